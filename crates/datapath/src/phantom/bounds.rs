//! What no posture can exceed: a proof of the words' ranges and errors over the whole workspace, by interval
//! arithmetic.
//!
//! Every count that the tables hold is in, in any combination, and every force up to the limit in any direction. A
//! range is that of the word's value. An error is the greatest distance to the same equations in real numbers, of the
//! same counts, with the lengths and gains as their words say; that of a force counts from the tip as the datapath sees
//! it (stiffness times the error of the position, and the rounding), those of radial, upper, fore, torques and commands
//! are for the forces as words. Ranges and errors add up term by term, as if the worst of each could meet: so the
//! figures are upper bounds, never estimates.
//!
//! The arithmetic is `f64`, rounded outwards: every end of a range moves by one ulp an operation, and every error grows
//! by one part in `2^40`, far more than its few roundings can take away.

use hpu_signal::Format;

use super::{PhantomConfig, PhantomFormats, TrigTable};
use crate::ConfigError;

/// What is proved of one signal.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SignalBound {
    /// Name of the net or, as `radial`, of the word inside a block.
    pub name: &'static str,
    /// Unit of all figures.
    pub unit: &'static str,
    /// Least value.
    pub min: f64,
    /// Greatest value.
    pub max: f64,
    /// Greatest error; infinite after a word that may have wrapped.
    pub error: f64,
    /// The word's format.
    pub format: Format,
    /// Whether the format holds the whole range, so that nothing ever wraps. Forces and commands saturate by intent:
    /// their range is what is left.
    pub fits: bool,
}

/// A range of values and the greatest error among them.
#[derive(Clone, Copy)]
struct Bound {
    min: f64,
    max: f64,
    error: f64,
}

/// One part in `2^40` more.
const SLACK: f64 = 1.0 + 1.0 / (1u64 << 40) as f64;

/// Half a unit in the last place.
fn half(format: Format) -> f64 {
    format.lsb() / 2.0
}

/// A factor's part in a product's error: none of an exact factor, however far off the other one is.
fn share(size: f64, error: f64) -> f64 {
    if size == 0.0 || error == 0.0 { 0.0 } else { size * error }
}

impl Bound {
    fn constant(value: f64) -> Self {
        Self { min: value, max: value, error: 0.0 }
    }

    fn symmetric(size: f64, error: f64) -> Self {
        Self { min: -size, max: size, error }
    }

    /// The greatest size.
    fn size(self) -> f64 {
        self.max.max(-self.min)
    }

    fn plus(self, other: Self) -> Self {
        Self {
            min: (self.min + other.min).next_down(),
            max: (self.max + other.max).next_up(),
            error: (self.error + other.error) * SLACK,
        }
    }

    fn minus(self, other: Self) -> Self {
        self.plus(Self { min: -other.max, max: -other.min, error: other.error })
    }

    /// With `a`, `b` the words and `a'`, `b'` the true values, `ab - a'b' = a (b - b') + b' (a - a')`.
    fn times(self, other: Self) -> Self {
        let ends = [self.min * other.min, self.min * other.max, self.max * other.min, self.max * other.max];
        Self {
            min: ends.into_iter().fold(f64::INFINITY, f64::min).next_down(),
            max: ends.into_iter().fold(f64::NEG_INFINITY, f64::max).next_up(),
            error: (share(self.size(), other.error) + share(other.size() + other.error, self.error)) * SLACK,
        }
    }

    /// At most that size.
    fn clamped(self, least: f64, most: f64) -> Self {
        Self { min: self.min.clamp(least, most), max: self.max.clamp(least, most), ..self }
    }

    /// Rounded to the nearest word.
    fn rounded(self, format: Format) -> Self {
        self.plus(Self::symmetric(half(format), half(format)))
    }
}

/// The rows of the proof, in the order in which each needs the ones before.
struct Proof(Vec<SignalBound>);

impl Proof {
    /// Notes a signal down; what goes on from it, which is any word at all if it may wrap.
    fn note(&mut self, name: &'static str, unit: &'static str, format: Format, value: Bound) -> Bound {
        let (least, most) = (format.min() as f64 * format.lsb(), format.max() as f64 * format.lsb());
        let Bound { min, max, error } = value;
        let fits = least <= min && max <= most;
        self.0.push(SignalBound { name, unit, min, max, error, format, fits });
        if fits { value } else { Bound { min: least, max: most, error: f64::INFINITY } }
    }
}

/// The range of a table's sines and cosines, all of them looked at.
fn sines(config: &PhantomConfig, joint: usize) -> Result<[Bound; 2], ConfigError> {
    let PhantomConfig { position_width, depth_width, turns, formats, .. } = *config;
    let table = TrigTable::new(position_width, depth_width, turns[joint], formats.trig)?;
    // A table's entry is the nearest word, but for the float that it was made with.
    let error = half(formats.trig) + f64::EPSILON / 2.0;
    let none = Bound { min: f64::INFINITY, max: f64::NEG_INFINITY, error };
    let reach = 1i64 << (depth_width - 1);
    Ok((-reach..reach).fold([none; 2], |[sine, cosine], count| {
        let with = |bound: Bound, word| {
            let value = formats.trig.to_f64(word);
            Bound { min: bound.min.min(value), max: bound.max.max(value), ..bound }
        };
        let words = table.at(count);
        [with(sine, words.sine), with(cosine, words.cosine)]
    }))
}

/// The ranges and errors of every signal from the sines on, for any posture that the tables hold and any stiffness up
/// to `stiffness_max_n_per_m`.
///
/// # Errors
///
/// When the tables refuse the configuration.
pub fn bounds(config: &PhantomConfig, stiffness_max_n_per_m: f64) -> Result<Vec<SignalBound>, ConfigError> {
    let PhantomFormats { trig, position, stiffness, force, torque, length_frac } = config.formats;
    let mut proof = Proof(Vec::new());
    let [upper_m, fore_m] =
        config.lengths.map(|word| Bound::constant(f64::from(word) / f64::from(1u32 << length_frac)));

    let mut joint = |index: usize, names: [&'static str; 2]| -> Result<[Bound; 2], ConfigError> {
        let [sine, cosine] = sines(config, index)?;
        Ok([proof.note(names[0], "1", trig, sine), proof.note(names[1], "1", trig, cosine)])
    };
    let [sine1, cosine1] = joint(0, ["sine1", "cosine1"])?;
    let [sine2, cosine2] = joint(1, ["sine2", "cosine2"])?;
    let [sine3, cosine3] = joint(2, ["sine3", "cosine3"])?;

    let mut place = |name, value: Bound| proof.note(name, "m", position, value.rounded(position));
    let radius = place("radius", upper_m.times(cosine2).plus(fore_m.times(sine3)));
    let x = place("x", sine1.times(radius));
    let y = place("y", fore_m.plus(upper_m.times(sine2).minus(fore_m.times(cosine3))));
    let z = place("z", cosine1.times(radius).minus(upper_m));

    let spring = Bound { min: 0.0, max: stiffness_max_n_per_m, error: 0.0 };
    let spring = proof.note("stiffness", "N/m", stiffness, spring);
    let limit = f64::from(config.force_limit) * force.lsb();
    let mut push = |name, at: Bound| {
        // Beyond walls that stand anywhere. Depth follows the tip with slope 0 or 1, and the clamp never adds to an
        // error.
        let walls = Bound::symmetric(-(position.min() as f64) * position.lsb(), 0.0);
        let pushed = spring.times(at.minus(walls));
        let pushed = Bound::symmetric(pushed.size(), pushed.error).rounded(force).clamped(-limit, limit);
        Bound { error: 0.0, ..proof.note(name, "N", force, pushed) }
    };
    let (force_x, force_y, force_z) = (push("force_x", x), push("force_y", y), push("force_z", z));

    let beam = Format::new(true, force.int() + 1, force.frac()).unwrap_or(force);
    let mut along = |name, value: Bound| proof.note(name, "N", beam, value.rounded(beam));
    let radial = along("radial", sine1.times(force_x).plus(cosine1.times(force_z)));
    let upper = along("upper", cosine2.times(force_y).minus(sine2.times(radial)));
    let fore = along("fore", sine3.times(force_y).plus(cosine3.times(radial)));

    let mut turn = |name, value: Bound| proof.note(name, "N.m", torque, value.rounded(torque));
    let torques = [
        turn("torque1", z.plus(upper_m).times(force_x).minus(x.times(force_z))),
        turn("torque2", upper_m.times(upper)),
        turn("torque3", fore_m.times(fore)),
    ];
    let command = Format::signed(config.command_width);
    for (joint, name) in ["command1", "command2", "command3"].into_iter().enumerate() {
        let gain = Bound::constant(f64::from(config.gains[joint]) / f64::from(1u32 << config.gain_frac));
        let scaled = torques[joint].times(gain).rounded(command);
        proof.note(name, "DAC count", command, scaled.clamped(command.min() as f64, command.max() as f64));
    }
    Ok(proof.0)
}
