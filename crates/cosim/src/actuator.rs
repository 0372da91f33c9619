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
/// In between it moves on, by no more than [`Shaper::slope_bound_per_s`] of full scale: that is all that the hold costs
/// the force. A shaper that has nothing to push with (no input, or one that pulls) rests at 0 and is not asked.
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

/// What an averaged bridge gives, and when.
///
/// A modulator takes its duty at the start of a period, and what another duty changes is where the pulse ends. The mean
/// of a pulse has its area, but its middle is the period's, where the pulse's is sooner. Both agree in area and in
/// first moment once the mean changes at the right moment: between duties of one sign `(1 - d - d') / 2` periods before
/// the start of the one that takes `d'` after `d`. A command that comes after that moment is made up for: what the
/// bridge still owes it gives in addition, up to the middle of that period.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Latch {
    period: u64,
    antiphase: bool,
    /// The duty that the modulator has taken.
    held: f64,
    /// The duty that it is given, and the edge at which it takes it.
    wanted: f64,
    begin: u64,
    /// The edge at which the mean changes from one to the other.
    due: f64,
    /// What the bridge gives since the edge `since`, and what it owed then, in edges of full duty, to a modulator that
    /// goes on with the duty it has taken.
    pub(crate) given: f64,
    since: u64,
    owed: f64,
    /// The edge at which what it gives changes by itself.
    pub(crate) next: u64,
}

impl Latch {
    /// A latch at edge 0, where the modulator starts with duty 0; that has a moment in antiphase.
    pub(crate) fn new(period: u64, antiphase: bool) -> Self {
        let next = u64::MAX;
        let rest = Self {
            period,
            antiphase,
            held: 0.0,
            wanted: 0.0,
            begin: 0,
            due: 0.0,
            given: 0.0,
            since: 0,
            owed: 0.0,
            next,
        };
        let owed = rest.moment(0.0) * period as f64;
        if owed == 0.0 { rest } else { Self { owed, given: owed / rest.end() as f64, next: rest.end(), ..rest } }
    }

    /// The first moment of a period at a duty, before that of its mean: in squares of the period.
    #[inline]
    fn moment(&self, duty: f64) -> f64 {
        if self.antiphase { 0.25 * (1.0 - duty * duty) } else { 0.5 * duty * (1.0 - duty.abs()) }
    }

    /// Goes on to an edge, before `from` comes a command.
    #[inline]
    fn settle(&mut self, edge: u64, from: u64) {
        self.owed += (self.held - self.given) * (edge - self.since) as f64;
        self.since = edge;
        if self.wanted != self.held && from >= self.begin {
            self.owed += (self.wanted - self.held) * (edge as f64 - self.due);
            self.held = self.wanted;
        }
    }

    /// Another duty from `from` on, known at `edge`.
    #[inline]
    fn want(&mut self, edge: u64, from: u64, duty: f64) {
        self.settle(edge, from);
        self.wanted = duty;
        // Periods begin at the edges after those that `period` divides; a word is seen at the edge after its own.
        self.begin = from.div_ceil(self.period) * self.period + 1;
        let change = duty - self.held;
        let lead = if change == 0.0 { 0.0 } else { (self.moment(duty) - self.moment(self.held)) / change };
        self.due = self.begin as f64 - lead * self.period as f64;
    }

    /// The edge up to which a late command is made up for.
    #[inline]
    fn end(&self) -> u64 {
        self.begin + self.period / 2
    }

    /// The duty is this from `edge` on; what the bridge gives from there, if that changes now.
    #[inline]
    pub(crate) fn give(&mut self, edge: u64, duty: f64) -> Option<f64> {
        if self.wanted == duty {
            return None;
        }
        self.want(edge, edge, duty);
        let (change, end) = (duty - self.held, self.end());
        if self.given == self.held && change != 0.0 {
            // One change is enough, at the moment that also settles what is owed; often that is half an edge, which
            // noise is not to decide.
            let at = (self.due - self.owed / change + 0.25).floor();
            if at > edge as f64 && at <= end as f64 {
                self.next = at as u64;
                return None;
            }
        }
        self.next = end;
        let missing = self.owed + change * (end as f64 - self.due).max(0.0);
        self.given = self.held + missing / (end - edge) as f64;
        Some(self.given)
    }

    /// What the bridge gives from the edge on at which it changes by itself.
    #[inline]
    pub(crate) fn take(&mut self) -> f64 {
        self.settle(self.next, self.next);
        self.next = u64::MAX;
        self.given = self.wanted;
        self.given
    }

    /// What the bridge gives on an average from one edge to another, the duty being this from `from` on.
    #[inline(always)]
    pub(crate) fn mean(&mut self, (edge, next): (u64, u64), from: u64, duty: f64) -> f64 {
        if self.wanted != duty {
            self.want(edge, from, duty);
        } else if self.given == duty && self.held == duty {
            return duty;
        } else {
            self.settle(edge, edge);
        }
        let change = self.wanted - self.held;
        let [passed, ahead] = [edge, next].map(|edge| (edge as f64 - self.due).max(0.0));
        let owed = self.owed + change * passed;
        let left = (self.end().max(next) - edge) as f64;
        self.given = self.held + change * (ahead - passed) / (next - edge) as f64 + owed / left;
        self.given
    }
}

#[cfg(test)]
mod tests {
    use hpu_datapath::{Block, Pwm, PwmConfig, pwm};

    use super::*;

    const WIDTH: u32 = 6;
    const PERIOD: u64 = 1 << WIDTH;
    const PERIODS: u64 = 24;

    /// For each period, the mean over it of what a signal has added up to since edge 0, `first` up to edge 1; in edges.
    fn running_means(first: f64, signal: impl FnMut(u64) -> f64) -> Vec<f64> {
        let mut sum = first;
        let halves = (1..).map(signal).map(|level| {
            sum += level;
            sum - 0.5 * level
        });
        let halves: Vec<_> = halves.take((PERIODS * PERIOD) as usize).collect();
        halves.chunks(PERIOD as usize).map(|period| period.iter().sum::<f64>() / PERIOD as f64).collect()
    }

    /// The running means of the switched bridge, and of the averaged one, for these commands, each from its edge on.
    fn both(antiphase: bool, commands: &[(u64, i64)]) -> (Vec<f64>, Vec<f64>) {
        let command = |edge: u64| commands.iter().rev().find(|(from, _)| *from <= edge).map_or(0, |(_, word)| *word);
        let mut pwm = Pwm::new(PwmConfig { width: WIDTH, antiphase, ..PwmConfig::default() }).unwrap();
        pwm.reset();
        let switched = running_means(0.0, |edge| {
            // The modulator finds the word that stood before its edge; its gates hold until the next.
            let gates = pwm.tick(pwm::In { command: command(edge - 1) });
            (gates.a_high - gates.b_high) as f64
        });
        let mut latch = Latch::new(PERIOD, antiphase);
        let mut given = latch.given;
        let averaged = running_means(given, |edge| {
            if latch.next <= edge {
                given = latch.take();
            }
            given = latch.give(edge, command(edge) as f64 / PERIOD as f64).unwrap_or(given);
            given
        });
        (switched, averaged)
    }

    #[test]
    fn an_averaged_bridge_has_given_as_much_as_the_switched_one_on_the_mean_of_every_period_without_a_change() {
        // Early in a period, at its last edge but one, at its last, at its first; from and to duties for which the mean
        // changes at a whole edge: sign and magnitude want an even sum of words, antiphase one that 4 divides.
        let commands =
            [(3, 16), (64 * 5 - 1, 40), (64 * 8, 8), (64 * 11 + 1, 48), (64 * 14 + 30, 16), (64 * 17 + 62, 0)];
        for antiphase in [false, true] {
            let (switched, averaged) = both(antiphase, &commands);
            let mut compared = 0;
            for period in 2..PERIODS {
                // Settled: the last change is taken by a period that is over.
                let from = period * PERIOD + 1;
                let changing =
                    commands.iter().any(|(edge, _)| (from.saturating_sub(2 * PERIOD)..from + PERIOD).contains(edge));
                if !changing {
                    let (exact, mean) = (switched[period as usize], averaged[period as usize]);
                    assert!((exact - mean).abs() < 1e-9, "antiphase {antiphase}, period {period}: {exact}, {mean}");
                    compared += 1;
                }
            }
            assert!(compared >= 6, "{compared}");
        }
    }
}
