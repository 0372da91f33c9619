//! Words on their way through blocks: the range of each, and how far it may be from the same law in real numbers.

use hpu_signal::{Format, Overflow, Signal};

use super::span::{Form, Span, Symbols};
use super::{Bound, How};

/// A word as far as it is known.
#[derive(Clone, Debug)]
pub(crate) struct Word {
    /// Its range, in its LSBs.
    pub span: Span,
    /// Its fraction bits; its form may count finer.
    pub frac: i32,
    /// Its value by what it is made of.
    pub form: Form,
    /// The value that real numbers would give; none after a wrap.
    pub exact: Option<Form>,
    /// Whether it held everything that was to be in it.
    pub fits: bool,
}

impl Symbols {
    /// A word that is right by itself: a count, a setting.
    pub fn given(&mut self, span: Span, frac: i32) -> Word {
        let form = if span.min == span.max { Form::constant(span.min, frac) } else { self.fresh(span, frac) };
        Word { span, frac, exact: Some(form.clone()), form, fits: true }
    }

    /// Any word at all. What follows is right on it as it stands, whatever it was to be.
    pub fn any(&mut self, format: Format) -> Word {
        Word { fits: false, ..self.given(Span::of(format), format.frac()) }
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
    pub fn replaced(&mut self, span: Span, frac: i32, error: Option<(Span, i32)>, fits: bool) -> Word {
        let form = self.fresh(span, frac);
        let exact = error.map(|(range, frac)| {
            let range = range.hull(Span::exact(0));
            if range == Span::exact(0) { form.clone() } else { form.minus(&self.fresh(range, frac)) }
        });
        Word { span, frac, form, exact, fits }
    }

    /// The word times another one, of which only the range counts, exactly; still to be [narrowed](Self::narrowed).
    pub fn product(&mut self, word: &Word, by: Span, frac: i32) -> Word {
        let span = word.span.times(by);
        if by.min == by.max {
            let times = |form: &Form| form.times(by.min, frac);
            let exact = word.exact.as_ref().map(times);
            return Word { span, frac: word.frac + frac, form: times(&word.form), exact, fits: word.fits };
        }
        let error = self.error(word).map(|(range, own)| (range.times(by), own + frac));
        self.replaced(span, word.frac + frac, error, word.fits)
    }

    /// Truncated to a format, then wrapped or clamped: clamps are the law's, too.
    pub fn narrowed(&mut self, word: &Word, to: Format, overflow: Overflow) -> Word {
        let form = self.truncated(&word.form, to.frac());
        let span = self.words(&word.form, to.frac()).meet(word.span.shifted(word.frac - to.frac()));
        let whole = Word { span, frac: to.frac(), form, exact: word.exact.clone(), fits: true };
        self.fitted(whole, to, overflow)
    }

    /// Wrapped or clamped.
    pub fn fitted(&mut self, word: Word, to: Format, overflow: Overflow) -> Word {
        if word.span.is_within(Span::of(to)) {
            return word;
        }
        match overflow {
            Overflow::Wrap => self.wrapped(to),
            Overflow::Saturate => self.clamped(&word, Span::of(to)),
        }
    }

    /// Clamped; no clamp adds to an error.
    pub fn clamped(&mut self, word: &Word, to: Span) -> Word {
        if word.span.is_within(to) {
            return word.clone();
        }
        let error = self.error(word);
        self.replaced(word.span.clamp(to), word.frac, error, false)
    }

    /// The sum of two words of the same fraction.
    pub fn sum(&mut self, left: &Word, right: &Word) -> Word {
        let form = left.form.plus(&right.form);
        let exact = left.exact.as_ref().zip(right.exact.as_ref()).map(|(left, right)| left.plus(right));
        let span = left.span.plus(right.span).meet(self.words(&form, left.frac));
        Word { span, frac: left.frac, form, exact, fits: true }
    }

    /// The word, or 0.
    pub fn or_zero(&mut self, word: &Word) -> Word {
        let zero = self.given(Span::exact(0), word.frac);
        self.either(word, &zero)
    }

    /// One of two words of the same fraction.
    pub fn either(&mut self, left: &Word, right: &Word) -> Word {
        let errors = self.error(left).zip(self.error(right)).map(|((left, fine), (right, finer))| {
            let frac = fine.max(finer);
            (left.shifted(fine - frac).hull(right.shifted(finer - frac)), frac)
        });
        self.replaced(left.span.hull(right.span), left.frac, errors, left.fits && right.fits)
    }

    /// What is known of it, as a row.
    pub fn bound(&self, signal: &Signal, word: &Word, assumptions: &[String]) -> Bound {
        let value = |word: i128| word as f64 * signal.format.lsb();
        // Beyond 2^53 the float may be the nearer one.
        let outward =
            |word: i128, way: fn(f64) -> f64| if word.abs() < 1 << 53 { value(word) } else { way(value(word)) };
        let error = self.error(word).map(|(range, frac)| {
            let most = range.max.max(-range.min) as f64;
            if most == 0.0 { 0.0 } else { (most * 2f64.powi(-frac)).next_up() }
        });
        Bound {
            name: signal.name,
            format: signal.format,
            unit: signal.unit,
            min: outward(word.span.min, f64::next_down),
            max: outward(word.span.max, f64::next_up),
            error,
            how: How::Proved,
            never_overflows: word.fits,
            assumptions: assumptions.to_vec(),
        }
    }
}
