//! A discrete spring that takes exactly the energy it is given, its force scaled for the user.
//!
//! - **Equation**: the spring's energy is `H = K x^2 / 2`; a motion `d` of the device is one of `alpha d` of the
//!   spring, at the force `K x` held meanwhile: `x' = sqrt(x^2 + 2 x alpha d)` takes just `K x alpha d`, with
//!   `alpha = ALPHA / 2^8`. At capture n: `R = penetration^2` if the spring engages: `x = 0`, in contact, and without
//!   `REVIVE` not so at the last capture; else `R = max(0, x^2 + 2 x alpha d)`. `x' = floor(sqrt(R))` to EXTENSION_FRAC
//!   bits, `torque = min(floor(stiffness * x' * scale), 2^TORQUE_WIDTH - 1)`.
//! - **Ports**: those of every law; `scale` is the force shown for one of the spring; `damping` and `delta` are
//!   ignored. `memory` (0,WIDTH,EXTENSION_FRAC): the extension `x`.
//! - **Latency**: `ROOT_WIDTH/2 + 2` edges from a capture to torque and memory,
//!   `ROOT_WIDTH = 2 (WIDTH + EXTENSION_FRAC) + 2`.
//! - **Edge**: a sample edge (countdown 0, then `max(period,1) - 1`) captures; the next starts the root;
//!   `ROOT_WIDTH/2 + 2` edges after the capture torque and memory are loaded. Sample edges up to and including that one
//!   are passed over: `d` then spans several samples.
//! - **Reset**: all 0, idle; the first edge samples.
//! - **Overflow**: radicand, extension and torque saturate. A radicand below 0, for motion back that takes more than
//!   the spring had, counts as one.
//! - **VHDL twin**: `hdl/passive_spring.vhd`, around a `square_root`.
//! - **Source**: Secchi, Stramigioli and Fantuzzi, passive sample and hold with power scaling; their energy leap.
//! - **Known failures**: the floors only take energy out, but the two clamps at 0 do not conserve it: a radicand below
//!   0 gives the user more than was stored, and engaging inside the wall (`REVIVE`) stores what nobody has given. The
//!   rest position drifts, as `x` is not the penetration. The motion while the root is computed was done on the torque
//!   before.
//! - **Differs from the hardware**: the products take one edge, so no limit on the clock. The emulator computes the
//!   root at the sample edge and shows it LATENCY edges later: the ports are exact at every edge, the registers of the
//!   root are not modelled.

use hpu_signal::{Format, Int, Machine, Narrowed, Narrowing, Overflow, Reach, Rounding, Signal, Word};

use crate::base::config::{NATURAL, within};
use crate::base::law::ZERO;
use crate::base::listed::Listed;
use crate::base::sequence::{Sequence, captures, loads_before_it_reads};
use crate::methods::method_variants::{InLoops, bare, distinct, shaped, short};
use crate::{
    Block, ConfigError, Generic, Law, LawIn, LawOut, LawWidths, Lemma, MethodLoop, Register, SquareRoot, Step,
    arithmetic::square_root,
};

crate::base::listed::configuration! {
    /// The widths and options of a passive spring.
    pub struct SpringConfig {
        /// The widths that every law has.
        widths: LawWidths = LawWidths::default(), [];
        /// Fraction bits of the extension.
        extension_frac: u32 = 8, ["EXTENSION_FRAC"];
        /// Motion of the spring per motion of the device, with 8 fraction bits.
        alpha: u32 = 256, ["ALPHA"];
        /// Whether a spring that has lost its whole extension inside the wall engages again.
        revive: bool = true, ["REVIVE"];
    }
}

impl SpringConfig {
    /// Returns the width of the radicand.
    pub const fn root_width(self) -> u32 {
        2 * (self.widths.width + self.extension_frac) + 2
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PassiveSpring {
    config: SpringConfig,
    motion: Format,
    radicand: Narrowing,
    extension: Narrowing,
    torque: Narrowing,
    root: SquareRoot,
    fits_64: bool,
    sequence: Sequence<Registers<Narrowed>>,
}

hpu_signal::ports! {
    /// The registers from which a capture begins, and those after it.
    pub struct Registers { position, contact, torque, extension }
}

const RESET: Registers<Narrowed> = Registers { position: ZERO, contact: ZERO, torque: ZERO, extension: ZERO };

impl PassiveSpring {
    /// Returns a spring with these widths and options.
    ///
    /// # Errors
    ///
    /// Returns an error unless the widths pass [`LawWidths::check`], the extension has 8 fraction bits or more and at
    /// most 30 bits, and alpha is a VHDL `natural`.
    pub fn new(config: SpringConfig) -> Result<Self, ConfigError> {
        let SpringConfig { widths, extension_frac, alpha, .. } = config;
        widths.check(Self::NAME)?;
        within(Self::NAME, "EXTENSION_FRAC", extension_frac, 8..=28)?;
        within(Self::NAME, "WIDTH + EXTENSION_FRAC", widths.width + extension_frac, 10..=30)?;
        within(Self::NAME, "ALPHA", alpha, 0..=NATURAL)?;
        let root_width = config.root_width();
        let frac = extension_frac.cast_signed();
        let clamp =
            |from_frac, to| Narrowing { from_frac, to, rounding: Rounding::Truncate, overflow: Overflow::Saturate };
        let square = Format::new(false, root_width.cast_signed() - 2 * frac, 2 * frac).expect("22 to 62 bits");
        let extension = Format::new(false, widths.width.cast_signed(), frac).expect("10 to 30 bits");
        let mut block = Self {
            config,
            motion: Format::signed(widths.width),
            radicand: clamp(2 * frac, square),
            extension: clamp(frac, extension),
            torque: clamp(widths.stiffness.frac() + frac + widths.scale.frac(), Format::unsigned(widths.torque_width)),
            root: SquareRoot::new(root_width)?,
            fits_64: false,
            // One edge starts the root, one computes the torque from it.
            sequence: Sequence::new(root_width / 2 + 2, RESET),
        };
        block.fits_64 = block.reaches_64();
        Ok(block)
    }

    /// Returns whether 64 bits suffice for everything that a capture computes.
    fn reaches_64(&self) -> bool {
        let (torque, extension) = (Reach::of(self.config.widths.torque()), Reach::of(self.extension.to));
        let position = Reach::of(Format::unsigned(self.config.widths.width));
        let last = Registers { position, contact: Reach::of(Format::BIT), torque, extension };
        let input = self.config.widths.inputs().map(|signal| Reach::of(signal.format));
        let root = Reach::of(Format::unsigned(self.config.root_width() / 2));
        let LawOut { torque, memory } = self.ended(&input, root);
        Reach::fit_64(&[self.begun(&last, &input), torque, memory])
    }

    /// Returns the radicand of a capture.
    #[inline]
    fn begun<W: Word>(&self, last: &Registers<W>, input: &LawIn<W>) -> W {
        let SpringConfig { widths, extension_frac, alpha, revive } = self.config;
        let (x, zero) = (last.extension, W::int(0));
        let (length, pace) = (self.extension.to.width() + 1, widths.width + 32);
        let touches = x.equals(zero) & input.contact.is_set();
        let engages = if revive { touches } else { touches & last.contact.equals(zero) };
        let anew = || {
            let depth = input.penetration.shl(extension_frac);
            [depth * depth]
        };
        let worked = || {
            let motion = (input.position - last.position).wrap(self.motion);
            let gained = x * (W::int(alpha.into()) * motion).cut("pace", pace);
            [(x * x).cut("area", 2 * length) + gained.cut("gained", length + pace).shl(extension_frac - 7)]
        };
        let [square] = W::branch(engages, anew, worked);
        square.narrow(&self.radicand)
    }

    /// Returns the torque and the extension after the root.
    #[inline]
    fn ended<W: Word>(&self, input: &LawIn<W>, root: W) -> LawOut<W> {
        let memory = root.narrow(&self.extension).cut("reached", self.extension.to.width() + 1);
        LawOut { torque: self.torque(input, memory), memory }
    }

    /// Computes the torque at an extension.
    #[inline]
    pub fn torque<W: Word>(&self, input: &LawIn<W>, extension: W) -> W {
        let LawWidths { stiffness, scale, .. } = self.config.widths;
        let pull = stiffness.width() + 2 + self.extension.to.width();
        let pulled = (input.stiffness * extension.shed()).cut("pull", pull);
        (pulled * input.scale).cut("push", pull + scale.width() + 1).narrow(&self.torque)
    }

    /// Returns the widths and constants.
    pub fn config(&self) -> &SpringConfig {
        &self.config
    }

    #[inline]
    fn shown(&self) -> LawOut<Narrowed> {
        let Registers { torque, extension: memory, .. } = *self.sequence.loaded();
        LawOut { torque, memory }
    }

    /// Returns the registers after a capture.
    #[inline]
    fn capture(&self, last: &Registers<Narrowed>, input: &LawIn<i64>) -> Registers<Narrowed> {
        if self.fits_64 { self.captured::<i64>(last, input) } else { self.captured::<i128>(last, input) }
    }

    #[inline]
    fn captured<T: Int>(&self, last: &Registers<Narrowed>, input: &LawIn<i64>) -> Registers<Narrowed> {
        let last = last.map(|register| Machine::<T>::of(register.word));
        let input = input.map(Machine::of);
        let radicand = self.begun(&last, &input).narrowed();
        let root = Narrowed { overflowed: radicand.overflowed, ..SquareRoot::root(radicand.word) };
        let LawOut { torque, memory } = self.ended(&input, Machine::of_narrowed(root));
        Registers { position: input.position, contact: input.contact, torque, extension: memory }.map(Machine::narrowed)
    }
}

/// The registers are those of the VHDL, including those of its root.
impl Step for PassiveSpring {
    fn registers(&self) -> Vec<Register> {
        let LawWidths { width, period_width, stiffness, scale, .. } = self.config.widths;
        // These words are signed in the VHDL; their signs need not be known.
        let signed = |format: Format| Format::signed(format.width() + 1);
        let mut all = vec![
            Register::new("countdown", Format::unsigned(period_width)),
            Register::new("previous", Format::unsigned(width)),
            Register::new("touched", Format::BIT),
            Register::new("x", signed(self.extension.to)),
            Register::kept("k", signed(stiffness)),
            Register::kept("beta", signed(scale)),
            Register::new("start", Format::BIT),
            Register::new("square", self.radicand.to),
            Register::new("torque", self.config.widths.torque()),
            Register::new("memory", self.extension.to),
        ];
        all.extend(Register::inside("root_of_square", &self.root));
        all
    }

    fn step<W: Word>(&self, registers: &[W], input: LawIn<W>) -> (Vec<W>, LawOut<W>) {
        let [left, position, contact, extension, stiffness, scale, start, square, torque, memory, ref root @ ..] =
            *registers
        else {
            unreachable!("registers")
        };
        let (rooting, made) = self.root.step(root, square_root::In { start, x: square });
        let (left, captures) = captures(left, input.period, [start, made.busy, made.ready]);
        let captured = || {
            let square = self.begun(&Registers { position, contact, torque, extension }, &input);
            [input.position, input.contact, input.stiffness, input.scale, square]
        };
        let kept = || [position, contact, stiffness, scale, square];
        let [position, contact, k, beta, square] = W::branch(captures, captured, kept);
        let loaded = || {
            let LawOut { torque, memory } = self.ended(&LawIn { stiffness, scale, ..input }, made.root);
            [memory, torque, memory]
        };
        let shown = LawOut { torque, memory };
        let [extension, torque, memory] = W::branch(made.ready.is_set(), loaded, || [extension, torque, memory]);
        let own = [left, position, contact, extension, k, beta, W::of_bit(captures), square, torque, memory];
        ([&own[..], &rooting].concat(), shown)
    }

    fn lemmas(&self) -> Vec<Lemma<'_>> {
        vec![loads_before_it_reads(self, 10, 6)]
    }
}

crate::base::listed::configured!(PassiveSpring: SpringConfig);

impl Law for PassiveSpring {
    const LOOP: &'static str = "passive_spring_loop";

    crate::base::law::law_config!();

    fn latency(&self) -> u32 {
        self.sequence.latency()
    }

    fn lost(&self) -> [(bool, bool); 2] {
        self.shown().lost()
    }
}

impl Block for PassiveSpring {
    const NAME: &'static str = "passive_spring";
    crate::base::law::law_ports!(self => self.extension.to, "count", "Extension of the spring");

    crate::base::law::law_in_sequence!();
}

impl Listed for PassiveSpring {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let narrow = SpringConfig { widths: short(), ..SpringConfig::default() };
        let all = [
            ("8_bit", narrow),
            ("no_revival", SpringConfig { revive: false, ..narrow }),
            ("one_and_a_half", SpringConfig { alpha: 384, ..narrow }),
            ("fine", SpringConfig { extension_frac: 10, ..narrow }),
        ];
        all.into_iter().map(|(label, config)| Ok((label, Self::new(config)?))).collect()
    }
}

impl InLoops for PassiveSpring {
    fn loops() -> Result<Vec<(&'static str, MethodLoop<Self>)>, ConfigError> {
        let narrow = Self::new(SpringConfig { widths: short(), ..SpringConfig::default() })?;
        let phase = narrow.latency() + 1;
        let others = SpringConfig { widths: distinct(), extension_frac: 14, alpha: 300, revive: true };
        Ok(vec![("8_bit", shaped(narrow, phase)?), ("distinct", bare(Self::new(others)?)?)])
    }
}
