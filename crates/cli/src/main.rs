//! The `hpu` command: arguments, files and colours. Everything else is in the libraries.

mod block;
mod cache;
mod chart;
mod check;
mod cost;
mod exit;
mod files;
mod fit;
mod hdl;
mod input;
mod interrupt;
mod jobs;
mod journal;
mod keys;
mod limits;
mod manual;
mod map;
mod new;
mod notation;
mod page;
mod parameters;
mod pictures;
mod price;
mod progress;
mod reproduce;
mod reproduce_beside;
mod reproduce_cost;
mod reproduce_cost_claims;
mod reproduce_cost_text;
mod reproduce_drop;
mod reproduce_drop_json;
mod reproduce_words;
mod run;
mod scene;
mod show;
mod terminal;
mod units;
mod vectors;
mod waves;
mod widths;

use std::env;
use std::ffi::OsString;
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use exit::{Exit, Failure};

/// Cycle-accurate emulator of haptic FPGA datapaths.
///
/// Exit codes: 0 fine; 1 a mismatch, an unmet expectation; 2 wrong usage, an output place that cannot be used; 3 a
/// needed tool is missing or too old; 4 a bad scene, vector or data file, a write or a tool that failed; 130
/// interrupted (SIGINT); 143 terminated (SIGTERM).
#[derive(Parser)]
#[command(name = "hpu", version = env!("HPU_VERSION"), max_term_width = 100)]
struct Command {
    /// Show no progress: no bar on a terminal, no line every 10 s elsewhere
    #[arg(short, long, global = true)]
    quiet: bool,
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    Run(run::Args),
    Scenes(scene::ListArgs),
    Scene(show::Args),
    New(new::Args),
    Keys(keys::Args),
    Block(block::Args),
    Vectors(vectors::Args),
    Check(check::Args),
    Limits(limits::Args),
    Map(map::Args),
    Chart(chart::Args),
    Fit(fit::Args),
    Widths(widths::Args),
    Cost(cost::Args),
    Reproduce(reproduce::Args),
    Completions(manual::CompletionArgs),
    Man(manual::ManArgs),
}

fn main() -> ExitCode {
    let command = match Command::try_parse() {
        Ok(command) => command,
        Err(refusal) if refusal.use_stderr() => refusal.exit(),
        // Help and the version are results like any other: a full disk is an error.
        Err(help) => return ended(terminal::print(&help.render().to_string()).map(|()| Exit::Fine)),
    };
    if !command.quiet {
        progress::begin(&named(env::args_os().skip(1)));
    }
    let done = interrupt::listen().and_then(|()| match command.verb {
        Verb::Run(args) => run::run(&args),
        Verb::Scenes(args) => scene::scenes(&args),
        Verb::Scene(args) => show::run(&args),
        Verb::New(args) => new::run(&args),
        Verb::Keys(args) => keys::run(&args),
        Verb::Block(args) => block::run(&args),
        Verb::Vectors(args) => vectors::run(&args),
        Verb::Check(args) => check::run(&args),
        Verb::Limits(args) => limits::run(&args),
        Verb::Map(args) => map::run(&args),
        Verb::Chart(args) => chart::run(&args),
        Verb::Fit(args) => fit::run(&args),
        Verb::Widths(args) => widths::run(&args),
        Verb::Cost(args) => cost::run(&args),
        Verb::Reproduce(args) => reproduce::run(&args),
        Verb::Completions(args) => manual::completions(&args, Command::command()),
        Verb::Man(args) => manual::man(&args, Command::command()),
    });
    ended(done)
}

fn ended(done: Result<Exit, Failure>) -> ExitCode {
    let exit = done.unwrap_or_else(|failure: Failure| {
        // The user who interrupted a command knows why it ended.
        if failure.exit() != Exit::Interrupted {
            terminal::complain(&failure);
        }
        failure.exit()
    });
    progress::end();
    ExitCode::from(if exit == Exit::Interrupted { interrupt::code() } else { exit as u8 })
}

/// Returns the name of a command in progress lines: its verb and the argument after it, as in `chart friction-wall`.
fn named(arguments: impl Iterator<Item = OsString>) -> String {
    let words = arguments.map(|argument| argument.to_string_lossy().into_owned());
    words.take_while(|word| !word.starts_with('-')).take(2).collect::<Vec<_>>().join(" ")
}
