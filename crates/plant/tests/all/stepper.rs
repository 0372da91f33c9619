//! Fixed steps against the exact flow, closed forms and their own orders.

use hpu_plant::{Axis, Bridge, Device, Drive, Energy, Gates, Hand, Method, Motor, Push, State, Stepper};

const EDGE_S: f64 = 1e-6;
const HORIZON: u64 = 1 << 24;
const BRIDGE: Bridge = Bridge { supply_v: 24.0, on_resistance_ohm: 0.1, diode_drop_v: 0.7, dead_band_v: 0.0 };
const METHODS: [(Method, i32); 4] =
    [(Method::Euler, 1), (Method::SemiImplicit, 1), (Method::Midpoint, 2), (Method::Rk4, 4)];

fn motor() -> Motor {
    Motor {
        resistance_ohm: 2.3457,
        inductance_h: 0.226e-3,
        torque_constant_nm_per_a: 25.9e-3,
        inertia_kg_m2: 1.37e-6,
        viscous_nm_s_per_rad: 1.3e-6,
        coulomb_nm: 0.0,
    }
}

const PUSH: Hand = Hand::Spring(Push { stiffness_nm_per_rad: 0.3, damping_nm_s_per_rad: 1e-4 });

/// Makes a number of steps under one drive; returns the state and the energies.
fn walk(axis: &Axis, method: Method, step_s: f64, steps: u64, x: State, drive: Drive, intent: f64) -> (State, Energy) {
    let stepper = Stepper::new(axis, method, step_s);
    let mut energy = Energy::default();
    let mut x = axis.taken(drive, &x);
    for _ in 0..steps {
        let excitation = axis.excitation(drive, &x, intent);
        let next = stepper.step(&x, &excitation);
        stepper.account(&mut energy, step_s, &stepper.powers(&x, &excitation), &stepper.powers(&next, &excitation));
        x = next;
    }
    (x, energy)
}

fn residual_j(axis: &Axis, from: &State, to: &State, energy: &Energy) -> f64 {
    energy.supplied_j() - (axis.stored_j(to) - axis.stored_j(from)) - energy.dissipated_j()
}

/// Checks every method's error over 20 ms at three steps, each half as long as the one before, against the exact flow.
/// The steps are short enough for the error's first term to dominate, and long enough for rounding to stay below it.
fn has_its_orders(axis: &Axis, start: State, drive: Drive, intent: f64) {
    let edges = 20_000;
    let mut exact = Device::new(axis, start[0], start[1], start[2]);
    exact.intend(0, start[3], intent);
    exact.driven(0, drive);
    let truth = exact.flow(0, edges);
    for (method, order) in METHODS {
        let longest = [4, 16, 0, 80][order as usize - 1];
        let errors = [longest, longest / 2, longest / 4].map(|step| {
            let (x, _) = walk(axis, method, step as f64 * EDGE_S, edges / step, start, drive, intent);
            (x[2] - truth[2]).abs()
        });
        for pair in errors.windows(2) {
            let got = (pair[0] / pair[1]).log2();
            assert!((got - f64::from(order)).abs() < 0.25, "{method:?}: {errors:?}, order {got}");
        }
    }
}

#[test]
fn every_method_has_its_order_on_the_motor() {
    let axis = Axis::new(motor(), BRIDGE, PUSH, EDGE_S, HORIZON).unwrap();
    has_its_orders(&axis, [0.2, 30.0, 0.1, 0.1], Drive::Average(-0.3), 1.0);
}

#[test]
fn every_method_has_its_order_without_inductance() {
    let axis = Axis::new(motor(), BRIDGE, PUSH, EDGE_S, HORIZON).unwrap().without_inductance();
    has_its_orders(&axis, [0.0, 30.0, 0.1, 0.1], Drive::Average(-0.3), 1.0);
}

#[test]
fn every_method_has_its_order_on_a_mass() {
    let hand = Hand::Spring(Push { stiffness_nm_per_rad: 2e4, damping_nm_s_per_rad: 5.0 });
    let axis = Axis::amplified(Motor::on_rail(0.05, 0.1, 0.0), hand, EDGE_S, HORIZON).unwrap();
    has_its_orders(&axis, [0.0, 0.3, 0.01, 0.01], Drive::Current(2.0), 0.05);
}

#[test]
fn energy_residuals_shrink_with_the_square_of_the_step() {
    let axis = Axis::new(motor(), BRIDGE, Hand::Torque(0.01), EDGE_S, HORIZON).unwrap();
    let start = [0.0, 10.0, 0.0, 0.0];
    let residual = |step: u64| {
        let (x, energy) = walk(&axis, Method::Rk4, step as f64 * EDGE_S, 4_000 / step, start, Drive::Average(0.5), 0.0);
        residual_j(&axis, &start, &x, &energy).abs()
    };
    let ratio = residual(16) / residual(8);
    assert!((ratio - 4.0).abs() < 0.4, "{ratio}");
}

#[test]
fn a_sliding_mass_stops_where_it_should_and_stays() {
    // 0.05 kg at 0.2 m/s against 0.5 N: 20 ms, 2 mm.
    let axis = Axis::amplified(Motor::on_rail(0.05, 0.0, 0.5), Hand::Torque(0.0), EDGE_S, HORIZON).unwrap();
    for (method, _) in METHODS {
        let (x, energy) = walk(&axis, method, 7e-6, 5_000, [0.0, 0.2, 0.0, 0.0], Drive::Current(0.0), 0.0);
        assert_eq!(x[1], 0.0, "{method:?}");
        // At most one step at the speed before the end, and half a step's deceleration along the way.
        assert!((x[2] - 2e-3).abs() < 7e-6 * 0.2, "{method:?}: {x:?}");
        assert!((energy.coulomb_j() - 0.5 * x[2].abs()).abs() < 1e-6, "{method:?}");
        let (x, _) = walk(&axis, method, 7e-6, 100, x, Drive::Current(0.4999), 0.0);
        assert_eq!(x[1], 0.0, "{method:?}");
        let (x, _) = walk(&axis, method, 7e-6, 100, x, Drive::Current(-0.6), 0.0);
        assert!((x[1] + 0.1 / 0.05 * 7e-4).abs() < 1e-12, "{method:?}: {x:?}");
    }
}

#[test]
fn smoothed_friction_creeps_as_the_exponential() {
    let axis = Axis::amplified(Motor::on_rail(0.1, 0.0, 0.2), Hand::Torque(0.0), EDGE_S, HORIZON)
        .unwrap()
        .with_smoothed_friction(0.01)
        .unwrap();
    for (method, order) in METHODS {
        let speed = |step_s: f64| {
            walk(
                &axis,
                method,
                step_s,
                (10e-3 / step_s).round() as u64,
                [0.0, 0.01, 0.0, 0.0],
                Drive::Current(0.0),
                0.0,
            )
            .0[1]
        };
        // The time constant is 5 ms.
        let truth = 0.01 * (-2.0f64).exp();
        let errors = [500e-6, 250e-6].map(|step_s| (speed(step_s) - truth).abs());
        let got = (errors[0] / errors[1]).log2();
        assert!((got - f64::from(order)).abs() < 0.25, "{method:?}: {errors:?}");
    }
}

#[test]
fn the_midpoint_solves_its_equation_with_friction() {
    let hand = Hand::Spring(Push { stiffness_nm_per_rad: 300.0, damping_nm_s_per_rad: 0.5 });
    for smoothed in [false, true] {
        let axis = Axis::amplified(Motor::on_rail(0.1, 0.3, 0.2), hand, EDGE_S, HORIZON).unwrap();
        let axis = if smoothed { axis.with_smoothed_friction(0.01).unwrap() } else { axis };
        let stepper = Stepper::new(&axis, Method::Midpoint, 1e-3);
        for (speed, angle) in [(0.2, 0.0), (-0.2, 0.001), (0.004, 0.0), (0.02, 0.0005)] {
            let x = [0.1, speed, angle, 0.0];
            let excitation = axis.excitation(Drive::Current(0.1), &x, 0.02);
            let next = stepper.step(&x, &excitation);
            let middle = std::array::from_fn(|k| 0.5 * (x[k] + next[k]));
            let slope = stepper.derivative(&middle, &excitation);
            for k in 0..4 {
                let left = next[k] - x[k] - 1e-3 * slope[k];
                assert!(left.abs() < 1e-14, "smoothed {smoothed}, {x:?}: state {k} {left}");
            }
        }
    }
}

#[test]
fn a_freewheeling_current_dies_in_its_diodes_and_does_not_come_back() {
    let axis = Axis::new(motor(), BRIDGE, Hand::Torque(0.0), EDGE_S, HORIZON).unwrap();
    let start = [1.0, 0.0, 0.0, 0.0];
    let drive = Drive::Gates(Gates::default());
    let mut exact = Device::new(&axis, 1.0, 0.0, 0.0);
    let truth = exact.flow(0, 2_000);
    for (method, _) in METHODS {
        let (x, energy) = walk(&axis, method, 0.25e-6, 8_000, start, drive, 0.0);
        assert_eq!(x[0], 0.0, "{method:?}");
        // The current lasts 9 us, and at either end of that a method may err by a step of a quarter.
        let share = 2.0 * 0.25 / 9.0;
        assert!((x[1] - truth[1]).abs() < share * truth[1], "{method:?}: {x:?}, {truth:?}");
        let there = exact.energy(2_000).diodes_j();
        assert!((energy.diodes_j() - there).abs() < share * there, "{method:?}");
    }
}

#[test]
fn a_prescribed_hand_moves_the_shaft_by_every_method_alike() {
    let axis = Axis::new(Motor { coulomb_nm: 1e-3, ..motor() }, BRIDGE, Hand::Prescribed, EDGE_S, HORIZON).unwrap();
    let start = [0.0, 5.0, 0.2, 0.2];
    for (method, _) in METHODS {
        let (x, energy) = walk(&axis, method, 1e-5, 1_000, start, Drive::Average(0.0), 5.0);
        assert!((x[2] - 0.25).abs() < 1e-12 && x[1] == 5.0, "{method:?}: {x:?}");
        // Friction, and the brake's current: K² ω² / R.
        assert!((energy.coulomb_j() - 1e-3 * 0.05).abs() < 1e-12);
        assert!(residual_j(&axis, &start, &x, &energy).abs() < 1e-3 * energy.exchanged_j(), "{method:?}");
    }
}
