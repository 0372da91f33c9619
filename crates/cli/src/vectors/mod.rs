//! `hpu vectors`: writes golden vectors, and the committed files that are generated from the blocks.

pub mod verify;

use std::collections::BTreeSet;
use std::path::PathBuf;

use clap::ValueEnum;
use hpu_cosim::{PlainName, Wired, WiredSimulation};
use hpu_datapath::{AnyBlock, block_names, registry, variants_of};
use hpu_rtl::{
    Hdl, Header, Memory, Origin, Source, VECTOR_READER, Vectors, package, scene_vectors, stimuli, testbench, vhdl,
    write_committed,
};

use crate::block::{Generics, configured, known};
use crate::scene::{self, Loaded, quoted};
use crate::shell::{Exit, Failure, Folder, print, print_file, tell};

use verify::verify;

/// The most rows of a set, because they are gathered in memory.
const MOST_ROWS: u64 = 10_000_000;

/// Write golden vectors of blocks, refresh or verify those there are
///
/// One set goes to stdout, several go into a folder.
///
/// A set is text. Line 1 names the block, its ports with their formats, and its generics. Every further line is one
/// clock edge: the inputs before it and the outputs after it, in hex words. The last line, "# end N rows", counts these
/// rows and is none itself: a file without it has been cut.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The blocks; all when none is named
    blocks: Vec<String>,
    /// Where the inputs come from
    #[arg(long, value_enum, default_value = "directed")]
    set_kind: SetKind,
    /// Only the configuration with this label; to stdout goes `default`
    #[arg(long, value_name = "LABEL")]
    variant: Option<String>,
    #[command(flatten)]
    generics: Generics,
    /// Seed of random inputs
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Rows: at most so many directed ones, so many random ones, so many edges of a scene [default: all, 1000, 10000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(..=MOST_ROWS))]
    count: Option<u64>,
    /// The scene whose loop is recorded
    #[arg(long, required_if_eq("set_kind", "scene"))]
    scene: Option<String>,
    #[command(flatten)]
    set: scene::Set,
    /// Only the lookup table of this name, with --set-kind table
    #[arg(long, value_name = "NAME")]
    table: Option<String>,
    /// Form of the files
    #[arg(long, value_enum, default_value = "txt")]
    format: Form,
    /// With -o, write a test bench beside the vectors of each block: BLOCK_pkg.vhd with the constants of the
    /// configuration, vector_reader.vhd, the block's VHDL and tb_BLOCK.vhd, in the order of analysis. A block of your
    /// own with the same entity may stand in the place of BLOCK.vhd
    #[arg(long)]
    bench: bool,
    /// Write DIR/BLOCK/LABEL-SET.txt (.csv, .json, .mem, .coe, .mif); with --verify, of each first difference
    /// BLOCK-FILE.vcd with its GTKWave save file
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Refresh the committed vectors, packages and testbenches in the project of this folder
    #[arg(long, conflicts_with_all = ["blocks", "out", "verify"])]
    update: bool,
    /// Hold vector files (txt or json) against the emulator, which must answer every row as the file says
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with = "blocks")]
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
    /// The lookup tables inside the blocks, a row an address
    Table,
}

/// Form of a file. In memories a row is a word, its first column in the upper bits; of a table the words alone.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Form {
    /// Hex words under a line that names block, ports, formats and generics
    Txt,
    /// Decimal numbers under a line of names
    Csv,
    /// Decimal numbers alone, as VUnit's load_csv reads them; words of up to 32 bits
    Vunit,
    /// Names, formats, units, generics, seed, rows; SHA-256 of all lines but its own: grep -v '"sha256"' FILE |
    /// sha256sum
    Json,
    /// Memory: Verilog's $readmemh
    Readmemh,
    /// Memory: Xilinx's coefficients, in hex
    Coe,
    /// Memory: Intel's (Altera's) MIF, with addresses
    MifIntel,
    /// Memory: Xilinx's MIF, a binary word a line
    MifXilinx,
}

impl Form {
    fn extension(self) -> &'static str {
        match self {
            Self::Txt => "txt",
            Self::Csv | Self::Vunit => "csv",
            Self::Json => "json",
            Self::Readmemh => "mem",
            Self::Coe => "coe",
            Self::MifIntel | Self::MifXilinx => "mif",
        }
    }
}

/// A set, its name, as in `displacement/8_bit-random` or `pwm/WIDTH_14-directed`, and its origin.
struct Named {
    name: String,
    origin: Origin,
    vectors: Vectors,
}

impl Named {
    /// Returns the set in this form.
    fn text(&self, form: Form) -> Result<String, Failure> {
        match form {
            Form::Txt => Ok(self.vectors.to_text()),
            Form::Csv => Ok(self.vectors.to_csv()),
            Form::Vunit => self.vectors.to_vunit().map_err(|error| Failure::usage(format!("{}: {error}", self.name))),
            Form::Json => Ok(self.vectors.to_json(&self.origin)),
            Form::Readmemh => self.memory().map(|memory| memory.to_readmemh()),
            Form::Coe => self.memory().map(|memory| memory.to_coe()),
            Form::MifIntel => self.memory().map(|memory| memory.to_mif_intel()),
            Form::MifXilinx => self.memory().map(|memory| memory.to_mif_xilinx()),
        }
    }

    /// Writes the files of a bench that reads this set, beside it.
    fn bench(&self, folder: &mut Folder) -> Result<(), Failure> {
        let Header { block: name, generics, .. } = &self.vectors.header;
        let block = hpu_datapath::configured(name, generics).expect("it is known").expect("it has been built");
        let set = self.name.rsplit('/').next().unwrap_or_default();
        let files = [
            ("vector_reader.vhd".to_string(), VECTOR_READER.to_string()),
            (format!("{name}_pkg.vhd"), package(&*block)),
            (format!("{name}.vhd"), vhdl(name, &Hdl::Carried)?),
            (format!("tb_{name}.vhd"), testbench(&*block, &format!("{set}.txt"))),
        ];
        files.into_iter().try_for_each(|(file, text)| folder.write(&format!("{name}/{file}"), text))
    }

    fn memory(&self) -> Result<Memory, Failure> {
        if self.vectors.rows.is_empty() {
            return Err(Failure::usage(format!("{} has no rows; a memory has a word at least", self.name)));
        }
        match self.origin.source {
            Source::Table => Ok(self.vectors.outputs_memory()),
            _ => Ok(self.vectors.memory()),
        }
    }
}

/// Runs `hpu vectors`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    match (args.update, &args.verify[..]) {
        (true, _) => update(),
        (false, []) => write(args),
        (false, files) => verify(files, args.out.as_deref()),
    }
}

/// Writes the vectors that were asked for.
fn write(args: &Args) -> Result<Exit, Failure> {
    args.blocks.iter().try_for_each(|name| known(name))?;
    if args.set_kind != SetKind::Table && args.table.is_some() {
        return Err(Failure::usage("--table picks one of the tables that --set-kind table writes"));
    }
    if args.set_kind == SetKind::Table && args.count.is_some() {
        return Err(Failure::usage("a table is written whole; --count is for vectors"));
    }
    let sets = match (args.set_kind, &args.scene) {
        (SetKind::Scene, Some(scene)) => of_scene(args, scene)?,
        _ => of_blocks(args)?,
    };
    if args.bench {
        benched(args, &sets)?;
    }
    let Some(dir) = &args.out else {
        let [set] = &sets[..] else {
            let names: Vec<_> = sets.iter().take(8).map(|set| set.name.as_str()).collect();
            let more = if sets.len() > names.len() { ", ..." } else { "" };
            let (count, names) = (sets.len(), names.join(", "));
            return Err(Failure::usage(format!("{count} sets ({names}{more}); name one, or a folder with -o")));
        };
        print_file(&set.text(args.format)?)?;
        return Ok(Exit::Fine);
    };
    let mut folder = Folder::open(dir)?;
    for set in &sets {
        folder.write(&format!("{}.{}", set.name, args.format.extension()), set.text(args.format)?)?;
        if args.bench {
            set.bench(&mut folder)?;
        }
    }
    let files: String = folder.places().map(|place| format!("{}\n", place.display())).collect();
    folder.commit()?;
    print(&files)?;
    for block in sets.iter().map(|set| set.vectors.header.block).filter(|_| args.bench) {
        let place = quoted(&dir.join(block).to_string_lossy());
        let sources = format!("{block}_pkg.vhd vector_reader.vhd {block}.vhd tb_{block}.vhd");
        tell(&format!("cd {place} && ghdl -a --std=08 {sources} && ghdl --elab-run --std=08 tb_{block}"));
    }
    Ok(Exit::Fine)
}

/// Refuses benches of anything but one set of each block, as text.
fn benched(args: &Args, sets: &[Named]) -> Result<(), Failure> {
    if args.format != Form::Txt {
        return Err(Failure::usage("--bench: a bench reads vectors as text; write --format txt, or none"));
    }
    let mut blocks = BTreeSet::new();
    match sets.iter().map(|set| set.vectors.header.block).find(|block| !blocks.insert(*block)) {
        Some(block) => Err(Failure::usage(format!(
            "--bench: a bench is of one configuration of a block, and there are several of {block}; choose one by \
             --variant LABEL or --generic NAME=VALUE"
        ))),
        None => Ok(()),
    }
}

/// A configuration: the label of one that is listed, the name of its files, and the block.
type Chosen = (Option<String>, String, Box<dyn AnyBlock>);

/// Returns the configurations that are asked for.
fn chosen(args: &Args) -> Result<Vec<Chosen>, Failure> {
    let generics = &args.generics.generic[..];
    if !generics.is_empty() {
        let [name] = &args.blocks[..] else {
            return Err(Failure::usage("--generic makes a configuration of one block; name it: hpu vectors BLOCK ..."));
        };
        let block = configured(name, generics)?;
        let stem: Vec<_> = generics.iter().map(|(name, value)| format!("{}_{value}", name.to_uppercase())).collect();
        return Ok(vec![(None, PlainName::near(&stem.join("-")).to_string(), block)]);
    }
    let variant = args.variant.as_deref().or(args.out.is_none().then_some("default"));
    let mut found = variants_of(|name| args.blocks.is_empty() || args.blocks.iter().any(|block| block == name));
    found.retain(|(label, _)| variant.is_none_or(|variant| variant == label));
    if found.is_empty() {
        return Err(Failure::usage(format!("no such variant `{}`; see hpu block NAME", variant.unwrap_or_default())));
    }
    Ok(found.into_iter().map(|(label, block)| (Some(label.clone()), label, block)).collect())
}

fn of_blocks(args: &Args) -> Result<Vec<Named>, Failure> {
    let found = chosen(args)?;
    if args.set_kind == SetKind::Table {
        return tables(args, &found);
    }
    let record = |(variant, stem, mut block): Chosen| {
        let (set, source, stimuli) = match args.set_kind {
            SetKind::Random => {
                let stimuli = stimuli::random(&*block, args.seed, args.count.map_or(1000, |count| count as usize));
                ("random", Source::Random { seed: args.seed }, stimuli)
            }
            _ => {
                let mut rows = stimuli::directed(&*block);
                rows.truncate(args.count.map_or(usize::MAX, |count| count as usize));
                ("directed", Source::Directed, rows)
            }
        };
        block.reset();
        let name = format!("{}/{stem}-{set}", block.name());
        Named { name, origin: Origin { variant, source }, vectors: Vectors::record(&mut *block, stimuli) }
    };
    Ok(found.into_iter().map(record).collect())
}

/// Returns the lookup tables of these blocks.
fn tables(args: &Args, blocks: &[Chosen]) -> Result<Vec<Named>, Failure> {
    let mut sets = Vec::new();
    for (variant, stem, block) in blocks {
        for rom in block.roms().iter().filter(|rom| args.table.as_ref().is_none_or(|table| table == rom.name)) {
            let origin = Origin { variant: variant.clone(), source: Source::Table };
            let name = format!("{}/{stem}-{}", block.name(), rom.name);
            sets.push(Named { name, origin, vectors: Vectors::of_rom(&**block, rom) });
        }
    }
    if sets.is_empty() {
        let with: Vec<_> = registry().iter().flat_map(|block| tables_of(&**block)).collect();
        return Err(Failure::usage(format!("no such lookup table; there are {}", with.join(", "))));
    }
    Ok(sets)
}

/// Returns the names of a block's tables, as in `trig_table sines`.
fn tables_of(block: &dyn AnyBlock) -> Vec<String> {
    block.roms().iter().map(|rom| format!("{} {}", block.name(), rom.name)).collect()
}

fn of_scene(args: &Args, scene: &str) -> Result<Vec<Named>, Failure> {
    let loaded = Loaded::new(scene, &args.set.set, None)?;
    let simulation = WiredSimulation::new(&loaded.scene).map_err(Failure::file)?;
    let (scene, wiring) = (&loaded.scene.name, simulation.wiring().name());
    // Only one set is written to stdout: that of the loop, unless a block is named.
    let of_loop = args.blocks.is_empty() && args.out.is_none();
    let wanted = |name: &str| {
        if of_loop { name == wiring } else { args.blocks.is_empty() || args.blocks.iter().any(|block| block == name) }
    };
    let plain = PlainName::near(scene);
    let seed = loaded.scene.run.seed;
    let settings: Vec<_> = args.set.set.iter().map(|(key, value)| format!("{key}={value}")).collect();
    let source = Source::Scene { scene: scene.to_string(), settings, seed };
    let sets: Vec<_> = scene_vectors(&simulation, args.count.unwrap_or(10_000))
        .into_iter()
        .filter(|(_, vectors)| wanted(vectors.header.block))
        .map(|(label, vectors)| Named {
            name: format!("{}/{plain}-{label}", vectors.header.block),
            origin: Origin { variant: None, source: source.clone() },
            vectors,
        })
        .collect();
    if sets.is_empty() {
        return Err(Failure::usage(format!("the {wiring} of {scene} has no {}", args.blocks.join(", no "))));
    }
    Ok(sets)
}

fn update() -> Result<Exit, Failure> {
    let root = PathBuf::from(".");
    let block = block_names()[0];
    if !root.join("hdl").join(format!("{block}.vhd")).exists() {
        return Err(Failure::usage("this folder is no hpu project: it has no hdl/"));
    }
    let written = write_committed(&root).map_err(Failure::file)?;
    let lines = written.iter().map(|path| format!("{}\n", path.display()));
    print(&format!("{}{} files refreshed\n", lines.collect::<String>(), written.len()))?;
    Ok(Exit::Fine)
}
