//! The keys of a scene of a segment on a gimbal.

use hpu_plant::arm::Form;

use crate::gimbal::{OUTPUTS, Shear, TargetKind};
use crate::head::accuracy::OfOutputs;
use crate::head::model::Solver;
use crate::head::outcome::OutcomeKind;
use crate::schema::Otherwise::{Is, Required, Said};
use crate::schema::quantity::Sense::{NotNegative, Positive, UpTo, Within};
use crate::schema::quantity::{self as q, STANDARD_GRAVITY_M_PER_S2};
use crate::schema::{
    Choice, DeviceKeys, Expected, Flag, Group, Key, Own, Quantity, Shape, Takes, Whole, keys, named, scene,
};

/// The form of `target.path`.
pub(crate) const TARGET_PATH: &str =
    "[[time, height, pitch, roll], ...] with at least one point, as in [[0, \"12 mm\", 0, 0]]";
/// The form of `finger.path`.
pub(crate) const FINGER_PATH: &str =
    "[[time, height], ...] with at least one point, as in [[0, \"30 mm\"], [\"1 s\", \"10 mm\"]]";
/// The form of the waves of a joint.
pub(crate) const LENGTH_WAVES: &str = "[[amplitude, frequency], ...], as in [[\"4 mm\", \"0.2 Hz\"]]";
pub(crate) const ANGLE_WAVES: &str = "[[amplitude, frequency], ...], as in [[\"15 deg\", \"0.2 Hz\"]]";

keys! { top_gimbal: "" of ["gimbal"];
    /// The two servos of pitch and roll.
    tilt_servo: Own = Own::section(Said("its keys' defaults"));
    /// The servo of the crank.
    crank_servo: Own = Own::section(Said("its keys' defaults"));
    /// The sensor of the finger's force.
    force_sensor: Own = Own::section(Said("its keys' defaults"));
    /// The design of the device's datapath.
    method: Own = Own::section(Said("its keys' defaults"));
    /// The motion that the host asks of the segment.
    target: Own = Own::section(Required);
    /// The stiffness that the segment renders when the finger probes it.
    surface: Own = Own::section(Said("its keys' defaults"));
    /// The rule by which the crank's control changes.
    switch: Own = Own::section(Said("its keys' defaults"));
    /// The shear stress that the target's motion along x is felt as; without it, the tip follows that motion itself.
    shear: Own = Own::section(Said("none"));
    /// The finger on the segment.
    finger: Own = Own::section(Said("none"));
}

keys! { gimbal: "device" of ["gimbal"];
    /// Length of the crank.
    crank: Quantity = Quantity::new(&q::LENGTH, Within(1e-3, 0.1), Is(12.5e-3));
    /// Length of the connecting rod, longer than the crank.
    rod: Quantity = Quantity::new(&q::LENGTH, Within(2e-3, 0.12), Is(58e-3));
    /// The part of the radius that the crank does not move; the paper does not give it.
    offset: Quantity = Quantity::new(&q::LENGTH, UpTo(0.05), Is(0.0));
    /// Mass of the segment (assumed; the paper gives none).
    mass: Quantity = Quantity::new(&q::MASS, Within(1e-3, 10.0), Is(0.05));
    /// Acceleration by gravity, downward along y.
    gravity: Quantity = Quantity::new(&q::ACCELERATION, UpTo(1e4), Is(STANDARD_GRAVITY_M_PER_S2));
    /// The energies: those of a point mass at the tip, or the published ones, whose dimensions do not agree.
    energies: Choice<Form> = Choice::new(
        || vec![("corrected", Form::Corrected), ("published", Form::Literal)], Is(Form::Corrected));
    /// The constant length of the published energies (assumed).
    length: Quantity = Quantity::new(&q::LENGTH, Within(1e-3, 1.0), Is(58e-3));
}

keys! { tilt_servo: "tilt_servo" of [];
    /// Torque at full drive and no speed; a Dynamixel RX-64 has 5.3 N.m.
    stall_torque: Quantity = Quantity::new(&q::TORQUE, Within(1e-3, 1e3), Is(5.3));
    /// Speed at full drive and no load, to which the torque falls in a straight line; an RX-64 has 64 rpm.
    no_load_speed: Quantity = Quantity::new(&q::ANGULAR_SPEED, Within(1e-2, 1e3), Is(6.702));
    /// Inertia of rotor and gears at the output (assumed).
    inertia: Quantity = Quantity::new(&q::INERTIA, UpTo(1.0), Is(4e-3));
    /// Coulomb friction at the output (assumed: none).
    coulomb: Quantity = Quantity::new(&q::TORQUE, UpTo(1e2), Is(0.0));
    /// Rate at which the bus reads the positions of all servos and writes the drives of these two.
    rate: Quantity = Quantity::new(&q::FREQUENCY, Within(1.0, 1e6), Is(1e3));
}

keys! { crank_servo: "crank_servo" of [];
    /// Torque at full drive and no speed; 0.118 N.m for a Savox SH-0262MG at 6 V.
    stall_torque: Quantity = Quantity::new(&q::TORQUE, Within(1e-3, 1e3), Is(0.118));
    /// Speed at full drive and no load, to which the torque falls in a straight line; an SH-0262MG has 167 rpm.
    no_load_speed: Quantity = Quantity::new(&q::ANGULAR_SPEED, Within(1e-2, 1e3), Is(17.49));
    /// Inertia of rotor and gears at the output (assumed).
    inertia: Quantity = Quantity::new(&q::INERTIA, UpTo(1.0), Is(1e-4));
    /// Coulomb friction at the output (assumed: none).
    coulomb: Quantity = Quantity::new(&q::TORQUE, UpTo(1e2), Is(0.0));
    /// Rate of the pulses that carry the drive.
    rate: Quantity = Quantity::new(&q::FREQUENCY, Within(1.0, 1e6), Is(250.0));
}

scene! { force_sensor: "force_sensor" of [];
    /// The sensor of the finger's force, with its converter of 12 bits.
    #[derive(Clone, Copy, PartialEq, Debug)]
    pub struct ForceSensor {
        /// Force of all ones; the word has 12 bits.
        full_scale_n: f64 = full_scale: Quantity = Quantity::new(&q::FORCE, Within(1e-2, 1e4), Is(10.0));
        /// Root mean square of the noise (assumed).
        noise_n: f64 = noise: Quantity = Quantity::new(&q::FORCE, UpTo(10.0), Is(5e-3));
        /// Rate of the conversions.
        rate_hz: f64 = rate: Quantity = Quantity::new(&q::FREQUENCY, Within(1.0, 1e6), Is(1e3));
    }
}

keys! { method_gimbal: "method" of ["gimbal"];
    /// Rate at which the loop samples.
    sample_rate: Quantity = Quantity::new(&q::FREQUENCY, Within(1.0, 1e6), Is(1e3));
    /// Gain of the error of pitch and roll, in full drives per radian; the paper has K1 = 1.5 without a unit.
    proportional: Quantity = Quantity::new(&q::RATIO, UpTo(1e3), Is(1.5));
    /// Gain of the change of that error, in full drives per rad/s; the paper has K2 = 2.8 without a unit.
    derivative: Quantity = Quantity::new(&q::RATIO, UpTo(1e3), Is(0.0));
    /// The same as `proportional` for the crank.
    crank_proportional: Quantity = Quantity::new(&q::RATIO, UpTo(1e3), Is(1.5));
    /// The same as `derivative` for the crank.
    crank_derivative: Quantity = Quantity::new(&q::RATIO, UpTo(1e3), Is(0.0));
    /// Samples over which the change of an error is taken.
    derivative_window: Whole<u32> = Whole::new(1, 64, Is(64));
    /// Gain of the force's error in impedance control, Kf; the paper has 2 to 10.
    force_gain: Quantity = Quantity::new(&q::RATIO, UpTo(15.0), Is(4.0));
}

keys! { surface: "surface" of [];
    /// Stiffness of the spring that the finger feels; the paper has 0.75 to 2 N/mm.
    stiffness: Quantity = Quantity::new(&q::STIFFNESS, NotNegative, Is(1e3));
}

keys! { switch: "switch" of [];
    /// Force above which the finger probes, and impedance control has the crank (assumed: the paper has no threshold).
    on: Quantity = Quantity::new(&q::FORCE, UpTo(1e4), Is(0.5));
    /// Force below which position control has it again; the same as `on` is a switch without hysteresis.
    off: Quantity = Quantity::new(&q::FORCE, UpTo(1e4), Said("that of switch.on"));
    /// Takes the radius at the switch as the spring's rest, and not the target's.
    latched: Flag = Flag(false);
    /// Keeps the drive at the switch by an offset that decays.
    bumpless: Flag = Flag(false);
    /// The offset loses a share of 2^-decay at every sample.
    decay: Whole<u32> = Whole::new(0, 15, Is(4));
}

keys! { shear: "shear" of [];
    /// Order of the fractional derivative that the stress is of the motion; the datapath takes the nearest fraction
    /// with a denominator of at most 1000.
    order: Quantity = Quantity::new(&q::RATIO, Within(*Shear::ORDERS.start(), *Shear::ORDERS.end()), Required);
    /// Viscosity of the object, in Pa·s to the power of the order: a motion of 1 rad/s has the stress that it has in a
    /// Newtonian fluid of as many Pa·s.
    viscosity: Quantity = Quantity::new(&q::VISCOSITY, NotNegative, Required);
    /// Thickness of the object's layer that the motion shears (assumed).
    layer: Quantity = Quantity::new(&q::LENGTH, Within(1e-6, 1.0), Is(10e-3));
    /// Area in which the finger touches the segment; the paper measured 3 cm2.
    area: Quantity = Quantity::new(&q::AREA, Within(1e-8, 1.0), Is(3e-4));
    /// Stiffness of the finger's skin along the segment (assumed).
    skin: Quantity = Quantity::new(&q::STIFFNESS, Within(1.0, 1e6), Is(500.0));
    /// Samples that count in the derivative; it leaves out those before.
    memory: Whole<u32> = Whole::new(2, 254, Is(254));
}

keys! { target: "target" of ["path", "sines", "random"];
    /// Kind of the motion: along points, a sum of sines, or random points with a smooth motion between them.
    kind: Choice<TargetKind> = Choice::new(|| named(&TargetKind::ALL, TargetKind::name), Required);
}

keys! { target_rate: "target" of ["path", "sines", "random"];
    /// Rate at which the host writes the target's words.
    rate: Quantity = Quantity::new(&q::FREQUENCY, Within(1.0, 1e6), Is(1e3));
}

keys! { target_path: "target" of ["path"];
    /// Points in the order of time, straight between two and constant after the last. Heights are above the lowest
    /// radius of the segment.
    path: Own = Own::new(|| Takes::Own(Shape::List, TARGET_PATH), Required);
}

keys! { target_middle: "target" of ["sines", "random"];
    /// Height of the middle of the motion.
    middle: Quantity = Quantity::new(&q::LENGTH, Within(1e-4, 0.2), Is(12.5e-3));
}

keys! { target_sines: "target" of ["sines"];
    /// Sines of the height, which begin at 0.
    height: Own = Own::new(|| Takes::Own(Shape::List, LENGTH_WAVES), Said("none"));
    /// Sines of the pitch.
    pitch: Own = Own::new(|| Takes::Own(Shape::List, ANGLE_WAVES), Said("none"));
    /// Sines of the roll.
    roll: Own = Own::new(|| Takes::Own(Shape::List, ANGLE_WAVES), Said("none"));
}

keys! { target_random: "target" of ["random"];
    /// Time from point to point; the motion rests for an instant at each.
    interval: Quantity = Quantity::new(&q::TIME, Within(1e-3, 1e3), Is(1.0));
    /// Range of the heights, around the middle.
    height_range: Quantity = Quantity::new(&q::LENGTH, UpTo(0.2), Is(12e-3));
    /// Greatest pitch and roll to either side.
    tilt: Quantity = Quantity::new(&q::ANGLE, UpTo(0.96), Is(30.0 * std::f64::consts::PI / 180.0));
    /// Number of the profile; with `run.seed` it decides the points.
    profile: Whole<u64> = Whole::new(0, i64::MAX as u64, Is(1));
}

keys! { finger: "finger" of [];
    /// Stiffness of the finger's pad (assumed).
    stiffness: Quantity = Quantity::new(&q::STIFFNESS, Within(1.0, 1e6), Is(1.5e3));
    /// Damping of the finger's pad (assumed).
    damping: Quantity = Quantity::new(&q::DAMPING, UpTo(1e3), Is(2.0));
    /// Height of the finger, its pad at rest, above the lowest radius of the segment: points in the order of time,
    /// straight between two and constant after the last.
    path: Own = Own::new(|| Takes::Own(Shape::List, FINGER_PATH), Required);
    /// Greatest speed of the finger: the path is walked faster or slower, so that its fastest stretch has this speed.
    speed: Quantity = Quantity::new(&q::SPEED, Positive, Said("as the path has it"));
}

keys! { model_gimbal: "model" of ["gimbal"];
    /// How the device is advanced: exactly from event to event, exactly at every clock cycle, or by a textbook method
    /// in steps.
    solver: Choice<Solver> = Choice::new(|| {
        let all = [Solver::Events, Solver::Clock, Solver::Euler, Solver::SemiImplicit, Solver::Midpoint, Solver::Rk4];
        named(&all, Solver::name)
    }, Is(Solver::Events));
    /// Step of a fixed-step solver, rounded to whole clock cycles; required by it.
    step: Quantity = Quantity::new(&q::TIME, Positive, Said("none"));
}

keys! { record_gimbal: "record" of ["gimbal"];
    /// Rate at which the device's motion is recorded.
    plant_rate: Quantity = Quantity::new(&q::FREQUENCY, Positive, Is(1e3));
}

keys! { expect_gimbal: "expect" of ["gimbal"];
    /// Verdict that the run must reach: the segment follows a moving target to the end, comes to rest at a fixed one,
    /// keeps a limit cycle there, or diverges; the run is too short to tell (`not_told`), or the finger moves nearly to
    /// its end (`hand_moves`).
    outcome: Choice<OutcomeKind> = Choice::new(|| {
        use OutcomeKind::{Diverged, HandMoves, LimitCycle, NotTold, Settled, Tracking};
        named(&[Tracking, Settled, LimitCycle, Diverged, NotTold, HandMoves], OutcomeKind::name)
    }, Said("not judged"));
    /// Root mean square of the distance between tip and target in the judged window.
    rms: Expected = Expected::new(&q::LENGTH, NotNegative);
    /// Amplitude of the limit cycle of the radius.
    amplitude: Expected = Expected::new(&q::LENGTH, NotNegative);
}

keys! { accuracy_gimbal: "accuracy" of ["gimbal"];
    /// Outputs that must agree.
    outputs: OfOutputs = OfOutputs(&OUTPUTS);
}

/// All of them.
pub(crate) const KEYS: DeviceKeys = DeviceKeys {
    first: &[],
    top: &[&top_gimbal::GROUP],
    device: &[&gimbal::GROUP, &tilt_servo::GROUP, &crank_servo::GROUP, &force_sensor::GROUP, &shear::GROUP],
    parts: &[],
    method: &[&method_gimbal::GROUP],
    motion: &[
        &target::GROUP,
        &target_rate::GROUP,
        &target_path::GROUP,
        &target_middle::GROUP,
        &target_sines::GROUP,
        &target_random::GROUP,
        &surface::GROUP,
        &switch::GROUP,
        &finger::GROUP,
    ],
    walls: &[],
    model: &[&model_gimbal::GROUP],
    record: &[&record_gimbal::GROUP],
    expect: &[&expect_gimbal::GROUP],
    accuracy: &[&accuracy_gimbal::GROUP],
    own_kinds: &["target"],
};
