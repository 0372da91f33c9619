//! Every block's VHDL against the emulator in GHDL. Without `ghdl` (Debian: ghdl-mcode) these tests fail and say so.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use hpu_rtl::wave::{mismatch_gtkw, mismatch_vcd};
use hpu_rtl::{Check, CheckOptions, Fault, check, junit};

use crate::read_back;

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
    let (columns, rows) = first.around.table(first.row);
    assert_eq!(columns, ["row", "position", "reference", "delta", "delta(vhdl)"]);
    assert_eq!(rows, [["1", "000", "000", "000", "000"], ["2", "000", "001", "fff", "001"]]);
    let told = "  first at 2: delta expected 111111111111 (-1), got 000000000001 (1)
    row  reference  delta  delta(vhdl)
    1    000        000    000
    2    001        fff    001
    unchanged: position=000
";
    assert_eq!(first.to_string(), told);
    // The rows after it are for the waveform, read by somebody else's parser: a row takes 10 ns.
    assert_eq!(first.around.rows.len(), 2 + 64);
    let changes = read_back::changes(mismatch_vcd(&first.around).into_bytes());
    let at = |name: &str, time_ns: u64| {
        let before = changes[name].iter().take_while(|(time_ps, _)| *time_ps <= 1000 * time_ns);
        before.last().map(|(_, bits)| bits.as_str())
    };
    assert_eq!(at("displacement.row", 20), Some(&*format!("{:032b}", 2)));
    assert_eq!(at("displacement.reference", 20), Some("000000000001"));
    assert_eq!(at("displacement.emulator.delta", 20), Some("111111111111"));
    assert_eq!(at("displacement.vhdl.delta", 20), Some("000000000001"));
    assert_eq!(["displacement.differs"; 2].map(|name| at(name, 20)), [Some("1"); 2]);
    assert_eq!((at("displacement.differs", 10), at("displacement.differs", 19)), (Some("0"), Some("0")));
    assert!(!changes.contains_key("displacement.clk") && at("displacement.row", 660).is_some());
    // The save file has a marker at row 2 and names what the waveform has.
    let save = mismatch_gtkw(&first.around, first.row, "x.vcd");
    assert!(
        save.contains("[dumpfile] \"/x.vcd\"")
            && save.lines().any(|line| line.starts_with('*') && line.ends_with(" 20")),
        "{save}"
    );
    assert!(save.contains("+{delta (emulator)} displacement.emulator.delta[11:0]\n"), "{save}");
    assert!(save.contains("+{delta (vhdl)} displacement.vhdl.delta[11:0]\n"), "{save}");
}

#[test]
fn a_counter_that_ignores_its_reset_is_caught_with_at_most_sixteen_edges_before() {
    let hdl = broken("reset", "position_counter.vhd", "rst = '1'", "rst = 'X'");
    let options = CheckOptions { blocks: vec!["position_counter".to_string()], ..CheckOptions::new(&hdl) };
    let report = check(&options).unwrap_or_else(|error| panic!("{error}"));
    fs::remove_dir_all(hdl).expect("removed");
    let first = report.rows[0].first.as_ref().expect("a first mismatch");
    assert_eq!(first.signal, "position");
    let (columns, rows) = first.around.table(first.row);
    assert_eq!(columns[..4], ["row", "rst", "step", "position"], "{first}");
    assert_eq!(rows.last().expect("the row itself")[0], first.row.to_string(), "{first}");
    assert!(rows.len() <= 16);
    // The counter without its reset has unknown bits, and the waveform says so.
    let changes = read_back::changes(mismatch_vcd(&first.around).into_bytes());
    assert_eq!(changes["position_counter.vhdl.position"][0].1, "xxxxxxxxxxxx");
    assert_eq!(changes["position_counter.emulator.position"][0].1, "000000000000");
    assert_eq!(changes["position_counter.clk"][..2], [(5_000, "0".into()), (10_000, "1".into())]);
    let xml = junit(&report);
    assert!(xml.contains("<failure message=\"first at "), "{xml}");
}

#[test]
fn a_check_of_a_block_needs_that_block_s_files_alone() {
    let folder = std::env::temp_dir().join(format!("hpu-test-{}-alone", std::process::id()));
    fs::create_dir_all(&folder).expect("a temporary directory");
    let copy = |name: &str| fs::copy(project().join("hdl").join(name), folder.join(name)).expect("a copy");
    copy("displacement.vhd");
    copy("axis_front.vhd");
    let checked = |block: &str| check(&CheckOptions { blocks: vec![block.to_string()], ..CheckOptions::new(&folder) });
    let report = checked("displacement");
    let refused = checked("axis_front").expect_err("its parts are missing").to_string();
    fs::remove_dir_all(&folder).expect("removed");
    assert!(report.as_ref().is_ok_and(hpu_rtl::CheckReport::ok), "{report:?}");
    assert!(
        refused.contains("synchronizer.vhd: No such file") && refused.contains("axis_front.vhd instantiates it"),
        "{refused}"
    );
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
