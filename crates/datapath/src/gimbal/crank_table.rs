//! Radius of the tip and its slope, from a table indexed by the position of the crank's servo.
//!
//! - **Equation**: with `n = clamp(count, 0, COUNT_DEN / COUNT_NUM)`, `psi = pi n COUNT_NUM / COUNT_DEN`, `L1 =
//!   CRANK_LENGTH`, `L2 = ROD_LENGTH` and `root = sqrt(L2^2 - L1^2 sin(psi)^2)`: `radius = round(OFFSET + L1 cos(psi) +
//!   root)`, `slope = round(-L1 sin(psi) (1 + L1 cos(psi) / root))`, the derivative of the radius. All lengths are in
//!   units of `2^-LENGTH_FRAC` metres, the slope in those per radian; it is never positive.
//! - **Ports**: `count` (1,COUNT_WIDTH-1,0) in; `radius`, in metres, `slope`, in metres per radian,
//!   (1,LENGTH_WIDTH-1-LENGTH_FRAC,LENGTH_FRAC) out.
//! - **Latency**: 1 edge. **Edge**: the outputs take what the count reads. **Reset**: all outputs 0.
//! - **Overflow**: none. Both are off by at most half an LSB from the closed form at the angle that the count states.
//! - **VHDL twin**: `hdl/crank_table.vhd`.
//! - **Source**: the crank-slider of Pediredla, Chandrasekaran, Annamraju, Thondiyath.
//! - **Differs from the hardware**: the paper computes on a host; its device has no such table.

use std::f64::consts::PI;
use std::sync::Arc;

use hpu_signal::{Format, Machine, Word};

use super::GimbalConfig;
use crate::base::config::{NATURAL, within};
use crate::base::listed::Listed;
use crate::{Block, ConfigError, Register, Rom, Step};

hpu_signal::ports! {
    /// Inputs of the table.
    pub struct In of |block: &CrankTable| {
        count: Format::signed(block.config.count_width), "count", "Position of the crank's servo";
    }
    /// Outputs of the table.
    pub struct Out of |block: &CrankTable| {
        radius: block.config.length, "m", "Distance of the tip from the centre";
        slope: block.config.length, "m/rad", "Derivative of the radius by the crank's angle";
    }
}

/// See the [module](self); clones share the words.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct CrankTable {
    config: GimbalConfig,
    radii: Arc<[i32]>,
    slopes: Arc<[i32]>,
    out: Out<i64>,
}

impl CrankTable {
    /// Returns the table of a device. It uses only lengths and counts.
    ///
    /// # Errors
    ///
    /// Returns an error unless lengths have 4 to 24 bits, 0 to 30 of them fraction bits, crank, rod and offset are such
    /// lengths with a rod longer than the crank, the greatest radius and each slope fit a length word, and half a turn
    /// has at most 4095 counts, all of which the count's 2 to 24 bits hold.
    pub fn new(config: GimbalConfig) -> Result<Self, ConfigError> {
        config.accept(Self::NAME)?;
        let [num, den] = config.count;
        within(Self::NAME, "COUNT_WIDTH", config.count_width, 2..=24)?;
        within(Self::NAME, "COUNT_NUM", num, 1..=NATURAL)?;
        within(Self::NAME, "COUNT_DEN", den, num..=NATURAL)?;
        let most = ((1 << (config.count_width - 1)) - 1).min(4095);
        within(Self::NAME, "COUNT_DEN / COUNT_NUM", den / num, 1..=most)?;
        let (crank, rod) = (f64::from(config.crank), f64::from(config.rod));
        let words = (0..=den / num).map(|count| {
            let psi = PI * f64::from(count * num) / f64::from(den);
            let (sine, cosine) = (libm::sin(psi), libm::cos(psi));
            let root = libm::sqrt(rod * rod - crank * crank * sine * sine);
            let radius = libm::round(f64::from(config.offset) + crank * cosine + root) as i32;
            (radius, libm::round(-crank * sine * (1.0 + crank * cosine / root)) as i32)
        });
        let (radii, slopes): (Vec<_>, Vec<_>) = words.unzip();
        let steepest = slopes.iter().map(|slope| slope.unsigned_abs()).max().expect("a word");
        within(Self::NAME, "the steepest slope", steepest, 0..=(1 << (config.length.width() - 1)) - 1)?;
        Ok(Self { config, radii: radii.into(), slopes: slopes.into(), out: Out { radius: 0, slope: 0 } })
    }

    fn at<W: Word>(&self, count: W) -> Out<W> {
        let place = count.limit(0, self.radii.len() as i128 - 1);
        Out { radius: place.look_up(&self.radii), slope: place.look_up(&self.slopes) }
    }

    #[inline]
    fn read(&self, count: i64) -> Out<i64> {
        self.at(Machine::<i64>::of(count)).map(|port| port.narrowed().word)
    }
}

impl Step for CrankTable {
    fn registers(&self) -> Vec<Register> {
        vec![Register::new("radius", self.config.length), Register::new("slope", self.config.length)]
    }

    fn step<W: Word>(&self, registers: &[W], input: In<W>) -> (Vec<W>, Out<W>) {
        let [radius, slope] = *registers else { unreachable!("two registers") };
        let next = self.at(input.count);
        (vec![next.radius, next.slope], Out { radius, slope })
    }
}

crate::base::listed::configured!(CrankTable: GimbalConfig, |config| {
    // The lengths and the counts: no angles.
    let all = config.generics();
    [&all[..5], &all[9..]].concat()
});

impl Block for CrankTable {
    const NAME: &'static str = "crank_table";
    crate::base::block::clocked!();

    fn roms(&self) -> Vec<Rom> {
        let rom = |name, words: &[i32]| {
            let words = words.iter().map(|&word| word.into()).collect();
            Rom { name, format: self.config.length, words }
        };
        vec![rom("radii", &self.radii), rom("slopes", &self.slopes)]
    }

    fn reset(&mut self) -> Out<i64> {
        self.out = Out { radius: 0, slope: 0 };
        self.out
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        self.out = self.read(input.count);
        self.out
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        if self.read(input.count) == self.out { u64::MAX } else { 0 }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
    }
}

impl Listed for CrankTable {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("narrow", Self::new(GimbalConfig::narrow())?), ("short", Self::new(GimbalConfig::short())?)])
    }
}

crate::circuit::part::registers!(CrankTable);
