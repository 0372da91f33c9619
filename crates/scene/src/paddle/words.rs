//! The words of the paddle's loop.

use std::f64::consts::PI;

use hpu_datapath::paddle::{FilteredPidConfig, PaddleConfig, TimerPwmConfig};
use hpu_signal::Format;

use crate::axis::sensors::{FRACTION, Sampled, SensorKind};
use crate::paddle::PaddleScene;
use crate::schedule::{Schedule, WordRamp};
use crate::schema::source::SceneError;
use crate::text::message::{number, number_below};

/// The most bits of a sum of codes, which has one more less its zero.
const MOST_SUM: u32 = 23;
/// The most bits of a wanted current.
const MOST_AIM: u32 = 20;
/// The periods that the firmware takes its loops for.
const BELIEVED_S: [f64; 2] = [50e-6, 350e-6];

/// The words of the paddle's loop, and their units.
#[derive(Clone, PartialEq, Debug)]
pub struct PaddleWords {
    /// Formats and limits of the wiring.
    pub config: PaddleConfig,
    /// Position that is the angle 0, modulo the counter's width.
    pub reference: i64,
    /// The sum of the codes that stand for the controller's 0.
    pub zero: i64,
    /// Words that change while the scene runs.
    pub schedule: Schedule,
    /// Shares of new readings in the filters of the angle and of the current.
    pub shares: [i64; 2],
    /// Gains of the error, its integral and its change of the position controller.
    pub gains: [i64; 3],
    /// Gains of the error and its integral, and the feed-forward, of the current controller.
    pub current_gains: [i64; 3],
    /// Periods of the converter, of the current controller and of the position controller, in clocks.
    pub periods: [i64; 3],
    /// Angle of one count or code, as the firmware takes it.
    pub count_rad: f64,
    /// Current of one unit of the sum.
    pub unit_a: f64,
    /// The firmware's own numbers.
    pub floats: PaddleFloats,
}

/// The numbers of the firmware, in float32 as it has them.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PaddleFloats {
    /// Degrees of one count or code, as the firmware takes it.
    pub count_deg: f32,
    /// Current of one unit of the words' sum.
    pub unit_a: f32,
    /// Current of one code.
    pub code_a: f32,
    /// Current that is the controller's 0.
    pub zero_a: f32,
    /// Codes whose mean is taken.
    pub window: usize,
    /// Gains in N·m/deg, N·m/(deg·s) and N·m·s/deg.
    pub gains: [f32; 3],
    /// Share of a new angle in the filter.
    pub share: f32,
    /// Turns of the motor for one of the paddle.
    pub reduction: f32,
    /// Torque of an ampere.
    pub torque_constant: f32,
    /// Greatest torque.
    pub torque_limit_nm: f32,
    /// Share of a new mean in the current's filter.
    pub current_share: f32,
    /// Volts for an ampere of error.
    pub proportional: f32,
    /// Volts a second for an ampere of error.
    pub integral: f32,
    /// Limit of the integral.
    pub limit_v: f32,
    /// Volts for an ampere of the wanted current.
    pub feed_forward_ohm: f32,
    /// Voltage that a duty is a share of.
    pub supply_v: f32,
    /// Greatest duty.
    pub duty_limit: f32,
    /// Steps of the bridge at a duty of 0.
    pub centre: i64,
}

impl PaddleScene {
    /// Returns the count at which the device starts, from angle 0.
    pub fn start_count(&self) -> i64 {
        self.encoder.count(self.network.start())
    }

    /// Returns the least and the greatest count from the start that the position counter holds.
    pub fn reach(&self) -> [i64; 2] {
        let half = 1 << (PaddleConfig::default().haptic.width - 1);
        [-half, half - 1].map(|count| count - self.start_count())
    }

    fn sampled(&self, index: usize) -> &Sampled {
        match &self.network.sensors[index].kind {
            SensorKind::Sampled(sampled) => sampled,
            _ => unreachable!("the reader takes sensors of words"),
        }
    }

    /// Returns the words of the scene's loop. Every word is the nearest one.
    ///
    /// # Errors
    ///
    /// [`SceneError`] when a word does not fit its format.
    pub fn words(&self) -> Result<PaddleWords, SceneError> {
        let method = &self.method;
        let codes = self.sampled(method.current);
        // A sum of codes is a mean times their number.
        let unit_a = libm::exp2(f64::from(FRACTION)) / (codes.scale * f64::from(method.window));
        let count_rad = if method.position.is_some() { method.code_rad } else { self.encoder.count_rad() };
        let normal = PaddleConfig::default();
        let steps_per_v = f64::from(normal.pwm.centre) / self.bridge.supply_v;

        let config = self.formats(codes, unit_a, steps_per_v)?;
        let (haptic, current) = (config.haptic, config.current);
        let [kp, ki, kd] = method.gains;
        let torque = count_rad / (method.reduction * method.torque_constant_nm_per_a * unit_a);
        let gains = [("kp", kp), ("ki", ki * BELIEVED_S[1]), ("kd", kd / BELIEVED_S[1])];
        let [proportional, integral] = method.current_gains;
        let duty_per_unit = steps_per_v * unit_a;
        let current_gains = [
            ("current_proportional", proportional),
            ("current_integral", integral * BELIEVED_S[0]),
            ("feed_forward", method.feed_forward_ohm),
        ];
        let word = |format: Format, (key, value): (&'static str, f64), unit: f64| self.gain(format, key, value, unit);
        let clocks = |key: &str, period_s: f64| self.clocks(key, period_s, config.period_width);
        let mut words = PaddleWords {
            reference: self.start_count().wrapping_neg() & ((1 << haptic.width) - 1),
            zero: if method.calibrated { (self.resting_a(&config.pwm) / unit_a).round() as i64 } else { 0 },
            schedule: Schedule::default(),
            shares: [share(2.0 * PI * method.cutoff_hz * BELIEVED_S[1]), share(method.current_share)],
            gains: [
                word(haptic.gain, gains[0], torque)?,
                word(haptic.gain, gains[1], torque)?,
                word(haptic.gain, gains[2], torque)?,
            ],
            current_gains: [
                word(current.gain, current_gains[0], duty_per_unit)?,
                word(current.gain, current_gains[1], duty_per_unit)?,
                word(current.gain, current_gains[2], duty_per_unit)?,
            ],
            periods: [
                codes.period.cast_signed(),
                clocks("method.current_period", method.current_period_s)?,
                clocks("method.haptic_period", method.haptic_period_s)?,
            ],
            floats: self.floats(count_rad, unit_a, &config.pwm),
            config,
            count_rad,
            unit_a,
        };
        words.schedule.wanted = Some(self.target(haptic.target, count_rad)?);
        Ok(words)
    }

    /// Returns the formats and limits of the loop, for units of the sum of codes.
    fn formats(&self, codes: &Sampled, unit_a: f64, steps_per_v: f64) -> Result<PaddleConfig, SceneError> {
        let (method, normal) = (&self.method, PaddleConfig::default());
        let sum_width = codes.bits + method.window.next_power_of_two().ilog2();
        if sum_width > MOST_SUM {
            let reason = format!("{} codes of {} bits; accepted: {MOST_SUM} bits of a sum", method.window, codes.bits);
            return Err(self.error("method.codes", reason));
        }
        let hall_width = method.position.map_or(normal.hall_width, |index| self.sampled(index).bits);
        if hall_width > normal.haptic.width {
            let reason = format!("its word has {hall_width} bits; accepted: {} at most", normal.haptic.width);
            return Err(self.error("method.position", reason));
        }
        let most = (method.torque_limit_nm / method.torque_constant_nm_per_a / unit_a).floor().max(1.0);
        let duty = method.duty_limit * f64::from(normal.pwm.centre);
        let most = self.whole("method.torque_limit", most)?;
        // One bit for the sign.
        let command_width = (33 - most.leading_zeros()).max(normal.haptic.command_width);
        if command_width > MOST_AIM {
            let reason =
                format!("its word has {command_width} bits, where {MOST_AIM} at most are accepted: write less");
            return Err(self.error("method.torque_limit", reason));
        }
        let haptic = FilteredPidConfig { command_width, least: -most, most, ..normal.haptic };
        let limit = method.integral_limit_v * steps_per_v * libm::exp2(f64::from(normal.current.sum_frac));
        let current = FilteredPidConfig {
            least: self.whole("method.duty_limit", (-duty).floor())?,
            most: self.whole("method.duty_limit", duty.floor())?,
            sum_limit: self.whole("method.integral_limit", limit.round())?.unsigned_abs(),
            ..normal.current
        };
        Ok(PaddleConfig {
            hall_width,
            haptic,
            code_width: codes.bits,
            window: method.window,
            sum_width,
            current,
            pwm: TimerPwmConfig { command_width: current.command_width, ..normal.pwm },
            ..normal
        })
    }

    fn floats(&self, count_rad: f64, unit_a: f64, pwm: &TimerPwmConfig) -> PaddleFloats {
        let method = &self.method;
        let [kp, ki, kd] = method.gains.map(|gain| gain.to_radians() as f32);
        let share = 350e-6f32 * (2.0 * PI * method.cutoff_hz) as f32;
        PaddleFloats {
            count_deg: count_rad.to_degrees() as f32,
            unit_a: unit_a as f32,
            code_a: (unit_a * f64::from(method.window)) as f32,
            zero_a: if method.calibrated { self.resting_a(pwm) as f32 } else { 0.0 },
            window: method.window as usize,
            gains: [kp, ki, kd],
            share: share.min(1.0),
            reduction: method.reduction as f32,
            torque_constant: method.torque_constant_nm_per_a as f32,
            torque_limit_nm: method.torque_limit_nm as f32,
            current_share: method.current_share as f32,
            proportional: method.current_gains[0] as f32,
            integral: method.current_gains[1] as f32,
            limit_v: method.integral_limit_v as f32,
            feed_forward_ohm: method.feed_forward_ohm as f32,
            supply_v: self.bridge.supply_v as f32,
            duty_limit: method.duty_limit as f32,
            centre: pwm.centre.into(),
        }
    }

    /// Returns the word of the wanted angle: that of the start, then that of the target.
    fn target(&self, format: Format, count_rad: f64) -> Result<WordRamp, SceneError> {
        let method = &self.method;
        let word = |angle_rad: f64| {
            let word = (angle_rad / count_rad / format.lsb()).round();
            let most = format.max() as f64 * format.lsb() * count_rad;
            if format.holds(word as i128) {
                return Ok(word as i64);
            }
            let reason =
                format!("{} rad, where {} rad to either side is accepted", number(angle_rad), number_below(most));
            Err(self.error("method.target", reason))
        };
        // A code begins at its angle; its middle is nearest to the start.
        let start = (self.network.start() / count_rad).floor() + 0.5;
        let (from, to) = (word(start * count_rad)?, word(method.target_rad)?);
        Ok(match self.clock.edges(method.target_from_s) {
            0 => WordRamp::new(to, to, 0, 1),
            edge => WordRamp::new(from, to, edge - 1, 1),
        })
    }

    /// Returns the current of the winding at rest without a duty.
    fn resting_a(&self, pwm: &TimerPwmConfig) -> f64 {
        let duty = 2.0 * f64::from(pwm.centre) / f64::from(pwm.steps) - 1.0;
        let resistance_ohm = self.network.network.feed.resistance_ohm + 2.0 * self.bridge.on_resistance_ohm;
        duty * self.bridge.supply_v / resistance_ohm
    }

    fn whole(&self, key: &str, word: f64) -> Result<i32, SceneError> {
        if word.abs() <= f64::from(i32::MAX) {
            return Ok(word as i32);
        }
        let reason = format!("its word is {}, where 2^31 - 1 at most is accepted: write less", number(word));
        Err(self.error(key, reason))
    }

    fn gain(&self, format: Format, key: &str, value: f64, unit: f64) -> Result<i64, SceneError> {
        let word = (value * unit / format.lsb()).round();
        if word <= format.max() as f64 {
            return Ok(word as i64);
        }
        let times = number_below(format.max() as f64 * format.lsb() / (value * unit));
        let reason = format!("its word does not fit {format}, where {times} times as much at most is accepted");
        Err(self.error(&format!("method.{key}"), reason))
    }

    fn clocks(&self, key: &str, period_s: f64, width: u32) -> Result<i64, SceneError> {
        let (clocks, most) = (self.clock.edges(period_s), (1u64 << width) - 1);
        if (1..=most).contains(&clocks) {
            return Ok(clocks.cast_signed());
        }
        let reason = format!("{clocks} clock cycles; accepted: 1 to {most}");
        Err(self.error(key, reason))
    }
}

/// Returns the word of a filter's share, at most all but 2^-16.
fn share(share: f64) -> i64 {
    ((share * 65_536.0).round() as i64).clamp(1, 65_535)
}
