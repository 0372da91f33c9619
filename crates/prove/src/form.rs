//! Numbers that depend on parameters, rounded outwards: a straight line in each of them, and an interval for the rest.
//!
//! Each parameter goes from -1 at the least value of its range to 1 at the greatest. An interval forgets which
//! parameter made it wide, so a difference of two equal intervals is wide; that of two forms is narrow. What is no
//! straight line is of second order in the width of the range.

use std::array::from_fn;

use crate::interval::Interval;

/// A number that depends on `K` parameters. Of none, it is an interval.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Form<const K: usize> {
    /// Encloses the number without the straight lines, whatever the parameters are.
    rest: Interval,
    /// By how much each parameter changes the number from the middle to the upper end of its range.
    slopes: [f64; K],
}

impl<const K: usize> Form<K> {
    /// The number 0.
    pub const ZERO: Self = Self::of(Interval::ZERO);

    /// Returns a number of which an enclosure is known.
    pub const fn of(rest: Interval) -> Self {
        Self { rest, slopes: [0.0; K] }
    }

    /// Returns a number that depends on no parameter.
    pub const fn exact(value: f64) -> Self {
        Self::of(Interval::exact(value))
    }

    /// Returns a number that is the parameter with this index itself, between two values.
    pub fn between([low, high]: [f64; 2], index: usize) -> Self {
        let middle = 0.5 * low + 0.5 * high;
        let half = (high - middle).max(middle - low).next_up();
        Self::line(middle, from_fn(|of| if of == index { half } else { 0.0 }))
    }

    /// Returns a number that is a straight line in each parameter.
    pub const fn line(middle: f64, slopes: [f64; K]) -> Self {
        Self { rest: Interval::exact(middle), slopes }
    }

    /// Returns the number with the straight lines of another one.
    pub fn along(self, other: Self) -> Self {
        Self { rest: self.rest, slopes: other.slopes }
    }

    /// Returns the interval that holds the number whatever the parameters are.
    pub fn all(self) -> Interval {
        let reach = self.reach();
        if K == 0 { self.rest } else { self.rest.plus(Interval { lo: -reach, hi: reach }) }
    }

    /// Returns the greatest absolute value.
    pub fn size(self) -> f64 {
        self.all().size()
    }

    /// Returns the enclosure at a corner of all ranges: the upper end of each parameter whose bit is set.
    pub fn at(self, corner: usize) -> Interval {
        let add = |sum: Interval, (index, slope): (usize, &f64)| {
            sum.plus(Interval::exact(if corner >> index & 1 == 1 { *slope } else { -slope }))
        };
        self.slopes.iter().enumerate().fold(self.rest, add)
    }

    /// Returns the number with the middle of its enclosure instead, and a bound of the difference.
    pub fn straight(self) -> (Self, f64) {
        let middle = self.rest.middle();
        (Self { rest: Interval::exact(middle), ..self }, around(self.rest, middle))
    }

    /// Returns the sum.
    #[inline]
    pub fn plus(self, other: Self) -> Self {
        let slopes = from_fn(|of| self.slopes[of] + other.slopes[of]);
        Self { rest: self.rest.plus(other.rest), slopes }.rounded(slopes.map(f64::abs))
    }

    /// Returns the difference.
    pub fn minus(self, other: Self) -> Self {
        self.plus(other.negative())
    }

    /// Returns the product.
    #[inline]
    pub fn times(self, other: Self) -> Self {
        let mut rest = self.rest.times(other.rest);
        let [reach, its_reach] = [self.reach(), other.reach()];
        if K == 0 || reach + its_reach == 0.0 {
            return Self::of(rest);
        }
        let [own, its] = [self.rest.middle(), other.rest.middle()];
        let slopes = from_fn(|of| own * other.slopes[of] + its * self.slopes[of]);
        let rounded = from_fn(|of| (own * other.slopes[of]).abs() + (its * self.slopes[of]).abs());
        // What is no straight line: the rests with the other's lines, and products of lines. Those of the same
        // parameter have one sign.
        let mut spread = up(around(self.rest, own) * its_reach) + up(around(other.rest, its) * reach);
        for of in 0..K {
            let square = Interval::exact(self.slopes[of]).times(Interval::exact(other.slopes[of]));
            rest = rest.plus(Interval { lo: square.lo.min(0.0), hi: square.hi.max(0.0) });
            for by in (0..K).filter(|by| *by != of) {
                spread = up(spread + up((self.slopes[of] * other.slopes[by]).abs()));
            }
        }
        // Products next to zero lose no more than the last number.
        let spread = up(spread) + f64::MIN_POSITIVE;
        Self { rest: rest.plus(Interval { lo: -spread, hi: spread }), slopes }.rounded(rounded)
    }

    /// Returns the quotient by a number that is above zero whatever the parameters are.
    pub fn divided(self, other: Self) -> Self {
        if other.reach() == 0.0 {
            let one = Self::of(Interval::exact(1.0).divided(other.rest));
            return if K == 0 { Self::of(self.rest.divided(other.rest)) } else { self.times(one) };
        }
        // 1/x and q x: at least 2 sqrt(q), at most what one of the ends has.
        let Interval { lo, hi } = other.all();
        if lo <= 0.0 {
            return Self::of(Interval { lo: f64::NEG_INFINITY, hi: f64::INFINITY });
        }
        let fall = 1.0 / (lo * hi);
        let end = |x: f64| Interval::exact(1.0).over(x).plus(Interval::exact(fall).times(Interval::exact(x))).hi;
        let least = 2.0 * fall.sqrt().next_down();
        let line = other.times(Self::exact(-fall));
        self.times(line.plus(Self::of(Interval { lo: least, hi: end(lo).max(end(hi)) })))
    }

    /// Returns the reciprocal of a number that is above zero. If it depends on one parameter alone, the reciprocal is the
    /// straight line instead: the parameter is another one, at whose ends the number is the same. No other number may
    /// depend on it.
    pub fn reciprocal(self) -> Self {
        let mut moving = (0..K).filter(|of| self.slopes[*of] != 0.0);
        let one = Self::exact(1.0).divided(self);
        let (Some(only), None) = (moving.next(), moving.next()) else { return one };
        let Interval { lo, hi } = Interval::exact(1.0).divided(self.all());
        let upward = Self::between([lo, hi], only);
        Self { slopes: upward.slopes.map(|slope| -slope * self.slopes[only].signum()), ..upward }
    }

    /// Returns the quotient by a number above zero that depends on no parameter.
    pub fn over(self, other: f64) -> Self {
        self.divided(Self::exact(other))
    }

    /// Returns the product with a power of two, which is exact but for numbers next to zero.
    pub fn scaled(self, by: f64) -> Self {
        Self { rest: self.rest.scaled(by), slopes: self.slopes.map(|slope| slope * by) }
    }

    /// Returns the negative.
    pub fn negative(self) -> Self {
        let Interval { lo, hi } = self.rest;
        Self { rest: Interval { lo: -hi, hi: -lo }, slopes: self.slopes.map(|slope| -slope) }
    }

    /// Returns a bound of the sum of the lines.
    fn reach(&self) -> f64 {
        self.slopes.iter().fold(0.0, |sum, slope| if *slope == 0.0 { sum } else { up(sum + slope.abs()) })
    }

    /// Returns the number with room for what its slopes have lost. Each is the sum of up to three roundings of numbers
    /// that are no greater than these.
    fn rounded(self, sizes: [f64; K]) -> Self {
        let lost = sizes.iter().fold(0.0, |sum, size| sum + size * 4.0 * f64::EPSILON);
        if K == 0 || lost == 0.0 {
            return self;
        }
        Self { rest: self.rest.plus(Interval { lo: -lost, hi: lost }), ..self }
    }
}

/// Returns a bound of the distance of an interval's numbers from one.
fn around(of: Interval, middle: f64) -> f64 {
    if of.lo == of.hi { (of.lo - middle).abs() } else { up((of.hi - middle).max(middle - of.lo)) }
}

fn up(x: f64) -> f64 {
    if x == 0.0 { x } else { x.next_up() }
}
