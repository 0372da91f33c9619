//! Studies as files: formulas, texts with values, variables, and the errors of a bad file.

use std::sync::Arc;

use hpu_cosim::Control;
use hpu_cosim::scene::{Experiment, shipped};
use hpu_papers::Error;
use hpu_papers::formula::Formula;
use hpu_papers::measure::measures;
use hpu_papers::studies::comparison::sums;
use hpu_papers::studies::summing::Finding;
use hpu_papers::studies::{Study, read};
use hpu_papers::template::{Template, Value, Values};

pub fn load(name: &str, set: &[(String, String)]) -> Result<Experiment, Error> {
    if name == "creep" {
        let mut load = |_: &str| unreachable!("no file is named");
        return Experiment::parse("creep.toml", include_str!("../../../study/tests/creep.toml"), set, &mut load)
            .map_err(Error::from);
    }
    let scene =
        shipped().iter().find(|scene| scene.name == name).ok_or_else(|| Error::new(format_args!("no scene {name}")))?;
    scene.parse(set).map_err(Error::from)
}

fn study(text: &str) -> Study {
    read("own.toml", text.as_bytes(), &["map"], Arc::new(load)).unwrap_or_else(|errors| panic!("{errors}"))
}

fn errors(text: &str) -> String {
    read("own.toml", text.as_bytes(), &["map"], Arc::new(load)).err().expect("errors").to_string()
}

fn value(text: &str) -> Result<Vec<f64>, Error> {
    let named = |name: &str| match name {
        "x" => Ok(vec![1.0, 2.0, 4.0]),
        "down" => Ok(vec![4.0, 2.0, 2.0]),
        "turns" => Ok(vec![1.0, 1.0, 0.0, 1.0]),
        "a.b" => Ok(vec![-3.0]),
        _ => Err(Error::new(format_args!("no {name}"))),
    };
    Formula::read(text)?.value(&named)
}

#[test]
fn formulas_follow_the_rules_of_arithmetic() {
    for (text, expected) in [
        ("1 + 2 * 3 - 4 / 2", vec![5.0]),
        ("8 - 2 - 1", vec![5.0]),
        ("-(2 - 5) * 25e-2", vec![75e-2]),
        ("1e3 - 1.5E+1", vec![985.0]),
        ("x * 2 - 1", vec![1.0, 3.0, 7.0]),
        ("10 / x", vec![10.0, 5.0, 2.5]),
        ("x - down", vec![-3.0, 0.0, 2.0]),
        ("2 <= x and x < 4", vec![0.0, 1.0, 0.0]),
        ("x == 1 or x > 3", vec![1.0, 0.0, 1.0]),
        ("abs(a.b) >= 3", vec![1.0]),
        ("sum(x) + most(x) - least(x)", vec![10.0]),
        ("first(x)", vec![1.0]),
        ("last(x)", vec![4.0]),
        ("never_falls(x)", vec![1.0]),
        ("never_falls(down)", vec![0.0]),
        ("never_rises(down)", vec![1.0]),
        ("never_rises(x)", vec![0.0]),
        ("leading(turns)", vec![2.0]),
        ("most(x, a.b)", vec![4.0]),
        ("else(unknown, 7) + else(a.b, 1)", vec![4.0]),
        ("sqrt(16) + ln(exp(1))", vec![5.0]),
        ("inf > pi", vec![1.0]),
    ] {
        assert_eq!(value(text), Ok(expected), "{text}");
    }
}

#[test]
fn a_formula_that_is_none_says_what_is_expected() {
    for (text, words) in [
        ("", "a number, a name or `(` is expected at the end"),
        ("1 +", "expected at the end"),
        ("(1 + 2", "`)` is expected at the end"),
        ("1 2", "an operator is expected at `2`"),
        ("mots(x)", "did you mean most?"),
        ("else(x)", "two arguments"),
        ("x + turns", "a list of 3 beside a list of 4"),
        ("unknown", "no unknown"),
        ("1..2", "a number"),
    ] {
        let refused = value(text).expect_err(text);
        assert!(refused.to_string().contains(words), "{text}: {refused}");
    }
}

#[test]
fn a_text_holds_values_in_the_form_asked_for() {
    let values = Values::from([
        ("m.k".into(), Ok(Value::Number(1234.5678))),
        ("m.short".into(), Ok(Value::Number(-0.0123))),
        ("m.said".into(), Ok(Value::Text("settles".into()))),
        ("m.none".into(), Err("none settles".into())),
    ]);
    let text = |text: &str| Template::read(text).and_then(|template| template.text(&values));
    for (template, expected) in [
        ("{m.said}, {m.k:.1 N/m}", "settles, 1234.6 N/m"),
        ("{m.k / 1000:+.2}", "+1.23"),
        ("{m.k}", "1234.5678"),
        ("{m.short:length}; {m.k * 1e-9:length}; {m.k:length}", "-12.3 mm; 1 um; 1234.57 m"),
        ("{m.none?:.1 N/m}", "none settles"),
        ("a[, {m.k:.0}][, {m.none:.0}][, {m.k / 0}] b", "a, 1235 b"),
    ] {
        assert_eq!(text(template).as_deref(), Ok(expected), "{template}");
    }
    assert_eq!(text("{m.none}"), Err("none settles".into()));
    assert_eq!(text("{m.said + 1}"), Err("m.said is a text".into()));
    assert!(text("{m.k").is_err_and(|error| error.to_string().contains("not closed")));
}

#[test]
fn lines_and_groups_vary_the_first_key_slowest() {
    let study = study(
        r#"
        name = "own"
        title = "Own"
        let = { both = ["1 kHz", "2 kHz"], one = { name = "one", k = 2 } }
        [[group]]
        name = "K $k"
        vary.k = { from = 1, to = 2, step = 0.5 }
        [[group.line]]
        vary.rate = "$both"
        vary.what = ["$one", { name = "two", k = "$($k * 2)" }]
        what = "$what.name at $rate, $($what.k * $k:.2 N)"
        text = "none"
        "#,
    );
    let lines: Vec<_> = study.comparison.lines.iter().map(|line| format!("{}: {}", line.group, line.what)).collect();
    assert_eq!(lines.len(), 12);
    assert_eq!(lines[0], "K 1: one at 1 kHz, 2.00 N");
    assert_eq!(lines[1], "K 1: two at 1 kHz, 2.00 N");
    assert_eq!(lines[6], "K 1.5: one at 2 kHz, 3.00 N");
    assert_eq!(lines[11], "K 2: two at 2 kHz, 8.00 N");
}

#[test]
fn all_methods_of_a_scene_are_a_variable() {
    let study = study(
        r#"
        name = "own"
        title = "Own"
        [[group]]
        name = "Methods"
        [[group.line]]
        vary.method = { methods_of = "hybrid-wall" }
        what = "$method.name"
        measure.run = { measure = "run", scene = "hybrid-wall", set = ["$method.set", 'run.duration=10 ms'] }
        text = "{run.outcome}"
        "#,
    );
    let lines = &study.comparison.lines;
    assert!(lines.len() > 8 && lines.iter().any(|line| line.what == "FOAW"), "{}", lines.len());
    let text = (lines[0].measure)(&Control::default()).expect("not stopped").expect("measured").text;
    assert!(
        ["settles", "moving", "chatters", "follows the hand"].iter().any(|outcome| text.starts_with(outcome)),
        "{text}"
    );
}

/// A mass without a wall that a constant force pushes: its motion is known in closed form.
const PUSHED: &str = r#"
    name = "own"
    title = "Own"
    [let]
    set = [
        'device.damping=0', 'device.coulomb=0', 'wall.position=1', 'wall.wraps=true', 'wall.stiffness=0',
        'run.duration=100 ms', 'record.plant_rate=1 kHz',
    ]
    [[group]]
    name = "A pushed mass"
    [[group.line]]
    vary.force = ["1 N", "2 N"]
    what = "$force"
    claims = "abc"
    measure.mass = { measure = "run", scene = "impulse-engine", set = ["$set", 'hand.torque=$force'] }
    text = "{mass.end:.6 m}, {mass.outcome}"
    figures = { end = "mass.end", energy = ["mass.hand_energy", "mass.residual"], way = "mass.high - mass.low" }
    [[claim]]
    letter = "a"
    paper = "moves on"
    place = "here"
    means = "it moves in the judged window"
    holds = "way > 0"
    [[claim]]
    letter = "b"
    paper = "twice the force, twice the way"
    place = "here"
    means = "the ways are as 1 to 2"
    holds = "abs(last(end) / first(end) - 2) < 0.5"
    [[claim]]
    letter = "c"
    paper = "nobody knows"
    place = "here"
    means = "each of both has to agree"
    by = "force"
    holds = ["end > 0", "end < 0"]
"#;

#[test]
fn figures_are_those_of_the_run_and_claims_follow_them() {
    let Study { comparison, .. } = study(PUSHED);
    let results: Vec<_> =
        comparison.lines.iter().map(|line| (line.measure)(&Control::default()).expect("not stopped")).collect();
    let found: Vec<_> = results.iter().map(|result| result.as_ref().expect("measured")).collect();
    assert_eq!(comparison.lines[0].figures, ["end", "energy", "energy", "way"]);
    for (force_n, found) in [1.0, 2.0].into_iter().zip(&found) {
        let [end_m, energy_j, residual_j, moved_m] = found.figures[..] else { panic!("{found:?}") };
        // The scene begins 5 mm before its wall, at rest at 0.
        let way_m = 0.5 * force_n / 63.3e-3 * 0.1 * 0.1;
        assert!((end_m / way_m - 1.0).abs() < 0.02, "{end_m} {way_m}");
        assert!((energy_j / (force_n * end_m) - 1.0).abs() < 0.02 && residual_j.abs() < 1e-9, "{found:?}");
        // From 70 % to all of the time.
        assert!((moved_m / (way_m * (1.0 - 0.7 * 0.7)) - 1.0).abs() < 0.03, "{moved_m} {way_m}");
    }
    let findings: Vec<_> = sums(&comparison, &results).into_iter().map(|sum| (sum.finding, sum.found)).collect();
    assert_eq!(findings[0], (Finding::Confirmed, "so in 2 of 2 cases".into()));
    assert_eq!(findings[1].0, Finding::Confirmed);
    assert_eq!(findings[2], (Finding::CannotBeTold, "so in 2 of 4 cases".into()));
}

#[test]
fn a_bad_file_tells_all_of_its_errors_with_line_and_key() {
    let told = errors(
        "name = \"own\"\n\
         titel = \"Own\"\n\
         [[group]]\n\
         name = \"G\"\n\
         [[group.line]]\n\
         what = \"a $lost one\"\n\
         text = \"{m.outcom}\"\n\
         measure.m = { measure = \"run\", scene = \"hybrid-wall\", set = ['wall.stifness=2'], pres = [0, 1] }\n\
         measure.n = { measure = \"stabel\", scene = \"hybrid-wall\" }\n\
         [[group.line]]\n\
         what = \"b\"\n\
         claims = \"z\"\n\
         text = \"{1 +}\"\n\
         figures.x = \"y\"\n\
         [[claim]]\n\
         letter = \"q\"\n\
         paper = \"p\"\n\
         place = \"p\"\n\
         means = \"m\"\n\
         holds = \"unknown > 1\"\n",
    );
    for words in [
        "own.toml:2:1: titel: unknown key; accepted here: name, title, notes",
        "did you mean title?",
        "own.toml:1:1: title: missing; write a text in quotes",
        "own.toml:6:8: group.line.what: no variable $lost",
        "own.toml:7:8: group.line.text: no value m.outcom",
        "did you mean m.outcome?",
        "group.line.measure.m.pres: unknown key; accepted here: measure, scene, set, swing, press, after",
        "unknown key",
        "own.toml:9:13: group.line.measure.n: no measure \"stabel\"",
        "did you mean stable?",
        "own.toml:13:8: group.line.text: in `{1 +}`",
        "no line decides claim q",
        "errors",
    ] {
        assert!(told.contains(words), "{words}\n{told}");
    }
    let files = told.lines().filter(|line| line.starts_with("own.toml:")).count();
    assert!(told.ends_with(&format!("\n{files} errors")), "{told}");
    assert_eq!(errors("a = \n").matches("not TOML").count(), 1);
    assert!(errors("name = \"a\"\ntitle = \"a\"\n[map]\nx = [[1]]\n[mapp]\n").contains("did you mean map?"));
}

#[test]
fn sections_of_verbs_stand_in_the_order_of_the_file() {
    let study = study(
        "name = \"own\"\ntitle = \"Own\"\n[let]\nk = 3\n[[map]]\nscene = \"hybrid-wall\"\nset = [\"a=$k\", \"b=2\"]\n\
         full = true\njson = false\n[[map]]\ncells = 7\n",
    );
    let options: Vec<_> = study.sections.iter().map(|section| &section.options[..]).collect();
    let option = |key: &str, place: &str, values: &[&str]| {
        (key.to_string(), format!("own.toml:{place}"), values.iter().map(|value| value.to_string()).collect::<Vec<_>>())
    };
    assert_eq!(
        options[0],
        [option("scene", "6:9", &["hybrid-wall"]), option("set", "7:7", &["a=3", "b=2"]), option("full", "8:8", &[])]
    );
    assert_eq!(options[1], [option("cells", "11:9", &["7"])]);
    assert_eq!(study.sections[1].place, "own.toml:10:1");
}

#[test]
fn every_measure_gives_every_value_that_it_names() {
    // The measures of a wall, over the shortest scene that each takes; the values of an option need the option.
    for measure in measures() {
        let options = match measure.name {
            "run" => ", press = [0.01, 0.02], after = 0.01",
            "apart" => ", other = ['wall.stiffness=2 kN/m'], after = 0.01",
            "ladder" => ", key = \"wall.stiffness\", values = [1, 2], unit = \"kN/m\"",
            "criterion" => ", name = \"abbott_okamura\"",
            "least_damping" => ", by = \"linear\"",
            "shaper_gain" => ", frequency = 10",
            "velocity" => ", rest = 1",
            "fitting" => {
                ", key = \"model.amplifier_lag\", values = [0.4], unit = \"ms\", axes = \"y\", walls = [5], trials = 1"
            }
            // These take minutes; the shipped studies use each of their values.
            "stable" | "limits" => continue,
            _ => "",
        };
        let is_motor = ["scene", "least_damping"].contains(&measure.name);
        let (scene, set) = match measure.name {
            "velocity" => ("qube-arm", "['run.duration=30 ms']"),
            "touch" => ("gimbal-switch", "[]"),
            "segment" => ("gimbal-shear", ALL_OF_A_SEGMENT),
            "fitting" => ("phantom-drop", "['run.duration=1 s']"),
            "paddle" => ("epfl-paddle-step", "['run.duration=60 ms']"),
            _ if is_motor => ("conventional-wall-1khz", "[]"),
            _ => ("impulse-engine", "['run.duration=300 ms', 'record.plant_rate=10 kHz']"),
        };
        let scene = if measure.is_of_scene { format!(", scene = \"{scene}\", set = {set}") } else { String::new() };
        let values: Vec<_> = measure.gives.iter().map(|name| format!("{{m.{name}}}")).collect();
        let study = study(&format!(
            "name = \"own\"\ntitle = \"Own\"\n[[group]]\nname = \"g\"\n[[group.line]]\nwhat = \"w\"\ntext = \"{}\"\n\
             measure.m = {{ measure = \"{}\"{scene}{options} }}\n",
            values.join(" | "),
            measure.name
        ));
        let found = (study.comparison.lines[0].measure)(&Control::default()).expect("not stopped");
        let text = found.unwrap_or_else(|reason| panic!("{}: {reason}", measure.name)).text;
        assert_eq!(text.split(" | ").count(), values.len(), "{}: {text}", measure.name);
    }
}

#[test]
fn a_measure_makes_runs_longer_until_they_tell_or_says_what_would() {
    // 255 words of stiffness up to 3.9 kN/m, of which those up to some hundreds of N/m creep.
    let text = |set: &str, measure: &str, text: &str| {
        let set = format!("['{set}', 'method.stiffness_format=(0,4,4)']");
        let study = study(&format!(
            "name = \"own\"\ntitle = \"Own\"\n[[group]]\nname = \"g\"\n[[group.line]]\nwhat = \"w\"\n\
             text = \"{text}\"\nmeasure.m = {{ {measure}, scene = \"creep\", set = {set} }}\n"
        ));
        (study.comparison.lines[0].measure)(&Control::default()).expect("not stopped").expect("a text").text
    };
    let stable = "measure = \"stable\", words = 8";
    assert_eq!(text("run.duration=600 ms", stable, "{m.all:.0} {m.failed?:.0}"), "3891 none");
    // The slowest time constant is 407 / 215 s: six of them are more than ten runs.
    let said = text("wall.damping=400 N.s/m", stable, "{m.all?:.0}");
    assert!(["not told from 15", "would tell"].iter().all(|part| said.contains(part)), "{said}");
    let ladder = "measure = \"ladder\", key = \"wall.stiffness\", values = [100, 300], unit = \"N/m\"";
    assert_eq!(text("run.duration=600 ms", ladder, "{m.text}"), "settles throughout");
    // One run is as the scene says.
    let run = "measure = \"run\"";
    let said = text("run.duration=600 ms", run, "{m.settles?:.0}: {m.outcome}");
    assert!(said.starts_with("not told: the motion may still come to rest; run.duration = \"1.5 s\""), "{said}");
    assert_eq!(text("run.duration=1.5 s", run, "{m.settles:.0}: {m.outcome}"), "1: settles");
}

/// A segment that moves in every direction, with a finger that presses it twice, the second time at the end.
const ALL_OF_A_SEGMENT: &str = "[\
    'target.height=[[0.001, 1]]', 'target.pitch=[[0.03, 1]]', 'target.roll=[[0.02, 1]]', 'run.duration=2 s', \
    'finger.path=[[0, 0.014], [0.5, 0.008], [1.3, 0.015], [1.9, 0.008]]']";

/// Returns the values of the measure `velocity` on the recorded arm under overrides.
fn velocity(keys: &str, set: &[&str]) -> Values {
    let set: String = set.iter().map(|pair| format!("'{pair}',")).collect();
    let names = ["rms", "most", "rest", "lag", "unlagged", "fastest"];
    let text = names.map(|name| format!("{{v.{name}?:.9}}")).join(" | ");
    let study = study(&format!(
        "name = \"own\"\ntitle = \"Own\"\n[[group]]\nname = \"g\"\n[[group.line]]\nwhat = \"w\"\ntext = \"{text}\"\n\
         measure.v = {{ measure = \"velocity\", scene = \"qube-arm\", {keys}, set = [{set}] }}\n"
    ));
    let found = (study.comparison.lines[0].measure)(&Control::default()).expect("not stopped").expect("a text");
    let value = |text: &str| text.parse().map(Value::Number).map_err(|_| Error::new(text));
    names.iter().zip(found.text.split(" | ")).map(|(name, text)| ((*name).into(), value(text))).collect()
}

fn number(values: &Values, name: &str) -> f64 {
    match &values[name] {
        Ok(Value::Number(number)) => *number,
        other => panic!("{name}: {other:?}"),
    }
}

#[test]
fn the_difference_at_constant_speed_errs_by_the_root_of_f_times_1_minus_f() {
    // 0.3 counts a sample, for 2 s: three of ten samples see a count. The error is 0.7 counts a sample in three of ten
    // and -0.3 in the others. The first sample has no difference yet.
    let count = std::f64::consts::TAU / 2048.0;
    let speed = 0.3 * count * 1e3;
    let path = format!("hand={{ kind = \"prescribed\", path = [[0, 0], [2, {}]] }}", 2.0 * speed);
    // The run ends before the path does, where the speed would be 0.
    let values = velocity("rest = 0", &[&path, "run.duration=1.999 s"]);
    let unit = count * 1e3;
    assert!((number(&values, "fastest") - speed).abs() < 1e-9, "{values:?}, not {speed}");
    assert!((number(&values, "rms") / unit - 0.21f64.sqrt()).abs() < 1e-3, "{values:?}");
    assert!((number(&values, "most") / unit - 0.7).abs() < 1e-6, "{values:?}");
    assert_eq!(values["rest"], Err("never at rest".into()));
}

#[test]
fn a_window_of_n_samples_held_for_one_is_late_by_half_of_their_sum() {
    // A cosine of 5 Hz, which starts at rest, with an encoder whose noise does not matter; a point of the path at each
    // sample.
    let at = |k: i32| 0.2 * (1.0 - libm::cos(std::f64::consts::TAU * 5e-3 * f64::from(k)));
    let points: Vec<String> = (0..=1000).map(|k| format!("[{:.3}, {:.9}]", f64::from(k) * 1e-3, at(k))).collect();
    let path = format!("hand={{ kind = \"prescribed\", path = [{}] }}", points.join(","));
    for (window, lag_s) in [(4, 2.5e-3), (8, 4.5e-3)] {
        let window = format!("method.window={window}");
        let set = [&path, "run.duration=1 s", "encoder.lines=10000", "method.estimator=window", &window];
        let values = velocity("rest = 1, over = 1e-3", &set);
        // A row at the edge of a sample still holds the word before it: half of the time between two rows is added.
        // The lowest point of the parabola is within a twentieth of that time.
        assert!((number(&values, "lag") - (lag_s + 5e-5)).abs() < 5e-6, "{values:?}");
        // What a delay leaves is the count, and the sine that a window of some ms flattens by a few per mille.
        assert!(number(&values, "unlagged") < 0.02 * number(&values, "fastest"), "{values:?}");
    }
}

#[test]
fn only_a_sampled_wall_in_words_has_estimators() {
    for (set, said) in [
        (["method={ kind = \"hybrid\", sample_rate = \"1 kHz\" }"], "only a sampled_wall"),
        (["model={ datapath = \"law\", bridge = \"averaged\" }"], "a law in floats"),
    ] {
        let values = velocity("rest = 1", &set);
        assert!(matches!(&values["rms"], Err(reason) if reason.to_string().starts_with(said)), "{values:?}");
    }
}
