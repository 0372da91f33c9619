//! The loop behind field-oriented control, for studies. Limits and widths know the loops of an H-bridge alone.

use hpu_cosim::scene::{BridgeModel, FocScene, Friction, Scene};

use crate::Error;
use crate::accuracy::Contestant;
use crate::device::Device;
use crate::fit::Simplifications;
use crate::{accuracy, fit, map, widths};

/// Keys that leave parts of the model out.
const AVERAGED: (&str, &str) = ("model.bridge", "averaged");
const FLOATS: (&str, &str) = ("model.datapath", "float64");
const IDEAL: (&str, &str) = ("model.currents", "ideal");
const FRICTIONLESS: (&str, &str) = ("model.friction", "none");
const RIGID: (&str, &str) = ("model.joints", "rigid");

/// Returns whether a scene's model has the switching of the bridge, current loops that can be left out, friction, and
/// joints that bend.
fn parts(scene: &FocScene) -> [bool; 4] {
    let has_loops = !scene.model.ideal && scene.method.enable_after_s == 0.0;
    let network = &scene.pmsm.around.network;
    let rubs = scene.model.friction != Friction::None && network.bodies.iter().any(|body| body.stiction > 0.0);
    let bends = scene.pmsm.around.bends().is_some();
    [scene.model.bridge == BridgeModel::Switching, has_loops, rubs, bends]
}

impl accuracy::Device for FocScene {
    fn contestants(&self) -> Vec<Contestant> {
        let [switches, has_loops, rubs, bends] = parts(self);
        let all = [
            (switches, Contestant::new("averaged", &[AVERAGED])),
            (has_loops, Contestant::new("ideal currents", &[AVERAGED, IDEAL])),
            (!self.model.in_floats, Contestant::new("floats", &[FLOATS])),
            (switches && !self.model.in_floats, Contestant::new("averaged floats", &[AVERAGED, FLOATS])),
            (rubs, Contestant::new("frictionless", &[FRICTIONLESS])),
            (bends, Contestant::new("rigid", &[RIGID])),
        ];
        all.into_iter().filter(|(has, _)| *has).map(|(_, contestant)| contestant).collect()
    }
}

impl fit::Device for FocScene {
    /// The wall, or else the bandwidth of the currents, 5 % less and more.
    fn around(&self) -> Vec<(&'static str, f64)> {
        let stiffness = self.wall.as_ref().map_or(0.0, |wall| wall.stiffness_nm_per_rad);
        let (key, value) = if stiffness > 0.0 {
            ("wall.stiffness", stiffness)
        } else {
            ("method.current_bandwidth", self.method.bandwidth_hz)
        };
        [0.95, 1.05].map(|share| (key, share * value)).into()
    }

    fn simplifications(&self) -> Simplifications {
        let mut list = Simplifications::default();
        let [switches, has_loops, rubs, bends] = parts(self);
        let averaged = switches.then(|| list.add("the bridge's switching", 6, &[AVERAGED], &[]));
        if has_loops {
            list.add("the current loops", 8, &[IDEAL], &[averaged]);
        }
        if !self.model.in_floats {
            list.add("the words of the logic (rounding, latency)", 2, &[FLOATS], &[]);
        }
        if rubs {
            list.add("Coulomb friction", 4, &[FRICTIONLESS], &[]);
        }
        if bends {
            list.add("the joints' compliance", 2, &[RIGID], &[]);
        }
        list
    }
}

impl map::Device for FocScene {}
impl widths::Device for FocScene {
    fn no_fields(&self) -> &'static str {
        "widths are varied of loops on an H-bridge alone: there are none to choose here"
    }
}
impl widths::search::Device for FocScene {}

impl Device for FocScene {
    #[cfg(not(target_family = "wasm"))]
    fn bounds(&self) -> Result<hpu_prove::ranges::Proof, Error> {
        Err(Error::new(format_args!("{}: no bounds are proved of a loop behind field-oriented control", self.name)))
    }

    fn gappa(&self) -> Result<String, Error> {
        Err(Error::new(format_args!("{}: no bounds are proved of a loop behind field-oriented control", self.name)))
    }

    fn limited(&self) -> Result<&Scene, Error> {
        let reason = "limits are found of a wall on an H-bridge, a mass or a network; hpu map runs this wall";
        Err(Error::new(format_args!("{}: {reason}", self.name)))
    }
}
