//! Controllers that close a loop around an axis in steps, without a clock: a law in floats, or a loop in words whose
//! counter is loaded with counts.

use hpu_datapath::{Loaded, LoopIn};

use crate::run::law_loop::{COMMAND, LawConfig, NETS, PENETRATION, POSITION};
use crate::world::encoder::Pins;
use hpu_scene::Schedule;
use hpu_scene::method::{AnyLaw, SampledLaw};

/// A position, as counts and as the true angle; a controller reads one of the two.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reading {
    /// Counts from the start.
    pub(crate) count: i64,
    /// The true angle.
    pub(crate) angle_rad: f64,
}

/// The force that a controller asks for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Asked {
    /// The force against the penetration, in N, and the duty of a bridge that gives it.
    pub(crate) force_n: f64,
    pub(crate) duty: f64,
    /// The edge from which force and duty are asked for; before it, the previous ones are.
    pub(crate) from: u64,
}

/// A `Controller` closes a loop around an axis in steps. The law in floats and the loop in words implement it, so that
/// [`AxisDirect`](crate::run::direct::AxisDirect) runs both alike.
pub(crate) trait Controller {
    /// Clock edges by which the position read is older than the edge at which it is read.
    const LATE: u64;

    /// Returns whether the controller reads counts, not the true position.
    fn counts(&self) -> bool;
    /// Returns whether a spring also reads the position at every step, between the samples.
    fn is_live(&self) -> bool;
    /// Reads a position at a sample's edge.
    fn sample(&mut self, edge: u64, at: Reading);
    /// Lets a live spring read a position at an edge within a step.
    fn follow(&mut self, edge: u64, at: Reading);
    /// Returns the force asked for in the step from `edge` to `next`.
    fn asked(&mut self, edge: u64, next: u64) -> Asked;
    /// Returns the number of nets.
    fn nets(&self) -> usize;
    /// Returns the word of a net at a row, or `None` if it depends on the position there.
    fn word(&self, net: usize) -> Option<i64>;
    /// Returns the word of a net that depends on the position, with the device at this count.
    fn word_at(&self, net: usize, count: i64) -> i64;
}

/// A law in floats.
pub(crate) struct FloatsLaw<'d> {
    config: &'d LawConfig,
    schedule: Schedule,
    /// The wall's position, if the law reads the true position.
    ideal_wall_rad: Option<f64>,
    law: AnyLaw,
    force_n: f64,
}

impl<'d> FloatsLaw<'d> {
    pub(crate) fn new(config: &'d LawConfig, schedule: Schedule, ideal_wall_rad: Option<f64>) -> Self {
        Self { config, schedule, ideal_wall_rad, law: config.law.clone(), force_n: 0.0 }
    }

    /// Returns the position beyond the wall's surface, in m.
    #[inline(always)]
    fn position_m(&self, at: Reading) -> f64 {
        match self.ideal_wall_rad {
            Some(wall_rad) => at.angle_rad - wall_rad,
            None => (at.count - self.config.surface) as f64 * self.config.count_m,
        }
    }

    /// Sets stiffness, scale and target to their values at an edge.
    #[inline(always)]
    fn vary(&mut self, edge: u64) {
        if self.schedule != Schedule::default() {
            let ramps = [(self.schedule.stiffness, 0), (self.schedule.scale, 1)];
            let shares = ramps.map(|(ramp, index)| {
                let start = self.config.start[index];
                ramp.filter(|_| start != 0).map_or(1.0, |ramp| ramp.word(edge) as f64 / start as f64)
            });
            self.config.vary(&mut self.law, shares);
        }
        if let Some(target) = &self.schedule.target {
            self.law.aim(match self.ideal_wall_rad {
                Some(wall_rad) => target.position(edge) - wall_rad,
                None => (target.word(edge) - self.config.surface) as f64 * self.config.count_m,
            });
        }
    }
}

impl Controller for FloatsLaw<'_> {
    const LATE: u64 = 0;

    #[inline(always)]
    fn counts(&self) -> bool {
        self.ideal_wall_rad.is_none()
    }

    fn is_live(&self) -> bool {
        self.config.live
    }

    #[inline(always)]
    fn sample(&mut self, edge: u64, at: Reading) {
        self.vary(edge);
        self.force_n = self.law.sample(self.position_m(at));
    }

    #[inline(always)]
    fn follow(&mut self, edge: u64, at: Reading) {
        self.vary(edge);
        let x_m = self.position_m(at);
        self.force_n = self.law.live_n(x_m).unwrap_or(self.force_n);
    }

    #[inline(always)]
    fn asked(&mut self, edge: u64, _: u64) -> Asked {
        let limit_n = self.config.limit_n;
        let force_n = self.force_n.clamp(-limit_n, limit_n);
        Asked { force_n, duty: force_n / self.config.full_scale_n, from: edge }
    }

    fn nets(&self) -> usize {
        NETS
    }

    fn word(&self, net: usize) -> Option<i64> {
        match net {
            0 | 1 | POSITION | PENETRATION => None,
            COMMAND => Some(self.config.command(self.force_n)),
            _ => Some(0),
        }
    }

    fn word_at(&self, net: usize, count: i64) -> i64 {
        let pins = Pins::at(count);
        match net {
            0 => pins.a,
            1 => pins.b,
            POSITION => count,
            _ => (count - self.config.surface).max(0),
        }
    }
}

/// A loop in words. Its counter is loaded at samples, and for a live spring also at every step.
pub(crate) struct LoadedLoop<W> {
    wiring: W,
    input: LoopIn<i64>,
    schedule: Schedule,
    live: bool,
    /// Force in N, and duty, of one count of the command.
    quantum_n: f64,
    duty: f64,
    /// The next edge of the wiring.
    edge: u64,
}

impl<W: Loaded> LoadedLoop<W> {
    /// Creates a loop after reset, its modulator at rest.
    pub(crate) fn new(
        mut wiring: W,
        input: LoopIn<i64>,
        schedule: Schedule,
        live: bool,
        (quantum_n, duty): (f64, f64),
    ) -> Self {
        wiring.reset();
        wiring.rest_modulator();
        wiring.settle(&input);
        Self { wiring, input, schedule, live, quantum_n, duty, edge: 1 }
    }

    fn vary(&mut self, edge: u64) {
        let ramps =
            [(self.schedule.stiffness, &mut self.input.stiffness), (self.schedule.scale, &mut self.input.scale)];
        for (ramp, word) in ramps {
            if let Some(ramp) = ramp {
                *word = ramp.word(edge);
            }
        }
        if let Some(target) = &self.schedule.target {
            self.input.reference = target.word(edge);
        }
    }

    #[inline]
    fn load(&mut self, at: Reading) {
        self.wiring.load(at.count, &self.input);
    }
}

impl<W: Loaded> Controller for LoadedLoop<W> {
    /// Edges that synchroniser, decoder and counter take.
    const LATE: u64 = 4;

    #[inline(always)]
    fn counts(&self) -> bool {
        true
    }

    fn is_live(&self) -> bool {
        self.live
    }

    #[inline]
    fn sample(&mut self, edge: u64, at: Reading) {
        debug_assert_eq!(self.edge, edge, "the wiring has been brought here");
        self.vary(edge);
        self.load(at);
        self.wiring.tick(self.input);
        self.edge += 1;
    }

    #[inline]
    fn follow(&mut self, edge: u64, at: Reading) {
        self.vary(edge);
        self.load(at);
    }

    #[inline]
    fn asked(&mut self, edge: u64, next: u64) -> Asked {
        if !self.live && self.schedule != Schedule::default() {
            self.vary(edge);
        }
        let mut command = self.wiring.words()[W::COMMAND];
        let mut from = edge;
        while self.edge < next {
            let quiet = self.wiring.quiet(&self.input).min(next - self.edge);
            if quiet > 0 {
                self.wiring.skip(quiet, &self.input);
                self.edge += quiet;
                continue;
            }
            self.wiring.tick(self.input);
            let now = self.wiring.words()[W::COMMAND];
            if now != command {
                (command, from) = (now, self.edge);
            }
            self.edge += 1;
        }
        Asked { force_n: command as f64 * self.quantum_n, duty: command as f64 * self.duty, from }
    }

    fn nets(&self) -> usize {
        self.wiring.words().len()
    }

    fn word(&self, net: usize) -> Option<i64> {
        Some(self.wiring.words()[net])
    }

    fn word_at(&self, net: usize, _: i64) -> i64 {
        self.wiring.words()[net]
    }
}
