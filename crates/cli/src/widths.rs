//! `hpu widths`: what every signal of a scene needs, and what each bit buys.

use crate::exit::{Exit, Failure};
use crate::scene;

/// Show what every signal of a scene needs, and what each bit buys
#[derive(clap::Args)]
pub struct Args {
    /// Scenes: files, or names of shipped scenes
    #[arg(required = true)]
    scenes: Vec<String>,
    #[command(flatten)]
    set: scene::Set,
}

/// `hpu widths`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    for scene in &args.scenes {
        scene::source(scene)?.parse(&args.set.set)?;
    }
    Ok(Exit::Fine)
}
