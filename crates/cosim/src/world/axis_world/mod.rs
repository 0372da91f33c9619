//! The world of an axis: a motor or a mass with its encoder, its bridge or amplifier and its hand, or a recording in
//! their place; and the scheduled words of the wall (ramps).
//!
//! [`Plant`] holds the immutable laws of a scene, [`AxisWorld`] its state.

mod due;
mod placed;
mod state;

use std::collections::VecDeque;
use std::marker::PhantomData;

#[cfg(not(target_family = "wasm"))]
use hpu_datapath::foc::KnobIn;
#[cfg(not(target_family = "wasm"))]
use hpu_datapath::paddle::PaddleIn;
use hpu_datapath::{LoopIn, LoopOut};
use hpu_plant::network::NetworkDevice;
#[cfg(not(target_family = "wasm"))]
use hpu_plant::pmsm::PmsmDevice;
use hpu_plant::{Band, Device, Drive, Event};
use hpu_scene::Schedule;

use crate::result::stays::Tally;
use crate::world::EncoderState;
use crate::world::actuator::{Actuator, Latch, Modulator, Shaping};
#[cfg(not(target_family = "wasm"))]
use crate::world::any_device::Phased;
use crate::world::any_device::{AnyDevice, Other};
use crate::world::encoder::{Encoder, Follower, Pins};
use crate::world::faults::FaultState;
use crate::world::plant::{AnyLaws, Kind, Plant};
use crate::world::sensors::Sensors;
use crate::world::stepped::Stepped;

pub use placed::Placed;

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
    /// The sensor whose words the encoder's lines follow, and these lines.
    follower: Option<(usize, Follower)>,
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
            follower: None,
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
        world.put_device(read);
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

    /// Puts the device where it starts, with its sensors.
    fn put_device(&mut self, read: [Option<usize>; 3]) {
        let plant = self.plant;
        if let Kind::Axis { axis, current_a, speed_rad_per_s, angle_rad, .. } = &plant.kind {
            self.device = Some(match plant.stepping {
                None => AnyDevice::Exact(Device::new(axis, *current_a, *speed_rad_per_s, *angle_rad)),
                Some(stepping) => {
                    let start = [*current_a, *speed_rad_per_s, *angle_rad];
                    AnyDevice::Other(Box::new(Other::Stepped(Stepped::new(axis, stepping, plant.edge_s, start))))
                }
            });
            self.begin(*angle_rad);
        }
        if let Kind::Network { laws, angle_rad, sensors, followed, seed, .. } = &plant.kind {
            let mut device = AnyDevice::Other(Box::new(match laws {
                AnyLaws::Small(laws) => Other::Small(NetworkDevice::new(laws, 0.0)),
                AnyLaws::Large(laws) => Other::Large(NetworkDevice::new(laws, 0.0)),
            }));
            let read = followed.map_or(read, |(sensor, _)| [None, None, Some(sensor)]);
            let sensors = (!sensors.is_empty()).then(|| Sensors::new(sensors, *seed, &mut device, read));
            self.sensors = sensors.map(Box::new);
            self.device = Some(device);
            self.begin(*angle_rad);
            if let (Some((sensor, bits)), Some(sensors)) = (*followed, &mut self.sensors) {
                let (follower, word) = Follower::new(bits, self.encoder.count());
                sensors.preset(sensor, word);
                self.follower = Some((sensor, follower));
            }
        }
        #[cfg(not(target_family = "wasm"))]
        if let Kind::Pmsm { laws, start, sensors, seed, .. } = &plant.kind {
            let mut device = AnyDevice::Other(Box::new(Other::Pmsm(Phased::new(PmsmDevice::new(
                laws, [0.0; 2], start[1], start[0],
            )))));
            let sensors = (!sensors.is_empty()).then(|| Sensors::new(sensors, *seed, &mut device, read));
            self.sensors = sensors.map(Box::new);
            self.device = Some(device);
            self.begin(start[0]);
        }
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
            None if self.follower.is_some() => self.pins,
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
        match (&self.faults, &self.follower) {
            (None, None) => self.stays.see(self.edge, count),
            (None, Some((_, follower))) => self.stays.see_apart(self.edge, count, follower.shown),
            (Some(faults), _) => self.stays.see_apart(self.edge, count, faults.count(count)),
        }
    }

    /// Returns whether nothing is planned from here on: the device and the logic alone decide.
    #[inline]
    fn is_left_alone(&self) -> bool {
        let is_fixed = self.next_due == u64::MAX && self.shaping.is_none() && self.latch.is_none();
        is_fixed && self.faults.is_none() && self.sensors.is_none() && self.modulator.is_none()
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
