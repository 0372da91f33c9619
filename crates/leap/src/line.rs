//! Words as lines with horizons, and the rule of each operation.

use crate::operation::{Operation, Widths, mask, offset, signed};

/// A horizon that is never reached.
pub const FOREVER: u64 = 1 << 62;

/// A word now, and as a function of the clock edges from now on: `(word + slope t) mod 2^width` for `0 <= t < horizon`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Line {
    /// The word of now.
    pub word: u64,
    /// The difference between two edges, as a signed number of the word's width.
    pub slope: i64,
    /// The number of edges, now among them, for which the line is known to hold; at least 1, at most [`FOREVER`].
    pub horizon: u64,
}

impl Line {
    /// Returns a word that rests.
    #[inline]
    pub fn still(word: u64) -> Self {
        Self { word, slope: 0, horizon: FOREVER }
    }

    /// Returns the word after so many edges, if it is on its line then.
    #[inline]
    pub(crate) fn after(self, edges: u64, width: u8) -> u64 {
        self.word.wrapping_add(edges.wrapping_mul(self.slope.cast_unsigned())) & mask(width)
    }

    /// Returns whether it rests for ever.
    #[inline]
    pub(crate) fn rests(self) -> bool {
        self.slope == 0 && self.horizon == FOREVER
    }

    #[inline]
    fn is_still(self) -> bool {
        self.slope == 0
    }

    /// Returns whether it rests at this word.
    #[inline]
    fn rests_at(self, word: u64) -> bool {
        self.slope == 0 && self.word == word
    }
}

/// Returns the first edge at which a line without a sign leaves the words of its width.
#[inline]
fn leaves(word: u64, slope: i64, width: u8) -> u64 {
    let room = if slope > 0 { mask(width) - word } else { word };
    match slope.unsigned_abs() {
        0 => FOREVER,
        1 => room.saturating_add(1).min(FOREVER),
        step => (room / step).saturating_add(1).min(FOREVER),
    }
}

/// Returns the first edge at which a line leaves the words of its width, or the signed numbers of its width.
#[inline]
fn wraps(line: Line, width: u8, is_signed: bool) -> u64 {
    leaves(if is_signed { offset(line.word, width) } else { line.word }, line.slope, width)
}

/// Returns the first edge at which `word + slope t` is 0 modulo `2^width`, for a word that is not 0.
///
/// Let `2^k` be the greatest power of two that divides the slope. If it does not divide the word, no sum is 0. Else the
/// odd part of the slope has an inverse modulo `2^(width - k)`, which gives the least solution.
#[inline]
fn zero(word: u64, slope: i64, width: u8) -> u64 {
    let slope = slope.cast_unsigned() & mask(width);
    if slope == 0 {
        return FOREVER;
    }
    let twos = slope.trailing_zeros();
    if word.trailing_zeros() < twos {
        return FOREVER;
    }
    let (odd, sum) = (slope >> twos, word.wrapping_neg() >> twos);
    // Newton's method doubles the number of correct bits; 3 x xor 2 has five.
    let mut inverse = odd.wrapping_mul(3) ^ 2;
    for _ in 0..4 {
        inverse = inverse.wrapping_mul(2u64.wrapping_sub(odd.wrapping_mul(inverse)));
    }
    let bits = width - twos as u8;
    (sum.wrapping_mul(inverse) & mask(bits)).min(FOREVER)
}

/// Returns the first edge at which the order of two unwrapped lines changes: `a < b` if `is_strict`, else `a <= b`.
#[inline]
fn crossing([a, b]: [u64; 2], [of_a, of_b]: [i64; 2], is_strict: bool) -> u64 {
    let holds = if is_strict { a < b } else { a <= b };
    // The line that has to come up is behind by `gap`, and nears by `step` an edge.
    let (gap, nears) = if holds { (b.abs_diff(a), of_a > of_b) } else { (a.abs_diff(b), of_b > of_a) };
    if !nears {
        return FOREVER;
    }
    let step = of_a.abs_diff(of_b);
    // `a < b` ends where the gap is closed, and so does its opposite for `a <= b`; else the gap has to be passed.
    let is_closed = holds == is_strict;
    let edges = if is_closed { gap.div_ceil(step) } else { (gap / step).saturating_add(1) };
    edges.clamp(1, FOREVER)
}

/// Returns the slope and the horizon of the bits of a word from bit `low` on: the slope is divided, rounded towards
/// zero, and the rest moves the bits below, until they wrap.
#[inline]
fn above(line: Line, low: u8) -> (i64, u64) {
    if low == 0 || line.slope == 0 {
        return (line.slope, FOREVER);
    }
    let (steps, rest) = (line.slope.unsigned_abs() >> low, line.slope.unsigned_abs() & mask(low));
    let directed = |size: u64| if line.slope < 0 { size.cast_signed().wrapping_neg() } else { size.cast_signed() };
    (directed(steps), leaves(line.word & mask(low), directed(rest), low))
}

impl Operation {
    /// Returns the line of a cell whose operands are these lines. `word` is the cell's word of now.
    ///
    /// No rule depends on more than the operands' lines: an operand may have any words from its horizon on. Where an
    /// operand that rests decides the result alone, such as a 0 of a conjunction, only its own horizon counts.
    pub fn line(self, widths: Widths, word: u64, operands: [Line; 3]) -> Line {
        self.line_of(widths, word, |at| operands[at])
    }

    /// As [`line`](Self::line), with operands that are read where a rule needs them.
    #[inline(always)]
    pub(crate) fn line_of(self, widths: Widths, word: u64, operand: impl Fn(usize) -> Line) -> Line {
        let Widths { result: width, a: of_a, b: of_b } = widths;
        let (a, b) = (operand(0), operand(1));
        let both = a.horizon.min(b.horizon);
        let known = |slope: i64, horizon: u64| Line { word, slope: signed(slope.cast_unsigned(), width), horizon };
        // Nothing is known of later edges.
        let unknown = Line { word, slope: 0, horizon: 1 };
        let decided = |decides: u64| match (a.rests_at(decides), b.rests_at(decides)) {
            (true, true) => Some(known(0, a.horizon.max(b.horizon))),
            (true, false) => Some(known(0, a.horizon)),
            (false, true) => Some(known(0, b.horizon)),
            (false, false) => None,
        };
        // One operand passes where the other rests at a word that changes nothing.
        let passed = |neutral: u64| match (a.is_still(), b.is_still()) {
            (true, true) => known(0, both),
            (true, false) if a.word == neutral => known(b.slope, both),
            (false, true) if b.word == neutral => known(a.slope, both),
            _ => unknown,
        };
        match self {
            Self::Extend { signed } => known(a.slope, a.horizon.min(wraps(a, of_a, signed))),
            Self::Slice { low } => {
                let (slope, horizon) = above(a, low);
                known(slope, a.horizon.min(horizon))
            }
            Self::Concat => {
                let slope = b.slope.wrapping_add(a.slope.wrapping_shl(of_b.into()));
                known(slope, both.min(leaves(b.word, b.slope, of_b)))
            }
            Self::Not => known(a.slope.wrapping_neg(), a.horizon),
            Self::And => decided(0).unwrap_or_else(|| passed(mask(width))),
            Self::Or => decided(mask(width)).unwrap_or_else(|| passed(0)),
            Self::Xor => match (a.is_still(), b.is_still()) {
                (true, false) if a.word == mask(width) => known(b.slope.wrapping_neg(), both),
                (false, true) if b.word == mask(width) => known(a.slope.wrapping_neg(), both),
                _ => passed(0),
            },
            Self::Add => known(a.slope.wrapping_add(b.slope), both),
            Self::Sub => known(a.slope.wrapping_sub(b.slope), both),
            Self::Mul => match (a.is_still(), b.is_still()) {
                _ if a.rests_at(0) || b.rests_at(0) => decided(0).unwrap_or(unknown),
                (true, _) => known(b.slope.wrapping_mul(a.word.cast_signed()), both),
                (_, true) => known(a.slope.wrapping_mul(b.word.cast_signed()), both),
                _ => unknown,
            },
            Self::Div { .. } | Self::Rem { .. } | Self::Parity => {
                let is_still = a.is_still() && (self == Self::Parity || b.is_still());
                let horizon = if self == Self::Parity { a.horizon } else { both };
                if is_still { known(0, horizon) } else { unknown }
            }
            Self::Less { signed } | Self::AtMost { signed } => {
                let is_strict = matches!(self, Self::Less { .. });
                let at = |line: Line| if signed { offset(line.word, of_a) } else { line.word };
                let unwrapped = both.min(wraps(a, of_a, signed)).min(wraps(b, of_a, signed));
                known(0, unwrapped.min(crossing([at(a), at(b)], [a.slope, b.slope], is_strict)))
            }
            Self::Equal | Self::Differ => {
                let difference = a.word.wrapping_sub(b.word) & mask(of_a);
                let slope = a.slope.wrapping_sub(b.slope);
                let parts = slope.cast_unsigned() & mask(of_a) != 0;
                match difference {
                    0 if parts => known(0, 1),
                    0 => known(0, both),
                    _ => known(0, both.min(zero(difference, slope, of_a))),
                }
            }
            Self::Mux => {
                let c = operand(2);
                let chosen = if a.word == 0 { b } else { c };
                let horizon = if a.is_still() { a.horizon.min(chosen.horizon) } else { 1 };
                let is_same = b.word == c.word && b.slope == c.slope;
                known(chosen.slope, if is_same { horizon.max(b.horizon.min(c.horizon)) } else { horizon })
            }
            Self::ShiftLeft | Self::ShiftRight { .. } if a.rests_at(0) => known(0, a.horizon),
            Self::ShiftLeft | Self::ShiftRight { .. } if !b.is_still() => unknown,
            Self::ShiftLeft => known(if b.word < u64::from(width) { a.slope << b.word } else { 0 }, both),
            Self::ShiftRight { signed } => {
                let horizon = both.min(wraps(a, width, signed));
                match u8::try_from(b.word).ok().filter(|amount| *amount < width) {
                    Some(amount) => {
                        let (slope, below) = above(a, amount);
                        known(slope, horizon.min(below))
                    }
                    // The zeros or signs that are left stay for as long as the word does not wrap, unless its sign does
                    // change.
                    None if signed && !a.is_still() => unknown,
                    None => known(0, both),
                }
            }
        }
    }
}
