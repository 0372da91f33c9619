//! A scene of an axis, made ready.

use hpu_datapath::{AxisWiring, LoopIn};

use crate::result::outline::Outline;
use crate::result::stays::DEEP_COUNTS;
use crate::result::time_constants::TimeConstants;
use crate::run::closed::Closed;
use crate::run::direct::{AxisDirect, Computed};
use crate::run::simulation::{Direct, LoopVisitor, Simulation, TheLoop, Wired};
use crate::run::simulation_error::SimulationError;
use crate::world::actuator::Actuator;
use crate::world::axis_world::AxisWorld;
use crate::world::plant::Plant;
use hpu_scene::method::AxisLoop;
use hpu_scene::{Device, EncoderModel, LoopWords, Scene, Setup, Solver};

/// A scene made ready: its words, its wiring, its plant.
pub struct AxisSimulation<'s> {
    scene: &'s Scene,
    plant: Plant,
    words: LoopWords,
    closed: Closed,
    outline: Outline,
}

impl<'s> AxisSimulation<'s> {
    /// Makes a scene ready.
    ///
    /// # Errors
    ///
    /// When its words, widths or parameters are impossible, or its device has no datapath.
    pub fn new(scene: &'s Scene) -> Result<Self, SimulationError> {
        let words = scene.words().map_err(SimulationError::Scene)?;
        let mut plant = Plant::new(scene).map_err(SimulationError::Plant)?;
        let closed = Closed::new(scene, &words)?;
        if let (Solver::Sample, Some(stepping)) = (scene.model.solver, &mut plant.stepping) {
            // Outputs are taken when a sample has passed through: at edge 1, after the law, after a shaper.
            let latency = match &closed {
                Closed::Words(axis_loop) => axis_loop.latency(),
                Closed::Law(_) => 0,
            };
            stepping.first = (1 + latency + 2).min(stepping.edges);
        }
        // A positive command drives the bridge, and the amplifier, against the positive direction.
        let column = if matches!(scene.device, Device::Mass(_)) { "wall_force_n" } else { "wall_torque_nm" };
        let commands = vec![("command", column, -words.command_quantum_nm(scene))];
        let (device, wiring) = ((&scene.device, scene.encoder.count_rad()), closed.wiring());
        let wall = Some((words.realised.wall_position_rad, scene.wall_push(&words)));
        let closed_by = (wiring.name(), wiring.nets());
        let outline = Outline::of_axis(scene, device, wall, closed_by, commands, plant.has_device());
        // The time constants of a device with a wall are not those of one that an integral gain moves.
        let slowest = scene.target.is_none().then(|| TimeConstants::of(scene));
        let outline = Outline { slowest, ..outline.with_hand(scene.hand_path()) };
        let outline = outline
            .with_target(scene.target.as_ref())
            .with_sensors(scene.network.as_deref().map_or(&[], |network| &network.sensors));
        Ok(Self { scene, plant, words, closed, outline })
    }

    /// Returns the scene.
    pub fn scene(&self) -> &'s Scene {
        self.scene
    }

    /// Returns the plant.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Returns the world, whose averaged bridge or amplifier follows this wiring's command.
    fn world<W: AxisWiring>(&self, _: &W) -> AxisWorld<'_> {
        AxisWorld::new(&self.plant, W::COMMAND, self.words.schedule.clone()).counted_by(self.outline.net("position"))
    }

    /// Returns the loop in words; `None` for a law in floats.
    pub fn axis_loop(&self) -> Option<&AxisLoop> {
        match &self.closed {
            Closed::Words(axis_loop) => Some(axis_loop),
            Closed::Law(_) => None,
        }
    }

    /// Returns the scene's words.
    pub fn words(&self) -> &LoopWords {
        &self.words
    }

    /// Returns the constant inputs of the wiring, with the pins at 0.
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

impl Simulation for AxisSimulation<'_> {
    fn outline(&self) -> &Outline {
        &self.outline
    }
}

impl Wired for AxisSimulation<'_> {
    fn wiring(&self) -> TheLoop<'_> {
        self.closed.wiring()
    }

    fn gates_drive(&self) -> bool {
        self.plant.actuator == Actuator::Switching
    }

    fn visit<'v, V: LoopVisitor<'v>>(&'v self, visitor: V) -> V::Out {
        match &self.closed {
            Closed::Words(axis_loop) => {
                hpu_scene::with_axis_loop!(axis_loop, wiring => visitor.visit(wiring, self.world(wiring), self.input()))
            }
            Closed::Law(wiring) => visitor.visit(wiring, self.world(wiring), self.input()),
        }
    }

    crate::run::simulation::wired_alike!();

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
            wall_rad: [0, DEEP_COUNTS].map(|deep| realised.wall_position_rad + deep as f64 * realised.count_rad),
            plant: &self.plant,
            computed,
            schedule: self.words.schedule.clone(),
            method: stepping.method,
            step: stepping.edges,
            period: self.scene.period_clocks(),
        }))
    }
}
