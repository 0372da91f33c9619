//! Compares the search over the widths of a PHANToM with the whole grid run design by design.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::num::NonZeroUsize;

use hpu_cosim::scene::{Experiment, OutcomeKind, PhantomScene, shipped};
use hpu_cosim::{Control, Driver};
use hpu_farm::UnitResult;
use hpu_study::Error;
use hpu_study::accuracy::{Outputs, worst};
use hpu_study::map::SceneText;
use hpu_study::phantom::{cells, proved, rams, rung};
use hpu_study::widths::Field;
use hpu_study::widths::search::{Cost, Design, Ended, Found, Knob, Merit, Plan, Ran, RatedDesign, search};

type Set = Vec<(String, String)>;

fn text(name: &str) -> SceneText {
    let shipped = shipped().iter().find(|shipped| shipped.name == name).expect("a shipped scene");
    SceneText { name: format!("{name}.toml"), text: shipped.text.to_string(), files: BTreeMap::new() }
}

fn set(pairs: &[(&str, &str)]) -> Set {
    pairs.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect()
}

fn knobs(texts: &[&str]) -> Vec<Knob> {
    texts.iter().map(|text| text.parse().unwrap_or_else(|error| panic!("{error}"))).collect()
}

fn plan(within: f64, jobs: usize) -> Plan {
    Plan { against: None, within, proved: false, jobs: NonZeroUsize::new(jobs).expect("some") }
}

fn found(set: &Set, knobs: &[Knob], plan: Plan) -> Result<Found, Error> {
    let scene = [("phantom-drop".to_string(), text("phantom-drop").parse(set).expect("the scene"))];
    let keep = |_: usize, _: &UnitResult<Ran>| Ok::<(), Infallible>(());
    match search(&scene, knobs, plan, BTreeMap::new(), &Control::default(), keep, |_| ()) {
        Ok(found) => Ok(found),
        Err(Ended::Refused(error)) => Err(error),
        Err(_) => panic!("nobody stops it"),
    }
}

fn run(experiment: &Experiment) -> Outputs {
    let (outputs, _) = Outputs::of(experiment, Driver::Events, &Control::default()).expect("it runs");
    outputs.expect("nobody stops it")
}

fn phantom(experiment: &Experiment) -> &PhantomScene {
    match experiment {
        Experiment::Phantom(scene) => scene,
        _ => panic!("a PHANToM"),
    }
}

/// Returns the highest rung of a scene up to which all rungs are passive; each wall is a scene of its own.
fn stable(experiment: &Experiment, runs: &mut usize) -> u32 {
    let base = phantom(experiment);
    for step in 1.. {
        let mut scene = base.clone();
        scene.room.stiffness_n_per_m *= rung(step);
        if scene.words().is_err() {
            return step - 1;
        }
        *runs += 1;
        if run(&Experiment::Phantom(scene)).outcome != OutcomeKind::Passive {
            return step - 1;
        }
    }
    unreachable!("a format holds no infinite wall")
}

/// Asserts that a search finds the front of the grid, in which every design has its own tables and nothing is
/// remembered.
fn holds_to_the_grid(set: &Set, texts: &[&str], within: f64) {
    let knobs = knobs(texts);
    let found = found(set, &knobs, plan(within, 2)).expect("a search");
    let base = text("phantom-drop").parse(set).expect("the scene");
    let own_n_per_m = phantom(&base).room.stiffness_n_per_m;
    let reference = run(&found.reference.design.scene(&base).expect("the reference"));

    let designs = knobs.iter().fold(vec![Design::of(&base).expect("a PHANToM")], |designs, knob| {
        let values = |design: Design| (knob.from..=knob.to).map(move |bits| design.with(knob.key.field, bits));
        designs.into_iter().flat_map(values).collect()
    });
    assert_eq!(found.designs, designs.len());
    let (mut grid, mut refused, mut off, mut runs) = (Vec::new(), 0, 0, 0);
    for design in designs {
        let depth = ("method.depth_bits".to_string(), design.get(Field::DEPTH).to_string());
        if text("phantom-drop").parse(&[&set[..], &[depth]].concat()).is_err() {
            refused += 1;
            continue;
        }
        let experiment = design.scene(&base).expect("a scene");
        let config = phantom(&experiment).method.config;
        let outputs = run(&experiment);
        runs += 1;
        let error = worst(&outputs.errors(&reference), &found.on[0].outputs);
        if error > within {
            off += 1;
            continue;
        }
        let cost = Cost { rams: rams(&config).expect("tables"), logic: Some(cells(&config).iter().sum()) };
        let stiffness = own_n_per_m * rung(stable(&experiment, &mut runs));
        grid.push(RatedDesign { design, merit: Merit { cost, error, stiffness }, capped: false });
    }
    assert_eq!((found.refused.iter().map(|(_, count)| count).sum::<usize>(), found.off), (refused, off));
    assert!(found.failed.is_empty());

    type Figures = (Cost, u64, u64);
    let merit = |RatedDesign { merit, .. }: &RatedDesign| -> Figures {
        (merit.cost, merit.error.to_bits(), merit.stiffness.to_bits())
    };
    let best = |point: &&RatedDesign| !grid.iter().any(|other: &RatedDesign| other.merit.beats(&point.merit));
    let mut wanted: Vec<Figures> = grid.iter().filter(best).map(merit).collect();
    wanted.sort_unstable();
    wanted.dedup();
    let mut front: Vec<Figures> = found.best().map(merit).collect();
    front.sort_unstable();
    assert!(!wanted.is_empty(), "a front of none says nothing");
    assert_eq!(front, wanted);
    let own =
        |point: &RatedDesign| grid.iter().any(|other| other.design == point.design && merit(other) == merit(point));
    assert!(found.best().all(own), "a design with another's figures");
    assert!(found.grid_runs <= runs, "{} runs of the grid, which took {runs}", found.grid_runs);
    assert!(found.runs < runs, "{} runs instead of {runs}", found.runs);
}

const SHORT: [(&str, &str); 2] = [("run.duration", "3 s"), ("room.stiffness", "2 kN/m")];

#[test]
#[ignore = "testbench/long.sh runs it"]
fn the_front_of_a_small_case_is_that_of_the_grid_run_design_by_design() {
    let words = ["depth_bits=10..13", "trig.frac=9..11", "position.frac=14..15"];
    holds_to_the_grid(&set(&SHORT), &words, f64::MAX);
}

#[test]
fn what_is_found_does_not_depend_on_the_threads() {
    let knobs = knobs(&["depth_bits=11..13", "trig.frac=8..11"]);
    let with = |jobs| found(&set(&SHORT), &knobs, plan(f64::MAX, jobs)).expect("a search");
    assert_eq!(with(1), with(3));
}

#[test]
fn the_proved_errors_are_those_of_the_counted_loop() {
    let set = set(&[("method.words", "narrow")]);
    let base = text("phantom-drop").parse(&set).expect("the scene");
    let (tip_m, torque) = proved(&base, &Design::of(&base).expect("a PHANToM")).expect("a datapath");
    // From testbench/record/phantom-cost.txt: tables of 13 bits, 0.123 um and 0.00028 %.
    assert!((1e6 * tip_m - 0.123).abs() < 5e-4, "{tip_m}");
    assert!((100.0 * torque - 0.00028).abs() < 5e-6, "{torque}");
}

#[test]
fn a_search_without_sense_is_refused_with_what_to_write() {
    let refused = |pairs: &[(&str, &str)], texts: &[&str]| {
        found(&set(pairs), &knobs(texts), plan(0.01, 1)).expect_err("no search").to_string()
    };
    let trig = ["trig.frac=14..16"];
    assert_eq!(refused(&[], &[]), "nothing to vary");
    assert_eq!(refused(&[], &["trig.frac=14..16", "trig.frac=17..18"]), "trig.frac is varied twice");
    assert!(refused(&[("platform.kind", "RTOS-1")], &trig).contains("write one of the platforms FPGA-20"));
    assert!(refused(&[("model.law", "ideal")], &trig).contains("write \"words\""));
    assert!(refused(&[("room.stiffness", "0")], &trig).contains("no stable stiffness"));
    assert!(refused(&[("room.stiffness", "20 kN/m")], &trig).contains("write a softer room.stiffness"));
    let shared = [("method.architecture", "shared")];
    assert!(refused(&shared, &["position.frac=14..16"]).contains("write \"parallel\""));
    assert!(refused(&[], &["depth_bits=4..8"]).contains("no scene has any of the 5 designs"));
    let wide = ["trig.frac=4..30", "length.frac=0..30", "position.frac=0..30", "force.frac=0..16"];
    assert!(refused(&[], &wide).contains("narrow a range"));

    let unread = |text: &str| text.parse::<Knob>().expect_err("no knob");
    assert!(unread("sine.frac=3..4").to_string().contains("trig.frac"));
    assert!(unread("depth_bits=3..9").to_string().contains("takes 4 to 15"));
    assert!(unread("trig.frac=9..8").to_string().contains("reversed"));
    assert!(unread("trig.frac=9").to_string().contains("takes one value only"));
}
