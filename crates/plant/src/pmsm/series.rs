//! The Taylor series of the motion from one start, term by term.

use super::around::Around;
use super::circuit::{Circuit, Plane, dot};
pub(super) use super::start::{ALPHA, ANGLE, BETA, Hold, SHARES, SPEED, Start};
use super::{Grip, Pmsm};
use crate::flow::double::{Product, versions};
use crate::flow::lanes::Lanes as _;
use crate::flow::polynomial::{Coefficients, Lanes, ORDER, convolved};

/// The fewest powers of a series.
pub(super) const FEWEST: usize = 4;

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

/// The numbers that all terms of a segment share.
struct Terms {
    pairs: f64,
    torque_per_flux: f64,
    salience: f64,
    gain: [f64; 3],
    viscous: f64,
    per_inertia: f64,
    stiffness: f64,
    damping: f64,
    units: f64,
    /// Torques of the first power alone: the hand's, and that of friction.
    hand_nm: f64,
    rub_nm: f64,
}

impl Terms {
    #[inline(always)]
    fn of(driven: &Driven, start: &Start) -> Self {
        let Driven { laws, circuit, hold } = driven;
        let (motor, shaft) = (&laws.motor, &laws.net.bodies[0]);
        let pairs = f64::from(motor.pole_pairs);
        let Grip { torque_nm, stiffness_nm_per_rad: stiffness, damping_nm_s_per_rad, units, .. } = laws.pull;
        Self {
            pairs,
            torque_per_flux: 1.5 * pairs,
            salience: motor.direct_h - motor.quadrature_h,
            gain: circuit.gain(laws, start.e),
            viscous: shaft.viscous,
            per_inertia: if let Hold::Slip(_) = hold { 1.0 / shaft.inertia } else { 0.0 },
            stiffness,
            damping: units * damping_nm_s_per_rad,
            units,
            hand_nm: torque_nm + stiffness * start.twist_rad + damping_nm_s_per_rad * start.intent_rad_per_s,
            rub_nm: if let Hold::Slip(sign) = hold { sign * shaft.coulomb } else { 0.0 },
        }
    }
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
        let laws = driven.laws;
        let is_plain = laws.motor.direct_h == laws.motor.quadrature_h && laws.waves.is_empty() && !laws.is_around;
        if is_plain {
            Self::write_as::<P, true>(series, driven, start, powers);
        } else {
            Self::write_as::<P, false>(series, driven, start, powers);
        }
    }

    /// Writes the series; those of a plain motor are the currents, speed and angle of a rotor alone without saliency
    /// and cogging.
    #[inline(always)]
    fn write_as<P: Product, const PLAIN: bool>(series: &mut Series, driven: &Driven, start: &Start, powers: usize) {
        assert!(powers <= ORDER);
        let terms = Terms::of(driven, start);
        let done = series.powers;
        if done == 0 {
            assert!(powers >= FEWEST);
            // The fewest powers, one by one: each is compiled for its own number of terms, which stay in registers.
            let of = (driven, start);
            let first = series.begin::<P, PLAIN>(driven.laws, start);
            let second = series.next::<P, PLAIN>(&terms, of, 0, first.x, product::<P>(&[first]));
            let third = series.next::<P, PLAIN>(&terms, of, 1, second.x, product::<P>(&[first, second]));
            let fourth = series.next::<P, PLAIN>(&terms, of, 2, third.x, product::<P>(&[first, second, third]));
            let all = [first, second, third, fourth];
            series.next::<P, PLAIN>(&terms, of, 3, fourth.x, product::<P>(&all));
        }
        for k in done.max(FEWEST)..powers {
            let product = convolved::<P>(&series.flux[..=k], &series.turned[..=k]);
            series.next::<P, PLAIN>(&terms, (driven, start), k, series.x[k], product);
        }
        series.powers = powers;
    }

    /// Begins the series at a start, and returns its first term.
    #[inline(always)]
    fn begin<P: Product, const PLAIN: bool>(&mut self, laws: &Pmsm, start: &Start) -> Term<P::Lanes> {
        let motor = &laws.motor;
        let (e, i) = (start.e, start.current());
        let salience = motor.direct_h - motor.quadrature_h;
        let active = motor.flux_vs + salience * dot(e, i);
        let speed = start.x[SPEED];
        let flux = [speed, speed, active * e[0], active * e[1]];
        let first = self.put::<P>(0, start.x, flux, [e[1], e[0], i[1], i[0]]);
        if PLAIN {
            return first;
        }
        self.along[0] = [e[0], e[1], active, active];
        self.crossed[0] = [i[0], i[1], e[0], e[1]];
        for (wave, pair) in self.waves.iter_mut().zip(motor.cogging.chunks(2)) {
            wave[0] = [0.0; 4];
            for (lane, harmonic) in pair.iter().enumerate() {
                let (sine, cosine) = laws.wave(harmonic, start.x[ANGLE], start.low[ANGLE]);
                (wave[0][2 * lane], wave[0][2 * lane + 1]) = (sine, cosine);
            }
        }
        first
    }

    /// Writes the terms of power `k`, and returns them.
    #[inline(always)]
    fn put<P: Product>(&mut self, k: usize, x: Lanes, flux: Lanes, turned: Lanes) -> Term<P::Lanes> {
        let term = Term { x, flux: P::lanes(&flux), turned: P::lanes(&turned) };
        self.x[k] = P::lanes(&x).state();
        (self.flux[k], self.turned[k]) = (term.flux.state(), term.turned.state());
        term
    }

    /// Writes the terms of power `k + 1`, and returns them, from those up to power `k`: from that of `x` and from that
    /// of the product of `flux` and `turned`.
    #[inline(always)]
    fn next<P: Product, const PLAIN: bool>(
        &mut self,
        terms: &Terms,
        (driven, start): (&Driven, &Start),
        k: usize,
        [alpha, beta, speed, angle]: Lanes,
        product: P::Lanes,
    ) -> Term<P::Lanes> {
        let Driven { laws, circuit, hold } = driven;
        let (motor, e) = (&laws.motor, start.e);
        let Self { x, along, crossed, waves, around, torque, .. } = self;
        let share = SHARES[k + 1];
        let [sine, cosine, ahead, behind] = product.state();
        let turn = terms.pairs * share;
        let (cosine, sine) = (-turn * sine, turn * cosine);
        // The shaft.
        let mut sum = terms.torque_per_flux * (ahead - behind) + if k == 0 { terms.hand_nm } else { 0.0 };
        sum -= terms.damping * speed;
        if terms.stiffness != 0.0 && k > 0 {
            let turned = terms.units * angle;
            sum -= terms.stiffness * if k == 1 { turned - start.intent_rad_per_s } else { turned };
        }
        if !PLAIN {
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
        }
        torque[k] = sum;
        let against_nm = if k == 0 { terms.rub_nm } else { 0.0 };
        let mut next = (sum - terms.viscous * speed - against_nm) * (terms.per_inertia * share);
        if k == 0
            && let Hold::Slip(sign) = hold
            && speed == 0.0
            && sign * next < 0.0
        {
            // Rounding must not make a shaft that begins to slip go back.
            next = 0.0;
        }
        // The winding.
        let resistive = circuit.resistive([alpha, beta]);
        let given = if k == 0 { circuit.volts } else { [0.0; 2] };
        let rise = [(given[0] - resistive[0]) * share, (given[1] - resistive[1]) * share];
        let [aa, ab, bb] = terms.gain;
        let (current, part);
        if PLAIN || terms.salience == 0.0 {
            part = [motor.flux_vs * cosine, motor.flux_vs * sine];
            let rest = [rise[0] - part[0], rise[1] - part[1]];
            current = [aa * rest[0] + ab * rest[1], ab * rest[0] + bb * rest[1]];
        } else {
            let salience = terms.salience;
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
        let [a, b] = current;
        self.put::<P>(k + 1, [a, b, next, speed * share], [next, next, part[0], part[1]], [sine, cosine, b, a])
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

/// The terms of one power.
#[derive(Clone, Copy)]
struct Term<L> {
    x: Lanes,
    flux: L,
    turned: L,
}

/// Returns the last known term of the product of `flux` and `turned`, from all terms of both.
#[inline(always)]
fn product<P: Product>(terms: &[Term<P::Lanes>]) -> P::Lanes {
    let pairs = terms.iter().zip(terms.iter().rev());
    pairs.fold(P::all(0.0), |sum, (flux, turned)| sum + flux.flux * turned.turned)
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
