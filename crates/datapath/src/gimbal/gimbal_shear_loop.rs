//! The loop of the segment on a gimbal whose target `x` is a fractional derivative, so that the tip shears the skin.
//!
//! - **Ports**: those of `gimbal_loop`; `shear_gain` (0,SHEAR_WIDTH-SHEAR_FRAC,SHEAR_FRAC) is the gain of the
//!   derivative.
//! - **Latency**: as `gimbal_loop`, but for `x`. The kinematics start at the same sample as the derivative, and so read
//!   the derivative of the sample before: the tip follows `x` one sample period later.
//! - **Reset**: all registers 0. The first edge after it raises the sample strobe, the second samples.
//! - **Overflow**: of its blocks; the derivative saturates.
//! - **VHDL twin**: `hdl/gimbal_shear_loop.vhd`; the instances and nets have the names of [`Wiring`](crate::Wiring)'s.
//! - **Source**: Pediredla et al., the shear stress as a fractional derivative.
//! - **Differs from the hardware**: the paper makes its reference offline. Combinational paths settle within the clock
//!   they change in, whatever their length.

/// See the [module](self).
pub type GimbalShearLoop = super::gimbal_loop::GimbalWiring<true>;
