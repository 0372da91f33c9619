//! The rows of the keys are what the readers do: every row is accepted by its kinds and by no other, its default is the
//! value of a scene without the key, and its range ends where it says.
//!
//! The scenes are read by `Experiment::parse`; nothing here knows how a reader uses a row.

use std::collections::BTreeSet;

use hpu_scene::keys::{KeyRow, Otherwise, Sizes, Takes, markdown, rows};
use hpu_scene::{Experiment, Origin, ParameterValue};

/// A scene that is accepted: its text, the changes that make it, and the kinds that it is for rows of keys.
struct Base {
    text: String,
    set: Vec<(&'static str, &'static str)>,
    scene: &'static str,
    device: &'static str,
    method: &'static str,
    /// The kind of the hand, or of a gimbal's target.
    hand: &'static str,
}

const MOTOR: &str = "kind = 'motor'\nresistance = 2\ninductance = 1e-3\ntorque_constant = 0.02\nrotor_inertia = 1e-6";
const MASS: &str = "kind = 'mass'\nmass = 0.1\ndamping = 0\n[encoder]\nresolution = 1e-5\n\
                    [amplifier]\nfull_scale = 10\nshaper = { cutoff = 2.5 }";
const NETWORK: &str = "kind = 'network'\nbodies.rotor = { inertia = 1e-6 }\n\
                       drive = { kind = 'pi', on = 'rotor', torque_constant = 0.02, resistance = 2, inductance = 1e-3, \
                       bandwidth = 500, dac = { full_scale = 1 } }\n[encoder]\non = 'rotor'";
const PMSM: &str =
    "kind = 'pmsm'\npole_pairs = 7\nresistance = 2\ninductance = 1e-3\nflux_linkage = 5e-3\nrotor_inertia = 1e-6";
const SALIENT: &str = "kind = 'pmsm'\npole_pairs = 7\nresistance = 2\ninductance_d = 1e-3\ninductance_q = 2e-3\n\
                       torque_constant = 0.05\nrotor_inertia = 1e-6";
const METHOD: &str = "[method]\nkind = 'hybrid'\nsample_rate = '1 kHz'\n[wall]\nposition = 0.01\nstiffness = 0";
const FOLLOWS: &str = "[method]\nkind = 'pid'\nsample_rate = '1 kHz'\nkp = 0.1\n[target]\npath = [[0, 0]]";
const DUT: &str = "[dut]\nfiles = ['a.v']\ntop = 'a'\nclock = 'clk'\nreset = { port = 'rst' }\n\
                   ports = { a = 'encoder.a', o = 'DRIVE' }\n[wall]\nposition = 1";

const PADDLE: &str = "about = 'A.'\n[device]\nkind = 'network'\nbodies.rotor = { inertia = 1e-6 }\n\
                      drive = { kind = 'bridge', on = 'rotor', torque_constant = 0.02, resistance = 2, \
                      inductance = 1e-3 }\n\
                      sensors.amps = { kind = 'current', gain = 1, range = 2, bits = 12, rate = 1e5 }\n\
                      sensors.hall = { kind = 'absolute', on = 'rotor', bits = 12, rate = 1e4 }\n\
                      [encoder]\non = 'rotor'\n[clock]\nfrequency = '50 MHz'\n\
                      [method]\nkind = 'epfl_paddle'\ncurrent = 'amps'\ntarget = 0.1\nkp = 1e-3\n\
                      [hand]\nkind = 'none'\n[faults]\n[run]\nduration = 1\n";

const SENSED: &str = "sensors.a = { kind = 'current', winding = 'a', trigger = true, gain = 1, range = 2, bits = 12 }\n\
                      sensors.b = { kind = 'current', winding = 'b', trigger = true, gain = 1, range = 2, bits = 12 }";
const FOC: &str =
    "[method]\nkind = 'foc'\nsample_rate = '1 kHz'\ntorques = [0, 0]\n[wall]\nposition = 0.01\nstiffness = 0";

fn on_an_axis(device: &str, loops: &str) -> String {
    format!(
        "about = 'A.'\n[device]\n{device}\n[clock]\nfrequency = '50 MHz'\n{loops}\n[hand]\nkind = 'none'\n\
         [faults]\n[run]\nduration = 1\n"
    )
}

/// The least scene of every kind.
fn bases() -> Vec<Base> {
    let axis = |device, method, hand, set: &[(&'static str, &'static str)]| {
        let of = match device {
            "mass" => MASS,
            "network" => NETWORK,
            _ => MOTOR,
        };
        let text = on_an_axis(of, if method == "pid" { FOLLOWS } else { METHOD });
        let (scene, mut all) = ("axis", vec![("method.kind", method), ("hand.kind", hand)]);
        all.extend(set);
        Base { text, set: all, scene, device, method, hand }
    };
    let dut = |device, of: &str, drive: &str| {
        let text = on_an_axis(of, DUT).replace("'DRIVE'", drive);
        Base { text, set: vec![], scene: "dut", device, method: "", hand: "none" }
    };
    let legs = "'bridge.leg_a', q = 'bridge.leg_b', r = 'bridge.leg_c'";
    let phantom = |set: &[(&'static str, &'static str)]| {
        let text = "about = 'A.'\n[device]\nkind = 'phantom'\n[drop]\naxis = 'y'\n[platform]\nkind = 'FPGA-400'\n\
                    [clock]\nfrequency = '50 MHz'\n[room]\nstiffness = 1000\n[run]\nduration = 1\n";
        Base { text: text.into(), set: set.to_vec(), scene: "phantom", device: "phantom", method: "phantom", hand: "" }
    };
    let gimbal = |kind, set: &[(&'static str, &'static str)]| {
        let text = "about = 'A.'\n[device]\nkind = 'gimbal'\n[clock]\nfrequency = '50 MHz'\n[target]\n\
                    [finger]\npath = [[0, 0.02], [1, 0.021]]\n[shear]\norder = 1\nviscosity = 1\n[run]\nduration = 1\n";
        let set = [("target.kind", kind)].into_iter().chain(set.iter().copied()).collect();
        Base { text: text.into(), set, scene: "gimbal", device: "gimbal", method: "gimbal", hand: kind }
    };
    let transfer = |plant: &str| {
        let text = format!(
            "about = 'A.'\n[device]\nkind = 'transfer'\n{plant}\n[clock]\nfrequency = '1 MHz'\n[adc]\nrange = 2\n\
             rate = '1 kHz'\n[dac]\nfull_scale = 2\n[method]\nnumerator = [1]\n[run]\nduration = 1\n"
        );
        Base { text, set: vec![], scene: "transfer", device: "transfer", method: "transfer", hand: "" }
    };
    let paddle = Base {
        text: PADDLE.into(),
        set: vec![("method.position", "hall")],
        scene: "epfl_paddle",
        device: "network",
        method: "epfl_paddle",
        hand: "none",
    };
    let foc = |set: &[(&'static str, &'static str)]| {
        let text = on_an_axis(&format!("{PMSM}\n{SENSED}"), FOC);
        Base { text, set: set.to_vec(), scene: "foc", device: "pmsm", method: "foc", hand: "none" }
    };
    vec![
        foc(&[]),
        foc(&[("model.bridge", "averaged"), ("model.currents", "ideal")]),
        paddle,
        gimbal("path", &[("target.path", "[[0, 0.01, 0, 0]]")]),
        gimbal("sines", &[]),
        gimbal("random", &[]),
        transfer("poles = [-1]"),
        transfer("a = [[-1]]\nb = [1]\nc = [1]"),
        axis("motor", "hybrid", "none", &[]),
        axis("motor", "conventional", "none", &[("method.rescaled", "true"), ("method.reference_rate", "1000")]),
        axis("motor", "sampled_wall", "none", &[]),
        axis("motor", "sampled_wall", "none", &[("method.estimator", "filtered")]),
        axis("motor", "sampled_wall", "none", &[("method.estimator", "foaw")]),
        axis(
            "motor",
            "sampled_wall",
            "none",
            &[("method.estimator", "filtered"), ("method.velocity_filter.corner", "30")],
        ),
        axis("motor", "virtual_coupling", "none", &[("method.coupling_stiffness", "1")]),
        axis("motor", "passivity_controller", "none", &[]),
        axis("motor", "energy_bounding", "none", &[("method.c1", "1")]),
        axis("motor", "passive_spring", "none", &[]),
        axis("motor", "braking_pulse", "none", &[]),
        axis("motor", "table", "none", &[("method.torques", "[0, 0]")]),
        axis("motor", "pid", "none", &[]),
        axis(
            "motor",
            "pid",
            "none",
            &[("method.anti_windup", "back_calculation"), ("target.amplitude", "0.1"), ("target.frequency", "1")],
        ),
        axis("mass", "pid", "none", &[("method.kp", "1e4")]),
        axis("motor", "hybrid", "none", &[("model.datapath", "linear")]),
        axis("motor", "hybrid", "constant_torque", &[("hand.torque", "0")]),
        axis(
            "motor",
            "hybrid",
            "spring_damper",
            &[("hand.stiffness", "1"), ("hand.damping", "0"), ("hand.path", "[[0, 0]]")],
        ),
        axis("motor", "hybrid", "prescribed", &[("hand.path", "[[0, 0]]")]),
        axis(
            "motor",
            "hybrid",
            "prescribed",
            &[("hand.file", "{ path = \"a.csv\", to = 2 }"), ("expect.recording.file", "a.csv")],
        ),
        axis(
            "motor",
            "hybrid",
            "capture",
            &[("hand.file", "{ path = \"a.vcd\", to = 2 }"), ("hand.channel_a", "a"), ("hand.channel_b", "b")],
        ),
        axis(
            "motor",
            "hybrid",
            "none",
            &[
                ("faults.doubled_edge", "1"),
                ("faults.bounce", "1"),
                ("faults.glitch", "1"),
                ("faults.swapped", "true"),
                ("faults.inverted", "encoder.a"),
                ("faults.stuck_switch", "bridge.plus_high"),
            ],
        ),
        axis("mass", "hybrid", "none", &[]),
        axis("network", "hybrid", "none", &[]),
        dut("motor", MOTOR, "'bridge.pwm', d = 'bridge.direction'"),
        dut("pmsm", PMSM, legs),
        dut("pmsm", SALIENT, legs),
        dut("mass", MASS, "{ is = 'amplifier.force', format = '(1,0,11)' }"),
        phantom(&[]),
        phantom(&[("platform.kind", "PMOS-1")]),
        phantom(&[("platform.kind", "RTOS-1")]),
        phantom(&[("model.transmission_stiffness", "3500")]),
    ]
}

type Set<'a> = Vec<(&'a str, String)>;

impl Base {
    fn read(&self, more: &Set) -> Result<Experiment, String> {
        let set: Vec<_> = self.set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
        let more = more.iter().map(|(key, value)| (key.to_string(), value.clone()));
        let set: Vec<_> = set.into_iter().chain(more).collect();
        // Faults are no part of a recording or of the linear law.
        let is_plain = self.hand == "capture" || self.set.contains(&("model.datapath", "linear"));
        let text = if is_plain { self.text.replace("[faults]\n", "") } else { self.text.clone() };
        let mut load = |name: &str| {
            Ok(if name.ends_with(".vcd") {
                b"$timescale 1 us $end\n$var wire 1 ! a $end\n$var wire 1 \" b $end\n$enddefinitions $end\n#0 0! 0\"\n"
                    .to_vec()
            } else {
                b"time_s,angle_rad\n0,0\n".to_vec()
            })
        };
        Experiment::parse("x.toml", &text, &set, &mut load).map_err(|error| error.to_string())
    }

    /// The kinds that this scene is for the rows of a section.
    fn kinds(&self, section: &str) -> Vec<&'static str> {
        match section {
            "device" | "encoder" | "host" => vec![self.device],
            "method" => vec![self.method, self.device],
            "hand" => vec![self.hand, self.device],
            "hand.file" => vec![self.hand],
            "target" if self.scene == "gimbal" => vec![self.hand],
            "" if self.scene == "axis" => {
                vec![self.scene, self.device, if self.method == "pid" { "pid" } else { "hybrid" }]
            }
            "model" if self.scene == "axis" => vec![self.scene, self.device],
            _ => vec![self.scene],
        }
    }

    fn takes(&self, row: &KeyRow) -> bool {
        let kinds = self.kinds(row.section);
        row.kinds.is_empty() || row.kinds.iter().any(|kind| kinds.contains(kind))
    }

    /// Whether the rows say that this scene takes a key of a section, with the sections that hold it.
    fn should_take(&self, section: &str, key: &str) -> bool {
        let is_row = rows().any(|row| (row.section, row.key) == (section, key) && self.takes(&row));
        let (above, name) = section.rsplit_once('.').unwrap_or(("", section));
        is_row && (section.is_empty() || self.should_take(above, name))
    }
}

fn path(section: &str, key: &str) -> String {
    if section.is_empty() { key.to_string() } else { format!("{section}.{key}") }
}

/// Whether a name of the table stands for any name.
fn is_any(name: &str) -> bool {
    name.split('.').any(|part| !part.is_empty() && part.chars().all(char::is_uppercase))
}

fn is_named(row: &KeyRow) -> bool {
    !is_any(row.key) && !is_any(row.section)
}

/// Refusals of a key by a kind that does not take it, in words of their own.
const OWN_WORDS: [&str; 4] = [
    "a mass has no winding",
    "a mass has a force amplifier and no bridge; leave this out",
    "has no place for a shaper",
    "a scene has a [method] of hpu's own blocks or a [dut] of yours",
];

#[test]
fn every_key_is_accepted_by_its_kinds_and_by_no_other() {
    let keys: BTreeSet<_> = rows().filter(is_named).map(|row| (row.section, row.key)).collect();
    let (mut accepted, mut tried) = (BTreeSet::new(), 0);
    for base in bases() {
        base.read(&vec![]).unwrap_or_else(|error| panic!("{:?}: {error}", base.set));
        for &(section, key) in keys.iter().filter(|(_, key)| *key != "kind") {
            // A [dut] would make another kind of scene of it.
            if base.scene == "axis" && path(section, key).starts_with("dut") {
                continue;
            }
            let name = path(section, key);
            // Without its method the target has no reader.
            if base.method == "pid" && name == "method" {
                continue;
            }
            let said = base.read(&vec![(&name, "1".into())]).err().unwrap_or_default();
            let is_refused = said.contains("unknown key") || OWN_WORDS.iter().any(|words| said.contains(words));
            let should = base.should_take(section, key);
            assert_eq!(!is_refused, should, "{name} in {} {:?}: {said}", base.scene, base.set);
            tried += 1;
            if should {
                accepted.insert((section, key));
            }
        }
    }
    let all: BTreeSet<_> = keys.into_iter().filter(|(_, key)| *key != "kind").collect();
    assert_eq!(accepted, all, "a key that no scene takes");
    assert!(tried > 2000, "{tried}");
}

#[test]
fn every_default_is_the_value_of_a_scene_without_the_key() {
    let mut held = BTreeSet::new();
    for base in bases() {
        let scene = base.read(&vec![]).unwrap_or_else(|error| panic!("{:?}: {error}", base.set));
        for row in rows().filter(|row| is_named(row) && base.takes(row)) {
            let Otherwise::Is(default) = &row.otherwise else { continue };
            let name = path(row.section, row.key);
            let found = scene.parameters.iter().find(|parameter| parameter.key == name);
            let found = found.filter(|parameter| parameter.origin == Origin::Default).map(|found| found.value.clone());
            // The error allowed between models, and the shift of a log, are no parameters of a run.
            let other = match &*name {
                "accuracy.within" => Some(ParameterValue::Number(scene.accuracy.within)),
                "expect.recording.shift" => {
                    scene.expect.recording.as_ref().map(|log| ParameterValue::Integer(log.shift.into()))
                }
                _ => None,
            };
            if let Some(found) = found.or(other) {
                assert_eq!(found, *default, "{name} in {} {:?}", base.scene, base.set);
                held.insert((row.section, row.key, row.kinds));
            }
        }
    }
    let has_default = |row: &KeyRow| is_named(row) && matches!(row.otherwise, Otherwise::Is(_));
    let all: BTreeSet<_> = rows().filter(has_default).map(|row| (row.section, row.key, row.kinds)).collect();
    let missing: Vec<_> = all.difference(&held).filter(|(_, key, _)| *key != "offset_binary").collect();
    assert!(missing.is_empty(), "defaults that no scene shows: {missing:?}");
    assert!(held.len() > 80, "{}", held.len());
}

/// Keys that are read only beside another.
const BESIDE: [(&str, &str, &str); 21] = [
    ("method.back_shift", "method.anti_windup", "back_calculation"),
    ("target.amplitude", "target.frequency", "1"),
    ("target.frequency", "target.amplitude", "0.1"),
    ("target.from", "target.amplitude", "0.1"),
    ("target.from", "target.frequency", "1"),
    ("method.filter_shift", "method.estimator", "filtered"),
    ("method.velocity_filter", "method.estimator", "filtered"),
    ("method.velocity_filter.order", "method.velocity_filter.corner", "30"),
    ("expect.recording", "expect.recording.file", "a.csv"),
    ("method.window", "method.estimator", "window"),
    ("method.noise", "method.estimator", "foaw"),
    ("method.acceleration", "method.estimator", "levant"),
    ("method.reference_rate", "method.rescaled", "true"),
    ("model.step", "model.solver", "rk4"),
    ("model.friction_speed", "model.friction", "smoothed"),
    ("model.transmission_damping", "model.transmission_stiffness", "3500"),
    ("model.motor_share", "model.transmission_stiffness", "3500"),
    ("platform.jitter", "platform.kind", "PMOS-1"),
    ("platform.missed", "platform.kind", "PMOS-1"),
    ("method.c2", "method.c1", "1e6"),
    ("wall.ramp", "wall.ramp", "{ stiffness = 1, from = 0, to = 1 }"),
];

/// Returns the reason for which a scene refuses a value of a key; `None` if it accepts the value.
fn said(base: &Base, row: &KeyRow, value: &str) -> Option<String> {
    let name = path(row.section, row.key);
    let mut set: Set = Vec::new();
    for (of, key, with) in BESIDE {
        if name == of || row.section == of {
            set.push((key, with.into()));
        }
    }
    // A detail of a fault belongs to that fault.
    if row.section == "faults" {
        let faults = [
            ("doubled", "faults.doubled_edge", "1"),
            ("bounce", "faults.bounce", "1"),
            ("glitch", "faults.glitch", "1"),
            ("swapped", "faults.swapped", "true"),
            ("inverted", "faults.inverted", "encoder.a"),
            ("stuck", "faults.stuck_switch", "bridge.plus_high"),
        ];
        let of = faults.into_iter().filter(|(stem, fault, _)| row.key.starts_with(stem) && name != *fault);
        set.extend(of.map(|(_, fault, with)| (fault, with.to_string())));
    }
    let full = if matches!(row.takes, Takes::Expected(_)) {
        format!("{{ value = {value}, tolerance = 0 }}")
    } else {
        value.into()
    };
    set.push((&name, full));
    let error = base.read(&set).err()?;
    let reason = error.split_once(&format!(": {name}")).map_or(error.as_str(), |(_, reason)| reason);
    Some(reason.to_string())
}

/// Whether a scene reads the key: a prescribed hand overrules a start, a mass has no bridge and a motor no amplifier,
/// the drive of this network is neither and it takes no steps, a hand with a path has no file, and a velocity that is
/// not rescaled has no scale, a filter by its corner takes no keys of others, another method has no target, a plant
/// is written in one way, as are inductances and magnets of three phases, and ideal currents alone have a delay.
fn reads(base: &Base, row: &KeyRow) -> bool {
    let written_otherwise = ["inductance", "inductance_d", "inductance_q", "flux_linkage", "torque_constant"];
    let is_overruled = base.hand == "prescribed" && row.key.starts_with("initial_")
        || base.method == "hybrid" && row.key == "scale_format"
        || ["filter_shift", "window", "noise", "acceleration"].contains(&row.key)
            && base.set.iter().any(|(key, _)| key.starts_with("method.velocity_filter"))
        || row.section == "hand.file" && base.set.iter().all(|(key, _)| *key != "hand.file")
        || base.scene == "epfl_paddle" && row.section.starts_with("device.drive")
        || ["mass", "network"].contains(&base.device) && row.section == "bridge"
        || ["motor", "network", "pmsm"].contains(&base.device) && row.section.starts_with("amplifier")
        || base.device == "network" && row.section == "model" && ["step", "friction_speed"].contains(&row.key)
        || base.device == "pmsm" && (row.key == "friction_speed" || row.key.starts_with("stuck"))
        || base.device == "pmsm"
            && written_otherwise.contains(&row.key)
            && !base.text.contains(&format!("{} =", row.key))
        || row.section == "device" && row.key == "gain" && !base.text.contains("poles")
        || row.section == "device" && row.key == "d" && !base.text.contains("c = [1]")
        || base.scene == "foc" && base.set.is_empty() && row.key == "current_delay"
        || base.method == "pid" && (row.section, row.key) == ("method", "kind");
    base.takes(row) && base.should_take(row.section, row.key) && !is_overruled
}

/// A refusal without the value: the words after its last colon.
fn words(reason: &str) -> &str {
    reason.rsplit_once(": ").map_or(reason, |(_, words)| words)
}

#[test]
fn every_range_ends_where_its_row_says() {
    let mut ends = 0;
    let all = bases();
    for row in rows().filter(is_named) {
        for base in all.iter().filter(|base| reads(base, &row)) {
            let (inside, outside): (Vec<String>, Vec<String>) = match &row.takes {
                Takes::Quantity(sizes) | Takes::Expected(sizes) if !sizes.is_empty() => {
                    edges(if base.device == "mass" { sizes[sizes.len() - 1] } else { sizes[0] })
                }
                Takes::Whole { least, most, .. } => {
                    let below = least.checked_sub(1).map(|below| below.to_string());
                    let above = (*most < i64::MAX as u64).then(|| (most + 1).to_string());
                    (
                        vec![least.to_string(), most.to_string()],
                        below.into_iter().chain(above).chain(["-1".into()]).collect(),
                    )
                }
                Takes::Choice(names) => {
                    (names.iter().map(ToString::to_string).collect(), vec!["zzz".into(), "1.5".into()])
                }
                Takes::Flag => (vec!["true".into(), "false".into()], vec!["1".into(), "yes".into()]),
                Takes::Format => (
                    vec!["(0,2,0)".into(), "(0,0,32)".into()],
                    vec!["(1,2,0)".into(), "(0,1,0)".into(), "(0,1,32)".into()],
                ),
                _ => continue,
            };
            let told =
                |value: &String| format!("{} = {value} in {} {:?}", path(row.section, row.key), base.scene, base.set);
            let refused: Vec<_> = outside
                .iter()
                .map(|value| said(base, &row, value).unwrap_or_else(|| panic!("{} is accepted", told(value))))
                .collect();
            for value in &inside {
                let said = said(base, &row, value).unwrap_or_default();
                let is_range = refused.iter().any(|refused| words(refused) == words(&said));
                let signs = ["must be above zero", "must not be negative", "is none of", "is not a", "is not true"];
                assert!(!is_range && !signs.iter().any(|words| said.contains(words)), "{}: {said}", told(value));
                ends += 1;
            }
        }
    }
    assert!(ends > 1000, "{ends}");
}

/// Values at the ends of a range, and beside them.
fn edges(sizes: Sizes) -> (Vec<String>, Vec<String>) {
    let (mut inside, mut outside) = (vec![sizes.least, sizes.most], vec![sizes.most * (1.0 + 1e-9)]);
    if sizes.least > 0.0 {
        outside.extend([sizes.least * (1.0 - 1e-9), -sizes.least]);
    } else {
        outside.push(sizes.least * (1.0 + 1e-9));
    }
    if sizes.zero {
        inside.push(0.0)
    } else {
        outside.push(0.0)
    }
    let written = |values: Vec<f64>| values.into_iter().map(|value| format!("{value:e}")).collect();
    (written(inside), written(outside))
}

#[test]
fn every_key_that_a_scene_gives_is_read() {
    // A key that is accepted but that no reader reads would be ignored.
    for base in bases() {
        for row in rows().filter(|row| is_named(row) && reads(&base, row)) {
            let value = match &row.takes {
                Takes::Quantity(_) | Takes::Expected(_) | Takes::Whole { .. } | Takes::Flag | Takes::Format => "[]",
                Takes::Choice(_) | Takes::Text(_) | Takes::Names(_) => "1.5",
                Takes::Section | Takes::Own(..) => continue,
            };
            let said = said(&base, &row, value);
            assert!(
                said.is_some(),
                "{} = {value} is accepted in {} {:?}",
                path(row.section, row.key),
                base.scene,
                base.set
            );
        }
    }
}

#[test]
fn the_table_of_the_documentation_is_made_of_the_rows() {
    let committed = include_str!("../../src/keys.md");
    assert!(committed == markdown(), "stale: hpu keys --markdown > crates/scene/src/keys.md");
}

#[test]
fn every_meaning_is_a_sentence() {
    for row in rows() {
        let KeyRow { section, key, meaning, .. } = &row;
        assert!(meaning.ends_with('.') && !meaning.contains("  "), "{section}.{key}: {meaning}");
        assert!(meaning.starts_with(|letter: char| letter.is_uppercase()), "{section}.{key}: {meaning}");
    }
}
