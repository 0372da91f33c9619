//! Measures of a segment on a gimbal: shape, stiffness, shear, and the switches of its control.

use std::ops::Range;
use std::sync::atomic::Ordering;

use hpu_cosim::scene::{Experiment, GimbalScene};
use hpu_cosim::{Control, Driver, FORCE, GimbalSimulation, RADIUS, STRESSES, Simulation, Trace, Verdict, Wired};
use hpu_plant::arm::Gimbal;

use super::velocity::lag;
use super::{Asked, Measure, Takes, numbers, option, text};
use crate::Error;
use crate::template::{Value, Values, length};
use hpu_page::summary::untold;
use hpu_prove::criteria::touch::{Criteria, NAMES};
use hpu_study::gimbal::Switches;

/// Columns of a row of a gimbal: the tip, its target.
const TIP: Range<usize> = 0..3;
const TARGET: Range<usize> = 3..6;

/// The longest lag that is looked for, in s.
const MOST_LAG_S: f64 = 1.0;

/// The least depth at which a stiffness is taken, in m.
const LEAST_DEPTH_M: f64 = 1e-3;

/// The time over which the speed of the surface is taken, in s.
const SPEED_OVER_S: f64 = 0.02;

/// The values that the measure gives.
const GIVES: &[&str] = &[
    "outcome",
    "settles",
    "rms",
    "mean",
    "deviation",
    "most",
    "mean_speed",
    "lag_height",
    "lag_pitch",
    "lag_roll",
    "fastest",
    "low",
    "high",
    "force",
    "felt",
    "stiffness_error",
    "stiffness_deviation",
    "stress",
    "stress_error",
    "stress_deviation",
    "switches",
    "late_switches",
    "bump",
    "switch_energy",
];

/// The values that the criteria of a touch give.
const TOUCH_GIVES: &[&str] = &["position", "position_force", "impedance_force", "growth", NAMES[0], NAMES[1], NAMES[2]];

/// The measures of a segment.
pub(super) static MEASURES: &[Measure] = &[
    Measure {
        name: "segment",
        about: "Runs of a segment on a gimbal: the distance of the tip from its target, the lags of height, pitch and \
                roll, the fastest motion of the surface, the force and the stiffness that the finger feels under \
                impedance control, the error of the shear stress, the switches of control, and those in the last three \
                tenths. With `seeds` it is run once for each `run.seed`, and the rows of all runs count. `press` is \
                the window of time in which the stiffness is taken, from a depth of 1 mm on.",
        is_of_scene: true,
        keys: &[option("seeds", Takes::Numbers), option("press", Takes::Numbers)],
        gives: GIVES,
        run: segment,
    },
    Measure {
        name: "touch",
        about: "The criteria of a switched touch, without a run: the stiffness of position control, the \
                finger's force at rest under either control, the growth of the linear loop from pulse to pulse there, \
                and whether each criterion predicts that the touch fails (1) or not (0).",
        is_of_scene: true,
        keys: &[],
        gives: TOUCH_GIVES,
        run: touch,
    },
];

/// A finished run.
struct Made {
    scene: GimbalScene,
    trace: Trace,
    switches: Switches,
    verdict: Option<Verdict>,
}

fn scene(asked: &Asked, more: &[(String, String)]) -> Result<GimbalScene, Error> {
    match asked.experiment(more)? {
        Experiment::Gimbal(scene) => Ok(scene),
        _ => Err(Error::new(format_args!("{} is no scene of a gimbal", asked.scene))),
    }
}

fn made(asked: &Asked, more: &[(String, String)], control: &Control) -> Result<Made, Error> {
    let scene = scene(asked, more)?;
    let simulation = GimbalSimulation::new(&scene)?;
    let mut trace = simulation.trace(&["mode"]);
    let mut switches = Switches::of(&scene, &simulation);
    let summary = simulation.run(Driver::Events, &mut trace, &mut switches, control);
    if control.stop.load(Ordering::Relaxed) || !summary.complete {
        return Err("stopped before its end".into());
    }
    Ok(Made { scene, trace, switches, verdict: summary.verdict })
}

impl Made {
    fn point(&self, columns: Range<usize>, row: usize) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.trace.real(columns.start + axis)[row])
    }

    fn rows(&self) -> usize {
        self.trace.real(RADIUS).len()
    }

    fn outcome(&self) -> String {
        match self.verdict {
            Some(Verdict::LimitCycle { amplitude_rad, frequency_hz, .. }) => {
                format!("limit cycle, {frequency_hz:.0} Hz, {}", length(amplitude_rad))
            }
            Some(Verdict::Diverged { at_s, .. }) => format!("leaves its range at {at_s:.2} s"),
            Some(Verdict::Tracking { .. }) => "follows".into(),
            Some(Verdict::NotTold { .. }) => "may still come to rest".into(),
            Some(Verdict::HandMoves { until_s, .. }) => format!("follows the finger, until {until_s:.2} s"),
            _ => "settles".into(),
        }
    }

    /// Returns depths in m and forces in N of the rows in a window of time under impedance control, from the least
    /// depth on.
    fn pressed(&self, window: &[f64]) -> Vec<(f64, f64)> {
        let (radii, forces, modes) = (self.trace.real(RADIUS), self.trace.real(FORCE), self.trace.words(0));
        let inside = |time_s: f64| match *window {
            [from_s, to_s] => (from_s..to_s).contains(&time_s),
            _ => true,
        };
        let rows = (0..self.rows()).filter(|row| modes[*row] == 1 && inside(self.trace.time_s(*row)));
        let pairs = rows.map(|row| (norm(self.point(TARGET, row)) - radii[row], forces[row]));
        pairs.filter(|(depth_m, _)| *depth_m >= LEAST_DEPTH_M).collect()
    }
}

fn norm([x, y, z]: [f64; 3]) -> f64 {
    libm::hypot(x, libm::hypot(y, z))
}

/// Returns mean and standard deviation; NaN of nothing.
fn spread(values: &[f64]) -> [f64; 2] {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / count;
    [mean, square.sqrt()]
}

/// Returns the lags in s of height, pitch and roll behind the target, each over all runs.
fn lags(all: &[Made]) -> [f64; 3] {
    let interval_s = all[0].trace.interval_s();
    let polar = |columns: Range<usize>| -> Vec<Vec<[f64; 3]>> {
        let of = |made: &Made| (0..made.rows()).map(|row| Gimbal::polar(made.point(columns.clone(), row))).collect();
        all.iter().map(of).collect()
    };
    let (tips, targets) = (polar(TIP), polar(TARGET));
    [2, 0, 1].map(|coordinate| {
        let moves = targets.iter().flatten().any(|target| target[coordinate] != targets[0][0][coordinate]);
        let most = ((MOST_LAG_S / interval_s) as usize).min(tips[0].len() - 1);
        // The mean of the differences is no lag: the segment's weight presses it down. Every tenth row will do.
        let mean_square = |lag: usize| {
            let pairs =
                tips.iter().zip(&targets).flat_map(|(tip, target)| tip.iter().skip(lag).zip(target).step_by(10));
            let (mut count, mut sum, mut square) = (0.0, 0.0, 0.0);
            for (tip, target) in pairs {
                let difference = tip[coordinate] - target[coordinate];
                (count, sum, square) = (count + 1.0, sum + difference, square + difference * difference);
            }
            (square - sum * sum / count) / count
        };
        if moves { lag(most, mean_square).0 * interval_s } else { f64::NAN }
    })
}

/// Runs a segment on a gimbal.
fn segment(asked: &Asked, control: &Control) -> Result<Values, Error> {
    let seeds: Vec<Vec<(String, String)>> = match asked.numbers("seeds") {
        [] => vec![Vec::new()],
        seeds => seeds.iter().map(|seed| vec![("run.seed".to_string(), seed.to_string())]).collect(),
    };
    let all: Vec<Made> = seeds.iter().map(|seed| made(asked, seed, control)).collect::<Result<_, _>>()?;
    let rows = || all.iter().flat_map(|made| (0..made.rows()).map(move |row| (made, row)));
    let apart = |made: &Made, [one, other]: [(Range<usize>, usize); 2]| {
        let (one, other) = (made.point(one.0, one.1), made.point(other.0, other.1));
        norm([0, 1, 2].map(|axis| one[axis] - other[axis]))
    };
    let errors: Vec<f64> = rows().map(|(made, row)| apart(made, [(TIP, row), (TARGET, row)])).collect();
    let [mean, deviation] = spread(&errors);
    let over = ((SPEED_OVER_S / all[0].trace.interval_s()).round() as usize).max(1);
    let speeds = |columns: Range<usize>| -> Vec<f64> {
        let later = rows().filter(|(made, row)| row + over < made.rows());
        let way = later.map(|(made, row)| apart(made, [(columns.clone(), row), (columns.clone(), row + over)]));
        way.map(|way| way / (over as f64 * all[0].trace.interval_s())).collect()
    };
    let radii = || rows().map(|(made, row)| made.trace.real(RADIUS)[row]);
    let pressed: Vec<(f64, f64)> = all.iter().flat_map(|made| made.pressed(asked.numbers("press"))).collect();
    let asked_n_per_m = all[0].scene.stiffness_n_per_m;
    let misses: Vec<f64> = pressed.iter().map(|(depth, force)| (force / depth - asked_n_per_m).abs()).collect();
    let [stiffness_error, stiffness_deviation] = spread(&misses);
    // Only a scene with shear has stresses.
    let stresses = STRESSES.map(|column| {
        let sheared = all.iter().filter(|made| made.scene.shear.is_some());
        sheared.flat_map(|made| made.trace.real(column)).copied().collect::<Vec<f64>>()
    });
    let [asked_pa, rendered_pa] = stresses;
    let wrong: Vec<f64> = asked_pa.iter().zip(&rendered_pa).map(|(asked, rendered)| (asked - rendered).abs()).collect();
    let [stress_error, stress_deviation] = spread(&wrong);
    let greatest = |values: &[f64]| values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    let settled = |made: &Made| matches!(made.verdict, Some(Verdict::Settled { .. } | Verdict::Tracking { .. }));
    let verdicts = || all.iter().filter_map(|made| made.verdict);
    let settles = match verdicts().find_map(|verdict| untold(verdict.outcome(), verdict.telling_s())) {
        Some(why) => Err(why.into()),
        None => Ok(Value::Number(f64::from(u8::from(all.iter().all(settled))))),
    };
    let [lag_height, lag_pitch, lag_roll] = lags(&all);
    let energies: Vec<f64> = all.iter().filter_map(|made| made.switches.energy_j()).collect();
    let mut values = numbers([
        ("rms", libm::hypot(mean, deviation)),
        ("mean", mean),
        ("deviation", deviation),
        ("most", greatest(&errors)),
        ("mean_speed", spread(&speeds(TARGET))[0]),
        ("lag_height", lag_height),
        ("lag_pitch", lag_pitch),
        ("lag_roll", lag_roll),
        ("fastest", greatest(&speeds(TIP))),
        ("low", radii().fold(f64::INFINITY, f64::min)),
        ("high", radii().fold(f64::NEG_INFINITY, f64::max)),
        ("force", rows().fold(0.0, |most, (made, row)| most.max(made.trace.real(FORCE)[row]))),
        ("felt", super::slope(&pressed)),
        ("stiffness_error", stiffness_error),
        ("stiffness_deviation", stiffness_deviation),
        ("stress", greatest(&asked_pa)),
        ("stress_error", stress_error),
        ("stress_deviation", stress_deviation),
        ("switches", all.iter().map(|made| made.switches.count as f64).sum()),
        ("late_switches", all.iter().map(|made| made.switches.judged as f64).sum()),
        ("bump", all.iter().fold(0.0, |most, made| most.max(made.switches.bump_n))),
        ("switch_energy", spread(&energies)[0]),
    ]);
    for (name, value) in &mut values {
        if matches!(value, Ok(Value::Number(number)) if !number.is_finite()) {
            *value = Err(missing(name).into());
        }
    }
    if all[0].scene.shear.is_none() {
        for name in ["stress", "stress_error", "stress_deviation"] {
            values.insert(name.into(), Err("the scene has no shear".into()));
        }
    }
    values.extend([text("outcome", all[0].outcome())]);
    values.insert("settles".into(), settles);
    Ok(values)
}

/// Returns why a value is missing.
fn missing(name: &str) -> &'static str {
    match name {
        "lag_height" | "lag_pitch" | "lag_roll" => "does not move, or later than 1 s",
        "switch_energy" => "no switch in the judged window",
        "felt" | "stiffness_error" | "stiffness_deviation" => "never deeper than 1 mm under impedance control",
        _ => "not finite",
    }
}

/// Returns what the criteria of a touch tell.
fn touch(asked: &Asked, _: &Control) -> Result<Values, Error> {
    let criteria = Criteria::of(&scene(asked, &[])?)?;
    let fails = criteria.fails().map(|fails| f64::from(u8::from(fails)));
    // The control that rests; under both, or neither, impedance control.
    let rest = if criteria.holds == [true, false] { 0 } else { 1 };
    Ok(numbers([
        ("position", criteria.position_n_per_m),
        ("position_force", criteria.rests[0].force_n),
        ("impedance_force", criteria.rests[1].force_n),
        ("growth", criteria.rests[rest].growth),
        (NAMES[0], fails[0]),
        (NAMES[1], fails[1]),
        (NAMES[2], fails[2]),
    ]))
}
