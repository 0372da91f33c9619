//! What was run, and what it says of narrower widths.
//!
//! A run is a function of the modulator's width and of the gains' *values*: a product is `floor(penetration k)`, and
//! the same for `k` written with more fraction bits or more integer bits. So formats that hold the same two gains are
//! one [`Gains`], and one run.
//!
//! **Narrower words, the same run.** Let a run with a position of `P` bits and a velocity of `V` keep `delta` within
//! `P' <= P` bits, every difference of two samples within `P'` bits, and the velocity, which never saturates, within
//! `V' <= V`. Then the run with `P'` and `V'` has the same motion, `delta`, velocity and torque at every edge. By
//! induction over the edges: while the motion is the same, the narrow counter is the wide one modulo `2^P'`, and so are
//! the wall's reference, `delta` and the difference modulo `2^P'`, read as two's complement; what lies within `P'` bits
//! is its own residue. So both are the same numbers; the velocity is the same difference (scaled alike), and fits. All
//! that follows (contact, penetration, products, torque, pins) is a function of `delta`, the velocity and the gains;
//! hence the motion is the same to the next edge.
//!
//! The difference of two samples is a difference of two values of `delta`, from reset on, so it fits where `delta`'s
//! whole range is less than half of the counter's; otherwise where the velocity, not rescaled, is that difference and
//! fits.

use std::collections::BTreeMap;

use hpu_signal::Format;

/// A gain's value: `word / 2^frac`, in lowest terms.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct Gain {
    pub word: i128,
    pub frac: u32,
}

impl Gain {
    pub fn new(word: i128, frac: u32) -> Self {
        let common = if word == 0 { frac } else { word.trailing_zeros().min(frac) };
        Self { word: word >> common, frac: frac - common }
    }

    /// A format that holds it, of two bits at least.
    pub fn format(self) -> Format {
        let bits = (128 - self.word.leading_zeros()).max(2).max(self.frac) as i32;
        Format::new(false, bits - self.frac as i32, self.frac as i32).expect("a gain's word has 32 bits at most")
    }
}

/// All that a run is a function of, but for position and velocity. Runs of different scenes say nothing of each other.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct Gains {
    /// Which scene, by its index.
    pub case: usize,
    pub pwm: u32,
    pub stiffness: Gain,
    pub damping: Gain,
}

/// Widths of position and velocity.
pub(super) type Depth = (u32, u32);

/// What a run said.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Ran {
    /// Whether it settled.
    pub settled: bool,
    /// Error of its outputs against the reference's, which stands for something at the scene's own stiffness alone.
    pub error: f64,
    /// Least and greatest `delta`.
    pub delta: (i64, i64),
    /// Least and greatest velocity; none when it saturated.
    pub velocity: Option<(i64, i64)>,
    /// Whether velocities are rescaled, so that they do not tell the difference of two samples.
    pub rescaled: bool,
}

fn fits((least, greatest): (i64, i64), bits: u32) -> bool {
    let format = Format::signed(bits);
    format.holds(least.into()) && format.holds(greatest.into())
}

impl Ran {
    /// Whether a run of at most these widths is the same.
    fn covers(&self, (position, velocity): Depth) -> bool {
        let difference = self.delta.1 - self.delta.0;
        self.velocity.is_some_and(|range| {
            let sampled = fits((-difference, difference), position) || (!self.rescaled && fits(range, position));
            fits(self.delta, position) && fits(range, velocity) && sampled
        })
    }

    /// As a line of a journal.
    pub fn line(&self) -> String {
        let velocity = self.velocity.map_or(String::from(","), |(least, most)| format!("{least},{most}"));
        let Self { settled, error, delta: (least, most), rescaled, .. } = self;
        format!("{settled},{error:e},{least},{most},{rescaled},{velocity}")
    }

    /// From its line; none of any other text.
    pub fn read(line: &str) -> Option<Self> {
        let fields: Vec<&str> = line.split(',').collect();
        let [settled, error, least, most, rescaled, slowest, fastest] = fields[..] else { return None };
        Some(Self {
            settled: settled.parse().ok()?,
            error: error.parse().ok()?,
            delta: (least.parse().ok()?, most.parse().ok()?),
            velocity: if slowest.is_empty() { None } else { Some((slowest.parse().ok()?, fastest.parse().ok()?)) },
            rescaled: rescaled.parse().ok()?,
        })
    }
}

/// Every run so far.
#[derive(Default)]
pub(super) struct Memory {
    runs: BTreeMap<Gains, Vec<(Depth, Ran)>>,
}

impl Memory {
    /// What a run says, or one of wider words that is the same.
    pub fn recall(&self, gains: &Gains, depth: Depth) -> Option<&Ran> {
        let runs = self.runs.get(gains)?;
        let wider = |of: Depth| of.0 >= depth.0 && of.1 >= depth.1;
        let same = runs.iter().find(|(of, ran)| *of == depth || (wider(*of) && ran.covers(depth)));
        same.map(|(_, ran)| ran)
    }

    /// Keeps a run.
    pub fn keep(&mut self, gains: Gains, depth: Depth, ran: Ran) {
        self.runs.entry(gains).or_default().push((depth, ran));
    }
}

#[cfg(test)]
mod tests {
    use super::{Gain, Ran};

    #[test]
    fn a_gain_is_its_value_whatever_the_format() {
        assert_eq!(Gain::new(36 << 4, 4), Gain::new(36, 0));
        assert_eq!(Gain::new(38, 4), Gain::new(19, 3));
        assert_eq!(Gain::new(0, 7), Gain::new(0, 0));
        for (word, frac, format) in [(36, 0, "(0,6,0)"), (19, 4, "(0,1,4)"), (1, 5, "(0,0,5)"), (0, 0, "(0,2,0)")] {
            let gain = Gain::new(word, frac);
            assert_eq!(gain.format().to_string(), format);
            assert!(gain.format().holds(gain.word));
        }
    }

    #[test]
    fn a_row_is_read_as_it_was_written() {
        for velocity in [None, Some((-3, 7))] {
            let ran = Ran { settled: true, error: f64::INFINITY, delta: (-978, 33), velocity, rescaled: false };
            assert_eq!(Ran::read(&ran.line()), Some(ran));
        }
        assert_eq!(Ran::read("settled"), None);
    }

    #[test]
    fn a_run_covers_the_widths_that_hold_all_its_words_and_no_others() {
        let ran = Ran { settled: true, error: 0.0, delta: (-978, 33), velocity: Some((-9, 31)), rescaled: false };
        assert!(ran.covers((11, 6)));
        assert!(!ran.covers((10, 6)), "-978 takes 11 bits");
        assert!(!ran.covers((11, 5)), "31 takes 6 bits");
        // The range of delta, 1011, fits a difference of 11 bits; one of 1100 does not, and velocities may not tell.
        let wide = Ran { delta: (-1000, 100), rescaled: true, ..ran };
        assert!(!wide.covers((11, 6)) && wide.covers((12, 6)));
        assert!(Ran { rescaled: false, ..wide }.covers((11, 6)));
        assert!(!Ran { velocity: None, ..ran }.covers((12, 12)), "one that saturated says nothing");
    }
}
