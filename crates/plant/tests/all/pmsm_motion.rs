//! A motor of three phases in motion: leaps against single steps, energies, diodes, averages and rows.

use std::f64::consts::TAU;

use hpu_plant::pmsm::{Harmonic, Inverter, Pmsm, PmsmDevice, PmsmMotor};
use hpu_plant::{Drive, Hand, Leg, Pace, Push};

use crate::pmsm::{ANYWHERE, BARE, EDGE_S, balanced, leap, motor};
use crate::random::Random;

use Leg::{High, Low, Open};

pub const PERIOD: u64 = 2500;
const COUNT_RAD: f64 = TAU / 65_536.0;

pub fn plain() -> PmsmMotor {
    PmsmMotor { inertia_kg_m2: 4e-6, ..motor() }
}

pub fn rough() -> PmsmMotor {
    let harmonic = |order, amplitude_nm, phase_rad| Harmonic { order, amplitude_nm, phase_rad };
    PmsmMotor {
        direct_h: 0.3e-3,
        quadrature_h: 0.5e-3,
        coulomb_nm: 2e-3,
        stiction_nm: 3e-3,
        cogging: vec![harmonic(42, 1e-3, 0.5), harmonic(84, 0.5e-3, -1.0), harmonic(14, -0.2e-3, 0.0)],
        ..plain()
    }
}

pub const INVERTER: Inverter = Inverter { supply_v: 24.0, supply_ohm: 0.1, on_resistance_ohm: 0.03, diode_drop_v: 0.7 };

fn cases() -> Vec<Pmsm> {
    let spring = Hand::Spring(Push { stiffness_nm_per_rad: 0.2, damping_nm_s_per_rad: 1e-4 });
    [(plain(), INVERTER, Hand::Torque(0.0)), (rough(), INVERTER, spring), (rough(), BARE, Hand::Torque(1e-3))]
        .into_iter()
        .map(|(motor, inverter, hand)| Pmsm::new(motor, inverter, hand, EDGE_S).unwrap())
        .collect()
}

/// Random complementary gates with dead time; some periods with a leg off, or all, or with mean voltages.
pub fn drives(random: &mut Random, periods: u64) -> Vec<(u64, Drive)> {
    let (mut legs, mut given) = ([Low; 3], vec![(0, Drive::Legs([Low; 3]))]);
    for period in 0..periods {
        let (begin, kind, mut changes) = (period * PERIOD, random.below(10), Vec::new());
        if kind == 4 {
            let shares = [0, 1, 2].map(|_| random.below(101) as f64 / 100.0);
            given.push((begin, Drive::Averages(shares)));
            continue;
        }
        for x in 0..3 {
            let on = PERIOD / 10 + random.below(PERIOD / 10 * 8);
            let rise = begin + (PERIOD - on) / 2;
            if kind == 0 || kind == 1 + x {
                changes.push((begin + 1, x, Open));
                continue;
            }
            let fall = rise + on;
            let pairs = [(begin + 1, Low), (rise, Open), (rise + 25, High), (fall, Open), (fall + 25, Low)];
            changes.extend(pairs.map(|(edge, leg)| (edge, x, leg)));
        }
        changes.sort_by_key(|&(edge, x, _)| (edge, x));
        for (edge, x, leg) in changes {
            legs[x as usize] = leg;
            given.push((edge, Drive::Legs(legs)));
        }
    }
    given
}

/// An encoder at a device.
#[derive(Clone)]
struct Counted<'a> {
    device: PmsmDevice<'a>,
    count: i64,
    /// The edges at which the count changed, with the bits of the state.
    edges: Vec<(u64, i64, [u64; 4])>,
}

impl<'a> Counted<'a> {
    fn new(laws: &'a Pmsm) -> Self {
        let device = PmsmDevice::new(laws, [0.5, -0.5], 3.0, 1e-5);
        Self { device, count: 0, edges: Vec::new() }
    }

    fn band(&self) -> (f64, f64) {
        (self.count as f64 * COUNT_RAD, (self.count + 1) as f64 * COUNT_RAD)
    }

    fn look(&mut self, edge: u64, x: [f64; 4]) {
        let side = self.device.side_of_band(edge, x[2], self.band());
        if side != 0 {
            self.count += i64::from(side);
            self.edges.push((edge, self.count, x.map(f64::to_bits)));
        }
    }

    fn leap(&mut self, mut edge: u64, to: u64) {
        while let Some(event) = self.device.next_event(edge, to, self.band()) {
            edge = event;
            let x = self.device.step(edge);
            self.look(edge, x);
        }
    }
}

/// Over 10^5 edges and more, single steps, leaps, and leaps of a device that is asked at random edges for anything
/// count at the same edges, and their states have the same bits.
#[test]
fn leaps_are_single_steps() {
    for (case, laws) in cases().iter().enumerate() {
        let mut random = Random(7 + case as u64);
        let [mut stepped, mut leaping, mut asked] = [0, 1, 2].map(|_| Counted::new(laws));
        asked.device.measure(Pace { stride: 1000, period: None }, [true; 2]);
        let (mut edge, mut intended) = (0, 0);
        for (to, drive) in drives(&mut random, 60) {
            for single in edge + 1..=to {
                let x = stepped.device.step(single);
                stepped.look(single, x);
            }
            leaping.leap(edge, to);
            while edge < to {
                let part = (edge + 1 + random.below(400)).min(to);
                asked.leap(edge, part);
                edge = part;
                let _ = (asked.device.energy(edge), asked.device.phases(edge), asked.device.voltages(edge));
                let _ = asked.device.next_event(edge, edge + random.below(100_000), asked.band());
                let later = asked.device.state(edge + random.below(5000));
                assert!(later.iter().all(|x| x.is_finite()));
            }
            let bits = [&stepped, &leaping, &asked].map(|of| of.device.state(to).map(f64::to_bits));
            assert_eq!(bits[0], bits[1], "case {case}, edge {to}");
            assert_eq!(bits[0], bits[2], "case {case}, edge {to}");
            for of in [&mut stepped, &mut leaping, &mut asked] {
                of.device.driven(to, drive);
                if intended % 50 == 49 {
                    of.device.intend(to, 0.01 * (to % 7) as f64, 1.0);
                }
            }
            intended += 1;
        }
        assert!(edge > 100_000 && stepped.edges.len() > 20, "{}", stepped.edges.len());
        assert_eq!(stepped.edges, leaping.edges);
        assert_eq!(stepped.edges, asked.edges);
        let sums = [&stepped, &leaping, &asked].map(|of| {
            let energy = of.device.energy(edge);
            [energy.source_j(), energy.copper_j(), energy.diodes_j(), energy.coulomb_j(), of.device.stored_j(edge)]
                .map(f64::to_bits)
        });
        assert!(sums[0] == sums[1] && sums[0] == sums[2]);
        assert_eq!(stepped.device.mode_changes(), leaping.device.mode_changes());
        assert!(leaping.device.mode_changes() > 10);
    }
}

/// Source and hand give as much energy as becomes heat or is stored, to rounding, over 2000 periods.
#[test]
fn no_energy_is_lost() {
    for (case, laws) in cases().iter().enumerate() {
        let (mut random, mut device) = (Random(70 + case as u64), PmsmDevice::new(laws, [1.0, 2.0], 5.0, 0.3));
        let mut edge = 0;
        for (index, (to, drive)) in drives(&mut random, 2000).into_iter().enumerate() {
            leap(&mut device, edge, to);
            edge = to;
            if index % 97 == 0 {
                balanced(&device, to, 1e-13);
            }
            device.driven(to, drive);
        }
        let energy = device.energy(edge);
        assert!(energy.copper_j() > 0.1 && energy.viscous_j() > 0.0 && energy.source_j() > 0.1);
        assert_eq!(energy.diodes_j() > 0.0, laws.inverter().diode_drop_v > 0.0);
        assert_eq!(energy.coulomb_j() > 0.0, laws.motor().coulomb_nm > 0.0);
        assert_eq!(device.crowded_edges(), 0);
    }
}

/// A motor, an inverter and a hand at random, over several decades; some have no friction, no diode's drop and so on.
fn anything(random: &mut Random) -> Pmsm {
    let mut log = |low: f64, high: f64| low * (high / low).powf(random.next());
    let (quadrature_h, coulomb_nm, cogging_nm) = (log(2e-5, 5e-3), log(1e-5, 0.1), log(1e-4, 1e-2));
    let [salient, rubs, cogs, feeds, resists, drops, sprung] = [0; 7].map(|_| log(0.5, 2.0) > 1.0);
    let wave = |order, share: f64| Harmonic { order, amplitude_nm: share * cogging_nm, phase_rad: share };
    let motor = PmsmMotor {
        pole_pairs: log(1.0, 22.0) as u32,
        resistance_ohm: log(0.02, 20.0),
        direct_h: quadrature_h * if salient { log(0.3, 3.0) } else { 1.0 },
        quadrature_h,
        flux_vs: log(5e-4, 0.1),
        inertia_kg_m2: log(1e-7, 1e-3),
        viscous_nm_s_per_rad: log(1e-7, 1e-3),
        coulomb_nm: if rubs { coulomb_nm } else { 0.0 },
        stiction_nm: if rubs { coulomb_nm * log(1.0, 3.0) } else { 0.0 },
        cogging: if cogs { vec![wave(12, 1.0), wave(36, 0.3)] } else { Vec::new() },
    };
    let inverter = Inverter {
        supply_v: log(5.0, 80.0),
        supply_ohm: if feeds { log(1e-3, 1.0) } else { 0.0 },
        on_resistance_ohm: if resists { log(1e-3, 1.0) } else { 0.0 },
        diode_drop_v: if drops { log(0.05, 2.0) } else { 0.0 },
    };
    let push = Push { stiffness_nm_per_rad: log(1e-2, 10.0), damping_nm_s_per_rad: log(1e-5, 1e-2) };
    let hand = if sprung { Hand::Spring(push) } else { Hand::Torque(1e-3) };
    Pmsm::new(motor, inverter, hand, EDGE_S).unwrap()
}

/// Random motors under random legs: leaps end in the bits of single calls, no energy is lost, and no edge has more
/// changes than are followed.
#[test]
fn random_motors_keep_energy_and_bits() {
    for seed in 0..60 {
        let mut random = Random(1000 + seed);
        let laws = anything(&mut random);
        let dq = [0; 2].map(|_| random.between(-3.0, 3.0));
        let mut leaping = PmsmDevice::new(&laws, dq, random.between(-100.0, 100.0), 0.1);
        let mut called = leaping.clone();
        let mut edge = 0;
        for index in 0..120 {
            let to = edge + 1 + if index % 40 == 39 { 200_000 } else { random.below(1 << (index % 15)) };
            leap(&mut leaping, edge, to);
            edge = to;
            called.step(to);
            let legs = [0; 3].map(|_| [High, Low, Open][random.below(3) as usize]);
            for device in [&mut leaping, &mut called] {
                device.driven(to, Drive::Legs(legs));
                if index % 30 == 5 {
                    device.intend(to, 0.2, -1.0);
                }
            }
        }
        assert_eq!(leaping.state(edge).map(f64::to_bits), called.state(edge).map(f64::to_bits), "{seed}");
        balanced(&leaping, edge, 1e-12);
        assert_eq!(leaping.crowded_edges(), 0, "{seed}");
    }
}

/// At a rotor at rest, with diodes without a drop, an open terminal between two at one rail lies at the limit of its
/// range for as long as they stay: rounding opens and closes no diode in turns.
#[test]
fn diodes_without_a_drop_do_not_chatter() {
    for seed in 0..40 {
        let mut random = Random(seed);
        let inverter = Inverter {
            supply_v: random.between(5.0, 80.0),
            supply_ohm: random.between(0.0, 0.5),
            on_resistance_ohm: if seed % 2 == 0 { 0.0 } else { random.between(0.0, 0.5) },
            diode_drop_v: 0.0,
        };
        let held = PmsmMotor { stiction_nm: 1e3, resistance_ohm: random.between(0.05, 3.0), ..plain() };
        let laws = Pmsm::new(held, inverter, Hand::Torque(0.0), EDGE_S).unwrap();
        let mut device = PmsmDevice::new(&laws, [0.0; 2], 0.0, random.between(-3.0, 3.0));
        let mut edge = 0;
        for _ in 0..300 {
            let legs = [0; 3].map(|_| [High, Low, Open][random.below(3) as usize]);
            device.driven(edge, Drive::Legs(legs));
            edge += 1 + random.below(5000);
            device.step(edge);
        }
        assert_eq!(device.crowded_edges(), 0, "{seed}");
        assert!(device.circuit_changes() < 1000, "{seed}: {}", device.circuit_changes());
    }
}

/// While a leg is open its terminal is a diode's drop below ground for a current out of it, a drop above the rail for a
/// current into it, and in between without a current.
#[test]
fn an_open_legs_terminal_follows_the_sign_of_its_current() {
    let laws = Pmsm::new(plain(), INVERTER, Hand::Torque(0.0), EDGE_S).unwrap();
    let (mut random, mut device) = (Random(5), PmsmDevice::new(&laws, [0.0; 2], 60.0, 0.3));
    let (mut legs, mut seen) = ([Open; 3], [0; 3]);
    let mut edge = 0;
    for (to, drive) in drives(&mut random, 300) {
        for to in [edge + (to - edge) / 2, to] {
            device.step(to);
            edge = to;
            let (phases, volts) = (device.phases(edge), device.voltages(edge));
            let sum = phases[0] + phases[1] + phases[2];
            assert!(sum.abs() <= 1e-14, "{sum:e}");
            let rail = 24.0 - 0.1 * device.supply_current(edge);
            for x in (0..3).filter(|&x| legs[x] == Open) {
                let (expected, kind) = match phases[x] {
                    i if i > 0.0 => (-0.7, 0),
                    i if i < 0.0 => (rail + 0.7, 1),
                    _ => (volts[x].clamp(-0.7, rail + 0.7), 2),
                };
                assert!((volts[x] - expected).abs() < 1e-9, "{volts:?} {phases:?} {rail}");
                seen[kind] += 1;
            }
            for x in (0..3).filter(|&x| legs[x] != Open) {
                let ideal = if legs[x] == High { rail } else { 0.0 };
                assert!((volts[x] - (ideal - 0.03 * phases[x])).abs() < 1e-12);
            }
        }
        match drive {
            Drive::Legs(given) => legs = given,
            _ => continue,
        }
        device.driven(to, drive);
    }
    assert!(seen.iter().all(|&times| times > 20), "{seen:?}");
}

/// A rotor that spins too slowly for its diodes coasts without currents. Faster, two diodes open where the voltage
/// between two phases, `√3 ψ p ω cos(..)`, reaches the supply and two drops; at edges of 10^-13 s.
#[test]
fn open_legs_rectify_from_the_instant_at_which_two_diodes_open() {
    let edge_s = 1e-13;
    let heavy = PmsmMotor { inertia_kg_m2: 1e30, viscous_nm_s_per_rad: 0.0, ..plain() };
    let laws = Pmsm::new(heavy, INVERTER, Hand::Torque(0.0), edge_s).unwrap();
    // The voltage between phases is up to 25.4 V at 349.1 rad/s. There is one phase or another near its top always, so
    // that the voltages between all pairs fall to cos 30° of it.
    let reach = |speed: f64| 3f64.sqrt() * 6e-3 * 7.0 * speed;
    let slow = PmsmDevice::new(&laws, [0.0; 2], 349.0, 0.2);
    assert_eq!(slow.phases(100_000_000_000), [0.0; 3]);
    for speed in [355.0, 380.0, -380.0] {
        // At angle 0 the phases b and c have the greatest voltage between them: √3/2 · √3 of a phase's, the top itself.
        // 30° away all pairs are at most at cos 30°.
        let angle = std::f64::consts::PI / 6.0 / 7.0;
        let mut device = PmsmDevice::new(&laws, [0.0; 2], speed, angle);
        let top = (25.4 / reach(speed).abs()).acos();
        // The next top is 30° away.
        let opens_s = (std::f64::consts::PI / 6.0 - top) / (7.0 * speed.abs());
        let mut edge = 0;
        while device.circuit_changes() == 0 {
            let event = device.next_event(edge, 1 << 40, ANYWHERE).unwrap();
            edge = event;
            device.step(edge);
        }
        let expected = (opens_s / edge_s).ceil() as u64;
        assert!(edge.abs_diff(expected) <= 1, "{speed}: {edge} instead of {expected}");
        device.step(edge + 100_000_000);
        let phases = device.phases(edge + 100_000_000);
        assert_eq!(phases.iter().filter(|i| **i == 0.0).count(), 1, "{phases:?}");
        assert!(device.supply_current(edge + 100_000_000) < 0.0);
    }
}

/// With two legs at ground the third's open terminal has 3/2 of its phase's back-EMF, until its diode conducts.
#[test]
fn a_floating_phase_shows_its_back_emf() {
    let heavy = PmsmMotor { inertia_kg_m2: 1e30, viscous_nm_s_per_rad: 0.0, ..plain() };
    let inverter = Inverter { on_resistance_ohm: 0.0, supply_ohm: 0.0, ..INVERTER };
    let laws = Pmsm::new(heavy, inverter, Hand::Torque(0.0), EDGE_S).unwrap();
    let (speed, angle) = (30.0, 0.05);
    for x in 0..3 {
        let mut device = PmsmDevice::new(&laws, [0.0; 2], speed, angle);
        let mut legs = [Low; 3];
        legs[x] = Open;
        device.driven(0, Drive::Legs(legs));
        let (mut floats, mut conducts) = (0, 0);
        for edge in (1..2_000_000).step_by(20_000) {
            device.step(edge);
            let phase = 7.0 * (angle + speed * edge as f64 * EDGE_S) - TAU / 3.0 * x as f64;
            let open = -1.5 * 6e-3 * 7.0 * speed * phase.sin();
            let (volts, current) = (device.voltages(edge)[x], device.phases(edge)[x]);
            if current == 0.0 {
                floats += 1;
                assert!((volts - open).abs() < 1e-12, "{volts} instead of {open}");
            } else {
                conducts += 1;
                assert!(current > 0.0 && volts == -0.7);
            }
        }
        assert!(floats > 20 && conducts > 20, "{floats} {conducts}");
    }
}

/// Mean voltages on a held rotor: the current rises by an exponential, with the on-resistance of one switch a phase,
/// and the supply's resistance by the square of the share.
#[test]
fn averages_are_a_resistance_and_an_inductance() {
    let held = PmsmMotor { stiction_nm: 1e3, ..plain() };
    let laws = Pmsm::new(held, INVERTER, Hand::Torque(0.0), EDGE_S).unwrap();
    let mut device = PmsmDevice::new(&laws, [0.0; 2], 0.0, 0.7);
    device.driven(0, Drive::Averages([0.25, 0.0, 0.0]));
    for edge in [1, 1000, 30_000, 200_000] {
        device.step(edge);
        let ohm = 0.83 + 2.0 / 3.0 * 0.1 * 0.25 * 0.25;
        let expected = 2.0 / 3.0 * 6.0 / ohm * -(-ohm * edge as f64 * EDGE_S / 0.4e-3).exp_m1();
        let [a, b, c] = device.phases(edge);
        assert!((a - expected).abs() < 1e-13 && (b + 0.5 * expected).abs() < 1e-13 && (b - c).abs() < 1e-13);
        assert!((device.supply_current(edge) - 0.25 * expected).abs() < 1e-13);
        let volts = 0.25 * (24.0 - 0.1 * 0.25 * expected) - 0.03 * expected;
        assert!((device.voltages(edge)[0] - volts).abs() < 1e-12);
        let whole = 2.0 / 3.0 * 6.0 / ohm;
        let charge = whole * (edge as f64 * EDGE_S + (0.4e-3 / ohm) * (-ohm * edge as f64 * EDGE_S / 0.4e-3).exp_m1());
        assert!((device.charges(edge)[0] - charge).abs() < 1e-15);
        assert_eq!(device.floor(Some(0), edge, 1e6), (1e6 * a).floor() as i64);
    }
    assert!((device.dq(200_000)[0] - device.phases(200_000)[0] * (7.0f64 * 0.7).cos()).abs() < 1e-12);
}

/// Means and extremes of rows against sums over every edge.
#[test]
fn rows_have_the_means_and_extremes_of_all_edges() {
    let laws = &cases()[1];
    let mut random = Random(11);
    let mut device = PmsmDevice::new(laws, [0.5, -0.5], 3.0, 1e-5);
    device.measure(Pace { stride: 1000, period: None }, [true; 2]);
    let drives = drives(&mut random, 12);
    let mut due = drives.iter().peekable();
    let (mut sums, mut least, mut most) = ([0.0f64; 2], [f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let mut before = device.state(0);
    let mut whole = [0.0; 2];
    while let Some(given) = due.next_if(|given| given.0 == 0) {
        device.driven(0, given.1);
    }
    for edge in 1..=12 * PERIOD {
        let x = device.step(edge);
        for k in 0..2 {
            sums[k] += 0.5 * (before[k] + x[k]);
            least[k] = least[k].min(before[k]).min(x[k]);
            most[k] = most[k].max(before[k]).max(x[k]);
        }
        if edge % 1000 == 0 {
            for (k, row) in device.measured(edge, &x).unwrap().into_iter().enumerate() {
                let size = most[k] - least[k];
                assert!((row.mean - sums[k] / 1000.0).abs() <= 1e-5 * size, "{row:?} {}", sums[k] / 1000.0);
                assert!((row.extent.least - least[k]).abs() <= 2e-3 * size, "{row:?} {}", least[k]);
                assert!((row.extent.greatest - most[k]).abs() <= 2e-3 * size, "{row:?} {}", most[k]);
                // The edges' own values are computed in another way.
                assert!(row.extent.least <= least[k] + 1e-13 && row.extent.greatest >= most[k] - 1e-13);
                whole[k] += row.mean * 1000.0 * EDGE_S;
            }
            (sums, least, most) = ([0.0; 2], [f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        }
        before = x;
        while let Some(given) = due.next_if(|given| given.0 == edge) {
            device.driven(edge, given.1);
        }
    }
    let [charge, _] = device.energy(12 * PERIOD).current_and_angle_since(&hpu_plant::Energy::default());
    assert!((charge - whole[0]).abs() <= 1e-14 * charge.abs(), "{charge} {}", whole[0]);
    let turned = device.state(12 * PERIOD)[2] - 1e-5;
    assert!((turned - whole[1]).abs() <= 1e-14, "{turned} {}", whole[1]);
}

/// A hand's torque between Coulomb friction and stiction moves a slipping shaft and no stuck one.
#[test]
fn stiction_holds_what_friction_does_not() {
    let sticky = PmsmMotor { coulomb_nm: 2e-3, stiction_nm: 5e-3, viscous_nm_s_per_rad: 0.0, ..plain() };
    let laws = |torque_nm| Pmsm::new(sticky.clone(), INVERTER, Hand::Torque(torque_nm), EDGE_S).unwrap();
    let run = |laws: &Pmsm, speed| {
        let mut device = PmsmDevice::new(laws, [0.0; 2], speed, 0.0);
        let x = device.step(1_000_000);
        (x[1], device.is_stuck(), device.still(1_000_000).is_some())
    };
    assert_eq!(run(&laws(4e-3), 0.0), (0.0, true, true));
    // (4 - 2) mN·m on 4e-6 kg·m² for 20 ms.
    let (speed, stuck, still) = run(&laws(4e-3), 1.0);
    assert!((speed - 11.0).abs() < 1e-12 && !stuck && !still);
    let (speed, stuck, _) = run(&laws(6e-3), 0.0);
    assert!((speed - 20.0).abs() < 1e-12 && !stuck);
    // Friction alone stops the shaft after 2 ms, and holds it.
    let laws = laws(0.0);
    let mut device = PmsmDevice::new(&laws, [0.0; 2], 1.0, 0.0);
    let mut at = device.next_event(0, 1_000_000, ANYWHERE).unwrap();
    while !device.is_stuck() {
        at = device.next_event(at.min(99_000), 1_000_000, ANYWHERE).unwrap();
        device.step(at);
    }
    assert!(at.abs_diff(100_000) <= 1, "{at}");
    assert!((device.state(at)[2] - 1e-3).abs() < 1e-15);
    assert_eq!(device.next_event(at, u64::MAX, ANYWHERE), None);
}

/// The message names the quantity, and what is accepted.
#[test]
fn impossible_motors_are_refused() {
    let refused = |change: &dyn Fn(&mut PmsmMotor, &mut Inverter, &mut Hand)| {
        let (mut motor, mut inverter, mut hand) = (plain(), INVERTER, Hand::Torque(0.0));
        change(&mut motor, &mut inverter, &mut hand);
        Pmsm::new(motor, inverter, hand, EDGE_S).unwrap_err().to_string()
    };
    assert_eq!(refused(&|m, _, _| m.pole_pairs = 0), "pole pairs are 0; accepted are 1 to 10000");
    assert_eq!(refused(&|m, _, _| m.direct_h = 0.0), "L_d is 0; it must be positive");
    assert_eq!(refused(&|m, _, _| m.quadrature_h = -1.0), "L_q is -1; it must be positive");
    assert_eq!(refused(&|m, _, _| m.inertia_kg_m2 = f64::NAN), "inertia is NaN; it must be positive");
    assert_eq!(refused(&|m, _, _| m.resistance_ohm = -0.1), "resistance is -0.1; it must be zero or positive");
    assert_eq!(refused(&|_, i, _| i.supply_v = 0.0), "supply is 0; it must be positive");
    let stiction = refused(&|m, _, _| m.coulomb_nm = 0.5);
    assert_eq!(stiction, "stiction is 0; it must be the Coulomb friction, 0.5, or more");
    let harmonic = Harmonic { order: 0, amplitude_nm: 1.0, phase_rad: 0.0 };
    let order = refused(&|m, _, _| m.cogging = vec![harmonic]);
    assert_eq!(order, "a harmonic of the cogging has order 0; accepted are 1 to 10000");
    let many = refused(&|m, _, _| m.cogging = vec![Harmonic { order: 1, ..harmonic }; 17]);
    assert_eq!(many, "cogging has 17 harmonics; accepted are up to 16");
    assert!(refused(&|_, _, h| *h = Hand::Torque(f64::INFINITY)).contains("finite"));
}
