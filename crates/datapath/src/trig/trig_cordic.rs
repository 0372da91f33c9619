//! Sine and cosine by CORDIC, all rotations between two edges: no table, no multiplier but that of the phase.
//!
//! - **Equation**: `phase = count STEP mod 2^PHASE_WIDTH`, in turns; `z` is its upper 30 bits, signed; half a turn is
//!   added or taken where `z` is not in `-2^28..2^28`, and the result turned round. From `x = K`, `y = 0`, for
//!   `i = 0 .. ITERATIONS-1`: `d = 1` if `z >= 0` else `-1`;
//!   `x, y, z = x - d floor(y/2^i), y + d floor(x/2^i), z - d A(i)`, with `A(i) = round(2^30 atan(2^-i) / 2 pi)` and
//!   `K = round(2^(TRIG_FRAC+GUARD) prod 1/sqrt(1+2^-2i))`. `sine` and `cosine` are `y` and `x` without their lower
//!   `GUARD` bits, to the nearest, ties up.
//! - **Ports**: `count` (1,COUNT_WIDTH-1,0) in; `sine` `cosine` (1,TRIG_INT,TRIG_FRAC), `valid`, always set, out.
//! - **Latency**: 1 edge. **Edge**: the outputs take what the count reads. **Reset**: all outputs 0.
//! - **Overflow**: none, `x` and `y` stay within `TRIG_FRAC+GUARD+3` bits.
//! - **VHDL twin**: `hdl/trig_cordic.vhd`.
//! - **Source**: Volder 1959; an alternative to the tables of Sevcik et al. 2009.
//! - **Differs from the hardware**: all rotations settle within one clock, so no limit on the clock.

use std::f64::consts::TAU;
use std::sync::Arc;

use hpu_signal::{Format, Word};

use super::phase::Phase;
use super::{Trig, TrigOut, Wave};
use crate::base::config::within;
use crate::base::listed::{Configured, Given, Listed};
use crate::base::words::{natural, nearest};
use crate::{ConfigError, Generic};

/// See the [module](self).
pub type TrigCordic = Trig<Rotations>;

/// The rotations.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Rotations {
    phase: Phase,
    guard: u32,
    /// `K`: the length that the rotations stretch to 1.
    start: i64,
    /// `A(i)`: the angle of each rotation, in turns of `2^30`.
    angles: Arc<[i64]>,
}

impl TrigCordic {
    /// Returns a wave of `iterations` rotations with `guard` more fraction bits than the result.
    ///
    /// # Errors
    ///
    /// Returns an error unless there are 4 to 28 rotations, `guard` is 0 to 8, the sines' fraction bits 4 to 28 with
    /// `guard`, counts have 4 to 24 bits, the phase 31 to 48, and the step is a VHDL `natural`.
    pub fn new(phase: Phase, iterations: u32, guard: u32) -> Result<Self, ConfigError> {
        const NAME: &str = Rotations::NAME;
        within(NAME, "ITERATIONS", iterations, 4..=28)?;
        within(NAME, "GUARD", guard, 0..=8)?;
        phase.accept(NAME, 31)?;
        within(NAME, "TRIG_FRAC + GUARD", phase.trig.frac().unsigned_abs() + guard, 4..=28)?;
        let slopes = || (0..iterations).map(|index| libm::scalbn(1.0, -index.cast_signed()));
        let stretch = libm::sqrt(slopes().map(|slope| 1.0 + slope * slope).product());
        let start = libm::round(libm::scalbn(1.0 / stretch, phase.trig.frac() + guard.cast_signed())) as i64;
        let angles = slopes().map(|slope| libm::round(libm::scalbn(libm::atan(slope) / TAU, 30)) as i64).collect();
        Ok(Trig::of(Rotations { phase, guard, start, angles }))
    }
}

crate::base::block::data_sheet!(TrigCordic = Self::new(Phase::default(), 24, 4));

impl Wave for Rotations {
    const NAME: &'static str = "trig_cordic";

    fn count(&self) -> Format {
        Format::signed(self.phase.count_width)
    }

    fn word(&self) -> Format {
        self.phase.trig
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        let iterations = u32::try_from(self.angles.len()).expect("at most 28");
        let mut all = vec![
            natural("COUNT_WIDTH", self.phase.count_width),
            natural("ITERATIONS", iterations),
            natural("GUARD", self.guard),
        ];
        all.extend(self.phase.generics());
        all
    }

    fn at<W: Word>(&self, count: W) -> TrigOut<W> {
        let (turn, frac) = (Format::signed(30), self.phase.trig.frac() + self.guard.cast_signed());
        let whole = self.phase.upper(count, 30).wrap(turn);
        // The angle is now within a quarter of a turn of 0, or of half a turn.
        let mut angle = whole.wrap(Format::signed(29));
        let is_flipped = !angle.equals(whole);
        let (mut x, mut y) = (W::int(self.start.into()), W::int(0));
        // No value leaves these words: the rotations stretch to 1, and an angle only shrinks.
        let word = Format::signed(frac.cast_unsigned() + 3);
        for (index, &rotation) in (0u32..).zip(&*self.angles) {
            let (across, along, rotation) = (y.shr(index), x.shr(index), W::int(rotation.into()));
            let on = || [x - across, y + along, angle - rotation];
            let back = || [x + across, y - along, angle + rotation];
            let [next_x, next_y, rest] = W::branch(angle.at_least(W::int(0)), on, back);
            (x, y, angle) = (next_x.wrap(word), next_y.wrap(word), rest.wrap(turn));
        }
        let [x, y] = W::branch(is_flipped, || [-x, -y], || [x, y]);
        let narrowing = nearest(frac, self.phase.trig);
        TrigOut { sine: y.narrow(&narrowing), cosine: x.narrow(&narrowing), valid: W::int(1) }
    }
}

crate::circuit::part::registers!(TrigCordic);

impl Configured for TrigCordic {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        Self::new(Phase::given(given)?, given.natural("ITERATIONS")?, given.natural("GUARD")?)
    }
}

impl Listed for TrigCordic {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let [joint_1, premium_1_5, short, _] = Phase::variants();
        let rotated = Phase { width: 31, step: 1_234_567, ..short };
        let unguarded = Phase { trig: Format::new(true, 1, 24).expect("26 bits"), ..joint_1 };
        Ok(vec![
            ("joint_1", Self::new(joint_1, 24, 4)?),
            ("premium_1_5", Self::new(premium_1_5, 24, 4)?),
            ("narrow", Self::new(rotated, 14, 3)?),
            ("unguarded", Self::new(unguarded, 28, 0)?),
        ])
    }
}
