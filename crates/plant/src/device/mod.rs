//! An axis in motion: its state, its modes, and its energy exchanged so far.
//!
//! The state is kept at an *anchor* edge, in double-double, and flowed from there, never stepped. The anchor moves only
//! when the drive of the motion changes: the gates or the amplifier's current, the hand's intention, or a mode (slip
//! and stuck, diode and open circuit).
//!
//! # What it costs
//!
//! An encoder edge of a chattering cell takes some 2 200 instructions with the four ticks of the datapath that come
//! with it (case `chatter` of `crates/wave/examples/instructions.rs`): 720 are the search for the next crossing, 730
//! the engine and the encoder, 370 the datapath, 180 new anchors, 50 rows. The time is that of some 11 edges of
//! `clock`.

mod cruise;
mod known;
mod modes;
mod search;
mod standing;
mod waves;

use hpu_signal::Real;

use crate::axis::{Hand, Mode, Shaft};
use crate::energy::{Energy, Powers, stored_j};
use crate::flow::double::{Double, Doubles, Native, Product, versions};
use crate::flow::gauge::{Flow, Gauge, Measured, Pace, Whole};
use crate::flow::guard::{Limits, Side, Watch};
use crate::flow::leap::Integrals;
use crate::flow::linear::Trajectory;
use crate::flow::matrix::{ANGLE, CURRENT, INTENT, SPEED, State};
use crate::{Axis, Circuit, Gates, Leg};

use cruise::{Cruise, Ripple};
use known::{Ahead, Known};
use modes::Check;
use waves::Waves;

pub use cruise::Pulses;
pub use standing::Standing;

/// The multiplier of a [`mark`](Device::mark): the golden ratio, as a fraction of 2^64.
const MIX: u64 = 0x9e37_79b9_7f4a_7c15;

/// The continuous outputs, in the order of [`Device::reals`].
pub const REALS: [Real; 4] = [
    Real { name: "current_a", doc: "Motor current" },
    Real { name: "speed_rad_per_s", doc: "Speed of the motor's shaft" },
    Real { name: "angle_rad", doc: "Angle of the motor's shaft" },
    Real { name: "torque_nm", doc: "Torque of the motor on its shaft, positive along the positive angle" },
];

/// The drive of an axis.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Drive {
    /// A bridge's gates.
    Gates(Gates),
    /// A bridge's mean voltage: a duty between -1 and 1.
    Average(f64),
    /// An imposed current in A; on a rail a force in N.
    Current(f64),
    /// The switches of an inverter's three legs, of phases a, b and c.
    Legs([Leg; 3]),
    /// The mean voltages of an inverter's three terminals, as shares of the supply between 0 and 1.
    Averages([f64; 3]),
}

/// An axis in motion.
#[derive(Clone)]
pub struct Device<'a> {
    pub(crate) axis: &'a Axis,
    pub(crate) anchor: u64,
    pub(crate) motion: Trajectory<'a>,
    pub(crate) mode: &'a Mode,
    pub(crate) shaft: Shaft,
    pub(crate) drive: Drive,
    pub(crate) circuit: Circuit,
    pub(crate) intent_rad_per_s: f64,
    pub(crate) checks: [Option<Check<'a>>; 2],
    pub(crate) powers: Powers,
    pub(crate) energy: Energy,
    pub(crate) initial_j: f64,
    pub(crate) mode_changes: u64,
    /// The state of a cruise over repeated gates; the motion is then the smooth one.
    pub(crate) cruise: Option<Cruise<'a>>,
    /// The edge at which the last smooth motion tried leaves its limits.
    pub(crate) leaves: u64,
    /// The ripple of the pulses under which a cruise was last tried. It holds for these pulses on any motion.
    pub(crate) ripple: Option<Ripple<'a>>,
    pub(crate) redecided: u64,
    /// The limits within which the check of the shaft must stay.
    pub(crate) held: Limits,
    pub(crate) known: Known,
    /// Current and speed between rows, if the observer asks for them.
    gauge: Option<Box<Gauge<2>>>,
}

/// The edge of an event, and the state of the motion there.
pub type Event = (u64, State);

impl<'a> Device<'a> {
    /// Creates a device at edge 0 with initial current, speed and angle, in its circuit: with all gates off, or with an
    /// amplifier that maintains the current.
    pub fn new(axis: &'a Axis, current_a: f64, speed_rad_per_s: f64, angle_rad: f64) -> Self {
        let x = [current_a, speed_rad_per_s, angle_rad, angle_rad];
        let emf_v = axis.motor.torque_constant_nm_per_a * speed_rad_per_s;
        let (drive, circuit) = if axis.amplified {
            (Drive::Current(current_a), Circuit::Amplified)
        } else if axis.is_resistive() {
            (Drive::Average(0.0), axis.bridge.averaged(0.0))
        } else {
            (Drive::Gates(Gates::default()), axis.bridge.circuit(Gates::default(), current_a, emf_v))
        };
        let mode = axis.mode(Shaft::Slip(0), None);
        let motor = &axis.motor;
        let mut device = Self {
            axis,
            anchor: 0,
            motion: Trajectory::new(&mode.system, x, [0.0; 4]),
            mode,
            shaft: Shaft::Slip(0),
            drive,
            circuit,
            intent_rad_per_s: 0.0,
            checks: [None; 2],
            powers: Powers::default(),
            energy: Energy::default(),
            initial_j: stored_j(motor.inductance_h, motor.inertia_kg_m2, &x),
            mode_changes: 0,
            cruise: None,
            leaves: 0,
            ripple: None,
            redecided: 0,
            held: Limits::ANY,
            known: Known::NOTHING,
            gauge: None,
        };
        device.shaft = device.shaft_at::<Native>(&x.into());
        device.enter(0, x.into());
        device
    }

    /// Returns the state at an edge at or after the anchor.
    #[inline]
    pub fn state(&self, edge: u64) -> State {
        let edges = edge - self.anchor;
        match &self.cruise {
            None => self.motion.at(edges),
            Some(cruise) => cruise.at(&self.motion, edges),
        }
    }

    versions! {
        /// Returns the state at an edge at or after the anchor, computed in double-double and rounded once. Unlike
        /// [`state`](Self::state) it does not depend on the anchors from which it is reached: a cruise gives what the
        /// pulses that it stands for give.
        pub fn exact_state[exact_fused, exact_native, exact_with](self: &Self, edge: u64) -> State
    }

    #[inline(always)]
    fn exact_with<P: Product>(&self, edge: u64) -> State {
        let edges = edge - self.anchor;
        match &self.cruise {
            None => self.motion.flow::<P>(edges),
            Some(cruise) => cruise.flow::<P>(&self.motion, edges),
        }
        .hi
    }

    /// Returns the state for edges asked in rising order, one by one; remembers the terms that neighbours share.
    #[inline(always)]
    pub fn state_next(&mut self, edge: u64) -> State {
        let edges = edge - self.anchor;
        match &mut self.cruise {
            None => self.motion.at_next(edges, &mut self.known.prefix),
            Some(cruise) => cruise.at_next(&self.motion, edges, &mut self.known.prefix),
        }
    }

    /// Returns the outputs named by [`REALS`] at an edge.
    pub fn reals(&self, edge: u64) -> [f64; REALS.len()] {
        self.shown(&self.state(edge))
    }

    /// Writes the outputs at the edges `first`, `first + stride` and so on: each equals [`reals`](Self::reals) to the
    /// bit.
    pub fn rows(&self, first: u64, stride: u64, rows: &mut [[f64; REALS.len()]]) {
        if self.cruise.is_some() {
            for (row, index) in rows.iter_mut().zip(0..) {
                *row = self.reals(first + index * stride);
            }
            return;
        }
        self.motion.rows(first - self.anchor, stride, rows);
        for row in rows {
            *row = self.shown(row);
        }
    }

    /// Returns the outputs at this edge and at all later ones, if nothing moves in the present mode: each equals
    /// [`reals`](Self::reals) to the bit.
    pub fn still(&self, edge: u64) -> Option<[f64; REALS.len()]> {
        (self.cruise.is_none() && edge > self.anchor).then(|| self.motion.still())?.map(|x| self.shown(&x))
    }

    /// Returns whether the motion certainly goes on as it is when the device [arrives](Self::arrive) at an edge up to
    /// the next known event.
    #[inline(always)]
    pub fn keeps(&self, edge: u64) -> bool {
        if self.cruise.is_some() || edge > self.known.ahead.until {
            return false;
        }
        if edge - self.anchor <= self.known.kept {
            return true;
        }
        let Some((_, x)) = self.known.ahead.event.as_ref().filter(|event| event.0 <= edge) else { return true };
        for (check, noise) in self.checks.iter().zip(&self.known.noise[1..]) {
            let Some(Check { guard, limits, .. }) = check else { continue };
            let value = guard.value(x);
            if value - limits.low.hi <= *noise || limits.high.hi - value <= *noise {
                return false;
            }
        }
        true
    }

    /// Returns the outputs of a state, in the order of [`REALS`].
    #[inline(always)]
    pub fn shown(&self, x: &State) -> [f64; REALS.len()] {
        [x[CURRENT], x[SPEED], x[ANGLE], self.axis.motor.torque_constant_nm_per_a * x[CURRENT]]
    }

    /// Gathers means of current and speed between rows from edge 0 on, and extremes where they are `read`; see
    /// [`measured`](Self::measured).
    pub fn measure(&mut self, pace: Pace, read: [bool; 2]) {
        self.gauge = Some(Box::new(Gauge::new(pace, read)));
    }

    /// Returns the exact means and extremes of current and speed since the row before the row at this edge, at which
    /// the state is `x`; `None` unless [`measure`](Self::measure) asked for them.
    pub fn measured(&self, edge: u64, x: &State) -> Option<[Measured; 2]> {
        let gauge = self.gauge.as_deref()?;
        let passed;
        let gauge = if edge == self.anchor {
            gauge
        } else {
            passed = self.gauge_at(gauge, edge);
            &passed
        };
        Some(gauge.row(edge, self.motion.system().edge_s(), &[x[CURRENT], x[SPEED]]))
    }

    /// Returns the hand's angle and torque in a state: see [`Axis::felt`].
    pub fn felt(&self, x: &State) -> [f64; 2] {
        self.axis.felt(x, self.intent_rad_per_s)
    }

    /// Returns the gauge at an edge after the anchor.
    fn gauge_at(&self, gauge: &Gauge<2>, edge: u64) -> Gauge<2> {
        let guards = [&self.mode.current, &self.mode.speed];
        let flow = Flow { motion: &self.motion, guards, anchor: self.anchor };
        match &self.cruise {
            None => gauge.after(self.anchor, edge, Some(edge), &flow),
            Some(cruise) => gauge.after(self.anchor, edge, Some(edge), &Waves { cruise, flow }),
        }
    }

    /// Tells the gauge the motion from the anchor to an edge, for rows. Called before [`account`](Self::account), not
    /// in it, where it would occupy many of that function's registers.
    #[inline(always)]
    pub(crate) fn pass(&mut self, edge: u64) {
        if self.gauge.is_some() && edge != self.anchor {
            self.pass_measured(edge);
        }
    }

    #[cold]
    fn pass_measured(&mut self, edge: u64) {
        if let Some(gauge) = self.gauge.as_deref() {
            self.gauge = Some(Box::new(self.gauge_at(gauge, edge)));
        }
    }

    /// Returns whether rows have means and extremes.
    #[inline(always)]
    pub(crate) fn is_measured(&self) -> bool {
        self.gauge.is_some()
    }

    /// Tells the gauge the course of an edge in which a mode ended.
    #[cold]
    pub(crate) fn pass_course(&mut self, edge: u64, course: &Whole<2>) {
        if let Some(gauge) = &mut self.gauge {
            **gauge = gauge.after(edge - 1, edge, Some(edge), course);
        }
    }

    /// Returns how often a mode has changed.
    pub fn mode_changes(&self) -> u64 {
        self.mode_changes
    }

    /// Returns how many decisions (is the angle past a count, has a mode ended) were made again in double-double
    /// because `f64` was not exact enough.
    pub fn redecided(&self) -> u64 {
        self.redecided
    }

    /// Returns whether friction holds the shaft.
    pub fn is_stuck(&self) -> bool {
        self.shaft == Shaft::Stuck
    }

    /// Returns the energy exchanged until `edge`.
    pub fn energy(&self, edge: u64) -> Energy {
        self.tallied(edge).0
    }

    /// Returns the energy stored at `edge` minus that at the start.
    pub fn stored_j(&self, edge: u64) -> f64 {
        let motor = &self.axis.motor;
        stored_j(motor.inductance_h, motor.inertia_kg_m2, &self.state(edge)) - self.initial_j
    }

    /// Sets the gates from `edge` on.
    ///
    /// # Panics
    ///
    /// On an axis without a bridge, or whose winding has no inductance.
    pub fn drive(&mut self, edge: u64, gates: Gates) {
        self.driven(edge, Drive::Gates(gates));
    }

    /// Drives with the average voltage of a duty between -1 and 1 from `edge` on.
    ///
    /// # Panics
    ///
    /// On an axis without a bridge.
    pub fn drive_average(&mut self, edge: u64, duty: f64) {
        self.driven(edge, Drive::Average(duty));
    }

    /// Imposes this current from `edge` on, as an ideal amplifier does; on a rail the force, in N.
    pub fn drive_current(&mut self, edge: u64, current_a: f64) {
        self.driven(edge, Drive::Current(current_a));
    }

    /// Sets the drive from `edge` on.
    ///
    /// # Panics
    ///
    /// As the function of that drive does.
    #[inline(always)]
    pub fn driven(&mut self, edge: u64, drive: Drive) {
        let is_as_it_was = match &self.cruise {
            None => self.drive == drive,
            Some(cruise) => self.foresees(cruise, edge, drive),
        };
        if !is_as_it_was {
            self.pass(edge);
            self.set(edge, drive);
        }
    }

    versions! {
        fn set[set_fused, set_native, set_with](self: &mut Self, edge: u64, drive: Drive)
    }

    #[inline(always)]
    fn set_with<P: Product>(&mut self, edge: u64, drive: Drive) {
        let mut x = self.account::<P>(edge);
        let shaft = self.shaft;
        self.drive = drive;
        self.circuit = match drive {
            Drive::Current(current_a) => {
                self.energy.surge(self.axis.motor.inductance_h, x.hi[CURRENT], current_a);
                x.set(CURRENT, current_a.into());
                self.let_go::<P>(&x);
                Circuit::Amplified
            }
            _ if self.axis.amplified => panic!("an amplified axis has no bridge"),
            Drive::Average(duty) => {
                let circuit = self.axis.bridge.averaged(duty);
                if let (true, Circuit::Closed { supply_share, switches, .. }) = (self.axis.is_resistive(), circuit) {
                    x.set(CURRENT, self.axis.exact_ohmic_a(supply_share, switches, x.lane(SPEED)));
                    self.let_go::<P>(&x);
                }
                circuit
            }
            Drive::Gates(_) if self.axis.is_resistive() => panic!("a winding without inductance has no switching"),
            Drive::Gates(gates) => {
                let emf_v = self.axis.motor.torque_constant_nm_per_a * x.hi[SPEED];
                self.axis.bridge.circuit(gates, x.hi[CURRENT], emf_v)
            }
            Drive::Legs(_) | Drive::Averages(_) => panic!("an axis has no inverter"),
        };
        if shaft == self.shaft {
            self.redrive::<P>(edge, x);
        } else {
            self.enter_with::<P>(edge, x);
        }
    }

    /// Lets friction lose its hold, if the torque has jumped beyond it.
    fn let_go<P: Product>(&mut self, x: &Doubles) {
        if self.shaft == Shaft::Stuck {
            self.shaft = self.shaft_at::<P>(x);
            self.mode_changes += u64::from(self.shaft != Shaft::Stuck);
        }
    }

    /// Sets the hand's intended angle and speed from `edge` on; a prescribing hand moves the shaft to them.
    pub fn intend(&mut self, edge: u64, angle_rad: f64, speed_rad_per_s: f64) {
        self.pass(edge);
        self.guide(edge, angle_rad, speed_rad_per_s);
    }

    versions! {
        fn guide[guide_fused, guide_native, guide_with](
            self: &mut Self, edge: u64, angle_rad: f64, speed_rad_per_s: f64
        )
    }

    #[inline(always)]
    fn guide_with<P: Product>(&mut self, edge: u64, angle_rad: f64, speed_rad_per_s: f64) {
        let mut x = self.account::<P>(edge);
        x.set(INTENT, angle_rad.into());
        self.intent_rad_per_s = speed_rad_per_s;
        if self.axis.hand == Hand::Prescribed {
            self.energy.jerk(self.axis.motor.inertia_kg_m2, x.hi[SPEED], speed_rad_per_s);
            x.set(SPEED, speed_rad_per_s.into());
            x.set(ANGLE, angle_rad.into());
        }
        self.let_go::<P>(&x);
        self.enter_with::<P>(edge, x);
    }

    versions! {
        fn enter[enter_fused, enter_native, enter_all](self: &mut Self, edge: u64, x: Doubles)
    }

    #[inline(always)]
    fn enter_all<P: Product>(&mut self, edge: u64, x: Doubles) {
        self.enter_with::<P>(edge, x);
    }

    /// Returns a number that is the same at two edges of which the device [recurs](Self::recurs), and at few others.
    #[inline]
    pub fn mark(&self, edge: u64) -> u64 {
        let Double { hi, lo } = self.motion.x.lane(ANGLE);
        (hi.to_bits() ^ lo.to_bits().rotate_left(32) ^ (edge - self.anchor)).wrapping_mul(MIX).rotate_left(32)
    }

    /// Returns whether the device is at `edge`, in every bit that decides how it moves, as an earlier one was at the
    /// edge `then`: driven alike, both move alike from there. In a cruise it promises nothing.
    pub fn recurs(&self, edge: u64, earlier: &Self, then: u64) -> bool {
        let state = |device: &Self, edge: u64| {
            let bits = [device.motion.x, device.motion.f].map(|of| (of.hi.map(f64::to_bits), of.lo.map(f64::to_bits)));
            (bits, edge - device.anchor, device.leaves.saturating_sub(edge), device.intent_rad_per_s.to_bits())
        };
        let mode = |device: &Self| (std::ptr::from_ref(device.mode), device.shaft, device.drive, device.circuit);
        let is_certain = self.cruise.is_none() && earlier.cruise.is_none();
        is_certain && state(self, edge) == state(earlier, then) && mode(self) == mode(earlier)
    }

    /// Moves on by `times` repetitions of all that has happened between two states, in which `edges` pass altogether.
    /// The second state [recurs](Self::recurs), and this one lies between them.
    pub fn repeat(&mut self, edges: u64, [then, now]: [&Self; 2], times: u64) {
        self.energy.repeat([&then.energy, &now.energy], times);
        self.mode_changes += times * (now.mode_changes - then.mode_changes);
        self.redecided += times * (now.redecided - then.redecided);
        (self.anchor, self.leaves) = (self.anchor + edges, self.leaves + edges);
        self.known.ahead = Ahead::NOTHING;
    }

    /// Moves to the next edge after the last one asked, and changes the mode if it has ended.
    #[inline(always)]
    pub fn step(&mut self, edge: u64) -> State {
        if self.cruise.is_some() {
            let x = self.state_next(edge);
            return self.arrive((edge, x));
        }
        let x = self.motion.at_next(edge - self.anchor, &mut self.known.prefix);
        self.arrive((edge, x))
    }

    /// Moves to the edge of an event, and changes the mode if the event is the end of one.
    #[inline(always)]
    pub fn arrive(&mut self, (edge, x): Event) -> State {
        if let Some(end) = self.cruise_end() {
            if edge < end {
                return x;
            }
            self.pass(edge);
            self.land(edge);
            return *self.motion.anchor();
        }
        let edges = edge - self.anchor;
        self.hear(edges);
        let mut sides = [Side::Inside; 2];
        for ((side, check), noise) in sides.iter_mut().zip(&self.checks).zip(&self.known.noise[1..]) {
            let Some(check) = check else { continue };
            let mut watch =
                Watch { motion: &self.motion, limits: check.limits, noise: *noise, again: &mut self.redecided };
            *side = check.guard.side(&mut watch, edges, check.guard.value(&x));
        }
        if sides == [Side::Inside; 2] {
            return x;
        }
        self.pass(edge - 1);
        self.change(edge, sides, &x);
        *self.motion.anchor()
    }

    versions! {
        /// Returns the energy exchanged until `edge`, and the state there.
        fn tallied[tallied_fused, tallied_native, tallied_with](self: &Self, edge: u64) -> (Energy, Doubles)
    }

    #[inline(always)]
    fn tallied_with<P: Product>(&self, edge: u64) -> (Energy, Doubles) {
        let mut energy = self.energy;
        let edges = edge - self.anchor;
        if let Some(cruise) = &self.cruise {
            return cruise.tallied::<P>(self, edges);
        }
        let (done, x) = self.motion.integrals::<P>(edges);
        let length_s = edges as f64 * self.motion.system().edge_s();
        energy.add(&self.powers, length_s, &self.motion.x, &x, &done);
        (energy, x)
    }

    /// Accounts for the energy until `edge` and returns the state there.
    #[inline(always)]
    pub(crate) fn account<P: Product>(&mut self, edge: u64) -> Doubles {
        if let Some(cruise) = self.cruise.take() {
            return self.leave::<P>(&cruise, edge);
        }
        let edges = edge - self.anchor;
        let (done, x) = self.motion.integrals::<P>(edges);
        let length_s = edges as f64 * self.motion.system().edge_s();
        self.energy.add(&self.powers, length_s, &self.motion.x, &x, &done);
        x
    }

    #[inline(always)]
    pub(crate) fn tally(&mut self, length_s: f64, before: &Doubles, after: &Doubles, done: &Integrals) {
        self.energy.add(&self.powers, length_s, before, after, done);
    }
}

#[cfg(test)]
mod tests;
