//! The FPGA: one file for each block, integers only, and the wirings that connect the blocks as the VHDL does.

/// Calls a macro with the list of laws: of each its module, its block, and the block's configuration.
macro_rules! laws {
    ($with:ident) => {
        $with! {
            sampled_wall: SampledWall, SampledWallConfig;
            virtual_coupling: VirtualCoupling, CouplingConfig;
            passivity_controller: PassivityController, PassivityConfig;
            energy_bounding: EnergyBounding, BoundingConfig;
            passive_spring: PassiveSpring, SpringConfig;
            braking_pulse: BrakingPulse, PulseConfig;
        }
    };
}

mod axis;
mod block;
mod catalogue;
mod circuit;
mod circuit_loop;
mod computation;
mod config;
mod countdown;
mod estimator;
mod haptic_loop;
mod history;
mod law;
mod listed;
mod loop_config;
mod method_variants;
mod part;
mod sequence;
mod timed_velocity;
mod wiring;
mod words;

pub mod axis_front;
pub mod biquad;
pub mod braking_pulse;
pub mod command_limiter;
pub mod conventional_loop;
pub mod cordic;
pub mod displacement;
mod distinct;
pub mod edge_timer;
pub mod energy_bounding;
pub mod filtered_difference;
pub mod foaw;
pub mod fractional_difference;
pub mod gimbal;
pub mod hybrid_loop;
pub mod input_shaper;
pub mod levant_differentiator;
pub mod method_loop;
pub mod passive_spring;
pub mod passivity_controller;
pub mod phantom;
pub mod position_counter;
pub mod pwm;
pub mod quadrature_decoder;
pub mod sample_timer;
pub mod sampled_wall;
pub mod saturator;
pub mod sequential_divider;
pub mod square_root;
pub mod synchronizer;
pub mod torque_sum;
pub mod truncating_multiplier;
pub mod unilateral;
pub mod velocity_register;
pub mod virtual_coupling;
pub mod window_difference;
pub mod zero_order_hold;

pub use axis_front::AxisFront;
pub use biquad::{Biquad, BiquadConfig};
use block::step;
pub use block::step::{AnyStep, Combinational, Holds, Lemma, Register, Step};
pub use block::{AnyBlock, Block, Connection, Generic, Instance, Parts, Rom, bundle, flatten};
pub use catalogue::{block_by_name, block_names, configured, registry, variants, variants_of};
pub use circuit_loop::{AxisCircuit, CircuitLoop, LoopCircuit};
pub use command_limiter::CommandLimiter;
pub use config::ConfigError;
pub use conventional_loop::ConventionalLoop;
pub use cordic::{Cordic, CordicBound, CordicConfig};
pub use displacement::Displacement;
pub use distinct::proved_variants_of;
pub use edge_timer::EdgeTimer;
pub use estimator::Estimator;
pub use filtered_difference::{FilteredConfig, FilteredDifference};
pub use foaw::{Foaw, FoawConfig};
pub use fractional_difference::{FractionalConfig, FractionalDifference};
pub use haptic_loop::{HapticLoop, haptic_wiring};
pub use hybrid_loop::HybridLoop;
pub use input_shaper::{InputShaper, InputShaperConfig, Shaping};
pub use law::{Law, LawIn, LawOut, LawWidths};
pub use levant_differentiator::{LevantConfig, LevantDifferentiator};
pub use loop_config::LoopConfig;
pub use method_loop::{MethodLoop, MethodLoopConfig};
pub use position_counter::PositionCounter;
pub use pwm::{Pwm, PwmConfig};
pub use quadrature_decoder::QuadratureDecoder;
pub use sample_timer::SampleTimer;
pub use saturator::Saturator;
pub use sequential_divider::{DividerConfig, SequentialDivider};
pub use square_root::SquareRoot;
pub use synchronizer::Synchronizer;
pub use torque_sum::TorqueSum;
pub use truncating_multiplier::TruncatingMultiplier;
pub use unilateral::Unilateral;
pub use velocity_register::{VelocityConfig, VelocityRegister};
pub use window_difference::WindowDifference;
pub use wiring::{AnyWiring, AxisWiring, Loaded, LoopIn, LoopOut, Repeat, Wiring};
pub use zero_order_hold::ZeroOrderHold;

macro_rules! exported {
    ($($module:ident: $Law:ident, $Config:ident;)*) => {
        $(pub use $module::{$Law, $Config};)*
    };
}
laws!(exported);
