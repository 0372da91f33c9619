//! The searches for the next event against every edge. A single function moves as a polynomial of the edge that grazes
//! its limits, and is decided in integers; a device is stepped edge by edge.

use hpu_plant::{
    Axis, Band, Bridge, Device, Drive, Gates, Guard, Hand, Linear, MotionPoint, Motor, Push, State, Trajectory,
};

use crate::random::Random;

/// Edges a motion lasts.
const EDGES: u64 = 1000;
/// An edge lasts this many seconds, a power of two.
const EDGE_S: f64 = 1.0 / 1_048_576.0;

/// A polynomial of the edge, by its coefficients.
#[derive(Clone, Debug)]
struct Polynomial(Vec<i128>);

impl Polynomial {
    fn times(&self, factor: &[i128]) -> Self {
        let mut product = vec![0; self.0.len() + factor.len() - 1];
        for (i, x) in self.0.iter().enumerate() {
            for (j, y) in factor.iter().enumerate() {
                product[i + j] += x * y;
            }
        }
        Self(product)
    }

    fn at(&self, edge: u64) -> i128 {
        self.0.iter().rev().fold(0, |sum, coefficient| sum * i128::from(edge) + coefficient)
    }

    /// Returns start and drive of four integrators in a row whose last state is this polynomial plus `base`.
    fn integrated(&self, base: f64) -> (State, State) {
        let mut derivatives = [0.0; 5];
        let mut factorial = 1;
        for (k, &coefficient) in self.0.iter().enumerate() {
            factorial *= k.max(1) as i128;
            let exact = (coefficient * factorial) as f64;
            assert!(exact as i128 == coefficient * factorial);
            derivatives[k] = exact * EDGE_S.powi(-(k as i32));
        }
        let [value, first, second, third, fourth] = derivatives;
        let start = base + value;
        assert!((start - base) as i128 == self.0[0], "the start is exact");
        ([second, first, start, third], [0.0, 0.0, 0.0, fourth])
    }
}

/// Four integrators in a row: from the last state to the first, the second, the third.
fn integrators() -> Linear {
    let a = [[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0; 4]];
    Linear::new(a, EDGE_S, 1 << 20)
}

/// Returns a polynomial of at most this degree whose values at edges are odd: a product of roots between two edges, and
/// of parabolas that come near to zero and turn.
fn grazing(random: &mut Random, degree: u64) -> Polynomial {
    let odd = |random: &mut Random| 2 * random.below(EDGES + 200) as i128 - 199;
    let mut polynomial = Polynomial(vec![if random.below(2) == 0 { 1 } else { -1 }]);
    let degree = 1 + random.below(degree) as usize;
    while polynomial.0.len() <= degree {
        let k = odd(random);
        match random.below(3) {
            // A pair of roots with few edges in between.
            0 if polynomial.0.len() < degree => {
                let gap = 2 * [1, 1, 2, 3, 10, 100][random.below(6) as usize];
                polynomial = polynomial.times(&[-k, 2]).times(&[-k - gap, 2]);
            }
            // No root, but nearly one.
            1 if polynomial.0.len() < degree => {
                let above = 2 * [1, 2, 30, 1000, 100_000][random.below(5) as usize];
                polynomial = polynomial.times(&[k * k + above, -4 * k, 4]);
            }
            _ => polynomial = polynomial.times(&[-k, 2]),
        }
    }
    polynomial
}

/// Searches a motion that follows a polynomial plus `base` for its first exit from a band, from one edge on, and
/// compares it with every edge. Limits are multiples of `unit`. Returns whether there is an exit; `None` without a
/// search, if the motion does not begin inside or a value is a limit's and the engine's values are not `exact`.
#[track_caller]
fn search(
    random: &mut Random,
    (guard, motion): (&Guard, &Trajectory),
    polynomial: &Polynomial,
    (base, unit): (f64, i128),
    exact: bool,
) -> Option<bool> {
    let values: Vec<i128> = (0..=EDGES).map(|edge| polynomial.at(edge)).collect();
    // Half of the searches begin, and half of them end, where the motion is near to a limit.
    let near = |edge: &u64| values[*edge as usize].abs() < 64 * unit;
    let mut chosen = |first: u64, usual: u64| {
        let edges: Vec<u64> = (first..=EDGES).filter(near).collect();
        match random.below(4) {
            0 => usual,
            1 => first + random.below(EDGES + 1 - first),
            _ => *edges.get(random.below(edges.len().max(1) as u64) as usize).unwrap_or(&usual),
        }
    };
    let from = chosen(0, 0).min(EDGES - 1);
    let to = chosen(from + 1, EDGES);
    // One limit is zero, the other is none or just about where the motion comes.
    let now = values[from as usize];
    let most = values[from as usize..=to as usize].iter().map(|value| value * now.signum()).max().expect("edges");
    let far = [None, Some(most + unit), Some(most), Some(most - 1)][random.below(4) as usize];
    let far = far.map(|far| far - far.rem_euclid(unit)).filter(|far| *far >= now.abs());
    let (low, high) = if now > 0 { (Some(0), far) } else { (far.map(|far| -far), Some(0)) };
    let open = random.below(2) == 0;
    let is_outside = |value: i128| {
        low.is_some_and(|low| value < low) || high.is_some_and(|high| value > high || open && value == high)
    };
    let is_limit = |value: &i128| low == Some(*value) || high == Some(*value);
    if is_outside(now) || !exact && values.iter().any(is_limit) {
        return None;
    }
    let limit = |limit: Option<i128>, none: f64| limit.map_or(none, |limit| base + limit as f64);
    let band = Band { low: limit(low, f64::NEG_INFINITY), high: limit(high, f64::INFINITY), open };
    let expected = (from + 1..=to).find(|&edge| is_outside(values[edge as usize]));
    let ends = [from, to].map(|edge| MotionPoint::of(motion, edge));
    let found = guard.first(motion, &band, &ends[0], &ends[1]);
    assert_eq!(found, expected, "{polynomial:?} from {from} to {to} in {low:?} to {high:?}, {open}");
    Some(expected.is_some())
}

#[test]
fn no_edge_is_missed_by_a_motion_that_grazes_its_limits() {
    let system = integrators();
    let guard = Guard::new([0.0, 0.0, 1.0, 0.0], &system);
    let mut random = Random(14);
    let mut outcomes = [0; 2];
    for trial in 0..80_000 {
        let mut polynomial = grazing(&mut random, 4);
        // Far from zero an f64 holds multiples of `unit` alone: values at neighbouring edges may be the same.
        let (base, unit) = [(0.0, 1), (2f64.powi(52), 1), (-2f64.powi(56), 16), (2f64.powi(60), 256)][trial % 4];
        polynomial.0[0] -= polynomial.0[0].rem_euclid(unit);
        let (x, f) = polynomial.integrated(base);
        let motion = Trajectory::new(&system, x, f);
        // The engine's values are exact up to the second degree.
        let exact = polynomial.0.len() <= 3;
        let outcome = search(&mut random, (&guard, &motion), &polynomial, (base, unit), exact);
        outcome.into_iter().for_each(|exits| outcomes[usize::from(exits)] += 1);
    }
    assert!(outcomes[0] > 8000 && outcomes[1] > 20_000, "{outcomes:?}");
}

#[test]
fn a_power_of_the_edge_passes_a_limit_just_below_its_value_at_the_last_edge() {
    let system = integrators();
    let guard = Guard::new([0.0, 0.0, 1.0, 0.0], &system);
    for degree in 1..=4 {
        let mut power = Polynomial(vec![0; degree + 1]);
        power.0[degree] = 2;
        let (x, f) = power.integrated(0.0);
        let motion = Trajectory::new(&system, x, f);
        for last in 1..300 {
            let band = Band { low: -1.0, high: (power.at(last) - 1) as f64, open: false };
            let ends = [0, last].map(|edge| MotionPoint::of(&motion, edge));
            assert_eq!(guard.first(&motion, &band, &ends[0], &ends[1]), Some(last), "degree {degree}");
        }
    }
}

#[test]
fn no_edge_is_missed_by_a_sum_of_states_that_are_much_larger_or_much_faster() {
    // An f64 does not hold the last digits of the states, or of their slopes, of which the sum is what is left.
    let system = Linear::new([[0.0; 4], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0; 4]], EDGE_S, 1 << 20);
    let guard = Guard::new([0.0, 0.0, 1.0, 1.0], &system);
    let mut random = Random(15);
    let mut outcomes = [0; 2];
    for trial in 0..6000 {
        let mut polynomial = grazing(&mut random, 2);
        let (base, unit) = [(0.0, 1), (0.0, 1), (2f64.powi(56), 16), (2f64.powi(60), 256)][trial % 4];
        polynomial.0[0] -= polynomial.0[0].rem_euclid(unit);
        let speed = [2f64.powi(40), 2f64.powi(55), 0.0, 2f64.powi(30)][trial % 4] / EDGE_S;
        let (x, _) = polynomial.integrated(base);
        let motion = Trajectory::new(&system, [x[0], x[1], x[2], -base], [0.0, 0.0, speed, -speed]);
        let outcome = search(&mut random, (&guard, &motion), &polynomial, (0.0, unit), true);
        outcome.into_iter().for_each(|exits| outcomes[usize::from(exits)] += 1);
    }
    assert!(outcomes[0] > 500 && outcomes[1] > 1500, "{outcomes:?}");
}

#[test]
fn no_edge_is_missed_by_a_cubic_whose_slope_is_lost_in_the_slopes_of_a_sum() {
    // Both states are so fast that an f64 of their slopes does not hold whether the sum rises or falls.
    let system = Linear::new([[0.0; 4], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0; 4]], EDGE_S, 1 << 20);
    let guard = Guard::new([0.0, 0.0, 1.0, 1.0], &system);
    let mut random = Random(17);
    let mut outcomes = [0; 2];
    for _ in 0..20_000 {
        // Three passages between edges.
        let mut root = 1 + 2 * random.below(200) as i128;
        let mut polynomial = Polynomial(vec![if random.below(2) == 0 { 1 } else { -1 }]);
        let mut gaps = 1.0;
        for _ in 0..3 {
            polynomial = polynomial.times(&[-root, 2]);
            let gap = 2 * [1, 2, 5, 10, 30, 100][random.below(6) as usize];
            root += gap;
            gaps *= gap as f64;
        }
        let (x, _) = polynomial.integrated(0.0);
        let speed = 2f64.powi(50 + random.below(8) as i32) * gaps.cbrt().powi(2).round() / EDGE_S;
        let motion = Trajectory::new(&system, [x[0], x[1], x[2], 0.0], [x[3], 0.0, speed, -speed]);
        let outcome = search(&mut random, (&guard, &motion), &polynomial, (0.0, 1), false);
        outcome.into_iter().for_each(|exits| outcomes[usize::from(exits)] += 1);
    }
    assert!(outcomes[0] > 500 && outcomes[1] > 5000, "{outcomes:?}");
}

/// A clock period in seconds.
const CLOCK_S: f64 = 20e-9;

fn motor(inductance_h: f64, coulomb_nm: f64) -> Motor {
    Motor {
        resistance_ohm: 2.35,
        inductance_h,
        torque_constant_nm_per_a: 25.9e-3,
        inertia_kg_m2: 1.37e-6,
        viscous_nm_s_per_rad: 1.3e-6,
        coulomb_nm,
    }
}

/// A device with an encoder, at an edge.
struct Walker<'a> {
    device: Device<'a>,
    edge: u64,
    count: i64,
    count_rad: f64,
    /// Edges at which a count or a mode changed, with both.
    log: Vec<(u64, i64, u64)>,
}

impl<'a> Walker<'a> {
    fn new(device: Device<'a>, count_rad: f64) -> Self {
        let log = vec![(0, 0, device.mode_changes())];
        Self { device, edge: 0, count: 0, count_rad, log }
    }

    fn band_rad(&self) -> (f64, f64) {
        (self.count as f64 * self.count_rad, (self.count + 1) as f64 * self.count_rad)
    }

    /// Reads the encoder.
    fn look(&mut self, angle_rad: f64) {
        let band_rad = self.band_rad();
        if !self.device.is_surely_within(self.edge, angle_rad, band_rad) {
            loop {
                match self.device.side_of_band(self.edge, angle_rad, self.band_rad()) {
                    0 => break,
                    side => self.count += i64::from(side),
                }
            }
        }
        self.note();
    }

    fn note(&mut self) {
        let now = (self.count, self.device.mode_changes());
        if self.log.last().is_none_or(|&(_, count, modes)| (count, modes) != now) {
            self.log.push((self.edge, now.0, now.1));
        }
    }

    fn drive(&mut self, drive: Drive) {
        match drive {
            Drive::Current(current_a) => self.device.drive_current(self.edge, current_a),
            Drive::Gates(gates) => self.device.drive(self.edge, gates),
            Drive::Average(duty) => self.device.drive_average(self.edge, duty),
            Drive::Legs(_) | Drive::Averages(_) => unreachable!("an axis has no inverter"),
        }
        self.note();
    }

    /// Goes to an edge one by one.
    fn step_to(&mut self, end: u64) {
        while self.edge < end {
            self.edge += 1;
            let x = self.device.step(self.edge);
            self.look(x[2]);
        }
    }

    /// Goes to an edge by searches of these lengths.
    fn leap_to(&mut self, end: u64, mut length: impl FnMut() -> u64) {
        while self.edge < end {
            let to = end.min(self.edge + length());
            let event = self.device.next_event(self.edge, to, self.band_rad());
            self.edge = event.map_or(to, |event| event.0);
            if let Some(event) = event {
                let x = self.device.arrive(event);
                self.look(x[2]);
            }
        }
    }
}

#[test]
fn searches_of_any_length_stop_where_steps_of_an_edge_find_something() {
    let bridge = Bridge { supply_v: 24.0, on_resistance_ohm: 0.3, diode_drop_v: 0.7, dead_band_v: 0.0 };
    let (spring, torque) = (Push { stiffness_nm_per_rad: 3.0, damping_nm_s_per_rad: 1e-4 }, Hand::Torque(0.02));
    let axes = [
        Axis::amplified(motor(1e-3, 0.0), torque, CLOCK_S, 1 << 24).unwrap(),
        Axis::amplified(motor(1e-3, 20e-3), Hand::Spring(spring), CLOCK_S, 1 << 24).unwrap(),
        Axis::new(motor(2e-6, 5e-3), bridge, torque, CLOCK_S, 1 << 24).unwrap(),
        Axis::new(motor(2e-6, 30e-3), bridge, Hand::Spring(spring), CLOCK_S, 1 << 24).unwrap(),
    ];
    let gates = [
        Gates { a_high: false, a_low: true, b_high: true, b_low: false },
        Gates { a_high: true, a_low: false, b_high: false, b_low: true },
        Gates { a_high: false, a_low: true, b_high: false, b_low: true },
        Gates::default(),
    ];
    let mut random = Random(3);
    let (mut counts, mut modes) = (0, 0);
    for trial in 0..1600 {
        let axis = &axes[trial % 4];
        // A count takes from some tens of edges on at the speeds that come about.
        let count_rad = 10f64.powf(random.between(-6.5, -4.5));
        let start = Device::new(axis, random.between(-1.5, 1.5), random.between(-0.3, 0.3), 0.4 * count_rad);
        let (mut stepped, mut leapt) = (Walker::new(start.clone(), count_rad), Walker::new(start, count_rad));
        while stepped.edge < 6000 {
            let end = stepped.edge + [1, 2, 64, 65, 400, 5000][random.below(6) as usize];
            stepped.step_to(end);
            leapt.leap_to(end, || [1, 1, 2, 64, 65, 81, 161, 5000][random.below(8) as usize]);
            assert_eq!(leapt.log, stepped.log, "trial {trial}, edge {end}");
            assert_eq!(leapt.device.state(end), stepped.device.state(end), "trial {trial}, edge {end}");
            let drive = match trial % 4 {
                0 | 1 => Drive::Current(random.between(-1.5, 1.5)),
                _ => Drive::Gates(gates[random.below(4) as usize]),
            };
            stepped.drive(drive);
            leapt.drive(drive);
        }
        counts += stepped.log.len() as u64 - stepped.device.mode_changes().min(stepped.log.len() as u64);
        modes += stepped.device.mode_changes();
    }
    assert!(counts > 10_000 && modes > 3000, "{counts} counts, {modes} ends of modes");
}

#[test]
fn friction_that_stops_a_shaft_around_the_end_of_a_quick_look_is_met() {
    // Without other forces the speed falls by the same amount in each edge.
    let free = Motor { viscous_nm_s_per_rad: 0.0, ..motor(1e-3, 10e-3) };
    let axis = Axis::amplified(free, Hand::Torque(0.0), CLOCK_S, 1 << 24).unwrap();
    let fall = free.coulomb_nm / free.inertia_kg_m2 * CLOCK_S;
    for stop in (60..70).chain(4090..4104).chain(4200..4204).chain([5000, 5119, 5120, 5121]) {
        // It stops in the middle of an edge; the next count is far away.
        let mut walker = Walker::new(Device::new(&axis, 0.0, fall * (stop as f64 - 0.5), 0.5), 1.0);
        walker.leap_to(stop - 1, || 1);
        assert!(!walker.device.is_stuck() && walker.log.len() == 1, "{stop}");
        walker.leap_to(stop, || 1);
        assert!(walker.device.is_stuck(), "{stop}");
    }
    // A long search goes part by part, and the last part may be a single edge.
    for stop in (81_915..81_925).chain([163_841]) {
        let mut device = Device::new(&axis, 0.0, fall * (stop as f64 - 0.5), 0.5);
        assert_eq!(device.next_event(0, stop, (0.0, 1.0)).map(|event| event.0), Some(stop));
    }
}

#[test]
fn a_diode_s_current_that_ends_within_rounding_of_an_edge_ends_where_steps_find_it() {
    // Without friction the current alone decides when the mode ends.
    let bridge = Bridge { supply_v: 24.0, on_resistance_ohm: 0.3, diode_drop_v: 0.7, dead_band_v: 0.0 };
    let axis = Axis::new(motor(1e-3, 0.0), bridge, Hand::Torque(0.0), CLOCK_S, 1 << 24).unwrap();
    let end = |current_a: f64| {
        let mut device = Device::new(&axis, current_a, 3.0, 0.5);
        (1..).find(|&edge| device.step(edge)[0] == 0.0 && device.mode_changes() > 0).expect("the diodes' current ends")
    };
    for last in (2..200).step_by(3) {
        // The greatest current that has ended by this edge, to the last bit.
        let [mut ended, mut flows] = [1e-6f64, 1.0].map(f64::to_bits);
        while flows - ended > 1 {
            let middle = ended.midpoint(flows);
            *(if end(f64::from_bits(middle)) <= last { &mut ended } else { &mut flows }) = middle;
        }
        assert_eq!([ended, flows].map(|bits| end(f64::from_bits(bits))), [last, last + 1]);
        for bits in ended - 4..=flows + 4 {
            let current_a = f64::from_bits(bits);
            let mut device = Device::new(&axis, current_a, 3.0, 0.5);
            let found = device.next_event(0, 4000, (-1.0, 2.0)).map(|event| event.0);
            assert_eq!(found, Some(end(current_a)), "{current_a:e} A");
        }
    }
}

#[test]
fn a_band_other_than_that_of_the_search_before_is_searched_by_itself() {
    let axis = Axis::amplified(motor(1e-3, 0.0), Hand::Torque(0.0), CLOCK_S, 1 << 24).unwrap();
    // One motion goes on; the other turns after some 26 edges and is back after twice as many.
    for (speed, current_a) in [(100.0, 0.0), (30.0, -3e3)] {
        for begin in [0, 5, 30, 40, 63] {
            let mut device = Device::new(&axis, 0.0, speed, 0.0);
            device.drive_current(0, current_a);
            let wide = (-1.0, 1.0);
            assert_eq!(device.next_event(0, 1, wide), None);
            // At edge `begin` the angle is in this band; before and behind it is not.
            let now_rad = device.state(begin)[2];
            let narrow = (now_rad - 3e-6, now_rad + 1e-6);
            let is_outside = |edge: &u64| !(narrow.0..narrow.1).contains(&device.state(*edge)[2]);
            let expected = (begin + 1..begin + 50).find(is_outside);
            let found = device.next_event(begin, begin + 50, narrow).map(|event| event.0);
            assert_eq!(found, expected, "from {begin} at {speed} rad/s");
            assert_eq!(device.next_event(begin, 9000, wide), None);
        }
    }
}

#[test]
fn an_event_found_does_not_answer_for_a_motion_that_has_come_back_into_the_band() {
    let axis = Axis::amplified(motor(1e-3, 0.0), Hand::Torque(0.0), CLOCK_S, 1 << 24).unwrap();
    // The motion turns after some 26 edges, is back after twice as many, and goes on.
    let mut device = Device::new(&axis, 0.0, 30.0, 0.0);
    device.drive_current(0, -3e3);
    let band = (0.5 * (device.state(69)[2] + device.state(70)[2]), 0.5 * device.state(26)[2]);
    let is_outside = |edge: &u64| !(band.0..band.1).contains(&device.state(*edge)[2]);
    let out = (1..26).find(is_outside).unwrap();
    let back = (26..52).find(|edge| !is_outside(edge)).unwrap();
    let out_again = (back..100).find(is_outside);
    assert_eq!(device.next_event(0, out, band).map(|event| event.0), Some(out));
    assert_eq!(device.next_event(back, 100, band).map(|event| event.0), out_again);
}

#[test]
fn an_edge_beyond_a_limit_right_behind_a_start_near_the_limit_is_not_missed() {
    // A parabola that begins above its limit by about the noise of its f64 values, is below it an edge later, and then
    // rises far above.
    let system = integrators();
    let guard = Guard::new([0.0, 0.0, 1.0, 0.0], &system);
    let mut random = Random(16);
    for trial in 0..100_000 {
        let (base, unit) = (2f64.powi(60), 256);
        let from = i128::from(1 + random.below(900));
        let (now, below) = (random.below(6000) as i128, 1 + random.below(600) as i128);
        let bend = 1 + now + below + random.below(100_000) as i128;
        // Around the start: `now - a j + bend j²` with `now - a + bend = -below`.
        let a = now + bend + below;
        let mut polynomial = Polynomial(vec![now + a * from + bend * from * from, -a - 2 * bend * from, bend]);
        // The value at edge 0 is a multiple of `unit`.
        let rest = polynomial.0[0].rem_euclid(unit);
        polynomial.0[0] -= rest;
        let (x, f) = polynomial.integrated(base);
        let motion = Trajectory::new(&system, x, f);
        let from = from as u64;
        if polynomial.at(from) < 0 {
            continue;
        }
        let to = from + 1 + random.below(EDGES - from);
        let expected = (from + 1..=to).find(|&edge| polynomial.at(edge) < 0);
        let band = Band { low: base, high: f64::INFINITY, open: false };
        let ends = [from, to].map(|edge| MotionPoint::of(&motion, edge));
        let found = guard.first(&motion, &band, &ends[0], &ends[1]);
        assert_eq!(found, expected, "trial {trial}: {polynomial:?} from {from} to {to}");
    }
}
