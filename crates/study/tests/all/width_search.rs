//! Compares the search over widths with the whole grid run design by design, and with the scenes' own words.

use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;
use std::num::NonZeroUsize;
use std::sync::atomic::Ordering;

use hpu_chart::{error_by_width, stiffness_by_cost};
use hpu_cosim::scene::{Experiment, Loop, OutcomeKind, shipped};
use hpu_cosim::{Control, Driver};
use hpu_datapath::{LoopConfig, PwmConfig};
use hpu_farm::UnitResult;
use hpu_signal::Format;
use hpu_study::Error;
use hpu_study::accuracy::{Outputs, worst};
use hpu_study::map::{Cell, CellLimits, SceneText};
use hpu_study::widths::Field;
use hpu_study::widths::search::{
    Cost, Design, ESTIMATE_ERROR, Ended, Found, Knob, Merit, Plan, Ran, estimate, search, search_wave,
};

use crate::looks::{assert_readable, texts};

pub type Set = Vec<(String, String)>;

pub fn text(name: &str) -> SceneText {
    let shipped = shipped().iter().find(|shipped| shipped.name == name).expect("a shipped scene");
    SceneText { name: format!("{name}.toml"), text: shipped.text.to_string(), files: BTreeMap::new() }
}

pub fn set(pairs: &[(&str, &str)]) -> Set {
    pairs.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect()
}

pub fn knobs(texts: &[&str]) -> Vec<Knob> {
    texts.iter().map(|text| text.parse().unwrap_or_else(|error| panic!("{error}"))).collect()
}

pub const PLAN: Plan = Plan { against: None, within: 0.05, proved: false, jobs: NonZeroUsize::new(2).expect("two") };

/// Returns a shipped scene under changes, with its name in a search.
pub fn scene(name: &str, set: &Set) -> (String, Experiment) {
    (name.to_string(), text(name).parse(set).expect("the scene"))
}

pub fn found(scenes: &[(String, Experiment)], knobs: &[Knob], plan: Plan) -> Result<Found, Error> {
    let keep = |_: usize, _: &UnitResult<Ran>| Ok::<(), Infallible>(());
    match search(scenes, knobs, plan, BTreeMap::new(), &Control::default(), keep, |_| ()) {
        Ok(found) => Ok(found),
        Err(Ended::Refused(error)) => Err(error),
        Err(Ended::Stopped | Ended::Kept(_) | Ended::Wave(_)) => panic!("nobody stops it"),
    }
}

/// Returns every design of the grid.
fn designs(own: Design, knobs: &[Knob]) -> Vec<Design> {
    knobs.iter().fold(vec![own], |designs, knob| {
        let values = |design: Design| (knob.from..=knob.to).map(move |bits| design.with(knob.key.field, bits));
        designs.into_iter().flat_map(values).collect()
    })
}

/// Finds the stable word of a scene by the rule of the search. Each wall is a scene of its own, and nothing is
/// remembered. Returns the word and the number of runs.
fn stable_word(experiment: &Experiment) -> (i128, usize) {
    let scene = experiment.clone().axis().expect("an axis");
    let words = scene.words().expect("words");
    let unit = words.realised.torque_quantum_nm / words.realised.count_rad * scene.method.stiffness_format.lsb();
    let mut runs = 0;
    let mut settles = |word: i128| {
        runs += 1;
        let mut scene = scene.clone();
        scene.wall.stiffness_nm_per_rad = word as f64 * unit;
        let cell = Cell::run(&Experiment::Axis(scene), CellLimits::default(), &Control::default());
        cell.expect("it runs").expect("nobody stops it").outcome == OutcomeKind::Settled
    };
    let max = scene.method.stiffness_format.max();
    let mut word = 1i128 << i128::from(words.stiffness).ilog2();
    if settles(word) {
        while 2 * word <= max && settles(2 * word) {
            word *= 2;
        }
    } else {
        loop {
            word /= 2;
            if word == 0 {
                return (0, runs);
            }
            if settles(word) {
                break;
            }
        }
    }
    let mut digit = word / 2;
    while digit > 0 {
        if word + digit <= max && settles(word + digit) {
            word += digit;
        }
        digit /= 2;
    }
    (word, runs)
}

/// One scene of a search: its name, its changes, and whether its own stable stiffness counts.
pub type On<'a> = (&'a str, Set, bool);

/// Asserts that a search finds the front of the grid, in which every design is a scene of its own. `allowed` tells
/// which designs' words hold the required ranges. Returns the search's result and the number of runs of the grid.
pub fn holds_to_the_grid(
    on: &[On],
    texts: &[&str],
    plan: Plan,
    allowed: impl Fn(&Experiment) -> bool,
) -> (Found, usize) {
    let knobs = knobs(texts);
    let scenes: Vec<_> = on.iter().map(|(name, set, _)| scene(name, set)).collect();
    let found = found(&scenes, &knobs, plan).expect("a search");
    let own = Design::of(&scenes[0].1).expect("an axis");
    let parse = |(name, set, _): &On, design: Design| {
        text(name).parse(&set.iter().cloned().chain(design.set()).collect::<Set>())
    };
    let outputs = |experiment: &Experiment| {
        let (outputs, _) = Outputs::of(experiment, Driver::Events, &Control::default()).expect("it runs");
        outputs.expect("nobody stops it")
    };
    let wide = |on: &On| outputs(&parse(on, found.reference.design).expect("the reference"));
    let references: Vec<_> = on.iter().map(wide).collect();

    let mut grid: Vec<(String, Merit)> = Vec::new();
    let (mut refused, mut runs) = (0, 0);
    for design in designs(own, &knobs) {
        let parsed: Result<Vec<_>, _> = on.iter().map(|on| parse(on, design)).collect();
        let Some(experiments) = parsed.ok().filter(|all| all.iter().all(&allowed)) else {
            refused += 1;
            continue;
        };
        let (mut error, mut stiffness, mut lut4) = (0.0f64, f64::INFINITY, 0);
        for (index, experiment) in experiments.iter().enumerate() {
            let axis = experiment.clone().axis().expect("an axis");
            let words = axis.words().expect("words");
            let unit = words.realised.torque_quantum_nm / words.realised.count_rad * axis.method.stiffness_format.lsb();
            error = error.max(worst(&outputs(experiment).errors(&references[index]), &found.on[index].outputs));
            runs += 1;
            if on[index].2 {
                let (word, tries) = stable_word(experiment);
                stiffness = stiffness.min(word as f64 * unit);
                runs += tries;
            }
            lut4 = estimate(&words.config, axis.method.kind == Loop::Conventional);
        }
        let error = if error > plan.within { f64::INFINITY } else { error };
        grid.push((design.to_string(), Merit { cost: Cost::of_logic(lut4), error, stiffness }));
    }
    assert_eq!(found.designs, grid.len() + refused);
    assert_eq!(found.refused.iter().map(|(_, count)| count).sum::<usize>(), refused);
    let good = |merit: &Merit| merit.is_some() && !grid.iter().any(|(_, other)| other.is_some() && other.beats(merit));
    let mut wanted: Vec<(String, Merit)> = grid.iter().filter(|(_, merit)| good(merit)).cloned().collect();
    let front = found.front.iter().map(|&index| &found.points[index]);
    let mut front: Vec<(String, Merit)> = front.map(|point| (point.design.to_string(), point.merit)).collect();
    wanted.sort_by(|a, b| a.0.cmp(&b.0));
    front.sort_by(|a, b| a.0.cmp(&b.0));
    assert!(wanted.len() > 1, "a front of one says little");
    assert_eq!(front, wanted);
    assert!(found.grid_runs <= runs, "{} runs of the grid, which took {runs}", found.grid_runs);
    (found, runs)
}

/// As [`holds_to_the_grid`], on one scene.
fn one_holds_to_the_grid(name: &str, set: &Set, texts: &[&str], plan: Plan) -> Found {
    let (found, runs) = holds_to_the_grid(&[(name, set.clone(), true)], texts, plan, |_| true);
    assert!(3 * found.runs < runs, "{} runs instead of {runs}", found.runs);
    found
}

pub const ANY_ERROR: Plan = Plan { within: f64::MAX, ..PLAN };

#[test]
fn the_front_of_a_small_case_is_that_of_the_grid_run_design_by_design() {
    let set = set(&[("run.duration", "60 ms")]);
    let knobs = ["position_bits=4..7", "stiffness_format.frac=0..2", "damping_format.frac=1..3", "velocity_bits=2..5"];
    one_holds_to_the_grid("thrown-hybrid", &set, &knobs, ANY_ERROR);
}

#[test]
fn so_it_is_where_products_wrap_and_velocities_are_rescaled() {
    let set = set(&[
        ("run.duration", "60 ms"),
        ("method.product", "drop_upper"),
        ("method.rescaled", "true"),
        ("method.reference_rate", "5 kHz"),
    ]);
    let knobs = ["position_bits=5..7", "stiffness_format.int=5..7", "velocity_bits=3..5", "pwm.bits=10..12"];
    one_holds_to_the_grid("thrown-hybrid", &set, &knobs, ANY_ERROR);
}

#[test]
fn so_it_is_of_a_held_position_and_where_designs_that_are_far_off_are_none() {
    let set = set(&[("run.duration", "40 ms")]);
    let knobs = ["position_bits=4..7", "stiffness_format.frac=0..1", "damping_format.frac=1..4", "velocity_bits=2..5"];
    let found = one_holds_to_the_grid("thrown-conventional", &set, &knobs, Plan { within: 0.1, ..PLAN });
    assert!(found.points.iter().all(|point| point.merit.error <= 0.1));
}

#[test]
fn a_search_goes_on_from_its_rows_and_finds_the_same_on_any_number_of_threads() {
    let scene = [scene("thrown-hybrid", &set(&[("run.duration", "40 ms")]))];
    let knobs = knobs(&["position_bits=5..7", "velocity_bits=3..5"]);
    let mut rows: BTreeMap<usize, UnitResult<Ran>> = BTreeMap::new();
    let keep = |index: usize, row: &UnitResult<Ran>| {
        rows.insert(index, row.clone());
        if rows.len() < 7 { Ok(()) } else { Err("the disk is full") }
    };
    let ended = search(&scene, &knobs, PLAN, BTreeMap::new(), &Control::default(), keep, |_| ());
    assert!(matches!(ended, Err(Ended::Kept("the disk is full"))));
    let kept = rows.len();
    let mut more = 0;
    let keep = |_: usize, _: &UnitResult<Ran>| {
        more += 1;
        Ok::<(), Infallible>(())
    };
    let ended = search(&scene, &knobs, PLAN, rows, &Control::default(), keep, |_| ());
    let Ok(resumed) = ended else { panic!("it goes on") };
    assert_eq!(resumed.runs, 1 + kept + more, "no run is done twice");
    let one = Plan { jobs: NonZeroUsize::MIN, ..PLAN };
    assert_eq!(resumed, found(&scene, &knobs, one).expect("a search"));
}

#[test]
fn a_search_that_is_stopped_says_so() {
    let control = Control::default();
    control.stop.store(true, Ordering::Relaxed);
    let keep = |_: usize, _: &UnitResult<Ran>| Ok::<(), Infallible>(());
    let knobs = knobs(&["velocity_bits=3..5"]);
    let ended = search(&[scene("thrown-hybrid", &Set::new())], &knobs, PLAN, BTreeMap::new(), &control, keep, |_| ());
    assert!(matches!(ended, Err(Ended::Stopped)));
}

#[test]
fn a_search_against_24_bits_keeps_the_modulator_and_tells_the_smallest_design() {
    let knobs = knobs(&["position_bits=10..12", "stiffness_format.int=7..8", "velocity_bits=4..5"]);
    let found =
        found(&[scene("hybrid-wall", &Set::new())], &knobs, Plan { against: Some(24), ..PLAN }).expect("a search");
    assert_eq!(found.reference.design.to_string(), "24 (0,12,12) (0,8,16) 24 12");
    let least = 0.99 * found.reference.merit.stiffness;
    let enough = found.points.iter().filter(|point| point.merit.stiffness >= least);
    let cheapest = enough.map(|point| point.merit.cost.lut4()).min();
    assert_eq!(found.smallest(0.01).map(|point| point.merit.cost.lut4()), cheapest);
    assert!(cheapest.is_some(), "{:#?}", found.points);
    let by_cost = stiffness_by_cost("hybrid-wall", &found, 0.01, "hpu widths");
    let said = |text: &str| texts(&by_cost.svg).iter().any(|of| of.text.contains(text));
    // A design is shown with the names of its widths, and each level with its meaning.
    assert!(said("reference: position 24, stiffness (0,12,12), damping (0,8,16), velocity 24, PWM 12;"));
    assert!(said("1 % less stiff than the reference") && said("smallest within 1 % of it"));
    // The same holds when the smallest is at the right edge.
    let mut narrow = found.clone();
    let kept: Vec<usize> =
        (0..found.points.len()).filter(|&index| Some(found.points[index].merit.cost.lut4()) <= cheapest).collect();
    narrow.points = kept.iter().map(|&index| found.points[index]).collect();
    narrow.front = found.front.iter().filter_map(|front| kept.iter().position(|index| index == front)).collect();
    let narrow = stiffness_by_cost("hybrid-wall", &narrow, 0.01, "hpu widths");
    for picture in [by_cost, narrow, error_by_width("hybrid-wall", &found, "hpu widths")] {
        assert_readable(&picture, "a search");
    }
}

/// Returns the message of a search that is refused.
fn refusal(name: &str, pairs: &[(&str, &str)], texts: &[&str]) -> String {
    found(&[scene(name, &set(pairs))], &knobs(texts), PLAN).expect_err("it is refused").to_string()
}

#[test]
fn a_search_that_makes_no_sense_is_refused_with_its_reason() {
    let one = ["velocity_bits=3..5"];
    for (name, set, knobs, said) in [
        ("hybrid-wall", &[][..], &[][..], "nothing to vary"),
        ("hybrid-wall", &[], &["velocity_bits=3..5", "velocity_bits=6..7"], "velocity_bits is varied twice"),
        ("hybrid-wall", &[("model.datapath", "linear")], &one, "\"linear\" has no words; write \"words\""),
        ("phantom-drop", &[], &one, "this is a scene of a PHANToM"),
        ("prescribed-sweep", &[], &one, "the hand imposes the motion"),
        ("observed-wall", &[], &one, "method.kind = \"passivity_controller\": the search is for the kinds \"hybrid\""),
        ("stiffening-wall", &[], &one, "wall.ramp: the words change while the scene runs"),
        ("free-motion", &[("wall.stiffness", "0")], &one, "without a wall there is no stable stiffness"),
        (
            "hybrid-wall",
            &[],
            &[
                "position_bits=2..32",
                "velocity_bits=2..32",
                "pwm.bits=2..24",
                "stiffness_format.frac=0..20",
                "damping_format.frac=0..24",
            ],
            "designs; at most 2097152 are searched: narrow a range",
        ),
    ] {
        let refused = refusal(name, set, knobs);
        assert!(refused.contains(said), "{name}: {refused}");
    }
}

#[test]
fn widths_of_which_no_scene_has_any_say_which_and_why() {
    let refused = refusal("hybrid-wall", &[], &["stiffness_format.int=2..4", "velocity_bits=3..5"]);
    assert!(refused.starts_with("no scene has any of the 9 designs\n3 of them: "), "{refused}");
    assert!(refused.contains("wall.stiffness") && refused.contains("does not fit (0,2,0)"), "{refused}");
    let refused = refusal("hybrid-wall", &[], &["damping_format.int=30..32", "velocity_bits=3..5"]);
    assert!(refused.contains("method.damping_format: (0,30,4): a gain has 2 to 32 bits"), "{refused}");
}

#[test]
fn some_widths_that_no_scene_has_are_skipped_and_counted() {
    let set = set(&[("run.duration", "40 ms")]);
    let found =
        found(&[scene("thrown-hybrid", &set)], &knobs(&["stiffness_format.int=5..7", "velocity_bits=4..5"]), PLAN);
    let found = found.expect("a search");
    assert_eq!(found.refused.len(), 1);
    assert!(found.refused[0].0.contains("does not fit (0,5,0)") && found.refused[0].1 == 2, "{:?}", found.refused);
}

#[test]
fn a_knob_that_is_none_says_what_is_accepted() {
    for (text, said) in [
        ("position_bits", "write KEY=FROM..TO, as in position_bits=8..16"),
        ("position_bits=12", "takes one value only, 12; write KEY=FROM..TO, or set it by --set"),
        ("position_bits=12..12", "position_bits=12..12 takes one value only"),
        ("position_bits=16..8", "is reversed; write the smaller value first"),
        ("position_bits=8..40", "cannot be 40: a scene takes 2 to 32"),
        ("position_bits=a..b", "`a..b` is no range of bits"),
        ("period_bits=8..12", "period_bits is no width that a search varies; write one of position_bits, "),
        ("stiffness_format=8..12", "stiffness_format.int, stiffness_format.frac, "),
    ] {
        let error = text.parse::<Knob>().expect_err(text);
        assert!(error.to_string().contains(said), "{text}: {error}");
    }
    let knob: Knob = "method.pwm.bits=8..12".parse().expect("with the section in front too");
    assert_eq!((knob.to_string(), knob.values()), ("pwm.bits=8..12".into(), 5));
}

#[test]
fn a_design_is_refused_where_its_scene_is() {
    let scene = text("thrown-hybrid");
    let base = scene.parse(&Set::new()).expect("the scene");
    let own = Design::of(&base).expect("an axis");
    let fields: Vec<Field> = own.widths().map(|(key, _)| key.field).collect();
    let mut accepted = 0;
    for &one in &fields {
        for &other in &fields {
            for (bits, more) in (0..=34).flat_map(|bits| [0, 2, 9, 32].map(|more| (bits, more))) {
                let design = own.with(one, bits).with(other, more);
                let parsed = scene.parse(&design.set());
                assert_eq!(design.scene(&base).is_ok(), parsed.is_ok(), "{design}: {parsed:?}");
                accepted += u32::from(parsed.is_ok());
            }
        }
    }
    assert!(accepted > 500, "{accepted}");
}

/// Each row gives the position, integer and fraction bits of stiffness and damping, velocity, modulator, whether
/// products saturate, and whether the position is held; then the LUT4s that Yosys 0.23 maps the loop to, by the flow of
/// `hpu cost`. The estimate's weights were fitted to other loops.
const MAPPED: [([i32; 7], bool, bool, u32); 12] = [
    ([10, 9, 1, 5, 4, 7, 12], true, false, 673),
    ([11, 7, 2, 3, 3, 6, 12], true, false, 573),
    ([15, 11, 0, 6, 3, 11, 10], true, false, 930),
    ([12, 8, 1, 4, 2, 9, 11], true, false, 636),
    ([14, 12, 4, 8, 0, 5, 12], true, false, 936),
    ([9, 10, 3, 3, 1, 8, 9], true, false, 535),
    ([11, 8, 2, 2, 4, 12, 12], true, true, 714),
    ([13, 6, 2, 5, 5, 13, 12], true, false, 886),
    ([16, 12, 2, 2, 2, 10, 14], true, false, 938),
    ([12, 9, 4, 10, 2, 12, 13], true, true, 1132),
    ([10, 12, 0, 8, 4, 10, 12], false, false, 690),
    ([22, 9, 3, 7, 6, 14, 12], true, false, 1542),
];

fn config([position, k_int, k_frac, b_int, b_frac, velocity, pwm]: [i32; 7], saturate: bool) -> LoopConfig {
    let gain = |int, frac| Format::new(false, int, frac).expect("a format");
    LoopConfig {
        position_width: position as u32,
        stiffness: gain(k_int, k_frac),
        damping: gain(b_int, b_frac),
        velocity_width: velocity as u32,
        pwm: PwmConfig { width: pwm as u32, ..PwmConfig::default() },
        saturate,
        ..LoopConfig::default()
    }
}

#[test]
fn the_estimate_is_as_near_to_what_yosys_maps_as_it_says() {
    for (widths, saturate, held, mapped) in MAPPED {
        let error = f64::from(estimate(&config(widths, saturate), held)) / f64::from(mapped) - 1.0;
        assert!(error.abs() <= ESTIMATE_ERROR, "{widths:?}: {error:+.3}");
    }
}

#[test]
fn no_bit_of_position_gains_and_modulator_makes_the_estimate_smaller() {
    let widths = |seed: u32| {
        [0, 1, 2, 3, 4, 5, 6].map(|place| (2 + seed.wrapping_mul(0x9e37_79b9).rotate_left(5 * place) % 15) as i32)
    };
    for seed in 0..20_000 {
        let widths = widths(seed);
        for place in [0, 1, 2, 3, 4, 6] {
            let mut more = widths;
            more[place] += 1;
            let [less, more] = [widths, more].map(|widths| estimate(&config(widths, true), false));
            assert!(less <= more, "{widths:?} at {place}: {less} and {more}");
        }
    }
}

#[test]
fn a_search_whose_waves_are_shared_by_processes_finds_what_one_process_finds() {
    let scene =
        [scene("thrown-hybrid", &[("run.duration".to_string(), "40 ms".to_string())].into_iter().collect::<Set>())];
    let knobs = knobs(&["position_bits=5..7", "velocity_bits=3..5"]);
    let plan = Plan { jobs: NonZeroUsize::MIN, ..PLAN };
    let control = Control::default();
    let part = |done: &BTreeMap<usize, UnitResult<Ran>>, part: &[usize]| {
        let mut rows = BTreeMap::new();
        let keep = |index: usize, row: &UnitResult<Ran>| {
            rows.insert(index, row.clone());
            Ok::<(), Infallible>(())
        };
        let ended = search_wave(&scene, &knobs, plan, done.clone(), part, &control, keep);
        (ended, rows)
    };
    let mut done = BTreeMap::new();
    let mut waves = 0;
    let shared = loop {
        match part(&done, &[]) {
            (Ok(found), rows) => {
                assert!(rows.is_empty());
                break found;
            }
            (Err(Ended::Wave(wave)), rows) => {
                assert!(rows.is_empty(), "no run is done unasked");
                waves += 1;
                let (first, second) = wave.split_at(wave.len() / 2);
                // Each half knows the waves before alone.
                let parts = [second, first].map(|half| part(&done, half));
                for ((ended, rows), half) in parts.into_iter().zip([second, first]) {
                    assert!(matches!(ended, Err(Ended::Wave(of)) if of == wave));
                    assert_eq!(rows.keys().copied().collect::<BTreeSet<_>>(), half.iter().copied().collect());
                    done.extend(rows);
                }
            }
            _ => panic!("nobody stops it"),
        }
    };
    assert!(waves > 2);
    assert_eq!(shared, found(&scene, &knobs, plan).expect("a search"));
}
