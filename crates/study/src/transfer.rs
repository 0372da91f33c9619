//! A plant as a transfer function, for studies. It has no wall, whose stiffness most studies vary.

use hpu_cosim::scene::{Scene, TransferScene};

use crate::Error;
use crate::device::{Device, ToldTables};
use crate::widths::search::Loops;
use crate::{accuracy, fit, map, widths};

const NO_WALL: &str = "a plant as a transfer function has no wall; its coefficients are the scene's own";

impl accuracy::Device for TransferScene {}
impl fit::Device for TransferScene {}
impl map::Device for TransferScene {}
impl widths::Device for TransferScene {
    fn no_fields(&self) -> &'static str {
        "vary adc.bits, dac.bits, method.fraction and method.coefficient_fraction by hand, or with hpu map"
    }
}
impl widths::search::Device for TransferScene {
    fn loops(&self) -> Result<&'static dyn Loops, Error> {
        Err("a search varies the loops of a wall; of a plant as a transfer function, vary the bits with hpu map".into())
    }
}

impl Device for TransferScene {
    #[cfg(not(target_family = "wasm"))]
    fn bounds(&self) -> Result<hpu_prove::ranges::Proof, Error> {
        Err("words of a difference equation are not bounded without a run: an unstable one reaches every word".into())
    }

    fn gappa(&self) -> Result<String, Error> {
        Err(NO_WALL.into())
    }

    fn priced(&self) -> Result<(), Error> {
        Err("a difference equation has no VHDL; the block biquad has".into())
    }

    fn limited(&self) -> Result<&Scene, Error> {
        Err(NO_WALL.into())
    }

    fn tables(&self) -> Result<ToldTables, Error> {
        Err(NO_WALL.into())
    }
}
