//! `hpu cost` and its cache: prices of scenes by tools with known answers, and errors without the tools.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Output;

use crate::common::{assert_refused, code, hpu, json, names, run, scratch, stdout, text};

/// Makes a folder of tools: the real GHDL, a Yosys that finds 5 lookup tables in everything, and a nextpnr that packs
/// 10 cells and runs `placing` for a placement, a piece of shell that finds the seed in `$seed`.
fn tools(dir: &Path, placing: &str) -> PathBuf {
    let place = dir.join("tools");
    fs::create_dir_all(&place).expect("a folder");
    let path = std::env::var("PATH").expect("a PATH");
    let scripts = [
        ("ghdl", format!("PATH='{path}' exec ghdl \"$@\"")),
        ("yosys", "[ \"$1\" = -V ] && echo 'Yosys 9.9' && exit; echo '  SB_LUT4   5' > ice40.txt".to_string()),
        (
            "nextpnr-ice40",
            format!(
                "case \"$*\" in --version) echo 'nextpnr (Version 9.9)'; exit;; \
                 *--pack-only*) echo 'ICESTORM_LC: 10/ 7680 0%'; exit;; esac\n\
                 while [ \"$1\" != --seed ]; do shift; done\nseed=$2\n{placing}"
            ),
        ),
    ];
    for (name, script) in scripts {
        let tool = place.join(name);
        fs::write(&tool, format!("#!/bin/sh\n{script}\n")).expect("a script");
        fs::set_permissions(&tool, fs::Permissions::from_mode(0o755)).expect("it may run");
    }
    place
}

/// Runs `hpu cost` with these tools and a cache beside them.
fn cost(dir: &Path, tools: &Path, arguments: &[&str]) -> Output {
    let cache = dir.join("cache");
    let found = hpu().arg("cost").args(arguments).args(["--cache", text(&cache)]).env("PATH", tools).output();
    found.expect("the command starts")
}

/// Seeds 1, 2 and 3 give 20, 25 and 10 MHz.
const BY_SEED: &str =
    "case $seed in 1) f=20;; 2) f=25;; 3) f=10;; esac; echo \"Max frequency for clock 'clk': $f.00 MHz\"";

#[test]
fn a_scene_is_priced_with_the_clocks_that_its_torque_takes() {
    let dir = scratch("price_scene");
    let tools = tools(&dir, BY_SEED);
    let output = cost(&dir, &tools, &["--scene", "hybrid-wall", "--json"]);
    assert_eq!(code(&output), 0, "{}", crate::common::stderr(&output));
    let found = json(&output);
    assert_eq!(found["placed_mhz"], serde_json::json!([20.0, 25.0, 10.0]));
    // The median counts: 50 ns are 2.5 clocks of 50 MHz, so 3, and every path has one of them.
    assert_eq!((&found["fmax_mhz"], &found["path_ns"]), (&20.0.into(), &50.0.into()));
    assert_eq!(found["clocks"], serde_json::json!({ "needed": 3, "given": 1 }));
    assert_eq!((&found["settling"]["from"]["settling"], &found["settling"]["to"]["settling"]), (&0.into(), &2.into()));
    let (parts, knobs) = (found["parts"].as_array().expect("parts"), found["knobs"].as_array().expect("knobs"));
    assert_eq!((parts.len(), knobs.len()), (11, 5));
    assert_eq!(knobs[0]["key"], "method.position_bits");
    assert_eq!((&knobs[0]["less"]["value"], &knobs[0]["more"]["value"]), (&"11".into(), &"13".into()));
    assert_eq!((&knobs[1]["less"]["value"], &knobs[1]["more"]["value"]), (&"(0,11,0)".into(), &"(0,12,1)".into()));
    // With enough time the page has nothing to write. The results come from the cache, although the tools would now
    // give others.
    fs::write(tools.join("yosys"), "#!/bin/sh\n[ \"$1\" = -V ] && echo 'Yosys 9.9'\n").expect("a script");
    let output = cost(&dir, &tools, &["--scene", "hybrid-wall"]);
    let page = stdout(&output);
    assert!(page.contains("3 clocks, and the loop gives it 1; write method.settling = 2"), "{page}");
    for line in page.lines() {
        assert!(line.chars().count() <= 120, "{} columns: {line}", line.chars().count());
    }
    // With another version of a tool, no result of this version is used.
    fs::write(tools.join("yosys"), "#!/bin/sh\n[ \"$1\" = -V ] && echo 'Yosys 9.10' || exit 1\n").expect("a script");
    assert_refused(&cost(&dir, &tools, &["--scene", "hybrid-wall"]), 4, &["yosys ended with code 1", "hybrid_loop"]);
}

#[test]
fn a_nextpnr_that_finds_no_place_is_told_and_not_taken_for_a_clock() {
    let dir = scratch("price_no_place");
    let tools = tools(&dir, "echo 'ERROR: Unable to find legal placement for cell x' >&2; exit 1");
    let output = cost(&dir, &tools, &["torque_sum", "--variant", "8_bit", "--json"]);
    assert_eq!(code(&output), 0, "{}", crate::common::stderr(&output));
    let found = &json(&output)["variants"][0];
    assert_eq!((&found["lut4"], &found["path_ns"]), (&5.into(), &serde_json::Value::Null));
    assert_eq!(found["placed_mhz"], serde_json::json!([null, null, null]));
}

#[test]
fn a_tool_that_fails_leaves_a_row_with_its_words_and_nothing_in_the_cache() {
    let dir = scratch("price_failure");
    let tools = tools(&dir, "echo 'ERROR: an internal one' >&2; exit 1");
    let output = cost(&dir, &tools, &["torque_sum", "--variant", "8_bit"]);
    assert_eq!(code(&output), 4);
    assert!(stdout(&output).contains("nextpnr-ice40 failed on torque_sum:\n  ERROR: an internal one"));
    assert_eq!(names(&dir.join("cache")), Vec::<String>::new());
}

#[test]
fn without_the_tools_the_packages_are_named() {
    let dir = scratch("price_no_tools");
    let empty = dir.join("empty");
    fs::create_dir_all(&empty).expect("a folder");
    let packages = &["ghdl-mcode yosys nextpnr-ice40"];
    assert_refused(&cost(&dir, &empty, &["pwm"]), 3, packages);
    assert_refused(&cost(&dir, &empty, &["--scene", "hybrid-wall"]), 3, packages);
}

#[test]
fn what_cannot_be_priced_is_refused_with_what_can() {
    let dir = scratch("price_usage");
    let tools = tools(&dir, BY_SEED);
    let file = dir.join("file");
    fs::write(&file, "").expect("a file");
    assert_eq!(code(&run(&["cost"])), 2);
    assert_eq!(code(&run(&["cost", "pwm", "--scene", "hybrid-wall"])), 2);
    assert_refused(&run(&["cost", "pwm", "--set", "wall.stiffness=1"]), 2, &["--scene SCENE", "--variant LABEL"]);
    let output = hpu().args(["cost", "pwm", "--cache", text(&file)]).env("PATH", &tools).output().expect("starts");
    assert_refused(&output, 2, &[text(&file), "write --cache DIR"]);
    let law = ["--scene", "hybrid-wall", "--set", "model.datapath=law", "--set", "model.bridge=averaged"];
    assert_refused(&cost(&dir, &tools, &law), 4, &["a law in floats has no price"]);
    let wide = ["--scene", "hybrid-wall", "--set", "method.position_bits=99"];
    assert_refused(&cost(&dir, &tools, &wide), 4, &["method.position_bits", "a whole number from 2 to 32"]);
}

/// Runs `hpu widths --price` on a scene with these tools and a cache beside them.
fn widths(dir: &Path, tools: &Path, scene: &str) -> Output {
    let cache = dir.join("cache");
    let arguments = ["widths", scene, "--no-trials", "--price", "--cache", text(&cache)];
    hpu().args(arguments).env("PATH", tools).output().expect("the command starts")
}

#[test]
fn a_page_is_priced_once_and_then_from_the_cache() {
    let dir = scratch("price_page");
    let tools = tools(&dir, BY_SEED);
    let cold = widths(&dir, &tools, "hybrid-wall");
    let page = stdout(&cold);
    // 20 MHz are 50 ns: three clocks at 50 MHz.
    for words in ["3 clocks, and the loop gives it 1; write method.settling = 2", "held back by 2 clocks instead of 0"]
    {
        assert!(page.contains(words), "{page}");
    }
    assert!(page.contains("method.position_bits") && page.contains("13: +0 LUT4, +0 ff"), "{page}");
    assert!(page.lines().count() <= 60 && page.lines().all(|line| line.chars().count() <= 120), "{page}");
    let entries = names(&dir.join("cache"));
    assert!(entries.len() > 10, "{entries:?}");
    assert!(entries.iter().all(|name| name.ends_with(".cost") || name.ends_with(".counts")), "{entries:?}");
    // From here on the tools give no results.
    fs::write(tools.join("yosys"), "#!/bin/sh\n[ \"$1\" = -V ] && echo 'Yosys 9.9' && exit\nexit 1\n")
        .expect("a script");
    let warm = widths(&dir, &tools, "hybrid-wall");
    assert_eq!((code(&warm), stdout(&warm)), (0, page));
    assert_eq!(names(&dir.join("cache")), entries);
    // The cache has no other widths, and a failure leaves no entry.
    assert_refused(&widths(&dir, &tools, "slow-pwm"), 4, &["yosys ended with code 1", "hybrid_loop"]);
    assert_eq!(names(&dir.join("cache")), entries);
}

#[test]
fn a_page_without_the_tools_names_the_packages_and_leaves_no_cache() {
    let dir = scratch("price_page_no_tools");
    let none = dir.join("none");
    fs::create_dir_all(&none).expect("a folder");
    let packages = ["is not installed", "apt install", "yosys", "nextpnr-ice40"];
    assert_refused(&widths(&dir, &none, "hybrid-wall"), 3, &packages);
    assert!(!dir.join("cache").exists());
}
