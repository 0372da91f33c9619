//! Numbers that depend on parameters, rounded outwards: a polynomial of second degree, and an interval for the rest.
//!
//! Each parameter goes from -1 at the least value of its range to 1 at the greatest. An interval forgets which
//! parameter made it wide, so a difference of two equal intervals is wide; that of two forms is narrow. The rest is of
//! third order in the width of the ranges.
//!
//! A polynomial over these ranges is a mean of its [control points](Form::at), with weights of at least 0 that are the
//! same for all polynomials: those of Bernstein. So what is convex and holds at each control point holds everywhere.

use std::array::from_fn;

use crate::interval::Interval;

/// A number that depends on `K` parameters. Of none, it is an interval.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Form<const K: usize> {
    /// Encloses the number without the polynomial, whatever the parameters are.
    rest: Interval,
    /// The factor of each parameter.
    slopes: [f64; K],
    /// The factors of products of two parameters, on and above the diagonal.
    squares: [[f64; K]; K],
}

impl<const K: usize> Form<K> {
    /// The number 0.
    pub const ZERO: Self = Self::of(Interval::ZERO);
    /// Number of control points.
    pub const CONTROLS: usize = 3usize.pow(K as u32);

    /// Returns a number of which an enclosure is known.
    pub const fn of(rest: Interval) -> Self {
        Self { rest, slopes: [0.0; K], squares: [[0.0; K]; K] }
    }

    /// Returns a number that depends on no parameter.
    pub const fn exact(value: f64) -> Self {
        Self::of(Interval::exact(value))
    }

    /// Returns a number that is a straight line in each parameter.
    pub const fn line(middle: f64, slopes: [f64; K]) -> Self {
        Self { rest: Interval::exact(middle), slopes, squares: [[0.0; K]; K] }
    }

    /// Returns a number that is the parameter with this index itself, between two values.
    pub fn between([low, high]: [f64; 2], index: usize) -> Self {
        let middle = 0.5 * low + 0.5 * high;
        let half = (high - middle).max(middle - low).next_up();
        Self::line(middle, from_fn(|of| if of == index { half } else { 0.0 }))
    }

    /// Returns the number with the polynomial of another one.
    pub fn along(self, other: Self) -> Self {
        Self { rest: self.rest, ..other }
    }

    /// Returns the interval that holds the number whatever the parameters are.
    pub fn all(self) -> Interval {
        let [first, second] = self.sizes();
        let reach = first + second;
        if reach == 0.0 { self.rest } else { self.rest.plus(Interval { lo: -reach, hi: reach }) }
    }

    /// Returns the greatest absolute value, infinity if nothing is known.
    pub fn size(self) -> f64 {
        let size = self.all().size();
        if size.is_nan() { f64::INFINITY } else { size }
    }

    /// Returns the enclosure of a control point. Its index has a digit of base three for each parameter.
    pub fn at(self, control: usize) -> Interval {
        let digit = |of: usize| control / 3usize.pow(of as u32) % 3;
        let place: [f64; K] = from_fn(|of| digit(of) as f64 - 1.0);
        let mut sum = self.rest;
        for of in 0..K {
            sum = sum.plus(Interval::exact(self.slopes[of] * place[of]));
            for by in of..K {
                // The control point of a square between both ends is that of their product.
                let both = if by > of { place[of] * place[by] } else { 2.0 * place[of].abs() - 1.0 };
                sum = sum.plus(Interval::exact(self.squares[of][by] * both));
            }
        }
        sum
    }

    /// Returns the number with the middle of its rest instead, and a bound of the difference.
    pub fn known(self) -> (Self, f64) {
        let middle = self.rest.middle();
        (Self { rest: Interval::exact(middle), ..self }, around(self.rest, middle))
    }

    /// Returns the sum.
    #[inline]
    pub fn plus(self, other: Self) -> Self {
        let sum = Self {
            rest: self.rest.plus(other.rest),
            slopes: from_fn(|of| self.slopes[of] + other.slopes[of]),
            squares: from_fn(|of| from_fn(|by| self.squares[of][by] + other.squares[of][by])),
        };
        if K == 0 { sum } else { sum.wider(f64::EPSILON * sum.sizes().iter().sum::<f64>()) }
    }

    /// Returns the difference.
    pub fn minus(self, other: Self) -> Self {
        self.plus(other.negative())
    }

    /// Returns the product.
    #[inline]
    pub fn times(self, other: Self) -> Self {
        // Intervals forget a number that is none.
        if ![self, other].iter().all(|of| of.rest.lo <= of.rest.hi) {
            return Self::of(Interval::exact(f64::NAN));
        }
        let rest = self.rest.times(other.rest);
        let [[first, second], [its_first, its_second]] = [self.sizes(), other.sizes()];
        if K == 0 || first + second + its_first + its_second == 0.0 {
            return Self::of(rest);
        }
        let [own, its] = [self.rest.middle(), other.rest.middle()];
        let slopes = from_fn(|of| own * other.slopes[of] + its * self.slopes[of]);
        let squares = from_fn(|of| {
            from_fn(|by| {
                let crossed = if by > of { self.slopes[by] * other.slopes[of] } else { 0.0 };
                let both = if by < of { 0.0 } else { self.slopes[of] * other.slopes[by] + crossed };
                own * other.squares[of][by] + its * self.squares[of][by] + both
            })
        });
        // Rests with the other's polynomial, and products of third and fourth order. All are at least 0.
        let spread = around(self.rest, own) * (its_first + its_second) + around(other.rest, its) * (first + second);
        let higher = first * its_second + second * its_first + second * its_second;
        // Each factor is a sum of up to four products.
        let rounded = own.abs() * (its_first + its_second) + its.abs() * (first + second) + first * its_first;
        Self { rest, slopes, squares }.wider(spread + higher + 4.0 * f64::EPSILON * rounded)
    }

    /// Returns the quotient by a number that is above zero whatever the parameters are.
    pub fn divided(self, other: Self) -> Self {
        if K == 0 {
            return Self::of(self.rest.divided(other.rest));
        }
        // 1/(m + m t) is (1 - t + t² - t³/(1 + t))/m.
        let (one, middle) = (Interval::exact(1.0), other.rest.middle());
        let per = Self::of(one.divided(Interval::exact(middle)));
        let t = other.minus(Self::exact(middle)).times(per);
        let all = t.all();
        if other.all().lo <= 0.0 || all.lo <= -0.5 || middle <= 0.0 {
            return Self::of(Interval { lo: f64::NEG_INFINITY, hi: f64::INFINITY });
        }
        let higher = Self::of(all.times(all).times(all).divided(one.plus(all)));
        self.times(Self::exact(1.0).minus(t).plus(t.times(t)).minus(higher).times(per))
    }

    /// Returns the reciprocal of a number that is above zero. If it is a straight line in one parameter alone, the
    /// reciprocal is the straight line instead: the parameter is another one, at whose ends the number is the same. No
    /// other number may depend on it.
    pub fn reciprocal(self) -> Self {
        let mut moving = (0..K).filter(|of| self.slopes[*of] != 0.0);
        let (Some(only), None, [_, 0.0]) = (moving.next(), moving.next(), self.sizes()) else {
            return Self::exact(1.0).divided(self);
        };
        let Interval { lo, hi } = Interval::exact(1.0).divided(self.all());
        let falls = Self::between([lo, hi], only);
        Self { slopes: falls.slopes.map(|slope| -slope * self.slopes[only].signum()), ..falls }
    }

    /// Returns the quotient by a number above zero that depends on no parameter.
    pub fn over(self, other: f64) -> Self {
        if K == 0 {
            return Self::of(self.rest.over(other));
        }
        self.times(Self::of(Interval::exact(1.0).over(other)))
    }

    /// Returns the product with a power of two, which is exact but for numbers next to zero.
    pub fn scaled(self, by: f64) -> Self {
        Self {
            rest: self.rest.scaled(by),
            slopes: self.slopes.map(|slope| slope * by),
            squares: self.squares.map(|row| row.map(|factor| factor * by)),
        }
    }

    /// Returns the negative.
    pub fn negative(self) -> Self {
        let Interval { lo, hi } = self.rest;
        Self {
            rest: Interval { lo: -hi, hi: -lo },
            slopes: self.slopes.map(|slope| -slope),
            squares: self.squares.map(|row| row.map(|factor| -factor)),
        }
    }

    /// Returns bounds of the parts of first and of second order.
    #[inline]
    fn sizes(&self) -> [f64; 2] {
        let sum = |factors: &[f64; K]| factors.iter().fold(0.0, |sum: f64, factor| sum + factor.abs());
        // Sums of at most four numbers.
        [sum(&self.slopes), self.squares.iter().map(sum).sum::<f64>()].map(|sum| sum * (1.0 + 1e-15))
    }

    /// Returns the number with a rest that is wider by a sum of numbers of at least 0. The sum has at most ten
    /// roundings, each of a share of 2⁻⁵³, and numbers next to zero.
    #[inline]
    fn wider(self, by: f64) -> Self {
        if by == 0.0 && self.sizes() == [0.0; 2] {
            return self;
        }
        let by = by * (1.0 + 1e-14) + f64::MIN_POSITIVE;
        Self { rest: self.rest.plus(Interval { lo: -by, hi: by }), ..self }
    }
}

/// Returns a bound of the distance of an interval's numbers from one.
fn around(of: Interval, middle: f64) -> f64 {
    if of.lo == middle && of.hi == middle { 0.0 } else { (of.hi - middle).max(middle - of.lo).next_up() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small number with its polynomial in two parameters, and its exact value at a point, in 128ths.
    type Known = (Form<2>, fn(f64, f64) -> f64);

    const POINTS: [f64; 5] = [-1.0, -0.625, 0.0, 0.375, 1.0];

    fn parameter(index: usize) -> Form<2> {
        Form::line(0.0, from_fn(|of| f64::from(u8::from(of == index))))
    }

    /// Numbers whose values at the points are exact in `f64`, or nearly.
    fn known() -> Vec<Known> {
        let [x, y] = [parameter(0), parameter(1)];
        let number = Form::exact;
        vec![
            (x.plus(number(3.0)), |x, _| x + 3.0),
            (x.times(y), |x, y| x * y),
            (x.times(x).minus(y), |x, y| x * x - y),
            (x.plus(y).times(x.minus(y)).times(x), |x, y| (x + y) * (x - y) * x),
            (x.times(x).times(y).times(y), |x, y| x * x * y * y),
            (x.scaled(0.25).plus(number(1.0)).times(y.plus(number(2.0))).negative(), |x, y| {
                -(0.25 * x + 1.0) * (y + 2.0)
            }),
            (number(1.0).divided(x.scaled(0.25).plus(number(2.0))), |x, _| 1.0 / (0.25 * x + 2.0)),
            (y.divided(x.plus(y).scaled(0.125).plus(number(1.0))), |x, y| y / (0.125 * (x + y) + 1.0)),
            (x.over(3.0).plus(y.over(7.0)), |x, y| x / 3.0 + y / 7.0),
        ]
    }

    /// The value of a form's polynomial at a point, with its rest.
    fn value(of: &Form<2>, place: [f64; 2]) -> Interval {
        let number = Interval::exact;
        let mut sum = of.rest;
        for at in 0..2 {
            sum = sum.plus(number(of.slopes[at]).times(number(place[at])));
            for by in at..2 {
                let product = number(place[at]).times(number(place[by]));
                sum = sum.plus(number(of.squares[at][by]).times(product));
            }
        }
        sum
    }

    #[test]
    fn the_rest_holds_what_lines_and_squares_are_rounded_by() {
        // Thirds and sevenths, whose products and sums are rounded. What is lost is exact in `f64`.
        let mut rounded = 0;
        for index in 1..200 {
            let [a, b] = [f64::from(index) / 3.0, -f64::from(index) / 7.0];
            let [one, other] = [a, b].map(|slope| Form::<1>::line(0.0, [slope]));
            let (product, sum) = (a * b, a + b);
            let of_product = libm::fma(a, b, -product);
            let kept = sum - a;
            let of_sum = (a - (sum - kept)) + (b - kept);
            rounded += u32::from(of_product.abs() > 0.0);
            let line = one.times(Form::exact(b));
            assert!(line.slopes == [product] && line.rest.lo <= of_product && of_product <= line.rest.hi, "{line:?}");
            let square = one.times(other);
            assert!(square.squares == [[product]], "{square:?}");
            assert!(square.rest.lo <= of_product && of_product <= square.rest.hi, "{square:?}");
            let both = one.plus(other);
            assert!(both.slopes == [sum] && both.rest.lo <= of_sum && of_sum <= both.rest.hi, "{both:?}");
        }
        assert!(rounded > 100, "{rounded}");
    }

    #[test]
    fn a_form_holds_the_number_at_every_point() {
        for (index, (form, exact)) in known().into_iter().enumerate() {
            for x in POINTS {
                for y in POINTS {
                    let (found, exact) = (value(&form, [x, y]), exact(x, y));
                    let spare = 4.0 * f64::EPSILON * exact.abs();
                    let holds = |of: Interval| of.lo <= exact + spare && exact - spare <= of.hi;
                    assert!(holds(found) && holds(form.all()), "{index} at {x}, {y}: {form:?}, {exact}");
                }
            }
            let size = form.size();
            assert!(size.is_finite() && size < 20.0, "{index}: {form:?}");
        }
    }

    #[test]
    fn a_polynomial_is_the_mean_of_its_control_points_by_the_weights_of_bernstein() {
        let weights = |x: f64| {
            let share = 0.5 + 0.5 * x;
            [(1.0 - share) * (1.0 - share), 2.0 * share * (1.0 - share), share * share]
        };
        for (index, (form, _)) in known().into_iter().enumerate() {
            for x in POINTS {
                for y in POINTS {
                    let [wide, found] = [weights(x), weights(y)];
                    let mean: f64 = (0..Form::<2>::CONTROLS)
                        .map(|control| wide[control % 3] * found[control / 3] * form.at(control).middle())
                        .sum();
                    let exact = value(&form, [x, y]).middle();
                    assert!((mean - exact).abs() < 1e-13, "{index} at {x}, {y}: {mean}, not {exact}");
                }
            }
        }
    }

    #[test]
    fn what_is_lost_is_of_third_order() {
        // The sum of a cube and its parts: a range of a tenth has a thousandth of the rest of a whole one.
        let rest = |half: f64| {
            let x = Form::<1>::line(1.0, [half]);
            x.times(x).times(x).divided(x.plus(Form::exact(1.0))).known().1
        };
        let ratio = rest(0.1) / rest(0.01);
        assert!((500.0..2000.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_reciprocal_has_its_ends_and_is_a_straight_line_in_one_parameter() {
        let number = Form::<2>::between([2.0, 8.0], 1);
        let found = number.reciprocal();
        assert_eq!(found.sizes()[1], 0.0);
        for (y, exact) in [(-1.0, 0.5), (1.0, 0.125)] {
            let end = value(&found, [0.3, y]);
            // The ends are passed by rounding alone.
            assert!(-y * (end.middle() - exact) >= 0.0 && (end.middle() - exact).abs() < 1e-14, "{y}: {end:?}");
        }
        let mixed = number.plus(parameter(0)).reciprocal();
        assert!(value(&mixed, [1.0, 1.0]).lo <= 1.0 / 9.0 && 1.0 / 9.0 <= value(&mixed, [1.0, 1.0]).hi);
    }

    #[test]
    fn nothing_is_known_of_a_quotient_by_what_may_be_zero() {
        for lo in [0.0, -1.0] {
            let found = Form::<1>::exact(1.0).divided(Form::between([lo, 2.0], 0));
            assert!(!(found.all().lo.is_finite() && found.all().hi.is_finite()), "{found:?}");
        }
    }
}
