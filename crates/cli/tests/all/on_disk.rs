//! Interrupts, full disks and closed pipes: files are whole, old files stay, and no half-written file is left.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::common::{ROOT, assert_refused, code, hpu, names, run, scratch, stderr, stdout, text};

/// Makes an output folder with files of an earlier run.
fn with_old_files(test: &str) -> std::path::PathBuf {
    let dir = scratch(test);
    for name in ["summary.json", "wave.fst", "trace.csv"] {
        fs::write(dir.join(name), "old").expect("an old file");
    }
    dir
}

fn assert_old_files_alone(dir: &Path) {
    assert_eq!(names(dir), ["summary.json", "trace.csv", "wave.fst"]);
    for name in names(dir) {
        assert_eq!(fs::read_to_string(dir.join(&name)).expect("a file"), "old", "{name}");
    }
}

fn interrupt(child: &Child) {
    let status = Command::new("sh").args(["-c", &format!("kill -INT {}", child.id())]).status();
    assert!(status.expect("a shell").success());
}

/// Starts a run that would take hours, and waits until it writes.
fn long_run(out: &Path) -> Child {
    let arguments = ["run", "hybrid-wall", "--driver", "clock", "--set", "run.duration=1000 s", "-o", text(out)];
    let child = hpu().args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("starts");
    let start = Instant::now();
    while !(out.exists() && names(out).iter().any(|name| name.starts_with(".wave.fst"))) {
        assert!(start.elapsed() < Duration::from_secs(20), "the run does not begin");
        sleep(Duration::from_millis(10));
    }
    sleep(Duration::from_millis(300));
    child
}

#[test]
fn ctrl_c_ends_a_run_with_its_summary_and_leaves_the_old_files() {
    let dir = with_old_files("interrupt");
    let child = long_run(&dir);
    interrupt(&child);
    let output = child.wait_with_output().expect("ends");
    assert_eq!(code(&output), 130, "{}", stderr(&output));
    let said = stdout(&output);
    assert!(said.contains("stopped before its end") && said.contains("no files written"), "{said}");
    assert!(said.contains("expected   not judged: the run was not finished"), "half a run is not judged: {said}");
    assert_old_files_alone(&dir);
}

#[test]
fn ctrl_c_in_a_run_into_a_new_folder_leaves_no_folder() {
    let dir = scratch("interrupt-new");
    let out = dir.join("out");
    let child = long_run(&out);
    interrupt(&child);
    assert_eq!(code(&child.wait_with_output().expect("ends")), 130);
    assert_eq!(names(&dir), [""; 0]);
}

#[test]
fn ctrl_c_ends_what_has_no_summary_at_once() {
    let arguments = ["run", "hybrid-wall", "--compare"];
    let child = hpu().args(arguments).stdout(Stdio::piped()).spawn().expect("starts");
    sleep(Duration::from_millis(500));
    interrupt(&child);
    let output = child.wait_with_output().expect("ends");
    assert_eq!((code(&output), stdout(&output).as_str()), (130, ""));
}

#[test]
fn ctrl_c_ends_a_check_after_its_block_without_a_report() {
    let dir = scratch("interrupt-check");
    let (junit, work) = (dir.join("report.xml"), dir.join("work"));
    fs::create_dir(&work).expect("a folder");
    let child =
        hpu().args(["check", "-x", text(&junit)]).env("TMPDIR", &work).stdout(Stdio::piped()).spawn().expect("starts");
    sleep(Duration::from_millis(500));
    interrupt(&child);
    let output = child.wait_with_output().expect("ends");
    assert_eq!(code(&output), 130, "{}", stdout(&output));
    assert!(!stdout(&output).contains("all agree"), "{}", stdout(&output));
    assert_eq!(names(&dir), ["work"], "no report");
    assert_eq!(names(&work), [""; 0], "no work of GHDL");
}

#[test]
fn a_disk_that_fills_up_is_told_with_the_path_and_leaves_the_old_files() {
    let dir = with_old_files("full");
    // A limit on the size of files stands for the full disk: a write fails in the same way, after a part of it is
    // written.
    for blocks in [0, 1, 64] {
        let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$@\"");
        let output = Command::new("sh")
            .args(["-c", &script, "sh", env!("CARGO_BIN_EXE_hpu"), "run", "wrap-product", "--vcd", "-o", text(&dir)])
            .current_dir(ROOT)
            .output()
            .expect("a shell");
        assert_refused(&output, 4, &[text(&dir), "File too large"]);
        assert_old_files_alone(&dir);
    }
}

#[test]
fn a_disk_that_is_full_ends_the_run() {
    let dir = scratch("full-early");
    // A thousand seconds of motion. There is no room for its first rows.
    let script = "trap '' XFSZ; ulimit -f 64; exec \"$@\"";
    let run = ["run", "hybrid-wall", "--set", "run.duration=1000 s", "--no-plot", "-o", text(&dir)];
    let start = Instant::now();
    let output = Command::new("sh")
        .args(["-c", script, "sh", env!("CARGO_BIN_EXE_hpu")])
        .args(run)
        .current_dir(ROOT)
        .output()
        .expect("a shell");
    assert_refused(&output, 4, &["trace.csv", "File too large"]);
    assert_eq!(names(&dir), [""; 0]);
    assert!(start.elapsed() < Duration::from_secs(10), "{:?}", start.elapsed());
}

#[test]
fn rows_and_bytes_are_told_before_a_run_and_refused_where_they_do_not_fit() {
    let dir = scratch("rows-told");
    let out = dir.join("out");
    let output = run(&["run", "free-motion", "--no-plot", "--parquet", "-o", text(&out)]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let rows = fs::read_to_string(out.join("trace.csv")).expect("a table");
    let told = stderr(&output);
    assert!(told.starts_with(&format!("trace.csv: {} rows, about ", rows.lines().count() - 1)), "{told}");
    assert!(told.contains("trace.parquet: at most about ") && told.contains("waveforms"), "{told}");
    let parquet = fs::read(out.join("trace.parquet")).expect("a table");
    assert!(parquet.starts_with(b"PAR1") && parquet.ends_with(b"PAR1"));
    assert!(stdout(&output).contains(text(&out.join("trace.parquet"))), "{}", stdout(&output));
    // The trace would have 4 x 10^16 rows.
    let more = dir.join("more");
    let set = ["--set", "record.plant_rate=50 MHz", "--edges", "40000000000000000"];
    let output = run(&[&["run", "free-motion", "-o", text(&more)][..], &set].concat());
    assert_refused(&output, 4, &[text(&more), "40000000000000001 rows", "are free", "record.plant_rate"]);
    assert_eq!(names(&dir), ["out"]);
}

#[test]
fn a_full_standard_output_is_told() {
    let full = fs::File::options().write(true).open("/dev/full").expect("the device that is always full");
    let output = hpu().arg("scenes").stdout(full).output().expect("starts");
    assert_refused(&output, 4, &["standard output", "No space left"]);
}

#[test]
fn a_reader_who_leaves_is_no_error() {
    let mut child =
        hpu().arg("block").arg("--json").stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("ends");
    assert_eq!((code(&output), stderr(&output).as_str()), (0, ""));
}

#[test]
fn a_run_replaces_old_files_and_leaves_no_other() {
    let dir = with_old_files("replace");
    let output = run(&["run", "wrap-product", "--vcd", "--no-plot", "-o", text(&dir)]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let waves = ["wave.fst", "wave.fst.gtkw", "wave.fst.sucl", "wave.vcd", "wave.vcd.gtkw", "wave.vcd.sucl"];
    let expected = [&["summary.json", "trace.csv"], &waves[..]].concat();
    assert_eq!(names(&dir), expected);
    for name in &expected {
        assert!(fs::metadata(dir.join(name)).expect("a file").len() > 100, "{name}");
        assert!(stdout(&output).contains(text(&dir.join(name))), "{name} is listed");
    }
    // Both waveforms open in the same way, except for their names.
    let save = |name: &str| fs::read_to_string(dir.join(format!("{name}.gtkw"))).expect("a save file");
    assert_eq!(save("wave.vcd"), save("wave.fst").replace("wave.fst", "wave.vcd"));
}

#[test]
fn a_file_system_without_locks_is_not_another_process() {
    let dir = scratch("disk-no-locks");
    let (source, library) = (dir.join("locks.c"), dir.join("locks.so"));
    // What NFS answers where it has no locks.
    let text_of =
        |error: &str| format!("#include <errno.h>\nint flock(int file, int how) {{ errno = {error}; return -1; }}\n");
    let map =
        ["map", "hybrid-wall", "--x", "wall.stiffness=0.5..1 N.m/rad:2", "--y", "wall.damping=0..0.1 mN.m.s/rad:2"];
    let map = [&map[..], &["--set", "run.duration=1 ms", "--full"]].concat();
    for error in ["ENOLCK", "EOPNOTSUPP", "ENOSYS"] {
        fs::write(&source, text_of(error)).expect("a source");
        let made = Command::new("cc").args(["-shared", "-fPIC", "-o", text(&library), text(&source)]).status();
        assert!(made.expect("a compiler of C").success());
        let out = dir.join(error);
        for _ in 0..2 {
            let mut command = hpu();
            command.args(&map).args(["-o", text(&out)]).env("LD_PRELOAD", &library);
            let output = command.output().expect("starts");
            assert_eq!(code(&output), 0, "{error}: {}", stderr(&output));
        }
    }
}
