//! The keys of a scene of a PHANToM.

use crate::head::accuracy::OfOutputs;
use crate::head::model::Solver;
use crate::head::outcome::OutcomeKind;
use crate::phantom::{Direction, OUTPUTS, PhantomLaw, Platform, Premium};
use crate::schema::Otherwise::{Is, Required, Said};
use crate::schema::quantity::Sense::{NotNegative, Positive, UpTo, Within};
use crate::schema::quantity::{self as q, STANDARD_GRAVITY_M_PER_S2};
use crate::schema::{Choice, DeviceKeys, Expected, Flag, Group, Key, Own, Quantity, Text, Whole, keys, named};
use crate::text::message::number;

/// The length of one of the arm's links.
const LINK: Quantity = Quantity::new(&q::LENGTH, Within(0.02, 0.5), Said("140 mm of a premium_1.0, else the arm's"))
    .refusing(|m| (m > 0.0).then(|| format!("{} m: links of 20 mm to 500 mm are accepted", number(m))));

hpu_signal::named! {
    /// The word formats that a scene can choose.
    #[derive(Clone, Copy, PartialEq)]
    pub(crate) enum Words {
        Fitted = "fitted",
        Narrow = "narrow",
        PlainQ22 = "plain_q22",
    }
}

/// The words for a value above the greatest.
macro_rules! above {
    ($words:literal) => {
        |value| (value > 0.0).then(|| $words.into())
    };
}

keys! { phantom: "device" of ["phantom"];
    /// The arm.
    model: Choice<Premium> = Choice::new(|| named(&Premium::ALL, Premium::name), Is(Premium::OneZero));
    /// Length of the upper arm; a `premium_1.5` has its own.
    upper_arm: Quantity = LINK;
    /// Length of the forearm; a `premium_1.5` has its own.
    forearm: Quantity = LINK;
    /// Coulomb friction, as felt at the tip.
    coulomb_force: Quantity = Quantity::new(&q::FORCE, UpTo(100.0), Is(0.038));
    /// Viscous friction, as felt at the tip.
    viscous_damping: Quantity = Quantity::new(&q::DAMPING, UpTo(100.0), Is(0.005));
    /// Acceleration by gravity along drop.axis; the tip's mass is drop.weight over it.
    gravity: Quantity = Quantity::new(&q::ACCELERATION, Within(1e-3, 1e4), Is(STANDARD_GRAVITY_M_PER_S2));
}

keys! { drop: "drop" of [];
    /// Direction along which gravity pulls, toward negative values.
    axis: Choice<Direction> = Choice::new(|| named(&Direction::ALL, Direction::name), Required);
    /// Weight of the tip on a scale.
    weight: Quantity = Quantity::new(&q::FORCE, UpTo(100.0), Is(0.15));
    /// Speed at which the tip is thrown at the wall.
    speed: Quantity = Quantity::new(&q::SPEED, UpTo(100.0), Is(0.0));
    /// Number of the trial; with `run.seed` it decides the small variations of the release.
    trial: Whole<u64> = Whole::new(0, i64::MAX as u64, Is(1));
}

keys! { platform: "platform" of [];
    /// Platform that computes the force: a multitasking or a real-time operating system, or the FPGA; the number is its
    /// rate in kHz.
    kind: Choice<Platform> = Choice::new(|| named(&Platform::ALL, Platform::name), Required);
    /// Greatest lateness of a sample of `PMOS-1`.
    jitter: Quantity = Quantity::new(&q::TIME, UpTo(0.9e-3), Is(100e-6))
        .refusing(above!("a sample may be late by at most 0.9 ms of its 1 ms"));
    /// Share of the samples that `PMOS-1` misses.
    missed: Quantity = Quantity::new(&q::RATIO, UpTo(0.5), Is(0.002))
        .refusing(above!("at most half of the samples may be missed"));
}

keys! { method_phantom: "method" of ["phantom"];
    /// Hardware of its own for each operation, or one multiplier that all share.
    architecture: Choice<bool> = Choice::new(|| vec![("parallel", false), ("shared", true)], Is(false));
    /// Word formats of the datapath: fitted to the signals, narrow, or 22 fraction bits everywhere.
    words: Choice<Words> = Choice::new(|| named(&Words::ALL, Words::name), Is(Words::Fitted));
    /// Bits of the index into the tables of sines, which bound the joints' angles.
    depth_bits: Whole<u32> = Whole::bits(4, 15, 13);
}

keys! { room: "room" of [];
    /// Distance from the origin to each wall.
    distance: Quantity = Quantity::new(&q::LENGTH, Positive, Is(0.02)).refusing(|m| (m <= 0.0).then(|| format!(
        "the walls of a pair stand at -distance and distance; {} m turns the room inside out", number(m))));
    /// Stiffness of all walls.
    stiffness: Quantity = Quantity::new(&q::STIFFNESS, NotNegative, Required);
    /// Directions that have a pair of walls.
    walls: Text = Text("the directions that have walls, as in \"y\" or \"xyz\"", Said("that of drop.axis"));
}

keys! { model_phantom: "model" of ["phantom"];
    /// How the arm is advanced: exactly from event to event, exactly at every clock cycle, or by a textbook method in
    /// steps.
    solver: Choice<Solver> = Choice::new(|| {
        let all = [Solver::Events, Solver::Clock, Solver::Euler, Solver::SemiImplicit, Solver::Midpoint, Solver::Rk4];
        named(&all, Solver::name)
    }, Is(Solver::Events));
    /// Step of a fixed-step solver, rounded to whole clock cycles; required by it.
    step: Quantity = Quantity::new(&q::TIME, Positive, Said("none"));
    /// How the force is computed: as the platform does, in floats from the counts, or in floats from the true angles.
    law: Choice<PhantomLaw> = Choice::new(|| named(&PhantomLaw::ALL, PhantomLaw::name), Is(PhantomLaw::Words));
    /// Moves all joints, or only the one under test.
    joints: Choice<bool> = Choice::new(|| vec![("all", false), ("tested", true)], Is(false));
    /// Models Coulomb friction.
    friction: Flag = Flag(true);
    /// Delay of a host from sample to command, in samples.
    delay: Quantity = Quantity::new(&q::RATIO, UpTo(4.0), Is(1.0)).refusing(above!("at most 4 samples"));
    /// Delay of a host in addition, whatever its rate.
    latency: Quantity = Quantity::new(&q::TIME, UpTo(0.1), Is(0.0)).refusing(above!("at most 100 ms"));
    /// Time constant of the amplifier.
    amplifier_lag: Quantity = Quantity::new(&q::TIME, UpTo(100.0), Is(0.0));
    /// Stiffness of the transmission, as felt at the tip; 0 is rigid.
    transmission_stiffness: Quantity = Quantity::new(&q::STIFFNESS, UpTo(1e7), Is(0.0));
    /// Damping of a flexible transmission.
    transmission_damping: Quantity = Quantity::new(&q::DAMPING, UpTo(1e3), Is(0.1));
    /// Share of the apparent mass on the motor's side of a flexible transmission.
    motor_share: Quantity = Quantity::new(&q::RATIO, Within(1e-3, 1.0 - f64::EPSILON / 2.0), Is(0.5))
        .refusing(|share| (share >= 1.0).then(|| "below 1: the arm has some of the mass".into()));
}

keys! { top_phantom: "" of ["phantom"];
    /// How the tip is released.
    drop: Own = Own::section(Required);
    /// The platform that computes the force, and its rate.
    platform: Own = Own::section(Required);
}

keys! { top_room: "" of ["phantom"];
    /// The design of the arm's datapath.
    method: Own = Own::section(Said("its keys' defaults"));
    /// The walls around the tip.
    room: Own = Own::section(Required);
}

keys! { record_phantom: "record" of ["phantom"];
    /// Rate at which the arm's motion is recorded.
    plant_rate: Quantity = Quantity::new(&q::FREQUENCY, Positive, Is(1e3));
}

keys! { expect_drop: "expect" of ["phantom"];
    /// Verdict that the drop must reach: the tip rests on the wall, chatters on it, or the run is aborted.
    outcome: Choice<OutcomeKind> = Choice::new(|| {
        named(&[OutcomeKind::Passive, OutcomeKind::NonPassive, OutcomeKind::HighlyUnstable], OutcomeKind::name)
    }, Said("not judged"));
    /// Root mean square of the motion about its steady value at the end of the drop.
    rms: Expected = Expected::new(&q::LENGTH, NotNegative);
}

keys! { accuracy_phantom: "accuracy" of ["phantom"];
    /// Outputs that must agree.
    outputs: OfOutputs = OfOutputs(&OUTPUTS);
}

/// All of them.
pub(crate) const KEYS: DeviceKeys = DeviceKeys {
    first: &[&top_phantom::GROUP],
    top: &[&top_room::GROUP],
    device: &[&phantom::GROUP],
    parts: &[&drop::GROUP, &platform::GROUP],
    method: &[&method_phantom::GROUP],
    motion: &[],
    walls: &[&room::GROUP],
    model: &[&model_phantom::GROUP],
    record: &[&record_phantom::GROUP],
    expect: &[&expect_drop::GROUP],
    accuracy: &[&accuracy_phantom::GROUP],
    own_kinds: &[],
};
