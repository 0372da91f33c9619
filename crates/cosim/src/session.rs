//! A scene, made ready and run.

use std::fmt;
use std::time::Instant;

use hpu_datapath::{Block, ConventionalLoop, HybridLoop, LoopIn, Wiring};
use hpu_signal::{Cycle, Observe, Signal};

use crate::engine::{ClosedLoop, Comparison, Control, Driver, compare};
use crate::plant::{Plant, PlantError};
use crate::scene::{Loop, LoopWords, Scene, SceneError};
use crate::summary::{EnergyAudit, NetUse, Summary};
use crate::trace::Trace;
use crate::verdict::judge;

/// Why a scene cannot run.
#[derive(Debug)]
pub enum SessionError {
    /// Its words do not fit.
    Scene(SceneError),
    /// Its widths do not make a datapath.
    Config(hpu_datapath::ConfigError),
    /// Its device does not make a plant.
    Plant(PlantError),
}

impl fmt::Display for SessionError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Scene(error) => error.fmt(f),
            Self::Config(error) => error.fmt(f),
            Self::Plant(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for SessionError {}

/// The scene's wiring.
#[derive(Clone)]
#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
pub enum TheLoop {
    /// Spring combinational, damping sampled.
    Hybrid(HybridLoop),
    /// Both sampled and held.
    Conventional(ConventionalLoop),
}

impl TheLoop {
    /// The wiring's name.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Hybrid(_) => HybridLoop::NAME,
            Self::Conventional(_) => ConventionalLoop::NAME,
        }
    }

    /// The nets.
    #[must_use]
    pub fn nets(&self) -> Vec<Signal> {
        match self {
            Self::Hybrid(wiring) => wiring.nets(),
            Self::Conventional(wiring) => wiring.nets(),
        }
    }
}

/// A scene made ready: its words, its wiring, its plant.
pub struct Session<'s> {
    scene: &'s Scene,
    plant: Plant,
    words: LoopWords,
    wiring: TheLoop,
}

struct Both<'a, O>(&'a mut Trace, &'a mut O);

impl<O: Observe> Observe for Both<'_, O> {
    #[inline]
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        self.0.nets(cycle, words);
        self.1.nets(cycle, words);
    }
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.0.reals(cycle, values);
        self.1.reals(cycle, values);
    }
}

impl<'s> Session<'s> {
    /// Makes a scene ready.
    ///
    /// # Errors
    ///
    /// When its words, widths or parameters are impossible, or its device has no datapath.
    pub fn new(scene: &'s Scene) -> Result<Self, SessionError> {
        let words = scene.words().map_err(SessionError::Scene)?;
        let plant = Plant::new(scene).map_err(SessionError::Plant)?;
        let wiring = match scene.method.kind {
            Loop::Hybrid => HybridLoop::new(words.config).map(TheLoop::Hybrid),
            Loop::Conventional => ConventionalLoop::new(words.config).map(TheLoop::Conventional),
        }
        .map_err(SessionError::Config)?;
        Ok(Self { scene, plant, words, wiring })
    }

    /// The scene.
    #[must_use]
    pub fn scene(&self) -> &'s Scene {
        self.scene
    }

    /// The plant.
    #[must_use]
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// The scene's words.
    #[must_use]
    pub fn words(&self) -> &LoopWords {
        &self.words
    }

    /// The wiring, as it stands before reset.
    #[must_use]
    pub fn wiring(&self) -> &TheLoop {
        &self.wiring
    }

    /// The constant inputs of the wiring, pins at 0.
    #[must_use]
    pub fn input(&self) -> LoopIn<i64> {
        LoopIn {
            a_pin: 0,
            b_pin: 0,
            reference: self.words.reference,
            stiffness: self.words.stiffness,
            damping: self.words.damping,
            period: self.words.period,
            scale: self.words.scale,
        }
    }

    /// Edges between rows of the trace.
    #[must_use]
    pub fn stride(&self) -> u64 {
        self.scene.clock.edges(1.0 / self.scene.record.plant_rate_hz).max(1)
    }

    /// An empty trace of the plant and of the nets with these names.
    #[must_use]
    pub fn trace(&self, nets: &[&str]) -> Trace {
        let all = self.wiring.nets();
        let picks = nets.iter().filter_map(|name| all.iter().position(|net| net.name == *name)).collect();
        Trace::new(self.scene.clock, self.stride(), picks)
    }

    /// Runs the scene to its end, or until stopped, filling the trace and showing everything to the observer.
    pub fn run<O: Observe>(&self, driver: Driver, trace: &mut Trace, observer: &mut O, control: &Control) -> Summary {
        match &self.wiring {
            TheLoop::Hybrid(wiring) => self.run_loop(wiring.clone(), driver, trace, observer, control),
            TheLoop::Conventional(wiring) => self.run_loop(wiring.clone(), driver, trace, observer, control),
        }
    }

    fn run_loop<W: Wiring, O: Observe>(
        &self,
        wiring: W,
        driver: Driver,
        trace: &mut Trace,
        observer: &mut O,
        control: &Control,
    ) -> Summary {
        let start = Instant::now();
        let end = self.scene.edges();
        let mut run = ClosedLoop::new(wiring, &self.plant, self.input(), self.stride());
        let complete = run.run(driver, end, &mut Both(trace, observer), control);
        let wall_s = start.elapsed().as_secs_f64();
        let device = run.world.device();
        let (energy, stored_j) = run.world.energy();
        let nets = run.wiring.nets().into_iter().zip(run.wiring.uses());
        Summary {
            verdict: device.filter(|_| complete).map(|_| judge(trace, self.scene.encoder.count_rad())),
            complete,
            edges: run.edge(),
            motion_s: self.scene.clock.seconds(Cycle(run.edge())),
            wall_s,
            ticks: run.ticks(),
            encoder_edges: run.world.encoder_edges(),
            gate_changes: run.gate_changes(),
            mode_changes: device.map_or(0, |device| device.mode_changes()),
            energy: EnergyAudit {
                source_j: energy.source_j(),
                hand_j: energy.hand_j(),
                supplied_j: energy.supplied_j(),
                stored_j,
                copper_j: energy.copper_j(),
                diodes_j: energy.diodes_j(),
                viscous_j: energy.viscous_j(),
                coulomb_j: energy.coulomb_j(),
                dissipated_j: energy.dissipated_j(),
                exchanged_j: energy.exchanged_j(),
                residual_j: energy.supplied_j() - stored_j - energy.dissipated_j(),
            },
            nets: nets.map(|(signal, usage)| NetUse { signal, usage }).collect(),
        }
    }

    /// Runs `events` against `clock` over this many edges, comparing every net and state at every edge.
    #[must_use]
    pub fn compare(&self, edges: u64) -> Comparison {
        match &self.wiring {
            TheLoop::Hybrid(wiring) => compare(wiring.clone(), &self.plant, self.input(), edges),
            TheLoop::Conventional(wiring) => compare(wiring.clone(), &self.plant, self.input(), edges),
        }
    }
}
