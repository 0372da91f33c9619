#![doc = include_str!("../README.md")]
// What such parts alone use stands there unused.
#![cfg_attr(
    target_family = "wasm",
    allow(
        dead_code,
        unused_imports,
        unused_variables,
        reason = "a page leaves out designs of one's own, three phases, the paddle, transfer functions, looking on"
    )
)]

mod any_simulation;
pub mod dut;
#[cfg(not(target_family = "wasm"))]
mod foc;
mod gimbal;
mod linear;
mod named_block;
#[cfg(not(target_family = "wasm"))]
mod paddle;
mod phantom;
mod result;
mod run;
#[cfg(not(target_family = "wasm"))]
mod transfer;
mod wired_simulation;
mod world;

pub use any_simulation::AnySimulation;
pub use dut::driven_world::{DrivenWorld, Halt, Logic};
#[cfg(not(target_family = "wasm"))]
pub use foc::FocSimulation;
pub use gimbal::{ERROR, FORCE, GIMBAL_REALS, GIMBAL_ROW, GimbalSimulation, RADIUS, STRESSES, stress_error_pa};
pub use linear::LinearLoop;
pub use named_block::{NamedBlockError, named_block};
#[cfg(not(target_family = "wasm"))]
pub use paddle::PaddleSimulation;
pub use phantom::PhantomSimulation;
pub use result::columns::{ARM_REALS, ARM_ROW, AXIS_ROW, RAIL_ROW, SIGNS, TORQUE_BETWEEN};
pub use result::contact::judged_window_s;
pub use result::felt::{Unseen, displayed_stiffness, product_wraps, unseen_contact};
pub use result::forever::{Beyond, Forever, InContact, Live, NotTold, Period, Quiet, Recurrence, Rest};
pub use result::outline::{Outline, Waves};
pub use result::stays::{DEEP_COUNTS, Stays, Sums};
pub use result::summary::{EnergyAudit, Frames, Mark, NetUse, Starts, Summary, Unheld, metric};
pub use result::trace::{ANGLE, Trace};
pub use result::verdict::{Abort, PASSIVE_RMS_M, Verdict, judge, judge_drop, unseen_growth_per_s};
pub use run::axis_simulation::AxisSimulation;
pub use run::closed::law_as_asked;
pub use run::engine::{ClosedLoop, Comparison, Control, Difference, Driver, compare};
pub use run::law_loop::{LawConfig, LawLoop};
pub use run::log_beside::{LogBeside, LogBesideError, LogHeld};
pub use run::look::look;
pub use run::simulation::{Direct, LoopVisitor, Simulation, TheLoop, Wired, follow};
pub use run::simulation_error::SimulationError;
pub use run::untyped::{AnyClosedLoop, AnyWorld};
#[cfg(not(target_family = "wasm"))]
pub use transfer::{Samples, TRANSFER_REALS, TransferSimulation};
pub use wired_simulation::WiredSimulation;
pub use world::axis_encoder::AxisEncoder;
pub use world::axis_world::AxisWorld;
pub use world::encoder::Pins;
pub use world::plant::{Plant, PlantError};
pub use world::{EncoderState, World};

pub use hpu_plant::{Pace, Standing};
pub use hpu_scene as scene;
pub use hpu_scene::{
    AxisLoop, COMMAND_BITS, Lines, NotPlain, PlainName, SceneFile, Schedule, SplitMix64, WordRamp, did_you_mean,
    excerpt, figure, law, method, number, printable, printable_json, read_plain, read_stdin, read_text, replay, script,
    utf8, with_axis_loop,
};
