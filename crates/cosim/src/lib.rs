//! Joins datapath and plant: scenes, worlds, the engine, the energy audit and the verdict.

pub mod law;
pub mod replay;
pub mod scene;

mod actuator;
mod arm_body;
mod arm_world;
mod axis_world;
mod body;
mod direct;
mod encoder;
mod engine;
mod host;
mod law_loop;
mod linear;
mod method;
mod mover;
mod phantom_session;
mod plant;
mod random;
mod ready;
mod rig;
mod schedule;
mod session;
mod stepped;
mod summary;
mod trace;
mod verdict;
mod world;

pub use arm_world::{ARM_REALS, FpgaWorld, HostWorld};
pub use axis_world::AxisWorld;
pub use direct::Direct;
pub use engine::{ClosedLoop, Comparison, Control, Difference, Driver, compare};
pub use law_loop::{COMMAND_BITS, LawConfig, LawLoop};
pub use linear::LinearLoop;
pub use phantom_session::PhantomSession;
pub use plant::{Plant, PlantError};
pub use random::SplitMix64;
pub use ready::Ready;
pub use rig::{Rig, TheLoop, Visit};
pub use schedule::{Schedule, WordRamp};
pub use session::{Session, SessionError};
pub use summary::{Abort, EnergyAudit, NetUse, Summary, metric};
pub use trace::Trace;
pub use verdict::{PASSIVE_RMS_M, Verdict, judge, judge_drop};
pub use world::{Pins, World};
