//! The interface between the studies and the devices that they study.

use hpu_cosim::scene::{Scene, Setup};

use crate::Error;
use crate::widths::search::OF_YOURS;
use crate::{accuracy, fit, map, widths};
use hpu_page::Page;
use hpu_prove::ranges::Proof;

/// The limits of a device that criteria tell without a run.
pub struct ToldLimits {
    /// The device, as in `an arm`.
    pub of: &'static str,
    /// Their page, or why the criteria say nothing of the scene.
    pub page: Result<Page, Error>,
}

/// The tables of a device in other sizes.
pub struct ToldTables {
    /// Their page, for text and JSON.
    pub page: Page,
    /// The same as CSV.
    pub csv: String,
}

/// A `Device` answers the questions of every study about the device of a scene, so that no study asks which device it
/// is. Each study asks a trait of its own; here is what commands ask beside them. Implemented by the scene of each kind
/// of device, each in a module of its own; [`device`](crate::device) returns it. What has a default is refused or left
/// out for a device that has no answer of its own.
pub trait Device:
    Setup + accuracy::Device + fit::Device + map::Device + widths::Device + widths::search::Device
{
    /// Proves the bounds of the scene's signals; else returns why nothing can be proved.
    fn bounds(&self) -> Result<Proof, Error> {
        Err(Error::new(format_args!("{OF_YOURS}; write a scene with a [method]")))
    }

    /// Returns the straight-line parts of the proof as a script of Gappa, or why there are none.
    fn gappa(&self) -> Result<String, Error> {
        Err(Error::new(format_args!("{OF_YOURS}; write a scene with a [method]")))
    }

    /// Returns why the loops of the device are not synthesised one by one, if they are not.
    fn priced(&self) -> Result<(), Error> {
        Ok(())
    }

    /// Returns the scene whose limits of stiffness are found analytically, or why there are none.
    fn limited(&self) -> Result<&Scene, Error>;

    /// Returns the limits that criteria tell without a run, if these are the device's limits. `scene` is the scene with
    /// its overrides as the command line has them.
    fn told_limits(&self, _scene: &str) -> Option<ToldLimits> {
        None
    }

    /// Returns the lookup tables of the scene's datapath in other sizes, or why it has none.
    fn tables(&self) -> Result<ToldTables, Error> {
        Err(Error::new(format_args!("{OF_YOURS}; write a scene with a [method]")))
    }
}
