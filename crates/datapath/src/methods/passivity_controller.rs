//! Time-domain passivity: an observer sums up the energy that the wall has taken, and a controller adds damping when
//! the wall has given more than it took.
//!
//! - **Equation**: at capture n, `d` the motion since the last, `f = wanted` the torque of spring and drag, `c` the
//!   correction in force: `W(n) = W(n-1) + f d + c(n-1) d(n-1)`, or with `EXACT` `W(n) = W(n-1) + torque(n-1) d`, the
//!   work done on the torque that was shown; at most `CREDIT` unless that is 0. `q = floor(|W| / |d|)`;
//!   `torque = clamp(f + sign(d) q)` if `W < 0` and `d /= 0`, else `f`; `c = torque - f`.
//!   `wanted = clamp(spring + drag)` as every law has it: `spring = min(floor(penetration * stiffness), top)` and
//!   `drag = floor(damping * d)`, within `-top - 1 .. top`, inside the wall, 0 outside, `top = 2^TORQUE_WIDTH - 1`.
//! - **Ports**: those of every law; `scale` and `delta` are ignored. `memory` (1,ENERGY_WIDTH-1,0): `W` of the latest
//!   capture.
//! - **Latency**: `ENERGY_WIDTH + 2` edges from a capture to its torque.
//! - **Edge**: a sample edge (countdown 0, then `max(period,1) - 1`) captures and loads `W`; the next starts the
//!   division; `ENERGY_WIDTH + 2` edges after the capture the torque is loaded. Sample edges up to and including that
//!   one are passed over: `d` then spans several samples.
//! - **Reset**: all 0, idle; the first edge samples.
//! - **Overflow**: energy and torque saturate; so does the quotient, at `TORQUE_WIDTH` bits.
//! - **VHDL twin**: `hdl/passivity_controller.vhd`, around a `sequential_divider`.
//! - **Source**: Hannaford and Ryu 2002 (series controller, impedance causality).
//! - **Known failures**: no correction without motion, whatever `W`. The classic observer pairs `d` with the torque
//!   that follows it and misses what the hold generates. Energy once taken delays the correction: bounded by `CREDIT`.
//!   `EXACT` takes all motion between captures as done on one torque: what moves while it computes was done on the one
//!   before. The floor of `q` leaves less than `|d|` uncorrected, which `W` carries on.
//! - **Differs from the hardware**: the products take one edge, so no limit on the clock. The emulator computes the
//!   quotient at the sample edge and shows it LATENCY edges later: the ports are exact at every edge, the registers of
//!   the division are not modelled.

use hpu_signal::{Format, Int, Machine, Narrowed, Narrowing, Overflow, Reach, Rounding, Signal, Word};

use crate::base::config::{NATURAL, within};
use crate::base::law::{Wanted, ZERO, shown};
use crate::base::listed::Listed;
use crate::base::sequence::{Sequence, captures, loads_before_it_reads};
use crate::methods::method_variants::{InLoops, bare, distinct, shaped, short};
use crate::{
    Block, ConfigError, DividerConfig, Generic, Law, LawIn, LawOut, LawWidths, Lemma, MethodLoop, Register,
    SequentialDivider, Step, arithmetic::sequential_divider,
};

crate::base::listed::configuration! {
    /// The widths and options of a passivity controller.
    pub struct PassivityConfig {
        /// The widths that every law has.
        widths: LawWidths = LawWidths::default(), [];
        /// Whether the observer uses the torque that was shown, instead of the wanted torque.
        exact: bool = false, ["EXACT"];
        /// Width of the energy.
        energy_width: u32 = 32, ["ENERGY_WIDTH"];
        /// The largest stored energy; 0 for no limit.
        credit: u32 = 0, ["CREDIT"];
    }
}

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PassivityController {
    config: PassivityConfig,
    motion: Format,
    energy: Narrowing,
    divider: SequentialDivider,
    wanted: Wanted,
    fits_64: bool,
    sequence: Sequence<Registers<Narrowed>>,
}

hpu_signal::ports! {
    /// The registers from which a capture begins, and those after it.
    pub struct Registers { position, motion, correction, energy, torque }
}

const RESET: Registers<Narrowed> =
    Registers { position: ZERO, motion: ZERO, correction: ZERO, energy: ZERO, torque: ZERO };

impl PassivityController {
    /// Returns a controller with these widths and options.
    ///
    /// # Errors
    ///
    /// Returns an error unless the widths pass [`LawWidths::check`], the energy has at least as many bits as the torque
    /// and at most 48, and the credit is a VHDL `natural`.
    pub fn new(config: PassivityConfig) -> Result<Self, ConfigError> {
        let PassivityConfig { widths, energy_width, credit, .. } = config;
        widths.check(Self::NAME)?;
        within(Self::NAME, "ENERGY_WIDTH", energy_width, widths.torque_width..=48)?;
        within(Self::NAME, "CREDIT", credit, 0..=NATURAL)?;
        let division =
            DividerConfig { num_width: energy_width, den_width: widths.width, frac: 0, out_width: widths.torque_width };
        let energy = Format::signed(energy_width);
        let mut block = Self {
            config,
            motion: Format::signed(widths.width),
            energy: Narrowing { from_frac: 0, to: energy, rounding: Rounding::Truncate, overflow: Overflow::Saturate },
            divider: SequentialDivider::new(division)?,
            wanted: Wanted::new(&widths),
            fits_64: false,
            // One edge starts the division, one adds its quotient.
            sequence: Sequence::new(division.steps() + 2, RESET),
        };
        block.fits_64 = block.reaches_64();
        Ok(block)
    }

    /// Returns the widths and constants.
    pub fn config(&self) -> &PassivityConfig {
        &self.config
    }

    /// Returns whether 64 bits suffice for everything that a capture computes.
    fn reaches_64(&self) -> bool {
        let (torque, motion) = (Reach::of(self.config.widths.torque()), Reach::of(self.motion));
        let position = Reach::of(Format::unsigned(self.config.widths.width));
        let last = Registers { position, motion, correction: torque, energy: Reach::of(self.energy.to), torque };
        let input = self.config.widths.inputs().map(|signal| Reach::of(signal.format));
        let [motion, wanted, energy] = self.begun(&last, &input);
        let missing = Reach::of(Format::unsigned(self.config.widths.torque_width));
        Reach::fit_64(&[motion, wanted, energy, self.ended(motion, wanted, energy, missing)])
    }

    /// Returns the values of a capture that are known before the division: displacement, wanted torque and energy.
    #[inline]
    fn begun<W: Word>(&self, last: &Registers<W>, input: &LawIn<W>) -> [W; 3] {
        let motion = (input.position - last.position).wrap(self.motion);
        let wanted = self.wanted.torque(input, motion);
        let LawWidths { width, torque_width, .. } = self.config.widths;
        let room = torque_width + 2 + width;
        let work = if self.config.exact {
            (last.torque * motion).cut("exactly", room - 1)
        } else {
            let asked = (wanted.shed() * motion).cut("asked", room - 1);
            asked + (last.correction * last.motion).cut("added", room)
        };
        let energy = (last.energy + work).narrow(&self.energy);
        let credit = self.config.credit.into();
        [motion, wanted, if self.config.credit > 0 { energy.limit(self.energy.to.min(), credit) } else { energy }]
    }

    /// Returns the wanted torque plus the quotient `missing` in the direction of the displacement, if the energy is
    /// below 0.
    #[inline]
    fn ended<W: Word>(&self, motion: W, wanted: W, energy: W, missing: W) -> W {
        let (zero, top) = (W::int(0), self.config.widths.top());
        let paid = || [shown(W::select(zero.above(motion), wanted - missing, wanted + missing), top)];
        let [torque] = W::branch(zero.above(energy) & motion.is_set(), paid, || [wanted]);
        torque
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
        let [motion, wanted, energy] = self.begun(&last, &input);
        let [moved, stored] = [motion, energy].map(|word| word.narrowed().word);
        let missing = if stored < 0 && moved != 0 { self.divider.divide(-stored, moved.abs()) } else { ZERO };
        let torque = self.ended(motion, wanted, energy, Machine::of_narrowed(missing));
        let correction = (torque - wanted).shed();
        Registers { position: input.position, motion, correction, energy, torque }.map(Machine::narrowed)
    }

    #[inline]
    fn shown(&self) -> LawOut<Narrowed> {
        LawOut { torque: self.sequence.loaded().torque, memory: self.sequence.captured().energy }
    }
}

/// The registers are those of the VHDL, including those of its divider.
impl Step for PassivityController {
    fn registers(&self) -> Vec<Register> {
        let LawWidths { width, period_width, torque_width, .. } = self.config.widths;
        let torque = self.config.widths.torque();
        let mut all = vec![
            Register::new("countdown", Format::unsigned(period_width)),
            Register::new("previous", Format::unsigned(width)),
            Register::new("moved", self.motion),
            Register::new("demand", Format::signed(torque_width + 1)),
            Register::new("correction", torque),
            Register::new("energy", self.energy.to),
            Register::new("shown", Format::signed(torque_width + 1)),
            Register::new("start", Format::BIT),
            Register::new("deficit", Format::unsigned(self.config.energy_width)),
            Register::new("distance", Format::unsigned(width)),
            Register::new("memory", self.energy.to),
        ];
        all.extend(Register::inside("divider", &self.divider));
        all
    }

    fn step<W: Word>(&self, registers: &[W], input: LawIn<W>) -> (Vec<W>, LawOut<W>) {
        let [left, position, motion, wanted, correction, energy, torque, start, num, den, memory, ref rest @ ..] =
            *registers
        else {
            unreachable!("registers")
        };
        let (dividing, made) = self.divider.step(rest, sequential_divider::In { start, num, den });
        let (left, captures) = captures(left, input.period, [start, made.busy, made.ready]);
        let magnitude = |word: W| W::select(W::int(0).above(word), -word, word);
        let captured = || {
            let last = Registers { position, motion, correction, energy, torque };
            let [motion, wanted, energy] = self.begun(&last, &input);
            [input.position, motion, wanted, energy, magnitude(energy), magnitude(motion), energy]
        };
        let kept = || [position, motion, wanted, energy, num, den, memory];
        let [position, moved, demand, stored, num, den, shown] = W::branch(captures, captured, kept);
        let loaded = || {
            let torque = self.ended(motion, wanted, energy, made.quotient);
            [torque - wanted, torque]
        };
        let [correction, pushed] = W::branch(made.ready.is_set(), loaded, || [correction, torque]);
        let own = [left, position, moved, demand, correction, stored, pushed, W::of_bit(captures), num, den, shown];
        ([&own[..], &dividing].concat(), LawOut { torque, memory })
    }

    fn lemmas(&self) -> Vec<Lemma<'_>> {
        vec![loads_before_it_reads(self, 11, 7)]
    }
}

crate::base::listed::configured!(PassivityController: PassivityConfig);

impl Law for PassivityController {
    const LOOP: &'static str = "passivity_controller_loop";

    crate::base::law::law_config!();

    fn latency(&self) -> u32 {
        self.sequence.latency()
    }

    fn lost(&self) -> [(bool, bool); 2] {
        self.shown().lost()
    }
}

impl Block for PassivityController {
    const NAME: &'static str = "passivity_controller";
    crate::base::law::law_ports!(self => self.energy.to, "PWM count*count", "Energy that the wall has taken");

    crate::base::law::law_in_sequence!();
}

impl Listed for PassivityController {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let (narrow, default) = (narrow(), PassivityConfig::default());
        let exact = PassivityConfig { exact: true, ..narrow };
        // The total, less the greatest credit, needs every bit that the VHDL gives it. The energy's width or those of
        // torque and motion determine this number of bits.
        let deep = |torque_width, energy_width| {
            let widths = LawWidths { width: 16, torque_width, ..LawWidths::default() };
            PassivityConfig { widths, exact: true, energy_width, credit: NATURAL }
        };
        let all = [
            ("exact", PassivityConfig { exact: true, ..default }),
            ("8_bit", narrow),
            ("exact_8_bit", exact),
            ("credit", PassivityConfig { credit: 40, ..narrow }),
            ("exact_credit", PassivityConfig { credit: 40, ..exact }),
            ("greatest_credit", PassivityConfig { credit: NATURAL, ..narrow }),
            ("wide_energy", deep(15, 32)),
            ("wide_torque", deep(16, 31)),
        ];
        all.into_iter().map(|(label, config)| Ok((label, Self::new(config)?))).collect()
    }
}

impl InLoops for PassivityController {
    fn loops() -> Result<Vec<(&'static str, MethodLoop<Self>)>, ConfigError> {
        let (held, exact) = (Self::new(narrow())?, Self::new(PassivityConfig { exact: true, ..narrow() })?);
        let phases = [held.latency() + 1, exact.latency() + 1];
        let others = PassivityConfig { widths: distinct(), exact: true, energy_width: 21, credit: 4000 };
        Ok(vec![
            ("8_bit", shaped(held, phases[0])?),
            ("exact_8_bit", shaped(exact, phases[1])?),
            ("distinct", bare(Self::new(others)?)?),
        ])
    }
}

fn narrow() -> PassivityConfig {
    PassivityConfig { widths: short(), energy_width: 14, ..PassivityConfig::default() }
}
