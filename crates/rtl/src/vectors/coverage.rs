//! The bits that a comparison has seen move.
//!
//! Two sides that agree on rows in which a bit never moves say nothing of that bit. The words are the emulator's; where
//! both sides agree, they are also those of the VHDL.

use hpu_signal::{Format, Signal};
use hpu_wave::Column;

use crate::vectors::vector::Header;

/// The place of a signal in a comparison.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Role {
    /// A word that both sides are given.
    Input,
    /// A word that is compared at an output.
    Output,
    /// A word that is compared inside a loop.
    Inside,
}

impl Role {
    /// Returns the role as a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Input => "input",
            Self::Output => "output",
            Self::Inside => "inside",
        }
    }
}

/// The moves of a signal from one compared row to the next.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Moved {
    /// Its name.
    pub name: &'static str,
    /// Its word format.
    pub format: Format,
    /// Its place.
    pub role: Role,
    /// The bits that went from 0 to 1.
    pub rose: u64,
    /// The bits that went from 1 to 0.
    pub fell: u64,
    /// The least and the greatest word; `None` before the first row.
    pub range: Option<(i64, i64)>,
    last: u64,
}

impl Moved {
    fn new(name: &'static str, format: Format, role: Role) -> Self {
        Self { name, format, role, rose: 0, fell: 0, range: None, last: 0 }
    }

    fn see(&mut self, word: i64) {
        let bits = self.format.bits(word);
        let (least, greatest) = match self.range {
            Some((least, greatest)) => {
                self.rose |= bits & !self.last;
                self.fell |= self.last & !bits;
                (least.min(word), greatest.max(word))
            }
            None => (word, word),
        };
        (self.range, self.last) = (Some((least, greatest)), bits);
    }

    /// Returns the number of bits that both rose and fell.
    pub fn toggled(&self) -> u32 {
        (self.rose & self.fell).count_ones()
    }
}

/// The rows of a comparison by their kind, and the moves of every signal in them.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Coverage {
    /// Rows of corner cases.
    pub directed: u64,
    /// Rows of random words.
    pub random: u64,
    /// Rows of products, in strata or all of them.
    pub products: u64,
    /// Rows at which the block is in reset, among all of them.
    pub resets: u64,
    /// The signals: inputs, outputs, then those inside a loop.
    pub signals: Vec<Moved>,
}

impl Coverage {
    /// Returns the coverage of no rows of vectors yet. The reset is no signal here; its rows are counted.
    pub(crate) fn of_block(header: &Header) -> Self {
        let moved = |role| move |&Column { name, format, .. }: &Column| Moved::new(name, format, role);
        let inputs = header.inputs.iter().skip(usize::from(header.clocked)).map(moved(Role::Input));
        let signals = inputs.chain(header.outputs.iter().map(moved(Role::Output)));
        Self { signals: signals.collect(), ..Self::default() }
    }

    /// Takes the next row of vectors, which begins with `rst` where the block is clocked.
    pub(crate) fn row(&mut self, clocked: bool, words: impl IntoIterator<Item = i64>) {
        let mut words = words.into_iter();
        if clocked {
            self.resets += u64::from(words.next() == Some(1));
        }
        self.see(words);
    }

    /// Returns the coverage of no edges of a loop yet, of which the first nets are the inputs, then the outputs.
    pub(crate) fn of_nets(nets: &[Signal], inputs: usize, outputs: usize) -> Self {
        let role = |index: usize| match index {
            _ if index < inputs => Role::Input,
            _ if index < inputs + outputs => Role::Output,
            _ => Role::Inside,
        };
        let moved = |(index, net): (usize, &Signal)| Moved::new(net.name, net.format, role(index));
        Self { signals: nets.iter().enumerate().map(moved).collect(), ..Self::default() }
    }

    /// Takes the words of the next row, in the order of the signals.
    pub(crate) fn see(&mut self, words: impl IntoIterator<Item = i64>) {
        self.signals.iter_mut().zip(words).for_each(|(signal, word)| signal.see(word));
    }

    /// Adds the rows of another run of the same block. Between two runs no bit moves.
    pub(crate) fn add(&mut self, other: Self) {
        self.directed += other.directed;
        self.random += other.random;
        self.products += other.products;
        self.resets += other.resets;
        if self.signals.is_empty() {
            self.signals = other.signals;
            return;
        }
        for (one, two) in self.signals.iter_mut().zip(other.signals) {
            one.rose |= two.rose;
            one.fell |= two.fell;
            one.range = match (one.range, two.range) {
                (Some((a, b)), Some((c, d))) => Some((a.min(c), b.max(d))),
                (range, None) | (None, range) => range,
            };
        }
    }

    /// Returns the number of bits of all signals, and how many of them both rose and fell.
    pub fn bits(&self) -> (u32, u32) {
        let sum = |of: fn(&Moved) -> u32| self.signals.iter().map(of).sum();
        (sum(|signal| signal.format.width()), sum(Moved::toggled))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(rows: &[i64]) -> Coverage {
        let net = Signal { name: "word", format: Format::signed(3), unit: "1", doc: "" };
        let mut coverage = Coverage::of_nets(&[net], 1, 0);
        rows.iter().for_each(|&word| coverage.see([word]));
        coverage
    }

    #[test]
    fn a_bit_has_toggled_when_it_rose_and_fell() {
        // 000, 001, 101, 100: bit 0 rose and fell, bit 2 rose, bit 1 stayed.
        let coverage = of(&[0, 1, -3, -4]);
        let [word] = &coverage.signals[..] else { panic!("one signal") };
        assert_eq!((word.rose, word.fell, word.range), (0b101, 0b001, Some((-4, 1))));
        assert_eq!(coverage.bits(), (3, 1));
        // The first row moves nothing, whatever it is.
        assert_eq!(of(&[-1]).bits(), (3, 0));
        assert_eq!(of(&[]).signals[0].range, None);
    }

    #[test]
    fn runs_are_added_without_a_move_between_them() {
        let mut sum = Coverage { directed: 2, ..of(&[0, 1]) };
        sum.add(Coverage { random: 3, resets: 1, ..of(&[2, 3, 2]) });
        let word = &sum.signals[0];
        // From 1 to 2, bit 1 would rise and bit 0 fall: bit 0 fell in the second run, and bit 1 never rose.
        assert_eq!((word.rose, word.fell, word.range), (0b001, 0b001, Some((0, 3))));
        assert_eq!((sum.directed, sum.random, sum.resets), (2, 3, 1));
        let mut empty = Coverage::default();
        empty.add(of(&[0, 1, 0]));
        assert_eq!(empty.bits(), (3, 1));
    }
}
