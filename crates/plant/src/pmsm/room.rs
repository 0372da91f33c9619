//! How long a series is good: a proved bound of what it leaves out.
//!
//! A series of power `N` leaves out, at a time `t`, by Lagrange, `t^(N+1)` times the next Taylor coefficient of the
//! motion at some moment before. A [`Room`] bounds the current, the speed and the hand's stretch; for as long as
//! the motion certainly stays in it, the recursion of the series over these bounds, with each sign that of the worst
//! case, bounds every coefficient of every motion in it. Numbers are not negative there, so their relative rounding is
//! below that of the operations in sequence, which [`ROUNDING`] covers.
//!
//! Left out of the proof: the rounding of the series itself and of anchors, and the truncation of energies, of `i_q`
//! between anchors and of the voltage of open terminals. A segment whose series are good for less than 1 ns lasts for
//! 1 ns, and is not covered.

use super::{Grip, Pmsm};
use crate::flow::polynomial::ORDER;

/// More than the relative rounding of the recursion below, whose results depend on less than 2^16 operations each.
const ROUNDING: f64 = 1.0 + 1.0 / (1u64 << 30) as f64;
/// The share of the bounds that a series may leave out.
const TOLERANCE: f64 = 1.0 / (1u64 << 55) as f64;

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

    /// Makes a room for segments that start so and are to last for a time.
    pub fn around(laws: &Pmsm, start: [f64; 4], expected_s: f64) -> Self {
        let motor = &laws.motor;
        let [current, speed, twist, intent] = start;
        let pairs = f64::from(motor.pole_pairs);
        let Grip { torque_nm, stiffness_nm_per_rad: stiffness, damping_nm_s_per_rad: damping } = laws.grip;
        let hand = torque_nm.abs();
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
        let (mut change_s, long) = ((4.0 * expected_s * (rate + 1.0)).clamp(0.25, 1.0) / (rate + 1.0), 1.5);
        let mut starts;
        loop {
            let change = (volts + ohm * current + motor.flux_vs * pairs * speed) / least * change_s;
            let current = current + change;
            let torque = 1.5 * pairs * (motor.flux_vs + salience * current) * current + constant + drag * speed;
            let speed = speed + torque / inertia * change_s;
            starts = [current, speed, twist + (speed + intent) * change_s, intent];
            // A rotor that may turn by more than that makes the series short; a smaller room is better.
            if f64::from(order) * speed * change_s <= 1.5 || change_s < 1e-12 {
                break;
            }
            change_s *= 0.5;
        }
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

#[cfg(test)]
mod tests {
    use super::{Room, TOLERANCE};
    use crate::flow::polynomial::ORDER;
    use crate::pmsm::circuit::{Change, settled};
    use crate::pmsm::series::{Driven, Hold, Series, Start};
    use crate::pmsm::{Harmonic, Inverter, Pmsm, PmsmMotor};
    use crate::{Hand, Leg, Push};

    /// Motors and hands, and starts of each with random currents, speeds and legs, with the bounds of their rooms.
    fn each(mut take: impl FnMut(&Pmsm, &Driven, &Start, &Room, [f64; 4])) {
        let mut seed = 1u64;
        let mut random = move || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 * 2f64.powi(-52) - 1.0
        };
        let inverter = Inverter { supply_v: 24.0, supply_ohm: 0.1, on_resistance_ohm: 0.05, diode_drop_v: 0.7 };
        let spring = Hand::Spring(Push { stiffness_nm_per_rad: 0.5, damping_nm_s_per_rad: 1e-3 });
        for (direct_h, cogging, hand) in
            [(4e-4, 0, Hand::Torque(1e-3)), (2e-4, 3, spring), (6e-4, 2, Hand::Torque(0.0)), (4e-4, 1, spring)]
        {
            let harmonic = |n: u32| Harmonic { order: 12 * (n + 1), amplitude_nm: 2e-3, phase_rad: f64::from(n) };
            let motor = PmsmMotor {
                pole_pairs: 7,
                resistance_ohm: 0.8,
                direct_h,
                quadrature_h: 4e-4,
                flux_vs: 6e-3,
                inertia_kg_m2: 3e-6,
                viscous_nm_s_per_rad: 1e-5,
                coulomb_nm: 1e-3,
                stiction_nm: 1e-3,
                cogging: (0..cogging).map(harmonic).collect(),
            };
            let laws = Pmsm::new(motor, inverter, hand, 2e-8).unwrap();
            for pick in 0..300 {
                let mut x = [3.0 * random(), 3.0 * random(), 400.0 * random().powi(3), random()];
                if pick % 7 == 0 {
                    x[2] = 0.0;
                }
                let legs = [0, 1, 2].map(|n| [Leg::High, Leg::Low, Leg::Open][(pick / 3usize.pow(n)) % 3]);
                let e = laws.direction(x[3], 0.0);
                let mut start = Start { x, low: [0.0; 4], e, twist_rad: 0.3 * random(), intent_rad_per_s: random() };
                let circuit = if pick % 5 == 0 {
                    (start.x[0], start.x[1]) = (0.0, 0.0);
                    let begins = (legs == [Leg::Open; 3]).then_some(Change::Both(0, 1));
                    settled(&laws, legs, ([0.0; 2], [true; 3]), (e, start.turning(&laws)), begins)
                } else {
                    settled(&laws, legs, (start.current(), [false; 3]), (e, start.turning(&laws)), None)
                };
                let hold = if x[2] == 0.0 { Hold::Stuck } else { Hold::Slip(x[2].signum()) };
                let bounds = [x[0].abs() + x[1].abs(), x[2].abs(), start.twist_rad.abs(), start.intent_rad_per_s.abs()];
                let room = Room::around(&laws, bounds, [0.0, 1e-5, 1e-3][pick % 3]);
                take(&laws, &Driven { laws: &laws, circuit, hold }, &start, &room, bounds);
            }
        }
    }

    /// A series of each power leaves out less than the tolerance at the time to which the room says it is good, but not
    /// less by many orders of magnitude. The terms of all higher powers of the longest series tell how much it is.
    #[test]
    fn a_room_bounds_what_a_series_leaves_out() {
        let mut most = [0.0f64; ORDER];
        each(|laws, driven, start, room, bounds| {
            assert!(room.takes(bounds));
            let mut series = Series::new(laws);
            Series::write(&mut series, driven, start, ORDER);
            for (powers, most) in most.iter_mut().enumerate().take(ORDER - 3).skip(4) {
                let t = room.good_s[powers];
                let left = |lane: usize| {
                    (powers + 1..=ORDER).rev().fold(0.0, |sum, k| sum * t + series.x[k][lane])
                        * t.powi(powers as i32 + 1)
                };
                let scales = [1.5 * room.starts[0], 1.5 * room.starts[0], 1.5 * room.starts[1], 1.0 / 7.0];
                for (lane, scale) in scales.into_iter().enumerate() {
                    let share = left(lane).abs() / (TOLERANCE * scale);
                    assert!(share <= 1.0, "power {powers}, lane {lane}: {share}");
                    *most = most.max(share);
                }
            }
        });
        assert!(most[4..ORDER - 3].iter().all(|share| *share > 1e-8), "{most:?}");
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn series_are_the_same_bits_in_the_lanes_of_any_processor() {
        assert!(crate::flow::double::has_fused(), "this test needs a processor with AVX2 and fused multiply-add");
        each(|laws, driven, start, _, _| {
            let (mut native, mut fused) = (Series::new(laws), Series::new(laws));
            for powers in [5, ORDER] {
                Series::write(&mut fused, driven, start, powers);
                Series::write_anywhere(&mut native, driven, start, powers);
            }
            let bits = |series: &Series| {
                [series.x, series.flux, series.turned].map(|terms| terms.map(|lanes| lanes.map(f64::to_bits)))
            };
            assert_eq!(bits(&native), bits(&fused));
            assert_eq!(native.torque.map(f64::to_bits), fused.torque.map(f64::to_bits));
        });
    }
}
