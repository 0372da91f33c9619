//! Everything in which the searches of devices differ.

use hpu_cosim::Summary;
use hpu_cosim::scene::Experiment;

use super::climb::Climb;
use super::front::Cost;
use super::knob::{Depth, Design, Keys, Knob};
use crate::Error;
use crate::widths::Field;
use hpu_prove::ranges::ProvedRanges;

/// The place of a design on one scene.
pub struct Standing {
    /// The design that stands for all designs with the same runs, up to the format of the stiffness.
    pub design: Design,
    /// The scene's own wall, as a climb counts walls.
    pub own: i128,
    /// The climb to the stable stiffness, at its beginning.
    pub climb: Box<dyn Climb>,
    /// The numbers that determine all runs of the design on the scene.
    pub alike: Vec<i128>,
}

/// The loops of one device. The search asks this trait for everything in which devices differ. Each device implements
/// it in a file of its own and stands in the list of `device`.
///
/// A search counts walls by whole numbers. Their meaning is the device's own: words of the stiffness, rungs of a
/// ladder.
pub trait Loops: Sync {
    /// Returns the widths that a search may vary.
    fn keys(&self) -> &'static Keys;

    /// Returns the knobs of a scene when none is named.
    fn usual(&self, scene: &Experiment) -> Vec<Knob>;

    /// Returns the unit of stiffness.
    fn unit(&self, scene: &Experiment) -> &'static str;

    /// Checks that the widths of a scene's loop can be searched; else returns why not.
    fn searchable(&self, scene: &Experiment) -> Result<(), Error>;

    /// Returns why the loop of a scene is not searched over a knob of the device, if it is not.
    fn refuses(&self, _scene: &Experiment, _knob: &Knob) -> Option<String> {
        None
    }

    /// Returns why two scenes need different hardware at the same widths, if they do.
    fn difference(&self, first: &Experiment, other: &Experiment) -> Option<String>;

    /// Returns whether two scenes are known to differ at most in the stiffness of their walls.
    fn same_but_for_stiffness(&self, _one: &Experiment, _other: &Experiment) -> bool {
        false
    }

    /// Returns the scene with a design's widths, or why no scene can have them.
    fn scene(&self, design: &Design, base: &Experiment) -> Result<Experiment, Error>;

    /// Returns the cost of a scene's loop, or why there is no such loop.
    fn cost(&self, scene: &Experiment) -> Result<Cost, Error>;

    /// Returns the place of a design on a scene that has its widths, or why the scene has no words.
    fn standing(&self, design: Design, scene: &Experiment) -> Result<Standing, Error>;

    /// Returns the design and the wall that stand for all designs and walls with the same run.
    fn run(&self, design: Design, wall: i128) -> (Design, i128) {
        (design, wall)
    }

    /// Returns the scene of a run, or why no scene can have it.
    fn at(&self, base: &Experiment, design: &Design, wall: i128) -> Result<Experiment, Error>;

    /// Returns the fewest bits of each width that holds values (`Key::holds`) with which the run is proved to be the
    /// same; `i32::MAX` where no narrower word is. Fails when the run does not tell its ranges.
    fn needs(&self, base: &Experiment, run: &Summary) -> Result<Depth, Error>;

    /// Returns the design that errors are measured against: the widest one of the knobs, or one of so many bits. Fails
    /// when there is none.
    fn reference(&self, base: &Experiment, knobs: &[Knob], bits: Option<i32>) -> Result<Design, Error>;

    /// Returns the reason why a reference has no stable wall.
    fn never_stable(&self, reference: &Design) -> String;

    /// Returns the check of a scene with other widths: whether its words hold the ranges that are proved for every
    /// motion within this scene's limits. Fails where no limits are proved.
    fn limits<'s>(&self, _scene: &'s Experiment) -> Result<Limits<'s>, Error> {
        Err(Error::new(format_args!("of {} the page tells it", self.keys().device)))
    }
}

/// Checks the words of a scene against proved ranges.
pub type Limits<'s> = Box<dyn Fn(&Experiment) -> Result<ProvedRanges, Error> + 's>;

/// Returns the knob of a width from so many bits below a scene's own up to it, but from `least` on.
pub(crate) fn below(own: &Design, field: Field, bits: i32, least: i32) -> Option<Knob> {
    let to = own.get(field);
    own.knob(field, (to - bits).max(least).min(to - 1), to)
}

/// Returns the bits of the narrowest signed word that holds a range.
pub(crate) fn signed_bits((least, most): (i64, i64)) -> i32 {
    let bits = |value: i64| 65 - (value ^ (value >> 63)).leading_zeros().cast_signed();
    bits(least).max(bits(most))
}
