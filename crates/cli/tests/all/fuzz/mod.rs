//! Random commands with sensible values and values at their limits: no panic, no hang, every exit code in the contract,
//! no files left behind, no file changed outside the folder of `-o`, no text of somebody else read as code.
//!
//! Shipped scenes are changed in any of their keys, to the limits of the accepted values and between; parts of some
//! files are replaced as text. Every verb runs with a small budget, as a process of its own. `HPU_FUZZ` is the number
//! of commands [60], `HPU_FUZZ_SEED` the seed [1], `HPU_FUZZ_FIRST` the number of the first command [0],
//! `HPU_FUZZ_FOLDER` the folder of its files [fuzz], `HPU_FUZZ_FOREIGN` the share in percent of scenes, studies,
//! designs and sweeps by somebody else [20]. Each command depends only on the seed and its number. A failure is
//! reported with its number and reduced to a smaller case, whose command and files stay in a folder.

mod command;
mod foreign;
mod keys;

use std::collections::BTreeMap;
use std::env;
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use hpu_cosim::scene::{Shipped, shipped};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

use crate::common::{scratch, steers};
use command::VERBS;
use keys::Key;

/// The limit of a command's processor time in seconds. Elapsed time would depend on the other work of the machine.
const MOST_CPU_S: u64 = 20;
/// The limit of a command's elapsed time.
const LONGEST: Duration = Duration::from_secs(180);
/// The memory that a command may allocate, in KiB.
const MOST_KIB: u64 = 4 << 20;
/// Attempts to reduce a failure to a smaller case.
const MOST_SHRINKS: usize = 40;

/// The parts of a command.
#[derive(Clone, Debug)]
pub struct Case {
    verb: usize,
    scene: usize,
    /// Key, kind of value, and place in its range.
    changes: Vec<(u16, u8, f64)>,
    numbers: [u32; 4],
    spoilt: Option<Spoilt>,
}

/// A change to the text of a file.
#[derive(Clone, Debug)]
pub struct Spoilt {
    at: f64,
    length: usize,
    with: String,
}

impl Spoilt {
    /// Returns the text with a part replaced.
    fn text(&self, text: &str) -> String {
        let bound = |byte: usize| (byte..=text.len()).find(|&byte| text.is_char_boundary(byte)).unwrap_or(text.len());
        let from = bound((self.at * text.len() as f64) as usize);
        let to = bound((from + self.length).min(text.len()));
        format!("{}{}{}", &text[..from], self.with, &text[to..])
    }
}

fn cases() -> impl Strategy<Value = Case> {
    // Most cases are runs, which are quick.
    let foreign = number("HPU_FUZZ_FOREIGN", 20).min(100) as u32;
    let verb = prop_oneof![
        (100 - foreign) => 0..3usize,
        (100 - foreign) => 3..VERBS.len(),
        2 * foreign => VERBS.len()..VERBS.len() + foreign::VERBS.len(),
    ];
    let changes = vec((any::<u16>(), 0..8u8, 0.0..1.0), 0..6);
    let with = prop_oneof![Just(String::new()), "[ -~]{1,6}", "[\\PC]{1,3}", Just("\n".into()), Just("1e308".into())];
    let spoilt = (0.0..1.0, 0..30usize, with).prop_map(|(at, length, with)| Spoilt { at, length, with });
    let spoilt = proptest::option::weighted(0.04, spoilt);
    (verb, any::<prop::sample::Index>(), changes, any::<[u32; 4]>(), spoilt).prop_map(
        |(verb, scene, changes, numbers, spoilt)| Case {
            verb,
            scene: scene.index(shipped().len()),
            changes,
            numbers,
            spoilt,
        },
    )
}

/// The result of a command.
struct Done {
    exit: String,
    seconds: f64,
    /// The fault, if there is one.
    wrong: Option<String>,
    stderr: String,
}

/// The commands of a verb with the same exit.
#[derive(Default)]
struct Tally {
    commands: u64,
    seconds: f64,
    longest_s: f64,
    /// The number of the command that took longest.
    longest: u64,
}

fn finished(child: &mut Child) -> bool {
    child.try_wait().expect("it is a child").is_some()
}

/// Returns the name of a case's verb.
fn verb(case: &Case) -> &'static str {
    VERBS.iter().chain(&foreign::VERBS).nth(case.verb).expect("a verb")
}

/// Runs a command. `path` are the folders of tools that it finds.
fn run(arguments: &[String], dir: &Path, path: &str) -> Done {
    let tmp = dir.with_extension("tmp");
    fs::create_dir_all(&tmp).expect("a folder");
    let seen = crate::common::seen(dir);
    let before = Instant::now();
    let [out, err] = ["stdout", "stderr"].map(|name| fs::File::create(tmp.with_extension(name)).expect("a file"));
    let mut child = Command::new("/bin/sh")
        .args([
            "-c",
            &format!("ulimit -v {MOST_KIB}; ulimit -t {MOST_CPU_S}; exec \"$0\" \"$@\""),
            env!("CARGO_BIN_EXE_hpu"),
        ])
        .args(arguments)
        .current_dir(dir)
        .env("TMPDIR", &tmp)
        .env("PATH", path)
        .env("HOME", &tmp)
        .stdin(Stdio::null())
        .stdout(out)
        .stderr(err)
        .spawn()
        .expect("the command starts");
    let mut pause = Duration::from_micros(500);
    while !finished(&mut child) && before.elapsed() < LONGEST {
        thread::sleep(pause);
        pause = (pause * 5 / 4).min(Duration::from_millis(20));
    }
    let seconds = before.elapsed().as_secs_f64();
    let hangs = !finished(&mut child);
    if hangs {
        child.kill().expect("it is a child");
    }
    let status = child.wait().expect("it has ended");
    let [stdout, stderr] = ["stdout", "stderr"]
        .map(|name| String::from_utf8_lossy(&fs::read(tmp.with_extension(name)).expect("its words")).into_owned());
    let exit = match (hangs, status.code(), status.signal()) {
        (true, ..) => "hangs".to_string(),
        (_, Some(code), _) => code.to_string(),
        // SIGXCPU or SIGKILL: the command has reached its time limit.
        (.., Some(24 | 9)) => "hangs".to_string(),
        (.., signal) => format!("signal {}", signal.unwrap_or(0)),
    };
    let left: Vec<_> =
        crate::common::names(dir).into_iter().filter(|name| name.starts_with('.') || name.ends_with(".tmp")).collect();
    // The cache of the user is there.
    let temporary: Vec<_> = crate::common::names(&tmp).into_iter().filter(|name| name != ".cache").collect();
    let is_text = !arguments.iter().any(|argument| argument == "--json");
    let wrong = if !["0", "1", "2", "3", "4"].contains(&exit.as_str()) {
        Some(format!("exit {exit}"))
    } else if exit == "1" && arguments.iter().any(|argument| argument == "--compare") {
        Some("the drivers differ".to_string())
    } else if stderr.contains("panicked") {
        Some("a panic".to_string())
    } else if foreign::is_code([dir, &tmp]) {
        Some("a text was read as code".to_string())
    } else if crate::common::seen(dir) != seen {
        Some("a file outside of `out` has changed".to_string())
    } else if steers(&stderr) || steers(&stdout) && arguments[0] != "scene" {
        // A scene that is shown is a file's content, and as it is but on a terminal.
        Some("a text that steers a terminal".to_string())
    } else if ["2", "3", "4"].contains(&exit.as_str()) && !stderr.lines().any(|line| line.starts_with("error: ")) {
        Some("a refusal without a word".to_string())
    } else if !left.is_empty() || !temporary.is_empty() {
        Some(format!("left behind: {left:?} {temporary:?}"))
    } else if has_long_number(&stderr) {
        Some("a message with a number of many digits".to_string())
    } else if ["run", "limits", "fit"].contains(&arguments[0].as_str()) && is_text && stdout.contains("NaN") {
        Some("NaN is told as a result".to_string())
    } else {
        None
    };
    Done { exit, seconds, wrong, stderr }
}

fn has_long_number(text: &str) -> bool {
    text.split(|c: char| !c.is_ascii_digit()).any(|digits| digits.len() > 40) || text.contains(" 0.000000 ")
}

fn empty(dir: &Path) {
    for old in [dir.to_path_buf(), dir.with_extension("tmp")] {
        if old.exists() {
            fs::remove_dir_all(old).expect("an old folder goes");
        }
    }
    fs::create_dir_all(dir).expect("a folder");
}

/// Runs the command of a case in an empty folder. Returns its arguments and its result.
fn done(case: &Case, scenes: &[Shipped], keys: &[Vec<Key>], dir: &Path) -> (Vec<String>, Done) {
    empty(dir);
    let arguments = arguments(case, scenes, keys, dir);
    // Some designs are simulated; most only read.
    let has_tools = verb(case) == "foreign design" && case.numbers[3].is_multiple_of(20);
    let path = if has_tools { env::var("PATH").expect("a PATH") } else { String::new() };
    let done = run(&arguments, dir, &path);
    (arguments, done)
}

fn arguments(case: &Case, scenes: &[Shipped], keys: &[Vec<Key>], dir: &Path) -> Vec<String> {
    match VERBS.get(case.verb) {
        Some(_) => command::arguments(case, scenes, keys, dir),
        None => foreign::arguments(verb(case), case, dir),
    }
}

fn number(name: &str, otherwise: u64) -> u64 {
    env::var(name).map_or(otherwise, |text| text.parse().unwrap_or_else(|_| panic!("{name}={text} is no number")))
}

#[test]
fn commands_at_random_end_as_the_contract_says() {
    let (count, seed, first) = (number("HPU_FUZZ", 60), number("HPU_FUZZ_SEED", 1), number("HPU_FUZZ_FIRST", 0));
    let scenes = shipped();
    let keys: Vec<Vec<Key>> = scenes.iter().map(keys::keys).collect();
    assert!(keys.iter().all(|keys| keys.len() > 15), "what scenes take is read from their refusals");
    let folder = scratch(&env::var("HPU_FUZZ_FOLDER").unwrap_or_else(|_| "fuzz".to_string()));
    let (start, mut tally, mut failures) = (Instant::now(), BTreeMap::<(&str, String), Tally>::new(), Vec::new());
    let mut told = Instant::now();
    for index in first..first + count {
        let mut bytes = [0; 32];
        bytes[..8].copy_from_slice(&seed.to_le_bytes());
        bytes[8..16].copy_from_slice(&index.to_le_bytes());
        let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &bytes);
        let mut tree = cases().new_tree(&mut TestRunner::new_with_rng(Config::default(), rng)).expect("a case");
        let dir = folder.join("now");
        let case = tree.current();
        let (mut arguments, mut done) = done(&case, scenes, &keys, &dir);
        let entry = tally.entry((verb(&case), done.exit.clone())).or_default();
        entry.commands += 1;
        entry.seconds += done.seconds;
        if done.seconds > entry.longest_s {
            (entry.longest_s, entry.longest) = (done.seconds, index);
        }
        if done.wrong.is_some() {
            let (kind, mut least) = (done.exit.clone(), case.clone());
            for _ in 0..MOST_SHRINKS {
                if !tree.simplify() {
                    break;
                }
                let (smaller, its) = self::done(&tree.current(), scenes, &keys, &dir);
                if its.wrong.is_some() && its.exit == kind {
                    least = tree.current();
                    (arguments, done) = (smaller, its);
                } else if !tree.complicate() {
                    break;
                }
            }
            let line: Vec<_> = arguments.iter().map(|word| format!("'{word}'")).collect();
            let wrong = done.wrong.unwrap_or_default();
            let said: String = done.stderr.chars().take(600).collect();
            failures.push(format!(
                "HPU_FUZZ_SEED={seed} HPU_FUZZ_FIRST={index} HPU_FUZZ=1: {wrong}\n  hpu {}\n  {said}",
                line.join(" ")
            ));
            eprintln!("{}", failures[failures.len() - 1]);
            // Writes its files again, in the place of those of the last attempt.
            empty(&dir);
            self::arguments(&least, scenes, &keys, &dir);
            let kept = folder.join(format!("case-{index}"));
            fs::rename(&dir, &kept).expect("its files stay");
            if failures.len() >= 25 {
                break;
            }
        }
        if told.elapsed() > Duration::from_secs(30) {
            told = Instant::now();
            eprintln!("{} of {count} commands, {} failures", index + 1 - first, failures.len());
        }
    }
    let all: u64 = tally.values().map(|tally| tally.commands).sum();
    let own = || tally.iter().filter(|((verb, _), _)| VERBS.contains(verb));
    let ours: u64 = own().map(|(_, tally)| tally.commands).sum();
    let past = own().filter(|((_, exit), _)| ["0", "1"].contains(&exit.as_str()));
    let past: u64 = past.map(|(_, tally)| tally.commands).sum();
    for ((verb, exit), Tally { commands, seconds, longest_s, longest }) in &tally {
        println!(
            "{verb:<18} exit {exit:<10} {commands:>7}, {seconds:.0} s, the longest {longest_s:.2} s (number {longest})"
        );
    }
    let seconds = start.elapsed().as_secs_f64();
    println!(
        "{all} commands, {past} of {ours} of our own past reading, {:.1} a second, {} failures",
        all as f64 / seconds,
        failures.len()
    );
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    assert!(ours < 50 || past * 10 >= ours * 9, "only {past} of {ours} commands got past reading");
}
