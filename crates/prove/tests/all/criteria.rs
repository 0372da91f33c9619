//! The published criteria against the known answers of their papers, and the exact criteria against the emulator.

use hpu_cosim::LinearLoop;
use hpu_cosim::scene::Scene;
use hpu_prove::SampledLoop;
use hpu_prove::criteria::{self, Criterion, Region, Rigid, describing_function, stable_amplitude};
use hpu_prove::linear::{Damping, Stretch, usual_range};

/// Table 1 of the PHANToM's paper: b 0.005 N·s/m, f_c 0.038 N, a count of 29.1 µm, T 1 ms.
const PHANTOM: Rigid = Rigid {
    inertia_kg_m2: 0.075,
    damping_nm_s_per_rad: 0.005,
    coulomb_nm: 0.038,
    quantum_rad: 29.1e-6,
    period_s: 1e-3,
    delay_s: 0.0,
    wall_damping_nm_s_per_rad: 0.0,
};

fn scene(text: &str, overrides: &[(&str, String)]) -> Scene {
    let overrides: Vec<_> = overrides.iter().map(|(key, value)| (key.to_string(), value.clone())).collect();
    Scene::parse("criteria.toml", text, &overrides, &mut |_| unreachable!("no file is named"))
        .unwrap_or_else(|e| panic!("{e}"))
}

/// Returns a linear scene of this device and hand.
fn linear(device: &str, hand: &str, overrides: &[(&str, String)]) -> Scene {
    let text = format!(
        r#"
about = "A wall by the linear law."
device = {device}
clock = {{ frequency = "1 MHz" }}
method = {{ kind = "conventional", sample_rate = "1 kHz" }}
wall = {{ position = 0, stiffness = 1000 }}
hand = {hand}
model = {{ datapath = "linear" }}
run = {{ duration = "1 s" }}
"#
    );
    scene(&text, overrides)
}

const NONE: &str = "{ kind = \"none\" }";

fn told(scene: &Scene, name: &str) -> Criterion {
    let all = criteria::all(scene);
    all.into_iter().flatten().find(|criterion| criterion.name == name).unwrap_or_else(|| panic!("{name}"))
}

#[track_caller]
fn near(got: f64, expected: f64, relative: f64) {
    assert!((got - expected).abs() <= relative * expected.abs(), "got {got}, expected {expected}");
}

#[test]
fn the_phantom_s_friction_and_damping_allow_what_its_paper_says() {
    let (sampling, quantum) = PHANTOM.abbott_okamura();
    near(sampling, 10.0, 1e-12);
    near(quantum, 2611.68385, 2e-9);
    for (rate_hz, allowed) in [(20e3, 200.0), (100e3, 1000.0), (400e3, 4000.0)] {
        near(Rigid { period_s: 1.0 / rate_hz, ..PHANTOM }.abbott_okamura().0, allowed, 1e-12);
    }
}

#[test]
fn at_1000_n_per_m_the_phantom_is_stable_below_47_mm_per_s() {
    let balance = PHANTOM.balance(1000.0);
    near(balance.beta, 0.005, 1e-12);
    near(balance.sigma, 1.30584192, 4e-9);
    near(balance.critical_rad_per_s.expect("one of two is met"), 0.0473737374, 1e-9);
    assert_eq!(balance.region, Region::LocallyStable);
}

#[test]
fn the_four_regions_lie_where_damping_and_friction_suffice_or_not() {
    let body = |damping: f64, coulomb: f64| Rigid { damping_nm_s_per_rad: damping, coulomb_nm: coulomb, ..PHANTOM };
    // At K = 1000 N/m and T = 1 ms, beta and sigma are 1/2 at b = 0.5 and f_c = 0.01455.
    for (damping, coulomb, region) in [
        (0.51, 0.0147, Region::Passive),
        (0.49, 0.0147, Region::LocallyStable),
        (0.51, 0.0144, Region::LimitCycle),
        (0.49, 0.0144, Region::Unstable),
    ] {
        let balance = body(damping, coulomb).balance(1000.0);
        assert_eq!(balance.region, region);
        let Some(speed) = balance.critical_rad_per_s else {
            assert!(matches!(region, Region::Passive | Region::Unstable));
            continue;
        };
        // In one sample at this speed, damping and friction take the energy that sampling and quantum generate.
        let (k, t, step) = (1000.0, 1e-3, 29.1e-6);
        let generated = 0.5 * k * speed * speed * t * t + 0.5 * k * step * speed * t;
        near(damping * speed * speed * t + coulomb * speed * t, generated, 1e-9);
        assert!(speed > 0.0);
    }
    // A delay of one sample asks for three times the damping.
    let late = Rigid { delay_s: 1e-3, ..body(1.51, 0.0147) };
    assert_eq!(late.balance(1000.0).region, Region::Passive);
    assert_eq!(Rigid { damping_nm_s_per_rad: 1.49, ..late }.balance(1000.0).region, Region::LocallyStable);
    near(late.diolaiti().0, 1510.0 / 1.5, 1e-12);
}

#[test]
fn a_position_without_a_quantum_asks_for_no_friction() {
    for coulomb_nm in [0.0, 0.038] {
        let body = Rigid { quantum_rad: 0.0, coulomb_nm, ..PHANTOM };
        assert_eq!(body.abbott_okamura().1, f64::INFINITY);
        assert_eq!((body.balance(9.9).region, body.balance(10.1).region), (Region::Passive, Region::LocallyStable));
    }
}

#[test]
fn passivity_costs_the_wall_s_damping_and_the_delay_s_lag() {
    let body = Rigid { damping_nm_s_per_rad: 0.8, ..PHANTOM };
    near(body.colgate_schenkel(), 1600.0, 1e-12);
    near(Rigid { wall_damping_nm_s_per_rad: 0.4, ..body }.colgate_schenkel(), 800.0, 1e-12);
    for samples in 0..5 {
        let late = Rigid { delay_s: f64::from(samples) * 1e-3, ..body };
        let limit = late.colgate_schenkel();
        // b = max over w of (T/2) / (1 - cos wT) Re{(1 - e^-jwT) K e^-jdwT}: the frequency condition itself.
        let needed = |angle: f64| {
            let (p, q, lag) = (1.0 - angle.cos(), angle.sin(), f64::from(samples) * angle);
            0.5e-3 / p * limit * (p * lag.cos() + q * lag.sin())
        };
        let most = (1..=100_000).map(|n| needed(f64::from(n) * 1e-5 * std::f64::consts::PI)).fold(f64::MIN, f64::max);
        near(most, 0.8, 1e-7);
    }
}

#[test]
fn a_dropped_phantom_comes_to_rest_on_the_known_stiffness() {
    let body = Rigid { inertia_kg_m2: 0.09, ..PHANTOM };
    near(body.drop_threshold(0.15).expect("it falls"), 9785.13552, 1e-9);
    // Lags that the papers' platforms suggest, to the whole newtons of the table.
    for (period_s, delay_s, expected, digits) in [
        (1e-3, 1e-3, 1087.23728, 1e-8),
        (1e-3, 1.1e-3, 956.0, 6e-4),
        (0.2e-3, 1.1e-3, 1699.0, 4e-4),
        (50e-6, 1.1e-3, 1933.0, 3e-4),
        (10e-6, 0.64e-3, 5880.0, 1e-4),
    ] {
        near(Rigid { period_s, delay_s, ..body }.drop_threshold(0.15).expect("it falls"), expected, digits);
    }
    assert_eq!(body.drop_threshold(0.038), None);
}

#[test]
fn a_scene_with_a_weight_has_the_drop_s_threshold_and_one_without_says_why_not() {
    let device = "{ kind = \"mass\", mass = 0.09, damping = 0.005, coulomb = 0.038 }";
    let dropped = linear(device, "{ kind = \"constant_torque\", torque = 0.15 }", &[]);
    let criterion = told(&dropped, "drop_threshold");
    near(criterion.limit, 9785.13552, 1e-9);
    assert_eq!(criterion.unit, "N/m");
    // The linear law also pulls.
    assert!(!criterion.assumptions_met());
    let held = linear(device, "{ kind = \"constant_torque\", torque = 0.03 }", &[]);
    for (scene, why) in [(linear(device, NONE, &[]), "constant effort"), (held, "friction holds")] {
        let all = criteria::all(&scene);
        let reason = &all.iter().flat_map(|told| told.as_ref().err()).find(|silent| silent.name == "drop_threshold");
        let reason = &reason.expect("silent").why;
        assert!(reason.contains(why), "{reason}");
    }
}

#[test]
fn the_describing_function_has_its_known_values() {
    assert_eq!(describing_function(0.5), 0.0);
    near(describing_function(0.5f64.sqrt()), 1.27323954, 4e-9);
    near(describing_function(1.0), 1.10265779, 5e-9);
    near(describing_function(2.0), 1.03748884, 5e-9);
    // The definition: the first harmonic of the rounded sine.
    for amplitude in [0.6, 1.0, 1.4, 2.3, 7.9] {
        let steps = 200_000;
        let sum: f64 = (0..steps)
            .map(|n| {
                let sine = (std::f64::consts::TAU * (f64::from(n) + 0.5) / f64::from(steps)).sin();
                (amplitude * sine + 0.5).floor() * sine
            })
            .sum();
        near(describing_function(amplitude), 2.0 * sum / (f64::from(steps) * amplitude), 2e-4);
    }
}

#[test]
fn a_stable_swing_s_amplitude_solves_the_describing_function() {
    // The sheet's 0.98849 has four digits: its N is 1.11113, while N of 0.98852 is 1/0.9.
    near(stable_amplitude(1.0 / 0.9).expect("a swing"), 0.9885, 5e-5);
    for step in 0..=40 {
        let gain = 0.801 + (1.2732 - 0.801) * f64::from(step) / 40.0;
        let amplitude = stable_amplitude(gain).expect("within the first threshold's fall");
        near(describing_function(amplitude), gain, 1e-12);
        // A larger oscillation meets less gain.
        assert!(describing_function(amplitude * 1.001) < gain);
    }
    assert_eq!(stable_amplitude(1.2733), None);
    assert_eq!(stable_amplitude(0.79), None);
}

#[test]
fn a_quantiser_swings_from_pi_quarters_of_the_critical_stiffness_on() {
    let device = "{ kind = \"mass\", mass = 0.1, damping = 5 }";
    let at = |stiffness: f64| linear(device, NONE, &[("wall.stiffness", stiffness.to_string())]);
    let critical = 10084.0301;
    let criterion = told(&at(critical * 0.9), "describing_function");
    near(criterion.limit, std::f64::consts::FRAC_PI_4 * critical, 6e-9);
    // The amplitude obeys K N(A) = K_crit.
    near(describing_function(criterion.figures[0].value), 1.0 / 0.9, 1e-8);
    // On a softer wall the motion comes to rest.
    assert!(told(&at(0.78 * critical), "describing_function").figures.is_empty());
    // The wall's damping passes the same quantiser: with both gains times 4/π the exact loop is at its border.
    let damped = linear(device, NONE, &[("wall.damping", "2".into())]);
    let onset = told(&damped, "describing_function").limit;
    let gain = 4.0 / std::f64::consts::PI;
    let border = linear(device, NONE, &[("wall.damping", (2.0 * gain).to_string())]);
    near(onset * gain, told(&border, "spectral_radius").limit, 1e-9);
}

#[test]
fn a_motor_is_a_body_that_its_back_emf_brakes() {
    let motor = "{ kind = \"motor\", motor = \"vasudevan_2007\", coulomb_friction = 1e-3 }";
    let scene = linear(motor, NONE, &[("wall.stiffness", "1".into())]);
    let body = Rigid::new(&scene);
    near(body.damping_nm_s_per_rad, 1.3e-6 + 2.85979167e-4, 1e-5);
    near(body.quantum_rad, 1.533981e-3, 1e-6);
    let criterion = told(&scene, "abbott_okamura");
    near(criterion.limit, 2.0 * body.damping_nm_s_per_rad / 1e-3, 1e-12);
    near(criterion.figures[1].value, 2e-3 / body.quantum_rad, 1e-12);
    assert_eq!((criterion.unit, criterion.assumptions_met()), ("N.m/rad", false));
    let unmet: Vec<_> = criterion.assumptions.iter().filter(|assumption| !assumption.met).map(|a| a.text).collect();
    assert!(unmet.iter().any(|text| text.contains("ideal force or current")), "{unmet:?}");
}

#[test]
fn routh_s_limit_counts_a_hand_that_holds_the_shaft() {
    let hand = "{ kind = \"spring_damper\", stiffness = 0.4, damping = 2e-4, path = [[0, 0]] }";
    let hybrid = [("method.kind", "hybrid".to_string()), ("wall.stiffness", "1".into())];
    let scene = linear("{ kind = \"motor\", motor = \"vasudevan_2007\" }", hand, &hybrid);
    let settling = Stretch::softest(&scene, Damping::Fixed(0.0), usual_range(&scene)).expect("a linear loop");
    near(settling.expect("a stretch").to.middle(), told(&scene, "routh").limit, 1e-9);
    assert!(told(&scene, "routh").assumptions_met());
}

/// The emulator's boundary in the domain where the exact criterion is valid: linear, unquantised, bilateral.
#[test]
fn the_emulated_boundary_is_that_of_the_exact_loop_over_bodies_periods_delays_and_hands() {
    let mut scenes = 0;
    let held = |stiffness: f64, damping: f64| {
        format!("{{ kind = \"spring_damper\", stiffness = {stiffness}, damping = {damping}, path = [[0, 0]] }}")
    };
    for device in [
        "{ kind = \"mass\", mass = 0.02, damping = 0.5 }",
        "{ kind = \"mass\", mass = 0.1, damping = 5 }",
        "{ kind = \"mass\", mass = 1, damping = 2 }",
    ] {
        for hand in [NONE.to_string(), held(50.0, 0.3), held(800.0, 4.0)] {
            for (rate, delay) in [("1 kHz", "0 s"), ("1 kHz", "1.3 ms"), ("10 kHz", "0.25 ms")] {
                for damping in ["0", "0.8"] {
                    agrees(
                        device,
                        &hand,
                        &[("wall.damping", damping), ("method.sample_rate", rate), ("model.delay", delay)],
                    );
                    scenes += 1;
                }
            }
        }
    }
    for hand in [NONE.to_string(), held(0.3, 1e-4), held(2.0, 1e-3)] {
        for kind in ["conventional", "hybrid"] {
            for damping in ["0", "1e-4"] {
                agrees(
                    "{ kind = \"motor\", motor = \"vasudevan_2007\" }",
                    &hand,
                    &[("method.kind", kind), ("wall.damping", damping)],
                );
                scenes += 1;
            }
        }
    }
    assert!(scenes >= 50, "{scenes}");
}

#[track_caller]
fn agrees(device: &str, hand: &str, overrides: &[(&str, &str)]) {
    let mut overrides: Vec<_> = overrides.iter().map(|(key, value)| (*key, value.to_string())).collect();
    // The range examined is from a thousandth to a thousand times this stiffness.
    overrides.push(("wall.stiffness", if device.contains("motor") { "1".into() } else { "1000".into() }));
    let scene = linear(device, hand, &overrides);
    let exact = told(&scene, "spectral_radius").limit;
    for (side, settles) in [(0.999, true), (1.001, false)] {
        let law = LinearLoop::new(&scene, side * exact, scene.wall.damping_nm_s_per_rad);
        let growth = law.growth_per_s(1 << 18);
        assert_eq!(growth < 0.0, settles, "{growth} at {side} of {exact}: {device} {hand} {overrides:?}");
        let radius = SampledLoop::new(&scene, side * exact, scene.wall.damping_nm_s_per_rad).spectral_radius();
        assert_eq!(radius < 1.0, settles, "{radius} at {side} of {exact}: {device} {hand} {overrides:?}");
    }
}
