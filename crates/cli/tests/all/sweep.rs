//! `hpu sweep`: the same bytes whatever the shards, against the verbs that know nothing of shards; damaged files,
//! deaths and poison.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use sha2::{Digest, Sha256};

use crate::common::{ROOT, assert_refused, code, hpu, json, names, run, scratch, stderr, stdout, text, tools};
use crate::map::{PLAN_OF_30_S, SMALL as COMMAND};

/// A study of a map with a boundary: 9 by 5 cells of 150 ms.
const SMALL: &str = r#"
name = "small"
title = "A small map"

[map]
scene = "hybrid-wall"
x = "wall.stiffness=0.5..6 N.m/rad:9"
y = "wall.damping=0..0.4 mN.m.s/rad:5"
set = ["run.duration=150 ms", "device.initial_angle=1.4 rad", 'hand.path=[["0 s", 1.4], ["20 ms", 1.8]]']
"#;

/// Writes a study into a folder.
fn study(dir: &Path, name: &str, content: &str) -> PathBuf {
    let path = dir.join(name);
    fs::write(&path, content).expect("a study");
    path
}

/// Writes the small study; with all cells, or refined.
fn small(dir: &Path, full: bool) -> PathBuf {
    study(dir, "small.toml", &if full { format!("{SMALL}full = true\n") } else { SMALL.to_string() })
}

fn fine(arguments: &[&str]) -> Output {
    let output = run(arguments);
    assert_eq!(code(&output), 0, "{arguments:?}: {}", stderr(&output));
    output
}

fn read(path: &Path) -> Vec<u8> {
    fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn gathered(dir: &Path) -> Vec<u8> {
    read(&dir.join("gathered.parquet"))
}

/// Returns the rows of a map's CSV, without the lines of comments.
fn rows(dir: &Path) -> Vec<String> {
    let text = fs::read_to_string(dir.join("map.csv")).expect("a map");
    text.lines().filter(|line| !line.starts_with('#')).map(String::from).collect()
}

/// Plans a study in shards of ten points into a folder beside it, and runs them.
fn whole(study: &Path) -> PathBuf {
    let out = study.with_file_name("sweep");
    fine(&["sweep", "run", text(study), "-o", text(&out), "--shard-points", "10", "--quiet"]);
    out
}

#[test]
fn a_map_in_shards_is_the_map_and_has_the_same_bytes_however_it_is_cut() {
    let dir = scratch("sweep-map");
    let (study, reference) = (small(&dir, true), dir.join("map"));
    fine(&[&COMMAND[..], &["--full", "-o", text(&reference)]].concat());
    let mut bytes = BTreeSet::new();
    for (name, points, jobs) in [("one", "45", "1"), ("seven", "7", "3"), ("single", "1", "2")] {
        let out = dir.join(name);
        let size = ["--shard-points", points, "--jobs", jobs, "--json"];
        let page = json(&fine(&[&["sweep", "run", text(&study), "-o", text(&out)][..], &size].concat()));
        assert_eq!((&page["rows"], &page["failed"]), (&45.into(), &0.into()));
        assert_eq!(names(&out), ["gathered.csv", "gathered.parquet", "manifest-1.json", "shards-1"]);
        assert_eq!(names(&out.join("shards-1")).len(), 45_usize.div_ceil(points.parse().expect("a number")));
        bytes.insert((gathered(&out), read(&out.join("gathered.csv"))));
        let drawn = out.join("drawn");
        fine(&["map", "--from", text(&out), "-o", text(&drawn)]);
        assert_eq!(rows(&drawn), rows(&reference));
        for picture in ["map.svg", "energy.svg"] {
            assert_eq!(read(&drawn.join(picture)), read(&reference.join(picture)), "{picture}");
        }
    }
    assert_eq!(bytes.len(), 1);
}

#[test]
fn a_refined_map_goes_in_waves_to_the_map_that_the_verb_makes() {
    let dir = scratch("sweep-waves");
    let (study, reference, out) = (small(&dir, false), dir.join("map"), dir.join("sweep"));
    let whole = json(&fine(&[&COMMAND[..], &["--json", "-o", text(&reference)]].concat()));
    let sweep = ["sweep", "plan", text(&study), "-o", text(&out), "--shard-points", "4"];
    fine(&sweep);
    // By hand, as on a farm: shards in any order, gather, plan, until no wave is left.
    let mut waves = 0;
    loop {
        waves += 1;
        let status = json(&fine(&["sweep", "status", text(&out), "--json"]));
        assert_eq!(status["complete"], false);
        let shards = status["waves"][waves - 1]["shards"].as_u64().expect("a number");
        for shard in (0..shards).rev() {
            fine(&["sweep", "shard", text(&out), "--index", &shard.to_string()]);
        }
        fine(&["sweep", "gather", text(&out)]);
        if stdout(&fine(&["sweep", "plan", text(&out), "--shard-points", "3"])).contains("no wave is left") {
            break;
        }
    }
    let status = json(&fine(&["sweep", "status", text(&out), "--json"]));
    assert_eq!(status["complete"], true);
    assert!(waves > 1, "a boundary takes a second wave");
    // As many points as cells that the map runs.
    let points = status["waves"].as_array().expect("waves").iter().filter_map(|wave| wave["points_done"].as_u64());
    assert_eq!(Some(points.sum()), whole["methods"][0]["run"].as_u64());
    let drawn = dir.join("drawn");
    fine(&["map", "--from", text(&out), "-o", text(&drawn)]);
    assert_eq!(rows(&drawn), rows(&reference));
}

#[test]
fn a_search_in_waves_finds_what_the_verb_finds() {
    let dir = scratch("sweep-search");
    let content = "name = \"search\"\ntitle = \"A search\"\n\n[widths]\nscenes = \"hybrid-wall\"\nsearch = true\n\
                   vary = [\"position_bits=11..12\", \"velocity_bits=9..10\"]\n";
    let (study, out) = (study(&dir, "search.toml", content), dir.join("sweep"));
    fine(&["sweep", "run", text(&study), "-o", text(&out), "--shard-points", "2"]);
    let vary = ["--vary", "position_bits=11..12", "--vary", "velocity_bits=9..10"];
    let (ours, theirs) = (dir.join("ours"), dir.join("theirs"));
    let verb = fine(&[&["widths", "hybrid-wall", "--search", "-o", text(&theirs)][..], &vary].concat());
    let from = fine(&["widths", "--from", text(&out), "-o", text(&ours)]);
    assert_eq!(stdout(&from), stdout(&verb));
    assert_eq!(read(&ours.join("designs.csv")), read(&theirs.join("designs.csv")));
    assert_refused(&run(&["map", "--from", text(&out)]), 2, &["hpu widths --from"]);
}

#[test]
fn the_lines_of_a_study_in_shards_are_those_of_the_study() {
    let dir = scratch("sweep-lines");
    let lines = |vary: &str| {
        format!(
            "[[group]]\nname = \"Settling, {vary}\"\n\n[[group.line]]\nvary.of = [0.5, 4.0]\n\
             what = \"$of N.m/rad, by {vary}\"\n\
             claims = \"a\"\ntext = \"{{wall.outcome}}, rms {{wall.rms * 1e6:.1 urad}}\"\nfigures.rms = \"wall.rms\"\n\
             measure.wall = {{ measure = \"run\", scene = \"{vary}\", set = [\"run.duration=100 ms\", \
             \"wall.stiffness=$of N.m/rad\"] }}\n\n"
        )
    };
    let content = format!(
        "name = \"lines\"\ntitle = \"Lines\"\n\n{}{}[[claim]]\nletter = \"a\"\npaper = \"softer is calmer\"\n\
         place = \"none\"\n\
         means = \"the rms never falls\"\nholds = \"never_falls(rms)\"\n",
        lines("hybrid-wall"),
        lines("thrown-hybrid")
    );
    let (study, out) = (study(&dir, "lines.toml", &content), dir.join("sweep"));
    let page = ["sweep", "run", text(&study), "-o", text(&out), "--shard-points", "3", "--json"];
    assert_eq!(json(&fine(&page))["rows"], 4);
    let (ours, theirs) = (dir.join("ours"), dir.join("theirs"));
    let verb = fine(&["study", text(&study), "-o", text(&theirs), "--json"]);
    let from = fine(&["study", "--from", text(&out), "-o", text(&ours), "--json"]);
    let without_files = |output: &Output| {
        let mut value = json(output);
        value["files"] = serde_json::Value::Null;
        value
    };
    assert_eq!(without_files(&from), without_files(&verb));
    for name in ["lines.txt", "lines.csv"] {
        assert_eq!(read(&ours.join(name)), read(&theirs.join(name)), "{name}");
    }
}

#[test]
fn a_finished_shard_is_left_as_it_is_and_a_shard_beyond_the_last_is_refused() {
    let dir = scratch("sweep-finished");
    let out = whole(&small(&dir, true));
    let file = out.join("shards-1/000002.parquet");
    let before = fs::metadata(&file).and_then(|found| found.modified()).expect("a file");
    let page = json(&fine(&["sweep", "shard", text(&out), "--index", "2", "--json"]));
    assert_eq!((&page["fresh"], &page["points"]), (&false.into(), &10.into()));
    assert_eq!(fs::metadata(&file).and_then(|found| found.modified()).expect("a file"), before);
    assert_refused(&run(&["sweep", "shard", text(&out), "--index", "5"]), 2, &["5 shards, from 0 to 4"]);
    // The same study again is the same sweep; another is refused.
    fine(&["sweep", "plan", text(&small(&dir, true)), "-o", text(&out)]);
    let other = small(&dir, false);
    assert_refused(&run(&["sweep", "plan", text(&other), "-o", text(&out)]), 2, &["another sweep", "another folder"]);
    assert_refused(&run(&["sweep", "status", text(&dir)]), 2, &["holds no sweep", "hpu sweep plan"]);
}

#[test]
fn files_that_are_not_those_of_their_shards_are_refused_by_name_and_run_again_when_asked() {
    let dir = scratch("sweep-damaged");
    let out = whole(&small(&dir, true));
    let expected = gathered(&out);
    fs::remove_file(out.join("gathered.parquet")).expect("a file");
    let shards = out.join("shards-1");
    let place = |shard: usize| shards.join(format!("{shard:06}.parquet"));
    let good: Vec<Vec<u8>> = (0..5).map(|shard| read(&place(shard))).collect();

    // The shards of the same map with another duration are foreign; those of the same map in other shards are stale.
    let other = dir.join("other");
    let longer = SMALL.replace("150 ms", "151 ms") + "full = true\n";
    let longer = study(&dir, "longer.toml", &longer);
    fine(&["sweep", "plan", text(&longer), "-o", text(&other), "--shard-points", "2"]);
    fine(&["sweep", "shard", text(&other), "--index", "0"]);
    let stale = dir.join("stale");
    fine(&["sweep", "plan", text(&small(&dir, true)), "-o", text(&stale), "--shard-points", "3"]);
    fine(&["sweep", "shard", text(&stale), "--index", "4"]);

    fs::write(place(0), &good[0][..good[0].len() - 30]).expect("a file");
    fs::write(place(1), read(&other.join("shards-1/000000.parquet"))).expect("a file");
    fs::write(place(2), &good[3]).expect("a file");
    let mut flipped = good[3].clone();
    flipped[good[3].len() / 3] ^= 0x10;
    fs::write(place(3), flipped).expect("a file");
    fs::write(place(4), read(&stale.join("shards-1/000004.parquet"))).expect("a file");
    fs::write(shards.join("000001 (copy).parquet"), &good[1]).expect("a file");

    let told = [
        "shards-1/000000.parquet: truncated",
        "shards-1/000001.parquet: foreign: of another sweep, hpu map",
        "shards-1/000002.parquet: duplicate: a copy of shard 3 of wave 1",
        "shards-1/000003.parquet: damaged",
        "shards-1/000004.parquet: stale: of an older manifest",
        "shards-1/000001 (copy).parquet: foreign",
    ];
    assert_refused(&run(&["sweep", "gather", text(&out)]), 4, &[&told[..], &["--again"]].concat());
    assert!(!out.join("gathered.parquet").exists());
    assert_refused(&run(&["sweep", "gather", text(&out), "--again"]), 1, &[&told[..], &["removed 6 files"]].concat());
    assert_refused(&run(&["sweep", "gather", text(&out)]), 1, &["5 shards are not done", "shards-1/000004.parquet"]);
    fine(&["sweep", "run", text(&out)]);
    assert_eq!(gathered(&out), expected);
    for (shard, good) in good.iter().enumerate() {
        assert_eq!(read(&place(shard)), *good, "shard {shard}");
    }
    // Both steps at once.
    fs::write(place(2), &good[4]).expect("a file");
    fine(&["sweep", "run", text(&out), "--again"]);
    assert_eq!(read(&place(2)), good[2]);
    // A gathered file that was changed is no map.
    let mut changed = expected;
    changed[100] ^= 1;
    fs::write(out.join("gathered.parquet"), changed).expect("a file");
    assert_refused(&run(&["map", "--from", text(&out)]), 4, &["gathered.parquet", "damaged"]);
}

/// Returns a manifest that was changed, with the checksum that it would have.
fn summed(text: &str) -> String {
    let mut manifest: serde_json::Value = serde_json::from_str(text).expect("JSON");
    manifest.as_object_mut().expect("an object").remove("manifest_sha256").expect("its sum");
    let sum: String = Sha256::digest(manifest.to_string()).iter().map(|byte| format!("{byte:02x}")).collect();
    manifest["manifest_sha256"] = sum.into();
    manifest.to_string()
}

#[test]
fn points_beyond_the_axes_are_refused_and_every_count_is_part_of_the_checksum() {
    let dir = scratch("sweep-beyond");
    let out = dir.join("sweep");
    fine(&["sweep", "plan", text(&small(&dir, true)), "-o", text(&out), "--shard-points", "9"]);
    let place = out.join("manifest-1.json");
    let original = String::from_utf8(read(&place)).expect("text");
    let manifest: serde_json::Value = serde_json::from_str(&original).expect("JSON");
    let count = manifest["points"].as_u64().expect("a number");
    assert_eq!(summed(&original), manifest.to_string(), "the checksum of this test is that of the command");
    let changed = |pairs: &[(&str, serde_json::Value)]| {
        let mut other = manifest.clone();
        pairs.iter().for_each(|(key, value)| other[*key] = value.clone());
        other.to_string()
    };
    let runs = |first: u64, points: u64, shard: u64| {
        let shards = points.div_ceil(shard.max(1));
        let numbers = [("points", points), ("shard_points", shard), ("shards", shards)];
        let numbers = numbers.map(|(key, number)| (key, number.into()));
        [&numbers[..], &[("runs", serde_json::json!([[first, points]]))]].concat()
    };
    let far = u64::MAX - 10;
    let beyond = [
        runs(count, 1, 9),
        runs(0, count + 1, 9),
        runs(100 * count, 5, 9),
        runs(far, 5, 9),
        runs(0, far, 1_000_000),
        runs(0, far, u64::MAX),
        runs(0, 1 << 40, 1),
        runs(0, count, 0),
        runs(0, count, 1 << 60),
        vec![("shards", far.into())],
        vec![("points", 0.into())],
        vec![("wave", 0.into())],
    ];
    let verbs = |asked: &dyn Fn(&[&str])| {
        let out = text(&out);
        asked(&["sweep", "status", out]);
        asked(&["sweep", "run", out]);
        asked(&["sweep", "gather", out]);
        asked(&["sweep", "shard", out, "--index", "0"]);
        asked(&["sweep", "shard", out, "--index", "0", "--point", "0"]);
        asked(&["sweep", "submit", out, "--engine", "slurm", "--dry-run"]);
        asked(&["map", "--from", out]);
    };
    for pairs in beyond {
        let told = format!("{pairs:?}");
        for manifest in [changed(&pairs), summed(&changed(&pairs))] {
            fs::write(&place, manifest).expect("a manifest");
            verbs(&|arguments: &[&str]| {
                let output = run(arguments);
                assert_eq!(code(&output), 4, "{told} {arguments:?}: {}", stderr(&output));
                assert!(stderr(&output).contains("plan the sweep again"), "{told}: {}", stderr(&output));
            });
        }
    }
    // No number may change without the checksum, even to one that could be.
    for (key, value) in [("shard_points", 8.into()), ("command", "hpu".into()), ("version", "x".into())] {
        fs::write(&place, changed(&[(key, value)])).expect("a manifest");
        assert_refused(&run(&["sweep", "status", text(&out)]), 4, &["manifest-1.json", "damaged"]);
    }
    fs::write(&place, original).expect("a manifest");
    let point = count.to_string();
    let last = format!("from 0 to {}", count - 1);
    assert_refused(&run(&["sweep", "shard", text(&out), "--index", "0", "--point", &point]), 2, &[&last]);
    fine(&["sweep", "run", text(&out)]);
}

#[test]
fn another_build_goes_on_only_when_asked() {
    let dir = scratch("sweep-build");
    let (study, out) = (small(&dir, true), dir.join("sweep"));
    fine(&["sweep", "plan", text(&study), "-o", text(&out), "--shard-points", "45"]);
    let place = out.join("manifest-1.json");
    let manifest: serde_json::Value = serde_json::from_slice(&read(&place)).expect("JSON");
    let own = manifest["program_xxh128"].as_str().expect("a sum");
    let original = String::from_utf8(read(&place)).expect("text");
    let other = original.replace(own, &"5".repeat(32));
    fs::write(&place, summed(&other)).expect("a manifest");
    assert_refused(&run(&["sweep", "shard", text(&out), "--index", "0"]), 2, &["another build", "--any-version"]);
    fine(&["sweep", "shard", text(&out), "--index", "0", "--any-version"]);
    assert_refused(&run(&["sweep", "gather", text(&out)]), 4, &["stale: of another build"]);
    fine(&["sweep", "gather", text(&out), "--any-version"]);
    // A program with one byte more is another one.
    let changed = dir.join("changed");
    let program = [read(Path::new(hpu().get_program())), vec![0]].concat();
    fs::write(&changed, program).expect("a program");
    fs::set_permissions(&changed, fs::Permissions::from_mode(0o755)).expect("it may run");
    fs::write(&place, original).expect("a manifest");
    let shard = Command::new(&changed).args(["sweep", "shard", text(&out), "--index", "0"]).output();
    assert_refused(&shard.expect("it starts"), 2, &["another build", "--any-version"]);
    // A manifest whose settings were changed is no manifest.
    fs::write(&place, summed(&other.replace("150 ms", "160 ms"))).expect("a manifest");
    assert_refused(&run(&["sweep", "status", text(&out)]), 4, &["manifest-1.json", "damaged"]);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn shards_that_are_killed_at_any_instant_end_with_the_same_bytes_and_no_poison() {
    // Twice as many cells, of which each takes some 20 ms, as the shaft turns about at rest.
    let long = SMALL.replace("hybrid-wall", "friction-wall").replace("150 ms", "2 s").replace("rad:9", "rad:18");
    let long = |dir: &Path| study(dir, "long.toml", &format!("{long}full = true\n"));
    let dir = scratch("sweep-killed");
    let out = dir.join("sweep");
    fine(&["sweep", "plan", text(&long(&dir)), "-o", text(&out), "--shard-points", "90"]);
    let shards = out.join("shards-1");
    let (journal, mut kept) = (shards.join("000000.journal"), Vec::new());
    let start = Instant::now();
    let mut kills = 0;
    for step in 0.. {
        assert!(start.elapsed() < Duration::from_secs(60), "the shard does not come to its end");
        let mut child = hpu();
        child.args(["sweep", "shard", text(&out), "--index", "0", "--quiet"]).stdout(Stdio::null());
        let mut child = child.spawn().expect("starts");
        // Longer each time, also on a busy machine: five kills in a row at the same point would make it poison.
        sleep(Duration::from_millis(60 + 10 * step + 4 * step * step));
        if child.try_wait().expect("a process").is_some() {
            break;
        }
        child.kill().expect("it runs");
        child.wait().expect("it ended");
        kills += 1;
        // The last kill may come when the shard has its file, and its journal is gone already.
        kept = fs::read(&journal).ok().filter(|rows| !rows.is_empty()).unwrap_or(kept);
    }
    assert!(kills > 0 && !kept.is_empty(), "a shard of 90 cells takes longer than 60 ms");
    // Few kills come while a file is written, so some are made up: in a row, in the journal beside it, in the shard.
    fs::write(&journal, [&kept, &b"half a row"[..]].concat()).expect("a journal");
    fs::write(shards.join(".000000.journal.hpu-1-0.tmp"), &kept).expect("a journal");
    fs::write(shards.join(".000000.hpu-1-0.tmp"), "PAR1").expect("a part of a file");
    fs::remove_file(shards.join("000000.parquet")).expect("the file goes");
    let ended = run(&["sweep", "shard", text(&out), "--index", "0"]);
    assert!(code(&ended) == 0 && stderr(&ended).contains("damaged"), "{}", stderr(&ended));
    fine(&["sweep", "gather", text(&out)]);
    assert_eq!(names(&shards), ["000000.parquet"]);
    assert!(gathered(&out) == gathered(&whole(&long(&scratch("sweep-killed-not")))));
}

#[test]
fn points_that_end_their_process_are_rows_with_their_reason() {
    let dir = scratch("sweep-poison");
    // Two of four cells record more rows than fit into the memory that the shell allows.
    let content = "name = \"poison\"\ntitle = \"Cells too large\"\n\n[map]\nscene = \"free-motion\"\n\
                   x = \"run.duration=0.001..0.3 s:2\"\ny = \"device.initial_speed=100..110 rad/s:2\"\n\
                   set = [\"record.plant_rate=50 MHz\"]\nfull = true\n";
    let (study, out) = (study(&dir, "poison.toml", content), dir.join("sweep"));
    let command = format!(
        "ulimit -c 0; ulimit -v 300000; exec '{}' sweep run '{}' -o '{}' --shard-points 4 --jobs 1 --json",
        env!("CARGO_BIN_EXE_hpu"),
        study.display(),
        out.display()
    );
    let output = Command::new("sh").args(["-c", &command]).current_dir(ROOT).output().expect("a shell");
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!((&json(&output)["rows"], &json(&output)["failed"]), (&4.into(), &2.into()));
    let csv = String::from_utf8(read(&out.join("gathered.csv"))).expect("text");
    let rows: Vec<&str> = csv.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit())).collect();
    for (point, row) in rows.iter().enumerate() {
        assert_eq!(row.starts_with(&format!("{point},failed,")), point % 2 == 1, "{row}");
        assert_eq!(row.contains("poison: its process ended 3 times, by signal 6"), point % 2 == 1, "{row}");
    }
    assert_eq!(names(&out.join("shards-1")), ["000000.parquet"]);
}

#[test]
fn points_that_the_guard_stops_are_not_run_and_leave_the_sweep_incomplete() {
    let dir = scratch("sweep-guard");
    let content = format!(
        "name = \"guard\"\ntitle = \"A cell too long\"\n\n[map]\nscene = \"friction-wall\"\n\
         x = \"run.duration=0.01..20 s:2\"\ny = \"wall.stiffness=1..2 N.m/rad:2\"\n\
         set = [\"record.plant_rate=100 Hz\", '{PLAN_OF_30_S}']\nfull = true\ncell_timeout = \"1ms\"\n"
    );
    let (study, out) = (study(&dir, "guard.toml", &content), dir.join("sweep"));
    fine(&["sweep", "plan", text(&study), "-o", text(&out), "--shard-points", "2"]);
    for shard in ["0", "1"] {
        fine(&["sweep", "shard", text(&out), "--index", shard]);
    }
    let told = ["shards-1/000000.parquet: not run: 1 points", "shards-1/000001.parquet: not run: 1 points"];
    assert_refused(&run(&["sweep", "gather", text(&out)]), 4, &told);
    let page = json(&fine(&["sweep", "gather", text(&out), "--partial", "--json"]));
    assert_eq!((&page["rows"], &page["failed"], &page["not_run"]), (&4.into(), &0.into(), &2.into()));
}

#[test]
fn a_manifest_of_a_billion_points_is_small_and_numbers_them_all() {
    let dir = scratch("sweep-billion");
    let methods: String = (0..1000).map(|at| format!("    \"m{at}:device.initial_angle=0.{at:03} rad\",\n")).collect();
    let content = format!(
        "name = \"billion\"\ntitle = \"10^9 points\"\n\n[map]\nscene = \"hybrid-wall\"\n\
         x = \"wall.stiffness=0.1..6 N.m/rad:1000\"\ny = \"wall.position=1..2 rad:1000\"\n\
         method = [\n{methods}]\nfull = true\n"
    );
    let (study, out) = (study(&dir, "billion.toml", &content), dir.join("sweep"));
    let size = ["--shard-points", "20000", "--json"];
    let page = json(&fine(&[&["sweep", "plan", text(&study), "-o", text(&out)][..], &size].concat()));
    assert_eq!((&page["points"], &page["shards"]), (&1_000_000_000.into(), &50_000.into()));
    let bytes = fs::metadata(out.join("manifest-1.json")).expect("a manifest").len();
    assert!(bytes < 1_000_000, "{bytes} bytes");
    let manifest: serde_json::Value =
        serde_json::from_slice(&read(&out.join("manifest-1.json"))).expect("one JSON value");
    assert_eq!(manifest["runs"], serde_json::json!([[0, 1_000_000_000]]));
}

#[test]
fn a_dry_run_prints_an_array_that_slurm_allows_and_the_job_after_it() {
    let dir = scratch("sweep-slurm");
    let (study, out) = (small(&dir, true), dir.join("sweep"));
    fine(&["sweep", "plan", text(&study), "-o", text(&out), "--shard-points", "2"]);
    let place = tools(&dir, &[("scontrol", "echo 'Configuration data'; echo 'MaxArraySize            = 8'")]);
    let dry = ["sweep", "submit", text(&out), "--engine", "slurm", "--dry-run", "--limit", "3", "--cores", "2"];
    let output = hpu().args(dry).arg("--option=--partition=long").env("PATH", &place).output().expect("starts");
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let said = stdout(&output);
    for line in [
        "#SBATCH --array=0-7%3",
        "#SBATCH --requeue",
        "#SBATCH --cpus-per-task=2",
        "#SBATCH --partition=long",
        "--wave 1 --index \"$SLURM_ARRAY_TASK_ID\" --of 8 --cores 2",
        "--dependency=afterok",
        "--engine slurm --limit 3 --cores 2 --option='--partition=long'",
    ] {
        assert!(said.contains(line), "{line}: {said}");
    }
    // Where Slurm tells nothing, its own default holds, and no array is longer than the shards are many.
    let output = hpu().args(dry).env("PATH", dir.join("none")).output().expect("starts");
    assert!(stdout(&output).contains("--array=0-22%3\n"), "{}", stdout(&output));
    let submit = ["sweep", "submit", text(&out), "--engine", "slurm"];
    assert_refused(
        &hpu().args(submit).env("PATH", dir.join("none")).output().expect("starts"),
        3,
        &["squeue", "Slurm's commands"],
    );
    let dry = ["sweep", "submit", text(&out), "--engine", "parallel", "--dry-run", "--limit", "3"];
    let said = stdout(&fine(&dry));
    assert!(said.contains("seq 0 22 | parallel --jobs 3 ") && said.contains("--index {} --of 23"), "{said}");
    // Of 23 shards in 8 tasks, the tasks with shards left: 3, 11 and 19 are task 3's.
    for shard in ["3", "11", "19", "0"] {
        fine(&["sweep", "shard", text(&out), "--index", shard]);
    }
    let dry = ["sweep", "submit", text(&out), "--engine", "slurm", "--dry-run"];
    let said = stdout(&hpu().args(dry).env("PATH", &place).output().expect("starts"));
    assert!(said.contains("--array=0-2,4-7\n"), "{said}");
    // The tasks of an array do all shards.
    for task in ["0", "1", "2"] {
        fine(&["sweep", "task", text(&out), "--wave", "1", "--index", task, "--of", "3", "--cores", "2"]);
    }
    assert_eq!(json(&fine(&["sweep", "status", text(&out), "--json"]))["complete"], true);
}

#[test]
fn what_is_no_sweep_is_refused_before_anything_is_written() {
    let dir = scratch("sweep-refused");
    let out = dir.join("out");
    let refused = |content: &str, more: &[&str], exit: i32, words: &[&str]| {
        let study = study(&dir, "study.toml", content);
        let output = run(&[&["sweep", "plan", text(&study), "-o", text(&out)][..], more].concat());
        assert_refused(&output, exit, words);
    };
    let head = "name = \"a\"\ntitle = \"b\"\n";
    refused(head, &[], 4, &["a sweep can split: map, widths, phantom-table-2, phantom-ladder or lines"]);
    refused(&format!("{head}[limits]\nscene = \"hybrid-wall\"\n"), &[], 4, &["nothing that a sweep can split"]);
    refused(&format!("{head}[phantom-tabel-2]\n"), &[], 4, &["unknown key", "did you mean phantom-table-2?"]);
    let key = format!("{head}[phantom-table-2]\naxis = \"y\"\n");
    refused(&key, &[], 4, &["phantom-table-2.axis: unknown key; accepted here: set, axes", "did you mean axes?"]);
    refused(&format!("{head}[phantom-table-2]\naxes = \"w\"\n"), &[], 2, &["some of x, y, z"]);
    refused(&format!("{head}[widths]\nscenes = \"hybrid-wall\"\n"), &[], 2, &["search = true"]);
    let two = SMALL.to_string() + "\n[widths]\nscenes = \"hybrid-wall\"\nsearch = true\n";
    refused(&two, &[], 2, &["--section", "map, widths"]);
    refused(&two, &["--section", "limits"], 2, &["no section limits", "map, widths"]);
    refused(&SMALL.replace("0.5..6", "6..0.5"), &[], 2, &["reversed"]);
    refused(&SMALL.replace("wall.damping", "wall.dampin"), &[], 4, &["wall.dampin", "unknown key"]);
    refused(SMALL, &["--shard-points", "0"], 2, &["--shard-points"]);
    refused(SMALL, &["--shard-time", "soon"], 2, &["60s"]);
    assert!(!out.exists());
    assert_refused(&run(&["sweep", "plan", text(&dir.join("study.toml"))]), 2, &["-o DIR"]);
    assert_refused(&run(&["map", "--from", text(&dir)]), 2, &["holds no sweep"]);
}

#[test]
fn a_drop_test_in_shards_has_the_files_of_the_verb_to_the_byte() {
    let dir = scratch("sweep-drops");
    let (section, verb) = (
        "axes = \"y\"\nplatforms = [\"PMOS-1\", \"FPGA-400\"]\nstiffness = [750, 1000]\nseeds = 2\ntrials = 1\n",
        "--axes y --platforms PMOS-1,FPGA-400 --stiffness 750,1000 --seeds 2 --trials 1",
    );
    let ladder = "axes = \"y\"\nplatforms = \"PMOS-1\"\nstiffness = 750\nseeds = 1\ntrials = 1\n";
    let content =
        format!("name = \"drops\"\ntitle = \"Drops\"\n\n[phantom-table-2]\n{section}\n[phantom-ladder]\n{ladder}");
    let study_file = study(&dir, "drops.toml", &content);
    let sweep = |section: &str, points: &str| {
        let out = dir.join(format!("{section}-{points}"));
        let run = ["sweep", "run", text(&study_file), "--section", section, "-o", text(&out), "--shard-points", points];
        fine(&[&run[..], &["--quiet"]].concat());
        out
    };
    let table = sweep("phantom-table-2", "3");
    let waves = json(&fine(&["sweep", "status", text(&table), "--json"]))["waves"].as_array().expect("waves").len();
    assert!(waves > 1, "cells near a boundary are a second wave");
    // Both write into a folder of the same name, which the command in their files names.
    let files = |place: &str, arguments: &[&str]| {
        let place = dir.join(place);
        fs::create_dir_all(&place).expect("a folder");
        let output = hpu().args(arguments).args(["-o", "out"]).current_dir(&place).output().expect("starts");
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        let out = place.join("out");
        let mut names = names(&out);
        names.retain(|name| name != "journal.txt");
        let files: Vec<_> = names.into_iter().map(|name| (read(&out.join(&name)), name)).collect();
        (stdout(&output), files)
    };
    let of_verb: Vec<&str> = ["reproduce", "phantom-table-2"].into_iter().chain(verb.split(' ')).collect();
    let of_sweep = files("ours", &["reproduce", "phantom-table-2", "--from", text(&table)]);
    assert!(of_sweep.1.iter().any(|(_, name)| name == "table.txt"));
    assert_eq!(of_sweep, files("theirs", &of_verb));
    // The ladder, against the same section of `hpu study`.
    let (_, of_sweep) =
        files("ladder", &["reproduce", "phantom-ladder", "--from", text(&sweep("phantom-ladder", "7"))]);
    let only = study(&dir, "ladder.toml", &format!("name = \"l\"\ntitle = \"L\"\n\n[phantom-ladder]\n{ladder}"));
    let of_study = dir.join("study");
    fine(&["study", text(&only), "-o", text(&of_study), "--quiet"]);
    for name in ["cells.csv", "ladder.csv"] {
        let own = of_sweep.iter().find(|(_, own)| own == name).expect("the file");
        assert_eq!(own.0, read(&of_study.join("phantom-ladder").join(name)), "{name}");
    }
    let other = ["reproduce", "phantom-ladder", "--from", text(&table)];
    assert_refused(&run(&other), 2, &["hpu reproduce phantom-table-2 --from shows it"]);
}

#[test]
fn limits_over_a_grid_in_shards_are_those_of_the_verb_at_each_point() {
    let dir = scratch("sweep-limits");
    // In runs that are long enough to tell, which a study makes longer.
    let short = ["run.duration=300 ms", "device.initial_angle=1.4 rad", "hand.path=[[0, 1.4], [0.02, 1.8]]"];
    let dampings = ["0", "0.3 mN.m.s/rad"];
    let set = format!("scene = \"hybrid-wall\", set = ['wall.damping=$damping', '{}']", short.join("', '"));
    let content = format!(
        "name = \"limits\"\ntitle = \"Limits\"\n\n[[group]]\nname = \"g\"\n\n[[group.line]]\n\
         vary.damping = {dampings:?}\nwhat = \"$damping\"\n\
         text = \"{{linear.limit:.9}}|{{words.failed?:.9}}|{{words.settled?:.9}}|{{criterion.limit:.9}}\"\n\
         measure.linear = {{ measure = \"linear\", {set} }}\n\
         measure.words = {{ measure = \"stable\", words = 12, {set} }}\n\
         measure.criterion = {{ measure = \"criterion\", name = \"routh\", {set} }}\n"
    );
    let (study, out) = (study(&dir, "limits.toml", &content), dir.join("sweep"));
    fine(&["sweep", "run", text(&study), "-o", text(&out), "--shard-points", "1", "--quiet"]);
    let lines = json(&fine(&["study", "--from", text(&out), "--json"]))["lines"].clone();
    for (line, damping) in lines.as_array().expect("lines").iter().zip(dampings) {
        let damping = format!("wall.damping={damping}");
        let set = [damping.as_str()].into_iter().chain(short).flat_map(|set| ["--set", set]);
        let verb: Vec<&str> = ["limits", "hybrid-wall", "--words", "12", "--json"].into_iter().chain(set).collect();
        let limits = json(&fine(&verb));
        let number = |value: &serde_json::Value| value.as_f64().expect("a number");
        let end = &limits["linear"]["stable"][0]["to"];
        let words = ["lowest_failed", "highest_settled"].map(|key| number(&limits["words"][key]));
        let criteria = limits["criteria"].as_array().expect("criteria");
        let routh = criteria.iter().find(|criterion| criterion["name"] == "routh").expect("it is told");
        let linear = 0.5 * (number(&end["at"]) + number(&end["beyond"]));
        let told = [linear, words[0], words[1], number(&routh["limit"])].map(|limit| format!("{limit:.9}"));
        assert_eq!(line["emulated"], told.join("|"), "{damping}");
    }
    assert_eq!(lines.as_array().map(Vec::len), Some(2));
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn a_map_over_a_generic_of_a_design_runs_in_shards_without_the_files_of_the_design() {
    let dir = scratch("sweep-design");
    let here = dir.join("here");
    fs::create_dir_all(here.join("rim")).expect("a folder");
    let shipped = Path::new(ROOT).join("testbench/dut");
    fs::copy(shipped.join("rim.toml"), here.join("rim.toml")).expect("a scene");
    for name in names(&shipped.join("rim")).iter().filter(|name| name.ends_with(".vhd")) {
        fs::copy(shipped.join("rim").join(name), here.join("rim").join(name)).expect("its VHDL");
    }
    let scene = here.join("rim.toml");
    let [x, y] = ["dut.generics.WALL_AT=1..3:2", "hand.stiffness=0.25..0.35 N.m/rad:2"];
    let set = ["dut.engine=ghdl", "wall.position=1.6 mrad", "run.duration=1 ms", "hand.path=[[0, 0], [0.0002, 0.06]]"];
    let content = format!(
        "name = \"design\"\ntitle = \"A generic\"\n\n[map]\nscene = \"{}\"\nx = \"{x}\"\ny = \"{y}\"\nset = ['{}']\n\
         full = true\n",
        scene.display(),
        set.join("', '")
    );
    let (reference, out) = (dir.join("map"), dir.join("sweep"));
    let verb = ["map", text(&scene), "--x", x, "--y", y, "--full", "-o", text(&reference)];
    let verb: Vec<&str> = verb.into_iter().chain(set.iter().flat_map(|set| ["--set", set])).collect();
    fine(&verb);
    fine(&["sweep", "plan", text(&study(&dir, "design.toml", &content)), "-o", text(&out), "--shard-points", "3"]);
    // Another machine of a farm has the manifest alone.
    fs::remove_dir_all(&here).expect("a folder");
    for shard in ["0", "1"] {
        fine(&["sweep", "shard", text(&out), "--index", shard]);
    }
    fine(&["sweep", "gather", text(&out)]);
    let drawn = dir.join("drawn");
    fine(&["map", "--from", text(&out), "-o", text(&drawn)]);
    let rows = [rows(&drawn), rows(&reference)];
    assert_eq!(rows[0], rows[1]);
    // The generic makes another motion.
    let moved = |cell: usize| rows[0][1 + cell].split(',').nth(7).map(String::from);
    assert_ne!(moved(0), moved(1), "{:?}", rows[0]);
}

/// A Slurm of three commands in a folder: `sbatch` numbers the jobs and keeps them, `squeue` finds them by name. The
/// file `die` says at which call `sbatch` kills the process that called it.
struct Farm {
    queue: PathBuf,
    tools: PathBuf,
}

impl Farm {
    fn new(dir: &Path) -> Self {
        let queue = dir.join("queue");
        fs::create_dir_all(&queue).expect("a folder");
        for (name, content) in [("calls", "0\n"), ("die", "")] {
            fs::write(queue.join(name), content).expect("a file");
        }
        let sbatch = "cd '{queue}'\nn=$(($(cat calls) + 1))\necho $n >calls\n\
                      if [ \"$(cat die)\" = \"$n before\" ]; then kill -9 $PPID; exit 1; fi\n\
                      cat >$n.part\necho \"$@\" >$n.options\nmv $n.part $n.sh\n\
                      if [ \"$(cat die)\" = \"$n after\" ]; then kill -9 $PPID; exit 1; fi\necho $n";
        let squeue = "for word in \"$@\"; do case $word in --name=*) names=,${word#--name=},;; esac; done\n\
                      for job in '{queue}'/*.sh; do\n[ -e \"$job\" ] || continue\n\
                      name=$(sed -n 's/^#SBATCH --job-name=//p' \"$job\")\n\
                      case $names in *,$name,*) basename \"$job\" .sh;; esac\ndone";
        let [sbatch, squeue] = [sbatch, squeue].map(|script| script.replace("{queue}", text(&queue)));
        let scripts = [("sbatch", &*sbatch), ("squeue", &*squeue), ("scontrol", "echo 'MaxArraySize = 3'")];
        let tools = tools(dir, &scripts);
        Self { queue, tools }
    }

    fn submit(&self, sweep: &Path) -> Output {
        let path = format!("{}:{}", self.tools.display(), std::env::var("PATH").expect("a PATH"));
        let submit = ["sweep", "submit", text(sweep), "--engine", "slurm"];
        hpu().args(submit).env("PATH", path).output().expect("starts")
    }

    /// Runs jobs as their dependencies allow until none is left; of the first array only so many tasks, and then the
    /// array has failed. Returns what the jobs said.
    fn run(&self, tasks_of_the_first: usize) -> String {
        let path = format!("{}:{}", self.tools.display(), std::env::var("PATH").expect("a PATH"));
        let (mut ended, mut said) = (std::collections::BTreeMap::new(), String::new());
        for turn in 0.. {
            assert!(turn < 100, "the jobs do not come to an end: {said}");
            let jobs = names(&self.queue).into_iter().filter_map(|name| name.strip_suffix(".sh")?.parse::<u32>().ok());
            let Some((job, can_run)) = jobs.collect::<BTreeSet<_>>().into_iter().find_map(|job| {
                let options = fs::read_to_string(self.queue.join(format!("{job}.options"))).expect("options");
                let kind = options.split_whitespace().find_map(|word| word.strip_prefix("--dependency="));
                let Some((kind, of)) = kind.and_then(|kind| kind.split_once(':')) else { return Some((job, true)) };
                let ok = ended.get(&of.parse::<u32>().expect("a job"))?;
                Some((job, (kind == "afterok") == *ok))
            }) else {
                return said;
            };
            let place = self.queue.join(format!("{job}.sh"));
            let script = fs::read_to_string(&place).expect("a script");
            let array = script.lines().find_map(|line| line.strip_prefix("#SBATCH --array="));
            let tasks: Vec<u32> = array.map_or(vec![0], |array| {
                let runs = array.split(',').map(|run| run.split_once('-').unwrap_or((run, run)));
                let number = |text: &str| text.parse::<u32>().expect("a number");
                runs.flat_map(|(first, last)| number(first)..=number(last)).collect()
            });
            let count = if job == 1 { tasks_of_the_first.min(tasks.len()) } else { tasks.len() };
            let mut ok = can_run && count == tasks.len();
            for task in tasks[..count].iter().filter(|_| can_run) {
                let mut shell = Command::new("sh");
                shell.arg(&place).env("PATH", &path).env("SLURM_JOB_ID", job.to_string());
                let output = shell.env("SLURM_ARRAY_TASK_ID", task.to_string()).output().expect("a shell");
                ok &= output.status.success();
                said += &stderr(&output);
            }
            ended.insert(job, ok);
            fs::remove_file(place).expect("a script");
        }
        said
    }
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn jobs_that_are_killed_between_any_two_steps_leave_the_rest_to_the_next_one() {
    let dir = scratch("sweep-chain");
    let study = small(&dir, false);
    let reference = dir.join("reference");
    fine(&["sweep", "run", text(&study), "-o", text(&reference), "--shard-points", "20", "--quiet"]);
    let expected = gathered(&reference);
    let chain = |name: &str| {
        let dir = dir.join(name.replace(' ', "-"));
        let out = dir.join("sweep");
        fine(&["sweep", "plan", text(&study), "-o", text(&out), "--shard-points", "20"]);
        (Farm::new(&dir), out)
    };
    // Jobs 1 to 3 are those of the user's command: array, follower, stand-in. Job 4 is the array of the second wave.
    for die in ["2 after", "4 before", "4 after", "5 after"] {
        let (farm, out) = chain(die);
        fs::write(farm.queue.join("die"), format!("{die}\n")).expect("a file");
        let of_user = die < "4";
        let output = farm.submit(&out);
        assert_eq!(output.status.success(), !of_user, "{die}: {}", stderr(&output));
        if of_user {
            assert_eq!(code(&farm.submit(&out)), 0, "the same command goes on");
        }
        let said = farm.run(usize::MAX);
        assert!(gathered(&out) == expected, "{die}: {said}");
        let status = json(&fine(&["sweep", "status", text(&out), "--json"]));
        assert_eq!(status["complete"], true, "{die}");
        // Nothing was submitted twice: three jobs a wave.
        let calls = fs::read_to_string(farm.queue.join("calls")).expect("a number");
        let waves = status["waves"].as_array().map_or(0, Vec::len);
        let before = usize::from(die.ends_with("before"));
        assert_eq!(calls.trim().parse(), Ok(3 * waves + before), "{die}");
        // Given once more, the command has nothing to do.
        assert!(stdout(&farm.submit(&out)).contains("none: the sweep is complete"));
    }
    // Of the first array a task does its shards and the others fail: the stand-in submits what is left.
    let (farm, out) = chain("failed tasks");
    assert_eq!(code(&farm.submit(&out)), 0);
    farm.run(1);
    assert!(gathered(&out) == expected);
    // An array that does nothing is not submitted again and again.
    let (farm, out) = chain("no task");
    assert_eq!(code(&farm.submit(&out)), 0);
    let said = farm.run(0);
    assert!(said.contains("has finished no shard"), "{said}");
    assert_eq!(fs::read_to_string(farm.queue.join("calls")).expect("a number"), "3\n");
}

#[test]
fn mutants_in_shares_are_the_mutants_of_one_machine() {
    let dir = scratch("sweep-mutants");
    // A check that answers by the text of the mutant instead of by solvers.
    let check = "[ \"$2\" = --formal ] || exit 1\nshift 2\n\
                 while [ $# -gt 0 ]; do case $1 in --hdl) folder=$2; shift;; \
                 --variant|-j|--tool-timeout) shift;; --json) ;;\n\
                 *) blocks=\"$blocks $1\";; esac; shift; done\n\
                 for block in $blocks; do\nverdict=proved\n\
                 [ -z \"$folder\" ] || case $(cksum <\"$folder/$block.vhd\") in\n\
                 [1-3]*) verdict=refuted;; [4-6]*) verdict=open;; esac\n\
                 rows=\"$rows${rows:+,}{\\\"block\\\":\\\"$block\\\",\\\"variant\\\":\\\"default\\\",\
                 \\\"verdict\\\":\\\"$verdict\\\"}\"\ndone\n\
                 echo \"{\\\"rows\\\":[$rows]}\"";
    let nothing = ["ghdl", "yosys", "z3", "yices-smt2"].map(|name| (name, "exit 0"));
    let scripts: Vec<_> = [("hpu", check)].into_iter().chain(nothing).collect();
    let place = tools(&dir, &scripts);
    let path = format!("{}:{}", place.display(), std::env::var("PATH").expect("a PATH"));
    let program = place.join("hpu");
    let mutants = |arguments: &[&str]| {
        let mut python = Command::new("python3");
        python.arg("testbench/mutants.py").args(arguments).current_dir(ROOT);
        python.env("PATH", &path).env("PYTHONDONTWRITEBYTECODE", "1").output().expect("Python starts")
    };
    let blocks = "unilateral,pwm,displacement,torque_sum,velocity_register";
    let own = ["--only", blocks, "--count", "15", "--jobs", "1", "--hpu", text(&program)];
    let whole = mutants(&own);
    assert_eq!(code(&whole), 0, "{}", stderr(&whole));
    let record = stdout(&whole);
    assert!(
        record.contains(" mutants of 5 files") && record.contains("refuted") && record.contains("killed"),
        "{record}"
    );
    let out = dir.join("shares");
    let share = |share: &str| mutants(&[&own[..], &["--shard", share, "-o", text(&out)]].concat());
    for part in ["1/3", "0/3"] {
        assert_eq!(code(&share(part)), 0);
    }
    let gather = || mutants(&["--gather", text(&out)]);
    assert!(
        code(&gather()) == 1 && stderr(&gather()).contains("mutants-2-of-3.jsonl: missing"),
        "{}",
        stderr(&gather())
    );
    assert_eq!(code(&share("2/3")), 0);
    assert_eq!((code(&gather()), stdout(&gather())), (0, record));
    // A finished share is left; a damaged one is refused by its name.
    assert!(stderr(&share("0/3")).contains("is done"));
    let file = out.join("mutants-1-of-3.jsonl");
    let kept = String::from_utf8(read(&file)).expect("text");
    fs::write(&file, kept.replacen("killed", "refuted", 1)).expect("a file");
    assert!(stderr(&gather()).contains("mutants-1-of-3.jsonl: damaged"), "{}", stderr(&gather()));
    assert_eq!(code(&mutants(&["--shard", "3/3", "-o", text(&out)])), 2);
}
