//! The FPGA: one file a block, integers only, and the wirings that put blocks together as VHDL would.

mod block;
mod catalogue;
mod config;
mod countdown;
mod haptic_loop;
mod loop_config;
mod loop_nets;
mod torque_path;
mod variants;
mod wiring;

pub mod conventional_loop;
pub mod displacement;
pub mod hybrid_loop;
pub mod phantom;
pub mod position_counter;
pub mod pwm;
pub mod quadrature_decoder;
pub mod saturator;
pub mod synchronizer;
pub mod torque_sum;
pub mod truncating_multiplier;
pub mod unilateral;
pub mod velocity_register;
pub mod zero_order_hold;

pub use block::{AnyBlock, Block, Generic, bundle, flatten};
pub use catalogue::{block_by_name, registry};
pub use config::ConfigError;
pub use conventional_loop::ConventionalLoop;
pub use displacement::Displacement;
pub use haptic_loop::HapticLoop;
pub use hybrid_loop::HybridLoop;
pub use loop_config::LoopConfig;
pub use position_counter::PositionCounter;
pub use pwm::{Pwm, PwmConfig};
pub use quadrature_decoder::QuadratureDecoder;
pub use saturator::Saturator;
pub use synchronizer::Synchronizer;
pub use torque_sum::TorqueSum;
pub use truncating_multiplier::TruncatingMultiplier;
pub use unilateral::Unilateral;
pub use variants::variants;
pub use velocity_register::{VelocityConfig, VelocityRegister};
pub use wiring::{Connection, Instance, LoopIn, LoopOut, Wiring};
pub use zero_order_hold::ZeroOrderHold;
