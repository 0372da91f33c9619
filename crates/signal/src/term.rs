//! Numbers as terms of bit-vectors for SMT-LIB solvers: exact, each as wide as its range requires.

use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::{Add, BitAnd, BitOr, Mul, Neg, Not, Sub};

use crate::{Format, Narrowing, Overflow, Rounding, Word};

/// The definitions made so far; each appears once.
#[derive(Default)]
struct Book {
    lines: Vec<String>,
    known: HashMap<String, usize>,
    /// The bits that replace numbers of these names, and the cuts that were met.
    cuts: HashMap<String, String>,
    met: Vec<(String, u32, Term)>,
}

/// The result of a computation with terms, with the definitions that it needs.
#[derive(Clone, Debug)]
pub struct Defined<R> {
    /// The result.
    pub built: R,
    /// The definitions of all its terms, one a line.
    pub lines: Vec<String>,
    /// The places where it can be [cut](Word::cut): names, widths and numbers.
    pub cuts: Vec<(String, u32, Term)>,
}

thread_local! {
    static BOOK: RefCell<Book> = RefCell::default();
}

/// Defines an expression of a sort; equal expressions share one definition.
fn define(sort: &str, expression: String) -> usize {
    BOOK.with_borrow_mut(|book| {
        if let Some(&known) = book.known.get(&expression) {
            return known;
        }
        let index = book.lines.len();
        book.lines.push(format!("(define-fun t{index} () {sort} {expression})"));
        book.known.insert(expression, index);
        index
    })
}

/// A number between two bounds, as a bit-vector in two's complement. It has as many bits as hardware needs for it; a
/// product has as many as both factors together.
#[derive(Clone, Copy, Debug)]
pub struct Term {
    index: usize,
    width: u32,
    least: i128,
    most: i128,
}

/// The truth of a condition, as a term.
#[derive(Clone, Copy, Debug)]
pub struct Bit(usize);

/// Returns the number of bits of two's complement that holds both.
fn width(least: i128, most: i128) -> u32 {
    let bits = |value: i128| 129 - (value ^ (value >> 127)).leading_zeros();
    bits(least).max(bits(most))
}

/// Returns a constant of `width` bits.
fn constant(value: i128, width: u32) -> String {
    let bits = value.cast_unsigned() & (u128::MAX >> (128 - width.min(128)));
    let sign = if width > 128 && value < 0 { "1" } else { "0" };
    format!("#b{}{bits:0w$b}", sign.repeat(width.saturating_sub(128) as usize), w = width.min(128) as usize)
}

impl Term {
    /// Builds a result from terms. A number whose name has bits in `cuts` is replaced by these bits.
    pub fn defined<R>(cuts: HashMap<String, String>, build: impl FnOnce() -> R) -> Defined<R> {
        let before = BOOK.replace(Book { cuts, ..Book::default() });
        let built = build();
        let Book { lines, met, .. } = BOOK.replace(before);
        Defined { built, lines, cuts: met }
    }

    /// Returns the condition that bits of SMT-LIB, of that width, are a number within its bounds.
    pub fn bounds(self, bits: &str, width: u32) -> String {
        let (least, most) = (constant(self.least, width), constant(self.most, width));
        format!("(and (bvsle {least} {bits}) (bvsle {bits} {most}))")
    }

    /// Returns the word of a format whose bits a text of SMT-LIB gives.
    pub fn of_bits(format: Format, bits: &str) -> Self {
        if format.is_signed() {
            return Self::new(format.width(), format.min(), format.max(), bits.to_string());
        }
        Self::new(format.width() + 1, 0, format.max(), format!("((_ zero_extend 1) {bits})"))
    }

    /// Returns its low bits in SMT-LIB.
    pub fn bits(self, width: u32) -> String {
        match self.width.cmp(&width) {
            std::cmp::Ordering::Less => self.extended(width),
            std::cmp::Ordering::Equal => self.name(),
            std::cmp::Ordering::Greater => format!("((_ extract {} 0) {})", width - 1, self.name()),
        }
    }

    fn new(width: u32, least: i128, most: i128, expression: String) -> Self {
        Self { index: define(&format!("(_ BitVec {width})"), expression), width, least, most }
    }

    fn name(self) -> String {
        format!("t{}", self.index)
    }

    /// Returns its name, or the name of its sign-extension.
    fn extended(self, width: u32) -> String {
        match width - self.width {
            0 => self.name(),
            more => format!("((_ sign_extend {more}) {})", self.name()),
        }
    }

    /// Applies an operation of bit-vectors to two words. The result has at least `room` bits, and the range of
    /// `corners`.
    fn both(self, other: Self, operation: &str, room: u32, corners: &[i128]) -> Self {
        let (least, most) = bounds(corners);
        let width = width(least, most).max(self.width).max(other.width).max(room);
        Self::new(width, least, most, format!("({operation} {} {})", self.extended(width), other.extended(width)))
    }

    fn compared(self, operation: &str, other: Self) -> Bit {
        let width = self.width.max(other.width);
        Bit(define("Bool", format!("({operation} {} {})", self.extended(width), other.extended(width))))
    }

    /// Returns the `count` lowest bits as a number that is not negative.
    fn rest(self, count: u32) -> Self {
        let rest = self.bits(count);
        Self::new(count + 1, 0, (1 << count) - 1, format!("((_ zero_extend 1) {rest})"))
    }
}

fn bounds(corners: &[i128]) -> (i128, i128) {
    let least = corners.iter().copied().min().expect("corners");
    (least, corners.iter().copied().max().expect("corners"))
}

impl Add for Term {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.both(other, "bvadd", 0, &[self.least + other.least, self.most + other.most])
    }
}

impl Sub for Term {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.both(other, "bvsub", 0, &[self.least - other.most, self.most - other.least])
    }
}

impl Mul for Term {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let [a, b, c, d] = [self.least, self.most, other.least, other.most];
        // Multiplies by the magnitude of a constant factor, as hardware does.
        if a == b && a < 0 {
            return -(Self::int(-a) * other);
        } else if c == d && c < 0 {
            return -(self * Self::int(-c));
        }
        self.both(other, "bvmul", self.width + other.width, &[a * c, a * d, b * c, b * d])
    }
}

impl Neg for Term {
    type Output = Self;
    fn neg(self) -> Self {
        Self::int(0) - self
    }
}

impl Not for Bit {
    type Output = Self;
    fn not(self) -> Self {
        Self(define("Bool", format!("(not {})", self.name())))
    }
}

impl BitAnd for Bit {
    type Output = Self;
    fn bitand(self, other: Self) -> Self {
        Self(define("Bool", format!("(and {} {})", self.name(), other.name())))
    }
}

impl BitOr for Bit {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(define("Bool", format!("(or {} {})", self.name(), other.name())))
    }
}

impl Bit {
    /// Returns its name in SMT-LIB.
    pub fn name(self) -> String {
        format!("t{}", self.0)
    }
}

impl Word for Term {
    type Bit = Bit;

    fn int(value: i128) -> Self {
        let width = width(value, value);
        Self::new(width, value, value, constant(value, width))
    }
    fn of_bit(bit: Bit) -> Self {
        Self::new(2, 0, 1, format!("(ite {} #b01 #b00)", bit.name()))
    }
    fn shl(self, bits: u32) -> Self {
        if bits == 0 {
            return self;
        }
        let zeros = "0".repeat(bits as usize);
        let expression = format!("(concat {} #b{zeros})", self.name());
        Self::new(self.width + bits, self.least << bits, self.most << bits, expression)
    }
    fn shr(self, bits: u32) -> Self {
        if bits == 0 {
            return self;
        }
        let floor = |value| Rounding::Truncate.shift(value, bits);
        let top = self.width - 1;
        let expression = format!("((_ extract {top} {}) {})", bits.min(top), self.name());
        Self::new(self.width - bits.min(top), floor(self.least), floor(self.most), expression)
    }
    fn round(self, rounding: Rounding, drop: i32) -> Self {
        if drop > 0 { rounded(self, rounding, drop.cast_unsigned()) } else { self.shl(drop.unsigned_abs()) }
    }
    fn narrow(self, rule: &Narrowing) -> Self {
        let scaled = self.round(rule.rounding, rule.from_frac - rule.to.frac());
        match rule.overflow {
            Overflow::Wrap => scaled.wrap(rule.to),
            Overflow::Saturate => scaled.limit(rule.to.min(), rule.to.max()),
        }
    }
    fn wrap(self, to: Format) -> Self {
        if to.holds(self.least) && to.holds(self.most) {
            return self;
        }
        Self::of_bits(to, &self.bits(to.width()))
    }
    fn at_least(self, other: Self) -> Bit {
        self.compared("bvsge", other)
    }
    fn equals(self, other: Self) -> Bit {
        self.compared("=", other)
    }
    fn branch<const N: usize>(bit: Bit, yes: impl FnOnce() -> [Self; N], no: impl FnOnce() -> [Self; N]) -> [Self; N] {
        let (mut words, no) = (yes(), no());
        for (word, other) in words.iter_mut().zip(no) {
            let (least, most) = bounds(&[word.least, word.most, other.least, other.most]);
            let width = word.width.max(other.width);
            let expression = format!("(ite {} {} {})", bit.name(), word.extended(width), other.extended(width));
            *word = Self::new(width, least, most, expression);
        }
        words
    }
    /// Selects by the address's bits, the lowest first.
    fn look_up<T: Copy + Into<i64>>(self, table: &[T]) -> Self {
        let mut words: Vec<_> = table.iter().map(|&word| Self::int(word.into().into())).collect();
        for bit in 0..self.width {
            if words.len() == 1 {
                break;
            }
            let is_set = Bit(define("Bool", format!("(= ((_ extract {bit} {bit}) {}) #b1)", self.name())));
            // If the number of words is odd, no address selects the word after the last.
            let pair = |pair: &[Self]| Self::select(is_set, pair[pair.len() - 1], pair[0]);
            words = words.chunks(2).map(pair).collect();
        }
        words[0]
    }
    fn cut(self, name: &str, own: u32) -> Self {
        // A net of so few bits cannot hold all values of this number, so the proof must assume nothing about the net.
        if width(self.least, self.most) > own {
            return self;
        }
        let bits = BOOK.with_borrow_mut(|book| {
            book.met.push((name.to_string(), own, self));
            book.cuts.get(name).cloned()
        });
        bits.map_or(self, |bits| Self::new(own, self.least, self.most, bits))
    }
    fn limit(self, least: i128, most: i128) -> Self {
        let clamped = |value: Self, bound: i128, least: i128, most: i128, operation: &str| {
            if least == value.least && most == value.most {
                return value;
            }
            let (bound, width) = (Self::int(bound), width(least, most));
            let beyond = value.compared(operation, bound).name();
            let (kept, bound) = (value.bits(width), bound.bits(width));
            Self::new(width, least, most, format!("(ite {beyond} {bound} {kept})"))
        };
        let below = clamped(self, least, self.least.max(least), self.most.max(least), "bvslt");
        clamped(below, most, below.least.min(most), below.most.min(most), "bvsgt")
    }
}

/// Returns the value divided by a power of two, and rounded.
fn rounded(value: Term, rounding: Rounding, drop: u32) -> Term {
    let (zero, one, half) = (Term::int(0), Term::int(1), Term::int(1 << (drop - 1)));
    let floor = value.shr(drop);
    let up = match rounding {
        Rounding::Truncate => return floor,
        // Uses one adder, as hardware does.
        Rounding::NearestUp => return (value + half).shr(drop),
        Rounding::NearestDown => return (value + half - one).shr(drop),
        Rounding::TowardZero => zero.above(value) & value.rest(drop).is_set(),
        Rounding::NearestAway => {
            let rest = value.rest(drop);
            rest.above(half) | rest.equals(half) & value.at_least(zero)
        }
        Rounding::NearestInward => {
            let rest = value.rest(drop);
            rest.above(half) | rest.equals(half) & zero.above(value)
        }
        Rounding::NearestEven | Rounding::NearestOdd => {
            let rest = value.rest(drop);
            let below = if rounding == Rounding::NearestEven { one } else { zero };
            rest.above(half) | rest.equals(half) & floor.rest(1).equals(below)
        }
    };
    floor + Term::of_bit(up)
}
