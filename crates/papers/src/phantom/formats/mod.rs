//! The word formats of an arm: the range of every signal, proved for every posture, and measured over a million
//! postures.

mod claims;
mod text;

use hpu_datapath::ConfigError;
use hpu_signal::Format;

use super::postures::{Measured, measure};
use super::{Config, SIGNALS, SignalBound, bounds};

pub use claims::sums;
pub use text::{FORMATS_CSV_HEADER, formats_csv, formats_text, plain};

/// Number of random postures of each configuration, beside every count of the tables and every combination of their
/// ends.
pub const POSTURES: usize = 1_000_000;
/// Stiffness of the stiffest walls of the published study, in N/m.
pub const STIFFNESS_MAX_N_PER_M: f64 = 40_000.0;

/// A configuration of word formats to examine, for walls up to a stiffness.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Words {
    /// Name of the configuration.
    pub name: &'static str,
    /// Description of the configuration.
    pub about: &'static str,
    /// The datapath's configuration.
    pub config: Config,
    /// Stiffness of the stiffest wall, in N/m.
    pub stiffness_max_n_per_m: f64,
}

/// Returns the configurations that are compared.
pub fn words() -> Vec<Words> {
    let fitted = Config::default();
    let plain = Config::plain_q22();
    let of = |name, about, config| Words { name, about, config, stiffness_max_n_per_m: STIFFNESS_MAX_N_PER_M };
    let soft = Words {
        stiffness_max_n_per_m: greatest(plain.formats.stiffness),
        ..of("plain_q22_soft", "the same, up to the stiffest wall that (0,9,22) holds", plain)
    };
    vec![
        of("fitted", "Premium 1.0, each word as its signal needs it, sines (1,9,22)", fitted),
        of("narrow", "the same with sines of (1,1,22)", fitted.narrow()),
        of("premium_1_5", "Premium 1.5 in the fitted words", Config::premium_1_5()),
        of("plain_q22", "Premium 1.0, (1,9,22) everywhere", plain),
        soft,
    ]
}

/// Returns the value of a format's greatest word.
pub(super) fn greatest(format: Format) -> f64 {
    format.max() as f64 * format.lsb()
}

hpu_signal::named! {
    /// The effect on a value that its word cannot hold.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum Fate {
        /// No value is too large for its word.
        Never = "never",
        /// The value stops at the limit, by intent.
        Saturates = "saturates",
        /// The value loses its upper bits.
        Wraps = "wraps",
    }
}

/// A signal's proved range and, unless the signal is inside a block, its measured range.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SignalRange {
    /// The range proved for every posture.
    pub proved: SignalBound,
    /// The range measured over some postures.
    pub measured: Option<Measured>,
    /// Factor and unit in which errors are written.
    pub scale: (f64, &'static str),
}

impl SignalRange {
    /// Returns what happens to a value that is too large for the signal's word.
    pub fn fate(&self) -> Fate {
        let SignalBound { name, fits, .. } = self.proved;
        match fits {
            false => Fate::Wraps,
            true if name.starts_with("force") || name.starts_with("command") => Fate::Saturates,
            true => Fate::Never,
        }
    }

    /// Returns the bits above the greatest value: the logarithm to base 2 of the format's upper end divided by that
    /// value; below 0 if the value does not fit.
    pub fn headroom_bits(&self) -> f64 {
        f64::from(self.proved.format.int()) - libm::log2(self.size())
    }

    /// Returns the greatest absolute value.
    pub fn size(&self) -> f64 {
        self.proved.max.max(-self.proved.min)
    }
}

/// The signals of one configuration.
#[derive(Clone, PartialEq, Debug)]
pub struct Formats {
    /// The configuration.
    pub words: Words,
    /// The signals, in the order of the datapath.
    pub rows: Vec<SignalRange>,
}

impl Formats {
    /// Proves and measures the ranges of all signals.
    ///
    /// # Errors
    ///
    /// Returns an error if a block refuses the word formats.
    pub fn new(words: Words, postures: usize) -> Result<Self, ConfigError> {
        let Words { config, stiffness_max_n_per_m, .. } = words;
        let measured = measure(&config, stiffness_max_n_per_m, postures)?;
        let row = |proved: SignalBound| {
            let index = SIGNALS.iter().position(|name| *name == proved.name);
            let joint = proved.name.chars().last().and_then(|digit| digit.to_digit(10));
            let scale = match (proved.unit, joint) {
                ("m", _) => (1e6, "um"),
                ("N", _) => (1e3, "mN"),
                ("N.m", Some(joint)) => (100.0 / full_scales_nm(&config)[joint as usize - 1], "% of full scale"),
                (unit, _) => (1.0, unit),
            };
            SignalRange { proved, measured: index.map(|index| measured[index]), scale }
        };
        Ok(Self { words, rows: bounds(&config, stiffness_max_n_per_m)?.into_iter().map(row).collect() })
    }

    /// Returns the row of a signal, if there is one.
    pub fn row(&self, signal: &str) -> Option<&SignalRange> {
        self.rows.iter().find(|row| row.proved.name == signal)
    }
}

/// Returns the torques of the joints, in N.m, at the full scale of their DACs: 0.17 N.m of the motor times the ratio.
pub fn full_scales_nm(config: &Config) -> [f64; 3] {
    let full = f64::from(1u32 << (config.command_width - 1)) * f64::from(1u32 << config.gain_frac);
    config.gains.map(|gain| full / f64::from(gain))
}

/// Returns a stiffness as text, never rounded up to a stiffness that does not fit.
pub fn stiffness(n_per_m: f64) -> String {
    if n_per_m.fract() == 0.0 { n_per_m.to_string() } else { format!("{n_per_m:.7}") }
}
