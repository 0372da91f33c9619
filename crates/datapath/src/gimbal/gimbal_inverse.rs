//! Inverse kinematics: the joints' angles at which the tip is at a given position, by one CORDIC and one square root.
//!
//! - **Equation**: `roll = atan2(-x, y)`, `pitch = atan2(z, hypot(x, y))`, `r = hypot(x, y, z)`. With `LEAST =
//!   ROD_LENGTH - CRANK_LENGTH`, `MOST = ROD_LENGTH + CRANK_LENGTH`, `R = clamp(r - OFFSET, LEAST, MOST)`, `P =
//!   floor((MOST - R) (R + LEAST) / 2^DROP)` and `Q = floor((R - LEAST) (R + MOST) / 2^DROP)`, the cosine rule is
//!   `(Q + P) cos(psi) = Q - P`, but for the floors; so `psi = atan2(floor(sqrt(4 P Q)), Q - P)` without a division.
//!   `radius = OFFSET + R`; `crank = psi`, clamped to 0 .. all ones. `DROP` is the least number for which
//!   `4 CRANK_LENGTH MOST < 2^(LENGTH_WIDTH + DROP)`. Pitch and roll are clamped to `-LIMIT .. LIMIT`. `out_of_reach`
//!   where one of these two or `R` is changed by its clamp. Every `atan2` and `hypot` is that of a `cordic` of
//!   `LENGTH_WIDTH + 1` bits, first of `(y, -x)`, then of the radius of the first and `z`, then of `(Q - P, root)`.
//! - **Ports**: `start` (0,1,0), `x` `y` `z` (1,LENGTH_WIDTH-1-LENGTH_FRAC,LENGTH_FRAC), in metres, in; `pitch` `roll`
//!   `crank` (1,0,ANGLE_WIDTH-1), in half turns, `radius`, a length, `out_of_reach`, `busy`, `ready` (0,1,0) out.
//! - **Latency**: `3 ROTATIONS + LENGTH_WIDTH + 13` edges from the edge with `start` to the one that loads the joints.
//! - **Edge**: with `start`, the position is captured and `busy` rises; what is under way is given up, even on its last
//!   edge. With the joints, `busy` falls and `ready` is high for one edge.
//! - **Reset**: idle, all outputs 0.
//! - **Overflow**: none. Beyond the reach, each joint is at its nearest limit, so that the tip is not at the target; a
//!   target on the limit itself may be told as out of reach by the rounding. [`GimbalInverse::bound`] is the derived
//!   bound of the tip's position within the reach. At the origin, pitch and roll are 0.
//! - **VHDL twin**: `hdl/gimbal_inverse.vhd`, around a `cordic` and a `square_root`.
//! - **Source**: the kinematics of Pediredla, Chandrasekaran, Annamraju, Thondiyath.
//! - **Differs from the hardware**: a design of this project, the paper computes on a host. The products take one edge,
//!   so no limit on the clock. The emulator computes the joints at the start and shows them when they are ready: the
//!   ports are exact at every edge, the registers of CORDIC and root are not modelled.

use std::f64::consts::PI;

use hpu_signal::{Format, Machine, Word};

use super::GimbalConfig;
use crate::base::computation::Computation;
use crate::base::config::within;
use crate::base::listed::Listed;
use crate::step::{equal, loads_first};
use crate::{
    Block, ConfigError, Cordic, Lemma, Register, SquareRoot, Step, arithmetic::cordic, arithmetic::square_root,
};

hpu_signal::ports! {
    /// Inputs of the kinematics.
    pub struct In of |block: &GimbalInverse| {
        start, "Captures the position and begins";
        x: block.config.length, "m", "Tip to the right of the centre";
        y: block.config.length, "m", "Tip above the centre";
        z: block.config.length, "m", "Tip before the centre";
    }
    /// Outputs of the kinematics.
    pub struct Out of |block: &GimbalInverse| {
        pitch: block.cordic.config().angle(), "half_turn", "Angle of the pitch joint";
        roll: block.cordic.config().angle(), "half_turn", "Angle of the roll joint";
        crank: block.cordic.config().angle(), "half_turn", "Angle of the crank, 0 at the greatest radius";
        radius: block.config.length, "m", "Distance of the tip from the centre";
        out_of_reach, "A joint is at its limit, the tip not at the target";
        busy, "A computation is under way";
        ready, "The joints are new, for one edge";
    }
}

hpu_signal::ports! {
    /// The results.
    pub struct Joints { pitch, roll, crank, radius, out_of_reach }
}

const NONE: Joints<i64> = Joints { pitch: 0, roll: 0, crank: 0, radius: 0, out_of_reach: 0 };

/// The number of registers beside those of CORDIC and root.
const OWN: usize = 21;

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct GimbalInverse {
    config: GimbalConfig,
    drop: u32,
    cordic: Cordic,
    root: SquareRoot,
    computation: Computation<Joints<i64>>,
}

impl GimbalInverse {
    /// Returns the kinematics of a device. It does not use the servos' counts.
    ///
    /// # Errors
    ///
    /// Returns an error unless lengths have 4 to 24 bits, 0 to 30 of them fraction bits, crank, rod and offset are such
    /// lengths with a rod longer than the crank, the greatest radius is a length word, the limit is a positive angle
    /// below half a turn, and [`Cordic::new`] accepts the widths of the angles and the rotations.
    pub fn new(config: GimbalConfig) -> Result<Self, ConfigError> {
        config.accept(Self::NAME)?;
        let cordic = Cordic::new(config.cordic())?;
        within(Self::NAME, "LIMIT", config.limit, 1..=(1 << (config.angle_width - 1)) - 1)?;
        let width = config.length.width();
        let most = 4 * u64::from(config.crank) * u64::from(config.rod + config.crank);
        let drop = (u64::BITS - most.leading_zeros()).saturating_sub(width);
        let root = SquareRoot::new(2 * width)?;
        let computation = Computation::new(3 * config.rotations + width + 13, NONE);
        Ok(Self { config, drop, cordic, root, computation })
    }

    /// Returns the number of edges from a start to the joints.
    pub fn latency(&self) -> u32 {
        3 * self.config.rotations + self.config.length.width() + 13
    }

    /// Returns the bound, in metres, of the distance between a target within the reach and the tip, if the joints were
    /// exactly at the angles that the words state.
    ///
    /// Two positions with radii that differ by `radial` and angles that differ by `pitch` and `roll` are at most
    /// `hypot(radial, r pitch, r roll)` apart. The errors of the angles are those of the CORDIC for the shortest
    /// vectors; the error of the first radius also turns the second vector. The radius has the errors of two radii and
    /// of the crank's angle. That angle is ill-conditioned at the dead centres, the radius is not: it depends on
    /// `cos(psi) = (Q - P) / (Q + P)` with a slope of at most `L1 (1 + L1 / L2)`, for the lengths L1 of the crank and
    /// L2 of the rod, which also bounds its derivative by `psi`. The floors of `P` and `Q` change this cosine by at
    /// most `2 / (P + Q - 2)`. The floor of the root is at most one part of `P + Q - 2`, the length of the last vector.
    pub fn bound(&self) -> f64 {
        let GimbalConfig { length, crank, rod, angle_width, limit, .. } = self.config;
        let (least, most) = self.config.reach();
        let (least, most) = (f64::from(least), f64::from(most));
        let lsb = libm::scalbn(1.0, 1 - angle_width.cast_signed());
        let lean = libm::cos(PI * f64::from(limit) * lsb);
        let [of_across, of_least, of_most] =
            [least * lean, least, most].map(|radius| self.config.cordic().bound(radius));
        let first = of_across.radius.max(of_most.radius);
        let pitch = PI * of_least.angle + libm::asin((first / least).min(1.0));
        let roll = PI * of_across.angle;

        let (crank, rod) = (f64::from(crank), f64::from(rod));
        let shortest = libm::scalbn(4.0 * crank * (rod - crank), -self.drop.cast_signed()) - 2.0;
        let turned = PI * self.config.cordic().bound(shortest - 1.0).angle.max(lsb);
        let crank = crank * (1.0 + crank / rod) * (2.0 / shortest + libm::asin(1.0 / shortest) + turned);
        let radial = first + of_least.radius.max(of_most.radius) + crank;
        let radius = most + radial;
        length.lsb() * libm::hypot(radial, libm::hypot(radius * pitch, radius * roll))
    }

    /// Returns an angle within the limits, and whether it was beyond them.
    #[inline]
    fn limited<W: Word>(&self, angle: W) -> (W, W::Bit) {
        let limit = i128::from(self.config.limit);
        let limited = angle.limit(-limit, limit);
        (limited, !limited.equals(angle))
    }

    /// Returns `P`, `Q` and the radius that the crank reaches, and whether this is another one.
    #[inline]
    fn legs<W: Word>(&self, radius: W) -> ([W; 3], W::Bit) {
        let GimbalConfig { length, crank, rod, offset, .. } = self.config;
        let (least, most, offset) = (W::int((rod - crank).into()), W::int((rod + crank).into()), W::int(offset.into()));
        let wanted = radius - offset;
        let reach = wanted.limit((rod - crank).into(), (rod + crank).into()).cut("reach", length.width());
        let is_beyond = !reach.equals(wanted);
        let wide = 2 * length.width() + 2;
        let folded = ((most - reach) * (reach + least)).cut("folding", wide).shr(self.drop);
        let stretched = ((reach - least) * (reach + most)).cut("stretching", wide).shr(self.drop);
        let side = Format::unsigned(length.width());
        ([folded.wrap(side), stretched.wrap(side), reach + offset], is_beyond)
    }

    /// Returns the radicand of `P` and `Q`.
    #[inline]
    fn radicand<W: Word>(&self, folded: W, stretched: W) -> W {
        let width = self.config.length.width();
        (folded * stretched).cut("quarter", 2 * width + 2).shl(2).wrap(Format::unsigned(2 * width))
    }

    /// Returns the crank's angle, which rounding may have taken beyond either end of its half turn.
    #[inline]
    fn within_half_turn<W: Word>(&self, angle: W) -> W {
        let top = self.config.angle_width - 1;
        let full = W::int((1 << top) - 1);
        let beyond = || [W::select(angle.bit(top - 1), W::int(0), full)];
        let [angle] = W::branch(angle.bit(top), beyond, || [angle]);
        angle
    }

    /// Returns the joints for a position.
    pub fn joints(&self, [x, y, z]: [i64; 3]) -> Joints<i64> {
        let word = |machine: Machine<i64>| machine.narrowed().word;
        let (across, angle) = self.cordic.measure(y, -x);
        let (roll, rolls_beyond) = self.limited(Machine::of(angle));
        let (far, angle) = self.cordic.measure(across, z);
        let (pitch, pitches_beyond) = self.limited(Machine::of(angle));
        let ([folded, stretched, radius], is_far) = self.legs(Machine::of(far));
        let root = SquareRoot::root(word(self.radicand(folded, stretched))).word;
        let (_, angle) = self.cordic.measure(word(stretched - folded), root);
        let crank = word(self.within_half_turn(Machine::of(angle)));
        let out_of_reach = i64::from(rolls_beyond | pitches_beyond | is_far);
        Joints { pitch: word(pitch), roll: word(roll), crank, radius: word(radius), out_of_reach }
    }

    #[inline]
    fn started(&self, input: &In<i64>) -> Option<Joints<i64>> {
        (input.start != 0).then(|| self.joints([input.x, input.y, input.z]))
    }

    #[inline]
    fn shown(&self) -> Out<i64> {
        let Joints { pitch, roll, crank, radius, out_of_reach } = self.computation.result();
        let (busy, ready) = (self.computation.busy().into(), self.computation.ready().into());
        Out { pitch, roll, crank, radius, out_of_reach, busy, ready }
    }
}

/// Returns the registers of a CORDIC or a root with a `busy`, their last but one, of any word: no other depends on it.
fn with_busy<W: Word>(registers: &[W]) -> Vec<W> {
    let (ready, others) = registers.split_last().expect("registers");
    [others, &[W::int(0), *ready]].concat()
}

/// Returns the same without it.
fn without_busy<W: Word>(registers: &[W]) -> Vec<W> {
    let (others, last) = registers.split_at(registers.len() - 2);
    [others, &last[1..]].concat()
}

/// The registers are those of the VHDL, including those of its CORDIC and its root.
impl Step for GimbalInverse {
    fn registers(&self) -> Vec<Register> {
        let (length, angle) = (self.config.length, self.cordic.config().angle());
        let width = length.width();
        let mut all = vec![
            Register::new("pass", Format::unsigned(3)),
            Register::new("turn", Format::BIT),
            Register::new("extract", Format::BIT),
            Register::new("height", length),
            Register::new("vector_x", Format::signed(width + 1)),
            Register::new("vector_y", Format::signed(width + 1)),
            Register::new("side", angle),
            Register::new("rise", angle),
            Register::new("far", Format::unsigned(width + 1)),
            Register::new("shown", length),
            Register::new("is_out", Format::BIT),
            Register::new("folded", Format::unsigned(width)),
            Register::new("stretched", Format::unsigned(width)),
            Register::new("radicand", Format::unsigned(2 * width)),
            Register::new("pitch", angle),
            Register::new("roll", angle),
            Register::new("crank", angle),
            Register::new("radius", length),
            Register::new("out_of_reach", Format::BIT),
            Register::new("busy", Format::BIT),
            Register::new("ready", Format::BIT),
        ];
        debug_assert_eq!(all.len(), OWN);
        let rotation = Register::inside("rotation", &self.cordic);
        let root = Register::inside("root_of_product", &self.root);
        // The VHDL leaves both open, so that they are no registers of the hardware.
        all.extend(rotation.chain(root).filter(|register| register.name != "busy"));
        all
    }

    fn step<W: Word>(&self, registers: &[W], input: In<W>) -> (Vec<W>, Out<W>) {
        let (own, inner) = registers.split_at(OWN);
        let [pass, turn, extract, height, vector_x, vector_y, side, rise, far, ref rest @ ..] = *own else {
            unreachable!("registers")
        };
        let [shown, is_out, folded, stretched, radicand, pitch, roll, crank, radius, out_of_reach, busy, ready] = *rest
        else {
            unreachable!("registers")
        };
        let (zero, one) = (W::int(0), W::int(1));
        let (rotating, rooting) = inner.split_at(Step::registers(&self.cordic).len() - 1);
        let vector = cordic::In { start: turn, x: vector_x, y: vector_y };
        let (rotating, measured) = self.cordic.step(&with_busy(rotating), vector);
        let (rooting, extracted) = self.root.step(&with_busy(rooting), square_root::In { start: extract, x: radicand });

        let is_measured = measured.ready.is_set() & !turn.is_set();
        let is_extracted = extracted.ready.is_set() & !extract.is_set();
        let at = |number: i128| pass.equals(W::int(number));
        let wide = Format::signed(self.config.length.width() + 1);
        let (limited, is_beyond) = self.limited(measured.angle);
        let starts = || {
            [one, one, zero, input.z, input.y, -input.x, side, rise, far, shown, is_out, folded, stretched, radicand]
        };
        let rolled = || {
            let across = measured.radius.wrap(wide);
            let is_out = W::of_bit(is_beyond);
            [W::int(2), one, zero, height, across, height, limited, rise, far, shown, is_out]
        };
        let pitched = || {
            let (far, is_out) = (measured.radius, W::of_bit(is_beyond | is_out.is_set()));
            [W::int(3), zero, zero, height, vector_x, vector_y, side, limited, far, shown, is_out]
        };
        let rooted = || [W::int(6), one, zero, height, vector_x, extracted.root, side, rise, far, shown, is_out];
        let folds = || {
            let ([folded, stretched, shown], is_far) = self.legs(far);
            let is_out = W::of_bit(is_far | is_out.is_set());
            let kept = [height, vector_x, vector_y, side, rise, far];
            let [height, x, y, side, rise, far] = kept;
            [W::int(4), zero, zero, height, x, y, side, rise, far, shown, is_out, folded, stretched, radicand]
        };
        let multiplies = || {
            let (x, radicand) = (stretched - folded, self.radicand(folded, stretched));
            [W::int(5), zero, one, height, x, vector_y, side, rise, far, shown, is_out, folded, stretched, radicand]
        };
        let waits = || [pass, zero, zero, height, vector_x, vector_y, side, rise, far, shown, is_out];
        let ends = || [zero, zero, zero, height, vector_x, vector_y, side, rise, far, shown, is_out];
        let measures = || {
            W::branch(at(1) & is_measured, rolled, || {
                W::branch(at(2) & is_measured, pitched, || {
                    W::branch(at(5) & is_extracted, rooted, || W::branch(at(6) & is_measured, ends, waits))
                })
            })
        };
        let others = || {
            let [pass, turn, extract, height, x, y, side, rise, far, shown, is_out] = measures();
            [pass, turn, extract, height, x, y, side, rise, far, shown, is_out, folded, stretched, radicand]
        };
        let runs = || W::branch(at(3), folds, || W::branch(at(4), multiplies, others));
        let next = W::branch(input.start.is_set(), starts, runs);

        let loads = !input.start.is_set() & at(6) & is_measured;
        let loaded = || [rise, side, self.within_half_turn(measured.angle), shown, is_out, zero, one];
        let kept = || {
            let busy = W::select(input.start.is_set(), one, busy);
            [pitch, roll, crank, radius, out_of_reach, busy, zero]
        };
        let results = W::branch(loads, loaded, kept);
        let out = Out { pitch, roll, crank, radius, out_of_reach, busy, ready };
        ([&next[..], &results, &without_busy(&rotating), &without_busy(&rooting)].concat(), out)
    }

    fn lemmas(&self) -> Vec<Lemma<'_>> {
        let root = OWN + Step::registers(&self.cordic).len() - 1;
        let idles = move |one: &[hpu_signal::Term], other: &[hpu_signal::Term]| {
            let rests =
                |first: usize, last: usize| !one[first].is_set() | equal(&one[first..last], &other[first..last]);
            rests(OWN, root) & rests(root, one.len())
        };
        vec![loads_first(self, idles)]
    }
}

crate::base::listed::configured!(GimbalInverse: GimbalConfig, |config| {
    // The lengths and the angles: no counts.
    config.generics()[..9].to_vec()
});

impl Block for GimbalInverse {
    const NAME: &'static str = "gimbal_inverse";
    crate::base::block::computing!(NONE);
}

impl Listed for GimbalInverse {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        Ok(vec![("narrow", Self::new(GimbalConfig::narrow())?), ("short", Self::new(GimbalConfig::short())?)])
    }
}

crate::circuit::part::registers!(GimbalInverse);
