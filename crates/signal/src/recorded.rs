//! Equations that are recorded once, so that any [`Word`] can read them later. Blocks without their types hand them to
//! the readings of other crates in this form.

use std::cell::RefCell;
use std::sync::Arc;

use crate::{Format, Narrowing, Rounding, Sine, Word, operators, truths};

/// One operation on words or bits. It names its operands by their places among the words or bits before it.
#[derive(Clone, Debug)]
enum Operation {
    Given(usize),
    Int(i128),
    OfBit(usize),
    Add(usize, usize),
    Sub(usize, usize),
    Mul(usize, usize),
    Neg(usize),
    Shl(usize, u32),
    Shr(usize, u32),
    Round(usize, Rounding, i32),
    Narrow(usize, Narrowing),
    Wrap(usize, Format),
    Select(usize, usize, usize),
    Lesser(usize, usize),
    Greater(usize, usize),
    LookUp(usize, Arc<[i64]>),
    Sine(usize, Sine, Arc<[i64]>),
    Cut(usize, String, u32),
    Shed(usize),
    Overflowing(usize, usize),
    Limit(usize, i128, i128),
    AtLeast(usize, usize),
    Equals(usize, usize),
    Bit(usize, u32),
    Not(usize),
    And(usize, usize),
    Or(usize, usize),
}

/// The operations recorded so far.
#[derive(Default)]
struct Book {
    operations: Vec<Operation>,
    words: usize,
    bits: usize,
}

thread_local! {
    static BOOK: RefCell<Book> = RefCell::default();
}

fn word(operation: Operation) -> Recorded {
    BOOK.with_borrow_mut(|book| {
        book.operations.push(operation);
        book.words += 1;
        Recorded(book.words - 1)
    })
}

fn bit(operation: Operation) -> RecordedBit {
    BOOK.with_borrow_mut(|book| {
        book.operations.push(operation);
        book.bits += 1;
        RecordedBit(book.bits - 1)
    })
}

/// A word that records how it is computed.
#[derive(Clone, Copy, Debug)]
pub struct Recorded(usize);

/// A bit that records how it is computed.
#[derive(Clone, Copy, Debug)]
pub struct RecordedBit(usize);

/// Equations that any [`Word`] can read.
///
/// # Example
///
/// ```
/// use hpu_signal::{Equations, Machine, Word};
/// let square = Equations::of(1, |given| vec![given[0] * given[0]]);
/// let read = square.read(&[Machine::<i64>::int(-7)]);
/// assert_eq!(read, [Machine::int(49)]);
/// ```
#[derive(Clone, Debug)]
pub struct Equations {
    operations: Vec<Operation>,
    results: Vec<usize>,
}

impl Equations {
    /// Records how `build` computes results from `given` words.
    pub fn of(given: usize, build: impl FnOnce(&[Recorded]) -> Vec<Recorded>) -> Self {
        let before = BOOK.take();
        let given: Vec<_> = (0..given).map(|index| word(Operation::Given(index))).collect();
        let results = build(&given).into_iter().map(|Recorded(result)| result).collect();
        Self { operations: BOOK.replace(before).operations, results }
    }

    /// Returns the results, computed from the given words. Both sides of every branch are read.
    pub fn read<W: Word>(&self, given: &[W]) -> Vec<W> {
        let mut reading = Reading::default();
        self.read_in(&mut reading, given);
        reading.results
    }

    /// Returns the same, in memory that is kept from reading to reading of these equations alone.
    pub fn read_in<'r, W: Word>(&self, reading: &'r mut Reading<W>, given: &[W]) -> &'r [W] {
        let Reading { words, bits, results } = reading;
        // Constants stay from the reading before.
        let is_first = words.is_empty();
        let (mut next_word, mut next_bit) = (0, 0);
        for operation in &self.operations {
            let made = match *operation {
                Operation::Int(_) if !is_first => {
                    next_word += 1;
                    continue;
                }
                Operation::Given(index) => given[index],
                Operation::Int(value) => W::int(value),
                Operation::OfBit(bit) => W::of_bit(bits[bit]),
                Operation::Add(a, b) => words[a] + words[b],
                Operation::Sub(a, b) => words[a] - words[b],
                Operation::Mul(a, b) => words[a] * words[b],
                Operation::Neg(a) => -words[a],
                Operation::Shl(a, count) => words[a].shl(count),
                Operation::Shr(a, count) => words[a].shr(count),
                Operation::Round(a, rounding, drop) => words[a].round(rounding, drop),
                Operation::Narrow(a, ref rule) => words[a].narrow(rule),
                Operation::Wrap(a, to) => words[a].wrap(to),
                Operation::Select(bit, yes, no) => W::select(bits[bit], words[yes], words[no]),
                Operation::Lesser(a, b) => words[a].lesser(words[b]),
                Operation::Greater(a, b) => words[a].greater(words[b]),
                Operation::LookUp(a, ref table) => words[a].look_up(table),
                Operation::Sine(a, sine, ref table) => words[a].sine(sine, table),
                Operation::Cut(a, ref name, width) => words[a].cut(name, width),
                Operation::Shed(a) => words[a].shed(),
                Operation::Overflowing(a, bit) => words[a].overflowing(bits[bit]),
                Operation::Limit(a, least, most) => words[a].limit(least, most),
                Operation::AtLeast(..)
                | Operation::Equals(..)
                | Operation::Bit(..)
                | Operation::Not(_)
                | Operation::And(..)
                | Operation::Or(..) => {
                    let bit = match *operation {
                        Operation::AtLeast(a, b) => words[a].at_least(words[b]),
                        Operation::Equals(a, b) => words[a].equals(words[b]),
                        Operation::Bit(a, place) => words[a].bit(place),
                        Operation::Not(a) => !bits[a],
                        Operation::And(a, b) => bits[a] & bits[b],
                        Operation::Or(a, b) => bits[a] | bits[b],
                        _ => unreachable!("an operation that gives a bit"),
                    };
                    keep(bits, next_bit, bit);
                    next_bit += 1;
                    continue;
                }
            };
            keep(words, next_word, made);
            next_word += 1;
        }
        results.clear();
        results.extend(self.results.iter().map(|&result| words[result]));
        results
    }
}

/// Writes a value to its place, which is the first one beyond the end at most.
fn keep<T>(values: &mut Vec<T>, place: usize, value: T) {
    match values.get_mut(place) {
        Some(kept) => *kept = value,
        None => values.push(value),
    }
}

/// The memory of a reading of [`Equations`]. A reader that reads often keeps it, so that nothing is allocated.
#[derive(Clone, Debug)]
pub struct Reading<W: Word> {
    words: Vec<W>,
    bits: Vec<W::Bit>,
    results: Vec<W>,
}

impl<W: Word> Default for Reading<W> {
    fn default() -> Self {
        Self { words: Vec::new(), bits: Vec::new(), results: Vec::new() }
    }
}

operators!(
    Recorded,
    |a, b| [word(Operation::Add(a.0, b.0)), word(Operation::Sub(a.0, b.0)), word(Operation::Mul(a.0, b.0))],
    word(Operation::Neg(a.0)),
);

truths!(RecordedBit, |a, b| [bit(Operation::And(a.0, b.0)), bit(Operation::Or(a.0, b.0))], bit(Operation::Not(a.0)),);

/// Returns a table's words in the form in which they are kept.
fn kept<T: Copy + Into<i64>>(table: &[T]) -> Arc<[i64]> {
    table.iter().map(|&word| word.into()).collect()
}

impl Word for Recorded {
    type Bit = RecordedBit;

    fn int(value: i128) -> Self {
        word(Operation::Int(value))
    }
    fn of_bit(bit: RecordedBit) -> Self {
        word(Operation::OfBit(bit.0))
    }
    fn shl(self, bits: u32) -> Self {
        word(Operation::Shl(self.0, bits))
    }
    fn shr(self, bits: u32) -> Self {
        word(Operation::Shr(self.0, bits))
    }
    fn round(self, rounding: Rounding, drop: i32) -> Self {
        word(Operation::Round(self.0, rounding, drop))
    }
    fn narrow(self, rule: &Narrowing) -> Self {
        word(Operation::Narrow(self.0, *rule))
    }
    fn wrap(self, to: Format) -> Self {
        word(Operation::Wrap(self.0, to))
    }
    fn at_least(self, other: Self) -> RecordedBit {
        bit(Operation::AtLeast(self.0, other.0))
    }
    fn equals(self, other: Self) -> RecordedBit {
        bit(Operation::Equals(self.0, other.0))
    }
    fn branch<const N: usize>(
        bit: RecordedBit,
        yes: impl FnOnce() -> [Self; N],
        no: impl FnOnce() -> [Self; N],
    ) -> [Self; N] {
        let (yes, no) = (yes(), no());
        std::array::from_fn(|index| word(Operation::Select(bit.0, yes[index].0, no[index].0)))
    }
    fn look_up<T: Copy + Into<i64>>(self, table: &[T]) -> Self {
        word(Operation::LookUp(self.0, kept(table)))
    }
    fn sine<T: Copy + Into<i64>>(self, sine: Sine, table: &[T]) -> Self {
        word(Operation::Sine(self.0, sine, kept(table)))
    }
    fn bit(self, place: u32) -> RecordedBit {
        bit(Operation::Bit(self.0, place))
    }
    fn cut(self, name: &str, width: u32) -> Self {
        word(Operation::Cut(self.0, name.to_string(), width))
    }
    fn shed(self) -> Self {
        word(Operation::Shed(self.0))
    }
    fn overflowing(self, bit: RecordedBit) -> Self {
        word(Operation::Overflowing(self.0, bit.0))
    }
    fn lesser(self, other: Self) -> Self {
        word(Operation::Lesser(self.0, other.0))
    }
    fn greater(self, other: Self) -> Self {
        word(Operation::Greater(self.0, other.0))
    }
    fn limit(self, least: i128, most: i128) -> Self {
        word(Operation::Limit(self.0, least, most))
    }
}
