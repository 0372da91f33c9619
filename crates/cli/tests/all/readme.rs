//! README.md and the book: every command in them runs, and the output shown below a command is its output. Every figure
//! of them comes from a run or a record, or is listed as one that depends on the machine or is from the literature.
//! Every link of them and of the other pages at the top leads to a file, and to a heading in it.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::common::{ROOT, code, scratch, stderr, stdout};
use crate::readme_tables::{COMMANDS, EXCEPTED, FIGURES, Form, From};

/// A piece of a page: a command, the output that is shown below the commands before it, or a file for the commands
/// after it.
#[derive(Debug)]
enum Piece {
    Command(String),
    Output(Vec<String>),
    File { name: String, text: String },
}

/// Returns a line of a shell without its comment, which begins with ` #` outside quotes; `None` while a quote is open.
fn without_comment(text: &str) -> Option<String> {
    let (mut quoted, mut kept, mut before) = (false, String::new(), ' ');
    for c in text.chars() {
        quoted ^= c == '\'';
        if !quoted && c == '#' && before.is_whitespace() {
            break;
        }
        kept.push(c);
        before = c;
    }
    (!quoted).then(|| kept.trim().to_string())
}

/// Returns the commands of a fenced block of shell.
fn commands(block: &[&str]) -> Vec<Piece> {
    let mut found = Vec::new();
    let mut open = String::new();
    for line in block {
        open += if open.ends_with(' ') { line.trim_start() } else { line };
        // A line that ends with a backslash goes on in the next one.
        if let Some(begun) = open.strip_suffix('\\') {
            open = format!("{} ", begun.trim_end());
            continue;
        }
        match without_comment(&open) {
            Some(command) => {
                found.extend((!command.is_empty()).then_some(Piece::Command(command)));
                open.clear();
            }
            None => open.push('\n'),
        }
    }
    assert_eq!(open, "", "a quote is left open");
    found
}

/// Returns the code spans of a line that are commands of `hpu`.
fn spans(line: &str) -> impl Iterator<Item = String> {
    let spans = line.split('`').skip(1).step_by(2);
    spans.filter(|span| span.starts_with("hpu ") || span.starts_with("\u{2026} ")).map(str::to_string)
}

/// Returns all commands and outputs of a page, in its order.
fn pieces(text: &str) -> Vec<Piece> {
    let mut found = Vec::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let Some(language) = line.strip_prefix("```") else {
            found.extend(spans(line).map(Piece::Command));
            continue;
        };
        let block: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
        match language {
            "sh" => found.extend(commands(&block)),
            "" => found.push(Piece::Output(block.into_iter().map(str::to_string).collect())),
            "toml" => {
                let name =
                    block[0].strip_prefix("# ").expect("the first line of a file is `# ` and its name").to_string();
                found.push(Piece::File { name, text: block.join("\n") });
            }
            // The tests of the Python package run it, and hold what it prints against `text`.
            "python" | "text" => {}
            other => panic!("a block of {other}: write sh, toml, python with text, or nothing for an output"),
        }
    }
    found
}

/// Returns the form in which a command runs here.
fn form(command: &str) -> &'static Form {
    let listed = COMMANDS.iter().find(|(listed, _)| *listed == command);
    &listed.unwrap_or_else(|| panic!("`{command}` is not in the table of commands")).1
}

/// A folder of its own, with the command on the path, as README and the book assume.
struct Shell {
    dir: PathBuf,
    path: String,
}

impl Shell {
    fn new(name: &str) -> Self {
        let dir = scratch(name);
        fs::create_dir_all(dir.join("bin")).expect("a folder");
        symlink(env!("CARGO_BIN_EXE_hpu"), dir.join("bin/hpu")).expect("a link");
        let path = format!("{}:{}", dir.join("bin").display(), std::env::var("PATH").expect("a PATH"));
        fs::create_dir_all(dir.join("work")).expect("a folder");
        // The pages name files of the project in this folder.
        symlink(fs::canonicalize(ROOT).expect("the project").join("testbench"), dir.join("work/testbench"))
            .expect("a link");
        Self { path, dir: dir.join("work") }
    }

    fn command(&self, line: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", line]).current_dir(&self.dir).env("PATH", &self.path);
        command
    }

    fn run(&self, line: &str) -> Output {
        let output = self.command(line).output().expect("a shell");
        assert_eq!(code(&output), 0, "`{line}`: {}{}", stdout(&output), stderr(&output));
        output
    }

    /// Runs a command in its form, and returns what it prints.
    fn in_form(&self, command: &str, form: &Form) -> String {
        match form {
            Form::AsIs => stdout(&self.run(command)),
            Form::Short { line, why, .. } => {
                assert!(!why.is_empty());
                stdout(&self.run(line))
            }
            Form::Begun(why) => {
                assert!(!why.is_empty());
                self.begin(command);
                String::new()
            }
            Form::NotHere(why) => {
                assert!(!why.is_empty());
                String::new()
            }
        }
    }

    /// Begins a long command, and interrupts it. It must accept its arguments, and report the interruption.
    fn begin(&self, line: &str) {
        let quiet = self.dir.join("begun.txt");
        let mut child = self
            .command(&format!("exec {line}"))
            .stdout(fs::File::create(&quiet).expect("a file"))
            .stderr(fs::File::create(self.dir.join("begun.err")).expect("a file"))
            .spawn()
            .expect("a shell");
        let begun = Instant::now();
        while !catches_interrupts(child.id()) && begun.elapsed() < Duration::from_secs(10) {
            sleep(Duration::from_millis(5));
        }
        // The work begins after its arguments are read.
        sleep(Duration::from_millis(100));
        let interrupted = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill");
        assert!(interrupted.success(), "`{line}` ended at once");
        let code = child.wait().expect("an end").code();
        assert_eq!(code, Some(130), "`{line}`: {}", fs::read_to_string(&quiet).expect("a text"));
    }
}

/// Returns whether a process has a handler for SIGINT, according to `/proc`.
fn catches_interrupts(id: u32) -> bool {
    let status = fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    let caught = caught.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or_default();
    // The mask's lowest bit is signal 1; SIGINT is signal 2.
    caught & 0b10 != 0
}

/// Asserts that each line of a shown output is a line of the real output, in the same order; `…` stands for lines left
/// out.
fn assert_shown(page: &str, shown: &[String], output: &str, command: &str) {
    let mut lines = output.lines();
    for line in shown.iter().filter(|line| !["", "\u{2026}"].contains(&line.trim())) {
        let is_line = |other: &str| {
            if line.contains('\u{2026}') { holds(other, line) } else { other.trim_end() == line.trim_end() }
        };
        assert!(lines.any(is_line), "`{command}` does not print this line of {page}:\n{line}\nbut:\n{output}");
    }
}

/// Returns whether a line has these words in their order, whatever the spaces; `…` stands for any text.
fn holds(line: &str, words: &str) -> bool {
    let [line, words] = [line, words].map(|text| text.split_whitespace().collect::<Vec<_>>().join(" "));
    let mut rest = line.as_str();
    words.split('\u{2026}').map(str::trim).all(|part| {
        let at = rest.find(part);
        rest = at.map_or("", |at| &rest[at + part.len()..]);
        at.is_some()
    })
}

fn file(path: &str) -> String {
    fs::read_to_string(Path::new(ROOT).join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// Returns README.md and every page of the book, each as a file of the project and its text. README is the first.
fn pages() -> Vec<(String, String)> {
    fn add(folder: &str, pages: &mut Vec<String>) {
        for entry in fs::read_dir(Path::new(ROOT).join(folder)).expect("the pages of the book").flatten() {
            let page = format!("{folder}/{}", entry.file_name().display());
            if entry.path().is_dir() { add(&page, pages) } else { pages.push(page) }
        }
    }
    let mut pages = vec![];
    add("crates/book/pages", &mut pages);
    pages.sort();
    pages.insert(0, "README.md".to_string());
    pages.into_iter().map(|page| (page.clone(), file(&page))).collect()
}

/// What each command has printed, in the form in which it ran.
type Printed = Vec<(String, String)>;

fn printed_by<'p>(printed: &'p Printed, command: &str) -> Option<&'p str> {
    printed.iter().find(|(ran, _)| ran == command).map(|(_, output)| output.as_str())
}

/// Runs those commands of a page that have not run yet, and holds the shown outputs against what they print.
fn run_page(shell: &Shell, page: &str, text: &str, printed: &mut Printed) {
    let mut last = String::new();
    let mut unused = BTreeSet::new();
    for piece in pieces(text) {
        match piece {
            Piece::File { name, text } => {
                assert!(!shell.dir.join(&name).exists(), "{page}: another page has a file {name}");
                fs::write(shell.dir.join(&name), text).expect("a file");
                unused.insert(name);
            }
            Piece::Output(shown) => {
                let output = match form(&last) {
                    Form::Short { record: Some(path), .. } => &file(path),
                    _ => printed_by(printed, &last).expect("a command before"),
                };
                assert_shown(page, &shown, output, &last);
            }
            Piece::Command(command) => {
                unused.retain(|name| !command.contains(name.as_str()));
                if printed_by(printed, &command).is_none() {
                    let output = shell.in_form(&command, form(&command));
                    printed.push((command.clone(), output));
                }
                last = command;
            }
        }
    }
    assert!(unused.is_empty(), "no command of {page} takes these files: {unused:?}");
}

#[test]
fn every_command_runs_and_what_is_shown_is_what_it_prints() {
    let shell = Shell::new("readme");
    let mut printed = Printed::new();
    for (page, text) in pages() {
        run_page(&shell, &page, &text, &mut printed);
    }
    let listed = COMMANDS.iter().map(|(listed, _)| *listed);
    let gone: Vec<_> = listed.filter(|listed| printed_by(&printed, listed).is_none()).collect();
    assert!(gone.is_empty(), "these are in the table and in no page: {gone:?}");
    for (said, from, shown) in FIGURES {
        let output = match from {
            From::Run(command) => printed_by(&printed, command).expect("a command of a page"),
            From::File(path) => &file(path),
        };
        assert!(output.lines().any(|line| holds(line, shown)), "a page says `{said}`; `{shown}` is not in: {output}");
    }
}

/// Returns all pages as one line: without outputs, commands and links, but with the comments of commands.
fn prose() -> String {
    let text = pages().into_iter().map(|(_, text)| text).collect::<Vec<_>>().join("\n");
    let (mut all, mut lines) = (Vec::new(), text.lines());
    while let Some(line) = lines.next() {
        if !line.starts_with("```") {
            // Numbers of a list are no figures.
            let numbered = line.split_once(". ").filter(|(number, _)| number.parse::<u8>().is_ok());
            all.push(numbered.map_or(line, |(_, text)| text));
            continue;
        }
        let block = lines.by_ref().take_while(|line| *line != "```");
        let comments = block
            .filter(|_| ["```sh", "```toml"].contains(&line))
            .filter_map(|line| line.split_once("# ").map(|(_, said)| said));
        all.extend(comments);
    }
    let mut text = all.join(" ");
    for (open, close) in [("`hpu ", '`'), ("`\u{2026} ", '`'), ("](", ')')] {
        while let Some(at) = text.find(open) {
            let end = text[at + open.len()..].find(close).expect("it is closed");
            text.replace_range(at..=at + open.len() + end, "");
        }
    }
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn every_figure_comes_from_a_run_or_is_named_as_one_that_does_not() {
    let mut text = prose();
    let mut take = |said: &str| {
        assert!(text.contains(said), "`{said}` is in the table of figures and in no page");
        text = text.replace(said, "");
    };
    FIGURES.iter().map(|(said, ..)| *said).collect::<BTreeSet<_>>().into_iter().for_each(&mut take);
    for (said, why) in EXCEPTED {
        assert!(!why.is_empty());
        take(said);
    }
    let left: Vec<&str> = text.split(' ').filter(|word| word.contains(|c: char| c.is_ascii_digit())).collect();
    assert!(left.is_empty(), "figures of README.md and the book that nothing is held against: {left:#?}");
}

/// Returns the targets of the links of a text.
pub fn links(text: &str) -> impl Iterator<Item = &str> {
    text.split("](").skip(1).filter_map(|rest| rest.split_once(')').map(|(target, _)| target))
}

/// Returns the anchors of the headings of a page, as GitHub makes them.
fn anchors(text: &str) -> BTreeSet<String> {
    let headings = text.lines().filter_map(|line| line.trim_start_matches('#').strip_prefix(' '));
    let kept = |c: char| c.is_alphanumeric() || "-_ ".contains(c);
    let lower = headings.map(|heading| heading.to_lowercase().chars().filter(|c| kept(*c)).collect::<String>());
    lower.map(|heading| heading.replace(' ', "-")).collect()
}

#[test]
fn every_link_leads_to_a_file_and_a_heading() {
    let tops = ["ARCHITECTURE.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md", "crates/capi/README.md"];
    let tops = tops.map(|page| (page.to_string(), file(page)));
    let mut seen = 0;
    for (page, text) in tops.into_iter().chain(pages()) {
        for link in links(&text).filter(|link| !link.contains("://")) {
            let (target, anchor) = link.split_once('#').unwrap_or((link, ""));
            let of_page = Path::new(ROOT).join(&page);
            let path = if target.is_empty() { of_page } else { of_page.with_file_name("").join(target) };
            assert!(path.exists(), "{page}: {link} leads nowhere");
            let is_heading = || anchors(&fs::read_to_string(&path).expect("a page")).contains(anchor);
            assert!(anchor.is_empty() || is_heading(), "{page}: {link} has no such heading");
            seen += 1;
        }
    }
    assert!(seen > 150, "{seen} links");
}
