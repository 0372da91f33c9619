//! The settings of an axis's loop as ranges of words.

use hpu_cosim::scene::LoopWords;
use hpu_datapath::LoopConfig;

use super::span::Span;

/// The settings of a scene's loop, each with the range of words that it takes during the run.
#[derive(Clone, Debug)]
pub struct Settings {
    pub config: LoopConfig,
    pub reference: Span,
    pub stiffness: Span,
    pub damping: Span,
    pub period: i64,
    pub scale: Span,
    /// The length of a full turn of the counter, with its unit.
    pub turn: String,
}

impl Settings {
    pub fn new(words: &LoopWords, unit: &str) -> Self {
        let ramped = |from: i64, to: Option<i64>| Span::exact(from.into()).hull(Span::exact(to.unwrap_or(from).into()));
        let last = |ramp: Option<hpu_cosim::WordRamp>| ramp.map(|ramp| ramp.word(u64::MAX));
        let counts = 2f64.powi(words.config.position_width.cast_signed());
        Self {
            turn: format!("{counts} counts ({:.6} {unit})", counts * words.realised.count_rad),
            config: words.config,
            reference: Span::exact(words.reference.into()),
            stiffness: ramped(words.stiffness, last(words.schedule.stiffness)),
            damping: Span::exact(words.damping.into()),
            period: words.period,
            scale: ramped(words.scale, last(words.schedule.scale)),
        }
    }
}
