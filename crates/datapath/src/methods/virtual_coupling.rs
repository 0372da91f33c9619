//! Virtual coupling: a spring and a damper hold a massless tool, which stands between the device and the virtual wall,
//! to the device.
//!
//! - **Equation**: at sample n, `K_c e + (B_c/T) (e - e(n-1)) = K_e x_tool` with the tool at `x_tool = x - e` inside
//!   the wall, `= 0` outside; the torque is the left side. In words, with `e` the extension of the coupling:
//!   `free = floor(FREE * e / 2^GAIN_FRAC)`, the extension of a tool that nothing holds; if `delta > free`,
//!   `e' = sat(floor((SHARE * delta + HELD * e) / 2^GAIN_FRAC))` and `torque' = clamp(floor(stiffness * e') +
//!   floor(damping * (e' - e)), 0, 2^TORQUE_WIDTH - 1)`; else `e' = free` and `torque' =
//!   0`. The gains, times `2^GAIN_FRAC`: `SHARE = K_e / (K_e + K_c + B_c/T)`, `HELD = (B_c/T) / (K_e + K_c +
//!   B_c/T)`, `FREE = (B_c/T) / (K_c + B_c/T)`; a rigid wall has `SHARE = 1`, `HELD = 0`.
//! - **Ports**: those of every law; `stiffness` and `damping` are the coupling's `K_c` and `B_c/T`; `position`,
//!   `contact`, `penetration` and `scale` are ignored. `memory` (1,WIDTH-1,EXTENSION_FRAC): the extension `e`.
//! - **Latency**: 1 edge: the sample edge loads torque and memory.
//! - **Edge**: with the countdown at 0, torque and memory are loaded and the countdown restarts at `max(period,1) - 1`;
//!   else it counts down. A new period takes effect at the next sample edge.
//! - **Reset**: countdown, torque and memory 0; the first edge samples.
//! - **Overflow**: extension and torque saturate. The law makes the torque 0 instead of negative, which is no overflow.
//! - **VHDL twin**: `hdl/virtual_coupling.vhd`.
//! - **Source**: Colgate, Stanley and Brown 1995; Adams and Hannaford 1999.
//! - **Known failures**: shows no more than `K_e K_c / (K_e + K_c)`. The gains hold for one period and one coupling, so
//!   that `stiffness`, `damping` and `period` are to change together with them. A negative extension comes to rest 1
//!   LSB below 0.
//! - **Differs from the hardware**: all products take one edge, so no limit on the clock.

use hpu_signal::{Format, Machine, Narrowed, Narrowing, Overflow, Rounding, Signal, Word};

use crate::base::config::{WORD, within};
use crate::base::countdown::Countdown;
use crate::base::law::ZERO;
use crate::base::listed::Listed;
use crate::methods::method_variants::{InLoops, bare, distinct, shaped, short};
use crate::step::counted_down;
use crate::{Block, ClockEdge, ConfigError, Generic, Law, LawIn, LawOut, LawWidths, MethodLoop, Register, Step};

crate::base::listed::configuration! {
    /// The widths and gains of a virtual coupling.
    pub struct CouplingConfig {
        /// The widths and formats that every law has.
        widths: LawWidths = LawWidths::default(), [];
        /// Number of fraction bits of the extension.
        extension_frac: u32 = 8, ["EXTENSION_FRAC"];
        /// Number of fraction bits of the three gains.
        gain_frac: u32 = 16, ["GAIN_FRAC"];
        /// Gain `SHARE`: extension per unit of the device's depth inside the wall.
        share: u32 = 1 << 16, ["SHARE"];
        /// Gain `FREE`: share of its extension that a free tool keeps over a sample.
        free: u32 = 0, ["FREE"];
        /// Gain `HELD`: share of its extension that a tool inside the wall keeps over a sample.
        held: u32 = 0, ["HELD"];
    }
}

/// A virtual coupling; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct VirtualCoupling {
    config: CouplingConfig,
    extension: Narrowing,
    spring: Narrowing,
    drag: Narrowing,
    fits_64: bool,
    countdown: Countdown,
    latest: LawOut<Narrowed>,
}

impl VirtualCoupling {
    /// Returns a coupling with these widths and gains.
    ///
    /// # Errors
    ///
    /// Returns an error unless the widths pass [`LawWidths::check`], the extension has 2 to 62 bits, the gains have 0
    /// to 30 fraction bits, and no gain is above 1.
    pub fn new(config: CouplingConfig) -> Result<Self, ConfigError> {
        let CouplingConfig { widths, extension_frac, gain_frac, share, free, held } = config;
        widths.check(Self::NAME)?;
        within(Self::NAME, "EXTENSION_FRAC", extension_frac, 0..=30)?;
        within(Self::NAME, "WIDTH + EXTENSION_FRAC", widths.width + extension_frac, WORD)?;
        within(Self::NAME, "GAIN_FRAC", gain_frac, 0..=30)?;
        for (generic, gain) in [("SHARE", share), ("FREE", free), ("HELD", held)] {
            within(Self::NAME, generic, gain, 0..=1 << gain_frac)?;
        }
        let (frac, gain) = (extension_frac.cast_signed(), gain_frac.cast_signed());
        let extension = Format::new(true, widths.width.cast_signed() - 1, frac).expect("2 to 62 bits");
        let floor =
            |from_frac, to| Narrowing { from_frac, to, rounding: Rounding::Truncate, overflow: Overflow::Saturate };
        // Spring and drag are narrowed without loss of upper bits; only their sum is clamped.
        let whole = |gain: Format| {
            let (dropped, room) = (gain.frac() + frac, gain.width() + extension.width() + 1);
            floor(dropped, Format::signed(room.saturating_sub(dropped.cast_unsigned()).clamp(2, 64)))
        };
        let mut block = Self {
            config,
            extension: floor(frac + gain, extension),
            spring: whole(widths.stiffness),
            drag: whole(widths.damping),
            fits_64: false,
            countdown: Countdown::default(),
            latest: LawOut { torque: ZERO, memory: ZERO },
        };
        block.fits_64 = Step::fits_64(&block);
        Ok(block)
    }

    /// Returns the torque and the extension that a sample edge would load now.
    #[inline]
    fn sample(&self, input: &LawIn<i64>) -> LawOut<Narrowed> {
        let last = self.latest.memory.word;
        if self.fits_64 {
            self.made::<Machine<i64>>(input.map(Machine::of), Machine::of(last)).map(Machine::narrowed)
        } else {
            self.made::<Machine<i128>>(input.map(Machine::of), Machine::of(last)).map(Machine::narrowed)
        }
    }

    /// Returns the widths and gains.
    pub fn config(&self) -> &CouplingConfig {
        &self.config
    }

    /// Computes the torque and the extension of a sample from the extension before it.
    #[inline]
    pub fn made<W: Word>(&self, input: LawIn<W>, last: W) -> LawOut<W> {
        let [share, free, held] =
            [self.config.share, self.config.free, self.config.held].map(|gain| W::int(gain.into()));
        let (top, width) = (self.config.widths.top().into(), self.extension.to.width());
        let device = input.delta.shl(self.config.extension_frac);
        let loose = (free * last).narrow(&self.extension).cut("loose", width);
        let inside = || {
            let memory = (share * device + held * last).narrow(&self.extension).cut("reached", width);
            let extension = memory.shed();
            let spring = (input.stiffness * extension).narrow(&self.spring);
            let stretch = (extension - last).cut("stretch", width + 1);
            let drag = (input.damping * stretch).narrow(&self.drag);
            let sum = spring + drag;
            [sum.limit(0, top).overflowing(sum.above(W::int(top))), memory]
        };
        let [torque, memory] = W::branch(loose.at_least(device), || [W::int(0), loose], inside);
        LawOut { torque, memory }
    }
}

impl Step for VirtualCoupling {
    fn registers(&self) -> Vec<Register> {
        vec![
            Register::new("countdown", Format::unsigned(self.config.widths.period_width)),
            Register::new("extension", self.extension.to),
            Register::new("torque", self.config.widths.torque()),
        ]
    }

    fn step<W: Word>(&self, registers: &[W], input: LawIn<W>) -> (Vec<W>, LawOut<W>) {
        let [left, extension, torque] = *registers else { unreachable!("three registers") };
        let (left, samples) = counted_down(left, input.period);
        let sampled = || {
            let LawOut { torque, memory } = self.made(input, extension);
            [memory, torque]
        };
        let [memory, pushes] = W::branch(samples, sampled, || [extension, torque]);
        (vec![left, memory, pushes], LawOut { torque, memory: extension })
    }
}

crate::base::listed::configured!(VirtualCoupling: CouplingConfig);

impl Law for VirtualCoupling {
    const LOOP: &'static str = "virtual_coupling_loop";

    crate::base::law::law_config!();

    fn latency(&self) -> u32 {
        1
    }

    fn lost(&self) -> [(bool, bool); 2] {
        self.latest.lost()
    }
}

impl Block for VirtualCoupling {
    const NAME: &'static str = "virtual_coupling";
    crate::base::law::law_ports!(self => self.extension.to, "count", "Extension of the coupling");

    fn equations(&self) -> Option<ClockEdge<'_>> {
        Some(ClockEdge::of(self))
    }

    fn reset(&mut self) -> LawOut<i64> {
        self.countdown = Countdown::default();
        self.latest = LawOut { torque: ZERO, memory: ZERO };
        self.latest.words()
    }

    #[inline]
    fn tick(&mut self, input: LawIn<i64>) -> LawOut<i64> {
        if self.countdown.tick(input.period) {
            self.latest = self.sample(&input);
        }
        self.latest.words()
    }

    #[inline]
    fn quiet(&self, input: &LawIn<i64>) -> u64 {
        // A change of the lost bits counts as a change of the outputs.
        if self.sample(input) == self.latest { u64::MAX } else { self.countdown.left() }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &LawIn<i64>) {
        debug_assert!(edges <= self.quiet(input));
        self.countdown.skip(edges, input.period);
    }
}

impl Listed for VirtualCoupling {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let soft = CouplingConfig { share: 39322, free: 16384, held: 6554, ..CouplingConfig::default() };
        Ok(vec![("soft", Self::new(soft)?), ("8_bit", Self::new(tight())?)])
    }
}

impl InLoops for VirtualCoupling {
    fn loops() -> Result<Vec<(&'static str, MethodLoop<Self>)>, ConfigError> {
        let tight = Self::new(tight())?;
        let phase = tight.latency() + 1;
        let others =
            CouplingConfig { widths: distinct(), extension_frac: 6, gain_frac: 13, share: 4928, free: 2048, held: 832 };
        Ok(vec![("8_bit", shaped(tight, phase)?), ("distinct", bare(Self::new(others)?)?)])
    }
}

/// Returns a narrow coupling whose gains are K_e = 60, K_c = 30, B_c/T = 10 PWM counts per count.
fn tight() -> CouplingConfig {
    CouplingConfig { widths: short(), extension_frac: 3, gain_frac: 8, share: 154, free: 64, held: 26 }
}
