//! `hpu export`: a scene as a part of somebody else's simulation.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
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

/// Write a scene as a Functional Mock-up Unit: FMI 3.0, co-simulation
///
/// The unit is the scene's plant: its inputs are the logic's outputs (the gates, or a command), its outputs the
/// encoder's lines and the other words that the logic reads, the states and the energies. With --loop it is the whole
/// loop with the scene's own blocks, without an input; its outputs are all nets and states. Position, stiffness and
/// damping of a wall are parameters; a loop takes the latter two at any time, from the next clock edge on. Times become
/// clock edges by rounding to the nearest one. With event mode and early return a step of a plant ends where a word of
/// an output has changed. States can be kept and set. A design of your own is not exported, only the plant around it.
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
    /// The library `libhpu` of the same version: `libhpu.so`, `hpu.dll` or `libhpu.dylib`; of each system that the unit
    /// is for [default: those beside the program]
    #[arg(long, value_name = "FILE")]
    library: Vec<PathBuf>,
}

/// Runs `hpu export`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let What::Fmu(args) = &args.what;
    let source = scene::source(&args.scene)?;
    let mut load = |file: &str| source.load(file);
    let (text, _) = SceneText::read((&source.name, &source.text), &args.set.set, &mut load).map_err(Failure::file)?;
    let places = if args.library.is_empty() { beside() } else { args.library.clone() };
    if places.is_empty() {
        let why = format!(
            "{DLL_PREFIX}hpu{DLL_SUFFIX} is not beside the program; `cargo build --release -p hpu-capi` makes it, and \
             --library names it"
        );
        return Err(Failure::new(Exit::NoTool, why));
    }
    let read = |place: &PathBuf| read_plain(place).map_err(|error| Failure::at(place, error));
    let libraries = places.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    let file = Single::open(&args.out)?;
    let stem = Path::new(&source.name).file_stem().map_or_else(String::new, |stem| stem.display().to_string());
    let files: Vec<(String, Vec<u8>)> = text.files.into_iter().collect();
    let export = Export {
        kind: if args.is_loop { Kind::Loop } else { Kind::Plant },
        name: &stem,
        text: &source.text,
        set: &args.set.set,
        files: &files,
        libraries: &libraries,
    };
    let bytes = archive(&export, &source).map_err(Failure::file)?;
    file.write(&bytes)?;
    Ok(Exit::Fine)
}

/// Returns the libraries beside this program, or in `lib` beside its folder: at most one of each system.
fn beside() -> Vec<PathBuf> {
    let Some(program) = program::code().ok() else { return Vec::new() };
    let folder = program.parent().unwrap_or(Path::new(""));
    let found =
        |name: &str| [folder.join(name), folder.join("../lib").join(name)].into_iter().find(|place| place.is_file());
    ["libhpu.so", "hpu.dll", "libhpu.dylib"].into_iter().filter_map(found).collect()
}
