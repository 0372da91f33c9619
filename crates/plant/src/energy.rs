//! The energy audit: every flow is integrated by itself, and none is computed as a difference of others.

use crate::flow::double::{Doubles, two_sum};
use crate::flow::lanes::{Array, Four, Lanes};
use crate::flow::leap::Integrals;
use crate::flow::matrix::{ANGLE, CURRENT, INTENT, SPEED, State};

const SOURCE: usize = 0;
const HAND: usize = 1;
const COPPER: usize = 2;
const DIODES: usize = 3;

const VISCOUS: usize = 0;
const COULOMB: usize = 1;
const EXCHANGED: usize = 2;

/// Four sums, each with the rest dropped by rounding (two-sum of Knuth). How their terms are grouped hardly changes
/// them.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
struct Sums {
    totals: State,
    rests: State,
}

impl Sums {
    #[inline(always)]
    fn add<L: Lanes>(&mut self, terms: L) {
        let (totals, rests) = two_sum(L::of(&self.totals), terms);
        self.totals = totals.state();
        self.rests = (L::of(&self.rests) + rests).state();
    }

    fn at(&self, index: usize) -> f64 {
        self.totals[index] + self.rests[index]
    }

    /// Returns what was added since an earlier state.
    fn since(&self, earlier: &Self, index: usize) -> f64 {
        (self.totals[index] - earlier.totals[index]) + (self.rests[index] - earlier.rests[index])
    }

    /// Adds what was added between two states so many times. Like a sum of the terms one by one, it is exact but for
    /// rounding far below that of [`at`](Self::at).
    fn repeat(&mut self, [then, now]: [&Self; 2], times: u64) {
        let times = times as f64;
        for index in 0..4 {
            // The difference of the totals with its own rounding, and that of the rests.
            let grown = now.totals[index] - then.totals[index];
            let kept = grown - now.totals[index];
            let rest = (now.totals[index] - (grown - kept)) - (then.totals[index] + kept);
            let more = times * grown;
            let (total, sum) = (self.totals[index], self.totals[index] + more);
            let kept = sum - total;
            self.rests[index] += (total - (sum - kept)) + (more - kept);
            self.rests[index] +=
                libm::fma(times, grown, -more) + times * (rest + (now.rests[index] - then.rests[index]));
            self.totals[index] = sum;
        }
    }
}

/// Energy flows since the start, in J.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Energy {
    /// The first four flows.
    flows: Sums,
    /// The other two, then the sum of the sizes of all six, twice: four fill a register.
    others: Sums,
    /// `∫ x dt`.
    states: Sums,
}

/// The constant powers of one mode.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Powers {
    /// Volts of the supply across the motor's path.
    pub source_v: f64,
    /// Torque of an imposed current in N·m, whose work on the shaft the source does; else 0.
    pub source_nm: f64,
    /// Resistance of the path in Ω.
    pub resistance_ohm: f64,
    /// Volts dropped in diodes.
    pub diode_v: f64,
    /// Viscous friction in N·m·s/rad.
    pub viscous_nm_s_per_rad: f64,
    /// Coulomb friction that opposes the motion, in N·m; 0 when stuck.
    pub coulomb_nm: f64,
    /// Smoothed friction at low speeds, in N·m·s/rad; else 0.
    pub creep_nm_s_per_rad: f64,
    /// Constant external torque in N·m (or force applied to a mass, counted with the hand).
    pub torque_nm: f64,
    /// Hand's stiffness in N·m/rad.
    pub hand_nm_per_rad: f64,
    /// Hand's damping in N·m·s/rad.
    pub hand_nm_s_per_rad: f64,
    /// Speed of the hand's intention in rad/s.
    pub intent_rad_per_s: f64,
    /// Torque constant, if the hand prescribes the motion and so bears the motor's torque; else 0.
    pub borne_nm_per_a: f64,
}

impl Energy {
    /// Accounts for a stretch of `length_s` seconds from `before` to `after`.
    #[inline(always)]
    pub(crate) fn add<S: Four, Q: Four<Lanes = S::Lanes>>(
        &mut self,
        powers: &Powers,
        length_s: f64,
        before: &Doubles,
        after: &Doubles,
        done: &Integrals<S, Q>,
    ) {
        self.turned(powers, length_s, after.lane_since(before, ANGLE), &before.hi, &after.hi, done);
    }

    /// Accounts for a stretch between states in `f64`, where the angle turned is known better than their difference.
    #[inline(always)]
    pub(crate) fn turned<S: Four, Q: Four<Lanes = S::Lanes>>(
        &mut self,
        powers: &Powers,
        length_s: f64,
        turned: f64,
        before: &State,
        after: &State,
        done: &Integrals<S, Q>,
    ) {
        self.reversed(powers, length_s, (turned, turned.abs()), before, after, done);
    }

    /// Accounts for a stretch within which the shaft may turn back. `turned` is the angle between its ends, and `way`
    /// the angle that the shaft turns through.
    #[inline(always)]
    pub(crate) fn reversed<S: Four, Q: Four<Lanes = S::Lanes>>(
        &mut self,
        powers: &Powers,
        length_s: f64,
        (turned, way): (f64, f64),
        before: &State,
        after: &State,
        done: &Integrals<S, Q>,
    ) {
        let source_j = powers.source_v * done.states.lanes().state()[CURRENT] + powers.source_nm * turned;
        self.spent(powers, source_j, length_s, (turned, way), before, after, done);
    }

    /// Accounts for a stretch in which the work of the source and the way of the shaft are known.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "a stretch has these")]
    pub(crate) fn spent<S: Four, Q: Four<Lanes = S::Lanes>>(
        &mut self,
        powers: &Powers,
        source_j: f64,
        length_s: f64,
        (turned, way): (f64, f64),
        before: &State,
        after: &State,
        done: &Integrals<S, Q>,
    ) {
        self.states.add(done.states.lanes());
        let (states, squares) = (done.states.lanes().state(), done.squares.lanes().state());
        let (charge, current_squared, speed_squared) = (states[CURRENT], squares[CURRENT], squares[SPEED]);
        let copper = powers.resistance_ohm * current_squared;
        let diodes = powers.diode_v * charge.abs();
        let viscous = powers.viscous_nm_s_per_rad * speed_squared;
        let coulomb = powers.coulomb_nm * way + powers.creep_nm_s_per_rad * speed_squared;
        let mut hand = powers.torque_nm * turned;
        if powers.hand_nm_per_rad != 0.0 || powers.hand_nm_s_per_rad != 0.0 {
            // With y = intent - angle and y' = v - ω: ∫ yω = v ∫ y - Δ(y²)/2.
            let v = powers.intent_rad_per_s;
            let intent = length_s * (before[INTENT] + 0.5 * v * length_s);
            let (y0, y1) = (before[INTENT] - before[ANGLE], after[INTENT] - after[ANGLE]);
            let spring = v * (intent - states[ANGLE]) - 0.5 * (y1 - y0) * (y1 + y0);
            let damper = v * turned - speed_squared;
            hand += powers.hand_nm_per_rad * spring + powers.hand_nm_s_per_rad * damper;
        }
        if powers.borne_nm_per_a != 0.0 {
            // Constant speed: the hand bears friction and the motor's torque.
            hand += viscous + coulomb - powers.borne_nm_per_a * before[SPEED] * charge;
        }
        self.take_by::<S::Lanes>([source_j, hand, copper, diodes, viscous, coulomb]);
    }

    #[inline(always)]
    pub(crate) fn take(&mut self, flows: [f64; 6]) {
        self.take_by::<Array>(flows);
    }

    #[inline(always)]
    fn take_by<L: Lanes>(&mut self, flows: [f64; 6]) {
        let [a, b, c, d, e, f] = flows;
        let exchanged = a.abs() + b.abs() + c.abs() + d.abs() + e.abs() + f.abs();
        self.flows.add(L::of(&[a, b, c, d]));
        self.others.add(L::of(&[e, f, exchanged, exchanged]));
    }

    /// Accounts for a stretch of a network, given the integrals of its first four states and its flows.
    pub(crate) fn passed(&mut self, states: &State, flows: [f64; 6]) {
        self.passed_by::<Array>(states, flows);
    }

    /// Does as [`passed`](Self::passed), in the lanes of the caller.
    #[inline(always)]
    pub(crate) fn passed_by<L: Lanes>(&mut self, states: &State, flows: [f64; 6]) {
        self.states.add(L::of(states));
        self.take_by::<L>(flows);
    }

    /// Adds what was exchanged from one state to another so many times.
    pub fn repeat(&mut self, [then, now]: [&Self; 2], times: u64) {
        self.flows.repeat([&then.flows, &now.flows], times);
        self.others.repeat([&then.others, &now.others], times);
        self.states.repeat([&then.states, &now.states], times);
    }

    /// Accounts for the hand's work in a jump of a prescribed speed: impulse times mean speed.
    pub(crate) fn jerk(&mut self, inertia_kg_m2: f64, from_rad_per_s: f64, to_rad_per_s: f64) {
        let work = inertia_kg_m2 * (to_rad_per_s - from_rad_per_s) * (0.5 * (to_rad_per_s + from_rad_per_s));
        let mut flows = [0.0; 6];
        flows[HAND] = work;
        self.take(flows);
    }

    /// Accounts for the source's work in a jump of an imposed current: the energy that the inductance stores.
    pub(crate) fn surge(&mut self, inductance_h: f64, from_a: f64, to_a: f64) {
        let mut flows = [0.0; 6];
        flows[SOURCE] = inductance_h * (to_a - from_a) * (0.5 * (to_a + from_a));
        self.take(flows);
    }

    /// Adds the integrals of the states over a step, on which they move on straight lines.
    pub fn moved(&mut self, length_s: f64, from: &State, to: &State) {
        self.states.add(Array::all(0.5 * length_s) * (Array::of(from) + Array::of(to)));
    }

    /// Returns the integrals of current and angle since an earlier state, in A·s and rad·s.
    pub fn current_and_angle_since(&self, earlier: &Self) -> [f64; 2] {
        [CURRENT, ANGLE].map(|index| self.states.since(&earlier.states, index))
    }

    /// Returns the work of the supply, or of the amplifier, on the circuit (negative where current flows back into it).
    pub fn source_j(&self) -> f64 {
        self.flows.at(SOURCE)
    }

    /// Returns the work of the hand on the shaft.
    pub fn hand_j(&self) -> f64 {
        self.flows.at(HAND)
    }

    /// Returns the heat in winding and switches.
    pub fn copper_j(&self) -> f64 {
        self.flows.at(COPPER)
    }

    /// Returns the heat in diodes.
    pub fn diodes_j(&self) -> f64 {
        self.flows.at(DIODES)
    }

    /// Returns the heat of viscous friction.
    pub fn viscous_j(&self) -> f64 {
        self.others.at(VISCOUS)
    }

    /// Returns the heat of Coulomb friction.
    pub fn coulomb_j(&self) -> f64 {
        self.others.at(COULOMB)
    }

    /// Returns the energy supplied by source and hand.
    pub fn supplied_j(&self) -> f64 {
        self.source_j() + self.hand_j()
    }

    /// Returns the energy dissipated in all ways.
    pub fn dissipated_j(&self) -> f64 {
        self.copper_j() + self.diodes_j() + self.viscous_j() + self.coulomb_j()
    }

    /// Returns the sum of the sizes of all flows; a residual is measured against it.
    pub fn exchanged_j(&self) -> f64 {
        self.others.at(EXCHANGED)
    }
}

/// Returns the energy stored in inductance and inertia.
pub(crate) fn stored_j(inductance_h: f64, inertia_kg_m2: f64, x: &State) -> f64 {
    0.5 * inductance_h * x[CURRENT] * x[CURRENT] + 0.5 * inertia_kg_m2 * x[SPEED] * x[SPEED]
}

#[cfg(test)]
mod tests {
    use super::Sums;
    use crate::flow::lanes::{Array, Lanes};

    /// Terms of very different sizes, summed beside them as integers: multiples of 2⁻⁷².
    #[test]
    fn a_sum_of_a_million_terms_is_exact_but_for_its_own_rounding() {
        let unit = 2f64.powi(-72);
        let (mut sums, mut exact) = (Sums::default(), [0i128; 4]);
        for k in 0..1_000_000u64 {
            let terms = [3u64, 7, 11, 13].map(|seed| {
                let bits = (k + 1).wrapping_mul(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
                (i128::from(bits >> 12) - (1 << 50)) << (bits % 20)
            });
            sums.add(Array::of(&terms.map(|term| term as f64 * unit)));
            exact = [0, 1, 2, 3].map(|index| exact[index] + terms[index]);
        }
        for (index, exact) in exact.into_iter().enumerate() {
            let exact = exact as f64 * unit;
            assert!((sums.at(index) - exact).abs() <= f64::EPSILON * exact.abs(), "{} is not {exact}", sums.at(index));
        }
    }

    /// Terms that come again and again, in one go and one by one.
    #[test]
    fn terms_repeated_in_one_go_are_summed_as_one_by_one() {
        let terms: Vec<f64> = (1..200u32).map(|k| (f64::from(k) * 0.7).sin() * 10f64.powi(k as i32 % 9 - 4)).collect();
        let mut before = Sums::default();
        terms.iter().for_each(|term| before.add(Array::all(0.3 * term + 1e3)));
        let mut one = before;
        terms.iter().for_each(|term| one.add(Array::all(*term)));
        for times in [1u64, 2, 3, 10, 1000] {
            let (mut in_one_go, mut one_by_one) = (one, one);
            in_one_go.repeat([&before, &one], times);
            for _ in 0..times {
                terms.iter().for_each(|term| one_by_one.add(Array::all(*term)));
            }
            assert_eq!(in_one_go.at(0).to_bits(), one_by_one.at(0).to_bits(), "{times} times");
        }
    }
}
