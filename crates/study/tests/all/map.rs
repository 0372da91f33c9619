//! Maps: axes, methods and cells, and that a map does not depend on threads or interruptions.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::fs::File;
use std::num::NonZeroUsize;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use hpu_cosim::Control;
use hpu_cosim::scene::{OutcomeKind, shipped, shipped_file};
use hpu_farm::{Row, UnitResult};
use hpu_prove::criteria::named;
use hpu_study::Error;
use hpu_study::map::{self, Axis, Cell, CellIndex, CellLimits, Curves, Displayed, Found, Map, Method, Plan, Switching};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;

fn axis(text: &str) -> Axis {
    text.parse().unwrap_or_else(|error| panic!("{text}: {error}"))
}

fn map_of(scene: &str, set: &[(&str, &str)], x: &str, y: &str, methods: &[&str]) -> Result<Map, Error> {
    let scene = shipped().iter().find(|shipped| shipped.name == scene).expect("a shipped scene");
    let set: Vec<_> = set.iter().map(|(key, value)| ((*key).to_string(), (*value).to_string())).collect();
    let methods = methods.iter().map(|text| text.parse().expect("a method")).collect();
    Map::new((scene.name, scene.text), &set, (axis(x), axis(y)), methods, &mut shipped_file)
}

/// Returns a map of a hand that leans on soft and stiff walls for 150 ms, with the last 45 ms judged.
fn pressed(x: &str, y: &str, methods: &[&str]) -> Map {
    let path = "[[\"0 s\", 1.4], [\"20 ms\", 1.8]]";
    let set = [("run.duration", "150 ms"), ("device.initial_angle", "1.4 rad"), ("hand.path", path)];
    map_of("hybrid-wall", &set, x, y, methods).expect("a map")
}

fn plan(full: bool, jobs: usize) -> Plan {
    Plan { full, limits: CellLimits::default(), jobs: NonZeroUsize::new(jobs).unwrap() }
}

fn run(map: &Map, plan: Plan) -> Vec<Found> {
    let found = map.run(plan, BTreeMap::new(), &Control::default(), |_, _| Ok::<_, Infallible>(())).unwrap();
    found.expect("nobody stops it")
}

fn outcomes(found: &[Found]) -> Vec<Option<OutcomeKind>> {
    (0..found.len()).map(|index| map::outcome(found, index)).collect()
}

#[test]
fn an_axis_has_both_ends_and_equal_steps_or_equal_ratios() {
    let linear = axis("wall.stiffness=1..3 N.m/rad:5");
    assert_eq!(linear.values(), [1.0, 1.5, 2.0, 2.5, 3.0]);
    assert_eq!(linear.text(1), "1.5 N.m/rad");
    let log = axis("method.sample_rate=1 Hz..1000 Hz:4:log");
    assert_eq!((log.values(), log.text(2)), (&[1.0, 10.0, 100.0, 1000.0][..], "100 Hz".to_string()));
    let plain = axis("method.position_bits=8..16:9");
    assert_eq!(plain.text(3), "11", "a whole number stays one");
    assert_eq!(axis("wall.position=-1..1:3").values(), [-1.0, 0.0, 1.0]);
    assert_eq!(axis("wall.damping=1e-3..2e-3 N.m.s/rad").cells(), 41);
    assert_eq!(axis(&log.to_string()), log, "it is written as it is read");
    assert_eq!(log.position(31.622_776_601_683_793), 1.5);
    assert_eq!(linear.position(2.25), 2.5);
}

#[test]
fn an_axis_that_is_none_is_refused_with_what_is_wrong() {
    for (text, word) in [
        ("wall.stiffness", "KEY=FROM..TO"),
        ("wall.stiffness=1", "KEY=FROM..TO"),
        ("=1..2", "no key"),
        ("a=2..2", "empty"),
        ("a=3..2", "reversed"),
        ("a=1..2:1", "1 cells"),
        ("a=1..2:1001", "1001 cells"),
        ("a=1..2:many", "`many`"),
        ("a=0..2:5:log", "above zero"),
        ("a=-1..2:5:log", "above zero"),
        ("a=one..2", "`one`"),
        ("a=nan..2", "`nan`"),
        ("a=1..inf", "`inf`"),
        ("a=1 mm..2 cm", "same unit"),
        ("a=1..1.0001:41", "told apart"),
    ] {
        let error = text.parse::<Axis>().expect_err(text);
        assert!(error.to_string().contains(word), "{text}: {error}");
    }
}

#[test]
fn commas_within_brackets_and_quotes_do_not_part_a_methods_changes() {
    let method: Method = "coarse:method.damping_format=(0,8,4),hand.path=[[\"0 s\", 0]],a=\"b,c\"".parse().unwrap();
    let pairs = [("method.damping_format", "(0,8,4)"), ("hand.path", "[[\"0 s\", 0]]"), ("a", "\"b,c\"")];
    assert_eq!(method.set, pairs.map(|(key, value)| (key.to_string(), value.to_string())));
    assert_eq!("plain".parse::<Method>().unwrap(), Method { label: "plain".into(), set: Vec::new() });
    for bad in ["", ":a=b", "a=b", "label:a"] {
        assert!(bad.parse::<Method>().is_err(), "{bad}");
    }
}

#[test]
fn maps_that_cannot_be_are_refused_before_a_cell_is_run() {
    let stiffness = "wall.stiffness=0.1..3 N.m/rad:5";
    let refused = |set: &[(&str, &str)], x: &str, y: &str, methods: &[&str]| {
        map_of("hybrid-wall", set, x, y, methods).expect_err("refused").to_string()
    };
    let holds = |said: String, words: &[&str]| assert!(words.iter().all(|word| said.contains(word)), "{said}");
    let damping = "wall.damping=0..0.2 mN.m.s/rad:5";
    holds(refused(&[], stiffness, stiffness, &["a"]), &["both axes", "wall.stiffness"]);
    holds(refused(&[], stiffness, damping, &["a", "a:wall.position=1"]), &["two methods", "labelled a"]);
    holds(refused(&[], stiffness, damping, &["a:wall.damping=1"]), &["method a", "wall.damping", "axis"]);
    holds(refused(&[], "wall.stifness=0.1..3:5", damping, &["a"]), &["wall.stifness", "unknown key", "stiffness"]);
    holds(refused(&[], "wall.stiffness=0.1..3 mm:5", damping, &["a"]), &["wall.stiffness", "N.m/rad"]);
    holds(refused(&[], stiffness, damping, &["ok", "law:model.datapath=linear"]), &["method law", "linear"]);
    let mass = [
        ("device", "{ kind = \"mass\", mass = 1, damping = 1 }"),
        ("hand", "{ kind = \"none\" }"),
        ("wall.damping", "0"),
        ("expect", "{}"),
    ];
    let position = "wall.position=0..1:5";
    holds(
        refused(&mass, "wall.stiffness=1..2 N/m:5", position, &["a"]),
        &["encoder.resolution", "missing", "method a"],
    );
    let recording = map_of("replay-capture", &[], stiffness, damping, &["a"]).expect_err("refused");
    assert_eq!(recording.to_string(), "a recording has no device whose motion could be judged");
    let phantom = map_of(
        "phantom-drop",
        &[],
        "room.stiffness=100..1000 N/m:3",
        "drop.weight=0.1..0.2 N:3",
        &["hybrid:method.kind=hybrid"],
    );
    holds(phantom.expect_err("refused").to_string(), &["method hybrid", "method"]);
}

#[test]
fn a_cell_comes_back_from_its_row_as_it_was() {
    let cell = Cell {
        outcome: OutcomeKind::LimitCycle,
        rms: Some(0.1 + 0.2),
        amplitude: Some(1e-300),
        frequency_hz: Some(0.0),
        hand_j: -1.5,
        source_j: 2.0 / 3.0,
        dissipated_j: 0.0,
        displayed: None,
        contact_share: Some(1.0 / 3.0),
        device_contact_share: Some(3.0 / 7.0),
        product_wraps: std::num::NonZeroU32::new(3),
        contact_unseen: false,
        position_lost_share: 1.0 / 16.0,
        stiffness_error: None,
        overflow_share: 0.125,
        switching: Some(Box::new(Switching { count: 12, bump_n: 2.0 / 7.0, switch_j: None })),
        edges: u64::MAX,
        telling_s: Some(0.3),
        for_ever: None,
    };
    let displayed = Some(Displayed { stiffness: f64::NEG_INFINITY, asked: 1.0 / 7.0 });
    let touching =
        Cell { displayed, switching: None, rms: None, contact_unseen: true, telling_s: None, ..cell.clone() };
    for outcome in OutcomeKind::ALL {
        for cell in [&cell, &touching].map(|cell| Cell { outcome, ..cell.clone() }) {
            assert_eq!(Row::of(&cell).read(), Ok(cell));
        }
    }
    let row: serde_json::Value = Row::of(&cell).read().expect("JSON");
    for (key, value) in
        [("outcome", "flying".into()), ("rms", "x".into()), ("edges", (-1).into()), ("hand_j", serde_json::Value::Null)]
    {
        let mut bad = row.clone();
        bad[key] = value;
        assert!(Row::of(&bad).read::<Cell>().is_err(), "{key}");
    }
}

#[test]
fn a_map_of_a_real_scene_has_the_boundary_of_its_full_grid_from_a_quarter_of_the_runs() {
    let map = pressed("wall.stiffness=0.5..6 N.m/rad:33", "wall.damping=0..0.4 mN.m.s/rad:33", &["a"]);
    let (refined, full) = (run(&map, plan(false, 2)), run(&map, plan(true, 2)));
    let (refined_outcomes, full_outcomes) = (outcomes(&refined), outcomes(&full));
    let kinds = |kind| full_outcomes.iter().filter(|outcome| **outcome == Some(kind)).count();
    assert!(kinds(OutcomeKind::Settled) > 100 && kinds(OutcomeKind::LimitCycle) > 100, "there is a boundary");
    assert_eq!(refined_outcomes, full_outcomes);
    let runs = refined.iter().filter(|found| matches!(found, Found::Run(_))).count();
    assert!(4 * runs <= full.len(), "{runs} of {}", full.len());
    // Cells that both maps ran are the same to the last digit.
    for (one, other) in refined.iter().zip(&full).filter(|(one, _)| matches!(one, Found::Run(_))) {
        assert_eq!(one, other);
    }
}

#[test]
fn where_the_hand_stops_before_the_wall_is_no_edge_of_rest_and_the_refined_map_finds_it() {
    // The hand's spring rests at 1.8 rad. It presses walls before that; walls beyond it are never reached.
    let map = pressed("wall.position=1.2..2.4 rad:17", "wall.damping=0..0.1 mN.m.s/rad:9", &["a"]);
    let (refined, full) = (run(&map, plan(false, 2)), run(&map, plan(true, 2)));
    let reached = |found: &[Found], index: usize| {
        map::nearest(found, index).expect("every cell is known").contact_share.expect("a complete run") > 0.0
    };
    let expected: Vec<bool> = (0..full.len()).map(|index| reached(&full, index)).collect();
    assert_eq!((0..full.len()).map(|index| reached(&refined, index)).collect::<Vec<_>>(), expected);
    let settled = |index: &usize| map::outcome(&full, *index) == Some(OutcomeKind::Settled);
    assert!((0..full.len()).all(|index| expected[index] || settled(&index)));
    let edges: usize = (0..full.len())
        .filter(|index| expected[*index])
        .map(|index| {
            let (ix, iy) = (index % 17, index / 17);
            let beside = [(ix > 0).then(|| index - 1), (ix < 16).then_some(index + 1)];
            let above = [(iy > 0).then(|| index.wrapping_sub(17)), (iy < 8).then_some(index + 17)];
            let beside = beside.into_iter().chain(above).flatten().filter(|other| expected[*other]);
            beside.filter(|other| settled(&index) && !settled(other)).count()
        })
        .sum();
    assert_eq!(map::Edge::new(&map, &full, None, 0).places, edges);
}

#[test]
fn threads_and_interruptions_change_nothing_and_no_cell_is_run_twice() {
    let map = pressed(
        "wall.stiffness=0.5..6.5 N.m/rad:17",
        "wall.damping=0..0.4 mN.m.s/rad:9",
        &["a", "b:method.pwm.bits=11"],
    );
    let expected = run(&map, plan(false, 1));
    assert_eq!(run(&map, plan(false, 3)), expected);
    for stop_after in [1, 7, 20] {
        let control = Control::default();
        let mut done: BTreeMap<usize, UnitResult<Cell>> = BTreeMap::new();
        let stopped = map.run(plan(false, 2), BTreeMap::new(), &control, |index, row| {
            done.insert(index, row.clone());
            control.stop.store(done.len() >= stop_after, Ordering::Relaxed);
            Ok::<_, Infallible>(())
        });
        assert_eq!(stopped, Ok(None));
        let before = done.clone();
        let went_on = map.run(plan(false, 2), done, &Control::default(), |index, _| {
            assert!(!before.contains_key(&index), "{index} is run twice");
            Ok::<_, Infallible>(())
        });
        assert_eq!(went_on, Ok(Some(expected.clone())));
    }
}

#[test]
fn cells_with_the_same_words_are_each_what_they_are_alone() {
    let map = pressed(
        "wall.stiffness=1..1.15 N.m/rad:8",
        "wall.damping=0.1..0.105 mN.m.s/rad:3",
        &["a", "b:device.coulomb_friction=1 mN.m"],
    );
    let (mut words, mut asked) = (Vec::new(), Vec::new());
    for (index, found) in run(&map, plan(true, 2)).into_iter().enumerate() {
        let Found::Run(Ok(cell)) = found else { panic!("cell {index}: {found:?}") };
        let experiment = map.experiment(map.point(index)).unwrap();
        let alone = Cell::run(&experiment, CellLimits::default(), &Control::default()).unwrap().unwrap();
        assert_eq!(cell, alone, "cell {index}");
        let scene = experiment.axis().unwrap();
        let own = scene.words().unwrap();
        words.push((scene.device, own.stiffness, own.damping));
        asked.push(cell.stiffness_error.unwrap().to_bits());
    }
    let distinct = (0..words.len()).filter(|&k| !words[..k].contains(&words[k])).count();
    assert!(distinct * 2 <= words.len(), "{distinct} of {}", words.len());
    asked.sort_unstable();
    asked.dedup();
    assert!(asked.len() >= 6, "each stiffness has an error of its own");
}

#[test]
fn a_refined_map_does_not_depend_on_what_else_is_known() {
    let map = pressed("wall.stiffness=0.5..6.5 N.m/rad:13", "wall.damping=0..0.4 mN.m.s/rad:5", &["a"]);
    let mut all: BTreeMap<usize, UnitResult<Cell>> = BTreeMap::new();
    let keep = |index: usize, row: &UnitResult<Cell>| {
        all.insert(index, row.clone());
        Ok::<_, Infallible>(())
    };
    map.run(plan(true, 2), BTreeMap::new(), &Control::default(), keep).unwrap();
    let again = map.run(plan(false, 2), all, &Control::default(), |_, _| Err("nothing is left to run"));
    assert_eq!(again, Ok(Some(run(&map, plan(false, 2)))));
}

#[test]
fn a_cell_of_too_many_events_and_one_that_cannot_be_are_rows_with_their_reasons_and_sink_nothing() {
    // Durations of 20 ms and of eleven days; a stiffness that fits its word, and one that does not.
    let set = [("record.plant_rate", "10 Hz"), PLANNED];
    let map =
        map_of("hybrid-wall", &set, "run.duration=0.02..1000000 s:2", "wall.stiffness=1..1000000 N.m/rad:2", &["a"])
            .expect("a map");
    let limits = CellLimits { events: 100_000, ..CellLimits::default() };
    let found = run(&map, Plan { limits, ..plan(true, 2) });
    let reason = |index: usize| match &found[index] {
        Found::Run(Err(reason)) => reason.why(),
        other => panic!("{other:?}"),
    };
    assert!(matches!(&found[0], Found::Run(Ok(_))), "{:?}", found[0]);
    assert_eq!(reason(1), "more than 100000 events");
    for index in [2, 3] {
        assert!(reason(index).contains("does not fit"), "{}", reason(index));
    }
    // A run that needs more memory than any machine has is not begun.
    let map = map_of("hybrid-wall", &[], "run.duration=0.02..1000000 s:2", "wall.stiffness=1..2 N.m/rad:2", &["a"]);
    let found = run(&map.expect("a map"), plan(true, 2));
    assert!(
        matches!(&found[1], Found::Run(Err(reason)) if reason.why().contains("record.plant_rate")),
        "{:?}",
        found[1]
    );
}

/// The path of a hand that has a plan for eleven days: until then no motion repeats.
const PLANNED: (&str, &str) = (
    "hand.path",
    r#"[["0 s", 0], ["150 ms", 1.4], ["250 ms", 1.9], ["400 ms", 1.2], ["500 ms", 1.8], ["1000000 s", 1.8]]"#,
);

/// Returns a map whose cells have some ten thousand events, and up to ten times as many.
fn of_many_events() -> Map {
    let stiffness = "wall.stiffness=1..2 N.m/rad:2";
    map_of("hybrid-wall", &[PLANNED], "run.duration=0.02..40 s:5", stiffness, &["a"]).expect("a map")
}

#[test]
fn a_limit_in_events_makes_the_same_cells_on_a_busy_machine() {
    let (map, idle) = (of_many_events(), AtomicBool::new(false));
    let limits = CellLimits { events: 60_000, ..CellLimits::default() };
    let alone = run(&map, Plan { limits, ..plan(true, 1) });
    let failed = |found: &Found| matches!(found, Found::Run(Err(reason)) if reason.why() == "more than 60000 events");
    assert!(alone.iter().any(failed) && !alone.iter().all(failed), "{alone:?}");
    let crowded = thread::scope(|scope| {
        for _ in 0..6 {
            scope.spawn(|| {
                while !idle.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            });
        }
        let crowded = run(&map, Plan { limits, ..plan(true, 4) });
        idle.store(true, Ordering::Relaxed);
        crowded
    });
    assert_eq!(crowded, alone);
}

#[test]
fn a_cell_that_the_guard_stops_is_late_and_has_no_row_and_is_run_by_whoever_goes_on() {
    let map = of_many_events();
    let limits = CellLimits { guard: Duration::ZERO, ..CellLimits::default() };
    // A cell is late after the guard's first look, which comes after 20 ms; this stops at least the longest cells.
    let mut rows: BTreeMap<usize, UnitResult<Cell>> = BTreeMap::new();
    let mut keep = |index: usize, row: &UnitResult<Cell>| {
        rows.insert(index, row.clone());
        Ok::<_, Infallible>(())
    };
    let guarded = map.run(Plan { limits, ..plan(true, 2) }, BTreeMap::new(), &Control::default(), &mut keep);
    let guarded = guarded.unwrap().expect("nobody stops it");
    let late: Vec<usize> = (0..map.len()).filter(|index| map::is_late(&guarded, *index)).collect();
    assert!(!late.is_empty(), "{guarded:?}");
    assert_eq!(rows.len() + late.len(), map.len(), "a late cell has no row");
    assert!(late.iter().all(|index| !rows.contains_key(index) && map::outcome(&guarded, *index).is_none()));
    let mut csv = Vec::new();
    map::csv(&mut csv, &map, &guarded, "hpu map", |_| String::new()).unwrap();
    assert_eq!(String::from_utf8(csv).unwrap().matches(",not_run,0,").count(), late.len());
    let again = Mutex::new(Vec::new());
    let note = |index: usize, _: &UnitResult<Cell>| {
        again.lock().unwrap().push(index);
        Ok::<_, Infallible>(())
    };
    let found = map.run(plan(true, 2), rows, &Control::default(), note).unwrap().expect("nobody stops it");
    let mut again = again.into_inner().unwrap();
    again.sort_unstable();
    assert_eq!(again, late);
    assert_eq!(found, run(&map, plan(true, 1)), "as if there had been no guard");
}

#[test]
fn the_displayed_stiffness_of_a_quiet_contact_is_that_of_the_word_within_the_encoders_and_the_modulators_steps() {
    let map = map_of(
        "hybrid-wall",
        &[("run.duration", "1 s")],
        "wall.stiffness=0.5..1.5 N.m/rad:2",
        "wall.damping=0.1..0.2 mN.m.s/rad:2",
        &["a"],
    )
    .expect("a map");
    for (index, found) in run(&map, plan(true, 2)).into_iter().enumerate() {
        let Found::Run(Ok(cell)) = found else { panic!("{found:?}") };
        assert_eq!(cell.outcome, OutcomeKind::Settled);
        let experiment = map.experiment(map.point(index)).unwrap().axis().unwrap();
        let realised = experiment.words().unwrap().realised;
        let displayed = cell.displayed.map(|displayed| displayed.stiffness).expect("the hand leans on it");
        // The hand's spring balances where 0.3 (1.8 - x) = k (x - wall). The wall's place is rounded to a count, and
        // the shaft's position is floored to one. So the torque is off by the stiffness times a count and a half, and
        // the position is off by as much. Mean torques are known to a step of the modulator.
        let stiffness = realised.stiffness_nm_per_rad;
        let off = 1.5 * realised.count_rad;
        let depth = 0.3 * (1.8 - 1.5) / (0.3 + stiffness) - off;
        let bound = (off * stiffness + realised.torque_quantum_nm) / depth;
        assert!((displayed - stiffness).abs() < bound, "{displayed} for {stiffness} within {bound}");
        let asked = map.x.values()[map.point(index).ix];
        assert_eq!(cell.displayed.and_then(Displayed::ratio), Some(displayed / asked));
    }
}

#[test]
fn curves_are_the_limits_that_hpu_limits_tells_in_the_axiss_unit_and_over_either_axis() {
    let (stiffness, damping) = ("wall.stiffness=100..5000 mN.m/rad:5", "wall.damping=0..0.4 mN.m.s/rad:3");
    for (x, y) in [(stiffness, damping), (damping, stiffness)] {
        let map = map_of("hybrid-wall", &[], x, y, &["a"]).expect("a map");
        let curves = Curves::new(&map, 0, &Control::new()).expect("curves");
        assert_eq!(curves.over_x, x == stiffness);
        let names: Vec<_> = curves.curves.iter().map(|curve| curve.name).collect();
        assert_eq!(names, ["spectral_radius", "routh", "describing_function"]);
        for at in 0..3 {
            let (ix, iy) = if curves.over_x { (2, at) } else { (at, 2) };
            let scene = map.experiment(CellIndex { method: 0, ix, iy }).unwrap().axis().unwrap();
            for curve in &curves.curves {
                let criterion = named(curve.name, &scene).expect("one of its criteria").expect("told");
                let (found, told) = (curve.limits[at].expect("a limit") / 1000.0, criterion.limit);
                assert!((found / told - 1.0).abs() < 1e-9, "{}: {found} {told}", curve.name);
            }
        }
    }
}

#[test]
fn where_no_criterion_speaks_it_is_said_why() {
    let map = map_of("hybrid-wall", &[], "wall.position=1..1.5:3", "wall.damping=0..0.1 mN.m.s/rad:3", &["a"]);
    assert!(
        Curves::new(&map.expect("a map"), 0, &Control::new()).expect_err("none").to_string().contains("wall.stiffness")
    );
    let map = map_of("phantom-drop", &[], "room.stiffness=100..1000 N/m:3", "drop.weight=0.1..0.2 N:3", &["a"]);
    assert!(Curves::new(&map.expect("a map"), 0, &Control::new()).expect_err("none").to_string().contains("no axis"));
}

#[test]
fn the_head_of_a_masss_map_is_in_metres_and_newtons() {
    let map = map_of("rail-drop", &[], "wall.stiffness=1..2 kN/m:3", "wall.position=1..2 cm:3", &["a"]).expect("a map");
    let units = map::units_of(&map);
    let of = |key: &str| units.iter().find(|(known, _)| known == key).expect("a key").1.as_str();
    assert!(of("rms").starts_with("m, ") && of("amplitude").starts_with("m, "));
    assert!(of("displayed_stiffness").starts_with("N/m, "));
}

#[test]
fn csv_and_parquet_hold_the_same_rows_with_units_in_their_heads() {
    let map = pressed(
        "wall.stiffness=0.5..6.5 N.m/rad:9",
        "wall.position=1.495..1.505 rad:5",
        &["a", "b:method.pwm.bits=11"],
    );
    let found = run(&map, plan(false, 2));
    let replay = |index: usize| format!("run {index}, \"again\"");
    let mut csv = Vec::new();
    map::csv(&mut csv, &map, &found, "hpu map x", replay).unwrap();
    let csv = String::from_utf8(csv).unwrap();
    let mut lines = csv.lines().skip_while(|line| line.starts_with('#'));
    assert!(csv.starts_with("# hpu map x\n# x: wall.stiffness in N.m/rad\n# y: wall.position in rad\n"));
    let head = "method,ix,iy,x,y,outcome,run,rms,amplitude,frequency_hz,hand_j,source_j,dissipated_j,\
                displayed_stiffness,displayed_ratio,contact_share,device_contact_share,product_wraps,contact_unseen,\
                position_lost_share,stiffness_error,overflow_share,switches,bump_n,switch_j,edges,telling_duration_s,\
                reason,replay";
    assert_eq!(lines.next(), Some(head));
    let lines: Vec<&str> = lines.collect();
    assert_eq!(lines.len(), 90);

    let path = concat!(env!("CARGO_TARGET_TMPDIR"), "/map.parquet");
    map::parquet(File::create(path).unwrap(), &map, &found, "hpu map x", replay).unwrap();
    let reader = SerializedFileReader::new(File::open(path).unwrap()).unwrap();
    let metadata = reader.metadata().file_metadata();
    let pairs = metadata.key_value_metadata().expect("metadata");
    let value = |key: &str| pairs.iter().find(|pair| pair.key == key).and_then(|pair| pair.value.as_deref());
    assert_eq!((value("command"), value("x")), (Some("hpu map x"), Some("wall.stiffness in N.m/rad")));
    for (index, row) in reader.get_row_iter(None).unwrap().enumerate() {
        let fields: Vec<String> = row
            .unwrap()
            .get_column_iter()
            .map(|(_, field)| match field {
                Field::Null => String::new(),
                Field::Str(text) => text.clone(),
                // CSV writes places and measurements in different ways.
                Field::Double(value) => format!("{value:e}"),
                field => field.to_string(),
            })
            .collect();
        let mut expected: Vec<String> = lines[index].splitn(29, ',').map(str::to_string).collect();
        for place in [3, 4] {
            expected[place] = format!("{:e}", expected[place].parse::<f64>().unwrap());
        }
        expected[28] = replay(index);
        assert_eq!(fields, expected, "row {index}");
    }
}
