//! A scene of an axis, made ready.

use hpu_datapath::{AxisWiring, LoopIn};
use hpu_signal::{Clock, Observe, Real, Signal};

use crate::actuator::Actuator;
use crate::axis_world::AxisWorld;
use crate::closed::Closed;
use crate::columns::{AXIS_ROW, CURRENTS, RAIL_ROW, TORQUE_BETWEEN};
use crate::direct::{AxisDirect, Computed};
use crate::engine::{Comparison, Control, Driver};
use crate::method::AxisLoop;
use crate::plant::Plant;
use crate::rig::{self, Compare, Direct, Rig, TheLoop, Visit, Wired};
use crate::scene::{Device, EncoderModel, LoopWords, Record, Scene, Solver};
use crate::session_error::SessionError;
use crate::summary::Summary;
use crate::trace::{ANGLE, TORQUE, Trace};
use crate::verdict::{Abort, Verdict, judge};
use crate::world::World;

/// A scene made ready: its words, its wiring, its plant.
pub struct Session<'s> {
    scene: &'s Scene,
    plant: Plant,
    words: LoopWords,
    closed: Closed,
}

impl<'s> Session<'s> {
    /// Makes a scene ready.
    ///
    /// # Errors
    ///
    /// When its words, widths or parameters are impossible, or its device has no datapath.
    pub fn new(scene: &'s Scene) -> Result<Self, SessionError> {
        let words = scene.words().map_err(SessionError::Scene)?;
        let mut plant = Plant::new(scene).map_err(SessionError::Plant)?;
        let closed = Closed::new(scene, &words)?;
        if let (Solver::Sample, Some(stepping)) = (scene.model.solver, &mut plant.stepping) {
            // Outputs are taken when a sample has passed through: at edge 1, after the law, after a shaper.
            let latency = match &closed {
                Closed::Words(axis_loop) => axis_loop.latency(),
                Closed::Law(_) => 0,
            };
            stepping.first = (1 + latency + 2).min(stepping.edges);
        }
        Ok(Self { scene, plant, words, closed })
    }

    /// Returns the scene.
    #[must_use]
    pub fn scene(&self) -> &'s Scene {
        self.scene
    }

    /// Returns the plant.
    #[must_use]
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Returns the world, whose averaged bridge or amplifier follows this wiring's command.
    fn world<W: AxisWiring>(&self, _: &W) -> AxisWorld<'_> {
        AxisWorld::new(&self.plant, W::COMMAND, self.words.schedule)
    }

    /// Returns the loop in words; `None` for a law in floats.
    #[must_use]
    pub fn axis_loop(&self) -> Option<&AxisLoop> {
        match &self.closed {
            Closed::Words(axis_loop) => Some(axis_loop),
            Closed::Law(_) => None,
        }
    }

    fn is_mass(&self) -> bool {
        matches!(self.scene.device, Device::Mass(_))
    }

    /// Returns the scene's words.
    #[must_use]
    pub fn words(&self) -> &LoopWords {
        &self.words
    }

    /// Returns the constant inputs of the wiring, with the pins at 0.
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
}

impl Rig for Session<'_> {
    fn name(&self) -> &str {
        &self.scene.name
    }

    fn clock(&self) -> Clock {
        self.scene.clock
    }

    fn edges(&self) -> u64 {
        self.scene.edges()
    }

    fn record(&self) -> Record {
        self.scene.record
    }

    fn reals(&self) -> &'static [Real] {
        &self.row()[..AxisWorld::REALS.len()]
    }

    fn row(&self) -> &'static [Real] {
        if self.is_mass() { &RAIL_ROW } else { &AXIS_ROW }
    }

    fn columns(&self) -> Vec<usize> {
        let all = if self.has_device() { 0..self.row().len() } else { 0..0 };
        all.filter(|column| !(self.is_mass() && CURRENTS.contains(column))).collect()
    }

    fn commands(&self) -> Vec<(&'static str, &'static str, f64)> {
        // A positive command drives the bridge, and the amplifier, against the positive direction.
        let column = if self.is_mass() { "wall_force_n" } else { "wall_torque_nm" };
        vec![("command", column, -self.words.command_quantum_nm(self.scene))]
    }

    fn drawn(&self) -> Vec<[usize; 3]> {
        vec![TORQUE_BETWEEN]
    }

    fn has_device(&self) -> bool {
        self.plant.has_device()
    }

    fn judged(&self) -> Vec<usize> {
        vec![ANGLE, TORQUE]
    }

    fn judge(&self, trace: &Trace, aborted: Option<Abort>) -> Verdict {
        if let Some(Abort { at_s, .. }) = aborted {
            return Verdict::Diverged { at_s, amplitude_rad: f64::INFINITY };
        }
        judge(trace, self.scene.encoder.count_rad())
    }

    fn closed_by(&self) -> &str {
        self.wiring().name()
    }

    fn nets(&self) -> Vec<Signal> {
        self.wiring().nets()
    }
}

impl Wired for Session<'_> {
    fn wiring(&self) -> TheLoop<'_> {
        match &self.closed {
            Closed::Words(axis_loop) => TheLoop::Axis(axis_loop),
            Closed::Law(wiring) => TheLoop::Law(wiring),
        }
    }

    fn gates_drive(&self) -> bool {
        self.plant.actuator == Actuator::Switching
    }

    fn visit<'v, V: Visit<'v>>(&'v self, visit: V) -> V::Out {
        match &self.closed {
            Closed::Words(axis_loop) => {
                with_axis_loop!(axis_loop, wiring => visit.visit(wiring, self.world(wiring), self.input()))
            }
            Closed::Law(wiring) => visit.visit(wiring, self.world(wiring), self.input()),
        }
    }

    fn run(&self, driver: Driver, trace: &mut Trace, observer: &mut dyn Observe, control: &Control) -> Summary {
        rig::run(self, driver, trace, observer, control)
    }

    fn compare(&self, edges: u64) -> Comparison {
        self.visit(Compare(edges))
    }

    fn driver(&self) -> Driver {
        self.scene.model.solver.into()
    }

    fn direct(&self) -> Option<Box<dyn Direct + '_>> {
        let stepping = self.plant.stepping?;
        let model = self.scene.model;
        let computed = match &self.closed {
            Closed::Law(law) => {
                let ideal = (model.encoder == EncoderModel::Ideal).then_some(self.scene.wall.position_rad);
                Computed::Law(law.config(), ideal)
            }
            Closed::Words(axis_loop) if model.encoder == EncoderModel::Loaded => {
                Computed::Words(axis_loop, self.input(), self.scene.method.kind.is_live())
            }
            Closed::Words(_) => return None,
        };
        let ideal = model.encoder == EncoderModel::Ideal;
        let realised = &self.words.realised;
        Some(Box::new(AxisDirect {
            touched_rad: if ideal {
                self.scene.wall.position_rad
            } else {
                realised.wall_position_rad + realised.count_rad
            },
            plant: &self.plant,
            computed,
            schedule: self.words.schedule,
            method: stepping.method,
            step: stepping.edges,
            period: self.scene.period_clocks(),
        }))
    }
}
