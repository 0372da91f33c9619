//! `hpu vectors`: golden vectors, and the committed files that are made from the blocks.

use std::path::PathBuf;

use clap::ValueEnum;
use hpu_cosim::{Ready, Rig};
use hpu_datapath::{AnyBlock, registry, variants};
use hpu_rtl::{Vectors, scene_vectors, stimuli, write_committed};

use crate::block::known;
use crate::exit::{Exit, Failure};
use crate::files::Folder;
use crate::scene::{self, Loaded};
use crate::terminal::print;
use crate::verify::verify;

/// Write golden vectors of blocks, one set to stdout or all into a folder; refresh or verify those there are
#[derive(clap::Args)]
pub struct Args {
    /// The blocks; all when none is named
    blocks: Vec<String>,
    /// Where the inputs come from
    #[arg(long, value_enum, default_value = "directed")]
    set_kind: SetKind,
    /// Only the configuration with this label; to stdout goes `default`
    #[arg(long, value_name = "LABEL")]
    variant: Option<String>,
    /// Seed of random inputs
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Rows: at most so many directed ones, so many random ones, so many edges of a scene [default: all, 1000, 10000]
    #[arg(long, value_name = "N")]
    count: Option<usize>,
    /// The scene whose loop is recorded
    #[arg(long, required_if_eq("set_kind", "scene"))]
    scene: Option<String>,
    #[command(flatten)]
    set: scene::Set,
    /// Form of the files
    #[arg(long, value_enum, default_value = "txt")]
    format: Form,
    /// Write DIR/BLOCK/LABEL-SET.txt (.csv, .mem)
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Refresh the committed vectors, packages and testbenches in the project of this folder
    #[arg(long, conflicts_with_all = ["blocks", "out", "verify"])]
    update: bool,
    /// Hold vector files against the emulator, which must answer every row as the file says
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with_all = ["blocks", "out"])]
    verify: Vec<PathBuf>,
}

/// Where inputs come from.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SetKind {
    /// Corner cases
    Directed,
    /// A seed
    Random,
    /// What a loop, and each block in it, saw in a scene
    Scene,
}

/// Form of a file.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Form {
    /// Hex words under a line that names block, ports, formats and generics
    Txt,
    /// Decimal numbers under a line of names
    Csv,
    /// Verilog's $readmemh
    Readmemh,
}

/// A set and its name, as in `displacement/8_bit-random`.
type Named = (String, Vectors);

/// `hpu vectors`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    if args.update {
        return update();
    }
    if !args.verify.is_empty() {
        return verify(&args.verify);
    }
    args.blocks.iter().try_for_each(|name| known(name))?;
    let sets = match (args.set_kind, &args.scene) {
        (SetKind::Scene, Some(scene)) => of_scene(args, scene)?,
        _ => of_blocks(args)?,
    };
    let Some(dir) = &args.out else {
        let [(_, vectors)] = &sets[..] else {
            return Err(Failure::usage(format!("{} sets; name one block, or a folder with -o", sets.len())));
        };
        print(&text(vectors, args.format))?;
        return Ok(Exit::Fine);
    };
    let extension = match args.format {
        Form::Txt => "txt",
        Form::Csv => "csv",
        Form::Readmemh => "mem",
    };
    let mut folder = Folder::open(dir)?;
    for (name, vectors) in &sets {
        folder.write(&format!("{name}.{extension}"), text(vectors, args.format))?;
    }
    let files: String = folder.places().map(|place| format!("{}\n", place.display())).collect();
    folder.commit()?;
    print(&files)?;
    Ok(Exit::Fine)
}

fn text(vectors: &Vectors, form: Form) -> String {
    match form {
        Form::Txt => vectors.to_text(),
        Form::Csv => vectors.to_csv(),
        Form::Readmemh => vectors.to_readmemh(),
    }
}

fn of_blocks(args: &Args) -> Result<Vec<Named>, Failure> {
    let variant = args.variant.as_deref().or(args.out.is_none().then_some("default"));
    let wanted = |label: &str, block: &dyn AnyBlock| {
        (args.blocks.is_empty() || args.blocks.iter().any(|name| name == block.name()))
            && variant.is_none_or(|variant| variant == label)
    };
    let found: Vec<_> = variants().into_iter().filter(|(label, block)| wanted(label, &**block)).collect();
    if found.is_empty() {
        return Err(Failure::usage(format!("no such variant `{}`; see hpu block NAME", variant.unwrap_or_default())));
    }
    let record = |(label, mut block): (String, Box<dyn AnyBlock>)| {
        let (set, stimuli) = match args.set_kind {
            SetKind::Random => ("random", stimuli::random(&*block, args.seed, args.count.unwrap_or(1000))),
            _ => {
                let mut rows = stimuli::directed(&*block);
                rows.truncate(args.count.unwrap_or(usize::MAX));
                ("directed", rows)
            }
        };
        block.reset();
        (format!("{}/{label}-{set}", block.name()), Vectors::record(&mut *block, stimuli))
    };
    Ok(found.into_iter().map(record).collect())
}

fn of_scene(args: &Args, scene: &str) -> Result<Vec<Named>, Failure> {
    let loaded = Loaded::new(scene, &args.set.set, None)?;
    let session = Ready::new(&loaded.scene).map_err(Failure::file)?;
    let (scene, wiring) = (loaded.scene.name(), session.wiring().name());
    // To stdout goes one set: that of the loop, unless a block is named.
    let of_loop = args.blocks.is_empty() && args.out.is_none();
    let wanted = |name: &str| {
        if of_loop { name == wiring } else { args.blocks.is_empty() || args.blocks.iter().any(|block| block == name) }
    };
    let sets: Vec<_> = scene_vectors(&session, args.count.map_or(10_000, |count| count as u64))
        .into_iter()
        .filter(|(_, vectors)| wanted(vectors.header.block))
        .map(|(label, vectors)| (format!("{}/{scene}-{label}", vectors.header.block), vectors))
        .collect();
    if sets.is_empty() {
        return Err(Failure::usage(format!("the {wiring} of {scene} has no {}", args.blocks.join(", no "))));
    }
    Ok(sets)
}

fn update() -> Result<Exit, Failure> {
    let root = PathBuf::from(".");
    let block = registry().first().map_or("", |block| block.name());
    if !root.join("hdl").join(format!("{block}.vhd")).exists() {
        return Err(Failure::usage("this folder is no hpu project: it has no hdl/"));
    }
    let written = write_committed(&root).map_err(Failure::file)?;
    let lines = written.iter().map(|path| format!("{}\n", path.display()));
    print(&format!("{}{} files refreshed\n", lines.collect::<String>(), written.len()))?;
    Ok(Exit::Fine)
}
