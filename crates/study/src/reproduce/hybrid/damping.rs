//! The least virtual damping with which a given wall settles.

use hpu_cosim::Control;
use hpu_cosim::scene::{Experiment, OutcomeKind, Scene};

use super::super::beside::{Found, Line};
use super::{Leaning, line};
use crate::limits::linear_settles;
use crate::map::{Cell, CellLimits};

const GROUP: &str = "The least virtual damping that holds a wall, pushed by 20 mN.m: seen to fail, to hold";

/// The loops: a name, the shipped scene, and the sample rate.
const LOOPS: [(&str, &str, &str); 6] = [
    ("conventional, 100 Hz", "conventional-wall-1khz", "100 Hz"),
    ("conventional, 1 kHz", "conventional-wall-1khz", "1 kHz"),
    ("conventional, 2 kHz", "conventional-wall-1khz", "2 kHz"),
    ("conventional, 5 kHz", "conventional-wall-1khz", "5 kHz"),
    ("conventional, 10 kHz", "conventional-wall-1khz", "10 kHz"),
    ("hybrid, 1 kHz", "hybrid-wall", "1 kHz"),
];

/// Number of rates of the conventional loop, the lowest first.
pub(super) const RATES: usize = LOOPS.len() - 1;

pub(super) fn lines() -> Vec<Line> {
    let mut lines = Vec::new();
    for stiffness in ["0.6", "1.8", "2.5"] {
        for (what, scene, rate) in LOOPS {
            let published = if rate == "1 kHz" && scene != "hybrid-wall" { "less at higher rates" } else { "" };
            lines.push(line(GROUP, format!("{stiffness} N.m/rad, {what}"), published, move |control| {
                let scene = damped(scene, stiffness, rate)?;
                let linear =
                    least(&scene, |scene| Ok(linear_settles(scene, scene.wall.stiffness_nm_per_rad) == Some(true)))?;
                let words = least(&scene, |scene| runs_settled(scene, control))?;
                let text = format!("linear {}, in words {}", text(linear, &scene), text(words, &scene));
                Ok(Found::new(text, [linear, words].map(|damping| damping.map_or(f64::INFINITY, |[_, holds]| holds))))
            }));
            if scene.starts_with("conventional") {
                lines.last_mut().expect("just added").claims = "c";
            }
        }
    }
    lines
}

fn damped(scene: &str, stiffness: &str, rate: &str) -> Result<Scene, String> {
    let set = [("wall.stiffness", stiffness), ("method.sample_rate", rate), ("method.damping_format", "(0,12,8)")];
    Leaning::Push(20).scene(scene, &set)
}

fn runs_settled(scene: &Scene, control: &Control) -> Result<bool, String> {
    let cell = Cell::run(&Experiment::Axis(scene.clone()), CellLimits::UNGUARDED, control)?.ok_or("stopped")?;
    Ok(cell.outcome == OutcomeKind::Settled)
}

/// Returns two dampings within 2 %, one seen to fail and the other seen to hold. They are the first such pair of a scan
/// upwards in steps of a square root of two, narrowed by bisection. Both are 0 if no damping is needed. Returns `None`
/// if no damping up to 32 mN·m·s/rad holds. A damping that holds between two steps of the scan is missed.
fn least(scene: &Scene, mut stable: impl FnMut(&Scene) -> Result<bool, String>) -> Result<Option<[f64; 2]>, String> {
    let mut holds = |damping: f64| {
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
fn text(damping: Option<[f64; 2]>, scene: &Scene) -> String {
    let realised = scene.words().map(|words| words.realised);
    let Some([fails, holds]) = damping else { return "none does".into() };
    if holds == 0.0 {
        return "0".into();
    }
    let decimals = (2 - (holds * 1e3).log10().floor() as i32).max(0) as usize;
    let seen = format!("{:.decimals$} to {:.decimals$} mN.m.s/rad", fails * 1e3, holds * 1e3);
    realised.map_or(seen.clone(), |realised| {
        let quantum = realised.torque_quantum_nm / realised.count_rad;
        format!("{seen} (gain {:.1})", holds * realised.sample_rate_hz / quantum)
    })
}
