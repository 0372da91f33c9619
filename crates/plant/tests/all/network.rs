//! Networks against known answers: closed forms, small steps and mpmath, computed outside of this crate.

use std::f64::consts::PI;

use hpu_plant::network::{
    Body, Count, Feed, FeedKind, Joint, Network, NetworkDevice, NetworkLaws, Place, Reduced, Size, Stop,
};
use hpu_plant::{Bridge, Drive, Gates, Hand, Push};

use crate::random::Random;

const EDGE_S: f64 = 20e-9;
const ANYWHERE: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

fn ideal(torque_constant: f64) -> Feed {
    let kind = FeedKind::Current { bandwidth_rad_per_s: f64::INFINITY, supply_v: f64::INFINITY };
    Feed { torque_constant, resistance_ohm: 0.0, inductance_h: 0.0, kind }
}

fn body(inertia: f64) -> Body {
    Body { inertia, ..Body::default() }
}

fn network(bodies: Vec<Body>, joints: Vec<Joint>) -> Network {
    let (feed, hand) = (ideal(1.0), Hand::Torque(0.0));
    Network { bodies, joints, stops: Vec::new(), feed, driven: 0, seen: 0, grip: 0, hand, sensed: Vec::new() }
}

fn reduced(network: &Network) -> Reduced {
    network.reduced().unwrap()
}

/// Flows to an edge, and tells the edges at which modes changed.
fn flow<const N: usize>(device: &mut NetworkDevice<N>, from: u64, to: u64) -> Vec<u64>
where
    Count<N>: Size<N>,
{
    let (mut edge, mut changes) = (from, Vec::new());
    while let Some(event) = device.next_event(edge, to, ANYWHERE) {
        (edge, _) = event;
        let before = device.mode_changes();
        device.arrive(event);
        if device.mode_changes() != before {
            changes.push(edge);
        }
    }
    changes
}

#[track_caller]
fn close(got: f64, expected: f64, relative: f64) {
    assert!((got - expected).abs() <= relative * expected.abs(), "got {got:?}, expected {expected:?}");
}

/// Compares all states in double-double with numbers of mpmath at 80 digits, as the nearest `f64` and the rest.
fn exact<const N: usize>(device: &NetworkDevice<N>, edge: u64, expected: &[(f64, f64)])
where
    Count<N>: Size<N>,
{
    let (hi, lo) = device.exact_states(edge);
    let most = expected.iter().fold(0.0, |most: f64, it| most.max(it.0.abs()));
    for (k, (high, low)) in expected.iter().enumerate() {
        let off = (hi[k] - high) + (lo[k] - low);
        assert!(off.abs() <= 1e-28 * most, "edge {edge}, state {k}: off by {off:e}");
    }
}

fn knob(handle_kg: f64) -> Network {
    let (stiffness, ratio) = (20e3, 0.06 / 10.0);
    let together = 1.0 / (ratio * ratio / 5e-6 + 1.0 / handle_kg);
    let damping = 2.0 * 0.02 * f64::sqrt(stiffness * together);
    let joint = Joint { from: 0, to: 1, ratio, compliance: Some((stiffness, damping)) };
    network(vec![body(5e-6), body(handle_kg)], vec![joint])
}

/// The known answer K2 of the design: six states, by a matrix exponential in 40 digits, and the same by mpmath from the
/// `f64` of this test.
#[test]
fn a_knob_in_six_states_flows_to_twenty_eight_digits() {
    let mut knob = knob(0.03);
    (knob.bodies[0].speed, knob.bodies[0].position) = (1.5, 0.3);
    (knob.bodies[1].speed, knob.bodies[1].position) = (0.009, 0.0018);
    knob.feed.kind = FeedKind::Current { bandwidth_rad_per_s: 2.0 * PI * 2000.0, supply_v: f64::INFINITY };
    knob.grip = 1;
    knob.hand = Hand::Spring(Push { stiffness_nm_per_rad: 500.0, damping_nm_s_per_rad: 5.0 });
    let laws = NetworkLaws::<8>::new(reduced(&knob), EDGE_S, 1 << 27);
    let mut device = NetworkDevice::new(&laws, 0.01);
    device.intend(0, 0.004, 0.05);
    device.driven(0, Drive::Current(0.02));
    for (edges, angle) in [
        (12345, 0.300_465_235_511_185),
        (250_000, 0.361_151_893_035_323_7),
        (1_000_000, 1.047_765_299_122_161_4),
        (50_000_000, 10.138_888_845_430_735),
    ] {
        close(device.exact_state(edges)[2], angle, 5e-16);
        close(device.state(edges)[2], angle, 5e-15);
    }
    // Current, speed, angle, intention; then speed and position of the handle.
    exact(
        &device,
        12345,
        &[
            (0.01955069431577324, -1.6604006283763325e-18),
            (2.337909314296633, -2.881006094286693e-17),
            (0.3004652355111849, 1.998258096029179e-17),
            (0.0040123450000000005, -4.1025638879316914e-19),
            (0.019477437583232195, 1.6889128505017447e-19),
            (0.0018035270008517725, -1.0027766903253624e-19),
        ],
    );
    exact(
        &device,
        1_000_000,
        &[
            (0.02, 0.0),
            (61.78507049973441, -3.520135912164061e-15),
            (1.0477652991221613, 3.893725504312121e-17),
            (0.005, 5.561703034966462e-20),
            (0.3605697091264347, -8.414454686602552e-18),
            (0.006165452750212216, -2.7826765765539614e-19),
        ],
    );
    let (energy, stored) = (device.energy(1_000_000), device.stored_j(1_000_000));
    let residual = energy.supplied_j() - energy.dissipated_j() - stored;
    assert!(residual.abs() <= 1e-12 * energy.exchanged_j(), "{residual:e} of {:e}", energy.exchanged_j());
}

/// The table of leaps has two digits of 7 bits up to 16383 edges, and a search looks further than it is asked.
#[test]
fn a_search_at_the_end_of_a_run_looks_beyond_it() {
    let mut knob = knob(0.03);
    knob.bodies[0].speed = 1.5;
    for horizon in [127, 16383] {
        let laws = NetworkLaws::<8>::new(reduced(&knob), EDGE_S, horizon);
        let mut device = NetworkDevice::new(&laws, 0.0);
        for edge in 1..=horizon {
            assert_eq!(device.next_event(edge - 1, edge, ANYWHERE), None);
        }
    }
}

/// A loop of the current with its integral, and a hand with a mass: nine states, by mpmath.
#[test]
fn a_paddle_in_nine_states_flows_to_twenty_eight_digits() {
    let (resistance_ohm, inductance_h) = (10.0, 1e-3);
    let kind = FeedKind::Pi {
        proportional_ohm: inductance_h * 2.0 * PI * 500.0,
        integral_ohm_per_s: resistance_ohm * 2.0 * PI * 500.0,
        feeds_forward: false,
        supply_v: f64::INFINITY,
    };
    let joint = |from, to, ratio, stiffness, damping| Joint { from, to, ratio, compliance: Some((stiffness, damping)) };
    let paddle = Network {
        bodies: vec![
            Body { speed: 3.0, position: 0.15, ..body(1.4e-6) },
            Body { position: 0.02, ..body(4e-4) },
            body(8e-3),
        ],
        joints: vec![joint(0, 1, 1.0 / 15.0, 60.0, 5e-3), joint(1, 2, 1.0, 5.0, 0.05)],
        feed: Feed { torque_constant: 0.03, resistance_ohm, inductance_h, kind },
        grip: 2,
        hand: Hand::Spring(Push { stiffness_nm_per_rad: 1.0, damping_nm_s_per_rad: 0.05 }),
        ..network(Vec::new(), Vec::new())
    };
    let laws = NetworkLaws::<12>::new(reduced(&paddle), EDGE_S, 1 << 27);
    let mut device = NetworkDevice::new(&laws, 0.0);
    device.intend(0, 0.1, 0.5);
    device.driven(0, Drive::Current(0.4));
    exact(
        &device,
        12345,
        &[
            (0.2002375046049422, 2.836563077505011e-19),
            (10.569511199035682, -3.5479009788152797e-16),
            (0.15165705346337513, -4.161041241445632e-18),
            (0.10012345, 2.829477164356038e-18),
            (-0.42101572423257316, 1.8743663434901095e-17),
            (0.019947567722619002, -1.0944549233695165e-18),
            (0.006605139722735584, -1.5765231714675075e-19),
            (8.292869513673642e-07, -1.0451518936360284e-23),
            (7.085254102899585e-05, -4.302579597035975e-23),
        ],
    );
    exact(
        &device,
        1_000_000,
        &[
            (0.3954859255109793, -1.9919812332330186e-17),
            (-2.0558715052462544, 1.0028183583385191e-16),
            (0.5581429991528557, 1.3362967579096513e-17),
            (0.11, 5.205229219114489e-18),
            (2.33038120831709, -1.2726767433626505e-16),
            (0.03678895416298929, -2.6699313530128232e-18),
            (0.6258180784394667, 5.506787495910498e-17),
            (0.005559594500656094, -4.311260023653148e-19),
            (0.00012323948780363064, -6.045792519886289e-21),
        ],
    );
}

fn pair(coulomb: [f64; 2], stiction: [f64; 2]) -> Network {
    let body = |k: usize, inertia| Body { coulomb: coulomb[k], stiction: stiction[k], ..body(inertia) };
    let joint = Joint { from: 0, to: 1, ratio: 1.0, compliance: Some((0.72, 3.5e-5)) };
    network(vec![body(0, 5e-6), body(1, 1.08e-6)], vec![joint])
}

/// The known answer K3: two bodies that turn, stick and slip by friction of their own, by a search in 40 digits.
#[test]
fn two_bodies_with_friction_turn_and_stick_at_their_instants() {
    let mut pair = pair([3e-3, 1e-3], [3e-3, 1e-3]);
    (pair.bodies[0].speed, pair.bodies[1].speed) = (20.0, -15.0);
    let edge_s = 1e-9;
    let laws = NetworkLaws::<8>::new(reduced(&pair), edge_s, 1 << 28);
    let mut device = NetworkDevice::new(&laws, 0.0);
    let changes = flow(&mut device, 0, (0.05 / edge_s) as u64);
    let expected = [
        0.001116802778301643,
        0.005679287047161605,
        0.008139919864030383,
        0.01258370024413564,
        0.01521915175697237,
        0.01941692183754004,
        0.02240997947827199,
        0.02348202476829984,
        0.02460834768035406,
        0.02490508210485999,
        0.02628681173398991,
        0.02935312344692719,
        0.02974131760342956,
        0.03177922282250188,
        0.03352170383800749,
        0.0373701112315471,
    ];
    assert_eq!(changes.len(), expected.len(), "{changes:?}");
    for (change, expected) in changes.iter().zip(expected) {
        let at_s = *change as f64 * edge_s;
        assert!(at_s >= expected && at_s <= expected + edge_s, "{at_s:?}, expected {expected:?}");
    }
    let rest = device.states((0.05 / edge_s) as u64);
    close(rest[2], 0.1798628400786524, 1e-14);
    close(rest[5], 0.1800848439552123, 1e-14);
}

/// The known answer K4: a body is pulled loose by a spring against its stiction. The angles at 30 ms are those of a
/// matrix exponential in 40 digits; the known answer's own are 25.21 ms after the body has let go.
#[test]
fn a_body_lets_go_at_its_stiction() {
    let laws = NetworkLaws::<8>::new(reduced(&pair([3e-3, 1e-3], [3.5e-3, 1.5e-3])), 1e-9, 1 << 28);
    let mut device = NetworkDevice::new(&laws, 0.0);
    device.driven(0, Drive::Current(4.2e-3));
    let changes = flow(&mut device, 0, 30_000_000);
    assert_eq!(changes[0], 4_792_668);
    let x = device.states(30_000_000);
    close(x[2], 0.02479617195800597, 1e-14);
    close(x[5], 0.023912395211183105, 1e-14);
    let later = device.states(30_002_667);
    close(later[2] + 0.498235016e-9 * later[1], 0.02479967925123, 1e-12);
    close(later[5] + 0.498235016e-9 * later[4], 0.0239160566309, 1e-12);
}

/// The known answer K5: a mass between undamped stops.
#[test]
fn a_button_bounces_between_its_stops() {
    let spring = 1450.831846960136;
    let mass = Body { spring, speed: 0.6, ..body(1.2e-3) };
    let mut button = network(vec![mass], Vec::new());
    button.stops = vec![Stop { body: 0, low: -0.4e-3, high: 0.4e-3, stiffness: 20e3, damping: 0.0 }];
    let laws = NetworkLaws::<8>::new(reduced(&button), 1e-9, 1 << 28);
    let mut device = NetworkDevice::new(&laws, 0.0);
    let changes = flow(&mut device, 0, 1_400_000);
    assert_eq!(changes, [748_282, 1_362_067]);
    // The hundredth crossing of 0 is 0.443 edges before this edge.
    let mut device = NetworkDevice::new(&laws, 0.0);
    flow(&mut device, 0, 211_034_806);
    close(device.state(211_034_806)[2], 0.6 * 0.4372568e-9, 1e-5);
    let middle = ((0.7482811541361788e-3 + 1.362066901491253e-3) / 2e-9) as u64;
    let mut device = NetworkDevice::new(&laws, 0.0);
    flow(&mut device, 0, middle);
    close(device.state(middle)[2], 0.4731924402639614e-3, 1e-10);
}

/// Two bodies come to rest within one clock cycle, whichever of them is first: each at `v^2 / (2 a)`, where friction
/// alone slows it down by `a` and then holds it.
#[test]
fn of_two_ends_within_an_edge_the_sooner_is_followed_first() {
    let (inertia, coulomb) = ([5e-6, 1.08e-6], [3e-3, 1e-3]);
    for rests_s in [[0.3e-3, 0.7e-3], [0.7e-3, 0.3e-3]] {
        let mut pair = pair(coulomb, coulomb);
        pair.joints[0].compliance = Some((0.0, 0.0));
        let slows = [0, 1].map(|k| coulomb[k] / inertia[k]);
        (0..2).for_each(|k| pair.bodies[k].speed = slows[k] * rests_s[k]);
        let laws = NetworkLaws::<8>::new(reduced(&pair), 1e-3, 1 << 10);
        let mut device = NetworkDevice::new(&laws, 0.0);
        assert_eq!((flow(&mut device, 0, 5), device.mode_changes()), (vec![1], 2));
        let rest = device.states(5);
        assert_eq!((rest[1], rest[4]), (0.0, 0.0));
        close(rest[2], slows[0] * rests_s[0] * rests_s[0] / 2.0, 1e-14);
        close(rest[5], slows[1] * rests_s[1] * rests_s[1] / 2.0, 1e-14);
    }
}

/// A hand whose intention jumps pulls a body loose and lets it go within the same clock cycle, as it moves back: with
/// `A = p - c / k` and `w^2 = k / J` the body comes to rest after `2 / w atan(A w / v)`.
#[test]
fn a_hand_that_jumps_and_moves_back_pulls_a_body_loose_at_once() {
    let (inertia, friction, stiffness, jump, back) = (5e-6, 3e-3, 0.05, 0.1, 100.0);
    let hand = Hand::Spring(Push { stiffness_nm_per_rad: stiffness, damping_nm_s_per_rad: 0.0 });
    let rubs = Body { coulomb: friction, stiction: friction, ..body(inertia) };
    let net = Network { hand, ..network(vec![rubs], Vec::new()) };
    let laws = NetworkLaws::<4>::new(reduced(&net), 1e-3, 1 << 10);
    let mut device = NetworkDevice::new(&laws, 0.0);
    device.intend(0, jump, -back);
    flow(&mut device, 0, 1);
    let (rest, w) = (jump - friction / stiffness, f64::sqrt(stiffness / inertia));
    let turned = 2.0 * (rest * w / back).atan();
    let [_, speed, angle, _] = device.state(1);
    assert_eq!(speed, 0.0);
    close(angle, rest * (1.0 - turned.cos()) - back / w * (turned - turned.sin()), 1e-10);
}

/// A body that leaves its stop faster than the stop follows, and is pushed back before it is out: the stop presses it
/// again. By small steps of `J x'' = T - max(0, k d + c v)` beyond the stop.
#[test]
fn a_lifted_body_is_pressed_again() {
    let (inertia, high, stiffness, damping) = (1e-5, 0.01, 10.0, 0.02);
    let mass = Body { speed: 5.0, position: 0.0095, ..body(inertia) };
    let mut net = network(vec![mass], Vec::new());
    net.stops = vec![Stop { body: 0, low: -0.01, high, stiffness, damping }];
    let laws = NetworkLaws::<4>::new(reduced(&net), EDGE_S, 1 << 20);
    let mut device = NetworkDevice::new(&laws, 0.0);
    let (pushed, end) = (125_000, 200_000);
    // Touches the stop, and leaves it.
    assert_eq!(flow(&mut device, 0, pushed).len(), 2);
    device.driven(pushed, Drive::Current(0.1));
    assert_eq!(flow(&mut device, pushed, end).len(), 1);
    let (mut speed, mut angle, step_s) = (5.0, 0.0095, EDGE_S / 2.0);
    for step in 0..2 * end {
        let torque = if step < 2 * pushed { 0.0 } else { 0.1 };
        let stop: f64 = if angle > high { stiffness * (angle - high) + damping * speed } else { 0.0 };
        speed += (torque - stop.max(0.0)) / inertia * step_s;
        angle += speed * step_s;
    }
    let [_, found, place, _] = device.state(end);
    close(place - high, angle - high, 1e-3);
    close(found, speed, 1e-3);
}

fn held(integral: Option<f64>) -> Network {
    let (supply_v, bandwidth_rad_per_s) = (24.0, 2.0 * PI * 2000.0);
    let kind = match integral {
        None => FeedKind::Current { bandwidth_rad_per_s, supply_v },
        Some(times) => FeedKind::Pi {
            proportional_ohm: 0.2e-3 * bandwidth_rad_per_s,
            integral_ohm_per_s: times * 1.1 * bandwidth_rad_per_s,
            feeds_forward: false,
            supply_v,
        },
    };
    let feed = Feed { torque_constant: 0.02, resistance_ohm: 1.1, inductance_h: 0.2e-3, kind };
    // A hand that prescribes rest holds the rotor.
    Network { feed, hand: Hand::Prescribed, ..network(vec![body(1e-5)], Vec::new()) }
}

/// A hand that prescribes the angle of a body jumps to another angle and speed: it gives what its body's inertia and
/// springs then hold more, `J v^2 / 2 + (k + K) d^2 / 2`.
#[test]
fn a_hand_that_jumps_loads_the_springs_of_its_body() {
    let mut net = Network { hand: Hand::Prescribed, ..pair([0.0; 2], [0.0; 2]) };
    net.bodies[0].spring = 0.1;
    let laws = NetworkLaws::<8>::new(reduced(&net), EDGE_S, 1 << 20);
    let mut device = NetworkDevice::new(&laws, 0.0);
    device.intend(0, 0.02, 3.0);
    close(device.energy(0).hand_j(), 0.5 * 5e-6 * 9.0 + 0.5 * (0.72 + 0.1) * 4e-4, 1e-14);
    // Half a millisecond later it jumps back.
    device.intend(25_000, 0.0, 0.0);
    let (energy, stored) = (device.energy(100_000), device.stored_j(100_000));
    let residual = energy.supplied_j() - energy.dissipated_j() - stored;
    assert!(residual.abs() <= 1e-12 * energy.exchanged_j(), "{residual:e} of {:e}", energy.exchanged_j());
}

/// The known answer K6: a current asked for at once, first at the limit of the supply, then by the loop.
#[test]
fn a_step_of_the_current_is_limited_by_the_supply() {
    const EDGE_S: f64 = 1e-9;
    let at = |net: &Network, edges: &[u64]| -> (u64, Vec<f64>) {
        let laws = NetworkLaws::<8>::new(reduced(net), EDGE_S, 1 << 28);
        let mut device = NetworkDevice::new(&laws, 0.0);
        device.driven(0, Drive::Current(12.0));
        let mut values = Vec::new();
        let (mut from, mut left) = (0, 0);
        for &to in edges {
            left = flow(&mut device, from, to).first().copied().unwrap_or(left);
            values.push(device.exact_state(to)[0]);
            from = to;
        }
        (left, values)
    };
    for net in [held(None), held(Some(1.0))] {
        let (left, values) = at(&net, &[250_000]);
        assert_eq!(left, 40_515);
        close(values[0], 11.450547960818, 1e-12);
    }
    let (left, values) = at(&held(Some(2.0)), &[100_000, 250_000, 500_000]);
    assert_eq!(left, 88_042);
    for (value, expected) in values.iter().zip([9.2003634671191, 12.900209910026, 12.093161139448]) {
        close(*value, expected, 1e-12);
    }
}

/// A loop of the current that is slower than the winding asks for `I (R + (L w - R) exp(-w t))`, which grows to the
/// supply's limit, the upper or the lower one; from then on the winding alone decides.
#[test]
fn a_slow_loop_comes_to_either_limit_of_the_supply() {
    const EDGE_S: f64 = 1e-7;
    let (reference_a, supply_v, resistance_ohm, inductance_h, bandwidth_rad_per_s) = (12.0, 6.0, 1.1, 0.2e-3, 1e3);
    let current = FeedKind::Current { bandwidth_rad_per_s, supply_v };
    // Its zero is the pole of the winding, so that the current is the same.
    let pi = FeedKind::Pi {
        proportional_ohm: inductance_h * bandwidth_rad_per_s,
        integral_ohm_per_s: resistance_ohm * bandwidth_rad_per_s,
        feeds_forward: false,
        supply_v,
    };
    let (asked_ohm, limit_a) = (inductance_h * bandwidth_rad_per_s, supply_v / resistance_ohm);
    let left = (resistance_ohm - supply_v / reference_a) / (resistance_ohm - asked_ohm);
    let (at_s, at_a) = (-left.ln() / bandwidth_rad_per_s, reference_a * (1.0 - left));
    for (kind, sign) in [(current, 1.0), (current, -1.0), (pi, 1.0), (pi, -1.0)] {
        let mut net = held(None);
        net.feed.kind = kind;
        let laws = NetworkLaws::<8>::new(reduced(&net), EDGE_S, 1 << 20);
        let mut device = NetworkDevice::new(&laws, 0.0);
        device.driven(0, Drive::Current(sign * reference_a));
        assert_eq!(flow(&mut device, 0, 20_000), [(at_s / EDGE_S).ceil() as u64]);
        for edge in [5_000, 10_000, 20_000] {
            let decay = ((at_s - edge as f64 * EDGE_S) * resistance_ohm / inductance_h).exp();
            close(device.state(edge)[0], sign * (limit_a + (at_a - limit_a) * decay), 1e-12);
        }
    }
}

/// Random networks: the same bits whether each edge is visited or leapt to, and energies that add up.
#[test]
fn random_networks_are_the_same_by_events_and_edge_by_edge() {
    let mut changes = 0;
    for seed in 0..8 {
        changes += if seed % 3 == 0 { compare::<12>(seed) } else { compare::<8>(seed) };
    }
    assert!(changes > 40, "{changes}");
}

/// Runs one of them both ways, and returns how often its mode changed.
fn compare<const N: usize>(seed: u64) -> u64
where
    Count<N>: Size<N>,
{
    let mut random = Random(seed + 1);
    let mut number = |least: f64, most: f64| least * (most / least).powf(random.next());
    let count = N / 4;
    let bodies = (0..count)
        .map(|_| Body {
            inertia: number(1e-6, 1e-5),
            viscous: number(1e-7, 1e-4),
            coulomb: number(1e-4, 2e-3),
            stiction: number(2e-3, 3e-3),
            spring: number(1e-3, 1e-1),
            constant: number(1e-4, 1e-3),
            speed: number(1.0, 30.0),
            position: 0.0,
        })
        .collect();
    let joints = (1..count)
        .map(|to| {
            let compliance = Some((number(0.5, 20.0), number(1e-5, 1e-4)));
            Joint { from: to - 1, to, ratio: number(0.5, 2.0), compliance }
        })
        .collect();
    let stop = |body, damping| Stop { body, low: -0.02, high: 0.015, stiffness: 10.0, damping };
    let winding = |kind| Feed { torque_constant: 0.03, resistance_ohm: 2.0, inductance_h: 0.3e-3, kind };
    let feed = winding(match seed % 4 {
        0 | 1 => {
            FeedKind::Bridge(Bridge { supply_v: 12.0, on_resistance_ohm: 0.1, diode_drop_v: 0.7, dead_band_v: 0.0 })
        }
        2 => FeedKind::Current { bandwidth_rad_per_s: number(3e3, 2e4), supply_v: 3.0 },
        _ => FeedKind::Pi {
            proportional_ohm: number(0.5, 3.0),
            integral_ohm_per_s: number(1e3, 2e4),
            feeds_forward: seed % 8 == 3,
            supply_v: 3.0,
        },
    });
    let stops = vec![stop(0, 0.0), stop(count - 1, 2e-3)];
    let hand = Hand::Spring(Push { stiffness_nm_per_rad: 0.05, damping_nm_s_per_rad: 1e-4 });
    let net = Network { stops, feed, hand, grip: count - 1, ..network(bodies, joints) };
    let laws = NetworkLaws::<N>::new(reduced(&net), 1e-6, 1 << 10);
    let [mut leaping, mut stepping] = [0, 1].map(|_| NetworkDevice::new(&laws, 0.0));
    for device in [&mut leaping, &mut stepping] {
        device.intend(0, 0.0, 0.4);
    }
    let drive = |part: u64| match net.feed.kind {
        FeedKind::Bridge(_) => {
            // A leg to the supply, to ground, or off.
            let (a, b) = (part % 3, part / 3 % 3);
            Drive::Gates(Gates { a_high: a == 1, a_low: a == 2, b_high: b == 1, b_low: b == 2 })
        }
        _ => Drive::Current([0.3, -0.5, 0.0, 1.5][part as usize % 4]),
    };
    let mut edge = 0;
    for part in 0..20 {
        leaping.driven(edge, drive(part));
        stepping.driven(edge, drive(part));
        let to = edge + 200;
        flow(&mut leaping, edge, to);
        (edge + 1..=to).for_each(|edge| {
            stepping.step(edge);
        });
        edge = to;
        let bits = [&leaping, &stepping].map(|device| device.states(edge).map(f64::to_bits));
        assert_eq!(bits[0], bits[1], "seed {seed}, edge {edge}");
    }
    assert_eq!(leaping.mode_changes(), stepping.mode_changes(), "seed {seed}");
    for device in [&leaping, &stepping] {
        let (energy, stored) = (device.energy(edge), device.stored_j(edge));
        let residual = energy.supplied_j() - energy.dissipated_j() - stored;
        assert!(residual.abs() <= 1e-12 * energy.exchanged_j(), "seed {seed}: {residual:e} of {energy:?}");
    }
    leaping.mode_changes()
}

#[test]
fn a_rigid_joint_leaves_one_body() {
    let mut knob = knob(0.03);
    knob.joints[0].compliance = None;
    let net = reduced(&knob);
    assert_eq!(net.size(), 4);
    close(knob.seen_rigidly()[0], 5e-6 + 0.03 * 0.006 * 0.006, 1e-15);
}

#[test]
fn networks_that_are_none_are_refused_at_their_part() {
    let rigid = |from, to| Joint { from, to, ratio: 1.0, compliance: None };
    let bodies = |count: usize| vec![body(1e-5); count];
    let place = |network: &Network| network.reduced().unwrap_err().place;
    let refused = |bodies, joints| place(&network(bodies, joints));
    let cycle = refused(bodies(3), vec![rigid(0, 1), rigid(1, 2), rigid(2, 0)]);
    assert!(matches!(cycle, Place::Joint(_)), "{cycle:?}");
    assert_eq!(refused(bodies(3), vec![rigid(0, 1)]), Place::Body(2));
    let springs = (1..6).map(|to| Joint { compliance: Some((1.0, 0.0)), ..rigid(to - 1, to) }).collect();
    assert_eq!(refused(bodies(6), springs), Place::Device);
}

/// Where a network rests, and how far its drive moves it from there: springs in series and beside each other.
#[test]
fn a_network_rests_where_its_springs_balance() {
    let (way, joint, hand, spring, place) = (0.25, 60.0, 3.0, 2.0, 0.4);
    let pair = |seen: usize, spring: f64, hand: Hand| {
        let knob = Body { spring, constant: 0.1 * spring, ..body(2e-5) };
        let joint = Joint { from: 0, to: 1, ratio: way, compliance: Some((joint, 1e-3)) };
        let network = Network { seen, grip: 1, hand, ..network(vec![body(1e-6), knob], vec![joint]) };
        reduced(&network).rest(place)
    };
    let grip = Hand::Spring(Push { stiffness_nm_per_rad: hand, damping_nm_s_per_rad: 0.1 });
    let series = |a: f64, b: f64| a * b / (a + b);
    for spring in [0.0, spring] {
        let held = hand + spring;
        let at_knob = (hand * place + 0.1 * spring) / held;
        // At the rotor, behind the joint; at the knob the drive's force passes the joint whole.
        let [found, compliance] = pair(0, spring, grip).expect("it is held");
        close(found, at_knob / way, 1e-13);
        close(compliance, 1.0 / (way * way * series(joint, held)), 1e-13);
        let [found, compliance] = pair(1, spring, grip).expect("it is held");
        close(found, at_knob, 1e-13);
        close(compliance, 1.0 / held, 1e-13);
    }
    let [found, compliance] = pair(0, spring, Hand::Torque(0.5)).expect("its own spring holds it");
    close(found, (0.5 / spring + 0.1) / way, 1e-13);
    close(compliance, 1.0 / (way * way * series(joint, spring)), 1e-13);
    assert_eq!(pair(0, 0.0, Hand::Torque(0.5)), None);
    assert_eq!(pair(1, 0.0, Hand::Torque(0.0)), None);
    assert_eq!(pair(0, spring, Hand::Prescribed), None);
}

/// Two bodies drift and swing against each other for a second without a drive, a hand or any damping. Every count comes
/// at its edge by the closed form, and next to none is too near to an edge for `f64` to tell: bounds that grow with
/// the time since the start would leave every decision to double-double, at the price of an edge each.
#[test]
fn bodies_that_swing_freely_are_looked_at_seldom() {
    let (inertias, stiffness, starts) = ([5e-6, 2e-6], 1.5, [2.0, -1.0]);
    let mut bodies = inertias.map(body).to_vec();
    (bodies[0].speed, bodies[1].speed) = (starts[0], starts[1]);
    let joint = Joint { from: 0, to: 1, ratio: 1.0, compliance: Some((stiffness, 0.0)) };
    let net = network(bodies, vec![joint]);
    let edges = 50_000_000;
    let laws = NetworkLaws::<8>::new(reduced(&net), EDGE_S, edges);
    let mut device = NetworkDevice::new(&laws, 0.0);
    let [first, second] = inertias;
    let mean = (first * starts[0] + second * starts[1]) / (first + second);
    let omega = (stiffness * (first + second) / (first * second)).sqrt();
    let swing = second / (first + second) * (starts[0] - starts[1]) / omega;
    let angle = |edge: u64| {
        let t = edge as f64 * EDGE_S;
        mean * t + swing * (omega * t).sin()
    };
    let count = 1e-3;
    let (mut edge, mut at, mut counts) = (0, 0.0, 0);
    while let Some(event) = device.next_event(edge, edges, (at * count, (at + 1.0) * count)) {
        edge = event.0;
        device.arrive(event);
        let now = (angle(edge) / count).floor();
        if now != at {
            let before = angle(edge - 1) / count;
            assert!(before > at - 1e-6 && before < at + 1.0 + 1e-6, "edge {edge}: {before} after {at}");
            (at, counts) = (now, counts + 1);
        }
    }
    close(device.state(edges)[2], angle(edges), 1e-12);
    assert!(counts > 1000 && device.redecided() < 10, "{counts} counts, {} decided again", device.redecided());
}

/// A body slips toward where its spring and its friction balance, ever slower, and never stops: its speed falls by
/// 10^13 in each second. Whether it still moves is told by `f64` all the same.
#[test]
fn a_body_that_creeps_to_its_rest_is_looked_at_seldom() {
    let slips = Body {
        coulomb: 1e-4,
        stiction: 1.5e-4,
        speed: -1.0,
        position: 0.1,
        viscous: 1e-3,
        spring: 0.033,
        ..body(1e-6)
    };
    let net = network(vec![slips, body(1e-6)], vec![Joint { from: 0, to: 1, ratio: 1.0, compliance: None }]);
    let edges = 100_000_000;
    let laws = NetworkLaws::<8>::new(reduced(&net), EDGE_S, edges);
    let mut device = NetworkDevice::new(&laws, 0.0);
    flow(&mut device, 0, edges);
    // 2e-6 kg.m2 on 1e-3 N.m.s/rad and 0.033 N.m/rad: poles at -35.5 and -464.5 /s, so after 2 s nothing is left.
    close(device.state(edges)[2], 1e-4 / 0.033, 1e-12);
    assert_eq!(device.mode_changes(), 0);
    assert!(device.redecided() < 10, "{} decided again", device.redecided());
}
