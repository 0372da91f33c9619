//! How long a series is good: a proved bound of what it leaves out.
//!
//! What a series of power `N` leaves out at a time `t` is, by Lagrange, `t^(N+1)` times the next Taylor coefficient of
//! the motion at some moment before. A [`Room`] bounds the current, the speed and the hand's stretch; for as long as
//! the motion certainly stays in it, the recursion of the series over these bounds, with each sign that of the worst
//! case, bounds every coefficient of every motion in it. Numbers are not negative there, so their relative rounding is
//! below that of the operations in sequence, which [`ROUNDING`] covers.
//!
//! Left out of the proof: the rounding of the series itself and of anchors, and the truncation of energies, of `i_q`
//! between anchors and of the voltage of open terminals. A segment lasts for [`SHORTEST_S`](super::motion) at least,
//! even where the bound would end it before.

use super::Pmsm;
use crate::Hand;
use crate::flow::polynomial::ORDER;

/// More than the relative rounding of the recursion below, whose results depend on less than 2^16 operations each.
const ROUNDING: f64 = 1.0 + 1.0 / (1u64 << 30) as f64;
/// What a series may leave out, as a share of the bounds.
const TOLERANCE: f64 = 1.0 / (1u64 << 58) as f64;

/// The bounds within which a motion starts, and what they promise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room {
    /// A segment may start up to these: size of the current, speed, the hand's stretch and the speed of its intention.
    starts: [f64; 4],
    /// The time for which a series of each power is good.
    pub good_s: [f64; ORDER + 1],
    /// Bound of the size of the acceleration.
    pub acceleration: f64,
}

impl Room {
    /// A room in which nothing may start.
    pub const NONE: Self = Self { starts: [-1.0; 4], good_s: [0.0; ORDER + 1], acceleration: 0.0 };

    /// Returns whether a segment may start so.
    #[inline(always)]
    pub fn takes(&self, start: [f64; 4]) -> bool {
        start.iter().zip(&self.starts).all(|(start, most)| start <= most)
    }

    /// Makes a room for segments that start so.
    pub fn around(laws: &Pmsm, start: [f64; 4]) -> Self {
        let motor = &laws.motor;
        let [current, speed, twist, intent] = start;
        let pairs = f64::from(motor.pole_pairs);
        let (stiffness, damping, hand) = match laws.hand {
            Hand::Spring(push) => (push.stiffness_nm_per_rad, push.damping_nm_s_per_rad, 0.0),
            Hand::Torque(torque_nm) => (0.0, 0.0, torque_nm.abs()),
            Hand::Prescribed => (0.0, 0.0, 0.0),
        };
        let least = motor.direct_h.min(motor.quadrature_h);
        let salience = (motor.direct_h - motor.quadrature_h).abs();
        let inverter = &laws.inverter;
        let ohm = motor.resistance_ohm + inverter.on_resistance_ohm + inverter.supply_ohm * (2.0 / 3.0);
        // Of two terminals at one rail and one at the other.
        let volts = (2.0 / 3.0) * (inverter.supply_v + 2.0 * inverter.diode_drop_v);
        let drag = motor.viscous_nm_s_per_rad + damping;
        let cogging: f64 = motor.cogging.iter().map(|harmonic| harmonic.amplitude_nm.abs()).sum();
        let constant = cogging + motor.coulomb_nm + hand + damping * intent;
        let inertia = motor.inertia_kg_m2;
        // A time in which the motion changes little, and what it changes by then.
        let order = motor.cogging.iter().map(|harmonic| harmonic.order).fold(motor.pole_pairs, u32::max);
        let rate = ohm / least + drag / inertia + (stiffness / inertia).sqrt() + f64::from(order) * speed;
        let (change_s, long) = (0.25 / (rate + 1.0), 1.5);
        let change = (volts + ohm * current + motor.flux_vs * pairs * speed) / least * change_s;
        let current = current + change;
        let torque = 1.5 * pairs * (motor.flux_vs + salience * current) * current + constant + drag * speed;
        let speed = speed + torque / inertia * change_s;
        let twist = twist + (speed + intent) * change_s;
        let starts = [current, speed, twist, intent];
        let [current, speed, twist, _] = starts.map(|bound| long * bound);

        // The recursion of the series over bounds.
        let mut i = [0.0; ORDER + 2];
        let mut w = [0.0; ORDER + 2];
        let mut e = [0.0; ORDER + 2];
        let mut along = [0.0; ORDER + 2];
        let mut flux = [0.0; ORDER + 2];
        let mut waves = vec![[0.0; ORDER + 2]; motor.cogging.len()];
        (i[0], w[0], e[0], along[0]) = (current, speed, 1.0, current);
        flux[0] = motor.flux_vs + salience * current;
        waves.iter_mut().for_each(|wave| wave[0] = 1.0);
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b.iter().rev()).map(|(a, b)| a * b).sum::<f64>();
        for k in 0..=ORDER {
            let share = 1.0 / (k + 1) as f64;
            e[k + 1] = pairs * share * product(&w[..=k], &e[..=k]);
            let mut torque = 1.5 * pairs * product(&flux[..=k], &i[..=k]) + drag * w[k];
            torque += match k {
                0 => stiffness * twist + motor.coulomb_nm + hand + damping * intent,
                1 => stiffness * (intent + w[0]),
                _ => stiffness * w[k - 1] / k as f64,
            };
            for (wave, harmonic) in waves.iter_mut().zip(&motor.cogging) {
                torque += harmonic.amplitude_nm.abs() * wave[k];
                wave[k + 1] = f64::from(harmonic.order) * share * product(&w[..=k], &wave[..=k]);
            }
            let given = if k == 0 { volts } else { 0.0 };
            let known = product(&e[1..=k + 1], &i[..=k]);
            // With both terms of the flux linkage along the rotor that do not need the next current.
            let active = motor.flux_vs + salience * along[0];
            let bent = active * e[k + 1] + salience * (product(&along[1..=k], &e[1..=k]) + known);
            i[k + 1] = ((given + ohm * i[k]) * share + bent) / least;
            along[k + 1] = known + i[k + 1];
            flux[k + 1] = bent + salience * i[k + 1];
            w[k + 1] = torque * share / inertia;
        }
        // The motion stays in the room for as long as its bounds allow.
        let stays = [
            (current - starts[0]) / i[1],
            (speed - starts[1]) / w[1],
            if stiffness > 0.0 { (twist - starts[2]) / (speed + intent) } else { f64::INFINITY },
        ];
        let stays_s = stays.into_iter().fold(f64::INFINITY, f64::min) / ROUNDING;
        let mut good_s = [0.0; ORDER + 1];
        for (n, good_s) in good_s.iter_mut().enumerate().skip(1) {
            let next = [
                i[n + 1] / current,
                w[n + 1] / speed,
                // The angle, against a turn of the rotor by 1 rad, and the rotor's direction.
                w[n] / (n + 1) as f64 * pairs,
                e[n + 1],
            ];
            let most = next.into_iter().fold(0.0, f64::max) * ROUNDING;
            *good_s = (libm::pow(TOLERANCE / most, 1.0 / (n + 1) as f64) / ROUNDING).min(stays_s);
        }
        Self { starts, good_s, acceleration: w[1] * ROUNDING }
    }
}
