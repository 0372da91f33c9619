//! The proved ranges of a gimbal's words, for every posture of the device and every force of the finger.
//!
//! The counts are those of the joints' travel, and the target is anywhere within the bounds of the scene's. From there
//! on, each block's equations are read as ranges. Two blocks take many edges for a result, and are read in another way:
//! of the inverse kinematics, one step shows that the clamps of the joints hold at all times; the fractional derivative
//! is a sum of products, whose range follows from its weights.

use std::f64::consts::PI;

use hpu_cosim::scene::GimbalScene;
use hpu_cosim::{GimbalSimulation, Wired};
use hpu_datapath::gimbal::{GimbalConfig, GimbalInverse};
use hpu_datapath::{ConfigError, Instance, Register, flatten};
use hpu_plant::arm::Gimbal;
use hpu_signal::{Format, Narrowing, Overflow, Rounding, Signal, Word as _};

use crate::Error;
use crate::interval::Interval;
use crate::ranges::affine::Affine;
use crate::ranges::haptic::NetRanges;
use crate::ranges::walk::Walk;
use crate::ranges::word::Word;
use crate::ranges::{How, Limit, Proof};
use hpu_signal::Span;

/// The reason why a run ends at these limits.
const TRAVEL: &str = "the segment tilts by at most 55 degrees, and the crank stays between its dead centres: beyond, a \
                      run ends";

/// Proves the bounds of a scene.
///
/// # Errors
///
/// The reason why nothing can be proved: words that do not fit, or make no datapath.
pub fn proof(scene: &GimbalScene) -> Result<Proof, Error> {
    let simulation = GimbalSimulation::new(scene)?;
    let wiring = simulation.wiring();
    let (nets, instances) = (wiring.nets(), wiring.instances());
    let errors = joint_errors(&scene.method.config.gimbal)?;
    let (rows, tables) = Affine::on_a_sheet(|| {
        // No counter of the loop turns over, so none is read through its difference.
        let mut walk = Walk { nets: vec![None; nets.len()], moved: &|_| None };
        for ((net, word), known) in nets.iter().zip(flatten(&simulation.input())).zip(&mut walk.nets) {
            *known = Some(Affine::given(given(scene, net).unwrap_or(Span::exact(word.into()))));
        }
        let net = |name: &str| nets.iter().position(|net| net.name == name).expect("a net of the loop");
        let labelled = |label: &str| instances.iter().find(|instance| instance.label == label);
        let block = |label: &str| labelled(label).expect("a block of the loop");
        if let Some(shear) = labelled("shear") {
            let [u, gain] = ["x", "shear_gain"].map(|name| walk.nets[net(name)].expect("an input").known().span);
            walk.nets[net("shear_x")] = Some(sheared(scene, shear, u, gain));
        }
        keep(&mut walk, block("inverse"), &scene.method.config.gimbal);
        if scene.shear.is_none() {
            for (joint, off) in ["pitch", "roll", "rest"].map(net).into_iter().zip(&errors) {
                walk.nets[joint] = walk.nets[joint].map(|word| within(word, *off));
            }
        }
        for label in ["servo1", "servo2", "servo3"] {
            walk.read(block(label));
        }
        walk.load(block("lever"));
        let tables = ["radius", "slope"].map(net);
        for index in tables {
            // The nearest word; the closed form is computed in floats, with an error far below a millionth of a word.
            walk.nets[index] = walk.nets[index].map(|word| within(word, 0.5 + 1e-6));
        }
        // The equilibrium goes from the switch to the impedance control, whose drive goes back to the switch. It is the
        // same for every drive, so it is read first.
        switch(&mut walk, block("switch"));
        for index in ["drive3", "mode"].map(net) {
            walk.nets[index] = None;
        }
        walk.read(block("impedance"));
        switch(&mut walk, block("switch"));
        (NetRanges::known(&nets, &walk.nets, &remarks(scene.shear.is_some())), tables)
    });
    let assumptions = [
        format!("a clock of {} Hz, words as the scene sets them", scene.clock.frequency_hz()),
        TRAVEL.to_string(),
        "the target within the bounds of the scene's; any force of the finger, at any time".to_string(),
    ];
    let mut bounds = rows.bounds(&nets, &assumptions);
    for index in tables {
        bounds[index].how = How::Exhausted;
    }
    Ok(Proof { bounds, limits: limits(scene), wraps_at: None })
}

/// Returns the range of an input that the world drives; `None` for a word that the scene sets.
fn given(scene: &GimbalScene, net: &Signal) -> Option<Span> {
    // Rounding keeps order, so that the ends of a travel have the least and the greatest count.
    let count = |angle_rad: f64| (angle_rad / scene.count_rad() + 1e-6).round() as i128;
    match net.name {
        "count1" | "count2" => Some(Span::new(-count(Gimbal::TILT_RAD), count(Gimbal::TILT_RAD))),
        "count3" => Some(Span::new(0, count(PI))),
        "finger_force" => Some(Span::of(net.format)),
        "x" => Some(words(target_m(scene)[0], net.format)),
        "y" => Some(words(target_m(scene)[1], net.format)),
        "z" => Some(words(target_m(scene)[2], net.format)),
        _ => None,
    }
}

/// Returns a box that holds every target of a scene, in m.
fn target_m(scene: &GimbalScene) -> [Interval; 3] {
    let least = scene.gimbal.radii_m()[0];
    let [height, pitch, roll] = scene.target.bounds().map(|[lo, hi]| Interval { lo, hi });
    let radius = height.plus(Interval::exact(least));
    let across = radius.times(pitch.cos());
    [across.times(roll.sin()).times(Interval::exact(-1.0)), across.times(roll.cos()), radius.times(pitch.sin())]
}

/// Returns the words of lengths, clamped as the host clamps them. A millionth of a word covers the roundings.
fn words(range_m: Interval, length: Format) -> Span {
    let word = |length_m: f64, slack: f64| {
        (length_m / length.lsb() + slack).round().clamp(length.min() as f64, length.max() as f64) as i128
    };
    Span::new(word(range_m.lo, -1e-6), word(range_m.hi, 1e-6))
}

/// Returns the fractional derivative of any samples in a range, the samples before the reset being 0.
fn sheared(scene: &GimbalScene, instance: &Instance, samples: Span, gain: Span) -> Affine {
    let config = scene.method.config.shear();
    let samples = samples.hull(Span::exact(0));
    let weights = instance.model.roms().into_iter().flat_map(|rom| rom.words);
    let sum = weights.map(|weight| samples.times(Span::exact(weight.into()))).reduce(Span::plus);
    let narrowing = Narrowing {
        from_frac: config.input.frac() + config.coef_frac.cast_signed() + config.gain.frac(),
        to: config.output,
        rounding: Rounding::NearestUp,
        overflow: Overflow::Saturate,
    };
    let derivative = Affine::given(sum.expect("weights")) * Affine::given(gain);
    // The distance to the derivative with weights in real numbers is not known.
    derivative.narrow(&narrowing).with(|known, _| Word { exact: None, ..known })
}

/// Reads the inverse kinematics: its joints stay within their clamps. The CORDIC's angle is at either side of 0.
fn keep(walk: &mut Walk, instance: &Instance, config: &GimbalConfig) {
    let limit = i128::from(config.limit);
    let tilt = Span::new(-limit, limit);
    // 0 until the first target.
    let radius = Span::new(0, config.reach().1.into());
    let full = (1 << (config.angle_width - 1)) - 1;
    let kept = [
        ("rise", tilt),
        ("side", tilt),
        ("pitch", tilt),
        ("roll", tilt),
        ("shown", radius),
        ("radius", radius),
        ("crank", Span::new(0, full)),
    ];
    let registers = instance.model.equations().map(|edge| edge.registers).unwrap_or_default();
    let is_angle = |register: &&Register| register.instance.is_some() && register.name == "angle";
    let angle = registers.iter().find(is_angle).expect("the CORDIC's angle");
    walk.keep(instance, &kept, (angle, &[Span::new(-full - 1, -1), Span::new(0, full)]));
}

/// Returns the greatest distance of pitch, roll and radius to those of the target in real numbers, in words of each,
/// for targets within the reach.
///
/// [`GimbalInverse::bound`] is the distance of the tip. It holds the error of the radius, and either error of an angle
/// times the greatest radius.
fn joint_errors(config: &GimbalConfig) -> Result<[f64; 3], ConfigError> {
    let bound_m = GimbalInverse::new(*config)?.bound();
    let radius = bound_m / config.length.lsb();
    let angle = radius / f64::from(config.reach().1) / PI * f64::from(1u32 << (config.angle_width - 1));
    // One part in 2^40 covers the roundings.
    Ok([angle, angle, radius].map(|error| error * (1.0 + 2f64.powi(-40))))
}

/// Reads the switch. An offset passes its errors from sample to sample, so its drive has no known error.
fn switch(walk: &mut Walk, instance: &Instance) {
    let registers = instance.model.equations().map(|edge| edge.registers).unwrap_or_default();
    let keeps_drive = registers.iter().any(|register| register.name == "offset");
    let kept = registers.iter().filter(|register| keeps_drive && ["drive", "offset"].contains(&register.name));
    let any = |register: &Register| Affine::put(|symbols| symbols.wrapped(register.format));
    let stated: Vec<_> = kept.map(|register| (register.name, any(register))).collect();
    walk.read_stated(instance, &stated);
}

/// Returns a word with its distance to the same law in real numbers, at most `off` words.
fn within(word: Affine, off: f64) -> Affine {
    let fine = 20;
    let most = (off * f64::from(1 << fine)).ceil() as i128;
    word.with(|known, symbols| symbols.replaced(known.span, Some((Span::new(-most, most), fine)), true))
}

/// Returns the remarks about nets of which something stays open.
fn remarks(has_shear: bool) -> Vec<(&'static str, String)> {
    let mut all = vec![
        ("crank", "no error is proved: the angle is ill-conditioned at the dead centres"),
        ("rest", "0 until the first target"),
    ];
    if has_shear {
        all.push(("shear_x", "the sum of the weights' products for any samples within the target's bounds"));
        let beyond = "no error is proved: the derivative may lead beyond the reach";
        all.extend(["pitch", "roll", "rest"].map(|name| (name, beyond)));
    }
    all.into_iter().map(|(name, said)| (name, said.to_string())).collect()
}

/// Returns the travel of the joints, and the radii that the crank reaches.
fn limits(scene: &GimbalScene) -> Vec<Limit> {
    let limit = |name, unit, [min, max]: [f64; 2]| Limit { name, unit, min, max, why: TRAVEL.into() };
    let tilt = [-Gimbal::TILT_RAD, Gimbal::TILT_RAD];
    vec![
        limit("pitch", "rad", tilt),
        limit("roll", "rad", tilt),
        limit("crank", "rad", [0.0, PI]),
        limit("radius", "m", scene.gimbal.radii_m()),
    ]
}

#[cfg(test)]
mod tests {
    use hpu_datapath::Wiring;
    use hpu_datapath::gimbal::GimbalLoop;

    use super::*;

    /// Returns the range of a net of the default loop, if its inverse kinematics keep to the clamps of a configuration.
    fn kept(config: &GimbalConfig, name: &str) -> Option<(i128, i128)> {
        let wiring = GimbalLoop::default();
        let (nets, instances) = (wiring.nets(), wiring.instances());
        let inverse = instances.iter().find(|instance| instance.label == "inverse").expect("the kinematics");
        Affine::on_a_sheet(|| {
            let mut walk = Walk { nets: vec![None; nets.len()], moved: &|_| None };
            keep(&mut walk, inverse, config);
            let Span { min, max } = walk.nets[nets.iter().position(|net| net.name == name)?]?.known().span;
            Some((min, max))
        })
    }

    #[test]
    fn a_step_shows_the_clamps_and_refutes_narrower_ones() {
        let config = GimbalConfig::default();
        assert_eq!(kept(&config, "pitch"), Some((-160_199, 160_199)));
        assert_eq!(kept(&config, "crank"), Some((0, (1 << 19) - 1)));
        assert_eq!(kept(&config, "rest"), Some((0, 243_270 + 52_429)));
        assert_eq!(kept(&GimbalConfig { limit: config.limit - 1, ..config }, "pitch"), None);
        assert_eq!(kept(&GimbalConfig { rod: config.rod - 1, ..config }, "rest"), None);
    }
}
