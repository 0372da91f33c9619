//! Criteria that tell without a run whether a finger can rest on the segment under the rule of the switch. They are
//! built independently of the emulator: in floats, without words, and with friction left out.
//!
//! | criterion | the touch fails if |
//! |---|---|
//! | `softer` | the asked spring is softer than position control, which acts as a spring of `K1 stall / lever²` |
//! | `no_rest` | at rest, position control's force is above `switch.on`, impedance control's below `switch.off` |
//! | `sampled` | the linear loop of the control that rests grows from pulse to pulse of the crank's servo |

use hpu_cosim::scene::GimbalScene;

use crate::Error;
use crate::sampled::{SampledLoop, exponential, scaled};

/// The rest of a touch under one control.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Rest {
    /// Force of the finger in N; 0 if the surface has left the finger.
    pub force_n: f64,
    /// Radius of the segment in m.
    pub radius_m: f64,
    /// Spectral radius of the linear loop around this rest, from one pulse of the crank's servo to the next.
    pub growth: f64,
}

/// The criteria of a touch, at the place where the finger ends.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Criteria {
    /// The stiffness of position control, in N/m, where the target ends.
    pub position_n_per_m: f64,
    /// The stiffness that the scene asks for, in N/m.
    pub asked_n_per_m: f64,
    /// The rest under position control and under impedance control.
    pub rests: [Rest; 2],
    /// Whether each of the two controls keeps the crank at its rest.
    pub holds: [bool; 2],
}

/// Names of the criteria.
pub const NAMES: [&str; 3] = ["softer", "no_rest", "sampled"];

impl Criteria {
    /// Returns the criteria of a scene.
    ///
    /// # Errors
    ///
    /// When the scene has no finger, its target moves or tilts, or its rates are not those of the linear loop: position
    /// and force at each sample, pulses at every so many samples, no gain of the crank's speed.
    pub fn of(scene: &GimbalScene) -> Result<Self, Error> {
        let probe = scene.probe.as_ref().ok_or("the criteria are those of a touch; write a [finger]")?;
        let end_s = scene.run.duration_s;
        let [height_m, pitch_rad, roll_rad] = scene.target.at(end_s);
        if scene.target.moves_after(0.0) || pitch_rad != 0.0 || roll_rad != 0.0 {
            return Err("the criteria are those of an upright segment whose target rests".into());
        }
        let finger_m = scene.gimbal.radii_m()[0] + hpu_cosim::scene::along(&probe.path, end_s)[0];
        let touch = Touch { scene, target_m: scene.gimbal.radii_m()[0] + height_m, finger_m };
        let position_n_per_m = touch.position_n_per_m(touch.target_m);
        let position = touch.rest(|radius_m| touch.position_n(radius_m));
        let rest_m = if scene.method.config.switch.take_radius { touch.taken_m(position) } else { touch.target_m };
        let impedance = touch.rest(|radius_m| touch.spring_n(rest_m, radius_m));
        let rests = [
            touch.around(position, |touch| (touch.position_n_per_m(position), 0.0))?,
            touch.around(impedance, |touch| {
                let is_limited = touch.desired_n(rest_m, impedance) >= touch.most_n();
                let spring = if is_limited { 0.0 } else { scene.stiffness_n_per_m };
                (spring * (1.0 + scene.method.force_gain), scene.method.force_gain)
            })?,
        ];
        let thresholds = scene.thresholds;
        let holds = [rests[0].force_n <= thresholds.on_n, rests[1].force_n >= thresholds.off_n];
        Ok(Self { position_n_per_m, asked_n_per_m: scene.stiffness_n_per_m, rests, holds })
    }

    /// Returns whether each criterion predicts that the touch fails, in the order of [`NAMES`].
    pub fn fails(&self) -> [bool; 3] {
        let stable = |index: usize| self.holds[index] && self.rests[index].growth < 1.0;
        [self.asked_n_per_m < self.position_n_per_m, !self.holds[0] && !self.holds[1], !stable(0) && !stable(1)]
    }
}

/// A finger at its last place, above a target.
struct Touch<'s> {
    scene: &'s GimbalScene,
    target_m: f64,
    finger_m: f64,
}

impl Touch<'_> {
    fn lever_m(&self, radius_m: f64) -> f64 {
        self.scene.gimbal.crank_rad(radius_m).map_or(0.0, |crank_rad| self.scene.gimbal.lever_m(&crank_rad)).abs()
    }

    /// Returns the torque per angle of position control.
    fn position_nm_per_rad(&self) -> f64 {
        self.scene.method.crank.proportional * self.scene.crank_servo.stall_nm
    }

    fn position_n_per_m(&self, radius_m: f64) -> f64 {
        let lever_m = self.lever_m(radius_m);
        self.position_nm_per_rad() / (lever_m * lever_m)
    }

    /// Returns the outward force of position control at a radius.
    fn position_n(&self, radius_m: f64) -> f64 {
        let [now, target] = [radius_m, self.target_m].map(|radius_m| self.scene.gimbal.crank_rad(radius_m));
        let error_rad = now.zip(target).map_or(0.0, |(now, target)| now - target);
        let stall_nm = self.scene.crank_servo.stall_nm;
        (self.position_nm_per_rad() * error_rad).clamp(-stall_nm, stall_nm) / self.lever_m(radius_m)
    }

    /// Returns the greatest force that the datapath asks of its spring.
    fn most_n(&self) -> f64 {
        f64::from(self.scene.method.config.impedance.force_limit) * self.scene.force_lsb_n()
    }

    fn desired_n(&self, rest_m: f64, radius_m: f64) -> f64 {
        (self.scene.stiffness_n_per_m * (rest_m - radius_m)).clamp(0.0, self.most_n())
    }

    fn finger_n(&self, radius_m: f64) -> f64 {
        let probe = self.scene.probe.as_ref().expect("a touch has a finger");
        (probe.finger.stiffness_n_per_m * (radius_m - self.finger_m)).max(0.0)
    }

    /// Returns the outward force of impedance control with force feedback.
    fn spring_n(&self, rest_m: f64, radius_m: f64) -> f64 {
        let desired_n = self.desired_n(rest_m, radius_m);
        let force_n = desired_n + self.scene.method.force_gain * (desired_n - self.finger_n(radius_m));
        let most_n = self.scene.crank_servo.stall_nm / self.lever_m(radius_m);
        force_n.clamp(-most_n, most_n)
    }

    /// Returns the radius at which an outward force carries finger and weight, by bisection between the dead centres.
    fn rest(&self, outward_n: impl Fn(f64) -> f64) -> f64 {
        let gimbal = &self.scene.gimbal;
        let weight_n = gimbal.mass_kg * gimbal.gravity_m_per_s2;
        let [mut low, mut high] = gimbal.radii_m();
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if outward_n(middle) > self.finger_n(middle) + weight_n {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }

    /// Returns the radius that a latched switch takes as the rest of its spring: where, under position control, the
    /// finger's force passes the threshold; at most that of the rest.
    fn taken_m(&self, position_m: f64) -> f64 {
        let gimbal = &self.scene.gimbal;
        let weight_n = gimbal.mass_kg * gimbal.gravity_m_per_s2;
        let carried_n = self.scene.thresholds.on_n + weight_n;
        let [mut low, mut high] = [position_m, self.target_m];
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.position_n(middle) > carried_n { low = middle } else { high = middle }
        }
        low
    }

    /// Returns the rest at a radius, with the linear loop around it. `gains` are those of the radius and of the
    /// finger's force, both as forces inward.
    ///
    /// The drive that a pulse takes is of the sample one period before, and is held to the next pulse.
    fn around(&self, radius_m: f64, gains: impl Fn(&Self) -> (f64, f64)) -> Result<Rest, Error> {
        let scene = self.scene;
        let probe = scene.probe.as_ref().expect("a touch has a finger");
        let force_n = self.finger_n(radius_m);
        let is_touched = force_n > 0.0;
        let (finger, damper) = match is_touched {
            true => (probe.finger.stiffness_n_per_m, probe.finger.damping_n_s_per_m),
            false => (0.0, 0.0),
        };
        let (sample, pulse) = (scene.period_clocks(), scene.clock.edges(1.0 / scene.crank_servo.rate_hz));
        let reads =
            [scene.tilt_servo.rate_hz, scene.force_sensor.rate_hz].map(|rate_hz| scene.clock.edges(1.0 / rate_hz));
        if reads != [sample; 2] || !pulse.is_multiple_of(sample) {
            return Err("the linear loop reads position and force at each sample, and drives at every so many".into());
        }
        if scene.method.crank.derivative_s != 0.0 {
            return Err("the linear loop has no gain of the crank's speed; write method.crank_derivative = 0".into());
        }
        let (gain, feedback) = gains(self);
        let lever = self.lever_m(radius_m);
        let inertia = scene.crank_servo.inertia_kg_m2 + scene.gimbal.mass_kg * lever * lever;
        let friction = scene.crank_servo.stall_nm / scene.crank_servo.no_load_rad_per_s + damper * lever * lever;
        // Angle, speed and the held torque.
        let plant = vec![
            vec![0.0, 1.0, 0.0],
            vec![-finger * lever * lever / inertia, -friction / inertia, 1.0 / inertia],
            vec![0.0; 3],
        ];
        let flow = |clocks: u64| exponential(&scaled(&plant, scene.clock.seconds(hpu_signal::Cycle(clocks))));
        let (whole, taken) = (flow(pulse), flow(pulse - sample));
        let square = lever * lever;
        let law = [-square * (gain + feedback * finger), -square * feedback * damper];
        let torque = (0..3).map(|column| law[0] * taken[0][column] + law[1] * taken[1][column]).collect();
        let growth = SampledLoop::of(vec![whole[0].clone(), whole[1].clone(), torque]).spectral_radius();
        Ok(Rest { force_n, radius_m, growth })
    }
}
