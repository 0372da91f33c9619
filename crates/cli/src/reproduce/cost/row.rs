//! A row of the study of costs: a block or loop, its cost, and the proved errors of its words.

use std::borrow::Borrow;

use hpu_papers::phantom::formats::{STIFFNESS_MAX_N_PER_M, full_scales_nm};

use super::{Config, bounds, loop_variants};
use crate::cost::Priced;

/// A block or loop with its result.
pub struct CostRow {
    /// Its cost.
    pub priced: Priced,
    /// The proved errors, if it is a loop.
    pub proof: Option<Proof>,
}

impl Borrow<Priced> for CostRow {
    fn borrow(&self) -> &Priced {
        &self.priced
    }
}

/// The proved errors of a loop's words.
pub struct Proof {
    /// Width in bits of the counts that its tables hold.
    pub depth_width: u32,
    /// Greatest error of the tip in micrometres, over the loop's own tables.
    pub position_um: f64,
    /// Greatest error of the tip in micrometres, over tables of 13 bits, the published ones.
    pub position_13_um: f64,
    /// Greatest error of a torque, in per cent of the joint's full scale.
    pub torque_percent: f64,
    /// Error of the words of the lengths, in micrometres.
    pub length_um: f64,
}

impl Proof {
    /// Returns the proved errors of a loop in the configuration with that label.
    pub fn of(name: &str, label: &str) -> Option<Self> {
        let named = name.ends_with("_loop").then(loop_variants)?;
        let config = named.into_iter().find(|(of, _)| *of == label)?.1;
        let full = Config { depth_width: 13, ..config };
        let worst = |config: &Config, unit: &str, scale: &dyn Fn(&str) -> f64| {
            let rows = bounds(config, STIFFNESS_MAX_N_PER_M).ok()?;
            let own = rows.iter().filter(|row| row.unit == unit && row.name != "radius");
            Some(own.map(|row| scale(row.name) * row.error).fold(0.0, f64::max))
        };
        let scales_nm = full_scales_nm(&config);
        let share = |name: &str| {
            let joint = name.trim_start_matches("torque").parse::<usize>().map_or(0, |joint| joint - 1);
            100.0 / scales_nm[joint]
        };
        let nominal_m = [0.14, 0.14];
        let one = f64::from(1u32 << config.formats.length_frac);
        let off =
            config.lengths.iter().zip(nominal_m).map(|(word, length_m)| (f64::from(*word) / one - length_m).abs());
        Some(Self {
            depth_width: config.depth_width,
            position_um: worst(&config, "m", &|_| 1e6)?,
            position_13_um: worst(&full, "m", &|_| 1e6)?,
            torque_percent: worst(&full, "N.m", &share)?,
            length_um: 1e6 * off.fold(0.0, f64::max),
        })
    }
}
