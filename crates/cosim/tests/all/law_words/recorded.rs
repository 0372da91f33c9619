//! Runs of scenes in words, recorded sample by sample as a law sees them.

use std::fmt::Write as _;

use hpu_cosim::scene::Scene;
use hpu_cosim::{AxisSimulation, Control, Driver, Simulation, SplitMix64, Wired};
use hpu_datapath::Generic;
use hpu_signal::{Cycle, Format, Observe};

/// The greatest torque of 12 bits, in PWM counts.
pub const TOP: f64 = 4095.0;
/// The greatest error of the floats: 1e5 roundings by half an ulp, 2^-31, of numbers below 2^22.
pub const FLOATS: f64 = 5e-5;

/// A motor that a hand pushes into a wall and pulls out of it at several places, beginning outside.
pub struct Push {
    /// The lines of `[method]`.
    pub method: &'static str,
    /// The wall's stiffness and damping; none where the method has no wall.
    pub wall: &'static str,
    /// The sample rate in Hz.
    pub rate_hz: u32,
    /// Samples of a run.
    pub samples: u32,
}

/// One sample: the inputs of the law and its results.
#[derive(Clone, Copy)]
pub struct Sample {
    /// Counts beyond the surface.
    pub delta: f64,
    /// Counts since the sample before.
    pub motion: f64,
    /// The torque in PWM counts.
    pub torque: f64,
    /// The torque behind the shaper, in PWM counts.
    pub shaped: f64,
    /// The law's memory, in its LSB.
    pub memory: f64,
}

impl Sample {
    /// Returns whether the sample touched the wall.
    pub fn touches(&self) -> bool {
        self.delta >= 0.0
    }
}

/// A run in words. Units: the count, the PWM count and the sample, in which the words of constants have their own
/// values.
pub struct Recorded {
    /// PWM counts per count.
    pub stiffness: f64,
    /// PWM counts per count in a sample of the velocity.
    pub damping: f64,
    /// The wall's stiffness as asked for, in PWM counts per count.
    pub asked: f64,
    /// The start of the device, in counts beyond the surface.
    pub start: f64,
    /// The samples.
    pub samples: Vec<Sample>,
    generics: Vec<(&'static str, Generic)>,
}

impl Recorded {
    /// Returns a generic of the loop.
    pub fn generic(&self, name: &str) -> f64 {
        let value = self.generics.iter().find(|(found, _)| *found == name).expect("a generic").1;
        if let Generic::Integer(value) = value { value as f64 } else { panic!("{name} is no number") }
    }
}

/// The nets before every sample edge.
struct Boundaries {
    period: u64,
    next: u64,
    last: Vec<i64>,
    rows: Vec<Vec<i64>>,
}

impl Boundaries {
    fn until(&mut self, edge: u64) {
        while self.next < edge {
            self.rows.push(self.last.clone());
            self.next += self.period;
        }
    }
}

impl Observe for Boundaries {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        self.until(cycle.0);
        self.last.clear();
        self.last.extend_from_slice(words);
    }

    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

impl Push {
    fn text(&self, seed: u64) -> String {
        let Self { method, wall, rate_hz, samples } = self;
        let mut random = SplitMix64::new(seed);
        let duration_s = f64::from(*samples) / f64::from(*rate_hz);
        let mut path = String::from("[0, 0]");
        for point in 1..=(duration_s / 0.02) as u32 {
            write!(path, ", [{}, {}]", f64::from(point) * 0.02, random.below(300) as f64 * 1e-3)
                .expect("a string grows");
        }
        let wall = match *wall {
            "" => String::new(),
            gains => format!("[wall]\nposition = \"0.1 rad\"\n{gains}\n"),
        };
        format!(
            "about = \"A motor pushed about\"\n[device]\nkind = \"motor\"\nmotor = \"vasudevan_2007\"\n\
             [clock]\nfrequency = \"5 MHz\"\n\
             [hand]\nkind = \"spring_damper\"\nstiffness = \"0.3 N.m/rad\"\ndamping = \"0.1 mN.m.s/rad\"\n\
             path = [{path}]\n\
             {wall}[run]\nduration = \"{duration_s} s\"\n\
             [method]\nsample_rate = \"{rate_hz} Hz\"\n{method}\n"
        )
    }

    /// Runs the motion in words.
    pub fn run(&self, seed: u64) -> Recorded {
        let text = self.text(seed);
        let scene = Scene::parse("push.toml", &text, &[], &mut |_| unreachable!("no file is named"));
        let scene = scene.unwrap_or_else(|error| panic!("{error}"));
        let simulation = AxisSimulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
        let (words, nets) = (simulation.words(), simulation.nets());
        let period = words.period.unsigned_abs();
        let mut seen = Boundaries { period, next: 0, last: Vec::new(), rows: Vec::new() };
        let run = simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut seen, &Control::default());
        assert_eq!(run.edges, period * u64::from(self.samples));
        seen.until(run.edges + 1);
        let [delta, torque, shaped, memory] =
            ["delta", "torque", "shaped", "memory"].map(|name| nets.iter().position(|net| net.name == name).unwrap());
        // Reset has counted nothing and read no reference; the first edge has.
        let at_start = Format::signed(words.config.position_width).wrap((-words.reference).into());
        seen.rows[0][delta] = at_start;
        let start = at_start as f64;
        let mut before = start;
        // A sample edge reads the nets before it; its results are there before the next sample edge.
        let samples = seen.rows.windows(2).map(|pair| {
            let at = |row: usize, net: usize| pair[row][net] as f64;
            let motion = at(0, delta) - std::mem::replace(&mut before, at(0, delta));
            Sample { delta: at(0, delta), motion, torque: at(1, torque), shaped: at(1, shaped), memory: at(1, memory) }
        });
        let unit = words.realised.torque_quantum_nm / words.realised.count_rad;
        Recorded {
            stiffness: words.stiffness as f64 * words.config.stiffness.lsb(),
            damping: words.damping as f64 * words.config.damping.lsb(),
            asked: scene.wall.stiffness_nm_per_rad / unit,
            start,
            samples: samples.collect(),
            generics: simulation.wiring().block().generics(),
        }
    }
}

/// The differences between words and law so far.
#[derive(Default)]
pub struct Tally {
    /// Number of samples compared with the law.
    pub held: u64,
    touching: u64,
    worst: f64,
    widest: f64,
    sum: f64,
}

impl Tally {
    /// The widest useful bound, in PWM counts: a fortieth of the greatest torque.
    pub const WIDE: f64 = 100.0;

    /// Compares words with the law; a comparison within a wider bound than `WIDE` does not count.
    pub fn hold(&mut self, sample: &Sample, word: f64, law: f64, bound: f64) {
        let off = (word - law).abs();
        let Sample { delta, motion, .. } = sample;
        assert!(
            off <= bound + FLOATS,
            "sample {}: {word} instead of {law}, bound {bound} ({delta}, {motion})",
            self.held
        );
        if bound > Self::WIDE {
            return;
        }
        self.held += 1;
        self.touching += u64::from(sample.touches());
        self.worst = self.worst.max(off);
        self.widest = self.widest.max(bound);
        self.sum += bound;
    }

    /// Checks that 1e5 samples were compared, a fifth of them inside the wall.
    pub fn done(&self, name: &str) {
        let Self { held, touching, worst, widest, sum } = self;
        println!(
            "{name}: {held} samples, {touching} in contact, off by {worst:.3} PWM counts, bounds to {widest:.3}, \
             mean {:.3}",
            sum / *held as f64
        );
        assert!(*held >= 100_000 && *touching >= held / 5, "{held} samples, {touching} in contact");
    }
}
