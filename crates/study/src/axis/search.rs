//! The loop of an axis.
//!
//! **Equal gains, the same run.** A run is a function of the modulator's width and of the gains' *values*. A product is
//! `floor(penetration k)`; it does not change when `k` is written with more fraction bits or more integer bits. So
//! formats that hold the same two gains need one run.
//!
//! **Narrower words, the same run.** Let a run with a position of `P` bits and a velocity of `V` bits keep three values
//! in range: `delta` within `P' <= P` bits, every difference of two samples within `P'` bits, and the velocity, which
//! never saturates, within `V' <= V` bits. Then the run with `P'` and `V'` has the same motion, `delta`, velocity and
//! torque at every edge. The proof is by induction over the edges. While the motion is the same, the narrow counter is
//! the wide one modulo `2^P'`. So are the wall's reference, `delta` and the difference, read as two's complement modulo
//! `2^P'`; a value that lies within `P'` bits is its own residue. So `delta` and the difference are the same numbers.
//! The velocity is the same difference (scaled alike), and fits. Everything that follows (contact, penetration,
//! products, torque, pins) is a function of `delta`, the velocity and the gains. So the motion is the same up to the
//! next edge.
//!
//! From reset on, the difference of two samples is a difference of two values of `delta`. So it fits where the whole
//! range of `delta` is less than half of the counter's range. It also fits where the velocity is that difference, not
//! rescaled, and fits.

use hpu_cosim::Summary;
use hpu_cosim::scene::{Datapath, Experiment, Hand, Loop, OutcomeKind, Scene};
use hpu_datapath::haptic_wiring;
use hpu_signal::{Format, SignalUse};

use super::axis;
use crate::Error;
use crate::widths::Field;
use crate::widths::search::climb::Digits;
use crate::widths::search::knob::{Depth, Key};
use crate::widths::search::loops::{Limits, Loops, Standing, below, signed_bits};
use crate::widths::search::{Cost, Design, ESTIMATE_ERROR, Keys, Knob, estimate};
use hpu_prove::ranges;

/// Position, formats of stiffness and damping, velocity, and the modulator: a period of it is two to the power of its
/// width in clock cycles.
static KEYS: Keys = Keys {
    device: "an axis",
    most_designs: 1 << 21,
    estimate_error: ESTIMATE_ERROR,
    aborts: false,
    stable: OutcomeKind::Settled,
    all: &[
        Key::new(Field::POSITION, "position_bits", (2, 32)).that_holds(),
        Key::new(Field::STIFFNESS_INT, "stiffness_format.int", (0, 32)),
        Key::new(Field::STIFFNESS_FRAC, "stiffness_format.frac", (0, 32)),
        Key::new(Field::DAMPING_INT, "damping_format.int", (0, 32)),
        Key::new(Field::DAMPING_FRAC, "damping_format.frac", (0, 32)),
        Key::new(Field::VELOCITY, "velocity_bits", (2, 32)).that_holds(),
        Key::new(Field::PWM, "pwm.bits", (2, 24)),
    ],
    text: |design| {
        let [stiffness, damping] = GAINS.map(|(_, gain)| shown(design, gain));
        let [position, velocity, pwm] = [Field::POSITION, Field::VELOCITY, Field::PWM].map(|field| design.get(field));
        format!("{position:>2} {stiffness} {damping} {velocity:>2} {pwm:>2}")
    },
};

/// Integer and fraction bits of a gain.
type GainBits = (Field, Field);

const STIFFNESS: GainBits = (Field::STIFFNESS_INT, Field::STIFFNESS_FRAC);
const DAMPING: GainBits = (Field::DAMPING_INT, Field::DAMPING_FRAC);
const GAINS: [(&str, GainBits); 2] = [("stiffness_format", STIFFNESS), ("damping_format", DAMPING)];

fn shown(design: &Design, (int, frac): GainBits) -> String {
    format!("(0,{},{})", design.get(int), design.get(frac))
}

/// A gain's value: `word / 2^frac`, in lowest terms.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Gain {
    word: i128,
    frac: u32,
}

impl Gain {
    fn new(word: i128, frac: i32) -> Self {
        let frac = frac.unsigned_abs();
        let common = if word == 0 { frac } else { word.trailing_zeros().min(frac) };
        Self { word: word >> common, frac: frac - common }
    }

    /// Returns a design whose gain has the shortest format that holds the value, of at least two bits.
    fn of(self, design: Design, (int, frac): GainBits) -> Design {
        let bits = (128 - self.word.leading_zeros()).max(2).max(self.frac);
        design.with(int, (bits - self.frac) as i32).with(frac, self.frac as i32)
    }
}

/// Returns a scene with a design's widths, whether or not its words hold the scene's values.
fn with(design: &Design, mut scene: Scene) -> Result<Scene, Error> {
    let gain = |(key, (int, frac)): (&str, GainBits)| {
        let format = Format::new(false, design.get(int), design.get(frac)).ok();
        format.filter(|format| (2..=32).contains(&format.width())).ok_or_else(|| {
            Error::new(format_args!("method.{key}: {}: a gain has 2 to 32 bits", shown(design, (int, frac))))
        })
    };
    let method = &mut scene.method;
    let [position, velocity, pwm] =
        [Field::POSITION, Field::VELOCITY, Field::PWM].map(|field| design.get(field).unsigned_abs());
    (method.position_bits, method.velocity_bits, method.pwm.bits) = (position, velocity, pwm);
    (method.stiffness_format, method.damping_format) = (gain(GAINS[0])?, gain(GAINS[1])?);
    Ok(scene)
}

pub struct Axis;

impl Loops for Axis {
    fn keys(&self) -> &'static Keys {
        &KEYS
    }

    /// Every width from some bits below the scene's own up to it, and fractions from no bits to four bits above. The
    /// modulator's width is not among them, because it also sets the period of the modulation.
    fn usual(&self, scene: &Experiment) -> Vec<Knob> {
        let own = Design::new(&KEYS, scene);
        let frac = |field: Field, to: i32| own.knob(field, 0, to);
        let all = [
            below(&own, Field::POSITION, 4, 2),
            below(&own, Field::STIFFNESS_INT, 6, 2),
            frac(Field::STIFFNESS_FRAC, own.get(Field::STIFFNESS_FRAC) + 4),
            below(&own, Field::DAMPING_INT, 6, 2),
            frac(Field::DAMPING_FRAC, own.get(Field::DAMPING_FRAC).max(1)),
            below(&own, Field::VELOCITY, 10, 2),
        ];
        all.into_iter().flatten().collect()
    }

    fn unit(&self, scene: &Experiment) -> &'static str {
        axis(scene).map_or("", |scene| scene.device.units().stiffness)
    }

    fn searchable(&self, scene: &Experiment) -> Result<(), Error> {
        let scene = axis(scene)?;
        match scene.model.datapath {
            Datapath::Words => {}
            Datapath::Linear => return Err("model.datapath = \"linear\" has no words; write \"words\"".into()),
            Datapath::Law => return Err("model.datapath = \"law\" is computed in floats; write \"words\"".into()),
        }
        match scene.hand {
            Hand::Prescribed { .. } => {
                return Err("the hand imposes the motion, so that no stiffness is unstable".into());
            }
            Hand::Capture { .. } => return Err("a recording stands in the place of the device".into()),
            _ => {}
        }
        if let Loop::Law(law) = scene.method.kind {
            let kind = law.name();
            return Err(format!(
                "method.kind = \"{kind}\": the search is for the kinds \"hybrid\" and \"conventional\""
            )
            .into());
        }
        if scene.wall.ramp.is_some() {
            return Err("wall.ramp: the words change while the scene runs; the search is of a wall that stays".into());
        }
        if scene.wall.stiffness_nm_per_rad == 0.0 {
            return Err("wall.stiffness = 0: without a wall there is no stable stiffness".into());
        }
        Ok(())
    }

    fn difference(&self, first: &Experiment, other: &Experiment) -> Option<String> {
        let [unit, others] = [first, other].map(|scene| self.unit(scene));
        if unit != others {
            return Some(format!("stiffness in {unit} and in {others}"));
        }
        let [kind, others] = [axis(first).ok()?, axis(other).ok()?].map(|scene| scene.method.kind.name());
        if kind != others {
            return Some(format!("method.kind = \"{kind}\" and \"{others}\""));
        }
        let other = self.scene(&Design::new(&KEYS, first), other).ok()?;
        let config = |scene: &Experiment| axis(scene).ok()?.words().ok().map(|words| words.config);
        (config(first)? != config(&other)?)
            .then(|| "another method.product, .rescaled, .period_bits, .settling, or .pwm".to_string())
    }

    fn same_but_for_stiffness(&self, one: &Experiment, other: &Experiment) -> bool {
        let (Ok(one), Ok(other)) = (axis(one), axis(other)) else { return false };
        let wall = |scene: &Scene| (scene.wall.position_rad, scene.wall.damping_nm_s_per_rad, scene.wall.wraps);
        let same = wall(one) == wall(other)
            && (one.device, one.encoder, one.bridge) == (other.device, other.encoder, other.bridge)
            && (&one.amplifier, one.clock, &one.method) == (&other.amplifier, other.clock, &other.method);
        same && (&one.hand, &one.model) == (&other.hand, &other.model)
            && (&one.run, &one.record) == (&other.run, &other.record)
    }

    fn scene(&self, design: &Design, base: &Experiment) -> Result<Experiment, Error> {
        for (Key { name, accepted: (least, most), .. }, bits) in design.widths() {
            if !(least..=most).contains(&bits) {
                return Err(format!("method.{name}: {bits}: a scene takes {least} to {most}").into());
            }
        }
        let scene = with(design, axis(base)?.clone())?;
        scene.words()?;
        Ok(Experiment::Axis(scene))
    }

    fn cost(&self, scene: &Experiment) -> Result<Cost, Error> {
        let scene = axis(scene)?;
        let config = scene.words()?.config;
        // Some widths are refused by the blocks.
        for is_conventional in [false, true] {
            haptic_wiring(config, is_conventional)?;
        }
        Ok(Cost::of_logic(estimate(&config, scene.method.kind == Loop::Conventional)))
    }

    fn standing(&self, design: Design, scene: &Experiment) -> Result<Standing, Error> {
        let scene = axis(scene)?;
        let words = scene.words()?;
        let (stiffness, own) = (scene.method.stiffness_format, words.stiffness.into());
        let unit = words.realised.torque_quantum_nm / words.realised.count_rad;
        // The scene's damping rounds to the same value in the same word with fewer fraction bits.
        let damping = Gain::new(words.damping.into(), design.get(Field::DAMPING_FRAC));
        let widths = [Field::STIFFNESS_INT, Field::STIFFNESS_FRAC, Field::POSITION, Field::VELOCITY];
        let gain = [design.get(Field::PWM).into(), damping.word, damping.frac.into()];
        Ok(Standing {
            design: damping.of(design, DAMPING),
            own,
            climb: Box::new(Digits::new(own, stiffness.max(), unit * stiffness.lsb())),
            alike: gain.into_iter().chain(widths.map(|field| design.get(field).into())).collect(),
        })
    }

    /// The wall is a word of the design's stiffness.
    fn run(&self, design: Design, wall: i128) -> (Design, i128) {
        let gain = Gain::new(wall, design.get(Field::STIFFNESS_FRAC));
        (gain.of(design, STIFFNESS), gain.word)
    }

    fn at(&self, base: &Experiment, design: &Design, wall: i128) -> Result<Experiment, Error> {
        let base = axis(base)?;
        let own = base.words()?.realised;
        let mut scene = with(design, base.clone())?;
        let coarser = f64::from(base.method.pwm.bits) - f64::from(scene.method.pwm.bits);
        let unit = own.torque_quantum_nm / own.count_rad * libm::exp2(coarser);
        scene.wall.stiffness_nm_per_rad = scene.method.stiffness_format.to_f64(wall as i64) * unit;
        Ok(Experiment::Axis(scene))
    }

    fn needs(&self, base: &Experiment, run: &Summary) -> Result<Depth, Error> {
        let used = |name: &str| -> Result<SignalUse, Error> {
            let net = run.nets.iter().find(|net| net.signal.name == name);
            Ok(net.ok_or_else(|| Error::new(format_args!("the loop has no net {name}")))?.usage)
        };
        let (delta, velocity) = (used("delta")?, used("velocity")?);
        let velocity = (velocity.overflowed == 0).then_some((velocity.min, velocity.max));
        Ok(narrowest((delta.min, delta.max), velocity, axis(base)?.method.reference_rate_hz.is_some()))
    }

    /// The modulator's width is always the scene's, because it sets the period of the modulation.
    fn reference(&self, base: &Experiment, knobs: &[Knob], bits: Option<i32>) -> Result<Design, Error> {
        let own = Design::new(&KEYS, base);
        if let Some(bits) = bits {
            return own.wide(bits);
        }
        let knobs = knobs.iter().filter(|knob| knob.key.field != Field::PWM);
        Ok(knobs.fold(own, |wide, knob| wide.with(knob.key.field, knob.to)))
    }

    fn never_stable(&self, reference: &Design) -> String {
        format!("settles at no stiffness down to the softest that {} holds", shown(reference, STIFFNESS))
    }

    fn limits<'s>(&self, scene: &'s Experiment) -> Result<Limits<'s>, Error> {
        let limits = ranges::Limits::new(axis(scene)?)?;
        Ok(Box::new(move |scene| Ok(limits.held(axis(scene)?)?)))
    }
}

/// Returns the fewest bits of position and velocity with which a run is the same (see the proof above). `velocity` is
/// `None` where it saturated. A velocity that is rescaled does not show the difference of two samples.
fn narrowest(delta: (i64, i64), velocity: Option<(i64, i64)>, rescaled: bool) -> Depth {
    let Some(velocity) = velocity.map(signed_bits) else { return [i32::MAX; 2] };
    let difference = delta.1 - delta.0;
    let whole = signed_bits((-difference, difference));
    let sampled = if rescaled { whole } else { whole.min(velocity) };
    [signed_bits(delta).max(sampled), velocity]
}

impl Design {
    /// Returns the design of an axis with position, gains and velocity of `bits` bits. The gains' integer bits stay,
    /// and so does the modulator's width, which sets its period.
    ///
    /// # Errors
    ///
    /// A message when `bits` is too few for the gains' integer bits.
    pub fn wide(mut self, bits: i32) -> Result<Self, Error> {
        for (key, (int, frac)) in GAINS {
            if bits < self.get(int) {
                let needed = format!("{key} has {} integer bits", self.get(int));
                return Err(format!("{bits} bits are too few: {needed}; write at least as many").into());
            }
            self = self.with(frac, bits - self.get(int));
        }
        Ok(self.with(Field::POSITION, bits).with(Field::VELOCITY, bits))
    }

    /// Returns the keys that give the scene of an axis this loop.
    pub fn set(&self) -> Vec<(String, String)> {
        let bits = |field| self.get(field).to_string();
        let [stiffness, damping] = GAINS.map(|(key, gain)| (key, shown(self, gain)));
        let [position, velocity, pwm] =
            [("position_bits", Field::POSITION), ("velocity_bits", Field::VELOCITY), ("pwm.bits", Field::PWM)]
                .map(|(key, field)| (key, bits(field)));
        [position, stiffness, damping, velocity, pwm].map(|(key, value)| (format!("method.{key}"), value)).into()
    }
}

#[cfg(test)]
mod tests {
    use super::{DAMPING, Design, Gain, KEYS, narrowest, shown};

    #[test]
    fn a_gain_is_its_value_whatever_the_format() {
        assert_eq!(Gain::new(36 << 4, 4), Gain::new(36, 0));
        assert_eq!(Gain::new(38, 4), Gain::new(19, 3));
        assert_eq!(Gain::new(0, 7), Gain::new(0, 0));
        let shipped = hpu_cosim::scene::shipped();
        let scene = shipped.iter().find(|scene| scene.name == "hybrid-wall").expect("a shipped scene");
        let own = Design::new(&KEYS, &scene.parse(&[]).expect("a scene"));
        for (word, frac, format) in [(36, 0, "(0,6,0)"), (19, 4, "(0,1,4)"), (1, 5, "(0,0,5)"), (0, 0, "(0,2,0)")] {
            let design = Gain::new(word, frac).of(own, DAMPING);
            assert_eq!(shown(&design, DAMPING), format);
        }
    }

    #[test]
    fn a_run_covers_the_widths_that_hold_all_its_words_and_no_others() {
        // -978 takes 11 bits, 31 takes 6 bits.
        assert_eq!(narrowest((-978, 33), Some((-9, 31)), false), [11, 6]);
        // The range of `delta`, 1011, fits a difference of 11 bits. A range of 1100 does not, and rescaled velocities
        // do not count.
        assert_eq!(narrowest((-1000, 100), Some((-9, 31)), true), [12, 6]);
        assert_eq!(narrowest((-1000, 100), Some((-9, 31)), false), [11, 6]);
        assert_eq!(narrowest((-978, 33), None, false), [i32::MAX; 2], "one that saturated says nothing");
    }
}
