//! Finds where the spring's product first overflows its word.

use hpu_cosim::scene::{Device, Hand, Loop, LoopWords, Scene};
use hpu_signal::Format;

use super::WrapsAt;
use super::haptic::NetRanges;
use super::travel::Settings;
use super::travel::Travel;

/// Solves `floor(penetration * word / 2^frac) >= 2^bits`: a penetration of `p` counts overflows from the word
/// `ceil(2^(bits + frac) / p)` on.
pub fn wraps_at(
    scene: &Scene,
    words: &LoopWords,
    settings: &Settings,
    travel: &Travel,
    rows: &NetRanges,
) -> Option<WrapsAt> {
    if !matches!(scene.method.kind, Loop::Hybrid | Loop::Conventional) {
        return None;
    }
    let (config, format) = (settings.config, settings.config.stiffness);
    let full = full(settings);
    let first =
        |factor: i128, held: Format| (factor > 0).then(|| (full + factor - 1) / factor).filter(|&by| held.holds(by));
    let penetration = rows.get("penetration").span.max;
    let word = first(penetration, format);
    Some(WrapsAt {
        penetration: i64::try_from(penetration).ok()?,
        word: word.and_then(|word| i64::try_from(word).ok()),
        of_a_word: words.realised.torque_quantum_nm / words.realised.count_rad * format.lsb(),
        at_scene: first(settings.stiffness.max, Format::unsigned(config.position_width)).map(|counts| counts as i64),
        at_rest: at_rest(scene, words, settings),
        reached: travel.reached,
    })
}

/// Returns the least product that overflows.
fn full(settings: &Settings) -> i128 {
    1i128 << (settings.config.pwm.width as i32 + settings.config.stiffness.frac())
}

/// Returns the least word at which a pushing hand cannot rest: even at the far end of the deepest penetration without
/// overflow, the hand pushes on. There is no drag at rest.
fn at_rest(scene: &Scene, words: &LoopWords, settings: &Settings) -> Option<i64> {
    let Hand::SpringDamper { stiffness_nm_per_rad, path, .. } = &scene.hand else { return None };
    let pwm = scene.method.pwm;
    let shaped = scene.amplifier.is_some_and(|amplifier| amplifier.shaper.is_some());
    if pwm.antiphase || pwm.floating || pwm.dead_time_s > 0.0 || shaped || scene.wall.ramp.is_some() {
        // The shaft does not get exactly the commanded torque.
        return None;
    }
    let coulomb_nm = match scene.device {
        Device::Motor(motor) => motor.coulomb_friction_nm,
        Device::Mass(mass) => mass.coulomb_n,
    };
    let (format, realised) = (settings.config.stiffness, words.realised);
    let depth_rad = path.last()?.angle_rad - realised.wall_position_rad;
    // One part in 10^9 and a millionth of a count cover the roundings.
    let pushed_on = |word: i128| {
        let deepest = (full(settings) + word - 1) / word - 1;
        let hold_nm = (deepest * word) as f64 * format.lsb() * realised.torque_quantum_nm + coulomb_nm;
        let push_nm = stiffness_nm_per_rad * (depth_rad - (deepest as f64 + 1.0 + 1e-6) * realised.count_rad);
        push_nm > hold_nm * (1.0 + 1e-9)
    };
    (1..=format.max().min(1 << 20)).find(|&word| pushed_on(word)).map(|word| word as i64)
}
