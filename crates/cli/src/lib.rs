#![doc = include_str!("../README.md")]
//!
//! [`main`] is the command. [`answers`] gives the results of its verbs to programs that have no terminal.

pub mod answers;
mod shell;

mod beside;
mod block;
mod certificate;
mod certify;
mod chart;
mod check;
mod command;
mod cost;
mod diff;
mod document;
mod explore;
mod export;
mod fit;
mod identify;
mod journal;
mod keys;
mod limits;
mod map;
mod new;
mod notation;
mod page;
mod parameters;
mod price;
mod report;
mod reproduce;
mod run;
mod scene;
mod scenes;
mod study;
mod sweep;
mod vectors;
mod waves;
mod widths;
mod work;

use std::env;
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use hpu_page::quantities as units;
use hpu_rtl::temporary;

use crate::shell::exit::{Exit, Failure, refused};
use crate::shell::{interrupt, manual, modes, program, progress, terminal};

/// Cycle-accurate emulator of haptic FPGA datapaths.
///
/// Exit codes: 0 fine; 1 a mismatch, an unmet expectation; 2 wrong usage, an output place that cannot be used; 3 a
/// needed tool is missing or too old; 4 a bad scene, vector or data file, a write or a tool that failed; 130
/// interrupted (SIGINT); 143 terminated (SIGTERM), 129 and 131 likewise (SIGHUP, SIGQUIT).
#[derive(Parser)]
#[command(name = "hpu", version = env!("HPU_VERSION"), max_term_width = 100)]
struct Command {
    /// Show no progress: no bar on a terminal, no line every 10 s elsewhere
    #[arg(short, long, global = true)]
    quiet: bool,
    /// Refuse to simulate designs: a scene with a [dut] is code, which a simulation runs on this machine. So does
    /// HPU_NO_DUT=1 in the environment
    #[arg(long, global = true)]
    no_dut: bool,
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    Run(run::Args),
    Scenes(scenes::Args),
    New(new::Args),
    Keys(keys::Args),
    Block(block::Args),
    Vectors(vectors::Args),
    Check(check::Args),
    Limits(limits::Args),
    Certify(certify::Args),
    Export(export::Args),
    Map(map::Args),
    Chart(chart::Args),
    Fit(fit::Args),
    Identify(identify::Args),
    Diff(diff::Args),
    Report(report::Args),
    Widths(widths::Args),
    Cost(cost::Args),
    Study(study::Args),
    Sweep(sweep::Args),
    Explore(explore::Args),
    Reproduce(reproduce::Args),
    Completions(manual::CompletionArgs),
    Man(manual::ManArgs),
}

/// Runs the command whose arguments are those of this process.
pub fn main() -> ExitCode {
    ExitCode::from(ran(&env::args_os().collect::<Vec<_>>()))
}

/// Runs the command as a part of another program, such as Python, and returns the exit code. `words` are its name and
/// its arguments, `starter` is the file that starts it, and `code` is the file with its code.
///
/// May be called once a process, without a handler of SIGINT: it listens for signals itself, and a second signal ends
/// the process.
pub fn ran_in(words: &[OsString], starter: PathBuf, code: PathBuf) -> u8 {
    program::is_part(program::Files { starter, code });
    ran(words)
}

fn ran(words: &[OsString]) -> u8 {
    let command = match parsed(words) {
        Ok(command) => command,
        Err(refusal) if refusal.use_stderr() => return terminal::refuse(&refusal),
        // Help and the version are results like any other: a full disk is an error.
        Err(help) => return ended(terminal::print(&help.render().to_string()).map(|()| Exit::Fine)),
    };
    hpu_rtl::tell_notes(terminal::tell);
    if command.no_dut {
        hpu_rtl::dut::forbid();
    }
    if !command.quiet {
        progress::begin(&named(words.iter().skip(1)));
    }
    ended(interrupt::listen().and_then(|()| command.verb.call()))
}

impl Verb {
    fn call(self) -> Result<Exit, Failure> {
        match self {
            Self::Run(args) => run::run(&args),
            Self::Scenes(args) => scenes::run(&args),
            Self::New(args) => new::run(&args),
            Self::Keys(args) => keys::run(&args),
            Self::Block(args) => block::run(&args),
            Self::Vectors(args) => vectors::run(&args),
            Self::Check(args) => check::run(&args),
            Self::Limits(args) => limits::run(&args),
            Self::Certify(args) => certify::run(&args),
            Self::Export(args) => export::run(&args),
            Self::Map(args) => match args.from() {
                Some(dir) => sweep::show_map(&args, dir),
                None => map::run(&args),
            },
            Self::Chart(args) => chart::run(&args),
            Self::Fit(args) => fit::run(&args),
            Self::Identify(args) => identify::run(&args),
            Self::Diff(args) => diff::run(&args),
            Self::Report(args) => report::run(&args),
            Self::Widths(args) => match args.from() {
                Some(dir) => sweep::show_search(&args, dir),
                None => widths::run(&args),
            },
            Self::Cost(args) => cost::run(&args),
            Self::Study(args) => match args.from() {
                Some(dir) => sweep::show_lines(&args, dir),
                None => study::run(&args, &Command::command(), again),
            },
            Self::Sweep(args) => sweep::run(&args, &Command::command()),
            Self::Explore(args) => explore::run(&args),
            Self::Reproduce(args) => match args.from() {
                Some((name, args, dir)) => sweep::show_drops(name, args, dir),
                None => reproduce::run(&args),
            },
            Self::Completions(args) => manual::completions(&args, Command::command()),
            Self::Man(args) => manual::man(&args, Command::command()),
        }
    }
}

/// The verbs of the first page of help, under their headings.
const HEADINGS: [(&str, &[&str]); 4] = [
    ("Scenes", &["run", "scenes", "new", "keys", "diff", "report", "explore"]),
    ("Questions about a scene", &["limits", "map", "chart", "fit", "identify", "widths"]),
    ("Blocks and their VHDL", &["block", "vectors", "check", "cost"]),
    ("Many runs", &["study", "sweep", "reproduce"]),
];

/// Returns the description of the command, with all verbs and options.
pub fn description() -> clap::Command {
    let command = Command::command();
    let header = command.get_styles().get_header();
    let about = |verb: &str| command.find_subcommand(verb).and_then(clap::Command::get_about).cloned();
    let line = |verb: &&str| format!("  {verb:<10} {}\n", about(verb).expect("every verb has a line"));
    let headings = HEADINGS.map(|(heading, verbs)| {
        format!("{header}{heading}:{header:#}\n{}\n", verbs.iter().map(line).collect::<String>())
    });
    let template = format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{}{header}Options:{header:#}\n{{options}}",
        headings.concat()
    );
    command.help_template(template)
}

/// Reads a command. Options that its mode does not read are refused; of what earlier versions had, the refusal says
/// what to use instead.
fn parsed(words: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> Result<Command, clap::Error> {
    let words: Vec<OsString> = words.into_iter().map(Into::into).collect();
    let mut description = description();
    let matches = description.try_get_matches_from_mut(&words).map_err(|refusal| match instead(&words) {
        Some(why) if refusal.use_stderr() => description.error(ErrorKind::InvalidSubcommand, why),
        _ => refusal,
    })?;
    modes::check(&mut description, &matches)?;
    Command::from_arg_matches(&matches)
}

/// Returns what to write in the place of a command that is no more.
fn instead(words: &[OsString]) -> Option<&'static str> {
    let words = || words.iter().skip(1).filter_map(|word| word.to_str());
    match words().filter(|word| !word.starts_with('-')).collect::<Vec<_>>()[..] {
        ["scene", ..] => Some("no verb `scene`; write hpu scenes show SCENE"),
        ["scenes", ..] if words().any(|word| word.starts_with("--template")) => {
            Some("no --template; hpu new NAME --dut writes a scene of your own HDL, hpu new NAME --ci its workflow")
        }
        ["run"] => Some("name a SCENE to run; hpu scenes lists the shipped ones"),
        _ => None,
    }
}

/// Reads a command that a study's file makes, to be called later.
fn again(words: &[String]) -> Result<study::Call, clap::Error> {
    let command = parsed(words)?;
    Ok(Box::new(|| command.verb.call()))
}

fn ended(done: Result<Exit, Failure>) -> u8 {
    // Where a part of a result is a refusal alone, there is no result.
    let done = match (done, refused()) {
        (Ok(_), Some(refusal)) => Err(refusal),
        (Err(failure), Some(_)) => Err(Failure::usage(failure)),
        (done, None) => done,
    };
    let exit = done.unwrap_or_else(|failure: Failure| {
        // The user who interrupted a command knows why it ended.
        if failure.exit() != Exit::Interrupted {
            terminal::complain(&failure);
        }
        failure.exit()
    });
    progress::end();
    temporary::remove_temporaries();
    if exit == Exit::Interrupted { interrupt::code() } else { exit as u8 }
}

/// Returns the name of a command in progress lines: its verb and the argument after it, as in `chart friction-wall`.
fn named<'a>(arguments: impl Iterator<Item = &'a OsString>) -> String {
    let words = arguments.map(|argument| argument.to_string_lossy().into_owned());
    words.take_while(|word| !word.starts_with('-')).take(2).collect::<Vec<_>>().join(" ")
}
