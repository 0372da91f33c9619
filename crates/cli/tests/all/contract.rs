//! The exit codes are those of `hpu run` in every verb: 1 where the scene's own design does not compile, 3 where a tool
//! is missing.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::common::{ROOT, code, hpu, scratch, stderr, stdout, text};

/// The answer of a verb to a scene that has a design of the user's own.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Does {
    /// It builds the design: 1 where that does not compile, 3 without its tools.
    Builds,
    /// It needs tools of its own, but no design: 3 without them.
    Tools,
    /// It refuses the scene, or its arguments, before any tool runs.
    Refuses,
    /// It needs no tool.
    Works,
}

/// Writes the scene of a design in Verilog, whole and with a line that does not compile.
fn scenes(dir: &Path) -> [PathBuf; 2] {
    let knee = fs::read_to_string(format!("{ROOT}/testbench/dut/knee.toml")).expect("a scene");
    let design = fs::read_to_string(format!("{ROOT}/testbench/dut/knee/DutyGen.v")).expect("a design");
    let broken = dir.join("Broken.v");
    fs::write(&broken, design.replace("endmodule", "assign = ;\nendmodule")).expect("a design");
    let places = |text: &str| text.replace("\"knee/", &format!("\"{ROOT}/testbench/dut/knee/"));
    let whole = places(&knee);
    let file = format!("\"{ROOT}/testbench/dut/knee/DutyGen.v\"");
    assert!(whole.contains(&file));
    [("whole.toml", whole.clone()), ("broken.toml", whole.replace(&file, &format!("{:?}", text(&broken))))].map(
        |(name, text)| {
            let place = dir.join(name);
            fs::write(&place, text).expect("a scene");
            place
        },
    )
}

/// Returns for each verb what it does, and its arguments for a scene; files go into `dir`.
fn verbs(scene: &str, dir: &Path) -> Vec<(Does, Vec<String>)> {
    let out = |name: &str| text(&dir.join(name)).to_string();
    let study = |name: &str, section: &str| {
        let place = dir.join(name);
        fs::write(&place, format!("name = \"own\"\ntitle = \"Own\"\n{section}\n")).expect("a study");
        text(&place).to_string()
    };
    let map = ["--x", "dut.ports.gain=95..600:2", "--y", "hand.stiffness=0.25..0.35 N.m/rad:2"];
    let mapped = study(
        "map-study.toml",
        &format!(
            "[map]\nscene = {scene:?}\nx = {:?}\ny = {:?}",
            "dut.ports.gain=95..600:2", "hand.stiffness=0.25..0.35 N.m/rad:2"
        ),
    );
    let limited =
        study("limits-study.toml", &format!("[limits]\nscene = {scene:?}\nrange = \"95..600\"\nwords = 2\nphases = 1"));
    let vhdl = study("broken.vhd", "is no VHDL");
    let log = out("log.csv");
    fs::write(&log, "time_ms,count\n0,0\n1,1\n2,2\n").expect("a log");
    let page = out("page.html");
    fs::write(&page, "<script type=\"application/json\" id=\"start\">{}</script>").expect("a page");
    let certificate = format!("{ROOT}/testbench/hybrid-wall.certificate");
    let words = |words: &[&str]| words.iter().map(ToString::to_string).collect::<Vec<_>>();
    let (report, explored, new) = (out("report.html"), out("explored.html"), out("new"));
    vec![
        (Does::Builds, words(&["run", scene])),
        (Does::Builds, words(&["run", scene, "-o", &out("run")])),
        (Does::Builds, [words(&["map", scene]), words(&map)].concat()),
        (Does::Builds, words(&["limits", scene, "--range", "95..600", "--words", "2", "--phases", "1"])),
        (Does::Builds, words(&["report", scene, "--out", &report])),
        (Does::Builds, words(&["diff", scene, scene])),
        (Does::Builds, words(&["identify", scene, &log, "--free", "hand.stiffness"])),
        (Does::Builds, words(&["cost", "--scene", scene])),
        (Does::Builds, words(&["study", &mapped])),
        (Does::Builds, words(&["study", &limited])),
        (Does::Builds, words(&["sweep", "plan", &mapped, "-o", &out("planned")])),
        (Does::Builds, words(&["sweep", "run", &mapped, "-o", &out("swept")])),
        (Does::Tools, words(&["check", "saturator", "--rows", "5"])),
        (Does::Tools, words(&["check", "--scene", "short-contact", "--edges", "100"])),
        (Does::Tools, words(&["check", "saturator", "--formal"])),
        (Does::Tools, words(&["check", "--entity", "saturator", "--as", "saturator", &vhdl])),
        (Does::Tools, words(&["run", "short-contact", "--driver", "rtl", "--edges", "100"])),
        (Does::Tools, words(&["cost", "torque_sum", "--variant", "8_bit"])),
        (Does::Tools, words(&["widths", "one-tick", "--no-trials", "--price"])),
        (Does::Tools, words(&["reproduce", "phantom-cost", "--blocks", "trig_table"])),
        (Does::Refuses, words(&["check", "--scene", scene])),
        (Does::Refuses, words(&["fit", scene])),
        (Does::Builds, words(&["chart", scene, "--set", "run.duration=1 ms"])),
        (Does::Builds, words(&["widths", scene])),
        (Does::Refuses, words(&["vectors", "--set-kind", "scene", "--scene", scene])),
        (Does::Works, words(&["scenes", "show", scene])),
        (Does::Works, words(&["explore", scene, "--page", &page, "--out", &explored])),
        (Does::Works, words(&["new", &new])),
        (Does::Works, words(&["certify", &certificate])),
        (Does::Works, words(&["export", "fmu", "hybrid-wall", "--library", "Cargo.toml", "-o", &out("x.fmu")])),
        (Does::Works, words(&["scenes"])),
        (Does::Works, words(&["keys"])),
        (Does::Works, words(&["block"])),
        (Does::Works, words(&["completions", "bash"])),
        (Does::Works, words(&["man"])),
    ]
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn every_verb_ends_as_run_does_with_a_design_that_does_not_compile_and_without_its_tools() {
    let dir = scratch("contract");
    let (empty, caches) = (dir.join("no-tools"), dir.join("cache"));
    fs::create_dir_all(&empty).expect("a folder");
    let [whole, broken] = scenes(&dir);
    let mut seen = BTreeSet::new();
    for (index, (does, words)) in verbs(text(&broken), &dir).into_iter().enumerate() {
        seen.insert(words[0].clone());
        if does == Does::Tools || does == Does::Works {
            continue;
        }
        // Of a model in the cache no tool is asked.
        let cache = caches.join(format!("broken-{index}"));
        let output = hpu().args(&words).env("XDG_CACHE_HOME", cache).output().expect("starts");
        let expected: &[i32] = if does == Does::Builds { &[1] } else { &[2, 4] };
        let said = stderr(&output);
        assert!(expected.contains(&code(&output)), "{words:?}: {} {said}", code(&output));
        assert!(does == Does::Refuses || said.contains("refuses `KneeCtl`"), "{words:?}: {said}");
        assert_eq!(stdout(&output), "", "{words:?}");
    }
    fs::remove_dir_all(&dir).expect("the files of these runs");
    fs::create_dir_all(&empty).expect("a folder");
    scenes(&dir);
    for (index, (does, words)) in verbs(text(&whole), &dir).into_iter().enumerate() {
        let cache = caches.join(format!("none-{index}"));
        let output = hpu().args(&words).env("XDG_CACHE_HOME", cache).env("PATH", &empty).output().expect("starts");
        let expected: &[i32] = match does {
            Does::Builds | Does::Tools => &[3],
            Does::Refuses => &[2, 4],
            Does::Works => &[0],
        };
        let said = stderr(&output);
        assert!(expected.contains(&code(&output)), "{words:?}: {} {said}", code(&output));
        assert!(expected != [3] || said.contains("is not installed"), "{words:?}: {said}");
    }
    let all = hpu_cli::description();
    let all: BTreeSet<_> = all.get_subcommands().map(|verb| verb.get_name().to_string()).collect();
    assert_eq!(seen, all, "the verbs of this test are those of the command");
}

#[test]
fn a_map_over_designs_of_which_each_refuses_its_generics_is_a_failure_and_one_that_runs_somewhere_is_a_result() {
    let dir = scratch("contract-map");
    let [whole, _] = scenes(&dir);
    let map = |y: &str| {
        let words = ["map", text(&whole), "--x", "dut.ports.gain=95..600:2", "--y", y, "--set", "run.duration=1 ms"];
        hpu().args(words).env("XDG_CACHE_HOME", dir.join("cache")).output().expect("starts")
    };
    let output = map("dut.parameters.NONE=1..2:2");
    assert_eq!(code(&output), 1, "{}", stderr(&output));
    assert!(stderr(&output).contains("neither the corners nor the middle of the map can run"), "{}", stderr(&output));
    let output = map("hand.stiffness=0.25..0.35 N.m/rad:2");
    assert_eq!(code(&output), 0, "{}", stderr(&output));
}

#[test]
fn chart_and_fit_refuse_a_scene_with_nothing_to_compare_with_one_code() {
    let axes = ["--x", "wall.stiffness=1..2:2", "--y", "wall.damping=0..0.1:2"];
    for (scene, why) in [
        ("testbench/dut/knee.toml", "the scene has a design of yours"),
        ("replay-capture", "a recording has no device whose motion could be compared"),
    ] {
        for (verb, more) in [("chart", &[][..]), ("chart", &axes), ("fit", &[])] {
            // The simulators of a design have the same words in each cell of a map.
            if verb == "chart" && more.is_empty() && scene.contains("knee") {
                continue;
            }
            let output = hpu().args([verb, scene]).args(more).output().expect("starts");
            let said = stderr(&output);
            assert_eq!(code(&output), 4, "{verb} {scene} {more:?}: {said}");
            assert!(said.contains(why), "{verb} {scene} {more:?}: {said}");
        }
    }
    let output = hpu().args(["chart", "one-tick", "--contestants", "nobody"]).output().expect("starts");
    assert_eq!(code(&output), 2, "{}", stderr(&output));
}
