//! The blocks as parts of a circuit: the words that their outputs have between two edges, and the bits lost.

use hpu_signal::Narrowed;

use crate::{
    Block, CommandLimiter, Displacement, InputShaper, Law, LawOut, PositionCounter, QuadratureDecoder, Saturator,
    Synchronizer, TorqueSum, TruncatingMultiplier, Unilateral, VelocityRegister, ZeroOrderHold,
    arithmetic::input_shaper, arithmetic::saturator, arithmetic::truncating_multiplier, velocity::velocity_register,
};

/// A block as a part of a circuit. Every block that a `circuit!` contains implements it.
pub trait Part: Block {
    /// Whether the outputs follow the inputs between two edges.
    const FOLLOWS: bool = true;
    /// Returns the outputs as they follow from these inputs and from the registers as they stand, with the bits that
    /// they lost. `shown` are the outputs before. It is called only if the outputs [`FOLLOW`](Self::FOLLOWS).
    fn follow(&mut self, input: &Self::In<i64>, shown: Self::Out<i64>) -> Self::Out<Narrowed>;
    /// Returns the bits that the outputs have lost, if these may change at an edge. The words do not count.
    #[inline]
    fn hidden(&self) -> Option<Self::Out<Narrowed>> {
        None
    }
}

/// Returns a word that lost no bits.
pub(crate) const fn exact(word: i64) -> Narrowed {
    Narrowed { word, rounded: false, overflowed: false }
}

/// Registers: their outputs follow nothing between the edges. `registers!(Block, self => outputs)` is for a block that
/// loses bits, with its outputs as they stand.
macro_rules! registers {
    ($($block:ident)*) => {
        $(impl $crate::circuit::part::Part for $block {
            const FOLLOWS: bool = false;
            #[inline]
            fn follow(&mut self, _: &Self::In<i64>, shown: Self::Out<i64>) -> Self::Out<hpu_signal::Narrowed> {
                shown.map($crate::circuit::part::exact)
            }
        })*
    };
    ($block:ident, $self:ident => $shown:expr) => {
        impl $crate::circuit::part::Part for $block {
            const FOLLOWS: bool = false;
            #[inline]
            fn follow(&mut $self, _: &Self::In<i64>, _: Self::Out<i64>) -> Self::Out<hpu_signal::Narrowed> {
                $shown
            }
            #[inline]
            fn hidden(&$self) -> Option<Self::Out<hpu_signal::Narrowed>> {
                Some($shown)
            }
        }
    };
}

/// Logic that tells the bits that it loses.
macro_rules! telling {
    ($($block:ident)*) => {
        $(impl $crate::circuit::part::Part for $block {
            #[inline]
            fn follow(&mut self, input: &Self::In<i64>, _: Self::Out<i64>) -> Self::Out<hpu_signal::Narrowed> {
                self.eval(*input)
            }
        })*
    };
}

/// Logic that loses no bits.
macro_rules! logic {
    ($($block:ident)*) => {
        $(impl $crate::circuit::part::Part for $block {
            #[inline]
            fn follow(&mut self, input: &Self::In<i64>, _: Self::Out<i64>) -> Self::Out<Narrowed> {
                self.eval(*input).map(exact)
            }
        })*
    };
}

pub(crate) use {registers, telling};

registers!(Synchronizer QuadratureDecoder PositionCounter ZeroOrderHold);
registers!(VelocityRegister, self => velocity_register::Out { velocity: self.latest() });
logic!(Displacement Unilateral TorqueSum);

impl Part for TruncatingMultiplier {
    #[inline]
    fn follow(&mut self, input: &Self::In<i64>, _: Self::Out<i64>) -> Self::Out<Narrowed> {
        truncating_multiplier::Out { product: self.eval(*input) }
    }
}

impl Part for Saturator {
    #[inline]
    fn follow(&mut self, input: &Self::In<i64>, _: Self::Out<i64>) -> Self::Out<Narrowed> {
        let word = self.eval(*input).limited;
        saturator::Out { limited: Narrowed { overflowed: word != input.value, ..exact(word) } }
    }
}

impl Part for CommandLimiter {
    #[inline]
    fn follow(&mut self, input: &Self::In<i64>, _: Self::Out<i64>) -> Self::Out<Narrowed> {
        let limited = self.limit(input.value);
        let overflowed = limited != input.value;
        saturator::Out { limited: Narrowed { overflowed, ..exact(self.settle(limited)) } }
    }
}

impl Part for InputShaper {
    #[inline]
    fn follow(&mut self, input: &Self::In<i64>, _: Self::Out<i64>) -> Self::Out<Narrowed> {
        self.settle(input.torque);
        input_shaper::Out { shaped: self.latest() }
    }

    #[inline]
    fn hidden(&self) -> Option<Self::Out<Narrowed>> {
        Some(input_shaper::Out { shaped: self.latest() })
    }
}

impl<L: Law> Part for L {
    #[inline]
    fn follow(&mut self, input: &Self::In<i64>, shown: Self::Out<i64>) -> Self::Out<Narrowed> {
        let LawOut { torque, memory } = self.settle(input, shown);
        let with = |word, (rounded, overflowed)| Narrowed { word, rounded, overflowed };
        let [of_torque, of_memory] = self.lost();
        LawOut { torque: with(torque, of_torque), memory: with(memory, of_memory) }
    }

    #[inline]
    fn hidden(&self) -> Option<Self::Out<Narrowed>> {
        let [torque, memory] = self.lost().map(|(rounded, overflowed)| Narrowed { word: 0, rounded, overflowed });
        Some(LawOut { torque, memory })
    }
}
