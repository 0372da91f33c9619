//! The devices that studies know. A new device is a module with its [`Device`], and a line in each list here.

use std::str::FromStr;

use hpu_cosim::scene::{DutScene, Experiment, Language, Scene};
use hpu_cosim::{LawConfig, Simulation, TheLoop, Trace};

use crate::Error;
use crate::accuracy::Contestant;
use crate::device::Device;
use crate::fit::Simplifications;
use crate::map::SwitchWatch;
use crate::widths::search::knob::SYNTAX;
use crate::widths::search::{Knob, Loops};
use crate::widths::{Asked, Field, Reach};
use crate::{accuracy, axis, fit, map, phantom, widths};

/// A design of the user's own has no words that a study could know.
impl Device for DutScene {
    fn limited(&self) -> Result<&Scene, Error> {
        Err(Error::new(format_args!("{} has a design of yours", self.name)))
    }
}

/// The simulators of a design, which are to have the same words at every edge.
impl accuracy::Device for DutScene {
    fn contestants(&self) -> Vec<Contestant> {
        let is_vhdl = Language::of(&self.dut.files) == Language::Vhdl;
        let names = ["leap", "verilator"].into_iter().chain(is_vhdl.then_some("ghdl"));
        names.map(|name| Contestant::new(name, &[("dut.engine", name)])).collect()
    }
}
impl fit::Device for DutScene {}
impl map::Device for DutScene {}
impl widths::Device for DutScene {}
impl widths::search::Device for DutScene {}

/// Returns the device of a scene.
pub fn device(scene: &Experiment) -> &dyn Device {
    match scene {
        Experiment::Axis(scene) => scene,
        Experiment::Phantom(scene) => scene,
        Experiment::Gimbal(scene) => scene,
        #[cfg(not(target_family = "wasm"))]
        Experiment::Transfer(scene) => scene,
        Experiment::Paddle(scene) => scene,
        Experiment::Foc(scene) => scene,
        Experiment::Dut(scene) => scene,
    }
}

/// Answers the questions of a study about any scene through its device, so that the study knows no list of devices.
macro_rules! by_device {
    ($asks:path { $(fn $name:ident$(<$life:lifetime>)?(&self $(, $arg:ident: $kind:ty)?) -> $answer:ty;)* }) => {
        impl $asks for Experiment {
            $(fn $name$(<$life>)?(&self $(, $arg: $kind)?) -> $answer {
                device(self).$name($($arg)?)
            })*
        }
    };
}

by_device!(accuracy::Device {
    fn motion<'t>(&self, trace: &'t Trace) -> &'t [f64];
    fn contestants(&self) -> Vec<Contestant>;
});
by_device!(fit::Device {
    fn around(&self) -> Vec<(&'static str, f64)>;
    fn simplifications(&self) -> Simplifications;
});
by_device!(map::Device {
    fn predicts(&self) -> bool;
    fn predictions(&self) -> Result<Vec<(&'static str, bool)>, Error>;
    fn switches(&self, simulation: &dyn Simulation) -> Option<Box<dyn SwitchWatch>>;
});
by_device!(widths::Device {
    fn fields(&self) -> Vec<Field>;
    fn no_fields(&self) -> &'static str;
    fn in_words(&self) -> Result<(), Error>;
    fn asked(&self) -> Vec<(&'static str, Asked)>;
    fn law(&self, wiring: &TheLoop) -> Option<(LawConfig, u64)>;
    fn reaches(&self) -> Result<Vec<Reach>, Error>;
});
by_device!(widths::search::Device {
    fn loops(&self) -> Result<&'static dyn Loops, Error>;
});

/// The loops of all devices that a search of widths takes.
const LOOPS: [&dyn Loops; 2] = [&axis::Loop, &phantom::Loop];

impl FromStr for Knob {
    type Err = Error;

    /// Reads `KEY=FROM..TO`; both ends are values: `position_bits=8..16`.
    fn from_str(text: &str) -> Result<Self, Error> {
        let (name, range) = text.split_once('=').ok_or(SYNTAX)?;
        let name = name.trim();
        let bare = name.strip_prefix("method.").unwrap_or(name);
        let key = LOOPS.iter().flat_map(|loops| loops.keys().all).find(|key| key.name == bare).ok_or_else(|| {
            let [first, others @ ..] = LOOPS;
            let others =
                others.map(|loops| format!("; of {} one of {}", loops.keys().device, loops.keys().names())).concat();
            format!("{name} is no width that a search varies; write one of {}{others}", first.keys().names())
        })?;
        Self::read(*key, name, range)
    }
}
