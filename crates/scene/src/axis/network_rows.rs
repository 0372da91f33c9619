//! The keys of a device of bodies and joints.

use crate::axis::library::{AMPLIFIERS, MOTORS, NamedPart, by_name};
use crate::schema::Otherwise::{Is, Required, Said};
use crate::schema::quantity as q;
use crate::schema::quantity::Sense::{Any, NotNegative, Positive, Within};
use crate::schema::{Choice, Flag, Group, Key, Own, Quantity, Shape, Takes, Text, Whole, keys, named};

/// Text of a key that names a body.
const BODY: &str = "the name of a body";

/// How a drive feeds its winding.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum DriveKind {
    Bridge,
    Current,
    Pi,
}

/// The bus of a chip.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Bus {
    /// Four lines: `csn`, `sck` and `mosi` of the design, `miso` of the chip.
    Spi,
    /// Two lines: `scl` and `sda_out` of the design, which pulls SDA down by 0, and `sda`, the level of the line.
    I2c,
}

keys! { network: "device" of ["network"];
    /// Bodies that turn or slide, each by its name.
    bodies: Own = Own::section(Required);
    /// Joints between bodies, each by its name.
    joints: Own = Own::section(Said("none"));
    /// The drive of one body.
    drive: Own = Own::section(Required);
    /// Body in whose units the wall is given.
    units_at: Text = Text(BODY, Said("the encoder's"));
    /// Sensors beside the encoder, each by its name.
    sensors: Own = Own::section(Said("none"));
}

keys! { bodies: "device.bodies" of [];
    /// A body of this name.
    BODY: Own = Own::section(Said("none"));
}

keys! { body: "device.bodies.BODY" of [];
    /// Motor of the library of parts, whose rotor the body is: a drive on it has the motor's winding.
    part: Choice<&'static NamedPart> = Choice::new(|| by_name(&MOTORS), Said("none"));
    /// Moment of inertia of a body that turns; one of inertia and mass.
    inertia: Quantity = Quantity::new(&q::INERTIA, Positive, Said("none"));
    /// Mass of a body that slides.
    mass: Quantity = Quantity::new(&q::MASS, Positive, Said("none"));
    /// Viscous friction against the ground.
    viscous_friction: Quantity = Quantity::along(|axis| axis.damping, NotNegative, Is(0.0));
    /// Coulomb friction against the ground.
    coulomb_friction: Quantity = Quantity::along(|axis| axis.effort, NotNegative, Is(0.0));
    /// Friction up to which the body sticks, at least Coulomb friction.
    stiction: Quantity = Quantity::along(|axis| axis.effort, NotNegative, Said("coulomb_friction"));
    /// Stiffness of a spring to position 0.
    return_spring: Quantity = Quantity::along(|axis| axis.stiffness, NotNegative, Is(0.0));
    /// Weight of a body that turns, as a straight line about one angle.
    gravity: Own = Own::section(Said("none"));
    /// Springs that end the body's way on both sides.
    stops: Own = Own::section(Said("none"));
    /// Position at the start; a body on a rigid joint starts where the joint holds it.
    initial_position: Quantity = Quantity::along(|axis| axis.position, Any, Is(0.0));
    /// Speed at the start.
    initial_speed: Quantity = Quantity::along(|axis| axis.speed, Any, Is(0.0));
}

keys! { gravity: "device.bodies.BODY.gravity" of [];
    /// Mass of the body.
    mass: Quantity = Quantity::new(&q::MASS, Positive, Required);
    /// Distance of its centre of mass from the axis.
    distance: Quantity = Quantity::new(&q::LENGTH, Positive, Required);
    /// Angle about which the weight's torque is a straight line; 0 hangs down.
    at: Quantity = Quantity::new(&q::ANGLE, Any, Is(0.0));
    /// Acceleration by gravity.
    acceleration: Quantity = Quantity::new(&q::ACCELERATION, Positive, Is(q::STANDARD_GRAVITY_M_PER_S2));
}

keys! { stops: "device.bodies.BODY.stops" of [];
    /// Position of the lower stop.
    low: Quantity = Quantity::along(|axis| axis.position, Any, Required);
    /// Position of the upper stop.
    high: Quantity = Quantity::along(|axis| axis.position, Any, Required);
    /// Stiffness of either stop.
    stiffness: Quantity = Quantity::along(|axis| axis.stiffness, Positive, Required);
    /// Damping of either stop; a stop never pulls.
    damping: Quantity = Quantity::along(|axis| axis.damping, NotNegative, Is(0.0));
}

keys! { joints: "device.joints" of [];
    /// A joint of this name.
    JOINT: Own = Own::section(Said("none"));
}

keys! { joint: "device.joints.JOINT" of [];
    /// Body that it comes from.
    from: Text = Text(BODY, Required);
    /// Body that it goes to, in whose units stiffness and damping are.
    to: Text = Text(BODY, Required);
    /// Turns of the first body for one turn of the second, or of the wheel of this radius.
    ratio: Quantity = Quantity::new(&q::RATIO, Within(1e-4, 1e4), Is(1.0));
    /// Radius at which a body that turns moves one that slides; required there.
    radius: Quantity = Quantity::new(&q::LENGTH, Positive, Said("none"));
    /// Stiffness; a joint without one is rigid.
    stiffness: Quantity = Quantity::along(|axis| axis.stiffness, Positive, Said("rigid"));
    /// Damping.
    damping beside stiffness: Quantity = Quantity::along(|axis| axis.damping, NotNegative, Is(0.0));
    /// Damping as a share of the critical one of the two bodies on the joint alone, in the place of `damping`.
    damping_ratio beside stiffness: Quantity = Quantity::new(&q::RATIO, NotNegative, Said("none"));
}

keys! { drive: "device.drive" of [];
    /// Amplifier of the library of parts.
    part: Choice<&'static NamedPart> = Choice::new(|| by_name(&AMPLIFIERS), Said("none"));
    /// Kind of the drive: the bridge of `[bridge]`, a current that follows its reference with a bandwidth, or a voltage
    /// from the current's error and its integral.
    kind: Choice<DriveKind> = Choice::new(
        || vec![("bridge", DriveKind::Bridge), ("current", DriveKind::Current), ("pi", DriveKind::Pi)],
        Required);
    /// Body that it moves.
    on: Text = Text(BODY, Required);
    /// Torque or force for one ampere, which is also the back-EMF constant; required but on a rotor that is a part.
    torque_constant: Quantity = Quantity::along(|axis| axis.effort_per_a, Positive, Said("the motor's"));
    /// Resistance of the winding; required but for a current without a supply.
    resistance: Quantity = Quantity::new(&q::RESISTANCE, Positive, Said("none"));
    /// Inductance of the winding; required but for a current without a supply.
    inductance: Quantity = Quantity::new(&q::INDUCTANCE, Positive, Said("none"));
    /// Bandwidth of the current; a current without one follows at once.
    bandwidth: Quantity = Quantity::new(&q::FREQUENCY, Positive, Said("none"));
    /// Voltage that limits the current's rise.
    supply: Quantity = Quantity::new(&q::VOLTAGE, Positive, Said("none"));
    /// Volts for an ampere of error of a "pi" drive; without it the bandwidth's.
    proportional: Quantity = Quantity::new(&q::RESISTANCE, Positive, Said("the bandwidth's"));
    /// Rate at which the error's integral adds as many volts; without it resistance over inductance.
    integral_rate: Quantity = Quantity::new(&q::FREQUENCY, Positive, Said("the winding's"));
    /// Whether a "pi" drive adds the back-EMF.
    feed_forward: Flag = Flag(false);
    /// Converter from the command to the reference of a current; required but for a bridge.
    dac: Own = Own::section(Said("none"));
}

keys! { dac: "device.drive.dac" of [];
    /// Current of a full command, 2^`method.pwm.bits` counts.
    full_scale: Quantity = Quantity::new(&q::CURRENT, Positive, Required);
    /// Bits with the sign; without it the command is converted as it is.
    bits: Whole<u32> = Whole::new(2, 32, Said("all"));
    /// Rounding of a command to the converter's bits.
    rounding: Choice<bool> = Choice::new(|| vec![("nearest", false), ("floor", true)], Is(false));
}

keys! { sensors: "device.sensors" of [];
    /// A sensor of this name.
    SENSOR: Own = Own::section(Said("none"));
}

keys! { sensor: "device.sensors.SENSOR" of [];
    /// Kind of the sensor: an incremental encoder, an encoder whose word is the position, three Hall switches, the
    /// drive's current by a shunt and a converter, or by a shunt and a modulator of the first order, which gives a
    /// stream of bits.
    kind: Choice<&'static str> =
        Choice::new(|| named(&["encoder", "absolute", "hall", "current", "sigma_delta"], |it| it), Required);
    /// Body that it reads; required but for a current, or where there is one body.
    on: Text = Text(BODY, Said("none"));
    /// Lines of a revolution, of an incremental encoder on a body that turns; it has four counts for each.
    lines: Whole<u32> = Whole::new(1, 1 << 24, Is(1024));
    /// Length of one count of an incremental encoder on a body that slides; required there.
    resolution: Quantity = Quantity::new(&q::LENGTH, Within(1e-11, 1.0), Said("none"));
    /// Phase whose current it reads, of a motor with three; required there.
    winding: Choice<usize> = Choice::new(|| vec![("a", 0), ("b", 1), ("c", 2)], Said("none"));
    /// Place of a phase's shunt: between bridge and motor, or below the lower switch, so that it shows 0 A while that
    /// is open.
    shunt: Choice<bool> = Choice::new(|| vec![("in_line", false), ("low_side", true)], Is(false));
    /// Whether a design starts each sample of a phase's current, by a rising edge of the pin `start` of the sensor, in
    /// the place of `rate` and `phase`.
    trigger: Flag = Flag(false);
    /// Chip on a bus that brings the word of an absolute encoder in the place of the pin `word`: the AS5047P at the
    /// pins `csn`, `sck`, `mosi` and `miso`, with 14 bits, or the AS5600 at `scl`, `sda_out` and `sda`, with 12 bits.
    chip: Choice<(Bus, u32, f64)> =
        Choice::new(|| vec![("as5047p", (Bus::Spi, 14, 100e-9)), ("as5600", (Bus::I2c, 12, 1e-6))], Said("none"));
    /// Rate of the samples of a word, or of a modulator's bits, their period rounded to whole clock cycles; required
    /// but for an encoder, or where a design starts the samples.
    rate: Quantity = Quantity::new(&q::FREQUENCY, Positive, Said("none"));
    /// Time of the first sample.
    phase: Quantity = Quantity::new(&q::TIME, NotNegative, Is(0.0));
    /// Time from a sample to its word, of a converter or of a filter.
    latency: Quantity = Quantity::new(&q::TIME, NotNegative, Is(0.0));
    /// Bit clock of a bus that brings the word after that, a bit a cycle.
    bus: Quantity = Quantity::new(&q::FREQUENCY, Positive, Said("none"));
    /// Bits of the word, of a current with its sign; required but for an encoder.
    bits: Whole<u32> = Whole::new(2, 24, Said("none"));
    /// Angle or length of all words of an absolute encoder, which begin anew beyond it; required on a body that slides.
    span: Quantity = Quantity::along(|axis| axis.position, Positive, Said("a turn"));
    /// Corner of a first-order lag: of an absolute encoder that is analog, or of the amplifier of a phase's shunt.
    corner: Quantity = Quantity::new(&q::FREQUENCY, Positive, Said("none"));
    /// Volts at the converter for one ampere; required of a current. Below 0 where the shunt's amplifier inverts, or
    /// where the shunt sees the current out of the motor.
    gain: Quantity = Quantity::new(&q::CURRENT_GAIN, Any, Said("none"));
    /// Volts of all words of a current, half of them below 0 A; required of a current. A converter clamps. A modulator
    /// gives ones alone at the upper end.
    range: Quantity = Quantity::new(&q::VOLTAGE, Positive, Said("none"));
    /// Current that the words show where none flows.
    offset: Quantity = Quantity::new(&q::CURRENT, Any, Is(0.0));
    /// Readings without current before the run, whose mean is taken off every word of a current.
    calibrated_zero: Whole<u32> = Whole::new(1, 1 << 16, Said("none"));
    /// Whether the words of a current begin at 0, with 0 A in the middle, in the place of two's complement.
    offset_binary: Flag = Flag(false);
    /// Standard deviation of the noise in counts of the word, by `run.seed`: the sum of four equal random numbers.
    noise: Quantity = Quantity::new(&q::RATIO, NotNegative, Is(0.0));
    /// Errors in counts of the word at places equally far apart over all words, straight between two: 2^n of an
    /// absolute encoder, whose last one leads to the first; 2^n + 1 of a current.
    inl: Own = Own::new(|| Takes::Own(Shape::List, "a list of numbers"), Said("none"));
    /// The same of an absolute encoder as harmonics of a turn, or of its span: of the first one, and of the second one
    /// too, the amplitude in counts and the phase at the word 0; as sines at 256 places.
    harmonics: Own = Own::new(|| Takes::Own(Shape::List, HARMONICS), Said("none"));
    /// Time before which the sensor takes no sample and a chip answers with zeros; starts before it are missed.
    power_up: Quantity = Quantity::new(&q::TIME, NotNegative, Is(0.0));
}

/// The form of the errors of an absolute encoder as harmonics.
pub(crate) const HARMONICS: &str = "a list of one or two [amplitude, phase], as in [[1.5, 0], [0.5, \"90 deg\"]]";

keys! { method_network: "method" of ["network"];
    /// Sensor of a network that the logic counts, in the place of the encoder: position and velocity are those of its
    /// body, and the encoder becomes a sensor that is called `encoder`. The words of an absolute one reach the logic's
    /// counter by two lines that follow them, a count each clock cycle, from the true count on; the loop of EPFL's
    /// paddle reads the words themselves.
    position: Text = Text("the name of an encoder or an absolute sensor in device.sensors", Said("encoder"));
}

keys! { encoder_network: "encoder" of ["network"];
    /// Body with the encoder.
    on: Text = Text(BODY, Required);
    /// Lines of a revolution of a body that turns; the decoder counts four for each.
    lines: Whole<u32> = Whole::new(1, 1 << 24, Is(1024));
    /// Length of one count of a body that slides; required there.
    resolution: Quantity = Quantity::new(&q::LENGTH, Within(1e-11, 1.0), Said("none"));
}

keys! { hand_network: "hand" of ["network", "pmsm"];
    /// Body that the hand holds.
    on: Text = Text(BODY, Said("the encoder's"));
    /// Mass of the hand itself, on a body that slides: it moves between the grip and the path.
    mass: Quantity = Quantity::new(&q::MASS, Positive, Said("none"));
    /// Moment of inertia of the hand itself, on a body that turns.
    inertia: Quantity = Quantity::new(&q::INERTIA, Positive, Said("none"));
    /// Stiffness of the hand itself, from its mass to the path.
    own_stiffness: Quantity = Quantity::along(|axis| axis.stiffness, NotNegative, Is(0.0));
    /// Damping of the hand itself, from its mass to the path.
    own_damping: Quantity = Quantity::along(|axis| axis.damping, NotNegative, Is(0.0));
}

keys! { model_joints: "model" of ["network", "foc"];
    /// Models the joints as they are, or all of them as rigid.
    joints: Choice<bool> = Choice::new(|| vec![("compliant", false), ("rigid", true)], Is(false));
}

keys! { model_network: "model" of ["network"];
    /// Models the drive as it is, or by a current that follows at once and has no limit.
    drive: Choice<bool> = Choice::new(|| vec![("as_given", false), ("ideal", true)], Is(false));
    /// Models the converter's bits, or converts each command as it is.
    converter: Choice<bool> = Choice::new(|| vec![("as_given", false), ("exact", true)], Is(false));
    /// Models the host's lateness, or a host that hands commands on at once.
    host: Choice<bool> = Choice::new(|| vec![("late", false), ("on_time", true)], Is(false));
}

keys! { top_host: "" of ["motor", "mass", "network"];
    /// A host between the logic and the actuator, which hands commands on later: to the amplifier of a mass, the
    /// modulator of a bridge or the bridge's mean, or the converter of a network's drive.
    host: Own = Own::section(Said("none"));
}

keys! { host: "host" of ["motor", "mass", "network"];
    /// Samples from a command to the actuator that takes it.
    late: Whole<u32> = Whole::new(0, 64, Is(0));
    /// Time from a command to the actuator, beside `late`; rounded to a clock, a second at most.
    latency: Quantity = Quantity::new(&q::TIME, NotNegative, Is(0.0));
}
