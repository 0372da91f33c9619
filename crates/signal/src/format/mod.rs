//! Word formats that are chosen at run time, written `(S,I,F)` in every language.

pub(crate) mod format_text;
pub(crate) mod notation;

use std::fmt;
use std::str::FromStr;

use crate::format::format_text::read;

/// A fixed-point word format `(S,I,F)`: `S` sign bit, `I` integer bits, `F` fraction bits; width `S+I+F`, 1 to 64 bits.
///
/// `I` or `F` may be negative, as long as the width is at least one bit. The least significant bit is then worth more
/// than 1, or the most significant bit less than ½.
///
/// A word is carried in an `i64`: sign-extended if signed, zero-extended if unsigned. Only an unsigned word of 64 bits
/// does not fit; it is carried as its bit pattern. [`Format::value`] returns the integer that a word stands for.
///
/// # Example
///
/// ```
/// use hpu_signal::Format;
/// let q22: Format = "(1,9,22)".parse().unwrap();
/// assert_eq!(q22.width(), 32);
/// assert_eq!(q22.to_f64(3 << 22), 3.0);
/// assert_eq!(q22.to_string(), "(1,9,22)");
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Format {
    pub(crate) signed: bool,
    pub(crate) int: i8,
    pub(crate) frac: i8,
}

/// Stands in place of a word that has an unknown bit, which only VHDL has. No word of fewer than 64 bits is carried as
/// this value.
pub const UNKNOWN: i64 = i64::MIN;

/// The reason why a format was refused.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum FormatError {
    /// The width is not between 1 and 64 bits.
    Width {
        /// The sign and the numbers of integer and fraction bits that were asked for.
        asked: (bool, i32, i32),
    },
    /// The text is in no known notation.
    Syntax(String),
    /// A number of the crate `fixed` has another format than the word that it was to be.
    Type {
        /// The format of the number's type.
        number: Format,
        /// The format of the word.
        word: Format,
    },
}

impl fmt::Display for FormatError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Width { asked: (s, i, fr) } => write!(
                f,
                "format ({},{i},{fr}) has {} bits; a word has 1 to 64",
                u8::from(*s),
                i64::from(*s) + i64::from(*i) + i64::from(*fr)
            ),
            Self::Type { number, word } => write!(f, "a number {number} is no word {word}"),
            Self::Syntax(text) => write!(
                f,
                "`{text}` is not a format; write (S,I,F): sign bit 0 or 1, integer bits, fraction bits, as in \
                 (1,9,22); or UQ4.8, Q4.8 (as TI writes it: the sign bit is not among the 4), ufix12_En8, sfix16_En12, \
                 ufixed(3 downto -8), ap_ufixed<12,4>"
            ),
        }
    }
}

impl std::error::Error for FormatError {}

impl Format {
    /// The format of one unsigned bit.
    pub const BIT: Self = Self { signed: false, int: 1, frac: 0 };

    /// Returns a format from its three numbers.
    ///
    /// # Errors
    ///
    /// Returns [`FormatError::Width`] unless the width is 1 to 64 bits (and `int`, `frac` are within -63..=64).
    pub fn new(signed: bool, int: i32, frac: i32) -> Result<Self, FormatError> {
        let width = i64::from(signed) + i64::from(int) + i64::from(frac);
        let near = -63..=64;
        if (1..=64).contains(&width) && near.contains(&int) && near.contains(&frac) {
            Ok(Self { signed, int: int as i8, frac: frac as i8 })
        } else {
            Err(FormatError::Width { asked: (signed, int, frac) })
        }
    }

    /// Returns the format of an unsigned integer of `width` bits.
    ///
    /// # Panics
    ///
    /// Panics if `width` is not 1 to 64. It is for widths that are known when the program is written; for others use
    /// [`Format::new`].
    pub fn unsigned(width: u32) -> Self {
        Self::new(false, width as i32, 0).expect("a width of 1 to 64 bits")
    }

    /// Returns the format of a two's complement integer of `width` bits, sign bit included.
    ///
    /// # Panics
    ///
    /// Panics if `width` is not 1 to 64. It is for widths that are known when the program is written; for others use
    /// [`Format::new`].
    pub fn signed(width: u32) -> Self {
        Self::new(true, width as i32 - 1, 0).expect("a width of 1 to 64 bits")
    }

    /// Whether the word has a sign bit.
    pub const fn is_signed(self) -> bool {
        self.signed
    }

    /// Returns the number of integer bits `I`.
    pub const fn int(self) -> i32 {
        self.int as i32
    }

    /// Returns the number of fraction bits `F`.
    pub const fn frac(self) -> i32 {
        self.frac as i32
    }

    /// Returns the width in bits.
    pub const fn width(self) -> u32 {
        (self.signed as i32 + self.int as i32 + self.frac as i32) as u32
    }

    /// Returns the least integer that the word can hold, in units of its least significant bit.
    pub const fn min(self) -> i128 {
        if self.signed { -(1i128 << (self.width() - 1)) } else { 0 }
    }

    /// Returns the greatest integer that the word can hold, in units of its least significant bit.
    pub const fn max(self) -> i128 {
        (1i128 << (self.width() - self.signed as u32)) - 1
    }

    /// Whether an integer, in units of the least significant bit, fits the word.
    pub const fn holds(self, value: i128) -> bool {
        self.min() <= value && value <= self.max()
    }

    /// Returns the word whose bits are the low bits of `value`: the bits that hardware keeps if the upper wires are
    /// left open.
    pub const fn wrap(self, value: i128) -> i64 {
        self.wrap_low(value as i64)
    }

    /// Computes [`wrap`](Self::wrap) from the lowest 64 bits of a value; the other bits do not matter.
    pub(crate) const fn wrap_low(self, value: i64) -> i64 {
        let free = 64 - self.width();
        let bits = (value as u64) << free;
        if self.signed { (bits as i64) >> free } else { (bits >> free) as i64 }
    }

    /// Whether the word is [`UNKNOWN`], which stands in place of a word with an unknown bit. Never true for words of 64
    /// bits.
    pub const fn is_unknown(self, word: i64) -> bool {
        word == UNKNOWN && self.width() < 64
    }

    /// Returns the integer that a word stands for, in units of the least significant bit.
    pub const fn value(self, word: i64) -> i128 {
        if self.signed { word as i128 } else { word as u64 as i128 }
    }

    /// Returns the bits of a word, right-aligned; all other bits are zero.
    pub const fn bits(self, word: i64) -> u64 {
        (word as u64) & (u64::MAX >> (64 - self.width()))
    }

    /// Returns the word with these bits; bits beyond the width are ignored.
    pub const fn from_bits(self, bits: u64) -> i64 {
        self.wrap(bits as i128)
    }

    /// Returns the value of the least significant bit, 2^-F.
    pub fn lsb(self) -> f64 {
        // 2^n for |n| <= 64 is exact; it is built from its exponent field.
        f64::from_bits(((1023 - i64::from(self.frac)) as u64) << 52)
    }

    /// Returns the value of a word as a float, which is exact up to 53 significant bits.
    pub fn to_f64(self, word: i64) -> f64 {
        (if self.signed { word as f64 } else { word as u64 as f64 }) * self.lsb()
    }

    /// Returns the format of the full product: integer and fraction bits add, and it is signed if either factor is.
    ///
    /// # Errors
    ///
    /// Returns [`FormatError::Width`] if the sum of the widths exceeds 64 bits. The product of wider words must be
    /// narrowed directly by [`Narrowing`](crate::Narrowing), which works on exact `i128` integers.
    pub fn product(self, other: Self) -> Result<Self, FormatError> {
        let signed = self.signed || other.signed;
        let width = (self.width() + other.width()) as i32;
        let frac = self.frac() + other.frac();
        Self::new(signed, width - i32::from(signed) - frac, frac)
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "({},{},{})", u8::from(self.signed), self.int, self.frac)
    }
}

impl fmt::Debug for Format {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// Reads `(S,I,F)` and the notations of other tools, in capital or small letters:
///
/// | text | format | notation |
/// |---|---|---|
/// | `UQ4.8` | (0,4,8) | Q notation, unsigned |
/// | `Q4.8` | (1,4,8), 13 bits | Q notation as TI writes it: the sign bit is *not* among the 4 integer bits |
/// | `Q4.8 (12 bits, ARM)` | (1,3,8), 12 bits | Q notation as ARM writes it, sign bit counted: the width must say so |
/// | `s4.8`, `u4.8` | (1,4,8), (0,4,8) | as comments of designs have it |
/// | `sfix16_En12`, `ufix12_En8`, `ufix12`, `ufix8_E2` | (1,3,12), (0,4,8), (0,12,0), (0,10,-2) | MathWorks |
/// | `Fix_16_12`, `UFix_12_8`, `ufix12_8`, `ufix<12,8>` | (1,3,12), (0,4,8) | the whole width, then the fraction bits |
/// | `sfixed(3 downto -12)`, `ufixed(3 downto -8)` | (1,3,12), (0,4,8) | VHDL-2008 |
/// | `ap_fixed<16,4>`, `ap_ufixed<12,4>` | (1,3,12), (0,4,8) | C++ high-level synthesis: the width, then integer bits |
impl FromStr for Format {
    type Err = FormatError;

    fn from_str(text: &str) -> Result<Self, FormatError> {
        let (signed, int, frac) = read(text).ok_or_else(|| FormatError::Syntax(text.to_string()))?;
        Self::new(signed, int, frac)
    }
}
