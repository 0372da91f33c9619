//! Sine and cosine from a quarter of a sine, addressed by the rounded phase.
//!
//! - **Equation**: `phase = count STEP mod 2^PHASE_WIDTH`, in turns; `a` is `phase` rounded to `QUARTER_WIDTH+2` bits,
//!   its upper two the quadrant, the rest `i` the step; `T(i) = round(sin(pi/2 i / 2^QUARTER_WIDTH) 2^TRIG_FRAC)`;
//!   `sine = T(i), T(2^QUARTER_WIDTH - i), -T(i), -T(2^QUARTER_WIDTH - i)` by quadrant, `cosine` the same a quadrant
//!   on.
//! - **Ports**: `count` (1,COUNT_WIDTH-1,0) in; `sine` `cosine` (1,TRIG_INT,TRIG_FRAC), `valid`, always set, out.
//! - **Latency**: 1 edge. **Edge**: the outputs take what the count reads. **Reset**: all outputs 0.
//! - **Overflow**: none. Off by at most half an LSB and half a step, `pi/4 2^-QUARTER_WIDTH`, and by what `STEP` is
//!   off.
//! - **VHDL twin**: `hdl/trig_quarter.vhd`.
//! - **Source**: the usual direct digital synthesis; an alternative to the tables of Sevcik et al. 2009.
//! - **Differs from the hardware**: multiplier and table settle within one clock, so no limit on the clock.

use hpu_signal::{Format, Word};

use super::phase::{Phase, Quarter};
use super::{Trig, TrigOut, Wave};
use crate::base::config::within;
use crate::base::listed::{Configured, Given, Listed};
use crate::base::words::natural;
use crate::{ConfigError, Generic, Rom};

/// See the [module](self).
pub type TrigQuarter = Trig<Nearest>;

/// The quarter of a sine; clones share its words.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Nearest {
    phase: Phase,
    width: u32,
    quarter: Quarter,
}

impl TrigQuarter {
    /// Returns a wave from a quarter of `2^quarter_width` steps.
    ///
    /// # Errors
    ///
    /// Returns an error unless `quarter_width` is 2 to 13, counts have 4 to 24 bits, the phase `quarter_width + 3` to
    /// 48, the step is a VHDL `natural`, and sines have an integer bit at least and 4 to 30 fraction bits.
    pub fn new(phase: Phase, quarter_width: u32) -> Result<Self, ConfigError> {
        within(Nearest::NAME, "QUARTER_WIDTH", quarter_width, 2..=13)?;
        phase.accept(Nearest::NAME, quarter_width + 3)?;
        let quarter = Quarter::new(quarter_width, phase.trig.frac());
        Ok(Trig::of(Nearest { phase, width: quarter_width, quarter }))
    }
}

crate::base::block::data_sheet!(TrigQuarter = Self::new(Phase::default(), 11));

impl Nearest {
    /// Returns the sine at an address.
    #[inline]
    fn wave<W: Word>(&self, address: W) -> W {
        let bit = |place: u32| address.bit(place);
        let step = address.wrap(Format::unsigned(self.width));
        let turn = W::int(1 << self.width);
        let size = self.quarter.at(W::select(bit(self.width), turn - step, step));
        W::select(bit(self.width + 1), -size, size)
    }
}

impl Wave for Nearest {
    const NAME: &'static str = "trig_quarter";

    fn count(&self) -> Format {
        Format::signed(self.phase.count_width)
    }

    fn word(&self) -> Format {
        self.phase.trig
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        let mut all = vec![natural("COUNT_WIDTH", self.phase.count_width), natural("QUARTER_WIDTH", self.width)];
        all.extend(self.phase.generics());
        all
    }

    fn roms(&self) -> Vec<Rom> {
        vec![Rom { name: "sines", format: self.phase.magnitude(), words: self.quarter.words().0 }]
    }

    #[inline]
    fn at<W: Word>(&self, count: W) -> TrigOut<W> {
        // The phase has one bit more than the address, so that it can be rounded.
        let (fine, turn) = (self.phase.upper(count, self.width + 3), Format::unsigned(self.width + 2));
        let address = (fine + W::int(1)).shr(1).wrap(turn);
        let ahead = (address + W::int(1 << self.width)).wrap(turn);
        TrigOut { sine: self.wave(address), cosine: self.wave(ahead), valid: W::int(1) }
    }
}

impl Configured for TrigQuarter {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        Self::new(Phase::given(given)?, given.natural("QUARTER_WIDTH")?)
    }
}

impl Listed for TrigQuarter {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let [joint_1, premium_1_5, short, long] = Phase::variants();
        Ok(vec![
            ("joint_1", Self::new(joint_1, 11)?),
            ("premium_1_5", Self::new(premium_1_5, 11)?),
            ("narrow", Self::new(short, 9)?),
            ("fine", Self::new(long, 10)?),
        ])
    }
}
