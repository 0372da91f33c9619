//! The arm's encoder edges against a judge of some 30 digits, which gets the same torques at the same edges
//! (`arm_judge`: another form of the equations, another precision, another code).
//!
//! Certified for each of four models (rigid, one joint, lagging amplifiers, flexible transmissions too; all with stick
//! and slip): 25,000 encoder edges lie on the right one of some 10^7 to 10^8 clock edges, none is near to another, and
//! the error stays below the bound that the arm itself returns. `arm_edges` goes on from there: 10^5 encoder edges of
//! each model, and the tolerance halved.

use crate::arm_judge::Judge;
use crate::arm_judge::twice::Twice;
use crate::arms::rubbing_1_5;
use hpu_plant::Band;
use hpu_plant::arm::{Arm, ArmModel, ArmMotion, Transmission};

const EDGE_S: f64 = 20e-9;
/// One count of an encoder of 4000 behind a ratio of 7.
const COUNT_RAD: f64 = std::f64::consts::TAU / 28_000.0;
const START_RAD: [f64; 3] = [0.01, 0.2, 0.3];
/// Edges between changes of the drive: 1 ms.
const PERIOD: u64 = 50_000;

fn band(angle_rad: f64) -> Band {
    let mut count = (angle_rad / COUNT_RAD).floor();
    while angle_rad < count * COUNT_RAD {
        count -= 1.0;
    }
    while angle_rad >= (count + 1.0) * COUNT_RAD {
        count += 1.0;
    }
    Band { low: count * COUNT_RAD, high: (count + 1.0) * COUNT_RAD, open: true }
}

fn within(band: &Band, angle: Twice) -> bool {
    angle >= Twice::from(band.low) && angle < Twice::from(band.high)
}

#[derive(Debug, Default)]
struct Found {
    clock_edges: u64,
    encoder_edges: usize,
    wrong: usize,
    mode_changes: u64,
    /// Encoder edges that the motion itself reports as near.
    near: usize,
    /// The greatest error of an angle at an encoder edge, in rad and as a share of the bound that the motion returns.
    error_rad: f64,
    share: f64,
    said_rad: f64,
    /// The least distance of an encoder edge's angles from their limit.
    nearest_rad: f64,
}

/// Runs an arm under springs and pushes for this number of encoder edges, with the judge beside it.
fn judged(model: ArmModel, at_least: usize) -> Found {
    let arm = Arm::new(model, EDGE_S).unwrap();
    let mut motion = ArmMotion::new(&arm, START_RAD, [0.0; 3]);
    let mut judge = Judge::new(model, START_RAD);
    let time = |edge: u64| Twice::from(edge as f64) * EDGE_S;
    let mut bands = motion.step(0).map(band);
    let mut found = Found { nearest_rad: f64::INFINITY, ..Found::default() };
    let mut edge = 0;
    let mut looked = (0, START_RAD.map(Twice::from));
    while found.encoder_edges < at_least {
        let state = motion.state(edge);
        let phase = (edge / (5 * PERIOD)) as f64;
        let push = [0.3 * (phase * 1.7).sin(), 0.3 * (phase * 2.3).sin(), 0.2 * (phase * 0.9).cos()];
        let drive = std::array::from_fn(|i| push[i] - 2.0 * state.angles_rad[i]);
        motion.drive(edge, drive);
        judge.drive(time(edge), drive);
        let next = edge + PERIOD;
        while edge < next {
            edge = motion.next_event(edge, next, &bands).unwrap_or(next);
            if looked.0 + 1 < edge {
                looked = (edge - 1, judge.angles(time(edge - 1)));
            }
            let (before, now, angles) = (looked.1, judge.angles(time(edge)), motion.step(edge));
            looked = (edge, now);
            for joint in 0..3 {
                let right = within(&bands[joint], before[joint]);
                if bands[joint].left_by(angles[joint]) {
                    let limit = if angles[joint] < bands[joint].low { bands[joint].low } else { bands[joint].high };
                    for angle in [before[joint], now[joint]] {
                        found.nearest_rad = found.nearest_rad.min((angle - limit.into()).hi.abs());
                    }
                    found.near += usize::from(motion.is_near(edge, joint, limit));
                    let above = motion.above_rad(edge, joint, limit);
                    let error_rad = (now[joint] - limit.into() - above.into()).hi.abs();
                    found.error_rad = found.error_rad.max(error_rad);
                    found.share = found.share.max(error_rad / motion.error_rad(edge));
                    found.said_rad = motion.error_rad(edge);
                    bands[joint] = band(angles[joint]);
                    found.encoder_edges += 1;
                }
                found.wrong += usize::from(!(right && within(&bands[joint], now[joint])));
            }
        }
    }
    Found { clock_edges: edge, mode_changes: motion.mode_changes(), ..found }
}

fn models() -> [ArmModel; 4] {
    let rigid = rubbing_1_5().balanced().with_tip_mass(0.015);
    let soft = Some(Transmission { stiffness_nm_per_rad: 60.0, damping_nm_s_per_rad: 2e-3 });
    [
        rigid,
        ArmModel { free: [false, true, false], ..rigid },
        ArmModel { amplifier_s: 2e-4, ..rigid },
        ArmModel { transmission: [soft; 3], amplifier_s: 2e-4, ..rigid },
    ]
}

#[test]
fn encoder_edges_fall_on_the_clock_edges_that_thirty_digits_put_them_on() {
    for model in models() {
        let found = judged(model, 25_000);
        assert_eq!(found.wrong, 0, "{found:?}");
        // No crossing comes as near to its limit as the arm's error, so none was decided by luck.
        assert!(found.nearest_rad > 100.0 * found.error_rad, "{found:?}");
        assert_eq!(found.near, 0, "{found:?}");
        // The arm's own bound of its error holds, and is small against the turn of a joint at 1 rad/s in one clock.
        assert!(found.share <= 1.0 && found.said_rad < 1e-4 * EDGE_S, "{found:?}");
        assert!(found.mode_changes > 10 && found.clock_edges > 10_000_000, "{found:?}");
    }
}

#[test]
fn an_edge_at_a_limit_is_near_and_one_beside_it_is_not() {
    let [model, ..] = models();
    let arm = Arm::new(model, EDGE_S).unwrap();
    let mut motion = ArmMotion::new(&arm, START_RAD, [0.0; 3]);
    motion.drive(0, [0.3, 0.2, -0.2]);
    for sample in 1..200 {
        let edge = sample * PERIOD;
        let (before, angles) = (motion.step(edge - 1), motion.step(edge));
        for joint in 0..3 {
            let (at, turned) = (angles[joint], angles[joint] - before[joint]);
            assert!(motion.above_rad(edge, joint, at) >= 0.0 && motion.above_rad(edge, joint, at.next_up()) < 0.0);
            // At the limit now, at the limit one edge ago, half way between.
            assert!(motion.is_near(edge, joint, at) && motion.is_near(edge, joint, before[joint]));
            assert!(!motion.is_near(edge, joint, at - 0.5 * turned), "{turned} rad a clock");
        }
    }
}
