//! Estimates the cost of the words of an arm's datapath, without tools.
//!
//! **Block RAM** is exact for the tables: [`table_rams`] of three joints.
//!
//! **Logic cells** are those of the parallel loop, which is mostly its multipliers. In a product of two words, each
//! pair of bits costs a full adder; in a product of a word and a constant, about every second pair does. One weight
//! converts pairs into cells. It is fitted to the cells that yosys and nextpnr count for the iCE40 HX8K: of three
//! blocks (kinematics, room and torques) and of three whole loops (words of 14 and 22 fraction
//! bits, and the default ones) in the record of `hpu reproduce`'s costs. The estimate is off by at most
//! [`ESTIMATE_ERROR`] there.
//!
//! The shared loop has one multiplier, which is as wide as its constants at any width of the words. The shared loops
//! that were synthesised vary sines, lengths and positions together, so they show nothing about each of them. So the
//! shared loop has no estimate, and only widths that change block RAM are varied.

use hpu_datapath::ConfigError;

use super::Config;
use super::tables::table_rams;

/// Logic cells for a pair of bits.
const CELLS: f64 = 3.75;

/// The largest relative error of the estimate on the counts that it is fitted to.
pub const ESTIMATE_ERROR: f64 = 0.07;

/// Returns the block RAMs of the iCE40 for the tables of three joints.
///
/// # Errors
///
/// When the size is not allowed for a table.
pub fn rams(config: &Config) -> Result<u64, ConfigError> {
    let Config { position_width, depth_width, turns, formats, .. } = *config;
    turns.iter().try_fold(0, |sum, &turn| Ok(sum + table_rams(position_width, depth_width, turn, formats.trig)?))
}

/// Returns the estimated logic cells of the parallel loop's kinematics, room and torques, and of its three scalers
/// together.
pub fn cells(config: &Config) -> [u32; 4] {
    let formats = &config.formats;
    // A sine is at most 1: it needs a sign, an integer bit and the fraction, however many bits its format has.
    let trig = formats.trig.frac().unsigned_abs() + 2;
    let [tip, spring, force, torque] =
        [formats.position, formats.stiffness, formats.force, formats.torque].map(|format| format.width());
    let [upper, fore] = config.lengths.map(|word| 32 - word.leading_zeros());
    let gains: u32 = config.gains.iter().map(|gain| 32 - gain.leading_zeros()).sum();
    let beam = force + 1;
    let forward = (2 * trig * tip, 2 * trig * (upper + fore));
    let room = (3 * spring * (tip + 1), 0);
    let jacobian = (2 * trig * force + 2 * trig * (force + beam) + 2 * (tip + 1) * force, beam * (upper + fore));
    let scale = (0, torque * gains);
    [forward, room, jacobian, scale]
        .map(|(words, constant)| (CELLS * (f64::from(words) + f64::from(constant) / 2.0)).round() as u32)
}

#[cfg(test)]
mod tests {
    use super::{Config, ESTIMATE_ERROR, cells, rams};

    fn holds(estimated: u32, counted: u32) {
        let off = f64::from(estimated) / f64::from(counted) - 1.0;
        assert!(off.abs() <= ESTIMATE_ERROR, "{estimated} instead of {counted}: {off:+.3}");
    }

    #[test]
    fn the_estimate_is_as_near_as_it_says_to_every_counted_block_and_loop() {
        let [forward, room, torque, _] = cells(&Config::default());
        // From the column `cells` of the record of costs in testbench/record.
        for (estimated, counted) in [(forward, 8532), (room, 5142), (torque, 18630)] {
            holds(estimated, counted);
        }
        let own = Config::default();
        for (config, counted) in [(own.fraction(14), 18983), (own.fraction(22), 30885), (own, 35291)] {
            holds(cells(&config).iter().sum(), counted);
        }
    }

    #[test]
    fn block_ram_is_what_the_counted_loops_have() {
        let shallow = Config { depth_width: 9, ..Config::default() };
        // From the column `bram` of the record of costs in testbench/record.
        for (config, counted) in
            [(shallow.fraction(14), 12), (shallow.fraction(18), 18), (shallow.fraction(22), 18), (shallow.narrow(), 18)]
        {
            assert_eq!(rams(&config).expect("a table"), counted, "{config:?}");
        }
        assert_eq!(rams(&Config::default()).expect("a table"), 330);
    }
}
