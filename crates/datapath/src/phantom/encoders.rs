//! The encoders of three joints, from pins to positions: each has a synchronizer, a decoder and a counter.

use hpu_signal::Signal;

use crate::axis::Axis;
use crate::circuit::instance;
use crate::{Block, ConfigError, Instance, flatten, quadrature_decoder, synchronizer};

/// The pins of three encoders.
pub(crate) type Pins = [synchronizer::In<i64>; 3];

/// The blocks of three joints and the nets that they drive.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Encoders {
    axes: [Axis; 3],
}

impl Encoders {
    /// The number of their nets without the positions.
    pub(crate) const LINES: usize = 12;

    pub(crate) fn new(width: u32) -> Result<Self, ConfigError> {
        Ok(Self { axes: [Axis::new(width)?, Axis::new(width)?, Axis::new(width)?] })
    }

    pub(crate) fn reset(&mut self) {
        self.axes.iter_mut().for_each(Axis::reset);
    }

    #[inline]
    pub(crate) fn tick(&mut self, pins: &Pins) {
        self.axes.iter_mut().zip(pins).for_each(|(axis, pins)| axis.tick(*pins));
    }

    #[inline]
    pub(crate) fn quiet(&self, pins: &Pins) -> u64 {
        let [first, second, third] = &self.axes;
        first.quiet(&pins[0]).min(second.quiet(&pins[1])).min(third.quiet(&pins[2]))
    }

    #[inline]
    pub(crate) fn skip(&mut self, edges: u64, pins: &Pins) {
        self.axes.iter_mut().zip(pins).for_each(|(axis, pins)| axis.skip(edges, pins));
    }

    /// Returns `a` and `b`, then `step` and `error`, of joints 1 to 3.
    #[inline]
    pub(crate) fn lines(&self) -> [i64; Self::LINES] {
        let [first, second, third] = &self.axes;
        let synchronizer::Out { a: a1, b: b1 } = first.lines;
        let synchronizer::Out { a: a2, b: b2 } = second.lines;
        let synchronizer::Out { a: a3, b: b3 } = third.lines;
        let quadrature_decoder::Out { step: step1, error: error1 } = first.motion;
        let quadrature_decoder::Out { step: step2, error: error2 } = second.motion;
        let quadrature_decoder::Out { step: step3, error: error3 } = third.motion;
        [a1, b1, a2, b2, a3, b3, step1, error1, step2, error2, step3, error3]
    }

    #[inline]
    pub(crate) fn positions(&self) -> [i64; 3] {
        [self.axes[0].position, self.axes[1].position, self.axes[2].position]
    }

    /// Returns the pins, `a` and `b` of joints 1 to 3.
    pub(crate) fn pins(&self) -> [Signal; 6] {
        let synchronizer::In { a_pin, b_pin } = self.axes[0].sync.inputs();
        let a = |name| Signal { name, ..a_pin.clone() };
        let b = |name| Signal { name, ..b_pin.clone() };
        [a("a_pin1"), b("b_pin1"), a("a_pin2"), b("b_pin2"), a("a_pin3"), b("b_pin3")]
    }

    /// Returns the positions of joints 1 to 3.
    pub(crate) fn outputs(&self) -> [Signal; 3] {
        let position = |joint: usize, name, doc| Signal { name, doc, ..self.axes[joint].counter.outputs().position };
        [
            position(0, "position1", "Position of joint 1, modulo its width"),
            position(1, "position2", "Position of joint 2, modulo its width"),
            position(2, "position3", "Position of joint 3, modulo its width"),
        ]
    }

    /// Returns the nets of [`lines`](Self::lines).
    pub(crate) fn nets(&self) -> Vec<Signal> {
        let lines = flatten(&self.axes[0].sync.outputs());
        let motion = flatten(&self.axes[0].decoder.outputs());
        let named = |signals: &[Signal], names: [&'static str; 6]| -> Vec<Signal> {
            names.iter().zip(signals.iter().cycle()).map(|(name, signal)| Signal { name, ..signal.clone() }).collect()
        };
        let mut all = named(&lines, ["a1", "b1", "a2", "b2", "a3", "b3"]);
        all.extend(named(&motion, ["step1", "error1", "step2", "error2", "step3", "error3"]));
        all
    }

    /// Returns the instances. They are connected to the pins, which are the first nets, to the lines from net `lines`
    /// on, and to the positions from net `positions` on.
    pub(crate) fn instances(&self, lines: usize, positions: usize) -> Vec<Instance> {
        const LABELS: [[&str; 3]; 3] =
            [["sync1", "sync2", "sync3"], ["decoder1", "decoder2", "decoder3"], ["counter1", "counter2", "counter3"]];
        let joints = || self.axes.iter().enumerate();
        let a = |joint: usize| lines + 2 * joint;
        let step = |joint: usize| lines + 6 + 2 * joint;
        let [sync, decoder, counter] = LABELS;
        let mut all: Vec<_> =
            joints().map(|(j, axis)| instance(sync[j], &axis.sync, &[2 * j, 2 * j + 1, a(j), a(j) + 1])).collect();
        all.extend(
            joints().map(|(j, axis)| instance(decoder[j], &axis.decoder, &[a(j), a(j) + 1, step(j), step(j) + 1])),
        );
        all.extend(joints().map(|(j, axis)| instance(counter[j], &axis.counter, &[step(j), positions + j])));
        all
    }
}
