//! Writes equations in the language of Gappa: real numbers, and `fixed<>` where words are narrowed.
//!
//! Every word has two expressions: its value in words, and its value in real numbers. A word is its integer over
//! `2^frac`, so that aligning fractions costs no symbol. A narrowed word is in its own unit.

use std::cell::RefCell;

use hpu_signal::{Format, Narrowing, Rounding, Word, operators, truths};

/// One word's expressions.
#[derive(Clone)]
struct Expressions {
    word: String,
    real: String,
    /// The word's integer is the expression times `2^frac`.
    frac: i32,
}

/// The script so far.
#[derive(Default)]
struct Book {
    words: Vec<Expressions>,
    lines: String,
}

thread_local! {
    static BOOK: RefCell<Book> = RefCell::default();
}

/// A word as an expression of Gappa.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Text(usize);

/// The truth of a condition, if both sides are constants.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Known(Option<bool>);

truths!(Known, |a, b| [Self(a.0.zip(b.0).map(|(one, other)| one && other)), !(!a & !b)], Self(a.0.map(|bit| !bit)),);

impl Text {
    /// Returns the lines that are written while `read` runs, apart from all others.
    pub fn written(read: impl FnOnce()) -> String {
        let before = BOOK.take();
        read();
        BOOK.replace(before).lines
    }

    fn put(expressions: Expressions) -> Self {
        BOOK.with_borrow_mut(|book| {
            book.words.push(expressions);
            Self(book.words.len() - 1)
        })
    }

    fn get(self) -> Expressions {
        BOOK.with_borrow(|book| book.words[self.0].clone())
    }

    /// Makes a variable of this name and format; its value in real numbers is called `real`.
    pub fn variable(name: &str, real: &str, format: Format) -> Self {
        Self::put(Expressions { word: name.to_string(), real: real.to_string(), frac: format.frac() })
    }

    /// Gives the word new names from here on.
    pub fn named(self, name: &str, real: &str) -> Self {
        let Expressions { word: what, real: really, frac } = self.get();
        BOOK.with_borrow_mut(|book| book.lines += &format!("{name} = {what};\n{real} = {really};\n"));
        Self::put(Expressions { word: name.to_string(), real: real.to_string(), frac })
    }

    /// Returns the number if it is a constant.
    fn constant(self) -> Option<i128> {
        self.get().word.parse().ok()
    }

    fn both(self, other: Self, symbol: &str) -> Self {
        let (one, other) = (self.get(), other.get());
        let frac = one.frac.max(other.frac);
        let [left, right] = [one, other].map(|of| of.at(frac));
        let join = |left: &str, right: &str| format!("({left} {symbol} {right})");
        Self::put(Expressions { word: join(&left.word, &right.word), real: join(&left.real, &right.real), frac })
    }
}

impl Expressions {
    /// Returns the same integer with another fraction.
    fn at(&self, frac: i32) -> Self {
        match frac - self.frac {
            0 => self.clone(),
            more => {
                let times = |of: &str| if of == "0" { of.to_string() } else { format!("({of} * 1b-{more})") };
                Self { word: times(&self.word), real: times(&self.real), frac }
            }
        }
    }
}

impl Text {
    fn plus(self, other: Self) -> Self {
        match (self.constant(), other.constant()) {
            (Some(0), _) => other,
            (_, Some(0)) => self,
            _ => self.both(other, "+"),
        }
    }

    fn times(self, other: Self) -> Self {
        let (one, other) = (self.get(), other.get());
        let join = |left: &str, right: &str| format!("({left} * {right})");
        let frac = [one.frac, other.frac].into_iter().sum();
        Self::put(Expressions { word: join(&one.word, &other.word), real: join(&one.real, &other.real), frac })
    }

    fn opposite(self) -> Self {
        let Expressions { word, real, frac } = self.get();
        Self::put(Expressions { word: format!("(-{word})"), real: format!("(-{real})"), frac })
    }
}

operators!(Text, |a, b| [a.plus(b), a.both(b, "-"), a.times(b)], a.opposite());

impl Word for Text {
    type Bit = Known;

    fn int(value: i128) -> Self {
        Self::put(Expressions { word: value.to_string(), real: value.to_string(), frac: 0 })
    }
    fn of_bit(bit: Known) -> Self {
        Self::int(bit.0.expect("a known bit").into())
    }
    fn shl(self, bits: u32) -> Self {
        let Expressions { word, real, frac } = self.get();
        Self::put(Expressions { word, real, frac: frac + bits.cast_signed() })
    }
    fn shr(self, bits: u32) -> Self {
        self.round(Rounding::Truncate, bits.cast_signed())
    }
    fn round(self, rounding: Rounding, drop: i32) -> Self {
        let way = match rounding {
            Rounding::Truncate => "dn",
            Rounding::TowardZero => "zr",
            Rounding::NearestUp => "nu",
            Rounding::NearestDown => "nd",
            Rounding::NearestAway => "na",
            Rounding::NearestInward => "nz",
            Rounding::NearestEven => "ne",
            Rounding::NearestOdd => "no",
        };
        let Expressions { word, real, frac } = self.get();
        let word = if drop > 0 { format!("fixed<{}, {way}>({word})", drop - frac) } else { word };
        Self::put(Expressions { word, real, frac: frac - drop })
    }
    /// Assumes words that hold every value that belongs in them, because nothing in this language wraps.
    fn narrow(self, rule: &Narrowing) -> Self {
        // From here on the word is in its own unit.
        let scaled = Self::put(self.get().at(rule.from_frac));
        scaled.round(rule.rounding, rule.from_frac - rule.to.frac())
    }
    fn wrap(self, _: Format) -> Self {
        self
    }
    fn at_least(self, other: Self) -> Known {
        Known(self.constant().zip(other.constant()).map(|(one, other)| one >= other))
    }
    fn equals(self, other: Self) -> Known {
        Known(self.constant().zip(other.constant()).map(|(one, other)| one == other))
    }
    fn branch<const N: usize>(
        bit: Known,
        yes: impl FnOnce() -> [Self; N],
        no: impl FnOnce() -> [Self; N],
    ) -> [Self; N] {
        if bit.0.expect("a script follows one straight line") { yes() } else { no() }
    }
    fn look_up<T: Copy + Into<i64>>(self, _: &[T]) -> Self {
        unreachable!("a script begins behind the tables")
    }
    fn cut(self, name: &str, _: u32) -> Self {
        self.named(name, &capital(name))
    }
    fn limit(self, _: i128, _: i128) -> Self {
        unreachable!("clamps have no word in that language")
    }
}

/// Returns the name of the real number that a word stands for.
pub fn capital(name: &str) -> String {
    let (first, rest) = name.split_at(1);
    first.to_uppercase() + rest
}
