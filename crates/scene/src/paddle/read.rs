//! Reading a scene whose loop is that of EPFL's haptic paddle.

use crate::axis::network::Compound;
use crate::axis::network_rows::method_network;
use crate::axis::read::{Built, axis_expect, built};
use crate::axis::read_device::agree_on_dead_band;
use crate::axis::read_hand::Load;
use crate::axis::read_model::friction;
use crate::axis::sensors::{ENCODER, Reading, SensorKind, one_of};
use crate::faults::read::{Pins, agree_on_faults, faults};
use crate::head::model::Friction;
use crate::head::{Own, about, clock};
use crate::paddle::rows as keys;
use crate::paddle::rows::PADDLE;
use crate::paddle::{PaddleMethod, PaddleModel, PaddleScene};
use crate::schema::section::Section;
use crate::schema::source::{SceneError, Source};

/// The head of a scene of the paddle.
const OWN: Own =
    Own { kind: PADDLE, plant_rate: &keys::record::plant_rate, expect: axis_expect, outputs: &keys::accuracy::outputs };

/// Reads a scene of the paddle's loop around a network.
pub(crate) fn scene(file: &str, source: &Source, load: Load) -> Result<PaddleScene, SceneError> {
    let root = Section::root(source);
    root.accept(&[PADDLE])?;
    let about = about(&root)?;
    let clock = clock(&root.section("clock")?)?;
    let model = root.section("model")?;
    // A network would read keys of its own there.
    model.accept(&[PADDLE])?;
    let Built { device, compound, encoder, bridge, hand, recorded, seen, .. } = built(&root, clock, load)?;
    let root = root.along(seen);
    if compound.dac.is_some() {
        let reason = "the paddle's loop switches a bridge; write device.drive.kind = \"bridge\"";
        return Err(root.error("device.drive.kind", reason));
    }
    if seen.position.si != "rad" {
        return Err(root.error("encoder.on", "the paddle's angle is that of a body that turns; write another one"));
    }
    if recorded.is_some() {
        return Err(root.error("hand.file", "not read here; write path, a list of points"));
    }
    let friction = friction(&model)?;
    if matches!(friction, Friction::Smoothed { .. }) {
        return Err(model.error("friction", "not of a network; write \"stick_slip\", or leave this out"));
    }
    let method = method(&root.section("method")?, &compound)?;
    let mut scene = PaddleScene {
        device,
        encoder,
        bridge,
        hand,
        method,
        network: compound,
        faults: faults(&root, clock)?,
        model: PaddleModel {
            solver: model.read(&keys::model_paddle::solver)?,
            friction,
            bridge: model.read(&keys::model_paddle::bridge)?,
            in_floats: model.read(&keys::model_paddle::datapath)?,
        },
        head: OWN.head(file, source, &root, (about, clock))?,
    };
    if let Some(faults) = &scene.faults {
        agree_on_faults(&scene.places, faults, Pins { lines: true, index: false, switches: true })?;
    }
    agree_on_dead_band(&scene, &scene.bridge, scene.model.bridge)?;
    scene.parameters = source.parameters.take(&["about", "expect", "accuracy"]).into();
    scene.words()?;
    Ok(scene)
}

/// Reads the loop. Its sensors are those of the network.
fn method(s: &Section, compound: &Compound) -> Result<PaddleMethod, SceneError> {
    use keys::method_paddle as key;
    s.accept(&[PADDLE, "network"])?;
    s.read(&key::kind)?;
    let names: Vec<String> = compound.sensors.iter().map(|sensor| sensor.name.clone()).collect();
    let sampled = |index: usize| match &compound.sensors[index].kind {
        SensorKind::Sampled(sampled) => Some(sampled),
        _ => None,
    };
    let current = one_of(s, &key::current, "sensor", &names)?;
    if sampled(current).is_none_or(|it| it.reading != Reading::Current || it.offset_binary) {
        let reason = format!(
            "{} reads no current by words in two's complement; write a sensor of kind \"current\"",
            names[current]
        );
        return Err(s.error(key::current.name, reason));
    }
    let position = match s.given(&method_network::position)? {
        None => None,
        Some(name) if name == ENCODER => None,
        Some(_) => Some(one_of(s, &method_network::position, "sensor", &names)?),
    };
    if let Some(index) = position
        && sampled(index).is_none_or(|sampled| !matches!(sampled.reading, Reading::Position(_)))
    {
        let reason = format!("{} has no angle's words; write \"encoder\", or one of kind \"absolute\"", names[index]);
        return Err(s.error(method_network::position.name, reason));
    }
    if position.is_none() && s.has(key::code_angle.name) {
        return Err(s.error(key::code_angle.name, "the encoder has no codes; name an absolute sensor in position"));
    }
    Ok(PaddleMethod {
        current,
        position,
        target_rad: s.read(&key::target)?,
        target_from_s: s.read(&key::target_from)?,
        gains: [s.read(&key::kp)?, s.read(&key::ki)?, s.read(&key::kd)?],
        cutoff_hz: s.read(&key::cutoff)?,
        code_rad: if position.is_some() { s.read(&key::code_angle)? } else { 0.0 },
        reduction: s.read(&key::reduction)?,
        torque_constant_nm_per_a: s.read(&key::torque_constant)?,
        torque_limit_nm: s.read(&key::torque_limit)?,
        window: s.read(&key::codes)?,
        calibrated: s.read(&key::zero)?,
        current_share: s.read(&key::current_share)?,
        current_gains: [s.read(&key::current_proportional)?, s.read(&key::current_integral)?],
        integral_limit_v: s.read(&key::integral_limit)?,
        feed_forward_ohm: s.read(&key::feed_forward)?,
        duty_limit: s.read(&key::duty_limit)?,
        current_period_s: s.read(&key::current_period)?,
        haptic_period_s: s.read(&key::haptic_period)?,
    })
}
