//! The PHANToM: a three-joint arm, whose datapath reads sines from tables and finds forces in a room of walls.

mod cost;
mod fields;
mod models;
mod search;
pub mod sines;
pub mod tables;
pub mod workspace;

use hpu_cosim::Trace;
use hpu_cosim::scene::{
    Experiment, PhantomLaw as Law, PhantomModel as Model, PhantomScene as Scene, Scene as AxisScene,
};
use hpu_datapath::phantom::{self as datapath, Config};
use hpu_signal::Format;

use crate::Error;
use crate::accuracy::Contestant;
use crate::device::{Device, ToldTables};
use crate::fit::Simplifications;
use crate::widths::search::Loops;
use crate::widths::{Asked, Field, Reach};
use crate::{accuracy, fit, map, widths};
use hpu_prove::arms::{phantom_proof, script};
use hpu_prove::ranges::Proof;

pub use cost::{cells, rams};
pub(crate) use search::Arm as Loop;
pub use search::{proved, rung};

/// Name of the study that repeats the published table of stable stiffnesses, as `hpu reproduce` takes it.
pub const TABLE_2: &str = "phantom-table-2";
/// The device with its article.
const A_DEVICE: &str = "a PHANToM";

fn of_scene(scene: Scene) -> Experiment {
    Experiment::Phantom(scene)
}

fn arm(scene: &Experiment) -> Result<&Scene, Error> {
    match scene {
        Experiment::Phantom(scene) => Ok(scene),
        _ => Err(Error::new(format_args!("this is no scene of {A_DEVICE}"))),
    }
}

fn arm_mut(scene: &mut Experiment) -> Result<&mut Scene, Error> {
    match scene {
        Experiment::Phantom(scene) => Ok(scene),
        _ => Err(Error::new(format_args!("this is no scene of {A_DEVICE}"))),
    }
}

impl accuracy::Device for Scene {
    fn motion<'t>(&self, trace: &'t Trace) -> &'t [f64] {
        trace.real(self.drop.axis.index())
    }

    fn contestants(&self) -> Vec<Contestant> {
        models::contestants(self)
    }
}

impl fit::Device for Scene {
    fn around(&self) -> Vec<(&'static str, f64)> {
        models::around(self)
    }

    fn simplifications(&self) -> Simplifications {
        models::simplifications(self)
    }
}

impl map::Device for Scene {}

impl widths::Device for Scene {
    fn fields(&self) -> Vec<Field> {
        let in_words = !self.platform.is_host() && self.model.law == Law::Words;
        if in_words { fields::ALL.to_vec() } else { Vec::new() }
    }

    fn asked(&self) -> Vec<(&'static str, Asked)> {
        let (Ok(words), formats) = (self.words(), self.method.config.formats) else { return Vec::new() };
        let share = |asked: f64, word: i64, format: Format| match word {
            0 => Asked::Share(1.0),
            word => Asked::Share(asked / format.to_f64(word)),
        };
        let wall = share(self.room.distance_m, words.high, formats.position);
        let walls = ["x_low", "x_high", "y_low", "y_high", "z_low", "z_high"].map(|name| (name, wall));
        let stiffness = share(self.room.stiffness_n_per_m, words.stiffness, formats.stiffness);
        walls.into_iter().chain([("stiffness", stiffness)]).collect()
    }

    /// Each joint passes through all counts that its tables hold.
    fn reaches(&self) -> Result<Vec<Reach>, Error> {
        let half = libm::exp2(f64::from(self.method.config.depth_width - 1)) - 1.0;
        Ok((0..3).map(|_| Reach { counts: [-half, half], most_per_s: f64::INFINITY }).collect())
    }
}

impl widths::search::Device for Scene {
    fn loops(&self) -> Result<&'static dyn Loops, Error> {
        Ok(&Loop)
    }
}

impl Device for Scene {
    fn bounds(&self) -> Result<Proof, Error> {
        Ok(phantom_proof(self)?)
    }

    fn gappa(&self) -> Result<String, Error> {
        Ok(script(self)?)
    }

    fn priced(&self) -> Result<(), Error> {
        Err(Error::new(format_args!("Yosys takes minutes for each loop of {A_DEVICE}")))
    }

    fn limited(&self) -> Result<&AxisScene, Error> {
        Err(Error::new(format_args!(
            "limits are those of an axis; {A_DEVICE}'s are found by trials: hpu reproduce {}",
            TABLE_2
        )))
    }

    fn tables(&self) -> Result<ToldTables, Error> {
        Ok(tables::tables(&self.method.config)?.told())
    }
}
