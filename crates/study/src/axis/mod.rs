//! A device of one axis: a motor with a wheel, or a mass on a rail.

mod fields;
mod models;
mod search;

use hpu_cosim::scene::{Datapath, Device as Body, Experiment, Hand, Loop as Closed, Scene};
use hpu_cosim::{LawConfig, TheLoop, law_as_asked};
use hpu_signal::Format;

use crate::Error;
use crate::accuracy::Contestant;
use crate::device::{Device, ToldTables};
use crate::fit::Simplifications;
use crate::widths::search::Loops;
use crate::widths::{Asked, Field, Reach};
use crate::{accuracy, fit, map, widths};
use hpu_prove::ranges::{Proof, axis_bounds, exhausted, gappa};

pub(crate) use search::Axis as Loop;

/// The message about a scene of another device.
const OTHER: &str = "the search is over the widths of an axis's loop; this is a scene of another device";

fn axis(scene: &Experiment) -> Result<&Scene, Error> {
    if let Experiment::Axis(scene) = scene { Ok(scene) } else { Err(OTHER.into()) }
}

fn axis_mut(scene: &mut Experiment) -> Result<&mut Scene, Error> {
    if let Experiment::Axis(scene) = scene { Ok(scene) } else { Err(OTHER.into()) }
}

/// The most inputs of a block for which a review tries all of them.
const MOST_INPUTS: u128 = 1 << 24;

impl accuracy::Device for Scene {
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
        let law = matches!(self.method.kind, Closed::Law(_));
        let scaled = self.method.kind.scale().is_some() || self.method.reference_rate_hz.is_some();
        // A law's velocity is as wide as its position.
        let mut all = fields::ALL.to_vec();
        all.retain(|field| *field != Field::VELOCITY || !law);
        all.retain(|field| ![Field::SCALE_INT, Field::SCALE_FRAC].contains(field) || scaled);
        all
    }

    fn in_words(&self) -> Result<(), Error> {
        let name = match self.model.datapath {
            Datapath::Words => return Ok(()),
            Datapath::Law => "law",
            Datapath::Linear => "linear",
        };
        Err(Error::new(format_args!("model.datapath = \"{name}\" has no words; write \"words\"")))
    }

    fn asked(&self) -> Vec<(&'static str, Asked)> {
        let Ok(words) = self.words() else { return Vec::new() };
        let count_rad = words.realised.count_rad;
        let surface = (self.wall.position_rad / count_rad).round();
        let reference = Asked::Is(surface - (self.initial_angle_rad() / count_rad).floor());
        let gains = [
            ("stiffness", Asked::Share(1.0 / (1.0 + words.realised.stiffness_error))),
            ("damping", Asked::Share(1.0 / (1.0 + words.realised.damping_error))),
        ];
        // A target is what its word says.
        self.target.is_none().then_some(("reference", reference)).into_iter().chain(gains).collect()
    }

    fn law(&self, wiring: &TheLoop) -> Option<(LawConfig, u64)> {
        let (TheLoop::Axis(wiring), Closed::Law(_)) = (wiring, self.method.kind) else { return None };
        Some((law_as_asked(self).ok()?, wiring.latency()))
    }

    /// An axis moves as far from the wall, on either side, as its counter can tell, and no faster than its motor
    /// without load.
    fn reaches(&self) -> Result<Vec<Reach>, Error> {
        if matches!(self.hand, Hand::Capture { .. }) {
            return Err("a recording has no device that could move at random".into());
        }
        let words = self.words()?;
        let half = libm::exp2(f64::from(self.method.position_bits - 1)) - 1.0;
        let surface = Format::signed(self.method.position_bits).wrap(words.reference.into()) as f64;
        let most_per_s = match &self.device {
            // The current of a network's converter, not a voltage, ends its speed.
            Body::Motor(_) if self.network.as_ref().is_some_and(|network| network.dac.is_some()) => f64::INFINITY,
            Body::Motor(motor) => self.bridge.supply_v / motor.torque_constant_nm_per_a / words.realised.count_rad,
            Body::Mass(_) => f64::INFINITY,
        };
        Ok(vec![Reach { counts: [surface - half, surface + half], most_per_s }])
    }
}

impl widths::search::Device for Scene {
    fn loops(&self) -> Result<&'static dyn Loops, Error> {
        Ok(&Loop)
    }
}

impl Device for Scene {
    /// Where a block has few inputs, the result of trying all of them replaces the bound.
    fn bounds(&self) -> Result<Proof, Error> {
        let mut proof = axis_bounds(self)?;
        for tried in exhausted(self, &proof, MOST_INPUTS)? {
            if let Some(bound) = proof.bounds.iter_mut().find(|bound| bound.name == tried.name) {
                *bound = tried;
            }
        }
        Ok(proof)
    }

    fn gappa(&self) -> Result<String, Error> {
        Ok(gappa(self, &axis_bounds(self)?)?)
    }

    fn limited(&self) -> Result<&Scene, Error> {
        if self.target.is_some() {
            let how = "hpu map --x method.kp=A..B --y method.kd=C..D varies its gains";
            return Err(Error::new(format_args!("limits are those of a wall, and the method follows a target; {how}")));
        }
        Ok(self)
    }

    fn tables(&self) -> Result<ToldTables, Error> {
        Err("an axis has no tables; write the scene of a device with three joints".into())
    }
}
