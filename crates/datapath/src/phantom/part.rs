//! The arm's blocks as parts of a circuit.

use hpu_signal::Narrowed;

use super::TrigTable;
use super::{CommandRegister, CommandScaler, CubeRoom, PhantomEngine, PhantomForward, PhantomTorque, SampleRegister};
use crate::part::{Part, registers};

registers!(SampleRegister TrigTable CommandRegister);

/// Logic that tells the bits that it loses.
macro_rules! logic {
    ($($block:ident)*) => {
        $(impl Part for $block {
            #[inline]
            fn follow(&mut self, input: &Self::In<i64>, _: Self::Out<i64>) -> Self::Out<Narrowed> {
                self.eval(*input)
            }
        })*
    };
}

logic!(PhantomForward CubeRoom PhantomTorque CommandScaler);

impl Part for PhantomEngine {
    #[inline]
    fn follow(&mut self, _: &Self::In<i64>, _: Self::Out<i64>) -> Self::Out<Narrowed> {
        *self.latest()
    }

    #[inline]
    fn hidden(&self) -> Option<Self::Out<Narrowed>> {
        Some(*self.latest())
    }
}
