//! Decoding of the two encoder lines, with four counts per period of the lines (x4).
//!
//! - **Equation**: forward order of (a b) is 00, 01, 11, 10, 00: one place forward is `step = +1`, one back is `-1`.
//! - **Ports**: `a`, `b` (0,1,0) in; `step` (1,1,0), `error` (0,1,0) out.
//! - **Latency**: 1 edge.
//! - **Edge**: compares (a b) with their values at the previous edge. Both changed: `step = 0` and `error = 1`, which
//!   stays until reset. The first `SETTLE` edges after reset only load the previous values, while the synchronizer in
//!   front fills.
//! - **Reset**: previous 00, `step` 0, `error` 0, settle counter `SETTLE`. **Overflow**: none.
//! - **VHDL twin**: `hdl/quadrature_decoder.vhd`.
//! - **Source**: the usual state table of an incremental encoder.
//! - **Differs from the hardware**: no digital filter against glitches; the lines of a real encoder also bounce and are
//!   not exactly 90 degrees apart.

use hpu_signal::{Format, Word};

use crate::base::config::{NATURAL, within};
use crate::base::listed::Listed;
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the decoder.
    pub struct In of |_: &QuadratureDecoder| {
        a, "Encoder line A, synchronous";
        b, "Encoder line B, synchronous";
    }
    /// Outputs of the decoder.
    pub struct Out of |_: &QuadratureDecoder| {
        step: Format::signed(2), "count",
            "Motion since the previous edge: +1 where b leads a (a b = 00, 01, 11, 10), -1 where a leads b, or 0";
        error, "Both lines have changed at one edge since reset: counts were lost";
    }
}

/// A quadrature decoder; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct QuadratureDecoder {
    settle: u32,
    settling: u32,
    previous: In<i64>,
    out: Out<i64>,
}

impl QuadratureDecoder {
    /// Returns a decoder that ignores the first `settle` edges after reset.
    ///
    /// # Errors
    ///
    /// Returns an error unless `settle` is a VHDL `natural`.
    pub fn new(settle: u32) -> Result<Self, ConfigError> {
        within(Self::NAME, "SETTLE", settle, 0..=NATURAL)?;
        Ok(Self { settle, settling: settle, previous: In { a: 0, b: 0 }, out: Out { step: 0, error: 0 } })
    }

    /// Does two ticks with these lines, if they are a step from the previous ones, which the second tick ends. Returns
    /// the step; `None` if there is none, or none that counts, and nothing was ticked.
    #[inline]
    pub(crate) fn pass(&mut self, lines: In<i64>) -> Option<i64> {
        let Out { step, .. } = self.next(&lines);
        if step == 0 {
            return None;
        }
        (self.previous, self.out.step) = (lines, 0);
        Some(step)
    }

    /// Computes the outputs after the next edge.
    #[inline]
    fn next(&self, input: &In<i64>) -> Out<i64> {
        if self.settling > 0 {
            return Out { step: 0, ..self.out };
        }
        match (place(input) - place(&self.previous)).rem_euclid(4) {
            0 => Out { step: 0, ..self.out },
            1 => Out { step: 1, ..self.out },
            3 => Out { step: -1, ..self.out },
            _ => Out { step: 0, error: 1 },
        }
    }
}

impl Step for QuadratureDecoder {
    fn registers(&self) -> Vec<Register> {
        let mut all = vec![
            Register { low: 1, ..Register::new("previous", Format::BIT) },
            Register::new("previous", Format::BIT),
            Register::new("step", Format::signed(2)),
            Register::new("error", Format::BIT),
        ];
        if self.settle > 0 {
            let format = Format::unsigned(u32::BITS - self.settle.leading_zeros());
            all.push(Register::set("settling", format, self.settle.into()));
        }
        all
    }

    fn step<W: Word>(&self, registers: &[W], In { a, b }: In<W>) -> (Vec<W>, Out<W>) {
        let [was_a, was_b, step, error, ref settling @ ..] = *registers else { unreachable!("registers") };
        let (zero, one, two) = (W::int(0), W::int(1), W::int(2));
        // `place` computes the place of (a b) in the forward order 00, 01, 11, 10.
        let place = |a: W, b: W| a.shl(1) + a + b - (a * b).shl(1);
        let moved = (place(a, b) - place(was_a, was_b)).wrap(Format::unsigned(2));
        let is = |steps: W| moved.equals(steps);
        let settles = settling.first().map_or(!zero.equals(zero), |left| left.is_set());
        let counted = W::select(is(one), one, W::select(is(W::int(3)), -one, zero));
        let [counted] = W::branch(settles, || [zero], || [counted]);
        let lost = W::of_bit(error.is_set() | is(two) & !settles);
        let mut next = vec![a, b, counted, lost];
        next.extend(settling.iter().map(|&left| W::select(left.is_set(), left - one, left)));
        (next, Out { step, error })
    }
}

/// Returns the place of (a b) in the forward order 00, 01, 11, 10.
#[inline]
fn place(lines: &In<i64>) -> i64 {
    2 * lines.a + (lines.a ^ lines.b)
}

crate::base::listed::configured! {
    QuadratureDecoder of |block| {
        "SETTLE": u32 = 3, block.settle;
    }
}

impl Block for QuadratureDecoder {
    const NAME: &'static str = "quadrature_decoder";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        self.settling = self.settle;
        self.previous = In { a: 0, b: 0 };
        self.out = Out { step: 0, error: 0 };
        self.out
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        self.out = self.next(&input);
        self.previous = input;
        self.settling = self.settling.saturating_sub(1);
        self.out
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        // From the second edge on, the lines equal the previous ones, so `step` is 0.
        if self.next(input) != self.out {
            0
        } else if self.out.step != 0 {
            1
        } else {
            u64::MAX
        }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        if edges > 0 {
            self.previous = *input;
            self.settling = u32::try_from(edges).map_or(0, |edges| self.settling.saturating_sub(edges));
        }
    }
}

impl Listed for QuadratureDecoder {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("settle_0", Self::new(0)?)])
    }
}
