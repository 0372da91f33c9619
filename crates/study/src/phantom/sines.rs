//! Four sources of sine and cosine: their errors, and the bits of ROM that they take.

use std::f64::consts::TAU;
use std::fmt::Write;

use hpu_datapath::ConfigError;
use hpu_signal::{Format, Notation};

use super::Config;
use super::datapath::{Phase, Trig, TrigCordic, TrigInterpolated, TrigOut, TrigQuarter, TrigTable, Turn, Wave};
use hpu_page::quoted;

hpu_signal::named! {
    /// A source of sine and cosine.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum Source {
        /// A table with a word for each count.
        Table = "trig_table",
        /// A table of a quarter wave, read at the nearest step.
        Quarter = "trig_quarter",
        /// A table of a quarter wave, with straight lines between its steps.
        Interpolated = "trig_interpolated",
        /// CORDIC rotations.
        Cordic = "trig_cordic",
    }
}

impl Source {
    /// Returns the arithmetic that the source needs, as text.
    pub const fn arithmetic(self) -> &'static str {
        match self {
            Self::Table => "no adder, no multiplier; sine and cosine of a count in one word pair, one read",
            Self::Quarter => {
                "1 multiplier by a constant (count STEP), 1 adder that rounds, 2 that fold, 2 that negate; two reads"
            }
            Self::Interpolated => {
                "1 multiplier by a constant (count STEP), 2 multipliers (rise r), 2 adders that fold, 2 that round, 2 \
                 of step and rise, 2 that negate; two reads of step and rise"
            }
            Self::Cordic => {
                "1 multiplier by a constant (count STEP), 3 adders a rotation, 1 for the half turn, 2 that negate, 2 \
                 that round; no ROM, its angles are constants"
            }
        }
    }
}

/// Size of a ROM.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Rom {
    /// Number of words.
    pub words: u64,
    /// Bits of each word.
    pub width: u32,
}

impl Rom {
    /// Returns the number of all bits.
    pub fn bits(self) -> u64 {
        self.words * u64::from(self.width)
    }
}

/// A source in one size, and its measured errors.
#[derive(Clone, PartialEq, Debug)]
pub struct Sine {
    /// The source.
    pub source: Source,
    /// The generics that differ within the ladder of sizes.
    pub size: String,
    /// Whether these are the default generics.
    pub default: bool,
    /// Format of sine and cosine.
    pub format: Format,
    /// The source's ROM, counted once however often it is read at a clock edge.
    pub rom: Rom,
    /// Greatest distance of a sine or cosine to the exact one.
    pub worst: f64,
    /// Root of the mean square of all these distances.
    pub rms: f64,
    /// Greatest error, in rad, of the angle to which sine and cosine together point.
    pub worst_rad: f64,
    /// Number of angles that were examined.
    pub angles: u64,
}

impl Sine {
    /// Returns the greatest error in units of the last place.
    pub fn worst_lsb(&self) -> f64 {
        self.worst / self.format.lsb()
    }

    /// Returns the rms error in units of the last place.
    pub fn rms_lsb(&self) -> f64 {
        self.rms / self.format.lsb()
    }
}

/// Returns the turns of the joints that differ: the first joint, and the second, which is like the third.
fn turns(config: &Config) -> [Turn; 2] {
    let [first, second, _] = config.turns;
    [first, second]
}

/// Examines every source in a ladder of sizes about its default, over all counts that the default tables hold in joint
/// 1 and in joint 2.
///
/// # Errors
///
/// Returns an error if a block refuses a size; no block does.
pub fn sines() -> Result<Vec<Sine>, ConfigError> {
    sines_of(&Config::default())
}

/// Like [`sines`], for another design: its joints, and the counts that its tables hold.
///
/// # Errors
///
/// Returns an error if a block refuses a size.
pub(crate) fn sines_of(config: &Config) -> Result<Vec<Sine>, ConfigError> {
    let Config { position_width, depth_width, .. } = *config;
    let (plain, phase) = (Config::default().formats.trig, Phase::default());
    let counts = Counts { turns: turns(config), reach: 1 << (depth_width - 1) };
    let stored = plain.frac().unsigned_abs();
    let mut all = Vec::new();
    for format in [narrow(14), narrow(18), narrow(22), plain, narrow(26), narrow(30)] {
        let size = format!("TRIG {format}");
        let tables = counts.turns.map(|turn| TrigTable::new(position_width, depth_width, turn, format));
        let rom = Rom { words: 1 << depth_width, width: 2 * format.width() };
        all.push(counts.looked_at(Source::Table, size, format == plain, format, rom, tables)?);
    }
    for width in 7..=13 {
        let made = counts.turns.map(|turn| TrigQuarter::new(phase.of(turn), width));
        let rom = Rom { words: 1 << width, width: stored };
        all.push(counts.looked_at(Source::Quarter, format!("QUARTER_WIDTH {width}"), width == 11, plain, rom, made)?);
    }
    for width in 4..=12 {
        let made = counts.turns.map(|turn| TrigInterpolated::new(phase.of(turn), width, 14));
        // A word holds a step and the rise to the next step, which is at most pi/2 of a step's width.
        let size = format!("QUARTER_WIDTH {width}, REST_WIDTH 14");
        let rom = Rom { words: 1 << width, width: stored + (stored + 1).saturating_sub(width) };
        all.push(counts.looked_at(Source::Interpolated, size, width == 9, plain, rom, made)?);
    }
    for iterations in [12, 16, 20, 22, 24, 26, 28] {
        let made = counts.turns.map(|turn| TrigCordic::new(phase.of(turn), iterations, 4));
        let size = format!("ITERATIONS {iterations}, GUARD 4");
        all.push(counts.looked_at(Source::Cordic, size, iterations == 24, plain, Rom { words: 0, width: 0 }, made)?);
    }
    Ok(all)
}

/// Returns the format of a sine with one integer bit.
fn narrow(frac: i32) -> Format {
    Format::new(true, 1, frac).expect("at most 32 bits")
}

/// All counts of the joints that differ.
struct Counts {
    turns: [Turn; 2],
    reach: i64,
}

impl Counts {
    /// Examines every count of both joints.
    fn looked_at<W: Wave>(
        &self,
        source: Source,
        size: String,
        default: bool,
        format: Format,
        rom: Rom,
        joints: [Result<Trig<W>, ConfigError>; 2],
    ) -> Result<Sine, ConfigError> {
        let (mut worst, mut squares, mut worst_rad, mut angles) = (0f64, 0.0, 0f64, 0u64);
        for (joint, turn) in joints.into_iter().zip(self.turns) {
            let joint = joint?;
            for count in -self.reach..self.reach {
                let (sine, cosine) = libm::sincos(TAU * (count * i64::from(turn.num)) as f64 / f64::from(turn.den));
                let TrigOut { sine: s, cosine: c, .. } = joint.at(count);
                let [s, c] = [s, c].map(|word| format.to_f64(word));
                worst = worst.max((s - sine).abs()).max((c - cosine).abs());
                squares += (s - sine) * (s - sine) + (c - cosine) * (c - cosine);
                worst_rad = worst_rad.max(libm::atan2(s * cosine - c * sine, c * cosine + s * sine).abs());
                angles += 1;
            }
        }
        let rms = (squares / (2 * angles) as f64).sqrt();
        Ok(Sine { source, size, default, format, rom, worst, rms, worst_rad, angles })
    }
}

/// First line of the CSV; units are in the names.
pub const SINES_CSV_HEADER: &str = "source,size,default,format,rom_words,rom_width_bits,rom_bits,worst,worst_lsb,\
     rms_lsb,worst_rad,latency_edges,angles,arithmetic\n";

/// Returns every source in every size as CSV, one a row.
pub fn sines_csv(all: &[Sine]) -> String {
    let mut text = SINES_CSV_HEADER.to_string();
    for sine in all {
        let Sine { source, size, default, format, rom, worst, worst_rad, angles, .. } = sine;
        let _ = writeln!(
            text,
            "{},{},{default},{},{},{},{},{worst:e},{:.4},{:.4},{worst_rad:e},1,{angles},{}",
            source.name(),
            quoted(size),
            quoted(&format.to_string()),
            rom.words,
            rom.width,
            rom.bits(),
            sine.worst_lsb(),
            sine.rms_lsb(),
            quoted(source.arithmetic()),
        );
    }
    text
}

/// Returns every source in every size as text.
pub fn sines_text(all: &[Sine], notation: Notation) -> String {
    let wide = all.iter().map(|sine| notation.of(sine.format).len()).fold(9, usize::max);
    let [first, second] = turns(&Config::default()).map(|turn| 1e6 * TAU * f64::from(turn.num) / f64::from(turn.den));
    let mut text = format!(
        "Exhausted over the {} counts of joint 1 and of joint 2 that the default tables hold, sine and cosine. \
         Latency: 1 edge, all of them.\nOne count is {first:.1} urad of joint 1 and {second:.1} urad of joints 2 and \
         3. * is the default.\n\n{:<18} {:<30} {:<wide$}{:>18}{:>9}{:>12}{:>12}{:>14}\n",
        1u64 << Config::default().depth_width,
        "source",
        "size",
        "format",
        "ROM words x bits",
        "= bits",
        "worst LSB",
        "rms LSB",
        "worst urad"
    );
    for source in Source::ALL {
        for sine in all.iter().filter(|sine| sine.source == source) {
            let rom = match sine.rom {
                Rom { words: 0, .. } => "none".to_string(),
                Rom { words, width } => format!("{words} x {width}"),
            };
            let _ = writeln!(
                text,
                "{:<18}{}{:<30} {:<wide$}{rom:>18}{:>9}{:>12.3}{:>12.3}{:>14.4}",
                source.name(),
                if sine.default { '*' } else { ' ' },
                sine.size,
                notation.of(sine.format),
                sine.rom.bits(),
                sine.worst_lsb(),
                sine.rms_lsb(),
                1e6 * sine.worst_rad,
            );
        }
        let _ = writeln!(text, "  {}\n", source.arithmetic());
    }
    text + "ROM bits are those stored once: a memory of one port takes them again for each further read of an edge.\n"
}
