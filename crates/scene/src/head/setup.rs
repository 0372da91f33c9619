//! The questions that every kind of scene answers about its device.

use crate::head::Units;
use crate::head::accuracy::Output;
use crate::head::miss::Miss;
use crate::head::model::Solver;
use crate::path::moves_until_s;

/// A `Setup` is a scene of one kind, asked without knowing the kind: summaries, maps and messages read it. Implemented
/// by the scene of each kind of device. [`Experiment::setup`](crate::Experiment::setup) returns it.
///
/// ```
/// let scene = hpu_scene::SceneFile::find("hybrid-wall")?.parse(&[])?;
/// assert_eq!(scene.setup().units().position, "rad");
/// assert!(scene.setup().wall_position() > 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Setup {
    /// Returns the solver of the device's motion.
    fn solver(&self) -> Solver;
    /// Returns the units in which the wall is written and the motion is told.
    fn units(&self) -> Units;
    /// Returns how many of these units one unit of the device's traced motion is: another number than 1 where a network
    /// has its wall at another body than its encoder.
    fn scale(&self) -> f64 {
        1.0
    }
    /// Returns the outputs by which models of the scene can be compared.
    fn outputs(&self) -> &'static [Output];
    /// Returns the position of the wall from which penetration is measured; 0 where nothing is measured from it.
    fn wall_position(&self) -> f64 {
        0.0
    }
    /// Returns the path of the hand, as times in s and positions in the unit of the motion; none where no hand follows
    /// a path.
    fn hand_path(&self) -> Vec<(f64, f64)> {
        Vec::new()
    }
    /// Returns the time from which on the hand stands still, and the target of a method that follows one; infinity if
    /// they never do.
    fn still_from_s(&self) -> f64 {
        moves_until_s(&self.hand_path())
    }
    /// Returns the relative error of the stiffness that the words realise; `None` without such words.
    fn stiffness_error(&self) -> Option<f64> {
        self.stiffness_miss().map(|miss| miss.error)
    }
    /// Returns the miss of the stiffness, if its word is far from it.
    fn stiffness_miss(&self) -> Option<Miss> {
        None
    }
    /// Returns the key that sets the format of the stiffness, if a scene can set it.
    fn stiffness_format(&self) -> Option<&'static str> {
        None
    }
}
