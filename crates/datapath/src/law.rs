//! What the laws of the method loops have in common: their ports, their widths, and the wall they all begin with.
//!
//! A *law* reads the wall's coordinates and makes a torque of them, once a sample. A
//! `MethodLoop` puts any law between encoder and bridge.
//!
//! A **sample edge** is an edge that finds the countdown at 0; it restarts the countdown at `max(period,1) - 1`, every
//! other edge decrements it. The first edge after reset samples. A law that computes for several edges passes over the
//! sample edges that fall into them.

use hpu_signal::{Format, Narrowed, Narrowing, Overflow, Rounding, Signal, Word};

use crate::config::{COUNTER, WORD, within};
use crate::{Block, ConfigError, Generic};

hpu_signal::ports! {
    /// Inputs of every law. What a law ignores is said in its data sheet.
    pub struct LawIn { position, delta, contact, penetration, stiffness, damping, period, scale }
}

hpu_signal::ports! {
    /// Outputs of every law: the torque, and what the law remembers (an energy, an extension, a velocity).
    pub struct LawOut { torque, memory }
}

/// A law as a block.
pub trait Law:
    Block<In<i64> = LawIn<i64>, In<Signal> = LawIn<Signal>, Out<i64> = LawOut<i64>, Out<Signal> = LawOut<Signal>>
    + Clone
    + 'static
{
    /// Name of the loop around this law.
    const LOOP: &'static str;
    /// The widths it shares with every law.
    fn widths(&self) -> &LawWidths;
    /// The generics that this law has beyond [`LawWidths::generics`].
    fn own_generics(&self) -> Vec<(&'static str, Generic)>;
    /// Edges from a sample edge to the torque it makes; 0 when the torque follows its registers at once.
    fn latency(&self) -> u32;
    /// Lets the outputs settle with these inputs and the registers as they stand, from what they have shown. For a law
    /// whose outputs are registers, there is nothing to do.
    #[inline]
    fn settle(&mut self, input: &LawIn<i64>, shown: LawOut<i64>) -> LawOut<i64> {
        let _ = input;
        shown
    }
    /// Whether torque and memory, as they stand, were rounded, and whether they overflowed. To
    /// [`quiet`](Block::quiet), a change of these counts as one of the outputs.
    fn lost(&self) -> [(bool, bool); 2];
}

/// The widths that every law has.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LawWidths {
    /// Width of the position.
    pub width: u32,
    /// Format of the stiffness, in PWM counts per count.
    pub stiffness: Format,
    /// Format of the damping, in PWM counts per count a sample.
    pub damping: Format,
    /// Width of the sample period.
    pub period_width: u32,
    /// Format of the scale.
    pub scale: Format,
    /// Bits of a torque's magnitude: those of the PWM.
    pub torque_width: u32,
}

impl Default for LawWidths {
    fn default() -> Self {
        Self {
            width: 12,
            stiffness: Format::unsigned(12),
            damping: Format::unsigned(12),
            period_width: 24,
            scale: Format::new(false, 8, 8).expect("16 bits"),
            torque_width: 12,
        }
    }
}

impl LawWidths {
    /// Refuses what no law can have.
    ///
    /// # Errors
    ///
    /// Unless position and gains have 2 to 32 bits, the period and the torque 2 to 30, and the gains are unsigned with
    /// 0 or more fraction bits.
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

    /// The generics that every law begins with, in the order of the entity.
    #[must_use]
    pub fn generics(&self) -> Vec<(&'static str, Generic)> {
        let integer = |value: u32| Generic::Integer(value.into());
        let frac = |format: Format| Generic::Integer(format.frac().into());
        vec![
            ("WIDTH", integer(self.width)),
            ("STIFFNESS_WIDTH", integer(self.stiffness.width())),
            ("STIFFNESS_FRAC", frac(self.stiffness)),
            ("DAMPING_WIDTH", integer(self.damping.width())),
            ("DAMPING_FRAC", frac(self.damping)),
            ("PERIOD_WIDTH", integer(self.period_width)),
            ("SCALE_WIDTH", integer(self.scale.width())),
            ("SCALE_FRAC", frac(self.scale)),
            ("TORQUE_WIDTH", integer(self.torque_width)),
        ]
    }

    /// The inputs of every law.
    #[must_use]
    pub fn inputs(&self) -> LawIn<Signal> {
        let (counts, whole) = (Format::unsigned(self.width), "count");
        LawIn {
            position: Signal::new("position", counts, whole, "Position, modulo its width"),
            delta: Signal::new("delta", Format::signed(self.width), whole, "Position beyond the wall's surface"),
            contact: Signal::bit("contact", "At or behind the wall's surface"),
            penetration: Signal::new("penetration", counts, whole, "Depth inside the wall"),
            stiffness: Signal::new("stiffness", self.stiffness, "PWM count/count", "Stiffness of the wall"),
            damping: Signal::new("damping", self.damping, "PWM count/(count/sample)", "Damping inside the wall"),
            period: Signal::new("period", Format::unsigned(self.period_width), "clock", "Sample period; 0 acts as 1"),
            scale: Signal::new("scale", self.scale, "1", "Force shown for one of the virtual environment"),
        }
    }

    /// The torque of every law.
    #[must_use]
    pub fn torque(&self) -> Signal {
        Signal::new("torque", Format::signed(self.torque_width + 2), "PWM count", "Torque against the penetration")
    }

    /// The torque that the plain wall wants with these inputs, after that much motion since the sample before.
    #[must_use]
    pub fn wanted<W: Word>(&self, input: &LawIn<W>, motion: W) -> W {
        Wanted::new(self).torque(input, motion)
    }

    /// The greatest magnitude that the bridge can show.
    #[inline]
    #[must_use]
    pub fn top(&self) -> i64 {
        (1 << self.torque_width) - 1
    }
}

/// A word after reset, and one that lost nothing to be 0.
pub(crate) const ZERO: Narrowed = Narrowed { word: 0, rounded: false, overflowed: false };

impl LawOut<Narrowed> {
    /// The words alone.
    #[inline]
    pub(crate) fn words(self) -> LawOut<i64> {
        self.map(|narrowed| narrowed.word)
    }

    /// As [`Law::lost`] tells it.
    pub(crate) fn lost(self) -> [(bool, bool); 2] {
        [self.torque, self.memory].map(|narrowed| (narrowed.rounded, narrowed.overflowed))
    }
}

/// A torque within what the bridge can show, which tells when it had to be put there.
#[inline]
pub(crate) fn shown<W: Word>(torque: W, top: i64) -> W {
    let limited = torque.limit((-top).into(), top.into());
    limited.overflowing(!limited.equals(torque))
}

/// The plain wall, which laws of several edges take as what is wanted: spring and drag, each truncated and clamped,
/// inside the wall only.
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

    /// `min(floor(penetration * stiffness), top)`.
    #[inline]
    pub(crate) fn spring<W: Word>(&self, penetration: W, stiffness: W) -> W {
        (penetration * stiffness).narrow(&self.spring)
    }

    /// Spring and drag inside the wall, within what the bridge can show; 0 outside.
    #[inline]
    pub(crate) fn torque<W: Word>(&self, input: &LawIn<W>, motion: W) -> W {
        let inside = || {
            let drag = (input.damping * motion).narrow(&self.drag);
            [shown(self.spring(input.penetration, input.stiffness) + drag, self.top)]
        };
        let [torque] = W::branch(input.contact.is_set(), inside, || [W::int(0)]);
        torque
    }
}
