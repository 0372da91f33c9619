//! The command's descriptions of itself: version, completions for shells, manual pages.

use std::collections::BTreeSet;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::{assert_refused, code, names, run, scratch, stderr, stdout, text};

#[allow(dead_code, reason = "the build script uses the rest")]
#[path = "../../build/commit.rs"]
mod commit;

/// Returns every verb, with the name of the study or verb below it where there is one.
fn verbs() -> Vec<Vec<String>> {
    fn below(command: &clap::Command, above: &[String], all: &mut Vec<Vec<String>>) {
        for verb in command.get_subcommands() {
            let name = [above, &[verb.get_name().to_string()]].concat();
            below(verb, &name, all);
            all.push(name);
        }
    }
    let mut all = Vec::new();
    below(&hpu_cli::description(), &[], &mut all);
    assert!(all.len() > 20 && all.contains(&vec!["run".to_string()]), "{all:?}");
    all
}

#[test]
fn the_first_page_of_help_has_twenty_verbs_under_four_headings() {
    let help = stdout(&run(&["--help"]));
    let is_heading = |line: &&str| !line.starts_with(' ') && line.ends_with(':') && *line != "Options:";
    let verb = |line: &str| Some(line.strip_prefix("  ")?.split_once(' ')?.0.to_string());
    assert_eq!(help.lines().filter(is_heading).count(), 4, "{help}");
    let verbs_of = |text: &str| text.lines().skip(1).map_while(verb).collect::<Vec<_>>();
    let headings = help.split("\n\n").filter(|part| part.lines().next().is_some_and(|line| is_heading(&line)));
    let mut listed: Vec<String> = headings.flat_map(verbs_of).collect();
    assert!(listed.len() <= 20, "{listed:?}");
    listed.extend(["certify", "export", "completions", "man"].map(String::from));
    listed.sort();
    let mut all: Vec<_> = verbs().into_iter().filter(|verb| verb.len() == 1).flatten().collect();
    all.sort();
    assert_eq!(listed, all);
}

/// Returns the long options of a verb, as its help lists them.
fn options(verb: &[String]) -> BTreeSet<String> {
    let verb: Vec<&str> = verb.iter().map(String::as_str).collect();
    let help = stdout(&run(&[&verb[..], &["--help"]].concat()));
    let lines = help.lines().filter(|line| line.trim_start().starts_with('-'));
    let words = lines.flat_map(|line| line.split_whitespace().take(2)).filter(|word| word.starts_with("--"));
    words.map(|word| word.split([',', '[']).next().unwrap_or(word).to_string()).collect()
}

/// Returns the text of one option in the help of a verb, without line breaks; `None` where the verb has no such option.
fn said_of(verb: &[String], option: &str) -> Option<String> {
    let verb: Vec<&str> = verb.iter().map(String::as_str).collect();
    let help = stdout(&run(&[&verb[..], &["--help"]].concat()));
    let has = |line: &&str| line.trim_start().starts_with('-') && line.split([' ', ',']).any(|word| word == option);
    let mut lines = help.lines().skip_while(|line| !has(line));
    let first = lines.next()?.trim().to_string();
    let rest =
        lines.map(str::trim).take_while(|line| !line.is_empty() && !line.starts_with("--") && !line.starts_with("-o"));
    let all = std::iter::once(first).chain(rest.map(str::to_string)).collect::<Vec<_>>().join(" ");
    Some(all.split_whitespace().collect::<Vec<_>>().join(" "))
}

#[test]
fn options_of_many_verbs_are_the_same_in_all_of_them() {
    let all = |option: &str| -> Vec<(String, String)> {
        let said = |verb: &Vec<String>| Some((verb.join(" "), said_of(verb, option)?));
        verbs().iter().filter_map(said).collect()
    };
    let jobs = all("--jobs");
    let with_jobs = [
        "check",
        "limits",
        "map",
        "chart",
        "widths",
        "cost",
        "study",
        "sweep run",
        "reproduce phantom-table-2",
        "reproduce phantom-ladder",
        "reproduce phantom-cost",
        "reproduce phantom-lag",
        "reproduce hybrid-loop",
        "reproduce input-shaper",
        "reproduce criteria",
        "reproduce power-scaling",
        "reproduce three-dof",
        "reproduce epfl-paddle",
    ];
    for verb in with_jobs {
        let (_, said) = jobs.iter().find(|(of, _)| of == verb).unwrap_or_else(|| panic!("{verb} has no --jobs"));
        assert_eq!(said, "-j, --jobs <N> Jobs at a time [default: one for each core]", "{verb}");
        let place: Vec<&str> = verb.split(' ').collect();
        assert_refused(
            &run(&[&place[..], &["-j", "0"]].concat()),
            2,
            &["'--jobs <N>': write a whole number from 1, as in 2"],
        );
    }
    assert_eq!(jobs.len(), with_jobs.len(), "{jobs:?}");
    let notation = all("--notation");
    let with_notation = ["run", "block", "widths", "reproduce phantom-formats", "reproduce phantom-sines"];
    for verb in with_notation {
        let (_, said) =
            notation.iter().find(|(of, _)| of == verb).unwrap_or_else(|| panic!("{verb} has no --notation"));
        assert_eq!(said, "--notation <NOTATION> How word formats are written [default: triple]", "{verb}");
        let place: Vec<&str> = verb.split(' ').collect();
        let refused = run(&[&place[..], &["--notation", "floats"]].concat());
        assert_refused(
            &refused,
            2,
            &["invalid value 'floats' for '--notation", "possible values: triple, vhdl, cpp, q"],
        );
    }
    assert_eq!(notation.len(), with_notation.len(), "{notation:?}");
}

fn feed(program: &str, arguments: &[&str], input: &str) -> (bool, String) {
    let mut command = Command::new(program);
    let child = command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let mut child = child.unwrap_or_else(|error| panic!("{program}: {error}; testbench/test.sh installs it"));
    // The pipe is taken, so that it is closed.
    child.stdin.take().expect("a pipe").write_all(input.as_bytes()).expect("is read");
    let output = child.wait_with_output().expect("ends");
    (output.status.success(), stderr(&output))
}

#[test]
fn every_shell_gets_a_completion_with_every_verb_and_bash_parses_its_own() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = run(&["completions", shell]);
        assert_eq!((code(&output), stderr(&output)), (0, String::new()), "{shell}");
        let script = stdout(&output);
        for verb in verbs().iter().flatten() {
            assert!(script.contains(verb.as_str()), "{shell}: {verb}");
        }
    }
    let script = stdout(&run(&["completions", "bash"]));
    for verb in verbs() {
        let case = format!("hpu__subcmd__{}", verb.join("-").replace('-', "__subcmd__"));
        let cased = script.split_once(&format!("        {case})\n"));
        let words = cased.unwrap_or_else(|| panic!("no {case}")).1.lines().next().expect("its words");
        for option in options(&verb) {
            assert!(words.contains(&option), "{verb:?} {option}: {words}");
        }
    }
    let (parsed, said) = feed("bash", &["-n"], &script);
    assert!(parsed && said.is_empty(), "{said}");
    assert_refused(&run(&["completions", "tcsh"]), 2, &["tcsh", "bash", "zsh"]);
}

#[test]
fn bash_completes_verbs_and_their_options() {
    let script = stdout(&run(&["completions", "bash"]));
    // Calls the completion as bash does: the command, the word to complete, the word before it.
    let ask = |words: &[&str]| {
        let [.., before, word] = words else { panic!("two words at least") };
        let asked = format!("COMP_WORDS=({}); COMP_CWORD={}", words.join(" "), words.len() - 1);
        let asked = format!("{script}\n{asked}; _hpu hpu '{word}' '{before}'; echo \"${{COMPREPLY[*]}}\"");
        let output = Command::new("bash").args(["-c", &asked]).output().expect("bash");
        stdout(&output).trim().to_string()
    };
    assert_eq!(ask(&["hpu", "ch"]), "check chart");
    assert_eq!(ask(&["hpu", "run", "hybrid-wall", "--comp"]), "--compare");
    assert_eq!(ask(&["hpu", "reproduce", "hybrid-loop", "--j"]), "--jobs --json");
}

#[test]
fn every_verb_has_a_manual_page_with_its_options_that_renders_without_a_warning() {
    let out = scratch("manual").join("man1");
    let output = run(&["man", "-o", text(&out)]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let mut expected: Vec<String> = verbs().iter().map(|verb| format!("hpu-{}.1", verb.join("-"))).collect();
    expected.push("hpu.1".into());
    expected.sort();
    assert_eq!(names(&out), expected);
    let page = |name: &str| fs::read_to_string(out.join(name)).expect("a page");
    for verb in verbs() {
        let text = page(&format!("hpu-{}.1", verb.join("-")));
        for option in options(&verb) {
            assert!(text.contains(&option.replace('-', "\\-")), "{verb:?}: {option}");
        }
        if let [verb] = &verb[..] {
            assert!(page("hpu.1").contains(&format!("hpu\\-{verb}(1)")), "{verb}");
        }
    }
    for name in names(&out) {
        let text = page(&name);
        assert!(text.contains(".SH NAME\n") && text.contains(".SH SYNOPSIS\n"), "{name}");
        let (rendered, said) = feed("groff", &["-ww", "-man", "-Tutf8"], &text);
        assert!(rendered && said.is_empty(), "{name}: {said}");
    }
    assert_eq!(stdout(&run(&["man"])), page("hpu.1"));
    assert_eq!(stdout(&run(&["man", "reproduce", "hybrid-loop"])), page("hpu-reproduce-hybrid-loop.1"));
    assert_refused(&run(&["man", "telepathy"]), 2, &["`telepathy`", "run", "reproduce"]);
}

fn git(dir: &Path, arguments: &[&str]) -> String {
    let who = ["-c", "user.name=n", "-c", "user.email=e", "-c", "commit.gpgsign=false"];
    let output = Command::new("git").arg("-C").arg(dir).args(who).args(arguments).output().expect("git");
    assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    stdout(&output).trim().to_string()
}

#[test]
fn the_version_has_the_commit_of_its_own_work_tree_and_whether_sources_were_changed_since() {
    let said = stdout(&run(&["--version"]));
    let known = format!("hpu {}", env!("CARGO_PKG_VERSION"));
    assert!(said.starts_with(&known) && said.lines().count() == 1, "{said}");

    // The folder is outside the project's work tree, which contains the folder of the tests.
    let dir = std::env::temp_dir().join(format!("hpu-commit-{}", std::process::id()));
    let source = dir.join("crates/any/src/lib.rs");
    fs::create_dir_all(source.parent().expect("a folder")).expect("a folder");
    fs::write(&source, "one\n").expect("a source");
    fs::write(dir.join("README.md"), "one\n").expect("a text");
    let version = || commit::version(&dir, "1.2.3");
    assert_eq!(version(), "1.2.3", "no work tree");
    assert_eq!(commit::watched(&dir), Vec::<std::path::PathBuf>::new());

    git(&dir, &["init", "-q"]);
    git(&dir, &["add", "."]);
    git(&dir, &["commit", "-qm", "one"]);
    let short = git(&dir, &["rev-parse", "--short", "HEAD"]);
    assert_eq!(version(), format!("1.2.3 ({short})"));
    let watched = commit::watched(&dir);
    for path in [".git/logs/HEAD", ".git/HEAD", "crates/any/src"] {
        assert!(watched.contains(&dir.join(path)), "{path}: {watched:?}");
    }
    assert!(watched.iter().all(|path| path.exists()), "cargo would build again for ever: {watched:?}");

    fs::write(dir.join("README.md"), "two\n").expect("a text");
    assert_eq!(version(), format!("1.2.3 ({short})"), "the program is the same");
    fs::write(&source, "two\n").expect("a source");
    assert_eq!(version(), format!("1.2.3 ({short}-dirty)"));
    // Sources inside another project's work tree do not have its commit.
    assert_eq!(commit::version(&dir.join("crates"), "1.2.3"), "1.2.3");
    fs::remove_dir_all(&dir).expect("goes");
}
