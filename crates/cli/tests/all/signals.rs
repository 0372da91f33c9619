//! SIGINT, SIGTERM, SIGHUP and SIGQUIT end every command soon, with the tools that it runs; SIGKILL ends the tools too.
//! The next command sweeps the files that a killed one left.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::{self, sleep};
use std::time::{Duration, Instant};

use crate::common::{ROOT, code, hpu, names, run, scratch, stderr, stdout, text, tools};

/// The time in which a command must end.
const SOON: Duration = Duration::from_secs(2);

/// A scene for which GHDL needs hours.
const ENDLESS: [&str; 3] = ["hybrid-wall", "--set", "run.duration=1000 s"];
/// A hand that has a plan to the end: without one the motion repeats, and its 1000 s are over at once.
const PLANNED: &str = r#"hand.path=[["0 s", 0], ["150 ms", 1.4], ["250 ms", 1.9], ["1000 s", 1.8]]"#;

/// A command in the background. The processes that it starts are found by the mark in their environment, its temporary
/// folder.
struct Started {
    child: Child,
    work: String,
}

impl Started {
    fn new(arguments: &[&str], work: &Path, tools: Option<&Path>) -> Self {
        fs::create_dir_all(work).expect("a folder");
        let mut command = hpu();
        if let Some(tools) = tools {
            command.env("PATH", tools);
        }
        let child = command.args(arguments).env("TMPDIR", work).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        Self { child: child.expect("starts"), work: text(work).to_string() }
    }

    /// Waits until a condition holds.
    fn until(&self, what: &str, holds: impl Fn() -> bool) {
        let start = Instant::now();
        while !holds() {
            assert!(start.elapsed() < Duration::from_secs(30), "{what}: not within 30 s");
            sleep(Duration::from_millis(5));
        }
    }

    /// Waits until a tool of this name runs.
    fn until_runs(&self, tool: &str) {
        self.until(tool, || running(&self.work).iter().any(|(_, command)| command.contains(tool)));
    }

    /// Sends a signal. Returns the exit code, the output, and the time until the command ended.
    fn end(self, signal: &str) -> (i32, String, Duration) {
        send(signal, self.child.id());
        let start = Instant::now();
        let output = self.child.wait_with_output().expect("ends");
        (output.status.code().unwrap_or(-1), stdout(&output) + &stderr(&output), start.elapsed())
    }
}

/// Sends a signal to a process, unless that has ended by itself since it was listed. A child of this one is there until
/// it is waited for.
fn send(signal: &str, id: u32) {
    let status = Command::new("sh").args(["-c", &format!("kill -{signal} {id}")]).status();
    let was_sent = status.expect("a shell").success();
    assert!(was_sent || !Path::new(&format!("/proc/{id}")).exists(), "process {id} takes no signal");
}

/// Returns the id and the command of each process with this temporary folder, or with one inside it.
fn running(work: &str) -> Vec<(u32, String)> {
    let mark = format!("TMPDIR={work}");
    let process = |entry: fs::DirEntry| {
        let id: u32 = entry.file_name().to_str()?.parse().ok()?;
        let environment = fs::read(entry.path().join("environ")).ok()?;
        let is_marked = environment.split(|byte| *byte == 0).any(|variable| variable.starts_with(mark.as_bytes()));
        let command = String::from_utf8_lossy(&fs::read(entry.path().join("cmdline")).ok()?).replace('\0', " ");
        (is_marked && !command.is_empty()).then_some((id, command))
    };
    fs::read_dir("/proc").expect("a process table").flatten().filter_map(process).collect()
}

fn assert_ended(ended: &(i32, String, Duration), expected: i32, work: &Path) {
    let (code, said, took) = ended;
    assert_eq!(*code, expected, "{said}");
    assert!(*took < SOON, "{took:?}");
    // A process that was killed is there for a moment more, the longer the busier the machine.
    let start = Instant::now();
    while !running(text(work)).is_empty() && start.elapsed() < SOON {
        sleep(Duration::from_millis(5));
    }
    assert_eq!(running(text(work)), [], "processes");
    assert_eq!(names(work), [""; 0], "temporary files");
}

#[test]
fn signals_end_a_check_while_ghdl_runs() {
    for (signal, expected) in [("INT", 130), ("TERM", 143)] {
        let dir = scratch(&format!("signal-check-{signal}"));
        let (work, out) = (dir.join("work"), dir.join("out"));
        let scene = ["check", "--edges", "1000000000", "-o", text(&out), "--scene"];
        let started = Started::new(&[&scene[..], &ENDLESS].concat(), &work, None);
        started.until_runs("bench_hybrid_loop_0");
        assert_ended(&started.end(signal), expected, &work);
        assert_eq!(names(&dir), ["work"]);
    }
}

#[test]
fn signals_end_a_run_of_the_vhdl_while_ghdl_runs() {
    for (signal, expected) in [("INT", 130), ("TERM", 143)] {
        let dir = scratch(&format!("signal-rtl-{signal}"));
        let (work, out) = (dir.join("work"), dir.join("out"));
        let arguments = [&["run"], &ENDLESS[..], &["--driver", "rtl", "-o", text(&out)]].concat();
        let started = Started::new(&arguments, &work, None);
        started.until_runs("bench_hybrid_loop_0");
        assert_ended(&started.end(signal), expected, &work);
        assert_eq!(names(&dir), ["work"]);
    }
}

#[test]
fn signals_end_a_synthesis_with_what_yosys_started() {
    let yosys = "[ \"$1\" = -V ] && echo 'Yosys 9.9' && exit\nsleep 1001 & exec sleep 1002";
    let commands: [&[&str]; 3] =
        [&["cost", "pwm"], &["cost", "--scene", "hybrid-wall"], &["widths", "one-tick", "--no-trials", "--price"]];
    thread::scope(|scope| {
        for (index, arguments) in commands.into_iter().enumerate() {
            scope.spawn(move || {
                for (signal, expected) in [("INT", 130), ("TERM", 143)] {
                    let dir = scratch(&format!("signal-cost-{index}-{signal}"));
                    let scripts =
                        [("ghdl", "exec ghdl \"$@\""), ("yosys", yosys), ("nextpnr-ice40", "echo nextpnr 9.9")];
                    let (work, tools, cache) = (dir.join("work"), tools(&dir, &scripts), dir.join("cache"));
                    let arguments = [arguments, &["--cache", text(&cache)]].concat();
                    let started = Started::new(&arguments, &work, Some(&tools));
                    started.until_runs("sleep 1002");
                    assert_ended(&started.end(signal), expected, &work);
                    assert_eq!(names(&cache), [""; 0]);
                }
            });
        }
    });
}

/// Returns the arguments for a map of a design, every cell of which is run.
fn map_of<'a>(scene: &'a str, out: &'a str) -> Vec<&'a str> {
    let axes = ["map", scene, "--x", "dut.ports.gain=50..550:6", "--y", "hand.stiffness=0.1..1.1:6"];
    [&axes[..], &["--set", "run.duration=100 ms", "--full", "-o", out]].concat()
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn a_map_of_a_design_goes_on_after_a_signal_with_the_cells_that_it_had_begun() {
    let work = scratch("signal-dut-map");
    let [cut, whole] = ["cut", "whole"].map(|name| work.join(name));
    let scene = fs::canonicalize(Path::new(ROOT).join("testbench/dut/knee.toml")).expect("a scene");
    assert_eq!(code(&run(&map_of(text(&scene), text(&whole)))), 0);
    let journal = cut.join("journal.txt");
    let cells = || fs::read_to_string(&journal).map_or(0, |text| text.lines().count());
    // At any time of the signal, a simulator that it kills must not count as a cell that has failed.
    for cells_before in [2, 9] {
        let map = Started::new(&map_of(text(&scene), text(&cut)), &work, None);
        map.until("some cells", || cells() > cells_before);
        let (exit, said, _) = map.end("INT");
        assert_eq!(exit, 130, "{said}");
        let journal = fs::read_to_string(&journal).expect("a journal");
        assert!(!journal.contains("\"Err\"") && !journal.contains("ended by signal"), "{journal}");
    }
    assert_eq!(code(&run(&map_of(text(&scene), text(&cut)))), 0);
    let rows = |out: &Path| {
        let text = fs::read_to_string(out.join("map.csv")).expect("a map");
        text.lines().skip(1).map(str::to_string).collect::<Vec<_>>()
    };
    assert_eq!(rows(&cut), rows(&whole));
}

#[test]
fn sigterm_ends_every_other_command() {
    let commands: [&[&str]; 6] = [
        &["run", "hybrid-wall", "--driver", "clock", "--set", "run.duration=1000 s"],
        &["run", "hybrid-wall", "--compare", "--set", "run.duration=1000 s"],
        &["limits", "hybrid-wall"],
        &["chart", "friction-wall"],
        &["widths", "hybrid-wall", "--set", "run.duration=1000 s", "--set", PLANNED],
        &["fit", "hybrid-wall", "--set", "run.duration=1000 s", "--set", PLANNED],
    ];
    thread::scope(|scope| {
        for (index, arguments) in commands.into_iter().enumerate() {
            scope.spawn(move || {
                let work = scratch(&format!("signal-other-{index}"));
                let mut started = Started::new(arguments, &work, None);
                sleep(Duration::from_millis(300));
                let ended = started.child.try_wait().expect("a child").is_some();
                assert!(!ended, "{arguments:?} is done too soon to be stopped");
                let (code, said, took) = started.end("TERM");
                assert_eq!(code, 143, "{arguments:?}: {said}");
                assert!(took < SOON, "{arguments:?}: {took:?}");
            });
        }
    });
}

#[test]
fn what_a_killed_run_left_is_swept_by_the_next_and_a_living_runs_files_are_not() {
    let (dir, work) = (scratch("killed-run"), scratch("killed-run-work"));
    let endless = [&["run"], &ENDLESS[..], &["--driver", "clock", "--vcd", "-o", text(&dir)]].concat();
    // There are two waveforms, each with its files for two viewers.
    let temporary = || names(&dir).iter().filter(|name| name.starts_with(".wave")).count();
    let killed = Started::new(&endless, &work, None);
    killed.until("its files", || temporary() == 6);
    killed.end("KILL");
    assert_eq!(temporary(), 6, "nobody was there to remove them");
    let living = Started::new(&endless, &work, None);
    living.until("those of the first gone, its own there", || {
        let names = names(&dir);
        temporary() == 6 && names.iter().all(|name| name.contains(&living.child.id().to_string()))
    });
    let output = run(&["run", "wrap-product", "--no-plot", "-o", text(&dir)]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(temporary(), 6, "a living run's files were swept");
    assert_eq!(living.end("TERM").0, 143);
    assert_eq!(names(&dir), ["summary.json", "trace.csv", "wave.fst", "wave.fst.gtkw", "wave.fst.sucl"]);
}

#[test]
fn the_work_of_ghdl_that_a_killed_check_left_is_swept_by_the_next() {
    let work = scratch("killed-check");
    let scene = ["check", "--edges", "1000000000", "--scene"];
    let started = Started::new(&[&scene[..], &ENDLESS].concat(), &work, None);
    started.until_runs("bench_hybrid_loop_0");
    started.end("KILL");
    for (id, _) in running(text(&work)) {
        send("KILL", id);
    }
    assert_eq!(names(&work).len(), 1, "its folder");
    let output = hpu().args(["check", "saturator"]).env("TMPDIR", &work).output().expect("starts");
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(names(&work), [""; 0]);
}

/// A tool with children and grandchildren in its group, in the background and in the foreground.
const FAMILY: &str = "[ \"$1\" = -V ] && echo 'Yosys 9.9' && exit\n\
                      sleep 1001 & sh -c 'sleep 1002 & sh -c \"sleep 1003; :\"; :' & exec sleep 1004";

/// Starts a synthesis by a Yosys with children. Returns it once all of them run.
fn synthesis(dir: &Path, work: &Path) -> Started {
    let scripts = [("ghdl", "exec ghdl \"$@\""), ("yosys", FAMILY), ("nextpnr-ice40", "echo nextpnr 9.9")];
    let (tools, cache) = (tools(dir, &scripts), dir.join("cache"));
    fs::create_dir_all(work).expect("a folder");
    let mut command = hpu();
    command.args(["cost", "pwm", "--cache", text(&cache)]).env("PATH", tools).env("TMPDIR", work);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("starts");
    let started = Started { child, work: text(work).to_string() };
    ["sleep 1001", "sleep 1002", "sleep 1003", "sleep 1004"].iter().for_each(|child| started.until_runs(child));
    started
}

#[test]
fn a_closed_terminal_and_sigquit_end_a_command_as_sigterm_does() {
    for (signal, expected) in [("HUP", 129), ("QUIT", 131), ("TERM", 143)] {
        let dir = scratch(&format!("signal-hangup-{signal}"));
        let work = dir.join("work");
        let ended = synthesis(&dir, &work).end(signal);
        assert_ended(&ended, expected, &work);
        assert!(!ended.1.contains("panic"), "{}", ended.1);
    }
    // What was made until then is kept, as after SIGTERM.
    let dir = scratch("signal-hangup-map");
    let (out, work) = (dir.join("out"), dir.join("work"));
    let map =
        ["map", "hybrid-wall", "--x", "wall.stiffness=0.5..6 N.m/rad:40", "--y", "wall.damping=0..0.4 mN.m.s/rad:40"];
    let map = Started::new(&[&map[..], &["--full", "-o", text(&out)]].concat(), &work, None);
    let journal = out.join("journal.txt");
    map.until("some cells", || fs::read_to_string(&journal).is_ok_and(|text| text.lines().count() > 3));
    let (exit, said, took) = map.end("HUP");
    assert!(exit == 129 && took < SOON, "{exit} {took:?} {said}");
    assert!(fs::read_to_string(&journal).is_ok_and(|text| text.lines().count() > 3));
}

#[test]
fn a_command_behind_nohup_outlives_its_terminal() {
    let dir = scratch("signal-nohup");
    let work = dir.join("work");
    // `nohup` starts a program that ignores SIGHUP, which its children inherit.
    fs::create_dir_all(&work).expect("a folder");
    let program = env!("CARGO_BIN_EXE_hpu");
    let script = format!("trap '' HUP; exec {program} run hybrid-wall --driver clock --set 'run.duration=1000 s'");
    let mut shell = Command::new("sh");
    shell.args(["-c", &script]).env("TMPDIR", &work).current_dir(ROOT);
    let child = shell.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("starts");
    let mut started = Started { child, work: text(&work).to_string() };
    started.until_runs("hybrid-wall");
    sleep(Duration::from_millis(300));
    send("HUP", started.child.id());
    sleep(Duration::from_millis(500));
    assert!(started.child.try_wait().expect("a child").is_none(), "it has ended");
    assert_eq!(started.end("TERM").0, 143);
}

#[test]
fn tools_and_what_they_have_started_die_with_a_command_that_is_killed() {
    for time in 0..3 {
        let dir = scratch(&format!("signal-kill-{time}"));
        let work = dir.join("work");
        let killed = synthesis(&dir, &work);
        // At another time of the tool each time.
        sleep(Duration::from_millis(37 * time));
        send("KILL", killed.child.id());
        let start = Instant::now();
        while !running(text(&work)).is_empty() && start.elapsed() < SOON {
            sleep(Duration::from_millis(5));
        }
        assert_eq!(running(text(&work)), [], "processes");
        drop(killed.child.wait_with_output());
    }
}

#[test]
fn a_simulator_dies_with_a_command_that_is_killed() {
    let dir = scratch("signal-kill-simulator");
    let (work, out) = (dir.join("work"), dir.join("out"));
    let arguments = [&["run"], &ENDLESS[..], &["--driver", "rtl", "-o", text(&out)]].concat();
    let killed = Started::new(&arguments, &work, None);
    killed.until_runs("bench_hybrid_loop_0");
    send("KILL", killed.child.id());
    let start = Instant::now();
    while !running(text(&work)).is_empty() && start.elapsed() < SOON {
        sleep(Duration::from_millis(5));
    }
    assert_eq!(running(text(&work)), [], "processes");
    drop(killed.child.wait_with_output());
}

#[test]
fn the_shards_of_a_sweep_die_with_it() {
    let dir = scratch("signal-kill-sweep");
    let work = dir.join("work");
    let study = "name = \"s\"\ntitle = \"S\"\n[map]\nscene = \"hybrid-wall\"\nx = \"wall.stiffness=0.5..6 N.m/rad:4\"\n\
                 y = \"wall.damping=0..0.4 mN.m.s/rad:4\"\nfull = true\nset = [\"run.duration=1000 s\", '''HAND''']\n";
    fs::write(dir.join("study.toml"), study.replace("HAND", PLANNED)).expect("a study");
    let (study, out) = (dir.join("study.toml"), dir.join("sweep"));
    for (signal, is_killed) in [("KILL", true), ("HUP", false)] {
        let sweep = ["sweep", "run", text(&study), "-o", text(&out), "--shard-points", "1", "--jobs", "2"];
        let sweep = Started::new(&sweep, &work, None);
        sweep.until("shards", || running(&sweep.work).iter().filter(|(_, it)| it.contains("--index")).count() == 2);
        send(signal, sweep.child.id());
        let start = Instant::now();
        while !running(text(&work)).is_empty() && start.elapsed() < SOON {
            sleep(Duration::from_millis(5));
        }
        assert_eq!(running(text(&work)), [], "processes");
        let output = sweep.child.wait_with_output().expect("ends");
        assert_eq!(output.status.code(), (!is_killed).then_some(129), "{}", stderr(&output));
    }
}

/// GNU parallel runs each job in a group of its own. It ends its jobs when it is asked to end twice, and leaves them
/// behind when it is killed.
#[test]
fn the_jobs_of_gnu_parallel_die_with_a_sweep_that_is_killed() {
    let dir = scratch("signal-kill-parallel");
    let work = dir.join("work");
    let study = "name = \"s\"\ntitle = \"S\"\n[map]\nscene = \"hybrid-wall\"\nx = \"wall.stiffness=0.5..6 N.m/rad:2\"\n\
                 y = \"wall.damping=0..0.4 mN.m.s/rad:2\"\nfull = true\n";
    let (file, out) = (dir.join("study.toml"), dir.join("sweep"));
    fs::write(&file, study).expect("a study");
    let plan = ["sweep", "plan", text(&file), "-o", text(&out), "--shard-points", "1"];
    assert_eq!(code(&run(&plan)), 0);
    let parallel = "setsid sleep 1000 & job=$!\nasked=0\n\
                    trap 'asked=$((asked + 1)); [ $asked = 1 ] || { kill $job; exit 1; }' TERM\n\
                    while :; do sleep 0.01; done";
    let path =
        format!("{}:{}", tools(&dir, &[("parallel", parallel)]).display(), std::env::var("PATH").expect("a PATH"));
    let submit = ["sweep", "submit", text(&out), "--engine", "parallel"];
    let killed = Started::new(&submit, &work, Some(Path::new(&path)));
    killed.until_runs("sleep 1000");
    // The job is in its own group by then.
    sleep(Duration::from_millis(100));
    send("KILL", killed.child.id());
    let start = Instant::now();
    while !running(text(&work)).is_empty() && start.elapsed() < 2 * SOON {
        sleep(Duration::from_millis(5));
    }
    assert_eq!(running(text(&work)), [], "processes");
    drop(killed.child.wait_with_output());
}
