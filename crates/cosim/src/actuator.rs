//! What stands between the datapath and the device: a bridge, or an amplifier with or without an analog shaper.

use hpu_plant::Shaper;

/// What drives the device of a scene.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Actuator {
    /// The bridge, every switching of it.
    Switching,
    /// The bridge's mean voltage.
    Averaged {
        /// PWM counts of full scale.
        full_scale: f64,
        /// When the duty changes; `None`: at once.
        latch: Option<Latch>,
    },
    /// A force amplifier that follows the command.
    Amplified {
        /// Force of one count, in N.
        quantum_n: f64,
        /// The shaper before it.
        shaping: Option<Shaping>,
    },
}

/// An analog shaper at work. Its output is handed on when its input changes and every `hold` edges after that.
///
/// In between it moves on, by no more than [`Shaper::slope_bound_per_s`] of full scale: that is all that the hold costs the
/// force. A shaper that has nothing to push with (no input, or one that pulls) rests at 0 and is not asked.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Shaping {
    shaper: Shaper,
    edge_s: f64,
    hold: u64,
    /// When the input last changed.
    anchor: u64,
    /// When the output is handed on next.
    pub(crate) next: u64,
}

impl Shaping {
    /// A shaper at rest at edge 0.
    pub(crate) fn new(cutoff_hz: f64, edge_s: f64, hold: u64) -> Self {
        Self { shaper: Shaper::new(cutoff_hz), edge_s, hold, anchor: 0, next: u64::MAX }
    }

    fn at(&self, edge: u64) -> Shaper {
        self.shaper.after((edge - self.anchor) as f64 * self.edge_s)
    }

    /// The input is this from `edge` on; the output there, if it is another input than before.
    pub(crate) fn take(&mut self, edge: u64, input: f64) -> Option<f64> {
        if self.shaper.input() == input {
            return None;
        }
        self.shaper = self.at(edge).stepped(input);
        self.anchor = edge;
        self.next = if input > 0.0 { edge + self.hold } else { u64::MAX };
        Some(self.shaper.output())
    }

    /// The output at an edge at which it is due.
    pub(crate) fn hand_on(&mut self, edge: u64) -> f64 {
        self.next = edge + self.hold;
        self.at(edge).output()
    }
}

/// When the duty of an averaged bridge changes.
///
/// A modulator takes its duty at the start of a period, and what another duty changes is where the pulse ends. A mean over a period
/// stands for its middle, so it changes half a period before that end, but no sooner than the command: a duty given after
/// that comes late, which the switching bridge's does not.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Latch {
    period: u64,
    antiphase: bool,
    wanted: f64,
    /// The edge at which it changes.
    pub(crate) next: u64,
}

impl Latch {
    /// A latch at edge 0, with nothing to take.
    pub(crate) fn new(period: u64, antiphase: bool) -> Self {
        Self { period, antiphase, wanted: 0.0, next: u64::MAX }
    }

    /// The duty is this from `edge` on; whether that is another than before.
    #[inline]
    pub(crate) fn give(&mut self, edge: u64, duty: f64) -> bool {
        if self.wanted == duty {
            return false;
        }
        self.wanted = duty;
        // Periods begin at the edges after those that `period` divides; a word is seen at the edge after its own.
        let begin = edge.div_ceil(self.period) * self.period + 1;
        let pulse = if self.antiphase { 0.5 + 0.5 * duty } else { duty.abs().min(1.0) };
        let middle = self.period / 2;
        self.next = (begin + (pulse * self.period as f64) as u64).saturating_sub(middle).max(edge);
        true
    }

    /// The duty, taken.
    pub(crate) fn take(&mut self) -> f64 {
        self.next = u64::MAX;
        self.wanted
    }
}
