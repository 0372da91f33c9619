//! One-step multiplier of two words of any width, each signed or unsigned, that keeps some bits of the product.
//!
//! - **Equation**: `product = narrow(rounded(a * b / 2^DROP_LOWER))` to `OUT_WIDTH` bits, rounded as `ROUNDING` says,
//!   down unless it says otherwise; `SATURATE` clamps to what the word holds, otherwise the upper bits are dropped.
//! - **Ports**: `a`, `b` in; `product` out, signed if either factor is. `DROP_LOWER` is the fraction bits of `a` and
//!   `b` less those of `product`.
//! - **Latency**: none, combinational. **Reset**: none.
//! - **Overflow**: saturates or wraps, as configured. [`eval`](TruncatingMultiplier::eval) returns the lost bits.
//! - **VHDL twin**: `hdl/truncating_multiplier.vhd`.
//! - **Source**: Vasudevan et al. 2007: 12 x 12 bits, with "the higher 12 bits" of the 24-bit product eliminated, as
//!   [`drop_upper`](TruncatingMultiplier::drop_upper) does. Its Eq. (8) needs the saturation before this truncation.
//! - **Differs from the hardware**: no propagation delay, so no limit on the clock; the product of the paper, whose
//!   device had no multiplier blocks, ripples. SATURATE and ROUNDING are additions, the paper's multiplier drops upper
//!   bits.

use hpu_signal::{Format, Machine, Narrowed, Narrowing, Overflow, Rounding, Word};

use crate::base::config::within;
use crate::base::listed::{Configured, Field, Given, Listed};
use crate::{Block, Combinational, ConfigError, Generic, ROUNDING, Step};

hpu_signal::ports! {
    /// Inputs of the multiplier.
    pub struct In of |block: &TruncatingMultiplier| {
        a: block.a, "1", "First factor";
        b: block.b, "1", "Second factor";
    }
    /// Outputs of the multiplier.
    pub struct Out of |block: &TruncatingMultiplier| {
        product: block.narrowing.to, "1", "The bits kept of the product";
    }
}

/// A truncating multiplier; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TruncatingMultiplier {
    a: Format,
    b: Format,
    narrowing: Narrowing,
    drop_lower: u32,
    fits_64: bool,
}

impl TruncatingMultiplier {
    /// Returns a multiplier of `a` and `b` into `out`.
    ///
    /// # Errors
    ///
    /// Returns an error unless every word has 2 bits or more, `a` and `b` have at most 126 bits together, and `out` is
    /// signed exactly when `a` or `b` is and has no more fraction bits than the product.
    pub fn new(a: Format, b: Format, out: Format, overflow: Overflow) -> Result<Self, ConfigError> {
        within(Self::NAME, "A_WIDTH", a.width(), 2..=64)?;
        within(Self::NAME, "B_WIDTH", b.width(), 2..=64)?;
        within(Self::NAME, "OUT_WIDTH", out.width(), 2..=64)?;
        within(Self::NAME, "A_WIDTH + B_WIDTH", a.width() + b.width(), 4..=126)?;
        if out.is_signed() != (a.is_signed() || b.is_signed()) {
            let found = format!("the product of {a} and {b} is {out}");
            return Err(ConfigError::new(Self::NAME, found, "signed if either factor is, else unsigned"));
        }
        let from_frac = a.frac() + b.frac();
        let drop_lower = u32::try_from(from_frac - out.frac()).map_err(|_| {
            let found = format!("the product of {a} and {b} is {out}");
            ConfigError::new(Self::NAME, found, format!("at most {from_frac} fraction bits"))
        })?;
        let mut block = Self {
            a,
            b,
            narrowing: Narrowing { from_frac, to: out, rounding: Rounding::Truncate, overflow },
            drop_lower,
            fits_64: false,
        };
        block.fits_64 = Step::fits_64(&block);
        Ok(block)
    }

    /// Returns the multiplier with another way to round.
    #[must_use]
    pub fn rounding(mut self, rounding: Rounding) -> Self {
        self.narrowing.rounding = rounding;
        self.fits_64 = Step::fits_64(&self);
        self
    }

    /// Returns a multiplier that keeps all bits of the product.
    ///
    /// # Errors
    ///
    /// Returns the errors of [`new`](Self::new), and an error unless the product has at most 64 bits.
    pub fn full(a: Format, b: Format) -> Result<Self, ConfigError> {
        Self::keeping(a, b, a.width() + b.width(), 0)
    }

    /// Returns a multiplier that keeps the lower `width` bits of the product and drops the upper ones: the paper's
    /// truncation.
    ///
    /// # Errors
    ///
    /// Returns the errors of [`new`](Self::new).
    pub fn drop_upper(a: Format, b: Format, width: u32) -> Result<Self, ConfigError> {
        Self::keeping(a, b, width, 0)
    }

    /// Returns a multiplier that keeps the upper `width` bits of the product and drops the lower ones.
    ///
    /// # Errors
    ///
    /// Returns the errors of [`new`](Self::new), and an error unless the product has `width` bits.
    pub fn drop_lower(a: Format, b: Format, width: u32) -> Result<Self, ConfigError> {
        let product = a.width() + b.width();
        within(Self::NAME, "OUT_WIDTH", width, 2..=product.min(64))?;
        Self::keeping(a, b, width, product - width)
    }

    /// Returns a multiplier that drops the lower bits of the product and clamps it to the range of `out`.
    ///
    /// # Errors
    ///
    /// Returns the errors of [`new`](Self::new).
    pub fn saturate(a: Format, b: Format, out: Format) -> Result<Self, ConfigError> {
        Self::new(a, b, out, Overflow::Saturate)
    }

    /// Returns a multiplier that keeps `width` bits of the product, from bit `drop` up.
    fn keeping(a: Format, b: Format, width: u32, drop: u32) -> Result<Self, ConfigError> {
        within(Self::NAME, "OUT_WIDTH", width, 2..=64)?;
        let signed = a.is_signed() || b.is_signed();
        let integer = if signed { Format::signed(width) } else { Format::unsigned(width) };
        let frac = a.frac() + b.frac() - i32::try_from(drop).expect("at most 126");
        let int = integer.int() - frac;
        let out = Format::new(signed, int, frac).map_err(|_| {
            let found = format!("the kept bits are ({},{int},{frac})", u8::from(signed));
            ConfigError::new(Self::NAME, found, "-63 to 64 integer and fraction bits")
        })?;
        Self::new(a, b, out, Overflow::Wrap)
    }

    /// Returns the product, and which bits were lost to make it.
    #[inline]
    pub fn eval(&self, input: In<i64>) -> Narrowed {
        if self.fits_64 {
            return self.made(input.map(Machine::<i64>::of)).product.narrowed();
        }
        // A word of 64 bits may stand for a value that its machine integer cannot hold.
        let (a, b) = (self.a.value(input.a), self.b.value(input.b));
        self.made(In { a: Machine::exact(a), b: Machine::exact(b) }).product.narrowed()
    }
}

impl Combinational for TruncatingMultiplier {
    #[inline]
    fn made<W: Word>(&self, input: In<W>) -> Out<W> {
        Out { product: (input.a * input.b).narrow(&self.narrowing) }
    }
}

impl Default for TruncatingMultiplier {
    fn default() -> Self {
        let word = Format::unsigned(12);
        Self::saturate(word, word, word).expect("the data sheet's default")
    }
}

impl Block for TruncatingMultiplier {
    const NAME: &'static str = "truncating_multiplier";

    crate::base::block::combinational!(self, input => Out { product: self.eval(input).word });
}

impl TruncatingMultiplier {
    fn told(&self) -> Vec<(&'static str, Generic)> {
        let mut all = vec![
            ("A_WIDTH", Generic::Integer(self.a.width().into())),
            ("B_WIDTH", Generic::Integer(self.b.width().into())),
            ("A_SIGNED", Generic::Boolean(self.a.is_signed())),
            ("B_SIGNED", Generic::Boolean(self.b.is_signed())),
            ("DROP_LOWER", Generic::Integer(self.drop_lower.into())),
            ("OUT_WIDTH", Generic::Integer(self.narrowing.to.width().into())),
            ("SATURATE", Generic::Boolean(self.narrowing.overflow == Overflow::Saturate)),
        ];
        all.extend(self.narrowing.rounding.told(&[ROUNDING]));
        all
    }
}

impl Configured for TruncatingMultiplier {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        // The entity tells no fraction bits but only how many lower bits are dropped. That many fraction bits are given
        // to the factors, to `a` first; if the factors have room for all of them, the product is a whole number.
        let dropped = given.word("DROP_LOWER")?;
        let factor = |width: &str, sign: &str, fraction: i32| {
            let (width, signed) = (given.word(width)?, given.is(sign));
            let fraction = fraction.clamp(0, width.max(0));
            given.format(signed, width.saturating_sub(i32::from(signed)) - fraction, fraction)
        };
        let a = factor("A_WIDTH", "A_SIGNED", dropped)?;
        let b = factor("B_WIDTH", "B_SIGNED", dropped.saturating_sub(a.frac()))?;
        let signed = a.is_signed() || b.is_signed();
        let frac = (a.frac() + b.frac()).saturating_sub(dropped);
        let whole = given.word("OUT_WIDTH")?.saturating_sub(i32::from(signed));
        let out = given.format(signed, whole.saturating_sub(frac), frac)?;
        let overflow = if given.is("SATURATE") { Overflow::Saturate } else { Overflow::Wrap };
        let rounding = given.field(&[ROUNDING], Rounding::Truncate)?;
        Ok(Self::new(a, b, out, overflow)?.rounding(rounding))
    }
}

impl Listed for TruncatingMultiplier {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let format = |signed, int, frac| Format::new(signed, int, frac).expect("at most 48 bits");
        let (unsigned, signed, byte) = (Format::unsigned(12), Format::signed(12), Format::unsigned(8));
        let (fine, fine_signed) = (format(false, 4, 8), format(true, 3, 8));
        // Products of a few bits, so that ties of either sign are met.
        let (small, smaller) = (Format::signed(6), Format::unsigned(5));
        let rounded = |rounding, overflow| {
            let out = format(true, 8, -3);
            Ok(Self::new(small, smaller, out, overflow)?.rounding(rounding))
        };
        Ok(vec![
            ("full", Self::full(unsigned, unsigned)?),
            ("drop_upper", Self::drop_upper(unsigned, unsigned, 12)?),
            ("drop_lower", Self::drop_lower(unsigned, unsigned, 12)?),
            ("saturate_fraction", Self::saturate(fine, fine, fine)?),
            ("full_signed", Self::full(signed, signed)?),
            ("full_mixed", Self::full(signed, unsigned)?),
            ("drop_upper_signed", Self::drop_upper(signed, signed, 12)?),
            ("drop_lower_mixed", Self::drop_lower(signed, unsigned, 12)?),
            ("saturate_signed", Self::saturate(signed, signed, Format::signed(13))?),
            ("saturate_mixed", Self::saturate(signed, fine, Format::signed(13))?),
            ("mixed_other", Self::saturate(fine, fine_signed, format(true, 6, 5))?),
            ("extend", Self::new(byte, Format::signed(8), Format::signed(24), Overflow::Wrap)?),
            ("uneven", Self::drop_lower(Format::signed(18), byte, 20)?),
            ("wide", Self::drop_lower(format(true, 35, 12), format(true, 27, 12), 64)?),
            ("toward_zero", rounded(Rounding::TowardZero, Overflow::Wrap)?),
            ("nearest_up", rounded(Rounding::NearestUp, Overflow::Saturate)?),
            ("nearest_down", rounded(Rounding::NearestDown, Overflow::Wrap)?),
            ("nearest_away", rounded(Rounding::NearestAway, Overflow::Saturate)?),
            ("nearest_inward", rounded(Rounding::NearestInward, Overflow::Wrap)?),
            ("nearest_even", rounded(Rounding::NearestEven, Overflow::Saturate)?),
            ("nearest_odd", rounded(Rounding::NearestOdd, Overflow::Wrap)?),
            ("nearest_even_unsigned", Self::drop_lower(byte, smaller, 6)?.rounding(Rounding::NearestEven)),
        ])
    }
}
