//! The common part of the four sources of sine and cosine: a wave that is registered at every edge.

mod phase;
pub mod trig_cordic;
pub mod trig_interpolated;
pub mod trig_quarter;
pub mod trig_table;

pub use phase::{Phase, Turn};
pub use trig_cordic::TrigCordic;
pub use trig_interpolated::TrigInterpolated;
pub use trig_quarter::TrigQuarter;
pub use trig_table::TrigTable;

use hpu_signal::{Format, Machine, Word};

use crate::{Block, ClockEdge, Generic, Register, Rom, Step};

hpu_signal::ports! {
    /// Inputs of a source of sine and cosine.
    pub struct TrigIn of[V: Wave] |block: &Trig<V>| {
        count: block.wave.count(), "count", "Position of the joint";
    }
    /// Outputs of a source of sine and cosine.
    pub struct TrigOut of[V: Wave] |block: &Trig<V>| {
        sine: block.wave.word(), "1", "Sine of the joint's angle";
        cosine: block.wave.word(), "1", "Cosine of the joint's angle";
        valid, "Sine and cosine are those of the count";
    }
}

/// Sine and cosine as a function of the count. Each of the four sources implements it; [`Trig`] makes a block of it.
///
/// ```
/// use hpu_datapath::phantom::{Trig, TrigQuarter, Wave};
/// use hpu_signal::{Machine, Word};
///
/// let block = TrigQuarter::default();
/// let _: &Trig<_> = &block;
/// ```
pub trait Wave: Clone + PartialEq {
    /// See [`Block::NAME`].
    const NAME: &'static str;
    /// Returns the format of the count.
    fn count(&self) -> Format;
    /// Returns the format of sine and cosine.
    fn word(&self) -> Format;
    /// See [`Block::generics`].
    fn generics(&self) -> Vec<(&'static str, Generic)>;
    /// See [`Block::roms`].
    fn roms(&self) -> Vec<Rom> {
        Vec::new()
    }
    /// Computes sine and cosine of a count, and whether they are known.
    fn at<W: Word>(&self, count: W) -> TrigOut<W>;
}

/// A source of sine and cosine. Its latency is 1 edge; the outputs are registered at every edge, and a reset clears
/// them.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Trig<W> {
    wave: W,
    out: TrigOut<i64>,
}

/// The outputs after reset.
const ZERO: TrigOut<i64> = TrigOut { sine: 0, cosine: 0, valid: 0 };

impl<W: Wave> Trig<W> {
    pub(crate) fn of(wave: W) -> Self {
        Self { wave, out: ZERO }
    }

    /// Returns sine and cosine of a count: the outputs after an edge that has seen it.
    #[inline]
    pub fn at(&self, count: i64) -> TrigOut<i64> {
        // A phase has at most 48 bits, and its product with a step 55.
        self.wave.at(Machine::<i64>::of(count)).map(|port| port.narrowed().word)
    }
}

impl<V: Wave> Step for Trig<V> {
    fn registers(&self) -> Vec<Register> {
        let word = self.wave.word();
        vec![Register::new("sine", word), Register::new("cosine", word), Register::new("valid", Format::BIT)]
    }

    fn step<W: Word>(&self, registers: &[W], input: TrigIn<W>) -> (Vec<W>, TrigOut<W>) {
        let [sine, cosine, valid] = *registers else { unreachable!("three registers") };
        let next = self.wave.at(input.count);
        (vec![next.sine, next.cosine, next.valid], TrigOut { sine, cosine, valid })
    }
}

impl<V: Wave> Block for Trig<V> {
    const NAME: &'static str = V::NAME;
    const CLOCKED: bool = true;
    crate::base::block::described!(TrigIn, TrigOut);

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        self.wave.generics()
    }

    fn roms(&self) -> Vec<Rom> {
        self.wave.roms()
    }

    fn equations(&self) -> Option<ClockEdge<'_>> {
        Some(ClockEdge::of(self))
    }

    fn reset(&mut self) -> TrigOut<i64> {
        self.out = ZERO;
        ZERO
    }

    #[inline]
    fn tick(&mut self, input: TrigIn<i64>) -> TrigOut<i64> {
        self.out = self.at(input.count);
        self.out
    }

    #[inline]
    fn quiet(&self, input: &TrigIn<i64>) -> u64 {
        if self.at(input.count) == self.out { u64::MAX } else { 0 }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &TrigIn<i64>) {
        debug_assert!(edges <= self.quiet(input));
    }
}
