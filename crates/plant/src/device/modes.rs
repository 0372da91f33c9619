//! Beginning and end of a device's modes: slip and stuck, diodes and open circuits.
//!
//! A mode ends at a real instant between two edges, found in `f64` and polished in double-double. The flow is split
//! there, and again where further modes end within the same edge. Limits are looked at on clock edges: a limit that is
//! passed and passed back between two edges ends no mode.
//!
//! # Friction within a period of the modulator
//!
//! Where friction turns or stops the shaft within a period, no cruise begins: each mode ends at its own instant, edge
//! by edge as `clock` has it. Leaps over the map from period to period were measured and left out. At rest in
//! `friction-wall` the same modes follow one another for 3.2 periods on average and 17 at most, while the state's steps
//! shrink by 0.8 to 0.6 from period to period: leaps that cost nothing would make such a rest 3.2 times as fast at
//! most. A period at rest costs about 11 000 instructions (case `resting`): 2 800 for two ends of modes, 3 500 for four
//! searches, 2 100 for two changes of gates, 2 500 for the engine, the datapath, and the question whether a cruise can
//! begin.

use super::{Device, Drive};
use crate::Circuit;
use crate::axis::{Hand, Shaft};
use crate::flow::course::Course;
use crate::flow::double::{Double, Doubles, Product, versions};
use crate::flow::gauge::Whole;
use crate::flow::guard::{Guard, Limits, Side};
use crate::flow::leap::Quadrature;
use crate::flow::linear::Trajectory;
use crate::flow::matrix::{ANGLE, CURRENT, INTENT, SPEED, State};

/// The part of the device whose condition a mode depends on.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cause {
    /// The shaft. Slip: the speed keeps its sign. Stuck: the torque stays within friction.
    Shaft,
    /// The circuit: the diodes' current keeps its sign, or the back-EMF stays within their range.
    Circuit,
}

/// The condition of a mode: it lasts while a function of the state stays in a band.
#[derive(Clone, Copy)]
pub(crate) struct Check<'a> {
    pub(crate) guard: &'a Guard,
    pub(crate) limits: Limits,
    cause: Cause,
}

/// The end of a mode within an edge.
struct End {
    /// Time since the start of the course.
    tau_s: Double,
    /// The state there.
    there: Doubles,
    /// The check that has left its band, and the side on which it has.
    cause: Cause,
    side: Side,
}

impl Check<'_> {
    #[inline(always)]
    fn value<P: Product>(&self, x: &Doubles) -> Double {
        self.guard.exact_value::<P>(x)
    }

    /// Returns the side on which a state lies: by `f64` alone, if its rounding cannot matter.
    #[inline(always)]
    fn side<P: Product>(&self, x: &Doubles) -> Side {
        if self.guard.is_surely_inside(&x.hi, &self.limits) {
            return Side::Inside;
        }
        self.limits.side(self.value::<P>(x))
    }
}

/// The most ends of modes within one edge that are followed each to its instant.
const MOST_ENDS: u32 = 8;

impl<'a> Device<'a> {
    /// Handles modes that ended between `edge - 1` and `edge`, by the sides of their bands on which their checks and
    /// the rounded state lie at `edge`. Finds the first instant, changes the mode there, then looks in the same way at
    /// the rest of the edge in the new mode. Anchors at `edge`.
    #[cold]
    pub(crate) fn change(&mut self, edge: u64, sides: [Side; 2], at_edge: &State) {
        if !self.reverse(edge, sides) {
            self.change_at_instants(edge, sides, at_edge);
        }
    }

    versions! {
        /// Handles ends of modes as [`change`](Self::change) does, of any kind.
        #[cold]
        pub(super) fn change_at_instants[instants_fused, instants_native, instants_with](
            self: &mut Self, edge: u64, sides: [Side; 2], at_edge: &State
        )
    }

    #[inline(always)]
    fn instants_with<P: Product>(&mut self, edge: u64, sides: [Side; 2], at_edge: &State) {
        let (from, edges, edge_s) = (self.motion.x, edge - 1 - self.anchor, self.motion.system().edge_s());
        let (done, mut x) = self.motion.integrals::<P>(edges);
        self.tally(edges as f64 * edge_s, &from, &x, &Quadrature::in_memory::<P::Lanes>(&done));
        let mut passed = self.is_measured().then_some(Whole::NOTHING);
        let mut course = Course::new::<P>(Trajectory::exact_with::<P>(self.motion.system(), x, self.motion.f));
        let mut left_s = Double::from(edge_s);
        let (mut sides, mut at_end) = (sides, *at_edge);
        let mut ends = 0;
        let end = loop {
            let End { tau_s, mut there, cause, side } = self.soonest::<P>(&course, &x, left_s, sides, &at_end);
            self.pass_part(&course, tau_s.hi, &x, &there, &mut passed);
            self.turn::<P>(cause, side, &mut there);
            self.enter_with::<P>(edge - 1, there);
            (x, left_s) = (there, left_s - tau_s);
            course = Course::new::<P>(self.motion);
            let end = course.at::<P>(left_s);
            ends += 1;
            sides = self.sides::<P>(&end);
            if sides == [Side::Inside; 2] || ends == MOST_ENDS {
                break end;
            }
            at_end = end.hi;
        };
        self.pass_part(&course, left_s.hi, &x, &end, &mut passed);
        if let Some(passed) = passed {
            self.pass_course(edge, &passed);
        }
        if self.axis.is_resistive() {
            self.redrive::<P>(edge, end);
        } else {
            let f = self.motion.f;
            self.anchor_at::<P>(edge, end, f);
        }
    }

    versions! {
        /// Reverses the shaft between `edge - 1` and `edge`, where the checks lie on these sides, and anchors at
        /// `edge`. Returns `false` and changes nothing if this end of a mode is none, or is not certain to be one.
        pub(super) fn reverse[reverse_fused, reverse_native, reverse_with](
            self: &mut Self, edge: u64, sides: [Side; 2]
        ) -> bool
    }

    #[inline(always)]
    fn reverse_with<P: Product>(&mut self, edge: u64, sides: [Side; 2]) -> bool {
        let (Shaft::Slip(before @ (1 | -1)), [Some(check), None]) = (self.shaft, &self.checks) else { return false };
        let outward = if before > 0 { Side::Below } else { Side::Above };
        let is_plain = self.axis.creep_rad_per_s == 0.0
            && self.powers.diode_v == 0.0
            && !self.axis.is_resistive()
            && !self.is_measured()
            && sides[0] == outward;
        if !is_plain {
            return false;
        }
        let constants = &self.axis.constants;
        let Some(reversal) = self.mode.reversal(constants.coulomb) else { return false };
        let (sign, system, from) = (f64::from(before), self.motion.system, &self.motion.x);
        let (mut done, x, w) = self.motion.integrals_and_slope::<P>(edge - self.anchor);
        let Some(rest) = reversal.rest::<P>(&x, &w, system.edge_s) else { return false };
        // The torque that turned the shaft about must also move it against friction.
        let kick = reversal.kick();
        if -sign * rest.slope < kick * (1.0 + 1e-9) {
            return false;
        }
        let (end, change) = reversal.end::<P>(&x, &rest, sign);
        let held = if before > 0 { Limits::NEGATIVE } else { Limits::POSITIVE };
        if !check.guard.is_surely_inside(&end.hi, &held) {
            return false;
        }
        reversal.include(&rest, sign, &x.hi, &w.hi, &mut done);
        let turned = end.lane_since(from, ANGLE);
        let back = rest.turn_rad + change[ANGLE];
        let way = (turned - back).abs() + back.abs();
        let length_s = (edge - self.anchor) as f64 * system.edge_s;
        self.energy.reversed(&self.powers, length_s, (turned, way), &from.hi, &end.hi, &done);

        self.mode_changes += 1;
        self.shaft = Shaft::Slip(-before);
        self.held = held;
        if let Some(check) = &mut self.checks[0] {
            check.limits = held;
        }
        let mut f = self.motion.f;
        f.set(SPEED, constants.torque.by::<P>(self.torque_nm::<P>()) - constants.coulomb.times::<P>(-sign));
        self.anchor_at::<P>(edge, end, f);
        true
    }

    /// Returns the sides on which the checks lie in a state.
    #[inline(always)]
    fn sides<P: Product>(&self, x: &Doubles) -> [Side; 2] {
        let mut sides = [Side::Inside; 2];
        for (side, check) in sides.iter_mut().zip(&self.checks) {
            if let Some(check) = check {
                *side = check.side::<P>(x);
            }
        }
        sides
    }

    /// Returns the first end of a mode on a course from state `x` to `at_end`, `left_s` later, where the checks lie on
    /// these sides.
    #[inline(always)]
    fn soonest<P: Product>(
        &self,
        course: &Course,
        x: &Doubles,
        left_s: Double,
        sides: [Side; 2],
        at_end: &State,
    ) -> End {
        let index = usize::from(sides[0] == Side::Inside);
        let end = self.end_of::<P>(index, sides[index], course, x, left_s, at_end);
        // The other check is outside by then if it has left before, even if it would be inside again later.
        let other = 1 - index;
        match self.checks[other].as_ref().map(|check| check.side::<P>(&end.there)) {
            None | Some(Side::Inside) => end,
            Some(side) => self.end_of::<P>(other, side, course, x, end.tau_s, &end.there.hi),
        }
    }

    /// Returns the end of a mode by one check, which lies on this side at the end of the time.
    #[inline(always)]
    fn end_of<P: Product>(
        &self,
        index: usize,
        side: Side,
        course: &Course,
        x: &Doubles,
        left_s: Double,
        at_end: &State,
    ) -> End {
        let check = self.checks[index].as_ref().expect("a check that is outside");
        let (limit, outward) = if side == Side::Below { (check.limits.low, -1.0) } else { (check.limits.high, 1.0) };
        let (before, after) = (check.value::<P>(x) - limit, check.guard.value(at_end) - limit.hi);
        let (tau_s, there) = if before.sign() == outward || before.sign() == 0.0 && course.leaves(check.guard, outward)
        {
            // The value is beyond its limit already at the start, or only at the end.
            let tau_s = if before.hi.abs() <= after.abs() { Double::ZERO } else { left_s };
            (tau_s, course.at::<P>(tau_s))
        } else {
            course.crossing::<P>(check.guard, limit, (before.hi, after, outward), left_s.hi)
        };
        End { tau_s, there, cause: check.cause, side }
    }

    /// Accounts for a part of a course within an edge.
    #[inline(always)]
    fn pass_part(&mut self, course: &Course, tau_s: f64, from: &Doubles, to: &Doubles, passed: &mut Option<Whole<2>>) {
        let done = course.integrals(tau_s, &to.hi);
        self.tally(tau_s, from, to, &done);
        if let Some(passed) = passed {
            passed.add(&self.motion, tau_s, [&from.hi, &to.hi], &done.states);
        }
    }

    /// Sets the new mode after one ended, from the state at its end and the side of its band.
    #[inline(always)]
    fn turn<P: Product>(&mut self, cause: Cause, side: Side, x: &mut Doubles) {
        self.mode_changes += 1;
        let above = side == Side::Above;
        match (cause, self.shaft, self.circuit) {
            (Cause::Shaft, Shaft::Stuck, _) => self.shaft = Shaft::Slip(if above { 1 } else { -1 }),
            (Cause::Shaft, Shaft::Creep, _) => {
                self.shaft = Shaft::Slip(if above { 1 } else { -1 });
                let creep = Double::from(self.axis.creep_rad_per_s);
                x.set(SPEED, if above { creep } else { -creep });
            }
            (Cause::Shaft, Shaft::Slip(sign), _) if self.axis.creep_rad_per_s != 0.0 => {
                self.shaft = Shaft::Creep;
                x.set(SPEED, (f64::from(sign) * self.axis.creep_rad_per_s).into());
            }
            (Cause::Shaft, ..) => {
                x.set(SPEED, Double::ZERO);
                self.shaft = self.shaft_at::<P>(x);
            }
            (Cause::Circuit, _, Circuit::Closed { .. }) => {
                x.set(CURRENT, Double::ZERO);
                self.reroute(x, self.axis.motor.torque_constant_nm_per_a * x.hi[SPEED]);
            }
            (Cause::Circuit, _, Circuit::Open { .. }) => {
                self.reroute(x, if above { f64::INFINITY } else { f64::NEG_INFINITY });
            }
            (Cause::Circuit, _, Circuit::Amplified) => unreachable!("an imposed current has no modes"),
        }
    }

    fn reroute(&mut self, x: &Doubles, emf_v: f64) {
        if let Drive::Gates(gates) = self.drive {
            self.circuit = self.axis.bridge.circuit(gates, x.hi[CURRENT], emf_v);
        }
    }

    /// Returns the torque on the shaft except friction, while the shaft stands still.
    #[inline(always)]
    fn net_nm<P: Product>(&self, x: &Doubles) -> Double {
        let torque_nm =
            x.lane(CURRENT).by::<P>(self.axis.motor.torque_constant_nm_per_a.into()) + self.torque_nm::<P>();
        match self.axis.hand {
            Hand::Spring(push) => {
                torque_nm + (x.lane(INTENT) - x.lane(ANGLE)).by::<P>(push.stiffness_nm_per_rad.into())
            }
            _ => torque_nm,
        }
    }

    /// Returns the constant part of the hand's torque on a shaft that stands still.
    #[inline(always)]
    fn torque_nm<P: Product>(&self) -> Double {
        match self.axis.hand {
            Hand::Torque(torque_nm) => torque_nm.into(),
            Hand::Spring(push) => {
                let (hi, lo) = P::two(push.damping_nm_s_per_rad, self.intent_rad_per_s);
                Double { hi, lo }
            }
            Hand::Prescribed => Double::ZERO,
        }
    }

    #[inline(always)]
    pub(crate) fn shaft_at<P: Product>(&self, x: &Doubles) -> Shaft {
        let friction_nm = self.axis.motor.coulomb_nm;
        if self.axis.hand == Hand::Prescribed {
            Shaft::Prescribed
        } else if friction_nm == 0.0 {
            Shaft::Slip(0)
        } else if x.hi[SPEED].abs() <= self.axis.creep_rad_per_s && self.axis.creep_rad_per_s != 0.0 {
            Shaft::Creep
        } else if x.hi[SPEED] != 0.0 {
            Shaft::Slip(if x.hi[SPEED] > 0.0 { 1 } else { -1 })
        } else {
            let net_nm = self.net_nm::<P>(x);
            let friction_nm = Double::from(friction_nm);
            let limits = Limits { low: -friction_nm, high: friction_nm, open: false };
            match limits.side(net_nm) {
                Side::Above => Shaft::Slip(1),
                Side::Below => Shaft::Slip(-1),
                Side::Inside => Shaft::Stuck,
            }
        }
    }

    /// Anchors at `edge` in state `x`, in the mode of the present shaft, circuit and hand.
    #[inline(always)]
    pub(crate) fn enter_with<P: Product>(&mut self, edge: u64, x: Doubles) {
        self.hold_shaft::<P>(&x);
        self.redrive::<P>(edge, x);
    }

    /// Sets the part of a mode that depends on shaft and hand.
    #[inline(always)]
    fn hold_shaft<P: Product>(&mut self, x: &Doubles) {
        let (axis, constants) = (self.axis, &self.axis.constants);
        let constant_nm = self.torque_nm::<P>();
        let push = match self.shaft {
            Shaft::Slip(sign) => constants.torque.by::<P>(constant_nm) - constants.coulomb.times::<P>(f64::from(sign)),
            Shaft::Creep => constants.torque.by::<P>(constant_nm),
            Shaft::Stuck | Shaft::Prescribed => Double::ZERO,
        };
        self.motion.f.set(SPEED, push);
        self.motion.f.set(INTENT, self.intent_rad_per_s.into());
        let creep = Double::from(axis.creep_rad_per_s);
        self.held = match self.shaft {
            Shaft::Slip(1) => Limits { low: creep, ..Limits::POSITIVE },
            Shaft::Slip(-1) => Limits { high: -creep, ..Limits::NEGATIVE },
            Shaft::Creep => Limits { low: -creep, high: creep, open: false },
            Shaft::Stuck => {
                let friction_nm = Double::from(axis.motor.coulomb_nm);
                Limits { low: -friction_nm - constant_nm, high: friction_nm - constant_nm, open: false }
            }
            _ => Limits::ANY,
        };
        (self.powers.coulomb_nm, self.powers.creep_nm_s_per_rad) = match self.shaft {
            Shaft::Slip(_) => (axis.motor.coulomb_nm, 0.0),
            Shaft::Creep => (0.0, axis.creep_nm_s_per_rad()),
            Shaft::Prescribed => (axis.friction_nm(x.hi[SPEED]).abs(), 0.0),
            Shaft::Stuck => (0.0, 0.0),
        };
        self.powers.viscous_nm_s_per_rad = axis.motor.viscous_nm_s_per_rad;
        self.powers.intent_rad_per_s = self.intent_rad_per_s;
        match axis.hand {
            Hand::Torque(torque_nm) => self.powers.torque_nm = torque_nm,
            Hand::Spring(push) => {
                self.powers.hand_nm_per_rad = push.stiffness_nm_per_rad;
                self.powers.hand_nm_s_per_rad = push.damping_nm_s_per_rad;
            }
            Hand::Prescribed => self.powers.borne_nm_per_a = axis.motor.torque_constant_nm_per_a,
        }
    }

    /// Anchors at `edge` in state `x`, with shaft and hand unchanged.
    #[inline(always)]
    pub(crate) fn redrive<P: Product>(&mut self, edge: u64, mut x: Doubles) {
        let (axis, constants, motor) = (self.axis, &self.axis.constants, &self.axis.motor);
        let mut volts = Double::ZERO;
        let (mut source, mut source_nm, mut resistance_ohm, mut diode_v) = (0.0, 0.0, 0.0, 0.0);
        let mut switched = None;
        match self.circuit {
            Circuit::Closed { supply_share, diodes, direction, switches } => {
                volts = constants.supply.times::<P>(supply_share);
                if diodes != 0 {
                    let drop = f64::from(direction) * f64::from(diodes);
                    volts = volts - constants.diode.times::<P>(drop);
                    diode_v = f64::from(diodes) * axis.bridge.diode_drop_v;
                }
                source = axis.bridge.supply_v * supply_share;
                resistance_ohm = axis.path_ohm(switches);
                switched = Some(switches);
            }
            Circuit::Amplified => {
                source = motor.resistance_ohm * x.hi[CURRENT];
                source_nm = motor.torque_constant_nm_per_a * x.hi[CURRENT];
                resistance_ohm = motor.resistance_ohm;
            }
            Circuit::Open { .. } => {}
        }
        let powers = &mut self.powers;
        (powers.source_v, powers.source_nm) = (source, source_nm);
        (powers.resistance_ohm, powers.diode_v) = (resistance_ohm, diode_v);
        self.mode = axis.mode(self.shaft, switched);
        let mut f = self.motion.f;
        f.set(CURRENT, volts);
        if let (true, Circuit::Closed { supply_share, switches, .. }) = (axis.is_resistive(), self.circuit) {
            f.set(CURRENT, -(f.lane(SPEED) * axis.ohmic_a_s_per_rad(switches)));
            x.set(CURRENT, axis.exact_ohmic_a(supply_share, switches, x.lane(SPEED)));
        }
        self.anchor_at::<P>(edge, x, f);
        self.checks = self.checks_now();
    }

    /// Continues in the same mode, from `edge` in state `x`.
    #[inline(always)]
    fn anchor_at<P: Product>(&mut self, edge: u64, x: Doubles, f: Doubles) {
        self.anchor = edge;
        self.motion = Trajectory::exact_with::<P>(&self.mode.system, x, f);
        self.known.forget();
    }

    #[inline(always)]
    fn checks_now(&self) -> [Option<Check<'a>>; 2] {
        let mode = self.mode;
        let motor = &self.axis.motor;
        let shaft = match self.shaft {
            Shaft::Slip(0) | Shaft::Prescribed => None,
            Shaft::Slip(_) | Shaft::Creep => Some((&mode.speed, self.held)),
            Shaft::Stuck => Some((&mode.net, self.held)),
        };
        let circuit = match self.circuit {
            Circuit::Closed { direction: 1, .. } => Some((&mode.current, Limits::POSITIVE)),
            Circuit::Closed { direction: -1, .. } => Some((&mode.current, Limits::NEGATIVE)),
            Circuit::Closed { .. } | Circuit::Amplified => None,
            Circuit::Open { emf_min_v, emf_max_v } => {
                let speed = |emf_v: f64| Double::from(emf_v).over(motor.torque_constant_nm_per_a.into());
                Some((&mode.speed, Limits { low: speed(emf_min_v), high: speed(emf_max_v), open: false }))
            }
        };
        [
            shaft.map(|(guard, limits)| Check { guard, limits, cause: Cause::Shaft }),
            circuit.map(|(guard, limits)| Check { guard, limits, cause: Cause::Circuit }),
        ]
    }
}
