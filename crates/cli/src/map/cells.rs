//! The cells of a map, as a sweep does them.

use std::num::NonZeroUsize;

use hpu_cosim::Control;
use hpu_farm::{Points, Schema, typed, untyped};
use hpu_page::Value;
use hpu_study::map::{self, Alike, Map, Plan, SceneText};

use super::Args;
use crate::shell::Failure;
use crate::work::{Find, Rows, Take, Work};

/// The cells of a map.
pub struct Cells {
    /// The command's arguments.
    pub args: Args,
    /// The map.
    pub map: Map,
}

impl Cells {
    /// Returns the cells of a map.
    pub fn new(args: Args, find: Find) -> Result<Self, Failure> {
        args.provide()?;
        let source = find(args.scene())?;
        let map = args.map((&source.scene.name, &source.scene.text), &mut |name: &str| source.load(name))?;
        Ok(Self { args, map })
    }
}

impl Work for Cells {
    fn schema(&self) -> Schema {
        map::schema(&self.map)
    }

    fn meanings(&self) -> Vec<(String, String)> {
        map::meanings(&self.map)
    }

    fn command(&self) -> String {
        self.args.command() + if self.args.full { " --full" } else { "" }
    }

    fn scenes(&self) -> Vec<(String, SceneText)> {
        vec![(self.args.scene().to_string(), self.map.scene.clone())]
    }

    fn place(&self, point: usize) -> Vec<Value> {
        map::place(&self.map, point)
    }

    fn count(&self) -> Option<u64> {
        Some(self.map.len() as u64)
    }

    fn is_adaptive(&self) -> bool {
        !self.args.full
    }

    fn next(&self, done: Rows, _control: &Control) -> Result<Points, Failure> {
        if self.args.full {
            return Ok(Points::all(self.map.len() as u64));
        }
        Ok(Points::of(self.map.next_wave(typed(done)).into_iter().map(|cell| cell as u64)))
    }

    fn run(&self, _done: Rows, points: &[usize], control: &Control, take: Take) -> Result<(), Failure> {
        let plan = Plan { full: self.args.full, limits: self.args.limits(), jobs: NonZeroUsize::MIN };
        self.map.run_cells(points, plan, control, &Alike::of(&self.map), |cell, row| take(cell, untyped(&row)))
    }
}
