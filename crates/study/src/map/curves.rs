//! What published criteria draw over a map: the greatest stiffness that they allow, along the other axis.

use hpu_cosim::scene::{Experiment, Scene};

use super::{Axis, Map, Point};
use crate::criteria;

/// The key over which the criteria have a limit.
pub const KEY: &str = "wall.stiffness";

/// The curves of a method.
#[derive(Clone, PartialEq, Debug)]
pub struct Curves {
    /// Whether it is the columns that are stiffnesses, and the rows that the limits are functions of.
    pub over_x: bool,
    /// A curve for each criterion.
    pub curves: Vec<Curve>,
}

/// A criterion's limit.
#[derive(Clone, PartialEq, Debug)]
pub struct Curve {
    /// The criterion's name.
    pub name: &'static str,
    /// What it assumes, and what it is good for.
    pub assumptions: &'static str,
    /// At how many points these are met.
    pub met: usize,
    /// The limit at each cell of the other axis, in the unit of the axis of stiffness; `None` where there is none.
    pub limits: Vec<Option<f64>>,
}

impl Curves {
    /// The curves of a method of a map.
    ///
    /// # Errors
    ///
    /// In words, why none can be drawn.
    pub fn new(map: &Map, method: usize) -> Result<Self, String> {
        let over_x = map.x.key() == KEY;
        if !over_x && map.y.key() != KEY {
            return Err(format!("the criteria have a limit of {KEY}, which is no axis"));
        }
        let (stiffness, other) = if over_x { (&map.x, &map.y) } else { (&map.y, &map.x) };
        let mut curves: Vec<Curve> = Vec::new();
        let mut refused = None;
        for cell in 0..other.cells() {
            let found = scene(map, method, over_x, cell).and_then(|(scene, asked)| {
                let start = scene.wall.stiffness_nm_per_rad;
                let criteria = criteria::all(&scene, start).map_err(|none| none.to_string())?;
                Ok((criteria, asked / start))
            });
            match found {
                Err(why) => refused = Some(why),
                Ok((criteria, scale)) => {
                    for criterion in criteria {
                        let curve = of(&mut curves, criterion.name, criterion.assumptions, other);
                        curve.limits[cell] = Some(criterion.limit * scale);
                        curve.met += usize::from(criterion.assumptions_met);
                    }
                }
            }
        }
        match refused {
            Some(why) if curves.is_empty() => Err(why),
            _ => Ok(Self { over_x, curves }).map(|curves| curves.within(stiffness)),
        }
    }

    /// Without what no axis can show.
    fn within(mut self, stiffness: &Axis) -> Self {
        for limit in self.curves.iter_mut().flat_map(|curve| &mut curve.limits) {
            *limit = limit.filter(|limit| stiffness.position(*limit).is_finite());
        }
        self
    }
}

/// The scene along the other axis, with some stiffness above zero, and that stiffness in the axis's unit.
fn scene(map: &Map, method: usize, over_x: bool, cell: usize) -> Result<(Scene, f64), String> {
    let stiffness = if over_x { &map.x } else { &map.y };
    let mut why = "no cell has a stiffness above zero".to_string();
    // A cell that asks too much of the words may have a neighbour that does not.
    for at in 1..stiffness.cells() {
        let (ix, iy) = if over_x { (at, cell) } else { (cell, at) };
        match map.experiment(Point { method, ix, iy }) {
            Ok(Experiment::Axis(scene)) if scene.wall.stiffness_nm_per_rad > 0.0 => {
                return Ok((scene, stiffness.values()[at]));
            }
            Ok(Experiment::Axis(_)) => {}
            Ok(Experiment::Phantom(_)) => return Err("the criteria speak of an axis, not of a PHANToM".into()),
            Err(error) => why = error.to_string(),
        }
    }
    Err(why)
}

fn of<'a>(curves: &'a mut Vec<Curve>, name: &'static str, assumptions: &'static str, other: &Axis) -> &'a mut Curve {
    let at = curves.iter().position(|curve| curve.name == name).unwrap_or_else(|| {
        curves.push(Curve { name, assumptions, met: 0, limits: vec![None; other.cells()] });
        curves.len() - 1
    });
    &mut curves[at]
}
