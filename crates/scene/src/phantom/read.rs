//! Reading a scene of a PHANToM.

use hpu_datapath::phantom::Config;
use hpu_plant::arm::{ArmModel, kinematics};

use crate::head::expect::expect;
use crate::head::expect::{Expect, Metric};
use crate::head::model::step;
use crate::head::{Own, about, clock};
use crate::phantom::rows::{self, Words};
use crate::phantom::{
    Direction, Drop, Irregularity, PhantomMethod, PhantomModel, PhantomScene, Platform, Premium, Room,
};
use crate::schema::parameter::Origin;
use crate::schema::section::Section;
use crate::schema::source::{SceneError, Source};
use crate::text::message::number;

/// The head of a scene of a PHANToM.
const OWN: Own = Own {
    kind: "phantom",
    plant_rate: &rows::record_phantom::plant_rate,
    expect: phantom_expect,
    outputs: &rows::accuracy_phantom::outputs,
};

pub(crate) fn scene(file: &str, source: &Source) -> Result<PhantomScene, SceneError> {
    let root = Section::root(source);
    root.accept(&["phantom"])?;
    let about = about(&root)?;
    let clock = clock(&root.section("clock")?)?;
    let (platform, irregularity) = platform(&root.section("platform")?)?;
    let device = root.section("device")?;
    let drop = drop(&device, &root.section("drop")?)?;
    let mut scene = PhantomScene {
        drop,
        platform,
        irregularity,
        method: method(&root.section("method")?, &drop)?,
        room: room(&root.section("room")?, drop.axis)?,
        model: model(&root.section("model")?)?,
        head: OWN.head(file, source, &root, (about, clock))?,
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

impl PhantomScene {
    /// Checks that the tip can reach every wall that is present, within the tables and the joints' limits.
    ///
    /// # Errors
    ///
    /// [`SceneError`] at `room.distance`.
    pub fn check_reach(&self) -> Result<(), SceneError> {
        reachable(self)
    }
}

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
        if kinematics::is_singular(scene.drop.lengths_m, angles_rad) {
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
    use rows::{drop as key, phantom as of_the_arm};
    device.accept(&["phantom"])?;
    s.accept(&[])?;
    let premium = device.read(&of_the_arm::model)?;
    let premium_name = of_the_arm::model.value.name_of(premium).unwrap_or_default();
    let mut lengths_m = match premium {
        Premium::OneZero => ArmModel::premium_1_0().lengths_m,
        Premium::OneFive => ArmModel::premium_1_5().lengths_m,
    };
    for (key, length_m) in [&of_the_arm::upper_arm, &of_the_arm::forearm].into_iter().zip(&mut lengths_m) {
        if device.has(key.name) && premium == Premium::OneFive {
            let reason = "the Premium 1.5 has its own; leave this out, or write model = \"premium_1.0\"";
            return Err(device.error(key.name, reason));
        }
        *length_m = device.read_or(key, *length_m, Origin::Arm(premium_name))?;
    }
    Ok(Drop {
        premium,
        lengths_m,
        coulomb_n: device.read(&of_the_arm::coulomb_force)?,
        damping_n_s_per_m: device.read(&of_the_arm::viscous_damping)?,
        gravity_m_per_s2: device.read(&of_the_arm::gravity)?,
        axis: s.read(&key::axis)?,
        weight_n: s.read(&key::weight)?,
        speed_m_per_s: s.read(&key::speed)?,
        trial: s.read(&key::trial)?,
    })
}

fn platform(s: &Section) -> Result<(Platform, Irregularity), SceneError> {
    use rows::platform as key;
    s.accept(&[])?;
    let kind = s.read(&key::kind)?;
    for key in [&key::jitter, &key::missed] {
        if s.has(key.name) && kind != Platform::Pmos1 {
            return Err(s.error(key.name, "only PMOS-1 has it; leave it out"));
        }
    }
    Ok((kind, Irregularity { jitter_s: s.read(&key::jitter)?, missed: s.read(&key::missed)? }))
}

fn method(s: &Section, drop: &Drop) -> Result<PhantomMethod, SceneError> {
    use rows::method_phantom as key;
    let premium = drop.premium;
    s.accept(&["phantom"])?;
    let arm = match premium {
        Premium::OneZero => Config::default(),
        Premium::OneFive => Config::premium_1_5(),
    };
    let shared = s.read(&key::architecture)?;
    let config = match s.read(&key::words)? {
        Words::Fitted => arm,
        Words::Narrow => arm.narrow(),
        Words::PlainQ22 if premium == Premium::OneFive => {
            return Err(
                s.error("words", "\"plain_q22\" is there for the Premium 1.0 alone; write \"fitted\" or \"narrow\"")
            );
        }
        Words::PlainQ22 => Config::plain_q22(),
    };
    let depth_width = s.read(&key::depth_bits)?;
    let length_lsbs = libm::exp2(f64::from(config.formats.length_frac));
    let lengths = drop.lengths_m.map(|length_m| (length_m * length_lsbs).round() as u32);
    let config = Config { depth_width, lengths, ..config };
    Ok(PhantomMethod { shared, config: if shared { config.shared() } else { config } })
}

fn room(s: &Section, axis: Direction) -> Result<Room, SceneError> {
    use rows::room as key;
    s.accept(&[])?;
    let mut walls = Direction::ALL.map(|direction| direction == axis);
    if let Some(text) = s.given(&key::walls)? {
        walls = Direction::ALL.map(|direction| text.contains(direction.name()));
        if text.chars().any(|c| !"xyz".contains(c)) {
            return Err(s.error(key::walls.name, format!("`{text}` is not made of x, y, z")));
        }
    }
    Ok(Room { distance_m: s.read(&key::distance)?, stiffness_n_per_m: s.read(&key::stiffness)?, walls })
}

fn model(s: &Section) -> Result<PhantomModel, SceneError> {
    use rows::model_phantom as key;
    s.accept(&["phantom"])?;
    let transmission_n_per_m = s.read(&key::transmission_stiffness)?;
    for key in [&key::transmission_damping, &key::motor_share] {
        if s.has(key.name) && transmission_n_per_m == 0.0 {
            return Err(s.error(key.name, "a rigid transmission has none; write transmission_stiffness too"));
        }
    }
    let solver = s.read(&key::solver)?;
    Ok(PhantomModel {
        solver,
        step_s: step(s, &key::step, solver)?,
        law: s.read(&key::law)?,
        tested_joint_only: s.read(&key::joints)?,
        friction: s.read(&key::friction)?,
        delay_samples: s.read(&key::delay)?,
        latency_s: s.read(&key::latency)?,
        amplifier_lag_s: s.read(&key::amplifier_lag)?,
        transmission_n_per_m,
        transmission_n_s_per_m: s.read(&key::transmission_damping)?,
        motor_share: s.read(&key::motor_share)?,
    })
}

fn phantom_expect(s: &Section) -> Result<Expect, SceneError> {
    use rows::expect_drop as key;
    s.accept(&["phantom"])?;
    expect(s, &[(Metric::Rms, &key::rms)], &key::outcome)
}
