//! A scene of a motor with three phases behind field-oriented control, made ready.

mod floats;

use hpu_datapath::AnyWiring;
use hpu_datapath::foc::{FocKnobLoop, KnobIn, ThreePhasePwm, ThreePhasePwmConfig};
use hpu_signal::Ports;

use crate::result::columns::CURRENTS;
use crate::result::outline::{Outline, Waves};
use crate::result::stays::Places;
use crate::run::simulation::{LoopVisitor, Simulation, TheLoop, Wired};
use crate::run::simulation_error::SimulationError;
use crate::world::actuator::Actuator;
use crate::world::axis_world::AxisWorld;
use crate::world::faults::FaultPlan;
use crate::world::plant::{Around, Plant};
use hpu_scene::{BridgeModel, FocScene, FocWords, Mass, Push, Sensor, Setup, Winding};

use floats::FloatLogic;

/// The loop of a scene.
#[allow(clippy::large_enum_variant, reason = "one of them exists a run")]
enum Closed {
    /// In words.
    Words(FocKnobLoop),
    /// In floats.
    Floats(FloatLogic),
}

impl Closed {
    fn wiring(&self) -> &dyn AnyWiring {
        match self {
            Self::Words(wiring) => wiring,
            Self::Floats(wiring) => wiring,
        }
    }
}

/// A scene behind field-oriented control made ready: its words, its wiring, its plant.
pub struct FocSimulation<'s> {
    scene: &'s FocScene,
    plant: Plant,
    words: FocWords,
    closed: Closed,
    outline: Outline,
}

impl<'s> FocSimulation<'s> {
    /// Makes a scene ready.
    ///
    /// # Errors
    ///
    /// When its words, widths or parameters are impossible.
    pub fn new(scene: &'s FocScene) -> Result<Self, SimulationError> {
        let words = scene.words().map_err(SimulationError::Scene)?;
        let wiring = FocKnobLoop::new(words.config).map_err(SimulationError::Config)?;
        let plant = plant(scene, &words)?;
        let wall = scene.wall.is_some().then(|| (scene.wall_count() as f64 * words.count_rad, push(scene, &words)));
        let (has_wall, device) = (wall.is_some(), (&scene.device, scene.encoder.count_rad()));
        let commands = vec![("target", "wall_torque_nm", words.unit[1])];
        let closed = if scene.model.in_floats {
            Closed::Floats(FloatLogic::new(words.floats, &wiring, modulator(&words)?))
        } else {
            Closed::Words(wiring)
        };
        let closed_by = (closed.wiring().name(), closed.wiring().nets());
        let outline = Outline::of_axis(scene, device, wall, closed_by, commands, true);
        let outline = outline.with_hand(scene.hand_path()).with_sensors(&sensors(scene));
        let waves = Waves { groups: &[], curves: &CURVES };
        let contact = outline.contact.filter(|_| has_wall);
        let columns = outline.columns.iter().filter(|column| !(scene.model.ideal && CURRENTS.contains(column)));
        let columns = columns.copied().collect();
        let outline = Outline { has_contact: has_wall, contact, waves, columns, ..outline };
        Ok(Self { scene, plant, words, closed, outline })
    }

    /// Returns the scene.
    pub fn scene(&self) -> &'s FocScene {
        self.scene
    }

    /// Returns the scene's words.
    pub fn words(&self) -> &FocWords {
        &self.words
    }

    /// Returns the constant inputs of the wiring; all that the world drives is 0.
    pub fn input(&self) -> KnobIn<i64> {
        let FocWords { reference, gains, period, zero, current_gains, .. } = self.words;
        KnobIn {
            coded: self.scene.method.position.is_some().into(),
            reference,
            stiffness: gains[0],
            damping: gains[1],
            period,
            zero,
            proportional: current_gains[0],
            integral: current_gains[1],
            ..KnobIn::build(|| 0)
        }
    }
}

/// Returns the modulator of the words.
fn modulator(words: &FocWords) -> Result<ThreePhasePwm, SimulationError> {
    let foc = words.config.foc;
    let config = ThreePhasePwmConfig {
        duty_width: foc.duty_width,
        steps: foc.steps,
        dead_time: foc.dead_time,
        min_pulse: foc.min_pulse,
        sample_delay: foc.sample_delay,
        peak: foc.peak,
    };
    ThreePhasePwm::new(config).map_err(SimulationError::Config)
}

/// The nets that waveforms draw as curves.
const CURVES: [&str; 11] =
    ["torque", "target", "d", "q", "v_d", "v_q", "v_alpha", "v_beta", "duty_a", "duty_b", "duty_c"];

/// Returns the sensors that the scene's model has.
fn sensors(scene: &FocScene) -> Vec<Sensor> {
    let all = scene.pmsm.sensors.iter();
    all.filter(|sensor| !(scene.model.ideal && sensor.reads_a_current())).cloned().collect()
}

/// Returns what the wall gives at rest, at the least.
fn push(scene: &FocScene, words: &FocWords) -> Push {
    let top = words.unit[1] * ((1u64 << words.config.torque_width()) - 1) as f64;
    let stall_a = scene.bridge.supply_v / (3f64.sqrt() * (scene.pmsm.resistance_ohm + scene.bridge.on_resistance_ohm));
    Push { stiffness: words.realised[0], most: top.min(scene.pmsm.torque_constant_nm_per_a() * stall_a) }
}

fn plant(scene: &FocScene, words: &FocWords) -> Result<Plant, SimulationError> {
    // Counts of the encoder from the start, whatever sensor is the position.
    let start = scene.encoder.count(scene.pmsm.start[0]);
    let counted = |count: i64| match scene.method.position {
        None => count,
        Some(_) => scene.encoder.count(count as f64 * words.count_rad).saturating_sub(start),
    };
    let has_reach = words.reach != [i64::MIN, i64::MAX];
    let foc = &words.config.foc;
    let motor = &*scene.pmsm;
    // Without currents a network's drive gives the wanted torque. A rotor alone is a mass on a rail, which is quicker.
    let (ideal, is_alone) = (scene.model.ideal, motor.is_alone());
    let network = (ideal && !is_alone).then(|| motor.without_currents());
    let rotor = hpu_scene::Device::Mass(Mass {
        mass_kg: motor.inertia_kg_m2,
        damping_n_s_per_m: motor.viscous_nm_s_per_rad,
        coulomb_n: motor.coulomb_nm,
        initial_position_m: motor.start[0],
        initial_speed_m_per_s: motor.start[1],
    });
    let actuator = match (scene.model.ideal, scene.model.bridge) {
        (true, _) => Actuator::Amplified { quantum_n: words.unit[1], shaping: None },
        (false, BridgeModel::Averaged) => Actuator::AveragedLegs { steps: foc.steps, min_pulse: foc.min_pulse },
        (false, BridgeModel::Switching) => Actuator::ThreeLegs,
    };
    let around = Around {
        device: if ideal { &rotor } else { &scene.device },
        network: network.as_ref(),
        pmsm: (!ideal).then_some(motor),
        bridge: scene.bridge,
        hand: &scene.hand,
        friction: scene.model.friction,
        winding: Winding::Inductive,
        clock: scene.clock,
        count_rad: scene.encoder.count_rad(),
        actuator,
        modulator: Some(2 * u64::from(foc.steps)),
        stepping: None,
        faults: scene.faults.as_ref().map(|all| FaultPlan::new(all, scene.clock, scene.run, scene.edges())),
        places: Places {
            wall: scene.wall.as_ref().map_or(i64::MAX, |wall| scene.encoder.nearest(wall.position_rad)),
            reach: has_reach.then(|| words.reach.map(counted)),
        },
        horizon: scene.edges(),
        late: scene.clock.edges(scene.model.delay_s),
        seed: scene.run.seed,
    };
    Plant::around(around).map_err(SimulationError::Plant)
}

impl Simulation for FocSimulation<'_> {
    fn outline(&self) -> &Outline {
        &self.outline
    }
}

impl Wired for FocSimulation<'_> {
    fn wiring(&self) -> TheLoop<'_> {
        match &self.closed {
            Closed::Words(wiring) => TheLoop::Device(wiring),
            Closed::Floats(wiring) => TheLoop::Floats(wiring),
        }
    }

    fn gates_drive(&self) -> bool {
        self.plant.actuator == Actuator::ThreeLegs
    }

    fn visit<'v, V: LoopVisitor<'v>>(&'v self, visitor: V) -> V::Out {
        let method = &self.scene.method;
        let (read, command, enabled_from) = if self.scene.model.ideal {
            // The current controllers stay off.
            let before = |index: usize| self.scene.pmsm.sensors[..index].iter().filter(|it| !it.reads_a_current());
            ([None, None, method.position.map(|index| before(index).count())], "torque", u64::MAX)
        } else {
            let read = [Some(method.currents[0]), Some(method.currents[1]), method.position];
            (read, "duty_a", self.scene.clock.edges(method.enable_after_s))
        };
        let command = self.outline.net(command).unwrap_or(0);
        let world = AxisWorld::of_three_phases(&self.plant, command, read, enabled_from);
        let counter = if method.position.is_some() { "position" } else { "counted" };
        let world = world.counted_by(self.outline.net(counter));
        match &self.closed {
            Closed::Words(wiring) => visitor.visit(wiring, world, self.input()),
            Closed::Floats(wiring) => visitor.visit(wiring, world, self.input()),
        }
    }

    crate::run::simulation::wired_alike!();
}
