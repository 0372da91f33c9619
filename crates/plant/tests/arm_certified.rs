//! The arm's encoder edges against a judge of some 30 digits.

mod arm_judge;

use arm_judge::Judge;
use arm_judge::twice::Twice;
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
    segments: u64,
    /// The greatest difference of angles seen, and the least distance of an encoder edge's angles from their limit.
    worst_rad: f64,
    nearest_rad: f64,
}

/// Runs an arm under springs and pushes for so many encoder edges, the judge beside it.
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
                found.worst_rad = found.worst_rad.max((now[joint] - Twice::from(angles[joint])).hi.abs());
                let right = within(&bands[joint], before[joint]);
                if bands[joint].left_by(angles[joint]) {
                    let limit = if angles[joint] < bands[joint].low { bands[joint].low } else { bands[joint].high };
                    for angle in [before[joint], now[joint]] {
                        found.nearest_rad = found.nearest_rad.min((angle - limit.into()).hi.abs());
                    }
                    bands[joint] = band(angles[joint]);
                    found.encoder_edges += 1;
                }
                found.wrong += usize::from(!(right && within(&bands[joint], now[joint])));
            }
        }
    }
    Found { clock_edges: edge, mode_changes: motion.mode_changes(), segments: motion.segments(), ..found }
}

fn models() -> [ArmModel; 4] {
    let rigid = ArmModel::premium_1_5().balanced().with_tip_mass(0.015);
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
        let start = std::time::Instant::now();
        let found = judged(model, 20_000);
        eprintln!("{found:?} {:?}", start.elapsed());
    }
}
