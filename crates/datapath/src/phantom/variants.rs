//! The PHANToM's blocks and wirings, and the configurations in which they are checked.

use hpu_signal::Format;

use super::{
    CommandRegister, CommandScaler, CubeRoom, PhantomConfig, PhantomEngine, PhantomFormats, PhantomForward, PhantomIo,
    PhantomLoop, PhantomSharedLoop, PhantomTorque, Phase, SampleRegister, TrigCordic, TrigInterpolated, TrigQuarter,
    TrigTable, Turn,
};
use crate::{AnyBlock, ConfigError};

/// Returns every block and wiring in its default configuration.
pub(crate) fn registry() -> Vec<Box<dyn AnyBlock>> {
    vec![
        Box::new(TrigTable::default()),
        Box::new(TrigQuarter::default()),
        Box::new(TrigInterpolated::default()),
        Box::new(TrigCordic::default()),
        Box::new(SampleRegister::default()),
        Box::new(PhantomForward::default()),
        Box::new(CubeRoom::default()),
        Box::new(PhantomTorque::default()),
        Box::new(CommandScaler::default()),
        Box::new(CommandRegister::default()),
        Box::new(PhantomEngine::default()),
        Box::new(PhantomLoop::default()),
        Box::new(PhantomSharedLoop::default()),
        Box::new(PhantomIo::default()),
    ]
}

type Variants = Vec<(&'static str, Box<dyn AnyBlock>)>;

/// Returns the other configurations.
pub(crate) fn others() -> Result<Variants, ConfigError> {
    let mut all: Variants = vec![
        ("8_bit", Box::new(SampleRegister::new(8, 6)?)),
        ("8_bit", Box::new(CommandRegister::new(8, 6, 3)?)),
        ("8_bit", Box::new(PhantomIo::new(8, 8)?)),
        ("delay_0", Box::new(CommandRegister::new(10, 4, 0)?)),
    ];
    all.extend(sines()?);
    // A position drops one bit of its products here.
    let one_bit = PhantomFormats {
        trig: format(true, 1, 14),
        length_frac: 12,
        position: format(true, 0, 25),
        ..PhantomFormats::default()
    };
    all.push(("one_bit", Box::new(PhantomForward::new(&one_bit, [573; 2])?)));
    for (label, config) in paths() {
        let PhantomConfig { formats, lengths, gains, gain_frac, command_width, .. } = config;
        all.push((label, Box::new(PhantomForward::new(&formats, lengths)?)));
        all.push((label, Box::new(CubeRoom::new(&formats, config.force_limit)?)));
        all.push((label, Box::new(PhantomTorque::new(&formats, lengths)?)));
        all.push((label, Box::new(CommandScaler::new(formats.torque, gains[0], gain_frac, command_width)?)));
        all.push((label, Box::new(PhantomEngine::new(config)?)));
    }
    for (label, config) in loops() {
        all.push((label, Box::new(PhantomLoop::new(config)?)));
        all.push((label, Box::new(PhantomSharedLoop::new(config.shared())?)));
    }
    // The Premium 1.5 differs from the default in geometry, which does not affect the room.
    all.retain(|(label, block)| *label != "premium_1_5" || block.name() != "cube_room");
    Ok(all)
}

/// Returns configurations of the path: another geometry, the paper's words, words so short that they wrap or are
/// widened instead of rounded, and words whose products lose no bit or one bit.
fn paths() -> [(&'static str, PhantomConfig); 6] {
    let narrow = PhantomFormats {
        trig: format(true, 1, 14),
        length_frac: 12,
        position: format(true, 0, 14),
        stiffness: format(false, 8, 0),
        force: format(true, 4, 8),
        torque: format(true, 1, 10),
    };
    let widening = PhantomFormats {
        trig: format(true, 1, 4),
        length_frac: 2,
        position: format(true, 3, 12),
        stiffness: format(false, 6, 2),
        force: format(true, 6, 18),
        torque: format(true, 8, 24),
    };
    // A radius keeps all fraction bits of its products; a force and the torques of joints 2 and 3 drop one.
    let aligned = PhantomFormats {
        trig: format(true, 1, 6),
        length_frac: 6,
        position: format(true, 2, 12),
        stiffness: format(false, 6, 2),
        force: format(true, 5, 13),
        torque: format(true, 6, 18),
    };
    // Whole numbers of metres and newtons: a force, a torque and a command drop nothing.
    let whole = PhantomFormats {
        trig: format(true, 1, 4),
        length_frac: 0,
        position: format(true, 8, 0),
        stiffness: format(false, 8, 0),
        force: format(true, 12, 0),
        torque: format(true, 14, 0),
    };
    let small = PhantomConfig { period_width: 6, delay: 2, ..PhantomConfig::default() };
    let short = PhantomConfig { formats: narrow, lengths: [573; 2], force_limit: 2176, command_width: 12, ..small };
    let wide = PhantomConfig {
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
    let plain = PhantomConfig { gains: [1, 2, 3], gain_frac: 0, command_width: 12, delay: 40, ..small };
    let aligned = PhantomConfig { formats: aligned, lengths: [9, 11], force_limit: 60_000, ..plain };
    let whole = PhantomConfig { formats: whole, lengths: [1, 3], force_limit: 2000, ..plain };
    [
        ("premium_1_5", PhantomConfig::premium_1_5().shared()),
        ("plain_q22", PhantomConfig::plain_q22().shared()),
        ("narrow", short),
        ("widening", wide),
        ("aligned", aligned),
        ("whole", whole),
    ]
}

/// Returns the configurations of the loops, each with its label in `variants`. For `phantom_shared_loop`, each is
/// [`shared`](PhantomConfig::shared).
#[must_use]
pub fn loop_variants() -> Vec<(&'static str, PhantomConfig)> {
    [("default", PhantomConfig::default())].into_iter().chain(loops()).collect()
}

/// Returns configurations of the loops: another geometry, the paper's words, words of more and more fraction bits on
/// tables that an HX8K holds, and a small loop.
fn loops() -> [(&'static str, PhantomConfig); 7] {
    let narrow_trig = PhantomFormats { trig: format(true, 1, 22), ..PhantomFormats::default() };
    let joint = Turn { num: 1, den: 100 };
    let small = PhantomConfig {
        position_width: 8,
        period_width: 6,
        depth_width: 5,
        turns: [Turn { num: 3, den: 200 }, joint, joint],
        ..PhantomConfig::default()
    };
    let shallow = PhantomConfig { depth_width: 9, ..PhantomConfig::default() };
    [
        ("premium_1_5", PhantomConfig::premium_1_5()),
        ("plain_q22", PhantomConfig::plain_q22()),
        ("fraction_14", shallow.fraction(14)),
        ("fraction_18", shallow.fraction(18)),
        ("fraction_22", shallow.fraction(22)),
        ("narrow_trig", PhantomConfig { formats: narrow_trig, depth_width: 9, ..PhantomConfig::default() }),
        ("small", small),
    ]
}

fn sines() -> Result<Variants, ConfigError> {
    let [joint_1, joint_2, _] = PhantomConfig::default().turns;
    let [_, premium_1_5, _] = PhantomConfig::premium_1_5().turns;
    let (plain, narrow, fine) = (format(true, 9, 22), format(true, 1, 14), format(true, 1, 30));
    let (first, newer) = (Phase::default().of(joint_1), Phase::default().of(premium_1_5));
    let short = Phase { count_width: 10, width: 12, step: 5, trig: narrow };
    let long = Phase { width: 44, trig: fine, ..Phase::default() }.of(joint_2);
    let rotated = Phase { width: 31, step: 1_234_567, ..short };
    let unguarded = Phase { trig: format(true, 1, 24), ..first };
    Ok(vec![
        ("joint_1", Box::new(TrigTable::new(16, 13, joint_1, plain)?)),
        ("premium_1_5", Box::new(TrigTable::new(16, 13, premium_1_5, plain)?)),
        ("narrow", Box::new(TrigTable::new(8, 8, Turn { num: 1, den: 256 }, narrow)?)),
        ("several_turns", Box::new(TrigTable::new(10, 6, Turn { num: 5, den: 77 }, fine)?)),
        ("joint_1", Box::new(TrigQuarter::new(first, 11)?)),
        ("premium_1_5", Box::new(TrigQuarter::new(newer, 11)?)),
        ("narrow", Box::new(TrigQuarter::new(short, 9)?)),
        ("fine", Box::new(TrigQuarter::new(long, 10)?)),
        ("joint_1", Box::new(TrigInterpolated::new(first, 9, 14)?)),
        ("premium_1_5", Box::new(TrigInterpolated::new(newer, 9, 14)?)),
        ("narrow", Box::new(TrigInterpolated::new(short, 5, 5)?)),
        ("fine", Box::new(TrigInterpolated::new(long, 10, 20)?)),
        ("joint_1", Box::new(TrigCordic::new(first, 24, 4)?)),
        ("premium_1_5", Box::new(TrigCordic::new(newer, 24, 4)?)),
        ("narrow", Box::new(TrigCordic::new(rotated, 14, 3)?)),
        ("unguarded", Box::new(TrigCordic::new(unguarded, 28, 0)?)),
    ])
}

fn format(signed: bool, int: i32, frac: i32) -> Format {
    Format::new(signed, int, frac).expect("a constant")
}
