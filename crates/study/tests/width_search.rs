//! The search over widths, against the whole grid run design by design, and against scenes' own words.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::num::NonZeroUsize;
use std::time::Duration;

use hpu_cosim::scene::{Experiment, OutcomeKind, shipped};
use hpu_cosim::{Control, Driver};
use hpu_study::accuracy::{Outputs, worst};
use hpu_study::map::{Cell, SceneText};
use hpu_study::units::Row;
use hpu_study::widths::search::{Design, Ended, Found, Knob, Merit, Plan, SearchError, search};

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

const PLAN: Plan = Plan { against: None, jobs: NonZeroUsize::new(2).expect("two") };

fn found(scene: &SceneText, set: &Set, knobs: &[Knob], plan: Plan) -> Result<Found, SearchError> {
    let keep = |_: usize, _: &Row| Ok::<(), Infallible>(());
    match search(scene, set, knobs, plan, BTreeMap::new(), &Control::default(), keep, |_| ()) {
        Ok(found) => Ok(found),
        Err(Ended::Refused(error)) => Err(error),
        Err(Ended::Stopped | Ended::Kept(_)) => panic!("nobody stops it"),
    }
}

/// Every design of the grid.
fn designs(own: Design, knobs: &[Knob]) -> Vec<Design> {
    knobs.iter().fold(vec![own], |designs, knob| {
        let values = |design: Design| (knob.from..=knob.to).map(move |bits| design.with(knob.width, bits));
        designs.into_iter().flat_map(values).collect()
    })
}

/// The stable word of a scene by its rule, each wall a scene of its own, and nothing remembered.
fn stable_word(experiment: &Experiment) -> i128 {
    let scene = experiment.clone().axis().expect("an axis");
    let words = scene.words().expect("words");
    let unit = words.realised.torque_quantum_nm / words.realised.count_rad * scene.method.stiffness_format.lsb();
    let settles = |word: i128| {
        let mut scene = scene.clone();
        scene.wall.stiffness_nm_per_rad = word as f64 * unit;
        let cell = Cell::run(&Experiment::Axis(scene), Duration::from_secs(60), &Control::default());
        cell.expect("it runs").expect("nobody stops it").outcome == OutcomeKind::Settled
    };
    let max = scene.method.stiffness_format.max();
    let mut word = 1i128 << i128::from(words.stiffness).ilog2();
    if settles(word) {
        while 2 * word <= max && settles(2 * word) {
            word *= 2;
        }
    } else {
        while !settles(word) {
            word /= 2;
            if word == 0 {
                return 0;
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
    word
}

fn error_of(experiment: &Experiment, reference: &Outputs, found: &Found) -> f64 {
    let (outputs, _) = Outputs::of(experiment, Driver::Events, &Control::default()).expect("it runs");
    worst(&outputs.expect("nobody stops it").errors(reference), &found.outputs)
}

#[test]
fn the_front_of_a_small_case_is_that_of_the_grid_run_design_by_design() {
    let scene = text("thrown-hybrid");
    let set = set(&[("run.duration", "60 ms")]);
    let knobs =
        knobs(&["position_bits=4..7", "stiffness_format.frac=0..2", "damping_format.frac=1..3", "velocity_bits=2..5"]);
    let found = found(&scene, &set, &knobs, PLAN).expect("a search");
    let own = Design::of(&scene.parse(&set).expect("the scene").axis().expect("an axis"));
    let parse = |design: Design| scene.parse(&set.iter().cloned().chain(design.set()).collect::<Set>());
    let reference = parse(found.reference.design).expect("the reference");
    let reference = Outputs::of(&reference, Driver::Events, &Control::default()).expect("it runs").0.expect("it ends");

    let mut grid: Vec<(Design, Merit)> = Vec::new();
    let mut refused = 0;
    for design in designs(own, &knobs) {
        let Ok(experiment) = parse(design) else {
            refused += 1;
            continue;
        };
        let axis = experiment.clone().axis().expect("an axis");
        let words = axis.words().expect("words");
        let unit = words.realised.torque_quantum_nm / words.realised.count_rad * axis.method.stiffness_format.lsb();
        let merit = Merit {
            lut4: hpu_study::widths::search::estimate(&words.config, false),
            error: error_of(&experiment, &reference, &found),
            stiffness: stable_word(&experiment) as f64 * unit,
        };
        grid.push((design, merit));
    }
    assert_eq!(found.designs, grid.len() + refused);
    assert_eq!(found.refused.iter().map(|(_, count)| count).sum::<usize>(), refused);
    let good = |merit: &Merit| merit.is_some() && !grid.iter().any(|(_, other)| other.is_some() && other.beats(merit));
    let mut wanted: Vec<(String, Merit)> =
        grid.iter().filter(|(_, merit)| good(merit)).map(|(design, merit)| (design.to_string(), *merit)).collect();
    let mut front: Vec<(String, Merit)> = found.best().map(|point| (point.design.to_string(), point.merit)).collect();
    wanted.sort_by(|a, b| a.0.cmp(&b.0));
    front.sort_by(|a, b| a.0.cmp(&b.0));
    println!(
        "{} designs, {} kinds, {} runs of {}: {front:#?}",
        found.designs, found.kinds, found.runs, found.grid_runs
    );
    assert!(wanted.len() > 1, "a front of one says little");
    assert_eq!(front, wanted);
    assert!(5 * found.runs < found.grid_runs, "{} runs of {}", found.runs, found.grid_runs);
}
