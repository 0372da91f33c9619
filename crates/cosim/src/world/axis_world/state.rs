//! An axis as a [`World`].

use hpu_datapath::{LoopOut, Repeat};
use hpu_plant::{Band, Gates, Pace, Pulses, REALS};
use hpu_signal::{Cycle, Observe, Real};

use super::AxisWorld;
use super::placed::Placed;
use crate::result::columns::{AXIS_ROW, CURRENT_BETWEEN, SPEED_BETWEEN, TORQUE_BETWEEN, tell};
#[cfg(not(target_family = "wasm"))]
use crate::result::forever::Rest;
use crate::result::stays::Sums;
use crate::result::summary::{EnergyAudit, Summary, Unheld};
use crate::world::actuator::Actuator;
use crate::world::any_device::{AnyDevice, Other};
use crate::world::{EncoderState, World};

/// Steps passed at a time: enough that the leaps between them cost little, few enough that a run can be stopped.
const GLIDES: u32 = 64;

/// Returns the gates that a wiring's outputs drive.
#[inline(always)]
pub(super) fn gates(out: LoopOut<i64>) -> Gates {
    let [a_high, a_low, b_high, b_low] = [out.a_high, out.a_low, out.b_high, out.b_low].map(|gate| gate != 0);
    Gates { a_high, a_low, b_high, b_low }
}

impl<I> AxisWorld<'_, I> {
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
        if let Some(AnyDevice::Other(other)) = &self.device
            && let Other::Stepped(_) = **other
        {
            self.pass_steps(limit, before);
        }
    }

    #[inline(always)]
    fn drive(&mut self, out: I::Out, words: &[i64]) {
        let bridge = I::bridge(&out);
        if self.told == Some(bridge) {
            return;
        }
        let is_switching = matches!(self.plant.actuator, Actuator::Switching);
        let word = if is_switching { 0 } else { I::command(self, &out, words) };
        // A bridge that switches has no command.
        if self.commanded != Some(word) {
            self.drive_anew(bridge, word);
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
        let is_switching = matches!(self.plant.actuator, Actuator::Switching);
        if !is_switching || self.faults.as_ref().is_some_and(|faults| faults.may_stick()) {
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
