//! Words on their way through blocks: the range of each, and its distance from the same law in real numbers.

use hpu_signal::{Format, Rounding};

use super::span::{Form, Symbols};
use hpu_signal::Span;

/// The knowledge about a word, in units of its least significant bit.
#[derive(Clone, Debug)]
pub struct Word {
    /// Its range.
    pub span: Span,
    /// After a wrap, the range and the error before it.
    pub before: Option<(Span, Option<(Span, i32)>)>,
    /// Its value as a form of the numbers that it is computed from; a form may have finer units.
    pub form: Form,
    /// Its value in real numbers; `None` after a wrap.
    pub exact: Option<Form>,
    /// Whether it held every value that belonged in it.
    pub fits: bool,
    /// For a word that wraps: its number of bits, and a whole number that equals it modulo these bits.
    pub turns: Option<(u32, Form)>,
}

/// Fraction bits that are kept: of a factor's error in a product, of a factor's true value, and of errors in general.
/// They are far more than figures show, and few enough for 127 bits.
const KEPT: [i32; 3] = [44, 24, 64];

impl Symbols {
    fn known(span: Span, form: Form, exact: Option<Form>, fits: bool) -> Word {
        Word { span, before: None, form, exact, fits, turns: None }
    }

    /// Makes a word that has no error: a count, a setting.
    pub fn given(&mut self, span: Span) -> Word {
        let form = if span.min == span.max { Form::constant(span.min, 0) } else { self.fresh(span, 0) };
        Self::known(span, form.clone(), Some(form), true)
    }

    /// Makes a word that may be any of its format. Errors of words computed from it are counted from its value as it
    /// stands.
    pub fn any(&mut self, format: Format) -> Word {
        Word { fits: false, ..self.given(Span::of(format)) }
    }

    /// Makes a word that may be any of its format and has no known error any more.
    pub fn wrapped(&mut self, format: Format) -> Word {
        Word { exact: None, ..self.any(format) }
    }

    /// Returns the word less its exact value, and the fraction bits of that difference.
    pub fn error(&self, word: &Word) -> Option<(Span, i32)> {
        let difference = word.form.minus(word.exact.as_ref()?);
        Some((self.range(&difference), difference.frac))
    }

    /// Makes a word of a known range whose error lies in `error`; with `None`, its error is unknown.
    pub fn replaced(&mut self, span: Span, error: Option<(Span, i32)>, fits: bool) -> Word {
        let form = self.fresh(span, 0);
        let exact = error.map(|(range, frac)| {
            let range = range.hull(Span::exact(0));
            if range == Span::exact(0) { form.clone() } else { form.minus(&self.fresh(range, frac)) }
        });
        Self::known(span, form, exact, fits)
    }

    /// Returns the exact product.
    pub fn product(&mut self, one: &Word, other: &Word) -> Word {
        let (span, fits) = (one.span.times(other.span), one.fits && other.fits);
        for (word, by) in [(one, other), (other, one)] {
            if by.span.min == by.span.max && by.exact.as_ref() == Some(&by.form) {
                let times = |form: &Form| form.times(by.span.min, 0);
                return Self::known(span, times(&word.form), word.exact.as_ref().map(times), fits);
            }
        }
        // With words a, b and true values a', b': a b - a' b' = a (b - b') + b' (a - a').
        let errors =
            self.error(one).zip(self.error(other)).map(|(one, other)| [one, other].map(|of| coarse(of, KEPT[0])));
        let error = errors.map(|[own, (by, frac)]| {
            let truth = coarse((other.span.shifted(-frac).plus(by.times(Span::exact(-1))), frac), KEPT[1]);
            let (first, second) = ((one.span.times(by), frac), (truth.0.times(own.0), truth.1 + own.1));
            let [first, second] = [first, coarse(second, KEPT[0])];
            let frac = first.1.max(second.1);
            (first.0.shifted(first.1 - frac).plus(second.0.shifted(second.1 - frac)), frac)
        });
        self.replaced(span, error, fits)
    }

    /// Returns the sum.
    pub fn sum(&mut self, left: &Word, right: &Word) -> Word {
        let form = left.form.plus(&right.form);
        let exact = left.exact.as_ref().zip(right.exact.as_ref()).map(|(left, right)| left.plus(right));
        let span = left.span.plus(right.span).meet(self.words(&form, 0));
        let width = left.turns.iter().chain(&right.turns).map(|turns| turns.0).min();
        let turns = width.map(|width| (width, left.whole().plus(right.whole())));
        let turns = turns.filter(|(_, form)| form.frac == 0);
        Word { turns, ..Self::known(span, form, exact, left.fits && right.fits) }
    }

    /// Returns the word times -1.
    pub fn negated(&self, word: &Word) -> Word {
        let times = |form: &Form| form.times(-1, 0);
        let turns = word.turns.as_ref().map(|(width, form)| (*width, times(form)));
        let span = word.span.times(Span::exact(-1));
        Word { turns, ..Self::known(span, times(&word.form), word.exact.as_ref().map(times), word.fits) }
    }

    /// Returns the word over `2^drop`, rounded.
    pub fn rounded(&mut self, word: &Word, rounding: Rounding, drop: u32) -> Word {
        let by = drop.cast_signed();
        let over = |form: &Form| form.times(1, by);
        let half = match rounding {
            Rounding::Truncate => 0,
            Rounding::NearestUp => 1i128 << (drop - 1),
            _ => {
                let [min, max] = [word.span.min, word.span.max].map(|end| rounding.shift(end, drop));
                let error = self.error(word).map(|(range, frac)| {
                    let fine = frac.max(0);
                    let Span { min, max } = moved_by(rounding, word.span, drop);
                    (range.shifted(frac - fine).plus(Span::new(min << fine, max << fine)), fine + by)
                });
                return self.replaced(Span::new(min, max), error, word.fits);
            }
        };
        let up = over(&word.form).plus(&Form::constant(half, by));
        let form = self.truncated(&up, 0);
        let span = self.words(&up, 0).meet(word.span.plus(Span::exact(half)).shifted(by));
        let rounded = Self::known(span, form, word.exact.as_ref().map(over), word.fits);
        if rounded.exact.as_ref().is_none_or(|exact| exact.frac <= KEPT[2]) {
            return rounded;
        }
        let error = self.error(&rounded).map(|error| coarse(error, KEPT[0]));
        self.replaced(span, error, word.fits)
    }

    /// Returns a word that counts modulo its width.
    pub fn turned(&mut self, word: Word, to: Format) -> Word {
        if let Some((_, form)) = word.turns.as_ref().filter(|turns| turns.0 >= to.width()) {
            let (range, turn) = (self.range(form), 1i128 << to.width());
            let back = -(range.min - to.min()).div_euclid(turn) * turn;
            if range.max + back <= to.max() {
                let form = form.plus(&Form::constant(back, 0));
                return Self::known(range.plus(Span::exact(back)), form.clone(), Some(form), word.fits);
            }
        }
        if word.span.is_within(Span::of(to)) { word } else { self.any(to) }
    }

    /// Returns the word clamped; a clamp adds nothing to an error.
    pub fn limited(&mut self, word: &Word, to: Span) -> Word {
        if word.span.is_within(to) {
            return word.clone();
        }
        let error = self.error(word);
        self.replaced(word.span.clamp(to), error, word.fits)
    }

    /// Returns a word that is one of two.
    pub fn either(&mut self, left: &Word, right: &Word) -> Word {
        let errors = self.error(left).zip(self.error(right)).map(|((left, fine), (right, finer))| {
            let frac = fine.max(finer);
            (left.shifted(fine - frac).hull(right.shifted(finer - frac)), frac)
        });
        self.replaced(left.span.hull(right.span), errors, left.fits && right.fits)
    }

    /// Returns the same word with its range limited to `span`.
    pub fn within(&mut self, word: &Word, span: Span) -> Word {
        let error = self.error(word);
        self.replaced(span, error, word.fits)
    }
}

impl Word {
    /// Returns the whole number that the word equals, or equals modulo its width.
    fn whole(&self) -> &Form {
        self.turns.as_ref().map_or(&self.form, |(_, form)| form)
    }
}

/// Returns the value of a word, rounded by `way`: beyond 2^53 the nearest float may be on the wrong side.
pub fn outward(word: i128, format: Format, way: fn(f64) -> f64) -> f64 {
    let value = word as f64 * format.lsb();
    if word.abs() < 1 << 53 { value } else { way(value) }
}

/// Returns the greatest size of an error, rounded up.
pub fn most((range, frac): (Span, i32), format: Format) -> f64 {
    outward(range.max.max(-range.min), format, f64::next_up) * 2f64.powi(-frac)
}

/// Rounds outwards to `kept` fraction bits.
fn coarse((range, frac): (Span, i32), kept: i32) -> (Span, i32) {
    let more = (frac - kept).max(0);
    (Span::new(range.min >> more, -(-range.max >> more)), frac - more)
}

/// Returns how far rounding moves a word of this range, in units of the last bit that is dropped.
fn moved_by(rounding: Rounding, words: Span, drop: u32) -> Span {
    let (unit, half) = (1i128 << drop, 1i128 << (drop - 1));
    let [down, up] = [Span::new(-half, half - 1), Span::new(1 - half, half)];
    let by_sign = |positive: Span, negative: Span| match words {
        Span { min: 0.., .. } => positive,
        Span { max: ..=0, .. } => negative,
        _ => positive.hull(negative),
    };
    match rounding {
        Rounding::Truncate => Span::new(1 - unit, 0),
        Rounding::TowardZero => by_sign(Span::new(1 - unit, 0), Span::new(0, unit - 1)),
        Rounding::NearestUp => up,
        Rounding::NearestDown => down,
        Rounding::NearestAway => by_sign(up, down),
        Rounding::NearestInward => by_sign(down, up),
        Rounding::NearestEven | Rounding::NearestOdd => up.hull(down),
    }
}
