//! Length and angle of a vector by CORDIC, one rotation an edge.
//!
//! - **Equation**: `radius = hypot(x, y)`, `angle = atan2(y, x)` in half turns. `x`, `y`, shifted left by `GUARD`, are
//!   turned by half a turn where `x < 0`: `x, y, z = -x, -y, -1`, else `z = 0`. For `i = 0 .. ROTATIONS-1`, with `d =
//!   1` if `y >= 0` else `-1`: `x, y, z = x + d floor(y/2^i), y - d floor(x/2^i), z + d A(i)`. `z` has `GUARD` more
//!   fraction bits than the angle and wraps; `A(i) = round(2^(ANGLE_WIDTH-1+GUARD) atan(2^-i) / pi)`. At the end
//!   `angle = floor(z/2^GUARD + 1/2)` and `radius = floor(x C / 2^(WIDTH+2+GUARD) + 1/2)` with
//!   `C = round(2^(WIDTH+2) prod 1/sqrt(1+2^-2i))`. For `x = y = 0` both are 0.
//! - **Ports**: `start` (0,1,0), `x` `y` (1,WIDTH-1,0) in; `radius` (0,WIDTH,0), in units of `x` and `y`, `angle`
//!   (1,0,ANGLE_WIDTH-1), `busy`, `ready` (0,1,0) out.
//! - **Latency**: `ROTATIONS + 1` edges from the edge with `start` to the one that loads radius and angle.
//! - **Edge**: with `start`, `x` and `y` are captured, the rotations begin and `busy` rises; those under way are given
//!   up, even on their last edge. Each of the next `ROTATIONS` edges rotates; the edge after them loads the results,
//!   `busy` falls and `ready` is high for one edge.
//! - **Reset**: idle, all outputs 0.
//! - **Overflow**: none. An angle that is nearest to 1 wraps to -1, which is the same direction. Both results are
//!   rounded to the nearest, ties up. [`CordicConfig::bound`] is the derived bound of their errors.
//! - **VHDL twin**: `hdl/cordic.vhd`.
//! - **Source**: Volder 1959, the vectoring mode.
//! - **Differs from the hardware**: a design of this project, not of a paper. The emulator computes the results at the
//!   start and shows them when they are ready: the ports are exact at every edge, the registers within are not
//!   modelled.

use std::f64::consts::{PI, SQRT_2};
use std::sync::Arc;

use hpu_signal::{Format, Word};

use crate::base::computation::Computation;
use crate::base::config::within;
use crate::base::listed::Listed;
use crate::step::loads_first;
use crate::{Block, ConfigError, Lemma, Register, Step};

hpu_signal::ports! {
    /// Inputs of the CORDIC.
    pub struct In of |block: &Cordic| {
        start, "Captures the vector and begins";
        x: Format::signed(block.config.width), "1", "First coordinate";
        y: Format::signed(block.config.width), "1", "Second coordinate";
    }
    /// Outputs of the CORDIC.
    pub struct Out of |block: &Cordic| {
        radius: Format::unsigned(block.config.width), "1", "Length of the latest vector that was measured";
        angle: block.config.angle(), "half_turn", "Angle from the first axis to that vector";
        busy, "Rotations are under way";
        ready, "Radius and angle are new, for one edge";
    }
}

crate::base::listed::configuration! {
    /// The widths of a CORDIC.
    pub struct CordicConfig {
        /// Width of both coordinates.
        width: u32 = 21, ["WIDTH"];
        /// Width of the angle.
        angle_width: u32 = 20, ["ANGLE_WIDTH"];
        /// Bits below those of coordinates and angle, which keep the rounding of the rotations small.
        guard: u32 = 4, ["GUARD"];
        /// The number of rotations.
        rotations: u32 = 20, ["ROTATIONS"];
    }
}

/// The most by which the results of a CORDIC differ from length and angle of the vector.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CordicBound {
    /// Error of the angle, in half turns, as a difference of directions.
    pub angle: f64,
    /// Error of the radius, in its least significant bits.
    pub radius: f64,
}

impl CordicConfig {
    /// Returns the number of edges from the start to the results.
    pub const fn steps(self) -> u32 {
        self.rotations + 1
    }

    /// Returns the format of the angle: half turns, from -1 to just below 1.
    pub fn angle(self) -> Format {
        Format::new(true, 0, self.angle_width.cast_signed() - 1).expect("3 to 31 bits")
    }

    /// Fraction bits of the constant that divides the radius by the rotations' gain.
    const fn gain_frac(self) -> u32 {
        self.width + 2
    }

    /// Returns the tangents of the rotations.
    fn tangents(self) -> impl Iterator<Item = f64> {
        (0..self.rotations).map(|index| libm::scalbn(1.0, -index.cast_signed()))
    }

    /// Returns the angle of each rotation in the units of `z`, not rounded.
    fn rotations(self) -> impl Iterator<Item = f64> {
        let frac = (self.angle_width - 1 + self.guard).cast_signed();
        self.tangents().map(move |tangent| libm::scalbn(libm::atan(tangent) / PI, frac))
    }

    /// Returns `1/K` in the units of the constant `C`, not rounded.
    fn shrinking(self) -> f64 {
        let gain = libm::sqrt(self.tangents().map(|tangent| 1.0 + tangent * tangent).product());
        libm::scalbn(1.0 / gain, self.gain_frac().cast_signed())
    }

    /// Returns the bound of the errors for a vector whose length in least significant bits is `radius`.
    ///
    /// Each rotation but the first drops bits of both shifted coordinates, which displaces the vector by less than
    /// `sqrt(2)` units of the guard bits. Behind rotation `i` the vector is at least `K(i) 2^GUARD radius` long, less
    /// the displacements so far, so each of them turns it by a known angle at most; `turned` is the sum. The remaining
    /// angle is at most `atan(2^-(ROTATIONS-1))`, that of the last rotation, plus the turns since `y` changed its sign
    /// for the last time. These turns are not in the sum of the angle's error, so that sum and remaining angle together
    /// are at most `turned` and one last rotation. The rounding of each constant and of the result is added. The radius
    /// has the error of the displacements, the cosine of the remaining angle, and the rounding of `C` and of the
    /// result.
    pub fn bound(self, radius: f64) -> CordicBound {
        let turn = libm::scalbn(1.0, (self.angle_width - 1).cast_signed());
        let guarded = libm::scalbn(1.0, self.guard.cast_signed());
        let (mut gain, mut displaced, mut turned) = (SQRT_2, 0.0, 0.0);
        for tangent in self.tangents().skip(1) {
            let stretch = libm::sqrt(1.0 + tangent * tangent);
            (gain, displaced) = (gain * stretch, displaced * stretch + SQRT_2);
            let (length, step) = (gain * guarded * radius - displaced, SQRT_2);
            turned += if length > step { libm::asin(step / length) } else { PI };
        }
        let last = libm::atan(self.tangents().last().expect("4 rotations at least"));
        let constants: f64 = self.rotations().map(|angle| (angle - angle.round()).abs()).sum();
        let nearest = if self.guard > 0 { 0.5 } else { 0.0 };
        let angle = (turned + last) / PI + (constants / guarded + nearest) / turn;

        let (shrinking, long) = (self.shrinking(), gain * guarded * radius);
        let scale = shrinking.round() / shrinking / (gain * guarded);
        let above = (long + displaced) * scale - radius;
        let below = radius - (long - displaced).max(0.0) * libm::cos((turned + last).min(PI / 2.0)) * scale;
        CordicBound { angle: angle.min(1.0), radius: above.max(below) + 0.5 }
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Cordic {
    config: CordicConfig,
    /// `A`: the angle of each rotation.
    angles: Arc<[i64]>,
    /// `C`: the factor of the radius.
    shrinking: i64,
    computation: Computation<(i64, i64)>,
}

impl Cordic {
    /// Returns a CORDIC with these widths.
    ///
    /// # Errors
    ///
    /// Returns an error unless coordinates have 3 to 25 bits, the angle 3 to 24, 0 to 7 bits guard them, and there are
    /// 4 rotations at least and at most as many as a coordinate and its guard have bits.
    pub fn new(config: CordicConfig) -> Result<Self, ConfigError> {
        within(Self::NAME, "WIDTH", config.width, 3..=25)?;
        within(Self::NAME, "ANGLE_WIDTH", config.angle_width, 3..=24)?;
        within(Self::NAME, "GUARD", config.guard, 0..=7)?;
        within(Self::NAME, "ROTATIONS", config.rotations, 4..=(config.width + config.guard).max(4))?;
        let angles = config.rotations().map(|angle| libm::round(angle) as i64).collect();
        let shrinking = libm::round(config.shrinking()) as i64;
        Ok(Self { config, angles, shrinking, computation: Computation::new(config.steps(), (0, 0)) })
    }

    /// Returns the widths.
    pub fn config(&self) -> CordicConfig {
        self.config
    }

    /// Returns radius and angle of a vector.
    #[inline]
    pub fn measure(&self, x: i64, y: i64) -> (i64, i64) {
        let CordicConfig { width, angle_width, guard, .. } = self.config;
        if (x, y) == (0, 0) {
            return (0, 0);
        }
        let half_turn = -(1 << (angle_width - 1 + guard));
        let (sign, mut z) = if x < 0 { (-1, half_turn) } else { (1, 0) };
        let (mut x, mut y) = ((sign * x) << guard, (sign * y) << guard);
        for (index, &angle) in self.angles.iter().enumerate() {
            let (along, across) = (x >> index, y >> index);
            (x, y, z) = if y >= 0 { (x + across, y - along, z + angle) } else { (x - across, y + along, z - angle) };
        }
        let drop = self.config.gain_frac() + guard;
        let radius = (x * self.shrinking + (1 << (drop - 1))) >> drop;
        let angle = (z + ((1 << guard) >> 1)) >> guard;
        (Format::unsigned(width).wrap(radius.into()), Format::signed(angle_width).wrap(angle.into()))
    }

    #[inline]
    fn started(&self, input: &In<i64>) -> Option<(i64, i64)> {
        (input.start != 0).then(|| self.measure(input.x, input.y))
    }

    #[inline]
    fn shown(&self) -> Out<i64> {
        let (radius, angle) = self.computation.result();
        Out { radius, angle, busy: self.computation.busy().into(), ready: self.computation.ready().into() }
    }
}

/// The equations of the VHDL, which rotates once an edge.
impl Step for Cordic {
    fn registers(&self) -> Vec<Register> {
        let CordicConfig { width, angle_width, guard, .. } = self.config;
        let coordinate = Format::signed(width + guard + 2);
        vec![
            Register::new("remaining", Format::unsigned(u32::BITS - self.config.steps().leading_zeros())),
            Register::kept("along", coordinate),
            Register::kept("across", coordinate),
            Register::kept("turned", Format::signed(angle_width + guard)),
            Register::kept("is_zero", Format::BIT),
            Register::new("radius", Format::unsigned(width)),
            Register::new("angle", self.config.angle()),
            Register::new("busy", Format::BIT),
            Register::new("ready", Format::BIT),
        ]
    }

    fn step<W: Word>(&self, registers: &[W], In { start, x, y }: In<W>) -> (Vec<W>, Out<W>) {
        let [remaining, along, across, turned, is_zero, radius, angle, busy, ready] = *registers else {
            unreachable!("registers")
        };
        let CordicConfig { width, angle_width, guard, rotations } = self.config;
        let (zero, one) = (W::int(0), W::int(1));
        let (coordinate, turn) = (Format::signed(width + guard + 2), Format::signed(angle_width + guard));
        let starts = || {
            let none = x.equals(zero) & y.equals(zero);
            let right = || [x.shl(guard), y.shl(guard), zero];
            let left = || [-x.shl(guard), -y.shl(guard), W::int(turn.min())];
            let [along, across, turned] = W::branch(x.at_least(zero), right, left);
            [W::int(self.config.steps().into()), along, across, turned, W::of_bit(none), radius, angle, one, zero]
        };
        let rotates = || {
            let first = [along, across, W::int(self.angles[0].into())];
            let shifted = (1..rotations).fold(first, |others, index| {
                let is_now = remaining.equals(W::int((rotations + 1 - index).into()));
                let rotation = W::int(self.angles[index as usize].into());
                W::branch(is_now, || [along.shr(index), across.shr(index), rotation], || others)
            });
            let [by_along, by_across, rotation] = shifted;
            let back = || [along + by_across, across - by_along, turned + rotation];
            let on = || [along - by_across, across + by_along, turned - rotation];
            let [along, across, turned] = W::branch(across.at_least(zero), back, on);
            let (along, across, turned) = (along.wrap(coordinate), across.wrap(coordinate), turned.wrap(turn));
            [remaining - one, along, across, turned, is_zero, radius, angle, busy, zero]
        };
        let loads = || {
            let drop = self.config.gain_frac() + guard;
            let product = along * W::int(self.shrinking.into());
            let radius = (product + W::int(1 << (drop - 1))).shr(drop).wrap(Format::unsigned(width));
            let nearest = (turned + W::int((1 << guard) >> 1)).shr(guard).wrap(self.config.angle());
            let angle = W::select(is_zero.is_set(), zero, nearest);
            [zero, along, across, turned, is_zero, radius, angle, zero, one]
        };
        let idles = || [remaining, along, across, turned, is_zero, radius, angle, busy, zero];
        let runs = || W::branch(remaining.equals(one), loads, rotates);
        let next = W::branch(start.is_set(), starts, || W::branch(remaining.is_set(), runs, idles));
        (next.to_vec(), Out { radius, angle, busy, ready })
    }

    fn lemmas(&self) -> Vec<Lemma<'_>> {
        vec![loads_first(self, |one, _| one[0].equals(Word::int(0)))]
    }
}

crate::base::listed::configured!(Cordic: CordicConfig);

impl Block for Cordic {
    const NAME: &'static str = "cordic";
    crate::base::block::computing!((0, 0));
}

impl Listed for Cordic {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let cordic = |[width, angle_width, guard, rotations]: [u32; 4]| {
            Self::new(CordicConfig { width, angle_width, guard, rotations })
        };
        Ok(vec![
            ("narrow", cordic([8, 9, 3, 9])?),
            ("unguarded", cordic([12, 8, 0, 10])?),
            ("coarse", cordic([3, 3, 1, 4])?),
            ("wide", cordic([25, 24, 7, 27])?),
        ])
    }
}
