//! The interface between the studies and the devices that they study.

use hpu_cosim::scene::{Scene, Setup};
use hpu_cosim::{LawConfig, Simulation, TheLoop, Trace};
use hpu_signal::Observe;

use crate::accuracy::Contestant;
use crate::fit::Simplifications;
use crate::page::Page;
use crate::widths::proof::Proof;
use crate::widths::search::Loops;
use crate::widths::{Asked, Field};

/// The reason why a study of widths does not take a design of the user's own.
pub(crate) const OF_YOURS: &str = "the words of a design of yours are its own";

/// The counts between which an encoder moves in random motion, and its greatest speed.
pub struct Reach {
    /// The least and the greatest count.
    pub counts: [f64; 2],
    /// The greatest speed, in counts a second.
    pub most_per_s: f64,
}

/// The switches of a control, as a map's cell has them.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Switching {
    /// Their number in the whole run.
    pub count: u64,
    /// The greatest leap of the drive at a switch, as a force in N at a tip that rests.
    pub bump_n: f64,
    /// Energy that the drive gave per switch in the judged window, in J; `None` without a switch there.
    pub switch_j: Option<f64>,
}

/// A `SwitchWatch` observes a run and counts the switches of its control. Implemented by the watch of each device whose
/// control switches; [`Device::switches`] returns it.
pub trait SwitchWatch: Observe {
    /// Returns the switches so far.
    fn switching(&self) -> Switching;
}

/// The limits of a device that criteria tell without a run.
pub struct ToldLimits {
    /// The device, as in `an arm`.
    pub of: &'static str,
    /// Their page, or why the criteria say nothing of the scene.
    pub page: Result<Page, String>,
}

/// The tables of a device in other sizes.
pub struct ToldTables {
    /// Their page, for text and JSON.
    pub page: Page,
    /// The same as CSV.
    pub csv: String,
}

/// A `Device` answers the questions of every study about the device of a scene, so that no study asks which device it
/// is. Implemented by the scene of each kind of device, each in a module of its own; [`device`](crate::device) returns
/// it. What has a default is refused or left out for a device that has no answer of its own.
pub trait Device: Setup {
    /// Returns the widths that a review and a recommendation go through; none where nothing is computed in words.
    fn fields(&self) -> Vec<Field> {
        Vec::new()
    }

    /// Returns why there are no [`fields`](Self::fields), where there are none.
    fn no_fields(&self) -> &'static str {
        "a host computes its force: there are no widths to choose"
    }

    /// Checks that the scene's law is computed in words; else returns why it is not.
    fn in_words(&self) -> Result<(), String> {
        Ok(())
    }

    /// Returns the values that the scene asks for, by the nets whose words hold them.
    fn asked(&self) -> Vec<(&'static str, Asked)> {
        Vec::new()
    }

    /// Returns the reference law in floats that runs beside the words, with the latency of the words in clock edges;
    /// `None` if the method has none.
    fn law(&self, _wiring: &TheLoop) -> Option<(LawConfig, u64)> {
        None
    }

    /// Returns how far and how fast each encoder can move, in the order of their pins. Fails where no device moves.
    fn reaches(&self) -> Result<Vec<Reach>, String> {
        Err("a design of yours has words of its own".into())
    }

    /// Returns the motion of a trace by which models are compared.
    fn motion<'t>(&self, trace: &'t Trace) -> &'t [f64] {
        trace.angles_rad()
    }

    /// Returns the neighbouring scenes in which a model is also judged, each as a key and its value in SI units: the
    /// wall 5 % softer and stiffer, and a few counts nearer and farther; other parts by 5 % where there is no wall.
    fn around(&self) -> Vec<(&'static str, f64)> {
        Vec::new()
    }

    /// Returns what a cheaper model of the scene may leave out.
    fn simplifications(&self) -> Simplifications {
        Simplifications::default()
    }

    /// Returns the models of the scene that differ from the scene as written.
    fn contestants(&self) -> Vec<Contestant> {
        Vec::new()
    }

    /// Returns the loops that a search of widths varies, or why there are none.
    fn loops(&self) -> Result<&'static dyn Loops, String> {
        Err(OF_YOURS.into())
    }

    /// Proves the bounds of the scene's signals; else returns why nothing can be proved.
    fn bounds(&self) -> Result<Proof, String> {
        Err(format!("{OF_YOURS}; write a scene with a [method]"))
    }

    /// Returns the straight-line parts of the proof as a script of Gappa, or why there are none.
    fn gappa(&self) -> Result<String, String> {
        Err(format!("{OF_YOURS}; write a scene with a [method]"))
    }

    /// Returns why the loops of the device are not synthesised one by one, if they are not.
    fn priced(&self) -> Result<(), String> {
        Ok(())
    }

    /// Returns the scene whose limits of stiffness are found analytically, or why there are none.
    fn limited(&self) -> Result<&Scene, String>;

    /// Returns the limits that criteria tell without a run, if these are the device's limits. `scene` is the scene with
    /// its overrides as the command line has them.
    fn told_limits(&self, _scene: &str) -> Option<ToldLimits> {
        None
    }

    /// Returns whether criteria speak of a touch of the device, whatever the values of its keys; if not,
    /// [`predictions`](Self::predictions) has none.
    fn predicts(&self) -> bool {
        false
    }

    /// Returns of each criterion its name and whether it predicts, without a run, that a touch fails.
    fn predictions(&self) -> Result<Vec<(&'static str, bool)>, String> {
        Err("no criterion speaks of a touch of this device".into())
    }

    /// Returns what watches the switches of the control in a run of this simulation of the scene.
    fn switches(&self, _simulation: &dyn Simulation) -> Option<Box<dyn SwitchWatch>> {
        None
    }

    /// Returns the lookup tables of the scene's datapath in other sizes, or why it has none.
    fn tables(&self) -> Result<ToldTables, String> {
        Err(format!("{OF_YOURS}; write a scene with a [method]"))
    }
}
