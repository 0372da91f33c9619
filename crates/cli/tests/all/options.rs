//! Every option of every verb, in every mode, has an effect or is refused: none is ignored.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;

use clap::Command;

use crate::common::{hpu, scratch};

/// A mode: the verb, the arguments that ask for the mode, and what an option is given in the place of [`GIVEN`].
type Mode = (&'static [&'static str], &'static [&'static str], &'static [(&'static str, &'static [&'static str])]);

/// Options that by their meaning change no result: how much runs at a time, how much is said on the way, and a limit of
/// wall time that no run of this test comes near.
const WITHOUT_EFFECT: [&str; 3] = ["quiet", "jobs", "cell-timeout"];

/// Options whose effect is not seen where nothing is wrong: the random rows of a check, all of which agree; a sweep
/// whose files are whole, whose points are all run, and whose build planned it, for which sweep.rs has others; the
/// shards that a task runs at a time; and the size of a further wave's shards, and of those of a
/// map that takes milliseconds.
const UNSEEN: [(&str, &str, &str); 8] = [
    ("check", "seed", "--rows"),
    ("sweep", "again", ""),
    ("sweep", "partial", ""),
    ("sweep", "any-version", ""),
    ("sweep", "cores", "--of"),
    ("sweep", "shard-time", "@PLANNED"),
    ("sweep", "shard-time", "@STUDY"),
    ("sweep", "shard-points", "@PLANNED"),
];

/// Verbs that are others by another name, with the options of these: the paper's studies that come with the program are
/// `study` on a file, the ladder is Table 2 by other models, and two tables of words are of one kind.
const ALIKE: [(&str, &str); 9] = [
    ("reproduce hybrid-loop", "study"),
    ("reproduce input-shaper", "study"),
    ("reproduce criteria", "study"),
    ("reproduce power-scaling", "study"),
    ("reproduce three-dof", "study"),
    ("reproduce epfl-paddle", "study"),
    ("reproduce phantom-lag", "study"),
    ("reproduce phantom-ladder", "reproduce phantom-table-2"),
    ("reproduce phantom-formats", "reproduce phantom-sines"),
];

/// A short run. `@` is a folder of the run's own.
const SHORT: &str = "run.duration=3 ms";

/// The value that an option is given unless the mode says otherwise.
const GIVEN: &[(&str, &[&str])] = &[
    ("set", &["--set", "run.duration=2 ms"]),
    ("json", &["--json"]),
    ("out", &["--out", "@/out"]),
    ("junit", &["--junit", "@/junit.xml"]),
    ("notation", &["--notation", "q"]),
    ("hdl", &["--hdl", "/nowhere"]),
    ("tool-timeout", &["--tool-timeout", "0.001"]),
    ("cache", &["--cache", "/proc/none"]),
    ("driver", &["--driver", "clock"]),
    ("expect", &["--expect"]),
    ("edges", &["--edges", "100"]),
    ("for-ever", &["--for-ever=1ms"]),
    ("certificates", &["--certificates", "@/c"]),
    ("loop", &["--loop"]),
    ("library", &["--library", "Cargo.toml"]),
    ("compare", &["--compare"]),
    ("dut", &["--dut", "testbench/dut/begin.vhd"]),
    ("beside", &["--beside", "free-motion", "--out", "@/o"]),
    ("vcd", &["--vcd"]),
    ("parquet", &["--parquet"]),
    ("no-plot", &["--no-plot"]),
    ("ci", &["--ci"]),
    ("schema", &["--schema"]),
    ("markdown", &["--markdown"]),
    ("variant", &["--variant", "8_bit"]),
    ("index", &["--index", "1"]),
    ("wave", &["--wave", "2"]),
    ("depth", &["--wave", "*", "--depth", "1"]),
    ("to", &["--to", "1ms"]),
    ("of", &["--of", "2"]),
    ("engine", &["--engine", "slurm"]),
    ("limit", &["--limit", "1"]),
    ("tasks", &["--tasks", "1"]),
    ("cores", &["--cores", "2"]),
    ("option", &["--option=--hold"]),
    ("one-wave", &["--one-wave"]),
    ("dry-run", &["--dry-run"]),
    ("cancel", &["--cancel"]),
    ("inputs", &["--inputs", "/nowhere"]),
    ("set-kind", &["--set-kind", "random"]),
    ("seed", &["--seed", "7"]),
    ("count", &["--count", "3"]),
    ("scene", &["--scene", "free-motion"]),
    ("table", &["--table", "cosines"]),
    ("format", &["--format", "csv"]),
    ("update", &["--update"]),
    ("verify", &["--verify", "/nowhere"]),
    ("rows", &["--rows", "3"]),
    ("exhaustive", &["--exhaustive"]),
    ("formal", &["--formal"]),
    ("entity", &["--entity", "x"]),
    ("as", &["--as", "saturator"]),
    ("port", &["--port", "a=b"]),
    ("generic", &["--generic", "A=B"]),
    ("bench", &["--bench"]),
    ("clock", &["--clock", "20 MHz"]),
    ("reset", &["--reset", "r"]),
    ("latency", &["--latency", "1"]),
    ("state", &["--state", "a=b"]),
    ("invariant", &["--invariant", "1"]),
    ("standard", &["--standard", "93"]),
    ("library", &["--library", "other"]),
    ("range", &["--range", "0.2..0.22"]),
    ("over", &["--over", "device.inductance=0.2..0.25 mH"]),
    ("hands", &["--hands", "50mm"]),
    ("words", &["--words", "3"]),
    ("phases", &["--phases", "2"]),
    ("from", &["--from", "/nowhere"]),
    ("method", &["--method", "a:method.kind=conventional"]),
    ("all-methods", &["--all-methods"]),
    ("full", &["--full"]),
    ("cell-events", &["--cell-events", "1"]),
    ("contestants", &["--contestants", "sample"]),
    ("x", &["--x", "hand.stiffness=0.1..0.2:2"]),
    ("y", &["--y", "hand.stiffness=0.1..0.2:2"]),
    ("within", &["--within", "50%"]),
    ("tolerance", &["--tolerance", "50%"]),
    ("with", &["--with", "widths"]),
    ("search", &["--search", "--vary", "position_bits=11..12"]),
    ("vary", &["--vary", "position_bits=11..12"]),
    ("against", &["--against", "20"]),
    ("also", &["--also", "wall.stiffness=0.3"]),
    ("proved", &["--proved"]),
    ("lose", &["--lose", "50%"]),
    ("random", &["--random", "0.02"]),
    ("no-trials", &["--no-trials"]),
    ("price", &["--price", "--cache", "/proc/none"]),
    ("tables", &["--tables"]),
    ("gappa", &["--gappa"]),
    ("page", &["--page", "/nowhere"]),
    ("device", &["--device", "mass"]),
    ("counts", &["--counts", "100"]),
    ("section", &["--section", "lines"]),
    ("shard-time", &["--shard-time", "1s"]),
    ("shard-points", &["--shard-points", "2"]),
    ("axes", &["--axes", "y"]),
    ("platforms", &["--platforms", "RTOS-20"]),
    ("stiffness", &["--stiffness", "250"]),
    ("seeds", &["--seeds", "2"]),
    ("trials", &["--trials", "2"]),
];

const KNEE: &str = "testbench/dut/knee.toml";
const MAPPED: [&str; 4] =
    ["--x", "device.coulomb_friction=0.1..10 mN.m:3", "--y", "device.initial_speed=100..300 rad/s:3"];
const HAND: (&str, &[&str]) = ("set", &["--set", "hand.stiffness=0.4"]);

/// All modes.
const MODES: &[Mode] = &[
    (&["run"], &["hybrid-wall", "--set", SHORT], &[HAND]),
    (&["run"], &["hybrid-wall", "--json", "--set", SHORT], &[HAND]),
    (&["run"], &["hybrid-wall", "--compare", "--set", SHORT], &[("compare", &["--compare", "a=b"])]),
    (
        &["run"],
        &["hybrid-wall", "--out", "@/o", "--set", SHORT],
        &[HAND, ("beside", &["--beside", "free-motion"]), ("wave", &["--wave", "ports"]), ("from", &["--from", "1ms"])],
    ),
    (
        &["run"],
        &["hybrid-wall", "--out", "@/o", "--no-plot", "--set", SHORT],
        &[HAND, ("no-plot", &["--no-plot", "--beside", "one-tick"])],
    ),
    (&["run"], &["short-contact", "--driver", "rtl", "--edges", "500"], &[HAND]),
    (&["run"], &[KNEE, "--set", SHORT], &[]),
    (
        &["run"],
        &[
            KNEE,
            "--set",
            SHORT,
            "--set",
            "clock.frequency=50 MHz",
            "--compare",
            "pwm=a_high",
            "--beside",
            "hybrid-wall",
        ],
        &[("beside", &["--beside", "nothing"]), ("compare", &["--compare", "pwm=a_low"])],
    ),
    (&["scenes"], &[], &[]),
    (&["scenes", "show"], &["hybrid-wall"], &[]),
    (&["new"], &["@/wall"], &[]),
    (&["new"], &["@/wall", "--dut"], &[]),
    (&["new"], &["@/wall", "--ci"], &[]),
    (&["new"], &["@/wall", "--device", "mass"], &[("device", &["--device", "motor"])]),
    (&["new"], &["@/wall", "--device", "phantom"], &[]),
    (&["keys"], &[], &[]),
    (&["keys"], &["method"], &[]),
    (&["block"], &[], &[]),
    (&["block"], &["pwm"], &[]),
    (&["block"], &["pwm", "--json"], &[]),
    (&["block"], &["truncating_multiplier", "--inputs", "@IN"], &[("variant", &["--variant", "drop_upper"])]),
    (&["vectors"], &["pwm", "--count", "5"], &[]),
    (&["vectors"], &["pwm", "--count", "5", "--set-kind", "random"], &[("set-kind", &["--set-kind", "directed"])]),
    (
        &["vectors"],
        &["pwm", "--count", "50", "--set-kind", "scene", "--scene", "hybrid-wall"],
        &[("set-kind", &["--set-kind", "directed"]), ("set", &["--set", "method.pwm.bits=10"])],
    ),
    (
        &["vectors"],
        &["trig_table", "--set-kind", "table", "--table", "sines"],
        &[("set-kind", &["--set-kind", "directed"]), ("variant", &["--variant", "nothing"])],
    ),
    // Where a word differs, --out has a waveform of it.
    (&["vectors"], &["--verify", "@WRONG"], &[("verify", &["--verify", "/nowhere"])]),
    (
        &["check"],
        &["displacement", "--rows", "1", "--out", "@/o"],
        &[("scene", &["--scene", "nothing"]), ("variant", &["--variant", "nothing"]), ("out", &["--out", "@/other"])],
    ),
    (&["check"], &["--scene", "short-contact", "--edges", "200"], &[HAND, ("scene", &["--scene", "nothing"])]),
    (&["check"], &["saturator", "--formal"], &[("scene", &["--scene", "nothing"])]),
    (
        &["limits"],
        &["hybrid-wall", "--set", "wall.damping=0", "--range", "0.2..0.25", "--words", "2", "--phases", "1"],
        &[HAND, ("for-ever", &["--for-ever"]), ("certificates", &["--for-ever", "--certificates", "@/c"])],
    ),
    (&["certify"], &["testbench/hybrid-wall.certificate"], &[]),
    (
        &["export", "fmu"],
        &["hybrid-wall", "--out", "@/x.fmu", "--library", "Cargo.toml"],
        &[HAND, ("loop", &["--loop"]), ("library", &["--library", "README.md"])],
    ),
    (&["limits"], &["gimbal-switch"], &[("set", &["--set", "method.force_gain=5"])]),
    (
        &["map"],
        &["free-motion", "--set", SHORT, MAPPED[0], MAPPED[1], MAPPED[2], MAPPED[3]],
        &[
            ("x", &["--x", "device.coulomb_friction=0.1..9 mN.m:3"]),
            ("y", &["--y", "device.initial_speed=100..200 rad/s:3"]),
        ],
    ),
    (
        &["chart"],
        &["hybrid-wall", "--contestants", "averaged", "--set", SHORT],
        &[
            ("x", &["--x", "hand.stiffness=0.1..0.2:2", "--y", "wall.damping=0..0.1 mN.m.s/rad:2"]),
            ("y", &["--y", "wall.damping=0..0.1 mN.m.s/rad:2"]),
        ],
    ),
    (&["fit"], &["one-tick", "--set", "run.duration=30 ms"], &[]),
    (
        &["identify"],
        &["free-motion", "@LOG", "--free", "device.coulomb_friction", "--set", SHORT],
        &[("free", &["--free", "device.initial_speed"]), ("held", &["--held", "/nowhere.csv"])],
    ),
    (&["diff"], &["one-tick", "count-cycle"], &[]),
    (&["report"], &["one-tick", "--out", "@/report.html"], &[("out", &["--out", "@/other.html"])]),
    (&["widths"], &["one-tick"], &[HAND]),
    (&["widths"], &["one-tick", "--no-trials"], &[HAND]),
    (&["widths"], &["one-tick", "--no-trials", "--json"], &[HAND]),
    (&["widths"], &["one-tick", "--random", "0.01"], &[HAND]),
    (&["widths"], &["one-tick", "--gappa"], &[("set", &["--set", "method.position_bits=11"])]),
    (
        &["widths"],
        &["one-tick", "--search", "--vary", "position_bits=11..12", "--vary", "velocity_bits=3..4"],
        &[HAND, ("vary", &["--vary", "pwm.bits=8..9"])],
    ),
    (&["explore"], &["--page", "@PAGE", "--out", "@/page.html"], &[("out", &["--out", "@/other.html"])]),
    (&["explore"], &["one-tick", "--page", "@PAGE", "--out", "@/page.html"], &[("out", &["--out", "@/other.html"])]),
    (
        &["sweep", "plan"],
        &["testbench/studies/example.toml", "--section", "map", "--out", "@/sweep", "--shard-points", "5"],
        &[("out", &["--out", "@/other"]), ("section", &["--section", "nothing"])],
    ),
    (&["sweep", "status"], &["@PLANNED"], &[]),
    (&["sweep", "shard"], &["@PLANNED", "--index", "0"], &[]),
    (&["sweep", "task"], &["@PLANNED", "--wave", "1", "--index", "0", "--of", "1"], &[]),
    (&["sweep", "gather"], &["@DONE"], &[]),
    (&["sweep", "run"], &["@STUDY", "--out", "@/sweep"], &[("section", &["--section", "nothing"])]),
    (&["sweep", "run"], &["@PLANNED"], &[]),
    (&["sweep", "submit"], &["@PLANNED", "--engine", "slurm", "--dry-run"], &[("engine", &["--engine", "parallel"])]),
    (&["sweep", "submit"], &["@PLANNED", "--engine", "parallel", "--dry-run"], &[]),
    (&["sweep", "submit"], &["@PLANNED", "--engine", "slurm", "--cancel"], &[("engine", &["--engine", "parallel"])]),
    (&["study"], &["@LINES"], &[]),
    (&["study"], &["--from", "@DONE"], &[]),
    (&["cost"], &["unilateral", "--cache", "@COSTS"], &[("cache", &["--cache", "/proc/none"])]),
    (
        &["cost"],
        &["--scene", "@DESIGN", "--cache", "@COSTS"],
        &[("set", &["--set", "dut.top=Nothing"]), ("cache", &["--cache", "/proc/none"])],
    ),
    (
        &["reproduce", "phantom-cost"],
        &["--blocks", "command_register", "--cache", "@COSTS"],
        &[("cache", &["--cache", "/proc/none"]), ("blocks", &["--blocks", "phantom_io"])],
    ),
    (&["completions"], &["bash"], &[]),
    (&["man"], &[], &[]),
    (&["reproduce", "phantom-sines"], &[], &[]),
    (&["reproduce", "phantom-sines"], &["--json"], &[]),
    (
        &["reproduce", "phantom-table-2"],
        &["--axes", "x", "--platforms", "FPGA-400", "--stiffness", "100", "--seeds", "1", "--trials", "1"],
        &[("set", &["--set", "drop.weight=0.2"])],
    ),
];

/// The results of a command: its exit code, the lines that it said, and its files.
struct Found {
    code: Option<i32>,
    said: String,
    refusal: String,
    files: BTreeMap<String, Vec<u8>>,
}

/// Returns a command's results. `@` in an argument is a folder of its own.
fn found(dir: &Path, number: usize, words: &[String]) -> Found {
    let own = dir.join(number.to_string());
    fs::create_dir_all(&own).expect("a folder");
    let place = |word: &String| {
        let word = word.replace("@IN", &dir.join("in.csv").display().to_string());
        let word = word.replace("@WRONG", &dir.join("wrong.txt").display().to_string());
        let word = word.replace("@PAGE", &dir.join("page.html").display().to_string());
        let word = word.replace("@STUDY", &dir.join("map.toml").display().to_string());
        let word = word.replace("@LINES", &dir.join("lines.toml").display().to_string());
        let word = word.replace("@DESIGN", &dir.join("design.toml").display().to_string());
        let word = word.replace("@LOG", &dir.join("log.csv").display().to_string());
        let word = word.replace("@COSTS", &dir.join("costs").display().to_string());
        // A command may change a sweep, so each has its own.
        for sweep in ["@PLANNED", "@DONE"].into_iter().filter(|sweep| word.contains(sweep)) {
            fs::create_dir_all(own.join("sweep")).expect("a folder");
            let mut files = BTreeMap::new();
            collect(&dir.join(&sweep[1..]), &dir.join(&sweep[1..]), &mut files);
            for (name, bytes) in files {
                let path = own.join("sweep").join(name);
                fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
                fs::write(path, bytes).expect("a file");
            }
        }
        let word = word.replace("@PLANNED", "@/sweep").replace("@DONE", "@/sweep");
        word.replace('@', &own.display().to_string())
    };
    // A scheduler without jobs.
    let path = std::env::var("PATH").unwrap_or_default();
    let path = format!("{}:{path}", dir.join("tools").display());
    let output = hpu().args(words.iter().map(place)).env("PATH", path).output().expect("starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).replace(&own.display().to_string(), "@");
    let mut files = BTreeMap::new();
    collect(&own, &own, &mut files);
    let refusal = text(&output.stderr);
    Found { code: output.status.code(), said: text(&output.stdout) + &refusal, refusal, files }
}

fn collect(root: &Path, dir: &Path, files: &mut BTreeMap<String, Vec<u8>>) {
    for entry in fs::read_dir(dir).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            collect(root, &path, files);
        } else {
            let name = path.strip_prefix(root).expect("below it").display().to_string();
            files.insert(name, fs::read(&path).expect("a file"));
        }
    }
}

/// Returns the lines that tell a result: those that are the same in two runs of one command, by their labels. Wall
/// times, and whatever else changes by itself, are left out.
fn lasting<'t>(text: &'t str, unstable: &BTreeSet<&str>) -> Vec<&'t str> {
    text.lines().filter(|line| !unstable.contains(label(line))).collect()
}

fn label(line: &str) -> &str {
    line.split_whitespace().next().unwrap_or_default()
}

/// Returns whether a command differs from both of two equal ones in more than these two differ.
fn differs(one: &Found, same: &Found, other: &Found) -> bool {
    let unstable: BTreeSet<&str> = {
        let (a, b): (Vec<&str>, Vec<&str>) = (one.said.lines().collect(), same.said.lines().collect());
        a.iter().zip(&b).filter(|(a, b)| a != b).flat_map(|(a, b)| [label(a), label(b)]).collect()
    };
    let files = |found: &Found| -> BTreeMap<String, Vec<u8>> {
        let is_lasting = |name: &String| one.files.get(name) == same.files.get(name) || !one.files.contains_key(name);
        found.files.clone().into_iter().filter(|(name, _)| is_lasting(name)).collect()
    };
    one.code != other.code
        || lasting(&one.said, &unstable) != lasting(&other.said, &unstable)
        || files(one) != files(other)
}

/// Returns the description of a verb.
fn described(verb: &[&str]) -> Command {
    verb.iter().fold(hpu_cli::description(), |command, name| {
        command.find_subcommand(name).unwrap_or_else(|| panic!("no verb {name}")).clone()
    })
}

/// Returns the long names of the options of a verb that users are told of.
fn options(verb: &[&str]) -> Vec<String> {
    let described = described(verb);
    let told = described.get_arguments().filter(|option| !option.is_hide_set());
    let names = told.filter_map(|option| option.get_long()).map(String::from);
    names.filter(|name| !["help", "version"].contains(&name.as_str())).collect()
}

/// Returns the verbs without verbs below them.
fn verbs(command: &Command, above: &str, all: &mut Vec<String>) {
    for verb in command.get_subcommands() {
        let name = format!("{above} {}", verb.get_name()).trim_start().to_string();
        match verb.has_subcommands() {
            true => verbs(verb, &name, all),
            false => all.push(name),
        }
    }
}

/// Writes a design of two registers with its scene, whose cost is counted in a second.
fn prepare_design(dir: &Path) {
    let design = "module small(input clk, rst, a, b, output reg pwm, dir);\n\
                  always @(posedge clk) if (rst) {pwm, dir} <= 0; else {pwm, dir} <= {a, b};\nendmodule\n";
    fs::write(dir.join("small.v"), design).expect("a design");
    let scene = "about = \"small\"\ndevice = { kind = \"motor\", motor = \"vasudevan_2007\", wheel_ratio = 7 }\n\
                 clock = { frequency = \"10 MHz\" }\nwall = { position = \"1.5 rad\" }\nrun = { duration = \"1 ms\" }\n\
                 hand = { kind = \"constant_torque\", torque = \"1 mN.m\" }\n[dut]\nfiles = [\"small.v\"]\n\
                 top = \"small\"\nclock = \"clk\"\nreset = { port = \"rst\" }\nports = { a = \"encoder.a\", \
                 b = \"encoder.b\", pwm = \"bridge.pwm\", dir = \"bridge.direction\" }\n";
    fs::write(dir.join("design.toml"), scene).expect("a scene");
}

/// Makes a sweep that is planned and one that is done, two small studies, and a Slurm that has no jobs.
fn prepare_sweeps(dir: &Path) {
    let map = "name = \"tiny\"\ntitle = \"Tiny\"\n[map]\nscene = \"free-motion\"\nset = [\"run.duration=3 ms\"]\n\
               x = \"device.coulomb_friction=0.1..10 mN.m:3\"\ny = \"device.initial_speed=100..300 rad/s:3\"\n";
    fs::write(dir.join("map.toml"), map).expect("a study");
    let lines = "name = \"tiny\"\ntitle = \"Tiny\"\n[[group]]\nname = \"g\"\n[[group.line]]\nwhat = \"x\"\n\
                 text = \"{run.outcome}\"\nmeasure.run = { measure = \"run\", scene = \"one-tick\" }\n";
    fs::write(dir.join("lines.toml"), lines).expect("a study");
    fs::write(dir.join("log.csv"), "time_ms,count\n0,0\n1,180\n2,340\n3,480\n").expect("a log");
    let fine = |words: &[&str]| {
        let output = hpu().current_dir(dir).args(words).output().expect("starts");
        assert!(output.status.success(), "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
    };
    fine(&["sweep", "plan", "map.toml", "--out", "PLANNED", "--shard-points", "2"]);
    fine(&["sweep", "run", "lines.toml", "--out", "DONE", "--shard-points", "2"]);
    fs::create_dir_all(dir.join("tools")).expect("a folder");
    for tool in ["squeue", "scontrol", "scancel"] {
        let path = dir.join("tools").join(tool);
        // Longer than the time limit that is tried.
        fs::write(&path, "#!/bin/sh\nsleep 0.05\n").expect("a tool");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("the owner's");
    }
}

/// Tries the options of the modes whose number leaves this remainder by four: the tests of a file run side by side.
fn tried(rest: usize) {
    let dir = scratch(&format!("options-{rest}"));
    fs::write(dir.join("in.csv"), "a,b\n60,70\n").expect("rows");
    fs::write(dir.join("page.html"), "<script type=\"application/json\" id=\"start\">{}</script>").expect("a page");
    let counter = "# position_counter in rst(0,1,0) step(1,1,0) out position(0,12,0) generics WIDTH=12";
    fs::write(dir.join("wrong.txt"), format!("{counter}\n1 0 001\n# end 1 rows\n")).expect("vectors");
    prepare_design(&dir);
    prepare_sweeps(&dir);
    let (mut number, mut ignored) = (0, Vec::new());
    for (verb, mode, own) in MODES.iter().skip(rest).step_by(4) {
        let base: Vec<String> = [*verb, *mode].concat().into_iter().map(String::from).collect();
        let mut run = |words: &[String]| {
            number += 1;
            found(&dir, number, words)
        };
        let (one, same) = (run(&base), run(&base));
        for option in options(verb) {
            let is_unseen = UNSEEN.iter().any(|(of, unseen, beside)| {
                (*of, *unseen) == (verb[0], &option) && (beside.is_empty() || mode.contains(beside))
            });
            if WITHOUT_EFFECT.contains(&&*option) || is_unseen {
                continue;
            }
            let given = own.iter().chain(GIVEN).find(|(name, _)| *name == option);
            let given = given.unwrap_or_else(|| panic!("--{option} of {verb:?} is not tried")).1;
            let words: Vec<String> = base.iter().cloned().chain(given.iter().map(ToString::to_string)).collect();
            let other = run(&words);
            let is_refused = other.code == Some(2) && other.refusal.contains(&format!("--{option}"));
            if !is_refused && !differs(&one, &same, &other) {
                ignored.push(words.join(" "));
            }
        }
    }
    assert!(ignored.is_empty(), "these options are ignored:\n{}", ignored.join("\n"));
}

#[test]
fn every_option_of_every_mode_has_an_effect_or_is_refused_first_quarter() {
    tried(0);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn every_option_of_every_mode_has_an_effect_or_is_refused_second_quarter() {
    tried(1);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn every_option_of_every_mode_has_an_effect_or_is_refused_third_quarter() {
    tried(2);
}

#[test]
#[ignore = "testbench/long.sh runs it"]
fn every_option_of_every_mode_has_an_effect_or_is_refused_last_quarter() {
    tried(3);
}

#[test]
fn every_verb_has_a_mode_whose_options_are_tried() {
    let mut all = Vec::new();
    verbs(&hpu_cli::description(), "", &mut all);
    let tried: BTreeSet<String> = MODES.iter().map(|(verb, ..)| verb.join(" ")).collect();
    let alike = |verb: &String| ALIKE.into_iter().find(|(one, _)| one == verb);
    let left: Vec<_> = all.iter().filter(|verb| !tried.contains(*verb) && alike(verb).is_none()).collect();
    assert!(left.is_empty(), "{left:?}");
    for (verb, other) in ALIKE {
        assert!(tried.contains(other), "{other} stands for {verb}");
        let of = |verb: &str| options(&verb.split(' ').collect::<Vec<_>>());
        let known = of(other);
        let unknown: Vec<_> = of(verb).into_iter().filter(|option| !known.contains(option)).collect();
        assert!(unknown.is_empty(), "{verb} has more options than {other}: {unknown:?}");
    }
}

#[test]
fn an_option_of_another_mode_is_refused_with_the_mode_that_reads_it() {
    for (words, said) in [
        (
            &["vectors", "pwm", "--set", "WIDTH=14"][..],
            "--set has no effect on vectors of blocks alone; --set-kind scene reads it; --variant LABEL or --generic \
             NAME=VALUE chooses a configuration",
        ),
        (
            &["cost", "--scene", "free-motion", "--variant", "8_bit"],
            "--variant has no effect on a scene's loop; a block's NAME reads it",
        ),
        (
            &["vectors", "pwm", "--scene", "hybrid-wall"],
            "--scene has no effect on vectors of blocks alone; --set-kind scene reads it",
        ),
        (&["run", "hybrid-wall", "--hdl", "hdl"], "--driver rtl reads it"),
        (&["check", "--formal", "pwm", "--rows", "9"], "--rows has no effect on a proof"),
        (&["run", "hybrid-wall", "--tool-timeout", "9"], "a scene with a [dut] reads it"),
        (&["limits", "hybrid-wall", "--tool-timeout", "9"], "a scene with a [dut] reads it"),
        (&["vectors", "--update", "--seed", "3"], "--seed has no effect on --update; the committed vectors have"),
        (&["map", "--from", "/nowhere", "--cell-events", "3"], "--cell-events has no effect on --from; the sweep's"),
        (&["sweep", "plan", "testbench", "--section", "map"], "--section: testbench is the folder of a sweep"),
        (
            &["sweep", "submit", "testbench", "--engine", "parallel", "--tool-timeout", "9"],
            "--tool-timeout has no effect on GNU parallel; --engine slurm reads it",
        ),
        (&["sweep", "run", "testbench", "--out", "/nowhere"], "--out: testbench is the folder of a sweep"),
    ] {
        let words: Vec<String> = words.iter().map(ToString::to_string).collect();
        let found = found(&scratch("options-refused"), 0, &words);
        assert_eq!(found.code, Some(2), "{words:?}: {}", found.refusal);
        assert!(found.refusal.starts_with("error: --") && found.refusal.contains(said), "{}", found.refusal);
    }
}
