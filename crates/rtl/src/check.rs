//! The check: GHDL compares every block's VHDL with the emulator, row by row, and loops closed around the VHDL, edge by
//! edge.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use hpu_cosim::{Control, NamedBlockError, named_block};
use hpu_datapath::{AnyBlock, block_by_name, block_names, variants_of};

use crate::closed_loop::{LoopJob, LoopScene, Loops};
use crate::engines::error::Error;
use crate::engines::ghdl::Library;
use crate::engines::hdl::Setup;
use crate::engines::sources::sources;
use crate::engines::tool::{Fault, Tool, ToolError};
use crate::vectors::around;
use crate::vectors::coverage::Coverage;
use crate::vectors::package::package;
use crate::vectors::report::{CheckReport, CheckRow, Tally, tally};
use crate::vectors::stimuli;
use crate::vectors::testbench::{VECTOR_READER, committed_vectors, testbench};
use crate::vectors::vector::{Stimulus, Vectors, literal};

/// The longest time that any simulation needs for a row: one that takes longer hangs.
const LONGEST_ROW: Duration = Duration::from_millis(20);

/// The settings of a check.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct CheckOptions {
    /// The VHDL.
    pub setup: Setup,
    /// Names of the blocks.
    pub blocks: Vec<String>,
    /// Labels of the variants; all when empty.
    pub variants: Vec<String>,
    /// Generics as text, which every block must have and take. If there are any, one configuration of each block is
    /// checked, with the defaults of its other generics.
    pub generics: Vec<(String, String)>,
    /// Scenes whose loops are closed around the VHDL, from shortly before they reach their wall.
    pub scenes: Vec<LoopScene>,
    /// Random rows a variant, beside the directed ones (ten times as many for blocks with a PWM).
    pub rows: usize,
    /// Seed of the random rows.
    pub seed: u64,
    /// Checks all 2^24 pairs of words of the default multiplier, instead of 2^16 pairs in strata.
    pub exhaustive: bool,
    /// GHDL processes that run at the same time.
    pub jobs: usize,
}

/// Configurations of blocks, each with its label.
type Configurations = Vec<(String, Box<dyn AnyBlock>)>;

impl CheckOptions {
    /// Returns the settings for every block with 2000 random rows each, on every core, and no scene.
    pub fn new(setup: impl Into<Setup>) -> Self {
        let jobs = thread::available_parallelism().map_or(1, usize::from);
        let blocks = block_names().iter().map(|name| (*name).to_string()).collect();
        let (variants, generics, scenes) = (Vec::new(), Vec::new(), Vec::new());
        Self { setup: setup.into(), blocks, variants, generics, scenes, rows: 2000, seed: 1, exhaustive: false, jobs }
    }

    /// Returns the configurations to check, in the order of the report.
    fn wanted(&self) -> Result<Configurations, Error> {
        if !self.generics.is_empty() {
            let made = |name: &String| Ok((generics_label(&self.generics), named_block(name, &self.generics)?));
            return self
                .blocks
                .iter()
                .map(made)
                .collect::<Result<_, NamedBlockError>>()
                .map_err(|error| Error::usage(error.to_string()));
        }
        let mut all = variants_of(|name| self.blocks.iter().any(|block| block == name));
        all.retain(|(label, _)| self.variants.is_empty() || self.variants.contains(label));
        Ok(all)
    }
}

/// Returns the label of a configuration that is known by these generics, as in `WIDTH=14,LATCHED=false`.
pub fn generics_label(generics: &[(String, String)]) -> String {
    let all: Vec<_> = generics.iter().map(|(name, value)| format!("{name}={value}")).collect();
    all.join(",")
}

/// Compares the VHDL with the emulator: first directed and random rows for every configuration of the blocks, then the
/// scenes.
///
/// # Errors
///
/// [`Error`] when GHDL is missing, the VHDL does not analyse, or a tool is at fault. A mismatch is not an error but
/// a result, and so is a run that the VHDL stopped.
pub fn check(options: &CheckOptions) -> Result<CheckReport, Error> {
    Check::new(options)?.run(&Control::default(), |_| Ok(()))
}

/// A check whose VHDL is analysed and whose GHDL runs are listed.
pub struct Check<'o> {
    options: &'o CheckOptions,
    blocks: Option<Library>,
    loops: Loops,
    scenes: Vec<LoopJob>,
    rows: Vec<PendingRow>,
    jobs: Vec<Job>,
}

/// A row of the report, and the results of its runs so far, by set.
struct PendingRow {
    row: CheckRow,
    clocked: bool,
    runs: usize,
    found: BTreeMap<u64, (Result<Tally, String>, f64)>,
}

/// A run of GHDL for one row of the report.
#[derive(Clone, Copy)]
struct Job {
    row: usize,
    /// The set of vectors, if the row is a block.
    set: u64,
    /// Estimated run time in milliseconds.
    about_ms: u64,
}

impl<'o> Check<'o> {
    /// Analyses the VHDL and lists the runs.
    ///
    /// # Errors
    ///
    /// [`Error`] when GHDL is missing or too old, the VHDL does not analyse, or a scene has no VHDL.
    pub fn new(options: &'o CheckOptions) -> Result<Self, Error> {
        let scenes = options.scenes.iter().map(|scene| LoopJob::new(scene).map(LoopJob::late));
        let scenes = scenes.collect::<Result<Vec<_>, _>>()?;
        Tool::Ghdl.version(options.setup.timeout)?;
        let (mut rows, mut jobs) = (Vec::new(), Vec::new());
        for (label, block) in options.wanted()? {
            let runs = sets(&*block, &label, options);
            for set in 0..runs {
                let about_ms = about_ms(times_us(block.name())[0], count(&*block, set, options));
                jobs.push(Job { row: rows.len(), set, about_ms });
            }
            let (row, clocked) = (CheckRow::new(block.name(), &label), block.clocked());
            rows.push(PendingRow { row, clocked, runs: runs as usize, found: BTreeMap::new() });
        }
        let blocks = if rows.is_empty() {
            None
        } else {
            Some(benches(options.blocks.iter().map(String::as_str), &options.setup)?)
        };
        for scene in &scenes {
            jobs.push(Job { row: rows.len(), set: 0, about_ms: about_ms(times_us(scene.wiring)[1], scene.edges) });
            rows.push(PendingRow { row: scene.row(), clocked: true, runs: 1, found: BTreeMap::new() });
        }
        let loops = Loops::new(&scenes, &options.setup)?;
        Ok(Self { options, blocks, loops, scenes, rows, jobs })
    }

    /// Returns the number of GHDL processes that run at the same time.
    pub fn at_a_time(&self) -> usize {
        self.options.jobs.clamp(1, self.jobs.len().max(1))
    }

    /// Returns the number of configurations of blocks, and the number of scenes.
    pub fn count(&self) -> (usize, usize) {
        (self.rows.len() - self.scenes.len(), self.scenes.len())
    }

    /// Returns the estimated time of all runs together, in milliseconds. It is computed from their rows and edges and
    /// the time per row or edge on the machine of the record.
    pub fn work_ms(&self) -> u64 {
        self.jobs.iter().map(|job| job.about_ms).sum()
    }

    /// Returns the estimated time of the whole check in milliseconds, when the runs share the processes.
    pub fn about_ms(&self) -> u64 {
        let longest = self.jobs.iter().map(|job| job.about_ms).max().unwrap_or(0);
        longest.max(self.work_ms() / self.at_a_time() as u64)
    }

    /// Runs everything, several runs at a time. Passes each row of the report to `tell` as soon as it and all rows
    /// before it are complete. Progress is counted in the milliseconds of [`work_ms`](Self::work_ms).
    ///
    /// # Errors
    ///
    /// [`Error`] when a tool is at fault, or the error that `tell` returned.
    pub fn run<E: From<Error>>(
        mut self,
        control: &Control,
        mut tell: impl FnMut(&CheckRow) -> Result<(), E>,
    ) -> Result<CheckReport, E> {
        self.order();
        let mut rows = std::mem::take(&mut self.rows);
        let blocks = rows.len() - self.scenes.len();
        let (next, ended) = (AtomicUsize::new(0), AtomicBool::new(false));
        let (send, done) = mpsc::channel();
        let work = |send: mpsc::Sender<_>| {
            // A block is not `Send`, so each thread makes its own.
            let mut wanted = self.options.wanted().expect("they were made before");
            while !ended.load(Ordering::Relaxed)
                && let Some(&job) = self.jobs.get(next.fetch_add(1, Ordering::Relaxed))
            {
                let start = Instant::now();
                let found = match job.row.checked_sub(blocks) {
                    Some(scene) => self.scenes[scene].run(&self.loops),
                    None => self.vectors(&mut wanted[job.row], job.set),
                };
                // The receiver is gone only after an error, which is reported there.
                let _ = send.send((job, found, start.elapsed().as_secs_f64()));
            }
        };
        let failed = thread::scope(|scope| {
            for _ in 0..self.at_a_time() {
                let send = send.clone();
                scope.spawn(|| work(send));
            }
            drop(send);
            let mut waiting = (0..rows.len()).peekable();
            for (job, found, seconds) in done {
                let took = rows[job.row].take(job.set, found, seconds);
                control.progress.fetch_add(job.about_ms, Ordering::Relaxed);
                let mut told = took.map_err(E::from);
                while told.is_ok()
                    && let Some(index) = waiting.next_if(|&index| rows[index].is_done())
                {
                    told = tell(rows[index].sum_up());
                }
                if let Err(error) = told {
                    ended.store(true, Ordering::Relaxed);
                    return Some(error);
                }
            }
            None
        });
        let mut rows: Vec<_> = rows.into_iter().map(|row| row.row).collect();
        let loops = rows.split_off(blocks);
        failed.map_or(Ok(CheckReport { rows, loops }), Err)
    }

    /// Sorts the runs: the longest first where a run takes more than a quarter of the time of a process, then the
    /// others in the order of the report, so that the report grows steadily.
    fn order(&mut self) {
        let long = self.work_ms() / (4 * self.at_a_time() as u64);
        self.jobs.sort_by_key(|job| if job.about_ms > long { u64::MAX - job.about_ms } else { u64::MAX });
    }

    /// Runs the testbench of a configuration on one set of vectors.
    fn vectors(&self, (label, block): &mut (String, Box<dyn AnyBlock>), set: u64) -> Result<Tally, Error> {
        let library = self.blocks.as_ref().expect("where a block is checked, blocks are analysed");
        block.reset();
        let stimuli = stimuli(&**block, set, self.options);
        let vectors = Vectors::record(&mut **block, stimuli);
        let mut tally = held(library, &vectors, &format!("{label}-{set}"))?;
        let (rows, Coverage { directed, random, products, .. }) = (tally.rows, &mut tally.coverage);
        (*random, *products) = if set == 0 { (random_rows(&**block, self.options.rows) as u64, 0) } else { (0, rows) };
        *directed = rows - *random - *products;
        Ok(tally)
    }
}

/// Compares the VHDL of a block with vectors, which are written to a file whose name contains `name`.
pub(crate) fn held(library: &Library, vectors: &Vectors, name: &str) -> Result<Tally, Error> {
    let (header, rows) = (&vectors.header, vectors.rows.len());
    let file = format!("{}-{name}.txt", header.block);
    library.write(&file, vectors.to_text())?;
    let mut generics: Vec<_> = header.generics.iter().map(|&(name, value)| (name, literal(value))).collect();
    generics.extend([("FORMAT", header.to_string()), ("VECTORS", file.clone())]);
    let unit = format!("tb_{}", header.block);
    let longest = LONGEST_ROW.saturating_mul(u32::try_from(rows).unwrap_or(u32::MAX));
    let said = library.run(&unit, &generics, &[], longest)?;
    library.remove(&file)?;
    let unfinished = || ToolError::new(Tool::Ghdl, &format!("finish {unit}"), Fault::Silent("result"), &said);
    let tally = tally(&said, &around::of_block(header)).filter(|tally| tally.rows == rows as u64);
    let mut coverage = Coverage::of_block(header);
    vectors.rows.iter().for_each(|row| coverage.row(header.clocked, row.iter().copied()));
    Ok(Tally { coverage, ..tally.ok_or_else(unfinished)? })
}

impl PendingRow {
    /// Keeps the result of a run. A complaint of GHDL about the VHDL is a result; a fault of a tool is returned as an
    /// error.
    fn take(&mut self, set: u64, found: Result<Tally, Error>, seconds: f64) -> Result<(), Error> {
        let found = match found {
            Ok(tally) => Ok(tally),
            Err(error) if error.is_refusal() => Err(error.to_string()),
            Err(error) => return Err(error),
        };
        self.found.insert(set, (found, seconds));
        Ok(())
    }

    fn is_done(&self) -> bool {
        self.found.len() == self.runs
    }

    /// Adds up the results in the order of the sets, whichever set ended first, and returns the whole row.
    fn sum_up(&mut self) -> &CheckRow {
        for (found, seconds) in std::mem::take(&mut self.found).into_values() {
            self.row.add(found, self.clocked, seconds);
        }
        &self.row
    }
}

/// Returns the estimated milliseconds of a run: GHDL's start, then its rows or edges.
fn about_ms(each_us: u64, count: u64) -> u64 {
    50 + each_us * count / 1000
}

/// Returns the microseconds that a row of a block takes in GHDL, and those that an edge of a loop takes in GHDL and the
/// emulator beside it.
fn times_us(block: &str) -> [u64; 2] {
    let of = |line: &str| {
        let mut times = line.strip_prefix(block)?.strip_prefix(' ')?.split(' ').map(|time| time.parse().ok());
        Some([times.next()??, times.next()??])
    };
    include_str!("times.txt").lines().find_map(of).unwrap_or([4, 2])
}

/// Analyses blocks, the blocks that they instantiate, and their testbenches.
pub(crate) fn benches<'n>(names: impl IntoIterator<Item = &'n str>, setup: &Setup) -> Result<Library, Error> {
    let names: Vec<_> = names.into_iter().collect();
    let blocks: Vec<_> =
        block_names().iter().filter(|name| names.contains(name)).filter_map(|name| block_by_name(name)).collect();
    let sources = sources(blocks.iter().map(|block| block.name()), &setup.hdl)?;
    let mut packages = vec![("vector_reader.vhd".to_string(), VECTOR_READER.to_string())];
    let parts = sources.iter().filter_map(|name| block_by_name(name));
    packages.extend(parts.map(|block| (format!("{}_pkg.vhd", block.name()), package(&*block))));
    let testbench =
        |block: &dyn AnyBlock| (format!("tb_{}.vhd", block.name()), testbench(block, &committed_vectors(block)));
    let testbenches: Vec<_> = blocks.iter().map(|block| testbench(&**block)).collect();
    Library::analyse(&packages, setup, sources.iter().map(String::as_str), &testbenches)
}

/// Returns whether this is the multiplier that is checked with all products, or with products in strata.
fn is_the_multiplier(block: &dyn AnyBlock, label: &str) -> bool {
    block.name() == "truncating_multiplier" && label == "default"
}

/// Returns the number of sets of vectors for a configuration. All products are too many for one set in memory.
fn sets(block: &dyn AnyBlock, label: &str, options: &CheckOptions) -> u64 {
    match is_the_multiplier(block, label) {
        true if options.exhaustive => 1 + 256,
        true => 1 + 1,
        false => 1,
    }
}

/// Returns the number of random rows for a configuration, when `rows` are asked for: ten times as many with a PWM.
fn random_rows(block: &dyn AnyBlock, rows: usize) -> usize {
    let has_pwm = block.outputs()[0].name == "a_high";
    if has_pwm { 10 * rows } else { rows }
}

/// Returns the number of stimuli of a set.
fn count(block: &dyn AnyBlock, set: u64, options: &CheckOptions) -> u64 {
    if set == 0 { (stimuli::directed(block).len() + random_rows(block, options.rows)) as u64 } else { 1 << 16 }
}

/// Returns the stimuli of a set. Set 0 has the directed and random ones, the other sets have products.
fn stimuli(block: &dyn AnyBlock, set: u64, options: &CheckOptions) -> Vec<Stimulus> {
    if set == 0 {
        return first_set(block, options.rows, options.seed);
    }
    let (a, b) = (block.inputs()[0].format, block.inputs()[1].format);
    if options.exhaustive { stimuli::chunk(a, b, set - 1) } else { stimuli::stratified(a, b, options.seed) }
}

/// Returns the directed and the random rows.
fn first_set(block: &dyn AnyBlock, rows: usize, seed: u64) -> Vec<Stimulus> {
    [stimuli::directed(block), stimuli::random(block, seed, random_rows(block, rows))].concat()
}

/// Returns the stimuli of all sets of a configuration, with products in strata.
pub(crate) fn all_stimuli(block: &dyn AnyBlock, label: &str, rows: usize, seed: u64) -> Vec<Stimulus> {
    let mut all = first_set(block, rows, seed);
    if is_the_multiplier(block, label) {
        all.extend(stimuli::stratified(block.inputs()[0].format, block.inputs()[1].format, seed));
    }
    all
}
