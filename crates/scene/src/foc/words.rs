//! The words of a loop behind field-oriented control.

use std::f64::consts::TAU;

use hpu_datapath::foc::{FocConfig, FocKnobLoop, KnobConfig};
use hpu_datapath::{LawWidths, torque_table};
use hpu_signal::Format;

use crate::foc::FocScene;
use crate::head::miss::Miss;
use crate::method::published::Published as _;
use crate::method::table::TableMethod;
use crate::method::{Setting, Unmade, gain};
use crate::schema::source::SceneError;
use crate::text::message::{number, number_above, number_below};

/// The words of a loop behind field-oriented control, and their units.
#[derive(Clone, PartialEq, Debug)]
pub struct FocWords {
    /// Formats and times of the wiring.
    pub config: KnobConfig,
    /// The wall's count, modulo the position's width.
    pub reference: i64,
    /// Stiffness and damping of the wall.
    pub gains: [i64; 2],
    /// Period of the law, in clocks.
    pub period: i64,
    /// Position at which the field's angle is taken for 0, modulo its width.
    pub zero: i64,
    /// Gains of the current controllers: of the error, and of its sum.
    pub current_gains: [i64; 2],
    /// Angle of a count of the position.
    pub count_rad: f64,
    /// Current of one unit of the words, and its torque.
    pub unit: [f64; 2],
    /// Stiffness and damping that the words realise, in N·m/rad and N·m·s/rad.
    pub realised: [f64; 2],
    /// The miss of the stiffness, if its word is far from it.
    pub stiffness_miss: Option<Miss>,
    /// The least and the greatest count, from the position's 0, that the words hold.
    pub reach: [i64; 2],
    /// The same numbers before they became words.
    pub floats: FocFloats,
}

/// The numbers of the loop in `f64`: torques and currents in units of the words' currents, voltages in theirs.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct FocFloats {
    /// Units of a code of the converters.
    pub unit: f64,
    /// Stiffness per count, and damping per count and sample, of the wall.
    pub stiffness: f64,
    /// The damping.
    pub damping: f64,
    /// The greatest torque.
    pub top: f64,
    /// The torques of the table towards smaller counts, of which so many are used.
    pub torques: [f64; torque_table::MOST_TORQUES],
    /// How many they are; 0 without a table.
    pub length: usize,
    /// Counts from one torque to the next.
    pub spacing: u32,
    /// Voltage for an error, and its change in a sample, of a current controller.
    pub proportional: f64,
    /// The latter.
    pub integral: f64,
    /// The greatest voltage of a controller.
    pub limit: f64,
    /// The voltage of the supply.
    pub supply: f64,
    /// Position at which the field's angle is taken for 0, and turns of the field in a count.
    pub zero: i64,
    /// The latter.
    pub turns_per_count: f64,
    /// Steps of a full duty.
    pub steps: f64,
}

impl FocFloats {
    /// Returns the torque of the table at a position.
    pub fn texture(&self, position: i64) -> f64 {
        if self.length == 0 {
            return 0.0;
        }
        let place = position.rem_euclid(self.length as i64 * i64::from(self.spacing)) as usize;
        let (index, part) = (place / self.spacing as usize, (place % self.spacing as usize) as f64);
        let (from, to) = (self.torques[index], self.torques[(index + 1) % self.length]);
        from + (to - from) * (part / f64::from(self.spacing))
    }
}

impl FocScene {
    /// Returns the words of the loop.
    ///
    /// With `i` the current of a converter's code over 2^3, `q = 3/2 p λ i` its torque, `c` the angle of a count and
    /// `T` the law's period, stiffness and damping are `k c / q` and `b c / (q T)`; with `u` the supply over 2^14, the
    /// gains of the currents for a bandwidth `f` are `2π f L_q i / u` and `2π f R T_pwm i / u`. Every word is the
    /// nearest one.
    ///
    /// # Errors
    ///
    /// [`SceneError`] when a word does not fit its format, or a gain above zero rounds to zero; when the times of the
    /// modulator do not fit each other.
    pub fn words(&self) -> Result<FocWords, SceneError> {
        let (method, motor) = (&self.method, &self.pmsm);
        let foc = self.foc_config()?;
        let unit_a = self.code_a() / f64::from(1u32 << foc.frac);
        let (unit_nm, count_rad) = (motor.torque_constant_nm_per_a() * unit_a, self.count_rad());
        let (period, edge_s) = (self.period_clocks(), self.clock.period_s());
        let width = Format::unsigned(method.position_bits);
        let gain = |key, value, unit, si, format| gain(&self.places, key, value, unit, si, format);
        let stiffness_unit = unit_nm / count_rad;
        let damping_unit = stiffness_unit * (period as f64 * edge_s);
        let (mut gains, mut realised, mut stiffness_miss) = ([0; 2], [0.0; 2], None);
        if let Some(wall) = &self.wall {
            let asked = [wall.stiffness_nm_per_rad, wall.damping_nm_s_per_rad];
            let [spring, damper] = [method.stiffness_format, method.damping_format];
            gains = [
                gain("wall.stiffness", asked[0], stiffness_unit, "N.m/rad", spring)?,
                gain("wall.damping", asked[1], damping_unit, "N.m.s/rad", damper)?,
            ];
            realised = [spring.to_f64(gains[0]) * stiffness_unit, damper.to_f64(gains[1]) * damping_unit];
            stiffness_miss = Miss::of(asked[0] / stiffness_unit, spring);
        }
        let (bandwidth_hz, unit_v) = (method.bandwidth_hz, self.bridge.supply_v / libm::exp2(14.0));
        let period_s = 2.0 * f64::from(foc.steps) * edge_s;
        let of_current =
            |ohm: f64| gain("method.current_bandwidth", bandwidth_hz, unit_v / (TAU * ohm * unit_a), "Hz", foc.gain);
        let ohms = [motor.inductance_h[1], motor.resistance_ohm * period_s];
        let current_gains = [of_current(ohms[0])?, of_current(ohms[1])?];
        let [proportional, integral] = ohms.map(|ohm| bandwidth_hz * TAU * ohm * unit_a / unit_v);
        let mut config = KnobConfig {
            foc,
            stiffness: method.stiffness_format,
            damping: method.damping_format,
            table_bits: 1,
            shift: 0,
            torques: [0; torque_table::MOST_TORQUES],
            ..KnobConfig::default()
        };
        let most = Format::unsigned(config.period_width).max();
        if i128::from(period) > most {
            let least = number_above(self.clock.frequency_hz() as f64 / most as f64);
            let reason = format!("{} Hz; write at this clock {least} Hz or more", number(method.sample_rate_hz));
            return Err(self.error("method.sample_rate", reason));
        }
        if let Some(table) = &method.table {
            let table = self.table(table, &config, (unit_nm, count_rad))?;
            (config.table_bits, config.shift, config.torques) = (table.table_bits, table.shift, table.torques);
        }
        let zero = (method.zero_rad / count_rad).round() as i64 - self.origin();
        let (reference, reach) = self.reach(zero, i128::from(foc.counts))?;
        let floats = self.floats(&config, [stiffness_unit, damping_unit, unit_nm], [proportional, integral], zero);
        FocKnobLoop::new(config).map_err(|error| self.error("method.kind", error.to_string()))?;
        Ok(FocWords {
            config,
            reference,
            gains,
            period: period as i64,
            zero: width.wrap(zero.into()),
            current_gains,
            count_rad,
            unit: [unit_a, unit_nm],
            realised,
            stiffness_miss,
            reach,
            floats,
        })
    }

    /// Returns the wall's word, and the counts in which the loop reads the place where the device is. `zero` is the
    /// count of the field's angle 0, `turn` the number of counts of a turn.
    fn reach(&self, zero: i64, turn: i128) -> Result<(i64, [i64; 2]), SceneError> {
        let (method, count_rad) = (&self.method, self.count_rad());
        let width = Format::unsigned(method.position_bits);
        let half = 1i64 << (method.position_bits - 1);
        let mut reach = [i64::MIN, i64::MAX];
        let mut reference = 0;
        if let Some(wall) = &self.wall {
            let from = self.wall_count().saturating_sub(self.origin());
            if !wall.wraps && !(1 - half..=half).contains(&from) {
                let at = |count: i64| count.saturating_add(self.origin()) as f64 * count_rad;
                let reason = format!(
                    "does not fit {} bits; write {} to {} rad, or more bits of the position",
                    method.position_bits,
                    number_above(at(1 - half)),
                    number_below(at(half))
                );
                return Err(self.error("wall.position", reason));
            }
            reference = width.wrap(from.into());
            reach = [from.saturating_sub(half), from.saturating_add(half - 1)];
        }
        // A counter that wraps at whole turns knows the field's angle for ever.
        if (1i128 << method.position_bits) % turn != 0 {
            reach = [reach[0].max(zero.saturating_sub(half)), reach[1].min(zero.saturating_add(half - 1))];
        }
        Ok((reference, reach))
    }

    /// Returns the law of real numbers of a loop in words, in its units. `units` are those of stiffness, damping and
    /// torque.
    fn floats(&self, config: &KnobConfig, units: [f64; 3], [proportional, integral]: [f64; 2], zero: i64) -> FocFloats {
        let (method, foc, [stiffness_unit, damping_unit, unit_nm]) = (&self.method, &config.foc, units);
        let mut floats = FocFloats {
            unit: f64::from(1u32 << foc.frac),
            stiffness: self.wall.map_or(0.0, |wall| wall.stiffness_nm_per_rad / stiffness_unit),
            damping: self.wall.map_or(0.0, |wall| wall.damping_nm_s_per_rad / damping_unit),
            top: ((1u64 << config.torque_width()) - 1) as f64,
            torques: [0.0; torque_table::MOST_TORQUES],
            length: 0,
            spacing: 1,
            proportional,
            integral,
            limit: foc.limit.into(),
            supply: libm::exp2(f64::from(foc.voltage_width - 1)),
            zero: Format::unsigned(method.position_bits).wrap(zero.into()),
            turns_per_count: f64::from(foc.pole_pairs) / f64::from(foc.counts),
            steps: foc.steps.into(),
        };
        if let Some(table) = &method.table {
            (floats.length, floats.spacing) = (table.length, table.spacing);
            floats.torques = table.torques_nm.map(|torque_nm| -torque_nm / unit_nm);
        }
        floats
    }

    /// Returns the words of the current loops.
    fn foc_config(&self) -> Result<FocConfig, SceneError> {
        let (method, clock_hz) = (&self.method, self.clock.frequency_hz() as f64);
        let sensors = method.currents.map(|index| self.sampled(index));
        let [Some(a), Some(b)] = sensors else {
            return Err(self.error("device.sensors", "no currents; write those of the phases a and b"));
        };
        let steps = (0.5 * clock_hz / method.pwm_hz).round();
        // The modulator has duties of 16 bits at most, and the samples come within half of a period.
        let latency = a.latency.max(b.latency).max(1);
        let [least, most] = [0.5 * clock_hz / 65534.0, 0.5 * clock_hz / (latency + 1).max(3) as f64];
        if !(least..=most).contains(&(0.5 * clock_hz / steps)) {
            let reason = format!(
                "{} Hz; with words of the currents {latency} clocks after their start, write {} to {} Hz",
                number(method.pwm_hz),
                number_above(least),
                number_below(most)
            );
            return Err(self.error("method.pwm_frequency", reason));
        }
        let steps = steps as u32;
        let clocks = |key: &str, time_s: f64, most: u32| {
            let clocks = self.clock.edges(time_s);
            u32::try_from(clocks).ok().filter(|clocks| *clocks <= most).ok_or_else(|| {
                let most_s = number_below(f64::from(most) / clock_hz);
                self.error(key, format!("{clocks} clocks; write at most {most_s} s"))
            })
        };
        let default = FocConfig::default();
        let counts = (TAU / self.count_rad()).round() as u32;
        if !(16..=1 << 20).contains(&counts) {
            let key = if method.position.is_some() { "method.position" } else { "encoder.lines" };
            return Err(self.error(key, format!("{counts} counts in a turn; write 16 to 2^20")));
        }
        Ok(FocConfig {
            position_width: method.position_bits,
            pole_pairs: self.pmsm.pole_pairs,
            counts,
            code_width: a.bits,
            duty_width: steps.ilog2() + 1,
            steps,
            dead_time: clocks("method.dead_time", method.dead_time_s, steps - 1)?,
            min_pulse: clocks("method.min_pulse", method.min_pulse_s, steps / 2)?,
            sample_delay: latency as u32,
            ..default
        })
    }

    /// Returns the words of the table.
    fn table(
        &self,
        table: &TableMethod,
        config: &KnobConfig,
        (quantum_n, count_m): (f64, f64),
    ) -> Result<hpu_datapath::TableConfig, SceneError> {
        let widths = LawWidths {
            width: config.foc.position_width,
            stiffness: config.stiffness,
            damping: config.damping,
            period_width: config.period_width,
            torque_width: config.torque_width(),
            ..LawWidths::default()
        };
        let crate::head::Units { stiffness, damping, effort, .. } = self.device.units();
        let setting = Setting {
            stiffness_n_per_m: 0.0,
            damping_n_s_per_m: 0.0,
            wall_n_per_m: 0.0,
            mass_kg: self.pmsm.inertia_kg_m2,
            period_s: self.period_clocks() as f64 * self.clock.period_s(),
            period: self.period_clocks() as i64,
            clock_hz: self.clock.frequency_hz(),
            start_m: 0.0,
            quantum_n,
            limit_n: quantum_n * widths.top() as f64,
            count_m,
            widths,
            shaper_hz: None,
            units: [stiffness, damping, effort],
            places: &self.places,
        };
        match table.block(&setting) {
            Ok(block) => Ok(*block.config()),
            Err(Unmade::Scene(error)) => Err(error),
            Err(Unmade::Config(error)) => Err(self.error("method.torques", error.to_string())),
        }
    }
}
