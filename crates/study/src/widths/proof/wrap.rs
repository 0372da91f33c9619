//! Where the spring's product first leaves its word.

use hpu_cosim::scene::Scene;
use hpu_signal::Format;

use super::WrapsAt;
use super::haptic::{Rows, Settings};
use super::travel::Travel;

/// `floor(penetration * word / 2^frac) >= 2^bits`: a penetration of `p` counts overflows from the word
/// `ceil(2^(bits + frac) / p)` on.
pub(crate) fn wraps_at(scene: &Scene, settings: &Settings, travel: &Travel, rows: &Rows) -> Option<WrapsAt> {
    if !matches!(scene.method.kind, hpu_cosim::scene::Loop::Hybrid | hpu_cosim::scene::Loop::Conventional) {
        return None;
    }
    let (config, format) = (settings.config, settings.config.stiffness);
    let full = 1i128 << (config.pwm.width as i32 + format.frac());
    let first =
        |factor: i128, held: Format| (factor > 0).then(|| (full + factor - 1) / factor).filter(|&by| held.holds(by));
    let penetration = rows.get("penetration").span.max;
    let word = first(penetration, format);
    let words = scene.words().ok()?;
    let unit = words.realised.torque_quantum_nm / words.realised.count_rad * format.lsb();
    Some(WrapsAt {
        penetration: i64::try_from(penetration).ok()?,
        word: word.and_then(|word| i64::try_from(word).ok()),
        stiffness: word.map(|word| word as f64 * unit),
        at_scene: first(settings.stiffness.max, Format::unsigned(config.position_width)).map(|counts| counts as i64),
        reached: travel.reached,
    })
}
