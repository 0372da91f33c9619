//! Ends of a network's modes: each at its own instant between two edges, as those of an axis (`device/modes.rs`).

use super::laws::{Touch, position_of, speed_of};
use super::motion::{Cause, Check, NetworkDevice};
use crate::Circuit;
use crate::device::Drive;
use crate::flow::course::Course;
use crate::flow::double::{Double, Doubles, Product, versions};
use crate::flow::gauge::Whole;
use crate::flow::guard::{Limits, Side};
use crate::flow::lanes::{Count, Size};
use crate::flow::matrix::{CURRENT, State};

/// The most ends of modes within one edge that are followed each to its instant, for each check.
const MOST_ENDS: usize = 8;

/// The end of a mode within an edge.
struct End<const N: usize> {
    /// The check that has left its band, by its index, and the side on which it has.
    index: usize,
    side: Side,
    /// Time since the start of the course.
    tau_s: Double,
    /// The state there.
    there: Doubles<N>,
}

/// Returns the side on which a state lies: by `f64` alone, if its rounding cannot matter.
fn side<P: Product, const N: usize>(check: &Check<N>, x: &Doubles<N>) -> Side
where
    Count<N>: Size<N>,
{
    if check.guard.is_surely_inside(&x.hi, &check.limits) {
        return Side::Inside;
    }
    check.limits.side(check.guard.exact_value::<P>(x))
}

impl<const N: usize> NetworkDevice<'_, N>
where
    Count<N>: Size<N>,
{
    versions! {
        /// Handles modes that ended between `edge - 1` and `edge`: finds the first instant, changes the mode there,
        /// then looks in the same way at the rest of the edge. Anchors at `edge`.
        #[cold]
        pub(super) fn change[change_fused, change_native, change_with](self: &mut Self, edge: u64)
    }

    #[inline(always)]
    fn change_with<P: Product>(&mut self, edge: u64) {
        let mut x = self.account(edge - 1);
        let mut passed = self.is_measured().then_some(Whole::NOTHING);
        self.motion.x = x;
        self.motion.w = self.motion.system.slope::<P>(&x, &self.motion.f);
        let mut course = Course::new::<P>(self.motion);
        let mut left_s = Double::from(self.motion.system().edge_s());
        let mut end = course.at::<P>(left_s);
        let mut ends = 0;
        while let Some(first) = self.soonest::<P>(&course, &x, left_s, &end) {
            if ends == MOST_ENDS * self.checks.len() {
                self.crowded += 1;
                break;
            }
            ends += 1;
            let End { index, side, tau_s, mut there } = first;
            self.pass_part(&course, tau_s.hi, &x, &there, &mut passed);
            self.turn::<P>(self.checks[index].cause, side, &mut there);
            self.enter(edge - 1, there);
            (x, left_s) = (there, left_s - tau_s);
            course = Course::new::<P>(self.motion);
            end = course.at::<P>(left_s);
        }
        self.pass_part(&course, left_s.hi, &x, &end, &mut passed);
        if let Some(passed) = passed {
            self.pass_course(edge, &passed);
        }
        self.enter(edge, end);
    }

    /// Returns the first end of a mode on a course from state `x` to `at_end`, `left_s` later, if a check is outside
    /// there. Of equal instants the first check's counts.
    #[inline(always)]
    fn soonest<P: Product>(
        &self,
        course: &Course<N>,
        x: &Doubles<N>,
        left_s: Double,
        at_end: &Doubles<N>,
    ) -> Option<End<N>> {
        let mut soonest: Option<End<N>> = None;
        for _ in 0..=self.checks.len() {
            let (limit_s, there) = soonest.as_ref().map_or((left_s, *at_end), |end| (end.tau_s, end.there));
            let is_other = |index: usize| soonest.as_ref().is_none_or(|end| end.index != index);
            // A check that is outside by then has left before, even if it is inside again later.
            let outside =
                self.checks.iter().enumerate().filter(|(index, _)| is_other(*index)).find_map(|(index, check)| {
                    let side = side::<P, N>(check, &there);
                    (side != Side::Inside).then_some((index, side))
                });
            let Some((index, side)) = outside else { break };
            soonest = Some(self.end_of::<P>(index, side, course, x, limit_s, &there.hi));
        }
        soonest
    }

    /// Returns the end of a mode by one check, which lies on this side at the end of the time.
    #[inline(always)]
    fn end_of<P: Product>(
        &self,
        index: usize,
        side: Side,
        course: &Course<N>,
        x: &Doubles<N>,
        left_s: Double,
        at_end: &State<N>,
    ) -> End<N> {
        let check = &self.checks[index];
        let (limit, outward) = if side == Side::Below { (check.limits.low, -1.0) } else { (check.limits.high, 1.0) };
        let (before, after) = (check.guard.exact_value::<P>(x) - limit, check.guard.value(at_end) - limit.hi);
        let (tau_s, there) = if before.sign() == outward || before.sign() == 0.0 && course.leaves(check.guard, outward)
        {
            // The value is beyond its limit already at the start, or only at the end.
            let tau_s = if before.hi.abs() <= after.abs() { Double::ZERO } else { left_s };
            (tau_s, course.at::<P>(tau_s))
        } else {
            course.crossing::<P>(check.guard, limit, (before.hi, after, outward), left_s.hi)
        };
        End { index, side, tau_s, there }
    }

    /// Accounts for a part of a course within an edge.
    #[inline(always)]
    fn pass_part(
        &mut self,
        course: &Course<N>,
        tau_s: f64,
        from: &Doubles<N>,
        to: &Doubles<N>,
        passed: &mut Option<Whole<2>>,
    ) {
        let done = course.integrals(tau_s, &to.hi);
        self.tally(tau_s, from, to, &done);
        if let Some(passed) = passed {
            passed.add(&self.motion, tau_s, [&from.hi, &to.hi], &done.states);
        }
    }

    /// Sets what holds after a mode ended, from the state at its end and the side of its band.
    #[inline(always)]
    fn turn<P: Product>(&mut self, cause: Cause, side: Side, x: &mut Doubles<N>) {
        self.mode_changes += 1;
        let outward = if side == Side::Above { 1 } else { -1 };
        match cause {
            Cause::Rub(r) if self.key.slips[r] == 0 => self.key.slips[r] = outward,
            Cause::Rub(r) => {
                x.set(speed_of(self.laws.rubs[r]), Double::ZERO);
                self.key.slips[r] = self.slip_at_rest::<P>(r, x);
            }
            Cause::Reach(s) => {
                let stop = &self.laws.net.stops[s];
                let (touch, end) = match self.key.touches[s] {
                    Touch::Lifted(at) => (Touch::Out, at),
                    _ => (Touch::Pressed(outward), outward),
                };
                x.set(position_of(stop.body), if end < 0 { stop.low } else { stop.high }.into());
                self.released(s, touch, &x.hi);
            }
            Cause::Press(s) => self.press(s, x),
            Cause::Limit => self.key.limited = if self.key.limited == 0 { outward } else { 0 },
            Cause::Circuit => {
                let emf_v = match self.circuit {
                    Circuit::Open { .. } => f64::from(outward) * f64::INFINITY,
                    _ => {
                        x.set(CURRENT, Double::ZERO);
                        self.mode.emf.value(&x.hi)
                    }
                };
                if let (Drive::Gates(gates), Some(bridge)) = (self.drive, self.laws.bridge()) {
                    self.circuit = bridge.circuit(gates, x.hi[CURRENT], emf_v);
                }
            }
        }
    }

    /// Lifts a body off a stop whose force has come to 0, or presses it again.
    fn press(&mut self, s: usize, x: &mut Doubles<N>) {
        let stop = &self.laws.net.stops[s];
        let touch = match self.key.touches[s] {
            // Without a damper the force is 0 where the body leaves the stop.
            Touch::Pressed(side) if stop.damping == 0.0 => {
                x.set(position_of(stop.body), if side < 0 { stop.low } else { stop.high }.into());
                Touch::Out
            }
            Touch::Pressed(side) => Touch::Lifted(side),
            Touch::Lifted(side) => Touch::Pressed(side),
            Touch::Out => unreachable!("a stop that is not touched presses nothing"),
        };
        self.released(s, touch, &x.hi);
    }

    /// Returns the direction in which a body with friction moves on from rest, or 0 if it sticks.
    #[inline(always)]
    fn slip_at_rest<P: Product>(&self, r: usize, x: &Doubles<N>) -> i8 {
        let (body, mut stuck) = (self.laws.rubs[r], self.key);
        stuck.slips[r] = 0;
        // The functional of a body that sticks is the same in every mode with the same stops.
        let guard = &self.laws.mode(&stuck, self.switches()).rubs[r];
        self.hold(body).side(guard.exact_value::<P>(x)).way()
    }

    /// Lets go bodies whose friction no longer holds them after a jump of drive or hand.
    pub(super) fn let_go(&mut self, x: &Doubles<N>) {
        self.constants = self.laws.constants(&self.key, self.intent_per_s);
        let before = self.key;
        for r in 0..self.laws.rubs.len() {
            if self.key.slips[r] == 0 {
                self.key.slips[r] = self.slip_at_rest::<crate::flow::double::Native>(r, x);
            }
        }
        self.set_limit(x);
        self.mode_changes += u64::from(before != self.key);
    }

    /// Finds in which mode the drive's voltage lies.
    fn set_limit(&mut self, x: &Doubles<N>) {
        let supply = self.laws.net.feed.kind.supply_v();
        let Drive::Current(reference_a) = self.drive else { return };
        if supply.is_infinite() {
            return;
        }
        let constant = self.laws.demand_constant(reference_a);
        let limits = Limits { low: -constant - supply.into(), high: Double::from(supply) - constant, open: false };
        let demand = self.mode.demand.exact_value::<crate::flow::double::Native>(x);
        self.key.limited = limits.side(demand).way();
    }

    /// Finds at the start which bodies stick, and whether the drive is at its limit.
    pub(super) fn settle(&mut self, x: &Doubles<N>) {
        for (r, &body) in self.laws.rubs.iter().enumerate() {
            let speed = x.hi[speed_of(body)];
            self.key.slips[r] = if speed == 0.0 { 0 } else { speed.signum() as i8 };
        }
        self.let_go(x);
    }
}
