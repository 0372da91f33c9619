//! Reads the tree of a scene into its parts: every key, its default, its range.

use std::sync::Arc;

use hpu_plant::Bridge;
use hpu_signal::Clock;

use crate::axis::Scene;
use crate::axis::file::log;
use crate::axis::network;
use crate::axis::network::Compound;
use crate::axis::parts::{Device, Encoder, Hand, Ramp, Wall};
use crate::axis::read_device::{Kind, amplifier, bridge, device, encoder};
use crate::axis::read_hand::{Load, Recorded, hand, path};
use crate::axis::read_method::{PWM_FREQUENCY, method};
use crate::axis::read_model::{agree_on_model, model, model_of_network};
use crate::axis::rows as keys;
use crate::faults::read::{Pins, agree_on_faults, faults};
use crate::head::expect::{Expect, Metric, expect};
use crate::head::model::{BridgeModel, Datapath, EncoderModel};
use crate::head::{Own, about, clock};
use crate::method::pid::pid;
use crate::method::{FOLLOWS, LOOPS, LawMethod, Loop, SCALED, WALLED};
use crate::path::{AxisTarget, Sine};
use crate::schema::quantity::Axis;
use crate::schema::quoted;
use crate::schema::section::Section;
use crate::schema::source::{SceneError, Source};
use crate::text::message::{number, number_above, number_below};

/// The head of a scene of an axis.
const OWN: Own =
    Own { kind: "axis", plant_rate: &keys::record::plant_rate, expect: axis_expect, outputs: &keys::accuracy::outputs };

/// The reason why a scene of an axis without a method is refused.
const NO_METHOD: &str = "\
    missing; write a [method] of hpu's own blocks or a [dut] of yours; a motor's scene without both is for a logic \
    outside of hpu, which opens the plant alone: hpu_open of libhpu, or hpu.Plant in Python";

/// Reads a scene of a motor or a mass.
pub(crate) fn scene(file: &str, source: &Source, kind: Kind, load: Load) -> Result<Scene, SceneError> {
    let root = Section::root(source);
    if root.has("pwm") {
        let asked = root.section("pwm").is_ok_and(|pwm| pwm.has("frequency"));
        return Err(root.unknown("pwm", if asked { PWM_FREQUENCY } else { "the PWM's keys stand in [method.pwm]" }));
    }
    let follows = follows(&root);
    root.accept(&["axis", kind.name(), if follows { FOLLOWS[0] } else { WALLED[0] }])?;
    if !root.has("method") {
        return Err(root.error("method", NO_METHOD));
    }
    if let Kind::Network = kind {
        return scene_of_network((file, kind), source, &root, load);
    }
    let about = about(&root)?;
    let (device, axis) = device(&root.section("device")?, kind)?;
    let root = root.along(axis);
    let count = || Ok(encoder(&root.section("encoder")?, kind, true)?.count_rad());
    let (hand, recorded) = hand(&root.section("hand")?, &[], load, &count)?;
    imposed(&root.section("device")?, &hand)?;
    let clock = clock(&root.section("clock")?)?;
    let model = model(&root.section("model")?, &device)?;
    let words = model.datapath != Datapath::Linear;
    let (encoder, amplifier) = (encoder(&root.section("encoder")?, kind, words)?, amplifier(&root, &device, words)?);
    let bridge = bridge(&root.section("bridge")?)?;
    let method = method(&root.section("method")?, &[])?;
    let (wall, target) = if follows { followed(&root)? } else { (wall(&root.section("wall")?)?, None) };
    let refused = (!words).then_some("the linear law has model.delay; write that instead");
    let host_clocks = host(&root, clock, Some(method.sample_rate_hz), (kind, refused))?;
    let mut parts = Scene {
        device,
        encoder,
        amplifier,
        bridge,
        method,
        wall,
        target: target.map(Arc::new),
        hand,
        faults: faults(&root, clock)?,
        model,
        network: None,
        host_clocks,
        head: OWN.head(file, source, &root, (about, clock))?,
    };
    parts.recording = recorded.map(|recorded| recorded.check(&parts)).transpose()?;
    parts.parameters = source.parameters.take(&unused(&parts)).into();
    agree(&parts)?;
    Ok(parts)
}

/// Reads a scene of a network.
fn scene_of_network(
    (file, kind): (&str, Kind),
    source: &Source,
    root: &Section,
    load: Load,
) -> Result<Scene, SceneError> {
    let about = about(root)?;
    let clock = clock(&root.section("clock")?)?;
    let Built { device, compound, encoder, bridge, hand, recorded, seen, at_wall } = built(root, clock, load)?;
    let (outside, ratio, follows) = (&root.alike(at_wall), compound.wall_ratio, follows(root));
    let (wall, target) = if follows { followed(outside)? } else { (wall(&outside.section("wall")?)?, None) };
    let (wall, target) = (wall.in_units_of(ratio), target.map(|target| Arc::new(target.in_units_of(ratio))));
    let root = &Section::root(source).along(seen);
    let mut model = model_of_network(&root.section("model")?)?;
    if compound.dac.is_some() {
        // There are no gates to switch.
        if root.section("model")?.has(keys::model_bridge::bridge.name) {
            return Err(root.error("model.bridge", "the drive is no bridge; leave this out"));
        }
        model.bridge = BridgeModel::Averaged;
    }
    let mut method = method(&if follows { outside } else { root }.section("method")?, &["network"])?;
    if let Loop::Law(LawMethod::PositionPid(pid)) = &mut method.kind {
        *pid = pid.seen_by(ratio);
    }
    let late_clocks = host(root, clock, Some(method.sample_rate_hz), (kind, None))?;
    let host_clocks = if root.section("model")?.read(&keys::model_network::host)? { 0 } else { late_clocks };
    let mut parts = Scene {
        device,
        encoder,
        amplifier: None,
        bridge,
        method,
        host_clocks,
        wall,
        target,
        hand,
        faults: faults(root, clock)?,
        model,
        network: Some(compound),
        head: OWN.head(file, source, &Section::root(source).along(at_wall), (about, clock))?,
    };
    parts.recording = recorded.map(|recorded| recorded.check(&parts)).transpose()?;
    parts.parameters = source.parameters.take(&unused(&parts)).into();
    agree(&parts)?;
    Ok(parts)
}

/// A network with all that a scene has around it, whatever closes its loop.
pub(crate) struct Built {
    pub device: Device,
    pub compound: Arc<Compound>,
    pub encoder: Encoder,
    pub bridge: Bridge,
    pub hand: Hand,
    pub recorded: Option<Recorded>,
    /// The dimensions of the motion of the body with the encoder, and of that in whose units the wall is.
    pub seen: &'static Axis,
    pub at_wall: &'static Axis,
}

/// Reads a network with its encoder, bridge and hand.
pub(crate) fn built(root: &Section, clock: Clock, load: Load) -> Result<Built, SceneError> {
    if root.has("amplifier") {
        return Err(root.error("amplifier", "a network has its drive in device.drive; leave this out"));
    }
    let mut draft = network::draft(root, clock)?;
    draft.simplify(&root.section("model")?)?;
    let [seen, grip, at_wall] = draft.axes();
    let encoder = draft.encoder();
    let count = || Ok(encoder.count_rad());
    let (mut hand, recorded) = hand(&root.section("hand")?.along(grip), &["network"], load, &count)?;
    let bridge = bridge(&root.section("bridge")?)?;
    let (device, compound) = draft.finish(root, &mut hand, bridge, clock.frequency_hz() as f64)?;
    Ok(Built { device, compound, encoder, bridge, hand, recorded, seen, at_wall })
}

/// Reads the host before the actuator of a device of this kind, and returns the clocks by which its commands are late;
/// `refused` is the reason why there is none. A design has no rate at which it samples.
pub(crate) fn host(
    root: &Section,
    clock: Clock,
    sample_rate_hz: Option<f64>,
    (kind, refused): (Kind, Option<&str>),
) -> Result<u64, SceneError> {
    if refused.is_some() && !root.has("host") {
        return Ok(0);
    }
    let s = root.section("host")?;
    s.accept(&[kind.name()])?;
    let (late, latency_s) = (u64::from(s.read(&keys::host::late)?), s.read(&keys::host::latency)?);
    if latency_s > 1.0 {
        // Every command on its way is kept.
        return Err(s.error("latency", format!("{} s; accepted: a second at most", number(latency_s))));
    }
    if let Some(reason) = refused {
        return Err(root.error("host", reason));
    }
    let sample = match sample_rate_hz {
        Some(rate_hz) => clock.edges(1.0 / rate_hz),
        None if late > 0 => return Err(s.error("late", "samples are those of a [method]; write latency, a time")),
        None => 0,
    };
    Ok(late * sample + clock.edges(latency_s))
}

/// Returns the sections and keys that are read but that no run of the scene uses.
fn unused(scene: &Scene) -> Vec<&'static str> {
    let mut unused = vec!["about", "expect", "accuracy"];
    if matches!(scene.hand, Hand::Prescribed { .. }) {
        unused.extend(["device.initial_angle", "device.initial_position", "device.initial_speed"]);
    }
    if !scene.has_bridge() {
        unused.extend(["bridge", "model.bridge", "model.winding"]);
    }
    if scene.method.reference_rate_hz.is_none() && scene.method.kind.scale().is_none() {
        unused.push("method.scale_format");
    }
    unused.extend(scene.method.kind.unused());
    if scene.model.datapath != Datapath::Linear {
        unused.push("model.delay");
    }
    unused
}

/// Refuses a start that the hand would overrule; it is not silently ignored.
pub(crate) fn imposed(device: &Section, hand: &Hand) -> Result<(), SceneError> {
    let starts = [keys::motor::initial_angle.name, keys::mass::initial_position.name, keys::motor::initial_speed.name];
    match starts.into_iter().find(|key| device.has(key)) {
        Some(key) if matches!(hand, Hand::Prescribed { .. }) => {
            Err(device.error(key, "a prescribed hand imposes the motion from its first point on; leave this out"))
        }
        _ => Ok(()),
    }
}

/// Checks the conditions between the parts of a scene.
fn agree(scene: &Scene) -> Result<(), SceneError> {
    let linear = scene.model.datapath == Datapath::Linear;
    if let (Loop::Law(law), true) = (scene.method.kind, linear) {
        let reason = format!(
            "\"linear\" is the law of the hybrid and the conventional loop; {} runs with \"words\" or \"law\"",
            law.name()
        );
        return Err(scene.places.error("model.datapath", reason));
    }
    if scene.has_bridge() && scene.model.datapath == Datapath::Law && scene.model.bridge == BridgeModel::Switching {
        let reason = "\"law\" has no gates to switch a bridge with; write bridge = \"averaged\" beside it";
        return Err(scene.places.error("model.datapath", reason));
    }
    if let (Hand::Capture { .. }, true) = (&scene.hand, linear) {
        let reason =
            "\"capture\" feeds encoder lines, which the linear law does not read; write model.datapath = \"words\"";
        return Err(scene.places.error("hand.kind", reason));
    }
    if scene.model.delay_s > 0.0 && !linear {
        return Err(scene
            .places
            .error("model.delay", "only the linear law takes a delay; write datapath = \"linear\""));
    }
    if scene.method.settling > 0 && scene.model.datapath != Datapath::Words {
        let reason = "only words settle; write model.datapath = \"words\", or leave this out";
        return Err(scene.places.error("method.settling", reason));
    }
    agree_on_model(scene)?;
    if !linear {
        agree_on_speeds(scene)?;
    }
    if let Some(ramp) = &scene.wall.ramp {
        agree_on_ramp(scene, ramp)?;
    }
    if let (Some(name), Some(_)) = (scene.network.as_ref().and_then(|network| network.position()), &scene.faults) {
        let reason =
            format!("of a logic that counts an encoder's own lines, and this one reads {name}; leave this out");
        return Err(scene.places.error("faults", reason));
    }
    if let Some(faults) = &scene.faults {
        let model = &scene.model;
        let has_lines = model.datapath == Datapath::Words && model.encoder == EncoderModel::Quantised;
        if !has_lines || matches!(scene.hand, Hand::Capture { .. }) {
            let reason = "faults are those of an encoder's lines and a bridge's switches, which neither a recording \
                          nor a law without lines has; write model.datapath = \"words\" and \
                          model.encoder = \"quantised\"";
            return Err(scene.places.error("faults", reason));
        }
        let pins = Pins { lines: true, index: false, switches: scene.modulator_clocks().is_some() };
        agree_on_faults(&scene.places, faults, pins)?;
    }
    if let Some(shaper) = scene.amplifier.and_then(|amplifier| amplifier.shaper)
        && scene.clock.edges(shaper.hold_s) == 0
    {
        let reason = format!("less than half a clock; write at least {} s", number_above(scene.clock.period_s()));
        return Err(scene.places.error("amplifier.shaper.hold", reason));
    }
    if scene.target.is_some() {
        agree_on_target(scene)?;
    }
    scene.check_period()?;
    if linear {
        return Ok(());
    }
    scene.check_datapath(&scene.words()?)
}

/// The most counts that may pass in one clock edge: about a thousand times as many as a decoder follows, which is one.
const MOST_COUNTS_AN_EDGE: f64 = 1000.0;

/// Refuses speeds that pass too many counts in a clock edge to teach anything.
fn agree_on_speeds(scene: &Scene) -> Result<(), SceneError> {
    let (clock, count_rad, unit) = (scene.clock, scene.encoder.count_rad(), scene.device.units().position);
    let most = MOST_COUNTS_AN_EDGE * count_rad;
    let check = |key: &str, when: &dyn Fn() -> String, edges: f64, change: f64| {
        if change.abs() <= most * edges {
            return Ok(());
        }
        let reason = format!(
            "{}{} {unit}/s passes {} encoder counts in one clock edge; \
             accepted: {MOST_COUNTS_AN_EDGE} counts, which is {} {unit}/s",
            when(),
            number_below(change.abs() / (edges * clock.period_s())),
            number_below(change.abs() / count_rad / edges),
            number_below(most / clock.period_s()),
        );
        Err(scene.places.error(key, reason))
    };
    let start = match &scene.device {
        Device::Motor(motor) => motor.initial_speed_rad_per_s,
        Device::Mass(mass) => mass.initial_speed_m_per_s,
    };
    check("device.initial_speed", &String::new, 1.0, start * clock.period_s())?;
    let Hand::Prescribed { path } = &scene.hand else { return Ok(()) };
    for (pair, index) in path.windows(2).zip(1..) {
        let [from, to] = [pair[0].time_s, pair[1].time_s];
        let when = || format!("between {} s and {} s ", number(from), number(to));
        let edges = ((to - from) / clock.period_s()).max(1.0);
        check(&format!("hand.path[{index}]"), &when, edges, pair[1].angle_rad - pair[0].angle_rad)?;
    }
    Ok(())
}

/// Refuses expectations of a wall that is not there.
fn agree_on_target(scene: &Scene) -> Result<(), SceneError> {
    let of_a_wall = [Metric::PeakPenetration, Metric::ContactShare, Metric::SpringOverflowShare];
    match scene.expect.numbers.iter().find(|number| of_a_wall.contains(&number.metric)) {
        Some(number) => {
            let reason = "a method that follows a target has no wall; accepted: rms, final_angle, peak_angle, \
                          amplitude, frequency, peak_torque, encoder_edges";
            Err(scene.places.error(&format!("expect.{}", number.metric.name()), reason))
        }
        None => Ok(()),
    }
}

fn agree_on_ramp(scene: &Scene, ramp: &Ramp) -> Result<(), SceneError> {
    let refused = |key: &str, reason: String| Err(scene.places.error(key, reason));
    if scene.model.datapath == Datapath::Linear {
        return refused("wall.ramp", "the linear law has one wall; write model.datapath = \"words\"".into());
    }
    let method = scene.method.kind;
    if ramp.scale.is_some() && method.scale().is_none() {
        let reason = format!(
            "\"{}\" does not scale its force, {} does; write stiffness instead",
            method.name(),
            quoted(&SCALED[LOOPS.len()..])
        );
        return refused("wall.ramp.scale", reason);
    }
    if let Some(reason) = method.features().fixed_wall {
        return refused("wall.ramp", reason.into());
    }
    if scene.model.datapath == Datapath::Law && scene.wall.stiffness_nm_per_rad == 0.0 {
        let reason =
            "the law in floats takes a ramp as a share of the wall's stiffness, which is 0; write one above it";
        return refused("wall.ramp", reason.into());
    }
    if scene.clock.edges(ramp.to_s) <= scene.clock.edges(ramp.from_s) {
        let reason = format!("{} s is no clock after from, {} s", number(ramp.to_s), number(ramp.from_s));
        return refused("wall.ramp.to", reason);
    }
    Ok(())
}

/// Returns whether the scene's method follows a target.
fn follows(root: &Section) -> bool {
    let method = root.section("method");
    method.is_ok_and(|s| s.get("kind").and_then(|kind| kind.as_str()).is_some_and(|kind| FOLLOWS.contains(&kind)))
}

/// Reads the target of a method that follows one. Its gains stand in the place of those of a wall that is where the
/// target begins.
fn followed(root: &Section) -> Result<(Wall, Option<AxisTarget>), SceneError> {
    use keys::target as key;
    let (gains, s) = (root.section("method")?, root.section("target")?);
    s.accept(&["axis"])?;
    if !s.has(key::path.name) {
        return Err(s.error(key::path.name, format!("missing; write {}", keys::PATH)));
    }
    let path = path(&s)?.into_iter().map(|point| (point.time_s, point.angle_rad)).collect();
    let sine = match s.given(&key::amplitude)?.zip(s.given(&key::frequency)?) {
        Some((amplitude, frequency_hz)) => Some(Sine { amplitude, frequency_hz, from_s: s.read(&key::from)? }),
        None => None,
    };
    let target = AxisTarget { path, sine };
    let wall = Wall {
        position_rad: target.at(0.0),
        stiffness_nm_per_rad: gains.read(&pid::kp)?,
        damping_nm_s_per_rad: gains.read(&pid::kd)?,
        wraps: false,
        ramp: None,
    };
    Ok((wall, Some(target)))
}

fn wall(s: &Section) -> Result<Wall, SceneError> {
    s.accept(&["axis"])?;
    Ok(Wall {
        position_rad: s.read(&keys::wall::position)?,
        stiffness_nm_per_rad: s.read(&keys::wall_axis::stiffness)?,
        damping_nm_s_per_rad: s.read(&keys::wall_axis::damping)?,
        wraps: s.read(&keys::wall::wraps)?,
        ramp: if s.has("ramp") { Some(ramp(&s.section("ramp")?)?) } else { None },
    })
}

fn ramp(s: &Section) -> Result<Ramp, SceneError> {
    use keys::wall_ramp as key;
    s.accept(&[])?;
    let scale = s.given(&key::scale)?;
    Ok(Ramp {
        scale,
        stiffness_nm_per_rad: match scale {
            Some(_) => s.given(&key::stiffness)?,
            None => Some(s.read(&key::stiffness)?),
        },
        from_s: s.read(&key::from)?,
        to_s: s.read(&key::to)?,
    })
}

pub(crate) fn axis_expect(s: &Section) -> Result<Expect, SceneError> {
    use keys::expect as key;
    s.accept(&["axis"])?;
    let metrics = [
        (Metric::FinalAngle, &key::final_angle),
        (Metric::PeakAngle, &key::peak_angle),
        (Metric::PeakPenetration, &key::peak_penetration),
        (Metric::Amplitude, &key::amplitude),
        (Metric::Frequency, &key::frequency),
        (Metric::PeakTorque, &key::peak_torque),
        (Metric::SpringOverflowShare, &key::spring_overflow_share),
        (Metric::EncoderEdges, &key::encoder_edges),
        (Metric::ContactShare, &key::contact_share),
        (Metric::Rms, &key::rms),
    ];
    let recording = s.has(key::recording.name).then(|| log(&s.section(key::recording.name)?)).transpose()?;
    Ok(Expect { recording, ..expect(s, &metrics, &key::outcome)? })
}
