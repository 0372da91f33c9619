//! The geometry and the words of an arm, shared by its blocks and wirings.

use hpu_signal::{Format, Rounding};

use crate::base::listed::Given;
use crate::base::words::{natural, parts};
use crate::trig::Turn;
use crate::{ConfigError, Generic};

/// The formats along the path from an angle to a torque.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Formats {
    /// Sines and cosines.
    pub trig: Format,
    /// Fraction bits of the lengths, in metres.
    pub length_frac: u32,
    /// Positions of the tip and of the walls, in metres.
    pub position: Format,
    /// Stiffness of the walls, in N/m.
    pub stiffness: Format,
    /// Forces on the tip, in newtons.
    pub force: Format,
    /// Torques about the joints, in N.m.
    pub torque: Format,
}

/// An arm and the datapath that drives it; the default is the Premium 1.0.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Config {
    /// Width of the position counters.
    pub position_width: u32,
    /// Width of the sample period.
    pub period_width: u32,
    /// Width of the counts that the tables of sines hold.
    pub depth_width: u32,
    /// Angle of one count of each joint.
    pub turns: [Turn; 3],
    /// The words along the path.
    pub formats: Formats,
    /// Lengths of the upper arm and the forearm, `length / 2^length_frac` metres.
    pub lengths: [u32; 2],
    /// Greatest force, a word of its format.
    pub force_limit: u32,
    /// Command per torque of each joint, `gain / 2^gain_frac` DAC counts per N.m.
    pub gains: [u32; 3],
    /// Fraction bits of the gains.
    pub gain_frac: u32,
    /// Width of the commands.
    pub command_width: u32,
    /// Edges from a sample to the capture of its results: in the parallel loop the commands' register captures them, in
    /// the shared loop the engine captures the sines.
    pub delay: u32,
}

impl Default for Formats {
    fn default() -> Self {
        Self {
            trig: format(true, 9, 22),
            length_frac: 24,
            position: format(true, 0, 24),
            stiffness: format(false, 16, 2),
            force: format(true, 4, 16),
            torque: format(true, 3, 20),
        }
    }
}

impl Default for Config {
    fn default() -> Self {
        Self {
            position_width: 16,
            period_width: 24,
            depth_width: 13,
            turns: Turn::PREMIUM_1_0,
            formats: Formats::default(),
            lengths: [2_348_810; 2],
            force_limit: 557_056,
            gains: [201_134, 220_289, 220_289],
            gain_frac: 3,
            command_width: 16,
            delay: 8,
        }
    }
}

impl Config {
    /// Returns the Premium 1.5: 0.215 m and 0.170 m, encoders of 4096 counts behind ratios of 13.3, 11.2 and 11.2, the
    /// motors and amplifiers of the 1.0 (0.17 N.m at the motor for a full scale of `2^15` DAC counts).
    pub fn premium_1_5() -> Self {
        Self {
            turns: Turn::PREMIUM_1_5,
            lengths: [3_607_101, 2_852_127],
            gains: [115_942, 137_681, 137_681],
            ..Self::default()
        }
    }

    /// Returns the Premium 1.0 with (1,9,22) everywhere, and (0,9,22) for the stiffness.
    pub fn plain_q22() -> Self {
        let word = format(true, 9, 22);
        let formats = Formats {
            trig: word,
            length_frac: 22,
            position: word,
            stiffness: format(false, 9, 22),
            force: word,
            torque: word,
        };
        Self { formats, lengths: [587_203; 2], force_limit: 35_651_584, ..Self::default() }
    }

    /// Returns this configuration with tables of (1,1,22): all the bits that a sine with 22 fraction bits has.
    #[must_use]
    pub fn narrow(self) -> Self {
        Self { formats: Formats { trig: format(true, 1, 22), ..self.formats }, ..self }
    }

    /// Returns this configuration with `frac` fraction bits, at most those of its lengths, in sines, lengths and
    /// positions. A sine has one integer bit, a position none.
    ///
    /// # Panics
    ///
    /// When `frac` exceeds the fraction bits of the lengths.
    #[must_use]
    pub fn fraction(self, frac: u32) -> Self {
        let bits = i32::try_from(frac).expect("at most those of the lengths");
        let dropped = self.formats.length_frac.checked_sub(frac).expect("at most those of the lengths");
        let nearest = |word: u32| {
            let word = Rounding::NearestUp.shift(i64::from(word), dropped);
            u32::try_from(word).expect("a word that is none longer")
        };
        let formats =
            Formats { trig: format(true, 1, bits), length_frac: frac, position: format(true, 0, bits), ..self.formats };
        Self { formats, lengths: self.lengths.map(nearest), ..self }
    }

    /// Returns this configuration for the shared loop, whose engine starts two edges after a sample, as soon as
    /// the sines are known.
    #[must_use]
    pub fn shared(self) -> Self {
        Self { delay: 2, ..self }
    }

    /// Returns the VHDL generics of the loops, in the order of the entity.
    pub(crate) fn generics(&self) -> Vec<(&'static str, Generic)> {
        let [turn_1, turn_2, turn_3] = self.turns;
        let mut all = vec![
            natural("POSITION_WIDTH", self.position_width),
            natural("PERIOD_WIDTH", self.period_width),
            natural("DEPTH_WIDTH", self.depth_width),
            natural("TURN_NUM_1", turn_1.num),
            natural("TURN_DEN_1", turn_1.den),
            natural("TURN_NUM_2", turn_2.num),
            natural("TURN_DEN_2", turn_2.den),
            natural("TURN_NUM_3", turn_3.num),
            natural("TURN_DEN_3", turn_3.den),
        ];
        all.extend(self.path_generics());
        all.push(natural("DELAY", self.delay));
        all
    }

    /// Returns the VHDL generics of the path from sines to commands.
    pub(crate) fn path_generics(&self) -> Vec<(&'static str, Generic)> {
        let Formats { trig, length_frac, position, stiffness, force, torque } = self.formats;
        let mut all = parts("TRIG_INT", "TRIG_FRAC", trig).to_vec();
        all.push(natural("LENGTH_FRAC", length_frac));
        all.push(natural("LENGTH_1", self.lengths[0]));
        all.push(natural("LENGTH_2", self.lengths[1]));
        all.extend(parts("POSITION_INT", "POSITION_FRAC", position));
        all.extend(parts("STIFFNESS_INT", "STIFFNESS_FRAC", stiffness));
        all.extend(parts("FORCE_INT", "FORCE_FRAC", force));
        all.push(natural("FORCE_LIMIT", self.force_limit));
        all.extend(parts("TORQUE_INT", "TORQUE_FRAC", torque));
        all.push(natural("GAIN_1", self.gains[0]));
        all.push(natural("GAIN_2", self.gains[1]));
        all.push(natural("GAIN_3", self.gains[2]));
        all.push(natural("GAIN_FRAC", self.gain_frac));
        all.push(natural("COMMAND_WIDTH", self.command_width));
        all
    }
}

fn format(signed: bool, int: i32, frac: i32) -> Format {
    Format::new(signed, int, frac).expect("a constant")
}

impl Formats {
    /// Reads the formats that the block has as generics; the others are those of the default configuration.
    pub(crate) fn given(given: &Given) -> Result<Self, ConfigError> {
        let default = Self::default();
        Ok(Self {
            trig: given.field(&["TRIG_INT", "TRIG_FRAC"], default.trig)?,
            length_frac: given.field(&["LENGTH_FRAC"], default.length_frac)?,
            position: given.field(&["POSITION_INT", "POSITION_FRAC"], default.position)?,
            stiffness: given.field(&["STIFFNESS_INT", "STIFFNESS_FRAC"], default.stiffness)?,
            force: given.field(&["FORCE_INT", "FORCE_FRAC"], default.force)?,
            torque: given.field(&["TORQUE_INT", "TORQUE_FRAC"], default.torque)?,
        })
    }
}

impl Config {
    /// Reads the generics that the block has; the others are those of the default.
    pub(crate) fn given(given: &Given) -> Result<Self, ConfigError> {
        let default = Self::default();
        let turn = |names: &[&'static str; 2], Turn { num, den }: Turn| {
            given.field(names, [num, den]).map(|[num, den]| Turn { num, den })
        };
        let [turn_1, turn_2, turn_3] = default.turns;
        Ok(Self {
            position_width: given.field(&["POSITION_WIDTH"], default.position_width)?,
            period_width: given.natural("PERIOD_WIDTH")?,
            depth_width: given.field(&["DEPTH_WIDTH"], default.depth_width)?,
            turns: [
                turn(&["TURN_NUM_1", "TURN_DEN_1"], turn_1)?,
                turn(&["TURN_NUM_2", "TURN_DEN_2"], turn_2)?,
                turn(&["TURN_NUM_3", "TURN_DEN_3"], turn_3)?,
            ],
            formats: Formats::given(given)?,
            lengths: given.naturals(["LENGTH_1", "LENGTH_2"])?,
            force_limit: given.natural("FORCE_LIMIT")?,
            gains: given.naturals(["GAIN_1", "GAIN_2", "GAIN_3"])?,
            gain_frac: given.natural("GAIN_FRAC")?,
            command_width: given.natural("COMMAND_WIDTH")?,
            delay: given.natural("DELAY")?,
        })
    }
}
