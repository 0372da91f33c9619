//! The configurations in which the blocks are tested.

use hpu_signal::{Format, Overflow};

use crate::{
    AnyBlock, Biquad, BiquadConfig, CommandLimiter, ConfigError, ConventionalLoop, Displacement, DividerConfig,
    EdgeTimer, FilteredConfig, FilteredDifference, Foaw, FoawConfig, HybridLoop, LoopConfig, PositionCounter, Pwm,
    PwmConfig, QuadratureDecoder, Saturator, SequentialDivider, SquareRoot, TorqueSum, TruncatingMultiplier,
    Unilateral, VelocityConfig, VelocityRegister, WindowDifference, ZeroOrderHold, method_variants, phantom, registry,
};

/// Returns every block in the configurations for which vectors are written and the VHDL is tested, each with the
/// variant's label. The configurations of [`registry`] have the label `default`. A label is unique among the variants
/// of its block.
///
/// # Panics
///
/// It never panics, because the configurations are constants.
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
        ("narrow_damping", Box::new(TorqueSum::new(8, 5, 8)?)),
        ("narrow_spring", Box::new(TorqueSum::new(5, 9, 8)?)),
        ("8_bit", Box::new(Saturator::new(10, 9, 255)?)),
        ("limit_0", Box::new(Saturator::new(10, 9, 0)?)),
        ("settling_1", Box::new(CommandLimiter::new(10, 9, 255, 1)?)),
        ("settling_5", Box::new(CommandLimiter::new(10, 9, 200, 5)?)),
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
    all.extend(arithmetic()?);
    all.extend(estimators()?);
    for (label, pwm) in modulators() {
        all.push((label, Box::new(Pwm::new(pwm)?)));
    }
    for (label, config) in loops() {
        all.push((label, Box::new(HybridLoop::new(config)?)));
        all.push((label, Box::new(ConventionalLoop::new(config)?)));
    }
    all.extend(method_variants::others()?);
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

fn arithmetic() -> Result<Variants, ConfigError> {
    let divider = |[num_width, den_width, frac, out_width]: [u32; 4]| {
        SequentialDivider::new(DividerConfig { num_width, den_width, frac, out_width })
    };
    let words = |input: (i32, i32), output: (i32, i32), coefficient: (i32, i32)| {
        [input, output, coefficient].map(|(int, frac)| format(true, int, frac))
    };
    let section = |[input, output, coefficient]: [Format; 3], b, a, period_width| {
        Biquad::new(BiquadConfig { input, output, coefficient, b, a, period_width })
    };
    // A Butterworth high-pass filter at 1/4000 of the sampling rate: 2.5 Hz at 10 kHz.
    let high_pass = ([1_072_549_859, -2_145_099_718, 1_072_549_859], [-2_145_098_394, 1_071_359_217]);
    let most = i32::MAX;
    Ok(vec![
        ("narrow", Box::new(divider([4, 3, 2, 5])?)),
        ("integer", Box::new(divider([16, 16, 0, 16])?)),
        ("fraction_only", Box::new(divider([5, 11, 16, 9])?)),
        ("wide", Box::new(divider([46, 32, 16, 62])?)),
        ("4_bit", Box::new(SquareRoot::new(4)?)),
        ("10_bit", Box::new(SquareRoot::new(10)?)),
        ("62_bit", Box::new(SquareRoot::new(62)?)),
        ("high_pass", Box::new(section(words((12, 4), (13, 26), (1, 30)), high_pass.0, high_pass.1, 4)?)),
        ("narrow", Box::new(section(words((3, 2), (2, 1), (1, 3)), [5, -7, 3], [-13, 6], 4)?)),
        ("integer", Box::new(section(words((9, 0), (11, 3), (2, 0)), [1, -2, 1], [-1, 1], 6)?)),
        ("extreme", Box::new(section(words((19, 20), (20, 19), (1, 30)), [most, i32::MIN, most], [-most, -most], 8)?)),
    ])
}

fn estimators() -> Result<Variants, ConfigError> {
    let filtered = |[width, period_width, shift, out_frac]: [u32; 4]| {
        FilteredDifference::new(FilteredConfig { width, period_width, shift, out_frac })
    };
    let adaptive = |[width, period_width, window, noise, out_frac]: [u32; 5]| {
        Foaw::new(FoawConfig { width, period_width, window, noise, out_frac })
    };
    Ok(vec![
        ("unfiltered", Box::new(filtered([8, 6, 0, 0])?)),
        ("5_bit", Box::new(filtered([5, 4, 2, 3])?)),
        ("slow", Box::new(filtered([10, 6, 16, 16])?)),
        ("wide", Box::new(filtered([40, 4, 5, 22])?)),
        ("one_sample", Box::new(WindowDifference::new(8, 6, 1)?)),
        ("5_bit", Box::new(WindowDifference::new(5, 4, 7)?)),
        ("wide", Box::new(WindowDifference::new(62, 4, 64)?)),
        ("4_bit", Box::new(adaptive([4, 4, 5, 2, 3])?)),
        ("noiseless", Box::new(adaptive([6, 6, 3, 0, 0])?)),
        ("loose", Box::new(adaptive([8, 6, 16, 15, 6])?)),
        ("wide", Box::new(adaptive([42, 4, 7, 1, 20])?)),
        // With one fraction bit less of 1/11 the words would differ.
        ("eleven", Box::new(adaptive([6, 4, 11, 15, 6])?)),
        ("2_bit", Box::new(EdgeTimer::new(2, 2)?)),
        ("short", Box::new(EdgeTimer::new(8, 3)?)),
        ("wide", Box::new(EdgeTimer::new(48, 30)?)),
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
        ("settling", LoopConfig { settling: 3, pwm: PwmConfig { latched: false, ..small.pwm }, ..small }),
    ]
}

fn format(signed: bool, int: i32, frac: i32) -> Format {
    Format::new(signed, int, frac).expect("a constant")
}
