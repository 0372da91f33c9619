//! How much of an arm's workspace the tables of sines hold.

use std::f64::consts::TAU;
use std::fmt::Write;
use std::ops::RangeInclusive;

use hpu_plant::arm::kinematics;

use super::Config;

/// The nominal workspace of a Premium 1.0, in mm: width (x), height (y), depth (z). General knowledge of the device.
pub const NOMINAL_MM: [f64; 3] = [254.0, 178.0, 127.0];
/// Number of cells along each side of the workspace: about 2 mm each.
pub const CELLS: [u32; 3] = [127, 89, 64];
/// Widths of the counts that the tables hold, in bits.
pub(crate) const DEPTHS: RangeInclusive<u32> = 11..=15;

/// The cells of the nominal workspace, classified by the counts that they need.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Workspace {
    /// Number of all cells.
    pub cells: u64,
    /// Number of cells that the links do not reach.
    pub unreachable: u64,
    /// For each width of 11 to 15 bits, the number of cells whose counts the tables hold.
    pub held: Vec<(u32, u64)>,
    /// For each joint, the number of cells that the configuration's own tables do not hold because of this joint, alone
    /// or with others.
    pub missed_by: [u64; 3],
    /// Width of the counts that the configuration's own tables hold, in bits.
    pub depth_width: u32,
}

impl Workspace {
    /// Returns the nominal workspace of the default configuration.
    pub fn nominal() -> Self {
        Self::new(&Config::default(), NOMINAL_MM, CELLS)
    }

    /// Computes the inverse kinematics at the middle of each cell of a box of this size about the neutral tip.
    pub fn new(config: &Config, size_mm: [f64; 3], cells: [u32; 3]) -> Self {
        let lengths_m = config.lengths.map(|word| f64::from(word) / f64::from(1u32 << config.formats.length_frac));
        let middle_m =
            |axis: usize, cell: u32| 1e-3 * size_mm[axis] * ((f64::from(cell) + 0.5) / f64::from(cells[axis]) - 0.5);
        let all: u64 = cells.map(u64::from).iter().product();
        let held = DEPTHS.map(|width| (width, 0)).collect();
        let mut found = Self { cells: all, unreachable: 0, held, missed_by: [0; 3], depth_width: config.depth_width };
        for x in 0..cells[0] {
            for y in 0..cells[1] {
                for z in 0..cells[2] {
                    let tip_m = [middle_m(0, x), middle_m(1, y), middle_m(2, z)];
                    match kinematics::angles_rad(lengths_m, tip_m) {
                        Some(angles_rad) => found.note(config, angles_rad),
                        None => found.unreachable += 1,
                    }
                }
            }
        }
        found
    }

    fn note(&mut self, config: &Config, angles_rad: [f64; 3]) {
        let counts = [0, 1, 2].map(|joint: usize| {
            let turn = config.turns[joint];
            libm::round(angles_rad[joint] / TAU * f64::from(turn.den) / f64::from(turn.num)) as i64
        });
        let inside = |count: i64, width: u32| (-(1i64 << (width - 1))..1 << (width - 1)).contains(&count);
        for (width, held) in &mut self.held {
            *held += u64::from(counts.iter().all(|&count| inside(count, *width)));
        }
        for (missed, count) in self.missed_by.iter_mut().zip(counts) {
            *missed += u64::from(!inside(count, self.depth_width));
        }
    }

    /// Returns a number of cells as a percentage of all cells.
    fn percent(&self, cells: u64) -> f64 {
        100.0 * cells as f64 / self.cells as f64
    }

    /// Returns the share of all cells that tables of a width hold, in percent.
    pub fn held_percent(&self, depth_width: u32) -> Option<f64> {
        self.held.iter().find(|(width, _)| *width == depth_width).map(|(_, held)| self.percent(*held))
    }

    /// Returns as text the share of each width, and what keeps the other cells out.
    pub fn text(&self) -> String {
        let [wide, high, deep] = NOMINAL_MM;
        let reached = self.cells - self.unreachable;
        let mut text = format!(
            "Workspace of the Premium 1.0: a box of {deep} x {high} x {wide} mm (deep x high x wide, nominal, general \
             knowledge), centred at the tip of the neutral pose.\nCounted: {} cells of about 2 mm, by the inverse \
             kinematics of their middles (elbow up); a cell is held when the counts of all three joints are in their \
             tables.\nJoint limits do not count. {} cells ({:.1} %) are beyond the links.\n",
            self.cells,
            self.unreachable,
            self.percent(self.unreachable)
        );
        let _ = writeln!(
            text,
            "{:>10}{:>14}{:>14}{:>20}",
            "depth bits", "cells held", "% of the box", "% of the reachable"
        );
        for (width, held) in &self.held {
            let share = 100.0 * *held as f64 / reached.max(1) as f64;
            let _ = writeln!(text, "{width:>10}{held:>14}{:>14.1}{share:>20.1}", self.percent(*held));
        }
        let [first, second, third] = self.missed_by.map(|missed| self.percent(missed));
        let _ = writeln!(
            text,
            "At {} bits joint 1 keeps {first:.1} % of the box out, joint 2 {second:.1} %, joint 3 {third:.1} % (some \
             of it together).\nThe paper tells of about 90 % of the workspace, and not how it was counted.",
            self.depth_width
        );
        text
    }

    /// Returns the shares as CSV.
    pub fn csv(&self) -> String {
        let mut text = "depth_bits,cells,unreachable_cells,held_cells,held_percent\n".to_string();
        for (width, held) in &self.held {
            let _ = writeln!(text, "{width},{},{},{held},{:.3}", self.cells, self.unreachable, self.percent(*held));
        }
        text
    }
}
