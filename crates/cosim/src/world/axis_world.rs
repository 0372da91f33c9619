//! The world of an axis: a motor or a mass with its encoder, its bridge or amplifier and its hand, or a recording in
//! their place; and the scheduled words of the wall (ramps).
//!
//! [`Plant`] holds the immutable laws of a scene, [`AxisWorld`] its state.

use std::collections::VecDeque;
use std::marker::PhantomData;

use hpu_datapath::foc::{FocOut, KnobIn};
use hpu_datapath::paddle::PaddleIn;
use hpu_datapath::{LoopIn, LoopOut, Repeat};
use hpu_plant::network::NetworkDevice;
#[cfg(not(target_family = "wasm"))]
use hpu_plant::pmsm::PmsmDevice;
use hpu_plant::{Band, Device, Drive, Event, Gates, Leg, Pace, Pulses, REALS};
use hpu_signal::{Cycle, Observe, Ports, Real};

use crate::result::columns::{AXIS_ROW, CURRENT_BETWEEN, SPEED_BETWEEN, TORQUE_BETWEEN, tell};
#[cfg(not(target_family = "wasm"))]
use crate::result::forever::Rest;
use crate::result::stays::{Sums, Tally};
use crate::result::summary::{EnergyAudit, Summary, Unheld};
use crate::world::actuator::{Actuator, Latch, Modulator, Shaping};
#[cfg(not(target_family = "wasm"))]
use crate::world::any_device::Phased;
use crate::world::any_device::{AnyDevice, Other};
use crate::world::encoder::{Encoder, Pins};
use crate::world::faults::FaultState;
use crate::world::plant::{AnyLaws, Kind, Plant};
use crate::world::sensors::Sensors;
use crate::world::stepped::Stepped;
use crate::world::{EncoderState, World};
use hpu_scene::{MOST_SENSORS, Schedule};

/// Steps passed at a time: enough that the leaps between them cost little, few enough that a run can be stopped.
const GLIDES: u32 = 64;

/// The inputs of a wiring that an axis's world drives, with the outputs of that wiring. Implemented by those of the
/// haptic loops, of the paddle's, and of the loop behind field-oriented control.
pub trait Placed: Ports<i64> + Copy + PartialEq {
    /// The outputs of the wiring.
    type Out: Ports<i64> + Copy + PartialEq;
    /// Returns the gates of an H-bridge; all 0 of another one.
    fn bridge(out: &Self::Out) -> LoopOut<i64>;
    /// Returns the word that an actuator which takes commands gets.
    fn command(world: &AxisWorld<Self>, out: &Self::Out, words: &[i64]) -> i64;
    /// Writes the present values.
    fn placed(&mut self, world: &AxisWorld<Self>);
    /// Whether these are the present values.
    #[inline]
    fn is_placed(&self, world: &AxisWorld<Self>) -> bool {
        let mut placed = *self;
        placed.placed(world);
        placed == *self
    }
}

/// The part of `impl Placed` that is alike for wirings with an H-bridge.
macro_rules! on_an_h_bridge {
    () => {
        type Out = LoopOut<i64>;

        #[inline(always)]
        fn bridge(out: &LoopOut<i64>) -> LoopOut<i64> {
            *out
        }

        #[inline(always)]
        fn command(world: &AxisWorld<Self>, _: &LoopOut<i64>, words: &[i64]) -> i64 {
            words[world.command]
        }
    };
}

impl Placed for LoopIn<i64> {
    on_an_h_bridge!();

    #[inline]
    fn placed(&mut self, world: &AxisWorld) {
        self.a_pin = world.pins.a;
        self.b_pin = world.pins.b;
        if world.is_scheduled {
            self.stiffness = world.stiffness.unwrap_or(self.stiffness);
            self.scale = world.scale.unwrap_or(self.scale);
            self.reference = world.reference.unwrap_or(self.reference);
        }
    }

    #[inline]
    fn is_placed(&self, world: &AxisWorld) -> bool {
        let Pins { a, b } = world.pins;
        (self.a_pin, self.b_pin) == (a, b)
            && (!world.is_scheduled
                || world.stiffness.is_none_or(|stiffness| stiffness == self.stiffness)
                    && world.scale.is_none_or(|scale| scale == self.scale)
                    && world.reference.is_none_or(|reference| reference == self.reference))
    }
}

impl Placed for PaddleIn<i64> {
    on_an_h_bridge!();

    #[inline]
    fn placed(&mut self, world: &AxisWorld<Self>) {
        self.a_pin = world.pins.a;
        self.b_pin = world.pins.b;
        if let Some(target) = world.reference {
            self.target = target;
        }
        let is_on = world.edge >= world.begins.0;
        [self.proportional, self.integral, self.derivative] = if is_on { world.begins.1 } else { [0; 3] };
        let (Some(sensors), [code, hall, _]) = (&world.sensors, world.read) else { return };
        if let Some(code) = code {
            self.code = sensors.pins()[code][0];
        }
        if let Some(hall) = hall {
            self.hall = sensors.pins()[hall][0];
        }
    }
}

/// Bits of a command to three legs that switch them.
const LEGS: u32 = 6;
/// Bits of a duty in a command to averaged legs, and the duties of open switches.
const DUTY: u32 = 16;
const OPEN: i64 = (1 << (3 * DUTY)) - 1;

impl Placed for KnobIn<i64> {
    type Out = FocOut<i64>;

    fn bridge(_: &FocOut<i64>) -> LoopOut<i64> {
        LoopOut { a_high: 0, a_low: 0, b_high: 0, b_low: 0 }
    }

    #[inline]
    fn command(world: &AxisWorld<Self>, out: &FocOut<i64>, words: &[i64]) -> i64 {
        let FocOut { a_high, a_low, b_high, b_low, c_high, c_low, trigger } = *out;
        let started = || match trigger {
            0 => 0,
            _ => world.read[..2].iter().flatten().fold(0, |bits, sensor| bits | 1 << sensor),
        };
        match world.plant.actuator {
            Actuator::ThreeLegs => {
                let gates = a_high | a_low << 1 | b_high << 2 | b_low << 3 | c_high << 4 | c_low << 5;
                gates | started() << LEGS
            }
            // The modulator takes the duties at the edge at which it starts the converters.
            Actuator::AveragedLegs { .. } if trigger == 1 && world.edge >= world.begins.0 => {
                let duties = &words[world.command..world.command + 3];
                duties.iter().rev().fold(0, |word, duty| word << DUTY | duty) | started() << (3 * DUTY)
            }
            Actuator::AveragedLegs { .. } => world.commanded.unwrap_or(OPEN) & OPEN | started() << (3 * DUTY),
            _ => words[world.command],
        }
    }

    #[inline]
    fn placed(&mut self, world: &AxisWorld<Self>) {
        self.a_pin = world.pins.a;
        self.b_pin = world.pins.b;
        let Some(sensors) = &world.sensors else { return };
        self.enable = i64::from(world.edge >= world.begins.0);
        for (word, sensor) in [&mut self.i_a, &mut self.i_b, &mut self.code].into_iter().zip(world.read) {
            if let Some(sensor) = sensor {
                *word = sensors.pins()[sensor][0];
            }
        }
    }

    #[inline]
    fn is_placed(&self, world: &AxisWorld<Self>) -> bool {
        let Pins { a, b } = world.pins;
        let Some(sensors) = &world.sensors else { return (self.a_pin, self.b_pin) == (a, b) };
        let is_read = |sensor: Option<usize>, word: i64| sensor.is_none_or(|sensor| sensors.pins()[sensor][0] == word);
        (self.a_pin, self.b_pin) == (a, b)
            && (self.enable != 0) == (world.edge >= world.begins.0)
            && is_read(world.read[0], self.i_a)
            && is_read(world.read[1], self.i_b)
            && is_read(world.read[2], self.code)
    }
}

/// The state of an axis and its surroundings, at one clock edge, for wirings with the inputs `I`.
#[derive(Clone)]
pub struct AxisWorld<'p, I = LoopIn<i64>> {
    plant: &'p Plant,
    /// Index of the net that an averaged bridge or an amplifier follows.
    command: usize,
    schedule: Schedule,
    /// Whether the schedule has a word. Most have none, and the world asks at every event.
    is_scheduled: bool,
    shaping: Option<Shaping>,
    latch: Option<Latch>,
    /// The modulator behind a host.
    modulator: Option<Box<Modulator>>,
    device: Option<AnyDevice<'p>>,
    /// The outputs that the device was last told; `None` if it has cruised since, without being told every change.
    told: Option<LoopOut<i64>>,
    /// The commands on their way through a host, each with the edge at which the actuator takes it.
    waiting: VecDeque<(u64, i64)>,
    /// The word of the command that an averaged bridge or an amplifier was last told.
    commanded: Option<i64>,
    encoder: Encoder,
    /// The set with the net of the position counter; empty where no net counts.
    counter: u64,
    /// The edges inside the wall, deep inside it, and out of the position counter's reach.
    stays: Tally,
    /// Faults between device and logic, if the scene asks for any.
    faults: Option<Box<FaultState<'p>>>,
    /// The sensors of a network beside the encoder, if it has any.
    sensors: Option<Box<Sensors<'p>>>,
    /// Why the run cannot go on, apart from the reasons that the device itself knows.
    over: Option<&'static str>,
    edge: u64,
    pins: Pins,
    /// Index of the next knot or recorded change.
    next: usize,
    /// The next edge at which something is due at a time fixed beforehand: a knot, a recorded change, a word, the
    /// shaper, a duty.
    next_due: u64,
    /// The same but for the samples of the converter whose code is an input.
    due_apart: u64,
    /// Scheduled words in the place of the scene's constants.
    stiffness: Option<i64>,
    scale: Option<i64>,
    reference: Option<i64>,
    /// Changes of recorded pins so far.
    recorded: u64,
    /// The count of recorded lines, from their first levels.
    recorded_count: i64,
    /// The sensors whose words are inputs: of the current, and of the angle; of three phases those of the currents in a
    /// and b, then of the angle.
    read: [Option<usize>; 3],
    /// The edge from which on the paddle's position controller has its gains, 0 before, and these gains; of three
    /// phases the edge from which on the gates switch.
    begins: (u64, [i64; 3]),
    inputs: PhantomData<I>,
}

impl<'p> AxisWorld<'p> {
    /// Creates the world at edge 0, all gates off. `command` is the index of the net that an averaged bridge or an
    /// amplifier follows.
    pub fn new(plant: &'p Plant, command: usize, schedule: Schedule) -> Self {
        Self::made(plant, command, schedule, [None; 3])
    }
}

#[cfg(not(target_family = "wasm"))]
impl<'p> AxisWorld<'p, PaddleIn<i64>> {
    /// Creates the world of the paddle's loop, which reads the words of a current and, if it is one, of an angle. Its
    /// position controller has these gains from an edge on at which the schedule gives another target.
    pub(crate) fn of_paddle(
        plant: &'p Plant,
        command: usize,
        schedule: Schedule,
        [code, hall]: [Option<usize>; 2],
        begins: (u64, [i64; 3]),
    ) -> Self {
        Self { begins, ..Self::made(plant, command, schedule, [code, hall, None]) }
    }
}

#[cfg(not(target_family = "wasm"))]
impl<'p> AxisWorld<'p, KnobIn<i64>> {
    /// Creates the world of the loop behind field-oriented control, which reads the words of two currents and, if it is
    /// one, of an angle. The gates switch from an edge on. `command` is the index of the net that an amplifier follows,
    /// or of the first duty of averaged legs.
    pub(crate) fn of_three_phases(
        plant: &'p Plant,
        command: usize,
        read: [Option<usize>; 3],
        enabled_from: u64,
    ) -> Self {
        let mut world = Self::made(plant, command, Schedule::default(), read);
        world.begins.0 = enabled_from;
        world.plan();
        world
    }
}

impl<'p, I> AxisWorld<'p, I> {
    fn made(plant: &'p Plant, command: usize, schedule: Schedule, read: [Option<usize>; 3]) -> Self {
        let mut world = Self {
            plant,
            command,
            is_scheduled: !schedule.is_empty(),
            schedule,
            shaping: None,
            latch: None,
            modulator: None,
            device: None,
            told: None,
            waiting: VecDeque::new(),
            commanded: None,
            encoder: Encoder::new(plant.count_rad, 0.0),
            counter: 0,
            stays: plant.places.tally(0),
            faults: plant.faults.as_ref().map(|plan| Box::new(FaultState::new(plan))),
            sensors: None,
            over: None,
            edge: 0,
            pins: Pins::default(),
            next: 0,
            next_due: 0,
            due_apart: 0,
            stiffness: None,
            scale: None,
            reference: None,
            recorded: 0,
            recorded_count: 0,
            read,
            begins: (0, [0; 3]),
            inputs: PhantomData,
        };
        if let Kind::Axis { axis, current_a, speed_rad_per_s, angle_rad, .. } = &plant.kind {
            world.device = Some(match plant.stepping {
                None => AnyDevice::Exact(Device::new(axis, *current_a, *speed_rad_per_s, *angle_rad)),
                Some(stepping) => {
                    let start = [*current_a, *speed_rad_per_s, *angle_rad];
                    AnyDevice::Other(Box::new(Other::Stepped(Stepped::new(axis, stepping, plant.edge_s, start))))
                }
            });
            world.begin(*angle_rad);
        }
        if let Kind::Network { laws, angle_rad, sensors, seed, .. } = &plant.kind {
            let mut device = AnyDevice::Other(Box::new(match laws {
                AnyLaws::Small(laws) => Other::Small(NetworkDevice::new(laws, 0.0)),
                AnyLaws::Large(laws) => Other::Large(NetworkDevice::new(laws, 0.0)),
            }));
            let sensors = (!sensors.is_empty()).then(|| Sensors::new(sensors, *seed, &mut device, read[0]));
            world.sensors = sensors.map(Box::new);
            world.device = Some(device);
            world.begin(*angle_rad);
        }
        #[cfg(not(target_family = "wasm"))]
        if let Kind::Pmsm { laws, start, sensors, seed, .. } = &plant.kind {
            let mut device = AnyDevice::Other(Box::new(Other::Pmsm(Phased::new(PmsmDevice::new(
                laws, [0.0; 2], start[1], start[0],
            )))));
            let sensors = (!sensors.is_empty()).then(|| Sensors::new(sensors, *seed, &mut device, read[0]));
            world.sensors = sensors.map(Box::new);
            world.device = Some(device);
            world.begin(start[0]);
        }
        match plant.actuator {
            Actuator::Amplified { shaping, .. } => world.shaping = shaping,
            Actuator::Averaged { latch, .. } => {
                world.latch = latch;
                if let Some(device) = &mut world.device {
                    device.driven(0, Drive::Average(latch.map_or(0.0, |latch| latch.given)));
                }
            }
            Actuator::Preloaded { .. } => {
                world.commanded = Some(0);
                world.waiting.push_back((1, 0));
            }
            Actuator::Modulated(config) => world.modulator = Modulator::new(config).map(Box::new),
            Actuator::Switching | Actuator::ThreeLegs | Actuator::AveragedLegs { .. } | Actuator::Converted { .. } => {}
        }
        world.due();
        // What was recorded before is the lines' first levels.
        (world.recorded, world.recorded_count) = (0, 0);
        if let Kind::Capture { .. } = plant.kind {
            world.stays = plant.places.tally(0);
        }
        world
    }

    /// Sets the encoder to the angle at the start.
    fn begin(&mut self, angle_rad: f64) {
        self.encoder = Encoder::new(self.plant.count_rad, angle_rad);
        self.stays = self.plant.places.tally(self.encoder.count());
        self.pins = self.encoder.pins();
        self.over = self.encoder.over();
    }

    /// Returns the world whose position counter shows its count in the net of this index.
    #[must_use]
    pub(crate) fn counted_by(self, net: Option<usize>) -> Self {
        Self { counter: net.map_or(0, |net| 1 << net), ..self }
    }

    /// Returns the device, unless it is stepped or a recording stands in for it.
    pub fn device(&self) -> Option<&Device<'p>> {
        match &self.device {
            Some(AnyDevice::Exact(device)) => Some(device),
            _ => None,
        }
    }

    /// Returns the levels of the encoder's lines.
    pub fn pins(&self) -> Pins {
        self.pins
    }

    /// Returns the encoder's count, from angle 0.
    pub fn count(&self) -> i64 {
        self.encoder.count()
    }

    /// Returns the state of the encoder.
    pub(crate) fn encoder_state(&self) -> EncoderState {
        let (count, faults) = (self.count(), self.faults.as_ref());
        let shown = faults.map_or(count, |faults| faults.count(count));
        EncoderState { count, shown, pins: self.pins, has_index: faults.is_none_or(|faults| faults.has_index()) }
    }

    /// Tells the encoder its angle at the present edge.
    #[inline(always)]
    fn look_at(&mut self, angle_rad: f64) {
        let Band { low, high, .. } = self.encoder.band();
        if let Some(device) = &mut self.device
            && !device.is_surely_within(self.edge, angle_rad, (low, high))
        {
            self.recount(angle_rad);
        }
        if self.sensors.is_some() {
            self.sense_more();
        }
    }

    /// Tells the sensors beside the encoder the motion at the present edge.
    #[cold]
    fn sense_more(&mut self) {
        if let (Some(sensors), Some(device)) = (&mut self.sensors, &mut self.device) {
            self.over = sensors.sense(self.edge, device).or(self.over);
        }
    }

    #[cold]
    fn recount(&mut self, angle_rad: f64) {
        let (edge, before) = (self.edge, self.encoder.count());
        let Some(device) = &mut self.device else { return };
        // In most cases the angle is the next count's, so far from its ends that `f64` can tell.
        let beside = self.encoder.beside(angle_rad);
        match beside.filter(|(_, band)| device.is_surely_within(edge, angle_rad, (band.low, band.high))) {
            Some(beside) => self.encoder.step(beside),
            None if self.encoder.sense_by(angle_rad, |band| device.side_of_band(edge, angle_rad, band)) => {}
            None => return,
        }
        self.over = self.encoder.over();
        self.pins = match &mut self.faults {
            None => self.encoder.pins(),
            Some(faults) => {
                faults.moved(edge, before, self.encoder.count());
                self.next_due = faults.next().map_or(self.next_due, |next| next.min(self.next_due));
                faults.pins(self.encoder.count())
            }
        };
        self.stay();
    }

    /// Takes note of where the device is from the present edge on. The position counter counts what the lines show.
    #[inline(always)]
    fn stay(&mut self) {
        let count = self.encoder.count();
        match &self.faults {
            None => self.stays.see(self.edge, count),
            Some(faults) => self.stays.see_apart(self.edge, count, faults.count(count)),
        }
    }

    /// Carries out what is due at the present edge: the hand's knot, a recorded change, a word, the shaper's output,
    /// the duty.
    fn due(&mut self) {
        let edge = self.edge;
        if self.is_scheduled {
            self.stiffness = self.schedule.stiffness.map(|ramp| ramp.word(edge));
            self.scale = self.schedule.scale.map(|ramp| ramp.word(edge));
            let target = self.schedule.target.as_ref().map(|target| target.word(edge));
            self.reference = target.or_else(|| self.schedule.wanted.map(|ramp| ramp.word(edge)));
        }
        if let (Some(shaping), Some(device)) = (&mut self.shaping, &mut self.device)
            && shaping.next <= edge
        {
            device.driven(edge, Drive::Current(-shaping.hand_on(edge)));
        }
        if let (Some(latch), Some(device)) = (&mut self.latch, &mut self.device)
            && latch.next <= edge
        {
            device.driven(edge, Drive::Average(latch.take()));
        }
        if let Some(modulator) = &mut self.modulator
            && modulator.next <= edge
        {
            modulator.tick(edge);
            let gates = modulator.gates;
            self.switch(gates);
        }
        while let Some((_, word)) = self.waiting.pop_front_if(|(due, _)| *due <= edge) {
            self.give(word);
        }
        match &self.plant.kind {
            Kind::Axis { knots, .. } | Kind::Network { knots, .. } | Kind::Pmsm { knots, .. } => {
                while let Some(knot) = knots.get(self.next).filter(|knot| knot.edge <= self.edge) {
                    self.next += 1;
                    let device = self.device.as_mut().expect("an axis has a device");
                    device.intend(self.edge, knot.angle_rad, knot.speed_rad_per_s);
                    let angle_rad = device.angle_rad(self.edge);
                    self.look_at(angle_rad);
                }
            }
            Kind::Capture { pins } => {
                while let Some(&(_, now)) = pins.get(self.next).filter(|change| change.0 <= self.edge) {
                    self.next += 1;
                    self.recorded += u64::from(now != self.pins);
                    self.recorded_count += self.pins.counts_to(now);
                    self.pins = now;
                    self.stays.unheld.see(edge, self.recorded_count);
                }
            }
        }
        if let (Some(sensors), Some(device)) = (&mut self.sensors, &mut self.device)
            && self.next_due <= edge
        {
            sensors.happen(edge, device);
        }
        if let Some(faults) = self.faults.as_mut().filter(|faults| faults.next().is_some_and(|next| next <= edge)) {
            let told = self.told.or_else(|| self.modulator.as_ref().map(|modulator| modulator.gates));
            if faults.happen(edge)
                && let (Some(out), Some(device)) = (told, &mut self.device)
            {
                // A fault may have moved the switches although the outputs are the same.
                device.driven(edge, Drive::Gates(gates(faults.drive(out))));
                self.over = self.over.or(faults.over());
            }
            self.pins = faults.pins(self.encoder.count());
            self.stay();
        }
        self.plan();
    }

    /// Tells the device the gates of a modulator.
    fn switch(&mut self, out: LoopOut<i64>) {
        let Some(device) = &mut self.device else { return };
        let switches = match &mut self.faults {
            None => out,
            Some(faults) => {
                let switches = faults.drive(out);
                self.over = self.over.or(faults.over());
                switches
            }
        };
        device.driven(self.edge, Drive::Gates(gates(switches)));
    }

    /// Tells the device outputs or a command that it was not told last.
    #[inline(never)]
    fn drive_anew(&mut self, out: LoopOut<i64>, word: i64) {
        let edge = self.edge;
        if self.device.is_none() {
            return;
        }
        match self.plant.actuator {
            Actuator::Switching => {
                self.told = Some(out);
                self.switch(out);
            }
            _ => {
                self.commanded = Some(word);
                match (self.plant.late, self.plant.actuator) {
                    // The modulator reads, at the first edge of a period, the word of the edge before it.
                    (_, Actuator::Preloaded { period, .. }) => {
                        self.waiting.push_back((edge.div_ceil(period) * period + 1, word));
                    }
                    (0, _) => self.give(word),
                    (late, _) => self.waiting.push_back((edge + late, word)),
                }
                self.plan();
            }
        }
    }

    /// Gives a command to an actuator that follows commands.
    fn give(&mut self, word: i64) {
        let edge = self.edge;
        let Some(device) = &mut self.device else { return };
        match self.plant.actuator {
            Actuator::Switching => {}
            Actuator::Modulated(_) => {
                if let Some(modulator) = &mut self.modulator {
                    modulator.take(edge, word);
                }
            }
            Actuator::ThreeLegs => {
                let legs = std::array::from_fn(|leg| match word >> (2 * leg) & 3 {
                    1 => Leg::High,
                    2 => Leg::Low,
                    _ => Leg::Open,
                });
                device.driven(edge, Drive::Legs(legs));
                if let Some(sensors) = &mut self.sensors {
                    sensors.start(edge, legs, word >> (2 * legs.len()), device);
                }
            }
            Actuator::AveragedLegs { steps, min_pulse } => {
                let duties: [i64; 3] = std::array::from_fn(|leg| word >> (DUTY * leg as u32) & ((1 << DUTY) - 1));
                let share = |duty: i64| match duty {
                    _ if duty < i64::from(min_pulse) => 0.0,
                    _ if duty > i64::from(steps - min_pulse) => 1.0,
                    _ => duty as f64 / f64::from(steps),
                };
                let is_open = word & OPEN == OPEN;
                let drive = if is_open { Drive::Legs([Leg::Open; 3]) } else { Drive::Averages(duties.map(share)) };
                device.driven(edge, drive);
                if let Some(sensors) = &mut self.sensors {
                    // The converters start at the valley, where all low switches are on.
                    let legs = [if is_open { Leg::Open } else { Leg::Low }; 3];
                    sensors.start(edge, legs, word >> (3 * DUTY) & ((1 << MOST_SENSORS) - 1), device);
                }
            }
            // As with a bridge in antiphase, but a positive command pushes towards the positive direction.
            Actuator::Preloaded { steps, centre, .. } => {
                let duty = 2.0 * (word + i64::from(centre)) as f64 / f64::from(steps) - 1.0;
                device.driven(edge, Drive::Average(-duty));
            }
            Actuator::Averaged { full_scale, .. } => {
                let duty = word as f64 / full_scale;
                let given = match &mut self.latch {
                    None => Some(duty),
                    Some(latch) => latch.give(edge, duty),
                };
                if let Some(given) = given {
                    device.driven(edge, Drive::Average(given));
                }
            }
            Actuator::Converted { dac, width, sign } => {
                device.driven(edge, Drive::Current(sign * dac.current_a(word, width)));
            }
            // As with a bridge, a positive command pushes against the positive direction.
            Actuator::Amplified { quantum_n, .. } => {
                let force_n = word as f64 * quantum_n;
                let given = match &mut self.shaping {
                    None => Some(force_n),
                    Some(shaping) => shaping.take(edge, force_n),
                };
                if let Some(given_n) = given {
                    device.driven(edge, Drive::Current(-given_n));
                }
            }
        }
    }

    /// Passes ends of steps before `limit`, as [`glide`](World::glide) does.
    #[inline(never)]
    fn pass_steps(&mut self, limit: u64, mut before: impl FnMut(&Self, u64)) {
        let last = self.next_due.max(self.edge + 1).min(limit);
        let Band { low, high, .. } = self.encoder.band();
        for _ in 0..GLIDES {
            let Some(AnyDevice::Other(other)) = &mut self.device else { return };
            let Other::Stepped(body) = &mut **other else { return };
            let Some(event) = body.passes(last - 1, (low, high)) else { return };
            before(self, event.0);
            self.edge = event.0;
            if let Some(device) = &mut self.device {
                device.arrive(event);
            }
        }
    }

    /// Shows rows as [`rows`](World::rows) does, up to `N` at a time.
    #[inline(always)]
    fn show_rows<const N: usize, O: Observe + ?Sized>(&self, first: u64, stride: u64, count: u64, observer: &mut O) {
        let mut rows = [[0.0; REALS.len()]; N];
        let mut from = first;
        let mut left = count;
        while left != 0 {
            let some = &mut rows[..left.min(N as u64) as usize];
            if let Some(device) = &self.device {
                device.rows(from, stride, some);
            }
            observer.block(Cycle(from), stride, REALS.len(), some.as_flattened());
            from += stride * some.len() as u64;
            left -= some.len() as u64;
        }
    }

    /// Returns whether nothing is planned from here on: the device and the logic alone decide.
    #[inline]
    fn is_left_alone(&self) -> bool {
        let is_fixed = self.next_due == u64::MAX && self.shaping.is_none() && self.latch.is_none();
        is_fixed && self.faults.is_none() && self.sensors.is_none() && self.modulator.is_none()
    }

    /// Finds the next edge at which something is due.
    fn plan(&mut self) {
        let outside = match &self.plant.kind {
            Kind::Axis { knots, .. } | Kind::Network { knots, .. } | Kind::Pmsm { knots, .. } => {
                knots.get(self.next).map(|knot| knot.edge)
            }
            Kind::Capture { pins } => pins.get(self.next).map(|&(edge, _)| edge),
        };
        // One after the other: the compiler must not compare what an absent part leaves uninitialised, which valgrind
        // reports.
        let mut due = outside.unwrap_or(u64::MAX);
        if let Some(shaping) = &self.shaping {
            due = due.min(shaping.next);
        }
        if let Some(latch) = &self.latch {
            due = due.min(latch.next);
        }
        if let Some(modulator) = &self.modulator {
            due = due.min(modulator.next);
        }
        if let Some(faults) = &self.faults {
            due = due.min(faults.next().unwrap_or(u64::MAX));
        }
        if let Some((edge, _)) = self.waiting.front() {
            due = due.min(*edge);
        }
        if self.is_scheduled {
            due = due.min(self.schedule.next(self.edge).unwrap_or(u64::MAX));
        }
        self.next_due = due;
        if let Some(sensors) = &self.sensors {
            due = due.min(sensors.next_apart());
            if self.edge < self.begins.0 {
                due = due.min(self.begins.0);
            }
            self.due_apart = due;
            self.next_due = sensors.conversions().map_or(due, |(first, _)| due.min(first));
        }
    }

    /// Returns the first edge up to `last` at which the device changes by itself.
    #[inline(always)]
    fn event(&mut self, last: u64) -> Option<Event> {
        let Band { low, high, .. } = self.encoder.band();
        // No closure: one that several functions share is called.
        match &mut self.device {
            Some(device) => device.next_event(self.edge, last, (low, high)),
            None => None,
        }
    }
}

/// Returns the gates that a wiring's outputs drive.
#[inline(always)]
fn gates(out: LoopOut<i64>) -> Gates {
    let [a_high, a_low, b_high, b_low] = [out.a_high, out.a_low, out.b_high, out.b_low].map(|gate| gate != 0);
    Gates { a_high, a_low, b_high, b_low }
}

impl<I: Placed> World for AxisWorld<'_, I> {
    type In = I;
    type Out = I::Out;
    type Row = [f64; REALS.len()];
    const REALS: &'static [Real] = &REALS;

    #[inline]
    fn edge(&self) -> u64 {
        self.edge
    }

    #[inline]
    fn place(&self, input: &mut I) {
        input.placed(self);
    }

    #[inline]
    fn shows(&self, input: &I) -> bool {
        input.is_placed(self)
    }

    #[inline]
    fn sense(&mut self) {
        self.edge += 1;
        if let Some(device) = &mut self.device {
            let angle_rad = device.step(self.edge);
            self.look_at(angle_rad);
        }
        if self.edge >= self.next_due {
            self.due();
        }
    }

    #[inline]
    fn advance(&mut self, limit: u64, before: impl FnOnce(&Self, u64)) {
        // Whatever is due at no edge of its own takes effect at the next edge.
        let last = self.next_due.max(self.edge + 1).min(limit);
        let event = self.event(last);
        let edge = event.map_or(last, |event| event.0);
        before(self, edge);
        self.edge = edge;
        if let (Some(device), Some(event)) = (&mut self.device, event) {
            let angle_rad = device.arrive(event);
            self.look_at(angle_rad);
        }
        if edge >= self.next_due {
            self.due();
        }
    }

    #[inline(always)]
    fn keeps(&self, edge: u64) -> bool {
        edge < self.next_due && self.faults.is_none() && self.device.as_ref().is_some_and(|device| device.keeps(edge))
    }

    fn next_change(&mut self, limit: u64) -> u64 {
        let last = self.next_due.max(self.edge + 1).min(limit);
        let event = self.event(last);
        event.map_or(last, |event| event.0)
    }

    #[inline]
    fn idles(&mut self, edges: u64) -> u64 {
        let edges = self.next_due.saturating_sub(self.edge + 1).min(edges);
        let Band { low, high, .. } = self.encoder.band();
        match &mut self.device {
            Some(device) if edges > 0 => device.idles(self.edge, edges, (low, high)),
            _ => 0,
        }
    }

    #[inline]
    fn coast(&mut self, edges: u64) {
        self.edge += edges;
    }

    #[inline(never)]
    fn convert(&mut self, limit: u64, before: impl FnOnce(&Self, u64), codes: &mut Vec<i64>) -> (u64, u64) {
        let Some((first, period)) = self.sensors.as_ref().and_then(|sensors| sensors.conversions()) else {
            return (0, 0);
        };
        let last = self.due_apart.min(limit);
        let event = if first < last { self.event(last) } else { None };
        let count = event.map_or(last, |event| event.0).saturating_sub(first).div_ceil(period);
        if count == 0 {
            return (0, 0);
        }
        let edge = first + (count - 1) * period;
        before(self, edge);
        self.edge = edge;
        if let (Some(sensors), Some(device)) = (&mut self.sensors, &mut self.device) {
            sensors.convert(count, device, codes);
        }
        self.next_due = self.due_apart.min(edge + period);
        (first, period)
    }

    #[inline(always)]
    fn glide(&mut self, limit: u64, before: impl FnMut(&Self, u64)) {
        if let Some(AnyDevice::Other(_)) = self.device {
            self.pass_steps(limit, before);
        }
    }

    #[inline(always)]
    fn drive(&mut self, out: I::Out, words: &[i64]) {
        if !self.is_driven_by(&out, words) {
            let word = if self.plant.actuator == Actuator::Switching { 0 } else { I::command(self, &out, words) };
            self.drive_anew(I::bridge(&out), word);
        }
    }

    #[inline(always)]
    fn is_driven_by(&self, out: &I::Out, words: &[i64]) -> bool {
        self.told == Some(I::bridge(out)) || self.commanded.is_some_and(|word| word == I::command(self, out, words))
    }

    fn driven_by(&self) -> u64 {
        match self.plant.actuator {
            Actuator::Switching | Actuator::ThreeLegs | Actuator::AveragedLegs { .. } => 0,
            _ => 1 << self.command,
        }
    }

    #[inline(always)]
    fn holds_outputs(&self) -> bool {
        self.told.is_some()
    }

    fn foresee(&mut self, repeat: &Repeat<I::Out>) -> Option<u64> {
        if self.plant.actuator != Actuator::Switching || self.faults.as_ref().is_some_and(|faults| faults.may_stick()) {
            return None;
        }
        let last = self.edge.saturating_add(repeat.edges).saturating_add(1).min(self.next_due);
        let Band { low, high, .. } = self.encoder.band();
        let pulses = Pulses { period: repeat.period, duty: repeat.first, pause: gates(I::bridge(&repeat.others)) };
        let end = self.device.as_mut()?.cruise(self.edge, last, (low, high), &pulses)?;
        // During a cruise the device is not told every change.
        self.told = None;
        Some(end)
    }

    fn reals(&self, edge: u64) -> Self::Row {
        self.device.as_ref().map_or([0.0; REALS.len()], |device| device.reals(edge))
    }

    fn rows<O: Observe + ?Sized>(&self, first: u64, stride: u64, count: u64, observer: &mut O) {
        if count == 1 {
            return observer.reals(Cycle(first), &self.reals(first));
        }
        if let Some(row) = self.device.as_ref().and_then(|device| device.still(first)) {
            return observer.still(Cycle(first), stride, count, &row);
        }
        if count <= 8 {
            self.show_rows::<8, O>(first, stride, count, observer);
        } else {
            self.show_rows::<64, O>(first, stride, count, observer);
        }
    }

    fn measure(&mut self, stride: u64, observer: &dyn Observe) {
        let period = self.plant.modulator;
        if let Some(device) = &mut self.device {
            // A torque is a current by another name.
            let is_read = |columns: [usize; 3]| observer.reads(columns[0]..columns[2] + 1);
            let current = is_read(CURRENT_BETWEEN) || is_read(TORQUE_BETWEEN);
            device.measure(Pace { stride, period }, [current, is_read(SPEED_BETWEEN)]);
        }
    }

    fn exact(&self, edge: u64) -> Self::Row {
        self.device.as_ref().map_or([0.0; REALS.len()], |device| device.shown(edge, &device.exact_state(edge)))
    }

    fn shown(&self, edge: u64, row: &mut Vec<f64>) {
        let (Some((torque_constant, units)), Some(device)) = (self.plant.effort(), &self.device) else {
            return row.resize(AXIS_ROW.len(), 0.0);
        };
        let x = device.exact_state(edge);
        row.extend(device.shown(edge, &x));
        if let Some(measured) = device.measured(edge, &x) {
            // Of a network in the units of the body with the encoder.
            let [position, effort] = device.felt(edge, &x);
            tell(torque_constant, &measured, [position / units, effort * units], row);
            if let Some(sensors) = &self.sensors {
                sensors.tell(row);
            }
        }
    }

    fn sums(&self, edge: u64) -> Sums {
        let (Some((effort_per_a, _)), Some(device)) = (self.plant.effort(), &self.device) else {
            return Sums::default();
        };
        Sums { energy: device.energy(edge), stays: self.stays.stays(edge), effort_per_a }
    }

    fn overflowing(&self) -> u64 {
        if self.stays.unheld.is_there() { self.counter } else { 0 }
    }

    fn encoder(&self) -> Option<EncoderState> {
        Some(self.encoder_state())
    }

    fn sensors(&self) -> &[[i64; 3]] {
        self.sensors.as_ref().map_or(&[], |sensors| sensors.pins())
    }

    #[inline]
    fn mark(&self) -> Option<u64> {
        match &self.device {
            Some(device) if self.is_left_alone() => device.mark(self.edge),
            _ => None,
        }
    }

    fn recurs(&self, earlier: &Self) -> bool {
        let (Some(now), Some(then)) = (&self.device, &earlier.device) else { return false };
        // All else follows from these, or from the wiring.
        self.is_left_alone()
            && earlier.is_left_alone()
            && self.encoder.count() == earlier.encoder.count()
            && now.recurs(self.edge, then, earlier.edge)
    }

    fn repeat(&mut self, [then, now]: [&Self; 2], times: u64) {
        let edges = times * (now.edge - then.edge);
        if let (Some(device), Some(before), Some(after)) = (&mut self.device, &then.device, &now.device) {
            device.repeat(edges, [before, after], times);
        }
        self.encoder.edges += times * (now.encoder.edges - then.encoder.edges);
        self.stays.repeat(edges, [(&then.stays, then.edge), (&now.stays, now.edge)], times);
        self.edge += edges;
    }

    #[cfg(not(target_family = "wasm"))]
    fn left_alone(&self) -> Result<f64, &'static str> {
        if !self.is_left_alone() {
            return Err("the hand moves on, or a sensor, a shaper, a latch, a host or a fault has a memory of its own");
        }
        match &self.device {
            Some(device) if device.mark(self.edge).is_some() => Ok(self.plant.count_rad),
            Some(_) => Err("a device in fixed steps is not compared"),
            None => Err("a recording has no device"),
        }
    }

    #[cfg(not(target_family = "wasm"))]
    fn reach(&self) -> u64 {
        self.device.as_ref().map_or(u64::MAX, AnyDevice::reach)
    }

    #[cfg(not(target_family = "wasm"))]
    fn rest(&self, lead: &[(I::Out, u64)], cycle: &[(I::Out, u64)]) -> Option<Rest> {
        let Some(AnyDevice::Exact(device)) = &self.device else { return None };
        let switching = self.plant.actuator == Actuator::Switching;
        let share = |(out, edges): &(I::Out, u64)| {
            Some((device.supply_share(switching.then(|| gates(I::bridge(out))))?, *edges))
        };
        let Band { low, high, .. } = self.encoder.band();
        Some(Rest {
            edge: self.edge,
            band_rad: [low, high],
            standing: device.standing(self.edge)?,
            lead: lead.iter().map(share).collect::<Option<_>>()?,
            cycle: cycle.iter().map(share).collect::<Option<_>>()?,
        })
    }

    fn summary(&self) -> Summary {
        let (device, faults) = (self.device.as_ref(), self.faults.as_ref());
        let audit = |device: &AnyDevice| EnergyAudit::of(&device.energy(self.edge), device.stored_j(self.edge));
        let unheld = &self.stays.unheld;
        Summary {
            unheld: unheld.first().map(|first| Unheld { first, edges: unheld.edges(self.edge) }),
            encoder_edges: self.encoder.edges + self.recorded,
            mode_changes: device.map_or(0, AnyDevice::mode_changes),
            steps: device.map_or(0, AnyDevice::steps),
            redecided: device.map_or(0, AnyDevice::redecided),
            energy: device.map_or_else(EnergyAudit::default, audit),
            faults: faults.map_or_else(Vec::new, |faults| faults.marks().to_vec()),
            faults_waiting: faults.map_or(0, |faults| faults.waiting()),
            frames: self.sensors.as_ref().map_or_else(Vec::new, |sensors| sensors.frames()),
            starts: self.sensors.as_ref().map_or_else(Vec::new, |sensors| sensors.starts()),
            ..Summary::default()
        }
    }

    #[inline]
    fn over(&self) -> Option<&'static str> {
        self.over.or_else(|| self.device.as_ref().and_then(AnyDevice::over))
    }
}
