//! A plant as a transfer function: its scene made ready, its world.

mod direct_form;
mod samples;
mod world;

use hpu_plant::transfer::Transfer;
use hpu_signal::Ports;

use crate::result::outline::{Outline, Rule, Waves};
use crate::result::trace::{ANGLE, TORQUE};
use crate::run::simulation::{LoopVisitor, Simulation, TheLoop, Wired};
use crate::run::simulation_error::SimulationError;
use hpu_scene::{Setup, TransferScene, TransferWords};

use direct_form::{DirectForm, TransferIn};
use world::{Plan, TransferWorld};

pub use samples::Samples;
pub use world::TRANSFER_REALS;

/// A scene of a plant as a transfer function made ready: its words, its controller, its plant.
pub struct TransferSimulation<'s> {
    plan: Plan<'s>,
    words: TransferWords,
    wiring: DirectForm,
    outline: Outline,
}

impl<'s> TransferSimulation<'s> {
    /// Makes a scene ready.
    ///
    /// # Errors
    ///
    /// When its words or its plant are impossible.
    pub fn new(scene: &'s TransferScene) -> Result<Self, SimulationError> {
        let words = scene.words().map_err(SimulationError::Scene)?;
        let plant = if scene.discrete {
            Transfer::discrete(&scene.form)
        } else {
            Transfer::continuous(&scene.form, scene.clock.period_s(), scene.adc.period)
        };
        let plant = plant.map_err(|error| SimulationError::Scene(scene.error("device", error.to_string())))?;
        let wiring = DirectForm::new(scene, &words);
        let closed_by = ("direct form I", hpu_datapath::Wiring::nets(&wiring));
        let rule = Rule::Rest(ANGLE, scene.adc.range.lsb());
        let outline = Outline::new(scene, (&TRANSFER_REALS, TRANSFER_REALS.len()), closed_by, rule);
        let outline = Outline {
            judged: vec![ANGLE, TORQUE],
            has_contact: false,
            reads_rows: true,
            waves: WAVES,
            ..outline.with_hand(scene.hand_path())
        };
        Ok(Self { plan: Plan::new(scene, plant, &words), words, wiring, outline })
    }

    /// Returns the scene.
    pub fn scene(&self) -> &'s TransferScene {
        self.plan.scene
    }

    /// Returns the loop from sample to sample, before the first.
    pub fn samples(&self) -> Samples<'_> {
        Samples::new(TransferWorld::new(&self.plan), self.wiring.clone())
    }

    /// Returns the plant.
    pub fn plant(&self) -> &Transfer {
        &self.plan.plant
    }

    /// Returns the number of the plant's states.
    pub fn order(&self) -> usize {
        self.plan.plant.order()
    }

    /// Returns the scene's words.
    pub fn words(&self) -> &TransferWords {
        &self.words
    }
}

/// The nets as waveforms show them.
const WAVES: Waves = Waves {
    groups: &[("Converters", &["reading", "command"]), ("Controller", &["reference", "error", "output"])],
    curves: &["reading", "command", "reference", "error", "output"],
};

impl Simulation for TransferSimulation<'_> {
    fn outline(&self) -> &Outline {
        &self.outline
    }
}

impl Wired for TransferSimulation<'_> {
    fn wiring(&self) -> TheLoop<'_> {
        TheLoop::Floats(&self.wiring)
    }

    fn visit<'v, V: LoopVisitor<'v>>(&'v self, visitor: V) -> V::Out {
        visitor.visit(&self.wiring, TransferWorld::new(&self.plan), TransferIn::build(|| 0))
    }

    /// How words go on for ever is told from sample to sample, without a clock.
    fn run_beyond(
        &self,
        driver: crate::Driver,
        trace: &mut crate::Trace,
        observer: &mut dyn hpu_signal::Observe,
        control: &crate::Control,
        beyond: Option<&crate::Beyond>,
    ) -> crate::Summary {
        let summary = crate::run::simulation::run(self, driver, trace, (observer, control), None);
        crate::Summary {
            forever: beyond.filter(|_| summary.complete).map(|beyond| (beyond.words)(summary.edges + beyond.edges)),
            ..summary
        }
    }

    fn closed_loop(&self) -> Box<dyn crate::AnyClosedLoop<'_> + '_> {
        self.visit(crate::run::simulation::Close)
    }

    fn compare(&self, edges: u64) -> crate::Comparison {
        self.visit(crate::run::simulation::Compare(edges))
    }

    fn driver(&self) -> crate::Driver {
        self.scene().model.solver.into()
    }
}
