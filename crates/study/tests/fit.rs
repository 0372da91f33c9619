//! The least model that answers a scene's question.

use hpu_cosim::scene::{Experiment, Output, shipped, shipped_file};
use hpu_cosim::{Control, Ready, Rig};
use hpu_study::accuracy::{Outputs, usual, worst};
use hpu_study::fit::{Fit, fit};
use hpu_study::map::SceneText;

type Set = Vec<(String, String)>;

fn scene(name: &str, set: &Set) -> (SceneText, Experiment) {
    let shipped = shipped().iter().find(|shipped| shipped.name == name).expect("a shipped scene");
    SceneText::read((name, shipped.text), set, &mut shipped_file).expect("it parses")
}

fn fitted(name: &str, set: &Set) -> Fit {
    let (text, experiment) = scene(name, set);
    fit(&text, set, experiment.accuracy().within, &Control::default()).expect("it runs")
}

fn set(pairs: &[(&str, &str)]) -> Set {
    pairs.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect()
}

/// Runs a model of a scene under further changes.
fn run(name: &str, set: &Set) -> (Outputs, Vec<Output>) {
    let (_, experiment) = scene(name, set);
    let driver = Ready::new(&experiment).expect("it is ready").driver();
    let (outputs, _) = Outputs::of(&experiment, driver, &Control::default()).expect("it runs");
    let outputs = outputs.expect("nobody stops it");
    let counted = experiment.accuracy().outputs.clone().unwrap_or_else(|| usual(outputs.outcome));
    (outputs, counted)
}

#[test]
fn dump() {
    for shipped in shipped() {
        let (text, experiment) = scene(shipped.name, &Set::new());
        if experiment.clone().axis().is_some_and(|scene| matches!(scene.hand, hpu_cosim::scene::Hand::Capture { .. })) {
            continue;
        }
        let start = std::time::Instant::now();
        match fit(&text, &Set::new(), 0.01, &Control::default()) {
            Ok(found) => {
                println!(
                    "{:<24} {:5.1}x  {:?} err {:?} around {:.4} tried {} runs {} in {:.2?}",
                    shipped.name,
                    found.speedup,
                    found.set,
                    found.errors,
                    found.around,
                    found.tried,
                    found.runs,
                    start.elapsed()
                );
                for left in &found.left_out {
                    println!("      left {left:?}");
                }
                for kept in &found.kept {
                    println!("      kept {kept:?}");
                }
            }
            Err(error) => println!("{:<24} {error}", shipped.name),
        }
    }
    let _ = (run, fitted, set, worst);
}
