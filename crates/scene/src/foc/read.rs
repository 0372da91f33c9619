//! Reading a scene whose loop is behind field-oriented control.

use std::sync::Arc;

use crate::axis::parts::Wall;
use crate::axis::read::axis_expect;
use crate::axis::read_device::agree_on_dead_band;
use crate::axis::read_hand::Load;
use crate::axis::read_model::friction;
use crate::axis::sensors::{ENCODER, Phase, Reading, Sampled, SensorKind, one_of};
use crate::faults::read::{Pins, agree_on_faults, faults};
use crate::foc::rows as keys;
use crate::foc::rows::FOC;
use crate::foc::{FocMethod, FocModel, FocScene};
use crate::head::model::{BridgeModel, Friction};
use crate::head::{Own, about, clock};
use crate::method::published::Published as _;
use crate::method::table::TableMethod;
use crate::pmsm::{Built, Pmsm, built};
use crate::schema::quantity::SHAFT;
use crate::schema::section::Section;
use crate::schema::source::{SceneError, Source};

/// The head of such a scene.
const OWN: Own =
    Own { kind: FOC, plant_rate: &keys::record::plant_rate, expect: axis_expect, outputs: &keys::accuracy::outputs };

/// The currents that the loop needs.
const CURRENTS: &str = "the loop reads the phases a and b; write in [device.sensors] two of kind \"current\" with \
                        trigger = true and the same bits, gain and range, one with winding = \"a\", one with \"b\"";

/// Reads a scene of a motor with three phases and a method.
pub(crate) fn scene(file: &str, source: &Source, load: Load) -> Result<FocScene, SceneError> {
    let root = Section::root(source).along(&SHAFT);
    root.accept(&[FOC])?;
    let about = about(&root)?;
    let clock = clock(&root.section("clock")?)?;
    let Built { device, motor, encoder, bridge, hand, recorded, at_wall } = built(&root, clock, load)?;
    let model = root.section("model")?;
    model.accept(&[FOC])?;
    let friction = friction(&model)?;
    if matches!(friction, Friction::Smoothed { .. }) {
        return Err(model.error("friction", "not of a pmsm; write \"stick_slip\", or leave this out"));
    }
    let method = method(&root.section("method")?, &motor)?;
    let ratio = motor.around.wall_ratio;
    let outside = root.alike(at_wall);
    let wall = if root.has("wall") { Some(wall(&outside.section("wall")?)?.in_units_of(ratio)) } else { None };
    if wall.is_none() && method.table.is_none() {
        return Err(root.error("wall", "missing; write a [wall], or a table in method.torques, or both"));
    }
    let mut scene = FocScene {
        device,
        pmsm: Arc::new(motor),
        encoder,
        bridge,
        hand,
        method,
        wall,
        faults: faults(&root, clock)?,
        model: FocModel {
            solver: model.read(&keys::model_foc::solver)?,
            friction,
            bridge: model.read(&keys::model_foc::bridge)?,
            ideal: model.read(&keys::model_foc::currents)?,
            delay_s: model.read(&keys::model_foc::current_delay)?,
            in_floats: model.read(&keys::model_foc::datapath)?,
        },
        head: OWN.head(file, source, &outside, (about, clock))?,
    };
    if let Some(faults) = &scene.faults {
        agree_on_faults(&scene.places, faults, Pins { lines: true, index: false, switches: false })?;
    }
    agree_on_dead_band(&scene, &scene.bridge, BridgeModel::Switching)?;
    agree_on_model(&scene)?;
    scene.recording = recorded.map(|recorded| recorded.check(&scene)).transpose()?;
    scene.parameters = source.parameters.take(&["about", "expect", "accuracy"]).into();
    scene.words()?;
    Ok(scene)
}

/// Refuses a switching bridge and keys of currents beside ideal ones, and a delay beside others.
fn agree_on_model(scene: &FocScene) -> Result<(), SceneError> {
    if !scene.model.ideal {
        return match scene.model.delay_s > 0.0 {
            true => Err(scene.error("model.current_delay", "only ideal currents have it; write currents = \"ideal\"")),
            false => Ok(()),
        };
    }
    let refused = |key: &str, reason: &str| Err(scene.error(key, reason));
    if scene.model.bridge == BridgeModel::Switching {
        return refused("model.currents", "\"ideal\" has no switching; write bridge = \"averaged\" beside it");
    }
    if scene.method.enable_after_s > 0.0 {
        return refused("model.currents", "\"ideal\" currents flow from the start; leave method.enable_after out");
    }
    Ok(())
}

/// Reads the wall.
fn wall(s: &Section) -> Result<Wall, SceneError> {
    s.accept(&[FOC])?;
    Ok(Wall {
        position_rad: s.read(&keys::wall::position)?,
        stiffness_nm_per_rad: s.read(&keys::wall_foc::stiffness)?,
        damping_nm_s_per_rad: s.read(&keys::wall_foc::damping)?,
        wraps: s.read(&keys::wall::wraps)?,
        ramp: None,
    })
}

/// Reads the loop. Its sensors are those of the motor.
fn method(s: &Section, motor: &Pmsm) -> Result<FocMethod, SceneError> {
    use keys::method_foc as key;
    s.accept(&[FOC, "pmsm"])?;
    s.read(&key::kind)?;
    let sampled = |index: usize| match &motor.sensors[index].kind {
        SensorKind::Sampled(sampled) => Some(sampled),
        _ => None,
    };
    let names: Vec<String> = motor.sensors.iter().map(|sensor| sensor.name.clone()).collect();
    let position = match s.given(&key::position)? {
        Some(name) if name != ENCODER => Some(one_of(s, &key::position, "sensor", &names)?),
        _ => None,
    };
    let is_angle = |it: &Sampled| matches!(it.reading, Reading::Position(_)) && it.chip.is_none() && !it.triggered;
    let position_bits = match position.map(|index| (&names[index], sampled(index).filter(|it| is_angle(it)))) {
        None => s.read(&key::position_bits)?,
        Some((name, None)) => {
            let reason = format!(
                "{name} gives no words of an angle at a rate of its own; write \"encoder\", or a sensor of kind \
                 \"absolute\" without chip and trigger"
            );
            return Err(s.error(key::position.name, reason));
        }
        Some(_) if s.has(key::position_bits.name) => {
            let reason = "the position is the sensor's word, which has its own bits; leave this out";
            return Err(s.error(key::position_bits.name, reason));
        }
        Some((_, Some(it))) => it.bits,
    };
    if !(4..=24).contains(&position_bits) {
        let reason = format!("a word of {position_bits} bits; accepted: 4 to 24");
        return Err(s.error(key::position.name, reason));
    }
    let of_phase = |leg: usize| {
        let is_it =
            |it: &Sampled| it.triggered && matches!(it.reading, Reading::Phase(Phase { leg: of, .. }) if of == leg);
        (0..names.len()).find(|&index| sampled(index).is_some_and(is_it))
    };
    let currents = match (of_phase(0), of_phase(1)) {
        (Some(a), Some(b)) => [a, b],
        _ => return Err(s.error(key::kind.name, CURRENTS)),
    };
    if let [Some(a), Some(b)] = currents.map(sampled) {
        let is_alike = (a.bits, a.scale, a.latency) == (b.bits, b.scale, b.latency);
        if !is_alike || a.offset_binary || b.offset_binary || a.scale < 0.0 || a.bits < 4 {
            let reason = "the currents of a and b need words alike, in two's complement, of 4 bits or more, with a \
                          gain above 0; write the same bits, gain, range and latency for both";
            return Err(s.error(key::kind.name, reason));
        }
    }
    if !s.has(key::torques.name) && s.has(key::spacing.name) {
        return Err(s.error(key::spacing.name, "there is no table; write torques beside it, or leave this out"));
    }
    Ok(FocMethod {
        sample_rate_hz: s.read(&key::sample_rate)?,
        position,
        position_bits,
        currents,
        table: if s.has(key::torques.name) { Some(TableMethod::read(s)?) } else { None },
        stiffness_format: s.read(&key::stiffness_format)?,
        damping_format: s.read(&key::damping_format)?,
        bandwidth_hz: s.read(&key::current_bandwidth)?,
        pwm_hz: s.read(&key::pwm_frequency)?,
        dead_time_s: s.read(&key::dead_time)?,
        min_pulse_s: s.read(&key::min_pulse)?,
        enable_after_s: s.read(&key::enable_after)?,
        zero_rad: s.read(&key::zero)?,
    })
}
