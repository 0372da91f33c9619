//! A scene, made ready and run.

use std::fmt;
use std::time::Instant;

use hpu_datapath::{AnyBlock, ConventionalLoop, HybridLoop, LoopIn, Wiring};
use hpu_signal::{Cycle, Observe, Real, Signal};

use crate::axis_world::AxisWorld;
use crate::engine::{ClosedLoop, Comparison, Control, Driver, compare};
use crate::plant::{Plant, PlantError};
use crate::scene::{Loop, LoopWords, Scene, SceneError};
use crate::summary::{NetUse, Summary};
use crate::trace::Trace;
use crate::verdict::judge;
use crate::world::World;

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
    /// Every wiring in its default configuration.
    #[must_use]
    pub fn all() -> Vec<Self> {
        vec![Self::Hybrid(HybridLoop::default()), Self::Conventional(ConventionalLoop::default())]
    }

    /// The wiring as a block.
    #[must_use]
    pub fn block(&self) -> &dyn AnyBlock {
        match self {
            Self::Hybrid(wiring) => wiring,
            Self::Conventional(wiring) => wiring,
        }
    }

    /// The wiring's name.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.block().name()
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

/// Something to do with a scene's loop, whatever its wiring and its world are.
pub trait Visit<'s> {
    /// What comes of it.
    type Out;
    /// Does it. The wiring stands as after reset, the world at edge 0; `input` holds the constant words.
    fn visit<E, W>(self, wiring: &W, world: E, input: E::In) -> Self::Out
    where
        E: World + 's,
        W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone + 'static;
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

    /// The continuous outputs of the scene's world.
    #[must_use]
    pub fn reals(&self) -> &'static [Real] {
        AxisWorld::REALS
    }

    /// An empty trace of the plant and of the nets with these names.
    #[must_use]
    pub fn trace(&self, nets: &[&str]) -> Trace {
        let all = self.wiring.nets();
        let picks = nets.iter().filter_map(|name| all.iter().position(|net| net.name == *name)).collect();
        Trace::new(self.scene.clock, self.stride(), self.reals().len(), picks)
    }

    /// Does something with the scene's loop.
    pub fn visit<'v, V: Visit<'v>>(&'v self, visit: V) -> V::Out {
        let command = self.wiring.nets().iter().position(|net| net.name == "command");
        let world = || AxisWorld::new(&self.plant, command.expect("a haptic loop has a command"));
        match &self.wiring {
            TheLoop::Hybrid(wiring) => visit.visit(wiring, world(), self.input()),
            TheLoop::Conventional(wiring) => visit.visit(wiring, world(), self.input()),
        }
    }

    /// Runs the scene to its end, or until stopped, filling the trace and showing everything to the observer.
    pub fn run<O: Observe>(&self, driver: Driver, trace: &mut Trace, observer: &mut O, control: &Control) -> Summary {
        let mut summary = self.visit(Run {
            driver,
            end: self.scene.edges(),
            stride: self.stride(),
            observer: Both(trace, observer),
            control,
        });
        summary.motion_s = self.scene.clock.seconds(Cycle(summary.edges));
        if summary.complete && self.plant.has_device() {
            summary.verdict = Some(judge(trace, self.scene.encoder.count_rad()));
        }
        summary
    }

    /// Runs `events` against `clock` over this many edges, comparing every net and state at every edge.
    #[must_use]
    pub fn compare(&self, edges: u64) -> Comparison {
        self.visit(Compare(edges))
    }
}

struct Compare(u64);

impl<'s> Visit<'s> for Compare {
    type Out = Comparison;
    fn visit<E, W>(self, wiring: &W, world: E, input: E::In) -> Comparison
    where
        E: World + 's,
        W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone + 'static,
    {
        compare(wiring.clone(), world, input, self.0)
    }
}

struct Run<'a, O> {
    driver: Driver,
    end: u64,
    stride: u64,
    observer: Both<'a, O>,
    control: &'a Control,
}

impl<'s, O: Observe> Visit<'s> for Run<'_, O> {
    type Out = Summary;
    fn visit<E, W>(mut self, wiring: &W, world: E, input: E::In) -> Summary
    where
        E: World + 's,
        W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone + 'static,
    {
        let start = Instant::now();
        let mut run = ClosedLoop::new(wiring.clone(), world, input, self.stride);
        let complete = run.run(self.driver, self.end, &mut self.observer, self.control);
        let nets = run.wiring.nets().into_iter().zip(run.wiring.uses());
        Summary {
            verdict: None,
            complete,
            edges: run.edge(),
            motion_s: 0.0,
            wall_s: start.elapsed().as_secs_f64(),
            ticks: run.ticks(),
            encoder_edges: run.world.encoder_edges(),
            output_changes: run.output_changes(),
            mode_changes: run.world.mode_changes(),
            energy: run.world.audit(),
            nets: nets.map(|(signal, usage)| NetUse { signal, usage }).collect(),
        }
    }
}
