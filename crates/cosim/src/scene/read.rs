//! Reads the tree of a scene into its parts: every key, its default, its range.

use hpu_signal::Clock;

use super::accuracy::{Output, accuracy};
use super::expect::{Expect, Expectation, Metric, OutcomeKind};
use super::law::LawMethod;
use super::model::{BridgeModel, Datapath, EncoderModel};
use super::parts::{Device, Hand, Loop, Ramp, Record, Run, Wall};
use super::quantity as q;
use super::read_device::{Axis, amplifier, bridge, device, encoder};
use super::read_faults::{Pins, agree_on_faults, faults};
use super::read_hand::{Load, hand};
use super::read_method::{PWM_FREQUENCY, method};
use super::read_model::{agree_on_model, model};
use super::section::Section;
use super::section::Sense::{Any, NotNegative, Positive, Within};
use super::source::{SceneError, Source};
use super::{MOST_EDGES, Scene};
use crate::message::{number, number_above, number_below};
use crate::session::SessionError;

pub(super) fn scene(file: &str, source: Source, load: Load) -> Result<Scene, SceneError> {
    let root = source.root();
    if root.has("pwm") {
        let asked = root.section("pwm").is_ok_and(|pwm| pwm.has("frequency"));
        return Err(root.unknown("pwm", if asked { PWM_FREQUENCY } else { "the PWM's keys stand in [method.pwm]" }));
    }
    root.accept(&[
        "about",
        "device",
        "encoder",
        "bridge",
        "amplifier",
        "clock",
        "method",
        "wall",
        "hand",
        "faults",
        "model",
        "run",
        "record",
        "expect",
        "accuracy",
    ])?;
    let about = root.text("about", "a few sentences that say what to look for")?.trim().to_string();
    let (device, axis) = device(&root.section("device")?)?;
    let hand = hand(&root.section("hand")?, axis, load)?;
    imposed(&root.section("device")?, &hand)?;
    let clock = clock(&root.section("clock")?)?;
    let model = model(&root.section("model")?, &device)?;
    let words = model.datapath != Datapath::Linear;
    let mut parts = Scene {
        name: scene_name(file),
        about,
        device,
        encoder: encoder(&root.section("encoder")?, &device, words)?,
        amplifier: amplifier(&root, &device, words)?,
        bridge: bridge(&root.section("bridge")?)?,
        clock,
        method: method(&root.section("method")?, axis)?,
        wall: wall(&root.section("wall")?, axis)?,
        hand,
        faults: faults(&root, clock)?,
        model,
        run: run(&root.section("run")?, clock)?,
        record: record(&root.section("record")?, 10e3)?,
        expect: axis_expect(&root.section("expect")?, axis)?,
        accuracy: accuracy(&root.section("accuracy")?, &Output::OF_AN_AXIS)?,
        auto: source.auto,
        parameters: [].into(),
        places: source.places.clone(),
    };
    parts.parameters = source.parameters.take(&unused(&parts)).into();
    agree(&parts)?;
    Ok(parts)
}

pub(super) fn scene_name(file: &str) -> String {
    let name = file.rsplit(['/', '\\']).next().unwrap_or(file);
    name.strip_suffix(".toml").unwrap_or(name).to_string()
}

/// Returns the sections and keys that are read but that no run of the scene uses.
fn unused(scene: &Scene) -> Vec<&'static str> {
    let mut unused = vec!["about", "expect", "accuracy"];
    if matches!(scene.hand, Hand::Prescribed { .. }) {
        unused.extend(["device.initial_angle", "device.initial_position", "device.initial_speed"]);
    }
    if matches!(scene.device, Device::Mass(_)) {
        unused.extend(["bridge", "model.bridge", "model.winding"]);
    }
    let scaled = matches!(scene.method.kind, Loop::Law(LawMethod::PassiveSpring { .. }));
    if scene.method.reference_rate_hz.is_none() && !scaled {
        unused.push("method.scale_format");
    }
    if scene.model.datapath != Datapath::Linear {
        unused.push("model.delay");
    }
    unused
}

/// Refuses a start that the hand would overrule; it is not silently ignored.
pub(super) fn imposed(device: &Section, hand: &Hand) -> Result<(), SceneError> {
    let starts = ["initial_angle", "initial_position", "initial_speed"];
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
    if let (Device::Motor(_), Datapath::Law, BridgeModel::Switching) =
        (&scene.device, scene.model.datapath, scene.model.bridge)
    {
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
    if let Some(faults) = &scene.faults {
        let model = &scene.model;
        let has_lines = model.datapath == Datapath::Words && model.encoder == EncoderModel::Quantised;
        if !has_lines || matches!(scene.hand, Hand::Capture { .. }) {
            let reason = "faults are those of an encoder's lines and a bridge's switches, which neither a recording nor a law \
                          without lines has; write model.datapath = \"words\" and model.encoder = \"quantised\"";
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
    scene.check_period()?;
    if linear {
        return Ok(());
    }
    let words = scene.words()?;
    match crate::method::wiring(scene, &words) {
        Err(SessionError::Scene(error)) => Err(error),
        Err(error) => Err(scene.places.error("method.kind", error.to_string())),
        Ok(_) => Ok(()),
    }
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

fn agree_on_ramp(scene: &Scene, ramp: &Ramp) -> Result<(), SceneError> {
    let refused = |key: &str, reason: String| Err(scene.places.error(key, reason));
    if scene.model.datapath == Datapath::Linear {
        return refused("wall.ramp", "the linear law has one wall; write model.datapath = \"words\"".into());
    }
    match scene.method.kind {
        Loop::Law(LawMethod::PassiveSpring { .. }) => {}
        method if ramp.scale.is_some() => {
            let reason = format!(
                "\"{}\" does not scale its force, \"passive_spring\" does; write stiffness instead",
                method.name()
            );
            return refused("wall.ramp.scale", reason);
        }
        Loop::Law(LawMethod::VirtualCoupling { .. }) => {
            let reason =
                "behind a coupling the wall's stiffness is part of constants, which do not change; leave it out";
            return refused("wall.ramp", reason.into());
        }
        _ => {}
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

pub(super) fn clock(s: &Section) -> Result<Clock, SceneError> {
    s.accept(&["frequency"])?;
    let frequency_hz = s.quantity("frequency", &q::FREQUENCY, Within(1.0, 1e10), None)?;
    // Beyond u64 the cast saturates, and the clock refuses that too.
    let whole = if frequency_hz.fract() == 0.0 { frequency_hz as u64 } else { 0 };
    Clock::new(whole).map_err(|error| s.error("frequency", format!("{} Hz: {error}", number(frequency_hz))))
}

fn wall(s: &Section, axis: &Axis) -> Result<Wall, SceneError> {
    s.accept(&["position", "stiffness", "damping", "ramp"])?;
    Ok(Wall {
        position_rad: s.quantity("position", axis.position, Any, None)?,
        stiffness_nm_per_rad: s.quantity("stiffness", axis.stiffness, NotNegative, None)?,
        damping_nm_s_per_rad: s.quantity("damping", axis.damping, NotNegative, Some(0.0))?,
        ramp: if s.has("ramp") { Some(ramp(&s.section("ramp")?, axis)?) } else { None },
    })
}

fn ramp(s: &Section, axis: &Axis) -> Result<Ramp, SceneError> {
    s.accept(&["stiffness", "scale", "from", "to"])?;
    let given = |key, dimension| match s.has(key) {
        true => s.quantity(key, dimension, NotNegative, None).map(Some),
        false => Ok(None),
    };
    Ok(Ramp {
        scale: given("scale", &q::RATIO)?,
        stiffness_nm_per_rad: match s.has("scale") {
            true => given("stiffness", axis.stiffness)?,
            false => Some(s.quantity("stiffness", axis.stiffness, NotNegative, None)?),
        },
        from_s: s.quantity("from", &q::TIME, NotNegative, None)?,
        to_s: s.quantity("to", &q::TIME, Positive, None)?,
    })
}

pub(super) fn run(s: &Section, clock: Clock) -> Result<Run, SceneError> {
    s.accept(&["duration", "seed"])?;
    let duration_s = s.quantity("duration", &q::TIME, Positive, None)?;
    let edges = duration_s * clock.frequency_hz() as f64;
    if !(0.5..=MOST_EDGES as f64).contains(&edges) {
        let reason = format!("{} clock edges; a run has 1 to 2^62", number(edges));
        return Err(s.error("duration", reason));
    }
    Ok(Run { duration_s, seed: s.integer("seed", 0, i64::MAX as u64, Some(0))? })
}

pub(super) fn record(s: &Section, plant_rate_hz: f64) -> Result<Record, SceneError> {
    s.accept(&["plant_rate", "clock"])?;
    Ok(Record {
        plant_rate_hz: s.quantity("plant_rate", &q::FREQUENCY, Positive, Some(plant_rate_hz))?,
        clock: s.flag("clock", false)?,
    })
}

pub(super) fn axis_expect(s: &Section, axis: &Axis) -> Result<Expect, SceneError> {
    let names: Vec<&str> = std::iter::once("outcome").chain(Metric::OF_AN_AXIS.map(Metric::name)).collect();
    s.accept(&names)?;
    let outcomes = [
        ("settled", Some(OutcomeKind::Settled)),
        ("limit_cycle", Some(OutcomeKind::LimitCycle)),
        ("diverged", Some(OutcomeKind::Diverged)),
    ];
    let mut numbers = Vec::new();
    for metric in Metric::OF_AN_AXIS.into_iter().filter(|metric| s.has(metric.name())) {
        let dimension = match metric {
            Metric::FinalAngle | Metric::PeakAngle | Metric::PeakPenetration | Metric::Amplitude => axis.position,
            Metric::Frequency => &q::FREQUENCY,
            Metric::PeakTorque => axis.effort,
            Metric::SpringOverflowShare | Metric::EncoderEdges | Metric::ContactShare => &q::RATIO,
            Metric::Rms => unreachable!("not of an axis"),
        };
        let number = s.section(metric.name())?;
        number.accept(&["value", "tolerance"])?;
        numbers.push(Expectation {
            metric,
            value: number.quantity("value", dimension, Any, None)?,
            tolerance: number.quantity("tolerance", dimension, NotNegative, None)?,
        });
    }
    Ok(Expect { outcome: s.choice("outcome", &outcomes, Some(None))?, numbers })
}
