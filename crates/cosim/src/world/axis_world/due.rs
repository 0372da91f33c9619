//! Edges known beforehand at which something happens to an axis, and commands to its actuator.

use hpu_datapath::LoopOut;
use hpu_plant::{Drive, Leg};
use hpu_scene::MOST_SENSORS;

use super::AxisWorld;
use super::placed::{DUTY, OPEN};
use super::state::gates;
use crate::world::actuator::Actuator;
use crate::world::encoder::Pins;
use crate::world::plant::Kind;

impl<I> AxisWorld<'_, I> {
    /// Carries out what is due at the present edge: the hand's knot, a recorded change, a word, the shaper's output,
    /// the duty.
    pub(super) fn due(&mut self) {
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
            if let Some((sensor, follower)) = &mut self.follower {
                follower.follow(edge, sensors.pins()[*sensor][0]);
                self.pins = Pins::at(follower.shown);
                self.stay();
            }
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
    pub(super) fn switch(&mut self, out: LoopOut<i64>) {
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
    pub(super) fn drive_anew(&mut self, out: LoopOut<i64>, word: i64) {
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
                    (0, _) if !self.give(word) => return,
                    (0, _) => {}
                    (late, _) => self.waiting.push_back((edge + late, word)),
                }
                self.plan();
            }
        }
    }

    /// Gives a command to an actuator that follows commands. Returns whether another edge than before may be the next
    /// at which something is due.
    pub(super) fn give(&mut self, word: i64) -> bool {
        let edge = self.edge;
        let Some(device) = &mut self.device else { return false };
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
                let bits = word >> (2 * legs.len());
                return self.sensors.as_mut().is_some_and(|sensors| sensors.start(edge, legs, bits, device));
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
                // The converters start at the valley, where all low switches are on.
                let legs = [if is_open { Leg::Open } else { Leg::Low }; 3];
                let bits = word >> (3 * DUTY) & ((1 << MOST_SENSORS) - 1);
                return self.sensors.as_mut().is_some_and(|sensors| sensors.start(edge, legs, bits, device));
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
        true
    }

    /// Finds the next edge at which something is due.
    pub(super) fn plan(&mut self) {
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
            if let Some((_, follower)) = &self.follower {
                due = due.min(follower.next);
            }
            if self.edge < self.begins.0 {
                due = due.min(self.begins.0);
            }
            self.due_apart = due;
            self.next_due = sensors.conversions().map_or(due, |(first, _)| due.min(first));
        }
    }
}
