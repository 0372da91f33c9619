//! Measures of stiffness and damping: limits of the linear loop, of the criteria, and of the scene in words.

use std::num::NonZeroUsize;

use hpu_cosim::Control;
use hpu_cosim::scene::{Device, Experiment, OutcomeKind, Scene};

use super::{Asked, LONGEST, Taken, numbers, text};
use crate::Error;
use crate::template::{Value, Values};
use hpu_page::summary::untold;
use hpu_prove::SampledLoop;
use hpu_prove::criteria;
use hpu_prove::linear::{Damping, StableSet, Stretch, linear_settles, usual_range};
use hpu_study::limits::{self, Looks, Seen, WordsSet};
use hpu_study::map::{Cell, CellLimits};

/// The values of a scene: of its words, then of its device.
pub(super) const SCENE_GIVES: &[&str] = &[
    "torque_quantum",
    "count",
    "sample_rate",
    "sample_period",
    "pwm_counts",
    "resistance",
    "torque_constant",
    "damping",
];

pub(super) fn scene(asked: &Asked, _: &Control) -> Result<Values, Error> {
    let scene = asked.axis()?;
    let words = scene.words()?.realised;
    let mut values = numbers([
        ("torque_quantum", words.torque_quantum_nm),
        ("count", words.count_rad),
        ("sample_rate", words.sample_rate_hz),
        ("sample_period", scene.sample_period_s()),
        ("pwm_counts", f64::from(1u32 << scene.method.pwm.bits)),
    ]);
    values.extend(match &scene.device {
        Device::Motor(motor) => numbers([
            ("resistance", motor.resistance_ohm),
            ("torque_constant", motor.torque_constant_nm_per_a),
            ("damping", motor.viscous_friction_nm_s_per_rad),
        ])
        .into_iter(),
        Device::Mass(mass) => numbers([("damping", mass.damping_n_s_per_m)]).into_iter(),
    });
    Ok(values)
}

pub(super) fn linear(asked: &Asked, _: &Control) -> Result<Values, Error> {
    let scene = asked.axis()?;
    if let Some(every) = asked.number("every") {
        return Ok(numbers([("limit", dual_rate(&scene, every as u32)?)]));
    }
    let (damping, range) = (Damping::Fixed(scene.wall.damping_nm_s_per_rad), usual_range(&scene));
    match Stretch::softest(&scene, damping, range)? {
        Some(stretch) => Ok(numbers([("limit", stretch.to.middle())])),
        None => Err(StableSet::new(&scene, damping, range)?.said().into()),
    }
}

/// Returns a stiffness at which the linear loop of two rates ceases to settle, by bisection from 1.
fn dual_rate(scene: &Scene, every: u32) -> Result<f64, Error> {
    let damping = scene.wall.damping_nm_s_per_rad;
    let stable = |stiffness: f64| SampledLoop::dual_rate(scene, stiffness, damping, every).spectral_radius() < 1.0;
    let (mut low, mut high) = (1.0, 1.0);
    for (end, wanted, factor) in [(&mut low, true, 0.5), (&mut high, false, 2.0)] {
        let mut sought = std::iter::successors(Some(1.0), |at| Some(at * factor)).take(40);
        *end = sought.find(|at| stable(*at) == wanted).ok_or("none")?;
    }
    while high - low > 1e-6 * (high + low) {
        let middle = 0.5 * (low + high);
        *(if stable(middle) { &mut low } else { &mut high }) = middle;
    }
    Ok(0.5 * (low + high))
}

pub(super) fn criterion(asked: &Asked, _: &Control) -> Result<Values, Error> {
    let name = asked.text("name");
    let criterion =
        criteria::named(name, &asked.axis()?).ok_or_else(|| Error::new(format_args!("no criterion {name} for it")))?;
    Ok(numbers([("limit", criterion.map_err(|silent| silent.why)?.limit)]))
}

/// Returns what the scene in words does, and the limits of all criteria beside it.
pub(super) fn limits(asked: &Asked, control: &Control) -> Result<Values, Error> {
    let scene = asked.axis()?;
    let looks = looks(asked)?;
    let limits = limits::limits(&scene, usual_range(&scene), || in_words(&scene, looks, control));
    let words = limits.in_words.as_ref();
    let mut values = Values::from([text("words", words.map_or_else(ToString::to_string, WordsSet::turn))]);
    for name in criteria::NAMES {
        let found = limits.criteria.iter().find(|criterion| criterion.name == name);
        let silent = limits.silent.iter().find(|silent| silent.name == name);
        let told = match (found, silent) {
            (Some(criterion), _) => {
                let mark = if criterion.assumptions_met() { ' ' } else { '!' };
                let over = words.map_or(String::new(), |words| format!(", {}", words.against(criterion.limit)));
                format!("{mark} {:.5} {}{over}", criterion.limit, criterion.unit)
            }
            (None, Some(silent)) => format!("silent: {}", silent.why),
            (None, None) => "says nothing of it".into(),
        };
        values.extend([text(name, told)]);
    }
    Ok(values)
}

/// Returns the settings of `hpu limits` for at most `words` stiffness words; brief ones if that key is missing.
fn looks(asked: &Asked) -> Result<Looks, Error> {
    match asked.number("words") {
        None => Ok(Looks::BRIEF),
        Some(words) if words.fract() == 0.0 && (2.0..=65_536.0).contains(&words) => {
            Ok(Looks::words(words as usize, Looks::default().phases))
        }
        Some(words) => Err(Error::new(format_args!("words = {words}: write a whole number from 2 to 65536"))),
    }
}

/// Returns what the scene in words does. If some runs are too short to tell, and their stiffnesses matter, all are made
/// as long as it takes, or twice as long where that is not known, up to [`LONGEST`].
fn in_words(scene: &Scene, looks: Looks, control: &Control) -> Result<WordsSet, hpu_study::Error> {
    longer(scene, |scene| {
        let found = WordsSet::new(std::slice::from_ref(scene), usual_range(scene), looks, NonZeroUsize::MIN, control)?;
        let open = found.open();
        let telling_s = open.iter().map(|seen| seen.telling_s.unwrap_or(2.0 * scene.run.duration_s));
        let telling_s = telling_s.reduce(f64::max);
        Ok((found, telling_s))
    })
}

/// Runs a scene; if it is too short to tell, makes it as long as it takes, up to [`LONGEST`].
fn cell(scene: &Scene, control: &Control) -> Result<Cell, Error> {
    longer(scene, |scene| {
        let cell = Cell::run(&Experiment::Axis(scene.clone()), CellLimits::UNGUARDED, control);
        let cell = cell?.ok_or("stopped")?;
        let telling_s = cell.telling_s;
        Ok((cell, telling_s))
    })
}

/// Returns what `run` finds of a scene, with the longer duration that it asks for as long as it asks for one.
fn longer<T, E>(scene: &Scene, run: impl Fn(&Scene) -> Result<(T, Option<f64>), E>) -> Result<T, E> {
    let mut scene = scene.clone();
    let longest_s = LONGEST * scene.run.duration_s;
    loop {
        match run(&scene)? {
            (_, Some(telling_s)) if telling_s > scene.run.duration_s && telling_s <= longest_s => {
                scene.head.run.duration_s = telling_s;
            }
            (found, _) => return Ok(found),
        }
    }
}

/// Gives the stiffness up to which all that were run settle at every phase (`all`) and beyond which none was seen to
/// settle (`some`), both or none; the lowest seen to fail and the highest seen to settle, each by itself.
pub(super) fn stable(asked: &Asked, control: &Control) -> Result<Values, Error> {
    let mut scene = asked.axis()?;
    let found = in_words(&scene, looks(asked)?, control)?;
    if let (Some(from), Some(to)) = (found.open().first(), found.open().last()) {
        let [low, high] = [from, to].map(|seen| found.digits(seen.stiffness));
        return Err(format!("not told from {low} to {high} {}: {}", found.unit, found.said_not_told(from, to)).into());
    }
    let known = |seen: Option<Seen>, otherwise: &str| {
        seen.map(|seen| Value::Number(seen.stiffness)).ok_or_else(|| Error::from(otherwise))
    };
    let (all, some) = (found.all_up_to(), found.highest_settled());
    const NONE: &str = "none settles at every phase";
    let mut values = Values::from([
        ("all".into(), known(some.and(all), NONE)),
        ("some".into(), known(all.and(some), NONE)),
        ("failed".into(), known(found.lowest_failed(), "none")),
        ("settled".into(), known(some, "none")),
        ("runs".into(), Ok(Value::Number(found.runs() as f64))),
    ]);
    if let (Some(Taken::Flag(true)), Some(all)) = (asked.options.get("felt"), some.and(all)) {
        scene.wall.stiffness_nm_per_rad = all.stiffness;
        let felt = cell(&scene, control)?.displayed.map(|displayed| displayed.stiffness);
        values.insert("felt".into(), felt.map(Value::Number).ok_or_else(|| "not felt".into()));
    }
    Ok(values)
}

pub(super) fn least_damping(asked: &Asked, control: &Control) -> Result<Values, Error> {
    let scene = asked.axis()?;
    let settles = |scene: &Scene| match asked.text("by") {
        "linear" => Ok(linear_settles(scene, scene.wall.stiffness_nm_per_rad) == Some(true)),
        "words" => {
            let cell = cell(scene, control)?;
            untold(cell.outcome, cell.telling_s).map_or(Ok(cell.outcome == OutcomeKind::Settled), |why| Err(why.into()))
        }
        other => Err(Error::new(format_args!("by = \"{other}\": write \"linear\" or \"words\""))),
    };
    let found = least(&scene, settles)?;
    let [fails, holds] = found.unwrap_or([f64::INFINITY; 2]);
    let mut values = numbers([("fails", fails), ("holds", holds)]);
    values.extend([text("text", told(found, &scene))]);
    Ok(values)
}

/// Returns two dampings within 2 %, one seen to fail and the other seen to hold. They are the first such pair of a scan
/// upwards in steps of a square root of two, narrowed by bisection. Both are 0 if no damping is needed. Returns `None`
/// if no damping up to 32 mN·m·s/rad holds. A damping that holds between two steps of the scan is missed.
fn least(scene: &Scene, stable: impl Fn(&Scene) -> Result<bool, Error>) -> Result<Option<[f64; 2]>, Error> {
    let holds = |damping: f64| {
        let mut scene = scene.clone();
        scene.wall.damping_nm_s_per_rad = damping;
        stable(&scene)
    };
    if holds(0.0)? {
        return Ok(Some([0.0; 2]));
    }
    let (mut low, mut high) = (0.0, 1e-6);
    while !holds(high)? {
        (low, high) = (high, high * std::f64::consts::SQRT_2);
        if high > 32e-3 {
            return Ok(None);
        }
    }
    while high - low > 0.02 * high && high > 1e-6 {
        let middle = 0.5 * (low + high);
        *(if holds(middle)? { &mut high } else { &mut low }) = middle;
    }
    Ok(Some([low, high]))
}

/// Returns as text where damping was seen to fail and to hold, and the gain in counts that the second damping means for
/// a velocity that is a difference of counts.
fn told(damping: Option<[f64; 2]>, scene: &Scene) -> String {
    let Some([fails, holds]) = damping else { return "none does".into() };
    if holds == 0.0 {
        return "0".into();
    }
    let decimals = (2 - libm::log10(holds * 1e3).floor() as i32).max(0) as usize;
    let seen = format!("{:.decimals$} to {:.decimals$} mN.m.s/rad", fails * 1e3, holds * 1e3);
    let Ok(realised) = scene.words().map(|words| words.realised) else { return seen };
    let quantum = realised.torque_quantum_nm / realised.count_rad;
    format!("{seen} (gain {:.1})", holds * realised.sample_rate_hz / quantum)
}
