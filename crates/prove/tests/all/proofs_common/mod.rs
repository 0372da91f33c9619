//! Helpers of the tests of proofs: scenes under overrides, and a shaft that moves at random within limits.

use hpu_cosim::scene::{Experiment, Scene, shipped};
use hpu_cosim::{AxisSimulation, Control, Driver, Pins, Simulation, SplitMix64, Summary, Wired};
use hpu_datapath::{LoopIn, LoopOut, Wiring};
use hpu_prove::ranges::{Bound, Proof};
use hpu_signal::{Signal, SignalUse};

/// Returns a shipped scene under overrides.
pub fn experiment(name: &str, overrides: &[(&str, &str)]) -> Experiment {
    let overrides: Vec<_> = overrides.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    let shipped = shipped().iter().find(|scene| scene.name == name).unwrap();
    shipped.parse(&overrides).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns a shipped scene of an axis under overrides.
pub fn axis(name: &str, overrides: &[(&str, &str)]) -> Scene {
    experiment(name, overrides).axis().unwrap()
}

/// Returns the summary of a complete run.
pub fn run(scene: &Scene) -> Summary {
    traced(scene).0
}

/// Returns the summary of a complete run, and the shaft's angles at the rate at which the scene records them.
pub fn traced(scene: &Scene) -> (Summary, Vec<f64>) {
    let simulation = AxisSimulation::new(scene).unwrap_or_else(|error| panic!("{error}"));
    let mut trace = simulation.trace(&[]);
    let summary = simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
    (summary, trace.angles_rad().to_vec())
}

pub fn of<'p>(proof: &'p Proof, name: &str) -> &'p Bound {
    proof.bounds.iter().find(|bound| bound.name == name).unwrap()
}

/// Returns the usage of one of the run's nets.
pub fn used(summary: &Summary, name: &str) -> SignalUse {
    summary.nets.iter().find(|net| net.signal.name == name).unwrap().usage
}

/// Asserts that a bound holds the values that were seen.
pub fn contains(bound: &Bound, signal: &Signal, usage: &SignalUse) {
    if usage.min > usage.max {
        return;
    }
    let (least, most) = (signal.format.to_f64(usage.min), signal.format.to_f64(usage.max));
    assert!(bound.min <= least && most <= bound.max, "{least} to {most}, beyond {bound:?}");
    assert!(!bound.never_overflows || usage.overflowed == 0, "overflowed {} edges: {bound:?}", usage.overflowed);
}

/// Returns the bits of the narrowest word that holds a range of values of this LSB, sign included.
pub fn bits(lsb: f64, least: f64, most: f64) -> u32 {
    let (least, most) = ((least / lsb) as i128, (most / lsb) as i128);
    let size = |value: i128| 128 - (if value < 0 { !value } else { value }).leading_zeros();
    size(least).max(size(most)) + u32::from(least < 0)
}

/// A shaft within limits of speed and angle: it moves to the directed corners first, then at random.
pub struct Wander {
    draw: SplitMix64,
    /// Position and its limits, in counts.
    at: f64,
    limits: [f64; 2],
    /// Slowest and fastest speed, in counts per clock.
    speeds: [f64; 2],
    speed: f64,
    left: u64,
    /// Number of clocks from end to end, and a few samples more.
    crossing: u64,
    corners: usize,
}

impl Wander {
    /// Returns a shaft that starts at the scene's initial angle.
    pub fn new(scene: &Scene, proof: &Proof, seed: u64) -> Self {
        let limit = |name: &str| proof.limits.iter().find(|limit| limit.name == name).unwrap();
        let (count, clock_s) = (scene.encoder.count_rad(), scene.clock.period_s());
        let (speed, angle) = (limit("speed"), limit("angle"));
        let speeds = [speed.min, speed.max].map(|speed| speed / count * clock_s);
        let limits = [angle.min, angle.max].map(|angle| angle / count);
        let at = scene.initial_angle_rad() / count;
        let slowest = speeds[1].min(-speeds[0]);
        let crossing = ((limits[1] - limits[0]) / slowest) as u64 + 3 * scene.period_clocks();
        Self { draw: SplitMix64::new(seed), at, limits, speeds, speed: 0.0, left: 16, crossing, corners: 0 }
    }

    fn uniform(&mut self) -> f64 {
        (self.draw.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns the pins after one more clock.
    pub fn step(&mut self) -> Pins {
        if self.left == 0 {
            self.corners += 1;
            let [slow, fast] = self.speeds;
            (self.speed, self.left) = match self.corners {
                // At full speed to both ends and back, and from end to end again.
                corner @ 1..6 => (if corner % 2 == 1 { fast } else { slow }, self.crossing),
                _ => {
                    let share = self.uniform();
                    let speed = match self.draw.next_u64() % 8 {
                        0 => 0.0,
                        1 => slow,
                        2 => fast,
                        3 => 0.01 * (slow + share * (fast - slow)),
                        _ => slow + share * (fast - slow),
                    };
                    (speed, 1 + self.draw.next_u64() % (self.crossing / 10))
                }
            };
        }
        self.left -= 1;
        self.at = (self.at + self.speed).clamp(self.limits[0], self.limits[1]);
        Pins::at(self.at.floor() as i64)
    }
}

/// Ticks a wiring under a wandering shaft, and passes its words on after every edge.
pub fn wander<W>(
    mut wiring: W,
    input: LoopIn<i64>,
    mut shaft: Wander,
    ticks: u64,
    mut see: impl FnMut(&[i64]),
) -> Vec<SignalUse>
where
    W: Wiring<In<i64> = LoopIn<i64>, Out<i64> = LoopOut<i64>>,
{
    wiring.reset();
    let place = |pins: Pins| LoopIn { a_pin: pins.a, b_pin: pins.b, ..input };
    for _ in 0..ticks {
        wiring.tick(place(shaft.step()));
        see(wiring.words());
    }
    wiring.uses()
}
