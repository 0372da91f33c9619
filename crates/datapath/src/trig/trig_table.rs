//! Sine and cosine from one full table, indexed by the count itself.
//!
//! - **Equation**: `sine = round(sin(2 pi count TURN_NUM / TURN_DEN) 2^TRIG_FRAC)`, to the nearest, `cosine` likewise;
//!   `valid = -2^(DEPTH_WIDTH-1) <= count < 2^(DEPTH_WIDTH-1)`, and without it both are 0.
//! - **Ports**: `count` (1,COUNT_WIDTH-1,0) in; `sine` `cosine` (1,TRIG_INT,TRIG_FRAC), `valid` out.
//! - **Latency**: 1 edge. **Edge**: the outputs take what the count reads. **Reset**: all outputs 0.
//! - **Overflow**: none. Off by at most half an LSB.
//! - **VHDL twin**: `hdl/trig_table.vhd`.
//! - **Source**: the look-up tables of Sevcik et al. 2009.
//! - **Differs from the hardware**: the paper's table covers its own workspace, whose size in counts it does not give.

use std::sync::Arc;

use hpu_signal::{Format, Sine, Word};

use super::phase::{Turn, sine};
use super::{Trig, TrigOut, Wave};
use crate::base::config::{NATURAL, within};
use crate::base::listed::{Configured, Given, Listed};
use crate::base::words::{accept_trig, natural, parts};
use crate::{ConfigError, Generic, Rom};

/// See the [module](self).
pub type TrigTable = Trig<Table>;

/// The full table; clones share its words.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Table {
    count: Format,
    depth: Format,
    turn: Turn,
    trig: Format,
    /// Sine and cosine of each count, in the order of the address: counts from 0 up, then negative counts.
    sines: Arc<[i32]>,
    cosines: Arc<[i32]>,
}

impl TrigTable {
    /// Returns a table of `2^depth_width` counts of `turn` each.
    ///
    /// # Errors
    ///
    /// Returns an error unless `count_width` is 4 to 24, `depth_width` 2 to 16 and at most `count_width`, the turn's
    /// numerator and denominator are positive VHDL `natural`s and so is every count times the numerator, and sines have
    /// an integer bit at least and 4 to 30 fraction bits.
    pub fn new(count_width: u32, depth_width: u32, turn: Turn, trig: Format) -> Result<Self, ConfigError> {
        const NAME: &str = Table::NAME;
        within(NAME, "COUNT_WIDTH", count_width, 4..=24)?;
        within(NAME, "DEPTH_WIDTH", depth_width, 2..=count_width.min(16))?;
        let depth = Format::signed(depth_width);
        within(NAME, "TURN_NUM", turn.num, 1..=NATURAL / (1 << (depth_width - 1)))?;
        within(NAME, "TURN_DEN", turn.den, 1..=NATURAL)?;
        accept_trig(NAME, trig)?;
        let (num, den) = (i64::from(turn.num), i64::from(turn.den));
        let word = |quarters: i64| sine(quarters, 4 * den, trig.frac());
        let angles = (0..=1i64 << (depth_width - 1)).map(|count| 4 * count * num);
        let half: Vec<_> = angles.map(|angle| (word(angle), word(angle + den))).collect();
        // Rounding is to the nearest, so the sine of the opposite count is the opposite word.
        let below = half[1..].iter().rev().map(|&(sine, cosine)| (-sine, cosine));
        let words = half[..half.len() - 1].iter().copied().chain(below);
        let (sines, cosines): (Vec<_>, Vec<_>) = words.unzip();
        let (sines, cosines) = (sines.into(), cosines.into());
        Ok(Trig::of(Table { count: Format::signed(count_width), depth, turn, trig, sines, cosines }))
    }
}

impl Default for TrigTable {
    fn default() -> Self {
        let turn = Turn { num: 1, den: 28_000 };
        let word = Format::new(true, 9, 22).expect("a constant");
        Self::new(16, 13, turn, word).expect("the data sheet's default")
    }
}

impl Wave for Table {
    const NAME: &'static str = "trig_table";

    fn count(&self) -> Format {
        self.count
    }

    fn word(&self) -> Format {
        self.trig
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        let mut all = vec![
            natural("COUNT_WIDTH", self.count.width()),
            natural("DEPTH_WIDTH", self.depth.width()),
            natural("TURN_NUM", self.turn.num),
            natural("TURN_DEN", self.turn.den),
        ];
        all.extend(parts("TRIG_INT", "TRIG_FRAC", self.trig));
        all
    }

    fn roms(&self) -> Vec<Rom> {
        let rom = |name, words: &[i32]| {
            let words = words.iter().map(|&word| word.into()).collect();
            Rom { name, format: self.trig, words }
        };
        vec![rom("sines", &self.sines), rom("cosines", &self.cosines)]
    }

    #[inline]
    fn at<W: Word>(&self, count: W) -> TrigOut<W> {
        let is_inside = count.at_least(W::int(self.depth.min())) & !count.above(W::int(self.depth.max()));
        let address = count.wrap(Format::unsigned(self.depth.width()));
        let Turn { num, den } = self.turn;
        let sine = Sine { num, den, is_cosine: false, frac: self.trig.frac() };
        let cosine = Sine { is_cosine: true, ..sine };
        let known = || [address.sine(sine, &self.sines), address.sine(cosine, &self.cosines), W::int(1)];
        let [sine, cosine, valid] = W::branch(is_inside, known, || [W::int(0); 3]);
        TrigOut { sine, cosine, valid }
    }
}

crate::circuit::part::registers!(TrigTable);

impl Configured for TrigTable {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        let [count_width, depth_width, num, den] =
            given.naturals(["COUNT_WIDTH", "DEPTH_WIDTH", "TURN_NUM", "TURN_DEN"])?;
        Self::new(count_width, depth_width, Turn { num, den }, given.parts(true, "TRIG")?)
    }
}

impl Listed for TrigTable {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let trig = |int, frac| Format::new(true, int, frac).expect("at most 32 bits");
        let [joint_1, ..] = Turn::PREMIUM_1_0;
        let [_, premium_1_5, _] = Turn::PREMIUM_1_5;
        Ok(vec![
            ("joint_1", Self::new(16, 13, joint_1, trig(9, 22))?),
            ("premium_1_5", Self::new(16, 13, premium_1_5, trig(9, 22))?),
            ("narrow", Self::new(8, 8, Turn { num: 1, den: 256 }, trig(1, 14))?),
            ("several_turns", Self::new(10, 6, Turn { num: 5, den: 77 }, trig(1, 30))?),
        ])
    }
}
