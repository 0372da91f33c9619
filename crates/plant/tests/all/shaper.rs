//! The analog input shaper against the frequency table, the step and the pulse of its data sheet.

use std::f64::consts::{PI, SQRT_2};

use hpu_plant::{Axis, Device, Hand, Motor, Shaper};

const CUTOFF_HZ: f64 = 2.5;

fn close(got: f64, expected: f64, tolerance: f64) {
    assert!((got - expected).abs() <= tolerance, "got {got}, expected {expected}");
}

#[test]
fn a_unit_step_overshoots_by_exp_of_minus_half_pi() {
    let step = Shaper::new(CUTOFF_HZ).stepped(1.0);
    let through = |t_s: f64| {
        let shaper = step.after(t_s);
        shaper.input() - shaper.high_pass()
    };
    let crest_s = SQRT_2 / 10.0;
    close(through(crest_s), 1.207_879_58, 1e-8);
    close(through(crest_s), 1.0 + (-0.5 * PI).exp(), 1e-15);
    for delta_s in [1e-3, 1e-4] {
        assert!(through(crest_s - delta_s) < through(crest_s) && through(crest_s + delta_s) < through(crest_s));
    }
    // The high-pass filter's output passes zero halfway; from there on its rectifier subtracts nothing.
    assert!(step.after(0.070_710_6).high_pass() > 0.0 && step.after(0.070_710_8).high_pass() < 0.0);
    assert_eq!(step.output(), 0.0);
    assert_eq!(step.after(0.1).output(), 1.0);
}

#[test]
fn the_flow_is_the_same_in_one_leap_and_in_many() {
    let start = Shaper::new(CUTOFF_HZ).stepped(0.7).after(0.013).stepped(-0.2);
    let mut small = start;
    for _ in 0..1000 {
        small = small.after(1e-4);
    }
    close(small.high_pass(), start.after(0.1).high_pass(), 1e-13);
    // A quarter of an hour later the output has decayed to 0.
    assert_eq!(start.after(900.0).high_pass(), 0.0);
}

/// Returns gain and phase, in degrees, of `1 - G` at a frequency: from the sampled response to a staircase of this
/// number of steps per period.
fn through(frequency_hz: f64, steps: usize) -> (f64, f64) {
    let period_s = 1.0 / frequency_hz;
    let step_s = period_s / steps as f64;
    let mut shaper = Shaper::new(CUTOFF_HZ);
    let settle = (4.0 / period_s).ceil() as usize + 2;
    let (mut re, mut im) = (0.0, 0.0);
    for n in 0..(settle + 1) * steps {
        let phase = 2.0 * PI * n as f64 / steps as f64;
        shaper = shaper.stepped(phase.sin());
        if n >= settle * steps {
            // The sum of the sampled output: Σ y e^{-jφ}.
            let y = shaper.input() - shaper.high_pass();
            re += y * phase.cos();
            im -= y * phase.sin();
        }
        shaper = shaper.after(step_s);
    }
    // sin is Im e^{jφ}: its own sum is -j steps / 2.
    let half = steps as f64 / 2.0;
    let (a, b) = (-im / half, re / half);
    (a.hypot(b), b.atan2(a).to_degrees())
}

#[test]
fn the_high_pass_s_complement_has_the_known_gains_and_phases() {
    for (frequency_hz, gain, phase) in [
        (1.0, 1.134_482_9, -4.461_497),
        (2.5, 1.224_744_9, -35.264_390),
        (10.0, 0.358_335_97, -79.362_344),
        (100.0, 0.035_360_856, -88.986_617),
        (130.0, 0.027_198_927, -89.220_640),
    ] {
        // The error of N steps per period falls with 1/N; Richardson's rule removes that term and leaves a small
        // multiple of 1/N².
        let (coarse, fine) = (through(frequency_hz, 2000), through(frequency_hz, 4000));
        close(2.0 * fine.0 - coarse.0, gain, 1e-5 * gain);
        close(2.0 * fine.1 - coarse.1, phase, 1e-3);
    }
}

#[test]
fn a_square_pulse_stays_below_its_input_and_drops_to_zero_with_it() {
    let mut shaper = Shaper::new(CUTOFF_HZ).stepped(1.0);
    let mut before = shaper;
    for _ in 0..400 {
        assert!((0.0..=1.0).contains(&shaper.output()));
        before = shaper;
        shaper = shaper.after(1e-3);
    }
    assert!(before.output() > 0.9);
    shaper = shaper.stepped(0.0);
    for _ in 0..400 {
        assert_eq!(shaper.output(), 0.0);
        shaper = shaper.after(1e-3);
    }
}

#[test]
fn a_pull_is_no_force_at_all() {
    let mut shaper = Shaper::new(CUTOFF_HZ).stepped(-0.5);
    for _ in 0..1000 {
        assert_eq!(shaper.output(), 0.0);
        shaper = shaper.after(1e-3);
    }
}

#[test]
fn the_slope_bound_is_the_variation_of_the_impulse_response_and_almost_reached() {
    let bound = Shaper::new(CUTOFF_HZ).slope_bound_per_s();
    // ∫|ℓ'| of ℓ = √2 ω e^{-z} cos z by sums of its differences, and the jump at the start.
    let omega = 2.0 * PI * CUTOFF_HZ;
    let l = |n: i32| {
        let z = f64::from(n) * 1e-4;
        SQRT_2 * omega * (-z).exp() * z.cos()
    };
    let variation = l(0) + (1..400_000).map(|n| (l(n) - l(n - 1)).abs()).sum::<f64>();
    close(bound, variation, 1e-6 * bound);
    // The worst input: 1 now, and before that the sign of -ℓ' at every age, which turns at z = 3π/4 + n π.
    let age_s = |z: f64| z * SQRT_2 / omega;
    let mut shaper = Shaper::new(CUTOFF_HZ);
    let turns: Vec<f64> = (0..6).rev().map(|n| (0.75 + f64::from(n)) * PI).collect();
    let mut sign = 1.0;
    for (index, z) in turns.iter().enumerate() {
        shaper = shaper.stepped(sign);
        let next = turns.get(index + 1).copied().unwrap_or(0.0);
        shaper = shaper.after(age_s(z - next));
        sign = -sign;
    }
    let shaper = shaper.stepped(sign);
    let slope = (shaper.after(1e-9).high_pass() - shaper.high_pass()).abs() / 1e-9;
    assert!(slope <= bound * (1.0 + 1e-6) && slope > 0.99 * bound, "{slope} of {bound}");
}

/// Returns speed and position of a mass of `mass_kg` after the forces `forces_n`, each for 1 ms of 50 000 edges, shaped
/// and updated every `hold` edges.
fn pushed(mass_kg: f64, forces_n: &[f64], hold: u64) -> [f64; 2] {
    const EDGE_S: f64 = 20e-9;
    let axis = Axis::amplified(Motor::on_rail(mass_kg, 0.0, 0.0), Hand::Torque(0.0), EDGE_S, 1 << 29).unwrap();
    let mut device = Device::new(&axis, 0.0, 0.0, 0.0);
    let mut shaper = Shaper::new(CUTOFF_HZ);
    for (index, &force_n) in forces_n.iter().enumerate() {
        let start = index as u64 * 50_000;
        shaper = shaper.stepped(force_n);
        for late in (0..50_000).step_by(hold as usize) {
            device.drive_current(start + late, -shaper.after(late as f64 * EDGE_S).output());
        }
        shaper = shaper.after(1e-3);
    }
    let x = device.state(forces_n.len() as u64 * 50_000);
    [x[1], x[2]]
}

#[test]
fn what_a_hold_costs_is_within_its_bound_and_halves_with_it() {
    let mass_kg = 0.0633;
    let forces_n: Vec<f64> = (0..200).map(|n| 5.0 + 5.0 * (f64::from(n) * 0.7).sin()).collect();
    let t_s = 0.2;
    let exact = pushed(mass_kg, &forces_n, 1);
    let mut last: Option<[f64; 2]> = None;
    for hold in [2000, 1000, 500] {
        let got = pushed(mass_kg, &forces_n, hold);
        let error_n = 10.0 * Shaper::new(CUTOFF_HZ).slope_bound_per_s() * hold as f64 * 20e-9;
        let errors = [got[0] - exact[0], got[1] - exact[1]];
        assert!(errors[0].abs() < error_n * t_s / mass_kg, "{hold}: {errors:?}");
        assert!(errors[1].abs() < 0.5 * error_n * t_s * t_s / mass_kg, "{hold}: {errors:?}");
        if let Some(last) = last {
            close(errors[1] / last[1], 0.5, 0.02);
        }
        last = Some(errors);
    }
}
