//! Joins datapath and plant: scenes, worlds, the engine, the energy audit and the verdict.

pub mod replay;
pub mod scene;

mod axis_world;
mod engine;
mod linear;
mod plant;
mod rig;
mod session;
mod summary;
mod trace;
mod verdict;
mod world;

pub use axis_world::AxisWorld;
pub use engine::{ClosedLoop, Comparison, Control, Difference, Driver, compare};
pub use linear::LinearLoop;
pub use plant::{Plant, PlantError};
pub use rig::{Rig, TheLoop, Visit};
pub use session::{Session, SessionError};
pub use summary::{Abort, EnergyAudit, NetUse, Summary, metric};
pub use trace::Trace;
pub use verdict::{Verdict, judge};
pub use world::{Pins, World};
