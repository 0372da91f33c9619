//! `hpu export`: a scene as a part of somebody else's simulation.

use std::path::{Path, PathBuf};

use clap::Subcommand;
use hpu::fmi::{Export, Kind, archive};
use hpu_cosim::read_plain;
use hpu_study::map::SceneText;

use crate::scene;
use crate::shell::{Exit, Failure, Single, program};

/// Export a scene for other simulators
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    Fmu(Fmu),
}

/// Write a scene as a Functional Mock-up Unit: FMI 3.0, co-simulation, for x86-64 Linux
///
/// The unit is the scene's plant: its inputs are the logic's outputs (the gates, or a command), its outputs the
/// encoder's lines and the other words that the logic reads, the states and the energies. With --loop it is the whole
/// loop with the scene's own blocks, without an input; its outputs are all nets and states. Position, stiffness and
/// damping of a wall are parameters. Times become clock edges by rounding to the nearest one. With event mode and early
/// return a step of a plant ends where a word of an output has changed. States can be kept and set. A design of your
/// own is not exported, only the plant around it.
#[derive(clap::Args)]
struct Fmu {
    #[arg(help = "A shipped scene or a TOML file", value_name = "SCENE")]
    scene: String,
    #[command(flatten)]
    set: scene::Set,
    /// Where to write the unit
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
    /// Export the whole loop instead of its plant
    #[arg(long = "loop")]
    is_loop: bool,
    /// The library `libhpu.so` of the same version [default: beside the program]
    #[arg(long, value_name = "FILE")]
    library: Option<PathBuf>,
}

/// Runs `hpu export`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let What::Fmu(args) = &args.what;
    let source = scene::source(&args.scene)?;
    let mut load = |file: &str| source.load(file);
    let (text, _) = SceneText::read((&source.name, &source.text), &args.set.set, &mut load).map_err(Failure::file)?;
    let place = args.library.clone().or_else(beside).ok_or_else(|| {
        let why = "libhpu.so is not beside the program; `cargo build --release -p hpu-capi` makes it, and --library \
                   names it";
        Failure::new(Exit::NoTool, why)
    })?;
    let library = read_plain(&place).map_err(|error| Failure::at(&place, error))?;
    let file = Single::open(&args.out)?;
    let stem = Path::new(&source.name).file_stem().map_or_else(String::new, |stem| stem.display().to_string());
    let files: Vec<(String, Vec<u8>)> = text.files.into_iter().collect();
    let export = Export {
        kind: if args.is_loop { Kind::Loop } else { Kind::Plant },
        name: &stem,
        text: &source.text,
        set: &args.set.set,
        files: &files,
        library: &library,
    };
    let bytes = archive(&export, &source).map_err(Failure::file)?;
    file.write(&bytes)?;
    Ok(Exit::Fine)
}

/// Returns the library beside this program, or in `lib` beside its folder.
fn beside() -> Option<PathBuf> {
    let program = program::code().ok()?;
    let folder = program.parent()?;
    [folder.join("libhpu.so"), folder.join("../lib/libhpu.so")].into_iter().find(|place| place.is_file())
}
