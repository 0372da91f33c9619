//! The energy audit: every flow integrated by itself, from the series of the motion.

use super::around::Around;
use super::circuit::{Circuit, Plane, dot};
use super::series::{ALPHA, ANGLE, BETA, Driven, Hold, SHARES, SPEED, Series, Start};
use super::{Grip, MOST_BODIES, Pmsm};
use crate::energy::Energy;
use crate::flow::double::{Product, versions};
use crate::flow::lanes::Lanes as _;
use crate::flow::matrix::State;
use crate::flow::polynomial::Lanes;

/// Nodes and weights of Gauss and Legendre on [0, 1], with 3 to 9 nodes, one list after another.
#[rustfmt::skip]
const NODES: [(f64, f64); 42] = [
    (0.112_701_665_379_258_31, 0.277_777_777_777_777_8), (0.5, 0.444_444_444_444_444_4),
    (0.887_298_334_620_741_7, 0.277_777_777_777_777_8), (0.069_431_844_202_973_71, 0.173_927_422_568_726_92),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_05), (0.669_990_521_792_428_1, 0.326_072_577_431_273_05),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_92), (0.046_910_077_030_668_004, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_24), (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_24), (0.953_089_922_969_332, 0.118_463_442_528_094_54),
    (0.033_765_242_898_423_99, 0.085_662_246_189_585_18), (0.169_395_306_766_867_73, 0.180_380_786_524_069_3),
    (0.380_690_406_958_401_56, 0.233_956_967_286_345_52), (0.619_309_593_041_598_5, 0.233_956_967_286_345_52),
    (0.830_604_693_233_132_2, 0.180_380_786_524_069_3), (0.966_234_757_101_576, 0.085_662_246_189_585_18),
    (0.025_446_043_828_620_736, 0.064_742_483_084_434_85), (0.129_234_407_200_302_77, 0.139_852_695_744_638_32),
    (0.297_077_424_311_301_4, 0.190_915_025_252_559_46), (0.5, 0.208_979_591_836_734_7),
    (0.702_922_575_688_698_5, 0.190_915_025_252_559_46), (0.870_765_592_799_697_2, 0.139_852_695_744_638_32),
    (0.974_553_956_171_379_3, 0.064_742_483_084_434_85), (0.019_855_071_751_231_884, 0.050_614_268_145_188_13),
    (0.101_666_761_293_186_64, 0.111_190_517_226_687_24), (0.237_233_795_041_835_5, 0.156_853_322_938_943_63),
    (0.408_282_678_752_175_1, 0.181_341_891_689_181), (0.591_717_321_247_825, 0.181_341_891_689_181),
    (0.762_766_204_958_164_5, 0.156_853_322_938_943_63), (0.898_333_238_706_813_4, 0.111_190_517_226_687_24),
    (0.980_144_928_248_768_1, 0.050_614_268_145_188_13), (0.015_919_880_246_186_954, 0.040_637_194_180_787_206),
    (0.081_984_446_336_682_1, 0.090_324_080_347_428_7), (0.193_314_283_649_704_8, 0.130_305_348_201_467_72),
    (0.337_873_288_298_095_54, 0.156_173_538_520_001_43), (0.5, 0.165_119_677_500_629_9),
    (0.662_126_711_701_904_5, 0.156_173_538_520_001_43), (0.806_685_716_350_295_2, 0.130_305_348_201_467_72),
    (0.918_015_553_663_317_9, 0.090_324_080_347_428_7), (0.984_080_119_753_813, 0.040_637_194_180_787_206),
];

/// A part of a segment: integrals over it, and its end.
#[derive(Clone, Copy)]
pub(super) struct Passed {
    /// Integrals of the currents, the speed, and the angle since the start.
    pub states: Lanes,
    /// Integral of the voltage on resistances times the current.
    heat: f64,
    /// Integral of the square of the speed.
    squared: f64,
    /// Integral of `i_q`.
    across_as: f64,
    /// The state at the end, and the parts of it that rounding takes.
    pub end: (Lanes, Lanes),
    /// The angle through which the shaft turned.
    turned: f64,
}

impl Passed {
    versions! {
        /// Adds the flows of the first `t` seconds of a series to an audit. The states are integrated term by term,
        /// products of two series of power `N` by Gauss's rule, which is exact up to the power `N` at least.
        pub(super) fn take[take_fused, take_native, take_with](
            energy: &mut Energy, driven: &Driven, start: &Start, series: &Series, t: f64
        ) -> Passed
    }

    /// Takes the flows in the lanes of any processor.
    #[cfg(test)]
    pub fn take_anywhere(energy: &mut Energy, driven: &Driven, start: &Start, series: &Series, t: f64) -> Self {
        Self::take_with::<crate::flow::double::Native>(energy, driven, start, series, t)
    }

    #[inline(always)]
    fn take_with<P: Product>(energy: &mut Energy, driven: &Driven, start: &Start, series: &Series, t: f64) -> Passed {
        let passed = Self::of::<P>(driven.circuit, start, series, t);
        let (states, flows) = passed.flows(driven, start, series, t);
        energy.passed_by::<P::Lanes>(&states, flows);
        passed
    }

    #[inline(always)]
    fn of<P: Product>(circuit: &Circuit, start: &Start, series: &Series, t: f64) -> Self {
        let Series { x, turned, powers, .. } = series;
        match *powers {
            // The usual ones are compiled for their own numbers of terms and nodes.
            4 => Self::of_terms::<P>((&x[..5], &turned[..5]), nodes(4), circuit, start, t),
            5 => Self::of_terms::<P>((&x[..6], &turned[..6]), nodes(5), circuit, start, t),
            powers => Self::of_terms::<P>((&x[..=powers], &turned[..=powers]), nodes(powers), circuit, start, t),
        }
    }

    #[inline(always)]
    fn of_terms<P: Product>(
        (x, turned): (&[Lanes], &[Lanes]),
        nodes: &[(f64, f64)],
        circuit: &Circuit,
        start: &Start,
        t: f64,
    ) -> Self {
        let mut states = P::all(0.0);
        let step = P::all(t);
        for (x, share) in x.iter().zip(&SHARES[1..]).rev() {
            states = states * step + P::lanes(x) * P::all(*share);
        }
        let mut states = (states * step).state();
        states[ANGLE] -= x[0][ANGLE] * t;
        let [mut heat, mut squared, mut across] = [0.0; 3];
        for (node, weight) in nodes {
            let step = P::all(node * t);
            let (mut point, mut speed) = (P::all(0.0), 0.0);
            for (turned, x) in turned.iter().zip(x).rev() {
                point = point * step + P::lanes(turned);
                speed = speed * (node * t) + x[SPEED];
            }
            let [sine, cosine, beta, alpha] = point.state();
            let [one, other] = circuit.resistive([alpha, beta]);
            heat += weight * (one * alpha + other * beta);
            squared += weight * (speed * speed);
            across += weight * (cosine * beta - sine * alpha);
        }
        let end = start.after::<P::Lanes>(&x[1..], t);
        let turned = (end.0[ANGLE] - start.x[ANGLE]) + (end.1[ANGLE] - start.low[ANGLE]);
        Self { states, heat: heat * t, squared: squared * t, across_as: across * t, end, turned }
    }

    /// Returns the integrals of the states that a row shows, and the flows.
    #[inline(always)]
    fn flows(&self, driven: &Driven, start: &Start, series: &Series, t: f64) -> (State, [f64; 6]) {
        let Driven { laws, circuit, hold } = *driven;
        let (passed, turned) = (self, self.turned);
        let inverter = &laws.inverter;
        let shaft = &laws.net.bodies[0];
        let charge: Plane = [passed.states[ALPHA], passed.states[BETA]];
        let source = inverter.supply_v * dot(circuit.rail, charge);
        let copper = 1.5 * passed.heat;
        let diodes = inverter.diode_drop_v * dot(circuit.diodes, charge);
        let squared = passed.squared;
        let mut viscous = shaft.viscous * squared;
        let mut coulomb = if let Hold::Slip(sign) = hold { sign * shaft.coulomb * turned } else { 0.0 };
        // Of the body at the grip, in its units: the integral of the square of its speed, its way and its integral.
        let mut held = [squared, turned, passed.states[ANGLE]];
        let mut bearing = 0.0;
        if laws.is_around {
            let around = Beside::of(laws, series, t, [passed.squared, turned, passed.states[ANGLE]]);
            viscous += around.viscous;
            coulomb += around.coulomb;
            held = around.held;
            bearing = around.borne(laws, (start, series), passed, (t, turned));
        }
        let v = start.intent_rad_per_s;
        let Grip { torque_nm, stiffness_nm_per_rad, damping_nm_s_per_rad, units, .. } = laws.grip;
        let [squared, moved, passed_by] = [units * units * held[0], units * held[1], units * held[2]];
        // With y = intent - angle and y' = v - ω: ∫ yω = v ∫ y - Δ(y²)/2.
        let y = start.twist_rad;
        let stretch = y * t + 0.5 * v * t * t - passed_by;
        let change = v * t - moved;
        let spring = v * stretch - 0.5 * change * (2.0 * y + change);
        let mut hand = torque_nm * moved + stiffness_nm_per_rad * spring + damping_nm_s_per_rad * (v * moved - squared);
        if laws.imposes(laws.grip.body) {
            // The hand bears all torques on a body that keeps its speed.
            let body = &laws.net.bodies[laws.grip.body];
            let friction = body.coulomb * held[1].abs();
            coulomb += friction;
            hand = friction + body.viscous * held[0] - bearing;
        }
        let angle = start.x[ANGLE] * t + passed.states[ANGLE];
        let intent = laws.intended(start, &series.around) * t + 0.5 * v * t * t;
        let states: State = [passed.across_as, turned, angle, intent];
        (states, [source, hand, copper, diodes, viscous, coulomb])
    }
}

/// Returns the integrals of the currents over the first `t` seconds of a series.
pub(super) fn charge(series: &Series, t: f64) -> Plane {
    let terms = series.x[..=series.powers].iter().zip(&SHARES[1..]).rev();
    let sums = terms.fold([0.0; 2], |sum, (x, share)| [ALPHA, BETA].map(|axis| sum[axis] * t + x[axis] * share));
    sums.map(|sum| sum * t)
}

/// The nodes and weights for the product of two series of these powers.
#[inline(always)]
fn nodes(powers: usize) -> &'static [(f64, f64)] {
    let count = powers / 2 + 1;
    let first = count * (count - 1) / 2 - 3;
    &NODES[first..first + count]
}

/// Flows of energy over a part of a segment, beside the rotor's own.
struct Beside {
    /// Heat of the dampers of ties, and of bodies beside the rotor.
    viscous: f64,
    /// Heat of friction of bodies beside the rotor.
    coulomb: f64,
    /// Of each body its way and the integral of that.
    ways: [[f64; 2]; MOST_BODIES],
    /// Of the body at the grip the integral of the square of its speed, its way, and the integral of that.
    held: [f64; 3],
}

impl Beside {
    fn of(laws: &Pmsm, series: &Series, t: f64, [squared, turned, passed]: [f64; 3]) -> Self {
        let Around { bodies, ties, .. } = &series.around;
        let powers = series.powers;
        let mut ways = [[turned, passed]; MOST_BODIES];
        for (way, body) in ways[1..].iter_mut().zip(bodies) {
            let (x, low) = body.at(t, powers);
            let sum = (1..=powers).rev().fold(0.0, |sum, k| sum * t + body.terms[k][1] * SHARES[k + 1]);
            *way = [(x[1] - body.x[1]) + (low[1] - body.low[1]), sum * t * t];
        }
        let mut squares = [squared; MOST_BODIES];
        squares[1..].fill(0.0);
        let mut viscous = 0.0;
        for (node, weight) in nodes(powers) {
            let (step, weight) = (node * t, weight * t);
            let mut speeds = [0.0; MOST_BODIES];
            speeds[0] = series.x[..=powers].iter().rev().fold(0.0, |sum, x| sum * step + x[SPEED]);
            for ((speed, body), square) in speeds[1..].iter_mut().zip(bodies).zip(&mut squares[1..]) {
                *speed = body.terms[..=powers].iter().rev().fold(0.0, |sum, term| sum * step + term[0]);
                *square += weight * *speed * *speed;
            }
            for tie in ties.iter().filter(|tie| tie.damping != 0.0) {
                let rate = tie.sum(|body| speeds[body]);
                viscous += weight * tie.damping * rate * rate;
            }
        }
        let mut coulomb = 0.0;
        for (of, (body, further)) in laws.net.bodies[1..].iter().zip(bodies).enumerate() {
            viscous += body.viscous * squares[of + 1];
            if let Hold::Slip(sign) = further.hold {
                coulomb += sign * body.coulomb * ways[of + 1][0];
            }
        }
        let held = laws.grip.body;
        Self { viscous, coulomb, ways, held: [squares[held], ways[held][0], ways[held][1]] }
    }

    /// Returns the work of all torques but friction on a body whose speed a hand imposes.
    fn borne(&self, laws: &Pmsm, (start, series): (&Start, &Series), passed: &Passed, (t, turned): (f64, f64)) -> f64 {
        let body = laws.grip.body;
        if !laws.imposes(body) {
            return 0.0;
        }
        let speed = series.around.terms(&series.x, body, 0)[0];
        let mut impulse = laws.net.bodies[body].constant * t;
        let Around { ties, stretches, .. } = &series.around;
        for (tie, first) in ties.iter().zip(stretches) {
            let [moved, integral] = [0, 1].map(|of| tie.sum(|body| self.ways[body][of]));
            let force = tie.stiffness * (first * t + integral) + tie.damping * moved;
            tie.ends.iter().filter(|(of, _)| *of == body).for_each(|(_, way)| impulse -= way * force);
        }
        if body > 0 {
            return speed * impulse;
        }
        let motor = &laws.motor;
        let salience = motor.direct_h - motor.quadrature_h;
        let mut charge = motor.flux_vs * passed.across_as;
        for (node, weight) in nodes(series.powers).iter().filter(|_| salience != 0.0) {
            let terms = series.turned[..=series.powers].iter().rev();
            let [sine, cosine, beta, alpha] =
                terms.fold([0.0; 4], |sum, term| std::array::from_fn(|k| sum[k] * (node * t) + term[k]));
            let (direct, across) = (cosine * alpha + sine * beta, cosine * beta - sine * alpha);
            charge += weight * t * salience * direct * across;
        }
        let cogging = |angle: f64, low: f64| laws.cogging_j(angle, low);
        let [angle, low] = [start.x[ANGLE], start.low[ANGLE]];
        let cogged = cogging(angle, low) - cogging(angle, low + turned);
        speed * (impulse + 1.5 * f64::from(motor.pole_pairs) * charge) + cogged
    }
}

impl Pmsm {
    /// Returns the hand's intention at the start of a segment.
    fn intended(&self, start: &Start, around: &Around) -> f64 {
        let [position, _] = around.position(start, self.grip.body);
        start.twist_rad + self.grip.units * position
    }

    /// Returns the energy of the cogging, in J.
    fn cogging_j(&self, angle: f64, low: f64) -> f64 {
        let each = self.motor.cogging.iter().map(|harmonic| {
            let (_, cosine) = self.wave(harmonic, angle, low);
            harmonic.amplitude_nm / f64::from(harmonic.order) * cosine
        });
        -each.sum::<f64>()
    }

    /// Returns the energy, in J, of currents, motion, cogging and springs, where each body beside the rotor has these
    /// speed and position, with low parts.
    pub(super) fn stored_j(&self, x: &Lanes, low: &Lanes, others: &[([f64; 2], [f64; 2])], around: &Around) -> f64 {
        let motor = &self.motor;
        let [cosine, sine] = self.direction(x[ANGLE], low[ANGLE]);
        let direct = cosine * x[ALPHA] + sine * x[BETA];
        let across = cosine * x[BETA] - sine * x[ALPHA];
        let mut stored = 0.75 * (motor.direct_h * direct * direct + motor.quadrature_h * across * across);
        stored += 0.5 * self.net.bodies[0].inertia * x[SPEED] * x[SPEED];
        for harmonic in &motor.cogging {
            let (_, cosine) = self.wave(harmonic, x[ANGLE], low[ANGLE]);
            stored -= harmonic.amplitude_nm / f64::from(harmonic.order) * cosine;
        }
        if self.is_around {
            let position = |body: usize| match body {
                0 => [x[ANGLE], low[ANGLE]],
                _ => [others[body - 1].0[1], others[body - 1].1[1]],
            };
            for (index, body) in self.net.bodies.iter().enumerate() {
                let speed = if index == 0 { 0.0 } else { others[index - 1].0[0] };
                stored += 0.5 * body.inertia * speed * speed - body.constant * position(index)[0];
            }
            for tie in &around.ties {
                let stretch = tie.stretch(position);
                stored += 0.5 * tie.stiffness * stretch * stretch;
            }
        }
        stored
    }
}
