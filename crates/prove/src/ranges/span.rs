//! Affine forms over ranges of whole numbers: a number that occurs twice is the same number in both places.

use hpu_signal::Span;

/// A number `2^-frac (constant + sum of factor * symbol)`; symbols are whole numbers from a [`Symbols`].
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Form {
    pub(crate) frac: i32,
    constant: i128,
    /// The factor of each symbol, in the order of symbols.
    terms: Vec<(usize, i128)>,
}

impl Form {
    pub(crate) fn constant(value: i128, frac: i32) -> Self {
        Self { frac, constant: value, terms: Vec::new() }
    }

    /// Returns the same value with more fraction bits.
    fn at(&self, frac: i32) -> Self {
        self.scaled_by(1 << (frac - self.frac).max(0), frac.max(self.frac))
    }

    fn scaled_by(&self, factor: i128, frac: i32) -> Self {
        let terms = self.terms.iter().map(|&(symbol, by)| (symbol, by * factor)).collect();
        Self { frac, constant: self.constant * factor, terms }
    }

    /// Returns the form times a word with `frac` fraction bits.
    pub fn times(&self, word: i128, frac: i32) -> Self {
        let mut product = self.scaled_by(word, self.frac + frac);
        product.terms.retain(|term| term.1 != 0);
        product
    }

    pub(crate) fn plus(&self, other: &Self) -> Self {
        let frac = self.frac.max(other.frac);
        let (mut sum, other) = (self.at(frac), other.at(frac));
        sum.constant += other.constant;
        for (symbol, factor) in other.terms {
            match sum.terms.binary_search_by_key(&symbol, |term| term.0) {
                Ok(index) => sum.terms[index].1 += factor,
                Err(index) => sum.terms.insert(index, (symbol, factor)),
            }
        }
        sum.terms.retain(|term| term.1 != 0);
        sum
    }

    pub(crate) fn minus(&self, other: &Self) -> Self {
        self.plus(&other.times(-1, 0))
    }

    /// Returns the greatest number that divides every value of the form, in its own LSBs.
    fn grain(&self) -> i128 {
        let gcd = |mut a: i128, mut b: i128| {
            while b != 0 {
                (a, b) = (b, a % b);
            }
            a.abs()
        };
        self.terms.iter().fold(self.constant.abs(), |grain, term| gcd(grain, term.1))
    }
}

/// The ranges of symbols.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Symbols(Vec<Span>);

impl Symbols {
    /// Makes a number of which only the range is known.
    pub fn fresh(&mut self, range: Span, frac: i32) -> Form {
        self.0.push(range);
        Form { frac, constant: 0, terms: vec![(self.0.len() - 1, 1)] }
    }

    /// Returns the range of a form, in its LSBs.
    pub fn range(&self, form: &Form) -> Span {
        let term = |&(symbol, factor): &(usize, i128)| self.0[symbol].times(Span::exact(factor));
        form.terms.iter().map(term).fold(Span::exact(form.constant), Span::plus)
    }

    /// Truncates a form to `frac` fraction bits: subtracts a number of its own, at most the value of all the bits
    /// dropped. Forms keep their fraction, so that the sum stays exact.
    pub fn truncated(&mut self, form: &Form, frac: i32) -> Form {
        let drop = form.frac - frac;
        if drop <= 0 {
            return form.clone();
        }
        let unit = 1i128 << drop;
        // The dropped part is a multiple of each number that divides the whole form.
        let grain = match form.grain() {
            0 => unit,
            grain => 1i128 << grain.trailing_zeros().min(drop.unsigned_abs()),
        };
        if grain == unit {
            return form.clone();
        }
        let dropped = self.fresh(Span::new(0, unit / grain - 1), form.frac);
        form.minus(&dropped.times(grain, 0))
    }

    /// Returns the range of a form in whole units of `frac` fraction bits, rounded down.
    pub fn words(&self, form: &Form, frac: i32) -> Span {
        self.range(form).shifted(form.frac - frac)
    }
}
