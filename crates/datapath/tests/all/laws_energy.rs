//! The laws' promises about energy, as exact statements about integers, in PWM counts times counts.
//!
//! The device rests while a law computes, as the algorithms suppose, so torque and motion pair up as
//! `torque(n-1) * motion(n)`. One test measures the effect of motion during the computation.

use crate::laws_common::{Random, Wall, motion, sampled};
use hpu_datapath::{
    Block, BoundingConfig, EnergyBounding, Law, LawWidths, PassiveSpring, PassivityConfig, PassivityController,
    SpringConfig,
};

fn widths(width: u32, torque_width: u32) -> LawWidths {
    LawWidths { width, torque_width, ..LawWidths::default() }
}

/// Returns the block with the bounds `c1` and `c2`, in sixteenths of a PWM count per count.
fn bounding(least_conservative: bool, widths: LawWidths, c1: u32, c2: u32) -> EnergyBounding {
    EnergyBounding::new(BoundingConfig { widths, least_conservative, c1, c2, ..BoundingConfig::default() }).unwrap()
}

/// The number of sixteenths in one.
const UNIT: i128 = 16;

/// Torque and stored energy after a sample, and the energy that the device has put in, in sixteenths of a PWM count
/// times count.
#[derive(Default, Clone, Copy)]
struct Books {
    torque: i128,
    energy: i128,
    /// Work of the device on the torque in force, plus the energy that its damping has taken:
    /// `sum F(n-1) d(n) + c1 d(n)^2`.
    balance: i128,
}

/// Runs one sample of the c1/c2 form. Asserts that the stored energy pays for the torque, and that no energy was
/// generated.
fn two_bounds_hold(books: &mut Books, law: &mut EnergyBounding, wall: &mut Wall, d: i64, [c1, c2]: [u32; 2]) {
    wall.moves(d);
    let [torque, energy] = sampled(law, wall).map(i128::from);
    let (d, [c1, c2]) = (i128::from(d), [c1, c2].map(i128::from));
    assert!(UNIT * torque * torque <= 2 * c2 * energy, "F = {torque}, E = {energy}, c2 = {c2}/16");
    books.balance += UNIT * books.torque * d + c1 * d * d;
    assert!(books.balance >= 0, "{} after F = {}, d = {d}", books.balance, books.torque);
    (books.torque, books.energy) = (torque, energy);
}

/// Runs one sample of the force bound. Asserts that the energy does not fall below 0 before it is clamped.
fn force_bound_holds(books: &mut Books, law: &mut EnergyBounding, wall: &mut Wall, d: i64, c1: u32) {
    wall.moves(d);
    let [torque, energy] = sampled(law, wall).map(i128::from);
    let (d, c1) = (i128::from(d), i128::from(c1));
    let stored = if books.torque == 0 { 0 } else { books.energy };
    let unclamped = stored + c1 * d * d + UNIT * books.torque * d;
    assert!(unclamped >= 0, "E = {} and F = {}, d = {d}", books.energy, books.torque);
    assert_eq!(energy, unclamped.min((1 << 32) - 1));
    books.balance += UNIT * books.torque * d + c1 * d * d;
    assert!(books.balance >= 0);
    (books.torque, books.energy) = (torque, energy);
}

/// Runs 2e5 samples at walls of many gains, with random motions about the wall's surface.
fn random_walls(widths: LawWidths, mut sample: impl FnMut(&mut Wall, i64)) {
    let mut random = Random(11);
    let mut wall = Wall::new(widths.width, 1);
    let reach = 1 << (widths.width - 6);
    for _ in 0..200_000 {
        match random.next() % 64 {
            0 => wall.stiffness = random.between(0, 100),
            1 => wall.stiffness = random.between(0, 4095),
            2 => wall.damping = random.between(0, 60),
            3 => wall.damping = random.between(0, 4095),
            4 => wall.damping = 0,
            _ => {}
        }
        let step = motion(&mut random, wall.position, reach);
        sample(&mut wall, step);
    }
}

/// Runs all histories of six motions of up to two counts each, at walls with these gains.
fn every_short_history(law: &EnergyBounding, mut sample: impl FnMut(&mut Books, &mut EnergyBounding, &mut Wall, i64)) {
    for [stiffness, damping, reference] in [[0, 0, 0], [1, 0, -1], [2, 3, 0], [9, 0, -2], [20, 7, 1], [60, 60, -4]] {
        let wall = Wall { stiffness, damping, reference, ..Wall::new(6, 1) };
        let mut all = vec![(law.clone(), wall, Books::default())];
        for _ in 0..6 {
            let mut longer = Vec::with_capacity(5 * all.len());
            for (law, wall, books) in &all {
                for d in -2..=2 {
                    let (mut law, mut wall, mut books) = (law.clone(), *wall, *books);
                    sample(&mut books, &mut law, &mut wall, d);
                    longer.push((law, wall, books));
                }
            }
            all = longer;
        }
        assert_eq!(all.len(), 5usize.pow(6));
    }
}

/// Bounds c1 and c2, in sixteenths, with a whole number of PWM counts per count between them. Such a number makes
/// `ceil(c2 d) <= floor(c1 d)` for `d > 0`. As `S >= |F|`, also `lo <= F + ceil(c2 d)`. So the energy's bounds never
/// lead beyond the step that c1 allows, nor do their mirror images for `d < 0`.
const WHOLE: [[u32; 2]; 8] =
    [[320, 320], [320, 160], [16, 16], [40, 32], [325, 320], [320, 313], [17, 5], [4000, 1600]];

#[test]
fn two_bounds_store_what_the_torque_costs_and_generate_nothing_over_random_histories() {
    for [c1, c2] in WHOLE {
        for torque_width in [12, 6] {
            let widths = widths(12, torque_width);
            let mut law = bounding(false, widths, c1, c2);
            let mut books = Books::default();
            random_walls(widths, |wall, d| two_bounds_hold(&mut books, &mut law, wall, d, [c1, c2]));
        }
    }
}

#[test]
fn two_bounds_store_what_the_torque_costs_and_generate_nothing_over_every_short_history() {
    for [c1, c2] in [[16, 16], [32, 16], [40, 32], [80, 80], [16, 9], [53, 41]] {
        let law = bounding(false, widths(6, 5), c1, c2);
        every_short_history(&law, |books, law, wall, d| two_bounds_hold(books, law, wall, d, [c1, c2]));
    }
}

#[test]
fn two_bounds_without_a_whole_number_between_lead_up_to_one_pwm_count_too_far() {
    for [c1, c2] in [[8, 8], [23, 20], [325, 325]] {
        let widths = widths(12, 12);
        let mut law = bounding(false, widths, c1, c2);
        let (mut last, mut too_far) = (0, 0);
        random_walls(widths, |wall, d| {
            wall.moves(d);
            let [torque, energy] = sampled(&mut law, wall);
            assert!(16 * torque * torque <= 2 * i64::from(c2) * energy);
            let (step, allowed) = ((torque - last) * d.signum(), i64::from(c1) * d.abs() / 16);
            assert!(step <= allowed + 1);
            too_far += u32::from(step > allowed);
            last = torque;
        });
        assert!(too_far > 0);
    }
}

#[test]
fn the_force_bound_never_overdraws_its_energy_over_random_histories() {
    for c1 in [320, 325, 16, 7, 4000] {
        for torque_width in [12, 6] {
            let widths = widths(12, torque_width);
            let mut law = bounding(true, widths, c1, 0);
            let mut books = Books::default();
            random_walls(widths, |wall, d| force_bound_holds(&mut books, &mut law, wall, d, c1));
        }
    }
}

#[test]
fn the_force_bound_never_overdraws_its_energy_over_every_short_history() {
    for c1 in [3, 8, 16, 23, 80] {
        let law = bounding(true, widths(6, 5), c1, 0);
        every_short_history(&law, |books, law, wall, d| force_bound_holds(books, law, wall, d, c1));
    }
}

/// The work of the device on the torque of every edge (`done`), and `sum (new - old) d` over the motions that a law
/// missed (`while_computing`), because they fell between a capture and the load of its result.
#[derive(Default)]
struct Work {
    done: i128,
    while_computing: i128,
}

/// Runs one sample of an exact observer, in which the part `early` of the motion `d` falls into the computation.
/// Returns the energy after the capture.
fn works(law: &mut PassivityController, wall: &mut Wall, work: &mut Work, d: i64, early: i64) -> i128 {
    wall.period = i64::from(law.latency()) + 1;
    let before = law.tick(wall.words());
    let memory = i128::from(before.memory);
    // The old torque is in force up to the edge that loads the new one.
    wall.moves(early);
    let mut after = before;
    for _ in 1..law.latency() {
        after = law.tick(wall.words());
        assert_eq!(after.torque, before.torque);
    }
    after.torque = law.tick(wall.words()).torque;
    wall.moves(d - early);
    let [before, after, late, early] = [before.torque, after.torque, d - early, early].map(i128::from);
    work.done += before * early + after * late;
    work.while_computing += (after - before) * early;
    memory
}

fn observer(energy_width: u32) -> PassivityController {
    let config = PassivityConfig { exact: true, energy_width, ..PassivityConfig::default() };
    PassivityController::new(config).unwrap()
}

#[test]
fn the_exact_observer_sums_the_work_on_the_torque_shown() {
    let mut law = observer(48);
    let mut work = Work::default();
    random_walls(widths(12, 12), |wall, d| {
        let expected = work.done;
        assert_eq!(works(&mut law, wall, &mut work, d, 0), expected);
    });
    assert_eq!(work.while_computing, 0);
}

#[test]
fn the_exact_observer_misses_by_the_step_of_the_torque_what_moves_while_it_computes() {
    let mut law = observer(48);
    let mut work = Work::default();
    let mut random = Random(5);
    random_walls(widths(12, 12), |wall, d| {
        let expected = work.done + work.while_computing;
        let early = random.between(d.min(0), d.max(0));
        assert_eq!(works(&mut law, wall, &mut work, d, early), expected);
    });
    assert_ne!(work.while_computing, 0);
}

#[test]
fn the_controller_takes_up_all_that_was_given_but_for_the_floor_when_the_motion_goes_on() {
    // Whenever energy is missing and the same motion follows, the new torque brings back all of it but for less than
    // one PWM count times this motion, unless the torque is at its limit.
    let mut law = PassivityController::new(PassivityConfig { exact: true, ..PassivityConfig::default() }).unwrap();
    let mut brought_back = 0;
    let widths = widths(12, 12);
    random_walls(widths, |wall, d| {
        wall.moves(d);
        let [torque, energy] = sampled(&mut law, wall);
        let words = wall.words();
        let spring = (words.penetration * words.stiffness).min(4095);
        let drag = (words.damping * d).clamp(-4096, 4095);
        let wanted = if words.contact == 1 { (spring + drag).clamp(-4095, 4095) } else { 0 };
        let added = (torque - wanted) * d;
        if energy >= 0 || d == 0 {
            assert_eq!(torque, wanted);
        } else if torque.abs() < 4095 {
            assert!((0..d.abs()).contains(&(-energy - added)) || added == 4095 * d.abs(), "W = {energy}, d = {d}");
            brought_back += 1;
        }
    });
    assert!(brought_back > 1000, "{brought_back}");
}

/// The energy books of a passive spring with the stiffness word `k`, which is `scale` times `stiffness`. Every entry is
/// twice an energy, in units of `2^(-2 EXTENSION_FRAC)` of the spring's: `k x^2` with `x` as a word.
#[derive(Default)]
struct Ledger {
    /// Work of the device: the torque shown times the spring's motion at this torque.
    work: i128,
    /// Energy that the floor of the root has dropped.
    rooted: i128,
    /// Work that the floor of the torque has dropped.
    truncated: i128,
    /// Energy that engaging has stored without work.
    engaged: i128,
    /// Energy that the device took beyond all that was stored.
    overdrawn: i128,
}

fn ledger(config: SpringConfig, [stiffness, scale]: [i64; 2]) -> Ledger {
    let mut law = PassiveSpring::new(config).unwrap();
    let mut random = Random(3);
    let mut wall = Wall { stiffness, scale, ..Wall::new(12, 1) };
    let k = i128::from(stiffness * scale);
    let count = 1i128 << config.extension_frac;
    // `unit` is 1 in the fraction bits of `k x`; `k x = torque * unit + dropped`.
    let unit = count << 8;
    let (mut torque, mut x, mut contact, mut books) = (0i128, 0i128, 0, Ledger::default());
    for sample in 0..120_000 {
        if sample % 500 == 0 {
            wall.reference = wall.position + random.between(-20, 20);
        }
        let d = motion(&mut random, wall.position, 20);
        wall.moves(d);
        let [next_torque, next] = sampled(&mut law, &mut wall).map(i128::from);
        let words = wall.words();
        // The spring's motion, alpha d, as a word of the extension.
        let moved = i128::from(config.alpha) * i128::from(d) * count / 256;
        let dropped = k * x - torque * unit;
        assert!((0..unit).contains(&dropped), "the torque is the floor of what the spring pulls with");
        let engages = x == 0 && words.contact == 1 && (contact == 0 || config.revive);
        let square = if engages { (i128::from(words.penetration) * count).pow(2) } else { x * x + 2 * x * moved };
        let rest = square.max(0) - next * next;
        assert!((0..=2 * next).contains(&rest), "the extension is the floor of the root: {next} of {square}");
        books.rooted += k * rest;
        books.overdrawn += k * (-square).max(0);
        if engages {
            books.engaged += k * square;
        } else {
            books.work += 2 * torque * unit * moved;
            books.truncated += 2 * dropped * moved;
        }
        (torque, x, contact) = (next_torque, next, words.contact);
        let stored = k * x * x;
        let put_in = books.work + books.engaged + books.overdrawn;
        assert_eq!(stored - put_in, books.truncated - books.rooted, "sample {sample}");
    }
    books
}

#[test]
fn the_spring_stores_the_work_on_the_torque_less_what_its_narrowings_counted() {
    for (extension_frac, alpha, revive) in [(8, 256, true), (8, 256, false), (10, 384, true), (10, 256, false)] {
        let config = SpringConfig { extension_frac, alpha, revive, ..SpringConfig::default() };
        let books = ledger(config, [7, 200]);
        assert!(books.rooted > 0 && books.truncated != 0 && books.engaged > 0 && books.overdrawn > 0);
    }
}

#[test]
fn a_spring_whose_torque_is_whole_loses_by_the_root_alone() {
    // K times scale is a multiple of the unit, so the torque drops nothing. Apart from its two clamps, the spring then
    // only takes energy.
    let widths =
        LawWidths { scale: hpu_signal::Format::new(false, 12, 8).unwrap(), torque_width: 30, ..LawWidths::default() };
    let books = ledger(SpringConfig { widths, ..SpringConfig::default() }, [5, 1 << 16]);
    assert_eq!(books.truncated, 0);
    assert!(books.rooted > 0);
}
