//! The keys of an axis: device, transducers, wall, hand, model.

pub(crate) use crate::method::rows::*;

pub(crate) use crate::axis::network_rows::*;

pub(crate) use crate::head::rows::*;

use crate::axis::file::OfFile;
pub(crate) use crate::axis::file::{expect_recording, hand_file, hand_file_motion};
use crate::axis::library::{BRIDGES, ENCODERS, MOTORS, NamedPart, by_name};
use crate::head::model::{BridgeModel, Datapath, EncoderModel, Friction, Solver, Winding};
use crate::method::{FOLLOWS, WALLED};
use crate::schema::Otherwise::{Is, Required, Said};
use crate::schema::quantity as q;
use crate::schema::quantity::Sense::{Any, NotNegative, Positive, Within};
use crate::schema::{Choice, Flag, Group, Key, Own, Quantity, Shape, Takes, Text, Whole, keys, named, scene};

/// The form of `hand.path` and of `target.path`.
pub(crate) const PATH: &str = "[[time, angle], ...] with at least one point, as in [[0, 0], [\"50 ms\", \"30 deg\"]]";

/// The default of what a named motor brings.
const MOTORS_OWN: &str = "the motor's";

keys! { top_wall: "" of WALLED;
    /// The virtual wall.
    wall: Own = Own::section(Required);
}

keys! { top_target: "" of FOLLOWS;
    /// The motion that the method follows.
    target: Own = Own::section(Required);
}

keys! { motor: "device" of ["motor"];
    /// Motor whose data are known; a key beside it replaces one of its data.
    motor: Choice<&'static NamedPart> = Choice::new(|| by_name(&MOTORS), Said("none"));
    /// Resistance of the winding; required without `motor`.
    resistance: Quantity = Quantity::new(&q::RESISTANCE, Positive, Said(MOTORS_OWN));
    /// Inductance of the winding; required without `motor`.
    inductance: Quantity = Quantity::new(&q::INDUCTANCE, Positive, Said(MOTORS_OWN));
    /// Torque for one ampere, which is also the back-EMF constant; required without `motor`.
    torque_constant: Quantity = Quantity::new(&q::TORQUE_CONSTANT, Positive, Said(MOTORS_OWN));
    /// Moment of inertia of the rotor; required without `motor`.
    rotor_inertia: Quantity = Quantity::new(&q::INERTIA, Positive, Said(MOTORS_OWN));
    /// Viscous friction at the shaft; a named motor brings its own.
    viscous_friction: Quantity = Quantity::new(&q::TORSIONAL_DAMPING, NotNegative, Is(0.0));
    /// Coulomb friction at the shaft.
    coulomb_friction: Quantity = Quantity::new(&q::TORQUE, NotNegative, Is(0.0));
    /// Turns of the shaft for one turn of the wheel.
    wheel_ratio: Quantity = Quantity::new(&q::RATIO, Within(1e-3, 1e4), Is(1.0));
    /// Moment of inertia of the wheel about its own axis.
    wheel_inertia: Quantity = Quantity::new(&q::INERTIA, NotNegative, Is(0.0));
    /// Angle of the shaft at the start.
    initial_angle: Quantity = Quantity::new(&q::ANGLE, Any, Is(0.0));
    /// Speed of the shaft at the start.
    initial_speed: Quantity = Quantity::new(&q::ANGULAR_SPEED, Any, Is(0.0));
    /// Current of the winding at the start.
    initial_current: Quantity = Quantity::new(&q::CURRENT, Any, Is(0.0));
}

scene! { mass: "device" of ["mass"];
    /// A mass on a rail.
    #[derive(Clone, Copy, PartialEq, Debug)]
    pub struct Mass {
        /// The mass.
        mass_kg: f64 = mass: Quantity = Quantity::new(&q::MASS, Positive, Required);
        /// Viscous friction of the rail.
        damping_n_s_per_m: f64 = damping: Quantity = Quantity::new(&q::DAMPING, NotNegative, Required);
        /// Coulomb friction of the rail.
        coulomb_n: f64 = coulomb: Quantity = Quantity::new(&q::FORCE, NotNegative, Is(0.0));
        /// Position at the start.
        initial_position_m: f64 = initial_position: Quantity = Quantity::new(&q::LENGTH, Any, Is(0.0));
        /// Speed at the start.
        initial_speed_m_per_s: f64 = initial_speed: Quantity = Quantity::new(&q::SPEED, Any, Is(0.0));
    }
}

keys! { encoder_part: "encoder" of ["motor", "network", "pmsm"];
    /// Encoder of the library of parts, with its lines.
    part: Choice<&'static NamedPart> = Choice::new(|| by_name(&ENCODERS), Said("none"));
}

keys! { encoder_motor: "encoder" of ["motor", "pmsm"];
    /// Lines of a revolution; the decoder counts four for each.
    lines: Whole<u32> = Whole::new(1, 1 << 24, Is(1024));
}

keys! { encoder_mass: "encoder" of ["mass"];
    /// Length of one count; required unless the law is linear.
    resolution: Quantity = Quantity::new(&q::LENGTH, Within(1e-11, 1.0), Said("none"));
}

keys! { bridge: "bridge" of [];
    /// Bridge of the library of parts, with the resistance of its switches.
    part: Choice<&'static NamedPart> = Choice::new(|| by_name(&BRIDGES), Said("none"));
    /// Supply voltage.
    supply: Quantity = Quantity::new(&q::VOLTAGE, Positive, Is(24.0));
    /// Resistance of one closed switch; two are in series with the winding.
    on_resistance: Quantity = Quantity::new(&q::RESISTANCE, NotNegative, Is(0.0));
    /// Forward voltage of a freewheeling diode.
    diode_drop: Quantity = Quantity::new(&q::VOLTAGE, NotNegative, Is(0.7));
    /// Mean voltage that does not reach the motor: it gets 0 V up to it in either direction, and beyond it the rest.
    /// Only of a bridge that is averaged.
    dead_band: Quantity = Quantity::new(&q::VOLTAGE, NotNegative, Is(0.0));
}

keys! { amplifier: "amplifier" of [];
    /// Force of a full command, 2^`method.pwm.bits` counts.
    full_scale: Quantity = Quantity::new(&q::FORCE, Positive, Required);
    /// Analog input shaper before the amplifier.
    shaper: Own = Own::section(Said("none"));
}

scene! { amplifier_shaper: "amplifier.shaper" of [];
    /// An analog input shaper: its force only pushes out of the wall, and its fast part is taken off.
    #[derive(Clone, Copy, PartialEq, Debug)]
    pub struct AnalogShaper {
        /// Cutoff of the shaper's high-pass filter.
        cutoff_hz: f64 = cutoff: Quantity = Quantity::new(&q::FREQUENCY, Positive, Required);
        /// Time for which the amplifier holds its output: a step of the emulation, no part of the hardware.
        hold_s: f64 = hold: Quantity = Quantity::new(&q::TIME, Positive, Is(1e-6));
    }
}

keys! { wall: "wall" of ["axis", "dut", "foc"];
    /// Where the wall stands; the device is in the wall at greater angles or positions.
    position: Quantity = Quantity::along(|axis| axis.position, Any, Required);
    /// Accepts a wall out of the range of `method.position_bits`, or of a port `wall.count`: the logic then reads the
    /// wall where its word wraps to.
    wraps: Flag = Flag(false);
}

keys! { wall_axis: "wall" of ["axis"];
    /// Stiffness of the wall's spring.
    stiffness: Quantity = Quantity::along(|axis| axis.stiffness, NotNegative, Required);
    /// Damping of the wall.
    damping: Quantity = Quantity::along(|axis| axis.damping, NotNegative, Is(0.0));
    /// Change of the wall during the run.
    ramp: Own = Own::section(Said("none"));
}

keys! { wall_dut: "wall" of ["dut"];
    /// Key that `hpu limits` varies to make the wall stiffer, below `dut.ports`, `dut.generics` or `dut.parameters`.
    varies: Text = Text(
        "the key of a generic or constant, as in \"dut.ports.gain\" or \"dut.generics.STIFFNESS\"", Said("none"));
}

keys! { wall_ramp: "wall.ramp" of [];
    /// Stiffness at the end of the ramp; required without `scale`.
    stiffness: Quantity = Quantity::along(|axis| axis.stiffness, NotNegative, Said("the wall's"));
    /// Scale of the force of a `passive_spring` at the end of the ramp, as `method.beta` is at its start.
    scale: Quantity = Quantity::new(&q::RATIO, NotNegative, Said("none"));
    /// Time at which the ramp begins; the value then changes in a straight line.
    from: Quantity = Quantity::new(&q::TIME, NotNegative, Required);
    /// Time at which the ramp ends.
    to: Quantity = Quantity::new(&q::TIME, Positive, Required);
}

keys! { target: "target" of ["axis"];
    /// Motion of the target as points in the order of time, straight between two and constant after the last; two
    /// points a clock apart are a step.
    path: Own = Own::new(|| Takes::Own(Shape::List, PATH), Required);
    /// Amplitude of a sine that is added to the path.
    amplitude beside frequency: Quantity = Quantity::along(|axis| axis.position, Positive, Said("no sine"));
    /// Frequency of the sine.
    frequency beside amplitude: Quantity = Quantity::new(&q::FREQUENCY, Positive, Said("no sine"));
    /// Time at which the sine begins, at 0.
    from beside amplitude: Quantity = Quantity::new(&q::TIME, NotNegative, Is(0.0));
}

keys! { hand: "hand" of [];
    /// Kind of the hand: none, a constant torque, a hand that holds it by spring and damper, an imposed motion, or
    /// a recording of encoder lines.
    kind: Choice<&'static str> = Choice::new(
        || named(&["none", "constant_torque", "spring_damper", "prescribed", "capture"], |it| it),
        Required);
}

keys! { hand_torque: "hand" of ["constant_torque"];
    /// Torque or force of the hand, positive into the wall.
    torque: Quantity = Quantity::along(|axis| axis.effort, Any, Required);
}

keys! { hand_grip: "hand" of ["spring_damper"];
    /// Stiffness of the grip.
    stiffness: Quantity = Quantity::along(|axis| axis.stiffness, NotNegative, Required);
    /// Damping of the grip.
    damping: Quantity = Quantity::along(|axis| axis.damping, NotNegative, Required);
}

keys! { hand_motion: "hand" of ["spring_damper", "prescribed"];
    /// Motion as points in the order of time, straight between two and constant after the last; required without
    /// `file`.
    path: Own = Own::new(|| Takes::Own(Shape::List, PATH), Said("the file's"));
    /// Table with the motion, beside the scene; required without `path`. Its header has a column of times and one of
    /// positions with their units, as in `time_s,angle_deg` or `t [ms];knob [rad]`. A recording of counts of the
    /// scene's encoder stands for the smoothest motion that lies in them: that with the least mean square of its third
    /// derivative.
    file: OfFile = OfFile("the name of a table beside the scene (CSV)", Said("the path"));
}

keys! { hand_capture: "hand" of ["capture"];
    /// Recorded lines, beside the scene: VCD or FST, or a table of levels as Saleae Logic, PulseView and sigrok write
    /// it.
    file: OfFile = OfFile("the name of a recording beside the scene (VCD, FST, CSV)", Required);
    /// Channel of encoder line A in the file.
    channel_a: Text = Text("the name of encoder line A in the file", Required);
    /// Channel of encoder line B in the file.
    channel_b: Text = Text("the name of encoder line B in the file", Required);
}

/// Friction by name; the speed of smoothed friction is a key of its own.
pub(crate) const SMOOTHED: Friction = Friction::Smoothed { speed_rad_per_s: 0.0 };

keys! { model: "model" of ["axis"];
    /// How the device is advanced: exactly from event to event, exactly at every clock cycle, exactly once a sample
    /// period, or by a textbook method in fixed steps.
    solver: Choice<Solver> = Choice::new(|| named(&Solver::ALL, Solver::name), Is(Solver::Events));
    /// Step of a fixed-step solver, rounded to whole clock cycles; required by it.
    step: Quantity = Quantity::new(&q::TIME, Positive, Said("none"));
    /// How the law is computed: by the blocks in fixed point, in floats on encoder counts with the gains that the
    /// fixed-point words realise, or as the linear law of the limits.
    datapath: Choice<Datapath> = Choice::new(|| named(&Datapath::ALL, Datapath::name), Is(Datapath::Words));
}

keys! { model_bridge: "model" of ["motor", "network"];
    /// Models every switching of the bridge, or its mean voltage with the pulses' area and first moment.
    bridge: Choice<BridgeModel> =
        Choice::new(|| named(&BridgeModel::ALL, BridgeModel::name), Is(BridgeModel::Switching));
}

keys! { model_motor: "model" of ["motor"];
    /// Models the winding with or without its inductance; without needs an averaged bridge.
    winding: Choice<Winding> = Choice::new(|| named(&Winding::ALL, Winding::name), Is(Winding::Inductive));
}

keys! { model_friction: "model" of ["axis", "dut", "epfl_paddle", "foc"];
    /// Models Coulomb friction with sticking and slipping, proportional to the speed below `friction_speed`, or not at
    /// all.
    friction: Choice<Friction> = Choice::new(|| vec![
        ("stick_slip", Friction::StickSlip), ("smoothed", SMOOTHED), ("none", Friction::None),
    ], Is(Friction::StickSlip));
    /// Speed from which smoothed friction is constant; required by it.
    friction_speed: Quantity = Quantity::along(|axis| axis.speed, Positive, Said("none"));
}

keys! { model_law: "model" of ["axis"];
    /// Position that the law reads: counts from the encoder's lines; counts that a fixed-step run loads into the
    /// counter once a step; or, for the law in floats, the position itself.
    encoder: Choice<EncoderModel> =
        Choice::new(|| named(&EncoderModel::ALL, EncoderModel::name), Is(EncoderModel::Quantised));
    /// Delay of the linear law in addition to sampling.
    delay: Quantity = Quantity::new(&q::TIME, NotNegative, Is(0.0));
}
