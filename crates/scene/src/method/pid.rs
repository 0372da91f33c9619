//! A PID controller of the position: a motor, or another device, that follows a target's path.
//!
//! `F = -(K_p e + S - K_d v + F_v w)`, limited to the clamp, with `e = target - x`, `S` the sum of `K_i e T` over all
//! samples, `v = (x(k) - x(k-1)) / T` and `w` the target's motion in the same way. The derivative is that of the
//! device, so that a step of the target makes no kick; `F_v = K_d` makes it that of the error.
//!
//! **Source**: the textbooks; both ways against windup as in Åström and Hägglund 1995.
//! **Known failures**: as those of a wall of stiffness `K_p` and damping `K_d` on both sides; and Coulomb friction with
//! an integral gain hunts: the sum grows while the device sticks.

use hpu_datapath::{PositionPid, PositionPidConfig};
use hpu_signal::Format;

use crate::method::published::{Features, Layer, Published};
use crate::method::sampled_law::SampledLaw;
use crate::method::setting::{Setting, Unmade};
use crate::schema::Otherwise::{Is, Required, Said};
use crate::schema::quantity::Sense::{NotNegative, Positive};
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::schema::{Choice, GainFormat, Group, Key, Quantity, Whole, keys};
use crate::text::message::{number, number_above};

/// The word of a feed-forward.
const FEED_FORWARD_BITS: i32 = 24;

keys! { pid: "method" of ["pid"];
    /// Proportional gain: torque for an error of the position. Its word has the format `stiffness_format`.
    kp: Quantity = Quantity::along(|axis| axis.stiffness, NotNegative, Required);
    /// Integral gain: what the torque grows by in a second for an error of the position.
    ki: Quantity = Quantity::along(|axis| axis.integral, NotNegative, Is(0.0));
    /// Derivative gain: torque against a speed. Its word has the format `damping_format`.
    kd: Quantity = Quantity::along(|axis| axis.damping, NotNegative, Is(0.0));
    /// Format of the word of `ki`, in PWM counts per position count and sample; with the formats of the other two gains
    /// it needs 24 bits at most.
    integral_format: GainFormat = GainFormat(12, 12);
    /// Greatest torque of the controller; no more than the actuator's full command.
    clamp: Quantity = Quantity::along(|axis| axis.effort, Positive, Said("the actuator's full command"));
    /// Treatment of the sum of errors at the clamp: it stands still, or gives back what the clamp cuts off.
    anti_windup: Choice<bool> = Choice::new(|| vec![("clamping", false), ("back_calculation", true)], Is(false));
    /// Share of the torque cut off that a sample gives back, as in 2^-back_shift.
    back_shift: Whole<u32> = Whole::new(0, 24, Is(4));
    /// Torque for a speed of the target; as much as `kd` makes the derivative that of the error.
    feed_forward: Quantity = Quantity::along(|axis| axis.damping, NotNegative, Is(0.0));
}

/// A PID controller in a scene, beside its proportional and its derivative gain, which stand in the place of the wall's
/// stiffness and damping.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PidMethod {
    /// `K_i`.
    pub integral_nm_per_rad_s: f64,
    /// Format of its word.
    pub integral_format: Format,
    /// The greatest torque, unless it is the actuator's.
    pub clamp_nm: Option<f64>,
    /// The exponent of the share given back, if the sum is not held at the clamp.
    pub back_shift: Option<u32>,
    /// Torque for a speed of the target.
    pub feed_forward_nm_s_per_rad: f64,
}

impl PidMethod {
    /// Returns the method in the units of the encoder's body, of which one is so many of those of the scene.
    pub(crate) fn seen_by(mut self, ratio: f64) -> Self {
        self.integral_nm_per_rad_s *= ratio * ratio;
        self.feed_forward_nm_s_per_rad *= ratio * ratio;
        self.clamp_nm = self.clamp_nm.map(|clamp_nm| clamp_nm * ratio.abs());
        self
    }

    /// Returns the words of a scene.
    pub fn config(&self, setting: &Setting) -> Result<PositionPidConfig, Unmade> {
        let Setting { widths, places, period_s, quantum_n, units: [stiffness, damping, effort], .. } = *setting;
        let unit = setting.stiffness_unit();
        let (ki, si) = (self.integral_nm_per_rad_s, format!("{stiffness}/s"));
        let integral = setting.word("method.ki", ki, unit / period_s, &si, self.integral_format)?;
        let frac = widths.damping.frac();
        let format = Format::new(false, FEED_FORWARD_BITS - frac, frac).expect("24 bits");
        let ahead = self.feed_forward_nm_s_per_rad;
        let feed_forward = setting.word("method.feed_forward", ahead, unit * period_s, damping, format)?;
        let top = widths.top() as f64;
        let limit = self.clamp_nm.map_or(top, |clamp_n| (clamp_n / quantum_n).round().min(top));
        if limit < 1.0 {
            let (asked, least) = (number(self.clamp_nm.unwrap_or_default()), number_above(quantum_n));
            let reason = format!("{asked} {effort} is no PWM count; accepted: {least} {effort}, which is one, or more");
            return Err(places.error("method.clamp", reason).into());
        }
        let config = PositionPidConfig {
            widths,
            integral,
            integral_format: self.integral_format,
            limit: limit as u32,
            back_calculation: self.back_shift.is_some(),
            back: self.back_shift.unwrap_or(0),
            feed_forward,
        };
        let gain = config.gain().map_err(|error| places.error("method.integral_format", error.to_string()))?;
        match self.back_shift {
            Some(shift) if i64::from(shift) > i64::from(gain.frac()) => {
                let reason = format!("accepted: 0 to {}, the fraction bits of the gains", gain.frac());
                Err(places.error("method.back_shift", reason).into())
            }
            _ => Ok(config),
        }
    }
}

impl Published for PidMethod {
    type Block = PositionPid;
    type Float = PidLaw;

    const KEYS: &'static Group = &pid::GROUP;
    const LAYERS: &'static [Layer] = &[];

    fn read(s: &Section) -> Result<Self, SceneError> {
        use pid as key;
        let back_calculation = s.read(&key::anti_windup)?;
        if s.has(key::back_shift.name) && !back_calculation {
            let reason = "nothing is given back; write anti_windup = \"back_calculation\", or leave this out";
            return Err(s.error(key::back_shift.name, reason));
        }
        Ok(Self {
            integral_nm_per_rad_s: s.read(&key::ki)?,
            integral_format: s.read(&key::integral_format)?,
            clamp_nm: s.given(&key::clamp)?,
            back_shift: if back_calculation { Some(s.read(&key::back_shift)?) } else { None },
            feed_forward_nm_s_per_rad: s.read(&key::feed_forward)?,
        })
    }

    fn block(&self, setting: &Setting) -> Result<PositionPid, Unmade> {
        Ok(PositionPid::new(self.config(setting)?)?)
    }

    fn float(&self, setting: &Setting) -> Result<PidLaw, SceneError> {
        Ok(PidLaw {
            gains: [setting.stiffness_n_per_m, self.integral_nm_per_rad_s, setting.damping_n_s_per_m],
            feed_forward_n_s_per_m: self.feed_forward_nm_s_per_rad,
            limit_n: self.clamp_nm.map_or(setting.limit_n, |clamp_n| clamp_n.min(setting.limit_n)),
            back: self.back_shift.map(|shift| 0.5f64.powi(shift.cast_signed())),
            period_s: setting.period_s,
            target_m: 0.0,
            before_m: [setting.start_m; 2],
            sum_n: 0.0,
        })
    }

    fn efforts(&mut self) -> Vec<&mut f64> {
        let own = [&mut self.integral_nm_per_rad_s, &mut self.feed_forward_nm_s_per_rad];
        own.into_iter().chain(&mut self.clamp_nm).collect()
    }

    fn features(&self) -> Features {
        Features::default()
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Debug)]
pub struct PidLaw {
    /// `K_p`, `K_i`, `K_d`.
    pub gains: [f64; 3],
    /// `F_v`.
    pub feed_forward_n_s_per_m: f64,
    /// The greatest force.
    pub limit_n: f64,
    /// The share of what the limit cuts off that a sample gives back; without one the sum stands still there.
    pub back: Option<f64>,
    /// `T`.
    pub period_s: f64,
    /// The target.
    pub target_m: f64,
    /// Position and target of the sample before.
    pub before_m: [f64; 2],
    /// `S`.
    pub sum_n: f64,
}

impl SampledLaw for PidLaw {
    fn sample(&mut self, x_m: f64) -> f64 {
        let [kp, ki, kd] = self.gains;
        let now_m = [x_m, self.target_m];
        let [speed, target_speed] = [0, 1].map(|of| (now_m[of] - self.before_m[of]) / self.period_s);
        self.before_m = now_m;
        let limited = |force_n: f64| force_n.clamp(-self.limit_n, self.limit_n);
        let error_m = self.target_m - x_m;
        let grown_n = self.sum_n + ki * error_m * self.period_s;
        let asked_n = kp * error_m + grown_n - kd * speed + limited(self.feed_forward_n_s_per_m * target_speed);
        let given_n = limited(asked_n);
        let pushes_on = (asked_n - given_n) * error_m > 0.0;
        self.sum_n = match self.back {
            Some(back) => limited(grown_n - back * (asked_n - given_n)),
            None if pushes_on => self.sum_n,
            None => limited(grown_n),
        };
        -given_n
    }

    fn vary(&mut self, stiffness_n_per_m: f64, _: f64) {
        self.gains[0] = stiffness_n_per_m;
    }

    fn aim(&mut self, target_m: f64) {
        self.target_m = target_m;
    }
}
