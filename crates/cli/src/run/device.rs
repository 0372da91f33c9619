//! The devices of a run, as its page, its files and its pictures show them.

use hpu_chart::Picture;
use hpu_cosim::scene::Units;
use hpu_cosim::{AnySimulation, AxisSimulation, EnergyAudit, Summary, Trace, WiredSimulation};
use hpu_page::Page;
use hpu_page::summary::Touch;
use hpu_signal::Signal;
use serde_json::Value;

use super::simulate::Ran;
use crate::units::si;

/// A `Shown` is a simulation that tells what only its device knows, for the page, the files and the pictures of its
/// run. Implemented by the simulation of each device in a file of its own; [`shown`] returns it.
pub trait Shown {
    /// Adds the lines of the device: its motion, and its words or the ports of a design.
    fn lines(&self, page: &mut Page, ran: &Ran);
    /// Returns the parameters as the scene's words realise them.
    fn realised(&self) -> Value;
    /// Returns the nets that are drawn, and written to the table.
    fn nets(&self) -> Vec<Signal>;
    /// Returns the pictures of a run.
    fn pictures(&self, trace: &Trace, summary: &Summary, command: &str) -> Vec<Picture>;

    /// Describes a design of the user's own: its simulator, and the connections of its ports.
    fn design(&self) -> Option<Value> {
        None
    }
    /// Returns the units in which a device of one axis is told, and how many of them one unit of its trace is.
    fn told_in(&self) -> Option<(Units, f64)> {
        None
    }
    /// Returns the position and the stiffness of an axis's wall, in the units of its trace. The stiffness is 0 where it
    /// is unknown.
    fn wall(&self) -> Option<(f64, f64)> {
        None
    }
    /// Returns the simulation of an axis whose words are known.
    fn axis(&self) -> Option<&AxisSimulation<'_>> {
        None
    }
    /// Tells where energy was dissipated.
    fn dissipated(&self, energy: &EnergyAudit) -> String {
        let [copper, diodes] = [energy.copper_j, energy.diodes_j].map(|joules| si(joules, "J"));
        let [viscous, coulomb] = [energy.viscous_j, energy.coulomb_j].map(|joules| si(joules, "J"));
        format!("copper {copper}, diodes {diodes}, viscous friction {viscous}, Coulomb friction {coulomb}")
    }
}

/// Returns the device of a simulation.
pub fn shown<'r>(simulation: &'r AnySimulation) -> &'r dyn Shown {
    match simulation {
        AnySimulation::Ours(WiredSimulation::Axis(simulation)) => simulation,
        AnySimulation::Ours(WiredSimulation::Phantom(simulation)) => simulation,
        AnySimulation::Ours(WiredSimulation::Gimbal(simulation)) => simulation,
        AnySimulation::Ours(WiredSimulation::Transfer(simulation)) => simulation,
        AnySimulation::Ours(WiredSimulation::Paddle(simulation)) => simulation,
        AnySimulation::Ours(WiredSimulation::Foc(simulation)) => simulation,
        AnySimulation::Dut(simulation) => simulation,
    }
}

/// Returns the contact of a run with the wall, as its summary tells it beside the verdict.
pub fn contact<'r>(ran: &'r Ran) -> Touch<'r> {
    let device = shown(ran.simulation);
    Touch {
        summary: &ran.summary,
        trace: &ran.trace,
        window_s: ran.window_s,
        wall: device.wall(),
        told_in: device.told_in(),
        axis: device.axis(),
    }
}

/// Adds the lines on the words, and a warning where the word of the stiffness misses it.
pub fn of_words(page: &mut Page, words: impl IntoIterator<Item = String>, missed: Option<String>) {
    words.into_iter().for_each(|said| _ = page.line("words", said));
    missed.into_iter().for_each(|said| _ = page.line("warning", said));
}

/// Returns those of all nets that have these names, in the order of the names.
pub fn named(all: Vec<Signal>, names: &[&str]) -> Vec<Signal> {
    names.iter().filter_map(|name| all.iter().find(|net| net.name == *name).cloned()).collect()
}
