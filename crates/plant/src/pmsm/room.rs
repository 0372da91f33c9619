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
        let Some(sizes) = Sizes::new(laws, around) else { return Self::NONE };
        let (rate, [.., intent]) = (sizes.rate(start[1]), start);
        let mut change_s = (4.0 * expected_s * (rate + 1.0)).clamp(0.25, 1.0) / (rate + 1.0);
        let (starts, more) = loop {
            let grown = sizes.grown(start, further, change_s);
            // A rotor that may turn by more than that makes the series short; a smaller room is better.
            if sizes.order * grown.0[1] * change_s <= 1.5 || change_s < 1e-12 {
                break grown;
            }
            change_s *= 0.5;
        };
        // The room is half as large again as the starts that it takes.
        let [current, speed, twist, _] = starts.map(|bound| 1.5 * bound);
        let bounds: Vec<f64> = more.iter().map(|bound| 1.5 * bound).collect();
        let (speeds, stretches) = bounds.split_at(sizes.others());
        let terms = sizes.terms([current, speed, twist, intent], speeds, stretches);

        // The motion stays in the room for as long as its bounds allow.
        let held = &sizes.held;
        let speed_of = |of: usize| if of == 0 { speed } else { speeds[of - 1] };
        let stays = [
            (current - starts[0]) / terms.i[1],
            (speed - starts[1]) / terms.w[1],
            if held.stiffness > 0.0 {
                (twist - starts[2]) / (held.units * speed_of(held.body) + intent)
            } else {
                f64::INFINITY
            },
        ];
        let rates = terms.v.iter().map(|v| v[1]).chain(around.ties.iter().map(|tie| tie.most(speed_of)));
        let stay = bounds.iter().zip(&more).zip(rates).map(|((bound, start), rate)| (bound - start) / rate);
        let stays_s = stays.into_iter().chain(stay).fold(f64::INFINITY, f64::min) / ROUNDING;
        let mut accelerations = [terms.w[1] * ROUNDING; MOST_BODIES];
        accelerations[1..].iter_mut().zip(&terms.v).for_each(|(to, v)| *to = v[1] * ROUNDING);
        let good_s = terms.good_s([current, speed], speeds, sizes.pairs, stays_s);
        Self { starts, further: more, touches: around.touches, good_s, accelerations }
    }
}

/// The hand at its body: sizes of its effort, of its spring and of its damper there, and of its ratio.
struct Held {
    body: usize,
    units: f64,
    nm: f64,
    stiffness: f64,
    damping: f64,
}

/// The numbers of a device that bound its motion, none of them negative.
struct Sizes<'l> {
    laws: &'l Pmsm,
    around: &'l Around,
    pairs: f64,
    /// The highest order of what turns with the rotor.
    order: f64,
    /// The smaller inductance, and the difference of both.
    least_h: f64,
    salience_h: f64,
    ohm: f64,
    volts: f64,
    /// The rotor's spring and damper by the hand: for its stretch, and for its own turn.
    pull: f64,
    resist: f64,
    units: f64,
    stiffness: f64,
    drag: f64,
    /// Constant torques of the hand and at the rotor.
    hand: f64,
    held: Held,
}

impl<'l> Sizes<'l> {
    /// Returns the numbers of a device; none without a rotor.
    fn new(laws: &'l Pmsm, around: &'l Around) -> Option<Self> {
        let (motor, inverter, shaft) = (&laws.motor, &laws.inverter, laws.net.bodies.first()?);
        let Grip { torque_nm, stiffness_nm_per_rad: pull, damping_nm_s_per_rad: resist, units, .. } = laws.pull;
        let units = units.abs();
        let (pull, resist) = (pull.abs(), resist.abs());
        let held_units = laws.grip.units.abs();
        let [nm, stiffness, damping] =
            [laws.grip.torque_nm, laws.grip.stiffness_nm_per_rad, laws.grip.damping_nm_s_per_rad]
                .map(|of| held_units * of.abs());
        Some(Self {
            laws,
            around,
            pairs: f64::from(motor.pole_pairs),
            order: f64::from(motor.cogging.iter().map(|harmonic| harmonic.order).fold(motor.pole_pairs, u32::max)),
            least_h: motor.direct_h.min(motor.quadrature_h),
            salience_h: (motor.direct_h - motor.quadrature_h).abs(),
            ohm: motor.resistance_ohm + inverter.on_resistance_ohm + inverter.supply_ohm * (2.0 / 3.0),
            // Of two terminals at one rail and one at the other.
            volts: (2.0 / 3.0) * (inverter.supply_v + 2.0 * inverter.diode_drop_v),
            pull,
            resist,
            units,
            stiffness: units * pull,
            drag: shaft.viscous + units * resist,
            hand: torque_nm.abs() + shaft.constant.abs(),
            held: Held { body: laws.grip.body, units: held_units, nm, stiffness, damping },
        })
    }

    /// Returns the number of bodies beside the rotor.
    fn others(&self) -> usize {
        self.laws.net.bodies.len() - 1
    }

    /// Returns a rate, in 1/s, within whose inverse the motion changes little.
    fn rate(&self, speed: f64) -> f64 {
        let bodies = &self.laws.net.bodies;
        let inertia = bodies[0].inertia;
        let mut rate =
            self.ohm / self.least_h + self.drag / inertia + (self.stiffness / inertia).sqrt() + self.order * speed;
        for tie in &self.around.ties {
            let per_inertia = tie.most(|body| tie.way(body) / bodies[body].inertia);
            rate += (tie.stiffness * per_inertia).sqrt() + tie.damping * per_inertia;
        }
        let held = &self.held;
        if held.body > 0 {
            let per_inertia = held.units / bodies[held.body].inertia;
            rate += (held.stiffness * per_inertia).sqrt() + held.damping * per_inertia;
        }
        rate
    }

    /// Returns bounds of the term of some power of what acts on each body beside the rotor's own torques, from those of
    /// the speeds, of the stretches, and of the hand's stretch with the speed of its intention.
    fn forces(&self, speed: impl Fn(usize) -> f64, stretch: impl Fn(usize) -> f64, hand: f64) -> [f64; MOST_BODIES] {
        let mut forces = [0.0; MOST_BODIES];
        for (index, tie) in self.around.ties.iter().enumerate() {
            let force = tie.stiffness * stretch(index) + tie.damping * tie.most(&speed);
            tie.ends.iter().for_each(|(body, way)| forces[*body] += way.abs() * force);
        }
        for (of, body) in self.laws.net.bodies.iter().enumerate().skip(1) {
            forces[of] += body.viscous * speed(of);
        }
        let held = &self.held;
        if held.body > 0 {
            forces[held.body] += held.stiffness * hand + held.damping * held.units * speed(held.body);
        }
        forces
    }

    /// Returns the constant part of what acts on a body beside the rotor.
    fn first(&self, of: usize, intent: f64) -> f64 {
        let body = &self.laws.net.bodies[of];
        let own = if of == self.held.body { self.held.nm + self.held.damping * intent } else { 0.0 };
        body.coulomb + body.constant.abs() + own
    }

    /// Returns what the bounds of a start grow to in a time: its four, then those of the bodies and ties.
    fn grown(&self, [current, speed, twist, intent]: [f64; 4], further: &[f64], change_s: f64) -> ([f64; 4], Vec<f64>) {
        let (motor, bodies) = (&self.laws.motor, &self.laws.net.bodies);
        let (speeds, stretches) = further.split_at(self.others());
        let cogging: f64 = motor.cogging.iter().map(|harmonic| harmonic.amplitude_nm.abs()).sum();
        let constant = cogging + bodies[0].coulomb + self.hand + self.resist * intent;
        let change = (self.volts + self.ohm * current + motor.flux_vs * self.pairs * speed) / self.least_h * change_s;
        let current = current + change;
        let tied = self.forces(|of| if of == 0 { speed } else { speeds[of - 1] }, |tie| stretches[tie], twist);
        let flux = motor.flux_vs + self.salience_h * current;
        let torque = 1.5 * self.pairs * flux * current + constant + self.drag * speed + tied[0];
        let speed = speed + torque / bodies[0].inertia * change_s;
        let body = |of: usize| match of {
            0 => speed,
            _ => speeds[of - 1] + (tied[of] + self.first(of, intent)) / bodies[of].inertia * change_s,
        };
        let twist = twist + (self.held.units * body(self.held.body) + intent) * change_s;
        let stretched = |(tie, at): (&Tie, &f64)| at + tie.most(body) * change_s;
        let stretches = self.around.ties.iter().zip(stretches).map(stretched);
        let more = (1..=self.others()).map(body).chain(stretches).collect();
        ([current, speed, twist, intent], more)
    }

    /// Runs the recursion of the series over the bounds of a room.
    fn terms(&self, [current, speed, twist, intent]: [f64; 4], speeds: &[f64], stretches: &[f64]) -> Terms {
        let (motor, bodies, pairs) = (&self.laws.motor, &self.laws.net.bodies, self.pairs);
        let mut along = [0.0; ORDER + 2];
        let mut flux = [0.0; ORDER + 2];
        let mut waves = vec![[0.0; ORDER + 2]; motor.cogging.len()];
        let mut terms = Terms::new(current, speed, speeds);
        along[0] = current;
        flux[0] = motor.flux_vs + self.salience_h * current;
        waves.iter_mut().for_each(|wave| wave[0] = 1.0);
        for k in 0..=ORDER {
            let share = 1.0 / (k + 1) as f64;
            terms.e[k + 1] = pairs * share * product(&terms.w[..=k], &terms.e[..=k]);
            let mut torque = 1.5 * pairs * product(&flux[..=k], &terms.i[..=k]) + self.drag * terms.w[k];
            torque += match k {
                0 => self.pull * twist + bodies[0].coulomb + self.hand + self.resist * intent,
                1 => self.pull * (intent + self.units * terms.w[0]),
                _ => self.stiffness * terms.w[k - 1] / k as f64,
            };
            let tied = self.forces_of_power(k, &terms, [twist, intent], stretches);
            torque += tied[0];
            for (v, of) in terms.v.iter_mut().zip(1..) {
                let force = tied[of] + if k == 0 { self.first(of, intent) } else { 0.0 };
                v[k + 1] = if self.laws.imposes(of) { 0.0 } else { force * share / bodies[of].inertia };
            }
            for (wave, harmonic) in waves.iter_mut().zip(&motor.cogging) {
                torque += harmonic.amplitude_nm.abs() * wave[k];
                wave[k + 1] = f64::from(harmonic.order) * share * product(&terms.w[..=k], &wave[..=k]);
            }
            let given = if k == 0 { self.volts } else { 0.0 };
            let known = product(&terms.e[1..=k + 1], &terms.i[..=k]);
            // With both terms of the flux linkage along the rotor that do not need the next current.
            let active = motor.flux_vs + self.salience_h * along[0];
            let bent = active * terms.e[k + 1] + self.salience_h * (product(&along[1..=k], &terms.e[1..=k]) + known);
            terms.i[k + 1] = ((given + self.ohm * terms.i[k]) * share + bent) / self.least_h;
            along[k + 1] = known + terms.i[k + 1];
            flux[k + 1] = bent + self.salience_h * terms.i[k + 1];
            terms.w[k + 1] = if self.laws.imposes(0) { 0.0 } else { torque * share / bodies[0].inertia };
        }
        terms
    }

    /// Returns the bounds of [`forces`](Self::forces) of a power, from the terms up to it.
    fn forces_of_power(
        &self,
        k: usize,
        terms: &Terms,
        [twist, intent]: [f64; 2],
        stretches: &[f64],
    ) -> [f64; MOST_BODIES] {
        let moved = |of: usize| terms.speed(of, k.max(1) - 1) / k.max(1) as f64;
        let stretch = |tie: usize| if k == 0 { stretches[tie] } else { self.around.ties[tie].most(moved) };
        let hand = match k {
            0 => twist,
            1 => intent + self.held.units * moved(self.held.body),
            _ => self.held.units * moved(self.held.body),
        };
        self.forces(|of| terms.speed(of, k), stretch, hand)
    }
}

/// Returns the term of the product of two series.
fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b.iter().rev()).map(|(a, b)| a * b).sum()
}

/// Bounds of the Taylor terms of every motion in a room.
struct Terms {
    /// The current.
    i: [f64; ORDER + 2],
    /// The rotor's speed.
    w: [f64; ORDER + 2],
    /// The rotor's direction.
    e: [f64; ORDER + 2],
    /// The speeds of the bodies beside the rotor.
    v: Vec<[f64; ORDER + 2]>,
}

impl Terms {
    /// Returns the first terms.
    fn new(current: f64, speed: f64, speeds: &[f64]) -> Self {
        let of = |first: f64| {
            let mut terms = [0.0; ORDER + 2];
            terms[0] = first;
            terms
        };
        Self { i: of(current), w: of(speed), e: of(1.0), v: speeds.iter().map(|speed| of(*speed)).collect() }
    }

    fn speed(&self, of: usize, k: usize) -> f64 {
        if of == 0 { self.w[k] } else { self.v[of - 1][k] }
    }

    /// Returns the time for which a series of each power is good, at most so long.
    fn good_s(&self, [current, speed]: [f64; 2], speeds: &[f64], pairs: f64, most_s: f64) -> [f64; ORDER + 1] {
        let mut good_s = [0.0; ORDER + 1];
        for (n, good_s) in good_s.iter_mut().enumerate().skip(1) {
            let next = [
                self.i[n + 1] / current,
                self.w[n + 1] / speed,
                // The angle, against a turn of the rotor by 1 rad, and the rotor's direction.
                self.w[n] / (n + 1) as f64 * pairs,
                self.e[n + 1],
            ];
            // The positions of further bodies, against 1 rad or 1 m.
            let more = self.v.iter().zip(speeds).flat_map(|(v, speed)| [v[n + 1] / speed, v[n] / (n + 1) as f64]);
            let most = next.into_iter().chain(more).fold(0.0, f64::max) * ROUNDING;
            *good_s = (libm::pow(TOLERANCE / most, 1.0 / (n + 1) as f64) / ROUNDING).min(most_s);
        }
        good_s
    }
}

#[cfg(test)]
mod tests {
    use super::{Around, Room, TOLERANCE};
    use crate::energy::Energy;
    use crate::flow::polynomial::ORDER;
    use crate::network::{Body, Joint, Network, Stop, Touch};
    use crate::pmsm::circuit::{Change, settled};
    use crate::pmsm::energy::Passed;
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
                let mut audits = [Energy::default(); 2];
                let passed = [
                    Passed::take(&mut audits[0], driven, start, &fused, 1e-6),
                    Passed::take_anywhere(&mut audits[1], driven, start, &native, 1e-6),
                ];
                assert_eq!(audits[0], audits[1]);
                let [one, other] =
                    passed.map(|it| [it.states, it.end.0, it.end.1].map(|lanes| lanes.map(f64::to_bits)));
                assert_eq!(one, other);
            }
            let bits = |series: &Series| {
                [series.x, series.flux, series.turned].map(|terms| terms.map(|lanes| lanes.map(f64::to_bits)))
            };
            assert_eq!(bits(&native), bits(&fused));
            assert_eq!(native.torque.map(f64::to_bits), fused.torque.map(f64::to_bits));
        });
    }
}
