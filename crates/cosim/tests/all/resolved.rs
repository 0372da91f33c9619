//! A shown scene is the scene: it parses to the same experiment and runs to the same summary.

use hpu_cosim::scene::{Experiment, Resolved, ValueSource, as_scene, resolved, shipped, shipped_file};
use hpu_cosim::{Control, Driver, Simulation, Summary, Wired, WiredSimulation};

fn pairs(set: &[(&str, &str)]) -> Vec<(String, String)> {
    set.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect()
}

fn show(name: &str, text: &str, set: &[(&str, &str)]) -> (Experiment, Vec<Resolved>) {
    let set = pairs(set);
    let scene = Experiment::parse(name, text, &set, &mut shipped_file).expect(name);
    let all = resolved(&scene, name, text, &set).expect(name);
    (scene, all)
}

/// Returns the keys with values as TOML; named data and keys without a value are comments.
fn written(all: &[Resolved]) -> String {
    as_scene(all, |key, pair| match key.source {
        ValueSource::Given(_) | ValueSource::Default => pair.map(str::to_string),
        ValueSource::Named(_) | ValueSource::Derived => None,
    })
}

/// Returns everything that a run can read of an experiment: all but the places of keys and the origins of values.
fn contents(scene: &Experiment) -> String {
    let text = format!("{scene:#?}");
    let (mut kept, mut inside) = (Vec::new(), None);
    for line in text.lines() {
        let indent = line.len() - line.trim_start().len();
        match inside {
            None if line.trim_start().starts_with("places: ") || line.trim_start().starts_with("origin: ") => {
                inside = line.ends_with(['{', '(']).then_some(indent);
            }
            None => kept.push(line),
            Some(of) if indent == of => inside = None,
            Some(_) => {}
        }
    }
    kept.join("\n")
}

fn run(scene: &Experiment) -> Summary {
    let simulation = WiredSimulation::new(scene).expect("ready");
    let mut trace = simulation.trace(&[]);
    let summary = simulation.run(Driver::Events, &mut trace, &mut (), &Control::default());
    Summary { wall_s: 0.0, ..summary }
}

#[test]
fn the_shown_text_of_every_shipped_scene_is_the_same_scene() {
    for shipped in shipped() {
        let set = [("run.duration", "30 ms")];
        for set in [&[][..], &set] {
            let name = format!("testbench/scenes/{}.toml", shipped.name);
            let (scene, all) = show(&name, shipped.text, set);
            let again = written(&all);
            let other = Experiment::parse(&name, &again, &[], &mut shipped_file);
            let other = other.unwrap_or_else(|error| panic!("{error:#}"));
            assert_eq!(contents(&other), contents(&scene), "{again}");
            // Nothing but the sources of values changes when the shown text is shown again.
            let (_, twice) = show(&name, &again, &[]);
            let plain = |all: &[Resolved]| {
                let keys = all.iter().map(|key| (key.section.clone(), key.key.clone(), key.value.clone(), key.unit));
                keys.collect::<Vec<_>>()
            };
            assert_eq!(plain(&twice), plain(&all), "{name}");
            if !set.is_empty() {
                assert_eq!(run(&other), run(&scene), "{name}");
            }
        }
    }
}

#[test]
fn every_value_has_the_source_that_gave_it() {
    let text = "about = \"A wall.\"\n[device]\nkind = \"motor\"\nmotor = \"vasudevan_2007\"\n\
                [clock]\nfrequency = \"50 MHz\"\n[method]\nkind = \"hybrid\"\nsample_rate = \"1 kHz\"\n\
                [wall]\nposition = 1\nstiffness = 1\ndamping = 0\n\
                [hand]\nkind = \"none\"\n[run]\nduration = 1\n";
    let (_, all) = show("mine.toml", text, &[("wall.stiffness", "2 N.m/rad"), ("bridge.supply", "12 V")]);
    let of = |section: &str, key: &str| {
        let found = all.iter().find(|found| found.section == section && found.key == key).expect(key);
        (found.source.to_string(), found.toml.clone().unwrap_or_default(), found.value.to_string(), found.unit)
    };
    let told = |source: &str, toml: &str, value: &str, unit| (source.into(), toml.into(), value.into(), unit);
    assert_eq!(of("", "about"), told("mine.toml:1", "\"A wall.\"", "\"A wall.\"", ""));
    assert_eq!(of("clock", "frequency"), told("mine.toml:6", "\"50 MHz\"", "50000000", "Hz"));
    assert_eq!(of("wall", "stiffness"), told("--set wall.stiffness=2 N.m/rad", "\"2 N.m/rad\"", "2", "N.m/rad"));
    assert_eq!(of("bridge", "supply"), told("--set bridge.supply=12 V", "\"12 V\"", "12", "V"));
    assert_eq!(of("bridge", "diode_drop").0, "default");
    assert_eq!(of("device", "inductance"), told("motor vasudevan_2007", "\"0.000226 H\"", "0.000226", "H"));
    assert_eq!(of("model", "step").0, "derived");
    assert!(all.iter().all(|key| !key.meaning.is_empty()));
}
