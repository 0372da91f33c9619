//! The loop of EPFL's haptic paddle, for studies. It follows a target and has no wall, whose stiffness most studies
//! vary.

use hpu_cosim::scene::{BridgeModel, Friction, PaddleScene, Scene};

use crate::Error;
use crate::accuracy::Contestant;
use crate::device::Device;
use crate::fit::Simplifications;
use crate::{accuracy, fit, map, widths};

/// A part of the model that can be left out: its name as a contestant, what it is, its worth, and the key that leaves
/// it out.
type Part = (&'static str, &'static str, u32, (&'static str, &'static str));

/// Returns the parts that a scene's model has.
fn parts(scene: &PaddleScene) -> Vec<Part> {
    let rubs = scene.model.friction != Friction::None && scene.network.network.bodies.iter().any(|b| b.coulomb > 0.0);
    let all = [
        (
            scene.model.bridge == BridgeModel::Switching,
            ("averaged", "the bridge's switching", 6, ("model.bridge", "averaged")),
        ),
        (
            !scene.model.in_floats,
            ("float32", "the words of the datapath (rounding, latency)", 2, ("model.datapath", "float32")),
        ),
        (rubs, ("frictionless", "Coulomb friction", 4, ("model.friction", "none"))),
    ];
    all.into_iter().filter(|(has, _)| *has).map(|(_, part)| part).collect()
}

impl accuracy::Device for PaddleScene {
    fn contestants(&self) -> Vec<Contestant> {
        parts(self).into_iter().map(|(name, _, _, set)| Contestant::new(name, &[set])).collect()
    }
}

impl fit::Device for PaddleScene {
    /// The gains 5 % less and more.
    fn around(&self) -> Vec<(&'static str, f64)> {
        let [kp, _, kd] = self.method.gains;
        let gains = [("method.kp", kp), ("method.kd", kd)].into_iter().filter(|(_, gain)| *gain > 0.0);
        gains.flat_map(|(key, gain)| [0.95, 1.05].map(|share| (key, share * gain))).collect()
    }

    fn simplifications(&self) -> Simplifications {
        let mut list = Simplifications::default();
        for (_, what, worth, set) in parts(self) {
            list.add(what, worth, &[set], &[]);
        }
        list
    }
}

impl map::Device for PaddleScene {}
impl widths::Device for PaddleScene {
    fn no_fields(&self) -> &'static str {
        "the loop's formats are fixed: there are no widths to choose"
    }
}
impl widths::search::Device for PaddleScene {}

impl Device for PaddleScene {
    #[cfg(not(target_family = "wasm"))]
    fn bounds(&self) -> Result<hpu_prove::ranges::Proof, Error> {
        Ok(hpu_prove::arms::paddle_proof(self)?)
    }

    fn limited(&self) -> Result<&Scene, Error> {
        Err(Error::new(format_args!("{} follows a target and has no wall", self.name)))
    }
}
