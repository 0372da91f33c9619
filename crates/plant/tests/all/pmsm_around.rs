//! A motor of three phases with bodies, joints, stops and a hand that imposes the motion: against networks, whose modes
//! flow in closed form by other code, against closed forms, and leaps against single steps.

use std::f64::consts::{PI, TAU};

use hpu_plant::network::{Body, FeedKind, Joint, Network, NetworkDevice, NetworkLaws, Sensed, Stop};
use hpu_plant::pmsm::{Inverter, Pmsm, PmsmDevice, PmsmMotor};
use hpu_plant::{Drive, Hand, Leg, Push};

use crate::pmsm::{ANYWHERE, BARE, EDGE_S, balanced, short_circuit};
use crate::pmsm_motion::{INVERTER, PERIOD, drives, plain, rough};
use crate::random::Random;

/// A motor without magnets: nothing but what is around it moves it.
fn dead() -> PmsmMotor {
    PmsmMotor { flux_vs: 0.0, ..plain() }
}

/// A network of a rotor and up to three further bodies on compliant and rigid joints, with stops and friction, where
/// the hand holds any of them.
fn network(random: &mut Random) -> Network {
    let further = random.below(4) as usize;
    let hand = match random.below(3) {
        0 => Hand::Torque(random.between(-5e-3, 5e-3)),
        1 => Hand::Spring(Push {
            stiffness_nm_per_rad: random.between(0.05, 0.5),
            damping_nm_s_per_rad: random.between(0.0, 1e-3),
        }),
        _ => Hand::Prescribed,
    };
    let mut network = Network::of_rotor(hand);
    network.bodies[0].speed = random.between(-20.0, 20.0);
    for from in 0..further {
        let rough = network.bodies.iter().filter(|body| body.coulomb > 0.0).count() < 2 && random.below(3) == 0;
        let coulomb = if rough { random.between(1e-4, 2e-3) } else { 0.0 };
        network.bodies.push(Body {
            inertia: random.between(2e-6, 4e-5),
            viscous: random.between(0.0, 5e-5),
            coulomb,
            stiction: 1.5 * coulomb,
            spring: if random.below(3) == 0 { random.between(0.01, 0.1) } else { 0.0 },
            constant: if random.below(3) == 0 { random.between(-1e-3, 1e-3) } else { 0.0 },
            position: 0.0,
            speed: random.between(-10.0, 10.0),
        });
        let is_rigid = random.below(4) == 0;
        let compliance = (!is_rigid).then(|| (random.between(0.2, 20.0), random.between(0.0, 2e-3)));
        let ratio = [1.0, -1.0, 0.25, 3.0][random.below(4) as usize];
        let from = if random.below(2) == 0 { 0 } else { from };
        network.joints.push(Joint { from, to: network.bodies.len() - 1, ratio, compliance });
    }
    network.grip = random.below(network.bodies.len() as u64) as usize;
    for _ in 0..random.below(3) {
        let body = random.below(network.bodies.len() as u64) as usize;
        if network.stops.iter().all(|stop| stop.body != body) {
            network.stops.push(Stop {
                body,
                low: random.between(-0.02, -0.001),
                high: random.between(0.001, 0.02),
                stiffness: random.between(0.5, 50.0),
                damping: if random.below(2) == 0 { 0.0 } else { random.between(1e-5, 5e-3) },
            });
        }
    }
    network.sensed = (0..network.bodies.len()).map(|body| Sensed { body, lag_rad_per_s: None }).collect();
    network
}

/// The same bodies with a current in the place of the motor.
fn without_motor(network: &Network, motor: &PmsmMotor) -> Network {
    let mut linear = network.clone();
    linear.bodies[0].inertia += motor.inertia_kg_m2;
    linear.bodies[0].viscous += motor.viscous_nm_s_per_rad;
    linear.bodies[0].coulomb += motor.coulomb_nm;
    linear.bodies[0].stiction += motor.stiction_nm;
    linear.feed.kind = FeedKind::Current { bandwidth_rad_per_s: f64::INFINITY, supply_v: f64::INFINITY };
    linear.feed.torque_constant = 1.0;
    linear
}

/// Without magnets the rotor and all around it are a linear network, whose modes flow in closed form: positions and
/// speeds are the same, and as many modes change.
fn moves_as_a_network(seed: u64, cases: u64) -> [u64; 2] {
    let mut random = Random(seed);
    let (mut changes, mut compared) = (0, 0);
    for case in 0..cases {
        let network = network(&mut random);
        let dead = PmsmMotor { coulomb_nm: 5e-4 * (case % 2) as f64, stiction_nm: 8e-4 * (case % 2) as f64, ..dead() };
        let linear = without_motor(&network, &dead);
        let Ok(reduced) = linear.reduced() else { continue };
        let at_once = NetworkLaws::<12>::new(reduced, EDGE_S, 1 << 19);
        let laws = Pmsm::around(dead, INVERTER, &network, EDGE_S).unwrap();
        let mut exact = NetworkDevice::new(&at_once, 0.0);
        let start = network.bodies[0];
        let mut device = PmsmDevice::new(&laws, [0.0; 2], start.speed, start.position);
        let mut edge = 0;
        let mut target = 0.0;
        for knot in 0..8u64 {
            let speed = random.between(-8.0, 8.0);
            exact.intend(edge, target, speed);
            device.intend(edge, target, speed);
            let to = edge + 100_000 + random.below(200_000);
            target += speed * (to - edge) as f64 * EDGE_S;
            while let Some(event) = exact.next_event(edge, to, ANYWHERE) {
                edge = event.0;
                exact.arrive(event);
            }
            exact.step(to);
            device.step(to);
            edge = to;
            let most = 1e-11 * (1.0 + knot as f64);
            for sensor in 0..network.bodies.len() {
                let (got, expected) = (device.reading_of(sensor, to), exact.reading(sensor, to));
                assert!(
                    (got - expected).abs() <= most,
                    "case {case}, knot {knot}, {sensor}: {got} {expected} {network:?}"
                );
                compared += 1;
            }
            let ([_, speed, ..], [_, expected, ..]) = (device.state(to), exact.state(to));
            assert!((speed - expected).abs() <= 1e3 * most, "case {case}, knot {knot}: {speed} {expected} {network:?}");
            let (felt, expected) = (device.felt(to), exact.felt(to));
            assert!((felt[0] - expected[0]).abs() <= most, "case {case}, knot {knot}");
            assert!((felt[1] - expected[1]).abs() <= 1e2 * most, "case {case}: {felt:?} {expected:?} {network:?}");
            let (energy, known) = (device.energy(to), exact.energy(to));
            let most = 1e-11 * known.exchanged_j();
            for (got, expected) in [
                (energy.hand_j(), known.hand_j()),
                (energy.viscous_j(), known.viscous_j()),
                (energy.coulomb_j(), known.coulomb_j()),
                (device.stored_j(to), exact.stored_j(to)),
            ] {
                assert!((got - expected).abs() <= most, "case {case}, knot {knot}: {got:e} {expected:e} {network:?}");
            }
        }
        assert_eq!(device.mode_changes(), exact.mode_changes(), "case {case}: {network:?}");
        changes += device.mode_changes();
    }
    println!("{compared} positions, {changes} modes");
    [compared, changes]
}

#[test]
fn without_magnets_all_moves_as_a_network() {
    let [compared, changes] = moves_as_a_network(66, 14);
    assert!(compared > 200 && changes > 100);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn without_magnets_all_moves_as_a_network_for_long() {
    let [compared, changes] = moves_as_a_network(67, 400);
    assert!(compared > 5000 && changes > 3000);
}

/// A rotor that runs into a stop without a damper turns back after half a period of rotor and stop, as fast as it came.
/// With a damper it leaves when the force is 0, and the stop takes what is left in its spring.
#[test]
fn a_stop_gives_back_what_its_damper_leaves() {
    let (inertia, stiffness, speed, end) = (4e-6, 2.0, 15.0, 0.1);
    for damping in [0.0, 4e-4, 2e-3] {
        let free = PmsmMotor { viscous_nm_s_per_rad: 0.0, ..dead() };
        let mut network = Network::of_rotor(Hand::Torque(0.0));
        network.stops = vec![Stop { body: 0, low: -1.0, high: end, stiffness, damping }];
        let edge_s = 1e-12;
        let laws = Pmsm::around(free, INVERTER, &network, edge_s).unwrap();
        let mut device = PmsmDevice::new(&laws, [0.0; 2], speed, 0.0);
        // y'' + 2 decay y' + natural² y = 0 from 0 with this speed; the force k y + c y' is 0 at `left_s`.
        let (decay, natural) = (0.5 * damping / inertia, (stiffness / inertia).sqrt());
        let frequency = (natural * natural - decay * decay).sqrt();
        let y = |t: f64| speed / frequency * (-decay * t).exp() * (frequency * t).sin();
        let rate =
            |t: f64| speed * (-decay * t).exp() * ((frequency * t).cos() - decay / frequency * (frequency * t).sin());
        // tan(frequency t) = -c frequency / (k - c decay), in the second quadrant.
        let left_s = (PI - (damping * frequency / (stiffness - damping * decay)).atan()) / frequency;
        let touched_s = end / speed;
        let mut edges = Vec::new();
        let (mut edge, to) = (0, ((touched_s + 3.0 * left_s) / edge_s) as u64);
        let mut modes = device.mode_changes();
        while let Some(event) = device.next_event(edge, to, ANYWHERE) {
            edge = event;
            device.step(edge);
            if std::mem::replace(&mut modes, device.mode_changes()) != modes {
                edges.push(edge);
            }
        }
        device.step(to);
        let expected: &[f64] = &[touched_s, touched_s + left_s];
        for (got, expected) in edges.iter().zip(expected) {
            let off_s = *got as f64 * edge_s - expected;
            assert!((0.0..2e-12).contains(&(off_s + 0.5e-12)), "{damping}: {off_s:e}");
        }
        assert_eq!(edges.len(), if damping == 0.0 { 2 } else { 3 });
        let (depth, speed_then) = (y(left_s), rate(left_s));
        assert!((device.state(to)[1] - speed_then).abs() < 1e-12 * speed, "{damping}");
        let lost = 0.5 * inertia * (speed * speed - speed_then * speed_then);
        assert!(damping > 0.0 || depth.abs() < 1e-12);
        assert!((device.energy(to).viscous_j() - lost).abs() < 1e-13 * lost.max(1e-4), "{damping}");
        assert!((device.stored_j(to) + lost).abs() < 1e-15);
    }
}

/// A hand that imposes a constant speed on a rotor whose winding is a short circuit bears friction and the motor's
/// torque, and its work is what becomes heat.
#[test]
fn a_hand_that_imposes_a_speed_bears_the_torque() {
    for (d, q) in [(0.4e-3, 0.4e-3), (0.3e-3, 0.5e-3)] {
        let motor = PmsmMotor { direct_h: d, quadrature_h: q, coulomb_nm: 1e-3, stiction_nm: 2e-3, ..plain() };
        let (psi, speed) = (motor.flux_vs, 90.0);
        let bare = Inverter { diode_drop_v: 0.7, ..BARE };
        let laws = Pmsm::new(motor.clone(), bare, Hand::Prescribed, EDGE_S).unwrap();
        let mut device = PmsmDevice::new(&laws, [1.0, -2.0], speed, 0.3);
        device.driven(0, Drive::Legs([Leg::Low; 3]));
        device.intend(0, 0.3, speed);
        for edge in [1u64, 1000, 20_000, 200_000] {
            device.step(edge);
            let t = edge as f64 * EDGE_S;
            let expected = short_circuit(&motor, 7.0 * speed, [1.0, -2.0], t);
            let got = device.dq(edge);
            assert!(
                (got[0] - expected[0]).abs() < 1e-12 && (got[1] - expected[1]).abs() < 1e-12,
                "{got:?} {expected:?}"
            );
            let [_, at, angle, _] = device.state(edge);
            assert_eq!(at, speed);
            assert!((angle - (0.3 + speed * t)).abs() < 1e-14);
            let torque = 10.5 * (psi + (d - q) * expected[0]) * expected[1];
            let [_, felt] = device.felt(edge);
            assert!((felt - (1e-3 + 1e-5 * speed - torque)).abs() < 1e-13, "{felt:e}");
            let energy = device.energy(edge);
            let rest = energy.supplied_j() - energy.dissipated_j() - device.stored_j(edge);
            // What is stored at the start, 0.0162 J, has its own rounding.
            let most = 1e-13 * energy.exchanged_j() + 4.0 * f64::EPSILON * 0.0162;
            assert!(rest.abs() <= most, "{rest:e} of {:e}", energy.exchanged_j());
        }
    }
}

/// Encoders on the rotor and on the last body beside it.
struct Counted<'a> {
    device: PmsmDevice<'a>,
    counts: [i64; 2],
    last: usize,
    seen: Vec<(u64, [i64; 2], [u64; 4])>,
}

impl<'a> Counted<'a> {
    fn new(laws: &'a Pmsm, network: &Network, speed: f64) -> Self {
        let mut device = PmsmDevice::new(laws, [0.5, -0.5], speed, 1e-5);
        let last = network.bodies.len() - 1;
        let counts = [0, (device.reading_of(last, 0) / COUNT_RAD).floor() as i64];
        device.watch(last, band(counts[1]));
        Self { device, counts, last, seen: Vec::new() }
    }

    fn look(&mut self, edge: u64, x: [f64; 4]) {
        let before = self.counts;
        self.counts[0] += i64::from(self.device.side_of_band(edge, x[2], band(self.counts[0])));
        let side = self.device.side_of_reading(self.last, edge, band(self.counts[1]));
        if side != 0 {
            self.counts[1] += i64::from(side);
            self.device.watch(self.last, band(self.counts[1]));
        }
        if before != self.counts {
            self.seen.push((edge, self.counts, x.map(f64::to_bits)));
        }
    }

    fn leap(&mut self, mut edge: u64, to: u64) {
        while let Some(event) = self.device.next_event(edge, to, band(self.counts[0])) {
            edge = event;
            let x = self.device.step(edge);
            self.look(edge, x);
        }
    }
}

const COUNT_RAD: f64 = TAU / 65_536.0;

fn band(count: i64) -> (f64, f64) {
    (count as f64 * COUNT_RAD, (count + 1) as f64 * COUNT_RAD)
}

/// Runs random motors with all that can be around them for some periods of 20 kHz each, by leaps and edge by edge.
/// Returns the edges, the counts seen and the changes of modes.
fn leaps_are_steps(seed: u64, cases: u64, periods: u64) -> [u64; 3] {
    let (mut random, mut told) = (Random(seed), [0; 3]);
    for case in 0..cases {
        let network = network(&mut random);
        let motor = if case % 2 == 0 { rough() } else { plain() };
        let Ok(laws) = Pmsm::around(motor, INVERTER, &network, EDGE_S) else { continue };
        let mut leaping = Counted::new(&laws, &network, network.bodies[0].speed);
        let mut stepping = Counted::new(&laws, &network, network.bodies[0].speed);
        let drives = drives(&mut random, periods);
        let (mut edge, mut target) = (0, 1e-5);
        for (index, &(at, drive)) in drives.iter().chain([&(periods * PERIOD, Drive::Legs([Leg::Open; 3]))]).enumerate()
        {
            leaping.leap(edge, at);
            leaping.device.step(at);
            for edge in edge + 1..=at {
                let x = stepping.device.step(edge);
                stepping.look(edge, x);
            }
            assert_eq!(leaping.seen, stepping.seen, "case {case}, {at}: {network:?}");
            let states = [&leaping, &stepping].map(|it| {
                let states = (it.device.state(at), it.device.felt(at), it.device.reading_of(it.last, at));
                (states.0.map(f64::to_bits), states.1.map(f64::to_bits), states.2.to_bits())
            });
            assert_eq!(states[0], states[1], "case {case}, {at}: {network:?}");
            assert_eq!(leaping.device.energy(at), stepping.device.energy(at), "case {case}, {at}");
            let knot = (index % 40 == 0).then(|| random.between(-20.0, 20.0));
            for it in [&mut leaping, &mut stepping] {
                it.device.driven(at, drive);
                if let Some(speed) = knot {
                    it.device.intend(at, target, speed);
                }
            }
            if let Some(speed) = knot {
                // The motion that is imposed goes on from where it is.
                let next = drives.get(40 * (index / 40 + 1)).map_or(at, |(next, _)| *next);
                target += speed * (next - at) as f64 * EDGE_S;
            }
            edge = at;
        }
        let device = &leaping.device;
        balanced(device, edge, 1e-12);
        assert_eq!(device.crowded_edges(), 0);
        told = [told[0] + edge, told[1] + leaping.seen.len() as u64, told[2] + device.mode_changes()];
    }
    println!("{told:?} edges, counts, changes of modes");
    told
}

#[test]
fn random_motors_with_bodies_and_stops_leap_as_they_step() {
    let [edges, counts, modes] = leaps_are_steps(1, 45, 10);
    assert!(edges >= 1_000_000 && counts > 1000 && modes > 250);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn random_motors_with_bodies_and_stops_leap_as_they_step_for_long() {
    let [edges, ..] = leaps_are_steps(2, 1000, 40);
    assert!(edges >= 90_000_000);
}

#[test]
fn a_network_that_no_motor_can_drive_is_refused() {
    let body = Body { inertia: 1e-5, ..Body::default() };
    let refused = |change: &dyn Fn(&mut Network)| {
        let mut network = Network::of_rotor(Hand::Torque(0.0));
        network.bodies.push(body);
        network.joints.push(Joint { from: 0, to: 1, ratio: 1.0, compliance: Some((1.0, 0.0)) });
        change(&mut network);
        Pmsm::around(plain(), INVERTER, &network, EDGE_S).unwrap_err().to_string()
    };
    assert!(refused(&|it| it.seen = 1).contains("drives the body with the encoder"));
    assert!(refused(&|it| it.joints.clear()).contains("nothing joins it"));
    assert!(refused(&|it| it.bodies[1].inertia = 0.0).contains("no positive inertia"));
    assert!(refused(&|it| it.bodies[1].speed = f64::NAN).contains("not finite"));
    let many = |it: &mut Network| {
        for from in 1..5 {
            it.bodies.push(body);
            it.joints.push(Joint { from, to: from + 1, ratio: 1.0, compliance: Some((1.0, 0.0)) });
        }
    };
    assert!(refused(&many).contains("14 states"));
}

/// On a held rotor a phase's current rises by one exponential, and the lag of a shunt behind it by two: closed forms of
/// corners slower than the winding, equal to it but for 1 %, and much faster. The low side sees no current while its
/// switch is open, and its lag falls by one exponential.
#[test]
fn the_lag_of_a_shunt_is_that_of_the_current_behind_it() {
    let held = PmsmMotor { stiction_nm: 1e3, ..plain() };
    let bare = Inverter { diode_drop_v: 0.7, ..BARE };
    let laws = Pmsm::new(held, bare, Hand::Torque(0.0), EDGE_S).unwrap();
    let rate = 0.8 / 0.4e-3;
    for corner in [200.0, 1.01 * rate, 3e4, 1e6, 3e8] {
        let mut device = PmsmDevice::new(&laws, [0.0; 2], 0.0, 0.3);
        let (in_line, low) = (device.lag(0, false, corner), device.lag(1, true, corner));
        let on = Drive::Legs([Leg::High, Leg::Low, Leg::Low]);
        device.driven(0, on);
        let last = 24.0 / 1.5 / 0.8;
        let current = |t: f64| last * -(-rate * t).exp_m1();
        // y' = c (i - y), i = last (1 - exp(-r t)).
        let lagged =
            |t: f64| last * (1.0 - (corner * (-rate * t).exp() - rate * (-corner * t).exp()) / (corner - rate));
        for edge in [1, 10, 500, 12_000, 60_000] {
            device.step(edge);
            let t = edge as f64 * EDGE_S;
            let most = 1e-12 * last;
            assert!((device.phases(edge)[0] - current(t)).abs() < most);
            let got = device.lagged(in_line, edge);
            assert!((got - lagged(t)).abs() < most, "{corner}, {edge}: {got} {}", lagged(t));
            assert!((device.lagged(low, edge) + 0.5 * lagged(t)).abs() < most, "{corner}, {edge}");
        }
        // All three high: the currents go on, and the shunt of b sees none.
        let from = 60_000;
        let before = device.lagged(low, from);
        device.driven(from, Drive::Legs([Leg::High; 3]));
        for edge in [from + 1, from + 700, from + 30_000] {
            let t = (edge - from) as f64 * EDGE_S;
            let expected = before * (-corner * t).exp();
            assert!((device.lagged(low, edge) - expected).abs() < 1e-13 * last, "{corner}, {edge}");
            let then = current(from as f64 * EDGE_S) * (-rate * t).exp();
            assert!((device.phases(edge)[0] - then).abs() < 1e-12 * last);
        }
        assert_eq!(device.lagged(low, 90_000).to_bits(), {
            let mut stepped = PmsmDevice::new(&laws, [0.0; 2], 0.0, 0.3);
            let low = stepped.lag(1, true, corner);
            stepped.driven(0, on);
            (1..=from).for_each(|edge| _ = stepped.step(edge));
            stepped.driven(from, Drive::Legs([Leg::High; 3]));
            (from + 1..=90_000).for_each(|edge| _ = stepped.step(edge));
            stepped.lagged(low, 90_000).to_bits()
        });
    }
}

/// A knob on a joint that is stiffer and stiffer turns with the rotor as one on a rigid joint: what is left falls as
/// the joint's compliance.
#[test]
fn a_stiff_joint_is_nearly_a_rigid_one() {
    let turned = |compliance: Option<(f64, f64)>| {
        let mut network = Network::of_rotor(Hand::Torque(5e-3));
        network.bodies.push(Body { inertia: 8e-6, viscous: 2e-5, ..Body::default() });
        network.joints.push(Joint { from: 0, to: 1, ratio: -0.5, compliance });
        network.grip = 1;
        network.sensed = vec![Sensed { body: 1, lag_rad_per_s: None }];
        // Friction would turn back at other instants, which differ by the period of the joint.
        let smooth = PmsmMotor { coulomb_nm: 0.0, stiction_nm: 0.0, ..rough() };
        let laws = Pmsm::around(smooth, INVERTER, &network, EDGE_S).unwrap();
        let mut device = PmsmDevice::new(&laws, [0.0; 2], 0.0, 0.0);
        let mut edge = 0;
        for (to, drive) in drives(&mut Random(5), 60) {
            device.step(to);
            device.driven(to, drive);
            edge = to;
        }
        (device.state(edge)[2], device.reading_of(0, edge))
    };
    let (angle, knob) = turned(None);
    assert!((knob + 0.5 * angle).abs() < 1e-15 && angle.abs() > 1e-3, "{angle} {knob}");
    // The torque in the joint is below 0.1 N·m.
    for stiffness in [1e3, 1e4, 1e5, 1e6f64] {
        // Both bodies on the joint alone, with critical damping.
        let inertia = 1.0 / (0.25 / 4e-6 + 1.0 / 8e-6);
        let (angle_there, knob_there) = turned(Some((stiffness, 2.0 * (stiffness * inertia).sqrt())));
        let off = (angle_there - angle).abs() + (knob_there - knob).abs();
        assert!(off <= 0.1 / stiffness, "{stiffness}: {off:e}");
    }
}
