//! The legible cells of the printed Table 2.
//!
//! The text of the paper at hand has five rows of the table. At 250 and 500 N/m all cells of all axes have their "x".
//! At 750 N/m the cells of x and y have it. The cells of z are blank there, which is more likely lost than meant: the
//! body of the paper finds the all-FPGA platforms five times stiffer than PMOS-1 in z. At 30 000 and 40 000 N/m no cell
//! has an "x". The rows in between are lost, and so is the shading.

use hpu_cosim::scene::{Direction, Platform};

use super::table::Class;
use super::tables::{Share, Tables, Tally};

/// A row of the printed table; only the "x" can be read.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Published {
    /// Stiffness of the row, in N/m.
    pub stiffness_n_per_m: f64,
    /// Along each axis, whether all of its platforms have an "x" or none has; `None` where the print is lost.
    pub passive: [Option<bool>; 3],
}

/// The legible rows.
pub const PUBLISHED: [Published; 5] = [
    Published { stiffness_n_per_m: 250.0, passive: [Some(true); 3] },
    Published { stiffness_n_per_m: 500.0, passive: [Some(true); 3] },
    Published { stiffness_n_per_m: 750.0, passive: [Some(true), Some(true), None] },
    Published { stiffness_n_per_m: 30e3, passive: [Some(false); 3] },
    Published { stiffness_n_per_m: 40e3, passive: [Some(false); 3] },
];

impl Published {
    /// Whether the printed cell has its "x"; `None` if there is no such row or the cell is lost.
    pub fn passive(axis: Direction, stiffness_n_per_m: f64) -> Option<bool> {
        PUBLISHED.iter().find(|row| row.stiffness_n_per_m == stiffness_n_per_m)?.passive[axis.index()]
    }
}

/// How many of a table's cells are legible in print, and how many of these agree with the print.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Agreement {
    /// Number of cells that can be compared.
    pub legible: usize,
    /// Number of cells that agree at every seed at which they were run.
    pub same: usize,
    /// Number of cells that agree at some of these seeds.
    pub mixed: usize,
}

impl Agreement {
    /// Counts the cells of a table; a cell that failed never agrees.
    pub fn of(tables: &Tables) -> Self {
        let mut agreement = Self::default();
        let table = tables.first();
        for &axis in &table.axes {
            for &platform in &table.platforms {
                for &stiffness_n_per_m in &table.stiffnesses_n_per_m {
                    if let Some(same) = Self::at(tables, axis, platform, stiffness_n_per_m) {
                        agreement.legible += 1;
                        agreement.same += usize::from(same.all());
                        agreement.mixed += usize::from(same.so > 0 && !same.all());
                    }
                }
            }
        }
        agreement
    }

    /// Returns the number of cells that agree at no seed.
    pub const fn otherwise(&self) -> usize {
        self.legible - self.same - self.mixed
    }

    /// Returns at how many seeds a cell is as printed; `None` if the print or the table does not tell.
    pub fn at(tables: &Tables, axis: Direction, platform: Platform, stiffness_n_per_m: f64) -> Option<Share> {
        let printed = Published::passive(axis, stiffness_n_per_m)?;
        let Tally { classes } = tables.cell(axis, platform, stiffness_n_per_m)?;
        let same = |class: &&Class| **class != Class::Failed && (**class == Class::Passive) == printed;
        Some(Share { so: classes.iter().filter(same).count(), of: classes.len() })
    }
}
