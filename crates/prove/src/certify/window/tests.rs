//! The parts of a bound from a state on, against brute force and closed forms.

use hpu_cosim::scene::shipped;

use super::*;

fn scene(set: &[(&str, &str)]) -> Scene {
    let shipped = shipped().iter().find(|scene| scene.name == "hybrid-wall").expect("it is shipped");
    let set: Vec<_> =
        [("wall.damping", "0")].iter().chain(set).map(|(key, value)| ((*key).into(), (*value).into())).collect();
    Scene::parse("hybrid-wall", shipped.text, &set, &mut |_| unreachable!()).expect("a scene")
}

/// Returns numbers at random from -1 to 1.
fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut random = hpu_cosim::SplitMix64::new(seed);
    move || 2.0 * (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 1.0
}

fn form(storage: [[f64; 4]; 4]) -> Square<4, 0> {
    storage.map(|row| row.map(Form::exact))
}

fn squares(storage: &[[f64; 4]; 4], x: &[f64; 4]) -> f64 {
    (0..16).map(|at| storage[at / 4][at % 4] * x[at / 4] * x[at % 4]).sum()
}

/// Storages at random that are a sum of squares, less a share of half the staircase's weight for the last state.
#[test]
fn what_is_stored_at_the_end_is_never_below_its_bound() {
    let mut side = random(70);
    let mut tightest = f64::INFINITY;
    for index in 0..120 {
        let (staircase, half) = (3.0 * (1.0 + side()), 0.5 + 0.2 * (1.0 + side()));
        let factor: [[f64; 4]; 4] = from_fn(|_| from_fn(|_| side()));
        let taken = [0.0, 0.2, 0.45, 0.7, 0.85, 0.95][index % 6];
        let cell = |row: usize, of: usize| {
            let last = if row == 3 && of == 3 { 0.5 * taken * staircase } else { 0.0 };
            let own = if row == of { 1e-6 } else { 0.0 };
            own + (0..4).map(|by| 1e-2 * factor[by][row] * factor[by][of]).sum::<f64>() - last
        };
        let storage: [[f64; 4]; 4] = from_fn(|row| from_fn(|of| cell(row, of)));
        let exact = Interval::exact;
        let least = at_end(&form(storage), exact(staircase), exact(half)).expect("a least value").lo;
        // At each last state, the least of the other three, by descent; the potential is the least of all.
        let mut lowest = 0.0f64;
        for part in -200..=200 {
            let last = 0.04 * f64::from(part) * half;
            let mut x = [0.0, 0.0, 0.0, last];
            for _ in 0..200 {
                for state in 0..3 {
                    let rest: f64 = (0..4).filter(|of| *of != state).map(|of| storage[state][of] * x[of]).sum();
                    x[state] = -rest / storage[state][state];
                }
            }
            let beyond = (last.abs() - half).max(0.0);
            let stored = staircase * beyond * beyond / 2.0 + squares(&storage, &x);
            assert!(stored >= least, "{index}: {stored} is stored, at least {least}");
            lowest = lowest.min(stored);
        }
        if taken > 0.0 {
            tightest = tightest.min((least - lowest) / least);
        }
    }
    // The bound is that of a share from a list, so it is no tighter than these allow.
    assert!(tightest < 0.35, "{tightest}");
    // A storage that falls without end, by any state or by the potential's whole weight.
    for at in 0..4 {
        let storage: [[f64; 4]; 4] = from_fn(|row| {
            from_fn(|of| {
                if row != of {
                    0.0
                } else if row == at {
                    -1.0
                } else {
                    1.0
                }
            })
        });
        assert!(at_end(&form(storage), Interval::exact(2.0), Interval::exact(0.5)).is_none(), "{at}");
    }
}

#[test]
fn what_is_stored_at_the_start_is_that_of_the_steepest_staircase_with_any_angle_before() {
    let mut side = random(71);
    for _ in 0..200 {
        let half: [[f64; 4]; 4] = from_fn(|_| from_fn(|_| side()));
        let storage: [[f64; 4]; 4] = from_fn(|row| from_fn(|of| 0.5 * (half[row][of] + half[of][row])));
        let (staircase, half) = (4.0 * (1.0 + side()), 0.5 + 0.2 * (1.0 + side()));
        let start = [side(), side(), 3.0 * side()];
        let exact = Interval::exact;
        let found = at_start(&form(storage), exact(staircase), exact(half), start.map(exact));
        let far = 2.0 * start[2].abs() + half;
        let all = (-32..=32).map(|part| {
            let before = far * f64::from(part) / 32.0;
            // The integral of the greatest staircase from where it is 0: of `y + H` from `-H` on.
            let potential = (0..1000).map(|part| (f64::from(part) + 0.5) / 1000.0 * (before.abs() + half)).sum::<f64>();
            let [x, y, z] = start;
            staircase * potential * (before.abs() + half) / 1000.0 + squares(&storage, &[x, y, z, before])
        });
        let least = all.fold(f64::INFINITY, f64::min);
        assert!((found - least).abs() < 1e-9 * (1.0 + least.abs()), "{found}, not {least}");
    }
}

/// A free motion over a period, in small steps: it leaves the straight line by no more than its acceleration allows.
#[test]
fn a_free_motion_leaves_the_line_between_readings_by_no_more_than_is_added() {
    let mut side = random(72);
    for set in [
        &[][..],
        &[("hand.damping", "0.004")],
        &[("device.inductance", "100 uH"), ("device.torque_constant", "0.05 N.m/A")],
    ] {
        let scene = scene(set);
        let plant = Plant::<0>::of(&scene, [], 1.0).expect("a plant");
        let rates = plant.rates.map(|row| row.map(|cell| cell.all().middle()));
        let mut most = [0.0f64; 3];
        for index in 0..300 {
            let mut start = [side(), side(), side()];
            // Each alone, in its own size, then all together.
            if index < 3 {
                start = from_fn(|state| f64::from(u8::from(state == index)));
            }
            let mut x = start;
            let mut angles = vec![x[2]];
            const STEPS: usize = 4096;
            for _ in 0..STEPS {
                // The middle of a step, twice: Heun's method would do as well.
                let slope = |x: &[f64; 3]| -> [f64; 3] { from_fn(|row| (0..3).map(|of| rates[row][of] * x[of]).sum()) };
                let own = slope(&x);
                let middle = slope(&from_fn(|state| x[state] + 0.5 / STEPS as f64 * own[state]));
                x = from_fn(|state| x[state] + middle[state] / STEPS as f64);
                angles.push(x[2]);
            }
            let line = |at: usize| angles[0] + (angles[STEPS] - angles[0]) * at as f64 / STEPS as f64;
            let far = (0..=STEPS).fold(0.0, |most: f64, at| most.max((angles[at] - line(at)).abs()));
            let [current, speed, angle] = start.map(|part: f64| Interval::exact(part.abs()));
            let [_, _, between] = plant.added([current, speed, angle, Interval::ZERO]).map(|more| more.hi);
            assert!(far <= between * (1.0 + 1e-6), "{set:?}, {start:?}: {far} beside the line, at most {between}");
            if index < 3 {
                most[index] = far / between;
            }
        }
        assert!(most.iter().all(|most| *most > 0.05), "{set:?}: {most:?}");
    }
}

#[test]
fn a_system_is_solved_within_its_enclosure() {
    let exact = Interval::exact;
    let rows = [[4.0, -1.0, 0.5], [1.0, 3.0, -1.0], [-0.5, 0.25, 2.0]].map(|row| row.map(exact));
    let x = [1.0, -2.0, 0.75];
    let right: State =
        from_fn(|row| (0..3).fold(Interval::ZERO, |sum, of| sum.plus(rows[row][of].times(exact(x[of])))));
    let found = solved(&rows, right).expect("a solution");
    assert!((0..3).all(|at| found[at].lo <= x[at] && x[at] <= found[at].hi && found[at].width() < 1e-12), "{found:?}");
    // Rows that are known to a thousandth: each solution within them.
    let wide = rows.map(|row| row.map(|cell| cell.plus(Interval { lo: -1e-3, hi: 1e-3 })));
    let found = solved(&wide, right).expect("a solution");
    for corner in 0..512 {
        let cell = |row: usize, of: usize| {
            let by = if corner >> (3 * row + of) & 1 == 1 { 1e-3 } else { -1e-3 };
            rows[row][of].middle() + by
        };
        let with = |row: usize| (0..3).map(|of| cell(row, of)).chain([right[row].middle()]).collect();
        let own = solution((0..3).map(with).collect()).expect("a solution");
        assert!((0..3).all(|at| found[at].lo <= own[at] && own[at] <= found[at].hi), "{corner}: {own:?}, {found:?}");
    }
    assert!(solved(&[[Interval::ZERO; 3]; 3], right).is_err());
}
