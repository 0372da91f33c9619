//! The Taylor series of the motion from one start, term by term.

use super::around::Around;
use super::circuit::{Circuit, Plane, dot};
pub(super) use super::start::{ALPHA, ANGLE, BETA, Hold, SHARES, SPEED, Start};
use super::{Grip, Pmsm};
use crate::flow::double::{Product, versions};
use crate::flow::lanes::Lanes as _;
use crate::flow::polynomial::{Coefficients, ORDER, convolved};

/// Series of the motion.
#[derive(Clone)]
pub(super) struct Series {
    /// Currents in the stator's frame, speed and angle.
    pub x: Coefficients,
    /// Speed, speed, and the part of the flux linkage along the rotor, in the stator's frame.
    pub flux: Coefficients,
    /// Sine and cosine of the electrical angle, and the currents, the second one first.
    pub turned: Coefficients,
    /// Cosine and sine, and the flux linkage along the rotor, twice. Used if `L_d` and `L_q` differ.
    along: Coefficients,
    /// Currents, cosine and sine.
    crossed: Coefficients,
    /// Sine and cosine of two harmonics of the cogging in each.
    waves: Vec<Coefficients>,
    /// The bodies around the rotor.
    pub around: Around,
    /// The torque on the shaft without friction.
    pub torque: [f64; ORDER + 1],
    /// Powers in use.
    pub powers: usize,
}

/// The laws, the circuit and the friction that drive a segment.
pub(super) struct Driven<'l> {
    pub laws: &'l Pmsm,
    pub circuit: &'l Circuit,
    pub hold: Hold,
}

impl Series {
    pub fn new(laws: &Pmsm) -> Self {
        const ZERO: Coefficients = [[0.0; 4]; ORDER + 1];
        let waves = vec![ZERO; laws.motor.cogging.len().div_ceil(2)];
        Self {
            x: ZERO,
            flux: ZERO,
            turned: ZERO,
            along: ZERO,
            crossed: ZERO,
            waves,
            around: Around::new(laws),
            torque: [0.0; ORDER + 1],
            powers: 0,
        }
    }

    versions! {
        /// Writes the series up to a power, in the lanes of the present processor, to the same bits in any. With
        /// `self.powers` 0 they begin at the start; else the powers beyond are added.
        pub(super) fn write[write_fused, write_native, write_with](
            series: &mut Series, driven: &Driven, start: &Start, powers: usize
        )
    }

    /// Writes the series in the lanes of any processor.
    #[cfg(test)]
    pub fn write_anywhere(series: &mut Series, driven: &Driven, start: &Start, powers: usize) {
        Self::write_with::<crate::flow::double::Native>(series, driven, start, powers);
    }

    #[inline(always)]
    fn write_with<P: Product>(series: &mut Series, driven: &Driven, start: &Start, powers: usize) {
        let Driven { laws, circuit, hold } = driven;
        let motor = &laws.motor;
        let pairs = f64::from(motor.pole_pairs);
        let salience = motor.direct_h - motor.quadrature_h;
        let e = start.e;
        let [aa, ab, bb] = circuit.gain(laws, e);
        let shaft = &laws.net.bodies[0];
        let per_inertia = if let Hold::Slip(_) = hold { 1.0 / shaft.inertia } else { 0.0 };
        let Grip { torque_nm, stiffness_nm_per_rad: stiffness, damping_nm_s_per_rad, units, .. } = laws.pull;
        let hand_nm = torque_nm + stiffness * start.twist_rad + damping_nm_s_per_rad * start.intent_rad_per_s;
        let damping = units * damping_nm_s_per_rad;
        let rub_nm = if let Hold::Slip(sign) = hold { sign * shaft.coulomb } else { 0.0 };
        let Self { x, flux, turned, along, crossed, waves, around, torque, .. } = series;
        let done = series.powers;
        if done == 0 {
            let i = start.current();
            let active = motor.flux_vs + salience * dot(e, i);
            x[0] = start.x;
            flux[0] = [start.x[SPEED], start.x[SPEED], active * e[0], active * e[1]];
            turned[0] = [e[1], e[0], i[1], i[0]];
            along[0] = [e[0], e[1], active, active];
            crossed[0] = [i[0], i[1], e[0], e[1]];
            for (wave, pair) in waves.iter_mut().zip(motor.cogging.chunks(2)) {
                wave[0] = [0.0; 4];
                for (lane, harmonic) in pair.iter().enumerate() {
                    let (sine, cosine) = laws.wave(harmonic, start.x[ANGLE], start.low[ANGLE]);
                    (wave[0][2 * lane], wave[0][2 * lane + 1]) = (sine, cosine);
                }
            }
        }
        assert!(powers <= ORDER);
        let torque_per_flux = 1.5 * pairs;
        let viscous = shaft.viscous;
        // What the first powers alone have.
        let (mut given, mut pull_nm, mut against_nm) = ([0.0; 2], 0.0, 0.0);
        if done == 0 {
            (given, pull_nm, against_nm) = (circuit.volts, hand_nm, rub_nm);
        }
        for k in done..powers {
            let share = SHARES[k + 1];
            let [sine, cosine, ahead, behind] = convolved::<P>(&flux[..=k], &turned[..=k]).state();
            let turn = pairs * share;
            let (cosine, sine) = (-turn * sine, turn * cosine);
            // The shaft.
            let [alpha, beta, speed, angle] = x[k];
            let mut sum = torque_per_flux * (ahead - behind) + pull_nm - damping * speed;
            if stiffness != 0.0 && k > 0 {
                sum -= stiffness * if k == 1 { units * angle - start.intent_rad_per_s } else { units * angle };
            }
            if laws.is_around {
                sum += around.write(laws, x, start, k);
            }
            for (wave, pair) in waves.iter_mut().zip(&laws.waves) {
                let (mut turned, mut cogging) = (P::all(0.0), P::lanes(&pair.amplitudes_nm) * P::lanes(&wave[k]));
                for (x, wave) in x[..=k].iter().zip(wave[..=k].iter().rev()) {
                    turned = turned + P::all(x[SPEED]) * P::lanes(wave);
                }
                cogging = cogging * P::all(-1.0);
                let (cogging, turned) = (cogging.state(), (turned * P::all(share)).state());
                sum += cogging[0] + cogging[2];
                let [one, other] = pair.orders;
                wave[k + 1] = [one * turned[1], -one * turned[0], other * turned[3], -other * turned[2]];
            }
            torque[k] = sum;
            let mut next = (sum - viscous * speed - against_nm) * (per_inertia * share);
            if k == 0 {
                if let Hold::Slip(sign) = hold
                    && speed == 0.0
                    && sign * next < 0.0
                {
                    // Rounding must not make a shaft that begins to slip go back.
                    next = 0.0;
                }
                (pull_nm, against_nm) = (0.0, 0.0);
            }
            // The winding.
            let resistive = circuit.resistive([alpha, beta]);
            let rise = [(given[0] - resistive[0]) * share, (given[1] - resistive[1]) * share];
            given = [0.0; 2];
            let (current, part);
            if salience == 0.0 {
                part = [motor.flux_vs * cosine, motor.flux_vs * sine];
                let rest = [rise[0] - part[0], rise[1] - part[1]];
                current = [aa * rest[0] + ab * rest[1], ab * rest[0] + bb * rest[1]];
            } else {
                let [one, other, first, second] = convolved::<P>(&along[1..=k], &crossed[1..=k]).state();
                let known = one + other + cosine * x[0][ALPHA] + sine * x[0][BETA];
                let active = along[0][2];
                let bent = [active * cosine + first, active * sine + second];
                let pull = salience * known;
                let rest = [rise[0] - bent[0] - pull * e[0], rise[1] - bent[1] - pull * e[1]];
                current = [aa * rest[0] + ab * rest[1], ab * rest[0] + bb * rest[1]];
                let pull = salience * (known + dot(e, current));
                part = [bent[0] + pull * e[0], bent[1] + pull * e[1]];
                along[k + 1] = [cosine, sine, pull, pull];
                crossed[k + 1] = [current[0], current[1], cosine, sine];
            }
            x[k + 1] = [current[0], current[1], next, speed * share];
            turned[k + 1] = [sine, cosine, current[1], current[0]];
            flux[k + 1] = [next, next, part[0], part[1]];
        }
        series.powers = powers;
    }

    /// Returns the term of power `k` of `i_q`.
    #[inline(always)]
    pub fn across_term(&self, k: usize) -> f64 {
        let terms = self.turned[..=k].iter().zip(self.x[..=k].iter().rev());
        terms.map(|(turned, x)| turned[1] * x[BETA] - turned[0] * x[ALPHA]).sum()
    }

    /// Returns the term of power `k` of the rate of the flux linkage; the last power in use is not known.
    #[inline(always)]
    pub fn flux_rate(&self, laws: &Pmsm, k: usize) -> Plane {
        let (x, flux, next) = (&self.x[k + 1], &self.flux[k + 1], (k + 1) as f64);
        let q = laws.motor.quadrature_h;
        [next * (q * x[ALPHA] + flux[2]), next * (q * x[BETA] + flux[3])]
    }
}

impl Pmsm {
    /// Returns sine and cosine of the electrical angle at an angle, given with its low part.
    pub(super) fn direction(&self, angle: f64, low: f64) -> Plane {
        let (sine, cosine) = turned(f64::from(self.motor.pole_pairs), 0.0, angle, low);
        [cosine, sine]
    }

    /// Returns sine and cosine of the argument of a harmonic of the cogging.
    pub(super) fn wave(&self, harmonic: &super::Harmonic, angle: f64, low: f64) -> (f64, f64) {
        turned(harmonic.order.into(), harmonic.phase_rad, angle, low)
    }
}

/// Returns sine and cosine of `order (angle + low) + phase`, as exact as `f64` can give them.
fn turned(order: f64, phase: f64, angle: f64, low: f64) -> (f64, f64) {
    use crate::flow::double::Double;
    let argument = Double::product(order, angle) + Double::joined(phase, order * low);
    let (sine, cosine) = libm::sincos(argument.hi);
    (sine + cosine * argument.lo, cosine - sine * argument.lo)
}
