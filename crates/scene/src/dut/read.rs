//! Reading a scene with a design of the user's own.

use std::sync::Arc;

use hpu_plant::Bridge;
use hpu_signal::{Clock, Format};
use toml_edit::{Array, Item, TableLike, Value};

use crate::axis::network::Compound;
use crate::axis::parts::{Amplifier, Device, Encoder, Hand};
use crate::axis::read::{axis_expect, built, host, imposed};
use crate::axis::read_device::{Kind, agree_on_dead_band, amplifier, bridge, device, encoder};
use crate::axis::read_hand::{Load, Recorded, hand};
use crate::axis::read_model::friction;
use crate::axis::sensors::Sensor;
use crate::dut::beside::beside;
use crate::dut::rows as keys;
use crate::dut::{
    Connected, Connection, Driving, Dut, DutClock, DutReset, DutScene, Engine, Generic, Line, Part, Registers,
    SensorPin, SourceFile,
};
use crate::faults::read::{Pins, agree_on_faults, faults};
use crate::head::model::{BridgeModel, Datapath, EncoderModel, Friction, Model, Solver, Winding};
use crate::head::{Own, about, clock};
use crate::pmsm::{Built, Pmsm};
use crate::schema::identifier::{Identifier, Language};
use crate::schema::parameter::{Origin, ParameterValue};
use crate::schema::quantity::{Axis, SHAFT};
use crate::schema::section::{Section, shown};
use crate::schema::source::{SceneError, Source};
use crate::schema::{Key, Read, Text};
use crate::text::kept::kept;
use crate::text::message::{did_you_mean, excerpt};

/// The head of a scene with a design of the user's own.
const OWN: Own =
    Own { kind: "dut", plant_rate: &keys::record::plant_rate, expect: axis_expect, outputs: &keys::accuracy::outputs };

/// Reads a scene with a design, or one of a plant alone.
pub(crate) fn scene(file: &str, source: &Source, kind: Kind, load: Load) -> Result<DutScene, SceneError> {
    let root = Section::root(source);
    if root.has("method") {
        let reason = "a scene has a [method] of hpu's own blocks or a [dut] of yours; leave one out";
        return Err(root.error("method", reason));
    }
    let is_alone = !root.has("dut");
    root.accept(if let Kind::Network = kind { &["dut", "network"] } else { &["dut"] })?;
    let about = about(&root)?;
    let found = around(&root, kind, load)?;
    let pmsm = found.pmsm.clone();
    let Around {
        device, clock, amplifier, encoder, bridge, hand, recorded, network, host_clocks, seen, at_wall, ..
    } = found;
    let root = root.along(seen);
    if let Hand::Capture { .. } = hand {
        return Err(root.error("hand.kind", "a recording has no device to drive; write \"prescribed\""));
    }
    let wall = root.section("wall")?.along(at_wall);
    wall.accept(&["dut"])?;
    let of_network = network.as_ref().map(|network| &network.sensors);
    let sensors = of_network.or(pmsm.as_ref().map(|pmsm| &pmsm.sensors)).map_or(&[][..], |sensors| sensors);
    let around = network.as_ref().or(pmsm.as_ref().map(|pmsm| &pmsm.around));
    let wall_ratio = around.map_or(1.0, |around| around.wall_ratio);
    let mut scene = DutScene {
        device,
        encoder,
        amplifier,
        bridge,
        host_clocks,
        dut: if is_alone { Dut::pins() } else { dut(&root.section("dut")?, sensors, load)? },
        wall_rad: if root.has("wall") { Some(wall.read(&keys::wall::position)? / wall_ratio) } else { None },
        network,
        pmsm,
        wraps: wall.read(&keys::wall::wraps)?,
        varies: if is_alone { unvaried(&wall)? } else { varies(&wall)? },
        hand,
        faults: faults(&root, clock)?,
        model: model(&root.section("model")?)?,
        head: OWN.head(file, source, &root, (about, clock))?,
    };
    scene.auto = false;
    let driving = scene.driving()?;
    agree_on_drive(&scene, driving)?;
    if let Some(faults) = &scene.faults {
        let has = |line: Line| scene.dut.lines().any(|connected| connected == line);
        agree_on_faults(
            &scene.places,
            faults,
            Pins {
                lines: has(Line::A) || has(Line::B),
                index: has(Line::Index),
                switches: matches!(driving, Driving::Gates | Driving::Legs | Driving::PulseAndDirection),
            },
        )?;
    }
    let of_wall = scene.dut.ports.iter().find(|connected| connected.connection == Connection::Wall);
    if let (Some(of_wall), None) = (of_wall, scene.wall_rad) {
        return Err(scene.error(&of_wall.path(), "the scene has no wall; write [wall] with its position"));
    }
    if driving == Driving::Duty {
        scene.model.bridge = BridgeModel::Averaged;
    }
    agree_on_dead_band(&scene, &scene.bridge, scene.model.bridge)?;
    if scene.dut.lines().any(|line| line == Line::Index) && matches!(scene.device, Device::Mass(_)) {
        return Err(scene.error("dut.ports", "the encoder of a mass has no index; leave encoder.index out"));
    }
    scene.recording = recorded.map(|recorded| recorded.check(&scene)).transpose()?;
    scene.parameters = source.parameters.take(&["about", "expect", "accuracy"]).into();
    Ok(scene)
}

/// The device of a design, with what moves it and what drives it.
struct Around {
    device: Device,
    clock: Clock,
    amplifier: Option<Amplifier>,
    encoder: Encoder,
    bridge: Bridge,
    hand: Hand,
    recorded: Option<Recorded>,
    network: Option<Arc<Compound>>,
    pmsm: Option<Arc<Pmsm>>,
    host_clocks: u64,
    /// The dimensions of the motion of the encoder's body, and of that in whose units the wall is.
    seen: &'static Axis,
    at_wall: &'static Axis,
}

/// Reads the device of a design, with its hand, its encoder and its actuator.
fn around(root: &Section, kind: Kind, load: Load) -> Result<Around, SceneError> {
    let clock = || clock(&root.section("clock")?);
    if let Kind::Network = kind {
        let clock = clock()?;
        let found = built(root, clock, load)?;
        let crate::axis::read::Built { device, compound, encoder, bridge, hand, recorded, seen, at_wall } = found;
        let gates = "a host hands on commands, and this design drives the gates of a bridge; leave this out";
        let refused = compound.dac.is_none().then_some(gates);
        let host_clocks = host(root, clock, None, (Kind::Network, refused))?;
        let network = Some(compound);
        return Ok(Around {
            device,
            clock,
            amplifier: None,
            encoder,
            bridge,
            hand,
            recorded,
            network,
            pmsm: None,
            host_clocks,
            seen,
            at_wall,
        });
    }
    let clock = clock()?;
    if let Kind::Pmsm = kind {
        let Built { device, motor, encoder, bridge, hand, recorded, at_wall } = crate::pmsm::built(root, clock, load)?;
        let pmsm = Some(Arc::new(motor));
        return Ok(Around {
            device,
            clock,
            amplifier: None,
            encoder,
            bridge,
            hand,
            recorded,
            network: None,
            pmsm,
            host_clocks: 0,
            seen: &SHAFT,
            at_wall,
        });
    }
    let (device, axis) = device(&root.section("device")?, kind)?;
    let of = |key: &str| root.section(key).map(|section| section.along(axis));
    let encoder = || encoder(&of("encoder")?, kind, true);
    let count = || Ok(encoder()?.count_rad());
    let (hand, recorded) = hand(&of("hand")?, &[], load, &count)?;
    imposed(&of("device")?, &hand)?;
    Ok(Around {
        clock,
        encoder: encoder()?,
        amplifier: amplifier(root, &device, true)?,
        pmsm: None,
        device,
        bridge: bridge(&root.section("bridge")?)?,
        hand,
        recorded,
        network: None,
        host_clocks: 0,
        seen: axis,
        at_wall: axis,
    })
}

/// Refuses a way to drive that the device does not have.
fn agree_on_drive(scene: &DutScene, driving: Driving) -> Result<(), SceneError> {
    let refused = |reason: &str| Err(scene.error("dut.ports", reason));
    match (driving, scene.pmsm.is_some()) {
        (Driving::Nothing | Driving::SixGates | Driving::ThreeLegs, true) => {
            return match scene.model.friction {
                Friction::Smoothed { .. } => {
                    Err(scene.error("model.friction", "not of a pmsm; write \"stick_slip\", or leave this out"))
                }
                _ => Ok(()),
            };
        }
        (_, true) => {
            return refused(
                "a pmsm has a bridge with three legs; connect bridge.a_high, a_low and so on, or \
                            bridge.leg_a, leg_b and leg_c",
            );
        }
        (Driving::SixGates | Driving::ThreeLegs, false) => {
            return refused("the bridge has two legs, plus and minus; only that of a pmsm has a, b and c");
        }
        _ => {}
    }
    let has_converter = scene.network.as_ref().map(|network| network.dac.is_some());
    match (driving, has_converter, &scene.device) {
        (Driving::Nothing, ..) | (Driving::Current, Some(true), _) | (Driving::Force, None, Device::Mass(_)) => Ok(()),
        (_, Some(true), _) => refused("the network's drive follows a current and has no bridge; connect drive.current"),
        (Driving::Current | Driving::Force, Some(false), _) => {
            refused("the network hangs on a bridge; write bridge.duty")
        }
        (Driving::Current, None, _) => refused("only the drive of a network takes drive.current"),
        (Driving::Force, None, Device::Motor(_)) => {
            refused("a motor hangs on a bridge and has no amplifier.force; write bridge.duty")
        }
        (_, None, Device::Mass(_)) => refused("a mass has an amplifier and no bridge; connect amplifier.force"),
        _ => match scene.model.friction {
            Friction::Smoothed { .. } if scene.network.is_some() => {
                let reason = "not of a network; write \"stick_slip\", or leave this out";
                Err(scene.error("model.friction", reason))
            }
            _ => Ok(()),
        },
    }
}

/// Returns the key that `hpu limits` varies.
fn varies(s: &Section) -> Result<Option<String>, SceneError> {
    let key = &keys::wall_dut::varies;
    let Some(varied) = s.given(key)? else { return Ok(None) };
    let is_one = ["dut.ports.", "dut.generics.", "dut.parameters."].iter().any(|of| varied.starts_with(of));
    if is_one { Ok(Some(varied)) } else { Err(s.error(key.name, format!("`{varied}` is not {}", key.value.0))) }
}

/// Refuses the key of a plant alone, which has no design to vary.
fn unvaried(s: &Section) -> Result<Option<String>, SceneError> {
    match s.given(&keys::wall_dut::varies)? {
        Some(_) => {
            Err(s.error(keys::wall_dut::varies.name, "a scene without a [dut] has nothing to vary; leave this out"))
        }
        None => Ok(None),
    }
}

/// Reads the part of the device's physics that is modelled.
fn model(s: &Section) -> Result<Model, SceneError> {
    s.accept(&["dut"])?;
    Ok(Model {
        solver: Solver::Events,
        step_s: None,
        datapath: Datapath::Words,
        bridge: BridgeModel::Switching,
        winding: Winding::Inductive,
        friction: friction(s)?,
        encoder: EncoderModel::Quantised,
        delay_s: 0.0,
    })
}

fn dut(s: &Section, sensors: &[Sensor], load: Load) -> Result<Dut, SceneError> {
    use keys::dut as key;
    s.accept(&[])?;
    let (mut files, libraries) = files(s, load)?;
    let language = Language::of(&files);
    let mut generics = generics(s, language)?;
    let beside = beside(&mut files, &mut generics, load);
    let name = |key: &Key<Text>| -> Result<Identifier, SceneError> {
        let text = s.read(key)?;
        let refused =
            || s.error(key.name, format!("`{}` is not {}: {}", excerpt(&text), key.value.0, language.identifiers()));
        Identifier::unit(language, &text).ok_or_else(refused)
    };
    let dut = Dut {
        library: name(&key::library)?,
        libraries,
        top: name(&key::top)?,
        standard: s.read(&key::standard)?,
        engine: s.read(&key::engine)?,
        registers: s.read(&key::registers)?,
        clocks: clocks(s, language)?,
        reset: if s.has("reset") { Some(reset(&s.section("reset")?, language)?) } else { None },
        generics,
        ports: {
            let named = s.section("pins")?;
            ports(&s.section("ports")?, (&named, &pins(&named, language)?), (language, sensors))?
        },
        formats: formats(&s.section("formats")?)?,
        files,
        beside,
        floats: s.read(&key::off)?,
    };
    one_use(s, &dut)?;
    if dut.engine == Engine::Ghdl && dut.registers != Registers::Unknown {
        let reason = "in GHDL a register begins as VHDL says (U without an initial value); leave this out, or write \
                      engine = \"verilator\"";
        return Err(s.error(key::registers.name, reason));
    }
    Ok(dut)
}

/// Returns the port that the value of a key names.
fn port_of(s: &Section, key: &Key<Text>, language: Language) -> Result<Identifier, SceneError> {
    let text = s.read(key)?;
    Identifier::new(language, &text).ok_or_else(|| s.error(key.name, no_identifier(&text, language)))
}

/// Returns a key as the name of a clock or a generic.
fn named(s: &Section, key: &str, language: Language) -> Result<Identifier, SceneError> {
    Identifier::new(language, key).ok_or_else(|| s.key_error(key, no_identifier(key, language)))
}

fn no_identifier(text: &str, language: Language) -> String {
    format!("`{}` is no identifier: {}", excerpt(text), language.identifiers())
}

/// The files of a design, and the libraries of those that have one of their own, by the file's name.
type Files = (Vec<SourceFile>, Vec<(String, Identifier)>);

/// Reads the files, and the libraries of those that have one of their own.
fn files(s: &Section, load: Load) -> Result<Files, SceneError> {
    const WHAT: &str = keys::FILES;
    let array = s.get("files").and_then(Item::as_array);
    let Some(array) = array.filter(|array| !array.is_empty()) else {
        return Err(s.error("files", format!("missing; write {WHAT}")));
    };
    let (mut files, mut libraries): (Vec<SourceFile>, Vec<_>) = (Vec::new(), Vec::new());
    for (index, value) in array.iter().enumerate() {
        let key = format!("files[{index}]");
        let Some((name, library)) = file(value).filter(|(name, _)| !name.trim().is_empty()) else {
            return Err(s.error(&key, format!("write {WHAT}")));
        };
        if let Some(library) = library {
            let refused = || {
                let accepted = Language::Vhdl.identifiers();
                s.error(&key, format!("`{}` is no name of a VHDL library: {accepted}", excerpt(library)))
            };
            libraries.push((name.to_string(), Identifier::unit(Language::Vhdl, library).ok_or_else(refused)?));
        }
        let extension = name.rsplit_once('.').map(|(_, extension)| extension.to_ascii_lowercase()).unwrap_or_default();
        if !["vhd", "vhdl", "v", "sv", "vh", "svh"].contains(&&*extension) {
            let reason = format!("`{name}` is neither VHDL (.vhd, .vhdl) nor Verilog (.v, .sv, .vh, .svh)");
            return Err(s.error(&key, reason));
        }
        let base = |name: &str| name.rsplit('/').next().unwrap_or(name).to_string();
        if files.iter().any(|(other, _)| base(other) == base(name)) {
            return Err(s.error(&key, format!("a file of the name `{}` is there already", base(name))));
        }
        let bytes = load(name).map_err(|error| {
            s.error(&key, format!("cannot read `{name}` ({error}); write a path from the scene's folder"))
        })?;
        files.push((name.to_string(), bytes.into()));
    }
    let language = |file: &SourceFile| Language::of(std::slice::from_ref(file));
    if files.iter().any(|file| language(file) != language(&files[0])) {
        return Err(s.error("files", "VHDL and Verilog in one design; hpu takes either"));
    }
    if let (Language::Verilog, false) = (Language::of(&files), libraries.is_empty()) {
        return Err(s.error("files", "Verilog has no libraries; leave `library` out"));
    }
    let names: Vec<_> = files.iter().map(|(name, _)| name.as_str()).collect();
    s.note("files", ParameterValue::Text(names.join(", ")), "", Origin::Scene);
    Ok((files, libraries))
}

/// Returns a file's name, and its library if it is given: `"p.vhd"` or `{ file = "p.vhd", library = "mylib" }`.
fn file(value: &Value) -> Option<(&str, Option<&str>)> {
    if let Some(name) = value.as_str() {
        return Some((name, None));
    }
    let table = value.as_inline_table().filter(|table| table.len() == 2)?;
    Some((table.get("file")?.as_str()?, Some(table.get("library")?.as_str()?)))
}

/// Reads the clocks: `clock = "clk"`, or `[dut.clocks]` with each clock's number of cycles of the scene's clock.
fn clocks(s: &Section, language: Language) -> Result<Vec<DutClock>, SceneError> {
    let clock = &keys::dut::clock;
    match (s.has("clock"), s.has("clocks")) {
        (true, false) => Ok(vec![DutClock { port: port_of(s, clock, language)?, divide: 1 }]),
        (false, true) => {
            let all = s.section("clocks")?;
            let clocks = all.keys().map(|port| {
                let divide = keys::dut_clocks::PORT.value.read(&all, port)?;
                Ok(DutClock { port: named(&all, port, language)?, divide })
            });
            let clocks = clocks.collect::<Result<Vec<_>, SceneError>>()?;
            if !clocks.iter().any(|clock| clock.divide == 1) {
                let reason =
                    "no clock has 1: clock.frequency is that of the fastest one, the others are divided from it";
                return Err(s.error("clocks", reason));
            }
            Ok(clocks)
        }
        (false, false) => Err(s.error("clock", format!("no clock; write {}", clock.value.0))),
        (true, true) => Err(s.error("clocks", "clock and clocks are both there; leave one out")),
    }
}

fn reset(s: &Section, language: Language) -> Result<DutReset, SceneError> {
    s.accept(&[])?;
    Ok(DutReset {
        port: port_of(s, &keys::dut_reset::port, language)?,
        active_low: s.read(&keys::dut_reset::active)?,
        clocks: s.read(&keys::dut_reset::clocks)?,
    })
}

fn generics(s: &Section, language: Language) -> Result<Vec<(Identifier, Generic)>, SceneError> {
    let mut all = Vec::new();
    for key in ["generics", "parameters"] {
        let section = s.section(key)?;
        for name in section.keys() {
            let value = match section.get(name) {
                Some(Item::Value(Value::Integer(number))) => Generic::Integer(*number.value()),
                Some(Item::Value(Value::Boolean(flag))) => Generic::Flag(*flag.value()),
                Some(Item::Value(Value::Float(real))) if real.value().is_finite() => Generic::real(*real.value()),
                Some(Item::Value(Value::String(text))) => Generic::Text(text.value().clone()),
                other => {
                    let reason = format!(
                        "{} is no value of a generic; write a number, true, false or a text",
                        other.map_or_else(String::new, shown)
                    );
                    return Err(section.error(name, reason));
                }
            };
            if let (Generic::Text(text), Language::Vhdl) = (&value, language)
                && text.chars().any(char::is_control)
            {
                let reason = "a text of VHDL has no control character, such as a line's end; leave it out";
                return Err(section.error(name, reason));
            }
            section.note(name, ParameterValue::Text(value.to_string()), "", Origin::Scene);
            all.push((named(&section, name, language)?, value));
        }
    }
    Ok(all)
}

/// Reads the formats of signals. Whether the design has such signals is known once it is built.
fn formats(s: &Section) -> Result<Vec<(String, Format)>, SceneError> {
    let mut all = Vec::new();
    for name in s.keys() {
        let text = s.get(name).and_then(Item::as_str);
        let text = text.ok_or_else(|| s.error(name, format!("write {}", keys::FORMAT)))?;
        let format = text.parse::<Format>().map_err(|error| s.error(name, error.to_string()))?;
        s.note(name, ParameterValue::Text(format.to_string()), "", Origin::Scene);
        all.push((name.to_string(), format));
    }
    Ok(all)
}

/// A name of the scene's own for a port or a part of one.
struct Pin {
    name: String,
    port: String,
    part: Part,
}

fn pins(s: &Section, language: Language) -> Result<Vec<Pin>, SceneError> {
    let pin = |name: &str| {
        let text = s.get(name).and_then(Item::as_str).ok_or_else(|| s.error(name, format!("write {}", keys::PIN)))?;
        let refused = || s.error(name, format!("`{}` is no name of a port; write {}", excerpt(text), keys::PIN));
        let (port, part) = Part::of_name(language, text).ok_or_else(refused)?;
        s.note(name, ParameterValue::Text(text.to_string()), "", Origin::Scene);
        Ok(Pin { name: name.to_string(), port, part })
    };
    s.keys().map(pin).collect()
}

/// Reads the connections, by the names of ports and of pins. A pin without one has the line of its name.
fn ports(
    s: &Section,
    pins: (&Section, &[Pin]),
    (language, sensors): (Language, &[Sensor]),
) -> Result<Vec<Connected>, SceneError> {
    let mut all = Vec::new();
    for key in s.keys() {
        let pin = pins.1.iter().find(|pin| pin.name == key).map(|pin| (pin.port.clone(), pin.part));
        let named = pin.or_else(|| Part::of_name(language, key));
        let (port, part) = named.ok_or_else(|| s.key_error(key, no_identifier(key, language)))?;
        if let Some(list) = s.get(key).and_then(Item::as_array) {
            if part != Part::Whole {
                return Err(s.error(key, "a list is for all bits of a port; write the port's name without an index"));
            }
            all.extend(list_of_bits(s, key, (&port, sensors), list)?);
            continue;
        }
        let (connection, shown) = connection(s, key, sensors)?;
        s.note(key, ParameterValue::Text(shown), "", Origin::Scene);
        all.push(Connected { port, part, connection, key: key.to_string(), is_pin: false });
    }
    for Pin { name, port, part } in pins.1.iter().filter(|pin| !s.has(&pin.name)) {
        let Some(line) = Line::ALL.into_iter().find(|line| line.own_name() == name) else {
            let lines = Line::ALL.map(Line::own_name).join(", ");
            let reason = format!("connect `{name}` in [dut.ports], or call it as its line: {lines}");
            return Err(pins.0.error(name, reason));
        };
        let connection = Connection::Line(line, false);
        all.push(Connected { port: port.clone(), part: *part, connection, key: name.clone(), is_pin: true });
    }
    Ok(all)
}

/// Reads the connections of all bits of a port, from the left.
fn list_of_bits(
    s: &Section,
    key: &str,
    (port, sensors): (&str, &[Sensor]),
    list: &Array,
) -> Result<Vec<Connected>, SceneError> {
    let mut all = Vec::new();
    for (index, value) in list.iter().enumerate() {
        let key = format!("{key}[{index}]");
        let Some((connection, _)) = simple(s, &key, &Item::Value(value.clone()), sensors)? else {
            let reason = format!("{} is no connection of one bit", shown(&Item::Value(value.clone())));
            return Err(s.error(&key, reason));
        };
        let is_bit = matches!(connection, Connection::Constant(0 | 1) | Connection::Open);
        if !is_bit && connection.format() != Some(Format::BIT) {
            let reason = format!(
                "{} is not one bit; connect a part of the port, as in \"{port}(7 downto 0)\"",
                connection.name()
            );
            return Err(s.error(&key, reason));
        }
        all.push((connection, key));
    }
    let of = u32::try_from(all.len()).unwrap_or(u32::MAX);
    let names: Vec<_> = all.iter().map(|(connection, _)| connection.name()).collect();
    s.note(key, ParameterValue::Text(names.join(", ")), "", Origin::Scene);
    let connected = |((connection, key), before)| {
        let part = Part::InList { before, of };
        Connected { port: port.to_string(), part, connection, key, is_pin: false }
    };
    Ok(all.into_iter().zip(0..).map(connected).collect())
}

/// Returns the connection of a port, and the text that describes it among the parameters.
fn connection(s: &Section, port: &str, sensors: &[Sensor]) -> Result<(Connection, String), SceneError> {
    let item = s.get(port).expect("the key of a section");
    if let Some(simple) = simple(s, port, item, sensors)? {
        return Ok(simple);
    }
    if item.as_table_like().is_some_and(|table: &dyn TableLike| !table.is_empty()) {
        let own = s.section(port)?;
        own.accept_as("dut.ports.PORT", &[])?;
        let is = own.read(&keys::dut_port::is)?;
        let text = own.read(&keys::dut_port::format)?;
        let format: Format =
            text.parse().map_err(|error: hpu_signal::FormatError| own.error("format", error.to_string()))?;
        let offset = own.read(&keys::dut_port::offset_binary)?;
        if !(2..=32).contains(&format.width()) {
            return Err(own.error("format", format!("{format} has {} bits; accepted: 2 to 32", format.width())));
        }
        if offset && !format.is_signed() {
            return Err(own.error(
                "offset_binary",
                format!("{format} has no sign; offset binary is a signed word whose highest bit is inverted"),
            ));
        }
        let connection = match is.as_str() {
            "encoder.angle" if !offset => Connection::Angle(format),
            "bridge.duty" => Connection::Duty(format, offset),
            "amplifier.force" => Connection::Force(format, offset),
            "drive.current" => Connection::Current(format, offset),
            _ => return Err(own.error("is", format!("`{is}` has no format; {}", accepted()))),
        };
        let binary = if offset { ", offset binary" } else { "" };
        return Ok((connection, format!("{is} {format}{binary}")));
    }
    Err(s.error(port, format!("{} is nothing that a port can be; {}", shown(item), accepted())))
}

/// Returns the connection of a value without keys of its own, and the text that describes it; `None` for another value.
fn simple(
    s: &Section,
    port: &str,
    item: &Item,
    sensors: &[Sensor],
) -> Result<Option<(Connection, String)>, SceneError> {
    if let Some(number) = item.as_integer() {
        return Ok(Some((Connection::Constant(number), number.to_string())));
    }
    if let Some(flag) = item.as_bool() {
        return Ok(Some((Connection::Constant(flag.into()), flag.to_string())));
    }
    if let Some(text) = item.as_str() {
        let (text, inverted) = text.strip_prefix("not ").map_or((text, false), |rest| (rest, true));
        if let Some(line) = Line::ALL.into_iter().find(|line| line.name() == text.trim()) {
            let connection = Connection::Line(line, inverted);
            return Ok(Some((connection, connection.name())));
        }
        if let Some(pin) = text.trim().strip_prefix("sensor.") {
            let pin = sensor_pin(pin, inverted, sensors).map_err(|reason| s.error(port, reason))?;
            return Ok(Some((Connection::Sensor(pin), Connection::Sensor(pin).name())));
        }
        let connection = match (text.trim(), inverted) {
            ("encoder.count", false) => Connection::Count,
            ("wall.count", false) => Connection::Wall,
            ("open", false) => Connection::Open,
            (word @ ("encoder.angle" | "bridge.duty" | "amplifier.force" | "drive.current"), false) => {
                let reason = format!("{word} needs a format; write {{ is = \"{word}\", format = \"(1,0,11)\" }}");
                return Err(s.error(port, reason));
            }
            _ => return Err(s.error(port, format!("{} is nothing that a port can be; {}", shown(item), accepted()))),
        };
        return Ok(Some((connection, connection.name())));
    }
    Ok(None)
}

/// Returns the pin of a sensor by its name behind `sensor.`, or the reason why there is none.
fn sensor_pin(name: &str, inverted: bool, sensors: &[Sensor]) -> Result<SensorPin, String> {
    let pins = |(index, sensor): (usize, &Sensor)| {
        let given = sensor.pins().into_iter().zip(0..);
        let start = sensor.is_triggered().then_some((("start", Format::BIT), SensorPin::START));
        let lines = sensor.lines().iter().map(|line| (*line, Format::BIT)).zip(SensorPin::LINES..);
        let all = given.chain(start).chain(lines);
        all.map(|((pin, format), place)| (format!("{}.{pin}", sensor.name), index, place, format)).collect::<Vec<_>>()
    };
    let together = sensors.iter().any(Sensor::is_triggered);
    let together = together.then(|| ("start".to_string(), SensorPin::ALL, SensorPin::START, Format::BIT));
    let all: Vec<_> = sensors.iter().enumerate().flat_map(pins).chain(together).collect();
    let Some(&(_, sensor, pin, format)) = all.iter().find(|(it, ..)| it == name) else {
        let names: Vec<&str> = all.iter().map(|(name, ..)| name.as_str()).collect();
        let (near, there) = (did_you_mean(name, &names), names.join(", sensor."));
        return Err(match names[..] {
            [] => "the scene has no sensors; a network or a pmsm has them in device.sensors".to_string(),
            _ => format!("no pin \"{}\" of a sensor; there are sensor.{there}{near}", excerpt(name)),
        });
    };
    if inverted && format != Format::BIT {
        return Err(format!("sensor.{name} is a word, which \"not\" does not invert; leave \"not\" out"));
    }
    Ok(SensorPin { sensor, pin, inverted, format, name: kept(&format!("sensor.{name}")) })
}

/// Returns the accepted connections as a message lists them.
fn accepted() -> String {
    let lines: Vec<_> = Line::ALL.iter().map(|line| line.name()).collect();
    format!(
        "accepted: {}, each also after \"not \"; encoder.count, wall.count, open, a whole number; \
         {{ is = \"bridge.duty\", format = \"(1,0,11)\" }}, and so encoder.angle, amplifier.force and drive.current; \
         the pins of sensors, as in sensor.NAME.a",
        lines.join(", ")
    )
}

/// Checks that every port is named once, and that no line of the world has two drivers.
fn one_use(s: &Section, dut: &Dut) -> Result<(), SceneError> {
    let clocks = dut.clocks.iter().map(|clock| &clock.port);
    for port in clocks.chain(dut.reset.iter().map(|reset| &reset.port)) {
        if let Some(connected) = dut.ports.iter().find(|connected| connected.port == **port) {
            return Err(s.error(
                connected.path().trim_start_matches("dut."),
                "it is a clock or the reset already; leave it out here",
            ));
        }
    }
    let drivers = dut.ports.iter().enumerate().filter(|(_, connected)| connected.connection.drives());
    for (index, connected @ Connected { connection, key, .. }) in drivers {
        let same = |other: &Connection| match (other, connection) {
            (Connection::Line(one, _), Connection::Line(two, _)) => one == two,
            (Connection::Sensor(one), Connection::Sensor(two)) => {
                let is_of_all = [one.sensor, two.sensor].contains(&SensorPin::ALL);
                one.pin == two.pin && (one.sensor == two.sensor || is_of_all)
            }
            (one, two) => std::mem::discriminant(one) == std::mem::discriminant(two),
        };
        if let Some(other) = dut.ports[..index].iter().find(|other| same(&other.connection)) {
            let (one, name) = (&other.key, connection.name());
            let reason = format!("two drivers: `{one}` and `{key}` are both connected to {name}");
            return Err(s.error(connected.path().trim_start_matches("dut."), reason));
        }
    }
    Ok(())
}
