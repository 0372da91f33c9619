//! The widths of a loop that a search may vary, by the scene's own keys.

use std::fmt;
use std::str::FromStr;

use hpu_cosim::scene::Scene;
use hpu_signal::Format;

/// A width of a loop.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Width {
    /// Of the position counter.
    Position,
    /// Integer bits of the stiffness.
    StiffnessInt,
    /// Fraction bits of the stiffness, which the product drops.
    StiffnessFrac,
    /// Integer bits of the damping.
    DampingInt,
    /// Fraction bits of the damping.
    DampingFrac,
    /// Of the velocity.
    Velocity,
    /// Of the modulator; a period of it is two to that many clocks.
    Pwm,
}

impl Width {
    /// All of them, in the order in which designs name them.
    pub const ALL: [Self; 7] = [
        Self::Position,
        Self::StiffnessInt,
        Self::StiffnessFrac,
        Self::DampingInt,
        Self::DampingFrac,
        Self::Velocity,
        Self::Pwm,
    ];

    /// Its key in `[method]`; integer and fraction bits of a format go by `.int` and `.frac` behind the format's.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::Position => "position_bits",
            Self::StiffnessInt => "stiffness_format.int",
            Self::StiffnessFrac => "stiffness_format.frac",
            Self::DampingInt => "damping_format.int",
            Self::DampingFrac => "damping_format.frac",
            Self::Velocity => "velocity_bits",
            Self::Pwm => "pwm.bits",
        }
    }

    /// The values that a scene takes; of integer and fraction bits, those that some format has.
    const fn accepted(self) -> (i32, i32) {
        match self {
            Self::Position | Self::Velocity => (2, 32),
            Self::Pwm => (2, 24),
            _ => (0, 32),
        }
    }
}

const SYNTAX: &str = "write KEY=FROM..TO, as in position_bits=8..16";

/// A width, and the values that it takes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Knob {
    /// Which.
    pub width: Width,
    /// The least value.
    pub from: i32,
    /// The greatest.
    pub to: i32,
}

impl Knob {
    /// How many values it takes.
    #[must_use]
    pub fn values(&self) -> usize {
        (self.to - self.from + 1).unsigned_abs() as usize
    }

    /// The knobs of a loop when none is named: every width from some bits below the scene's own up to it, and fractions
    /// from none to four bits above. The modulator's is not among them: it sets the period of the modulation too.
    #[must_use]
    pub fn usual(scene: &Scene) -> Vec<Self> {
        let own = Design::of(scene);
        let below = |width: Width, bits: i32, least: i32| {
            let to = own.get(width);
            Self { width, from: (to - bits).max(least).min(to - 1), to }
        };
        let frac = |width: Width| Self { width, from: 0, to: own.get(width) + 4 };
        vec![
            below(Width::Position, 4, 2),
            below(Width::StiffnessInt, 6, 2),
            frac(Width::StiffnessFrac),
            below(Width::DampingInt, 6, 2),
            Self { width: Width::DampingFrac, from: 0, to: own.get(Width::DampingFrac).max(1) },
            below(Width::Velocity, 10, 2),
        ]
    }
}

impl FromStr for Knob {
    type Err = String;

    /// Reads `KEY=FROM..TO`, both ends values: `position_bits=8..16`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (key, range) = text.split_once('=').ok_or(SYNTAX)?;
        let key = key.trim();
        let bare = key.strip_prefix("method.").unwrap_or(key);
        let width = Width::ALL.into_iter().find(|width| width.key() == bare).ok_or_else(|| {
            let keys: Vec<&str> = Width::ALL.iter().map(|width| width.key()).collect();
            format!("{key} is no width that a search varies; write one of {}", keys.join(", "))
        })?;
        let (from, to) = values(key, range, width.accepted())?;
        Ok(Self { width, from, to })
    }
}

/// Reads the values of a key, `FROM..TO`, each of which it accepts.
pub(super) fn values(key: &str, range: &str, (least, most): (i32, i32)) -> Result<(i32, i32), String> {
    let bits = |text: &str| text.trim().parse::<i32>().ok();
    let Some((from, to)) = range.split_once("..") else {
        return Err(match bits(range) {
            Some(bits) => format!("{key} takes one value only, {bits}; write KEY=FROM..TO, or set it by --set"),
            None => SYNTAX.into(),
        });
    };
    let (Some(from), Some(to)) = (bits(from), bits(to)) else {
        return Err(format!("`{}` is no range of bits; {SYNTAX}", range.trim()));
    };
    if let Some(bits) = [from, to].into_iter().find(|bits| !(least..=most).contains(bits)) {
        return Err(format!("{key} cannot be {bits}: a scene takes {least} to {most}"));
    }
    match from.cmp(&to) {
        std::cmp::Ordering::Less => Ok((from, to)),
        std::cmp::Ordering::Equal => {
            Err(format!("{key}={from}..{to} takes one value only; widen it, or set it by --set"))
        }
        std::cmp::Ordering::Greater => Err(format!("{key}={from}..{to} is reversed; write the smaller value first")),
    }
}

impl fmt::Display for Knob {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}={}..{}", self.width.key(), self.from, self.to)
    }
}

/// The widths of a loop.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Design {
    bits: [i32; Width::ALL.len()],
}

impl Design {
    /// Those of a scene.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let method = &scene.method;
        let (stiffness, damping) = (method.stiffness_format, method.damping_format);
        let [position, velocity, pwm] =
            [method.position_bits, method.velocity_bits, method.pwm.bits].map(|bits| bits as i32);
        Self { bits: [position, stiffness.int(), stiffness.frac(), damping.int(), damping.frac(), velocity, pwm] }
    }

    /// One of them.
    #[must_use]
    pub fn get(&self, width: Width) -> i32 {
        self.bits[width as usize]
    }

    /// All bits of it together.
    #[must_use]
    pub fn bits(&self) -> i32 {
        self.bits.iter().sum()
    }

    /// This design with another width.
    #[must_use]
    pub fn with(mut self, width: Width, bits: i32) -> Self {
        self.bits[width as usize] = bits;
        self
    }

    /// Position, gains and velocity of so many bits, the gains' integer bits as they are; the modulator's width, which
    /// is its period, stays.
    ///
    /// # Errors
    ///
    /// In words, when so many bits are too few for the gains' integer bits.
    pub fn wide(mut self, bits: i32) -> Result<Self, String> {
        for (int, frac) in [(Width::StiffnessInt, Width::StiffnessFrac), (Width::DampingInt, Width::DampingFrac)] {
            if bits < self.get(int) {
                let needed = format!("{} has {} integer bits", int.key().trim_end_matches(".int"), self.get(int));
                return Err(format!("{bits} bits are too few: {needed}; write at least as many"));
            }
            self = self.with(frac, bits - self.get(int));
        }
        Ok(self.with(Width::Position, bits).with(Width::Velocity, bits))
    }

    /// Format of the stiffness, or damping; none for a word of no bits, or more than 64.
    fn gain(&self, int: Width, frac: Width) -> Option<Format> {
        Format::new(false, self.get(int), self.get(frac)).ok()
    }

    /// Format of the stiffness.
    ///
    /// # Panics
    ///
    /// When it is none, which a search has refused.
    #[must_use]
    pub fn stiffness(&self) -> Format {
        self.gain(Width::StiffnessInt, Width::StiffnessFrac).expect("a design of a search has formats")
    }

    /// Format of the damping.
    ///
    /// # Panics
    ///
    /// As [`stiffness`](Self::stiffness).
    #[must_use]
    pub fn damping(&self) -> Format {
        self.gain(Width::DampingInt, Width::DampingFrac).expect("a design of a search has formats")
    }

    /// The keys that make a scene's loop this one.
    #[must_use]
    pub fn set(&self) -> Vec<(String, String)> {
        let format = |int, frac| format!("(0,{},{})", self.get(int), self.get(frac));
        [
            ("position_bits", self.get(Width::Position).to_string()),
            ("stiffness_format", format(Width::StiffnessInt, Width::StiffnessFrac)),
            ("damping_format", format(Width::DampingInt, Width::DampingFrac)),
            ("velocity_bits", self.get(Width::Velocity).to_string()),
            ("pwm.bits", self.get(Width::Pwm).to_string()),
        ]
        .map(|(key, value)| (format!("method.{key}"), value))
        .into()
    }

    /// The scene with this loop.
    ///
    /// # Errors
    ///
    /// Why no scene has it: a width beyond what scenes take, or words that do not hold what the scene asks for.
    pub fn scene(&self, base: &Scene) -> Result<Scene, String> {
        for width in Width::ALL {
            let ((least, most), bits) = (width.accepted(), self.get(width));
            if !(least..=most).contains(&bits) {
                return Err(format!("method.{}: {bits}: a scene takes {least} to {most}", width.key()));
            }
        }
        let gain = |int: Width, frac: Width| {
            let format = self.gain(int, frac).filter(|format| (2..=32).contains(&format.width()));
            let key = int.key().trim_end_matches(".int");
            format.ok_or_else(|| {
                format!("method.{key}: (0,{},{}): a gain has 2 to 32 bits", self.get(int), self.get(frac))
            })
        };
        let mut scene = base.clone();
        let method = &mut scene.method;
        let [position, velocity, pwm] =
            [Width::Position, Width::Velocity, Width::Pwm].map(|width| self.get(width).unsigned_abs());
        (method.position_bits, method.velocity_bits, method.pwm.bits) = (position, velocity, pwm);
        method.stiffness_format = gain(Width::StiffnessInt, Width::StiffnessFrac)?;
        method.damping_format = gain(Width::DampingInt, Width::DampingFrac)?;
        scene.words().map_err(|error| error.to_string())?;
        Ok(scene)
    }
}

impl fmt::Display for Design {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [position, k_int, k_frac, b_int, b_frac, velocity, pwm] = self.bits;
        write!(f, "{position:>2} (0,{k_int},{k_frac}) (0,{b_int},{b_frac}) {velocity:>2} {pwm:>2}")
    }
}
