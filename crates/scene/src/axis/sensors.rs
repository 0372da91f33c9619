//! The sensors of a network beside its encoder: `device.sensors.NAME`.

use std::f64::consts::PI;

use hpu_plant::network::Sensed;
use hpu_signal::{Clock, Format};
use toml_edit::Item;

use crate::axis::network_rows as keys;
use crate::axis::network_rows::Bus;
use crate::axis::parts::Encoder;
use crate::schema::parameter::{Origin, ParameterValue};
use crate::schema::quantity as q;
use crate::schema::quantity::{RAIL, SHAFT, Sense};
use crate::schema::section::Section;
use crate::schema::source::SceneError;
use crate::schema::{Key, Quantity, Text, Whole};
use crate::text::message::{did_you_mean, number, number_below};

/// The name of the scene's own encoder among sensors.
pub(crate) const ENCODER: &str = "encoder";

/// A sensor of a network beside the encoder that the logic counts.
#[derive(Clone, PartialEq, Debug)]
pub struct Sensor {
    /// Its name.
    pub name: String,
    /// The quantity that it reads, and how.
    pub kind: SensorKind,
}

/// The quantity that a sensor reads, and how.
#[derive(Clone, PartialEq, Debug)]
pub enum SensorKind {
    /// An incremental encoder on a body, the one of this index among those that sensors read.
    Encoder(usize, Encoder),
    /// A sensor that samples a word.
    Sampled(Sampled),
    /// A modulator of the current.
    Modulator(Modulator),
    /// Hall switches of a motor with three phases.
    Hall(Hall),
}

/// Three Hall switches, each at 1 for half an electrical turn, a third of a turn apart: a from angle 0 on, b from 120
/// and c from 240 degrees.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Hall {
    /// The index of the angle among those that sensors read.
    pub reading: usize,
    /// The angle of a sixth of an electrical turn.
    pub sector_rad: f64,
}

/// A sigma-delta modulator of the first order: each bit is the sign of what is left of the current's charge after the
/// bits before, a 1 for as much as full scale brings in a period, a 0 for as much below 0 A.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Modulator {
    /// Clocks from a bit to the next.
    pub period: u64,
    /// Clocks to the first bit.
    pub phase: u64,
    /// The charge of a bit, in A·s.
    pub charge_as: f64,
    /// The index of the phase, of a motor with three.
    pub winding: Option<usize>,
}

/// The quantity of which a sensor samples words.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Reading {
    /// The position of this index among those that sensors read.
    Position(usize),
    /// The drive's current.
    Current,
    /// The current of a phase of a motor with three.
    Phase(Phase),
}

/// A phase whose current a sensor reads.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Phase {
    /// Its index: 0 is a.
    pub leg: usize,
    /// Whether its shunt is below the lower switch, so that it shows 0 A while that is open.
    pub is_low_side: bool,
}

impl Reading {
    /// Returns whether it is a position, whose words begin anew after the last one; those of a current are clamped.
    fn is_round(self) -> bool {
        matches!(self, Self::Position(_))
    }
}

/// A sensor that samples a word.
#[derive(Clone, PartialEq, Debug)]
pub struct Sampled {
    /// The quantity that it reads.
    pub reading: Reading,
    /// Whether the design starts each sample by a pin, so that none is taken at `phase` and every `period`.
    pub triggered: bool,
    /// The number of 2^-16 counts of the word for one unit: rad, m or A.
    pub scale: f64,
    /// Bits of the word: of a current with its sign, else without.
    pub bits: u32,
    /// Clocks from a sample to the next, to the first one, and from a sample to its word.
    pub period: u64,
    /// Clocks to the first sample.
    pub phase: u64,
    /// Clocks from a sample to its word.
    pub latency: u64,
    /// Clocks before which it takes no sample, and answers to nothing.
    pub ready: u64,
    /// Errors over all words, in 2^-16 counts.
    pub inl: Vec<i64>,
    /// The offset in 2^-16 counts.
    pub offset: i64,
    /// Each of the four terms of the noise is one of this number of values, 2^-16 counts apart; 1 is none.
    pub noise: u64,
    /// The number of readings whose mean is taken off.
    pub zero_of: u32,
    /// Whether the words of a current begin at 0, with no current in the middle.
    pub offset_binary: bool,
    /// The corner of a first-order lag between a phase's current and the converter, in rad/s; `None` without a lag.
    pub lag_rad_per_s: Option<f64>,
    /// Of a chip the bus that it is on, and the least clocks of a period of the bus; `None` if the design sees the
    /// word.
    pub chip: Option<(Bus, u64)>,
}

/// The fraction of a count in which words are computed: 2^-16.
pub const FRACTION: u32 = 16;

impl Sampled {
    /// Returns the word of a reading, which is given in 2^-16 counts and rounded down, with the noise of `below`, which
    /// returns a random number below its argument. A current has `zero` taken off.
    pub fn word(&self, value: i64, zero: i64, mut below: impl FnMut(u64) -> u64) -> i64 {
        let whole = self.bits + FRACTION;
        let half = 1i64 << (whole - 1);
        // The place among all words, the least at 0.
        let place = if self.reading.is_round() { value & (2 * half - 1) } else { value.clamp(-half, half - 1) + half };
        let noise = match self.noise {
            1 => 0,
            noise => (0..4).map(|_| below(noise) as i64).sum::<i64>() - 2 * (noise as i64 - 1),
        };
        let sum = place + self.error(place) + noise + self.offset;
        if self.reading.is_round() {
            return (sum >> FRACTION) & ((1 << self.bits) - 1);
        }
        let clamped = |word: i64| word.clamp(-(half >> FRACTION), (half >> FRACTION) - 1);
        let word = clamped(clamped((sum - half) >> FRACTION) - zero);
        if self.offset_binary { word + (half >> FRACTION) } else { word }
    }

    /// Returns the error of a place among all words, both in 2^-16 counts.
    #[inline]
    fn error(&self, place: i64) -> i64 {
        let pieces = self.inl.len() - usize::from(!self.reading.is_round() && !self.inl.is_empty());
        if pieces == 0 {
            return 0;
        }
        let shift = self.bits + FRACTION - pieces.ilog2();
        let (piece, within) = ((place >> shift) as usize, place & ((1 << shift) - 1));
        let (from, to) = (self.inl[piece], self.inl[(piece + 1) % self.inl.len()]);
        from + ((i128::from(to - from) * i128::from(within)) >> shift) as i64
    }
}

impl Sensor {
    /// Returns the pins that the world drives, three at most: the name and the format of each.
    pub fn pins(&self) -> Vec<(&'static str, Format)> {
        match &self.kind {
            SensorKind::Encoder(..) => vec![("a", Format::BIT), ("b", Format::BIT)],
            SensorKind::Hall(_) => ["a", "b", "c"].map(|pin| (pin, Format::BIT)).into(),
            SensorKind::Sampled(Sampled { chip: Some((Bus::Spi, _)), .. }) => vec![("miso", Format::BIT)],
            SensorKind::Sampled(Sampled { chip: Some((Bus::I2c, _)), .. }) => vec![("sda", Format::BIT)],
            SensorKind::Sampled(Sampled { reading, bits, offset_binary, .. }) => {
                let word =
                    if reading.is_round() || *offset_binary { Format::unsigned(*bits) } else { Format::signed(*bits) };
                vec![("word", word), ("valid", Format::BIT)]
            }
            SensorKind::Modulator(_) => vec![("bit", Format::BIT), ("valid", Format::BIT)],
        }
    }

    /// Returns whether it reads a current, not a position.
    pub fn reads_a_current(&self) -> bool {
        match &self.kind {
            SensorKind::Sampled(sampled) => !sampled.reading.is_round(),
            SensorKind::Modulator(_) => true,
            SensorKind::Encoder(..) | SensorKind::Hall(_) => false,
        }
    }

    /// Returns whether the design starts its samples.
    pub fn is_triggered(&self) -> bool {
        matches!(&self.kind, SensorKind::Sampled(sampled) if sampled.triggered)
    }

    /// Returns whether it is a chip on a bus, whose lines the design drives.
    pub fn is_chip(&self) -> bool {
        !self.lines().is_empty()
    }

    /// Returns the names of the lines of a chip that the design drives, three at most.
    pub fn lines(&self) -> &'static [&'static str] {
        match &self.kind {
            SensorKind::Sampled(Sampled { chip: Some((Bus::Spi, _)), .. }) => &["csn", "sck", "mosi"],
            SensorKind::Sampled(Sampled { chip: Some((Bus::I2c, _)), .. }) => &["scl", "sda_out"],
            _ => &[],
        }
    }
}

/// Returns the index of the body, or sensor, that a key names.
pub(crate) fn one_of(s: &Section, key: &Key<Text>, what: &str, names: &[String]) -> Result<usize, SceneError> {
    let name = s.read(key)?;
    names.iter().position(|it| *it == name).ok_or_else(|| {
        let all: Vec<&str> = names.iter().map(String::as_str).collect();
        let near = did_you_mean(&name, &all);
        s.error(key.name, format!("no {what} \"{name}\"; there are {}{near}", all.join(", ")))
    })
}

/// Returns the names of the sections below one, each letters, digits, `_` and `-`.
pub(crate) fn names_of(s: &Section, what: &str) -> Result<Vec<String>, SceneError> {
    let is_plain =
        |name: &str| name.len() <= 40 && name.chars().all(|it| it.is_ascii_alphanumeric() || it == '_' || it == '-');
    if let Some(name) = s.keys().find(|name| !is_plain(name)) {
        let reason = format!("not the name of a {what}; accepted: up to 40 letters, digits, _ and -");
        return Err(s.key_error(name, reason));
    }
    Ok(s.keys().map(String::from).collect())
}

/// Returns the encoder whose counts are words of these bits and this scale, on a body that slides or not; `None` if
/// there is none.
pub(crate) fn counts((bits, scale): (u32, f64), slides: bool) -> Option<Encoder> {
    let count = libm::exp2(f64::from(FRACTION)) / scale;
    if slides {
        return Some(Encoder::Linear { resolution_m: count });
    }
    let is_turn = (3..=26).contains(&bits) && (count * libm::exp2(f64::from(bits)) / (2.0 * PI) - 1.0).abs() < 1e-15;
    is_turn.then(|| Encoder::Rotary { lines: 1 << (bits - 2) })
}

/// Reads an encoder on a body of this name, by its keys for the lines of a turn and for the length of a count.
pub(crate) fn encoder(
    s: &Section,
    (lines, resolution): (&Key<Whole<u32>>, &Key<Quantity>),
    (slides, name): (bool, &str),
) -> Result<Encoder, SceneError> {
    if slides && s.given(lines)?.is_some() {
        return Err(s.error(lines.name, format!("{name} slides: write resolution")));
    }
    if !slides && s.given(resolution)?.is_some() {
        return Err(s.error(resolution.name, format!("{name} turns: write lines")));
    }
    Ok(if slides {
        Encoder::Linear { resolution_m: s.read(resolution)? }
    } else {
        Encoder::Rotary { lines: s.read(lines)? }
    })
}

/// The keys of each kind of sensor, beside its kind.
const KEYS: [(&str, &[&str]); 5] = [
    ("encoder", &["on", "lines", "resolution"]),
    (
        "absolute",
        &[
            "on",
            "chip",
            "rate",
            "phase",
            "latency",
            "bus",
            "bits",
            "span",
            "corner",
            "noise",
            "inl",
            "harmonics",
            "power_up",
        ],
    ),
    (
        "current",
        &[
            "winding",
            "shunt",
            "trigger",
            "rate",
            "phase",
            "latency",
            "bus",
            "bits",
            "gain",
            "range",
            "corner",
            "offset",
            "calibrated_zero",
            "offset_binary",
            "noise",
            "inl",
            "power_up",
        ],
    ),
    ("hall", &["on"]),
    ("sigma_delta", &["winding", "rate", "phase", "gain", "range"]),
];

/// Those of them that only a motor with three phases has.
const OF_PHASES: [&str; 4] = ["winding", "shunt", "trigger", "chip"];

/// The most sensors of a network.
pub const MOST_SENSORS: usize = 16;
/// The most sensors that are chips on buses.
const MOST_CHIPS: usize = 8;
/// The most samples whose words are still on their way.
const MOST_WAITING: u64 = 1000;
/// The most places of a table of errors.
const MOST_PLACES: usize = (1 << 12) + 1;
/// The greatest error of a table, in counts of the word.
const MOST_COUNTS: f64 = (1u64 << 24) as f64;

/// Reads a rate. Returns it with its period in clocks.
fn rate(s: &Section, clock: Clock) -> Result<(f64, u64), SceneError> {
    let (rate_hz, most_hz) = (s.read(&keys::sensor::rate)?, clock.frequency_hz() as f64);
    if rate_hz > most_hz {
        let most = number(most_hz);
        return Err(s.error("rate", format!("faster than the clock; write its frequency, {most} Hz, at most")));
    }
    Ok((rate_hz, clock.edges(1.0 / rate_hz)))
}

/// Reads the gain of a current's sensor.
fn gain(s: &Section) -> Result<f64, SceneError> {
    let gain = s.read(&keys::sensor::gain)?;
    if gain == 0.0 {
        Err(s.error("gain", "0, so that no word shows a current; write another number"))
    } else {
        Ok(gain)
    }
}

/// Reads a modulator of the current, of a motor with three phases of one of theirs.
fn modulator(s: &Section, phases: bool, clock: Clock) -> Result<Modulator, SceneError> {
    use keys::sensor as key;
    let (_, period) = rate(s, clock)?;
    let full_a = 0.5 * s.read(&key::range)? / gain(s)?;
    let charge_as = full_a * period as f64 * clock.period_s();
    let winding = if phases { Some(winding(s)?) } else { None };
    Ok(Modulator { period, phase: clock.edges(s.read(&key::phase)?), charge_as, winding })
}

/// Returns the index of the phase that a sensor of a motor with three phases reads.
fn winding(s: &Section) -> Result<usize, SceneError> {
    let key = &keys::sensor::winding;
    s.given(key)?.ok_or_else(|| s.error(key.name, "missing; write a, b or c, the phase whose current it reads"))
}

/// Returns the phase whose current a sensor of a motor with three phases reads.
fn phase(s: &Section) -> Result<Phase, SceneError> {
    Ok(Phase { leg: winding(s)?, is_low_side: s.read(&keys::sensor::shunt)? })
}

/// Reads a sensor that samples a word, on a body that slides or not if it reads a position.
fn sampled(s: &Section, reading: Reading, slides: bool, clock: Clock) -> Result<Sampled, SceneError> {
    use keys::sensor as key;
    let is_round = reading.is_round();
    let (bits, triggered) = (s.read(&key::bits)?, s.read(&key::trigger)?);
    let chip = s.given(&key::chip)?;
    if let Some((_, own, _)) = chip.filter(|(_, own, _)| *own != bits || s.has("span") || s.has("bus")) {
        let reason = format!("its word is a turn in {own} bits; write bits = {own}, and neither span nor bus");
        return Err(s.error("chip", reason));
    }
    if let Some(key) = ["rate", "phase"].into_iter().find(|key| triggered && s.has(key)) {
        return Err(s.error(key, "the design starts each sample, by trigger = true; write one of both"));
    }
    // A sample that the design starts may follow the one before at the next clock.
    let (rate_hz, period) = if triggered { (0.0, 0) } else { rate(s, clock)? };
    let bus_s = s.given(&key::bus)?.map_or(0.0, |bus_hz| f64::from(bits) / bus_hz);
    if bus_s * rate_hz > 1.0 {
        let most = number_below(1.0 / bus_s);
        let reason = format!("faster than its bus, which brings a word of {bits} bits {most} times a second");
        return Err(s.error("rate", reason));
    }
    let latency_s = s.read(&key::latency)? + bus_s;
    if latency_s * rate_hz > MOST_WAITING as f64 {
        return Err(s.error("latency", format!("accepted: {MOST_WAITING} periods of `rate` at most")));
    }
    let counts = libm::exp2(f64::from(bits));
    let scale = if !is_round {
        counts * gain(s)? / s.read(&key::range)?
    } else if slides && !s.has("span") {
        return Err(s.error("span", "missing; write the length of all words"));
    } else {
        counts / s.given(&key::span)?.unwrap_or(2.0 * PI)
    };
    let (noise, offset) = (s.read(&key::noise)?, if is_round { 0.0 } else { scale * s.read(&key::offset)? });
    for (key, own) in [("noise", noise), ("offset", offset.abs())] {
        if own > counts {
            let reason = format!("{} counts of the word, which has {counts}; write less", number_below(own));
            return Err(s.error(key, reason));
        }
    }
    let fine = |counts: f64| (counts * libm::exp2(f64::from(FRACTION))).round() as i64;
    Ok(Sampled {
        reading,
        triggered,
        scale: scale * libm::exp2(f64::from(FRACTION)),
        bits,
        period,
        phase: clock.edges(s.read(&key::phase)?),
        latency: clock.edges(latency_s),
        ready: clock.edges(s.read(&key::power_up)?),
        inl: inl(s, bits, is_round)?.into_iter().map(fine).collect(),
        offset: fine(offset),
        // The variance of four numbers, each one of n, is (n^2 - 1) / 3.
        noise: fine(noise * 3f64.sqrt()).unsigned_abs().max(1),
        zero_of: s.given(&key::calibrated_zero)?.unwrap_or(0),
        offset_binary: s.read(&key::offset_binary)?,
        lag_rad_per_s: if is_round { None } else { s.given(&key::corner)?.map(|hz| 2.0 * PI * hz) },
        chip: chip.map(|(bus, _, least_s)| (bus, clock.first_edge_at((least_s * 1e12) as u64).0)),
    })
}

/// Reads the errors of words in counts.
fn inl(s: &Section, bits: u32, is_round: bool) -> Result<Vec<f64>, SceneError> {
    let Some(item) = s.get("inl") else { return harmonics(s) };
    if s.has(keys::sensor::harmonics.name) {
        return Err(s.error("inl", "the errors are given as harmonics too; write one of both"));
    }
    let Some(list) = item.as_array() else {
        return Err(s.error("inl", "write a list of numbers, in counts of the word"));
    };
    let all = list.iter().enumerate().map(|(index, value)| {
        let number = value.as_float().or(value.as_integer().map(|whole| whole as f64));
        let number = number.filter(|number| number.abs() <= MOST_COUNTS);
        number.ok_or_else(|| s.error(&format!("inl[{index}]"), "write a number, in counts of the word"))
    });
    let (pieces, more) = (list.len() - usize::from(!is_round && !list.is_empty()), if is_round { "" } else { " + 1" });
    if !pieces.is_power_of_two() || list.len() > MOST_PLACES || pieces.ilog2() > bits {
        let reason = format!("{} errors; accepted: 2^n{more} of them, n from 0 to {}", list.len(), bits.min(12));
        return Err(s.error("inl", reason));
    }
    let all = all.collect::<Result<Vec<f64>, _>>()?;
    let text = all.iter().map(|&it| number(it)).collect::<Vec<_>>().join(", ");
    s.note("inl", ParameterValue::Text(format!("[{text}]")), "", Origin::Scene);
    Ok(all)
}

/// The places of a turn for which errors as harmonics are computed.
const PLACES: usize = 256;

/// Reads the errors of words as harmonics, in counts.
fn harmonics(s: &Section) -> Result<Vec<f64>, SceneError> {
    let name = keys::sensor::harmonics.name;
    let Some(item) = s.get(name) else { return Ok(Vec::new()) };
    let refused = |at: &str| s.error(at, format!("write {}", keys::HARMONICS));
    let list = item.as_array().filter(|list| (1..=2).contains(&list.len())).ok_or_else(|| refused(name))?;
    let (mut all, mut told) = (vec![0.0; PLACES], Vec::new());
    for ((index, pair), order) in list.iter().enumerate().zip([1.0, 2.0]) {
        let at = format!("{name}[{index}]");
        let pair = pair.as_array().filter(|pair| pair.len() == 2).ok_or_else(|| refused(&at))?;
        let part = |part: usize| Item::Value(pair.get(part).cloned().unwrap_or_else(|| 0.into()));
        let amplitude = s.quantity_of(&format!("{at}[0]"), &part(0), &q::RATIO, Sense::NotNegative, |_| None)?;
        let phase_rad = s.quantity_of(&format!("{at}[1]"), &part(1), &q::ANGLE, Sense::Any, |_| None)?;
        if amplitude > MOST_COUNTS {
            return Err(s.error(&at, format!("accepted: {MOST_COUNTS} counts at most")));
        }
        for (error, place) in all.iter_mut().zip(0u32..) {
            *error += amplitude * libm::sin(order * f64::from(place) * (2.0 * PI / PLACES as f64) + phase_rad);
        }
        told.push(format!("[{}, {}]", number(amplitude), number(phase_rad)));
    }
    s.note(name, ParameterValue::Text(format!("[{}]", told.join(", "))), "", Origin::Scene);
    Ok(all)
}

/// Reads the sensors of bodies with these names, of which some slide; of a motor with three phases and these
/// `pole_pairs` in the place of a drive's current those of its phases. Returns them with the bodies that they read.
pub(crate) fn sensors(
    device: &Section,
    (names, slides): (&[String], &[bool]),
    pole_pairs: Option<u32>,
    clock: Clock,
) -> Result<(Vec<Sensor>, Vec<Sensed>), SceneError> {
    use keys::sensor as key;
    let (all, phases) = (device.section("sensors")?, pole_pairs.is_some());
    let (mut sensors, mut sensed) = (Vec::new(), Vec::new());
    let own = names_of(&all, "sensor")?;
    if own.len() > MOST_SENSORS {
        return Err(device.error("sensors", format!("{} sensors; accepted: {MOST_SENSORS}", own.len())));
    }
    for name in own {
        if name == ENCODER {
            return Err(all.key_error(&name, "the name of the scene's own encoder; write another one"));
        }
        let s = all.section(&name)?;
        s.accept_as("device.sensors.SENSOR", &[])?;
        let kind = s.read(&key::kind)?;
        let own = KEYS.iter().find(|(of, _)| *of == kind).map_or(&[][..], |(_, keys)| keys);
        if let Some(other) = s.keys().find(|key| *key != "kind" && !own.contains(key)) {
            let takes: Vec<_> = own.iter().filter(|key| phases || !OF_PHASES.contains(*key)).copied().collect();
            let reason = format!("not of a sensor of kind \"{kind}\", which takes {}", takes.join(", "));
            return Err(s.error(other, reason));
        }
        let of_current = ["current", "sigma_delta"].contains(&kind);
        // A motor with three phases has its rotor first.
        let is_alone = (names.len() == 1 || phases) && !s.has(key::on.name);
        let body = if of_current {
            None
        } else if is_alone {
            Some(0)
        } else {
            Some(one_of(&s, &key::on, "body", names)?)
        };
        let of_phase = OF_PHASES.into_iter().find(|key| s.has(key));
        if let Some(key) = of_phase.filter(|_| !phases) {
            return Err(s.error(key, "of a sensor of a motor of kind \"pmsm\"; leave this out"));
        }
        let kind = match body {
            None if kind == "sigma_delta" => SensorKind::Modulator(modulator(&s, phases, clock)?),
            None => {
                let reading = if phases { Reading::Phase(phase(&s)?) } else { Reading::Current };
                SensorKind::Sampled(sampled(&s, reading, false, clock)?)
            }
            Some(1..) if kind == "hall" => return Err(s.error(key::on.name, "Hall switches are of the rotor")),
            Some(_) if kind == "hall" => match pole_pairs {
                Some(pairs) => {
                    let sector_rad = 2.0 * PI / (6.0 * f64::from(pairs));
                    SensorKind::Hall(Hall { reading: sensed.len(), sector_rad })
                }
                None => return Err(s.error("kind", "Hall switches are of a motor of kind \"pmsm\"")),
            },
            Some(body) if kind == "encoder" => {
                let encoder = encoder(&s, (&key::lines, &key::resolution), (slides[body], &names[body]))?;
                SensorKind::Encoder(sensed.len(), encoder)
            }
            Some(body) => {
                let s = s.alike(if slides[body] { &RAIL } else { &SHAFT });
                SensorKind::Sampled(sampled(&s, Reading::Position(sensed.len()), slides[body], clock)?)
            }
        };
        if s.has("chip") && sensors.iter().filter(|sensor: &&Sensor| sensor.is_chip()).count() == MOST_CHIPS {
            return Err(s.error("chip", format!("accepted: {MOST_CHIPS} chips on buses at most")));
        }
        let corner_hz = corner(&s, phases, body.is_some(), clock)?;
        sensed.extend(body.map(|body| Sensed { body, lag_rad_per_s: corner_hz.map(|hz| 2.0 * PI * hz) }));
        sensors.push(Sensor { name, kind });
    }
    Ok((sensors, sensed))
}

/// Reads the corner of a sensor's lag.
fn corner(s: &Section, phases: bool, is_angle: bool, clock: Clock) -> Result<Option<f64>, SceneError> {
    use keys::sensor as key;
    let corner_hz = s.given(&key::corner)?;
    if corner_hz.is_some() && phases && is_angle {
        return Err(s.error("corner", "an analog angle is one of a network; leave this out"));
    }
    if corner_hz.is_some() && !phases && !is_angle {
        return Err(s.error("corner", "of a phase's current, of a motor of kind \"pmsm\"; leave this out"));
    }
    if corner_hz.is_some_and(|hz| hz > clock.frequency_hz() as f64) {
        return Err(s.error("corner", "beyond the clock; leave the lag out"));
    }
    Ok(corner_hz)
}
