//! Converts limits of the shaft into ranges of the encoder's counts.

use hpu_cosim::scene::{Hand, LoopWords, Scene};
use hpu_datapath::LoopConfig;
use hpu_signal::Format;

use super::device::Motion;
use hpu_signal::Span;

/// The settings of a scene's loop, each with the range of words that it takes during the run.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    pub(crate) config: LoopConfig,
    pub(crate) reference: Span,
    pub(crate) stiffness: Span,
    pub(crate) damping: Span,
    pub(crate) period: i64,
    pub(crate) scale: Span,
    /// The length of a full turn of the counter, with its unit.
    pub(crate) turn: String,
}

impl Settings {
    pub(crate) fn new(words: &LoopWords, unit: &str) -> Self {
        let ramped = |from: i64, to: Option<i64>| Span::exact(from.into()).hull(Span::exact(to.unwrap_or(from).into()));
        let last = |ramp: Option<hpu_cosim::WordRamp>| ramp.map(|ramp| ramp.word(u64::MAX));
        let counts = 2f64.powi(words.config.position_width.cast_signed());
        Self {
            turn: format!("{counts} counts ({:.6} {unit})", counts * words.realised.count_rad),
            config: words.config,
            reference: match words.schedule.target {
                Some(_) => Span::of(Format::unsigned(words.config.position_width)),
                None => Span::exact(words.reference.into()),
            },
            stiffness: ramped(words.stiffness, last(words.schedule.stiffness)),
            damping: Span::exact(words.damping.into()),
            period: words.period,
            scale: ramped(words.scale, last(words.schedule.scale)),
        }
    }
}

/// The counts that the counter may see.
#[derive(Clone, Debug)]
pub struct Travel {
    /// Counts since the start; `None` where they have no limit, or where the decoder may miss a count.
    pub counts: Option<Span>,
    /// Displacement from the wall's surface; `None` where it reaches half the counter's range and would be read with
    /// the other sign, and of a target.
    pub delta: Option<Span>,
    /// Speed of the shaft in counts per clock cycle, upwards and downwards.
    per_clock: [f64; 2],
    /// Whether the decoder never misses a count once it has settled.
    pub decoded: bool,
    /// Whether the greatest count is certainly reached.
    pub reached: bool,
}

/// Clock cycles from reset until the decoder has settled; counts that pass in these are not seen.
const UNSEEN: f64 = 6.0;

impl Travel {
    /// Returns the counts of a scene whose shaft stays within these limits.
    pub fn new(scene: &Scene, words: &LoopWords, motion: &Motion) -> Self {
        let count_rad = words.realised.count_rad;
        let wide = 1.0 + 2f64.powi(-40);
        let per_clock = [motion.speed.hi, -motion.speed.lo]
            .map(|speed| (speed.max(0.0) / count_rad * scene.clock.period_s() * wide).next_up());
        let decoded = per_clock.iter().all(|&counts| counts < 1.0);
        let start = scene.initial_angle_rad() / count_rad;
        // A count boundary that is passed while the decoder settles shifts all counts after it.
        let unseen = UNSEEN * per_clock[0].max(per_clock[1]);
        let near = (start - start.round()).abs() <= unseen + 2f64.powi(-40);
        let shift = if near && motion.speed.size() > 0.0 { unseen.min(UNSEEN) as i128 + 1 } else { 0 };
        let counts = motion.angle.filter(|_| decoded).and_then(|angle| {
            // A multiple of a count may be read as either of its two neighbours.
            let low = (angle.lo / count_rad - 2f64.powi(-30)).floor();
            let high = (angle.hi / count_rad + 2f64.powi(-30)).floor();
            let first = start.floor();
            let whole = low.abs().max(high.abs()) < 2f64.powi(52);
            whole.then(|| Span::new((low - first) as i128 - shift, (high - first) as i128 + shift))
        });
        let reached = shift == 0 && deepest_is_reached(scene, count_rad, per_clock[0].max(per_clock[1]));
        let word = Format::signed(words.config.position_width);
        // The wall's position as the first word has it; its distance may itself have been read with the other sign.
        let surface = -i128::from(word.wrap(-i128::from(words.reference)));
        let delta = counts
            .map(|counts| Span::new(counts.min - surface, counts.max - surface))
            .filter(|delta| delta.is_within(Span::of(word)) && words.schedule.target.is_none());
        Self { counts, delta, per_clock, decoded, reached }
    }

    /// Returns the travel of a motion about which nothing is known.
    pub fn unlimited() -> Self {
        Self { counts: None, delta: None, per_clock: [f64::INFINITY; 2], decoded: false, reached: false }
    }

    /// Returns the greatest speed in either direction, in counts per clock cycle.
    pub fn fastest(&self) -> f64 {
        self.per_clock[0].max(self.per_clock[1])
    }

    /// Returns the range of counts passed in `clocks` clock cycles.
    pub fn moved(&self, clocks: f64) -> Span {
        let most = |speed: f64| if speed == 0.0 { 0.0 } else { (speed * clocks).next_up().floor() + 1.0 };
        let [up, down] = self.per_clock.map(most);
        let limit = 2f64.powi(62);
        let moved = Span::new(-(down.min(limit) as i128), up.min(limit) as i128);
        match self.counts {
            // The difference between two counts, the 0 before the first sample included, is at most the whole range.
            Some(counts) => {
                let all = counts.hull(Span::exact(0));
                moved.meet(Span::new(all.min - all.max, all.max - all.min))
            }
            None => moved,
        }
    }
}

/// Returns whether a hand that imposes the motion takes the shaft to its greatest count before the run is over, and for
/// long enough that every register sees it.
fn deepest_is_reached(scene: &Scene, count_rad: f64, per_clock: f64) -> bool {
    let Hand::Prescribed { path } = &scene.hand else { return false };
    let most = path.iter().map(|point| point.angle_rad).fold(f64::NEG_INFINITY, f64::max);
    let inside = most / count_rad - (most / count_rad).floor();
    let margin = 2f64.powi(-20) + 16.0 * per_clock;
    let seen = |time_s: f64| scene.clock.edges(time_s) + 16 < scene.edges();
    let at = path.iter().find(|point| point.angle_rad == most);
    inside > margin && 1.0 - inside > margin && at.is_some_and(|point| seen(point.time_s))
}
