//! Everything outside the FPGA: the device with its encoder, bridge and hand, or a recording in their place.
//!
//! [`Plant`] holds the immutable laws of a scene, [`World`] their state. Datapath and plant meet here through two small
//! things: the encoder's pins that an edge samples, and the gates that hold from that edge to the next.

use hpu_datapath::LoopOut;
use hpu_plant::{Device, Energy, Gates, REALS};

use crate::plant::{Kind, Plant};

/// The levels of the two encoder lines.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Pins {
    /// Line A, 0 or 1.
    pub a: i64,
    /// Line B, 0 or 1.
    pub b: i64,
}

impl Pins {
    /// The lines at a count: forward runs 00, 01, 11, 10.
    #[must_use]
    pub fn at(count: i64) -> Self {
        let phase = count & 3;
        Self { a: phase >> 1, b: (phase >> 1) ^ (phase & 1) }
    }
}

/// The state of a world, at one clock edge.
#[derive(Clone)]
pub struct World<'p> {
    plant: &'p Plant,
    device: Option<Device<'p>>,
    edge: u64,
    count: i64,
    band: (f64, f64),
    pins: Pins,
    /// Index of the next knot or recorded change.
    next: usize,
    encoder_edges: u64,
}

impl<'p> World<'p> {
    /// The world at edge 0, all gates off.
    #[must_use]
    pub fn new(plant: &'p Plant) -> Self {
        let mut world = Self {
            plant,
            device: None,
            edge: 0,
            count: 0,
            band: (0.0, 0.0),
            pins: Pins::default(),
            next: 0,
            encoder_edges: 0,
        };
        match &plant.kind {
            Kind::Axis { axis, current_a, speed_rad_per_s, angle_rad, .. } => {
                world.device = Some(Device::new(axis, *current_a, *speed_rad_per_s, *angle_rad));
                world.recount(*angle_rad);
            }
            Kind::Capture { .. } => {}
        }
        world.due();
        world.encoder_edges = 0;
        world
    }

    /// The edge the world stands at.
    #[must_use]
    pub fn edge(&self) -> u64 {
        self.edge
    }

    /// The pins as they stand.
    #[inline]
    #[must_use]
    pub fn pins(&self) -> Pins {
        self.pins
    }

    /// The device, unless a recording stands in for it.
    #[must_use]
    pub fn device(&self) -> Option<&Device<'p>> {
        self.device.as_ref()
    }

    /// Changes of the encoder's count so far (edges of its lines).
    #[must_use]
    pub fn encoder_edges(&self) -> u64 {
        self.encoder_edges
    }

    /// The continuous outputs at an edge at or after the device's anchor and before its next event; zeros for a recording.
    #[must_use]
    pub fn reals(&self, edge: u64) -> [f64; REALS.len()] {
        self.device.as_ref().map_or([0.0; REALS.len()], |device| device.reals(edge))
    }

    /// The energy exchanged so far, and the energy stored over the start's.
    #[must_use]
    pub fn energy(&self) -> (Energy, f64) {
        self.device
            .as_ref()
            .map_or_else(Default::default, |device| (device.energy(self.edge), device.stored_j(self.edge)))
    }

    /// Flows by one clock edge: the pins that this edge samples.
    #[inline]
    pub fn sense(&mut self) -> Pins {
        self.edge += 1;
        if let Some(device) = &mut self.device {
            let x = device.step(self.edge);
            self.count(x[2]);
        }
        self.due();
        self.pins
    }

    /// Goes to the first edge after the present one, up to `limit`, at which anything here changes by itself (a pin, a mode,
    /// the hand's intention), or to `limit`; shows each edge of the way to `before` while it still lies ahead.
    #[inline]
    pub fn advance(&mut self, limit: u64, before: impl FnOnce(&Self, u64)) {
        let due = match &self.plant.kind {
            Kind::Axis { knots, .. } => knots.get(self.next).map(|knot| knot.edge),
            Kind::Capture { pins } => pins.get(self.next).map(|&(edge, _)| edge),
        };
        // Whatever has no edge of its own comes with the next one.
        let due = due.map(|edge| edge.max(self.edge + 1)).filter(|&edge| edge <= limit);
        let last = due.unwrap_or(limit);
        let event = self.device.as_ref().and_then(|device| device.next_event(self.edge, last, self.band));
        let edge = event.map_or(last, |event| event.0);
        before(self, edge);
        self.edge = edge;
        if let (Some(device), Some(event)) = (&mut self.device, event) {
            let x = device.arrive(event);
            self.count(x[2]);
        }
        if due == Some(edge) {
            self.due();
        }
    }

    /// The gates and the command from the present edge on.
    #[inline]
    pub fn drive(&mut self, out: LoopOut<i64>, command: i64) {
        let edge = self.edge;
        let Some(device) = &mut self.device else {
            return;
        };
        match self.plant.averaged {
            None => {
                let [a_high, a_low, b_high, b_low] =
                    [out.a_high, out.a_low, out.b_high, out.b_low].map(|gate| gate != 0);
                device.drive(edge, Gates { a_high, a_low, b_high, b_low });
            }
            Some(full_scale) => device.drive_average(edge, command as f64 / full_scale),
        }
    }

    /// Takes in what is due at the present edge: the hand's knot, a recorded change.
    #[inline]
    fn due(&mut self) {
        match &self.plant.kind {
            Kind::Axis { knots, .. } => {
                while let Some(knot) = knots.get(self.next).filter(|knot| knot.edge <= self.edge) {
                    self.next += 1;
                    let device = self.device.as_mut().expect("an axis has a device");
                    device.intend(self.edge, knot.angle_rad, knot.speed_rad_per_s);
                    let angle_rad = device.state(self.edge)[2];
                    self.recount(angle_rad);
                }
            }
            Kind::Capture { pins } => {
                while let Some(&(_, now)) = pins.get(self.next).filter(|change| change.0 <= self.edge) {
                    self.next += 1;
                    self.encoder_edges += u64::from(now != self.pins);
                    self.pins = now;
                }
            }
        }
    }

    #[inline(always)]
    fn count(&mut self, angle_rad: f64) {
        if !(angle_rad >= self.band.0 && angle_rad < self.band.1) {
            self.recount(angle_rad);
        }
    }

    /// The count of an angle: the integer `c` with `c·δ <= angle < (c+1)·δ` in the products as computed, so that it does
    /// not depend on how the angle was reached.
    fn recount(&mut self, angle_rad: f64) {
        let step = self.plant.count_rad;
        let mut count = (angle_rad / step).floor() as i64;
        while angle_rad < count as f64 * step {
            count -= 1;
        }
        while angle_rad >= (count + 1) as f64 * step {
            count += 1;
        }
        self.encoder_edges += count.abs_diff(self.count);
        self.count = count;
        self.band = (count as f64 * step, (count + 1) as f64 * step);
        self.pins = Pins::at(count);
    }
}
