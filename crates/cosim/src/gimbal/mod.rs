//! A segment on a gimbal: its scene made ready, its world.

mod columns;
mod segment_loop;
mod side;

use hpu_datapath::gimbal::GimbalIn;
use hpu_plant::arm::{Arm, Joints, Recorded};
use hpu_signal::Ports;

use crate::result::outline::{Command, Outline, Rule, Waves};
use crate::result::trace::Trace;
use crate::run::simulation::{LoopVisitor, Simulation, TheLoop, Wired};
use crate::run::simulation_error::SimulationError;
use crate::world::arm::ArmPlant;
use crate::world::arm_world::ArmWorld;
use hpu_scene::{GimbalScene, GimbalWords, Setup};

pub use columns::{ERROR, FORCE, GIMBAL_REALS, GIMBAL_ROW, RADIUS, STRESSES};
use segment_loop::SegmentLoop;
use side::{GimbalSide, Plan};

/// A scene of a segment on a gimbal made ready: its words, its wiring, its plant.
pub struct GimbalSimulation<'s> {
    scene: &'s GimbalScene,
    plant: ArmPlant<Recorded>,
    plan: Plan<'s>,
    words: GimbalWords,
    wiring: SegmentLoop,
    outline: Outline,
}

impl<'s> GimbalSimulation<'s> {
    /// Makes a scene ready.
    ///
    /// # Errors
    ///
    /// When its words, widths or parameters are impossible.
    pub fn new(scene: &'s GimbalScene) -> Result<Self, SimulationError> {
        let words = scene.words().map_err(SimulationError::Scene)?;
        let wiring = SegmentLoop::new(scene.method.config, scene.shear.is_some());
        let wiring = wiring.map_err(SimulationError::Config)?;
        let plant = plant(scene)?;
        let [first, second, third] = plant.command_nm;
        let commands = vec![
            ("drive1", "stall_torque1_nm", first),
            ("drive2", "stall_torque2_nm", second),
            ("drive3", "stall_torque3_nm", third),
        ];
        let outline = outline(scene, &wiring, commands);
        Ok(Self { scene, plant, plan: Plan::new(scene), words, wiring, outline })
    }

    /// Returns the scene.
    pub fn scene(&self) -> &'s GimbalScene {
        self.scene
    }

    /// Returns the scene's words.
    pub fn words(&self) -> &GimbalWords {
        &self.words
    }

    /// Returns the constant inputs of the datapath; all that the world drives is 0.
    pub fn input(&self) -> GimbalIn<i64> {
        let GimbalWords { proportional, derivative, stiffness, feedback, thresholds, period, shear_gain, .. } =
            self.words;
        GimbalIn {
            proportional: proportional[0],
            derivative: derivative[0],
            crank_proportional: proportional[1],
            crank_derivative: derivative[1],
            stiffness,
            feedback,
            threshold_on: thresholds[0],
            threshold_off: thresholds[1],
            period,
            shear_gain,
            ..GimbalIn::build(|| 0)
        }
    }
}

/// Returns the outline of a scene. Its target stands still in the judged window if its radius is to come to rest there.
/// Without a finger it has no contact, and without shear no stresses.
fn outline(scene: &GimbalScene, wiring: &SegmentLoop, commands: Vec<Command>) -> Outline {
    let has_shear = scene.shear.is_some();
    let closed_by = (wiring.wiring().name(), wiring.wiring().nets());
    let reals = if has_shear { GIMBAL_REALS.len() } else { STRESSES[0] };
    let rule = still_within_m(scene).map_or(Rule::Follow(ERROR), |count_m| Rule::Rest(RADIUS, count_m));
    let outline = Outline::new(scene, (&GIMBAL_ROW, reals), closed_by, rule);
    // The mode is 1 under impedance control.
    let contact = outline.net("mode");
    Outline {
        columns: (0..GIMBAL_ROW.len()).filter(|column| has_shear || !STRESSES.contains(column)).collect(),
        commands,
        judged: [RADIUS, ERROR, FORCE].into_iter().chain(STRESSES.into_iter().filter(|_| has_shear)).collect(),
        reads_rows: has_shear,
        has_contact: scene.probe.is_some(),
        contact,
        waves: WAVES,
        ..outline.with_hand(scene.hand_path())
    }
}

/// The nets as waveforms show them; `x`, `y` and `z` are those of the target.
const WAVES: Waves = Waves {
    groups: &[
        ("Target", &["x", "y", "z", "shear_gain", "shear_x", "pitch", "roll", "crank", "rest", "out_of_reach"]),
        ("Servos", &["count", "drive", "proportional", "derivative", "crank_proportional", "crank_derivative"]),
        (
            "Switch",
            &[
                "finger_force",
                "threshold_on",
                "threshold_off",
                "mode",
                "radius",
                "equilibrium",
                "slope",
                "stiffness",
                "feedback",
                "position_drive",
                "impedance_drive",
            ],
        ),
    ],
    curves: &[
        "pitch",
        "roll",
        "crank",
        "rest",
        "drive",
        "finger_force",
        "equilibrium",
        "position_drive",
        "impedance_drive",
    ],
};

/// Returns mean and standard deviation of the absolute error of the rendered stress, in Pa, over the whole trace of a
/// scene with shear. The published error of the stress is given in this form.
///
/// # Panics
///
/// When the trace does not keep both stresses.
pub fn stress_error_pa(trace: &Trace) -> [f64; 2] {
    let [asked, rendered] = STRESSES.map(|column| trace.real(column));
    let errors = || asked.iter().zip(rendered).map(|(asked, rendered)| (rendered - asked).abs());
    let count = asked.len().max(1) as f64;
    let mean = errors().sum::<f64>() / count;
    [mean, (errors().map(|error| (error - mean) * (error - mean)).sum::<f64>() / count).sqrt()]
}

/// Returns the change of the radius by one position of the crank's servo, where it is greatest; `None` if the target
/// moves in the judged window, so that the motion is judged by how it follows.
fn still_within_m(scene: &GimbalScene) -> Option<f64> {
    let levers = (0..=1800).map(|tenth| scene.gimbal.lever_m(&(0.1 * f64::from(tenth)).to_radians()).abs());
    let steepest_m = levers.fold(0.0, f64::max);
    (!scene.follows()).then_some(steepest_m * scene.count_rad())
}

fn plant(scene: &GimbalScene) -> Result<ArmPlant<Recorded>, SimulationError> {
    let servos = [scene.tilt_servo, scene.tilt_servo, scene.crank_servo];
    let joints = Joints {
        // The torque falls with the speed, in a straight line from stall to no load.
        viscous_nm_s_per_rad: servos.map(|servo| servo.stall_nm / servo.no_load_rad_per_s),
        coulomb_nm: servos.map(|servo| servo.coulomb_nm),
        rotor_kg_m2: servos.map(|servo| servo.inertia_kg_m2),
        free: [true; 3],
        ..Joints::default()
    };
    let arm = Arm::of(&scene.gimbal, joints, scene.clock.period_s());
    let arm = arm.map_err(|error| SimulationError::Arm(error.to_string()))?;
    let arm = match &scene.probe {
        Some(probe) => arm.with_finger(probe.finger),
        None => arm,
    };
    let full = f64::from(1u32 << (scene.method.config.impedance.drive_width - 1));
    let start_rad = scene.gimbal.angles_rad(scene.tip_m(scene.target.at(0.0)));
    let start_rad = start_rad.ok_or_else(|| SimulationError::Arm("the target's start is out of reach".into()))?;
    Ok(ArmPlant {
        arm,
        stepping: scene.model.solver.method().map(|method| (method, scene.step_clocks())),
        // The servos' positions are read at instants of the bus alone.
        count_rad: [f64::INFINITY; 3],
        command_nm: servos.map(|servo| servo.stall_nm / full),
        start_rad,
        start_rad_per_s: [0.0; 3],
        stops: Box::new(|_| None),
    })
}

impl Simulation for GimbalSimulation<'_> {
    fn outline(&self) -> &Outline {
        &self.outline
    }
}

impl Wired for GimbalSimulation<'_> {
    fn wiring(&self) -> TheLoop<'_> {
        TheLoop::Device(self.wiring.wiring())
    }

    fn visit<'v, V: LoopVisitor<'v>>(&'v self, visit: V) -> V::Out {
        let world = ArmWorld::new(&self.plant, GimbalSide::new(&self.plan));
        match &self.wiring {
            SegmentLoop::Plain(wiring) => visit.visit(wiring, world, self.input()),
            SegmentLoop::Shear(wiring) => visit.visit(wiring, world, self.input()),
        }
    }

    crate::run::simulation::wired_alike!();
}
