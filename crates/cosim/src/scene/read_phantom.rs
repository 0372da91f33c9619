//! Reading a scene of a PHANToM.

use hpu_datapath::phantom::PhantomConfig;
use hpu_plant::arm::{ArmModel, kinematics};

use crate::arm_world::is_singular;
use crate::message::number;

use super::accuracy::{Output, accuracy};
use super::expect::{Expect, Expectation, Metric, OutcomeKind};
use super::model::Solver;
use super::parameter::{Origin, ParameterValue};
use super::phantom::{
    Direction, Drop, Irregularity, PhantomLaw, PhantomMethod, PhantomModel, PhantomScene, Platform, Premium, Room,
};
use super::quantity as q;
use super::read::{clock, record, run, scene_name};
use super::read_model::step;
use super::section::Section;
use super::section::Sense::{Any, NotNegative, Positive, UpTo, Within};
use super::source::{SceneError, Source};

pub(super) fn phantom_scene(file: &str, source: Source) -> Result<PhantomScene, SceneError> {
    let root = source.root();
    root.accept(&[
        "about", "device", "drop", "platform", "clock", "method", "room", "model", "run", "record", "expect",
        "accuracy",
    ])?;
    let about = root.text("about", "a few sentences that say what to look for")?.trim().to_string();
    let clock = clock(&root.section("clock")?)?;
    let (platform, irregularity) = platform(&root.section("platform")?)?;
    let device = root.section("device")?;
    let drop = drop(&device, &root.section("drop")?)?;
    let mut scene = PhantomScene {
        name: scene_name(file),
        about,
        drop,
        platform,
        irregularity,
        clock,
        method: method(&root.section("method")?, &drop)?,
        room: room(&root.section("room")?, drop.axis)?,
        model: model(&root.section("model")?)?,
        run: run(&root.section("run")?, clock)?,
        record: record(&root.section("record")?, 1e3)?,
        expect: expect(&root.section("expect")?)?,
        accuracy: accuracy(&root.section("accuracy")?, &Output::OF_A_PHANTOM)?,
        auto: source.auto,
        parameters: [].into(),
        places: source.places.clone(),
    };
    scene.parameters = source.parameters.take(&unused(&scene)).into();
    agree(&scene)?;
    Ok(scene)
}

/// Returns the sections and keys that are read but that no run of the scene uses.
fn unused(scene: &PhantomScene) -> Vec<&'static str> {
    let mut unused = vec!["about", "expect", "accuracy"];
    if scene.platform != Platform::Pmos1 {
        unused.extend(["platform.jitter", "platform.missed"]);
    }
    if scene.model.transmission_n_per_m == 0.0 {
        unused.extend(["model.transmission_damping", "model.motor_share"]);
    }
    if !scene.platform.is_host() {
        unused.extend(["model.delay", "model.latency"]);
    }
    unused
}

/// Checks that the tip can reach every wall that is present, within the tables and the joints' limits.
fn reachable(scene: &PhantomScene) -> Result<(), SceneError> {
    let half = f64::from(1u32 << (scene.method.config.depth_width - 1));
    let walls = Direction::ALL.into_iter().filter(|direction| scene.room.walls[direction.index()]);
    for (direction, sign) in walls.flat_map(|direction| [(direction, -1.0), (direction, 1.0)]) {
        let mut tip_m = [0.0; 3];
        tip_m[direction.index()] = sign * scene.room.distance_m;
        let refuse = |why: &str| {
            let reason = format!(
                "the tip cannot come to the wall at {} = {} m: {why}",
                direction.name(),
                number(tip_m[direction.index()])
            );
            scene.places.error("room.distance", reason)
        };
        let Some(angles_rad) = kinematics::angles_rad(scene.drop.lengths_m, tip_m) else {
            return Err(refuse("the links do not reach it; write less"));
        };
        if is_singular(scene.drop.lengths_m, angles_rad) {
            return Err(refuse("the arm is singular there; write less"));
        }
        if scene.drop.premium == Premium::OneFive && !kinematics::within_limits_1_5(angles_rad) {
            return Err(refuse("a joint is beyond its limits; write less"));
        }
        let counts = scene.method.config.turns.iter().zip(angles_rad).map(|(turn, angle_rad)| {
            angle_rad / (2.0 * std::f64::consts::PI) * f64::from(turn.den) / f64::from(turn.num)
        });
        if counts.into_iter().any(|count| count.abs() >= half) {
            return Err(refuse("a joint is outside of the tables of sines; write less, or more method.depth_bits"));
        }
    }
    Ok(())
}

/// Checks the conditions between the parts of a scene.
fn agree(scene: &PhantomScene) -> Result<(), SceneError> {
    scene.words()?;
    reachable(scene)?;
    let (period, config) = (scene.period_clocks(), &scene.method.config);
    let least = if scene.method.shared { 40 } else { u64::from(config.delay) + 1 };
    if !scene.platform.is_host() && period < least {
        let most_hz = scene.clock.frequency_hz() / least;
        let reason = format!(
            "{} samples every {period} clocks, but this design takes {least}; the clock allows {most_hz} Hz",
            scene.platform.name()
        );
        return Err(scene.places.error("clock.frequency", reason));
    }
    if period < 2 {
        let reason = format!("{} needs a clock of {} Hz or more", scene.platform.name(), 2 * scene.platform.rate_hz());
        return Err(scene.places.error("clock.frequency", reason));
    }
    Ok(())
}

fn drop(device: &Section, s: &Section) -> Result<Drop, SceneError> {
    device.accept(&["kind", "model", "upper_arm", "forearm", "coulomb_force", "viscous_damping"])?;
    s.accept(&["axis", "weight", "speed", "trial"])?;
    let axes = Direction::ALL.map(|axis| (axis.name(), axis));
    let arms = [("premium_1.0", Premium::OneZero), ("premium_1.5", Premium::OneFive)];
    let premium = device.choice("model", &arms, Some(Premium::OneZero))?;
    let (premium_name, _) = arms[usize::from(premium == Premium::OneFive)];
    let mut lengths_m = match premium {
        Premium::OneZero => ArmModel::premium_1_0().lengths_m,
        Premium::OneFive => ArmModel::premium_1_5().lengths_m,
    };
    for (key, length_m) in ["upper_arm", "forearm"].into_iter().zip(&mut lengths_m) {
        if device.has(key) && premium == Premium::OneFive {
            return Err(
                device.error(key, "the Premium 1.5 has its own; leave this out, or write model = \"premium_1.0\"")
            );
        }
        *length_m = device.quantity(key, &q::LENGTH, Positive, Some(*length_m))?;
        device.note(key, ParameterValue::Number(*length_m), q::LENGTH.si_unit(), Origin::Arm(premium_name));
        if !(0.02..=0.5).contains(length_m) {
            return Err(device.error(key, format!("{} m: links of 20 mm to 500 mm are accepted", number(*length_m))));
        }
    }
    Ok(Drop {
        premium,
        lengths_m,
        coulomb_n: device.quantity("coulomb_force", &q::FORCE, UpTo(100.0), Some(0.038))?,
        damping_n_s_per_m: device.quantity("viscous_damping", &q::DAMPING, UpTo(100.0), Some(0.005))?,
        axis: s.choice("axis", &axes, None)?,
        weight_n: s.quantity("weight", &q::FORCE, UpTo(100.0), Some(0.15))?,
        speed_m_per_s: s.quantity("speed", &q::SPEED, UpTo(100.0), Some(0.0))?,
        trial: s.integer("trial", 0, i64::MAX as u64, Some(1))?,
    })
}

fn platform(s: &Section) -> Result<(Platform, Irregularity), SceneError> {
    s.accept(&["kind", "jitter", "missed"])?;
    let kind = s.choice("kind", &Platform::ALL.map(|platform| (platform.name(), platform)), None)?;
    for key in ["jitter", "missed"] {
        if s.has(key) && kind != Platform::Pmos1 {
            return Err(s.error(key, "only PMOS-1 has it; leave it out"));
        }
    }
    let irregularity = Irregularity {
        jitter_s: s.quantity("jitter", &q::TIME, NotNegative, Some(100e-6))?,
        missed: s.quantity("missed", &q::RATIO, NotNegative, Some(0.002))?,
    };
    if irregularity.jitter_s > 0.9e-3 {
        return Err(s.error("jitter", "a sample may be late by at most 0.9 ms of its 1 ms"));
    }
    if irregularity.missed > 0.5 {
        return Err(s.error("missed", "at most half of the samples may be missed"));
    }
    Ok((kind, irregularity))
}

fn method(s: &Section, drop: &Drop) -> Result<PhantomMethod, SceneError> {
    let premium = drop.premium;
    s.accept(&["architecture", "words", "depth_bits"])?;
    let arm = match premium {
        Premium::OneZero => PhantomConfig::default(),
        Premium::OneFive => PhantomConfig::premium_1_5(),
    };
    let shared = s.choice("architecture", &[("parallel", false), ("shared", true)], Some(false))?;
    let words = [("fitted", Words::Fitted), ("narrow", Words::Narrow), ("plain_q22", Words::PlainQ22)];
    let config = match s.choice("words", &words, Some(Words::Fitted))? {
        Words::Fitted => arm,
        Words::Narrow => arm.narrow(),
        Words::PlainQ22 if premium == Premium::OneFive => {
            return Err(
                s.error("words", "\"plain_q22\" is there for the Premium 1.0 alone; write \"fitted\" or \"narrow\"")
            );
        }
        Words::PlainQ22 => PhantomConfig::plain_q22(),
    };
    let depth_width = s.bits_within("depth_bits", 4..=15, 13)?;
    let length_lsbs = f64::from(config.formats.length_frac).exp2();
    let lengths = drop.lengths_m.map(|length_m| (length_m * length_lsbs).round() as u32);
    let config = PhantomConfig { depth_width, lengths, ..config };
    Ok(PhantomMethod { shared, config: if shared { config.shared() } else { config } })
}

#[derive(Clone, Copy, PartialEq)]
enum Words {
    Fitted,
    Narrow,
    PlainQ22,
}

fn room(s: &Section, axis: Direction) -> Result<Room, SceneError> {
    s.accept(&["distance", "stiffness", "walls"])?;
    let mut walls = Direction::ALL.map(|direction| direction == axis);
    if s.has("walls") {
        let text = s.text("walls", "the directions that have walls, as in \"y\" or \"xyz\"")?;
        walls = Direction::ALL.map(|direction| text.contains(direction.name()));
        if text.is_empty() || text.chars().any(|c| !"xyz".contains(c)) {
            return Err(s.error("walls", format!("`{text}` is not made of x, y, z")));
        }
    }
    let distance_m = s.quantity("distance", &q::LENGTH, Any, Some(0.02))?;
    if distance_m <= 0.0 {
        let reason = format!(
            "the walls of a pair stand at -distance and distance; {} m turns the room inside out",
            number(distance_m)
        );
        return Err(s.error("distance", reason));
    }
    Ok(Room { distance_m, stiffness_n_per_m: s.quantity("stiffness", &q::STIFFNESS, NotNegative, None)?, walls })
}

fn model(s: &Section) -> Result<PhantomModel, SceneError> {
    s.accept(&[
        "solver",
        "step",
        "law",
        "joints",
        "friction",
        "delay",
        "latency",
        "amplifier_lag",
        "transmission_stiffness",
        "transmission_damping",
        "motor_share",
    ])?;
    let delay_samples = s.quantity("delay", &q::RATIO, NotNegative, Some(1.0))?;
    let law = s.choice("law", &PhantomLaw::ALL.map(|law| (law.name(), law)), Some(PhantomLaw::Words))?;
    let latency_s = s.quantity("latency", &q::TIME, NotNegative, Some(0.0))?;
    if latency_s > 0.1 {
        return Err(s.error("latency", "at most 100 ms"));
    }
    if delay_samples > 4.0 {
        return Err(s.error("delay", "at most 4 samples"));
    }
    let transmission_n_per_m = s.quantity("transmission_stiffness", &q::STIFFNESS, UpTo(1e7), Some(0.0))?;
    for key in ["transmission_damping", "motor_share"] {
        if s.has(key) && transmission_n_per_m == 0.0 {
            return Err(s.error(key, "a rigid transmission has none; write transmission_stiffness too"));
        }
    }
    let motor_share = s.quantity("motor_share", &q::RATIO, Within(1e-3, 1.0), Some(0.5))?;
    if motor_share >= 1.0 {
        return Err(s.error("motor_share", "below 1: the arm has some of the mass"));
    }
    let solvers = [Solver::Events, Solver::Clock, Solver::Euler, Solver::SemiImplicit, Solver::Midpoint, Solver::Rk4];
    let solver = s.choice("solver", &solvers.map(|solver| (solver.name(), solver)), Some(Solver::Events))?;
    Ok(PhantomModel {
        solver,
        step_s: step(s, solver)?,
        law,
        tested_joint_only: s.choice("joints", &[("all", false), ("tested", true)], Some(false))?,
        friction: s.flag("friction", true)?,
        delay_samples,
        latency_s,
        amplifier_lag_s: s.quantity("amplifier_lag", &q::TIME, UpTo(100.0), Some(0.0))?,
        transmission_n_per_m,
        transmission_n_s_per_m: s.quantity("transmission_damping", &q::DAMPING, UpTo(1e3), Some(0.1))?,
        motor_share,
    })
}

fn expect(s: &Section) -> Result<Expect, SceneError> {
    s.accept(&["outcome", Metric::Rms.name()])?;
    let outcomes = [
        ("passive", Some(OutcomeKind::Passive)),
        ("non_passive", Some(OutcomeKind::NonPassive)),
        ("highly_unstable", Some(OutcomeKind::HighlyUnstable)),
    ];
    let mut numbers = Vec::new();
    if s.has(Metric::Rms.name()) {
        let number = s.section(Metric::Rms.name())?;
        number.accept(&["value", "tolerance"])?;
        numbers.push(Expectation {
            metric: Metric::Rms,
            value: number.quantity("value", &q::LENGTH, NotNegative, None)?,
            tolerance: number.quantity("tolerance", &q::LENGTH, NotNegative, None)?,
        });
    }
    Ok(Expect { outcome: s.choice("outcome", &outcomes, Some(None))?, numbers })
}
