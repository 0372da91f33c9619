//! The energy audit: every flow integrated by itself, from the series of the motion.

use super::Pmsm;
use super::circuit::{Circuit, Plane, dot};
use super::series::{ALPHA, ANGLE, BETA, Hold, SPEED, Series, Start};
use crate::Hand;
use crate::energy::Energy;
use crate::flow::double::{Product, versions};
use crate::flow::lanes::Lanes as _;
use crate::flow::matrix::State;
use crate::flow::polynomial::{Lanes, ORDER};

/// What is integrated over a part of a segment.
#[derive(Clone, Copy, Default)]
pub(super) struct Passed {
    /// Integrals of the currents, the speed, and the angle since the start.
    pub states: Lanes,
    /// Integrals of the voltage on resistances times the current, in both directions of the stator, of the square of
    /// the speed, and of nothing. Of the first two only the sum counts.
    products: Lanes,
    /// Integral of `i_q`.
    pub torque_as: f64,
}

impl Passed {
    versions! {
        /// Integrates the first `t` seconds of a series.
        pub(super) fn of[of_fused, of_native, of_with](
            series: &Series, laws: &Pmsm, circuit: &Circuit, t: f64
        ) -> Passed
    }

    #[inline(always)]
    fn of_with<P: Product>(series: &Series, laws: &Pmsm, circuit: &Circuit, t: f64) -> Passed {
        let powers = series.powers;
        let x = &series.x[..=powers];
        let mut drops = [[0.0; 4]; ORDER + 1];
        for (drop, x) in drops.iter_mut().zip(x) {
            let [one, other] = circuit.resistive([x[ALPHA], x[BETA]]);
            *drop = [one, other, x[SPEED], 0.0];
        }
        let (mut states, mut products) = (P::all(0.0), P::all(0.0));
        let step = P::all(t);
        for k in (0..=powers).rev() {
            let share = P::all(1.0 / (k + 1) as f64);
            states = states * step + P::lanes(&x[k]) * share;
            // The resistances are a symmetric matrix: both halves of the sum are alike.
            let half = k.div_ceil(2);
            let mut sum = P::all(0.0);
            for (drop, x) in drops[..half].iter().zip(x[..=k].iter().rev()) {
                sum = sum + P::lanes(drop) * P::lanes(x);
            }
            sum = sum + sum;
            if k % 2 == 0 {
                sum = sum + P::lanes(&drops[half]) * P::lanes(&x[half]);
            }
            products = products * step + sum * share;
        }
        let (mut states, products) = ((states * step).state(), (products * step).state());
        states[ANGLE] -= x[0][ANGLE] * t;
        Passed { states, products, torque_as: across(series, laws, t) }
    }
}

/// Returns the integral of `i_q` over the first `t` seconds.
#[inline(always)]
fn across(series: &Series, laws: &Pmsm, t: f64) -> f64 {
    let motor = &laws.motor;
    let powers = series.powers;
    let mut sum = 0.0;
    if motor.direct_h == motor.quadrature_h && motor.flux_vs > 0.0 {
        sum = motor.flux_vs * series.across_term(powers) / (powers + 1) as f64;
        for k in (0..powers).rev() {
            sum = sum * t + series.across[k] / (k + 1) as f64;
        }
        return sum * t / motor.flux_vs;
    }
    for k in (0..=powers).rev() {
        sum = sum * t + series.across_term(k) / (k + 1) as f64;
    }
    sum * t
}

/// Adds the flows of the first `t` seconds of a series, through which the shaft turned by `turned`.
pub(super) fn take(
    energy: &mut Energy,
    laws: &Pmsm,
    (circuit, hold): (&Circuit, Hold),
    start: &Start,
    passed: &Passed,
    (t, turned): (f64, f64),
) {
    let (motor, inverter) = (&laws.motor, &laws.inverter);
    let charge: Plane = [passed.states[ALPHA], passed.states[BETA]];
    let source = inverter.supply_v * dot(circuit.rail, charge);
    let copper = 1.5 * (passed.products[0] + passed.products[1]);
    let diodes = inverter.diode_drop_v * dot(circuit.diodes, charge);
    let squared = passed.products[2];
    let viscous = motor.viscous_nm_s_per_rad * squared;
    let coulomb = if let Hold::Slip(sign) = hold { sign * motor.coulomb_nm * turned } else { 0.0 };
    let v = start.intent_rad_per_s;
    let hand = match laws.hand {
        Hand::Torque(torque_nm) => torque_nm * turned,
        Hand::Spring(push) => {
            // With y = intent - angle and y' = v - ω: ∫ yω = v ∫ y - Δ(y²)/2.
            let y = start.twist_rad;
            let stretch = y * t + 0.5 * v * t * t - passed.states[ANGLE];
            let change = v * t - turned;
            let spring = v * stretch - 0.5 * change * (2.0 * y + change);
            push.stiffness_nm_per_rad * spring + push.damping_nm_s_per_rad * (v * turned - squared)
        }
        Hand::Prescribed => 0.0,
    };
    let angle = start.x[ANGLE] * t + passed.states[ANGLE];
    let intent = angle_of_intent(start) * t + 0.5 * v * t * t;
    let states: State = [passed.torque_as, turned, angle, intent];
    energy.passed(&states, [source, hand, copper, diodes, viscous, coulomb]);
}

fn angle_of_intent(start: &Start) -> f64 {
    start.twist_rad + start.x[ANGLE]
}

impl Pmsm {
    /// Returns the energy, in J, of currents, motion and cogging.
    pub(super) fn stored_j(&self, x: &Lanes, low: &Lanes) -> f64 {
        let motor = &self.motor;
        let [cosine, sine] = self.direction(x[ANGLE], low[ANGLE]);
        let direct = cosine * x[ALPHA] + sine * x[BETA];
        let across = cosine * x[BETA] - sine * x[ALPHA];
        let mut stored = 0.75 * (motor.direct_h * direct * direct + motor.quadrature_h * across * across);
        stored += 0.5 * motor.inertia_kg_m2 * x[SPEED] * x[SPEED];
        for harmonic in &motor.cogging {
            let (_, cosine) = self.wave(harmonic, x[ANGLE], low[ANGLE]);
            stored -= harmonic.amplitude_nm / f64::from(harmonic.order) * cosine;
        }
        stored
    }
}
