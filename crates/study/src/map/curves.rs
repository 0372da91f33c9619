//! The curves of published criteria over a map: the greatest stiffness that each allows, along the other axis. Only
//! criteria that apply to the method's kind of loop have a curve.

use std::sync::atomic::Ordering;

use hpu_cosim::Control;
use hpu_cosim::scene::{Experiment, Scene};

use super::{Axis, CellIndex, Map};
use crate::Error;
use hpu_prove::criteria::{self, Criterion};
use serde::Serialize;

/// The key that the criteria limit.
pub const KEY: &str = "wall.stiffness";

/// The curves of a method.
#[derive(Clone, PartialEq, Debug)]
pub struct Curves {
    /// Whether the columns are stiffnesses, so that the limits are functions of the row.
    pub over_x: bool,
    /// A curve for each criterion.
    pub curves: Vec<Curve>,
}

/// The limit of a criterion along the other axis.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Curve {
    /// Name of the criterion.
    pub name: &'static str,
    /// Assumptions of the criterion.
    pub assumptions: String,
    /// Number of points at which the assumptions are met.
    #[serde(rename = "assumptions_met_at")]
    pub met: usize,
    /// The limit at each cell of the other axis, in the unit of the axis of stiffness; `None` where there is none.
    pub limits: Vec<Option<f64>>,
}

impl Curves {
    /// Returns the curves of a method of a map. They are not complete when `control` stopped it.
    ///
    /// # Errors
    ///
    /// Returns as text why there are none.
    pub fn new(map: &Map, method: usize, control: &Control) -> Result<Self, Error> {
        let over_x = map.x.key() == KEY;
        if !over_x && map.y.key() != KEY {
            return Err(format!("the criteria have a limit of {KEY}, which is no axis").into());
        }
        let (stiffness, other) = if over_x { (&map.x, &map.y) } else { (&map.y, &map.x) };
        let mut curves: Vec<Curve> = Vec::new();
        let mut refused = None;
        for cell in (0..other.cells()).take_while(|_| !control.stop.load(Ordering::Relaxed)) {
            match scene(map, method, over_x, cell) {
                Err(why) => refused = Some(why),
                Ok((scene, asked)) => {
                    let start = scene.wall.stiffness_nm_per_rad;
                    for criterion in criteria::all(&scene) {
                        match criterion {
                            Err(silent) => refused = Some(silent.why.into()),
                            Ok(criterion) if criterion.speaks => {
                                let curve = of(&mut curves, &criterion, other);
                                curve.limits[cell] = Some(criterion.limit * asked / start);
                                curve.met += usize::from(criterion.assumptions_met());
                            }
                            Ok(_) => {}
                        }
                    }
                }
            }
        }
        match refused {
            Some(why) if curves.is_empty() => Err(why),
            _ => Ok(Self { over_x, curves }).map(|curves| curves.within(stiffness)),
        }
    }

    /// Returns the curves without the limits that the axis cannot show.
    fn within(mut self, stiffness: &Axis) -> Self {
        for limit in self.curves.iter_mut().flat_map(|curve| &mut curve.limits) {
            *limit = limit.filter(|limit| stiffness.position(*limit).is_finite());
        }
        self
    }
}

/// Returns the scene at a cell of the other axis, with some stiffness above zero, and this stiffness in the axis's
/// unit.
fn scene(map: &Map, method: usize, over_x: bool, cell: usize) -> Result<(Scene, f64), Error> {
    let stiffness = if over_x { &map.x } else { &map.y };
    let mut why = Error::from("no cell has a stiffness above zero");
    // If the scene's words cannot hold a cell's values, a neighbouring cell may still be possible.
    for at in 1..stiffness.cells() {
        let (ix, iy) = if over_x { (at, cell) } else { (cell, at) };
        match map.experiment(CellIndex { method, ix, iy }) {
            Ok(Experiment::Axis(scene)) if scene.wall.stiffness_nm_per_rad > 0.0 => {
                return Ok((scene, stiffness.values()[at]));
            }
            Ok(Experiment::Axis(_)) => {}
            Ok(Experiment::Dut(_)) => return Err("the criteria speak of known laws, not of a design of yours".into()),
            Ok(_) => return Err("the criteria speak of an axis, which this is not".into()),
            Err(error) => why = error.into(),
        }
    }
    Err(why)
}

fn of<'a>(curves: &'a mut Vec<Curve>, criterion: &Criterion, other: &Axis) -> &'a mut Curve {
    let at = curves.iter().position(|curve| curve.name == criterion.name).unwrap_or_else(|| {
        let texts: Vec<_> = criterion.assumptions.iter().map(|assumption| assumption.text).collect();
        let (assumptions, limits) = (texts.join("; "), vec![None; other.cells()]);
        curves.push(Curve { name: criterion.name, assumptions, met: 0, limits });
        curves.len() - 1
    });
    &mut curves[at]
}
