//! The widths of a loop that a search may vary, by the scene's own keys.

use std::fmt;
use std::str::FromStr;

use hpu_cosim::scene::Scene;
use hpu_signal::Format;

/// A width of a loop.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Width {
    /// Width of the position counter.
    Position,
    /// Integer bits of the stiffness.
    StiffnessInt,
    /// Fraction bits of the stiffness, which the product drops.
    StiffnessFrac,
    /// Integer bits of the damping.
    DampingInt,
    /// Fraction bits of the damping.
    DampingFrac,
    /// Width of the velocity.
    Velocity,
    /// Width of the modulator; a period is two to the power of it clock cycles.
    Pwm,
}

impl Width {
    /// All widths, in the order in which designs name them.
    pub const ALL: [Self; 7] = [
        Self::Position,
        Self::StiffnessInt,
        Self::StiffnessFrac,
        Self::DampingInt,
        Self::DampingFrac,
        Self::Velocity,
        Self::Pwm,
    ];

    /// Returns its key in `[method]`; `.int` and `.frac` after a format's key mean its integer and fraction bits.
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

    /// Returns the least and greatest value that a scene accepts; for integer and fraction bits, that some format has.
    const fn accepted(self) -> (i32, i32) {
        match self {
            Self::Position | Self::Velocity => (2, 32),
            Self::Pwm => (2, 24),
            _ => (0, 32),
        }
    }
}

const SYNTAX: &str = "write KEY=FROM..TO, as in position_bits=8..16";

/// A width, and the range of values that it takes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Knob {
    /// The width.
    pub width: Width,
    /// The least value.
    pub from: i32,
    /// The greatest value.
    pub to: i32,
}

impl Knob {
    /// Returns the number of values that it takes.
    #[must_use]
    pub fn values(&self) -> usize {
        (self.to - self.from + 1).unsigned_abs() as usize
    }

    /// Returns the knobs of a loop when none is named: every width from some bits below the scene's own up to it, and
    /// fractions from no bits to four bits above. The modulator's width is not among them, because it also sets the
    /// period of the modulation.
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

    /// Reads `KEY=FROM..TO`; both ends are values: `position_bits=8..16`.
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

/// Reads the values of a key, `FROM..TO`; the key must accept each of them.
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
    /// Returns the widths of a scene.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let method = &scene.method;
        let (stiffness, damping) = (method.stiffness_format, method.damping_format);
        let [position, velocity, pwm] =
            [method.position_bits, method.velocity_bits, method.pwm.bits].map(|bits| bits as i32);
        Self { bits: [position, stiffness.int(), stiffness.frac(), damping.int(), damping.frac(), velocity, pwm] }
    }

    /// Returns one width.
    #[must_use]
    pub fn get(&self, width: Width) -> i32 {
        self.bits[width as usize]
    }

    /// Returns the sum of all widths.
    #[must_use]
    pub fn bits(&self) -> i32 {
        self.bits.iter().sum()
    }

    /// Returns this design with another value of one width.
    #[must_use]
    pub fn with(mut self, width: Width, bits: i32) -> Self {
        self.bits[width as usize] = bits;
        self
    }

    /// Returns the design with position, gains and velocity of `bits` bits. The gains' integer bits stay, and so does
    /// the modulator's width, which sets its period.
    ///
    /// # Errors
    ///
    /// A message when `bits` is too few for the gains' integer bits.
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

    /// Returns the format of the stiffness or damping; `None` for a word of no bits, or more than 64.
    fn gain(&self, int: Width, frac: Width) -> Option<Format> {
        Format::new(false, self.get(int), self.get(frac)).ok()
    }

    /// Returns the format of the stiffness.
    ///
    /// # Panics
    ///
    /// When it has none; a search has refused such designs.
    #[must_use]
    pub fn stiffness(&self) -> Format {
        self.gain(Width::StiffnessInt, Width::StiffnessFrac).expect("a design of a search has formats")
    }

    /// Returns the format of the damping.
    ///
    /// # Panics
    ///
    /// As [`stiffness`](Self::stiffness).
    #[must_use]
    pub fn damping(&self) -> Format {
        self.gain(Width::DampingInt, Width::DampingFrac).expect("a design of a search has formats")
    }

    /// Returns the keys that give a scene this loop.
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

    /// Returns the scene with this loop.
    ///
    /// # Errors
    ///
    /// Why no scene can have it: a width beyond the range of scenes, or words that do not hold the scene's values.
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
