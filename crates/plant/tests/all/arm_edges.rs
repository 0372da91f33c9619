//! The arm as a clock sees it: the right edges, and the same bits by stepping and by leaping.

use crate::arms::rubbing_1_5;
use hpu_plant::Band;
use hpu_plant::arm::{Arm, ArmModel, ArmMotion, ArmState, Transmission};

const EDGE_S: f64 = 20e-9;
/// One count of an encoder of 4000 behind a ratio of 7.
const COUNT_RAD: f64 = std::f64::consts::TAU / 28_000.0;

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

/// Returns torques of springs that read counts, with a push that changes every few ms.
fn torques_nm(bands: &[Band; 3], sample: u64) -> [f64; 3] {
    let phase = (sample / 40) as f64;
    let push = [0.2 * (phase * 1.7).sin(), 0.15 * (phase * 2.3).sin(), 0.1 * (phase * 0.9).cos()];
    std::array::from_fn(|i| push[i] - 0.6 * bands[i].low)
}

/// Returns every change of a count, and the final state, in a loop closed every `period` edges, by `step` or by
/// leaping.
fn run(arm: &Arm, period: u64, samples: u64, leap: bool) -> (Vec<(u64, usize, i64)>, ArmState, [u64; 2]) {
    let mut motion = ArmMotion::new(arm, [0.01, 0.2, 0.3], [0.0; 3]);
    let mut bands = motion.step(0).map(band);
    let mut edges = Vec::new();
    let mut edge = 0;
    for sample in 0..samples {
        motion.drive(edge, torques_nm(&bands, sample));
        let next = edge + period;
        while edge < next {
            edge = if leap { motion.next_event(edge, next, &bands).unwrap_or(next) } else { edge + 1 };
            let angles = motion.step(edge);
            for joint in 0..3 {
                if bands[joint].left_by(angles[joint]) {
                    bands[joint] = band(angles[joint]);
                    edges.push((edge, joint, (bands[joint].low / COUNT_RAD).round() as i64));
                }
            }
        }
    }
    (edges, motion.state(edge), [motion.mode_changes(), motion.segments()])
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
fn step_by_step_and_leaping_give_the_same_bits() {
    for model in models() {
        let arm = Arm::new(model, EDGE_S).unwrap();
        let (stepped, leaped) = (run(&arm, 5000, 400, false), run(&arm, 5000, 400, true));
        assert!(!stepped.0.is_empty());
        assert_eq!(stepped, leaped);
    }
}

/// Returns, for a tolerance, the first encoder edges, the arm's bound of its angles' error at the last of them, and the
/// number of near ones.
fn encoder_edges(model: ArmModel, tolerance: f64, at_least: usize) -> (Vec<(u64, usize)>, f64, usize) {
    let arm = Arm::new(model, EDGE_S).unwrap().with_tolerance(tolerance);
    let mut motion = ArmMotion::new(&arm, [0.01, 0.2, 0.3], [0.0; 3]);
    let mut bands = motion.step(0).map(band);
    let (mut edges, mut near) = (Vec::new(), 0);
    let mut edge = 0;
    for sample in 0.. {
        if edges.len() >= at_least {
            break;
        }
        let phase = f64::from(sample / 5);
        let push = [0.3 * (phase * 1.7).sin(), 0.3 * (phase * 2.3).sin(), 0.2 * (phase * 0.9).cos()];
        // The torques are the same to the bit as long as the counts are the same.
        motion.drive(edge, std::array::from_fn(|i| push[i] - 2.0 * bands[i].low));
        let next = edge + 50_000;
        while edge < next {
            edge = motion.next_event(edge, next, &bands).unwrap_or(next);
            let angles = motion.step(edge);
            for joint in 0..3 {
                if bands[joint].left_by(angles[joint]) {
                    let limit = if angles[joint] < bands[joint].low { bands[joint].low } else { bands[joint].high };
                    near += usize::from(motion.is_near(edge, joint, limit));
                    bands[joint] = band(angles[joint]);
                    edges.push((edge, joint));
                }
            }
        }
    }
    (edges, motion.error_rad(edge), near)
}

/// 10^5 encoder edges of each model over 10^8 clock edges and more. `arm_certified` checks the first of them with 30
/// digits.
#[test]
fn halving_the_tolerance_moves_no_encoder_edge_nor_does_making_it_next_to_nothing() {
    for model in models() {
        let (usual, error_rad, near) = encoder_edges(model, 1e-16, 100_000);
        assert!(usual.last().unwrap().0 > 80_000_000, "{:?}", usual.last());
        // The error bound is small against a turn at 1 rad/s in one clock, and few crossings come that near to a limit.
        // Stiff transmissions have the most of these, because the estimate ignores their damping.
        assert!(error_rad < 1e-3 * EDGE_S && near * 100 < usual.len(), "{error_rad} rad, {near} near");
        for tolerance in [0.5e-16, 1e-20] {
            let (other, ..) = encoder_edges(model, tolerance, 100_000);
            let wrong = usual.iter().zip(&other).filter(|(a, b)| a != b).count();
            assert_eq!((wrong, usual.len()), (0, other.len()), "{tolerance}");
        }
    }
}

#[test]
fn halving_the_tolerance_halves_the_error_or_better() {
    let model = ArmModel { coulomb_nm: [0.0; 3], ..rubbing_1_5() };
    let at = |tolerance: f64| {
        let arm = Arm::new(model, EDGE_S).unwrap().with_tolerance(tolerance);
        ArmMotion::new(&arm, [0.1, 0.2, 0.4], [2.0, -1.0, 3.0]).step(25_000_000)
    };
    let reference = at(1e-18);
    let error = |tolerance: f64| {
        let found = at(tolerance);
        (0..3).map(|i| (found[i] - reference[i]).abs()).fold(0.0, f64::max)
    };
    let mut tolerance = 1e-2;
    let mut errors = Vec::new();
    while tolerance > 1e-10 {
        errors.push(error(tolerance));
        tolerance *= 0.0625;
    }
    // Four halvings between neighbours; steps are whole numbers, so single halvings are uneven.
    let (first, last) = (errors[0], *errors.last().unwrap());
    let halvings = 4 * (errors.len() - 1) as i32;
    assert!(first > 1e-9 && last < first * 0.5_f64.powi(halvings), "{errors:?}");
}
