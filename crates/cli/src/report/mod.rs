//! `hpu report`: one page of a scene, of two beside each other, or of a folder of results.

mod folder;
mod parts;
mod pieces;
mod scene;

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::ValueEnum;

use crate::scene::{Named, Set, source};
use crate::units::si;

use crate::document::Document;
use crate::shell::{Exit, Failure, Single, interrupt, print, values};
use scene::SceneReport;

/// Make one page of a scene: to look at, to mail, to print
///
/// The page is one HTML file that asks no network: the scene with every key and the source of its value, the loop as a
/// drawing, the run as a picture that can be zoomed to single clock cycles, verdict, energies and signals. --with adds
/// parts that take longer. Each part says the command that made it. Two scenes stand beside each other. A scene with a
/// [dut] is code: its design runs on your machine, unless --no-dut refuses it.
///
/// Of a folder of results (of hpu map, chart, widths --search, reproduce, or any other) the page has the pictures and
/// the tables; point at a cell to see the figures of its run.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// A scene's file, or the name of a shipped scene; two of them; or a folder of results
    #[arg(required = true, num_args = 1..=2, value_name = "SCENE")]
    scenes: Vec<String>,
    #[command(flatten)]
    set: Set,
    /// Parts beside the run; --with widths takes seconds, most others minutes
    #[arg(long, value_enum, value_delimiter = ',', value_name = "PART,...")]
    with: Vec<Part>,
    /// Let the run look on after its end for so long [default: 10s], as hpu run --for-ever does
    #[arg(long, value_name = "TIME", num_args = 0..=1, require_equals = true, default_missing_value = "10s",
        value_parser = values::time)]
    for_ever: Option<Duration>,
    /// Take parts from this folder where they are there, as hpu limits SCENE -o DIR leaves them, also in folders of
    /// their names below it
    #[arg(long, value_name = "DIR")]
    from: Option<PathBuf>,
    /// The file
    #[arg(short, long, value_name = "FILE", default_value = "report.html")]
    out: PathBuf,
}

/// A part of a report that takes longer than the run.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// The bits that each signal needs: measured, proved, recommended
    Widths,
    /// The stiffnesses at which the wall settles, as sets
    Limits,
    /// A map over the wall's stiffness and damping, around those of the scene
    Map,
    /// The VHDL in GHDL beside the emulator
    Check,
    /// The VHDL proved equal to the emulator
    Formal,
    /// Cells and clock in an FPGA
    Cost,
}

impl Part {
    /// Returns the heading of the part.
    pub fn title(self) -> &'static str {
        match self {
            Self::Widths => "Widths",
            Self::Limits => "Limits",
            Self::Map => "Map",
            Self::Check => "VHDL beside the emulator",
            Self::Formal => "Proofs",
            Self::Cost => "Cost",
        }
    }

    /// Returns the name of the part, which is that of its files.
    pub fn name(self) -> String {
        self.to_possible_value().expect("no part is hidden").get_name().to_string()
    }
}

/// Runs `hpu report`.
pub fn run(args: &Args) -> Result<Exit, Failure> {
    let file = Single::open(&args.out)?;
    let document = match &args.scenes[..] {
        [dir] if Path::new(dir).is_dir() => {
            if !args.set.set.is_empty() || !args.with.is_empty() || args.for_ever.is_some() || args.from.is_some() {
                let options = "--set, --with, --for-ever and --from";
                return Err(Failure::usage(format!("{dir} is a folder; {options} are of scenes")));
            }
            Some(folder::document(Path::new(dir))?)
        }
        scenes => of_scenes(args, scenes)?,
    };
    let Some(document) = document else { return Ok(Exit::Interrupted) };
    let html = document.html();
    file.write(&html)?;
    print(&format!("wrote {}: {}\n", args.out.display(), si(html.len() as f64, "B")))?;
    Ok(Exit::Fine)
}

/// Makes the page of these scenes; `None` when interrupted.
fn of_scenes(args: &Args, scenes: &[String]) -> Result<Option<Document>, Failure> {
    if let Some(dir) = args.from.as_ref().filter(|dir| !dir.is_dir()) {
        return Err(Failure::usage(format!("{} is no folder", dir.display())));
    }
    let named = scenes.iter().map(|name| Ok((name.clone(), source(name)?)));
    let named = named.collect::<Result<Vec<Named>, Failure>>()?;
    let watch = interrupt::watch();
    let mut all: Vec<SceneReport> = Vec::new();
    for one in &named {
        let Some(report) = SceneReport::new(one, &args.set.set, args.for_ever, watch)? else { return Ok(None) };
        all.push(report);
    }
    let mut parts = Vec::new();
    for report in &all {
        let Some(of_scene) = parts::parts(report, &args.with, args.from.as_deref(), watch)? else { return Ok(None) };
        parts.push(of_scene);
    }
    Ok(Some(scene::document(&all, parts)))
}
