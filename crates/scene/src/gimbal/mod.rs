//! A scene of a segment on a gimbal (Pediredla, Chandrasekaran, Annamraju and Thondiyath 2022): shape and shear by
//! position control, stiffness by impedance control of the crank.

mod read;
pub(crate) mod rows;
mod shear;
pub(crate) mod shipped;
mod target;

pub(crate) use read::scene;
pub use rows::ForceSensor;
pub use shear::{Displacement, Shear};
pub use target::{Posture, Target, TargetKind};

use std::f64::consts::PI;

use hpu_datapath::gimbal::GimbalLoopConfig;
use hpu_plant::arm::{Finger, Gimbal};
use hpu_signal::{Cycle, Format};

use crate::head::accuracy::Output;
use crate::head::miss::Miss;
use crate::head::model::Solver;
use crate::head::setup::Setup;
use crate::head::{Head, Units, has_head};
use crate::judged::{stride, window_start};
use crate::schema::source::SceneError;
use crate::text::message::number;

/// The outputs by which models of a gimbal are compared.
pub(crate) const OUTPUTS: [Output; 3] = [Output::Trace, Output::Rms, Output::Verdict];

/// A servo: its torque falls in a straight line from stall to no load.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Servo {
    /// Torque at full drive and no speed.
    pub stall_nm: f64,
    /// Speed at full drive and no load.
    pub no_load_rad_per_s: f64,
    /// Inertia of rotor and gears at the output.
    pub inertia_kg_m2: f64,
    /// Coulomb friction at the output.
    pub coulomb_nm: f64,
    /// Rate at which the servo takes a drive.
    pub rate_hz: f64,
}

/// The gains of a position controller.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PositionGains {
    /// Full drives per rad of error.
    pub proportional: f64,
    /// Full drives per rad/s of its change.
    pub derivative_s: f64,
}

/// The design of the device's datapath.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct GimbalMethod {
    /// Rate at which the loop samples.
    pub sample_rate_hz: f64,
    /// Gains of pitch and roll.
    pub tilt: PositionGains,
    /// Gains of the crank.
    pub crank: PositionGains,
    /// Gain of the force's error.
    pub force_gain: f64,
    /// The blocks' formats and constants.
    pub config: GimbalLoopConfig,
}

/// The thresholds at which the crank's control changes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Thresholds {
    /// Force above which impedance control begins.
    pub on_n: f64,
    /// Force below which it ends.
    pub off_n: f64,
}

/// The finger on the segment.
#[derive(Clone, PartialEq, Debug)]
pub struct Probe {
    /// Its pad.
    pub finger: Finger,
    /// Times in s, and heights in m of the pad at rest above the least radius.
    pub path: Vec<(f64, f64)>,
}

/// The physics that is modelled.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct GimbalModel {
    /// The solver of the motion.
    pub solver: Solver,
    /// Step of a fixed-step solver.
    pub step_s: Option<f64>,
}

/// A scene of a segment on a gimbal, validated, in SI units.
#[derive(Clone, PartialEq, Debug)]
pub struct GimbalScene {
    /// The part that every scene has.
    pub head: Head,
    /// The segment, its gimbal and its crank.
    pub gimbal: Gimbal,
    /// The servos of pitch and roll.
    pub tilt_servo: Servo,
    /// The servo of the crank.
    pub crank_servo: Servo,
    /// The sensor of the finger's force.
    pub force_sensor: ForceSensor,
    /// The design of the datapath.
    pub method: GimbalMethod,
    /// The motion that the host asks for.
    pub target: Target,
    /// Stiffness of the rendered spring.
    pub stiffness_n_per_m: f64,
    /// The rule of the switch.
    pub thresholds: Thresholds,
    /// The shear stress, if the target's lateral motion is to be felt as one.
    pub shear: Option<Shear>,
    /// The finger, if there is one.
    pub probe: Option<Probe>,
    /// The parts of the physics that are modelled.
    pub model: GimbalModel,
}

/// The constant words of a gimbal's datapath, computed from its scene.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct GimbalWords {
    /// Gains of the error: those of pitch and roll, that of the crank.
    pub proportional: [i64; 2],
    /// Gains of its change.
    pub derivative: [i64; 2],
    /// Stiffness of the rendered spring.
    pub stiffness: i64,
    /// The miss of the stiffness, if it is greater than [`Miss::FLAGGED`].
    pub stiffness_miss: Option<Miss>,
    /// Gain of the force's error.
    pub feedback: i64,
    /// Forces at which impedance control begins and ends.
    pub thresholds: [i64; 2],
    /// Sample period in clocks.
    pub period: i64,
    /// Gain of the fractional derivative; 0 without shear.
    pub shear_gain: i64,
}

has_head!(GimbalScene);

impl GimbalScene {
    /// Returns the sample period in whole clocks.
    pub fn period_clocks(&self) -> u64 {
        self.clock.edges(1.0 / self.method.sample_rate_hz)
    }

    /// Returns the solver's step in whole clocks, at least one: a sample period if the scene sets no step.
    pub fn step_clocks(&self) -> u64 {
        self.model.step_s.map_or(self.period_clocks(), |step_s| self.clock.edges(step_s).max(1))
    }

    /// Returns whether the target moves in the last 30 % of the run: the segment is then judged by how it follows.
    pub fn follows(&self) -> bool {
        let from = window_start(self.edges(), stride(self.clock, self.record.plant_rate_hz), 0);
        self.target.moves_after(self.clock.seconds(Cycle(from)))
    }

    /// Returns the angle of one position of a servo.
    pub fn count_rad(&self) -> f64 {
        let [num, den] = self.method.config.gimbal.count;
        PI * f64::from(num) / f64::from(den)
    }

    /// Returns the force of one LSB of the sensor.
    pub fn force_lsb_n(&self) -> f64 {
        self.force_sensor.full_scale_n / f64::from(1u32 << self.method.config.impedance.force_width)
    }

    /// Returns the tip at a posture.
    pub fn tip_m(&self, [height_m, pitch_rad, roll_rad]: Posture) -> [f64; 3] {
        Gimbal::tip_at_m(&pitch_rad, &roll_rad, &(self.gimbal.radii_m()[0] + height_m))
    }

    /// Returns the displacement of the tip along x that the target's motion asks for, if it is felt as shear.
    pub fn displacement(&self) -> Option<Displacement> {
        let motion_m = |time_s: f64| self.tip_m(self.target.at(time_s))[0];
        Some(self.shear?.displacement(motion_m, self.sample_s(), self.run.duration_s))
    }

    /// Returns the sample period.
    fn sample_s(&self) -> f64 {
        self.period_clocks() as f64 * self.clock.period_s()
    }

    /// Returns the gain of the datapath's derivative per unit of viscosity.
    fn shear_gain_per_viscosity(&self, shear: &Shear) -> f64 {
        shear.gain_per_viscosity() * libm::pow(self.sample_s(), -shear.order())
    }

    /// Returns the viscosity that the words realise, in Pa·s to the power of the order.
    pub fn realised_viscosity(&self, words: &GimbalWords) -> Option<f64> {
        let shear = self.shear.as_ref()?;
        Some(words.shear_gain as f64 * self.method.config.shear.gain.lsb() / self.shear_gain_per_viscosity(shear))
    }

    /// Returns the words of the scene's datapath, each rounded to the nearest.
    ///
    /// # Errors
    ///
    /// [`SceneError`] when a value does not fit its format, or a stiffness above zero rounds to zero.
    pub fn words(&self) -> Result<GimbalWords, SceneError> {
        let config = &self.method.config;
        let word = |key: &str, asked: f64, lsb: f64, format: Format| {
            let word = (asked / lsb).round();
            if word > format.max() as f64 {
                let most = number(format.max() as f64 * lsb);
                return Err(self.error(key, format!("{} does not fit {format}; write at most {most}", number(asked))));
            }
            if word == 0.0 && asked > 0.0 {
                let reason =
                    format!("{} rounds to zero in {format}; write 0 or at least {}", number(asked), number(lsb));
                return Err(self.error(key, reason));
            }
            Ok(word as i64)
        };
        // A half turn of error asks for this many counts of drive at a gain of one full drive per radian.
        let full = f64::from(1u32 << (config.impedance.drive_width - 1)) * PI;
        let span_s = f64::from(config.servo.window) * self.sample_s();
        let p_lsb = config.servo.proportional.lsb() / full;
        let d_lsb = config.servo.derivative.lsb() / full * span_s;
        let gains = [("", &self.method.tilt), ("crank_", &self.method.crank)];
        let [p_tilt, p_crank] = gains.map(|(joint, gain)| {
            word(&format!("method.{joint}proportional"), gain.proportional, p_lsb, config.servo.proportional)
        });
        let [d_tilt, d_crank] = gains.map(|(joint, gain)| {
            word(&format!("method.{joint}derivative"), gain.derivative_s, d_lsb, config.servo.derivative)
        });
        let force_lsb_n = self.force_lsb_n();
        let stiffness = config.impedance.stiffness;
        let stiffness_lsb = stiffness.lsb() * force_lsb_n / config.gimbal.length.lsb();
        let feedback = config.impedance.feedback;
        let force = Format::unsigned(config.impedance.force_width);
        let shear_gain = |shear: &Shear| {
            let gain = config.shear.gain;
            word("shear.viscosity", shear.viscosity, gain.lsb() / self.shear_gain_per_viscosity(shear), gain)
        };
        let asked = self.stiffness_n_per_m;
        Ok(GimbalWords {
            proportional: [p_tilt?, p_crank?],
            derivative: [d_tilt?, d_crank?],
            stiffness: word("surface.stiffness", asked, stiffness_lsb, stiffness)?,
            stiffness_miss: Miss::of(asked * stiffness.lsb() / stiffness_lsb, stiffness),
            feedback: word("method.force_gain", self.method.force_gain, feedback.lsb(), feedback)?,
            thresholds: [
                word("switch.on", self.thresholds.on_n, force_lsb_n, force)?,
                word("switch.off", self.thresholds.off_n, force_lsb_n, force)?,
            ],
            period: self.period_clocks() as i64,
            shear_gain: self.shear.as_ref().map_or(Ok(0), shear_gain)?,
        })
    }
}

impl Setup for GimbalScene {
    fn solver(&self) -> Solver {
        self.model.solver
    }

    fn units(&self) -> Units {
        Units { position: "m", effort: "N.m", stiffness: "N/m", damping: "N.s/m" }
    }

    fn outputs(&self) -> &'static [Output] {
        &OUTPUTS
    }

    /// The finger is the hand; its path is that of the radius at which its pad would be at rest. A segment that follows
    /// its target is compared with this alone.
    fn hand_path(&self) -> Vec<(f64, f64)> {
        let [least_m, _] = self.gimbal.radii_m();
        let path = self.probe.iter().filter(|_| !self.follows()).flat_map(|probe| &probe.path);
        path.map(|(time_s, height_m)| (*time_s, least_m + height_m)).collect()
    }

    fn stiffness_miss(&self) -> Option<Miss> {
        self.words().ok()?.stiffness_miss
    }
}
