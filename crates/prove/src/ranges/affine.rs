//! Reads equations as ranges and affine forms: bounds that no word computed from such words can exceed.
//!
//! [`Affine::on_a_sheet`] makes one sheet, which stores all words; an [`Affine`] is a place on that sheet.

use std::cell::RefCell;

use hpu_signal::{Format, Narrowing, Overflow, Rounding, Sine, Word, operators, truths};

use super::span::Symbols;
use super::word::Word as Known;
use hpu_signal::Span;

/// All words so far.
#[derive(Default)]
struct Sheet {
    symbols: Symbols,
    words: Vec<Known>,
    /// Words inside blocks, with the names that their equations give them.
    named: Vec<(String, Affine, u32)>,
}

thread_local! {
    static SHEET: RefCell<Sheet> = RefCell::default();
}

/// A word with a known range and affine form, in units of its least significant bit.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Affine(usize);

/// Whether a condition can be false, and whether it can be true.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Maybe {
    no: bool,
    yes: bool,
}

truths!(Maybe, |a, b| [Self { no: a.no || b.no, yes: a.yes && b.yes }, !(!a & !b)], Self { no: a.yes, yes: a.no },);

impl Affine {
    /// Calls `make` with an empty sheet.
    pub fn on_a_sheet<R>(make: impl FnOnce() -> R) -> R {
        let before = SHEET.take();
        let made = make();
        SHEET.replace(before);
        made
    }

    /// Makes a word from the sheet's symbols.
    pub fn put(make: impl FnOnce(&mut Symbols) -> Known) -> Self {
        SHEET.with_borrow_mut(|sheet| {
            let known = make(&mut sheet.symbols);
            sheet.words.push(known);
            Self(sheet.words.len() - 1)
        })
    }

    /// Returns its range, form and error.
    pub fn known(self) -> Known {
        SHEET.with_borrow(|sheet| sheet.words[self.0].clone())
    }

    /// Makes a word that has no error.
    pub fn given(span: Span) -> Self {
        Self::put(|symbols| symbols.given(span))
    }

    /// Returns the word less its exact value, and the fraction bits of that difference; `None` where no error is
    /// proved.
    pub fn error(self) -> Option<(Span, i32)> {
        SHEET.with_borrow(|sheet| sheet.symbols.error(&sheet.words[self.0]))
    }

    /// Returns the word of this name inside the blocks read last, and its bits.
    pub fn named(name: &str) -> Option<(Self, u32)> {
        SHEET.with_borrow(|sheet| {
            let found = sheet.named.iter().rev().find(|(found, ..)| found == name);
            found.map(|&(_, word, width)| (word, width))
        })
    }

    /// Returns a new word, made of this one by `change`.
    pub fn with(self, change: impl FnOnce(Known, &mut Symbols) -> Known) -> Self {
        let known = self.known();
        Self::put(|symbols| change(known, symbols))
    }

    /// Returns the word of another edge: it has the same range and error, but is not the same number.
    pub fn another(self) -> Self {
        let error = self.error();
        self.with(|known, symbols| {
            let turns = known.turns.map(|(width, form)| {
                let range = symbols.range(&form);
                (width, symbols.fresh(range, 0))
            });
            if known.span.min == known.span.max {
                return Known { turns, ..known };
            }
            Known { turns, ..symbols.replaced(known.span, error, known.fits) }
        })
    }

    /// Returns whether it can only be one number.
    pub fn is_constant(self) -> bool {
        let Span { min, max } = self.known().span;
        min == max
    }

    /// Returns whether everything known of `other` also holds for this word.
    pub fn is_within(self, other: Self) -> bool {
        let (known, wider) = (self.known(), other.known());
        let turns = match (&known.turns, &wider.turns) {
            (_, None) => true,
            (None, Some((_, wide))) => known.span.is_within(SHEET.with_borrow(|sheet| sheet.symbols.range(wide))),
            (Some((width, form)), Some((other, wide))) => SHEET
                .with_borrow(|sheet| width >= other && sheet.symbols.range(form).is_within(sheet.symbols.range(wide))),
        };
        let error = match (self.error(), other.error()) {
            (_, None) => true,
            (None, Some(_)) => false,
            (Some(error), Some(wider)) => {
                let frac = error.1.max(wider.1);
                let [error, wider] = [error, wider].map(|(range, own)| range.shifted(own - frac));
                error.is_within(wider)
            }
        };
        turns && error && (known.fits || !wider.fits) && known.span.is_within(wider.span)
    }

    /// Returns a word that is one of two; if one of them holds all of the other, that word itself.
    pub fn or(self, other: Self) -> Self {
        if other.is_within(self) {
            self
        } else if self.is_within(other) {
            other
        } else {
            self.both(other, Symbols::either)
        }
    }

    fn both(self, other: Self, make: impl FnOnce(&mut Symbols, &Known, &Known) -> Known) -> Self {
        let (one, other) = (self.known(), other.known());
        Self::put(|symbols| make(symbols, &one, &other))
    }

    /// Returns how far it is above another word.
    fn above_by(self, other: Self) -> Span {
        self.both(other, |symbols, one, other| symbols.sum(one, &symbols.negated(other))).known().span
    }
}

operators!(
    Affine,
    |a, b| [a.both(b, Symbols::sum), a + -b, a.both(b, Symbols::product)],
    a.with(|known, symbols| symbols.negated(&known)),
);

impl Word for Affine {
    type Bit = Maybe;

    fn int(value: i128) -> Self {
        Self::given(Span::exact(value))
    }
    fn of_bit(Maybe { no, yes }: Maybe) -> Self {
        Self::given(Span::new(i128::from(!no), i128::from(yes)))
    }
    fn shl(self, bits: u32) -> Self {
        self * Self::int(1 << bits)
    }
    fn shr(self, bits: u32) -> Self {
        self.round(Rounding::Truncate, bits.cast_signed())
    }
    fn round(self, rounding: Rounding, drop: i32) -> Self {
        if drop <= 0 {
            return self.shl(drop.unsigned_abs());
        }
        self.with(|known, symbols| symbols.rounded(&known, rounding, drop.cast_unsigned()))
    }
    fn narrow(self, rule: &Narrowing) -> Self {
        let rounded = self.round(rule.rounding, rule.from_frac - rule.to.frac());
        rounded.with(|known, symbols| match rule.overflow {
            _ if known.span.is_within(Span::of(rule.to)) => known,
            Overflow::Wrap => {
                let before = Some((known.span, symbols.error(&known)));
                Known { before, ..symbols.wrapped(rule.to) }
            }
            Overflow::Saturate => Known { fits: false, ..symbols.limited(&known, Span::of(rule.to)) },
        })
    }
    fn wrap(self, to: Format) -> Self {
        self.with(|known, symbols| symbols.turned(known, to))
    }
    fn at_least(self, other: Self) -> Maybe {
        let Span { min, max } = self.above_by(other);
        Maybe { no: min < 0, yes: max >= 0 }
    }
    fn equals(self, other: Self) -> Maybe {
        let Span { min, max } = self.above_by(other);
        Maybe { no: min != 0 || max != 0, yes: min <= 0 && 0 <= max }
    }
    fn branch<const N: usize>(
        bit: Maybe,
        yes: impl FnOnce() -> [Self; N],
        no: impl FnOnce() -> [Self; N],
    ) -> [Self; N] {
        if !bit.no {
            return yes();
        } else if !bit.yes {
            return no();
        }
        let (yes, no) = (yes(), no());
        std::array::from_fn(|index| if yes[index] == no[index] { yes[index] } else { yes[index].either(no[index]) })
    }
    fn look_up<T: Copy + Into<i64>>(self, table: &[T]) -> Self {
        self.with(|known, symbols| Known { exact: None, ..symbols.given(among(table, known.span)) })
    }
    /// Every entry is the nearest word, apart from the rounding of the float that it was computed with.
    fn sine<T: Copy + Into<i64>>(self, Sine { frac, .. }: Sine, table: &[T]) -> Self {
        self.with(|known, symbols| {
            let fine = (53 - frac).max(1);
            let off = (1 << (fine - 1)) + (1i128 << (fine + frac - 53));
            symbols.replaced(among(table, known.span), Some((Span::new(-off, off), fine)), true)
        })
    }
    fn bit(self, place: u32) -> Maybe {
        match self.known().span {
            Span { min, max } if min >> place == max >> place => {
                Maybe { no: min >> place & 1 == 0, yes: min >> place & 1 == 1 }
            }
            _ => Maybe { no: true, yes: true },
        }
    }
    fn cut(self, name: &str, width: u32) -> Self {
        SHEET.with_borrow_mut(|sheet| sheet.named.push((name.to_string(), self, width)));
        self
    }
    /// Its losses are reported elsewhere; its error goes on.
    fn shed(self) -> Self {
        self.with(|known, _| Known { fits: true, ..known })
    }
    fn greater(self, other: Self) -> Self {
        let Span { min, max } = self.above_by(other);
        if min >= 0 {
            self
        } else if max <= 0 {
            other
        } else {
            let least = self.known().span.min.max(other.known().span.min);
            self.either(other).with(|known, symbols| symbols.within(&known, Span::new(least, known.span.max)))
        }
    }
    fn lesser(self, other: Self) -> Self {
        -(-self).greater(-other)
    }
    fn overflowing(self, bit: Maybe) -> Self {
        self.with(|known, _| Known { fits: known.fits && !bit.yes, ..known })
    }
    fn limit(self, least: i128, most: i128) -> Self {
        self.with(|known, symbols| symbols.limited(&known, Span::new(least, most)))
    }
}

impl Affine {
    fn either(self, other: Self) -> Self {
        self.both(other, Symbols::either)
    }
}

/// Returns the words of a table at these addresses, limited to the table's own.
fn among<T: Copy + Into<i64>>(table: &[T], addresses: Span) -> Span {
    let last = table.len() - 1;
    let [from, to] =
        [addresses.min, addresses.max].map(|at| usize::try_from(at.max(0)).map_or(last, |at| at.min(last)));
    let words = table[from..=to].iter().map(|&word| i128::from(word.into()));
    words.map(Span::exact).reduce(Span::hull).expect("a word")
}

#[cfg(test)]
mod tests {
    use hpu_signal::Machine;

    use super::*;

    fn twice<W: Word>(a: W, b: W, first: &Narrowing, second: &Narrowing) -> W {
        ((a * b - a).narrow(first) * b + a.shl(1)).narrow(second)
    }

    /// Returns all pairs of the words below.
    fn pairs() -> impl Iterator<Item = (i64, i64)> {
        (-8..8).flat_map(|a| (0..8).map(move |b| (a, b)))
    }

    fn given(least: i128, most: i128) -> Affine {
        Affine::given(Span::new(least, most))
    }

    #[test]
    fn range_and_error_hold_every_word_and_every_difference() {
        let rule = |rounding, drop| {
            let (to, overflow) = (Format::signed(16), Overflow::Wrap);
            Narrowing { from_frac: drop, to, rounding, overflow }
        };
        for (rounding, drop) in Rounding::ALL.into_iter().flat_map(|rounding| (0..4).map(move |drop| (rounding, drop)))
        {
            let (first, second) = (rule(rounding, drop), rule(rounding, 2));
            let (span, error) = Affine::on_a_sheet(|| {
                let made = twice(given(-8, 7), given(0, 7), &first, &second);
                (made.known().span, made.error().expect("no wrap"))
            });
            let unit = f64::from(1 << drop);
            let [mut least, mut most] = [f64::INFINITY, f64::NEG_INFINITY];
            for (a, b) in pairs() {
                let word = twice(Machine::<i64>::of(a), Machine::of(b), &first, &second).narrowed().word;
                let truth = ((a * b - a) as f64 / unit * b as f64 + 2.0 * a as f64) / 4.0;
                assert!((span.min..=span.max).contains(&i128::from(word)), "{word} beyond {span:?}");
                let off = word as f64 - truth;
                (least, most) = (least.min(off), most.max(off));
            }
            let proved = [error.0.min, error.0.max].map(|end| end as f64 * 2f64.powi(-error.1));
            assert!(proved[0] <= least && most <= proved[1], "{least} to {most} beyond {proved:?}");
            // The bounds are upper bounds, but not loose ones.
            assert!(proved[1] - proved[0] <= 3.0 * (most - least) + 1e-9, "{least} to {most} far inside {proved:?}");
        }
    }

    #[test]
    fn a_word_fits_where_no_input_overflows_and_nothing_is_promised_after_a_wrap() {
        for (overflow, width) in
            Overflow::ALL.into_iter().flat_map(|overflow| (3..9).map(move |width| (overflow, width)))
        {
            let rule = Narrowing { from_frac: 1, to: Format::signed(width), rounding: Rounding::NearestUp, overflow };
            let known = Affine::on_a_sheet(|| (given(-8, 7) * given(0, 7)).narrow(&rule).known());
            let made = |(a, b)| (Machine::<i64>::of(a) * Machine::of(b)).narrow(&rule).narrowed();
            assert!(pairs().all(|pair| known.span.min <= i128::from(made(pair).word)));
            assert!(pairs().all(|pair| i128::from(made(pair).word) <= known.span.max));
            // The range of one product is reached, so this is not only an upper bound.
            assert_eq!(known.fits, !pairs().any(|pair| made(pair).overflowed), "{width} bits");
            assert_eq!(known.exact.is_some(), known.fits || overflow == Overflow::Saturate);
        }
    }

    #[test]
    fn a_bit_is_known_where_it_is_the_same_in_all_words() {
        for (least, most, place) in (-8..8).flat_map(|a| (a..8).flat_map(move |b| (0..5).map(move |c| (a, b, c)))) {
            let Maybe { no, yes } = Affine::on_a_sheet(|| given(least, most).bit(place));
            let is_seen = |bit: i128| (least..=most).any(|word| word >> place & 1 == bit);
            assert!((no || !is_seen(0)) && (yes || !is_seen(1)), "bit {place} of {least} to {most}");
            // The uppermost bits of a range of one sign are known.
            assert!(least ^ most < 0 || place < 4 || no != yes, "bit {place} of {least} to {most}");
        }
    }

    #[test]
    fn a_counter_that_turns_over_reads_through_its_difference() {
        // A counter of 4 bits counts from -6 to 5; seen from 9, where 9 is read as -7.
        let (word, to) = (Format::unsigned(4), Format::signed(4));
        let known = Affine::on_a_sheet(|| {
            let position = Affine::put(|symbols| {
                let counts = symbols.fresh(Span::new(-6, 5), 0);
                Known { turns: Some((4, counts)), ..symbols.given(Span::of(word)) }
            });
            [Affine::int(15), Affine::int(9)].map(|reference| (position - reference).wrap(to).known())
        });
        let seen =
            |reference: i64| (-6..=5).map(move |count: i64| to.wrap(i128::from(count.rem_euclid(16) - reference)));
        assert_eq!((known[0].span, known[0].fits), (Span::new(-5, 6), true));
        assert!(seen(15).eq((-6..=5).map(|count| count + 1)), "from -1 on, no more than that");
        // From -7 on it would reach 12, which is beyond 7.
        assert!(!known[1].fits && known[1].span == Span::of(to) && seen(9).any(|delta| delta < 0));
    }
}
