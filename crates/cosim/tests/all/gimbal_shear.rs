//! Shear, texture and random profiles of the segment on a gimbal, against closed forms of the fractional derivative.

use hpu_cosim::scene::GimbalScene;
use hpu_cosim::{Control, Driver, GIMBAL_REALS, GimbalSimulation, Simulation, Verdict, Wired, stress_error_pa};

use crate::gimbal::{column, refusal, run, scene};

/// A roll at a constant speed from 0 on. The target moves along x by the sine `-58 mm sin(SPEED t)`.
const RAMP: &str = "{ kind = 'path', rate = '100 kHz', path = [[0, '12.5 mm', 0, 0], [3, '12.5 mm', 0, 0.3]] }";
const SPEED_RAD_PER_S: f64 = 0.1;
const RADIUS_M: f64 = 58e-3;

/// Returns the fractional derivative of `-58 mm sin(SPEED t)` that begins at 0: the power series of the sine, of which
/// `Dᵅ tⁿ = n! / Γ(n + 1 - α) tⁿ⁻ᵅ`.
fn derivative(order: f64, time_s: f64) -> f64 {
    let term = |index: i32| {
        let power = f64::from(2 * index + 1);
        let sign = if index % 2 == 0 { -1.0 } else { 1.0 };
        sign * SPEED_RAD_PER_S.powf(power) * time_s.powf(power - order) / libm::tgamma(power + 1.0 - order)
    };
    RADIUS_M * (0..12).map(term).sum::<f64>()
}

fn sheared(order: &str, set: &[(&str, &str)]) -> GimbalScene {
    let common = [("shear.order", order), ("target", RAMP), ("run.duration", "2 s")];
    scene("gimbal-shear", &[&common, set].concat())
}

/// 5 kPa.s · 3 cm2 / (500 N/m · 10 mm).
const GAIN: f64 = 0.3;

#[test]
fn the_displacement_is_the_fractional_derivative_to_the_second_order_of_the_step() {
    // The centred sum is D^a (1 + a (h D)^2 / 24 ..): of the sine a share of (h w)^2, of its begin less than
    // (h / t)^2 / 5. A sum that is not centred would be wrong by a h / (2 t) (1 - a), 100 times more.
    for (text, order) in [("0.5", 0.5), ("0.8", 0.8), ("1.2", 1.2), ("1.5", 1.5)] {
        let displacement = sheared(text, &[]).displacement().expect("shear");
        for time_s in [0.5, 1.0, 1.5, 2.0] {
            let exact_m = GAIN * derivative(order, time_s);
            let bound = 0.2 * (0.01 / time_s).powi(2) + (0.01 * SPEED_RAD_PER_S).powi(2);
            let miss = (displacement.at(time_s) / exact_m - 1.0).abs();
            assert!(miss < bound, "order {order} at {time_s} s: {miss}, at most {bound}");
        }
    }
}

#[test]
fn the_datapath_takes_the_fractional_derivative_of_the_samples_within_its_memory() {
    // 2 s have 200 samples, and all of them count. The datapath's sum is that of a/2 samples before, of targets that
    // are up to 10 us old. A target's word is half an LSB off, the weights are together 2 max(1, a); the gain has
    // 2^-12.
    for (text, order) in [("0.5", 0.5), ("0.8", 0.8), ("1.2", 1.2), ("1.5", 1.5)] {
        let scene = sheared(text, &[]);
        let simulation = GimbalSimulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
        let mut trace = simulation.trace(&["shear_x"]);
        simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
        let lsb_m = scene.method.config.gimbal.length.lsb();
        let gain = simulation.words().shear_gain as f64 / 4096.0;
        for sample in [50, 100, 150, 195] {
            // A row in the middle of the sample period.
            let word = trace.words(0)[10 * sample + 5];
            let time_s = 0.01 * (sample as f64 - 0.5 * order);
            let of = |time_s: f64| GAIN * derivative(order, time_s);
            let exact_m = of(time_s);
            let rate = (of(time_s) - of(time_s - 1e-4)).abs() / 1e-4;
            let bound_m = exact_m.abs() * (0.2 * (0.01 / time_s).powi(2) + 1e-6 + 0.5 / (4096.0 * gain))
                + 1.1e-5 * rate
                + lsb_m * (0.5 + gain * order.max(1.0));
            let miss_m = word as f64 * lsb_m - exact_m;
            assert!(miss_m.abs() < bound_m, "order {order}, sample {sample}: {miss_m} m, at most {bound_m} m");
        }
    }
}

#[test]
fn a_short_memory_leaves_out_no_more_than_its_bound() {
    // The bound is that of the greatest |x|; the target's |x| only grows.
    for (order, memory) in [("0.5", "20"), ("1.5", "20")] {
        let last = |memory: &str| {
            let scene = sheared(order, &[("shear.memory", memory)]);
            let simulation = GimbalSimulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
            let mut trace = simulation.trace(&["shear_x"]);
            simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
            let scale_m = scene.method.config.gimbal.length.lsb();
            let gain = simulation.words().shear_gain as f64 / 4096.0;
            (*trace.words(0).last().expect("rows") as f64 * scale_m, gain)
        };
        let [(whole_m, gain), (short_m, _)] = ["254", memory].map(last);
        let share = hpu_datapath::fractional_difference::memory_bound(order.parse().unwrap(), memory.parse().unwrap());
        let most_m = gain * share * RADIUS_M * libm::sin(0.2);
        let left_out_m = (whole_m - short_m).abs();
        assert!(left_out_m < most_m && left_out_m > 0.05 * most_m, "{order}: {left_out_m} m of {most_m} m");
    }
}

#[test]
fn the_rendered_stress_is_the_asked_one_through_the_servos_lag() {
    // A sampled loop: the error of a sample, whose derivative is that of the sample before, drives the servo at w0 K1
    // from the second instant of the bus on. The position is known to half a count, 2.56 mrad; half a drive LSB is
    // 1 / 2048 / 1.5 rad; gravity asks for 0.05 kg 9.81 m/s2 3 mm / (5.3 N.m 1.5); the servo's inertia of 4 g.m2 is a
    // lag of 5 ms, in which the tip moves by at most 3 mm (5 mm/s).
    for order in ["0.5", "0.8", "1.2", "1.5"] {
        let scene = scene("gimbal-shear", &[("shear.order", order)]);
        let simulation = GimbalSimulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
        let mut trace = simulation.trace(&["shear_x"]);
        let summary = simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
        assert!(matches!(summary.verdict, Some(Verdict::Tracking { .. })), "{order}");
        let [asked, rendered] = ["asked_stress_pa", "rendered_stress_pa"].map(|name| trace.real(column(name)));
        let per_m = 500.0 / 3e-4;
        let lsb_pa = per_m * scene.method.config.gimbal.length.lsb();
        let bound_pa = per_m * (RADIUS_M * (2.56e-3 + 0.33e-3 + 0.19e-3) + 5e-3 * 5e-3);
        let (mut lagged, mut held, mut drive) = (0.0, 0.0, 0.0);
        for (row, rendered_pa) in rendered.iter().enumerate() {
            if row % 10 == 2 {
                let sample = row - 2;
                let before = sample.checked_sub(1).map_or(0, |before| trace.words(0)[before]);
                drive = 6.702 * 1.5 * (before as f64 * lsb_pa - held);
            }
            if row % 10 == 0 {
                held = lagged;
            }
            lagged += 1e-3 * drive;
            let miss_pa = rendered_pa - lagged;
            assert!(miss_pa.abs() < bound_pa, "{order}, row {row}: {miss_pa} Pa, at most {bound_pa}");
        }
        let greatest = asked.iter().fold(0.0f64, |most, stress| most.max(stress.abs()));
        assert!(greatest > 8.0 * bound_pa, "{order}: {greatest} Pa");
        let [mean_pa, deviation_pa] = stress_error_pa(&trace);
        println!("order {order}: asked up to {greatest} Pa, error {mean_pa} Pa, deviation {deviation_pa} Pa");
        assert!(mean_pa > 0.0 && mean_pa < 0.2 * greatest && deviation_pa < mean_pa, "{order}: {mean_pa} Pa");
    }
}

#[test]
fn events_and_clock_agree_under_shear() {
    let set = [("clock.frequency", "2 MHz"), ("method.sample_rate", "1 kHz"), ("run.duration", "0.6 s")];
    let scene = scene("gimbal-shear", &set);
    let simulation = GimbalSimulation::new(&scene).unwrap_or_else(|error| panic!("{error}"));
    let comparison = simulation.compare(1_200_000);
    assert_eq!((comparison.mismatches, comparison.edges), (0, 1_200_000), "{:?}", comparison.first);
}

#[test]
fn only_a_scene_with_shear_has_stresses() {
    let names = |scene: &GimbalScene| -> Vec<_> {
        let simulation = GimbalSimulation::new(scene).unwrap_or_else(|error| panic!("{error}"));
        assert!(simulation.reals().iter().all(|real| GIMBAL_REALS.iter().any(|other| other.name == real.name)));
        let row = simulation.row();
        let columns: Vec<_> = simulation.columns().into_iter().map(|column| row[column].name).collect();
        let reals = simulation.reals().iter().map(|real| real.name);
        assert!(columns.iter().copied().zip(reals).all(|(column, real)| column == real));
        columns
    };
    let (with, without) = (names(&scene("gimbal-shear", &[])), names(&scene("gimbal-shape", &[])));
    let stresses = ["asked_stress_pa", "rendered_stress_pa"];
    assert_eq!(with.iter().filter(|name| !stresses.contains(name)).copied().collect::<Vec<_>>(), without);
    assert_eq!(with.len(), without.len() + 2);
}

/// A run without files keeps only the outputs that the summary needs; the stresses are among them.
#[test]
fn the_error_of_the_stress_is_told_without_a_recording() {
    let scene = scene("gimbal-shear", &[("run.duration", "0.5 s")]);
    let simulation = GimbalSimulation::new(&scene).expect("possible");
    let [brief, whole] = [simulation.brief_trace(), simulation.trace(&[])].map(|mut trace| {
        simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
        stress_error_pa(&trace)
    });
    assert_eq!(brief, whole);
}

#[test]
fn an_order_becomes_the_nearest_fraction() {
    for (order, fraction) in [
        ("0.5", [1, 2]),
        ("1.2", [6, 5]),
        ("0.3333333333", [1, 3]),
        ("1", [1, 1]),
        ("0.001", [1, 1000]),
        ("1.999", [1999, 1000]),
        ("1.41421356", [1393, 985]),
    ] {
        let scene = scene("gimbal-shear", &[("shear.order", order), ("shear.viscosity", "1 kPa.s")]);
        assert_eq!(scene.shear.expect("shear").order, fraction, "{order}");
        assert_eq!(scene.method.config.shear.order, fraction, "{order}");
    }
}

#[test]
fn a_texture_passes_under_a_resting_finger_at_the_published_speed() {
    let scene = scene("gimbal-texture", &[]);
    let (summary, trace) = run(&scene);
    assert!(matches!(summary.verdict, Some(Verdict::Tracking { .. })));
    // Impedance control never has the crank, and the finger never leaves the segment.
    assert_eq!(summary.contact_share, Some(0.0));
    let force_n = trace.real(column("finger_force_n"));
    assert!(force_n[1000..].iter().all(|force_n| (0.05..0.5).contains(force_n)));
    // 0.5 s after the turn began the lag has settled to e^-5. Both ends are known to half a count of 0.3 mm.
    let pitch_rad = |row: usize| {
        let [x, y, z] = ["tip_x_m", "tip_y_m", "tip_z_m"].map(|name| trace.real(column(name))[row]);
        z.atan2(x.hypot(y))
    };
    for (from, to) in [(1500, 2000), (3500, 4000), (5500, 6000)] {
        let speed_m_per_s = RADIUS_M * (pitch_rad(to) - pitch_rad(from)).abs() / 0.5;
        assert!((speed_m_per_s - 38.5e-3).abs() < 0.3e-3 / 0.5 + 0.5e-3, "{from}: {speed_m_per_s} m/s");
    }
}

#[test]
fn ten_profiles_differ_and_are_followed_by_the_lag_of_the_servos() {
    let mut errors_m = Vec::new();
    for seed in 1..=10 {
        // 6 s hold three of the ten random points.
        let (summary, _) = run(&scene("gimbal-profile", &[("run.seed", &seed.to_string()), ("run.duration", "6 s")]));
        let Some(Verdict::Tracking { rms_m, .. }) = summary.verdict else { panic!("{seed}: {:?}", summary.verdict) };
        // The quintic is at most 15/8 times as fast as the straight line, which is at most 60 degrees in 2 s for each
        // tilt; the lag is 0.1 s, and the height's adds less than 1 mm.
        assert!(rms_m > 1e-4 && rms_m < 0.1 * 1.875 * RADIUS_M * 1.1 * 0.524 * 1.42 + 1e-3, "{seed}: {rms_m} m");
        assert!(!errors_m.contains(&rms_m), "{seed}");
        errors_m.push(rms_m);
    }
    println!("{errors_m:?}");
}

#[test]
fn an_impossible_shear_is_refused_where_it_stands() {
    for (set, expected) in [
        (("shear.order", "0"), "shear.order: `0` must be above zero"),
        (("shear.order", "2"), "accepted: 0.001 to 1.999"),
        (("shear.order", "-1"), "shear.order: `-1` must be above zero"),
        (("shear.order", "2.5"), "accepted: 0.001 to 1.999"),
        (("shear.viscosity", "1 MPa.s"), "does not fit (0,12,12); write at most"),
        (("shear.viscosity", "0.1 mPa.s"), "rounds to zero in (0,12,12)"),
        (("shear.viscosity", "200 kPa.s"), "out of the device's reach"),
        (("shear.memory", "1"), "2 to 254"),
        (("shear.memory", "255"), "2 to 254"),
        (("shear.skin", "0"), "shear.skin: `0` must be above zero"),
        (("shear.area", "3 cm"), "shear.area"),
        (("target", "{ kind = 'path', path = [[0, '12 mm', 0, '1 deg']] }"), "begins with a roll of 1 degrees"),
        (("shear", "{ order = 1 }"), "shear.viscosity"),
    ] {
        let message = refusal("gimbal-shear", &[set]).expect("refused");
        assert!(message.contains(expected), "{set:?}: {message}");
    }
    // The kinematics alone take 96 clocks.
    let fast = [("method.sample_rate", "300 kHz"), ("shear.viscosity", "10 Pa.s")];
    let message = refusal("gimbal-shear", &fast).expect("refused");
    assert!(message.contains("a sample every 167 clocks, but the datapath takes 256"), "{message}");
    assert_eq!(refusal("gimbal-shear", &[&fast[..], &[("shear.memory", "100")]].concat()), None);
}
