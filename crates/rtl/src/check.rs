//! The check: every block's VHDL held against the emulator, row by row, in GHDL.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use hpu_datapath::{AnyBlock, registry, variants};

use crate::ghdl::{GhdlError, Library};
use crate::package::package;
use crate::testbench::{VECTOR_READER, testbench};
use crate::vector::{Stimulus, Vectors, literal};
use crate::stimuli;

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
        Self { hdl: hdl.into(), blocks: Vec::new(), rows: 2000, seed: 1, exhaustive: false, jobs }
    }
}

/// The first row in which VHDL and emulator disagree, or the first edge of a closed loop.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Mismatch {
    /// Row of the vectors, counted from 1; for a closed loop the edge, counted from 0.
    pub row: u64,
    /// Name of the signal.
    pub signal: String,
    /// What the emulator says, in bits and in value.
    pub expected: String,
    /// What the VHDL says.
    pub got: String,
    /// Up to 16 rows that end with this one: the words that went in and were expected, then what came out.
    pub history: Vec<String>,
}

/// One configuration of one block, checked.
#[derive(Clone, PartialEq, Debug)]
pub struct CheckRow {
    /// Name of the block.
    pub block: String,
    /// Label of the configuration.
    pub variant: String,
    /// Rows compared.
    pub vectors: u64,
    /// Clock edges among them; 0 for combinational logic.
    pub edges: u64,
    /// Words that differ.
    pub mismatches: u64,
    /// The first of them.
    pub first: Option<Mismatch>,
    /// What GHDL said when it did not come to a result.
    pub failure: Option<String>,
    /// Seconds taken.
    pub seconds: f64,
}

impl CheckRow {
    /// Whether every word was equal.
    #[must_use]
    pub fn ok(&self) -> bool {
        self.mismatches == 0 && self.failure.is_none() && self.vectors > 0
    }
}

/// What the check found.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct CheckReport {
    /// One row a configuration, in the order of `variants()`.
    pub rows: Vec<CheckRow>,
}

impl CheckReport {
    /// Whether there was something to check and every word was equal.
    #[must_use]
    pub fn ok(&self) -> bool {
        !self.rows.is_empty() && self.rows.iter().all(CheckRow::ok)
    }
}

impl fmt::Display for CheckReport {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(f, "{:<22} {:<30} {:>10} {:>10} {:>10} {:>8}", "block", "variant", "vectors", "edges", "mismatches", "s")?;
        for row in &self.rows {
            let CheckRow { block, variant, vectors, edges, mismatches, seconds, .. } = row;
            writeln!(f, "{block:<22} {variant:<30} {vectors:>10} {edges:>10} {mismatches:>10} {seconds:>8.2}")?;
            if let Some(first) = &row.first {
                write!(f, "{first}")?;
            }
            if let Some(failure) = &row.failure {
                writeln!(f, "  {}", failure.trim_end().replace('\n', "\n  "))?;
            }
        }
        Ok(())
    }
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { row, signal, expected, got, history } = self;
        writeln!(f, "  first at {row}: {signal} expected {expected}, got {got}")?;
        history.iter().try_for_each(|row| writeln!(f, "    {row}"))
    }
}

/// Holds the VHDL of a directory against the emulator: directed and random rows for every configuration of every block.
///
/// # Errors
///
/// [`GhdlError`] when GHDL is missing or the VHDL does not analyse. A mismatch is a result, and so is a run that failed.
pub fn check(options: &CheckOptions) -> Result<CheckReport, GhdlError> {
    let library = library(&options.hdl)?;
    let wanted = |name: &str| options.blocks.is_empty() || options.blocks.iter().any(|block| block == name);
    let jobs = variants().into_iter().filter(|(_, block)| wanted(block.name())).count();
    let next = AtomicUsize::new(0);
    // A block is not `Send`: each thread makes its own.
    let work = || {
        let mut rows = Vec::new();
        let mut all: Vec<_> = variants().into_iter().filter(|(_, block)| wanted(block.name())).map(Some).collect();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some((label, block)) = all.get_mut(index).and_then(Option::take) else { return rows };
            rows.push((index, check_variant(&library, &label, block, options)));
        }
    };
    let mut rows: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..options.jobs.clamp(1, jobs.max(1))).map(|_| scope.spawn(work)).collect();
        threads.into_iter().flat_map(|thread| thread.join().expect("a checking thread does not panic")).collect()
    });
    rows.sort_by_key(|(index, _)| *index);
    Ok(CheckReport { rows: rows.into_iter().map(|(_, row)| row).collect() })
}

/// Analyses all blocks of a directory and their testbenches.
fn library(hdl: &Path) -> Result<Library, GhdlError> {
    let blocks = registry();
    let mut packages = vec![("vector_reader.vhd".to_string(), VECTOR_READER.to_string())];
    packages.extend(blocks.iter().map(|block| (format!("{}_pkg.vhd", block.name()), package(&**block))));
    let files: Vec<_> = blocks.iter().map(|block| hdl.join(format!("{}.vhd", block.name()))).collect();
    let testbench = |block: &Box<dyn AnyBlock>| (format!("tb_{}.vhd", block.name()), testbench(&**block));
    Library::analyse(&packages, &files, &blocks.iter().map(testbench).collect::<Vec<_>>())
}

fn check_variant(library: &Library, label: &str, mut block: Box<dyn AnyBlock>, options: &CheckOptions) -> CheckRow {
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
    usual.extend(stimuli::random(block, options.seed, if has_pwm { 10 * options.rows } else { options.rows }));
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

struct Tally {
    rows: u64,
    mismatches: u64,
    first: Option<Mismatch>,
}

/// Runs a testbench over one set.
fn run(library: &Library, label: &str, vectors: &Vectors) -> Result<Tally, GhdlError> {
    let header = &vectors.header;
    let file = format!("{}-{label}.txt", header.block);
    library.write(&file, &vectors.to_text())?;
    let mut generics: Vec<_> = header.generics.iter().map(|&(name, value)| (name, literal(value))).collect();
    generics.extend([("FORMAT", header.to_string()), ("VECTORS", file)]);
    let unit = format!("tb_{}", header.block);
    let said = library.run(&unit, &generics, &[])?;
    let tally = tally(&said).filter(|tally| tally.rows == vectors.rows.len() as u64);
    tally.ok_or_else(|| GhdlError::Failed { step: format!("finish {unit}"), said })
}

/// Reads what a testbench wrote: `RESULT`, and before it `MISMATCH` and `HISTORY` when there was one.
fn tally(said: &str) -> Option<Tally> {
    let number = |line: &str, key: &str| line.split_once(key)?.1.split(' ').next()?.parse().ok();
    let result = said.lines().find(|line| line.starts_with("RESULT "))?;
    let first = said.lines().find_map(|line| first(line.strip_prefix("MISMATCH row=")?));
    let history = || said.lines().filter_map(|line| line.strip_prefix("HISTORY ")).map(str::to_string).collect();
    Some(Tally {
        rows: number(result, "rows=")?,
        mismatches: number(result, "mismatches=")?,
        first: first.map(|first| Mismatch { history: history(), ..first }),
    })
}

/// `<row> signal=<name> expected=<bits and value> got=<bits and value>`
fn first(line: &str) -> Option<Mismatch> {
    let (row, line) = line.split_once(" signal=")?;
    let (signal, line) = line.split_once(" expected=")?;
    let (expected, got) = line.split_once(" got=")?;
    Some(Mismatch {
        row: row.parse().ok()?,
        signal: signal.to_string(),
        expected: expected.to_string(),
        got: got.to_string(),
        history: Vec::new(),
    })
}
