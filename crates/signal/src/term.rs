//! Numbers as terms of bit-vectors, which a solver of SMT-LIB reads: exact, each as wide as its range asks for.

use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::{Add, BitAnd, BitOr, Mul, Neg, Not, Sub};

use crate::{Format, Narrowing, Overflow, Rounding, Word};

/// The definitions made so far, each once.
#[derive(Default)]
struct Book {
    lines: Vec<String>,
    known: HashMap<String, usize>,
}

thread_local! {
    static BOOK: RefCell<Book> = RefCell::default();
}

/// A definition of a sort; the same one twice is one.
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

/// A number between two bounds, as a bit-vector in two's complement of as many bits as they need.
#[derive(Clone, Copy, Debug)]
pub struct Term {
    index: usize,
    least: i128,
    most: i128,
}

/// A truth.
#[derive(Clone, Copy, Debug)]
pub struct Bit(usize);

/// Bits of two's complement that hold both.
fn width(least: i128, most: i128) -> u32 {
    let bits = |value: i128| 129 - (value ^ (value >> 127)).leading_zeros();
    bits(least).max(bits(most))
}

/// A constant of so many bits.
fn constant(value: i128, width: u32) -> String {
    let bits = value.cast_unsigned() & (u128::MAX >> (128 - width.min(128)));
    let sign = if width > 128 && value < 0 { "1" } else { "0" };
    format!("#b{}{bits:0w$b}", sign.repeat(width.saturating_sub(128) as usize), w = width.min(128) as usize)
}

impl Term {
    /// What `build` makes, and the definitions of all its terms, a line each.
    pub fn defined<R>(build: impl FnOnce() -> R) -> (R, Vec<String>) {
        let before = BOOK.take();
        let built = build();
        (built, BOOK.replace(before).lines)
    }

    /// The word of a format whose bits a text of SMT-LIB gives.
    #[must_use]
    pub fn of_bits(format: Format, bits: &str) -> Self {
        if format.is_signed() {
            return Self::new(format.min(), format.max(), bits.to_string());
        }
        Self::new(0, format.max(), format!("((_ zero_extend 1) {bits})"))
    }

    /// Its low bits, in SMT-LIB.
    #[must_use]
    pub fn bits(self, width: u32) -> String {
        let own = self.width();
        match own.cmp(&width) {
            std::cmp::Ordering::Less => self.extended(width),
            std::cmp::Ordering::Equal => self.name(),
            std::cmp::Ordering::Greater => format!("((_ extract {} 0) {})", width - 1, self.name()),
        }
    }

    fn new(least: i128, most: i128, expression: String) -> Self {
        let width = width(least, most);
        Self { index: define(&format!("(_ BitVec {width})"), expression), least, most }
    }

    fn name(self) -> String {
        format!("t{}", self.index)
    }

    fn width(self) -> u32 {
        width(self.least, self.most)
    }

    /// Its name, or that of its sign-extension.
    fn extended(self, width: u32) -> String {
        match width - self.width() {
            0 => self.name(),
            more => format!("((_ sign_extend {more}) {})", self.name()),
        }
    }

    /// What an operation of bit-vectors makes of two words, within these bounds.
    fn both(self, other: Self, operation: &str, corners: &[i128]) -> Self {
        let (least, most) = bounds(corners);
        let width = width(least, most).max(self.width()).max(other.width());
        let whole = format!("({operation} {} {})", self.extended(width), other.extended(width));
        Self::new(least, most, cut(&whole, width, self::width(least, most)))
    }

    fn compared(self, operation: &str, other: Self) -> Bit {
        let width = self.width().max(other.width());
        Bit(define("Bool", format!("({operation} {} {})", self.extended(width), other.extended(width))))
    }

    /// The `count` lowest bits, as a number that is not negative.
    fn rest(self, count: u32) -> Self {
        let rest = self.bits(count);
        Self::new(0, (1 << count) - 1, format!("((_ zero_extend 1) {rest})"))
    }
}

fn bounds(corners: &[i128]) -> (i128, i128) {
    let least = corners.iter().copied().min().expect("corners");
    (least, corners.iter().copied().max().expect("corners"))
}

/// The lower bits of an expression, where it has more.
fn cut(expression: &str, from: u32, to: u32) -> String {
    if from == to { expression.to_string() } else { format!("((_ extract {} 0) {expression})", to - 1) }
}

impl Add for Term {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.both(other, "bvadd", &[self.least + other.least, self.most + other.most])
    }
}

impl Sub for Term {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.both(other, "bvsub", &[self.least - other.most, self.most - other.least])
    }
}

impl Mul for Term {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let [a, b, c, d] = [self.least, self.most, other.least, other.most];
        self.both(other, "bvmul", &[a * c, a * d, b * c, b * d])
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
    /// What it is called in SMT-LIB.
    #[must_use]
    pub fn name(self) -> String {
        format!("t{}", self.0)
    }
}

impl Word for Term {
    type Bit = Bit;

    fn int(value: i128) -> Self {
        Self::new(value, value, constant(value, width(value, value)))
    }
    fn of_bit(bit: Bit) -> Self {
        Self::new(0, 1, format!("(ite {} #b01 #b00)", bit.name()))
    }
    fn shl(self, bits: u32) -> Self {
        if bits == 0 {
            return self;
        }
        let zeros = "0".repeat(bits as usize);
        let (least, most) = (self.least << bits, self.most << bits);
        let expression = format!("(concat {} #b{zeros})", self.name());
        Self::new(least, most, cut(&expression, self.width() + bits, width(least, most)))
    }
    fn shr(self, bits: u32) -> Self {
        if bits == 0 {
            return self;
        }
        let floor = |value| Rounding::Truncate.shift(value, bits);
        let (least, most) = (floor(self.least), floor(self.most));
        let top = self.width() - 1;
        let expression = format!("((_ extract {top} {}) {})", bits.min(top), self.name());
        Self::new(least, most, cut(&expression, self.width() - bits.min(top), width(least, most)))
    }
    fn narrow(self, rule: &Narrowing) -> Self {
        let drop = rule.from_frac - rule.to.frac();
        let scaled = if drop > 0 {
            rounded(self, rule.rounding, drop.cast_unsigned())
        } else {
            self.shl(drop.unsigned_abs())
        };
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
    fn branch<const N: usize>(
        bit: Bit,
        yes: impl FnOnce() -> [Self; N],
        no: impl FnOnce() -> [Self; N],
    ) -> [Self; N] {
        let (mut words, no) = (yes(), no());
        for (word, other) in words.iter_mut().zip(no) {
            let (least, most) = bounds(&[word.least, word.most, other.least, other.most]);
            let width = width(least, most);
            let expression = format!("(ite {} {} {})", bit.name(), word.extended(width), other.extended(width));
            *word = Self::new(least, most, expression);
        }
        words
    }
    /// Choices by the address's bits, the lowest first.
    fn look_up(self, table: &[i64]) -> Self {
        let mut words: Vec<_> = table.iter().map(|&word| Self::int(word.into())).collect();
        for bit in 0..self.width() {
            if words.len() == 1 {
                break;
            }
            let is_set = Bit(define("Bool", format!("(= ((_ extract {bit} {bit}) {}) #b1)", self.name())));
            // Of an odd number of words, no address has the one after the last.
            let pair = |pair: &[Self]| Self::select(is_set, pair[pair.len() - 1], pair[0]);
            words = words.chunks(2).map(pair).collect();
        }
        words[0]
    }
    fn limit(self, least: i128, most: i128) -> Self {
        let clamped = |value: Self, bound: i128, least: i128, most: i128, operation: &str| {
            if least == value.least && most == value.most {
                return value;
            }
            let (bound, width) = (Self::int(bound), width(least, most));
            let beyond = value.compared(operation, bound).name();
            let kept = cut(&value.name(), value.width(), width.min(value.width()));
            let kept = if width > value.width() { value.extended(width) } else { kept };
            Self::new(least, most, format!("(ite {beyond} {} {kept})", bound.extended(width)))
        };
        let below = clamped(self, least, self.least.max(least), self.most.max(least), "bvslt");
        clamped(below, most, below.least.min(most), below.most.min(most), "bvsgt")
    }
}

/// Divided by a power of two, and rounded.
fn rounded(value: Term, rounding: Rounding, drop: u32) -> Term {
    let (zero, one, half) = (Term::int(0), Term::int(1), Term::int(1 << (drop - 1)));
    let floor = value.shr(drop);
    let up = match rounding {
        Rounding::Truncate => return floor,
        // One adder, as hardware has it.
        Rounding::NearestUp => return (value + half).shr(drop),
        Rounding::TowardZero => zero.above(value) & value.rest(drop).is_set(),
        Rounding::NearestAway => {
            let rest = value.rest(drop);
            rest.above(half) | rest.equals(half) & value.at_least(zero)
        }
        Rounding::NearestEven => {
            let rest = value.rest(drop);
            rest.above(half) | rest.equals(half) & floor.rest(1).equals(one)
        }
    };
    floor + Term::of_bit(up)
}
