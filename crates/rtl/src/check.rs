//! The check: every block's VHDL held against the emulator, row by row, in GHDL.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use hpu_datapath::{AnyBlock, registry, variants};

use crate::ghdl::{GhdlError, Library};
use crate::package::package;
use crate::report::{CheckReport, CheckRow, Tally, tally};
use crate::stimuli;
use crate::testbench::{VECTOR_READER, testbench};
use crate::vector::{Stimulus, Vectors, literal};

/// What to check.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct CheckOptions {
    /// Directory with `<block>.vhd`.
    pub hdl: PathBuf,
    /// Names of the blocks; all when empty.
    pub blocks: Vec<String>,
    /// Random rows a variant, beside the directed ones (ten times as many for blocks with a PWM).
    pub rows: usize,
    /// Seed of the random rows.
    pub seed: u64,
    /// Every pair of words of the default multiplier, all 2^24, instead of 2^16 in strata.
    pub exhaustive: bool,
    /// GHDL processes at a time.
    pub jobs: usize,
}

impl CheckOptions {
    /// Every block of a directory, 2000 random rows each, on every core.
    #[must_use]
    pub fn new(hdl: impl Into<PathBuf>) -> Self {
        let jobs = std::thread::available_parallelism().map_or(1, usize::from);
        Self {
            hdl: hdl.into(),
            blocks: Vec::new(),
            rows: 2000,
            seed: 1,
            exhaustive: false,
            jobs,
        }
    }
}

/// Holds the VHDL of a directory against the emulator: directed and random rows for every configuration of every block.
///
/// # Errors
///
/// [`GhdlError`] when GHDL is missing or the VHDL does not analyse. A mismatch is a result, and so is a run that failed.
pub fn check(options: &CheckOptions) -> Result<CheckReport, GhdlError> {
    let library = library(&options.hdl)?;
    let wanted =
        |name: &str| options.blocks.is_empty() || options.blocks.iter().any(|block| block == name);
    let jobs = variants()
        .into_iter()
        .filter(|(_, block)| wanted(block.name()))
        .count();
    let next = AtomicUsize::new(0);
    // A block is not `Send`: each thread makes its own.
    let work = || {
        let mut rows = Vec::new();
        let mut all: Vec<_> = variants()
            .into_iter()
            .filter(|(_, block)| wanted(block.name()))
            .map(Some)
            .collect();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some((label, block)) = all.get_mut(index).and_then(Option::take) else {
                return rows;
            };
            rows.push((index, check_variant(&library, &label, block, options)));
        }
    };
    let mut rows: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..options.jobs.clamp(1, jobs.max(1)))
            .map(|_| scope.spawn(work))
            .collect();
        threads
            .into_iter()
            .flat_map(|thread| thread.join().expect("a checking thread does not panic"))
            .collect()
    });
    rows.sort_by_key(|(index, _)| *index);
    Ok(CheckReport {
        rows: rows.into_iter().map(|(_, row)| row).collect(),
        loops: Vec::new(),
    })
}

/// Analyses all blocks of a directory and their testbenches.
fn library(hdl: &Path) -> Result<Library, GhdlError> {
    let blocks = registry();
    let mut packages = vec![("vector_reader.vhd".to_string(), VECTOR_READER.to_string())];
    packages.extend(
        blocks
            .iter()
            .map(|block| (format!("{}_pkg.vhd", block.name()), package(&**block))),
    );
    let files: Vec<_> = blocks
        .iter()
        .map(|block| hdl.join(format!("{}.vhd", block.name())))
        .collect();
    let testbench = |block: &dyn AnyBlock| (format!("tb_{}.vhd", block.name()), testbench(block));
    Library::analyse(
        &packages,
        &files,
        &blocks
            .iter()
            .map(|block| testbench(&**block))
            .collect::<Vec<_>>(),
    )
}

fn check_variant(
    library: &Library,
    label: &str,
    mut block: Box<dyn AnyBlock>,
    options: &CheckOptions,
) -> CheckRow {
    let start = Instant::now();
    let mut row = CheckRow {
        block: block.name().to_string(),
        variant: label.to_string(),
        vectors: 0,
        edges: 0,
        mismatches: 0,
        first: None,
        failure: None,
        seconds: 0.0,
    };
    for stimuli in sets(&*block, label, options) {
        block.reset();
        let vectors = Vectors::record(&mut *block, stimuli);
        match run(library, label, &vectors) {
            Ok(tally) => {
                row.vectors += tally.rows;
                row.mismatches += tally.mismatches;
                row.first = row.first.or(tally.first);
            }
            Err(error) => {
                row.failure = Some(error.to_string());
                break;
            }
        }
    }
    row.edges = if block.clocked() { row.vectors } else { 0 };
    row.seconds = start.elapsed().as_secs_f64();
    row
}

/// The sets of stimuli of one configuration, made as they are asked for: all products are too many to hold at once.
fn sets<'a>(
    block: &dyn AnyBlock,
    label: &str,
    options: &'a CheckOptions,
) -> Box<dyn Iterator<Item = Vec<Stimulus>> + 'a> {
    let has_pwm = block.outputs()[0].name == "a_high";
    let mut usual = stimuli::directed(block);
    usual.extend(stimuli::random(
        block,
        options.seed,
        if has_pwm {
            10 * options.rows
        } else {
            options.rows
        },
    ));
    let usual = std::iter::once(usual);
    if block.name() != "truncating_multiplier" || label != "default" {
        return Box::new(usual);
    }
    if !options.exhaustive {
        return Box::new(usual.chain(stimuli::stratified(block, options.seed)));
    }
    let (a, b) = (block.inputs()[0].format, block.inputs()[1].format);
    Box::new(usual.chain((0..256).map(move |upper| stimuli::chunk(a, b, upper))))
}

/// Runs a testbench over one set.
fn run(library: &Library, label: &str, vectors: &Vectors) -> Result<Tally, GhdlError> {
    let header = &vectors.header;
    let file = format!("{}-{label}.txt", header.block);
    library.write(&file, &vectors.to_text())?;
    let mut generics: Vec<_> = header
        .generics
        .iter()
        .map(|&(name, value)| (name, literal(value)))
        .collect();
    generics.extend([("FORMAT", header.to_string()), ("VECTORS", file)]);
    let unit = format!("tb_{}", header.block);
    let said = library.run(&unit, &generics, &[])?;
    let tally = tally(&said).filter(|tally| tally.rows == vectors.rows.len() as u64);
    tally.ok_or_else(|| GhdlError::Failed {
        step: format!("finish {unit}"),
        said,
    })
}
