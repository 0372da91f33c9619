//! The loop behind field-oriented control, for studies. Limits and widths know the loops of an H-bridge alone.

use hpu_cosim::scene::{BridgeModel, FocScene, Friction, Scene};

use crate::Error;
use crate::accuracy::Contestant;
use crate::device::Device;
use crate::fit::Simplifications;
use crate::{accuracy, fit, map, widths};

/// A part of the model that can be left out: its name as a contestant, what it is, its worth, and the key that leaves
/// it out.
type Part = (&'static str, &'static str, u32, (&'static str, &'static str));

/// Returns the parts that a scene's model has.
fn parts(scene: &FocScene) -> Vec<Part> {
    let rubs = scene.model.friction != Friction::None && scene.pmsm.coulomb_nm > 0.0;
    let has_loops = !scene.model.ideal;
    let is_ideal = has_loops && scene.method.position.is_none() && scene.method.enable_after_s == 0.0;
    let all = [
        (
            has_loops && scene.model.bridge == BridgeModel::Switching,
            ("averaged", "the bridge's switching", 6, ("model.bridge", "averaged")),
        ),
        (
            is_ideal && !scene.gives("model.bridge"),
            ("ideal currents", "the current loops", 8, ("model.currents", "ideal")),
        ),
        (rubs, ("frictionless", "Coulomb friction", 4, ("model.friction", "none"))),
    ];
    all.into_iter().filter(|(has, _)| *has).map(|(_, part)| part).collect()
}

impl accuracy::Device for FocScene {
    fn contestants(&self) -> Vec<Contestant> {
        parts(self).into_iter().map(|(name, _, _, set)| Contestant::new(name, &[set])).collect()
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
        for (_, what, worth, set) in parts(self) {
            list.add(what, worth, &[set], &[]);
        }
        list
    }
}

impl map::Device for FocScene {}
impl widths::Device for FocScene {
    fn no_fields(&self) -> &'static str {
        "widths are reviewed of loops on an H-bridge: there are none to choose here"
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
