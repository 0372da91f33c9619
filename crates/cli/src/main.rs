//! The `hpu` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    hpu_cli::main()
}
