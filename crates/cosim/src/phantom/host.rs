//! The host of the operating-system platforms. It samples the counters, computes the wall's force in floating point,
//! and commands the DACs after a delay. The FPGA only counts and converts.
//!
//! Samples are due every period. `PMOS-1` takes each one late by a random time up to its jitter, and some not at all
//! (both assumed: the paper gives no figures). The same law without quantisation, on the continuous angles, is the
//! `ideal` law of the fidelity ladder.

use std::collections::VecDeque;

use hpu_plant::arm::kinematics::Pose;
use hpu_signal::Format;

use hpu_scene::SplitMix64;

/// Edges from an encoder's pins to a host that reads its counter.
pub(crate) const COUNTING: u64 = 4;

/// The immutable part of a host.
pub(crate) struct Host {
    pub(crate) lengths_m: [f64; 2],
    pub(crate) count_rad: [f64; 3],
    pub(crate) command_nm: [f64; 3],
    /// The least and the greatest command, in counts of the DACs.
    pub(crate) commands: [f64; 2],
    pub(crate) position: Format,
    pub(crate) distance_m: f64,
    pub(crate) walls: [bool; 3],
    pub(crate) stiffness_n_per_m: f64,
    pub(crate) force_limit_n: f64,
    pub(crate) ideal: bool,
    pub(crate) period: u64,
    pub(crate) first: u64,
    pub(crate) delay: u64,
    pub(crate) jitter: u64,
    /// Probability of a missed sample, in 2^-32.
    pub(crate) missed: u64,
    pub(crate) seed: u64,
}

impl Host {
    /// Returns the joints' angles as the words of the counters show them.
    pub(crate) fn counted_rad(&self, positions: [i64; 3]) -> [f64; 3] {
        let counts = Format::signed(self.position.width());
        [0, 1, 2].map(|i| counts.from_bits(self.position.bits(positions[i])) as f64 * self.count_rad[i])
    }

    /// Returns the command for these angles: the law's torques in DAC counts.
    fn law(&self, angles_rad: [f64; 3]) -> [i64; 3] {
        self.words(self.torques_nm(&Pose::of(self.lengths_m, angles_rad)))
    }

    /// Returns the law's torques in a pose: the wall's force times the transposed Jacobian.
    pub(crate) fn torques_nm(&self, pose: &Pose) -> [f64; 3] {
        let tip = pose.tip_m();
        let mut force = [0.0; 3];
        for axis in 0..3 {
            let penetration = if tip[axis] > self.distance_m {
                tip[axis] - self.distance_m
            } else {
                (tip[axis] + self.distance_m).min(0.0)
            };
            if self.walls[axis] {
                force[axis] = (-self.stiffness_n_per_m * penetration).clamp(-self.force_limit_n, self.force_limit_n);
            }
        }
        if force == [0.0; 3] { force } else { pose.torques_nm(force) }
    }

    /// Returns torques in DAC counts, rounded and limited to what the DACs give.
    pub(crate) fn words(&self, torques_nm: [f64; 3]) -> [i64; 3] {
        let [least, most] = self.commands;
        [0, 1, 2].map(|i| (torques_nm[i] / self.command_nm[i]).round().clamp(least, most) as i64)
    }

    /// Returns torques limited to what the DACs give.
    pub(crate) fn within(&self, torques_nm: [f64; 3]) -> [f64; 3] {
        let [least, most] = self.commands;
        [0, 1, 2].map(|i| torques_nm[i].clamp(least * self.command_nm[i], most * self.command_nm[i]))
    }
}

/// A host at work.
#[derive(Clone)]
pub(crate) struct HostState<'p> {
    host: &'p Host,
    random: SplitMix64,
    /// The edge at which the next sample is due, and the edge at which it is taken.
    nominal: u64,
    sample: u64,
    /// Commands under way, the earliest first.
    pending: VecDeque<(u64, [i64; 3])>,
    command: [i64; 3],
}

impl<'p> HostState<'p> {
    pub(crate) fn new(host: &'p Host) -> Self {
        let mut state = Self {
            host,
            random: SplitMix64::new(host.seed),
            nominal: host.first,
            sample: host.first,
            pending: VecDeque::new(),
            command: [0; 3],
        };
        state.sample += state.late();
        state
    }

    fn late(&mut self) -> u64 {
        if self.host.jitter == 0 { 0 } else { self.random.below(self.host.jitter + 1) }
    }

    /// Returns the next edge at which the host does something.
    #[inline]
    pub(crate) fn due(&self) -> u64 {
        self.pending.front().map_or(self.sample, |(edge, _)| self.sample.min(*edge))
    }

    pub(crate) fn command(&self) -> [i64; 3] {
        self.command
    }

    pub(crate) fn host(&self) -> &'p Host {
        self.host
    }

    /// Does what is due at an edge. `counted_rad` gives the joints' angles by the counters, `angles_rad` the true ones.
    pub(crate) fn act(
        &mut self,
        edge: u64,
        counted_rad: impl FnOnce() -> [f64; 3],
        angles_rad: impl FnOnce() -> [f64; 3],
    ) {
        if self.sample <= edge {
            let taken = self.host.missed == 0 || self.random.below(1 << 32) >= self.host.missed;
            if taken {
                let read_rad = if self.host.ideal { angles_rad() } else { counted_rad() };
                // Every command takes equally long, so the order stays.
                self.pending.push_back((edge + self.host.delay, self.host.law(read_rad)));
            }
            self.nominal += self.host.period;
            self.sample = self.nominal + self.late();
        }
        while let Some((_, command)) = self.pending.pop_front_if(|(due, _)| *due <= edge) {
            self.command = command;
        }
    }
}
