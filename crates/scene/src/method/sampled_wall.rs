//! The sampled wall: spring, and damping by an estimator at its own rate. Its law in floats is [`Wall`].

use hpu_datapath::{Estimator, SampledWallConfig};

use crate::method::published::{Features, Layer, Published};
use crate::method::setting::{Setting, Unmade};
use crate::method::wall::Wall;
use crate::schema::Otherwise::{self, Is};
use crate::schema::quantity::Sense::{self, NotNegative};
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::schema::{Choice, Group, Key, Quantity, Whole, keys, named};

keys! { sampled_wall: "method" of ["sampled_wall"];
    /// Whether the spring reads the sampled position or the position at once.
    spring: Choice<bool> = Choice::new(|| vec![("held", false), ("live", true)], Is(false));
    /// How the velocity is estimated: difference of two samples, low-pass filter, difference over a window, first-order
    /// adaptive window, time between encoder edges, or Levant's differentiator.
    estimator: Choice<Estimator> =
        Choice::new(|| named(&Estimator::ALL, Estimator::name), Is(Estimator::Difference));
    /// Samples of the spring for one sample of the velocity.
    velocity_every: Whole<u32> = Whole::new(1, 1 << 20, Is(1));
    /// Weight of a new sample in the filter of `filtered`: 2^-`filter_shift`.
    filter_shift: Whole<u32> = Whole::new(0, 16, Is(3));
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

/// A sampled wall in a scene.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SampledWallMethod {
    /// Whether the spring reads the position at once, as in the hybrid loop.
    pub live: bool,
    /// The estimator of the velocity.
    pub estimator: Estimator,
    /// Periods of the spring per period of the velocity.
    pub ratio: u32,
    /// `log2` of the filter's weight.
    pub shift: u32,
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
        Ok(Self {
            live: s.read(&key::spring)?,
            estimator,
            ratio: s.read(&key::velocity_every)?,
            shift: s.read(&key::filter_shift)?,
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
        let Self { live, estimator, ratio, shift, window, noise, velocity_frac, relief_nm_s_per_rad, .. } = *self;
        let unit = setting.stiffness_unit() * (self.features().velocity_samples * setting.period_s);
        let widths = setting.widths;
        let relief = setting.word("method.negative_damping", relief_nm_s_per_rad, unit, "", widths.damping)?;
        let (root_gain, slew) = self.levant(setting)?;
        Ok(Self::Block::new(SampledWallConfig {
            widths,
            spring_held: !live,
            estimator,
            ratio,
            shift,
            window,
            noise,
            velocity_frac,
            relief,
            root_gain,
            slew,
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
        foreign(self.estimator).collect()
    }
}
