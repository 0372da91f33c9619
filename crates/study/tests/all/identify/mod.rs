//! Keys from logs: oscillations in closed form, in whole counts, with differences that last for many rows.

mod emulated;
mod qube;

use hpu_study::Error;
use hpu_study::identify::{Bound, Free, Identified, Rows, identify};

/// Numbers of a normal distribution, by sums of twelve uniform ones of SplitMix64.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn next(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

const ROWS: usize = 800;

/// An oscillation of 300 counts at 1 kHz: its square of an angular frequency, and its decay.
fn motion(square: f64, decay: f64) -> Vec<f64> {
    let at = |row: usize| {
        let time_s = row as f64 * 1e-3;
        300.0 * (-decay * time_s).exp() * (square.sqrt() * time_s).cos()
    };
    (0..ROWS).map(at).collect()
}

fn free(key: &str, start: f64) -> Free {
    Free { key: key.into(), start, bounds: (1e-9, 1e9) }
}

fn rows(off: Vec<f64>) -> Rows {
    Rows { times_s: (0..off.len()).map(|row| row as f64 * 1e-3).collect(), off, shift: 0 }
}

/// Identifies keys of a model from a log.
fn of(free: &[Free], log: &[f64], model: impl Fn(&[f64]) -> Vec<f64>) -> Result<Identified, Error> {
    let mut runs = |values: &[f64], _: Option<&[i64]>| {
        Ok(Some(vec![rows(model(values).iter().zip(log).map(|(run, log)| run - log).collect())]))
    };
    identify(free, &mut runs).map(|found| found.expect("not stopped"))
}

/// Returns a log of the true values in whole counts, of which the middles are taken, off by noise whose rows are
/// correlated.
fn log(noise: &mut Noise, correlation: f64) -> Vec<f64> {
    let mut off = noise.next();
    let mut log = motion(900.0, 2.0);
    for count in &mut log {
        off = correlation * off + (1.0 - correlation * correlation).sqrt() * noise.next();
        *count = (*count + off).floor() + 0.5;
    }
    log
}

#[test]
fn intervals_cover_the_truth_and_naive_ones_do_not() {
    let mut noise = Noise(7);
    for correlation in [0.5, 0.9, 0.97] {
        let [mut covered, mut by_profile, mut naively, mut count] = [0.0; 4];
        for _ in 0..70 {
            let log = log(&mut noise, correlation);
            let found = of(&[free("square", 850.0), free("decay", 2.5)], &log, |v| motion(v[0], v[1])).expect("found");
            for (found, truth) in found.found.iter().zip([900.0, 2.0]) {
                let off = (found.value - truth).abs();
                covered += f64::from(off <= found.quantile * found.sd);
                naively += f64::from(off <= 1.96 * found.naive_sd);
                let inside = matches!(found.bound, Bound::Both(low, high) if (low..=high).contains(&truth));
                by_profile += f64::from(inside);
                count += 1.0;
            }
        }
        // Of 140 intervals of 95 %, one standard deviation of the share is 1.8 %.
        for covered in [covered, by_profile] {
            assert!((0.89..=0.995).contains(&(covered / count)), "{correlation}: {covered} of {count}");
        }
        assert!(naively / count < 0.85, "{correlation}: {naively} of {count}");
    }
}

#[test]
fn on_a_staircase_the_optimum_is_at_the_foot_of_a_dense_scan_and_its_interval_covers() {
    let mut noise = Noise(77);
    let [mut covered, mut count] = [0.0; 2];
    for _ in 0..60 {
        let log = log(&mut noise, 0.5);
        // The model passes through a quantiser of a count.
        let model = |v: &[f64]| motion(v[0], 2.0).iter().map(|at| at.round()).collect::<Vec<_>>();
        let found = of(&[free("square", 880.0)], &log, model).expect("found");
        let found = &found.found[0];
        let is_in = matches!(found.bound, Bound::Both(low, high) if (low..=high).contains(&900.0));
        covered += f64::from(is_in);
        // The foot of the least squares parabola through a dense scan of a unit to both sides.
        let sum = |square: f64| model(&[square]).iter().zip(&log).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let dense = || (-100..=100).map(|at| f64::from(at) * 0.01);
        let [mut odd, mut even, mut second, mut fourth] = [0.0; 4];
        let mean = dense().map(|by| by * by).sum::<f64>() / 201.0;
        for by in dense() {
            let sum = sum(900.0 + by);
            odd += by * sum;
            even += (by * by - mean) * sum;
            second += by * by;
            fourth += (by * by - mean).powi(2);
        }
        let foot = 900.0 - 0.5 * (odd / second) / (even / fourth);
        assert!((found.value - foot).abs() < 1.5 * found.sd, "{foot} {found:?}");
        count += 1.0;
    }
    assert!(covered / count >= 0.88, "{covered} of {count}");
}

#[test]
fn keys_that_the_log_does_not_tell_are_said_so() {
    let log = log(&mut Noise(3), 0.5);
    // Stiffness and inertia have an effect by their ratio alone.
    let both = [free("stiffness", 1000.0), free("inertia", 1.0), free("decay", 2.2)];
    let found = of(&both, &log, |v| motion(v[0] / v[1], v[2])).expect("found").found;
    assert_eq!([found[0].bound, found[1].bound], [Bound::None; 2], "{found:?}");
    assert!((found[0].value / found[1].value / 900.0 - 1.0).abs() < 1e-2, "{found:?}");
    assert!(matches!(found[2].bound, Bound::Both(low, high) if 1.9 < low && low < 2.0 && 2.0 < high && high < 2.1));
    // A limit that the motion of 300 counts just reaches: lower ones would be seen.
    let limited = |v: &[f64]| motion(v[0], 2.0).iter().map(|count| count.clamp(-v[1], v[1])).collect();
    let found = of(&[free("square", 890.0), free("limit", 310.0)], &log, limited).expect("found").found;
    assert!(matches!(found[1].bound, Bound::Lower(low) if (285.0..300.0).contains(&low)), "{found:?}");
    let error = of(&[free("square", 890.0), free("colour", 1.0)], &log, |v| motion(v[0], 2.0)).unwrap_err();
    assert!(error.to_string().starts_with("colour has no effect"), "{error}");
    let error = of(&[free("square", 0.0)], &log, |v| motion(v[0], 2.0)).unwrap_err();
    assert!(error.to_string().starts_with("square starts at 0"), "{error}");
}

#[test]
fn a_key_below_zero_and_one_at_its_bound_are_found() {
    let log = log(&mut Noise(4), 0.5);
    let below = Free { key: "below".into(), start: -800.0, bounds: (-1e9, 1e9) };
    let bounded = Free { key: "decay".into(), start: 2.3, bounds: (2.2, 5.0) };
    let found = of(&[below, bounded], &log, |v| motion(-v[0], v[1])).expect("found").found;
    assert!(matches!(found[0].bound, Bound::Both(low, high) if low < -895.0 && -905.0 < high && low < high));
    assert!(found[1].is_at_bound && found[1].value == 2.2 && !found[0].is_at_bound, "{found:?}");
}

#[test]
fn the_shift_of_a_log_is_found_beside_its_keys() {
    // Two logs, begun at another row each; a shift and the frequency hardly differ over a few rows.
    let mut noise = Noise(9);
    let logs = [log(&mut noise, 0.5)[4..].to_vec(), log(&mut noise, 0.5)[7..].to_vec()];
    let mut runs = |values: &[f64], shifts: Option<&[i64]>| {
        let run = motion(values[0], values[1]);
        let off = |log: &[f64], shift: i64| {
            let rows = run[shift as usize..].iter().zip(log).take(780);
            rows.map(|(run, log)| run - log).collect::<Vec<f64>>()
        };
        let sum = |log: &[f64], shift: i64| off(log, shift).iter().map(|off| off * off).sum::<f64>();
        let found = logs.iter().enumerate().map(|(at, log)| {
            let best = || (0..10).min_by(|one, other| sum(log, *one).total_cmp(&sum(log, *other))).unwrap_or(0);
            let shift = shifts.map_or_else(best, |shifts| shifts[at].clamp(0, 10));
            Rows { shift, ..rows(off(log, shift)) }
        });
        Ok(Some(found.collect()))
    };
    let found = identify(&[free("square", 860.0), free("decay", 2.5)], &mut runs).expect("found").expect("not stopped");
    assert_eq!([found.met[0].1.shift, found.met[1].1.shift], [4, 7]);
    assert!((found.found[0].value - 900.0).abs() < found.found[0].quantile * found.found[0].sd, "{found:?}");
}

#[test]
fn a_model_that_lacks_something_is_rejected() {
    let mut log = log(&mut Noise(5), 0.5);
    let keys = [free("square", 890.0), free("decay", 2.2)];
    let met = of(&keys, &log, |v| motion(v[0], v[1])).expect("found").met[0];
    assert!(!met.1.is_rejected() && met.0.is_rejected(), "{met:?}");
    // Something touched the device half way.
    log[400..440].iter_mut().for_each(|count| *count += 12.0);
    let met = of(&keys, &log, |v| motion(v[0], v[1])).expect("found").met[0].1;
    assert!(met.is_rejected() && met.worst_s == [0.4, 0.439], "{met:?}");
}
