//! Intervals of `f64`, rounded outwards, and small matrices of them.

/// All numbers from `lo` to `hi`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Interval {
    pub lo: f64,
    pub hi: f64,
}

impl Interval {
    pub const ZERO: Self = Self::exact(0.0);

    pub const fn exact(value: f64) -> Self {
        Self { lo: value, hi: value }
    }

    /// One ulp outwards.
    fn outward(lo: f64, hi: f64) -> Self {
        Self { lo: lo.next_down(), hi: hi.next_up() }
    }

    pub fn plus(self, other: Self) -> Self {
        if self == Self::ZERO {
            return other;
        }
        if other == Self::ZERO {
            return self;
        }
        Self::outward(self.lo + other.lo, self.hi + other.hi)
    }

    pub fn minus(self, other: Self) -> Self {
        self.plus(Self { lo: -other.hi, hi: -other.lo })
    }

    pub fn times(self, other: Self) -> Self {
        if self == Self::ZERO || other == Self::ZERO {
            return Self::ZERO;
        }
        let ends = [self.lo * other.lo, self.lo * other.hi, self.hi * other.lo, self.hi * other.hi];
        Self::outward(
            ends.into_iter().fold(f64::INFINITY, f64::min),
            ends.into_iter().fold(f64::NEG_INFINITY, f64::max),
        )
    }

    /// Divided by something above zero.
    pub fn over(self, other: f64) -> Self {
        self.divided(Self::exact(other))
    }

    /// Divided by something all above zero.
    pub fn divided(self, other: Self) -> Self {
        if self == Self::ZERO {
            return Self::ZERO;
        }
        let ends = [self.lo / other.lo, self.lo / other.hi, self.hi / other.lo, self.hi / other.hi];
        Self::outward(
            ends.into_iter().fold(f64::INFINITY, f64::min),
            ends.into_iter().fold(f64::NEG_INFINITY, f64::max),
        )
    }

    /// Times a power of two, which is exact.
    pub fn scaled(self, by: f64) -> Self {
        Self { lo: self.lo * by, hi: self.hi * by }
    }

    /// The greatest size.
    pub fn size(self) -> f64 {
        self.hi.max(-self.lo)
    }
}

/// Rows and columns; small, square unless it is a row or a column.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Matrix(pub Vec<Vec<Interval>>);

impl Matrix {
    pub fn identity(size: usize) -> Self {
        let one = |here: bool| if here { Interval::exact(1.0) } else { Interval::ZERO };
        Self((0..size).map(|row| (0..size).map(|column| one(row == column)).collect()).collect())
    }

    pub fn column(values: &[Interval]) -> Self {
        Self(values.iter().map(|&value| vec![value]).collect())
    }

    pub fn row(values: &[Interval]) -> Self {
        Self(vec![values.to_vec()])
    }

    pub fn rows(&self) -> usize {
        self.0.len()
    }

    fn columns(&self) -> usize {
        self.0[0].len()
    }

    pub fn map(&self, change: impl Fn(Interval) -> Interval) -> Self {
        Self(self.0.iter().map(|row| row.iter().map(|&cell| change(cell)).collect()).collect())
    }

    pub fn plus(&self, other: &Self) -> Self {
        let sum =
            |(left, right): (&Vec<Interval>, &Vec<Interval>)| left.iter().zip(right).map(|(l, r)| l.plus(*r)).collect();
        Self(self.0.iter().zip(&other.0).map(sum).collect())
    }

    pub fn times(&self, other: &Self) -> Self {
        let cell = |row: &[Interval], column: usize| {
            row.iter().zip(&other.0).fold(Interval::ZERO, |sum, (left, right)| sum.plus(left.times(right[column])))
        };
        Self(self.0.iter().map(|row| (0..other.columns()).map(|column| cell(row, column)).collect()).collect())
    }

    /// The sizes of all cells, as a matrix that is at least as great.
    pub fn sizes(&self) -> Self {
        self.map(|cell| Interval::exact(cell.size()))
    }

    /// The greatest sum of sizes along a row.
    pub fn norm(&self) -> f64 {
        let sum = |row: &Vec<Interval>| row.iter().fold(0.0, |sum: f64, cell| (sum + cell.size()).next_up());
        self.0.iter().map(sum).fold(0.0, f64::max)
    }

    /// `e^(self)`: a Taylor series of the matrix scaled down, and its remainder, squared up again.
    pub fn exponential(&self) -> Self {
        let size = self.rows();
        let halvings = (self.norm().log2().ceil() as i32 + 3).max(0);
        let small = self.map(|cell| cell.times(Interval::exact(2f64.powi(-halvings))));
        let (mut term, mut sum) = (Self::identity(size), Self::identity(size));
        let order = 14;
        for index in 1..=order {
            term = term.times(&small).map(|cell| cell.over(f64::from(index)));
            sum = sum.plus(&term);
        }
        // The norm is at most 1/8: what is left is less than twice the next term, whose norm is below this.
        let rest = 2.0 * term.norm() / 8.0;
        let mut result = sum.plus(&Self(vec![vec![Interval { lo: -rest, hi: rest }; size]; size]));
        for _ in 0..halvings {
            result = result.times(&result);
        }
        result
    }
}
