//! Sine and cosine from a quarter of a sine, with linear interpolation between its steps.
//!
//! - **Equation**: `phase = count STEP mod 2^PHASE_WIDTH`, in turns; its upper two bits are the quadrant `q`, the next
//!   `QUARTER_WIDTH+REST_WIDTH` are `f`, the others are dropped; `g = f` for even `q`,
//!   `2^(QUARTER_WIDTH+REST_WIDTH) - f` for odd; `i` is the upper part of `g`, `r` its lower `REST_WIDTH` bits; `m =
//!   T(i) + floor(((T(i+1) - T(i)) r + 2^(REST_WIDTH-1)) / 2^REST_WIDTH)` with `T(i) = round(sin(pi/2 i /
//!   2^QUARTER_WIDTH) 2^TRIG_FRAC)`; `sine = m, m, -m,
//!   -m` by quadrant, `cosine` the same a quadrant on with the same `f`.
//! - **Ports**: `count` (1,COUNT_WIDTH-1,0) in; `sine` `cosine` (1,TRIG_INT,TRIG_FRAC), `valid`, always set, out.
//! - **Latency**: 1 edge. **Edge**: the outputs take what the count reads. **Reset**: all outputs 0.
//! - **Overflow**: none. Off by at most one LSB, the chord's `(pi/2 2^-QUARTER_WIDTH)^2 / 8`, and by what the phase is
//!   off: `pi/2 2^-(QUARTER_WIDTH+REST_WIDTH)` dropped, and `STEP`.
//! - **VHDL twin**: `hdl/trig_interpolated.vhd`.
//! - **Source**: the usual interpolated table; an alternative to the tables of Sevcik et al. 2009.
//! - **Differs from the hardware**: multipliers and table settle within one clock, so no limit on the clock.

use hpu_signal::{Format, Word};

use super::phase::{Phase, Quarter};
use super::{Trig, TrigOut, Wave};
use crate::base::config::within;
use crate::base::listed::{Configured, Given, Listed};
use crate::base::words::natural;
use crate::{ConfigError, Generic, Rom};

/// See the [module](self).
pub type TrigInterpolated = Trig<Chords>;

/// The quarter of a sine, and the width of the fraction between its steps; clones share its words.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Chords {
    phase: Phase,
    width: u32,
    rest: u32,
    quarter: Quarter,
}

impl TrigInterpolated {
    /// Returns a wave from a quarter of `2^quarter_width` steps, each divided into `2^rest_width`.
    ///
    /// # Errors
    ///
    /// Returns an error unless `quarter_width` is 2 to 12, `rest_width` 1 to 20, counts have 4 to 24 bits, the phase
    /// `quarter_width + rest_width + 2` to 48, the step is a VHDL `natural`, and sines have an integer bit at least and
    /// 4 to 30 fraction bits.
    pub fn new(phase: Phase, quarter_width: u32, rest_width: u32) -> Result<Self, ConfigError> {
        within(Chords::NAME, "QUARTER_WIDTH", quarter_width, 2..=12)?;
        within(Chords::NAME, "REST_WIDTH", rest_width, 1..=20)?;
        phase.accept(Chords::NAME, quarter_width + rest_width + 2)?;
        let quarter = Quarter::new(quarter_width, phase.trig.frac());
        Ok(Trig::of(Chords { phase, width: quarter_width, rest: rest_width, quarter }))
    }
}

crate::base::block::data_sheet!(TrigInterpolated = Self::new(Phase::default(), 9, 14));

impl Chords {
    /// Returns the sine in a quadrant, at a fraction of it.
    #[inline]
    fn wave<W: Word>(&self, quadrant: W, fraction: W) -> W {
        let bit = |place: u32| quadrant.bit(place);
        let turn = W::int(1 << (self.width + self.rest));
        let folded = W::select(bit(0), turn - fraction, fraction);
        let (index, rest) = (folded.shr(self.rest), folded.wrap(Format::unsigned(self.rest)));
        let half = W::int(1 << (self.rest - 1));
        let size = self.quarter.at(index) + (self.quarter.rise(index) * rest + half).shr(self.rest);
        W::select(bit(1), -size, size)
    }
}

impl Wave for Chords {
    const NAME: &'static str = "trig_interpolated";

    fn count(&self) -> Format {
        Format::signed(self.phase.count_width)
    }

    fn word(&self) -> Format {
        self.phase.trig
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        let mut all = vec![
            natural("COUNT_WIDTH", self.phase.count_width),
            natural("QUARTER_WIDTH", self.width),
            natural("REST_WIDTH", self.rest),
        ];
        all.extend(self.phase.generics());
        all
    }

    fn roms(&self) -> Vec<Rom> {
        let (points, rises) = self.quarter.words();
        let rom = |name, words| Rom { name, format: self.phase.magnitude(), words };
        vec![rom("points", points), rom("rises", rises)]
    }

    #[inline]
    fn at<W: Word>(&self, count: W) -> TrigOut<W> {
        let turn = self.width + self.rest;
        let phase = self.phase.upper(count, turn + 2);
        let (quadrant, fraction) = (phase.shr(turn), phase.wrap(Format::unsigned(turn)));
        let ahead = quadrant + W::int(1);
        TrigOut { sine: self.wave(quadrant, fraction), cosine: self.wave(ahead, fraction), valid: W::int(1) }
    }
}

impl Configured for TrigInterpolated {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        Self::new(Phase::given(given)?, given.natural("QUARTER_WIDTH")?, given.natural("REST_WIDTH")?)
    }
}

impl Listed for TrigInterpolated {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let [joint_1, premium_1_5, short, long] = Phase::variants();
        Ok(vec![
            ("joint_1", Self::new(joint_1, 9, 14)?),
            ("premium_1_5", Self::new(premium_1_5, 9, 14)?),
            ("narrow", Self::new(short, 5, 5)?),
            ("fine", Self::new(long, 10, 20)?),
        ])
    }
}
