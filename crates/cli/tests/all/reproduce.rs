//! `hpu reproduce`: its results do not depend on threads or interruptions, and it refuses the folder of another study.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::common::{assert_refused, code, hpu, json, names, run, scratch, stderr, stdout, text};

/// A small study: 2 axes, 2 platforms, 3 stiffnesses, 2 trials, each of half a second, in which no drop comes to rest.
/// The softest row is therefore near a boundary, and so is the stiffest, which is not aborted: these rows run at 2
/// seeds.
const SMALL: [&str; 14] = [
    "reproduce",
    "phantom-table-2",
    "--axes",
    "xy",
    "--platforms",
    "FPGA-20,RTOS-1",
    "--stiffness",
    "500,250,30000",
    "--seeds",
    "2",
    "--trials",
    "2",
    "--set",
    "run.duration=500 ms",
];
const TRIALS: usize = 2 * 2 * (2 + 1 + 2) * 2;

fn small(out: &Path, more: &[&str]) -> std::process::Output {
    run(&[&SMALL[..], &["-o", text(out)], more].concat())
}

fn content(dir: &Path, name: &str) -> String {
    fs::read_to_string(dir.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

#[test]
fn a_study_writes_its_table_trials_and_pictures_and_prints_the_table() {
    let out = scratch("reproduce-small").join("out");
    let output = small(&out, &["--quiet"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(stderr(&output), "", "no progress where nobody wants any");
    let expected = ["cells.csv", "journal.txt", "rms.png", "rms.svg", "table-2.png", "table-2.svg", "table.txt"];
    assert_eq!(names(&out), expected);
    let table = content(&out, "table.txt");
    assert!(stdout(&output).starts_with(&table));
    let command = "hpu reproduce phantom-table-2 --axes xy --platforms RTOS-1,FPGA-20 --stiffness 250,500,30000 \
                   --seeds 2 --trials 2 --set run.duration='500 ms' -o ";
    assert!(table.contains(command), "{table}");
    assert!(content(&out, "table-2.svg").contains("--stiffness 250,500,30000"));
    let cells = content(&out, "cells.csv");
    let rows: Vec<Vec<&str>> = cells.lines().skip(1).map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), TRIALS);
    let keys: Vec<String> = rows.iter().map(|row| row[1..6].join(" ")).collect();
    let first = ["250 1 1", "250 1 2", "250 2 1", "250 2 2", "500 1 1", "500 1 2", "30000 1 1"];
    assert_eq!(keys[..7], first.map(|key| format!("x RTOS-1 {key}")));
    assert_eq!(keys[TRIALS - 1], "y FPGA-20 30000 2 2");
}

#[test]
fn the_command_under_the_table_replays_one_of_its_trials() {
    let output = run(&[&SMALL[..], &["--json"]].concat());
    let result = json(&output);
    let replay = result["replay"].as_str().expect("a command").replacen("hpu", env!("CARGO_BIN_EXE_hpu"), 1);
    let output = Command::new("sh").args(["-c", &replay]).current_dir(crate::common::ROOT).output().expect("a shell");
    assert!([0, 1].contains(&code(&output)), "{}", stderr(&output));
    assert!(stdout(&output).contains("outcome"), "{}", stdout(&output));
}

#[test]
fn threads_change_nothing() {
    let dir = scratch("reproduce-threads");
    for (name, jobs) in [("one", "1"), ("three", "3")] {
        assert_eq!(code(&small(&dir.join(name), &["--jobs", jobs])), 0);
    }
    assert_eq!(content(&dir.join("one"), "cells.csv"), content(&dir.join("three"), "cells.csv"));
}

#[test]
fn an_interrupted_study_says_so_and_goes_on_to_what_an_uninterrupted_one_is() {
    let dir = scratch("reproduce-interrupt");
    let (whole, out) = (dir.join("whole"), dir.join("out"));
    let long = ["--jobs", "2", "--set", "run.duration=10 s"];
    assert_eq!(code(&small(&whole, &long)), 0);
    let arguments = [&SMALL[..], &["-o", text(&out)], &long].concat();
    let child = hpu().args(&arguments).stdout(Stdio::piped()).spawn().expect("starts");
    let done = || fs::read_to_string(out.join("journal.txt")).map_or(0, |text| text.lines().count());
    let start = Instant::now();
    while done() < 4 {
        assert!(start.elapsed() < Duration::from_secs(60), "no trial is done");
        sleep(Duration::from_millis(1));
    }
    let kill = Command::new("sh").args(["-c", &format!("kill -INT {}", child.id())]).status();
    assert!(kill.expect("a shell").success());
    let output = child.wait_with_output().expect("ends");
    assert_eq!(code(&output), 130, "{}", stdout(&output));
    assert!(stdout(&output).contains("interrupted after") && stdout(&output).contains("goes on"));
    assert_eq!(names(&out), ["journal.txt"], "no half of a result");
    let kept = content(&out, "journal.txt");
    assert!(kept.ends_with('\n') && kept.lines().count() < content(&whole, "journal.txt").lines().count());

    let output = run(&arguments);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(content(&out, "journal.txt").starts_with(&kept), "what was done is not done again");
    assert_eq!(content(&out, "cells.csv"), content(&whole, "cells.csv"));
}

#[test]
fn a_finished_study_is_drawn_again_from_its_journal() {
    let out = scratch("reproduce-again");
    assert_eq!(code(&small(&out, &[])), 0);
    let (journal, table) = (content(&out, "journal.txt"), content(&out, "table.txt"));
    fs::remove_file(out.join("table.txt")).expect("a table");
    assert_eq!(code(&small(&out, &["--jobs", "1"])), 0, "the number of threads is no setting of the study");
    assert_eq!((content(&out, "journal.txt"), content(&out, "table.txt")), (journal, table));
}

#[test]
fn the_folder_of_another_study_is_refused_and_stays_as_it_is() {
    let out = scratch("reproduce-other");
    assert_eq!(code(&small(&out, &[])), 0);
    let before = content(&out, "journal.txt");
    for more in [["--set", "drop.weight=0.2"], ["--set", "run.seed=5"]] {
        assert_refused(&small(&out, &more), 2, &["holds another study", "this one is", more[1], "another folder"]);
    }
    fs::write(out.join("journal.txt"), "my own notes\n").expect("a file");
    assert_refused(&small(&out, &[]), 2, &["journal.txt", "holds another study", "my own notes"]);
    fs::write(out.join("journal.txt"), before.replacen(" [0,", " [zero,", 1)).expect("a file");
    let output = small(&out, &["--jobs", "1"]);
    assert_eq!(code(&output), 0);
    assert!(stderr(&output).contains("journal.txt: 1 row is damaged"), "{}", stderr(&output));
    let sorted = |text: &str| text.lines().map(String::from).collect::<std::collections::BTreeSet<_>>();
    assert_eq!(sorted(&content(&out, "journal.txt")), sorted(&before), "its cell is run again");
    fs::write(out.join("journal.txt"), before.replacen("journal 3: ", "journal 2: ", 1)).expect("a file");
    assert_refused(&small(&out, &[]), 2, &["journal.txt", "of an older program", "another folder"]);
}

#[test]
fn what_no_cell_could_take_is_refused_before_anything_is_written() {
    let dir = scratch("reproduce-refused");
    let out = dir.join("out");
    for (arguments, exit, words) in [
        (&["--set", "room.stiffness=5"][..], 2, &["room.stiffness", "--stiffness"][..]),
        (&["--set", "room.stifness=5"], 4, &["room.stifness", "unknown key"]),
        (&["--set", "drop.weight=heavy"], 4, &["drop.weight"]),
    ] {
        let arguments = [&["reproduce", "phantom-table-2", "-o", text(&out)][..], arguments].concat();
        assert_refused(&run(&arguments), exit, words);
    }
    for (option, value) in [
        ("--axes", "w"),
        ("--platforms", "RTOS-7"),
        ("--stiffness", "-5"),
        ("--trials", "0"),
        ("--seeds", "0"),
        ("--jobs", "0"),
    ] {
        let output = run(&["reproduce", "phantom-table-2", option, value, "-o", text(&out)]);
        assert_eq!((code(&output), stdout(&output).as_str()), (2, ""), "{option} {value}");
    }
    assert_eq!(names(&dir), [""; 0]);
}

#[test]
fn json_is_one_object_with_claims_limits_and_cells() {
    let result = json(&run(&[&SMALL[..], &["--json"]].concat()));
    assert_eq!((&result["complete"], &result["trials"]), (&true.into(), &TRIALS.into()));
    let rung = &result["rungs"][0];
    assert_eq!(rung["cells"].as_array().expect("cells").len(), 12);
    assert_eq!(rung["limits"].as_array().expect("limits").len(), 4);
    assert_eq!(rung["printed"]["legible"], 12);
    assert_eq!(result["seeds"], serde_json::json!([1, 2]));
    let seeds = |cell: usize| rung["cells"][cell]["outcome_at_seeds"].as_array().expect("outcomes").len();
    assert_eq!([0, 1, 2].map(seeds), [2, 1, 2]);
    assert!(rung["claims"][0]["met_at_seeds"].as_array().is_some_and(|seeds| seeds.len() == 2));
    assert!(rung["claims"].as_array().expect("claims").iter().any(|claim| claim["letter"] == "f"));
    assert_eq!(rung["failures"], serde_json::json!([]));
}

#[test]
fn the_ladder_runs_every_rung_and_draws_itself() {
    let out = scratch("reproduce-ladder");
    let output = run(&[
        "reproduce",
        "phantom-ladder",
        "--axes",
        "y",
        "--platforms",
        "PMOS-1,FPGA-100",
        "--stiffness",
        "250",
        "--seeds",
        "3",
        "--trials",
        "1",
        "--set",
        "run.duration=300 ms",
        "-o",
        text(&out),
    ]);
    assert_eq!(code(&output), 0, "{}{}", stdout(&output), stderr(&output));
    let expected = ["cells.csv", "journal.txt", "ladder.csv", "ladder.png", "ladder.svg", "ladder.txt", "table.txt"];
    assert_eq!(names(&out), expected);
    for rung in hpu_papers::phantom::RUNGS {
        assert!(content(&out, "ladder.txt").lines().any(|line| line.starts_with(rung.name)), "{}", rung.name);
        // Only one row is not passive, so both of its neighbours are open.
        assert_eq!(content(&out, "cells.csv").matches(&format!("{},y,", rung.name)).count(), 2 * 3, "{}", rung.name);
    }
}
