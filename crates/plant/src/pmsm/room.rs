//! How long a series is good: a proved bound of what it leaves out.
//!
//! A series of power `N` leaves out, at a time `t`, by Lagrange, `t^(N+1)` times the next Taylor coefficient of the
//! motion at some moment before. A [`Room`] bounds the current, the speeds and all stretches; for as long as
//! the motion certainly stays in it, the recursion of the series over these bounds, with each sign that of the worst
//! case, bounds every coefficient of every motion in it. Numbers are not negative there, so their relative rounding is
//! below that of the operations in sequence, which [`ROUNDING`] covers.
//!
//! Left out of the proof: the rounding of the series itself and of anchors, and the truncation of energies, of `i_q`
//! between anchors and of the voltage of open terminals. A segment whose series are good for less than 1 ns lasts for
//! 1 ns, and is not covered.

use super::around::{Around, Tie};
use super::{Grip, MOST_BODIES, Pmsm};
use crate::flow::polynomial::ORDER;
use crate::network::{MOST_STOPS, Touch};

/// More than the relative rounding of the recursion below, whose results depend on less than 2^16 operations each.
const ROUNDING: f64 = 1.0 + 1.0 / (1u64 << 30) as f64;
/// The share of the bounds that a series may leave out.
const TOLERANCE: f64 = 1.0 / (1u64 << 55) as f64;

/// The bounds within which a motion starts, and what they promise.
#[derive(Clone, Debug)]
pub(super) struct Room {
    /// A segment may start up to these: size of the current, speed, the hand's stretch and the speed of its intention.
    starts: [f64; 4],
    /// The same of the speeds of the bodies beside the rotor, then of the stretches of the ties that act.
    further: Vec<f64>,
    /// Where the stops are touched.
    touches: [Touch; MOST_STOPS],
    /// The time for which a series of each power is good.
    pub good_s: [f64; ORDER + 1],
    /// Bounds of the sizes of the accelerations.
    pub accelerations: [f64; MOST_BODIES],
}

impl Room {
    /// A room in which nothing may start.
    pub const NONE: Self = Self {
        starts: [-1.0; 4],
        further: Vec::new(),
        touches: [Touch::Out; MOST_STOPS],
        good_s: [0.0; ORDER + 1],
        accelerations: [0.0; MOST_BODIES],
    };

    /// Returns whether a segment may start so.
    #[inline(always)]
    pub fn takes(&self, start: [f64; 4]) -> bool {
        start.iter().zip(&self.starts).all(|(start, most)| start <= most)
    }

    /// Returns whether a segment may start so with what is around the rotor.
    pub fn takes_around(&self, around: &Around, starts: &[f64]) -> bool {
        self.touches == around.touches && starts.iter().zip(&self.further).all(|(start, most)| start <= most)
    }

    /// Makes a room for segments that start so and are to last for a time. `further` are the speeds of the bodies
    /// beside the rotor, then the stretches of the ties that act.
    pub fn made(laws: &Pmsm, around: &Around, start: [f64; 4], further: &[f64], expected_s: f64) -> Self {
        let motor = &laws.motor;
        let [shaft, others @ ..] = &laws.net.bodies[..] else { return Self::NONE };
        let [current, speed, twist, intent] = start;
        let pairs = f64::from(motor.pole_pairs);
        let Grip { torque_nm, stiffness_nm_per_rad: pull, damping_nm_s_per_rad: resist, units, .. } = laws.pull;
        let units = units.abs();
        let (pull, resist) = (pull.abs(), resist.abs());
        let (stiffness, damping) = (units * pull, units * resist);
        let hand = torque_nm.abs() + shaft.constant.abs();
        let least = motor.direct_h.min(motor.quadrature_h);
        let salience = (motor.direct_h - motor.quadrature_h).abs();
        let inverter = &laws.inverter;
        let ohm = motor.resistance_ohm + inverter.on_resistance_ohm + inverter.supply_ohm * (2.0 / 3.0);
        // Of two terminals at one rail and one at the other.
        let volts = (2.0 / 3.0) * (inverter.supply_v + 2.0 * inverter.diode_drop_v);
        let drag = shaft.viscous + damping;
        let cogging: f64 = motor.cogging.iter().map(|harmonic| harmonic.amplitude_nm.abs()).sum();
        let constant = cogging + shaft.coulomb + hand + resist * intent;
        let inertia = shaft.inertia;
        // A time in which the motion changes little, and what it changes by then.
        let order = motor.cogging.iter().map(|harmonic| harmonic.order).fold(motor.pole_pairs, u32::max);
        let mut rate = ohm / least + drag / inertia + (stiffness / inertia).sqrt() + f64::from(order) * speed;
        let (speeds, stretches) = further.split_at(others.len());
        for tie in &around.ties {
            let per_inertia = tie.most(|body| tie.way(body) / laws.net.bodies[body].inertia);
            rate += (tie.stiffness * per_inertia).sqrt() + tie.damping * per_inertia;
        }
        let held = laws.grip;
        let (held_units, held_body) = (held.units.abs(), held.body);
        let [held_nm, held_stiffness, held_damping] =
            [held.torque_nm, held.stiffness_nm_per_rad, held.damping_nm_s_per_rad].map(|of| held_units * of.abs());
        if held_body > 0 {
            let per_inertia = held_units / laws.net.bodies[held_body].inertia;
            rate += (held_stiffness * per_inertia).sqrt() + held_damping * per_inertia;
        }
        // Bounds of the term of some power of what acts on each body beside the rotor's own torques, from those of the
        // speeds, of the stretches, and of the hand's stretch with the speed of its intention.
        let forces = |speed: &dyn Fn(usize) -> f64, stretch: &dyn Fn(usize) -> f64, hand: f64| {
            let mut forces = [0.0; MOST_BODIES];
            for (index, tie) in around.ties.iter().enumerate() {
                let force = tie.stiffness * stretch(index) + tie.damping * tie.most(speed);
                tie.ends.iter().for_each(|(body, way)| forces[*body] += way.abs() * force);
            }
            for (body, of) in others.iter().zip(1..) {
                forces[of] += body.viscous * speed(of);
            }
            if held_body > 0 {
                forces[held_body] += held_stiffness * hand + held_damping * held_units * speed(held_body);
            }
            forces
        };
        let first = |of: usize| {
            let body = &laws.net.bodies[of];
            let own = if of == held_body { held_nm + held_damping * intent } else { 0.0 };
            body.coulomb + body.constant.abs() + own
        };
        let (mut change_s, long) = ((4.0 * expected_s * (rate + 1.0)).clamp(0.25, 1.0) / (rate + 1.0), 1.5);
        let (mut starts, mut more);
        loop {
            let change = (volts + ohm * current + motor.flux_vs * pairs * speed) / least * change_s;
            let current = current + change;
            let tied = forces(&|of| if of == 0 { speed } else { speeds[of - 1] }, &|tie| stretches[tie], twist);
            let torque =
                1.5 * pairs * (motor.flux_vs + salience * current) * current + constant + drag * speed + tied[0];
            let speed = speed + torque / inertia * change_s;
            let grown = |of: usize| match of {
                0 => speed,
                _ => speeds[of - 1] + (tied[of] + first(of)) / laws.net.bodies[of].inertia * change_s,
            };
            starts = [current, speed, twist + (held_units * grown(held_body) + intent) * change_s, intent];
            let stretched = |(tie, at): (&Tie, &f64)| at + tie.most(grown) * change_s;
            let stretches = around.ties.iter().zip(stretches).map(stretched);
            more = (1..=others.len()).map(grown).chain(stretches).collect::<Vec<f64>>();
            // A rotor that may turn by more than that makes the series short; a smaller room is better.
            if f64::from(order) * speed * change_s <= 1.5 || change_s < 1e-12 {
                break;
            }
            change_s *= 0.5;
        }
        let [current, speed, twist, _] = starts.map(|bound| long * bound);
        let bounds: Vec<f64> = more.iter().map(|bound| long * bound).collect();
        let (speeds, stretches) = bounds.split_at(others.len());

        // The recursion of the series over bounds.
        let mut i = [0.0; ORDER + 2];
        let mut w = [0.0; ORDER + 2];
        let mut e = [0.0; ORDER + 2];
        let mut along = [0.0; ORDER + 2];
        let mut flux = [0.0; ORDER + 2];
        let mut waves = vec![[0.0; ORDER + 2]; motor.cogging.len()];
        let mut v = vec![[0.0; ORDER + 2]; others.len()];
        v.iter_mut().zip(speeds).for_each(|(v, speed)| v[0] = *speed);
        (i[0], w[0], e[0], along[0]) = (current, speed, 1.0, current);
        flux[0] = motor.flux_vs + salience * current;
        waves.iter_mut().for_each(|wave| wave[0] = 1.0);
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b.iter().rev()).map(|(a, b)| a * b).sum::<f64>();
        for k in 0..=ORDER {
            let share = 1.0 / (k + 1) as f64;
            e[k + 1] = pairs * share * product(&w[..=k], &e[..=k]);
            let mut torque = 1.5 * pairs * product(&flux[..=k], &i[..=k]) + drag * w[k];
            torque += match k {
                0 => pull * twist + shaft.coulomb + hand + resist * intent,
                1 => pull * (intent + units * w[0]),
                _ => stiffness * w[k - 1] / k as f64,
            };
            let speed_of = |of: usize, k: usize| if of == 0 { w[k] } else { v[of - 1][k] };
            let moved = |of: usize| speed_of(of, k.max(1) - 1) / k.max(1) as f64;
            let stretch = |tie: usize| if k == 0 { stretches[tie] } else { around.ties[tie].most(moved) };
            let stretch_of_hand = match k {
                0 => twist,
                1 => intent + held_units * moved(held_body),
                _ => held_units * moved(held_body),
            };
            let tied = forces(&|of| speed_of(of, k), &stretch, stretch_of_hand);
            torque += tied[0];
            for (v, of) in v.iter_mut().zip(1..) {
                let force = tied[of] + if k == 0 { first(of) } else { 0.0 };
                v[k + 1] = if laws.imposes(of) { 0.0 } else { force * share / laws.net.bodies[of].inertia };
            }
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
            w[k + 1] = if laws.imposes(0) { 0.0 } else { torque * share / inertia };
        }
        // The motion stays in the room for as long as its bounds allow.
        let stays = [
            (current - starts[0]) / i[1],
            (speed - starts[1]) / w[1],
            if held_stiffness > 0.0 {
                let most = if held_body == 0 { speed } else { speeds[held_body - 1] };
                (twist - starts[2]) / (held_units * most + intent)
            } else {
                f64::INFINITY
            },
        ];
        let rates = v
            .iter()
            .map(|v| v[1])
            .chain(around.ties.iter().map(|tie| tie.most(|of| if of == 0 { speed } else { speeds[of - 1] })));
        let stay = bounds.iter().zip(&more).zip(rates).map(|((bound, start), rate)| (bound - start) / rate);
        let stays_s = stays.into_iter().chain(stay).fold(f64::INFINITY, f64::min) / ROUNDING;
        let mut good_s = [0.0; ORDER + 1];
        for (n, good_s) in good_s.iter_mut().enumerate().skip(1) {
            let next = [
                i[n + 1] / current,
                w[n + 1] / speed,
                // The angle, against a turn of the rotor by 1 rad, and the rotor's direction.
                w[n] / (n + 1) as f64 * pairs,
                e[n + 1],
            ];
            // The positions of further bodies, against 1 rad or 1 m.
            let more = v.iter().zip(speeds).flat_map(|(v, speed)| [v[n + 1] / speed, v[n] / (n + 1) as f64]);
            let most = next.into_iter().chain(more).fold(0.0, f64::max) * ROUNDING;
            *good_s = (libm::pow(TOLERANCE / most, 1.0 / (n + 1) as f64) / ROUNDING).min(stays_s);
        }
        let mut accelerations = [w[1] * ROUNDING; MOST_BODIES];
        accelerations[1..].iter_mut().zip(&v).for_each(|(to, v)| *to = v[1] * ROUNDING);
        Self { starts, further: more, touches: around.touches, good_s, accelerations }
    }
}

#[cfg(test)]
mod tests {
    use super::{Around, Room, TOLERANCE};
    use crate::flow::polynomial::ORDER;
    use crate::network::{Body, Joint, Network, Stop, Touch};
    use crate::pmsm::circuit::{Change, settled};
    use crate::pmsm::series::{Driven, Hold, Series, Start};
    use crate::pmsm::{Harmonic, Inverter, Pmsm, PmsmMotor};
    use crate::{Hand, Leg, Push};

    /// Two bodies beside a rotor, of which the second one turns the other way, with a spring and a stop.
    fn bodies(hand: Hand) -> Network {
        let mut network = Network::of_rotor(hand);
        let body = Body { inertia: 4e-6, viscous: 1e-5, coulomb: 1e-4, stiction: 1e-4, ..Body::default() };
        network.bodies.extend([body, Body { inertia: 1e-6, spring: 0.1, constant: 1e-3, ..body }]);
        network.joints = vec![
            Joint { from: 0, to: 1, ratio: 0.5, compliance: Some((5.0, 1e-4)) },
            Joint { from: 1, to: 2, ratio: -3.0, compliance: Some((0.4, 0.0)) },
        ];
        network.stops = vec![Stop { body: 1, low: -0.1, high: 0.1, stiffness: 20.0, damping: 1e-3 }];
        network.grip = 2;
        network
    }

    /// Motors, hands and bodies, and starts of each with random currents, speeds and legs, with the bounds of their
    /// rooms.
    fn each(mut take: impl FnMut(&Pmsm, &Driven, &Start, (&Room, &Around), [f64; 4])) {
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
            let alone = Pmsm::new(motor.clone(), inverter, hand, 2e-8).unwrap();
            let among = Pmsm::around(motor, inverter, &bodies(hand), 2e-8).unwrap();
            for pick in 0..600 {
                let laws = if pick < 300 { &alone } else { &among };
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
                    settled(laws, legs, ([0.0; 2], [true; 3]), (e, start.turning(laws)), begins)
                } else {
                    settled(laws, legs, (start.current(), [false; 3]), (e, start.turning(laws)), None)
                };
                let mut around = Around::new(laws);
                let mut further = Vec::new();
                if pick >= 300 {
                    around.touch(laws, 0, [Touch::Out, Touch::Pressed(1)][pick % 2]);
                    for (body, hold) in around.bodies.iter_mut().zip([Hold::Slip(1.0), Hold::Stuck]) {
                        body.x = [if hold == Hold::Stuck { 0.0 } else { 300.0 * random().abs() }, random()];
                        body.hold = hold;
                        further.push(body.x[0].abs());
                    }
                    around.begin(&start);
                    further.extend(around.stretches.iter().map(|stretch| stretch.abs()));
                }
                let hold = if x[2] == 0.0 { Hold::Stuck } else { Hold::Slip(x[2].signum()) };
                let bounds = [x[0].abs() + x[1].abs(), x[2].abs(), start.twist_rad.abs(), start.intent_rad_per_s.abs()];
                let room = Room::made(laws, &around, bounds, &further, [0.0, 1e-5, 1e-3][pick % 3]);
                assert!(room.takes(bounds) && room.takes_around(&around, &further));
                take(laws, &Driven { laws, circuit, hold }, &start, (&room, &around), bounds);
            }
        }
    }

    /// A series of each power leaves out less than the tolerance at the time to which the room says it is good, but not
    /// less by many orders of magnitude. The terms of all higher powers of the longest series tell how much it is.
    #[test]
    fn a_room_bounds_what_a_series_leaves_out() {
        let mut most = [0.0f64; ORDER];
        each(|laws, driven, start, (room, around), _| {
            let mut series = Series::new(laws);
            series.around = around.clone();
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
                for (body, bound) in series.around.bodies.iter().zip(&room.further) {
                    for (lane, scale) in [1.5 * bound, 1.0].into_iter().enumerate() {
                        let left = (powers + 1..=ORDER).rev().fold(0.0, |sum, k| sum * t + body.terms[k][lane])
                            * t.powi(powers as i32 + 1);
                        assert!(left.abs() <= TOLERANCE * scale, "power {powers}, lane {lane} of a body: {left:e}");
                    }
                }
            }
        });
        assert!(most[4..ORDER - 3].iter().all(|share| *share > 1e-8), "{most:?}");
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn series_are_the_same_bits_in_the_lanes_of_any_processor() {
        assert!(crate::flow::double::has_fused(), "this test needs a processor with AVX2 and fused multiply-add");
        each(|laws, driven, start, (_, around), _| {
            let (mut native, mut fused) = (Series::new(laws), Series::new(laws));
            (native.around, fused.around) = (around.clone(), around.clone());
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
