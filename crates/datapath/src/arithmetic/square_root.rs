//! Floor of the square root, one bit an edge.
//!
//! - **Equation**: `root = floor(sqrt(x))`.
//! - **Ports**: `start` (0,1,0), `x` (0,WIDTH,0) in; `root` (0,WIDTH/2,0), `busy`, `ready` (0,1,0) out.
//! - **Latency**: `WIDTH/2` edges from the edge with `start` to the one that loads the root.
//! - **Edge**: with `start`, `x` is captured, the extraction begins and `busy` rises; one under way is given up, even
//!   on its last edge. `WIDTH/2` edges later the root is loaded, `busy` falls and `ready` is high for one edge.
//! - **Reset**: idle, all outputs 0. **Overflow**: none.
//! - **VHDL twin**: `hdl/square_root.vhd`.
//! - **Source**: the digit-by-digit root of the textbooks.
//! - **Differs from the hardware**: a design of this project, not of a paper. The emulator computes the root at the
//!   start and shows it when it is ready: the ports are exact at every edge, the registers within are not modelled.

use hpu_signal::{Format, Narrowed, Term, Word};

use crate::base::computation::{Computation, ZERO};
use crate::base::config::within;
use crate::base::listed::Listed;
use crate::step::{equal, loads_first};
use crate::{Block, ConfigError, Lemma, Register, Step};

hpu_signal::ports! {
    /// Inputs of the square root.
    pub struct In of |block: &SquareRoot| {
        start, "Captures the radicand and begins";
        x: block.word, "1", "Radicand";
    }
    /// Outputs of the square root.
    pub struct Out of |block: &SquareRoot| {
        root: Format::unsigned(block.word.width() / 2), "1", "Root of the latest extraction that ended";
        busy, "An extraction is under way";
        ready, "The root is new, for one edge";
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SquareRoot {
    word: Format,
    computation: Computation<Narrowed>,
}

impl SquareRoot {
    /// Returns a root of words of `width` bits.
    ///
    /// # Errors
    ///
    /// Returns an error unless `width` is even and 4 to 62.
    pub fn new(width: u32) -> Result<Self, ConfigError> {
        within(Self::NAME, "WIDTH", width, 4..=62)?;
        if !width.is_multiple_of(2) {
            return Err(ConfigError::new(Self::NAME, format!("WIDTH is {width}"), "even widths"));
        }
        Ok(Self { word: Format::unsigned(width), computation: Computation::new(width / 2, ZERO) })
    }

    /// Returns the root, and whether it was rounded, which means that `x` was no square.
    #[inline]
    pub fn latest(&self) -> Narrowed {
        self.computation.result()
    }

    /// Returns the root of a radicand.
    #[inline]
    pub(crate) fn root(x: i64) -> Narrowed {
        let root = x.isqrt();
        Narrowed { word: root, rounded: root * root != x, overflowed: false }
    }

    /// Returns the root of an extraction that starts with these inputs, if one does.
    #[inline]
    fn started(&self, input: &In<i64>) -> Option<Narrowed> {
        (input.start != 0).then(|| Self::root(input.x))
    }

    #[inline]
    fn shown(&self) -> Out<i64> {
        let Self { computation, .. } = self;
        Out {
            root: computation.result().word,
            busy: i64::from(computation.busy()),
            ready: i64::from(computation.ready()),
        }
    }
}

/// The equations of the VHDL, which finds one bit of the root an edge.
impl Step for SquareRoot {
    fn registers(&self) -> Vec<Register> {
        let steps = self.word.width() / 2;
        vec![
            Register::new("remaining", Format::unsigned(u32::BITS - steps.leading_zeros())),
            Register::kept("bits", self.word),
            Register::kept("partial", Format::unsigned(steps)),
            Register::kept("rest", Format::unsigned(steps + 2)),
            Register::new("root", Format::unsigned(steps)),
            Register::new("busy", Format::BIT),
            Register::new("ready", Format::BIT),
        ]
    }

    fn step<W: Word>(&self, registers: &[W], In { start, x }: In<W>) -> (Vec<W>, Out<W>) {
        let [remaining, bits, partial, rest, root, busy, ready] = *registers else { unreachable!("registers") };
        let (width, zero, one) = (self.word.width(), W::int(0), W::int(1));
        let steps = width / 2;
        let starts = || [W::int(steps.into()), x, zero, zero, root, one, zero];
        let extracts = || {
            let rest = rest.wrap(Format::unsigned(steps)).shl(2) + bits.shr(width - 2);
            let trial = partial.shl(2) + one;
            let is_less = trial.above(rest);
            let partial = (partial.shl(1) + W::of_bit(!is_less)).wrap(Format::unsigned(steps));
            let rest = W::select(is_less, rest, rest - trial);
            let is_last = remaining.equals(one);
            let [root, busy, ready] = W::branch(is_last, || [partial, zero, one], || [root, busy, zero]);
            [remaining - one, bits.shl(2).wrap(self.word), partial, rest, root, busy, ready]
        };
        let idles = || [remaining, bits, partial, rest, root, busy, zero];
        let next = W::branch(start.is_set(), starts, || W::branch(remaining.is_set(), extracts, idles));
        (next.to_vec(), Out { root, busy, ready })
    }

    /// Claims that these equations take the root. After `k` digits of the root of `X`, `partial^2 + rest` equals the `2
    /// k` bits of `X` that were taken, and `rest <= 2 partial`. When `partial` becomes `2 partial` or `2 partial + 1`,
    /// its square becomes four times the square, or four times the square plus `4 partial + 1`. So no solver needs to
    /// multiply.
    fn lemmas(&self) -> Vec<Lemma<'_>> {
        let (width, steps) = (self.word.width(), self.word.width() / 2);
        let (bit, half) = (Format::BIT, Format::unsigned(steps));
        let extracts = |k: u32| Lemma {
            any: vec![self.word, Format::unsigned(k.max(1)), Format::unsigned(steps + 2), self.word, half, bit],
            follows: Box::new(move |any| {
                let [x, so_far, rest, square, shown, ready] = *any else { unreachable!("six words") };
                let (zero, one) = (Term::int(0), Term::int(1));
                let to_come =
                    |taken: u32| if taken < steps { x.wrap(Format::unsigned(width - 2 * taken)) } else { zero };
                let so_far = if k == 0 { zero } else { so_far };
                let given = so_far.shl(1).at_least(rest) & (square + rest).equals(x.shr(width - 2 * k));
                let state = [Term::int((steps - k).into()), to_come(k).shl(2 * k), so_far, rest, shown, one, ready];
                let (next, _) = self.step(&state, In { start: zero, x: zero });
                let [left, bits, partial, rest, made, busy, ready] = next[..] else { unreachable!("seven registers") };
                let digit = partial.wrap(Format::BIT);
                let square = square.shl(2) + Term::select(digit.is_set(), so_far.shl(2) + one, zero);
                let outputs = if k + 1 == steps {
                    made.equals(partial) & busy.equals(zero) & ready.equals(one)
                } else {
                    made.equals(shown) & busy.equals(one) & ready.equals(zero)
                };
                let follows = left.equals(Term::int((steps - k - 1).into()))
                    & bits.equals(to_come(k + 1).shl(2 * k + 2))
                    & partial.equals(so_far.shl(1) + digit)
                    & partial.shl(1).at_least(rest)
                    & (square + rest).equals(x.shr(width - 2 * k - 2))
                    & outputs;
                (given, follows)
            }),
        };
        let begins = Lemma {
            any: vec![self.word],
            follows: Box::new(move |any| {
                let (zero, one) = (Term::int(0), Term::int(1));
                let (next, _) = self.step(&[zero; 7], In { start: one, x: any[0] });
                (zero.equals(zero), equal(&next, &[Term::int(steps.into()), any[0], zero, zero, zero, one, zero]))
            }),
        };
        let idles = |one: &[Term], _: &[Term]| one[0].equals(Term::int(0));
        (0..steps).map(extracts).chain([begins, loads_first(self, idles)]).collect()
    }
}

crate::base::listed::configured! {
    SquareRoot of |block| {
        "WIDTH": u32 = 24, block.word.width();
    }
}

impl Block for SquareRoot {
    const NAME: &'static str = "square_root";
    crate::base::block::computing!(ZERO);
}

impl Listed for SquareRoot {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("4_bit", Self::new(4)?), ("10_bit", Self::new(10)?), ("62_bit", Self::new(62)?)])
    }
}
