//! A scene of the loop of EPFL's haptic paddle, made ready.

mod firmware;

use hpu_datapath::AnyWiring;
use hpu_datapath::paddle::{EpflPaddleLoop, PaddleIn, TimerPwm, TimerPwmConfig};
use hpu_signal::{Ports, Signal};

use crate::result::outline::Outline;
use crate::result::stays::Places;
use crate::run::simulation::{LoopVisitor, Simulation, TheLoop, Wired};
use crate::run::simulation_error::SimulationError;
use crate::world::actuator::Actuator;
use crate::world::axis_world::AxisWorld;
use crate::world::faults::FaultPlan;
use crate::world::plant::{Around, Plant};
use hpu_scene::{BridgeModel, PaddleScene, PaddleWords, Setup, Winding};

use firmware::Firmware;

/// The loop of a scene.
#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
enum Closed {
    /// In words.
    Words(EpflPaddleLoop),
    /// In the firmware's floats.
    Floats(Firmware),
}

impl Closed {
    fn wiring(&self) -> &dyn AnyWiring {
        match self {
            Self::Words(wiring) => wiring,
            Self::Floats(wiring) => wiring,
        }
    }
}

/// A scene of the paddle's loop made ready: its words, its wiring, its plant.
pub struct PaddleSimulation<'s> {
    scene: &'s PaddleScene,
    plant: Plant,
    words: PaddleWords,
    closed: Closed,
    outline: Outline,
}

impl<'s> PaddleSimulation<'s> {
    /// Makes a scene ready.
    ///
    /// # Errors
    ///
    /// When its words, widths or parameters are impossible.
    pub fn new(scene: &'s PaddleScene) -> Result<Self, SimulationError> {
        let words = scene.words().map_err(SimulationError::Scene)?;
        let wiring = EpflPaddleLoop::new(words.config).map_err(SimulationError::Config)?;
        let plant = plant(scene, words.config.pwm)?;
        let device = (&scene.device, scene.encoder.count_rad());
        let closed = if scene.model.in_floats {
            let modulator = TimerPwm::new(words.config.pwm).map_err(SimulationError::Config)?;
            Closed::Floats(Firmware::new(words.floats, &wiring, modulator))
        } else {
            Closed::Words(wiring)
        };
        let wiring = closed.wiring();
        // The filtered angle is in counts where the controller reads the encoder, else in codes of a sensor.
        let is_count = |net: &Signal| net.name == "filtered" && scene.method.position.is_none();
        let shown = |net: Signal| if is_count(&net) { Signal { unit: "count", ..net } } else { net };
        let closed_by = (wiring.name(), wiring.nets().into_iter().map(shown).collect());
        let outline = Outline::of_axis(scene, device, None, closed_by, Vec::new(), true);
        let outline = outline.with_hand(scene.hand_path()).with_sensors(&scene.network.sensors);
        let outline = Outline { has_contact: false, ..outline };
        Ok(Self { scene, plant, words, closed, outline })
    }

    /// Returns the scene.
    pub fn scene(&self) -> &'s PaddleScene {
        self.scene
    }

    /// Returns the scene's words.
    pub fn words(&self) -> &PaddleWords {
        &self.words
    }

    /// Returns the constant inputs of the wiring; all that the world drives is 0.
    pub fn input(&self) -> PaddleIn<i64> {
        let PaddleWords { reference, zero, shares, gains, current_gains, periods, .. } = self.words;
        PaddleIn {
            reference,
            zero,
            analog: self.scene.method.position.is_some().into(),
            share: shares[0],
            proportional: gains[0],
            integral: gains[1],
            derivative: gains[2],
            current_share: shares[1],
            current_proportional: current_gains[0],
            current_integral: current_gains[1],
            forward: current_gains[2],
            adc_period: periods[0],
            current_period: periods[1],
            haptic_period: periods[2],
            ..PaddleIn::build(|| 0)
        }
    }
}

fn plant(scene: &PaddleScene, pwm: TimerPwmConfig) -> Result<Plant, SimulationError> {
    let around = Around {
        device: &scene.device,
        network: Some(&scene.network),
        pmsm: None,
        bridge: scene.bridge,
        hand: &scene.hand,
        friction: scene.model.friction,
        winding: Winding::Inductive,
        clock: scene.clock,
        count_rad: scene.encoder.count_rad(),
        actuator: match scene.model.bridge {
            BridgeModel::Switching => Actuator::Switching,
            BridgeModel::Averaged => {
                let TimerPwmConfig { prescale, steps, centre, .. } = pwm;
                Actuator::Preloaded { steps, centre, period: u64::from(prescale) * u64::from(steps) }
            }
        },
        modulator: None,
        stepping: None,
        faults: scene.faults.as_ref().map(|all| FaultPlan::new(all, scene.clock, scene.run, scene.edges())),
        places: Places { wall: i64::MAX, reach: Some(scene.reach()) },
        horizon: scene.edges(),
        late: 0,
        seed: scene.run.seed,
    };
    Plant::around(around).map_err(SimulationError::Plant)
}

impl Simulation for PaddleSimulation<'_> {
    fn outline(&self) -> &Outline {
        &self.outline
    }
}

impl Wired for PaddleSimulation<'_> {
    fn wiring(&self) -> TheLoop<'_> {
        match &self.closed {
            Closed::Words(wiring) => TheLoop::Device(wiring),
            Closed::Floats(wiring) => TheLoop::Floats(wiring),
        }
    }

    fn gates_drive(&self) -> bool {
        self.plant.actuator == Actuator::Switching
    }

    fn visit<'v, V: LoopVisitor<'v>>(&'v self, visitor: V) -> V::Out {
        let method = &self.scene.method;
        let command = self.outline.nets.len() - 1;
        let read = [Some(method.current), method.position];
        let begins = (self.scene.clock.edges(method.target_from_s), self.words.gains);
        let world = AxisWorld::of_paddle(&self.plant, command, self.words.schedule.clone(), read, begins);
        let world = world.counted_by(self.outline.net("position"));
        match &self.closed {
            Closed::Words(wiring) => visitor.visit(wiring, world, self.input()),
            Closed::Floats(wiring) => visitor.visit(wiring, world, self.input()),
        }
    }

    crate::run::simulation::wired_alike!();
}
