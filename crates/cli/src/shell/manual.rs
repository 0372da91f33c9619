//! `hpu completions` and `hpu man`: the command's description of itself, for shells and for `man`.

use std::path::PathBuf;

use clap::Command;
use clap_complete::Shell;
use clap_mangen::Man;

use crate::shell::exit::{Exit, Failure};
use crate::shell::files::{Folder, file_lines};
use crate::shell::terminal::{print, print_file};

/// Print a shell's completions of every verb and option
///
/// For bash: `hpu completions bash > ~/.local/share/bash-completion/completions/hpu`. For zsh: into a file `_hpu` in a
/// folder of $fpath. For fish: `hpu completions fish > ~/.config/fish/completions/hpu.fish`.
#[derive(clap::Args)]
pub(crate) struct CompletionArgs {
    /// Shell to complete for
    #[arg(value_enum)]
    shell: Shell,
}

/// Print the manual page of the command or of a verb, or write all pages
///
/// To read a page: `hpu man run | man -l -`. To install all: `hpu man -o ~/.local/share/man/man1`; then `man hpu-run`.
#[derive(clap::Args)]
pub(crate) struct ManArgs {
    /// Verb to print the page of, as in `run` or `reproduce hybrid-loop` [default: the command itself]
    #[arg(conflicts_with = "out")]
    verb: Vec<String>,
    /// Write hpu.1, hpu-run.1 and so on into this folder
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs `hpu completions`.
pub fn completions(args: &CompletionArgs, mut command: Command) -> Result<Exit, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "hpu", &mut script);
    print_file(&String::from_utf8_lossy(&script))?;
    Ok(Exit::Fine)
}

/// Runs `hpu man`.
pub fn man(args: &ManArgs, command: Command) -> Result<Exit, Failure> {
    let command = whole(command);
    let Some(out) = &args.out else {
        let mut of = &command;
        for verb in &args.verb {
            of = of.find_subcommand(verb).ok_or_else(|| {
                let verbs: Vec<_> = of.get_subcommands().map(Command::get_name).collect();
                Failure::usage(format!("`{}` has no verb `{verb}`; it has: {}", of.get_name(), verbs.join(", ")))
            })?;
        }
        print_file(&page(of)?)?;
        return Ok(Exit::Fine);
    };
    let mut folder = Folder::open(out)?;
    write(&command, &mut folder)?;
    print(&file_lines(&folder.commit()?))?;
    Ok(Exit::Fine)
}

/// Returns the command with everything that clap adds to it. The pages of verbs do not mention a `help` verb.
fn whole(command: Command) -> Command {
    let mut command = command.disable_help_subcommand(true);
    command.build();
    command
}

fn write(command: &Command, folder: &mut Folder) -> Result<(), Failure> {
    folder.write(&format!("{}.1", title(command)), page(command)?)?;
    command.get_subcommands().try_for_each(|verb| write(verb, folder))
}

/// Returns the title of a page: `hpu-run` for the verb `run`.
fn title(command: &Command) -> &str {
    command.get_display_name().unwrap_or(command.get_name())
}

/// Returns the page of a command or verb.
fn page(command: &Command) -> Result<String, Failure> {
    let mut page = Vec::new();
    let made =
        Man::new(command.clone()).title(title(command)).source(concat!("hpu ", env!("HPU_VERSION"))).render(&mut page);
    made.map_err(|error| Failure::file(format!("the manual page of {}: {error}", command.get_name())))?;
    Ok(String::from_utf8_lossy(&page).into_owned())
}
