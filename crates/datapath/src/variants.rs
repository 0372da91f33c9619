//! The configurations in which the blocks are checked.

use hpu_signal::{Format, Overflow};

use crate::{
    AnyBlock, ConfigError, ConventionalLoop, Displacement, HybridLoop, LoopConfig, PositionCounter, Pwm, PwmConfig,
    QuadratureDecoder, Saturator, TorqueSum, TruncatingMultiplier, Unilateral, VelocityConfig, VelocityRegister,
    ZeroOrderHold, phantom, registry,
};

/// Every block in the configurations over which vectors and VHDL are checked, each with the variant's label; `default`
/// for those of [`registry`]. A label is unique among the variants of its block.
///
/// # Panics
///
/// Never: the configurations are constants.
#[must_use]
pub fn variants() -> Vec<(String, Box<dyn AnyBlock>)> {
    let mut all: Vec<_> = registry().into_iter().map(|block| ("default".to_string(), block)).collect();
    all.extend(others().expect("constant configurations").into_iter().map(|(label, block)| (label.to_string(), block)));
    all
}

type Variants = Vec<(&'static str, Box<dyn AnyBlock>)>;

fn others() -> Result<Variants, ConfigError> {
    let mut all: Variants = vec![
        ("settle_0", Box::new(QuadratureDecoder::new(0)?)),
        ("8_bit", Box::new(PositionCounter::new(8)?)),
        ("32_bit", Box::new(PositionCounter::new(32)?)),
        ("8_bit", Box::new(Displacement::new(8)?)),
        ("32_bit", Box::new(Displacement::new(32)?)),
        ("8_bit", Box::new(Unilateral::new(8)?)),
        ("8_bit", Box::new(ZeroOrderHold::new(8, 6)?)),
        ("8_bit", Box::new(TorqueSum::new(8, 9, 10)?)),
        ("wrap", Box::new(TorqueSum::new(8, 9, 8)?)),
        ("8_bit", Box::new(Saturator::new(10, 9, 255)?)),
        ("limit_0", Box::new(Saturator::new(10, 9, 0)?)),
    ];
    all.extend(multipliers()?);
    let velocity = VelocityConfig { width: 8, period_width: 6, out_width: 8, ..VelocityConfig::default() };
    for (label, config) in [
        ("8_bit", velocity),
        ("narrow", VelocityConfig { out_width: 5, ..velocity }),
        ("wide", VelocityConfig { out_width: 16, ..velocity }),
        ("rescaled", VelocityConfig { rescaled: true, ..VelocityConfig::default() }),
        ("rescaled_8_bit", VelocityConfig { rescaled: true, scale: format(false, 4, 4), ..velocity }),
    ] {
        all.push((label, Box::new(VelocityRegister::new(config)?)));
    }
    for (label, pwm) in modulators() {
        all.push((label, Box::new(Pwm::new(pwm)?)));
    }
    for (label, config) in loops() {
        all.push((label, Box::new(HybridLoop::new(config)?)));
        all.push((label, Box::new(ConventionalLoop::new(config)?)));
    }
    all.extend(phantom::others()?);
    Ok(all)
}

fn multipliers() -> Result<Variants, ConfigError> {
    let (unsigned, signed) = (Format::unsigned(12), Format::signed(12));
    let (fine, fine_signed) = (format(false, 4, 8), format(true, 3, 8));
    let byte = Format::unsigned(8);
    Ok(vec![
        ("full", Box::new(TruncatingMultiplier::full(unsigned, unsigned)?)),
        ("drop_upper", Box::new(TruncatingMultiplier::drop_upper(unsigned, unsigned, 12)?)),
        ("drop_lower", Box::new(TruncatingMultiplier::drop_lower(unsigned, unsigned, 12)?)),
        ("saturate_fraction", Box::new(TruncatingMultiplier::saturate(fine, fine, fine)?)),
        ("full_signed", Box::new(TruncatingMultiplier::full(signed, signed)?)),
        ("full_mixed", Box::new(TruncatingMultiplier::full(signed, unsigned)?)),
        ("drop_upper_signed", Box::new(TruncatingMultiplier::drop_upper(signed, signed, 12)?)),
        ("drop_lower_mixed", Box::new(TruncatingMultiplier::drop_lower(signed, unsigned, 12)?)),
        ("saturate_signed", Box::new(TruncatingMultiplier::saturate(signed, signed, Format::signed(13))?)),
        ("saturate_mixed", Box::new(TruncatingMultiplier::saturate(signed, fine, Format::signed(13))?)),
        ("mixed_other", Box::new(TruncatingMultiplier::saturate(fine, fine_signed, format(true, 6, 5))?)),
        ("extend", Box::new(TruncatingMultiplier::new(byte, Format::signed(8), Format::signed(24), Overflow::Wrap)?)),
        ("uneven", Box::new(TruncatingMultiplier::drop_lower(Format::signed(18), byte, 20)?)),
        ("wide", Box::new(TruncatingMultiplier::drop_lower(format(true, 35, 12), format(true, 27, 12), 64)?)),
    ])
}

fn modulators() -> Vec<(&'static str, PwmConfig)> {
    let small = PwmConfig { width: 5, ..PwmConfig::default() };
    vec![
        ("8_bit", PwmConfig { width: 8, ..small }),
        ("antiphase", PwmConfig { antiphase: true, ..small }),
        ("immediate", PwmConfig { latched: false, ..small }),
        ("immediate_antiphase", PwmConfig { antiphase: true, latched: false, ..small }),
        ("floating", PwmConfig { floating: true, ..small }),
        ("dead_time", PwmConfig { dead_time: 3, ..small }),
        ("dead_time_antiphase", PwmConfig { antiphase: true, dead_time: 2, ..small }),
        ("dead_time_floating", PwmConfig { floating: true, dead_time: 4, ..small }),
        ("dead_time_longer_than_period", PwmConfig { width: 2, dead_time: 7, latched: false, ..small }),
    ]
}

fn loops() -> Vec<(&'static str, LoopConfig)> {
    let small = LoopConfig {
        position_width: 8,
        stiffness: format(false, 6, 2),
        damping: format(false, 4, 4),
        period_width: 6,
        velocity_width: 6,
        pwm: PwmConfig { width: 6, ..PwmConfig::default() },
        ..LoopConfig::default()
    };
    vec![
        ("wrap", LoopConfig { saturate: false, ..LoopConfig::default() }),
        ("8_bit", small),
        ("rescaled", LoopConfig { rescaled: true, scale: format(false, 4, 4), ..small }),
        ("antiphase", LoopConfig { pwm: PwmConfig { antiphase: true, dead_time: 2, ..small.pwm }, ..small }),
        ("immediate", LoopConfig { pwm: PwmConfig { latched: false, floating: true, ..small.pwm }, ..small }),
    ]
}

fn format(signed: bool, int: i32, frac: i32) -> Format {
    Format::new(signed, int, frac).expect("a constant")
}
