//! Compares the proved limits of a device with closed forms, and with the worst and random commands integrated by Runge
//! and Kutta.

use std::f64::consts::PI;

use crate::proofs_common::axis;
use hpu_cosim::scene::{Experiment, Scene, SceneFile};
use hpu_prove::ranges::axis_bounds;

/// The motor of all scenes.
const R: f64 = 2.3457;
const L: f64 = 0.226e-3;
const K: f64 = 25.9e-3;
const J: f64 = 13.7e-7;
const B: f64 = 1.3e-6;
const U: f64 = 24.0;

/// The hand of `hybrid-wall`.
const GRIP: f64 = 0.3;
const GRIP_DAMPING: f64 = 0.1e-3;

/// A bridge that may give any voltage between both signs of its supply, and a hand whose path stays at 0.
const ANY: (&str, &str) = ("method.pwm.mode", "\"locked_antiphase\"");
const STILL: (&str, &str) = ("hand.path", "[[\"0 s\", 0]]");

fn limit(scene: &Scene, name: &str) -> (f64, f64) {
    let proof = axis_bounds(scene).unwrap();
    let limit = proof.limits.iter().find(|limit| limit.name == name).unwrap();
    (limit.min, limit.max)
}

/// Asserts that the bound is at least the truth, and at most a part in 200 above it.
fn close_above(bound: f64, truth: f64) {
    assert!(truth <= bound && bound <= 1.005 * truth, "{bound} for {truth}");
}

#[test]
fn a_free_motor_turns_no_faster_than_without_load() {
    let scene = axis("hybrid-wall", &[ANY, ("hand", "{ kind = \"none\" }")]);
    let (least, most) = limit(&scene, "speed");
    let free = K * U / (R * B + K * K);
    close_above(most, free);
    close_above(-least, free);
    assert!((free - 922.447_677).abs() < 0.1, "the published set's figure is {free}");
}

#[test]
fn a_resistive_motor_in_a_hand_swings_as_far_as_the_closed_form_of_second_order_says() {
    let still = [ANY, STILL, ("model.bridge", "\"averaged\""), ("model.winding", "\"resistive\"")];
    let scene = axis("hybrid-wall", &still);
    let natural = (GRIP / J).sqrt();
    let decay = (B + GRIP_DAMPING + K * K / R) / J / 2.0;
    let damped = (natural * natural - decay * decay).sqrt();
    // The factor by which everything is smaller half a swing later.
    let half = (-PI * decay / damped).exp();
    let angle = K * U / R / GRIP * (1.0 + half) / (1.0 - half);
    let peak = (-decay * (damped / decay).atan() / damped).exp() / natural;
    let speed = K * U / R / J * 2.0 * peak / (1.0 - half);
    let (least, most) = limit(&scene, "angle");
    close_above(most, angle);
    close_above(-least, angle);
    close_above(limit(&scene, "speed").1, speed);
}

/// Current, speed and distance from the hand.
type State = [f64; 3];

fn slope([i, w, e]: State, volt: f64) -> State {
    [(volt - R * i - K * w) / L, (K * i - (B + GRIP_DAMPING) * w - GRIP * e) / J, w]
}

/// Does one step of the classic method of fourth order.
fn step(x: State, volt: f64, h: f64) -> State {
    let ahead = |k: State, by: f64| std::array::from_fn(|n| x[n] + by * k[n]);
    let k1 = slope(x, volt);
    let k2 = slope(ahead(k1, h / 2.0), volt);
    let k3 = slope(ahead(k2, h / 2.0), volt);
    let k4 = slope(ahead(k3, h), volt);
    std::array::from_fn(|n| x[n] + h / 6.0 * (k1[n] + 2.0 * k2[n] + 2.0 * k3[n] + k4[n]))
}

#[test]
fn the_worst_command_reaches_the_limits_and_no_other_passes_them() {
    let scene = axis("hybrid-wall", &[ANY, STILL]);
    let limits = [limit(&scene, "speed").1, limit(&scene, "angle").1];
    let (h, steps) = (2e-6, 25_000);
    // The response to a pulse, backwards in time, tells when to push in which direction.
    let mut response = vec![[1.0 / L, 0.0, 0.0]];
    for n in 0..steps {
        response.push(step(response[n], 0.0, h));
    }
    for (output, limit) in [1, 2].into_iter().zip(limits) {
        let end = (0..steps).fold([0.0; 3], |x, n| step(x, U * response[steps - n][output].signum(), h));
        println!("state {output}: the worst command reaches {}, proved {limit}", end[output]);
        assert!(end[output] <= limit && end[output] > 0.99 * limit);
    }
    let mut seed = 1u64;
    let mut draw = |below: u64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) % below
    };
    let (mut x, mut most) = ([0.0; 3], [0f64; 2]);
    for _ in 0..5_000 {
        let volt = U * (draw(201) as f64 / 100.0 - 1.0);
        for _ in 0..1 + draw(1500) {
            x = step(x, volt, h);
            most = [most[0].max(x[1].abs()), most[1].max(x[2].abs())];
        }
    }
    println!("at random {most:?}, proved {limits:?}");
    assert!(most[0] <= limits[0] && most[1] <= limits[1]);
}

#[test]
fn commands_of_one_sign_narrow_the_limits() {
    // The scene's wall pulls only by its drag, so the shaft cannot be thrown as far into the wall as out of it.
    let (both, one) = (axis("hybrid-wall", &[ANY]), axis("hybrid-wall", &[]));
    let (wide, narrow) = (limit(&both, "angle"), limit(&one, "angle"));
    assert!(wide.0 < narrow.0 && narrow.1 < wide.1, "{narrow:?} within {wide:?}");
    assert!(narrow.1 - 1.9 < 0.5 * (wide.1 - 1.9), "{narrow:?} within {wide:?}");
}

#[test]
fn the_paddles_words_stay_within_the_sums_of_their_codes_and_the_limits_of_their_controllers() {
    let experiment = SceneFile::find("epfl-paddle-cycle").unwrap().parse(&[]).unwrap();
    let Experiment::Paddle(scene) = &experiment else { panic!("a scene of the paddle") };
    let proof = hpu_prove::arms::paddle_proof(scene).unwrap();
    // 33 codes of 13 bits with their sign, less 33 of -4.42 mA; the filter takes the mean's place among them.
    let zero = (-0.046_875f64 / 10.6 / (2.5 / (0.75 * 4095.0)) * 33.0).round();
    let sums = (33.0 * -4096.0 - zero, 33.0 * 4095.0 - zero);
    // 12 bits of the Hall sensor; 32.3 mN.m over 53.8 mN.m/A in units of the sum; 98 % of 511 steps.
    for (name, ends) in [
        ("sum", sums),
        ("current", sums),
        ("filtered", (-2048.0, 2047.0)),
        ("aim", (-24339.0, 24339.0)),
        ("command", (-501.0, 500.0)),
    ] {
        let bound = proof.of(name).unwrap();
        // A filter cuts off: its least word is some 2^-12 below.
        assert!(bound.max == ends.1 && (0.0..0.01).contains(&(ends.0 - bound.min)), "{name}: {bound:?}");
    }
}
