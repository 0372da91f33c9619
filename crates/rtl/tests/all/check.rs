//! Every block's VHDL against the emulator in GHDL. Without `ghdl` (Debian: ghdl-mcode) these tests fail and say so.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use hpu_rtl::{Check, CheckOptions, Fault, check, junit};

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// `hpu check` itself, which the test command runs, holds them all.
#[test]
fn a_check_is_of_every_configuration_of_every_block() {
    let options = CheckOptions::new(project().join("hdl"));
    let check = Check::new(&options).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(check.count(), (hpu_datapath::variants().len(), 0));
}

#[test]
fn the_multiplier_is_checked_on_products_from_all_strata() {
    let (blocks, variants) = (vec!["truncating_multiplier".to_string()], vec!["default".to_string()]);
    let options = CheckOptions { blocks, variants, ..CheckOptions::new(project().join("hdl")) };
    let report = check(&options).unwrap_or_else(|error| panic!("{error}"));
    assert!(report.ok(), "{report}");
    assert_eq!(report.rows.len(), 1);
    assert!(report.rows[0].vectors >= 1 << 16, "{report}");
}

/// A copy of the project's VHDL in which one file has one phrase exchanged.
fn broken(test: &str, file: &str, phrase: &str, by: &str) -> PathBuf {
    let copy = std::env::temp_dir().join(format!("hpu-test-{}-{test}", std::process::id()));
    fs::create_dir_all(&copy).expect("a temporary directory");
    for entry in fs::read_dir(project().join("hdl")).expect("the VHDL") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|extension| extension == "vhd") {
            fs::copy(&path, copy.join(path.file_name().expect("a file"))).expect("a copy");
        }
    }
    let text = fs::read_to_string(copy.join(file)).expect("the block");
    assert!(text.contains(phrase), "{file} no longer says `{phrase}`");
    fs::write(copy.join(file), text.replace(phrase, by)).expect("a patched block");
    copy
}

#[test]
fn a_displacement_that_adds_is_caught_with_row_signal_expected_and_got() {
    let hdl = broken(
        "adds",
        "displacement.vhd",
        "unsigned(position) - unsigned(reference)",
        "unsigned(position) + unsigned(reference)",
    );
    let options = CheckOptions { blocks: vec!["displacement".to_string()], ..CheckOptions::new(&hdl) };
    let report = check(&options).unwrap_or_else(|error| panic!("{error}"));
    fs::remove_dir_all(hdl).expect("removed");
    assert!(!report.ok());
    let row = report.rows.iter().find(|row| row.variant == "default").expect("the default configuration");
    let first = row.first.as_ref().expect("a first mismatch");
    // Corners of (position, reference) in order: (0, 0) agrees either way; (0, 1) is -1 and not 1.
    assert_eq!((first.row, first.signal.as_str()), (2, "delta"));
    assert_eq!(first.expected, "111111111111 (-1)");
    assert_eq!(first.got, "000000000001 (1)");
    assert_eq!(first.history, ["row=1 000 000 000 got 000", "row=2 000 001 fff got 001"]);
}

#[test]
fn a_counter_that_ignores_its_reset_is_caught_with_at_most_sixteen_edges_before() {
    let hdl = broken("reset", "position_counter.vhd", "rst = '1'", "rst = 'X'");
    let options = CheckOptions { blocks: vec!["position_counter".to_string()], ..CheckOptions::new(&hdl) };
    let report = check(&options).unwrap_or_else(|error| panic!("{error}"));
    fs::remove_dir_all(hdl).expect("removed");
    let first = report.rows[0].first.as_ref().expect("a first mismatch");
    assert_eq!(first.signal, "position");
    let last = format!("row={} ", first.row);
    assert!(first.history.last().expect("the row itself").starts_with(&last), "{first}");
    assert!(first.history.len() <= 16);
    let xml = junit(&report);
    assert!(xml.contains("<failure message=\"first at "), "{xml}");
}

#[test]
fn vhdl_that_does_not_analyse_is_told_in_ghdls_own_words() {
    let hdl = broken("syntax", "saturator.vhd", "end architecture", "end architect");
    let error = check(&CheckOptions::new(&hdl)).expect_err("a syntax error").to_string();
    fs::remove_dir_all(hdl).expect("removed");
    assert!(error.contains("saturator.vhd:"), "{error}");
}

#[test]
fn without_ghdl_the_check_names_the_package_to_install() {
    const CHILD: &str = "HPU_TEST_WITHOUT_GHDL";
    if std::env::var_os(CHILD).is_some() {
        let error = check(&CheckOptions::new(project().join("hdl"))).expect_err("no ghdl");
        assert!(matches!(error.tool().expect("a tool's fault").fault, Fault::Missing), "{error}");
        assert!(error.to_string().contains("ghdl-mcode"), "{error}");
        return;
    }
    // The same test in a process that finds no program at all.
    let name = "without_ghdl_the_check_names_the_package_to_install";
    let mut child = Command::new(std::env::current_exe().expect("this test"));
    let child = child.args(["--exact", name]).env("PATH", "").env(CHILD, "1").output().expect("a child");
    assert!(child.status.success(), "{}", String::from_utf8_lossy(&child.stdout));
}
