#![doc = include_str!("../README.md")]

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
            torque_table: TorqueTable, TableConfig;
            position_pid: PositionPid, PositionPidConfig;
        }
    };
}

mod arithmetic;
mod base;
mod catalogue;
mod circuit;
mod loops;
mod methods;
mod pins;
mod trig;
mod velocity;

mod distinct;
pub mod foc;
pub mod gimbal;
pub mod paddle;
pub mod phantom;

pub use arithmetic::biquad::{Biquad, BiquadConfig};
pub use arithmetic::command_limiter::CommandLimiter;
pub use arithmetic::cordic::{Cordic, CordicBound, CordicConfig};
pub use arithmetic::input_shaper::{InputShaper, InputShaperConfig, Shaping};
pub use arithmetic::pid::{Pid, PidConfig};
pub use arithmetic::saturator::Saturator;
pub use arithmetic::sequential_divider::{DividerConfig, SequentialDivider};
pub use arithmetic::square_root::SquareRoot;
pub use arithmetic::torque_sum::TorqueSum;
pub use arithmetic::truncating_multiplier::TruncatingMultiplier;
pub use arithmetic::unilateral::Unilateral;
pub use arithmetic::zero_order_hold::ZeroOrderHold;
pub use arithmetic::{
    biquad, command_limiter, cordic, input_shaper, pid, saturator, sequential_divider, square_root, torque_sum,
    truncating_multiplier, unilateral, zero_order_hold,
};
use base::block::step;
pub use base::block::step::{ClockEdge, Combinational, Holds, Lemma, Register, Step};
pub use base::block::{AnyBlock, Block, Connection, Generic, Instance, Parts, ROUNDING, Rom, bundle, flatten};
pub use base::config::ConfigError;
pub use base::law::{Law, LawIn, LawOut, LawWidths};
pub use base::wiring::{AnyWiring, AxisWiring, Loaded, LoopIn, LoopOut, Repeat, Wiring};
pub use catalogue::{block_by_name, block_names, configured, registry, variants, variants_of};
pub use circuit::circuit_loop::{AxisCircuit, CircuitLoop, LoopCircuit};
pub use distinct::proved_variants_of;
pub use gimbal::fractional_difference::{FractionalConfig, FractionalDifference};
pub use gimbal::sample_timer::SampleTimer;
pub use gimbal::{fractional_difference, sample_timer};
pub use loops::axis_front::AxisFront;
pub use loops::conventional_loop::ConventionalLoop;
pub use loops::haptic_loop::{HapticLoop, haptic_wiring};
pub use loops::hybrid_loop::HybridLoop;
pub use loops::loop_config::LoopConfig;
pub use loops::{axis_front, conventional_loop, hybrid_loop};
pub use methods::method_loop::{MethodLoop, MethodLoopConfig};
pub use methods::{
    braking_pulse, energy_bounding, method_loop, passive_spring, passivity_controller, position_pid, sampled_wall,
    torque_table, virtual_coupling,
};
pub use pins::displacement::Displacement;
pub use pins::position_counter::PositionCounter;
pub use pins::pwm::{Pwm, PwmConfig};
pub use pins::quadrature_decoder::QuadratureDecoder;
pub use pins::synchronizer::Synchronizer;
pub use pins::{displacement, position_counter, pwm, quadrature_decoder, synchronizer};
pub use velocity::butterworth_difference::{ButterworthConfig, ButterworthDifference};
pub use velocity::edge_timer::EdgeTimer;
pub use velocity::estimator::Estimator;
pub use velocity::filtered_difference::{FilteredConfig, FilteredDifference};
pub use velocity::foaw::{Foaw, FoawConfig};
pub use velocity::levant_differentiator::{LevantConfig, LevantDifferentiator};
pub use velocity::velocity_register::{VelocityConfig, VelocityRegister};
pub use velocity::window_difference::WindowDifference;
pub use velocity::{
    butterworth_difference, edge_timer, filtered_difference, foaw, levant_differentiator, velocity_register,
    window_difference,
};

macro_rules! exported {
    ($($module:ident: $Law:ident, $Config:ident;)*) => {
        $(pub use $module::{$Law, $Config};)*
    };
}
laws!(exported);
