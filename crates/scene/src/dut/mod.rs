//! A design of the user's own: its files, and the connections of its ports.

pub(crate) mod beside;
mod layout;
mod part;
pub(crate) mod read;
pub(crate) mod rows;

use std::fmt;
use std::sync::Arc;

use hpu_signal::Format;

use crate::head::{Head, Units, has_head};
use hpu_plant::Bridge;

use crate::axis::initial_angle_rad;
use crate::axis::network::Compound;
use crate::axis::parts::{Amplifier, Device, Encoder, Hand, Push};
use crate::axis::sensors::Sensor;
use crate::faults::Faults;
use crate::head::accuracy::Output;
use crate::head::model::{Model, Solver};
use crate::head::setup::Setup;
use crate::pmsm::Pmsm;
use crate::schema::identifier::Identifier;
use crate::schema::source::SceneError;
pub use beside::{BesideFile, beside};
pub use layout::Layout;
pub use part::Part;

/// One experiment of an axis whose loop is closed by a design of the user's own; in SI units.
#[derive(Clone, PartialEq, Debug)]
pub struct DutScene {
    /// The part that every scene has.
    pub head: Head,
    /// The device that the hand holds; of a network what its body with the encoder shows if all joints are rigid.
    pub device: Device,
    /// The bodies and joints of a network.
    pub network: Option<Arc<Compound>>,
    /// The motor with three phases, if the device is one; `device` is then that motor with one winding.
    pub pmsm: Option<Arc<Pmsm>>,
    /// Clocks from a command to the converter of a network that takes it: those of a host between both.
    pub host_clocks: u64,
    /// The encoder on the shaft, or along the rail.
    pub encoder: Encoder,
    /// The H-bridge of a motor.
    pub bridge: Bridge,
    /// The force amplifier of a mass.
    pub amplifier: Option<Amplifier>,
    /// The design.
    pub dut: Dut,
    /// The position of the wall that the design renders, if it renders one.
    pub wall_rad: Option<f64>,
    /// Whether the wall may stand out of the range of a port that takes its count.
    pub wraps: bool,
    /// Key of the generic or constant that makes the wall stiffer, if the scene names one.
    pub varies: Option<String>,
    /// The hand, which moves the device.
    pub hand: Hand,
    /// The faults between device and design.
    pub faults: Option<Faults>,
    /// The parts of the device's physics that are modelled.
    pub model: Model,
}

has_head!(DutScene);

impl DutScene {
    /// Returns the way in which the design drives its device.
    ///
    /// # Errors
    ///
    /// [`SceneError`] about the connection that is missing beside another, or one too many.
    pub fn driving(&self) -> Result<Driving, SceneError> {
        let refused = |reason: String| Err(self.error("dut.ports", reason));
        let has = |line: Line| self.dut.lines().any(|connected| connected == line);
        let six = [Line::AHigh, Line::ALow, Line::BHigh, Line::BLow, Line::CHigh, Line::CLow];
        let ways = [
            (Driving::SixGates, &six[..]),
            (Driving::ThreeLegs, &[Line::LegA, Line::LegB, Line::LegC]),
            (Driving::Gates, &[Line::PlusHigh, Line::PlusLow, Line::MinusHigh, Line::MinusLow]),
            (Driving::Legs, &[Line::Plus, Line::Minus]),
            (Driving::PulseAndDirection, &[Line::Pwm, Line::Direction]),
        ];
        let words = self.dut.ports.iter().filter_map(|connected| match connected.connection {
            Connection::Duty(..) => Some(Driving::Duty),
            Connection::Force(..) => Some(Driving::Force),
            Connection::Current(..) => Some(Driving::Current),
            _ => None,
        });
        let begun = ways.iter().filter(|(_, lines)| lines.iter().any(|line| has(*line))).map(|(way, _)| *way);
        let all: Vec<_> = words.chain(begun).collect();
        let choices = "the four of bridge.plus_high, plus_low, minus_high and minus_low; or bridge.plus and \
                       bridge.minus; or bridge.pwm and bridge.direction; or bridge.duty; or, of a mass, \
                       amplifier.force; or, of a network without a bridge, drive.current; or, of a pmsm, the six of \
                       bridge.a_high, a_low and so on to c_low, or bridge.leg_a, leg_b and leg_c";
        match all[..] {
            [] => Ok(Driving::Nothing),
            [way] => {
                let lines = ways.iter().find(|(of, _)| *of == way).map_or(&[][..], |(_, lines)| lines);
                // A pulse alone drives in the positive direction.
                match lines.iter().find(|line| **line != Line::Direction && !has(**line)) {
                    Some(missing) => refused(format!("nothing is connected to {}; connect {choices}", missing.name())),
                    None => Ok(way),
                }
            }
            _ => refused(format!("the device is driven in more than one way; connect only one of: {choices}")),
        }
    }

    /// Returns the sensors beside the encoder.
    pub fn sensors(&self) -> &[Sensor] {
        match (&self.network, &self.pmsm) {
            (Some(network), _) => &network.sensors,
            (None, Some(pmsm)) => &pmsm.sensors,
            (None, None) => &[],
        }
    }

    /// Returns the position of the wall; infinite where there is none, so that nothing touches it.
    pub fn wall_or_far_rad(&self) -> f64 {
        self.wall_rad.unwrap_or(f64::INFINITY)
    }

    /// Returns the wall's count, from angle 0; the greatest one where there is no wall.
    pub fn wall_count(&self) -> i64 {
        self.encoder.nearest(self.wall_or_far_rad())
    }

    /// Returns what the wall gives at rest, at the least. Only its author knows the stiffness of a design, so a wall is
    /// taken to be a tenth as stiff as the grip of the hand, or to give a tenth of a constant push; where nothing is
    /// known of the hand, a hundredth of what the actuator can.
    pub fn wall_push(&self) -> Push {
        let full = match (&self.device, self.network.as_deref()) {
            (_, Some(compound)) => compound.stall(self.bridge),
            (Device::Motor(motor), _) => motor.stall_nm(self.bridge),
            (Device::Mass(_), _) => self.amplifier.map_or(0.0, |amplifier| amplifier.full_scale_n),
        };
        match self.hand {
            _ if self.driving() == Ok(Driving::Nothing) => Push { stiffness: 0.0, most: 0.0 },
            Hand::SpringDamper { stiffness_nm_per_rad, .. } if stiffness_nm_per_rad > 0.0 => {
                Push { stiffness: 0.1 * stiffness_nm_per_rad, most: full }
            }
            Hand::ConstantTorque { torque_nm } => {
                Push { stiffness: f64::INFINITY, most: full.min(0.1 * torque_nm.abs()) }
            }
            _ => Push { stiffness: f64::INFINITY, most: 0.01 * full },
        }
    }

    /// Returns the count at which the device starts, from angle 0.
    pub fn start_count(&self) -> i64 {
        let start = self.network.as_ref().map(|network| network.start());
        self.encoder.count(start.unwrap_or_else(|| initial_angle_rad(&self.hand, &self.device)))
    }
}

/// A design.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Dut {
    /// Its files, in any order; none where a scene is that of the plant alone.
    pub files: Vec<SourceFile>,
    /// Files that it reads beside them: headers, and the data of memories.
    pub beside: Vec<BesideFile>,
    /// The VHDL library that they are compiled into.
    pub library: Identifier,
    /// The names of the files that are compiled into another library, with that library.
    pub libraries: Vec<(String, Identifier)>,
    /// Its topmost entity or module; empty where a scene is that of the plant alone.
    pub top: Identifier,
    /// The edition of VHDL that it is written in.
    pub standard: Standard,
    /// The simulator.
    pub engine: Engine,
    /// The values with which registers begin that nothing sets.
    pub registers: Registers,
    /// Its clocks.
    pub clocks: Vec<DutClock>,
    /// Its reset, if it has one.
    pub reset: Option<DutReset>,
    /// Generics or parameters, and their values as the language writes them.
    pub generics: Vec<(Identifier, Generic)>,
    /// The connections of its ports, and of parts of them.
    pub ports: Vec<Connected>,
    /// Whether a bridge leg is open, instead of braking, while `bridge.pwm` is 0.
    pub floats: bool,
    /// Formats of ports and of signals inside, by their paths below the top as in `decoder.count`: what the design's
    /// own types do not say.
    pub formats: Vec<(String, Format)>,
}

/// A file of a design: its name, as the scene has it, and its content.
pub type SourceFile = (String, Arc<[u8]>);

hpu_signal::named! {
    /// An edition of VHDL.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum Standard {
        /// VHDL-93.
        Vhdl93 = "93",
        /// VHDL-2008.
        Vhdl2008 = "2008",
    }
}

hpu_signal::named! {
    /// A simulator of designs.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum Engine {
        /// Leaps where the design can and that pays, else Verilator where it can simulate the design, else GHDL.
        Auto = "auto",
        /// GHDL.
        Ghdl = "ghdl",
        /// Verilator, after GHDL's synthesis for VHDL.
        Verilator = "verilator",
        /// Leaps over the clock edges at which only counters move, on Yosys' netlist, after GHDL's synthesis for VHDL.
        Leap = "leap",
    }
}

hpu_signal::named! {
    /// The values with which registers begin that neither an initial value nor the reset sets.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum Registers {
        /// Unknown: a run ends where one of them drives the device.
        Unknown = "unknown",
        /// 0, as in an FPGA that clears its registers.
        Zero = "zero",
        /// Random, by the seed of the run.
        Random = "random",
    }
}

/// A clock of a design.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct DutClock {
    /// Its port.
    pub port: Identifier,
    /// Number of cycles of the scene's clock in one of its own.
    pub divide: u32,
}

/// The reset of a design.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct DutReset {
    /// Its port.
    pub port: Identifier,
    /// Whether it resets at 0.
    pub active_low: bool,
    /// Number of cycles of the slowest clock for which it is active before the run.
    pub clocks: u32,
}

/// The value of a generic or parameter.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Generic {
    /// A whole number.
    Integer(i64),
    /// True or false.
    Flag(bool),
    /// A real number, as both languages write it: digits with a point among them, and an exponent of ten.
    Real(String),
    /// A text.
    Text(String),
}

impl Generic {
    /// Returns a finite real number as a value.
    pub fn real(value: f64) -> Self {
        let text = format!("{value:e}");
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let point = if mantissa.contains('.') { "" } else { ".0" };
        Self::Real(format!("{mantissa}{point}e{exponent}"))
    }
}

impl fmt::Display for Generic {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Integer(value) => value.fmt(f),
            Self::Flag(value) => value.fmt(f),
            Self::Real(value) | Self::Text(value) => f.write_str(value),
        }
    }
}

hpu_signal::named! {
    /// A line of one bit between world and design.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum Line {
        /// Encoder line A.
        A = "encoder.a",
        /// Encoder line B.
        B = "encoder.b",
        /// The encoder's index: 1 at one count of a revolution.
        Index = "encoder.index",
        /// The high switch of the leg at the motor's plus terminal.
        PlusHigh = "bridge.plus_high",
        /// The low switch of the leg at the plus terminal.
        PlusLow = "bridge.plus_low",
        /// The high switch of the leg at the minus terminal.
        MinusHigh = "bridge.minus_high",
        /// The low switch of the leg at the minus terminal.
        MinusLow = "bridge.minus_low",
        /// The plus leg: high at 1, low at 0.
        Plus = "bridge.plus",
        /// The minus leg: high at 1, low at 0.
        Minus = "bridge.minus",
        /// The pulse: the motor is driven at 1.
        Pwm = "bridge.pwm",
        /// The direction in which it is driven: positive at 1.
        Direction = "bridge.direction",
        /// Enable: at 0 all switches are open.
        Enable = "bridge.enable",
        /// The high switch of the leg at phase a.
        AHigh = "bridge.a_high",
        /// The low switch of the leg at phase a.
        ALow = "bridge.a_low",
        /// The high switch of the leg at phase b.
        BHigh = "bridge.b_high",
        /// The low switch of the leg at phase b.
        BLow = "bridge.b_low",
        /// The high switch of the leg at phase c.
        CHigh = "bridge.c_high",
        /// The low switch of the leg at phase c.
        CLow = "bridge.c_low",
        /// The leg at phase a: high at 1, low at 0.
        LegA = "bridge.leg_a",
        /// The leg at phase b: high at 1, low at 0.
        LegB = "bridge.leg_b",
        /// The leg at phase c: high at 1, low at 0.
        LegC = "bridge.leg_c",
    }
}

impl Line {
    /// Returns its name without its owner, as in `plus_high`.
    pub fn own_name(self) -> &'static str {
        self.name().rsplit('.').next().unwrap_or_default()
    }

    /// Returns whether it is an input of the design, driven by the world.
    pub fn is_given(self) -> bool {
        matches!(self, Self::A | Self::B | Self::Index)
    }
}

/// A connection of a port, or of a part of its bits.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Connected {
    /// The port, or the word in it: identifiers with dots and indices, as in `enc.a` or `gains(2)`.
    pub port: String,
    /// The bits that are connected.
    pub part: Part,
    /// Their connection.
    pub connection: Connection,
    /// The key below `dut.ports`, or below `dut.pins`, for messages.
    pub key: String,
    /// Whether the key stands in `dut.pins`.
    pub is_pin: bool,
}

impl Connected {
    /// Returns whether it is about a port of this name, or about a part of one. The port may be a word of an array.
    pub fn is_of(&self, port: &str, ignores_case: bool) -> bool {
        self.part.is_of(&self.port, port, ignores_case)
    }

    /// Returns the bits of a port that are connected: the number of those to the right, and its own; `None` where the
    /// port has no such bits.
    pub fn bits(&self, (port, layout): (&str, &Layout), ignores_case: bool) -> Option<(u32, u32)> {
        layout.bits(port, (&self.port, self.part), ignores_case)
    }

    /// Returns the path of its key in the scene.
    pub fn path(&self) -> String {
        let section = if self.is_pin { "pins" } else { "ports" };
        format!("dut.{section}.{}", self.key)
    }
}

/// A pin of a sensor of a network, beside its encoder.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SensorPin {
    /// The sensor's index, or [`ALL`](Self::ALL).
    pub sensor: usize,
    /// The index of the pin: 0 to 2 as in [`Sensor::pins`](crate::Sensor::pins), [`START`](Self::START), or three from
    /// [`LINES`](Self::LINES) on.
    pub pin: usize,
    /// Whether it is inverted; only a line is.
    pub inverted: bool,
    /// The format of its words.
    pub format: Format,
    /// Its name in scenes.
    pub name: &'static str,
}

impl SensorPin {
    /// The pin by which a design starts a sample.
    pub const START: usize = 3;
    /// The first of the lines of a chip that a design drives.
    pub const LINES: usize = 4;
    /// The sensor of a pin that starts a sample of every sensor that waits for one.
    pub const ALL: usize = usize::MAX;
}

/// The connection of a port.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Connection {
    /// A line, inverted if the flag is set.
    Line(Line, bool),
    /// The encoder's count, from 0 at the start, modulo the port's range.
    Count,
    /// The encoder's angle, in whole counts, as a word of this format, modulo its range.
    Angle(Format),
    /// The wall's position in counts from the start.
    Wall,
    /// A constant word.
    Constant(i64),
    /// The mean voltage of the bridge over its supply, as a word of this format; in offset binary if the flag is set.
    Duty(Format, bool),
    /// The amplifier's force over its full scale, as a word of this format; in offset binary if the flag is set.
    Force(Format, bool),
    /// The reference of a network's current over its converter's full scale, as a word of this format; in offset binary
    /// if the flag is set.
    Current(Format, bool),
    /// A pin of a sensor beside the encoder; an output of the design if it starts a sample.
    Sensor(SensorPin),
    /// Nothing: an output that nothing reads.
    Open,
}

impl Connection {
    /// Returns its name in scenes.
    pub fn name(self) -> String {
        match self {
            Self::Line(line, inverted) => format!("{}{}", if inverted { "not " } else { "" }, line.name()),
            Self::Count => "encoder.count".to_string(),
            Self::Angle(_) => "encoder.angle".to_string(),
            Self::Wall => "wall.count".to_string(),
            Self::Constant(word) => word.to_string(),
            Self::Duty(..) => "bridge.duty".to_string(),
            Self::Force(..) => "amplifier.force".to_string(),
            Self::Current(..) => "drive.current".to_string(),
            Self::Sensor(pin) => format!("{}{}", if pin.inverted { "not " } else { "" }, pin.name),
            Self::Open => "open".to_string(),
        }
    }

    /// Returns whether the port is an input of the design.
    pub fn is_given(self) -> bool {
        match self {
            Self::Line(line, _) => line.is_given(),
            Self::Sensor(pin) => pin.pin < SensorPin::START,
            Self::Count | Self::Angle(_) | Self::Wall | Self::Constant(_) => true,
            Self::Duty(..) | Self::Force(..) | Self::Current(..) | Self::Open => false,
        }
    }

    /// Returns whether its word drives the device.
    pub fn drives(self) -> bool {
        !self.is_given() && self != Self::Open
    }

    /// Returns the format of its words, if the connection fixes it.
    pub fn format(self) -> Option<Format> {
        match self {
            Self::Angle(format) | Self::Duty(format, _) | Self::Force(format, _) | Self::Current(format, _) => {
                Some(format)
            }
            Self::Sensor(pin) => Some(pin.format),
            Self::Line(..) => Some(Format::BIT),
            Self::Count | Self::Wall | Self::Constant(_) | Self::Open => None,
        }
    }
}

/// The way in which a design drives its device.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Driving {
    /// By the four switches of the bridge.
    Gates,
    /// By its two legs.
    Legs,
    /// By a pulse and a direction.
    PulseAndDirection,
    /// By the six switches of a bridge with three legs.
    SixGates,
    /// By its three legs.
    ThreeLegs,
    /// By a word for the mean voltage.
    Duty,
    /// By a word for the force.
    Force,
    /// By a word for the reference of a network's current.
    Current,
    /// Not at all: a decoder or a filter alone. The bridge stays open.
    Nothing,
}

impl Dut {
    /// Returns the pins of a motor's plant alone, for a logic that no scene names: the lines of the encoder and the
    /// gates of the bridge, by the names that they have in this project's loops.
    pub fn pins() -> Self {
        let line = |(name, line): (&'static str, Line)| Connected {
            port: name.to_string(),
            part: Part::Whole,
            connection: Connection::Line(line, false),
            key: name.to_string(),
            is_pin: false,
        };
        let pins = [
            ("a_pin", Line::A),
            ("b_pin", Line::B),
            ("a_high", Line::MinusHigh),
            ("a_low", Line::MinusLow),
            ("b_high", Line::PlusHigh),
            ("b_low", Line::PlusLow),
        ];
        Self {
            files: Vec::new(),
            beside: Vec::new(),
            library: Identifier::fixed("work"),
            libraries: Vec::new(),
            top: Identifier::default(),
            standard: Standard::Vhdl2008,
            engine: Engine::Auto,
            registers: Registers::Unknown,
            clocks: Vec::new(),
            reset: None,
            generics: Vec::new(),
            ports: pins.map(line).into(),
            floats: false,
            formats: Vec::new(),
        }
    }

    /// Returns the lines that are connected.
    pub fn lines(&self) -> impl Iterator<Item = Line> + '_ {
        self.ports.iter().filter_map(|connected| match connected.connection {
            Connection::Line(line, _) => Some(line),
            _ => None,
        })
    }
}

impl Setup for DutScene {
    fn solver(&self) -> Solver {
        self.model.solver
    }

    fn units(&self) -> Units {
        self.device.units()
    }

    fn outputs(&self) -> &'static [Output] {
        &Output::OF_AN_AXIS
    }

    fn wall_position(&self) -> f64 {
        self.wall_or_far_rad()
    }

    fn hand_path(&self) -> Vec<(f64, f64)> {
        self.hand.path()
    }
}
