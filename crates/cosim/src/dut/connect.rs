//! The ports of a design and their connections: checked once; then inputs get words, and outputs drive the device.

use hpu_signal::{Format, Signal};

use super::{Design, Fault, Port};
use crate::world::EncoderState;
use crate::world::axis_encoder::AxisEncoder;
use hpu_scene::{
    Connected, Connection, Driving, DutScene, Layout, Line, MOST_SENSORS, Part, SceneError, Sensor, SensorPin,
    did_you_mean, kept,
};

/// A port with its connections.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Wire {
    /// The port.
    pub port: Port,
    /// The connections of its bits, none of which has two; bits without one are open.
    pieces: Vec<Piece>,
}

/// Bits of a port with one connection.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Piece {
    /// The number of bits to the right.
    shift: u32,
    width: u32,
    connection: Connection,
}

impl Wire {
    /// Returns whether any of its bits drives the device.
    pub fn drives(&self) -> bool {
        self.pieces.iter().any(|piece| piece.connection.drives())
    }

    /// Returns whether its words are numbers, by its type, by the scene or by its connection.
    pub fn is_quantity(&self) -> bool {
        let is_one =
            |connection: Connection| connection != Connection::Open && connection.format() != Some(Format::BIT);
        self.port.is_quantity || self.whole().is_some_and(is_one)
    }

    /// Returns the connection of the whole port, if it has one.
    fn whole(&self) -> Option<Connection> {
        match self.pieces[..] {
            [] => Some(Connection::Open),
            [piece] if piece.width == self.port.format.width() => Some(piece.connection),
            _ => None,
        }
    }

    /// Returns the format of its words.
    fn format(&self) -> Format {
        self.whole().and_then(Connection::format).unwrap_or(self.port.format)
    }

    /// Returns the names of the connections, from the left, with those of the bits, as in `[3:0]` or `.a`.
    pub fn connection(&self) -> String {
        if let Some(connection) = self.whole() {
            return connection.name();
        }
        let piece = |Piece { shift, width, connection }: &Piece| {
            format!("{} {}", self.port.layout.name(*shift, *width), connection.name())
        };
        self.pieces.iter().map(piece).collect::<Vec<_>>().join(", ")
    }
}

impl Piece {
    /// Returns the bits of a word of the port that are its own, as a word of a format of their width.
    fn of(self, word: i64, format: Format) -> i64 {
        format.from_bits((word >> self.shift).cast_unsigned() & (u64::MAX >> (64 - self.width)))
    }
}

/// All connections of a design, in the order of its ports without clocks and reset.
pub struct Wires {
    pub(super) wires: Vec<Wire>,
    /// The ports as nets, then a net that tells whether the wall is touched.
    pub(super) nets: Vec<Signal>,
    /// The indices of the inputs, and of the outputs that drive the device.
    pub(super) given: Vec<usize>,
    pub(super) outputs: Vec<usize>,
    driving: Driving,
    /// The lines of the way to drive: four or six gates, two or three legs, or pulse and direction.
    lines: [Option<Level>; 6],
    /// The pins by which the design starts samples and drives lines of chips, each with its bit of the command.
    starts: Vec<(usize, Level)>,
    enable: Option<Level>,
    /// The place among the outputs of the word that drives, its bits, its format, and whether it is offset binary.
    word: Option<(usize, Piece, Format, bool)>,
    floats: bool,
    /// Whether the device is a motor with three phases.
    has_phases: bool,
    /// The encoder with its wall.
    pub(crate) encoder: AxisEncoder,
    count_rad: f64,
}

/// The values that the world's sensors show: the encoder's, and the pins of the others.
pub(crate) type Sensed<'a> = (EncoderState, &'a [[i64; 3]]);

/// The place of a line's port among the outputs, the number of bits to the line's right, and whether it is inverted.
type Level = (usize, u32, bool);

/// Outputs that cannot drive the device: both switches of a leg are closed, or a bit is unknown.
#[derive(Debug)]
pub enum Misdriven {
    /// The name of the port with an unknown bit.
    Unknown(String),
    /// The leg whose switches are both closed.
    Short(&'static str),
}

impl Misdriven {
    /// Returns the message, with the clock edge and the time at which it happened.
    pub fn text(&self, edge: u64, at_s: f64) -> String {
        match self {
            Self::Unknown(port) => format!(
                "output `{port}` has an unknown bit (X, Z or U) at clock edge {edge} ({at_s:e} s), where it drives the \
                 device; let the reset or an initial value set it"
            ),
            Self::Short(leg) => format!(
                "both switches of the {leg} leg are closed at clock edge {edge} ({at_s:e} s), which shorts the supply; \
                 check dead time and polarity (\"not bridge.{leg}_low\")"
            ),
        }
    }
}

impl Wires {
    /// Returns the connections that the scene names, of a design that is not built. A port whose connection does not
    /// fix its format has a signed word of 64 bits.
    ///
    /// # Errors
    ///
    /// When the connections name no way to drive the device.
    pub fn of_scene(scene: &DutScene) -> Result<Self, SceneError> {
        let port = |connected: &Connected| {
            let connection = connected.connection;
            let format = connection.format().unwrap_or(Format::signed(64));
            // A part of a port, whose width nobody knows here, is a port of its own.
            Wire {
                port: Port {
                    name: connected.key.clone(),
                    is_input: connection.is_given(),
                    format,
                    is_inside: false,
                    is_number: false,
                    is_quantity: false,
                    layout: Layout::vector(format.width()),
                    default: None,
                },
                pieces: vec![Piece { shift: 0, width: format.width(), connection }],
            }
        };
        Self::of(scene, scene.dut.ports.iter().map(port).collect())
    }

    pub(super) fn new(scene: &DutScene, design: &dyn Design) -> Result<Self, Fault> {
        let dut = &scene.dut;
        let same = |one: &str, two: &str| {
            if design.ignores_case() { one.eq_ignore_ascii_case(two) } else { one == two }
        };
        let ports = formatted(scene, design, &same)?;
        let find = |key: &str, name: &str| -> Result<&Port, SceneError> {
            let outside = || ports.iter().filter(|port| !port.is_inside);
            outside().find(|port| same(&port.name, name)).ok_or_else(|| {
                let has = |of: Vec<&Port>| of.into_iter().map(shown).collect::<Vec<_>>().join(", ");
                let words: Vec<_> = outside().filter(|port| is_word_of(&port.name, name, &same)).collect();
                scene.error(
                    key,
                    match words[..] {
                        [] => format!("`{}` has no port `{name}`; it has {}", dut.top, has(outside().collect())),
                        _ => format!("port `{name}` is connected by its words: {}", has(words)),
                    },
                )
            })
        };
        let ignores_case = design.ignores_case();
        for clock in &dut.clocks {
            let key =
                if dut.clocks.len() == 1 { "dut.clock".to_string() } else { format!("dut.clocks.{}", clock.port) };
            line(scene, &key, find(&key, &clock.port)?)?;
        }
        if let Some(reset) = &dut.reset {
            line(scene, "dut.reset.port", find("dut.reset.port", &reset.port)?)?;
        }
        for connected in &dut.ports {
            let key = connected.path();
            let mut outside = ports.iter().filter(|port| !port.is_inside);
            // A port that no part is of has no such name.
            match outside.find(|port| connected.is_of(&port.name, ignores_case)) {
                Some(port) => check(scene, port, connected, ignores_case)?,
                None => drop(find(&key, &connected.port)?),
            }
        }
        let timing = dut.clocks.iter().map(|clock| &clock.port).chain(dut.reset.iter().map(|reset| &reset.port));
        let timing: Vec<_> = timing.collect();
        let mut wires = Vec::new();
        for port in ports.iter().filter(|port| !timing.iter().any(|name| same(name, &port.name))) {
            let own = dut.ports.iter().filter(|connected| connected.is_of(&port.name, ignores_case));
            let mut pieces = pieces(scene, port, own, ignores_case)?;
            if let ([], Some(word)) = (&pieces[..], port.default) {
                let connection = Connection::Constant(word);
                pieces.push(Piece { shift: 0, width: port.format.width(), connection });
            }
            let connected: u32 = pieces.iter().map(|piece| piece.width).sum();
            if port.is_input && connected < port.format.width() {
                let which = if pieces.is_empty() { "" } else { "not all bits of " };
                let is = if pieces.is_empty() { "is connected to nothing" } else { "are connected" };
                let reason = format!(
                    "{which}the input {} {is}; connect it to what the world gives (encoder.a, encoder.b, \
                     encoder.index, encoder.count, encoder.angle, wall.count) or to a whole number",
                    shown(port)
                );
                return Err(scene.error("dut.ports", reason).into());
            }
            wires.push(Wire { port: port.clone(), pieces });
        }
        Ok(Self::of(scene, wires)?)
    }

    fn of(scene: &DutScene, wires: Vec<Wire>) -> Result<Self, SceneError> {
        let net = |wire: &Wire| {
            let unit = match wire.whole() {
                Some(Connection::Count | Connection::Wall) => "count",
                Some(Connection::Angle(_)) => "rad",
                _ => "1",
            };
            let what = if wire.port.is_inside { "inside".to_string() } else { wire.connection() };
            Signal::new(kept(&wire.port.name), wire.format(), unit, kept(&what))
        };
        let mut nets: Vec<_> = wires.iter().map(net).collect();
        nets.push(Signal::bit("wall_contact", "The encoder's count is beyond the wall's"));
        let all = |is: fn(&Wire) -> bool| (0..wires.len()).filter(|&index| is(&wires[index])).collect::<Vec<_>>();
        let outputs = all(Wire::drives);
        let pieces = || {
            let of = |(place, &index): (usize, &usize)| wires[index].pieces.iter().map(move |piece| (place, *piece));
            outputs.iter().enumerate().flat_map(of)
        };
        let line = |wanted: Line| {
            pieces().find_map(|(place, piece)| match piece.connection {
                Connection::Line(line, inverted) if line == wanted => Some((place, piece.shift, inverted)),
                _ => None,
            })
        };
        let word = pieces().find_map(|(place, piece)| match piece.connection {
            Connection::Duty(format, offset)
            | Connection::Force(format, offset)
            | Connection::Current(format, offset) => Some((place, piece, format, offset)),
            _ => None,
        });
        let driving = scene.driving()?;
        Ok(Self {
            lines: {
                let all: &[Line] = match driving {
                    Driving::Gates => &[Line::MinusHigh, Line::MinusLow, Line::PlusHigh, Line::PlusLow],
                    Driving::Legs => &[Line::Minus, Line::Plus],
                    Driving::PulseAndDirection => &[Line::Pwm, Line::Direction],
                    Driving::SixGates => &[Line::AHigh, Line::ALow, Line::BHigh, Line::BLow, Line::CHigh, Line::CLow],
                    Driving::ThreeLegs => &[Line::LegA, Line::LegB, Line::LegC],
                    Driving::Duty | Driving::Force | Driving::Current | Driving::Nothing => &[],
                };
                std::array::from_fn(|place| all.get(place).copied().and_then(line))
            },
            starts: pieces()
                .flat_map(|(place, piece)| {
                    let Connection::Sensor(pin) = piece.connection else { return Vec::new() };
                    let level = (place, piece.shift, pin.inverted);
                    if pin.pin >= SensorPin::LINES {
                        let chips = scene.sensors()[..pin.sensor].iter().filter(|sensor| sensor.is_chip()).count();
                        return vec![(MOST_SENSORS + 3 * chips + pin.pin - SensorPin::LINES, level)];
                    }
                    let is_started = |(index, sensor): &(usize, &Sensor)| {
                        sensor.is_triggered() && [*index, SensorPin::ALL].contains(&pin.sensor)
                    };
                    let started = scene.sensors().iter().enumerate().filter(is_started);
                    started.map(|(index, _)| (index, level)).collect()
                })
                .collect(),
            enable: line(Line::Enable),
            word,
            driving,
            given: all(|wire| wire.port.is_input),
            outputs,
            wires,
            nets,
            floats: scene.dut.floats,
            has_phases: scene.pmsm.is_some(),
            encoder: AxisEncoder::new(scene.encoder, scene.wall_or_far_rad()),
            count_rad: scene.encoder.count_rad(),
        })
    }

    /// Returns the wires, in the order of the ports.
    pub fn wires(&self) -> &[Wire] {
        &self.wires
    }

    /// Returns the ports as signals, then one that tells whether the wall is touched.
    pub fn nets(&self) -> &[Signal] {
        &self.nets
    }

    /// Returns the wires of the inputs, which the world gives.
    pub(crate) fn given(&self) -> impl ExactSizeIterator<Item = &Wire> {
        self.given.iter().map(|&index| &self.wires[index])
    }

    /// Returns the wires of the outputs that drive the device.
    pub(crate) fn outputs(&self) -> impl ExactSizeIterator<Item = &Wire> {
        self.outputs.iter().map(|&index| &self.wires[index])
    }

    /// Returns the index of the narrowest port that takes the encoder's count, and the least and the greatest count
    /// from the start that it holds, as signed or as unsigned.
    pub(super) fn counter(&self) -> Option<(usize, [i64; 2])> {
        let pieces =
            |(index, wire): (usize, &Wire)| wire.pieces.iter().map(|piece| (index, *piece)).collect::<Vec<_>>();
        let all = self.wires.iter().enumerate().flat_map(pieces);
        let counters = all.filter(|(_, piece)| piece.connection == Connection::Count);
        let (index, piece) = counters.min_by_key(|(_, piece)| piece.width)?;
        let bits = piece.width.min(62);
        Some((index, [-(1 << (bits - 1)), (1 << bits) - 1]))
    }

    /// Returns the word of an input in a state of the sensors; 0 for an output. The encoder stood at the count `start`
    /// at the start.
    pub(crate) fn word(&self, wire: &Wire, (encoder, sensors): Sensed, start: i64) -> i64 {
        if let Some(connection) = wire.whole() {
            return self.given_word(connection, wire.format(), (encoder, sensors), start);
        }
        let bits = |piece: &Piece| {
            let format = piece.connection.format().unwrap_or(Format::unsigned(piece.width));
            format.bits(self.given_word(piece.connection, format, (encoder, sensors), start)) << piece.shift
        };
        wire.port.format.from_bits(wire.pieces.iter().map(bits).sum())
    }

    /// Returns the word of a connection that the world gives.
    fn given_word(&self, connection: Connection, format: Format, (encoder, sensors): Sensed, start: i64) -> i64 {
        match connection {
            Connection::Line(line, inverted) => {
                let level = match line {
                    Line::A => encoder.pins.a,
                    Line::B => encoder.pins.b,
                    _ => self.encoder.index(encoder),
                };
                level ^ i64::from(inverted)
            }
            Connection::Count => format.wrap((encoder.shown - start).into()),
            Connection::Wall => format.wrap((self.encoder.wall - start).into()),
            Connection::Angle(format) => {
                format.wrap((encoder.shown as f64 * self.count_rad / format.lsb()).round() as i128)
            }
            Connection::Constant(word) => format.wrap(word.into()),
            Connection::Sensor(SensorPin { sensor, pin, inverted, .. }) => sensors[sensor][pin] ^ i64::from(inverted),
            Connection::Duty(..) | Connection::Force(..) | Connection::Current(..) | Connection::Open => 0,
        }
    }

    /// Takes the words of the [`outputs`](Self::outputs) from the words of all ports; `None` is an unknown word.
    ///
    /// # Errors
    ///
    /// When one of them is unknown.
    pub(super) fn known(&self, words: &[Option<i64>], outputs: &mut [i64]) -> Result<(), Misdriven> {
        for (output, &index) in outputs.iter_mut().zip(&self.outputs) {
            *output = words[index].ok_or_else(|| Misdriven::Unknown(self.wires[index].port.name.clone()))?;
        }
        Ok(())
    }

    /// Returns the gates, in the order of a wiring's outputs, and the command that these words of the
    /// [`outputs`](Self::outputs) ask for.
    ///
    /// # Errors
    ///
    /// When both switches of a leg would be closed.
    pub(crate) fn drive(&self, words: &[i64]) -> Result<([i64; 4], i64), Misdriven> {
        let level = |(place, shift, inverted): Level| (words[place] >> shift & 1 != 0) != inverted;
        let lines @ [one, two, three, four, ..] = self.lines.map(|line| line.is_some_and(level));
        if self.has_phases {
            return Ok(([0; 4], self.three_legs(lines, level)?));
        }
        // The minus leg is the wiring's leg a.
        let mut gates = match self.driving {
            Driving::Gates if one && two => return Err(Misdriven::Short("minus")),
            Driving::Gates if three && four => return Err(Misdriven::Short("plus")),
            Driving::Gates => [one, two, three, four],
            Driving::Legs => [one, !one, two, !two],
            // Without a direction, a pulse drives in the positive one.
            Driving::PulseAndDirection => match (one, two || self.lines[1].is_none()) {
                (true, true) => [false, true, true, false],
                (true, false) => [true, false, false, true],
                (false, _) => [false, !self.floats, false, !self.floats],
            },
            Driving::SixGates | Driving::ThreeLegs => unreachable!("a bridge has three legs or two"),
            Driving::Duty | Driving::Force | Driving::Current | Driving::Nothing => [false; 4],
        };
        if !self.enable.is_none_or(level) {
            gates = [false; 4];
        }
        let command = self.word.map_or(0, |(place, piece, format, offset)| {
            let word = piece.of(words[place], format);
            let word = if offset { format.wrap(i128::from(word) + (1i128 << (format.width() - 1))) } else { word };
            let most = format.lsb().recip() as i64;
            // No actuator gives more than its full scale. A positive command pushes against the positive direction, but
            // to a converter the word goes as it is.
            let word = word.clamp(-most, most);
            if self.driving == Driving::Current { word } else { -word }
        });
        Ok((gates.map(i64::from), command))
    }
}

impl Wires {
    /// Returns the word that these lines ask of a bridge with three legs, as
    /// [`ThreeLegs`](crate::world::actuator::Actuator::ThreeLegs) takes it.
    ///
    /// # Errors
    ///
    /// When both switches of a leg would be closed.
    fn three_legs(&self, lines: [bool; 6], level: impl Fn(Level) -> bool) -> Result<i64, Misdriven> {
        let [a, b, c, ..] = lines;
        let mut gates = match self.driving {
            Driving::SixGates => lines,
            Driving::ThreeLegs => [a, !a, b, !b, c, !c],
            _ => [false; 6],
        };
        if let Some(leg) = (0..3).find(|leg| gates[2 * leg] && gates[2 * leg + 1]) {
            return Err(Misdriven::Short(["a", "b", "c"][leg]));
        }
        if !self.enable.is_none_or(&level) {
            gates = [false; 6];
        }
        let starts = self.starts.iter().map(|&(bit, pin)| (gates.len() + bit, level(pin)));
        let bits = gates.into_iter().enumerate().chain(starts);
        Ok(bits.map(|(place, is_high)| i64::from(is_high) << place).sum())
    }
}

/// The most names that a message lists.
const LISTED: usize = 12;

/// Returns the ports of a design, and the signals inside that are shown, with the formats that the scene says of them.
fn formatted(
    scene: &DutScene,
    design: &dyn Design,
    same: &dyn Fn(&str, &str) -> bool,
) -> Result<Vec<Port>, SceneError> {
    let mut ports = design.ports().to_vec();
    for (name, format) in &scene.dut.formats {
        let refused = |reason: String| Err(scene.error(&format!("dut.formats.{name}"), reason));
        let all = || ports.iter().chain(design.hidden());
        let Some(port) = all().find(|port| same(&port.name, name)) else {
            let names: Vec<_> = all().map(|port| port.name.as_str()).collect();
            let near = did_you_mean(name, &names);
            let more = if names.len() > LISTED { format!(" and {} more", names.len() - LISTED) } else { String::new() };
            let others = match near.as_str() {
                "" => format!("; it has {}{more}", names[..names.len().min(LISTED)].join(", ")),
                near => near.to_string(),
            };
            return refused(format!("`{}` has no port or signal inside of this name{others}", scene.dut.top));
        };
        let width = port.format.width();
        if format.width() != width {
            return refused(format!("{} has {width} bit(s), {format} has {}", port.name, format.width()));
        }
        let fixed = scene.dut.ports.iter().find(|connected| same(&connected.port, name));
        let fixed = fixed.and_then(|connected| connected.connection.format()).filter(|_| !port.is_inside);
        if fixed.is_some_and(|fixed| fixed != *format && fixed != Format::BIT) {
            return refused("its connection in [dut.ports] says its format; leave one out".to_string());
        }
        for port in ports.iter_mut().filter(|port| same(&port.name, name)) {
            (port.format, port.is_quantity) = (*format, true);
        }
    }
    Ok(ports)
}

/// Returns whether a port is a word in the record or the array of this name.
fn is_word_of(port: &str, name: &str, same: &dyn Fn(&str, &str) -> bool) -> bool {
    let (start, rest) = port.split_at_checked(name.len()).unwrap_or((port, ""));
    same(start, name) && rest.starts_with(['.', '(', '['])
}

/// Returns a port as messages show it.
fn shown(port: &Port) -> String {
    let way = if port.is_input { "in" } else { "out" };
    let width = port.format.width();
    format!("{} ({way}, {width} bit{})", port.name, if width == 1 { "" } else { "s" })
}

/// Checks that a clock or a reset is an input of one bit.
fn line(scene: &DutScene, key: &str, port: &Port) -> Result<(), SceneError> {
    if port.is_input && port.format.width() == 1 {
        return Ok(());
    }
    Err(scene.error(key, format!("{} is no input of one bit", shown(port))))
}

/// Returns the bits of a port with their connections.
fn pieces<'a>(
    scene: &DutScene,
    port: &Port,
    all: impl Iterator<Item = &'a Connected>,
    ignores_case: bool,
) -> Result<Vec<Piece>, SceneError> {
    let mut pieces: Vec<Piece> = Vec::new();
    for connected @ Connected { connection, .. } in all {
        let Some((shift, width)) = connected.bits((&port.name, &port.layout), ignores_case) else { continue };
        if let Some(other) =
            pieces.iter().find(|piece| piece.shift < shift + width && shift < piece.shift + piece.width)
        {
            let reason = format!("these bits of {} are connected to {} too", shown(port), other.connection.name());
            return Err(scene.error(&connected.path(), reason));
        }
        if *connection != Connection::Open {
            pieces.push(Piece { shift, width, connection: *connection });
        }
    }
    pieces.sort_unstable_by_key(|piece| std::cmp::Reverse(piece.shift));
    Ok(pieces)
}

/// Checks that a port, or a part of it, can have a connection.
fn check(scene: &DutScene, port: &Port, connected: &Connected, ignores_case: bool) -> Result<(), SceneError> {
    let refused = |reason: String| Err(scene.error(&connected.path(), reason));
    let Connected { part, connection, .. } = *connected;
    let Some((_, width)) = connected.bits((&port.name, &port.layout), ignores_case) else {
        return refused(match part {
            Part::InList { of, .. } => format!("{} has not the {of} bit(s) of the list", shown(port)),
            _ => format!("{} has no such bits; it is {}", shown(port), port.layout),
        });
    };
    if connection.is_given() != port.is_input {
        let should = if port.is_input { "the world gives nothing there" } else { "the design gives it" };
        return refused(format!("{} cannot be connected to {}: {should}", shown(port), connection.name()));
    }
    let fits = |word: i64| {
        let holds = |format: Format| format.holds(word.into());
        holds(Format::unsigned(width)) || width > 1 && holds(Format::signed(width))
    };
    match connection {
        Connection::Constant(word) if !fits(word) => refused(format!("{word} does not fit {}", shown(port))),
        Connection::Wall if !scene.wraps => {
            let counts = scene.wall_count().saturating_sub(scene.start_count());
            if fits(counts) {
                return Ok(());
            }
            refused(format!(
                "the wall is {counts} counts from the start, which does not fit {}; move wall.position, widen the \
                 port, or write wall.wraps = true in a scene that shows how it wraps",
                shown(port)
            ))
        }
        _ => match connection.format() {
            Some(format) if format.width() != width => {
                refused(format!("{} has not the {} bit(s) of {}", shown(port), format.width(), connection.name()))
            }
            // A port with a binary point of its own, which is the format of its words.
            Some(format) if part == Part::Whole && port.format.lsb() != 1.0 && format != port.format => {
                refused(format!("{} is {}, not {format}; write this format", shown(port), port.format))
            }
            _ => Ok(()),
        },
    }
}
