//! The words of the laws compared with the laws in real numbers: single samples from equal states, and published or
//! known answers.
//!
//! The units are counts and PWM counts. Both sides read the position in counts, so no bound needs room for its
//! quantisation.

use crate::laws_common::{Random, Wall, motion, sampled};
use hpu_datapath::{
    BoundingConfig, CouplingConfig, EnergyBounding, LawWidths, PassiveSpring, PassivityConfig, PassivityController,
    SpringConfig, VirtualCoupling,
};
use hpu_signal::Format;

/// Runs 1e5 samples of a device that wanders about a wall whose gains change now and then.
fn wander(most_stiffness: i64, most_damping: i64, mut sample: impl FnMut(&mut Wall)) {
    let mut random = Random(17);
    let mut wall = Wall { scale: 256, ..Wall::new(12, 1) };
    for _ in 0..100_000 {
        match random.next() % 64 {
            0 => wall.stiffness = random.between(0, most_stiffness),
            1 => wall.damping = random.between(0, most_damping),
            2 => wall.reference = wall.position + random.between(-9, 9),
            3 => wall.scale = random.between(0, 1023),
            _ => {}
        }
        let step = motion(&mut random, wall.position, 30);
        wall.moves(step);
        sample(&mut wall);
    }
}

#[test]
fn the_coupling_stays_within_its_roundings_of_the_massless_tool() {
    // Each row is K_e, K_c and B_c/T, in PWM counts per count.
    for [k_e, k_c, b_t] in
        [[60.0, 30.0, 10.0], [500.0, 20.0, 7.0], [3.0, 200.0, 90.0], [25.0, 25.0, 0.0], [f64::INFINITY, 40.0, 15.0]]
    {
        let gain = |gain: f64| (gain * 65536.0).round() as u32;
        let (share, held) =
            if k_e.is_finite() { (k_e / (k_e + k_c + b_t), b_t / (k_e + k_c + b_t)) } else { (1.0, 0.0) };
        let widths = LawWidths { torque_width: 20, ..LawWidths::default() };
        let (share_word, free_word, held_word) = (gain(share), gain(b_t / (k_c + b_t)), gain(held));
        let config =
            CouplingConfig { widths, share: share_word, free: free_word, held: held_word, ..CouplingConfig::default() };
        let mut law = VirtualCoupling::new(config).unwrap();
        let mut last = 0.0f64;
        let mut touched = 0;
        wander(0, 0, |wall| {
            (wall.stiffness, wall.damping) = (k_c as i64, b_t as i64);
            let x = wall.words().delta as f64;
            let [torque, word] = sampled(&mut law, wall);
            let extension = word as f64 / 256.0;
            // A free tool has K_c e + (B_c/T)(e - e-) = 0. If the free tool is not inside the wall, this is its
            // extension. Otherwise the left side equals K_e (x - e), which gives e.
            let free = b_t * last / (k_c + b_t);
            let exact = if x <= free {
                free
            } else if k_e.is_finite() {
                (k_e * x + b_t * last) / (k_e + k_c + b_t)
            } else {
                x
            };
            // `step` bounds the error of the extension in one step: the extension is floored (2^-8), and its two gains
            // are off by half of 2^-16 each. At the surface, if the free tool is within another `step` of it, the words
            // may take the other branch; both branches meet there, and the gain of the position is at most 1.
            let step = 1.0 / 256.0 + 0.5 / 65536.0 * (x.abs() + last.abs());
            assert!((extension - exact).abs() <= 2.0 * step, "e = {extension}, not {exact}, x = {x}");
            // The torque depends on the extension by K_c + B_c/T, and has two floors.
            let force = (k_c * exact + b_t * (exact - last)).max(0.0);
            let within = 2.0 + (k_c + b_t) * 2.0 * step;
            assert!((torque as f64 - force).abs() <= within, "{torque}, not {force}, x = {x}");
            touched += u32::from(force > 0.0);
            last = extension;
        });
        assert!((20_000..80_000).contains(&touched), "{touched}");
    }
}

#[test]
fn the_spring_stays_within_one_lsb_and_one_pwm_count_of_the_energy_leap() {
    for (extension_frac, alpha) in [(8, 256), (10, 384), (9, 100)] {
        let widths = LawWidths { torque_width: 28, ..LawWidths::default() };
        let config = SpringConfig { widths, extension_frac, alpha, revive: true };
        let mut law = PassiveSpring::new(config).unwrap();
        let lsb = 1.0 / f64::from(1 << extension_frac);
        let (mut last, mut previous) = (0.0f64, 0);
        wander(4095, 0, |wall| {
            let words = wall.words();
            let [torque, word] = sampled(&mut law, wall);
            let moved = f64::from(alpha) / 256.0 * (wall.position - previous) as f64;
            // This is exact in f64: words of up to 62 bits are squared, but all values are far below 2^26 here.
            let engages = last == 0.0 && words.contact == 1;
            let exact =
                if engages { words.penetration as f64 } else { (last * last + 2.0 * last * moved).max(0.0).sqrt() };
            let extension = word as f64 * lsb;
            // The only floor is that of the root; 1e-9 allows for the root in f64.
            assert!((-1e-9..lsb + 1e-9).contains(&(exact - extension)), "x = {extension}, not {exact}");
            // The floor of the torque adds to it.
            let gain = wall.stiffness as f64 * wall.scale as f64 / 256.0;
            let lost = gain * exact - torque as f64;
            assert!((-1e-3..1.0 + gain * lsb + 1e-3).contains(&lost), "lost {lost}");
            (last, previous) = (extension, wall.position);
        });
    }
}

/// Counts per millimetre. With [`PWM_PER_N`] PWM counts per newton, `c = b/T = 500 N/m` is 20 PWM counts per count and
/// `K = 2000 N/m` is 80.
const COUNTS_PER_MM: i64 = 10;
const PWM_PER_N: f64 = 400.0;
/// PWM counts times counts per joule.
const ENERGY_PER_J: f64 = PWM_PER_N * 1e4;

/// Returns torque and memory for a device at 1, 2, 1 and 0 mm.
fn up_and_down(law: &mut EnergyBounding) -> [[i64; 2]; 4] {
    let mut wall = Wall { stiffness: 80, ..Wall::new(12, 1) };
    sampled(law, &mut wall);
    [1, 2, 1, 0].map(|mm| {
        wall.position = mm * COUNTS_PER_MM;
        sampled(law, &mut wall)
    })
}

#[test]
fn the_force_bound_gives_the_known_answer_to_the_word() {
    let config = BoundingConfig { least_conservative: true, ..BoundingConfig::default() };
    let shown = up_and_down(&mut EnergyBounding::new(config).unwrap());
    // Every number and every root here is a whole word.
    let known = [(5e-4, 1.0), (2e-3, 2.0), (5e-4, 1.0), (0.0, 0.0)];
    for ([torque, energy], (energy_j, force_n)) in shown.into_iter().zip(known) {
        assert_eq!((torque as f64, energy as f64 / 16.0), (force_n * PWM_PER_N, (energy_j * ENERGY_PER_J).round()));
    }
}

#[test]
fn two_bounds_give_the_known_answer_within_the_floor_of_the_only_inexact_root() {
    let shown = up_and_down(&mut EnergyBounding::default());
    let known = [(0.5, 5e-4), (1.0, 1.5e-3), (0.822875656, 6.77124344e-4), (0.322875656, 3.54248689e-4)];
    // A root bounds the third sample. It is floored to sixteenths, and the torque then to a PWM count, so the torque is
    // off by 17/16 at most. The fourth sample keeps this error, as it steps by c1. Each of the two samples adds 10
    // counts times this error to the energy.
    for (n, ([torque, energy], (force_n, energy_j))) in shown.into_iter().zip(known).enumerate() {
        let (off, floors) = (17.0 / 16.0, n.saturating_sub(1) as f64);
        let (force, stored) = (force_n * PWM_PER_N, energy_j * ENERGY_PER_J);
        assert!((torque as f64 - force).abs() <= off * floors.min(1.0) + 1e-6 * force, "{torque}, not {force}");
        assert!((energy as f64 - stored).abs() <= 10.0 * off * floors + 1e-6 * stored, "{energy}, not {stored}");
    }
}

fn wanted(wall: &Wall, motion: i64) -> f64 {
    let words = wall.words();
    let spring = (words.penetration * words.stiffness).min(4095);
    let drag = (words.damping * motion).clamp(-4096, 4095);
    if words.contact == 1 { (spring + drag).clamp(-4095, 4095) as f64 } else { 0.0 }
}

#[test]
fn two_bounds_stay_within_their_roundings_of_the_published_beta() {
    for (c1_word, c2_word) in [(320, 320), (325, 163), (40, 25), (4000, 1600)] {
        let config = BoundingConfig { c1: c1_word, c2: c2_word, ..BoundingConfig::default() };
        let mut law = EnergyBounding::new(config).unwrap();
        let [c1, c2] = [c1_word, c2_word].map(|word| f64::from(word) / 16.0);
        let (mut force, mut energy, mut previous) = (0.0f64, 0.0f64, 0);
        wander(300, 20, |wall| {
            let d = wall.position - previous;
            previous = wall.position;
            let [torque, stored] = sampled(&mut law, wall);
            let wanted = wanted(wall, d);
            let dx = d as f64;
            let exact = if d == 0 {
                force
            } else {
                let half = (c2 * c2 + 2.0 * c2 * energy / (dx * dx)).sqrt();
                let gamma = c2 - force / dx;
                let beta = (wanted - force) / dx;
                force + beta.min(c1).min(gamma + half).max(gamma - half) * dx
            };
            // The bound that limits the torque is floored or ceiled to a PWM count; the root has lost 1/16 before. The
            // clamp to what the bridge can show does not add to the error. 1e-6 allows for f64.
            let off = (torque as f64 - exact.clamp(-4095.0, 4095.0)).abs();
            assert!(off <= 17.0 / 16.0 + 1e-6, "{torque}, not {exact}");
            // The energy follows exactly from the torque shown.
            assert_eq!(stored as f64, energy + torque as f64 * dx);
            (force, energy) = (torque as f64, stored as f64);
        });
    }
}

#[test]
fn the_force_bound_stays_within_its_roundings_of_the_published_one() {
    for c1_word in [320, 325, 7, 4000] {
        let config = BoundingConfig { least_conservative: true, c1: c1_word, ..BoundingConfig::default() };
        let mut law = EnergyBounding::new(config).unwrap();
        let c1 = f64::from(c1_word) / 16.0;
        let (mut force, mut energy, mut previous) = (0.0f64, 0.0f64, 0);
        wander(300, 20, |wall| {
            let d = wall.position - previous;
            previous = wall.position;
            let [torque, stored] = sampled(&mut law, wall);
            let dx = d as f64;
            let kept = if force == 0.0 { 0.0 } else { energy };
            energy = kept + c1 * dx * dx + force * dx;
            // The energy agrees exactly, in sixteenths.
            assert_eq!(stored as f64 / 16.0, energy);
            let bound = (4.0 * c1 * energy).sqrt();
            let exact = wanted(wall, d).clamp(-bound, bound);
            // The root is floored to sixteenths, and the result to a PWM count.
            assert!(
                (0.0..17.0 / 16.0 + 1e-6).contains(&(exact.abs() - torque.abs() as f64 + 1e-9)),
                "{torque}, not {exact}"
            );
            force = torque as f64;
        });
    }
}

#[test]
fn the_passivity_observer_gives_the_known_answer_to_the_word() {
    // The samples (v, f) = (0.1, 2), (0.1, 4), (-0.05, 8), in twentieths and thirtieths, give W = 0.2, 0.6, 0.2 and no
    // correction.
    let mut law = PassivityController::default();
    let mut wall = Wall::new(12, 1);
    for (d, stiffness, force, energy) in [(2, 30, 2.0, 0.2), (2, 30, 4.0, 0.6), (-1, 80, 8.0, 0.2)] {
        wall.moves(d);
        wall.stiffness = stiffness;
        let [torque, stored] = sampled(&mut law, &mut wall);
        assert_eq!((torque as f64 / 30.0, stored as f64), (force, f64::round(energy * 600.0)));
    }
}

#[test]
fn the_correction_is_the_published_alpha_times_the_motion_but_for_one_floor() {
    let widths = LawWidths { stiffness: Format::new(false, 6, 6).unwrap(), ..LawWidths::default() };
    let config = PassivityConfig { widths, energy_width: 40, credit: 200, ..PassivityConfig::default() };
    let mut law = PassivityController::new(config).unwrap();
    let (mut energy, mut correction, mut last, mut previous) = (0.0f64, 0.0f64, 0.0f64, 0);
    let mut corrected = 0;
    wander(400, 3, |wall| {
        let d = wall.position - previous;
        previous = wall.position;
        let words = wall.words();
        let [torque, stored] = sampled(&mut law, wall);
        // The wanted torque is a word in both laws: the spring has 6 fraction bits and is floored.
        let spring = (words.penetration * words.stiffness).div_euclid(64).min(4095);
        let drag = (words.damping * d).clamp(-4096, 4095);
        let wanted = if words.contact == 1 { (spring + drag).clamp(-4095, 4095) as f64 } else { 0.0 };
        let v = d as f64;
        // W(n) = W(n-1) + f2 v + alpha(n-1) v(n-1)^2, where alpha v is the correction in force. Little energy is saved
        // up, so that a spring that changes soon makes it negative.
        energy = (energy + wanted * v + correction * last).min(200.0);
        assert_eq!(stored as f64, energy);
        let alpha = if energy < 0.0 && d != 0 { -energy / (v * v) } else { 0.0 };
        // The quotient is limited to what the bridge can show, and is floored.
        let exact = (wanted + (alpha * v).clamp(-4095.0, 4095.0)).clamp(-4095.0, 4095.0);
        assert!((torque as f64 - exact).abs() < 1.0, "{torque}, not {exact}");
        corrected += u32::from(torque as f64 != wanted);
        (correction, last) = (torque as f64 - wanted, v);
    });
    assert!(corrected > 1000, "{corrected}");
}
