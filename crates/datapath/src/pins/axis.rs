//! The blocks of one encoder, from its pins to a position: a synchronizer, a decoder and a counter.

use crate::{
    Block, ConfigError, PositionCounter, QuadratureDecoder, Synchronizer, pins::position_counter,
    pins::quadrature_decoder, pins::synchronizer,
};

/// The blocks of an encoder, named as their instances, and the words of the nets that they drive.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Axis {
    pub(crate) sync: Synchronizer,
    pub(crate) decoder: QuadratureDecoder,
    pub(crate) counter: PositionCounter,
    pub(crate) lines: synchronizer::Out<i64>,
    pub(crate) motion: quadrature_decoder::Out<i64>,
    pub(crate) position: i64,
}

impl Axis {
    pub(crate) fn new(width: u32) -> Result<Self, ConfigError> {
        Ok(Self {
            sync: Synchronizer::new(),
            decoder: QuadratureDecoder::default(),
            counter: PositionCounter::new(width)?,
            lines: synchronizer::Out { a: 0, b: 0 },
            motion: quadrature_decoder::Out { step: 0, error: 0 },
            position: 0,
        })
    }

    /// Applies one edge of reset.
    pub(crate) fn reset(&mut self) {
        self.lines = self.sync.reset();
        self.motion = self.decoder.reset();
        self.position = self.counter.reset().position;
    }

    /// Returns the inputs that decoder and counter read at the next edge.
    #[inline]
    fn seen(&self) -> (quadrature_decoder::In<i64>, position_counter::In<i64>) {
        let synchronizer::Out { a, b } = self.lines;
        (quadrature_decoder::In { a, b }, position_counter::In { step: self.motion.step })
    }

    #[inline]
    pub(crate) fn tick(&mut self, pins: synchronizer::In<i64>) {
        let (lines, motion) = self.seen();
        self.lines = self.sync.tick(pins);
        self.motion = self.decoder.tick(lines);
        self.position = self.counter.tick(motion).position;
    }

    #[inline]
    pub(crate) fn quiet(&self, pins: &synchronizer::In<i64>) -> u64 {
        let (lines, motion) = self.seen();
        self.sync.quiet(pins).min(self.decoder.quiet(&lines)).min(self.counter.quiet(&motion))
    }

    #[inline]
    pub(crate) fn skip(&mut self, edges: u64, pins: &synchronizer::In<i64>) {
        let (lines, motion) = self.seen();
        self.sync.skip(edges, pins);
        self.decoder.skip(edges, &lines);
        self.counter.skip(edges, &motion);
    }
}
