//! The devices of a search over widths, as its page and its files show them.

use hpu_chart::Picture;
use hpu_cosim::scene::Experiment;
use hpu_datapath::AnyBlock;

use super::shown::Shown;
use super::{Asked, Search, Searched};
use crate::shell::Failure;

/// A `Device` is everything in which the searches of devices differ for the command line. Each device implements it in
/// a file of its own; [`device`] returns it.
pub trait Device {
    /// Refuses options that a search of the device does not take.
    fn accepts(&self, _args: &Search, _asked: &Asked) -> Result<(), Failure> {
        Ok(())
    }
    /// Returns the columns and lines of the page.
    fn shown<'s>(&self, searched: &'s Searched) -> Shown<'s>;
    /// Returns the errors around the reference as CSV, and the pictures, if there are any.
    fn files(&self, _searched: &Searched) -> Option<(String, [Picture; 2])> {
        None
    }
    /// Returns the loop of a scene to synthesise.
    fn block(&self, _scene: Experiment) -> Result<Box<dyn AnyBlock>, Failure> {
        Err(Failure::file("it has no loop of these widths"))
    }
}
