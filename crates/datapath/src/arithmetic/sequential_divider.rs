//! Unsigned restoring division, one bit an edge.
//!
//! - **Equation**: `quotient = min(floor(num * 2^FRAC / den), 2^OUT_WIDTH - 1)`; all ones for `den = 0`.
//! - **Ports**: `start` (0,1,0), `num` (0,NUM_WIDTH,0), `den` (0,DEN_WIDTH,0) in; `quotient` (0,OUT_WIDTH-FRAC,FRAC),
//!   `busy`, `ready` (0,1,0) out.
//! - **Latency**: `STEPS = NUM_WIDTH + FRAC` edges from the edge with `start` to the one that loads the quotient.
//! - **Edge**: with `start`, `num` and `den` are captured, the division begins and `busy` rises; one under way is given
//!   up, even on its last edge. `STEPS` edges later the quotient is loaded, `busy` falls and `ready` is high for one
//!   edge.
//! - **Reset**: idle, all outputs 0.
//! - **Overflow**: saturates when `OUT_WIDTH` is too narrow.
//! - **VHDL twin**: `hdl/sequential_divider.vhd`.
//! - **Source**: the restoring division of the textbooks; it turns the interval of an `edge_timer` into a speed.
//! - **Differs from the hardware**: a design of this project, not of a paper. The emulator computes the quotient at the
//!   start and shows it when it is ready: the ports are exact at every edge, the registers within are not modelled.

use hpu_signal::{Format, Narrowed, Narrowing, Overflow, Rounding, Term, Word};

use crate::base::computation::{Computation, ZERO};
use crate::base::config::within;
use crate::base::listed::Listed;
use crate::step::{equal, loads_first};
use crate::{Block, ConfigError, Lemma, Register, Step};

hpu_signal::ports! {
    /// Inputs of the divider.
    pub struct In of |block: &SequentialDivider| {
        start, "Captures the operands and begins";
        num: Format::unsigned(block.config.num_width), "1", "Dividend";
        den: Format::unsigned(block.config.den_width), "1", "Divisor";
    }
    /// Outputs of the divider.
    pub struct Out of |block: &SequentialDivider| {
        quotient: block.narrowing.to, "1", "Quotient of the latest division that ended";
        busy, "A division is under way";
        ready, "The quotient is new, for one edge";
    }
}

crate::base::listed::configuration! {
    /// The widths of a divider.
    pub struct DividerConfig {
        /// Width of the dividend.
        num_width: u32 = 24, ["NUM_WIDTH"];
        /// Width of the divisor.
        den_width: u32 = 16, ["DEN_WIDTH"];
        /// Fraction bits of the quotient.
        frac: u32 = 8, ["FRAC"];
        /// Width of the quotient, fraction bits included.
        out_width: u32 = 24, ["OUT_WIDTH"];
    }
}

impl DividerConfig {
    /// Returns the number of edges from the start to the quotient.
    pub const fn steps(self) -> u32 {
        self.num_width + self.frac
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SequentialDivider {
    config: DividerConfig,
    narrowing: Narrowing,
    computation: Computation<Narrowed>,
}

impl SequentialDivider {
    /// Returns a divider with these widths.
    ///
    /// # Errors
    ///
    /// Returns an error unless the dividend has 2 to 48 bits, the divisor 2 to 32, the quotient 0 to 16 fraction bits,
    /// together with the dividend at most 62, and 2 to `num_width + frac` bits in all.
    pub fn new(config: DividerConfig) -> Result<Self, ConfigError> {
        within(Self::NAME, "NUM_WIDTH", config.num_width, 2..=48)?;
        within(Self::NAME, "DEN_WIDTH", config.den_width, 2..=32)?;
        within(Self::NAME, "FRAC", config.frac, 0..=16)?;
        within(Self::NAME, "NUM_WIDTH + FRAC", config.steps(), 2..=62)?;
        within(Self::NAME, "OUT_WIDTH", config.out_width, 2..=config.steps())?;
        let frac = config.frac.cast_signed();
        let to = Format::new(false, config.out_width.cast_signed() - frac, frac).expect("2 to 62 bits");
        let narrowing = Narrowing { from_frac: frac, to, rounding: Rounding::Truncate, overflow: Overflow::Saturate };
        Ok(Self { config, narrowing, computation: Computation::new(config.steps(), ZERO) })
    }

    /// Returns the quotient, and what was lost to make it: a remainder, or the upper bits. A division by 0 overflows.
    #[inline]
    pub fn latest(&self) -> Narrowed {
        self.computation.result()
    }

    /// Returns the quotient of these operands.
    #[inline]
    pub(crate) fn divide(&self, num: i64, den: i64) -> Narrowed {
        let dividend = num * (1 << self.config.frac);
        match dividend.checked_div(den) {
            None => Narrowed { rounded: false, ..self.narrowing.apply(self.narrowing.to.max() + 1) },
            Some(quotient) => {
                let narrowed = self.narrowing.apply(quotient.into());
                Narrowed { rounded: quotient * den != dividend, ..narrowed }
            }
        }
    }

    /// Returns the quotient of a division that starts with these inputs, if one does.
    #[inline]
    fn started(&self, input: &In<i64>) -> Option<Narrowed> {
        (input.start != 0).then(|| self.divide(input.num, input.den))
    }

    #[inline]
    fn shown(&self) -> Out<i64> {
        let bit = i64::from;
        Out {
            quotient: self.computation.result().word,
            busy: bit(self.computation.busy()),
            ready: bit(self.computation.ready()),
        }
    }
}

/// The equations of the VHDL, which finds one bit of the quotient an edge.
impl Step for SequentialDivider {
    fn registers(&self) -> Vec<Register> {
        let (steps, den) = (self.config.steps(), self.config.den_width);
        vec![
            Register::new("remaining", Format::unsigned(u32::BITS - steps.leading_zeros())),
            Register::kept("bits", Format::unsigned(steps)),
            Register::kept("divisor", Format::unsigned(den)),
            Register::kept("rest", Format::unsigned(den + 1)),
            Register::new("quotient", Format::unsigned(self.config.out_width)),
            Register::new("busy", Format::BIT),
            Register::new("ready", Format::BIT),
        ]
    }

    fn step<W: Word>(&self, registers: &[W], In { start, num, den }: In<W>) -> (Vec<W>, Out<W>) {
        let [remaining, bits, divisor, rest, quotient, busy, ready] = *registers else { unreachable!("registers") };
        let DividerConfig { den_width, frac, out_width, .. } = self.config;
        let (steps, (zero, one)) = (self.config.steps(), (W::int(0), W::int(1)));
        let starts = || [W::int(steps.into()), num.shl(frac), den, zero, quotient, one, zero];
        let divides = || {
            let rest = rest.wrap(Format::unsigned(den_width)).shl(1) + bits.shr(steps - 1);
            let is_less = divisor.above(rest);
            let bits = (bits.shl(1) + W::of_bit(!is_less)).wrap(Format::unsigned(steps));
            let rest = W::select(is_less, rest, rest - divisor);
            let is_last = remaining.equals(one);
            let made = || [bits.limit(0, (1 << out_width) - 1), zero, one];
            let [quotient, busy, ready] = W::branch(is_last, made, || [quotient, busy, zero]);
            [remaining - one, bits, divisor, rest, quotient, busy, ready]
        };
        let idles = || [remaining, bits, divisor, rest, quotient, busy, zero];
        let next = W::branch(start.is_set(), starts, || W::branch(remaining.is_set(), divides, idles));
        (next.to_vec(), Out { quotient, busy, ready })
    }

    /// Claims that these equations divide. After `k` bits of a dividend `N`, `bits` holds the remaining bits of `N`,
    /// then the quotient `Q` so far. `Q * divisor + rest` equals the bits of `N` that were taken, and `rest < divisor`.
    /// When `Q` becomes `2 Q` or `2 Q + 1`, the product `P = Q * divisor` becomes `2 P`, or `2 P` plus a divisor. So no
    /// solver needs to multiply. For a divisor of 0, all bits of the quotient are set.
    fn lemmas(&self) -> Vec<Lemma<'_>> {
        let DividerConfig { num_width, den_width, out_width, .. } = self.config;
        let steps = self.config.steps();
        let (bit, den, quotient) = (Format::BIT, Format::unsigned(den_width), Format::unsigned(out_width));
        let whole = Format::unsigned(steps);
        let divides = |k: u32| Lemma {
            any: vec![whole, Format::unsigned(k.max(1)), den, Format::unsigned(den_width + 1), whole, quotient, bit],
            follows: Box::new(move |any| {
                let [n, so_far, divisor, rest, product, shown, ready] = *any else { unreachable!("seven words") };
                let (zero, one) = (Term::int(0), Term::int(1));
                let to_come = |taken: u32| if taken < steps { n.wrap(Format::unsigned(steps - taken)) } else { zero };
                let so_far = if k == 0 { zero } else { so_far };
                let bits = to_come(k).shl(k) + so_far;
                let is_zero = divisor.equals(zero);
                let given = is_zero | divisor.above(rest) & (product + rest).equals(n.shr(steps - k));
                let input = In { start: zero, num: zero, den: zero };
                let state = [Term::int((steps - k).into()), bits, divisor, rest, shown, one, ready];
                let (next, _) = self.step(&state, input);
                let [left, bits, same, rest, made, busy, ready] = next[..] else { unreachable!("seven registers") };
                let digit = bits.wrap(Format::BIT);
                let so_far = so_far.shl(1) + digit;
                let product = product.shl(1) + Term::select(digit.is_set(), divisor, zero);
                let is_last = k + 1 == steps;
                let outputs = if is_last {
                    made.equals(so_far.lesser(Term::int((1 << out_width) - 1))) & busy.equals(zero) & ready.equals(one)
                } else {
                    made.equals(shown) & busy.equals(one) & ready.equals(zero)
                };
                let divided = divisor.above(rest) & (product + rest).equals(n.shr(steps - k - 1));
                let follows = left.equals(Term::int((steps - k - 1).into()))
                    & bits.equals(to_come(k + 1).shl(k + 1) + so_far)
                    & same.equals(divisor)
                    & (is_zero & digit.is_set() | !is_zero & divided)
                    & outputs;
                (given, follows)
            }),
        };
        let begins = Lemma {
            any: vec![Format::unsigned(num_width), den],
            follows: Box::new(move |any| {
                let [num, divisor] = *any else { unreachable!("two words") };
                let (zero, one) = (Term::int(0), Term::int(1));
                let state = [zero; 7];
                let (next, _) = self.step(&state, In { start: one, num, den: divisor });
                let expected = [Term::int(steps.into()), num.shl(self.config.frac), divisor, zero, zero, one, zero];
                (zero.equals(zero), equal(&next, &expected))
            }),
        };
        let idles = |one: &[Term], _: &[Term]| one[0].equals(Term::int(0));
        (0..steps).map(divides).chain([begins, loads_first(self, idles)]).collect()
    }
}

crate::base::listed::configured!(SequentialDivider: DividerConfig);

impl Block for SequentialDivider {
    const NAME: &'static str = "sequential_divider";
    crate::base::block::computing!(ZERO);
}

impl Listed for SequentialDivider {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let divider = |[num_width, den_width, frac, out_width]: [u32; 4]| {
            Self::new(DividerConfig { num_width, den_width, frac, out_width })
        };
        Ok(vec![
            ("narrow", divider([4, 3, 2, 5])?),
            ("integer", divider([16, 16, 0, 16])?),
            ("fraction_only", divider([5, 11, 16, 9])?),
            ("wide", divider([46, 32, 16, 62])?),
        ])
    }
}
