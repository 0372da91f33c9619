//! The amplifier's lag that gives PMOS-1 the published limit, for each assumed transmission.
//!
//! Neither the lag nor the transmission's stiffness is published. Each line runs the drop test on PMOS-1 with one
//! transmission and every lag of a grid. It tells with which lags the stiffest passive wall is where the paper saw it.

use hpu_cosim::scene::{Direction, Platform};
use hpu_cosim::{Control, PlainName};

use super::claims::PMOS_1;
use super::trial::{Verdict, run_trial};
use super::{LAG, Rung, Study, TITLE_OF_LAG, TRIALS, TrialSetup};
use crate::Error;
use crate::studies::Variables;
use crate::studies::comparison::{Claim, Comparison, Found, Line, measure};
use crate::studies::summing::Statement;

/// Lags that are tried, in hundredths of a millisecond: 0 to 0.80 ms in steps of 0.05.
pub const LAGS_10_US: [u32; 17] = [0, 5, 10, 15, 20, 25, 30, 35, 40, 45, 50, 55, 60, 65, 70, 75, 80];

/// Transmissions that are assumed: a name, and the stiffness at the tip as a scene writes it.
const TRANSMISSIONS: [(&str, &str); 7] = [
    ("rigid", "0"),
    ("14 kN/m", "14 kN/m"),
    ("7 kN/m", "7 kN/m"),
    ("5 kN/m", "5 kN/m"),
    ("3.5 kN/m, as shipped", "3.5 kN/m"),
    ("3 kN/m", "3 kN/m"),
    ("2 kN/m", "2 kN/m"),
];

/// Walls at and beyond the limit that the paper gives, in N/m.
const ROWS_N_PER_M: [f64; 3] = [750.0, 1000.0, 1250.0];

/// The part of the arm that moves: heading, value of `model.joints`, axes that are judged.
const ARMS: [(&str, &str, &[Direction]); 2] = [
    ("The joint under test alone, as on the ladder; lags in ms that fit along x, y and z", "tested", &Direction::ALL),
    (
        "All three joints, as the scene is shipped; lags in ms that fit along y and z (along x the free arm creeps, \
         and passes far stiffer walls)",
        "all",
        &[Direction::Y, Direction::Z],
    ),
];

/// Returns the comparison, with a line for each transmission.
pub fn comparison() -> Comparison {
    let mut lines = Vec::new();
    for (group, joints, axes) in ARMS {
        for (name, stiffness) in TRANSMISSIONS {
            lines.push(Line {
                group,
                what: name.into(),
                published: "",
                claims: "a",
                figures: Vec::new(),
                vars: Variables::default(),
                shown: None,
                measure: measure(move |control| fitting(joints, axes, stiffness, &LAGS_10_US, control)),
            });
        }
    }
    let statement = Statement {
        letter: "a",
        paper: PMOS_1.0,
        place: PMOS_1.1,
        means: "no lag is published: the lags above are fitted to this very claim, to each transmission its own",
    };
    Comparison {
        name: PlainName::near(LAG),
        title: TITLE_OF_LAG,
        lines,
        claims: vec![Claim { statement, holds: Vec::new(), by: None }],
        notes: vec![
            "The paper publishes neither the lag nor the transmission. The lag is identified together with the \
             transmission that is assumed: the softer the transmission, the longer the lag. The shipped scene takes \
             3.5 kN/m (general knowledge of the device) and 0.4 ms.",
            "Lags are tried from 0 to 0.80 ms in steps of 0.05 ms, walls of 750, 1000 and 1250 N/m, three trials each, \
             which all have to be passive. All trials are of one seed: \
             at the ends of an interval another seed may differ.",
        ],
    }
}

/// Returns the lags that fit. The figures are the least and the greatest lag, in ms, at which PMOS-1 is passive at
/// 750 N/m and not at 1000 N/m.
///
/// # Errors
///
/// Returns why a trial could not be run.
pub fn fitting(
    joints: &str,
    axes: &[Direction],
    stiffness: &str,
    lags_10_us: &[u32],
    control: &Control,
) -> Option<Result<Found, Error>> {
    let (mut narrow, mut wide) = (Vec::new(), Vec::new());
    for &lag in lags_10_us {
        let set = [
            ("model.joints", joints.to_string()),
            ("model.amplifier_lag", format!("{:.2} ms", f64::from(lag) / 100.0)),
            ("model.transmission_stiffness", stiffness.to_string()),
        ];
        let set = set.map(|(key, value)| (key.to_string(), value)).to_vec();
        let study = Study { set, ..Study::whole(&[Rung::SHIPPED]) };
        // Number of passive rows, counted from the softest: along the axis with the fewest, and along the axis with the
        // most.
        let (mut fewest, mut most) = (ROWS_N_PER_M.len(), 0);
        for &axis in axes {
            let passive = match passive_rows(&study, axis, control)? {
                Ok(passive) => passive,
                Err(reason) => return Some(Err(reason)),
            };
            (fewest, most) = (fewest.min(passive), most.max(passive));
        }
        if fewest >= 1 && most <= 2 {
            wide.push(lag);
            if most == 1 {
                narrow.push(lag);
            }
        }
    }
    let told = |lags: &[u32]| {
        let lags: Vec<_> = lags.iter().map(|lag| format!("{:.2}", f64::from(*lag) / 100.0)).collect();
        if lags.is_empty() { "none".to_string() } else { lags.join(" ") }
    };
    let text = format!("passive at 750, not at 1000 N/m: {}; at 750, not at 1250: {}", told(&narrow), told(&wide));
    let ends = [narrow.first(), narrow.last()].map(|lag| lag.map_or(f64::INFINITY, |lag| f64::from(*lag) / 100.0));
    Some(Ok(Found::new(text, ends)))
}

/// Returns how many of the rows, from the softest on, are passive in all trials.
fn passive_rows(study: &Study, axis: Direction, control: &Control) -> Option<Result<usize, Error>> {
    for (row, stiffness_n_per_m) in ROWS_N_PER_M.into_iter().enumerate() {
        for trial in 1..=TRIALS {
            let seed = study.first_seed;
            let point = TrialSetup { rung: 0, axis, platform: Platform::Pmos1, stiffness_n_per_m, seed, trial };
            match run_trial(&study.overrides(&point), control) {
                Ok(None) => return None,
                Ok(Some(trial)) if matches!(trial.verdict, Verdict::Passive { .. }) => {}
                Ok(Some(_)) => return Some(Ok(row)),
                Err(reason) => return Some(Err(reason)),
            }
        }
    }
    Some(Ok(ROWS_N_PER_M.len()))
}
