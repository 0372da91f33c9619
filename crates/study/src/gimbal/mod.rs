//! The segment on a gimbal, for studies.

mod crank;
mod models;
mod page;
mod switches;
mod touch;

use hpu_cosim::scene::{GimbalScene, Scene};
use hpu_cosim::{Simulation, Trace};

use crate::Error;
use crate::accuracy::Contestant;
use crate::device::{Device, ToldLimits, ToldTables};
use crate::fit::Simplifications;
use crate::map::SwitchWatch;
use crate::widths::Reach;
use crate::widths::search::Loops;
use crate::{accuracy, fit, map, widths};
use hpu_prove::arms::gimbal_proof;
use hpu_prove::criteria::touch::{Criteria, NAMES};
use hpu_prove::ranges::Proof;

pub use crank::{CrankSize, crank_sizes};
pub use switches::Switches;
pub use touch::TouchLimits;

impl accuracy::Device for GimbalScene {
    /// The radius, by its column in a trace.
    fn motion<'t>(&self, trace: &'t Trace) -> &'t [f64] {
        trace.real(hpu_cosim::RADIUS)
    }

    fn contestants(&self) -> Vec<Contestant> {
        models::contestants(self)
    }
}

impl fit::Device for GimbalScene {
    fn around(&self) -> Vec<(&'static str, f64)> {
        models::around(self)
    }

    fn simplifications(&self) -> Simplifications {
        models::simplifications(self)
    }
}

impl map::Device for GimbalScene {
    fn predicts(&self) -> bool {
        true
    }

    fn predictions(&self) -> Result<Vec<(&'static str, bool)>, Error> {
        Ok(NAMES.into_iter().zip(Criteria::of(self)?.fails()).collect())
    }

    fn switches(&self, simulation: &dyn Simulation) -> Option<Box<dyn SwitchWatch>> {
        Some(Box::new(Switches::of(self, simulation)))
    }
}

impl widths::Device for GimbalScene {
    /// Each servo passes through all its positions.
    fn reaches(&self) -> Result<Vec<Reach>, Error> {
        let half = libm::exp2(f64::from(self.method.config.gimbal.count_width - 1)) - 1.0;
        Ok((0..3).map(|_| Reach { counts: [-half, half], most_per_s: f64::INFINITY }).collect())
    }

    fn no_fields(&self) -> &'static str {
        "no key of a gimbal's scene chooses a width"
    }
}

impl widths::search::Device for GimbalScene {
    fn loops(&self) -> Result<&'static dyn Loops, Error> {
        Err("a search varies keys of widths, of which a gimbal's scene has none; hpu widths without --search proves \
             and measures its words"
            .into())
    }
}

impl Device for GimbalScene {
    fn priced(&self) -> Result<(), Error> {
        Err("Yosys takes minutes for the loop of a gimbal".into())
    }

    fn limited(&self) -> Result<&Scene, Error> {
        Err("the limits of stiffness are those of an axis; a gimbal's are the criteria of its touch".into())
    }

    fn told_limits(&self, scene: &str) -> Option<ToldLimits> {
        let page = TouchLimits::of(self).map(|found| page::page(scene, &self.name, &found));
        Some(ToldLimits { of: "a gimbal", page })
    }

    fn bounds(&self) -> Result<Proof, Error> {
        Ok(gimbal_proof(self)?)
    }

    fn gappa(&self) -> Result<String, Error> {
        Err("a gimbal's kinematics are a CORDIC, which takes many edges, and no straight-line code".into())
    }

    fn tables(&self) -> Result<ToldTables, Error> {
        let config = &self.method.config.gimbal;
        let sizes = crank_sizes(&self.gimbal, config)?;
        Ok(crank::told(config, &sizes))
    }
}
