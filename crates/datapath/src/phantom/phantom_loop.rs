//! A three-joint haptic loop in parallel hardware: encoders, sample, sines, kinematics, a room of walls, torques,
//! commands.
//!
//! - **Ports**: `a_pin1` `b_pin1` `a_pin2` `b_pin2` `a_pin3` `b_pin3`, the walls `x_low` `x_high` `y_low` `y_high`
//!   `z_low` `z_high`, `room`, `stiffness`, `period` in; `command1` `command2` `command3` out.
//! - **Latency**: 4 edges from a pin to its position, up to `period` to its sample, and `DELAY` from there to the
//!   commands, which must be at least 2: sample, sines, and all the rest combinational.
//! - **Reset**: all registers 0. **Overflow**: of its blocks.
//! - **VHDL twin**: `hdl/phantom_loop.vhd`; the instances and nets have the names of [`Wiring`](crate::Wiring)'s.
//! - **Source**: Sevcik et al. 2009.
//! - **Differs from the hardware**: combinational paths settle within the clock they change in, whatever their length;
//!   DELAY is the time a real one would be given.

/// See the [module](self).
pub type PhantomLoop = super::phantom_wiring::PhantomWiring<false>;
