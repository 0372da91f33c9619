//! Seeded random motion: tries the datapath on motions that no scene contains.
//!
//! The loop is open: the encoders follow a random, band-limited motion, whatever the gates do. A walk is a sum of sines
//! of up to [`BAND_HZ`]. It is reflected at both ends of its range, so that it reaches every count in the range.

use hpu_cosim::scene::Experiment;
use hpu_cosim::{Control, Simulation, SplitMix64, Wired, WiredSimulation};
use hpu_signal::{Cycle, Observe, SignalUse};

use super::measured::{Measured, beside, rows, simulation};
use super::{Device, Reach};
use crate::Error;

/// The highest frequency of a walk, in hertz: a hand can follow it.
const BAND_HZ: f64 = 10.0;
/// The number of sines in a walk.
const SINES: usize = 8;
/// The time over which a walk is straight, in seconds.
const STRAIGHT_S: f64 = 1e-3;

/// A random motion of one encoder, in counts from its start.
#[derive(Clone, Debug)]
pub struct Walk {
    /// Size in counts, frequency in rad/s, phase.
    sines: [[f64; 3]; SINES],
    low: f64,
    high: f64,
    start: f64,
}

impl Walk {
    /// Makes a walk that begins at 0, stays between two counts and moves at most `most_per_s` counts a second.
    #[must_use]
    pub fn new(random: &mut SplitMix64, [low, high]: [f64; 2], most_per_s: f64) -> Self {
        let mut unit = || random.below(1 << 53) as f64 / (1u64 << 53) as f64;
        // The range is passed twice if all sines add up.
        let size = 2.0 * (high - low) / SINES as f64;
        let mut sines: [[f64; 3]; SINES] = std::array::from_fn(|_| {
            [size, 2.0 * std::f64::consts::PI * BAND_HZ * unit(), 2.0 * std::f64::consts::PI * unit()]
        });
        let speed: f64 = sines.iter().map(|[size, rad_per_s, _]| size * rad_per_s).sum();
        if speed > most_per_s {
            sines.iter_mut().for_each(|sine| sine[1] *= most_per_s / speed);
        }
        let mut walk = Self { sines, low, high, start: 0.0 };
        walk.start = walk.sum(0.0);
        walk
    }

    fn sum(&self, time_s: f64) -> f64 {
        self.sines.iter().map(|[size, rad_per_s, phase]| size * libm::sin(rad_per_s * time_s + phase)).sum()
    }

    /// Returns the position at a time, in counts.
    pub fn at(&self, time_s: f64) -> f64 {
        let range = self.high - self.low;
        let along = (self.sum(time_s) - self.start - self.low).rem_euclid(2.0 * range);
        self.low + if along > range { 2.0 * range - along } else { along }
    }
}

/// Turns the encoders of a scene at random for `seconds` and returns the ranges and losses of every signal; `None` when
/// `control` stopped it.
///
/// Each encoder moves within its [`reach`](Device::reaches).
///
/// # Errors
///
/// Why the scene cannot be run, or that its loop is not in words or no device could move.
pub fn random(experiment: &Experiment, seconds: f64, seed: u64, control: &Control) -> Result<Option<Measured>, Error> {
    let simulation = simulation(experiment)?;
    let mut random = SplitMix64::new(seed);
    let slowest = simulation.clock().frequency_hz() as f64 / 8.0;
    let walk = |Reach { counts, most_per_s }| Walk::new(&mut random, counts, most_per_s.min(slowest));
    let walks = experiment.reaches()?.into_iter().map(walk).collect();
    let mut beside = beside(experiment, &simulation);
    let end = simulation.clock().edges(seconds);
    let clock_s = simulation.clock().period_s();
    let Some(uses) = drive(&simulation, walks, (clock_s, end), &mut beside, control) else { return Ok(None) };
    let nets: Vec<_> = simulation.wiring().nets().into_iter().zip(uses).collect();
    beside.finish(end);
    let rows = rows(&nets, &beside);
    Ok(Some(Measured {
        wiring: simulation.wiring().name(),
        rows,
        edges: end,
        motion_s: seconds,
        outcomes: Vec::new(),
        contact_shares: Vec::new(),
    }))
}

/// An encoder that follows a walk along straight pieces.
struct Encoder {
    walk: Walk,
    count: i64,
    /// The straight piece: its first edge and the position there, its slope in counts an edge, and its last edge.
    from: (u64, f64),
    slope: f64,
    until: u64,
}

impl Encoder {
    /// Returns the edge at which the count next changes, at most the end of the straight piece.
    fn next(&self) -> u64 {
        let (edge, at) = self.from;
        let bound = if self.slope > 0.0 { (self.count + 1) as f64 } else { self.count as f64 };
        let edges = (bound - at) / self.slope;
        if edges.is_finite() && edges < (self.until - edge) as f64 {
            (edge + edges.max(0.0) as u64 + 1).min(self.until)
        } else {
            self.until
        }
    }

    /// Moves to an edge, at most the next one.
    fn go(&mut self, edge: u64, clock_s: f64, straight: u64) {
        let at = self.from.1 + self.slope * (edge - self.from.0) as f64;
        // At most one count an edge, as a decoder takes them.
        self.count += (at.floor() as i64 - self.count).signum();
        if edge == self.until {
            self.from = (edge, self.walk.at(edge as f64 * clock_s));
            self.until = edge + straight;
            self.slope = (self.walk.at(self.until as f64 * clock_s) - self.from.1) / straight as f64;
        }
    }
}

/// Drives a wiring by the walks of its encoders up to the edge `end`. Returns the use of its nets; `None` when
/// `control` stopped it.
fn drive(
    simulation: &WiredSimulation,
    walks: Vec<Walk>,
    (clock_s, end): (f64, u64),
    beside: &mut super::Beside,
    control: &Control,
) -> Option<Vec<SignalUse>> {
    use std::sync::atomic::Ordering;
    let straight = (STRAIGHT_S / clock_s).ceil().max(8.0) as u64;
    let mut encoders: Vec<Encoder> = walks
        .into_iter()
        .map(|walk| {
            let mut encoder = Encoder { walk, count: 0, from: (0, 0.0), slope: 0.0, until: 0 };
            encoder.go(0, clock_s, straight);
            encoder
        })
        .collect();
    let start = simulation.closed_loop();
    let (mut wiring, mut input) = (start.wiring_copy(), start.constants());
    wiring.rest_modulator();
    wiring.reset();
    beside.nets(Cycle(0), wiring.words());
    show(&encoders, &mut input);
    let mut edge = 0;
    while edge < end {
        let quiet = wiring.quiet(&input);
        let moves = encoders.iter().map(Encoder::next).fold(u64::MAX, u64::min);
        let next = moves.max(edge + 1).min(edge.saturating_add(quiet).saturating_add(1)).min(end);
        wiring.skip(next - 1 - edge, &input);
        edge = next;
        for encoder in encoders.iter_mut().filter(|encoder| encoder.next() <= edge) {
            encoder.go(edge, clock_s, straight);
        }
        show(&encoders, &mut input);
        wiring.step(&input);
        beside.nets(Cycle(edge), wiring.words());
        control.progress.store(edge, Ordering::Relaxed);
        if control.stop.load(Ordering::Relaxed) {
            return None;
        }
    }
    Some(wiring.uses())
}

/// Writes the encoders' pins, which come first, to the inputs.
fn show(encoders: &[Encoder], input: &mut [i64]) {
    for (pins, encoder) in input.chunks_exact_mut(2).zip(encoders) {
        let lines = hpu_cosim::Pins::at(encoder.count);
        pins.copy_from_slice(&[lines.a, lines.b]);
    }
}
