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
    /// Labels of the variants; all when empty.
    pub variants: Vec<String>,
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
        Self { hdl: hdl.into(), blocks: Vec::new(), variants: Vec::new(), rows: 2000, seed: 1, exhaustive: false, jobs }
    }
}

/// Holds the VHDL of a directory against the emulator: directed and random rows for every configuration of every block.
///
/// # Errors
///
/// [`GhdlError`] when GHDL is missing or the VHDL does not analyse. A mismatch is a result, and so is a run that failed.
pub fn check(options: &CheckOptions) -> Result<CheckReport, GhdlError> {
    let library = library(&options.hdl)?;
    let wanted = || -> Vec<_> {
        let all = variants().into_iter();
        let wanted = |names: &[String], name: &str| names.is_empty() || names.iter().any(|wanted| wanted == name);
        all.filter(|(label, block)| wanted(&options.blocks, block.name()) && wanted(&options.variants, label)).collect()
    };
    let mut report = CheckReport::default();
    let mut jobs = Vec::new();
    for (index, (label, block)) in wanted().iter().enumerate() {
        report.rows.push(CheckRow::new(block.name(), label));
        jobs.extend((0..sets(&**block, label, options)).map(|set| (index, set)));
    }
    let next = AtomicUsize::new(0);
    // A block is not `Send`: each thread makes its own.
    let work = || {
        let mut blocks = wanted();
        let mut done = Vec::new();
        while let Some(&(index, set)) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
            let (label, block) = &mut blocks[index];
            let start = Instant::now();
            block.reset();
            let stimuli = stimuli(&**block, set, options);
            let result = run(&library, &format!("{label}-{set}"), &Vectors::record(&mut **block, stimuli));
            done.push((index, set, result, start.elapsed().as_secs_f64()));
        }
        done
    };
    let mut done: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..options.jobs.max(1)).map(|_| scope.spawn(work)).collect();
        threads.into_iter().flat_map(|thread| thread.join().expect("a checking thread does not panic")).collect()
    });
    done.sort_by_key(|&(index, set, ..)| (index, set));
    let blocks = wanted();
    for (index, _, result, seconds) in done {
        report.rows[index].add(result.map_err(|error| error.to_string()), blocks[index].1.clocked(), seconds);
    }
    Ok(report)
}

/// Analyses all blocks of a directory and their testbenches.
fn library(hdl: &Path) -> Result<Library, GhdlError> {
    let blocks = registry();
    let mut packages = vec![("vector_reader.vhd".to_string(), VECTOR_READER.to_string())];
    packages.extend(blocks.iter().map(|block| (format!("{}_pkg.vhd", block.name()), package(&**block))));
    let files: Vec<_> = blocks.iter().map(|block| hdl.join(format!("{}.vhd", block.name()))).collect();
    let testbench = |block: &dyn AnyBlock| (format!("tb_{}.vhd", block.name()), testbench(block));
    Library::analyse(&packages, &files, &blocks.iter().map(|block| testbench(&**block)).collect::<Vec<_>>())
}

/// Whether this is the multiplier whose products are taken all, or in strata.
fn is_the_multiplier(block: &dyn AnyBlock, label: &str) -> bool {
    block.name() == "truncating_multiplier" && label == "default"
}

/// How many sets of vectors a configuration is checked with: all products are too many to hold at once.
fn sets(block: &dyn AnyBlock, label: &str, options: &CheckOptions) -> u64 {
    match is_the_multiplier(block, label) {
        true if options.exhaustive => 1 + 256,
        true => 1 + 1,
        false => 1,
    }
}

/// The stimuli of a set: directed and random ones first, then products.
fn stimuli(block: &dyn AnyBlock, set: u64, options: &CheckOptions) -> Vec<Stimulus> {
    if set == 0 {
        let has_pwm = block.outputs()[0].name == "a_high";
        let rows = if has_pwm { 10 * options.rows } else { options.rows };
        return [stimuli::directed(block), stimuli::random(block, options.seed, rows)].concat();
    }
    let (a, b) = (block.inputs()[0].format, block.inputs()[1].format);
    if options.exhaustive { stimuli::chunk(a, b, set - 1) } else { stimuli::stratified(a, b, options.seed) }
}

/// Runs a testbench over one set.
fn run(library: &Library, label: &str, vectors: &Vectors) -> Result<Tally, GhdlError> {
    let header = &vectors.header;
    let file = format!("{}-{label}.txt", header.block);
    library.write(&file, &vectors.to_text())?;
    let mut generics: Vec<_> = header.generics.iter().map(|&(name, value)| (name, literal(value))).collect();
    generics.extend([("FORMAT", header.to_string()), ("VECTORS", file.clone())]);
    let unit = format!("tb_{}", header.block);
    let said = library.run(&unit, &generics, &[])?;
    library.remove(&file)?;
    let tally = tally(&said).filter(|tally| tally.rows == vectors.rows.len() as u64);
    tally.ok_or_else(|| GhdlError::Failed { step: format!("finish {unit}"), said })
}
