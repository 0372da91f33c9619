//! The methods' reference laws against hand calculations, closed forms and their own ledgers.

use hpu_scene::SplitMix64;
use hpu_scene::law::{
    AnyLaw, BoundingForm, EnergyBounding, InputShaper, MidpointSpring, Observer, PassiveSpring, PassivityController,
    SampledLaw, VirtualCoupling, Wall, high_pass,
};

const PERIOD_S: f64 = 1e-3;

fn wall(stiffness_n_per_m: f64) -> Wall {
    Wall::new(stiffness_n_per_m, 0.0, 1, PERIOD_S, 0.0)
}

fn close(found: f64, wanted: f64, tolerance: f64) {
    assert!((found - wanted).abs() <= tolerance, "{found} instead of {wanted}");
}

/// Returns a uniform random number in -1 to 1.
fn any(random: &mut SplitMix64) -> f64 {
    random.next_u64() as f64 * 2f64.powi(-63) - 1.0
}

#[test]
fn energy_bounding_by_the_force_bound_gives_the_sheets_numbers() {
    let mut law = EnergyBounding::new(wall(2000.0), BoundingForm::ForceBound(500.0), 1e9, 0.0);
    law.sample(0.0);
    for (x_m, energy_j, force_n) in [(1e-3, 5e-4, 1.0), (2e-3, 2e-3, 2.0), (1e-3, 5e-4, 1.0), (0.0, 0.0, 0.0)] {
        close(law.sample(x_m), force_n, 1e-12);
        close(law.energy_j(), energy_j, 1e-15);
    }
}

#[test]
fn energy_bounding_by_c1_and_c2_gives_the_sheets_numbers() {
    let mut law = EnergyBounding::new(wall(2000.0), BoundingForm::C1C2(500.0, 500.0), 1e9, 0.0);
    law.sample(0.0);
    let forces_n = [0.5, 1.0, 0.822875656, 0.322875656];
    let energies_j = [5e-4, 1.5e-3, 6.77124344e-4, 3.54248689e-4];
    for (x_m, (force_n, energy_j)) in [1e-3, 2e-3, 1e-3, 0.0].into_iter().zip(forces_n.into_iter().zip(energies_j)) {
        close(law.sample(x_m), force_n, 1e-9);
        close(law.energy_j(), energy_j, 1e-12);
    }
}

#[test]
fn energy_bounding_never_gives_more_than_the_devices_damping_takes() {
    let (c, mut random) = (500.0, SplitMix64::new(4));
    for form in [BoundingForm::C1C2(c, c), BoundingForm::C1C2(c, 0.5 * c), BoundingForm::ForceBound(c)] {
        for _ in 0..200 {
            let stiffness_n_per_m = 20_000.0 * (1.0 + any(&mut random));
            let mut law = EnergyBounding::new(wall(stiffness_n_per_m), form, 1e9, 0.0);
            let (mut x_m, mut force_n, mut balance_j, mut exchanged_j) = (0.0, law.sample(0.0), 0.0, 0.0);
            for _ in 0..1000 {
                let motion_m = 1e-3 * any(&mut random);
                x_m += motion_m;
                balance_j += force_n * motion_m + c * motion_m * motion_m;
                exchanged_j += (force_n * motion_m).abs();
                assert!(balance_j >= -1e-12 * exchanged_j, "{form:?} gave {balance_j} J");
                force_n = law.sample(x_m);
            }
        }
    }
}

#[test]
fn the_force_bound_is_tight() {
    // On a steady ramp the displayed stiffness is 2c, the greatest that is passive.
    let mut law = EnergyBounding::new(wall(1e9), BoundingForm::ForceBound(500.0), 1e9, 0.0);
    law.sample(0.0);
    for step in 1..100 {
        let x_m = f64::from(step) * 1e-4;
        close(law.sample(x_m) / x_m, 1000.0, 1e-6);
    }
}

#[test]
fn the_published_observer_sums_as_the_sheet_says() {
    let mut law = PassivityController::new(wall(20.0), Observer::Velocity, f64::INFINITY, 1e9, 0.0);
    for (x, stiffness, energy) in [(0.1, 20.0, 0.2), (0.2, 20.0, 0.6), (0.15, 8.0 / 0.15, 0.2)] {
        law.wall.stiffness_n_per_m = stiffness;
        close(law.sample(x), stiffness * x, 1e-12);
        close(law.energy_j(), energy, 1e-12);
    }
}

#[test]
fn the_controller_pays_a_debt_back_with_the_next_motion() {
    // 10 N are held over a retreat of 2 mm after 1 mm of advance at 5 N: 5 mJ in, 20 mJ out; 15 mJ over 2 mm is 7.5 N.
    let mut law = PassivityController::new(wall(5000.0), Observer::HeldForce, f64::INFINITY, 1e9, 0.0);
    close(law.sample(1e-3), 5.0, 1e-12);
    close(law.sample(2e-3), 10.0, 1e-12);
    close(law.energy_j(), 5e-3, 1e-15);
    close(law.sample(0.0), 0.0 - 7.5, 1e-9);
    close(law.energy_j(), -15e-3, 1e-15);
}

#[test]
fn a_controller_at_standstill_takes_up_nothing_and_forgets_nothing() {
    let mut law = PassivityController::new(wall(5000.0), Observer::HeldForce, f64::INFINITY, 1e9, 0.0);
    for x_m in [1e-3, 2e-3, 0.0] {
        law.sample(x_m);
    }
    let debt_j = law.energy_j();
    for _ in 0..10 {
        close(law.sample(0.0), 0.0, 0.0);
    }
    close(law.energy_j(), debt_j, 0.0);
}

#[test]
fn a_credit_is_bounded_when_asked() {
    let mut law = PassivityController::new(wall(5000.0), Observer::HeldForce, 1e-3, 1e9, 0.0);
    law.sample(1e-3);
    law.sample(3e-3);
    close(law.energy_j(), 1e-3, 0.0);
}

#[test]
fn behind_a_coupling_the_wall_feels_like_both_in_series() {
    let (coupling, environment) = (3000.0, 1500.0);
    let mut law = VirtualCoupling::new(coupling, 4.0, environment, PERIOD_S);
    let force_n = (0..10_000).map(|_| law.sample(2e-3)).last().expect("sampled");
    close(force_n, 2e-3 / (1.0 / coupling + 1.0 / environment), 1e-12);
    let mut rigid = VirtualCoupling::new(coupling, 4.0, f64::INFINITY, PERIOD_S);
    let force_n = (0..10_000).map(|_| rigid.sample(2e-3)).last().expect("sampled");
    close(force_n, 2e-3 * coupling, 1e-12);
}

#[test]
fn a_couplings_force_is_what_the_environment_gives_back() {
    // Both sides of the tool: the coupling's law and the wall's spring.
    let (kc, bc, ke) = (3000.0, 4.0, 1500.0);
    let mut law = VirtualCoupling::new(kc, bc, ke, PERIOD_S);
    let (mut random, mut x_m, mut e_m) = (SplitMix64::new(7), 0.0, 0.0);
    for _ in 0..10_000 {
        x_m = (x_m + 2e-4 * any(&mut random)).clamp(-1e-3, 3e-3);
        let damper = bc / PERIOD_S;
        let free_m = damper * e_m / (kc + damper);
        let touching_m = (ke * x_m + damper * e_m) / (ke + kc + damper);
        e_m = if x_m - free_m > 0.0 { touching_m } else { free_m };
        let tool_m = x_m - e_m;
        close(law.sample(x_m), if x_m - free_m > 0.0 { (ke * tool_m).max(0.0) } else { 0.0 }, 1e-9);
    }
}

#[test]
fn the_passive_spring_keeps_its_ledger_over_a_million_samples_of_any_motion() {
    let mut random = SplitMix64::new(5);
    for revive in [false, true] {
        let mut law = PassiveSpring::new(10_000.0, revive, 0.0);
        let (mut x_m, mut force_n, mut taken_j, mut exchanged_j) = (0.0, law.sample(0.0), 0.0, 0.0);
        for _ in 0..1_000_000 {
            let before_m = x_m;
            x_m = (x_m + 1e-4 * any(&mut random)).clamp(-2e-3, 2e-3);
            taken_j += force_n * (x_m - before_m);
            exchanged_j += (force_n * (x_m - before_m)).abs();
            force_n = law.sample(x_m);
        }
        let residual_j = law.stored_j() - law.engaged_j() - law.overdrawn_j() - taken_j;
        assert!(residual_j.abs() <= 1e-12 * exchanged_j, "{residual_j} J of {exchanged_j} J");
        assert!(exchanged_j > 0.1, "the spring was used: {exchanged_j} J");
    }
}

#[test]
fn a_dead_spring_stays_dead_unless_it_may_revive() {
    for (revive, force_n) in [(false, 0.0), (true, 2.0)] {
        let mut law = PassiveSpring::new(1000.0, revive, -1e-3);
        law.sample(-1e-3);
        law.sample(1e-3);
        // A retreat of 0.6 mm takes out more than was stored: the extension ends at zero, still inside the wall.
        close(law.sample(0.4e-3), 0.0, 0.0);
        assert!(law.overdrawn_j() > 0.0);
        close(law.sample(2e-3), force_n, 1e-12);
    }
}

#[test]
fn scaling_a_linear_spring_is_the_same_as_another_stiffness() {
    let mut random = SplitMix64::new(6);
    let mut scaled = PassiveSpring::new(1000.0, true, 0.0);
    scaled.beta = 1.0 / 40.0;
    let mut soft = PassiveSpring::new(25.0, true, 0.0);
    let mut x_m = 0.0;
    for _ in 0..10_000 {
        x_m = (x_m + 1e-4 * any(&mut random)).clamp(-1e-3, 2e-3);
        close(scaled.sample(x_m), soft.sample(x_m), 1e-15);
    }
}

#[test]
fn the_midpoint_spring_loses_nothing_where_the_plain_hold_gains() {
    let spring = MidpointSpring { stiffness_n_per_m: 400.0, mass_kg: 1.0, period_s: PERIOD_S };
    let start = (0.1, 0.0);
    let end = (0..100_000).fold(start, |state, _| spring.step(state));
    assert!((spring.energy_j(end) / spring.energy_j(start) - 1.0).abs() < 1e-12);
    let mut law = wall(400.0);
    let (mut q_m, mut v_m_per_s) = start;
    for _ in 0..1000 {
        // The wall is bilateral here: at negative positions the force of the mirrored position acts.
        let a = -q_m.signum() * law.force_n(q_m.abs());
        q_m += PERIOD_S * (v_m_per_s + 0.5 * a * PERIOD_S);
        v_m_per_s += a * PERIOD_S;
        law.sample(0.0);
    }
    close(spring.energy_j((q_m, v_m_per_s)) / spring.energy_j(start), 1.216871351, 1e-9);
}

#[test]
fn the_high_pass_has_the_sheets_coefficients() {
    let wanted = [0.988954248067, -1.97790849613, 0.988954248067, -1.97778648378, 0.978030508492];
    for (found, wanted) in high_pass(2.5, PERIOD_S).into_iter().zip(wanted) {
        close(found, wanted, 5e-12);
    }
}

#[test]
fn a_pulse_comes_out_shaped_and_ends_with_itself() {
    let mut law = InputShaper::new(AnyLaw::Wall(wall(1.0)), 2.5, PERIOD_S);
    let (mut most, mut at) = (0.0, 0);
    for n in 0..1000 {
        let force_n = law.sample(1.0);
        assert!(
            (0.0..=1.0 + 1e-12).contains(&force_n),
            "between nothing and its input, while the high-pass is positive"
        );
        if force_n > most {
            (most, at) = (force_n, n);
        }
    }
    close(law.sample(-1.0), 0.0, 0.0);
    // The high-pass of a step crosses zero at 70.7 ms; from then on the step passes unchanged.
    close(most, 1.0, 1e-12);
    assert!((65..=75).contains(&at), "{at} ms");
}

#[test]
fn dual_rate_sampling_divides_the_velocitys_quantum() {
    let (count_m, fast_s) = (1e-5, 1e-4);
    let mut plain = Wall::new(0.0, 1.0, 1, fast_s, 0.0);
    let mut dual = Wall::new(0.0, 1.0, 10, fast_s, 0.0);
    let mut seen = [0.0f64; 2];
    for n in 0..1000 {
        // One count every seven samples.
        let x_m = f64::from(n / 7) * count_m;
        seen = [seen[0].max(plain.sample(x_m)), seen[1].max(dual.sample(x_m))];
    }
    close(seen[0], count_m / fast_s, 1e-12);
    close(seen[1], 2.0 * count_m / (10.0 * fast_s), 1e-12);
}
