//! The common part of the laws of the method loops: their ports, their widths, and the wall that they all begin with.
//!
//! A *law* reads the wall's coordinates and computes a torque from them once a sample. A `MethodLoop` connects any law
//! between encoder and bridge.
//!
//! A **sample edge** is an edge that finds the countdown at 0; it restarts the countdown at `max(period,1) - 1`, and
//! every other edge decrements it. The first edge after reset is a sample edge. A law that computes for several edges
//! ignores the sample edges that fall into its computation.

use hpu_signal::{Format, Narrowed, Narrowing, Overflow, Rounding, Signal, Word};

use crate::base::config::{COUNTER, WORD, within};
use crate::base::listed::{Field, Given};
use crate::{Block, ConfigError, Generic};

hpu_signal::ports! {
    /// Inputs of every law. The data sheet of a law says which inputs it ignores.
    pub struct LawIn of |widths: &LawWidths| {
        position: Format::unsigned(widths.width), "count", "Position, modulo its width";
        delta: Format::signed(widths.width), "count", "Position beyond the wall's surface";
        contact, "At or behind the wall's surface";
        penetration: Format::unsigned(widths.width), "count", "Depth inside the wall";
        stiffness: widths.stiffness, "PWM count/count", "Stiffness of the wall";
        damping: widths.damping, "PWM count/(count/sample)", "Damping inside the wall";
        period: Format::unsigned(widths.period_width), "clock", "Sample period; 0 acts as 1";
        scale: widths.scale, "1", "Force shown for one of the virtual environment";
    }
    /// Outputs of every law: the torque, and the word that the law remembers (an energy, an extension or a velocity).
    pub struct LawOut of |law: (&LawWidths, Signal)| {
        torque: law.0.torque(), "PWM count", "Torque against the penetration";
        memory = law.1;
    }
}

/// A method of stabilisation as a block. The five laws implement it, so that [`MethodLoop`](crate::MethodLoop) wires
/// any of them between encoder and bridge.
pub trait Law:
    Block<
        In<i64> = LawIn<i64>,
        In<Signal> = LawIn<Signal>,
        Out<i64> = LawOut<i64>,
        Out<Signal> = LawOut<Signal>,
        Out<Narrowed> = LawOut<Narrowed>,
    > + Clone
    + PartialEq
    + 'static
{
    /// Name of the loop around this law, which is that of its VHDL entity.
    const LOOP: &'static str;
    /// Returns the widths that every law has.
    fn widths(&self) -> &LawWidths;
    /// Returns the number of edges from a sample edge to the torque that it makes; 0 if the torque follows the law's
    /// registers combinationally.
    fn latency(&self) -> u32;
    /// Lets the combinational outputs settle with these inputs and the registers as they stand; `shown` are the outputs
    /// shown before. Returns the outputs. A law whose outputs are registers need not implement it.
    #[inline]
    fn settle(&mut self, input: &LawIn<i64>, shown: LawOut<i64>) -> LawOut<i64> {
        let _ = input;
        shown
    }
    /// Returns, for torque and memory as they stand, whether they were rounded and whether they overflowed.
    /// [`quiet`](Block::quiet) must treat a change of these flags like a change of an output.
    fn lost(&self) -> [(bool, bool); 2];
}

crate::base::listed::configuration! {
    /// The widths and formats that every law has.
    pub struct LawWidths {
        /// Width of the position, in bits.
        width: u32 = 12, ["WIDTH"];
        /// Format of the stiffness, in PWM counts per count.
        stiffness: Format = Format::unsigned(12), ["STIFFNESS_WIDTH", "STIFFNESS_FRAC"];
        /// Format of the damping, in PWM counts per (count per sample).
        damping: Format = Format::unsigned(12), ["DAMPING_WIDTH", "DAMPING_FRAC"];
        /// Width of the sample period, in bits.
        period_width: u32 = 24, ["PERIOD_WIDTH"];
        /// Format of the scale, which is a pure number.
        scale: Format = Format::new(false, 8, 8).expect("16 bits"), ["SCALE_WIDTH", "SCALE_FRAC"];
        /// Number of bits of a torque's magnitude, which is that of the PWM.
        torque_width: u32 = 12, ["TORQUE_WIDTH"];
    }
}

impl LawWidths {
    /// Returns an error for widths that no law can have.
    ///
    /// # Errors
    ///
    /// Returns an error unless position and gains have 2 to 32 bits, the period and the torque have 2 to 30 bits, and
    /// the gains are unsigned with 0 or more fraction bits.
    pub fn check(&self, law: &'static str) -> Result<(), ConfigError> {
        within(law, "WIDTH", self.width, 2..=32)?;
        within(law, "PERIOD_WIDTH", self.period_width, COUNTER)?;
        within(law, "TORQUE_WIDTH", self.torque_width, COUNTER)?;
        for (word, format) in [("stiffness", self.stiffness), ("damping", self.damping), ("scale", self.scale)] {
            within(law, word, format.width(), 2..=32.min(*WORD.end()))?;
            if format.is_signed() || format.frac() < 0 {
                let found = format!("{word} is {format}");
                return Err(ConfigError::new(law, found, "unsigned with 0 or more fraction bits, as (0,12,0)"));
            }
        }
        Ok(())
    }

    /// Describes the inputs of every law.
    pub fn inputs(&self) -> LawIn<Signal> {
        LawIn::of(self)
    }

    /// Describes the outputs of a law with this description of its memory.
    pub fn outputs(&self, memory: Signal) -> LawOut<Signal> {
        LawOut::of((self, memory))
    }

    /// Returns the format of every law's torque.
    pub fn torque(&self) -> Format {
        Format::signed(self.torque_width + 2)
    }

    /// The torque that the plain wall wants with these inputs, after that much motion since the sample before.
    pub fn wanted<W: Word>(&self, input: &LawIn<W>, motion: W) -> W {
        Wanted::new(self).torque(input, motion)
    }

    /// Returns the greatest torque magnitude that the bridge can show, in PWM counts.
    #[inline]
    pub fn top(&self) -> i64 {
        (1 << self.torque_width) - 1
    }
}

/// A word of 0 that lost no bits: the state after reset.
pub(crate) const ZERO: Narrowed = Narrowed { word: 0, rounded: false, overflowed: false };

impl LawOut<Narrowed> {
    /// Returns the words without the flags of lost bits.
    #[inline]
    pub(crate) fn words(self) -> LawOut<i64> {
        self.map(|narrowed| narrowed.word)
    }

    /// Returns the flags of lost bits in the form of [`Law::lost`].
    pub(crate) fn lost(self) -> [(bool, bool); 2] {
        [self.torque, self.memory].map(|narrowed| (narrowed.rounded, narrowed.overflowed))
    }
}

/// Returns the torque limited to what the bridge can show, and marks it as overflowed if the limit changed it.
#[inline]
pub(crate) fn shown<W: Word>(torque: W, top: i64) -> W {
    let limited = torque.limit((-top).into(), top.into());
    limited.overflowing(!limited.equals(torque))
}

/// The torque of a plain wall, which the laws of several edges take as the wanted torque: spring and drag inside the
/// wall only, each truncated and clamped.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Wanted {
    spring: Narrowing,
    drag: Narrowing,
    top: i64,
}

impl Wanted {
    pub(crate) fn new(widths: &LawWidths) -> Self {
        let clamp =
            |from_frac, to| Narrowing { from_frac, to, rounding: Rounding::Truncate, overflow: Overflow::Saturate };
        Self {
            spring: clamp(widths.stiffness.frac(), Format::unsigned(widths.torque_width)),
            drag: clamp(widths.damping.frac(), Format::signed(widths.torque_width + 1)),
            top: widths.top(),
        }
    }

    /// Returns `min(floor(penetration * stiffness), top)`.
    #[inline]
    pub(crate) fn spring<W: Word>(&self, penetration: W, stiffness: W) -> W {
        (penetration * stiffness).narrow(&self.spring)
    }

    /// Returns the sum of spring and drag inside the wall, limited to what the bridge can show, and 0 outside.
    #[inline]
    pub(crate) fn torque<W: Word>(&self, input: &LawIn<W>, motion: W) -> W {
        let inside = || {
            let drag = (input.damping * motion).narrow(&self.drag);
            [shown(self.spring(input.penetration, input.stiffness) + drag, self.top)]
        };
        let [torque] = W::branch(input.contact.is_set(), inside, || [W::int(0)]);
        torque.cut("wanted", self.drag.to.width())
    }
}

/// The widths of every law, whose generics have names of their own.
impl Field for LawWidths {
    fn told(self, _: &[&'static str]) -> Vec<(&'static str, Generic)> {
        self.generics()
    }

    fn given(given: &Given, _: &[&'static str], _: &Self) -> Result<Self, ConfigError> {
        Self::given(given)
    }
}

/// The part of `impl Law` that is alike in all laws: the widths of every law.
macro_rules! law_config {
    () => {
        fn widths(&self) -> &LawWidths {
            &self.config.widths
        }
    };
}

/// The part of `impl Block` that is alike in all laws: their ports, with the description of the memory, and their
/// generics.
macro_rules! law_ports {
    ($self:ident => $format:expr, $unit:expr, $doc:literal) => {
        const CLOCKED: bool = true;
        type In<T> = LawIn<T>;
        type Out<T> = LawOut<T>;

        fn inputs(&self) -> LawIn<Signal> {
            self.config.widths.inputs()
        }

        fn outputs(&$self) -> LawOut<Signal> {
            $self.config.widths.outputs(Signal::new("memory", $format, $unit, $doc))
        }

        fn generics(&self) -> Vec<(&'static str, Generic)> {
            self.told()
        }
    };
}

/// The part of `impl Block` that is alike in the laws that capture at a sample edge and load some edges later.
macro_rules! law_in_sequence {
    () => {
        fn equations(&self) -> Option<crate::ClockEdge<'_>> {
            Some(crate::ClockEdge::of(self))
        }

        fn reset(&mut self) -> LawOut<i64> {
            self.sequence.reset(RESET);
            self.shown().words()
        }

        #[inline]
        fn tick(&mut self, input: LawIn<i64>) -> LawOut<i64> {
            if self.sequence.tick(input.period) {
                self.sequence.captures(self.capture(self.sequence.loaded(), &input));
            }
            self.shown().words()
        }

        #[inline]
        fn quiet(&self, input: &LawIn<i64>) -> u64 {
            let stays =
                |last: &Registers<Narrowed>| last.position.word == input.position && self.capture(last, input) == *last;
            self.sequence.quiet(input.period, stays)
        }

        #[inline]
        fn skip(&mut self, edges: u64, input: &LawIn<i64>) {
            debug_assert!(edges <= self.quiet(input));
            self.sequence.skip(edges, input.period);
        }
    };
}

pub(crate) use {law_config, law_in_sequence, law_ports};
