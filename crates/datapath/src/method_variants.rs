//! The blocks and wirings of the method loops, and the configurations in which they are tested.

use hpu_signal::Format;

use crate::config::NATURAL;
use crate::{
    AnyBlock, AxisFront, BoundingConfig, ConfigError, CouplingConfig, EnergyBounding, Estimator, InputShaper,
    InputShaperConfig, Law, LawWidths, MethodLoop, MethodLoopConfig, PassiveSpring, PassivityConfig,
    PassivityController, PwmConfig, SampledWall, SampledWallConfig, Shaping, SpringConfig, VirtualCoupling,
};

/// Returns every block and wiring of the method loops in its default configuration.
pub(crate) fn registry() -> Vec<Box<dyn AnyBlock>> {
    vec![
        Box::new(AxisFront::default()),
        Box::new(InputShaper::default()),
        Box::new(SampledWall::default()),
        Box::new(VirtualCoupling::default()),
        Box::new(PassivityController::default()),
        Box::new(EnergyBounding::default()),
        Box::new(PassiveSpring::default()),
        Box::new(MethodLoop::<SampledWall>::default()),
        Box::new(MethodLoop::<VirtualCoupling>::default()),
        Box::new(MethodLoop::<PassivityController>::default()),
        Box::new(MethodLoop::<EnergyBounding>::default()),
        Box::new(MethodLoop::<PassiveSpring>::default()),
    ]
}

type Variants = Vec<(&'static str, Box<dyn AnyBlock>)>;

/// Returns the configurations beyond the default ones, each with its label.
pub(crate) fn others() -> Result<Variants, ConfigError> {
    let mut all: Variants = vec![("8_bit", Box::new(AxisFront::new(8)?)), ("32_bit", Box::new(AxisFront::new(32)?))];
    let shaper =
        InputShaperConfig { torque_width: small().torque_width, period_width: small().period_width, shaping: None };
    for (label, config) in [
        ("8_bit", shaper),
        ("shaping", InputShaperConfig { shaping: Some(shaping(0)), ..InputShaperConfig::default() }),
        ("shaping_8_bit", InputShaperConfig { shaping: Some(shaping(0)), ..shaper }),
        // The filter shows half of each difference. The other half of a step up is shown at once, so the edge of the
        // first sample is visible.
        (
            "phase",
            InputShaperConfig { shaping: Some(Shaping { phase: 5, b: [1 << 29, -1 << 29, 0], a: [0, 0] }), ..shaper },
        ),
        // A ringing difference reaches every rectifier and the filter's limits within a few samples.
        (
            "ringing",
            InputShaperConfig {
                shaping: Some(Shaping { phase: 1, b: [1 << 30, -1 << 30, 0], a: [0, 1 << 30] }),
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
    all.extend(stabilised()?);
    all.extend(distinct_loops()?);
    Ok(all)
}

/// Returns loops in which no two generics have the same value, so that a generic in another one's place is noticed.
fn distinct_loops() -> Result<Variants, ConfigError> {
    let format = |int, frac| Format::new(false, int, frac).expect("a constant");
    let widths = LawWidths {
        width: 9,
        stiffness: format(5, 3),
        damping: format(5, 5),
        period_width: 12,
        scale: format(3, 4),
        torque_width: 11,
    };
    let pwm = PwmConfig { width: 11, ..PwmConfig::default() };
    let bare = MethodLoopConfig { pwm, shaping: None };
    let wall = SampledWallConfig {
        widths,
        estimator: Estimator::Filtered,
        ratio: 2,
        shift: 1,
        window: 13,
        noise: 14,
        velocity_frac: 6,
        relief: 15,
        ..SampledWallConfig::default()
    };
    let coupling = CouplingConfig { widths, extension_frac: 6, gain_frac: 13, share: 4928, free: 2048, held: 832 };
    let control = PassivityConfig { widths, exact: true, energy_width: 21, credit: 4000 };
    let bounding = BoundingConfig {
        widths,
        c1: 91,
        c2: 80,
        bound_frac: 2,
        bound_width: 7,
        energy_width: 22,
        root_width: 40,
        ..BoundingConfig::default()
    };
    let spring = SpringConfig { widths, extension_frac: 14, alpha: 300, revive: true };
    let foaw = SampledWallConfig { estimator: Estimator::Foaw, window: 6, noise: 2, ratio: 1, ..wall };
    let shaped = MethodLoopConfig { shaping: Some(shaping(16)), ..bare };
    Ok(vec![
        ("distinct", Box::new(MethodLoop::new(SampledWall::new(wall)?, shaped)?)),
        ("distinct_foaw", Box::new(MethodLoop::new(SampledWall::new(foaw)?, bare)?)),
        ("distinct", Box::new(MethodLoop::new(VirtualCoupling::new(coupling)?, bare)?)),
        ("distinct", Box::new(MethodLoop::new(PassivityController::new(control)?, bare)?)),
        ("distinct", Box::new(MethodLoop::new(EnergyBounding::new(bounding)?, bare)?)),
        ("distinct", Box::new(MethodLoop::new(PassiveSpring::new(spring)?, bare)?)),
    ])
}

/// Configurations of the laws that stabilise, in widths so short that their latency may exceed a period.
struct Small {
    coupling: CouplingConfig,
    control: PassivityConfig,
    bounding: BoundingConfig,
    spring: SpringConfig,
}

fn stabilisers() -> Small {
    let format = |int, frac| Format::new(false, int, frac).expect("a constant");
    let widths = LawWidths {
        width: 8,
        stiffness: format(6, 2),
        damping: format(4, 4),
        period_width: 8,
        scale: format(4, 4),
        torque_width: 6,
    };
    Small {
        // These gains are K_e = 60, K_c = 30, B_c/T = 10 PWM counts per count.
        coupling: CouplingConfig { widths, extension_frac: 3, gain_frac: 8, share: 154, free: 64, held: 26 },
        control: PassivityConfig { widths, energy_width: 14, ..PassivityConfig::default() },
        bounding: BoundingConfig {
            widths,
            c1: 23,
            c2: 20,
            bound_frac: 2,
            bound_width: 6,
            energy_width: 16,
            root_width: 28,
            ..BoundingConfig::default()
        },
        spring: SpringConfig { widths, ..SpringConfig::default() },
    }
}

/// Returns coupling, passivity control, energy bounding and passive spring, and the loops around them.
fn stabilised() -> Result<Variants, ConfigError> {
    let Small { coupling, control, bounding, spring } = stabilisers();
    let soft = CouplingConfig { share: 39322, free: 16384, held: 6554, ..CouplingConfig::default() };
    let exact = |config| PassivityConfig { exact: true, ..config };
    let least = |config| BoundingConfig { least_conservative: true, ..config };
    let own = |law| MethodLoopConfig { pwm: small_pwm(), shaping: Some(shaping(law)) };
    let tight = VirtualCoupling::new(coupling)?;
    let (controller, exactly) = (PassivityController::new(control)?, PassivityController::new(exact(control))?);
    let (bounded, least_bounded) = (EnergyBounding::new(bounding)?, EnergyBounding::new(least(bounding))?);
    let energy_level = PassiveSpring::new(spring)?;
    Ok(vec![
        ("soft", Box::new(VirtualCoupling::new(soft)?)),
        ("8_bit", Box::new(MethodLoop::new(tight.clone(), own(tight.latency() + 1))?)),
        ("8_bit", Box::new(tight)),
        ("exact", Box::new(PassivityController::new(exact(PassivityConfig::default()))?)),
        ("8_bit", Box::new(MethodLoop::new(controller.clone(), own(controller.latency() + 1))?)),
        ("8_bit", Box::new(controller)),
        ("exact_8_bit", Box::new(MethodLoop::new(exactly.clone(), own(exactly.latency() + 1))?)),
        ("exact_8_bit", Box::new(exactly)),
        ("credit", Box::new(PassivityController::new(PassivityConfig { credit: 40, ..control })?)),
        ("exact_credit", Box::new(PassivityController::new(PassivityConfig { credit: 40, ..exact(control) })?)),
        ("greatest_credit", Box::new(PassivityController::new(PassivityConfig { credit: NATURAL, ..control })?)),
        ("wide_energy", Box::new(PassivityController::new(deep(15, 32))?)),
        ("wide_torque", Box::new(PassivityController::new(deep(16, 31))?)),
        ("8_bit", Box::new(MethodLoop::new(bounded.clone(), own(bounded.latency() + 1))?)),
        ("8_bit", Box::new(bounded)),
        ("least_conservative", Box::new(EnergyBounding::new(least(BoundingConfig::default()))?)),
        ("least_conservative_8_bit", Box::new(MethodLoop::new(least_bounded.clone(), own(0))?)),
        ("least_conservative_8_bit", Box::new(least_bounded)),
        ("8_bit", Box::new(MethodLoop::new(energy_level.clone(), own(energy_level.latency() + 1))?)),
        ("8_bit", Box::new(energy_level)),
        ("no_revival", Box::new(PassiveSpring::new(SpringConfig { revive: false, ..spring })?)),
        ("one_and_a_half", Box::new(PassiveSpring::new(SpringConfig { alpha: 384, ..spring })?)),
        ("fine", Box::new(PassiveSpring::new(SpringConfig { extension_frac: 10, ..spring })?)),
    ])
}

/// Returns a passivity controller whose total, less the greatest credit, needs every bit that the VHDL gives it.
/// Depending on the arguments, the energy's width or the widths of torque and motion determine this number of bits.
fn deep(torque_width: u32, energy_width: u32) -> PassivityConfig {
    let widths = LawWidths { width: 16, torque_width, ..LawWidths::default() };
    PassivityConfig { widths, exact: true, energy_width, credit: NATURAL }
}

/// Returns widths so short that everything wraps, saturates and rounds within a few edges.
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

/// Returns the modulator of a loop with the widths of [`small`].
pub(crate) fn small_pwm() -> PwmConfig {
    PwmConfig { width: small().torque_width, ..PwmConfig::default() }
}

fn small_wall() -> SampledWallConfig {
    SampledWallConfig { widths: small(), velocity_frac: 4, ..SampledWallConfig::default() }
}

/// Returns walls with every estimator, the spring held and live, both rates, and with and without relief.
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

/// Returns the modulators and shapers of the loops, each with its label.
fn loops() -> Vec<(&'static str, PwmConfig, Option<Shaping>)> {
    let pwm = small_pwm();
    vec![
        ("8_bit", pwm, Some(shaping(5))),
        ("antiphase", PwmConfig { antiphase: true, dead_time: 2, ..pwm }, None),
        ("immediate", PwmConfig { latched: false, floating: true, ..pwm }, Some(shaping(0))),
    ]
}

/// Returns the shaper's 2.5 Hz high-pass filter for a rate of 10 kHz.
fn shaping(phase: u32) -> Shaping {
    Shaping { phase, b: [1_072_549_859, -2_145_099_718, 1_072_549_859], a: [-2_145_098_394, 1_071_359_217] }
}
