//! Joins datapath and plant: scenes, worlds, the engine, the energy audit and the verdict.

pub mod law;
#[macro_use]
pub mod method;
pub mod scene;

mod actuator;
mod any_device;
mod any_simulation;
mod arm;
mod arm_body;
mod arm_loop;
mod arm_world;
mod axis_simulation;
mod axis_world;
mod closed;
mod columns;
mod contact;
mod controller;
mod direct;
pub mod dut;
mod encoder;
mod engine;
mod faults;
mod files;
mod gimbal;
mod integrator;
mod law_loop;
mod linear;
mod message;
mod outline;
mod parse;
mod phantom;
mod plant;
mod random;
mod scene_file;
mod schedule;
mod simulation;
mod simulation_error;
mod stepped;
mod summary;
mod trace;
mod untyped;
mod verdict;
mod window;
mod wired_simulation;
mod world;

pub use any_simulation::AnySimulation;
pub use arm_loop::ArmLoop;
pub use axis_simulation::AxisSimulation;
pub use axis_world::AxisWorld;
pub use closed::law_as_asked;
pub use columns::{
    ARM_REALS, ARM_ROW, AXIS_ROW, ERROR, FORCE, GIMBAL_REALS, GIMBAL_ROW, RADIUS, RAIL_ROW, SIGNS, STRESSES,
    TORQUE_BETWEEN,
};
pub use contact::judged_window_s;
pub use encoder::Pins;
pub use engine::{ClosedLoop, Comparison, Control, Difference, Driver, compare};
pub use faults::Mark;
pub use files::{read_plain, read_stdin, read_text};
pub use gimbal::{GimbalSimulation, SegmentLoop, stress_error_pa};
pub use law_loop::{LawConfig, LawLoop};
pub use linear::LinearLoop;
pub use message::{did_you_mean, excerpt, figure, number, utf8};
pub use method::AxisLoop;
pub use outline::Outline;
pub use phantom::PhantomSimulation;
pub use plant::{Plant, PlantError};
pub use random::SplitMix64;
pub use scene::{COMMAND_BITS, replay};
pub use scene_file::SceneFile;
pub use schedule::{Schedule, WordRamp};
pub use simulation::{Direct, LoopVisitor, Simulation, TheLoop, Wired, follow};
pub use simulation_error::SimulationError;
pub use summary::{EnergyAudit, NetUse, Summary, metric};
pub use trace::Trace;
pub use untyped::{AnyClosedLoop, AnyWorld};
pub use verdict::{Abort, PASSIVE_RMS_M, Verdict, judge, judge_drop, unseen_growth_per_s};
pub use wired_simulation::WiredSimulation;
pub use world::{EncoderState, World};

pub use hpu_plant::Pace;
