//! Remembers runs, and answers for narrower widths whose run is proved to be the same.
//!
//! A run is a function of the modulator's width and of the gains' *values*. A product is `floor(penetration k)`; it
//! does not change when `k` is written with more fraction bits or more integer bits. So formats that hold the same two
//! gains are one [`Gains`] and need one run.
//!
//! **Narrower words, the same run.** Let a run with a position of `P` bits and a velocity of `V` bits keep three values
//! in range: `delta` within `P' <= P` bits, every difference of two samples within `P'` bits, and the velocity, which
//! never saturates, within `V' <= V` bits. Then the run with `P'` and `V'` has the same motion, `delta`, velocity and
//! torque at every edge. The proof is by induction over the edges. While the motion is the same, the narrow counter is
//! the wide one modulo `2^P'`. So are the wall's reference, `delta` and the difference, read as two's complement modulo
//! `2^P'`; a value that lies within `P'` bits is its own residue. So `delta` and the difference are the same numbers.
//! The velocity is the same difference (scaled alike), and fits. Everything that follows (contact, penetration,
//! products, torque, pins) is a function of `delta`, the velocity and the gains. So the motion is the same up to the
//! next edge.
//!
//! From reset on, the difference of two samples is a difference of two values of `delta`. So it fits where the whole
//! range of `delta` is less than half of the counter's range. It also fits where the velocity is that difference, not
//! rescaled, and fits.

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

    /// Returns a format that holds the gain, of at least two bits.
    pub fn format(self) -> Format {
        let bits = (128 - self.word.leading_zeros()).max(2).max(self.frac) as i32;
        Format::new(false, bits - self.frac as i32, self.frac as i32).expect("a gain's word has 32 bits at most")
    }
}

/// The values that determine a run, apart from the widths of position and velocity. Runs of different scenes say
/// nothing about each other.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) struct Gains {
    /// The index of the scene.
    pub case: usize,
    pub pwm: u32,
    pub stiffness: Gain,
    pub damping: Gain,
}

/// Widths of position and velocity.
pub(super) type Depth = (u32, u32);

/// The result of a run.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Ran {
    /// Whether the run settled.
    pub settled: bool,
    /// Error of its outputs against the reference's; valid only at the scene's own stiffness.
    pub error: f64,
    /// Least and greatest `delta`.
    pub delta: (i64, i64),
    /// Least and greatest velocity; `None` when it saturated.
    pub velocity: Option<(i64, i64)>,
    /// Whether velocities are rescaled; then they do not show the difference of two samples.
    pub rescaled: bool,
}

fn fits((least, greatest): (i64, i64), bits: u32) -> bool {
    let format = Format::signed(bits);
    format.holds(least.into()) && format.holds(greatest.into())
}

impl Ran {
    /// Returns whether a run with these widths, at most its own, is the same.
    fn covers(&self, (position, velocity): Depth) -> bool {
        let difference = self.delta.1 - self.delta.0;
        self.velocity.is_some_and(|range| {
            let sampled = fits((-difference, difference), position) || (!self.rescaled && fits(range, position));
            fits(self.delta, position) && fits(range, velocity) && sampled
        })
    }

    /// Returns it as a line of a journal.
    pub fn line(&self) -> String {
        let velocity = self.velocity.map_or(String::from(","), |(least, most)| format!("{least},{most}"));
        let Self { settled, error, delta: (least, most), rescaled, .. } = self;
        format!("{settled},{error:e},{least},{most},{rescaled},{velocity}")
    }

    /// Reads it from its line; `None` for any other text.
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

/// All runs so far.
#[derive(Default)]
pub(super) struct Memory {
    runs: BTreeMap<Gains, Vec<(Depth, Ran)>>,
}

impl Memory {
    /// Returns the result of a run: its own, or that of wider words whose run is proved to be the same.
    pub fn recall(&self, gains: &Gains, depth: Depth) -> Option<&Ran> {
        let runs = self.runs.get(gains)?;
        let wider = |of: Depth| of.0 >= depth.0 && of.1 >= depth.1;
        let same = runs.iter().find(|(of, ran)| *of == depth || (wider(*of) && ran.covers(depth)));
        same.map(|(_, ran)| ran)
    }

    /// Stores the result of a run.
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
        // The range of `delta`, 1011, fits a difference of 11 bits. A range of 1100 does not, and rescaled velocities
        // do not count.
        let wide = Ran { delta: (-1000, 100), rescaled: true, ..ran };
        assert!(!wide.covers((11, 6)) && wide.covers((12, 6)));
        assert!(Ran { rescaled: false, ..wide }.covers((11, 6)));
        assert!(!Ran { velocity: None, ..ran }.covers((12, 12)), "one that saturated says nothing");
    }
}
