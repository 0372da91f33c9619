//! The actuator between the datapath and the device: a bridge, or an amplifier with or without an analog shaper.
//!
//! An averaged bridge is a `Latch`. Pulses and their mean have the same area and first moment if the mean changes at
//! one certain moment near the start of the period that takes a duty. When a command comes too late for that moment,
//! the bridge adds the missing part up to the middle of the period.

use hpu_datapath::{Block, LoopOut, Pwm, PwmConfig, pwm};
use hpu_plant::Shaper;
use hpu_scene::Dac;

/// The actuator that drives the device of a scene.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Actuator {
    /// The bridge with every switching of its gates.
    Switching,
    /// The bridge with every switching of the gates of a modulator behind a host.
    Modulated(PwmConfig),
    /// A bridge with three legs. A command has a bit for each switch, the high and the low one of legs a, b and c from
    /// the lowest bit on, then one for each of [`MOST_SENSORS`](hpu_scene::MOST_SENSORS) sensors, at whose rise that
    /// sensor takes a sample, then the lines `csn`, `sck` and `mosi` of each chip on a bus.
    ThreeLegs,
    /// The mean voltages of a bridge with three legs, in each period of a modulator. A command has the duties of legs
    /// a, b and c, 16 bits each from the lowest bit on, all ones while the switches are open; then a bit for each
    /// sensor as [`ThreeLegs`](Self::ThreeLegs) has it.
    AveragedLegs {
        /// The greatest duty.
        steps: u32,
        /// The least duty that is not dropped, and the least distance to the greatest one.
        min_pulse: u32,
    },
    /// The bridge's mean voltage.
    Averaged {
        /// PWM counts of full scale.
        full_scale: f64,
        /// The modulator's latch, which decides when the mean changes; `None`: the mean changes at once.
        latch: Option<Latch>,
    },
    /// The bridge's mean voltage in each period of a modulator that takes a command at its beginning.
    Preloaded {
        /// Steps of a period.
        steps: u32,
        /// Steps for which the voltage is positive at a command of 0.
        centre: u32,
        /// Clocks of a period.
        period: u64,
    },
    /// A force amplifier that follows the command.
    Amplified {
        /// Force of one count, in N.
        quantum_n: f64,
        /// The shaper between the command and the amplifier, if there is one.
        shaping: Option<Shaping>,
    },
    /// A drive whose current follows the command after a converter.
    Converted {
        /// The converter.
        dac: Dac,
        /// Bits of a full command.
        width: u32,
        /// 1 if a positive word asks for a positive current, -1 if for a negative one.
        sign: f64,
    },
}

/// An analog shaper at work. The device gets its output anew when the shaper's input changes, and every `hold` edges
/// after that.
///
/// In between, the output of the shaper moves on by no more than [`Shaper::slope_bound_per_s`] of full scale. The hold
/// causes no other error of the force. A shaper whose input is 0 or pulls has nothing to push with: it rests at 0, and
/// `next` then never comes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Shaping {
    shaper: Shaper,
    edge_s: f64,
    hold: u64,
    /// The edge at which the input last changed.
    anchor: u64,
    /// The edge at which the device gets the output next.
    pub(crate) next: u64,
}

impl Shaping {
    /// Creates a shaper at rest at edge 0.
    pub(crate) fn new(cutoff_hz: f64, edge_s: f64, hold: u64) -> Self {
        Self { shaper: Shaper::new(cutoff_hz), edge_s, hold, anchor: 0, next: u64::MAX }
    }

    fn at(&self, edge: u64) -> Shaper {
        self.shaper.after((edge - self.anchor) as f64 * self.edge_s)
    }

    /// Sets the input from `edge` on. Returns the output at `edge` if the input differs from the one before, else
    /// `None`.
    pub(crate) fn take(&mut self, edge: u64, input: f64) -> Option<f64> {
        if self.shaper.input() == input {
            return None;
        }
        self.shaper = self.at(edge).stepped(input);
        self.anchor = edge;
        self.next = if input > 0.0 { edge + self.hold } else { u64::MAX };
        Some(self.shaper.output())
    }

    /// Returns the output at an edge at which it is due, and plans the next one.
    pub(crate) fn hand_on(&mut self, edge: u64) -> f64 {
        self.next = edge + self.hold;
        self.at(edge).output()
    }
}

/// A modulator behind a host. It reads the commands that the host hands on, and drives the gates of the bridge.
#[derive(Clone)]
pub(crate) struct Modulator {
    pwm: Pwm,
    /// The command that it reads at the next edge.
    input: pwm::In<i64>,
    /// The latest edge that it has ticked, and its gates from there on.
    edge: u64,
    pub(crate) gates: LoopOut<i64>,
    /// The edge at which the gates may change next if no command comes.
    pub(crate) next: u64,
}

impl Modulator {
    /// Creates a modulator at reset; `None` if its generics are impossible.
    pub(crate) fn new(config: PwmConfig) -> Option<Self> {
        let mut pwm = Pwm::new(config).ok()?;
        let gates = pins(pwm.reset());
        let mut modulator = Self { pwm, input: pwm::In { command: 0 }, edge: 0, gates, next: 0 };
        modulator.tick(0);
        Some(modulator)
    }

    /// Ticks the edges up to one at which the gates may change, or before which they do not.
    pub(crate) fn tick(&mut self, edge: u64) {
        if edge > self.edge {
            self.pwm.skip(edge - 1 - self.edge, &self.input);
            self.gates = pins(self.pwm.tick(self.input));
            self.edge = edge;
        }
        self.next = edge.saturating_add(self.pwm.quiet(&self.input)).saturating_add(1);
    }

    /// Takes a command after an edge: it is read at the next one.
    pub(crate) fn take(&mut self, edge: u64, command: i64) {
        self.tick(edge);
        self.input.command = command;
        self.tick(edge);
    }
}

/// Returns a modulator's outputs as those of a loop.
fn pins(pwm::Out { a_high, a_low, b_high, b_low }: pwm::Out<i64>) -> LoopOut<i64> {
    LoopOut { a_high, a_low, b_high, b_low }
}

/// The output of an averaged bridge, and the edges at which it changes.
///
/// A modulator takes its duty at the start of a period; another duty moves only the end of the pulse. The mean of a
/// pulse has the pulse's area, but its middle is the middle of the period, and the middle of the pulse comes sooner.
/// Pulse and mean agree in area and in first moment if the mean changes at the right moment: between duties `d` and
/// `d'` of one sign, that is `(1 - d - d') / 2` periods before the start of the period that takes `d'`. If the command
/// comes after that moment, the bridge still owes an area. It gives this area in addition, up to the middle of that
/// period.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Latch {
    period: u64,
    antiphase: bool,
    /// The duty that the modulator has taken.
    held: f64,
    /// The duty that the modulator is given, and the edge at which it takes it.
    wanted: f64,
    begin: u64,
    /// The edge at which the mean changes from `held` to `wanted`, as a real number.
    due: f64,
    /// The duty that the bridge gives since the edge `since`, and the area that it owed at that edge, in edges of full
    /// duty. The area is reckoned for a modulator that goes on with the duty it has taken.
    pub(crate) given: f64,
    since: u64,
    owed: f64,
    /// The edge at which the given duty changes without a new command.
    pub(crate) next: u64,
}

impl Latch {
    /// Creates a latch at edge 0, where the modulator starts with duty 0. In antiphase, duty 0 has a first moment too.
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

    /// Returns by how much the first moment of a period at a duty is less than that of its mean, in squares of the
    /// period.
    #[inline]
    fn moment(&self, duty: f64) -> f64 {
        if self.antiphase { 0.25 * (1.0 - duty * duty) } else { 0.5 * duty * (1.0 - duty.abs()) }
    }

    /// Accounts for the time up to an edge, given that no other command comes before `from`.
    #[inline]
    fn settle(&mut self, edge: u64, from: u64) {
        self.owed += (self.held - self.given) * (edge - self.since) as f64;
        self.since = edge;
        if self.wanted != self.held && from >= self.begin {
            self.owed += (self.wanted - self.held) * (edge as f64 - self.due);
            self.held = self.wanted;
        }
    }

    /// Takes another duty, which stands from `from` on and is known at `edge`.
    #[inline]
    pub(crate) fn want(&mut self, edge: u64, from: u64, duty: f64) {
        self.settle(edge, from);
        self.wanted = duty;
        // Periods begin at the edges after those that `period` divides; the modulator sees a word at the edge after its
        // own.
        self.begin = from.div_ceil(self.period) * self.period + 1;
        let change = duty - self.held;
        let lead = if change == 0.0 { 0.0 } else { (self.moment(duty) - self.moment(self.held)) / change };
        self.due = self.begin as f64 - lead * self.period as f64;
    }

    /// Returns the edge up to which the area owed by a late command is given.
    #[inline]
    fn end(&self) -> u64 {
        self.begin + self.period / 2
    }

    /// Sets the duty from `edge` on. Returns what the bridge gives from there, if that changes now.
    #[inline]
    pub(crate) fn give(&mut self, edge: u64, duty: f64) -> Option<f64> {
        if self.wanted == duty {
            return None;
        }
        self.want(edge, edge, duty);
        let (change, end) = (duty - self.held, self.end());
        if self.given == self.held && change != 0.0 {
            // One change is enough, at the moment that also settles the owed area. That moment is often half an edge,
            // so 0.25 is added: noise must not decide which way it is rounded.
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

    /// Returns the duty that the bridge gives from the edge `next` on, at which it changes without a new command.
    #[inline]
    pub(crate) fn take(&mut self) -> f64 {
        self.settle(self.next, self.next);
        self.next = u64::MAX;
        self.given = self.wanted;
        self.given
    }

    /// Returns the mean duty that the bridge gives between two edges, where the commanded duty is `duty` from `from`
    /// on.
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
    use super::*;

    const WIDTH: u32 = 6;
    const PERIOD: u64 = 1 << WIDTH;
    const PERIODS: u64 = 24;

    /// Returns, for each period, the mean of the running integral of a signal since edge 0, in edges; the signal is
    /// `first` up to edge 1.
    fn running_means(first: f64, signal: impl FnMut(u64) -> f64) -> Vec<f64> {
        let mut sum = first;
        let halves = (1..).map(signal).map(|level| {
            sum += level;
            sum - 0.5 * level
        });
        let halves: Vec<_> = halves.take((PERIODS * PERIOD) as usize).collect();
        halves.chunks(PERIOD as usize).map(|period| period.iter().sum::<f64>() / PERIOD as f64).collect()
    }

    /// Returns the running means of the switched bridge and of the averaged one for these commands, each from its edge
    /// on.
    fn both(antiphase: bool, commands: &[(u64, i64)]) -> (Vec<f64>, Vec<f64>) {
        let command = |edge: u64| commands.iter().rev().find(|(from, _)| *from <= edge).map_or(0, |(_, word)| *word);
        let mut pwm = Pwm::new(PwmConfig { width: WIDTH, antiphase, ..PwmConfig::default() }).unwrap();
        pwm.reset();
        let switched = running_means(0.0, |edge| {
            // The modulator reads the word that stood before its edge; its gates hold until the next edge.
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

    /// The modulator told commands at some edges only, and asked at those at which its gates may change, against one
    /// that is ticked at every edge.
    #[test]
    fn a_modulator_behind_a_host_has_the_gates_of_one_that_reads_every_command() {
        let mut random = hpu_scene::SplitMix64::new(62);
        for mode in 0..16 {
            let [antiphase, latched, floating, dead] = [1, 2, 4, 8].map(|bit| mode & bit != 0);
            if antiphase && floating {
                continue;
            }
            let dead_time = if dead { 3 } else { 0 };
            let config = PwmConfig { width: WIDTH, antiphase, latched, floating, dead_time };
            let (mut ticked, mut asked) = (Pwm::new(config).unwrap(), Modulator::new(config).unwrap());
            assert_eq!(asked.gates, pins(ticked.reset()));
            let (mut command, mut changes) = (0, 0);
            for edge in 1..20_000 {
                let gates = pins(ticked.tick(pwm::In { command }));
                if asked.next == edge {
                    asked.tick(edge);
                }
                changes += u32::from(asked.edge == edge);
                assert_eq!(asked.gates, gates, "{config:?} at edge {edge}");
                if random.below(150) == 0 {
                    command = random.below(2 * PERIOD + 1) as i64 - PERIOD as i64;
                    asked.take(edge, command);
                }
            }
            assert!((200..8000).contains(&changes), "{config:?}: asked at {changes} edges");
        }
    }

    #[test]
    fn an_averaged_bridge_has_given_as_much_as_the_switched_one_on_the_mean_of_every_period_without_a_change() {
        // Commands early in a period, at its last edge but one, at its last and at its first edge. The duties are such
        // that the mean changes at a whole edge: for sign and magnitude the sum of two words must be even, in antiphase
        // divisible by 4.
        let commands =
            [(3, 16), (64 * 5 - 1, 40), (64 * 8, 8), (64 * 11 + 1, 48), (64 * 14 + 30, 16), (64 * 17 + 62, 0)];
        for antiphase in [false, true] {
            let (switched, averaged) = both(antiphase, &commands);
            let mut compared = 0;
            for period in 2..PERIODS {
                // Settled: the period that takes the last change is over.
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
