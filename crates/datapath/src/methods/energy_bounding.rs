//! Energy bounding: limits the wall's torque to what the device's own damping can dissipate.
//!
//! - **Equation**: at capture n, `d` the motion since the last, `f = wanted` the torque of spring and drag, `F` the
//!   torque, `E` the energy stored, `c1 = C1 / 2^BOUND_FRAC`, `c2` likewise, `floor` and `ceil` to whole PWM counts,
//!   `top = 2^TORQUE_WIDTH - 1`. The c1/c2 form: with `S = sqrt((c2 d)^2 + 2 c2 E)`, rounded down to BOUND_FRAC bits,
//!   `hi = floor(c2 d + S)`, `lo = ceil(c2 d - S)`, and `F' = max(min(f, F + floor(c1 d), hi), lo)` for `d > 0`,
//!   `min(max(f, F + ceil(c1 d), lo), hi)` for `d < 0`, `F` for `d = 0`, all clamped to `-top .. top`;
//!   `E' = min(E + F' d, max)`. This is `F' = F + beta d` with the published bounds of `beta` multiplied by `d`, so
//!   that nothing is divided; `F'^2 <= 2 c2 E'` holds exactly.
//!   `LEAST_CONSERVATIVE`: `E' = clamp((0 if F = 0, else E) + c1 d^2 + F d, 0, max)`, `F' = clamp(f, -b, b)` with
//!   `b = min(floor(2 sqrt(c1 E')), top)`.
//!   `wanted = clamp(spring + drag)` as every law has it: `spring = min(floor(penetration * stiffness), top)` and
//!   `drag = floor(damping * d)`, within `-top - 1 .. top`, inside the wall, 0 outside.
//! - **Ports**: those of every law; `scale` and `delta` are ignored. `memory`: `E`, (0,ENERGY_WIDTH,0), or
//!   (0,ENERGY_WIDTH-BOUND_FRAC,BOUND_FRAC) when `LEAST_CONSERVATIVE`.
//! - **Latency**: `ROOT_WIDTH/2 + 2` edges from a capture to torque and memory.
//! - **Edge**: a sample edge (countdown 0, then `max(period,1) - 1`) captures; the next starts the root;
//!   `ROOT_WIDTH/2 + 2` edges after the capture torque and memory are loaded. Sample edges up to and including that one
//!   are passed over: `d` then spans several samples.
//! - **Reset**: all 0, idle; the first edge samples.
//! - **Overflow**: energy and torque saturate, both to the safe side as long as `top^2 <= 2 c2 (2^ENERGY_WIDTH - 1)`.
//! - **VHDL twin**: `hdl/energy_bounding.vhd`, around a `square_root`.
//! - **Source**: Kim and Ryu 2004 and 2010 (c1/c2 form); Kim et al. (least conservative force bound).
//! - **Known failures**: the c1/c2 form shows no more than c1, and keeps a torque just outside the wall. It generates
//!   nothing when a whole number lies between c2 and c1, `c2 <= c1`; where none does, `lo` and `hi`, rounded to whole
//!   PWM counts, may lead one PWM count beyond the step that c1 allows, and such steps can add up. The motion while the
//!   root is computed was done on the torque before.
//! - **Differs from the hardware**: the products take one edge, so no limit on the clock. The emulator computes the
//!   root at the sample edge and shows it LATENCY edges later: the ports are exact at every edge, the registers of the
//!   root are not modelled.

use hpu_signal::{Format, Int, Machine, Narrowed, Narrowing, Overflow, Reach, Rounding, Signal, Word};

use crate::base::config::within;
use crate::base::law::{Wanted, ZERO, shown};
use crate::base::listed::Listed;
use crate::base::sequence::{Sequence, captures, loads_before_it_reads};
use crate::methods::method_variants::{InLoops, bare, distinct, shaped, short};
use crate::{
    Block, ConfigError, Generic, Law, LawIn, LawOut, LawWidths, Lemma, MethodLoop, Register, SquareRoot, Step,
    arithmetic::square_root,
};

crate::base::listed::configuration! {
    /// The widths and bounds of an energy-bounding law.
    pub struct BoundingConfig {
        /// The widths that every law has.
        widths: LawWidths = LawWidths::default(), [];
        /// Whether the force bound is used instead of c1 and c2.
        least_conservative: bool = false, ["LEAST_CONSERVATIVE"];
        /// Damping of the device over the sample period, in PWM counts per count.
        c1: u32 = 320, ["C1"];
        /// Stiffness that the stored energy must be able to pay for, in PWM counts per count.
        c2: u32 = 320, ["C2"];
        /// Fraction bits of both.
        bound_frac: u32 = 4, ["BOUND_FRAC"];
        /// Width of both.
        bound_width: u32 = 14, ["BOUND_WIDTH"];
        /// Width of the energy.
        energy_width: u32 = 32, ["ENERGY_WIDTH"];
        /// Width of the radicand.
        root_width: u32 = 54, ["ROOT_WIDTH"];
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct EnergyBounding {
    config: BoundingConfig,
    motion: Format,
    /// Rounds from the fraction of the bounds to whole PWM counts.
    whole: Narrowing,
    energy: Narrowing,
    wanted: Wanted,
    root: SquareRoot,
    fits_64: bool,
    sequence: Sequence<Registers<Narrowed>>,
}

hpu_signal::ports! {
    /// The registers from which a capture begins, and those after it.
    pub struct Registers { position, torque, energy }
}

const RESET: Registers<Narrowed> = Registers { position: ZERO, torque: ZERO, energy: ZERO };

/// The known values of a capture before the root; the next energy is known only with the force bound.
#[derive(Clone, Copy)]
struct Begun<W> {
    motion: W,
    wanted: W,
    energy: W,
    radicand: W,
}

impl EnergyBounding {
    /// Returns a law with these widths and bounds.
    ///
    /// # Errors
    ///
    /// Returns an error unless the widths pass [`LawWidths::check`], c1 and c2 fit their 2 to 30 bits, and the radicand
    /// is even, at most 62 bits, and holds its terms: `2 (BOUND_WIDTH + WIDTH)` and `BOUND_WIDTH + ENERGY_WIDTH +
    /// BOUND_FRAC + 2` bits.
    pub fn new(config: BoundingConfig) -> Result<Self, ConfigError> {
        let BoundingConfig { widths, c1, c2, bound_frac, bound_width, energy_width, root_width, .. } = config;
        widths.check(Self::NAME)?;
        within(Self::NAME, "BOUND_WIDTH", bound_width, 2..=30)?;
        within(Self::NAME, "C1", c1, 0..=(1 << bound_width) - 1)?;
        within(Self::NAME, "C2", c2, 0..=(1 << bound_width) - 1)?;
        within(Self::NAME, "ENERGY_WIDTH", energy_width, 2..=60)?;
        within(Self::NAME, "BOUND_FRAC", bound_frac, 0..=30)?;
        let least = (2 * (bound_width + widths.width)).max(bound_width + energy_width + bound_frac + 2);
        within(Self::NAME, "ROOT_WIDTH", root_width, least..=62)?;
        let frac = bound_frac.cast_signed();
        let energy_frac = if config.least_conservative { frac } else { 0 };
        let energy = Format::new(false, energy_width.cast_signed() - energy_frac, energy_frac).expect("2 to 60 bits");
        let floor =
            |from_frac, to| Narrowing { from_frac, to, rounding: Rounding::Truncate, overflow: Overflow::Saturate };
        let mut block = Self {
            config,
            motion: Format::signed(widths.width),
            whole: floor(frac, Format::signed(62)),
            energy: floor(energy_frac, energy),
            wanted: Wanted::new(&widths),
            root: SquareRoot::new(root_width)?,
            fits_64: false,
            // One edge starts the root, one bounds the torque by it.
            sequence: Sequence::new(root_width / 2 + 2, RESET),
        };
        block.fits_64 = block.reaches_64();
        Ok(block)
    }

    /// Returns the widths and constants.
    pub fn config(&self) -> &BoundingConfig {
        &self.config
    }

    /// Returns whether 64 bits suffice for everything that a capture computes.
    fn reaches_64(&self) -> bool {
        let (torque, energy) = (Reach::of(self.config.widths.torque()), Reach::of(self.energy.to));
        let last = Registers { position: Reach::of(Format::unsigned(self.config.widths.width)), torque, energy };
        let input = self.config.widths.inputs().map(|signal| Reach::of(signal.format));
        let begun = self.begun(&last, &input);
        let LawOut { torque, memory } =
            self.ended(&last, begun, Reach::of(Format::unsigned(self.config.root_width / 2)));
        Reach::fit_64(&[begun.radicand, torque, memory])
    }

    /// Returns the known values of a capture before the root.
    #[inline]
    fn begun<W: Word>(&self, last: &Registers<W>, input: &LawIn<W>) -> Begun<W> {
        let BoundingConfig { widths, c1, c2, bound_frac, bound_width, .. } = self.config;
        let motion = (input.position - last.position).wrap(self.motion);
        let wanted = self.wanted.torque(input, motion);
        let (torque, stored) = (last.torque.shed(), last.energy.shed());
        if self.config.least_conservative {
            let c1 = W::int(c1.into());
            let stored = W::select(torque.is_set(), stored, W::int(0));
            let worked = (torque * motion).cut("worked", widths.torque_width + 2 + widths.width);
            let damped = c1 * (motion * motion).cut("moved2", 2 * widths.width);
            let energy = (stored + damped + worked.shl(bound_frac)).narrow(&self.energy);
            Begun { motion, wanted, energy, radicand: (c1 * energy.shed()).shl(2) }
        } else {
            let c2 = W::int(c2.into());
            let room = bound_width + widths.width;
            let middle = (c2 * motion).cut("pull", room);
            let pulled = (middle * middle).cut("pulled", 2 * room);
            Begun { motion, wanted, energy: stored, radicand: pulled + (c2 * stored).shl(bound_frac + 1) }
        }
    }

    /// Returns the torque and the energy after the root.
    #[inline]
    fn ended<W: Word>(&self, last: &Registers<W>, begun: Begun<W>, root: W) -> LawOut<W> {
        let Begun { motion, wanted, energy, .. } = begun;
        if self.config.least_conservative {
            let bound = self.floor(root).lesser(W::int(self.config.widths.top().into()));
            return LawOut { torque: wanted.lesser(bound).greater(-bound), memory: energy };
        }
        let [c1, c2] = [self.config.c1, self.config.c2].map(|bound| W::int(bound.into()));
        let middle = c2 * motion;
        let (high, low) = (self.floor(middle + root), -self.floor(root - middle));
        let step = last.torque.shed();
        let forth = || [wanted.lesser(step + self.floor(c1 * motion)).lesser(high).greater(low)];
        let back = || [wanted.greater(step - self.floor(-(c1 * motion))).greater(low).lesser(high)];
        let moves = || W::branch(motion.above(W::int(0)), forth, back);
        let [chosen] = W::branch(motion.is_set(), moves, || [last.torque]);
        let LawWidths { width, torque_width, .. } = self.config.widths;
        let torque = shown(chosen, self.config.widths.top()).cut("bounded", torque_width + 1);
        let used = (torque.shed() * motion).cut("used", torque_width + 1 + width);
        LawOut { torque, memory: (energy + used).narrow(&self.energy) }
    }

    /// Returns whole PWM counts, rounded down.
    #[inline]
    fn floor<W: Word>(&self, value: W) -> W {
        value.narrow(&self.whole)
    }

    #[inline]
    fn shown(&self) -> LawOut<Narrowed> {
        let Registers { torque, energy: memory, .. } = *self.sequence.loaded();
        LawOut { torque, memory }
    }

    /// Returns the registers after a capture.
    #[inline]
    fn capture(&self, last: &Registers<Narrowed>, input: &LawIn<i64>) -> Registers<Narrowed> {
        if self.fits_64 { self.captured::<i64>(last, input) } else { self.captured::<i128>(last, input) }
    }

    #[inline]
    fn captured<T: Int>(&self, last: &Registers<Narrowed>, input: &LawIn<i64>) -> Registers<Narrowed> {
        let last = last.map(Machine::<T>::of_narrowed);
        let input = input.map(Machine::of);
        let begun = self.begun(&last, &input);
        let root = SquareRoot::root(begun.radicand.narrowed().word);
        let LawOut { torque, memory } = self.ended(&last, begun, Machine::of_narrowed(root));
        Registers { position: input.position, torque, energy: memory }.map(Machine::narrowed)
    }
}

/// The registers are those of the VHDL, including those of its root.
impl Step for EnergyBounding {
    fn registers(&self) -> Vec<Register> {
        let LawWidths { width, period_width, torque_width, .. } = self.config.widths;
        let torque = self.config.widths.torque();
        let mut all = vec![
            Register::new("countdown", Format::unsigned(period_width)),
            Register::new("previous", Format::unsigned(width)),
            Register::new("moved", self.motion),
            Register::new("demand", Format::signed(torque_width + 1)),
            Register::new("energy", self.energy.to),
            Register::new("shown", torque),
            Register::new("start", Format::BIT),
            Register::new("radicand", Format::unsigned(self.config.root_width)),
            Register::new("torque", torque),
            Register::new("memory", self.energy.to),
        ];
        // In the other form, the VHDL does not keep `filled`.
        all.extend(self.config.least_conservative.then(|| Register::new("filled", self.energy.to)));
        all.extend(Register::inside("root_of_energy", &self.root));
        all
    }

    fn step<W: Word>(&self, registers: &[W], input: LawIn<W>) -> (Vec<W>, LawOut<W>) {
        let [left, position, motion, wanted, energy, pushed, start, x, torque, memory, ref rest @ ..] = *registers
        else {
            unreachable!("registers")
        };
        let (filled, root) = rest.split_at(usize::from(self.config.least_conservative));
        let stored = filled.first().copied().unwrap_or(energy);
        let (rooting, made) = self.root.step(root, square_root::In { start, x });
        let (left, captures) = captures(left, input.period, [start, made.busy, made.ready]);
        let last = Registers { position, torque: pushed, energy };
        let captured = || {
            let begun = self.begun(&last, &input);
            [input.position, begun.motion, begun.wanted, begun.radicand, begun.energy]
        };
        let kept = || [position, motion, wanted, x, stored];
        let [position, moved, demand, radicand, to_come] = W::branch(captures, captured, kept);
        let loaded = || {
            let begun = Begun { motion, wanted, energy: stored, radicand: x };
            let LawOut { torque, memory } = self.ended(&last, begun, made.root);
            [memory, torque, torque, memory]
        };
        let shown = LawOut { torque, memory };
        let kept = || [energy, pushed, torque, memory];
        let [energy, pushed, torque, memory] = W::branch(made.ready.is_set(), loaded, kept);
        let starts = W::of_bit(captures);
        let own = [left, position, moved, demand, energy, pushed, starts, radicand, torque, memory];
        ([&own[..], &[to_come][..filled.len()], &rooting].concat(), shown)
    }

    fn lemmas(&self) -> Vec<Lemma<'_>> {
        vec![loads_before_it_reads(self, 10 + usize::from(self.config.least_conservative), 6)]
    }
}

crate::base::listed::configured!(EnergyBounding: BoundingConfig);

impl Law for EnergyBounding {
    const LOOP: &'static str = "energy_bounding_loop";

    crate::base::law::law_config!();

    fn latency(&self) -> u32 {
        self.sequence.latency()
    }

    fn lost(&self) -> [(bool, bool); 2] {
        self.shown().lost()
    }
}

impl Block for EnergyBounding {
    const NAME: &'static str = "energy_bounding";
    crate::base::law::law_ports!(self => self.energy.to, "PWM count*count", "Energy stored");

    crate::base::law::law_in_sequence!();
}

impl Listed for EnergyBounding {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let least = |config| Self::new(BoundingConfig { least_conservative: true, ..config });
        Ok(vec![
            ("8_bit", Self::new(narrow())?),
            ("least_conservative", least(BoundingConfig::default())?),
            ("least_conservative_8_bit", least(narrow())?),
        ])
    }
}

impl InLoops for EnergyBounding {
    fn loops() -> Result<Vec<(&'static str, MethodLoop<Self>)>, ConfigError> {
        let bounded = Self::new(narrow())?;
        let phase = bounded.latency() + 1;
        let least = Self::new(BoundingConfig { least_conservative: true, ..narrow() })?;
        let others = BoundingConfig {
            widths: distinct(),
            c1: 91,
            c2: 80,
            bound_frac: 2,
            bound_width: 7,
            energy_width: 22,
            root_width: 40,
            ..BoundingConfig::default()
        };
        Ok(vec![
            ("8_bit", shaped(bounded, phase)?),
            ("least_conservative_8_bit", shaped(least, 0)?),
            ("distinct", bare(Self::new(others)?)?),
        ])
    }
}

fn narrow() -> BoundingConfig {
    BoundingConfig {
        widths: short(),
        c1: 23,
        c2: 20,
        bound_frac: 2,
        bound_width: 6,
        energy_width: 16,
        root_width: 28,
        ..BoundingConfig::default()
    }
}
