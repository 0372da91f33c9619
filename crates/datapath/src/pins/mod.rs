//! Blocks at the pins: encoders in, PWM out.

pub(crate) mod axis;
pub mod displacement;
pub mod position_counter;
pub mod pwm;
pub mod quadrature_decoder;
pub mod synchronizer;
