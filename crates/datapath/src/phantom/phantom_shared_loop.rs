//! A three-joint haptic loop whose kinematics, room, torques and commands share one multiplier.
//!
//! - **Ports**: those of `phantom_loop`.
//! - **Latency**: 4 edges from a pin to its position, up to `period` to its sample, `DELAY`, 2 or more, from there to
//!   the start of the engine, and 32 to the commands.
//! - **Reset**: all registers 0. **Overflow**: of the blocks that the engine replaces.
//! - **VHDL twin**: `hdl/phantom_shared_loop.vhd`; the instances and nets have the names of
//!   [`Wiring`](crate::Wiring)'s.
//! - **Source**: Sevcik et al. 2009, for a smaller FPGA.
//! - **Differs from the hardware**: the paper does not say how its logic is shared. The emulator models the ports of
//!   phantom_engine, not the registers within.

/// See the [module](self).
pub type PhantomSharedLoop = super::phantom_loop::PhantomWiring<true>;
