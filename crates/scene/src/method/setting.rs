//! The numbers of a scene that a law is made of.

use std::fmt;

use hpu_datapath::{ConfigError, LawWidths};
use hpu_signal::Format;

use crate::method::wall::Wall;
use crate::schema::source::Places;
use crate::schema::source::SceneError;
use crate::text::message::{number, number_above, number_below};

/// The reason why a law cannot be made.
#[derive(Debug)]
pub enum Unmade {
    /// A value of the scene does not fit its word.
    Scene(SceneError),
    /// Its widths do not make a datapath.
    Config(ConfigError),
}

impl fmt::Display for Unmade {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Scene(error) => error.fmt(f),
            Self::Config(error) => error.fmt(f),
        }
    }
}

impl From<SceneError> for Unmade {
    fn from(error: SceneError) -> Self {
        Self::Scene(error)
    }
}

impl From<ConfigError> for Unmade {
    fn from(error: ConfigError) -> Self {
        Self::Config(error)
    }
}

/// The numbers of a scene that a law is made of, in SI units. Metres and newtons stand for radians and newton metres as
/// well.
pub struct Setting<'a> {
    /// The wall's stiffness and damping, or the method's own (see [`Features::gains`](super::Features::gains)): as the
    /// words realise them, or as the scene asks for them.
    pub stiffness_n_per_m: f64,
    pub(crate) damping_n_s_per_m: f64,
    /// The wall's stiffness as the scene asks for it.
    pub(crate) wall_n_per_m: f64,
    /// The device's mass, or its moment of inertia at the shaft.
    pub(crate) mass_kg: f64,
    /// The sample period, also in clocks.
    pub(crate) period_s: f64,
    pub(crate) period: i64,
    pub(crate) clock_hz: u64,
    /// The device at the start, beyond the wall's surface.
    pub(crate) start_m: f64,
    /// The force of one PWM count.
    pub quantum_n: f64,
    /// The greatest force of the actuator.
    pub limit_n: f64,
    /// The position of one count.
    pub count_m: f64,
    pub(crate) widths: LawWidths,
    /// The cutoff of the input shaper behind the law, if there is one.
    pub(crate) shaper_hz: Option<f64>,
    /// The units of stiffness, damping and effort of the encoder's body.
    pub(crate) units: [&'static str; 3],
    pub(crate) places: &'a Places,
}

impl Setting<'_> {
    /// Returns the stiffness of one PWM count per count.
    pub(crate) fn stiffness_unit(&self) -> f64 {
        self.quantum_n / self.count_m
    }

    /// Returns the energy of one PWM count times one count.
    pub(crate) fn energy_unit_j(&self) -> f64 {
        self.quantum_n * self.count_m
    }

    /// Returns the word of a constant of the hardware nearest to `value / unit`; the value is in `si`.
    pub(crate) fn word(&self, key: &str, value: f64, unit: f64, si: &str, format: Format) -> Result<u32, SceneError> {
        let word = gain(self.places, key, value, unit, si, format)?;
        Ok(u32::try_from(word).expect("an unsigned format of at most 32 bits"))
    }

    /// Returns a wall whose velocity is computed every `ratio` samples.
    pub(crate) fn wall(&self, ratio: u32) -> Wall {
        Wall::new(self.stiffness_n_per_m, self.damping_n_s_per_m, ratio, self.period_s, self.start_m)
    }
}

/// Returns the word nearest to `value / unit`; the value is in `si`.
pub(crate) fn gain(
    places: &Places,
    key: &str,
    value: f64,
    unit: f64,
    si: &str,
    format: Format,
) -> Result<i64, SceneError> {
    let exact = value / unit / format.lsb();
    let nearest = exact.round();
    let (least, most) = (format.lsb() * unit, format.max() as f64 * format.lsb() * unit);
    if nearest > format.max() as f64 {
        let reason = format!(
            "{} {si} does not fit {format}; write at most {} {si}, or more integer bits",
            number(value),
            number_below(most)
        );
        return Err(places.error(key, reason));
    }
    if nearest == 0.0 && value > 0.0 {
        let reason = format!(
            "{} {si} rounds to zero in {format}; write 0, at least {} {si}, or more fraction bits",
            number(value),
            number_above(least)
        );
        return Err(places.error(key, reason));
    }
    Ok(nearest as i64)
}
