//! The blocks and wirings of the method loops, and the configurations in which they are checked.

use hpu_signal::Format;

use crate::{
    AnyBlock, AxisFront, ConfigError, Estimator, InputShaper, InputShaperConfig, LawWidths, MethodLoop,
    MethodLoopConfig, PwmConfig, SampledWall, SampledWallConfig, Shaping,
};

/// Every block and wiring in its default configuration.
pub(crate) fn registry() -> Vec<Box<dyn AnyBlock>> {
    vec![
        Box::new(AxisFront::default()),
        Box::new(InputShaper::default()),
        Box::new(SampledWall::default()),
        Box::new(MethodLoop::<SampledWall>::default()),
    ]
}

type Variants = Vec<(&'static str, Box<dyn AnyBlock>)>;

/// The other configurations.
pub(crate) fn others() -> Result<Variants, ConfigError> {
    let mut all: Variants = vec![("8_bit", Box::new(AxisFront::new(8)?)), ("32_bit", Box::new(AxisFront::new(32)?))];
    let shaper =
        InputShaperConfig { torque_width: small().torque_width, period_width: small().period_width, shaping: None };
    for (label, config) in [
        ("8_bit", shaper),
        ("shaping", InputShaperConfig { shaping: Some(shaping(0)), ..InputShaperConfig::default() }),
        ("shaping_8_bit", InputShaperConfig { shaping: Some(shaping(0)), ..shaper }),
        ("phase", InputShaperConfig { shaping: Some(shaping(5)), ..shaper }),
        // A difference that rings: every rectifier and the filter's limits are reached within a few samples.
        (
            "ringing",
            InputShaperConfig {
                shaping: Some(Shaping { phase: 2, b: [1 << 30, -1 << 30, 0], a: [0, 1 << 30] }),
                ..shaper
            },
        ),
    ] {
        all.push((label, Box::new(InputShaper::new(config)?)));
    }
    for (label, config) in walls() {
        all.push((label, Box::new(SampledWall::new(config)?)));
    }
    for (label, pwm, shaping) in loops() {
        all.push((
            label,
            Box::new(MethodLoop::new(SampledWall::new(small_wall())?, MethodLoopConfig { pwm, shaping })?),
        ));
    }
    Ok(all)
}

/// Widths so short that everything wraps, saturates and rounds within a few edges.
pub(crate) fn small() -> LawWidths {
    let format = |int, frac| Format::new(false, int, frac).expect("a constant");
    LawWidths {
        width: 8,
        stiffness: format(4, 2),
        damping: format(3, 3),
        period_width: 6,
        scale: format(2, 4),
        torque_width: 6,
    }
}

/// The modulator of a loop of these widths.
pub(crate) fn small_pwm() -> PwmConfig {
    PwmConfig { width: small().torque_width, ..PwmConfig::default() }
}

fn small_wall() -> SampledWallConfig {
    SampledWallConfig { widths: small(), velocity_frac: 4, ..SampledWallConfig::default() }
}

/// Every estimator, the spring held and at once, both rates, with and without relief.
fn walls() -> Vec<(&'static str, SampledWallConfig)> {
    let small = small_wall();
    vec![
        ("8_bit", small),
        ("live", SampledWallConfig { spring_held: false, ratio: 3, ..small }),
        ("filtered", SampledWallConfig { estimator: Estimator::Filtered, shift: 2, relief: 5, ..small }),
        ("window", SampledWallConfig { estimator: Estimator::Window, window: 3, ratio: 3, ..small }),
        ("foaw", SampledWallConfig { estimator: Estimator::Foaw, spring_held: false, relief: 90, ..small }),
        ("edge_timer", SampledWallConfig { estimator: Estimator::EdgeTimer, ..small }),
        (
            "edge_timer_live",
            SampledWallConfig { estimator: Estimator::EdgeTimer, spring_held: false, ratio: 3, relief: 3, ..small },
        ),
        ("edge_timer_wide", SampledWallConfig { estimator: Estimator::EdgeTimer, ..SampledWallConfig::default() }),
    ]
}

/// The loops' modulators and shapers.
fn loops() -> Vec<(&'static str, PwmConfig, Option<Shaping>)> {
    let pwm = small_pwm();
    vec![
        ("8_bit", pwm, Some(shaping(5))),
        ("antiphase", PwmConfig { antiphase: true, dead_time: 2, ..pwm }, None),
        ("immediate", PwmConfig { latched: false, floating: true, ..pwm }, Some(shaping(0))),
    ]
}

/// The 2.5 Hz high-pass at 10 kHz.
fn shaping(phase: u32) -> Shaping {
    Shaping { phase, b: [1_072_549_859, -2_145_099_718, 1_072_549_859], a: [-2_145_098_394, 1_071_359_217] }
}
