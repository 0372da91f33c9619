//! The configurations in which the arm's blocks and wirings are tested.

use hpu_signal::Format;

use super::{Config, Formats, Turn};

/// Returns configurations of the path: another geometry, the paper's words, words so short that they wrap or are
/// widened instead of rounded, and words whose products lose no bit or one bit.
pub(crate) fn paths() -> [(&'static str, Config); 6] {
    let narrow = Formats {
        trig: format(true, 1, 14),
        length_frac: 12,
        position: format(true, 0, 14),
        stiffness: format(false, 8, 0),
        force: format(true, 4, 8),
        torque: format(true, 1, 10),
    };
    let widening = Formats {
        trig: format(true, 1, 4),
        length_frac: 2,
        position: format(true, 3, 12),
        stiffness: format(false, 6, 2),
        force: format(true, 6, 18),
        torque: format(true, 8, 24),
    };
    // A radius keeps all fraction bits of its products; a force and the torques of joints 2 and 3 drop one.
    let aligned = Formats {
        trig: format(true, 1, 6),
        length_frac: 6,
        position: format(true, 2, 12),
        stiffness: format(false, 6, 2),
        force: format(true, 5, 13),
        torque: format(true, 6, 18),
    };
    // Whole numbers of metres and newtons: a force, a torque and a command drop nothing.
    let whole = Formats {
        trig: format(true, 1, 4),
        length_frac: 0,
        position: format(true, 8, 0),
        stiffness: format(false, 8, 0),
        force: format(true, 12, 0),
        torque: format(true, 14, 0),
    };
    let small = Config { period_width: 6, delay: 2, ..Config::default() };
    let short = Config { formats: narrow, lengths: [573; 2], force_limit: 2176, command_width: 12, ..small };
    let wide = Config {
        formats: widening,
        lengths: [3, 5],
        force_limit: 1 << 20,
        gains: [3, 4, 7],
        gain_frac: 0,
        command_width: 8,
        delay: 0,
        ..small
    };
    // With this delay, an engine that did not wait would show something before its first start.
    let plain = Config { gains: [1, 2, 3], gain_frac: 0, command_width: 12, delay: 40, ..small };
    let aligned = Config { formats: aligned, lengths: [9, 11], force_limit: 60_000, ..plain };
    let whole = Config { formats: whole, lengths: [1, 3], force_limit: 2000, ..plain };
    [
        ("premium_1_5", Config::premium_1_5().shared()),
        ("plain_q22", Config::plain_q22().shared()),
        ("narrow", short),
        ("widening", wide),
        ("aligned", aligned),
        ("whole", whole),
    ]
}

/// Returns the configurations of the loops, each with its label in `variants`. In the shared loop, each is
/// [`shared`](Config::shared).
pub fn loop_variants() -> Vec<(&'static str, Config)> {
    [("default", Config::default())].into_iter().chain(loops()).collect()
}

/// Returns configurations of the loops: another geometry, the paper's words, words of more and more fraction bits on
/// tables that an HX8K holds, and a small loop.
pub(crate) fn loops() -> [(&'static str, Config); 7] {
    let narrow_trig = Formats { trig: format(true, 1, 22), ..Formats::default() };
    let joint = Turn { num: 1, den: 100 };
    let small = Config {
        position_width: 8,
        period_width: 6,
        depth_width: 5,
        turns: [Turn { num: 3, den: 200 }, joint, joint],
        ..Config::default()
    };
    let shallow = Config { depth_width: 9, ..Config::default() };
    [
        ("premium_1_5", Config::premium_1_5()),
        ("plain_q22", Config::plain_q22()),
        ("fraction_14", shallow.fraction(14)),
        ("fraction_18", shallow.fraction(18)),
        ("fraction_22", shallow.fraction(22)),
        ("narrow_trig", Config { formats: narrow_trig, depth_width: 9, ..Config::default() }),
        ("small", small),
    ]
}

fn format(signed: bool, int: i32, frac: i32) -> Format {
    Format::new(signed, int, frac).expect("a constant")
}
