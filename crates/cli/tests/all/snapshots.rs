//! Snapshots of the command's surface: every page of help, the keys of every verb's JSON, its page of text, and the
//! messages of refusals.
//!
//! A script that reads `--json` breaks when a key goes; a snapshot shows the change first. After an intended change,
//! look at `git diff` and accept: `INSTA_UPDATE=always cargo test -p hpu --test all -- snapshots`.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

use serde_json::Value;

use crate::common::{code, hpu, json, stderr, stdout};

fn settings() -> insta::Settings {
    let mut settings = insta::Settings::clone_current();
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings
}

/// Returns every verb with those below it, in words.
fn verbs(command: &clap::Command, above: &str, all: &mut Vec<String>) {
    for verb in command.get_subcommands() {
        let name = format!("{above} {}", verb.get_name()).trim_start().to_string();
        verbs(verb, &name, all);
        all.push(name);
    }
}

fn help(verb: &[&str]) -> String {
    let output = hpu().args(verb).arg("--help").env("COLUMNS", "100").output().expect("starts");
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    stdout(&output)
}

#[test]
fn every_page_of_help() {
    let mut all = Vec::new();
    verbs(&hpu_cli::description(), "", &mut all);
    let page = |verb: &String| (format!("help-{}", verb.replace(' ', "-")), help(&verb.split(' ').collect::<Vec<_>>()));
    let mut pages: Vec<_> = all.iter().map(page).collect();
    pages.push(("help".to_string(), help(&[])));
    assert!(pages.len() > 24, "{} pages", pages.len());
    settings().bind(|| {
        for (name, page) in pages {
            insta::assert_snapshot!(name, page);
        }
    });
}

/// Collects every path of a JSON value with the types of its values; all elements of a list share a path.
fn paths(value: &Value, at: &str, found: &mut BTreeSet<String>) {
    match value {
        // Which keys a fit sets depends on wall times.
        Value::Object(set) if at == ".set" => set.values().for_each(|value| paths(value, ".set.KEY", found)),
        Value::Object(object) => object.iter().for_each(|(key, value)| {
            paths(value, &format!("{at}.{key}"), found);
        }),
        Value::Array(all) => all.iter().for_each(|value| paths(value, &format!("{at}[]"), found)),
        // A machine that is busy tells no speed.
        Value::Null if at.ends_with(".speedup") => drop(found.insert(format!("{at} number"))),
        Value::Null => drop(found.insert(format!("{at} null"))),
        Value::Bool(_) => drop(found.insert(format!("{at} bool"))),
        Value::Number(_) => drop(found.insert(format!("{at} number"))),
        Value::String(_) => drop(found.insert(format!("{at} text"))),
    }
}

/// Commands for the forms of JSON, as short as possible. Commands that take a minute are left out: `cost --scene`, and
/// the studies of papers but two.
const COMMANDS: [(&str, &str); 25] = [
    ("run", "run hybrid-wall --edges 100000 --json"),
    ("run-compare", "run hybrid-wall --edges 100000 --compare --json"),
    ("run-phantom", "run phantom-drop --set run.duration=20ms --json"),
    ("run-dut", "run testbench/dut/knee.toml --edges 20000 --json"),
    ("scenes", "scenes --json"),
    ("keys", "keys --json"),
    ("scenes-show", "scenes show hybrid-wall --json"),
    ("blocks", "block --json"),
    ("block", "block truncating_multiplier --json"),
    ("check", "check displacement --rows 20 --scene hybrid-wall --edges 2000 --json"),
    ("check-formal", "check --formal displacement --json"),
    (
        "check-entity",
        "check --entity fast_mul --as truncating_multiplier --port x=a --port y=b --port p=product --clock clock \
         --latency 2 --generic N=A_WIDTH --generic KEEP=OUT_WIDTH --generic SATURATING=SATURATE --rows 20 \
         --variant full --variant drop_upper testbench/dut/blocks/fast_mul.vhd --json",
    ),
    ("limits", "limits hybrid-wall --words 2 --phases 1 --json"),
    ("limits-gimbal", "limits gimbal-switch-held --json"),
    (
        "map",
        "map hybrid-wall --x wall.stiffness=0.1..6:2 --y wall.damping=0..0.4mN.m.s/rad:2 --set run.duration=0.3s \
         --json",
    ),
    ("chart", "chart friction-wall --contestants events,rk4 --set run.duration=0.1s --json"),
    ("fit", "fit friction-wall --set run.duration=0.1s --json"),
    ("widths", "widths hybrid-wall --json"),
    ("widths-gimbal", "widths gimbal-switch-held --set run.duration=20ms --json"),
    ("widths-phantom", "widths phantom-drop --set run.duration=20ms --json"),
    ("widths-search", "widths hybrid-wall --search --vary position_bits=11..12 --vary velocity_bits=9..10 --json"),
    ("cost", "cost displacement --variant default --json"),
    ("reproduce-formats", "reproduce phantom-formats --json"),
    ("reproduce-sines", "reproduce phantom-sines --json"),
    (
        "reproduce-table",
        "reproduce phantom-table-2 --axes x --platforms RTOS-1,FPGA-20 --stiffness 250,5000 --trials 1 \
         --set run.duration=0.3s --json",
    ),
];

#[test]
fn the_keys_of_every_verbs_json() {
    settings().bind(|| {
        for (name, command) in COMMANDS {
            let output = hpu().args(command.split_whitespace()).output().expect("starts");
            assert_eq!(code(&output), 0, "{command}: {}", stderr(&output));
            let mut found = BTreeSet::new();
            paths(&json(&output), "", &mut found);
            let found: Vec<_> = found.into_iter().collect();
            insta::assert_snapshot!(format!("json-{name}"), found.join("\n"));
        }
    });
}

/// Commands whose page of text is the same on every machine, once wall times are filtered: charts and fits choose and
/// mark by wall times, proofs come in the order in which they end, and lists of scenes and keys are tested elsewhere.
const PAGES: [&str; 14] = [
    "run",
    "run-compare",
    "run-phantom",
    "run-dut",
    "block",
    "check",
    "check-entity",
    "limits",
    "limits-gimbal",
    "map",
    "widths",
    "widths-gimbal",
    "widths-phantom",
    "cost",
];

/// Returns a page without its wall times: the time and speed of a run, and the seconds of a check.
fn without_wall_times(name: &str, page: &str) -> String {
    let line = |line: &str| {
        if let (Some((before, _)), true) = (line.split_once(") in "), line.contains("edges/s")) {
            return format!("{before}) in TIME\n");
        }
        let is_seconds = |word: &str| word.split_once('.').is_some_and(|(_, decimals)| decimals.len() == 2);
        let last = line.split_whitespace().find(|word| word.parse::<f64>().is_ok() && is_seconds(word));
        match last.filter(|_| name.starts_with("check")).and_then(|seconds| line.split_once(seconds)) {
            Some((before, after)) => format!("{} TIME{after}\n", before.trim_end()),
            None => format!("{line}\n"),
        }
    };
    page.lines().map(line).collect()
}

#[test]
fn the_page_of_text_of_every_verb() {
    settings().bind(|| {
        for name in PAGES {
            let command = COMMANDS.iter().find(|(other, _)| *other == name).expect("a command").1;
            let command = command.trim_end_matches(" --json");
            let output = hpu().args(command.split_whitespace()).output().expect("starts");
            assert_eq!(code(&output), 0, "{command}: {}", stderr(&output));
            let page = without_wall_times(name, &stdout(&output));
            assert!(!page.contains("edges/s"), "{page}");
            insta::assert_snapshot!(format!("text-{name}"), format!("$ hpu {command}\n{page}"));
        }
    });
}

/// Commands that are refused, with their exit codes.
const REFUSED: [(i32, &str); 36] = [
    (2, "nonsense"),
    (2, "run"),
    (2, "scene show hybrid-wall"),
    (2, "scenes --template"),
    (2, "scenes --template ci"),
    (2, "check hybrid-wall"),
    (2, "keys stifness"),
    (2, "block velocitty"),
    (2, "scenes --json show hybrid-wall"),
    (2, "run hybrid-wall --set wall.stiffness"),
    (4, "run hybrid-wall --set wall.stifness=1"),
    (4, "run hybrid-wall --set wall.stiffness=1kg"),
    (4, "run Cargo.toml"),
    (2, "run hybrid-wall -o /dev/null/x"),
    (2, "run hybrid-wall --vcd"),
    (2, "run hybrid-wall --compare a=b"),
    (2, "block pwm --variant none"),
    (2, "block --notation q"),
    (2, "cost"),
    (2, "cost pwm --set a=1"),
    (2, "limits phantom-drop"),
    (2, "limits gimbal-shape"),
    (2, "limits gimbal-switch --range 1..2"),
    (4, "widths gimbal-switch --search"),
    (2, "widths hybrid-wall --tables"),
    (2, "limits hybrid-wall --range 3..1"),
    (2, "limits hybrid-wall --range soft"),
    (4, "map hybrid-wall --x wall.nokey=1..2:2 --y wall.damping=0..1:2"),
    (2, "map hybrid-wall --x wall.damping=1..2:2"),
    (2, "chart hybrid-wall --contestants nope"),
    (2, "fit hybrid-wall --within 200%"),
    (2, "widths --gappa hybrid-wall phantom-drop"),
    (2, "vectors --table x"),
    (4, "vectors --verify Cargo.toml"),
    (4, "diff hybrid-wall Cargo.toml.json"),
    (2, "diff hybrid-wall"),
];

#[test]
fn the_message_of_every_refusal() {
    let told = |(expected, command): &(i32, &str)| {
        let output = hpu().args(command.split_whitespace()).env("COLUMNS", "100").output().expect("starts");
        assert_eq!(code(&output), *expected, "{command}: {}", stderr(&output));
        assert_eq!(stdout(&output), "", "{command}");
        format!("$ hpu {command}\n{}exit code {expected}\n\n", stderr(&output))
    };
    settings().bind(|| insta::assert_snapshot!("refusals", REFUSED.iter().map(told).collect::<String>()));
}

#[test]
fn no_snapshot_is_left_of_what_is_gone() {
    let dir = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/snapshots"));
    let kept = fs::read_dir(dir).expect("snapshots").map(|entry| entry.expect("an entry").file_name());
    let mut jsons: Vec<_> = kept.filter_map(|name| name.into_string().ok()).collect();
    jsons.retain(|name| name.starts_with("json-"));
    assert_eq!(jsons.len(), COMMANDS.len(), "{jsons:?}");
}
