//! The sampled wall: spring, and damping by an estimator at its own rate. Its law in floats is [`Wall`].

use hpu_datapath::{ButterworthConfig, Estimator, SampledWallConfig};

use crate::method::published::{Features, Layer, Published};
use crate::method::rows::method_velocity_filter;
use crate::method::setting::{Setting, Unmade};
use crate::method::wall::Wall;
use crate::schema::Otherwise::{self, Is};
use crate::schema::quantity::Sense::{self, NotNegative};
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::schema::{Choice, Group, Key, Own, Quantity, Whole, keys, named};
use crate::text::message::{number_above, number_below};

keys! { sampled_wall: "method" of ["sampled_wall"];
    /// Whether the spring reads the sampled position or the position at once.
    spring: Choice<bool> = Choice::new(|| vec![("held", false), ("live", true)], Is(false));
    /// How the velocity is estimated: difference of two samples, low-pass filter, difference over a window, first-order
    /// adaptive window, time between encoder edges, or Levant's differentiator.
    estimator: Choice<Estimator> =
        Choice::new(|| named(ESTIMATORS, Estimator::name), Is(Estimator::Difference));
    /// Samples of the spring for one sample of the velocity.
    velocity_every: Whole<u32> = Whole::new(1, 1 << 20, Is(1));
    /// Weight of a new sample in the filter of `filtered`: 2^-`filter_shift`.
    filter_shift: Whole<u32> = Whole::new(0, 16, Is(3));
    /// The filter of `filtered` by its corner and order, instead of `filter_shift`.
    velocity_filter: Own = Own::section(Otherwise::Said("none"));
    /// Samples in the window of `window`, or at most in that of `foaw`.
    window: Whole<u32> = Whole::new(1, 64, Is(8));
    /// Noise of the position that `foaw` assumes, in counts.
    noise: Whole<u32> = Whole::new(0, 15, Is(1));
    /// Greatest acceleration that `levant` follows; its gains are those of Levant for it.
    acceleration: Quantity =
        Quantity::along(|axis| axis.acceleration, Sense::Positive, Otherwise::Said("none; `levant` needs it"));
    /// Fraction bits of the velocity.
    velocity_frac: Whole<u32> = Whole::new(0, 16, Is(8));
    /// Negative damping, inside the wall and outside.
    negative_damping: Quantity = Quantity::along(|axis| axis.damping, NotNegative, Is(0.0));
}

/// The values of `method.estimator`. `filtered` has two blocks: that of the second order is the last of all estimators.
const ESTIMATORS: &[Estimator] = Estimator::ALL.split_last().expect("not empty").1;

/// The bits of the weight of a filter of the first order that is given by its corner.
const WEIGHT_BITS: u32 = 16;

/// The units of a one in the coefficients of a filter of the second order.
const ONE: f64 = (1u32 << 30) as f64;

/// A sampled wall in a scene.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SampledWallMethod {
    /// Whether the spring reads the position at once, as in the hybrid loop.
    pub live: bool,
    /// The estimator of the velocity.
    pub estimator: Estimator,
    /// Periods of the spring per period of the velocity.
    pub ratio: u32,
    /// The filter's weight is the inverse of `2^shift`, unless it has a corner.
    pub shift: u32,
    /// The filter's corner, if that is given.
    pub corner_hz: Option<f64>,
    /// The filter's order, 1 or 2.
    pub order: u32,
    /// Samples of the window.
    pub window: u32,
    /// Noise bound of the adaptive window, in counts.
    pub noise: u32,
    /// Greatest acceleration that Levant's differentiator follows, in rad/s2; 0 with other estimators.
    pub acceleration_rad_per_s2: f64,
    /// Fraction bits of the velocity.
    pub velocity_frac: u32,
    /// Negative damping, inside the wall and outside.
    pub relief_nm_s_per_rad: f64,
}

impl SampledWallMethod {
    /// Returns the weight of a new difference in the filter, as a word and the number of its fraction bits, at this
    /// sample period: of a corner `f` the word nearest to `1 - exp(-2 pi f T)`, `T` being the velocity's period.
    pub fn weight(&self, sample_period_s: f64) -> (u32, u32) {
        let Some(corner_hz) = self.corner_hz else { return (1, self.shift) };
        let share = -libm::expm1(-corner_hz * self.turn_s(sample_period_s));
        ((share * f64::from(1u32 << WEIGHT_BITS)).round() as u32, WEIGHT_BITS)
    }

    /// Returns the words `B0`, `A1` and `A2` of a Butterworth filter at this sample period, in units of `2^-30`, and
    /// the fraction bits with which it comes to rest. `None` where no filter is of the second order, or `B0` is 0.
    ///
    /// Bilinear transform with the corner `f` prewarped: with `K = tan(pi f T)` and `D = 1 + sqrt(2) K + K^2`, `B0` is
    /// the word nearest to `K^2 / D`, `A1` that nearest to `2 (K^2 - 1) / D`.
    pub fn section(&self, sample_period_s: f64) -> Option<([i64; 3], u32)> {
        let corner_hz = self.corner_hz.filter(|_| self.order == 2)?;
        let k = libm::tan(0.5 * corner_hz * self.turn_s(sample_period_s));
        let d = 1.0 + std::f64::consts::SQRT_2 * k + k * k;
        let word = |value: f64| (value * ONE).round() as i32;
        let (b0, a1) = (word(k * k / d).cast_unsigned(), word(2.0 * (k * k - 1.0) / d));
        let guard = (1u32 << 28).div_ceil(b0.max(1)).next_power_of_two().trailing_zeros() + 1;
        let config = ButterworthConfig { b0, a1, ..ButterworthConfig::default() };
        (b0 > 0).then(|| ([b0.into(), a1.into(), config.a2()], guard))
    }

    /// Returns the corner that the filter's words have at this sample period, in hertz. `None` where nothing is
    /// filtered.
    pub fn realised_corner_hz(&self, sample_period_s: f64) -> Option<f64> {
        if let Some(([b0, a1, a2], _)) = self.section(sample_period_s) {
            let k = (4.0 * b0 as f64 / (ONE - a1 as f64 + a2 as f64)).sqrt();
            return Some(2.0 * libm::atan(k) / self.turn_s(sample_period_s));
        }
        let (word, frac) = self.weight(sample_period_s);
        let share = f64::from(word) * 0.5f64.powi(frac.cast_signed());
        let corner_hz = -libm::log1p(-share) / self.turn_s(sample_period_s);
        (self.estimator == Estimator::Filtered && corner_hz.is_finite()).then_some(corner_hz)
    }

    /// Returns `2 pi T`, where `T` is the velocity's period.
    fn turn_s(&self, sample_period_s: f64) -> f64 {
        std::f64::consts::TAU * f64::from(self.ratio) * sample_period_s
    }

    /// Returns the words of the filter of a scene. A corner whose weight rounds to 0 or to 1 is refused.
    fn filter(&self, setting: &Setting) -> Result<(u32, u32), SceneError> {
        let found = self.weight(setting.period_s);
        let whole = 1u32 << WEIGHT_BITS;
        if self.corner_hz.is_some() && self.order == 1 && !(1..whole).contains(&found.0) {
            let half = 0.5 / f64::from(whole);
            let [least_hz, most_hz] =
                [-half, half - 1.0].map(|less| -libm::log1p(less) / self.turn_s(setting.period_s));
            let reason = format!(
                "rounds to a weight of {} in {WEIGHT_BITS} bits; accepted at this sample rate: {} to {} Hz",
                found.0 / whole,
                number_above(least_hz),
                number_below(most_hz)
            );
            return Err(setting.places.error("method.velocity_filter.corner", reason));
        }
        Ok(found)
    }

    /// Returns the words `B0` and `A1` and the further fraction bits of the filter of a scene, or those of the default
    /// where it is not of the second order. A corner at which the filter needs more bits than its block has is refused.
    fn filter_2(&self, setting: &Setting) -> Result<ButterworthConfig, SceneError> {
        let default = ButterworthConfig::default();
        let Some(corner_hz) = self.corner_hz.filter(|_| self.order == 2) else { return Ok(default) };
        let room = (40 - setting.widths.width.min(40)).min(30).saturating_sub(self.velocity_frac);
        // Closer to half of the rate the filter takes nothing off.
        let most_hz = 0.98 * std::f64::consts::PI / self.turn_s(setting.period_s);
        match self.section(setting.period_s) {
            Some(([b0, a1, _], guard)) if guard <= room && corner_hz <= most_hz => {
                Ok(ButterworthConfig { b0: b0 as u32, a1: a1 as i32, guard, ..default })
            }
            _ => {
                // The least corner whose K^2 / D is the least share c that the fraction bits allow.
                let c = 0.5f64.powi(room.cast_signed() + 1);
                let k = (c + (c * c + 2.0 * c * (1.0 - c)).sqrt()) / (std::f64::consts::SQRT_2 * (1.0 - c));
                let least_hz = 2.0 * libm::atan(k) / self.turn_s(setting.period_s);
                let reason = format!(
                    "a filter of the second order has {room} bits beside those of position and velocity; accepted at \
                     this sample rate: {} to {} Hz",
                    number_above(least_hz),
                    number_below(most_hz)
                );
                Err(setting.places.error("method.velocity_filter.corner", reason))
            }
        }
    }

    /// Returns the words of Levant's gains, `1.5 sqrt(L)` and `1.1 L`, for an acceleration of `L` counts per sample
    /// squared.
    fn levant(&self, setting: &Setting) -> Result<(u32, u32), SceneError> {
        let period_s = f64::from(self.ratio) * setting.period_s;
        let bound = self.acceleration_rad_per_s2 * period_s * period_s / setting.count_m;
        let (root_gain, slew) = (1.5 * bound.sqrt() * 256.0, 1.1 * bound * f64::from(1u32 << self.velocity_frac));
        let word = |gain: f64| (gain.round() < f64::from(1u32 << 20)).then_some(gain.round() as u32);
        let (Some(root_gain), Some(slew)) = (word(root_gain), word(slew)) else {
            let reason = "too great: in a sample it is more than a word of 20 bits; write less, or sample more often";
            return Err(setting.places.error("method.acceleration", reason));
        };
        if slew == 0 && self.estimator == Estimator::Levant {
            let reason = "too small: a sample adds less than half of the velocity's last bit; write more, or give \
                          velocity_frac more bits";
            return Err(setting.places.error("method.acceleration", reason));
        }
        Ok((root_gain, slew))
    }
}

/// Returns the keys of estimators that this one does not take.
fn foreign(estimator: Estimator) -> impl Iterator<Item = &'static str> {
    let owners = [
        ("method.filter_shift", &[Estimator::Filtered][..]),
        ("method.velocity_filter", &[Estimator::Filtered]),
        ("method.window", &[Estimator::Window, Estimator::Foaw]),
        ("method.noise", &[Estimator::Foaw]),
        ("method.acceleration", &[Estimator::Levant]),
    ];
    owners.into_iter().filter(move |(_, owners)| !owners.contains(&estimator)).map(|(key, _)| key)
}

impl Published for SampledWallMethod {
    type Block = hpu_datapath::SampledWall;
    type Float = Wall;

    const KEYS: &'static Group = &sampled_wall::GROUP;
    const LAYERS: &'static [Layer] = &[
        Layer { label: "dual rate", set: &[("method.velocity_every", "10")] },
        Layer { label: "FOAW", set: &[("method.estimator", "foaw")] },
        Layer { label: "input shaper", set: &[("method.shaper.cutoff", "2.5 Hz")] },
    ];

    fn read(s: &Section) -> Result<Self, SceneError> {
        use sampled_wall as key;
        let estimator = s.read(&key::estimator)?;
        let mut foreign = foreign(estimator).filter_map(|path| path.strip_prefix("method."));
        if let Some(key) = foreign.find(|key| s.has(key)) {
            return Err(s.error(key, "not a number of this estimator; leave it out"));
        }
        let filter = s.section("velocity_filter")?;
        filter.accept(&[])?;
        let (corner_hz, order) = match s.has("velocity_filter") {
            true if s.has("filter_shift") => {
                return Err(s.error("filter_shift", "the filter has a corner; leave one of the two out"));
            }
            true => {
                let corner_hz = filter.read(&method_velocity_filter::corner)?;
                (Some(corner_hz), filter.read(&method_velocity_filter::order)?)
            }
            false => (None, 1),
        };
        Ok(Self {
            live: s.read(&key::spring)?,
            estimator,
            ratio: s.read(&key::velocity_every)?,
            shift: s.read(&key::filter_shift)?,
            corner_hz,
            order,
            window: s.read(&key::window)?,
            noise: s.read(&key::noise)?,
            acceleration_rad_per_s2: match s.given(&key::acceleration)? {
                Some(acceleration) => acceleration,
                None if estimator == Estimator::Levant => {
                    let reason = "missing; levant needs the greatest acceleration that it follows, as \"2000 rad/s2\"";
                    return Err(s.error("acceleration", reason));
                }
                None => 0.0,
            },
            velocity_frac: s.read(&key::velocity_frac)?,
            relief_nm_s_per_rad: s.read(&key::negative_damping)?,
        })
    }

    fn block(&self, setting: &Setting) -> Result<Self::Block, Unmade> {
        let Self { live, estimator, ratio, window, noise, velocity_frac, relief_nm_s_per_rad, .. } = *self;
        let (weight, shift) = self.filter(setting)?;
        let unit = setting.stiffness_unit() * (self.features().velocity_samples * setting.period_s);
        let widths = setting.widths;
        let relief = setting.word("method.negative_damping", relief_nm_s_per_rad, unit, "", widths.damping)?;
        let (root_gain, slew) = self.levant(setting)?;
        let ButterworthConfig { b0, a1, guard, .. } = self.filter_2(setting)?;
        let estimator = if self.order == 2 { Estimator::Butterworth } else { estimator };
        Ok(Self::Block::new(SampledWallConfig {
            widths,
            spring_held: !live,
            estimator,
            ratio,
            shift,
            weight,
            window,
            noise,
            velocity_frac,
            relief,
            root_gain,
            slew,
            b0,
            a1,
            guard,
        })?)
    }

    fn float(&self, setting: &Setting) -> Result<Wall, SceneError> {
        if !self.features().has_float {
            let reason = "the law in floats takes the difference; write \"difference\", or model.datapath = \"words\"";
            return Err(setting.places.error("method.estimator", reason));
        }
        let mut wall = setting.wall(self.ratio);
        wall.relief_n_s_per_m = self.relief_nm_s_per_rad;
        Ok(wall)
    }

    fn efforts(&mut self) -> Vec<&mut f64> {
        vec![&mut self.relief_nm_s_per_rad]
    }

    fn features(&self) -> Features {
        let window = if self.estimator == Estimator::Window { self.window } else { 1 };
        Features {
            live: self.live,
            velocity_samples: f64::from(self.ratio) * f64::from(window),
            times_lines: self.estimator == Estimator::EdgeTimer,
            has_float: self.estimator == Estimator::Difference,
            ..Features::default()
        }
    }

    fn unused(&self) -> Vec<&'static str> {
        let replaced = self.corner_hz.map(|_| "method.filter_shift");
        foreign(self.estimator).chain(replaced).collect()
    }
}
