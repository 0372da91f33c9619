//! The world of an axis: a motor with its encoder, bridge and hand, or a recording in their place.
//!
//! [`Plant`] holds the immutable laws of a scene, [`AxisWorld`] their state.

use hpu_datapath::{LoopIn, LoopOut};
use hpu_plant::{Band, Device, Gates, REALS};
use hpu_signal::Real;

use crate::encoder::Encoder;
use crate::plant::{Kind, Plant};
use crate::summary::EnergyAudit;
use crate::world::{Pins, World};

/// The state of an axis and what is around it, at one clock edge.
#[derive(Clone)]
pub struct AxisWorld<'p> {
    plant: &'p Plant,
    /// Index of the net that an averaged bridge follows.
    command: usize,
    device: Option<Device<'p>>,
    encoder: Encoder,
    edge: u64,
    pins: Pins,
    /// Index of the next knot or recorded change.
    next: usize,
    /// Changes of recorded pins so far.
    recorded: u64,
}

impl<'p> AxisWorld<'p> {
    /// The world at edge 0, all gates off. `command` is the index of the net that an averaged bridge follows.
    #[must_use]
    pub fn new(plant: &'p Plant, command: usize) -> Self {
        let mut world = Self {
            plant,
            command,
            device: None,
            encoder: Encoder::new(plant.count_rad, 0.0),
            edge: 0,
            pins: Pins::default(),
            next: 0,
            recorded: 0,
        };
        if let Kind::Axis { axis, current_a, speed_rad_per_s, angle_rad, .. } = &plant.kind {
            world.device = Some(Device::new(axis, *current_a, *speed_rad_per_s, *angle_rad));
            world.encoder = Encoder::new(plant.count_rad, *angle_rad);
            world.pins = world.encoder.pins();
        }
        world.due();
        world.recorded = 0;
        world
    }

    /// The device, unless a recording stands in for it.
    #[must_use]
    pub fn device(&self) -> Option<&Device<'p>> {
        self.device.as_ref()
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
                    self.count(angle_rad);
                }
            }
            Kind::Capture { pins } => {
                while let Some(&(_, now)) = pins.get(self.next).filter(|change| change.0 <= self.edge) {
                    self.next += 1;
                    self.recorded += u64::from(now != self.pins);
                    self.pins = now;
                }
            }
        }
    }

    #[inline(always)]
    fn count(&mut self, angle_rad: f64) {
        if self.encoder.sense(angle_rad) {
            self.pins = self.encoder.pins();
        }
    }
}

impl World for AxisWorld<'_> {
    type In = LoopIn<i64>;
    type Out = LoopOut<i64>;
    type Row = [f64; REALS.len()];
    const REALS: &'static [Real] = &REALS;

    #[inline]
    fn edge(&self) -> u64 {
        self.edge
    }

    #[inline]
    fn place(&self, input: &mut LoopIn<i64>) {
        input.a_pin = self.pins.a;
        input.b_pin = self.pins.b;
    }

    #[inline]
    fn sense(&mut self) {
        self.edge += 1;
        if let Some(device) = &mut self.device {
            let x = device.step(self.edge);
            self.count(x[2]);
        }
        self.due();
    }

    #[inline]
    fn advance(&mut self, limit: u64, before: impl FnOnce(&Self, u64)) {
        let due = match &self.plant.kind {
            Kind::Axis { knots, .. } => knots.get(self.next).map(|knot| knot.edge),
            Kind::Capture { pins } => pins.get(self.next).map(|&(edge, _)| edge),
        };
        // Whatever has no edge of its own comes with the next one.
        let due = due.map(|edge| edge.max(self.edge + 1)).filter(|&edge| edge <= limit);
        let last = due.unwrap_or(limit);
        let Band { low, high, .. } = self.encoder.band();
        let event = self.device.as_ref().and_then(|device| device.next_event(self.edge, last, (low, high)));
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

    #[inline]
    fn drive(&mut self, out: LoopOut<i64>, words: &[i64]) {
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
            Some(full_scale) => device.drive_average(edge, words[self.command] as f64 / full_scale),
        }
    }

    fn reals(&self, edge: u64) -> Self::Row {
        self.device.as_ref().map_or([0.0; REALS.len()], |device| device.reals(edge))
    }

    fn audit(&self) -> EnergyAudit {
        let Some(device) = &self.device else {
            return EnergyAudit::default();
        };
        let (energy, stored_j) = (device.energy(self.edge), device.stored_j(self.edge));
        EnergyAudit {
            source_j: energy.source_j(),
            hand_j: energy.hand_j(),
            supplied_j: energy.supplied_j(),
            stored_j,
            copper_j: energy.copper_j(),
            diodes_j: energy.diodes_j(),
            viscous_j: energy.viscous_j(),
            coulomb_j: energy.coulomb_j(),
            dissipated_j: energy.dissipated_j(),
            exchanged_j: energy.exchanged_j(),
            residual_j: energy.supplied_j() - stored_j - energy.dissipated_j(),
            ..EnergyAudit::default()
        }
    }

    fn encoder_edges(&self) -> u64 {
        self.encoder.edges + self.recorded
    }

    fn mode_changes(&self) -> u64 {
        self.device.as_ref().map_or(0, Device::mode_changes)
    }
}
