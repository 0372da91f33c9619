//! The sensors of a network beside the encoder that its logic counts, at work.

use std::collections::VecDeque;

use hpu_plant::{Band, Leg};
use hpu_scene::{Bus, Hall, MOST_SENSORS, Modulator, Phase, Reading, Sampled, Sensor, SensorKind, SplitMix64};

use crate::result::summary::{Frames, Starts};
use crate::world::any_device::AnyDevice;
use crate::world::encoder::Encoder;
use crate::world::i2c_chip::I2cChip;
use crate::world::spi_chip::{Lines, SpiChip};

/// The sensors of a scene at one clock edge.
#[derive(Clone)]
pub(crate) struct Sensors<'p> {
    encoders: Vec<FurtherEncoder>,
    samplers: Vec<Sampler<'p>>,
    /// The chips on a bus, each with the index of its sensor.
    chips: Vec<(usize, Chip)>,
    /// Of each sensor the words of its pins: lines A and B, or a word or bit and whether it came at this edge; of a
    /// chip its line out; of Hall switches all three.
    pins: Vec<[i64; 3]>,
    /// Whether anything reads that a word came: else it stays 0, and the edge after a word is no event.
    tells_new: bool,
    /// The legs of a bridge with three, and the bits by which a design starts samples, as they are.
    legs: [Leg; 3],
    started: i64,
    /// These bits with the lines of chips, as they were told last.
    told: i64,
    /// The sampler whose words an input shows at once, if there is one.
    converter: Option<usize>,
    /// The next edge at which anything but a sample of the converter is due.
    apart: u64,
}

/// A chip on a bus.
#[derive(Clone)]
enum Chip {
    Spi(SpiChip),
    I2c(I2cChip),
}

macro_rules! each {
    ($chip:expr, $it:ident => $call:expr) => {
        match $chip {
            Chip::Spi($it) => $call,
            Chip::I2c($it) => $call,
        }
    };
}

impl Chip {
    /// Takes the lines that the design drives, if they are others than before.
    fn drive(&mut self, edge: u64, [first, second, third]: [bool; 3]) {
        match self {
            Self::Spi(chip) => {
                let lines = Lines { csn: first, sck: second, mosi: third };
                if chip.lines() != lines {
                    chip.drive(edge, lines);
                }
            }
            Self::I2c(chip) if chip.lines() != [first, second] => chip.drive(edge, [first, second]),
            Self::I2c(_) => {}
        }
    }
}

/// An encoder that the device watches for it, or Hall switches, which are an encoder of six counts an electrical turn.
#[derive(Clone)]
struct FurtherEncoder {
    /// Its places among the scene's sensors and among the device's readings.
    sensor: usize,
    reading: usize,
    encoder: Encoder,
    is_hall: bool,
}

/// A sensor that samples a word or a bit.
#[derive(Clone)]
struct Sampler<'p> {
    /// Its place among the scene's sensors.
    sensor: usize,
    taking: Taking<'p>,
    /// Edges from a sample to the next, and from a sample to its word.
    period: u64,
    latency: u64,
    /// The edge before which it takes no sample.
    ready: u64,
    /// The edge of the next sample.
    next: u64,
    /// The words on their way, each with the edge at which it comes.
    waiting: VecDeque<(u64, i64)>,
    /// The edge after that at which the last word came, while that is to come.
    until: Option<u64>,
    starts: Starts,
}

/// How a sample is taken.
#[derive(Clone)]
enum Taking<'p> {
    /// A word, with noise, the mean of the readings without current, and the index of the lag of a phase's shunt.
    Word(&'p Sampled, SplitMix64, i64, Option<usize>),
    /// A bit of a modulator of a phase, or of the drive's current, with bits of this charge, and the charge that the
    /// bits so far stand for, in 2^-24 of it.
    Bit(Option<usize>, f64, i64),
}

/// The charge of a bit, in the units of the modulator's sum.
const BIT: i64 = 1 << 24;

impl<'p> Sensors<'p> {
    /// Puts sensors on a device that stands at edge 0. Words have a pin that tells when they come, unless the logic
    /// reads some of them at a pace of its own, the one of a current first.
    pub(crate) fn new(all: &'p [Sensor], seed: u64, device: &mut AnyDevice, read: [Option<usize>; 3]) -> Self {
        let (pins, tells_new, current) = (vec![[0; 3]; all.len()], read == [None; 3], read[0]);
        let mut sensors = Self {
            encoders: Vec::new(),
            samplers: Vec::new(),
            chips: Vec::new(),
            pins,
            tells_new,
            legs: [Leg::Open; 3],
            started: 0,
            told: 0,
            converter: None,
            apart: 0,
        };
        for (sensor, one) in all.iter().enumerate() {
            match &one.kind {
                SensorKind::Encoder(reading, encoder) => {
                    sensors.follow(sensor, (*reading, encoder.count_rad(), false), device);
                }
                SensorKind::Hall(Hall { reading, sector_rad }) => {
                    sensors.follow(sensor, (*reading, *sector_rad, true), device);
                }
                SensorKind::Sampled(of) => {
                    let mut taking = Taking::word(of, sensor, seed);
                    if let (Reading::Phase(phase), Some(corner), Taking::Word(.., lag)) =
                        (of.reading, of.lag_rad_per_s, &mut taking)
                    {
                        *lag = Some(device.lag(phase, corner));
                    }
                    if current == Some(sensor) && of.latency == 0 && !of.triggered {
                        sensors.converter = Some(sensors.samplers.len());
                    }
                    #[cfg(not(target_family = "wasm"))]
                    if let Some((bus, least)) = of.chip {
                        let chip = match bus {
                            Bus::Spi => Chip::Spi(SpiChip::new(least)),
                            Bus::I2c => Chip::I2c(I2cChip::new(least)),
                        };
                        // A free line is pulled up.
                        sensors.pins[sensor][0] = i64::from(bus == Bus::I2c);
                        sensors.chips.push((sensor, chip));
                    }
                    // A design sees no word at the edge at which it starts the sample.
                    let late = of.ready.saturating_sub(of.phase).div_ceil(of.period.max(1)) * of.period;
                    let times = if of.triggered {
                        (u64::MAX, 0, of.latency.max(1))
                    } else {
                        (of.phase + late, of.period, of.latency)
                    };
                    sensors.samplers.push(Sampler { ready: of.ready, ..Sampler::new(sensor, taking, times) });
                }
                SensorKind::Modulator(Modulator { period, phase, charge_as, winding }) => {
                    sensors.samplers.push(Sampler::new(
                        sensor,
                        Taking::Bit(*winding, *charge_as, 0),
                        (*phase, *period, 0),
                    ));
                }
            }
        }
        sensors.plan();
        sensors
    }

    /// Puts an encoder with counts of this angle on a reading of the device.
    fn follow(&mut self, sensor: usize, (reading, count_rad, is_hall): (usize, f64, bool), device: &mut AnyDevice) {
        let encoder = Encoder::new(count_rad, device.reading(reading, 0));
        self.encoders.push(FurtherEncoder { sensor, reading, encoder, is_hall });
        self.show(device, self.encoders.len() - 1);
    }

    /// Lets a sensor show a word before its first one.
    pub(crate) fn preset(&mut self, sensor: usize, word: i64) {
        self.pins[sensor][0] = word;
    }

    /// Returns the words of the pins of each sensor.
    pub(crate) fn pins(&self) -> &[[i64; 3]] {
        &self.pins
    }

    /// Appends to a row the count of each encoder and the word of each other sensor, in the order of the scene.
    pub(crate) fn tell(&self, row: &mut Vec<f64>) {
        let first = row.len();
        row.extend(self.pins.iter().map(|pins| pins[0] as f64));
        for (sensor, chip) in &self.chips {
            row[first + sensor] = each!(chip, it => it.word[0]) as f64;
        }
        for FurtherEncoder { sensor, encoder, .. } in &self.encoders {
            row[first + sensor] = encoder.count() as f64;
        }
    }

    /// Tells all encoders the device's position at an edge. Returns why no count follows it any more, if that is so.
    pub(crate) fn sense(&mut self, edge: u64, device: &mut AnyDevice) -> Option<&'static str> {
        let mut over = None;
        for index in 0..self.encoders.len() {
            let FurtherEncoder { reading, encoder, .. } = &mut self.encoders[index];
            let value = device.reading(*reading, edge);
            if encoder.sense_by(value, |band| device.side_of_reading(*reading, edge, value, band)) {
                over = over.or(encoder.over());
                self.show(device, index);
            }
        }
        over
    }

    /// Shows the count of an encoder, and lets the device watch for the next one.
    fn show(&mut self, device: &mut AnyDevice, index: usize) {
        let FurtherEncoder { sensor, reading, encoder, is_hall } = &self.encoders[index];
        let (pins, Band { low, high, .. }) = (encoder.pins(), encoder.band());
        self.pins[*sensor] = if *is_hall { hall(encoder.count()) } else { [pins.a, pins.b, 0] };
        device.watch(*reading, (low, high));
    }

    /// Returns the next edge at which a sample is taken or a word comes or stops being new, but for those of
    /// [`conversions`](Self::conversions).
    pub(crate) fn next_apart(&self) -> u64 {
        self.apart
    }

    /// Finds the edge of [`next_apart`](Self::next_apart).
    fn plan(&mut self) {
        let apart = |(place, _): &(usize, _)| Some(*place) != self.converter;
        let sampled = self.samplers.iter().enumerate().filter(apart).map(|(_, sampler)| sampler.due());
        let chips = self.chips.iter().map(|(_, chip)| each!(chip, it => it.due()));
        self.apart = sampled.chain(chips).min().unwrap_or(u64::MAX);
    }

    /// Returns the edge of the next sample of a current whose word an input shows at once, and the edges from one to
    /// the next.
    pub(crate) fn conversions(&self) -> Option<(u64, u64)> {
        self.converter.map(|place| (self.samplers[place].next, self.samplers[place].period))
    }

    /// Takes a number of these samples, and appends their words.
    pub(crate) fn convert(&mut self, count: u64, device: &mut AnyDevice, codes: &mut Vec<i64>) {
        let Some(place) = self.converter else { return };
        let Sampler { next, period, taking, sensor, .. } = &mut self.samplers[place];
        if let Taking::Word(of, random, zero, _) = taking {
            let word = |value| codes.push(of.word(value, *zero, |bound| random.below(bound)));
            device.floors((*next, *period), of.scale, count as usize, word);
        }
        *next += count * *period;
        if let Some(&code) = codes.last() {
            self.pins[*sensor][0] = code;
        }
    }

    /// Takes a sample of each sensor whose bit rises at this edge. A sensor that is still converting misses it. Returns
    /// whether anything may be due at another edge than before.
    pub(crate) fn start(&mut self, edge: u64, legs: [Leg; 3], bits: i64, device: &mut AnyDevice) -> bool {
        self.legs = legs;
        if std::mem::replace(&mut self.told, bits) == bits {
            return false;
        }
        let lines = bits >> MOST_SENSORS;
        for (place, (sensor, chip)) in self.chips.iter_mut().enumerate() {
            let level = |line: usize| lines >> (3 * place + line) & 1 != 0;
            let lines = [level(0), level(1), level(2)];
            let is_up = || self.samplers.iter().all(|sampler| sampler.sensor != *sensor || edge >= sampler.ready);
            if is_up() {
                chip.drive(edge, lines);
            }
        }
        let bits = bits & ((1 << MOST_SENSORS) - 1);
        let risen = bits & !self.started;
        self.started = bits;
        for sampler in self.samplers.iter_mut().filter(|sampler| risen >> sampler.sensor & 1 != 0) {
            if sampler.waiting.is_empty() && edge >= sampler.ready {
                let word = sampler.taking.take(edge, device, legs);
                sampler.waiting.push_back((edge + sampler.latency, word));
                sampler.starts.taken += 1;
            } else {
                sampler.starts.missed += 1;
            }
        }
        self.plan();
        true
    }

    /// Returns the frames of each chip, by the index of its sensor.
    pub(crate) fn frames(&self) -> Vec<(usize, Frames)> {
        self.chips.iter().map(|(sensor, chip)| (*sensor, each!(chip, it => it.frames()))).collect()
    }

    /// Returns how often a design has started samples, of each sensor by its index that waits for it.
    pub(crate) fn starts(&self) -> Vec<(usize, Starts)> {
        let triggered = self.samplers.iter().filter(|sampler| sampler.period == 0);
        triggered.map(|sampler| (sampler.sensor, sampler.starts)).collect()
    }

    /// Carries out what is due at an edge.
    pub(crate) fn happen(&mut self, edge: u64, device: &mut AnyDevice) {
        for sampler in self.samplers.iter_mut().filter(|sampler| sampler.due() <= edge) {
            match self.chips.iter_mut().find(|(sensor, _)| *sensor == sampler.sensor) {
                Some((_, chip)) => {
                    let word = each!(chip, it => &mut it.word);
                    sampler.happen(edge, (device, self.legs), word, false);
                }
                None => {
                    let pins = &mut self.pins[sampler.sensor];
                    sampler.happen(edge, (device, self.legs), pins, self.tells_new);
                }
            }
        }
        for (sensor, chip) in &mut self.chips {
            if let Some(level) = each!(chip, it => it.shown(edge)) {
                self.pins[*sensor][0] = level;
            }
        }
        self.plan();
    }
}

/// Returns the levels of three Hall switches in a sixth of an electrical turn: each is 1 for half a turn, and the three
/// are a third of a turn apart.
fn hall(sixth: i64) -> [i64; 3] {
    [0, 2, 4].map(|first| i64::from((sixth - first).rem_euclid(6) < 3))
}

impl<'p> Taking<'p> {
    /// Returns the taking of words, which reads its zero before the run if it has one.
    fn word(of: &'p Sampled, sensor: usize, seed: u64) -> Self {
        // Each sensor has random numbers of its own, whatever the others draw.
        let mut random = SplitMix64::new(seed.wrapping_mul(64).wrapping_add(32 + sensor as u64));
        let (count, mut zero) = (i64::from(of.zero_of), 0);
        if count > 0 {
            let sum = (0..count).map(|_| of.word(0, 0, |bound| random.below(bound))).sum::<i64>();
            zero = (2 * sum + count).div_euclid(2 * count);
        }
        Self::Word(of, random, zero, None)
    }

    fn take(&mut self, edge: u64, device: &mut AnyDevice, legs: [Leg; 3]) -> i64 {
        match self {
            Self::Word(of, random, zero, lag) => {
                let value = match of.reading {
                    _ if let Some(lag) = *lag => device.floor_of_lag(lag, edge, of.scale),
                    Reading::Phase(Phase { leg, is_low_side: true }) if legs[leg] != Leg::Low => 0,
                    reading => device.floor(reading, edge, of.scale),
                };
                of.word(value, *zero, |bound| random.below(bound))
            }
            Self::Bit(winding, charge_as, told) => {
                let charge = device.charge_as(*winding, edge);
                let bit = (charge / *charge_as * BIT as f64).floor() as i64 >= *told;
                *told += if bit { BIT } else { -BIT };
                bit.into()
            }
        }
    }
}

impl<'p> Sampler<'p> {
    fn new(sensor: usize, taking: Taking<'p>, (next, period, latency): (u64, u64, u64)) -> Self {
        let (waiting, starts) = (VecDeque::new(), Starts::default());
        Self { sensor, taking, period, latency, ready: 0, next, waiting, until: None, starts }
    }

    fn due(&self) -> u64 {
        let comes = self.waiting.front().map_or(u64::MAX, |(edge, _)| *edge);
        self.next.min(comes).min(self.until.unwrap_or(u64::MAX))
    }

    fn happen(
        &mut self,
        edge: u64,
        (device, legs): (&mut AnyDevice, [Leg; 3]),
        [shown, is_new, _]: &mut [i64; 3],
        tells_new: bool,
    ) {
        if self.until.take_if(|until| *until <= edge).is_some() {
            *is_new = 0;
        }
        if self.next <= edge {
            let word = self.taking.take(edge, device, legs);
            self.next += self.period;
            if self.latency == 0 && !tells_new {
                *shown = word;
                return;
            }
            self.waiting.push_back((edge + self.latency, word));
        }
        while let Some((_, word)) = self.waiting.pop_front_if(|(comes, _)| *comes <= edge) {
            *shown = word;
            if tells_new {
                (*is_new, self.until) = (1, Some(edge + 1));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::hall;

    #[test]
    fn hall_switches_close_for_half_a_turn_each_a_third_of_a_turn_after_the_one_before() {
        // Levels of a, b and c in the six sixths of an electrical turn: Gray codes, of which 000 and 111 are none.
        let turn = [[1, 0, 1], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]];
        for sixth in -12..12 {
            assert_eq!(hall(sixth), turn[sixth.rem_euclid(6) as usize], "{sixth}");
        }
    }
}
