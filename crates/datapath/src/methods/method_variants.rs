//! The configurations in which the loops around laws are tested, and the widths that the variants of laws share.

use hpu_signal::Format;

use crate::base::listed::{Configured, Given, Listed};
use crate::methods::method_loop::{LAW, SHAPER};
use crate::pins::pwm::IN_LOOP;
use crate::{ConfigError, InputShaperConfig, Law, LawWidths, MethodLoop, MethodLoopConfig, PwmConfig, Shaping};

/// A law with the configurations in which the loop around it is tested.
pub(crate) trait InLoops: Law + Listed {
    /// Returns the loops beside the default one, each with its label. In the one that is `distinct`, no two generics
    /// have the same value, so that a generic in another one's place is noticed.
    fn loops() -> Result<Vec<(&'static str, MethodLoop<Self>)>, ConfigError>;
}

impl<L: InLoops> Configured for MethodLoop<L> {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        let pwm = PwmConfig::given(&given.renamed(&IN_LOOP))?;
        let shaping = InputShaperConfig::given(&given.renamed(&SHAPER))?.shaping;
        Self::new(L::of_generics(&given.renamed(&LAW))?, MethodLoopConfig { pwm, shaping })
    }
}

impl<L: InLoops> Listed for MethodLoop<L> {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        L::loops()
    }
}

/// Returns a loop around a law with [`distinct`] widths.
pub(crate) fn bare<L: Law>(law: L) -> Result<MethodLoop<L>, ConfigError> {
    let pwm = PwmConfig { width: law.widths().torque_width, ..PwmConfig::default() };
    MethodLoop::new(law, MethodLoopConfig { pwm, shaping: None })
}

/// Returns a loop around a law, with the shaper of 2.5 Hz at that phase.
pub(crate) fn shaped<L: Law>(law: L, phase: u32) -> Result<MethodLoop<L>, ConfigError> {
    let pwm = PwmConfig { width: law.widths().torque_width, ..PwmConfig::default() };
    MethodLoop::new(law, MethodLoopConfig { pwm, shaping: Some(Shaping::high_pass(phase)) })
}

/// Returns widths so short that everything wraps, saturates and rounds within a few edges.
pub(crate) fn small() -> LawWidths {
    widths(8, [(4, 2), (3, 3), (2, 4)], 6, 6)
}

/// Returns widths so short that the latency of a law that computes may exceed a period.
pub(crate) fn short() -> LawWidths {
    widths(8, [(6, 2), (4, 4), (4, 4)], 8, 6)
}

/// Returns widths of which no two are the same.
pub(crate) fn distinct() -> LawWidths {
    widths(9, [(5, 3), (5, 5), (3, 4)], 12, 11)
}

fn widths(width: u32, formats: [(i32, i32); 3], period_width: u32, torque_width: u32) -> LawWidths {
    let [stiffness, damping, scale] = formats.map(|(int, frac)| Format::new(false, int, frac).expect("10 bits"));
    LawWidths { width, stiffness, damping, period_width, scale, torque_width }
}
