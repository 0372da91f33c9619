//! Words on their way through blocks: the range of each, and how far it may be from the same law in real numbers.

use hpu_signal::{Format, Rounding};

use super::span::{Form, Span, Symbols};

/// A word as far as it is known, in units of its least significant bit.
#[derive(Clone, Debug)]
pub(crate) struct Word {
    pub span: Span,
    /// After a wrap, the range that was to be in it, and the error of that.
    pub before: Option<(Span, Option<(Span, i32)>)>,
    /// Its value by what it is made of; a form may count finer.
    pub form: Form,
    /// The value that real numbers would give; none after a wrap.
    pub exact: Option<Form>,
    /// Whether it held everything that was to be in it.
    pub fits: bool,
    /// Of a word that turns over: so many bits, and a whole number that it is modulo these.
    pub turns: Option<(u32, Form)>,
}

/// Fraction bits that a product keeps of its factors' errors, of a factor's true value, and that errors may have at
/// all: far more than figures show, and few enough for 127 bits.
const KEPT: [i32; 3] = [44, 24, 64];

impl Symbols {
    fn known(span: Span, form: Form, exact: Option<Form>, fits: bool) -> Word {
        Word { span, before: None, form, exact, fits, turns: None }
    }

    /// A word that is right by itself: a count, a setting.
    pub fn given(&mut self, span: Span) -> Word {
        let form = if span.min == span.max { Form::constant(span.min, 0) } else { self.fresh(span, 0) };
        Self::known(span, form.clone(), Some(form), true)
    }

    /// Any word at all. What follows is right on it as it stands, whatever it was to be.
    pub fn any(&mut self, format: Format) -> Word {
        Word { fits: false, ..self.given(Span::of(format)) }
    }

    /// Any word at all, of which nothing is promised any more.
    pub fn wrapped(&mut self, format: Format) -> Word {
        Word { exact: None, ..self.any(format) }
    }

    /// Word less exact value, and the fraction bits of that.
    pub fn error(&self, word: &Word) -> Option<(Span, i32)> {
        let difference = word.form.minus(word.exact.as_ref()?);
        Some((self.range(&difference), difference.frac))
    }

    /// A word of a known range whose error is one of these, or none at all.
    pub fn replaced(&mut self, span: Span, error: Option<(Span, i32)>, fits: bool) -> Word {
        let form = self.fresh(span, 0);
        let exact = error.map(|(range, frac)| {
            let range = range.hull(Span::exact(0));
            if range == Span::exact(0) { form.clone() } else { form.minus(&self.fresh(range, frac)) }
        });
        Self::known(span, form, exact, fits)
    }

    /// The product, exactly.
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

    /// The sum.
    pub fn sum(&mut self, left: &Word, right: &Word) -> Word {
        let form = left.form.plus(&right.form);
        let exact = left.exact.as_ref().zip(right.exact.as_ref()).map(|(left, right)| left.plus(right));
        let span = left.span.plus(right.span).meet(self.words(&form, 0));
        let width = left.turns.iter().chain(&right.turns).map(|turns| turns.0).min();
        let turns = width.map(|width| (width, left.whole().plus(right.whole())));
        let turns = turns.filter(|(_, form)| form.frac == 0);
        Word { turns, ..Self::known(span, form, exact, left.fits && right.fits) }
    }

    /// The word times -1.
    pub fn negated(&self, word: &Word) -> Word {
        let times = |form: &Form| form.times(-1, 0);
        let turns = word.turns.as_ref().map(|(width, form)| (*width, times(form)));
        let span = word.span.times(Span::exact(-1));
        Word { turns, ..Self::known(span, times(&word.form), word.exact.as_ref().map(times), word.fits) }
    }

    /// Over `2^drop`, rounded.
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
                    let unit = 1i128 << (fine + by);
                    (range.shifted(frac - fine).plus(Span::new(-unit, unit)), fine + by)
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

    /// A word that counts modulo its width.
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

    /// Clamped; no clamp adds to an error.
    pub fn limited(&mut self, word: &Word, to: Span) -> Word {
        if word.span.is_within(to) {
            return word.clone();
        }
        let error = self.error(word);
        self.replaced(word.span.clamp(to), error, word.fits)
    }

    /// One of two words.
    pub fn either(&mut self, left: &Word, right: &Word) -> Word {
        let errors = self.error(left).zip(self.error(right)).map(|((left, fine), (right, finer))| {
            let frac = fine.max(finer);
            (left.shifted(fine - frac).hull(right.shifted(finer - frac)), frac)
        });
        self.replaced(left.span.hull(right.span), errors, left.fits && right.fits)
    }

    /// The same word where its range is known to be this.
    pub fn within(&mut self, word: &Word, span: Span) -> Word {
        let error = self.error(word);
        self.replaced(span, error, word.fits)
    }
}

impl Word {
    /// The whole number that it is, or is modulo its width.
    fn whole(&self) -> &Form {
        self.turns.as_ref().map_or(&self.form, |(_, form)| form)
    }
}

/// The value of a word, rounded that way: beyond 2^53 the float may be the nearer one.
pub(crate) fn outward(word: i128, format: Format, way: fn(f64) -> f64) -> f64 {
    let value = word as f64 * format.lsb();
    if word.abs() < 1 << 53 { value } else { way(value) }
}

/// The greatest size of an error, rounded up.
pub(crate) fn most((range, frac): (Span, i32), format: Format) -> f64 {
    outward(range.max.max(-range.min), format, f64::next_up) * 2f64.powi(-frac)
}

/// Rounded outwards to so many fraction bits.
fn coarse((range, frac): (Span, i32), kept: i32) -> (Span, i32) {
    let more = (frac - kept).max(0);
    (Span::new(range.min >> more, -(-range.max >> more)), frac - more)
}
