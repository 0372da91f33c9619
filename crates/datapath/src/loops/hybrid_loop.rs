//! The hybrid loop: the spring is continuous, the damping sampled.
//!
//! - **Equation**: `command = clamp(E (K * delta + B * velocity))`, Vasudevan et al. 2007, Eqs. (2) to (8): the
//!   spring's path is combinational from the position counter to the modulator's input, the velocity is sampled.
//! - **Ports**: `a_pin`, `b_pin` (0,1,0), `reference` (0,POSITION_WIDTH,0), `stiffness`, `damping`, `period` and
//!   `scale` in; the gates `a_high`, `a_low`, `b_high`, `b_low` out.
//! - **Latency**: pin to command 4 edges (synchronizer 2, decoder 1, counter 1) and `SETTLING`; then the modulator's.
//! - **Reset**: every register as its block says. **Overflow**: products saturate or wrap (`SATURATE`), the torque is
//!   limited.
//! - **VHDL twin**: `hdl/hybrid_loop.vhd`.
//! - **Source**: Vasudevan et al. 2007.
//! - **Differs from the hardware**: the paper's multiplier is asynchronous, without a clock anywhere in the path of the
//!   spring; here the encoder's path is clocked, so the spring is continuous to one clock. Combinational paths settle
//!   within the clock they change in, whatever their length; SETTLING says how much later they would.

use crate::loops::haptic_loop::HapticLoop;

/// The hybrid loop; the [module](self) describes it.
pub type HybridLoop = HapticLoop<false>;
