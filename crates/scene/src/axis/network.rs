//! A device of bodies and joints, as scenes have it: `device.kind = "network"`.

use std::f64::consts::PI;
use std::mem;
use std::sync::Arc;

use hpu_plant::network::{Body, Feed, FeedKind, Joint, Network, NetworkError, Place, Sensed, Stop};
use hpu_plant::{Bridge, Push};
use hpu_signal::Clock;

use crate::axis::library::NamedPart;
use crate::axis::network_rows as keys;
use crate::axis::network_rows::DriveKind;
use crate::axis::parts::{Device, Encoder, Hand, Motor, PathPoint};
use crate::axis::rows::{Mass, encoder_part};
use crate::axis::sensors::{ENCODER, Reading, Sampled, Sensor, SensorKind, counts, encoder, names_of, one_of, sensors};
use crate::head::Units;
use crate::method::is_paddle;
use crate::schema::quantity::{Axis, RAIL, SHAFT};
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::schema::{Key, Quantity, Text};
use crate::text::message::{figure, number};

/// The name of a three-phase motor's own body.
const ROTOR: &str = "rotor";

/// A device of bodies and joints.
#[derive(Clone, PartialEq, Debug)]
pub struct Compound {
    /// Its bodies, joints and drive, without the hand.
    pub network: Network,
    /// The names of its bodies; those of the hand's own mass last.
    pub names: Vec<String>,
    /// Whether each body slides.
    pub slides: Vec<bool>,
    /// The converter before the reference of a current; `None` on a bridge.
    pub dac: Option<Dac>,
    /// The sensors beside the encoder that the logic counts.
    pub sensors: Vec<Sensor>,
    /// The index of the absolute one among them whose words the encoder's lines follow, if they do.
    pub followed: Option<usize>,
    /// Whether the last of its bodies is the hand's own mass.
    pub hand_has_mass: bool,
    /// The path of the hand, in units of the body that it holds.
    pub path: Vec<PathPoint>,
    /// Units of the body at the grip, and of the driven body, for one unit of the body with the encoder, all joints
    /// taken as rigid.
    pub grip_ratio: f64,
    /// Those of the driven body.
    pub drive_ratio: f64,
    /// The body in whose units the wall is given.
    pub wall_body: usize,
    /// Units of that body for one unit of the body with the encoder.
    pub wall_ratio: f64,
    /// The units of that body.
    pub wall_units: Units,
}

impl Compound {
    /// Moves the start of all bodies and the path of the hand by a distance of the body with the encoder, and the path
    /// to a later time; a hand without a path leaves it to the bodies to arrive later.
    pub fn shift(&mut self, aside: f64, late_s: f64) {
        let back = if self.path.is_empty() { late_s } else { 0.0 };
        let ratios: Vec<f64> = (0..self.network.bodies.len()).map(|body| self.network.ratio(body)).collect();
        for (body, ratio) in self.network.bodies.iter_mut().zip(ratios) {
            body.position += ratio * aside - back * body.speed;
        }
        for knot in &mut self.path {
            knot.time_s += if knot.time_s > 0.0 { late_s } else { 0.0 };
            knot.angle_rad += self.grip_ratio * aside;
        }
    }

    /// Returns the sensor whose words are the position, and the corner of its lag in rad/s, if it has one; `None` if
    /// lines are counted.
    pub fn word(&self) -> Option<(&Sampled, Option<f64>)> {
        match &self.sensors[self.followed?].kind {
            SensorKind::Sampled(word @ Sampled { reading: Reading::Position(index), .. }) => {
                Some((word, self.network.sensed[*index].lag_rad_per_s))
            }
            _ => None,
        }
    }

    /// Returns the name of the sensor whose words are the position; `None` if lines are counted.
    pub fn position(&self) -> Option<&str> {
        self.followed.map(|index| self.sensors[index].name.as_str())
    }

    /// Returns the name of the body in whose units the wall is given.
    pub fn wall_name(&self) -> &str {
        &self.names[self.wall_body]
    }

    /// Returns what a linear loop around the network leaves out beside Coulomb friction, each as text.
    pub fn left_out(&self) -> Vec<String> {
        let Network { joints, stops, feed, .. } = &self.network;
        let rigid = joints.iter().filter(|joint| joint.compliance.is_none()).map(|joint| {
            format!("the compliance of the joint from {} to {}", self.names[joint.from], self.names[joint.to])
        });
        let mut all: Vec<String> = rigid.collect();
        all.extend(stops.iter().map(|stop| format!("the stops of {}", self.names[stop.body])));
        all.extend(self.position().map(|name| format!("rate, latency, lag and errors of the sensor {name}")));
        if let FeedKind::Current { supply_v, .. } | FeedKind::Pi { supply_v, .. } = feed.kind
            && supply_v.is_finite()
        {
            all.push(format!("the limit of the supply, {} V", number(supply_v)));
        }
        if let Some(dac) = self.dac {
            let full = number(dac.full_scale_a);
            all.push(match dac.bits {
                Some(bits) => format!("the converter's {bits} bits and full scale, {full} A"),
                None => format!("the converter's full scale, {full} A"),
            });
        }
        all
    }

    /// Returns as text which joints bend; `None` if none does. The hand's own mass is none of the device's bodies.
    pub fn bends(&self) -> Option<String> {
        let own = self.network.bodies.len() - usize::from(self.hand_has_mass);
        let bending = self.network.joints.iter().filter(|joint| joint.compliance.is_some() && joint.to < own);
        let all: Vec<String> =
            bending.map(|joint| format!("{} to {}", self.names[joint.from], self.names[joint.to])).collect();
        (!all.is_empty()).then(|| format!("compliant from {}", all.join(", ")))
    }

    /// Returns as text how the drive's current differs from what is asked for; `None` if it follows at once.
    pub fn lags(&self) -> Option<String> {
        match self.network.feed.kind {
            FeedKind::Bridge(_) => Some("a winding behind a bridge".into()),
            FeedKind::Pi { .. } => Some("a current loop with a winding".into()),
            FeedKind::Current { bandwidth_rad_per_s, .. } => bandwidth_rad_per_s.is_finite().then(|| {
                let hertz = bandwidth_rad_per_s / (2.0 * PI);
                format!("a current that follows at {} Hz", figure(hertz))
            }),
        }
    }

    /// Returns as text which bodies have a return spring or a weight; `None` if none has.
    pub fn springs(&self) -> Option<String> {
        let held = self.network.bodies.iter().zip(&self.names).filter(|(body, _)| body.spring != 0.0);
        let all: Vec<&str> = held.map(|(_, name)| name.as_str()).collect();
        (!all.is_empty()).then(|| format!("a spring or weight at {}", all.join(", ")))
    }

    /// Returns the torque or force of an ampere at the body with the encoder, and the resistance, of a winding that a
    /// bridge drives; `None` of another drive.
    pub fn winding(&self) -> Option<(f64, f64)> {
        let feed = &self.network.feed;
        let wound = matches!(feed.kind, FeedKind::Bridge(_));
        wound.then_some((self.drive_ratio * feed.torque_constant, feed.resistance_ohm))
    }

    /// Returns the torque or force of a full command at the body with the encoder, all joints taken as rigid.
    pub(crate) fn stall(&self, bridge: Bridge) -> f64 {
        self.drive_ratio * self.network.feed.torque_constant * self.stall_a(bridge)
    }

    /// Returns the position of the body with the encoder at the start.
    pub(crate) fn start(&self) -> f64 {
        self.network.bodies[self.network.seen].position
    }

    /// Returns the current of a full command: the converter's, or what a bridge lets through a winding at rest.
    pub(crate) fn stall_a(&self, bridge: Bridge) -> f64 {
        let resistance_ohm = self.network.feed.resistance_ohm + 2.0 * bridge.on_resistance_ohm;
        self.dac.map_or(bridge.supply_v / resistance_ohm, |dac| dac.full_scale_a)
    }
}

/// A converter from words to a current.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Dac {
    /// The current of a full command.
    pub full_scale_a: f64,
    /// Its bits with the sign, if it has fewer than the command.
    pub bits: Option<u32>,
    /// Whether it rounds down, not to the nearest.
    pub floors: bool,
}

impl Dac {
    /// Returns the current for a command, where `2^width` is a full one: its upper bits, clamped to the converter's.
    pub fn current_a(&self, command: i64, width: u32) -> f64 {
        let word = match self.bits {
            Some(bits) if bits <= width => {
                let (step, most) = (1 << (width + 1 - bits), 1 << (bits - 1));
                let rounded = if self.floors { command } else { command + step / 2 };
                step * rounded.div_euclid(step).clamp(-most, most - 1)
            }
            _ => command,
        };
        word as f64 * self.full_scale_a * 0.5f64.powi(width.cast_signed())
    }
}

/// A network as it is read, before the scene's other parts.
pub(crate) struct Draft {
    names: Vec<String>,
    joint_names: Vec<String>,
    slides: Vec<bool>,
    network: Network,
    dac: Option<Dac>,
    units_at: usize,
    encoder: Encoder,
    sensors: Vec<Sensor>,
    followed: Option<usize>,
}

fn units(axis: &Axis) -> Units {
    let [position, effort, stiffness, damping] =
        [axis.position, axis.effort, axis.stiffness, axis.damping].map(|quantity| quantity.si);
    Units { position, effort, stiffness, damping }
}

fn axis_of(slides: bool) -> &'static Axis {
    if slides { &RAIL } else { &SHAFT }
}

/// Returns the index of the body that a key names.
fn body_of(s: &Section, key: &Key<Text>, names: &[String]) -> Result<usize, SceneError> {
    one_of(s, key, "body", names)
}

/// Reads bodies, joints and drive.
pub(crate) fn draft(root: &Section, clock: Clock) -> Result<Draft, SceneError> {
    let s = root.section("device")?;
    s.accept(&["network"])?;
    let all = s.section("bodies")?;
    let names = names_of(&all, "body")?;
    if names.is_empty() {
        return Err(s.error("bodies", "missing; write bodies.NAME = { inertia = \"50 g.cm2\" } or { mass = \"30 g\" }"));
    }
    let (mut bodies, mut stops, mut slides, mut motors) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for name in &names {
        let of = all.section(name)?;
        of.accept_as("device.bodies.BODY", &[])?;
        let is_slide = of.has("mass");
        let part = of.given(&keys::body::part)?;
        if is_slide && part.is_some() {
            return Err(
                of.error("part", "a motor's rotor turns, and a body with a mass slides; write one of part, mass")
            );
        }
        motors.push(part);
        let of = of.along(axis_of(is_slide)).with(part.map(NamedPart::gives));
        let body = body(&of, is_slide)?;
        stops.extend(stop_of(&of, bodies.len(), body.position)?);
        bodies.push(body);
        slides.push(is_slide);
    }
    let (joint_names, joints) = joints(&s, (&names, &slides, &bodies))?;
    let (mut sensors, mut sensed) = sensors(&s, (&names, &slides), None, clock)?;
    let (mut encoder, on) = encoder_of(&root.section("encoder")?, (&names, &slides))?;
    let hand = root.section("hand")?;
    let grip = if hand.has("on") { body_of(&hand, &keys::hand_network::on, &names)? } else { on };
    let units_at = if s.has("units_at") { body_of(&s, &keys::network::units_at, &names)? } else { on };
    let (feed, driven, dac) = drive(s.section("drive")?, root, (&names, &slides, &motors))?;
    let hand = hpu_plant::Hand::Torque(0.0);
    let (mut seen, mut followed) = (on, None);
    // The paddle's loop reads words of a sensor beside the encoder.
    let chosen = if is_paddle(root) { None } else { chosen(&root.section("method")?, &sensors)? };
    if let Some(chosen) = chosen {
        let Sensor { name, kind } = &mut sensors[chosen];
        let refused = |reason: String| Err(root.error("method.position", reason));
        match kind {
            // The two change places.
            SensorKind::Encoder(index, own) => {
                mem::swap(own, &mut encoder);
                mem::swap(&mut sensed[*index].body, &mut seen);
                *name = ENCODER.into();
            }
            // Its counts are those of an encoder with its words.
            SensorKind::Sampled(Sampled { reading: Reading::Position(index), bits, scale, .. }) => {
                let own = Sensor { name: ENCODER.into(), kind: SensorKind::Encoder(sensed.len(), encoder) };
                (seen, followed) = (sensed[*index].body, Some(chosen));
                let Some(alike) = counts((*bits, *scale), slides[seen]) else {
                    let reason = format!("{name} has no words of 3 to 26 bits of a turn; leave its span out");
                    return refused(reason);
                };
                encoder = alike;
                sensed.push(Sensed { body: on, lag_rad_per_s: None });
                sensors.push(own);
            }
            _ => return refused(format!("{name} reads no position; write an encoder, or an absolute sensor")),
        }
    }
    let network = Network { bodies, joints, stops, feed, driven, seen, grip, hand, sensed };
    Ok(Draft { names, joint_names, slides, network, dac, units_at, encoder, sensors, followed })
}

/// Reads the joints between bodies, with their names.
fn joints(device: &Section, bodies: (&[String], &[bool], &[Body])) -> Result<(Vec<String>, Vec<Joint>), SceneError> {
    let all = device.section("joints")?;
    let names = names_of(&all, "joint")?;
    let joints = names.iter().map(|name| joint(&all.section(name)?, bodies)).collect::<Result<_, _>>()?;
    Ok((names, joints))
}

/// Reads what is around the rotor of a motor with three phases: `rotor` is its body without stops and return spring,
/// `feed` its winding across the magnets' axis. Returns the sensors apart.
pub(crate) fn around(
    root: &Section,
    (rotor, feed): (Body, Feed),
    (encoder, pole_pairs): (Encoder, u32),
    clock: Clock,
) -> Result<(Draft, Vec<Sensor>), SceneError> {
    let s = &root.section("device")?;
    let all = s.section("bodies")?;
    let further: Vec<String> = names_of(&all, "body")?.into_iter().filter(|name| name != ROTOR).collect();
    let names: Vec<String> = [ROTOR.into()].into_iter().chain(further).collect();
    let (mut bodies, mut stops, mut slides) = (vec![rotor], Vec::new(), vec![false]);
    let own = all.section(ROTOR)?;
    if let Some(key) = own.keys().find(|key| !["return_spring", "gravity", "stops"].contains(key)) {
        let reason = "not of the rotor, whose inertia, friction and start stand in [device]; accepted here: \
                      return_spring, gravity, stops";
        return Err(own.key_error(key, reason));
    }
    if own.keys().next().is_some() {
        (bodies[0].spring, bodies[0].constant) = spring(&own, false)?;
        stops.extend(stop_of(&own, 0, rotor.position)?);
    }
    for name in &names[1..] {
        let of = all.section(name)?;
        of.accept_as("device.bodies.BODY", &[])?;
        if of.has(keys::body::part.name) {
            return Err(of.error(keys::body::part.name, "the rotor is that of the device; write inertia, or mass"));
        }
        let is_slide = of.has("mass");
        let of = of.along(axis_of(is_slide));
        let body = body(&of, is_slide)?;
        stops.extend(stop_of(&of, bodies.len(), body.position)?);
        bodies.push(body);
        slides.push(is_slide);
    }
    let (joint_names, joints) = joints(s, (&names, &slides, &bodies))?;
    let (sensors, sensed) = sensors(s, (&names, &slides), Some(pole_pairs), clock)?;
    let units_at = if s.has("units_at") { body_of(s, &keys::network::units_at, &names)? } else { 0 };
    let hand = hpu_plant::Hand::Torque(0.0);
    let held = root.section("hand")?;
    let grip = if held.has("on") { body_of(&held, &keys::hand_network::on, &names)? } else { 0 };
    let network = Network { bodies, joints, stops, feed, driven: 0, seen: 0, grip, hand, sensed };
    let (dac, followed, own) = (None, None, Vec::new());
    Ok((Draft { names, joint_names, slides, network, dac, units_at, encoder, sensors: own, followed }, sensors))
}

/// Reads the scene's own encoder. Returns it with its body.
fn encoder_of(s: &Section, (names, slides): (&[String], &[bool])) -> Result<(Encoder, usize), SceneError> {
    use keys::encoder_network as key;
    s.accept(&["network"])?;
    let on = body_of(s, &key::on, names)?;
    let s = &s.alike(s.axis()).with(s.given(&encoder_part::part)?.map(NamedPart::gives));
    Ok((encoder(s, (&key::lines, &key::resolution), (slides[on], &names[on]))?, on))
}

/// Returns the index of the sensor that a method counts in the place of the scene's own encoder.
fn chosen(method: &Section, sensors: &[Sensor]) -> Result<Option<usize>, SceneError> {
    let key = &keys::method_network::position;
    if method.given(key)?.is_none_or(|name| name == ENCODER) {
        return Ok(None);
    }
    let names: Vec<String> = sensors.iter().map(|sensor| sensor.name.clone()).chain([ENCODER.into()]).collect();
    one_of(method, key, "sensor", &names).map(Some)
}

fn body(s: &Section, slides: bool) -> Result<Body, SceneError> {
    use keys::body as key;
    let inertia = match (slides, s.has("inertia")) {
        (true, true) => return Err(s.error("inertia", "the body has a mass and so slides; write one of inertia, mass")),
        (true, false) => s.read(&key::mass)?,
        (false, _) => s.read(&key::inertia)?,
    };
    let coulomb = s.read(&key::coulomb_friction)?;
    let stiction = s.given(&key::stiction)?.unwrap_or(coulomb);
    if stiction < coulomb {
        let unit = s.axis().effort.si;
        let reason = format!(
            "stiction {} {unit} is less than coulomb_friction, {} {unit}; write as much or more",
            number(stiction),
            number(coulomb)
        );
        return Err(s.error("stiction", reason));
    }
    let (spring, constant) = spring(s, slides)?;
    let (position, speed) = (s.read(&key::initial_position)?, s.read(&key::initial_speed)?);
    Ok(Body { inertia, viscous: s.read(&key::viscous_friction)?, coulomb, stiction, spring, constant, position, speed })
}

/// Reads the stiffness of a body's return spring, with that of gravity, and its constant torque.
fn spring(s: &Section, slides: bool) -> Result<(f64, f64), SceneError> {
    let (mut spring, mut constant) = (s.read(&keys::body::return_spring)?, 0.0);
    if s.has("gravity") {
        use keys::gravity as key;
        if slides {
            return Err(s.error("gravity", "it pulls a body that turns; a body that slides has none: leave this out"));
        }
        let g = s.section("gravity")?;
        g.accept_as("device.bodies.BODY.gravity", &[])?;
        let weight_nm = g.read(&key::mass)? * g.read(&key::distance)? * g.read(&key::acceleration)?;
        let at = g.read(&key::at)?;
        spring += weight_nm * libm::cos(at);
        constant = -weight_nm * (libm::sin(at) - at * libm::cos(at));
    }
    Ok((spring, constant))
}

/// Reads the stops of a body that starts at a position.
fn stop_of(s: &Section, body: usize, position: f64) -> Result<Option<Stop>, SceneError> {
    use keys::stops as key;
    if !s.has("stops") {
        return Ok(None);
    }
    let s = s.section("stops")?;
    s.accept_as("device.bodies.BODY.stops", &[])?;
    let (low, high) = (s.read(&key::low)?, s.read(&key::high)?);
    if low >= high {
        return Err(s.error("high", format!("not above low, {}", number(low))));
    }
    if !(low..=high).contains(&position) {
        let place = if position < low { "low" } else { "high" };
        let (at, unit) = (number(position), s.axis().position.si);
        let reason = format!("the device starts at {at} {unit}, inside this stop; start it between both");
        return Err(s.error(place, reason));
    }
    Ok(Some(Stop { body, low, high, stiffness: s.read(&key::stiffness)?, damping: s.read(&key::damping)? }))
}

fn joint(s: &Section, (names, slides, bodies): (&[String], &[bool], &[Body])) -> Result<Joint, SceneError> {
    use keys::joint as key;
    s.accept_as("device.joints.JOINT", &[])?;
    let (from, to) = (body_of(s, &key::from, names)?, body_of(s, &key::to, names)?);
    if from == to {
        return Err(s.error("to", "it comes from this body; write another one"));
    }
    let turns = s.read(&key::ratio)?;
    let ratio = match (slides[from], slides[to]) {
        (false, true) => s.read(&key::radius)? / turns,
        _ if s.has("radius") => {
            return Err(s.error("radius", "only where a turning body drives one that slides; leave this out"));
        }
        (true, false) => {
            let reason =
                format!("{} slides and {} turns; write the joint from the one that turns", names[from], names[to]);
            return Err(s.error("from", reason));
        }
        _ => 1.0 / turns,
    };
    // Units of the body that it goes to.
    let refusing = |key: &Key<Quantity>| -> Result<Option<f64>, SceneError> {
        let given = s.get(key.name).and_then(|item| item.as_str());
        let is_of = |axis| given.is_some_and(|text| key.value.dimension(&s.alike(axis)).parse(text).is_some());
        let (here, other) = (axis_of(slides[to]), axis_of(!slides[to]));
        if !is_of(here) && is_of(other) {
            let unit = |axis| key.value.dimension(&s.alike(axis)).si;
            let has = if slides[to] { "a mass" } else { "an inertia" };
            let reason = format!("{}, because {} has {has}; got {}", unit(here), names[to], unit(other));
            return Err(s.error(key.name, reason));
        }
        s.alike(here).given(key)
    };
    let Some(stiffness) = refusing(&key::stiffness)? else {
        return Ok(Joint { from, to, ratio, compliance: None });
    };
    let damping = match (refusing(&key::damping)?, s.given(&key::damping_ratio)?) {
        (Some(_), Some(_)) => return Err(s.error("damping_ratio", "damping is given too; write one of both")),
        (None, Some(share)) => {
            let together = 1.0 / (ratio * ratio / bodies[from].inertia + 1.0 / bodies[to].inertia);
            2.0 * share * (stiffness * together).sqrt()
        }
        (damping, None) => damping.unwrap_or(0.0),
    };
    Ok(Joint { from, to, ratio, compliance: Some((stiffness, damping)) })
}

/// Reads the drive, the body that it moves, and its converter.
fn drive(
    s: Section,
    root: &Section,
    (names, slides, motors): (&[String], &[bool], &[Option<&'static NamedPart>]),
) -> Result<(Feed, usize, Option<Dac>), SceneError> {
    use keys::drive as key;
    s.accept_as("device.drive", &[])?;
    let kind = s.read(&key::kind)?;
    let driven = body_of(&s, &key::on, names)?;
    let amplifier = s.given(&key::part)?;
    if let (DriveKind::Bridge, Some(_)) = (kind, amplifier) {
        return Err(s.error("part", "an amplifier is of a drive of kind \"current\" or \"pi\"; leave this out"));
    }
    let s = s.with(amplifier.map(NamedPart::gives)).with(motors[driven].map(NamedPart::gives));
    let torque_constant = s.alike(axis_of(slides[driven])).read(&key::torque_constant)?;
    let refuse = |keys: &[&str], of: &str| match keys.iter().find(|key| s.has(key)) {
        Some(key) => Err(s.error(key, format!("only of a drive of kind {of}; leave this out"))),
        None => Ok(()),
    };
    if kind == DriveKind::Bridge {
        refuse(&["bandwidth", "supply", "dac"], "\"current\" or \"pi\"")?;
    } else if root.has("bridge") {
        return Err(
            root.error("bridge", "the drive is no bridge; write device.drive.kind = \"bridge\", or leave this out")
        );
    }
    if kind != DriveKind::Pi {
        refuse(&["proportional", "integral_rate", "feed_forward"], "\"pi\"")?;
    }
    let needs_winding = kind != DriveKind::Current || s.has("supply");
    let winding = |key: &Key<Quantity>| if needs_winding { s.read(key) } else { Ok(s.given(key)?.unwrap_or(0.0)) };
    let (resistance_ohm, inductance_h) = (winding(&key::resistance)?, winding(&key::inductance)?);
    let supply_v = s.given(&key::supply)?.unwrap_or(f64::INFINITY);
    let bandwidth_rad_per_s = s.given(&key::bandwidth)?.map(|hz| 2.0 * PI * hz);
    let kind = match kind {
        DriveKind::Bridge => {
            FeedKind::Bridge(Bridge { supply_v: 0.0, on_resistance_ohm: 0.0, diode_drop_v: 0.0, dead_band_v: 0.0 })
        }
        DriveKind::Current => {
            let bandwidth_rad_per_s = bandwidth_rad_per_s.unwrap_or(f64::INFINITY);
            if bandwidth_rad_per_s.is_infinite() && supply_v.is_finite() {
                return Err(s.error("supply", "a current that follows at once has no limit; write its bandwidth too"));
            }
            FeedKind::Current { bandwidth_rad_per_s, supply_v }
        }
        DriveKind::Pi => {
            let proportional_ohm = match (s.given(&key::proportional)?, bandwidth_rad_per_s) {
                (Some(given), _) => given,
                (None, Some(bandwidth)) => bandwidth * inductance_h,
                (None, None) => return Err(s.error("bandwidth", "missing; write a frequency, or proportional")),
            };
            let rate_per_s = s.given(&key::integral_rate)?.map_or(resistance_ohm / inductance_h, |hz| 2.0 * PI * hz);
            let feeds_forward = s.read(&key::feed_forward)?;
            FeedKind::Pi {
                proportional_ohm,
                integral_ohm_per_s: proportional_ohm * rate_per_s,
                feeds_forward,
                supply_v,
            }
        }
    };
    let dac = if let FeedKind::Bridge(_) = kind { None } else { Some(converter(&s)?) };
    Ok((Feed { torque_constant, resistance_ohm, inductance_h, kind }, driven, dac))
}

fn converter(drive: &Section) -> Result<Dac, SceneError> {
    use keys::dac as key;
    if !drive.has("dac") {
        return Err(drive.error("dac", "missing; write dac = { full_scale = \"2 A\", bits = 12 }, or without bits"));
    }
    let s = drive.section("dac")?;
    s.accept_as("device.drive.dac", &[])?;
    Ok(Dac { full_scale_a: s.read(&key::full_scale)?, bits: s.given(&key::bits)?, floors: s.read(&key::rounding)? })
}

impl Draft {
    /// The dimensions of the motion of the body with the encoder, of that at the grip, and of that with the wall.
    pub(crate) fn axes(&self) -> [&'static Axis; 3] {
        [self.network.seen, self.network.grip, self.units_at].map(|body| axis_of(self.slides[body]))
    }

    /// Makes all joints rigid if `[model]` says so.
    pub(crate) fn stiffen(&mut self, s: &Section) -> Result<(), SceneError> {
        if s.read(&keys::model_joints::joints)? {
            self.network.joints.iter_mut().for_each(|joint| joint.compliance = None);
        }
        Ok(())
    }

    /// Leaves out what `[model]` leaves out of bodies, drive and converter.
    pub(crate) fn simplify(&mut self, s: &Section) -> Result<(), SceneError> {
        use keys::model_network as key;
        self.stiffen(s)?;
        let (is_ideal, is_exact) = (s.read(&key::drive)?, s.read(&key::converter)?);
        if self.dac.is_none() && (is_ideal || is_exact) {
            let key = if is_ideal { key::drive.name } else { key::converter.name };
            return Err(s.error(key, "of a drive with a converter, and a bridge has none; leave this out"));
        }
        if is_ideal {
            self.network.feed.kind = FeedKind::Current { bandwidth_rad_per_s: f64::INFINITY, supply_v: f64::INFINITY };
        }
        if let (Some(dac), true) = (&mut self.dac, is_exact) {
            dac.bits = None;
        }
        Ok(())
    }

    /// Returns units of the body with the wall for one unit of the body with the encoder.
    pub(crate) fn wall_ratio(&self) -> f64 {
        self.network.ratio(self.units_at)
    }

    /// Returns the encoder that the logic counts.
    pub(crate) fn encoder(&self) -> Encoder {
        self.encoder
    }

    /// Returns the device, and what of it the body with the encoder shows: all joints taken as rigid. The hand becomes
    /// one at that body.
    pub(crate) fn finish(
        mut self,
        root: &Section,
        hand: &mut Hand,
        bridge: Bridge,
        clock_hz: f64,
    ) -> Result<(Device, Arc<Compound>), SceneError> {
        let grip_ratio = self.network.ratio(self.network.grip);
        let [inertia, viscous, coulomb] = self.network.seen_rigidly();
        let own = self.names.len();
        let path = self.hold(&root.section("hand")?, hand, grip_ratio)?;
        let hand_has_mass = self.names.len() > own;
        if let FeedKind::Bridge(own) = &mut self.network.feed.kind {
            *own = bridge;
        }
        let s = root.section("device")?;
        if let (Hand::Prescribed { .. }, Some(first)) = (&*hand, path.first()) {
            self.impose(&s, first.angle_rad)?;
        }
        let reduced = self.network.reduced().map_err(|error| self.refused(&s, &error))?;
        for (name, index) in self.joint_names.iter().zip(0..) {
            let compliant =
                self.network.joints.iter().take(index + 1).filter(|joint| joint.compliance.is_some()).count();
            let frequency_hz = match self.network.joints[index].compliance {
                Some(_) => reduced.frequencies_hz()[compliant - 1],
                None => 0.0,
            };
            if frequency_hz > clock_hz {
                let at = number(frequency_hz / 1e6);
                let reason =
                    format!("its mode is at {at} MHz, beyond the clock: make it rigid, leave its stiffness out");
                return Err(s.error(&format!("joints.{name}.stiffness"), reason));
            }
        }
        let seen = self.network.seen;
        let (initial, feed) = (self.network.bodies[seen], self.network.feed);
        let drive_ratio = self.network.ratio(self.network.driven);
        let device = if self.slides[seen] {
            Device::Mass(Mass {
                mass_kg: inertia,
                damping_n_s_per_m: viscous,
                coulomb_n: coulomb,
                initial_position_m: initial.position,
                initial_speed_m_per_s: initial.speed,
            })
        } else {
            Device::Motor(Motor {
                resistance_ohm: feed.resistance_ohm,
                inductance_h: feed.inductance_h,
                torque_constant_nm_per_a: drive_ratio * feed.torque_constant,
                rotor_inertia_kg_m2: inertia,
                viscous_friction_nm_s_per_rad: viscous,
                coulomb_friction_nm: coulomb,
                wheel_ratio: 1.0,
                wheel_inertia_kg_m2: 0.0,
                initial_angle_rad: initial.position,
                initial_speed_rad_per_s: initial.speed,
                initial_current_a: 0.0,
            })
        };
        let (wall_ratio, wall_units) = (self.wall_ratio(), units(axis_of(self.slides[self.units_at])));
        let Self { names, slides, network, dac, sensors, followed, units_at: wall_body, .. } = self;
        let compound = Compound {
            network,
            names,
            slides,
            dac,
            sensors,
            followed,
            hand_has_mass,
            path,
            grip_ratio,
            drive_ratio,
            wall_body,
            wall_ratio,
            wall_units,
        };
        Ok((device, Arc::new(compound)))
    }

    /// Starts the body at the grip where a prescribed hand does; its own start is refused, not ignored.
    fn impose(&mut self, s: &Section, position: f64) -> Result<(), SceneError> {
        let groups = self.network.rigid().map_err(|error| self.refused(s, &error))?;
        let (root, units) = groups[self.network.grip];
        for (name, (of, _)) in self.names.iter().zip(&groups) {
            let body = s.section("bodies")?.section(name)?;
            let is_rotor = name == ROTOR && s.has("pole_pairs");
            let body = if is_rotor { s.alike(s.axis()) } else { body };
            let starts = ["initial_position", "initial_angle", "initial_speed"];
            let start = starts.into_iter().find(|key| *of == root && body.has(key));
            if let Some(key) = start {
                let reason = "a prescribed hand imposes the motion from its first point on; leave this out";
                return Err(body.error(key, reason));
            }
        }
        self.network.bodies[root].position = position / units;
        Ok(())
    }

    /// Puts the hand on its body, with its own mass, and returns its path there. The scene's hand becomes one at the
    /// body with the encoder.
    fn hold(&mut self, s: &Section, hand: &mut Hand, ratio: f64) -> Result<Vec<PathPoint>, SceneError> {
        use keys::hand_network as key;
        let slides = self.slides[self.network.grip];
        let s = s.alike(axis_of(slides));
        let (own, wrong) = if slides { (&key::mass, &key::inertia) } else { (&key::inertia, &key::mass) };
        if s.given(wrong)?.is_some() {
            let is = if slides { "slides: write mass" } else { "turns: write inertia" };
            return Err(s.error(wrong.name, format!("{} {is}", self.names[self.network.grip])));
        }
        let mass = s.given(own)?;
        let (own_stiffness, own_damping) = (s.read(&key::own_stiffness)?, s.read(&key::own_damping)?);
        let is_grip = matches!(hand, Hand::SpringDamper { .. });
        let of_mass = [
            (own.name, mass.is_some()),
            (key::own_stiffness.name, own_stiffness != 0.0),
            (key::own_damping.name, own_damping != 0.0),
        ];
        let given = of_mass.into_iter().find(|(_, is_given)| *is_given);
        if let Some((key, _)) = given.filter(|_| !is_grip || mass.is_none()) {
            let reason = format!("only of a hand of kind \"spring_damper\" with its {}; leave this out", own.name);
            return Err(s.error(key, reason));
        }
        let square = ratio * ratio;
        let path = match hand {
            Hand::Capture { .. } => {
                return Err(s.error("kind", "a recording stands in for a motor or a mass; write another hand"));
            }
            Hand::None => Vec::new(),
            Hand::ConstantTorque { torque_nm } => {
                self.network.hand = hpu_plant::Hand::Torque(*torque_nm);
                *torque_nm *= ratio;
                Vec::new()
            }
            Hand::SpringDamper { stiffness_nm_per_rad, damping_nm_s_per_rad, path } => {
                let mut push =
                    Push { stiffness_nm_per_rad: *stiffness_nm_per_rad, damping_nm_s_per_rad: *damping_nm_s_per_rad };
                if let Some(inertia) = mass {
                    let compliance = Some((push.stiffness_nm_per_rad, push.damping_nm_s_per_rad));
                    let to = self.network.bodies.len();
                    let position = self.network.bodies[self.network.grip].position;
                    self.network.bodies.push(Body { inertia, position, ..Body::default() });
                    self.network.joints.push(Joint { from: self.network.grip, to, ratio: 1.0, compliance });
                    self.names.push("hand".into());
                    self.slides.push(slides);
                    self.network.grip = to;
                    push = Push { stiffness_nm_per_rad: own_stiffness, damping_nm_s_per_rad: own_damping };
                }
                self.network.hand = hpu_plant::Hand::Spring(push);
                (*stiffness_nm_per_rad, *damping_nm_s_per_rad) =
                    (square * *stiffness_nm_per_rad, square * *damping_nm_s_per_rad);
                seen_from(path, ratio)
            }
            Hand::Prescribed { path } => {
                self.network.hand = hpu_plant::Hand::Prescribed;
                seen_from(path, ratio)
            }
        };
        Ok(path)
    }

    fn refused(&self, s: &Section, error: &NetworkError) -> SceneError {
        match error.place {
            Place::Device => s.error("bodies", error.reason.clone()),
            Place::Body(body) => s.error(&format!("bodies.{}", self.names[body]), error.reason.clone()),
            Place::Joint(joint) => match self.joint_names.get(joint) {
                Some(name) => s.error(&format!("joints.{name}"), error.reason.clone()),
                None => s.error("bodies", error.reason.clone()),
            },
        }
    }
}

/// Returns a path as it was, and makes it one at the body with the encoder.
fn seen_from(path: &mut [PathPoint], ratio: f64) -> Vec<PathPoint> {
    let own = path.to_vec();
    path.iter_mut().for_each(|point| point.angle_rad /= ratio);
    own
}
