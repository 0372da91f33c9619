//! `hpu vectors --format` and `hpu block --notation`: output for other tools.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::{assert_refused, code, json, names, run, scratch, stderr, stdout, text};

/// Returns the vectors that are written to stdout.
fn vectors(arguments: &[&str]) -> String {
    let output = run(&[&["vectors"], arguments].concat());
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    stdout(&output)
}

/// Runs a script in the shell, and returns its output.
fn shell(script: &str, file: &Path) -> String {
    let output = Command::new("sh").args(["-c", script, "sh"]).arg(file).output().expect("a shell");
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn json_names_block_formats_units_generics_and_seed_and_sha256sum_agrees() {
    let file = scratch("json").join("pwm.json");
    let arguments = ["pwm", "--set-kind", "random", "--seed", "7", "--count", "50", "--format", "json"];
    fs::write(&file, vectors(&arguments)).expect("a file");
    let value: serde_json::Value = serde_json::from_str(&fs::read_to_string(&file).expect("text")).expect("JSON");
    assert_eq!(
        (&value["block"], &value["variant"], &value["set"]),
        (&"pwm".into(), &"default".into(), &"random".into())
    );
    assert_eq!((&value["seed"], &value["clocked"]), (&7.into(), &true.into()));
    assert_eq!(
        value["columns"][0],
        serde_json::json!({"name": "rst", "direction": "in", "format": [0, 1, 0], "unit": "1"})
    );
    assert_eq!(value["rows"].as_array().map(Vec::len), Some(50));
    assert!(value["generics"].as_object().is_some_and(|generics| !generics.is_empty()));
    let told = value["sha256"].as_str().expect("a digest");
    assert_eq!(shell("grep -v '\"sha256\"' \"$1\" | sha256sum", &file), format!("{told}  -\n"));
    let output = run(&["vectors", "--verify", text(&file)]);
    assert_eq!((code(&output), stdout(&output).ends_with("50 rows agree\n")), (0, true), "{}", stderr(&output));
}

#[test]
fn json_that_was_edited_is_refused_and_wrong_words_with_a_right_digest_are_shown() {
    let file = scratch("edited").join("counter.json");
    let good = vectors(&["position_counter", "--format", "json", "--count", "6"]);
    let row = good.lines().rfind(|line| line.starts_with('[')).expect("a row");
    let wrong = row.replace("]", "1]");
    fs::write(&file, good.replace(row, &wrong)).expect("a file");
    let refused = run(&["vectors", "--verify", text(&file)]);
    assert_refused(&refused, 4, &["counter.json", "changed since it was written", "sha256"]);
    // The file with the right digest of its changed lines.
    let told = json_key(&good, "sha256");
    let found = shell("grep -v '\"sha256\"' \"$1\" | sha256sum | cut -c -64", &file);
    fs::write(&file, good.replace(row, &wrong).replace(&told, found.trim())).expect("a file");
    let output = run(&["vectors", "--verify", text(&file)]);
    assert_eq!(code(&output), 1, "{}", stderr(&output));
    let line = good.lines().take_while(|line| *line != row).count() + 1;
    let told = format!("counter.json:{line}: position is ");
    assert!(stdout(&output).contains(&told), "{}", stdout(&output));
}

fn json_key(text: &str, key: &str) -> String {
    let value: serde_json::Value = serde_json::from_str(text).expect("JSON");
    value[key].as_str().expect("a string").to_string()
}

#[test]
fn json_of_a_scene_says_which_and_what_was_changed() {
    let said = vectors(&[
        "--set-kind",
        "scene",
        "--scene",
        "wrap-product",
        "--set",
        "run.seed=5",
        "--count",
        "3",
        "--format",
        "json",
    ]);
    let value: serde_json::Value = serde_json::from_str(&said).expect("JSON");
    assert_eq!((&value["set"], &value["scene"], &value["seed"]), (&"scene".into(), &"wrap-product".into(), &5.into()));
    assert_eq!(value["settings"], serde_json::json!(["run.seed=5"]));
    assert_eq!((&value["block"], &value["variant"]), (&"hybrid_loop".into(), &serde_json::Value::Null));
}

#[test]
fn tables_go_into_a_folder_a_file_each_and_verify() {
    let dir = scratch("tables");
    let out = dir.join("out");
    for (form, extension) in [("mif-intel", "mif"), ("txt", "txt"), ("json", "json")] {
        let arguments = ["vectors", "trig_interpolated", "--set-kind", "table", "--variant", "default"];
        let output = run(&[&arguments[..], &["--format", form, "-o", text(&out)]].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        let files = names(&out.join("trig_interpolated"));
        for name in ["default-points", "default-rises"] {
            assert!(files.contains(&format!("{name}.{extension}")), "{files:?}");
        }
    }
    let place = |name: &str| out.join("trig_interpolated").join(name);
    let mif = fs::read_to_string(place("default-points.mif")).expect("a table");
    assert!(mif.contains("DEPTH = 512;\nWIDTH = 23;\n") && mif.contains("\n0 : 000000;\n"), "{mif}");
    for name in ["default-points.txt", "default-rises.json"] {
        let output = run(&["vectors", "--verify", text(&place(name))]);
        assert_eq!((code(&output), stdout(&output).ends_with("512 rows agree\n")), (0, true), "{}", stderr(&output));
    }
    let whole = fs::read_to_string(place("default-points.txt")).expect("a table");
    // The file without its last word.
    let last = whole.lines().rev().nth(1).expect("a row");
    let cut = whole.replace(&format!("{last}\n"), "").replace("512 rows", "511 rows");
    fs::write(dir.join("cut.txt"), cut).expect("a cut table");
    let output = run(&["vectors", "--verify", text(&dir.join("cut.txt"))]);
    assert_eq!(code(&output), 1, "{}{}", stdout(&output), stderr(&output));
    assert!(stdout(&output).contains("511 rows in the file, 512 in the table"), "{}", stdout(&output));
    let coe = vectors(&["trig_table", "--set-kind", "table", "--table", "sines", "--format", "coe"]);
    assert!(
        coe.contains("\nmemory_initialization_radix=16;\nmemory_initialization_vector=\n00000000,\n"),
        "{coe:.200}"
    );
}

#[test]
fn exports_without_a_meaning_are_refused() {
    let refused = |arguments: &[&str], words: &[&str]| {
        assert_refused(&run(&[&["vectors"], arguments].concat()), 2, words);
    };
    let tables = ["no such lookup table", "trig_table sines", "trig_quarter sines", "trig_interpolated points"];
    refused(&["position_counter", "--set-kind", "table"], &tables);
    refused(&["trig_table", "--set-kind", "table", "--table", "points"], &tables);
    refused(
        &["trig_table", "--set-kind", "table"],
        &["2 sets", "trig_table/default-sines", "trig_table/default-cosines"],
    );
    refused(&["trig_table", "--table", "sines"], &["--table", "--set-kind table"]);
    refused(&["--set-kind", "scene", "--scene", "wrap-product", "--table", "sines"], &["--table", "--set-kind table"]);
    refused(&["trig_quarter", "--set-kind", "table", "--count", "9"], &["written whole", "--count"]);
    refused(&["pwm", "--count", "0", "--format", "coe"], &["pwm/default-directed has no rows"]);
    let wide = ["position_counter", "--variant", "32_bit", "--format", "vunit"];
    refused(&wide, &["position_counter/32_bit-directed", "position(0,32,0) has 32 bits", "unsigned ones of up to 31"]);
    // The files that fit are removed, too, when another is refused.
    let out = scratch("exports-refused").join("out");
    let output = run(&["vectors", "position_counter", "--format", "vunit", "-o", text(&out)]);
    assert_eq!((code(&output), out.exists()), (2, false));
}

#[test]
fn formats_come_in_every_notation() {
    let table = |notation: &str| stdout(&run(&["block", "trig_table", "--notation", notation]));
    assert!(table("triple").contains("sine         (1,9,22) "), "{}", table("triple"));
    assert!(table("vhdl").contains("sine         sfixed(9 downto -22) "), "{}", table("vhdl"));
    assert!(table("cpp").contains("valid        ap_ufixed<1,1> "), "{}", table("cpp"));
    assert!(table("q").contains("sine         Q9.22 (32 bits, TI) = Q10.22 (32 bits, ARM) "), "{}", table("q"));
    assert!(table("sfixed") == table("vhdl") && table("ap_fixed") == table("cpp"));
    assert_refused(&run(&["block", "--notation", "q"]), 2, &["name a block beside --notation"]);
    let ran = stdout(&run(&["run", "phantom-thrown", "--edges", "1000", "--notation", "vhdl"]));
    assert!(ran.contains("words      stiffness 20000 of ufixed(15 downto -2) is 5 kN/m"), "{ran}");
    assert!(ran.contains("net        cosine3      sfixed(9 downto -22) "), "{ran}");
    let sines = stdout(&run(&["reproduce", "phantom-sines", "--notation", "cpp"]));
    assert!(sines.contains(" ap_fixed<32,10> "), "{sines}");
    let ports = json(&run(&["block", "trig_table", "--json"]))["ports"].clone();
    let expected = serde_json::json!({
        "vhdl": "sfixed(15 downto 0)",
        "cpp": "ap_fixed<16,16>",
        "q": "Q15.0 (16 bits, TI) = Q16.0 (16 bits, ARM)",
    });
    assert_eq!(ports[0]["notations"], expected);
}
