//! From limits of the shaft to ranges of the encoder's counts.

use hpu_cosim::scene::{Hand, LoopWords, Scene};
use hpu_signal::Format;

use super::device::Motion;
use super::span::Span;

/// What the counter may see.
#[derive(Clone, Debug)]
pub(crate) struct Travel {
    /// Counts since the start; none where they have no limit, or where the decoder may miss one.
    pub counts: Option<Span>,
    /// Displacement from the wall's surface; none where it reaches half the counter's range and reads as the other way.
    pub delta: Option<Span>,
    /// Speed of the shaft in counts per clock, upwards and downwards.
    per_clock: [f64; 2],
    /// Whether the decoder never misses a count once it has settled.
    pub decoded: bool,
    /// Whether the greatest count is reached for certain.
    pub reached: bool,
}

/// Clock edges from reset until the decoder has settled, during which counts pass unseen.
const UNSEEN: f64 = 6.0;

impl Travel {
    /// The counts of a scene whose shaft keeps to these limits.
    pub fn new(scene: &Scene, words: &LoopWords, motion: &Motion) -> Self {
        let count_rad = words.realised.count_rad;
        let wide = 1.0 + 2f64.powi(-40);
        let per_clock = [motion.speed.hi, -motion.speed.lo]
            .map(|speed| (speed.max(0.0) / count_rad * scene.clock.period_s() * wide).next_up());
        let decoded = per_clock.iter().all(|&counts| counts < 1.0);
        let start = scene.initial_angle_rad() / count_rad;
        // A boundary that is passed while the decoder settles shifts all counts after it.
        let unseen = UNSEEN * per_clock[0].max(per_clock[1]);
        let near = (start - start.round()).abs() <= unseen + 2f64.powi(-40);
        let shift = if near && motion.speed.size() > 0.0 { unseen.min(UNSEEN) as i128 + 1 } else { 0 };
        let counts = motion.angle.filter(|_| decoded).and_then(|angle| {
            // A multiple of a count may be either side of itself.
            let low = (angle.lo / count_rad - 2f64.powi(-30)).floor();
            let high = (angle.hi / count_rad + 2f64.powi(-30)).floor();
            let first = start.floor();
            let whole = low.abs().max(high.abs()) < 2f64.powi(52);
            whole.then(|| Span::new((low - first) as i128 - shift, (high - first) as i128 + shift))
        });
        let reached = shift == 0 && deepest_is_reached(scene, count_rad, per_clock[0].max(per_clock[1]));
        let word = Format::signed(words.config.position_width);
        // The wall as the first word has it, whose distance may itself have been read the other way.
        let surface = -i128::from(word.wrap(-i128::from(words.reference)));
        let delta = counts
            .map(|counts| Span::new(counts.min - surface, counts.max - surface))
            .filter(|delta| delta.is_within(Span::of(word)));
        Self { counts, delta, per_clock, decoded, reached }
    }

    /// Nothing is known of the motion.
    pub fn unlimited() -> Self {
        Self { counts: None, delta: None, per_clock: [f64::INFINITY; 2], decoded: false, reached: false }
    }

    /// The greatest speed either way, in counts per clock.
    pub fn fastest(&self) -> f64 {
        self.per_clock[0].max(self.per_clock[1])
    }

    /// Counts gone in that many clocks.
    pub fn moved(&self, clocks: f64) -> Span {
        let most = |speed: f64| if speed == 0.0 { 0.0 } else { (speed * clocks).next_up().floor() + 1.0 };
        let [up, down] = self.per_clock.map(most);
        let limit = 2f64.powi(62);
        let moved = Span::new(-(down.min(limit) as i128), up.min(limit) as i128);
        match self.counts {
            // Between two of the counts, and the 0 before the first sample, there is no more than all of them.
            Some(counts) => {
                let all = counts.hull(Span::exact(0));
                moved.meet(Span::new(all.min - all.max, all.max - all.min))
            }
            None => moved,
        }
    }
}

/// Whether a hand that imposes the motion takes the shaft to its greatest count, for long enough that every register
/// sees it, and before the run is over.
fn deepest_is_reached(scene: &Scene, count_rad: f64, per_clock: f64) -> bool {
    let Hand::Prescribed { path } = &scene.hand else { return false };
    let most = path.iter().map(|point| point.angle_rad).fold(f64::NEG_INFINITY, f64::max);
    let inside = most / count_rad - (most / count_rad).floor();
    let margin = 2f64.powi(-20) + 16.0 * per_clock;
    let seen = |time_s: f64| scene.clock.edges(time_s) + 16 < scene.edges();
    let at = path.iter().find(|point| point.angle_rad == most);
    inside > margin && 1.0 - inside > margin && at.is_some_and(|point| seen(point.time_s))
}
