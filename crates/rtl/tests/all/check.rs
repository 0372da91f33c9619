//! GHDL compares every block's VHDL with the emulator. Without `ghdl` (Debian: ghdl-mcode) these tests fail and name
//! the package.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use hpu_cosim::scene::{Experiment, shipped};
use hpu_cosim::{Control, Driver, SceneFile, Simulation, Wired, WiredSimulation};
use hpu_rtl::{Check, CheckOptions, Contact, Fault, LoopScene, check, junit};
use hpu_signal::{Cycle, Observe};
use hpu_wave::{mismatch_gtkw, mismatch_vcd};

use crate::read_back;

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The test command also runs `hpu check`, which compares all of these configurations.
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

/// Copies the project's VHDL, and replaces one phrase in one file.
fn broken(test: &str, file: &str, phrase: &str, by: &str) -> PathBuf {
    let copy = std::env::temp_dir().join(format!("hpu-test-{}-{test}", std::process::id()));
    fs::create_dir_all(&copy).expect("a temporary directory");
    let folders = ["hdl", "hdl/generated"].map(|folder| fs::read_dir(project().join(folder)).expect("the VHDL"));
    for entry in folders.into_iter().flatten() {
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
    // The corners of (position, reference) in order: (0, 0) is equal either way; (0, 1) gives -1, not 1.
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
    // The rows after the mismatch are in the waveform, which another project's parser reads: a row takes 10 ns.
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
    // The save file has a marker at row 2, and names the variables of the waveform.
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
    // The counter without its reset has unknown bits, and the waveform shows them.
    let changes = read_back::changes(mismatch_vcd(&first.around).into_bytes());
    assert_eq!(changes["position_counter.vhdl.position"][0].1, "xxxxxxxxxxxx");
    assert_eq!(changes["position_counter.emulator.position"][0].1, "000000000000");
    assert_eq!(changes["position_counter.clk"][..2], [(5_000, "0".into()), (10_000, "1".into())]);
    let xml = junit(&report);
    assert!(xml.contains("<failure message=\"first at "), "{xml}");
}

/// Returns a whole shipped scene; a comparison takes its `edges` edges from it.
fn loop_scene(name: &str, edges: u64) -> (LoopScene, Experiment) {
    let shipped = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
    let (name, text) = (format!("{name}.toml"), shipped.text.to_string());
    let data = project().join("testbench/scenes");
    let source = SceneFile { name, text, data, is_shipped: false };
    (LoopScene { source, overrides: Vec::new(), edges }, shipped.parse(&[]).expect("a scene"))
}

/// Observes the first edge at which one of some nets is not 0. Words to which nets settle before the first edge are not
/// contact.
struct First {
    nets: Vec<usize>,
    at: Option<u64>,
}

impl Observe for First {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        if self.at.is_none() && cycle.0 > 0 && self.nets.iter().any(|&net| words[net] != 0) {
            self.at = Some(cycle.0);
        }
    }
    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

impl First {
    /// Runs the scene with the driver that ticks every edge.
    fn of(names: &[&str], experiment: &Experiment) -> Option<u64> {
        let simulation = WiredSimulation::new(experiment).unwrap_or_else(|error| panic!("{error}"));
        let nets = simulation.nets();
        let nets = (0..nets.len()).filter(|&net| names.contains(&nets[net].name)).collect();
        let mut first = Self { nets, at: None };
        simulation.run(Driver::Clock, &mut simulation.brief_trace(), &mut first, &Control::default());
        first.at
    }
}

#[test]
fn a_loop_is_compared_where_its_scene_touches_the_wall() {
    let cases: [(&str, &[&str], u64); 4] = [
        // The spring sees the position at once; the conventional wall sees it only at its samples, 50 000 edges apart.
        ("thrown-hybrid", &["penetration"], 9000),
        ("leak-bounce", &["penetration"], 80_000),
        ("phantom-thrown", &["contact"], 9000),
        ("phantom-thrown-rtos", &["host1", "host2", "host3"], 9000),
    ];
    let all: Vec<_> = cases.iter().map(|(name, _, edges)| loop_scene(name, *edges)).collect();
    let never = loop_scene("free-motion", 3000).0;
    let scenes = all.iter().map(|(scene, _)| scene.clone()).chain([never]).collect();
    let options = CheckOptions { blocks: Vec::new(), scenes, ..CheckOptions::new(project().join("hdl")) };
    let report = check(&options).unwrap_or_else(|error| panic!("{error}"));
    assert!(report.ok(), "{report}");
    for (((_, experiment), (name, nets, edges)), row) in all.iter().zip(cases).zip(&report.loops) {
        let reached = First::of(nets, experiment).expect("the wall is reached");
        let Contact { late, edges: touched } = row.contact.expect("a loop tells of contact");
        assert_eq!(late.reached, Some(reached), "{name}");
        let before = reached - late.from_edge;
        assert!(before >= edges / 3 && before < edges, "{name}: {before} edges before the wall");
        // The rest of the motion is the same as in the scene. The wall is reached at the same edge within a hundredth
        // of the way (and a period of the host, whose commands come one period late).
        let expected = edges - before;
        assert!(touched.abs_diff(expected) <= before / 100 + 2500, "{name}: {touched} of {expected} edges in contact");
    }
    let free = report.loops.last().expect("a row").contact.expect("a loop tells of contact");
    assert_eq!((free.late.from_edge, free.late.reached, free.edges), (0, None, 0));
}

#[test]
fn vhdl_that_is_wrong_in_contact_alone_is_caught_in_a_scene_whose_hand_arrives_late() {
    let hdl =
        broken("late", "unilateral.vhd", "penetration <= delta;", "penetration <= '0' & delta(delta'high downto 1);");
    let (scene, experiment) = loop_scene("hybrid-wall", 3000);
    let options = CheckOptions { blocks: Vec::new(), scenes: vec![scene], ..CheckOptions::new(&hdl) };
    let report = check(&options).unwrap_or_else(|error| panic!("{error}"));
    fs::remove_dir_all(hdl).expect("removed");
    let row = &report.loops[0];
    let first = row.first.as_ref().expect("a mismatch");
    assert_eq!((first.signal.as_str(), first.expected.as_str()), ("penetration", "000000000001 (1)"));
    // The hand arrives after millions of edges; the comparison begins a thousand edges before.
    assert!(row.contact.expect("contact").late.from_edge > 7_000_000 && experiment.edges() > 50_000_000);
    assert!(first.row.abs_diff(1000) <= 10, "{}", first.row);
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
        assert!(matches!(error.fault(), Some(Fault::Missing)), "{error}");
        assert!(error.to_string().contains("ghdl-mcode"), "{error}");
        return;
    }
    // Runs this test in a process that finds no program at all.
    let name = "without_ghdl_the_check_names_the_package_to_install";
    let mut child = Command::new(std::env::current_exe().expect("this test"));
    let child = child.args(["--exact", name]).env("PATH", "").env(CHILD, "1").output().expect("a child");
    assert!(child.status.success(), "{}", String::from_utf8_lossy(&child.stdout));
}
