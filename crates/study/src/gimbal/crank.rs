//! The table of the crank: its rows and its words, and what fewer rows or other words would cost.
//!
//! The datapath reads the table at the position of the crank's servo, without interpolation. A table with every second
//! row is read without the lowest bit of the position, one with every fourth row without the lowest two, and so on.
//! Worst errors are *exhausted*: every position of the servo from one dead centre to the other. They are distances to
//! the device of the scene, whose lengths in metres the words round as well.
//!
//! A radius tells the crank's angle, but less and less of it towards the dead centres, where the radius does not change
//! with the angle. The error of the angle is therefore told apart for the ends of the travel.

use std::f64::consts::PI;

use hpu_datapath::gimbal::{CrankTable, GimbalConfig};
use hpu_datapath::{Block, ConfigError};
use hpu_plant::arm::Gimbal;
use hpu_signal::Format;

use crate::device::ToldTables;
use hpu_page::{Cell, Column, Page, Table};

/// The distances between rows beside that of the scene, in positions of the servo.
const MORE_STEPS: [u32; 5] = [2, 4, 8, 16, 32];
/// The fraction bits of lengths, beside those of the scene.
const MORE_BITS: [i32; 6] = [-8, -6, -4, -2, 2, 4];
/// The share of the travel that is near a dead centre, at each end.
const NEAR: f64 = 0.01;
/// Blanks below the label of the text.
const BELOW: &str = "           ";
/// Bits of a block RAM of the iCE40.
const RAM_BITS: u64 = 4096;

/// The crank's table in one size, and its measured errors.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CrankSize {
    /// Positions of the servo from one row to the next.
    pub step: u32,
    /// Format of radius and slope.
    pub format: Format,
    /// Whether this is the table of the scene.
    pub is_chosen: bool,
    /// The number of rows.
    pub rows: u64,
    /// Bits of a row, of radius and slope together, that are not equal in all rows.
    pub row_bits: u32,
    /// Greatest error of the radius in m.
    pub radius_m: f64,
    /// Greatest error of the slope in m/rad.
    pub slope_m_per_rad: f64,
    /// Greatest error in rad of the crank's angle that the radius tells: away from the dead centres, and near them.
    pub crank_rad: [f64; 2],
}

impl CrankSize {
    /// Returns the greatest error of the radius in units of the last place.
    pub fn radius_lsb(&self) -> f64 {
        self.radius_m / self.format.lsb()
    }

    /// Returns the least number of block RAMs that have room for the bits.
    pub fn least_rams(&self) -> u64 {
        (self.rows * u64::from(self.row_bits)).div_ceil(RAM_BITS)
    }
}

/// Measures the crank's table of a device in other lengths and other words. `config` is the design's. Left out are
/// sizes that the block refuses.
///
/// # Errors
///
/// When the block refuses the design's own words.
pub fn crank_sizes(gimbal: &Gimbal, config: &GimbalConfig) -> Result<Vec<CrankSize>, ConfigError> {
    let (int, frac) = (config.length.int(), config.length.frac());
    let mut sizes = vec![measured(gimbal, config, 1, true)?];
    sizes.extend(MORE_STEPS.into_iter().flat_map(|step| measured(gimbal, config, step, false)));
    for more in MORE_BITS {
        let Ok(length) = Format::new(true, int, frac + more) else { continue };
        let lsbs = |length_m: f64| (length_m / length.lsb()).round() as u32;
        let (crank, rod, offset) = (lsbs(gimbal.crank_m), lsbs(gimbal.rod_m), lsbs(gimbal.offset_m));
        sizes.extend(measured(gimbal, &GimbalConfig { length, crank, rod, offset, ..*config }, 1, false));
    }
    Ok(sizes)
}

/// Measures a table with a row for each `step` positions of the servo.
fn measured(gimbal: &Gimbal, config: &GimbalConfig, step: u32, is_chosen: bool) -> Result<CrankSize, ConfigError> {
    let [num, den] = config.count;
    let table = CrankTable::new(GimbalConfig { count: [num * step, den], ..*config })?;
    let [radii, slopes] = &table.roms()[..] else { unreachable!("radius and slope") };
    let format = config.length;
    let [least_m, most_m] = gimbal.radii_m();
    let end_m = NEAR * (most_m - least_m);
    let (mut radius_m, mut slope_m_per_rad, mut crank_rad) = (0f64, 0f64, [0f64; 2]);
    for position in 0..=den / num {
        let row = (position / step) as usize;
        let angle_rad = PI * f64::from(position * num) / f64::from(den);
        let (read_m, true_m) = (format.to_f64(radii.words[row]), gimbal.radius_m(&angle_rad));
        radius_m = radius_m.max((read_m - true_m).abs());
        slope_m_per_rad = slope_m_per_rad.max((format.to_f64(slopes.words[row]) - gimbal.lever_m(&angle_rad)).abs());
        let told_rad = gimbal.crank_rad(read_m.clamp(least_m, most_m)).expect("within the reach");
        let worst_rad = &mut crank_rad[usize::from((true_m - least_m).min(most_m - true_m) < end_m)];
        *worst_rad = worst_rad.max((told_rad - angle_rad).abs());
    }
    let row_bits = [radii, slopes].map(|rom| varying(&rom.words)).iter().sum();
    let rows = radii.words.len() as u64;
    Ok(CrankSize { step, format, is_chosen, rows, row_bits, radius_m, slope_m_per_rad, crank_rad })
}

/// Returns the number of bits that are not equal in all words. Bits that repeat the sign of every word count once.
fn varying(words: &[i64]) -> u32 {
    let width = |word: &i64| i64::BITS + 1 - (word ^ (word >> (i64::BITS - 1))).leading_zeros();
    let width = words.iter().map(width).max().expect("a row");
    let (zeros, ones) = words.iter().fold((0, 0), |(zeros, ones), word| (zeros | !word, ones | word));
    (zeros & ones & ((1i64 << width) - 1)).count_ones()
}

/// Returns the page of the tables.
pub(super) fn told(config: &GimbalConfig, sizes: &[CrankSize]) -> ToldTables {
    let mut page = Page::default();
    let positions = u64::from(config.count[1] / config.count[0]) + 1;
    page.data("positions", positions).data("near_percent_of_travel", 100.0 * NEAR).data("how", "exhausted");
    page.note(format!(
        "tables     of the crank, a row for each position of its servo, {} here (*), read without interpolation; \
         worst\n{BELOW}errors exhausted over all {positions} positions, against the device's lengths in metres",
        config.length
    ));
    let table = sizes_table(sizes);
    let csv = table.csv(&[] as &[&str]);
    page.table(table);
    page.note(format!(
        "{BELOW}crank: the angle that the radius tells. Within {} % of the travel from a dead centre (near), where \
         the\n{BELOW}radius hardly changes with the angle, it is off by about the root of the radius's error.\n\
         {BELOW}block RAM: at least, by the bits; hpu cost crank_table measures it",
        100.0 * NEAR
    ));
    ToldTables { page, csv }
}

fn sizes_table(sizes: &[CrankSize]) -> Table {
    let scaled = |value: f64, scale: f64, digits: usize| Cell::new(value).shown(format!("{:.digits$}", value * scale));
    let fields = [
        Column::integer("rows", "rows").of(|size: &CrankSize| {
            Cell::new(size.rows).shown(format!("{}{:>5}", if size.is_chosen { '*' } else { ' ' }, size.rows))
        }),
        Column::integer("positions_per_row", "positions a row").data().of(|size: &CrankSize| size.step),
        Column::flag("chosen", "chosen").data().of(|size: &CrankSize| size.is_chosen),
        Column::text("format", "format").of(|size: &CrankSize| size.format.to_string()),
        Column::integer("row_bits", "ROM words x bits")
            .of(|size: &CrankSize| Cell::new(size.row_bits).shown(format!("{} x {}", size.rows, size.row_bits))),
        Column::integer("least_block_rams", "block RAM").of(CrankSize::least_rams),
        Column::number("radius_m", "radius um").of(move |size: &CrankSize| scaled(size.radius_m, 1e6, 4)),
        Column::number("radius_lsb", "LSB").of(move |size: &CrankSize| scaled(size.radius_lsb(), 1.0, 3)),
        Column::number("slope_m_per_rad", "slope um/rad")
            .of(move |size: &CrankSize| scaled(size.slope_m_per_rad, 1e6, 4)),
        Column::number("crank_rad", "crank urad").of(move |size: &CrankSize| scaled(size.crank_rad[0], 1e6, 2)),
        Column::number("crank_near_rad", "near").of(move |size: &CrankSize| scaled(size.crank_rad[1], 1e6, 0)),
    ];
    Table::of("sizes", sizes, fields)
}
