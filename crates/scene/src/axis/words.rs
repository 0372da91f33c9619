//! Computes the words of a scene's datapath from the scene's SI values.

use std::sync::Arc;

use hpu_datapath::{LawWidths, LoopConfig, PwmConfig};
use hpu_signal::Format;

use crate::axis::Scene;
use crate::axis::parts::{Device, Push};
use crate::head::Units;
use crate::head::miss::{Miss, relative_error};
use crate::head::model::{Datapath, EncoderModel};
use crate::head::setup::Setup;
use crate::method::{AxisLoop, Loop, Setting, Unmade, gain};
use crate::path::AxisTarget;
use crate::schedule::{Schedule, TargetWords, WordRamp};
use crate::schema::source::SceneError;
use crate::text::message::{number, number_above, number_below};

/// The keys of a wall's gains.
const WALL_GAINS: [&str; 2] = ["wall.stiffness", "wall.damping"];

/// Bits of the magnitude of the command of a law in floats.
pub const COMMAND_BITS: u32 = 40;

/// The words of a loop, and the values that they realise.
#[derive(Clone, PartialEq, Debug)]
pub struct LoopWords {
    /// Widths and options of the wiring.
    pub config: LoopConfig,
    /// The wall's position in counts from the start, modulo the counter's range.
    pub reference: i64,
    /// PWM counts per position count, in its format.
    pub stiffness: i64,
    /// PWM counts per velocity count, in its format.
    pub damping: i64,
    /// Sample period in clocks.
    pub period: i64,
    /// Counts per reference sample for one count per sample, or a passive spring's `beta`, in its format; 0 for loops
    /// that read neither.
    pub scale: i64,
    /// Words that change while the scene runs, starting from those above.
    pub schedule: Schedule,
    /// The values that the words realise.
    pub realised: Realised,
}

/// The SI values that a loop's words realise.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Realised {
    /// Stall torque, or amplifier's force, of one PWM count.
    pub torque_quantum_nm: f64,
    /// Shaft angle of one count.
    pub count_rad: f64,
    /// The wall's position: a whole number of counts.
    pub wall_position_rad: f64,
    /// The wall's stiffness.
    pub stiffness_nm_per_rad: f64,
    /// Relative rounding error of the stiffness; 0 for no stiffness.
    pub stiffness_error: f64,
    /// The miss of the stiffness, if it is greater than [`Miss::FLAGGED`].
    pub stiffness_miss: Option<Miss>,
    /// The wall's damping.
    pub damping_nm_s_per_rad: f64,
    /// Relative rounding error of the damping, by the gain's and the scale's words together; 0 for no damping.
    pub damping_error: f64,
    /// Sample rate.
    pub sample_rate_hz: f64,
}

impl Realised {
    /// Returns the values in other units, of which one unit of the encoder's body is so many.
    #[must_use]
    pub fn in_units(self, scale: f64) -> Self {
        let square = scale * scale;
        Self {
            torque_quantum_nm: self.torque_quantum_nm / scale.abs(),
            count_rad: self.count_rad * scale.abs(),
            wall_position_rad: self.wall_position_rad * scale,
            stiffness_nm_per_rad: self.stiffness_nm_per_rad / square,
            damping_nm_s_per_rad: self.damping_nm_s_per_rad / square,
            ..self
        }
    }
}

impl LoopWords {
    /// Returns the torque or force that one count of the command asks for: the quantum of a PWM count, or the finer one
    /// of a law in floats.
    pub fn command_quantum_nm(&self, scene: &Scene) -> f64 {
        let counts = match scene.model.datapath {
            Datapath::Law => 2f64.powi(self.config.pwm.width.cast_signed() - COMMAND_BITS.cast_signed()),
            Datapath::Words | Datapath::Linear => 1.0,
        };
        counts * self.realised.torque_quantum_nm
    }
}

impl Scene {
    /// Returns the words of the scene's loop.
    ///
    /// With the torque quantum `q = K U / (R + 2 R_on) / 2^pwm_bits` and the angle of a count `c = 2 pi / (4 lines)`
    /// (of a mass the amplifier's full scale over `2^pwm_bits`, and the encoder's resolution), the stiffness is
    /// `k c / q` and the damping `b c / (q T)`, `T` being the time over which the velocity counts, or the reference
    /// period when velocities are rescaled by `f_sample / f_reference`. Every word is the nearest one.
    ///
    /// # Errors
    ///
    /// [`SceneError`] when a word does not fit its format, when a gain above zero rounds to zero, and for a mass
    /// without encoder or amplifier.
    pub fn words(&self) -> Result<LoopWords, SceneError> {
        let method = &self.method;
        let stall_nm = self.stall_nm()?;
        let torque_quantum_nm = stall_nm * Format::new(false, 1, method.pwm.bits as i32).map_or(0.0, Format::lsb);
        let count_rad = self.encoder.count_rad();
        let period = self.check_period()?;
        let period_s = self.sample_period_s();

        let units = self.device.units();
        let stiffness_unit = torque_quantum_nm / count_rad;
        let [spring, damper] = self.gains();
        let stiffness = self.gain(spring.0, spring.1, stiffness_unit, units.stiffness, method.stiffness_format)?;

        let reference_period_s = method.reference_rate_hz.map_or(self.velocity_span_s(), f64::recip);
        let damping_unit = stiffness_unit * reference_period_s;
        let damping = self.gain(damper.0, damper.1, damping_unit, units.damping, method.damping_format)?;
        let scale = match (method.reference_rate_hz, method.kind.scale()) {
            (None, Some((key, scale))) => self.gain(key, scale, 1.0, "", method.scale_format)?,
            (None, None) => 0,
            (Some(_), _) => self.gain(
                "method.reference_rate",
                reference_period_s / period_s,
                1.0,
                "samples a reference period",
                method.scale_format,
            )?,
        };
        // One count per sample of T reads as `scale` counts per reference period, so the error of `scale` is part of
        // the damping's.
        let scale_share = match method.reference_rate_hz {
            None => 1.0,
            Some(_) => method.scale_format.to_f64(scale) * period_s / reference_period_s,
        };

        let schedule = match &self.target {
            Some(target) => Schedule { target: Some(self.target_words(target)?), ..Schedule::default() },
            None => self.schedule(stiffness, stiffness_unit, units.stiffness, scale)?,
        };
        let from_start = self.wall_from_start();
        self.check_wall(from_start)?;
        let position = Format::unsigned(method.position_bits);
        let stiffness_nm_per_rad = method.stiffness_format.to_f64(stiffness) * stiffness_unit;
        let damping_nm_s_per_rad = method.damping_format.to_f64(damping) * damping_unit * scale_share;
        Ok(LoopWords {
            config: self.loop_config()?,
            // A law in floats reads the target as it is.
            reference: schedule.target.as_ref().map_or(position.wrap(from_start.into()), |target| target.word(0)),
            stiffness,
            damping,
            period,
            scale,
            schedule,
            realised: Realised {
                torque_quantum_nm,
                count_rad,
                wall_position_rad: self.wall_count() as f64 * count_rad,
                stiffness_nm_per_rad,
                stiffness_miss: Miss::of(spring.1 / stiffness_unit, method.stiffness_format),
                stiffness_error: relative_error(stiffness_nm_per_rad, spring.1),
                damping_nm_s_per_rad,
                damping_error: relative_error(damping_nm_s_per_rad, damper.1),
                sample_rate_hz: 1.0 / period_s,
            },
        })
    }

    /// Returns the wall's count, from angle 0.
    pub fn wall_count(&self) -> i64 {
        self.encoder.nearest(self.wall.position_rad)
    }

    /// Returns the counts from the start to the wall, without a counter's wrap.
    pub(crate) fn wall_from_start(&self) -> i64 {
        self.wall_count().saturating_sub(self.encoder.count(self.initial_angle_rad()))
    }

    /// Returns the least and the greatest count from the start that the position counter holds: those whose distance
    /// to the wall fits its width as two's complement. `None` for a law in floats, whose counts do not wrap.
    pub fn reach(&self) -> Option<[i64; 2]> {
        let (half, wall) = (1 << (self.method.position_bits - 1), self.wall_from_start());
        let is_counted = self.model.datapath == Datapath::Words
            && self.model.encoder != EncoderModel::Ideal
            // The distance to a target that moves is no place.
            && self.target.is_none();
        is_counted.then(|| [wall.saturating_sub(half), wall.saturating_add(half - 1)])
    }

    /// Returns the angles, or positions, between which the position counter holds the device: there the loop reads its
    /// true distance to the wall. `None` without a counter.
    pub fn held_rad(&self) -> Option<[f64; 2]> {
        let start = self.encoder.count(self.initial_angle_rad());
        let at = |from_start: i64| start.saturating_add(from_start) as f64 * self.encoder.count_rad();
        self.reach().map(|[least, most]| [at(least), at(most.saturating_add(1))])
    }

    /// Returns the fewest bits of a position counter that holds the device at all of these angles, or positions; `None`
    /// if no counter does.
    pub fn holding_bits(&self, angles_rad: [f64; 2]) -> Option<u32> {
        let wall = self.wall_count();
        let [least, most] = angles_rad.map(|angle_rad| self.encoder.count(angle_rad).saturating_sub(wall));
        (2..=32).find(|bits| least >= -(1i64 << (bits - 1)) && most < 1i64 << (bits - 1))
    }

    /// Refuses a wall so many counts from the start that the position counter reads it elsewhere. The loop's blocks
    /// take the distance to the wall modulo `2^position_bits`, as two's complement, so the distance at the start has to
    /// fit that.
    fn check_wall(&self, from_start: i64) -> Result<(), SceneError> {
        let holds = |bits: u32| (1 - (1i64 << (bits - 1))..=1 << (bits - 1)).contains(&from_start);
        let bits = self.method.position_bits;
        if self.wall.wraps || self.target.is_some() || self.model.datapath != Datapath::Words || holds(bits) {
            return Ok(());
        }
        let (unit, count_rad) = (self.units().position, self.scale() * self.encoder.count_rad());
        let (half, start) = (1i64 << (bits - 1), self.encoder.count(self.initial_angle_rad()));
        let at = |from_start: i64| start.saturating_add(from_start) as f64 * count_rad;
        let (least, most) = (number_above(at(1 - half)), number_below(at(half)));
        let wider = match (bits..=32).find(|bits| holds(*bits)) {
            Some(wider) => format!("method.position_bits = {wider}"),
            None => "a coarser encoder, which 32 bits hold".into(),
        };
        let reason = format!(
            "{} {unit} does not fit {bits} bits: it is {} counts from the start, and walls from {least} to {most} \
             {unit} fit; write {wider}, or wall.wraps = true in a scene that shows how a counter wraps",
            number(self.written_wall().position_rad),
            from_start.unsigned_abs(),
        );
        Err(self.places.error("wall.position", reason))
    }

    /// Returns the words of a target. The error wraps as the position counter does, so a target that goes half of the
    /// counter's range or more between two samples is refused.
    fn target_words(&self, target: &Arc<AxisTarget>) -> Result<TargetWords, SceneError> {
        let bits = self.method.position_bits;
        let count_rad = self.encoder.count_rad();
        let half = (1i64 << (bits - 1)) as f64;
        let most_hz = 0.5 / self.sample_period_s();
        if let Some(sine) = target.sine.filter(|sine| sine.frequency_hz > most_hz) {
            let reason = format!(
                "{} Hz; accepted: half of the sample rate at most, {} Hz",
                number(sine.frequency_hz),
                number_below(most_hz)
            );
            return Err(self.places.error("target.frequency", reason));
        }
        let is_word = self.model.datapath == Datapath::Words;
        let ((piece, index), swing) = target.fastest(self.sample_period_s());
        let first = self.wall_from_start().unsigned_abs() as f64;
        let steps = [(piece / count_rad, format!("target.path[{index}]")), (first, "target.path[0]".into())];
        let steps = steps.into_iter().chain([(swing / count_rad, "target.amplitude".into())]);
        if let Some((counts, key)) = steps.into_iter().find(|(counts, _)| is_word && *counts >= half) {
            let wider = (bits..=32).find(|bits| counts < (1i64 << (bits - 1)) as f64);
            let wider = wider.map_or("a coarser encoder".into(), |bits| format!("method.position_bits = {bits}"));
            let reason = format!(
                "the target steps by {} counts in a sample, and {bits} bits hold less than {half} to either side; \
                 write {wider}, or points farther apart in time",
                number(counts.round())
            );
            return Err(self.places.error(&key, reason));
        }
        Ok(TargetWords {
            target: target.clone(),
            period: self.period_clocks().max(1),
            edge_s: self.clock.period_s(),
            count_rad,
            start: self.encoder.count(self.initial_angle_rad()),
            word: is_word.then(|| Format::unsigned(bits)),
        })
    }

    /// Returns the scene with the words of `nominal`, of which it is a copy in a changed world. Every value given in
    /// newton metres is scaled by the ratio of the full commands, as in hardware whose words nobody has adapted to the
    /// new world.
    ///
    /// # Errors
    ///
    /// [`SceneError`], if the words still differ: then the change is one of the hardware, not of its world.
    pub fn with_words_of(mut self, nominal: &Self) -> Result<Self, SceneError> {
        let by = self.full_command_over(nominal);
        let scale = |values: &mut [&mut f64]| values.iter_mut().for_each(|value| **value *= by);
        scale(&mut [&mut self.wall.stiffness_nm_per_rad, &mut self.wall.damping_nm_s_per_rad]);
        if let Some(stiffness) = self.wall.ramp.as_mut().and_then(|ramp| ramp.stiffness_nm_per_rad.as_mut()) {
            scale(&mut [stiffness]);
        }
        if let Loop::Law(law) = &mut self.method.kind {
            scale(&mut law.efforts());
        }
        if self.model.datapath == Datapath::Linear {
            return Ok(self);
        }
        let (own, other) = (self.words()?, nominal.words()?);
        let realised = other.realised;
        if (LoopWords { realised, ..own }) != other {
            let reason = "it is of the hardware, not of the world around it";
            return Err(SceneError::at("the words change with it", reason));
        }
        Ok(self)
    }

    /// Returns the effort of a full command over the effort of a full command in another world.
    pub fn full_command_over(&self, nominal: &Self) -> f64 {
        match (self.stall_nm(), nominal.stall_nm()) {
            (Ok(own), Ok(other)) => own / other,
            // A linear mass whose amplifier is not described.
            _ => 1.0,
        }
    }

    /// Returns what the wall gives at rest, at the least: the stiffness that the words realise, or the method's if that
    /// is less, as far as the actuator goes.
    pub fn wall_push(&self, words: &LoopWords) -> Push {
        let features = self.method.kind.features();
        let asked = self.wall.stiffness_nm_per_rad;
        let wall = if features.gains.is_some() { asked } else { words.realised.stiffness_nm_per_rad };
        let ramp = |end: Option<f64>, start: f64| end.map_or(1.0, |end| (end / start).min(1.0));
        let weakest = self
            .wall
            .ramp
            .as_ref()
            .map_or(1.0, |to| ramp(to.stiffness_nm_per_rad, asked).min(ramp(to.scale, features.scale)));
        Push {
            stiffness: features.scale * weakest / (wall.recip() + features.stiffest.recip()),
            most: words.realised.torque_quantum_nm * libm::exp2(f64::from(words.config.pwm.width)),
        }
    }

    /// Returns the torque, or force, of a full command.
    fn stall_nm(&self) -> Result<f64, SceneError> {
        if let Some(compound) = self.network.as_deref() {
            return Ok(compound.stall(self.bridge));
        }
        match &self.device {
            Device::Motor(motor) => Ok(motor.stall_nm(self.bridge)),
            Device::Mass(_) if self.encoder.count_rad() == 0.0 => {
                Err(self.places.error("encoder.resolution", "missing; words need the length of a count"))
            }
            Device::Mass(_) => {
                let missing = || self.places.error("amplifier.full_scale", "missing; words need the force of a count");
                self.amplifier.map(|amplifier| amplifier.full_scale_n).ok_or_else(missing)
            }
        }
    }

    /// Returns the ramps of the words, starting from the words at the start.
    fn schedule(&self, stiffness: i64, unit: f64, si: &str, scale: i64) -> Result<Schedule, SceneError> {
        let Some(ramp) = &self.wall.ramp else { return Ok(Schedule::default()) };
        let start = self.clock.edges(ramp.from_s);
        let edges = self.clock.edges(ramp.to_s).saturating_sub(start).max(1);
        let to = |from, word: Option<i64>| word.map(|word| WordRamp::new(from, word, start, edges));
        let formats = (self.method.stiffness_format, self.method.scale_format);
        let last = ramp.stiffness_nm_per_rad.map(|k| self.gain("wall.ramp.stiffness", k, unit, si, formats.0));
        let shown = ramp.scale.map(|scale| self.gain("wall.ramp.scale", scale, 1.0, "", formats.1));
        let (stiffness, scale) = (to(stiffness, last.transpose()?), to(scale, shown.transpose()?));
        Ok(Schedule { stiffness, scale, ..Schedule::default() })
    }

    fn loop_config(&self) -> Result<LoopConfig, SceneError> {
        let method = &self.method;
        let dead_time = u32::try_from(self.clock.edges(method.pwm.dead_time_s));
        let most = 1u32 << (method.pwm.bits - 1);
        let dead_time = dead_time.ok().filter(|clocks| *clocks <= most).ok_or_else(|| {
            let most_s = f64::from(most) * self.clock.period_s();
            self.places.error(
                "method.pwm.dead_time",
                format!("longer than half a PWM period; write at most {} s", number_below(most_s)),
            )
        })?;
        Ok(LoopConfig {
            position_width: method.position_bits,
            stiffness: method.stiffness_format,
            damping: method.damping_format,
            period_width: method.period_bits,
            velocity_width: method.velocity_bits,
            rescaled: method.reference_rate_hz.is_some(),
            scale: method.scale_format,
            saturate: method.saturate,
            pwm: PwmConfig {
                width: method.pwm.bits,
                antiphase: method.pwm.antiphase,
                latched: method.pwm.latched,
                floating: method.pwm.floating,
                dead_time,
            },
            settling: method.settling,
        })
    }

    /// Returns the period word: the sample period in whole clocks, from 1 to the greatest that its width holds.
    pub(crate) fn check_period(&self) -> Result<i64, SceneError> {
        let word = Format::unsigned(self.method.period_bits);
        let period = i128::from(self.period_clocks());
        if period >= 1 && word.holds(period) {
            return Ok(word.wrap(period));
        }
        let clock_hz = self.clock.frequency_hz() as f64;
        let reason = format!(
            "{} Hz takes {period} clocks a sample; period_bits = {} at this clock accepts {} Hz to {} Hz",
            number(self.method.sample_rate_hz),
            self.method.period_bits,
            number_above(clock_hz / word.max() as f64),
            number(clock_hz),
        );
        Err(self.places.error("method.sample_rate", reason))
    }

    /// Returns the word nearest to `value / unit`; the value is in `si`.
    pub(crate) fn gain(&self, key: &str, value: f64, unit: f64, si: &str, format: Format) -> Result<i64, SceneError> {
        gain(&self.places, key, value, unit, si, format)
    }

    /// Returns the numbers that the scene's method is made of, with this stiffness and damping.
    pub fn setting(&self, words: &LoopWords, [stiffness_n_per_m, damping_n_s_per_m]: [f64; 2]) -> Setting<'_> {
        let LoopWords { config, realised: Realised { torque_quantum_nm, count_rad, .. }, .. } = words;
        let surface = self.surface(words);
        let Units { stiffness, damping, effort, .. } = self.device.units();
        let units = [stiffness, damping, effort];
        Setting {
            stiffness_n_per_m,
            damping_n_s_per_m,
            wall_n_per_m: self.wall.stiffness_nm_per_rad,
            mass_kg: match &self.device {
                Device::Motor(motor) => motor.inertia_kg_m2(),
                Device::Mass(mass) => mass.mass_kg,
            },
            period_s: self.sample_period_s(),
            period: words.period,
            clock_hz: self.clock.frequency_hz(),
            start_m: match self.model.encoder {
                EncoderModel::Quantised | EncoderModel::Loaded => -(surface as f64) * count_rad,
                EncoderModel::Ideal => self.initial_angle_rad() - self.wall.position_rad,
            },
            quantum_n: *torque_quantum_nm,
            limit_n: torque_quantum_nm * Format::unsigned(config.pwm.width).max() as f64,
            count_m: *count_rad,
            widths: LawWidths {
                width: config.position_width,
                stiffness: config.stiffness,
                damping: config.damping,
                period_width: config.period_width,
                scale: config.scale,
                torque_width: config.pwm.width,
            },
            shaper_hz: self.method.shaper_hz,
            units,
            places: &self.places,
        }
    }

    /// Returns the counts from the start to the wall's surface, as the loop reads it: a law in floats does not wrap.
    pub fn surface(&self, words: &LoopWords) -> i64 {
        match self.model.datapath {
            Datapath::Law => self.wall_from_start(),
            _ => Format::signed(words.config.position_width).wrap(words.reference.into()),
        }
    }

    /// Returns keys and values of the stiffness and the damping that the loop's words hold: those of the wall, or of
    /// the method.
    pub fn gains(&self) -> [(&'static str, f64); 2] {
        let own = self.method.kind.features().gains;
        let [stiffness, damping] = if self.target.is_some() { ["method.kp", "method.kd"] } else { WALL_GAINS };
        own.unwrap_or([(stiffness, self.wall.stiffness_nm_per_rad), (damping, self.wall.damping_nm_s_per_rad)])
    }

    /// Refuses words that make no datapath.
    pub(crate) fn check_datapath(&self, words: &LoopWords) -> Result<(), SceneError> {
        let realised = &words.realised;
        let setting = self.setting(words, [realised.stiffness_nm_per_rad, realised.damping_nm_s_per_rad]);
        match self.model.datapath {
            Datapath::Law => self.method.kind.float(&setting).map(drop),
            Datapath::Words | Datapath::Linear => match AxisLoop::new(&self.method.kind, &setting, words.config) {
                Ok(_) => Ok(()),
                Err(Unmade::Scene(error)) => Err(error),
                Err(Unmade::Config(error)) => Err(self.error("method.kind", error.to_string())),
            },
        }
    }
}
