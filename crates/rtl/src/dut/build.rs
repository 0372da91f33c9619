//! Folders of built models. The name of a folder is the SHA-256 of everything that the model is built from. A folder is
//! [sealed](crate::engines::sealed), so that no model runs and no cost is believed that is not as it was made.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use hpu_cosim::scene::{Dut, DutReset, DutScene};
use hpu_signal::Clock;
use sha2::{Digest, Sha256};

use super::files::plain_names;
use super::text::delay::Delay;
use super::{Names, Prepared, Simulators};
use crate::engines::entry::hexadecimal;
use crate::engines::error::{Error, Reason};
use crate::engines::temporary::Temporary;
use crate::engines::tool::TIMEOUT;
use crate::{engines::owned, engines::sealed};

/// Version of the build. Raise it when the same tools build something else from the same design.
const FLOW: &str = "16";

/// The program around a model of Verilator. A change of it changes every key.
pub(super) const PROGRAM: &str = include_str!("main.cpp");

/// Cycles of a clock from which on nothing waits for a delay.
const LONGEST: u64 = 1 << 16;

/// A design, and how it is clocked.
pub(crate) struct Model<'a> {
    pub(crate) dut: &'a Dut,
    /// The fastest clock of the design.
    pub(crate) clock: Clock,
    /// Cycles of this clock before the first request. Meanwhile the design has the inputs with which the simulation
    /// begins, and is in reset if it has one.
    pub(crate) settle: u64,
    /// Seed of registers that begin at random.
    pub(crate) seed: u64,
    /// The names of its ports and signals.
    pub(crate) names: &'a Names,
}

impl<'a> Model<'a> {
    /// Returns the model of a scene's design, as it was prepared, which settles as long as its reset takes. A reset
    /// lasts until the first values of all delays have come.
    pub(super) fn of(scene: &DutScene, Prepared { dut, names }: &'a Prepared) -> Self {
        let common = common_cycle(dut);
        let settle =
            |reset: &DutReset| common * u64::from(reset.clocks).max(delayed(dut, scene.clock).div_ceil(common));
        let settle = dut.reset.as_ref().map_or(0, settle);
        Self { dut, clock: scene.clock, settle, seed: scene.run.seed, names }
    }
}

/// Returns the cycles of the clock until the first value of every delay that VHDL's simulator keeps has come.
fn delayed(dut: &Dut, clock: Clock) -> u64 {
    let delays = if super::is_vhdl(&dut.files) { super::vhdl::delays(dut) } else { Vec::new() };
    let cycles =
        |delay: Delay| Some((delay.length_s? / clock.period_s()).ceil() as u64).filter(|_| !delay.is_short(clock));
    delays.into_iter().filter_map(cycles).filter(|cycles| *cycles < LONGEST).max().map_or(0, |cycles| cycles + 1)
}

impl Simulators {
    /// Returns the longest time that a tool may run.
    pub(super) fn limit(&self) -> Duration {
        self.setup.timeout.unwrap_or(TIMEOUT)
    }

    /// Returns the folder of a built model. Unless it holds these `results` as they were built, `make` builds the model
    /// in an empty folder first. The key of the folder covers the design, its clocking, and `tools`.
    pub(super) fn built(
        &self,
        model: &Model,
        tools: &str,
        results: &[&str],
        make: impl Fn(&Path) -> Result<(), Error>,
    ) -> Result<Built, Error> {
        let key = key(model, tools);
        let no_folder = |error| Error::io(crate::temporary::parent(), error);
        let cache = self.cache.path().map_err(no_folder)?;
        // Threads that want the same model build it only once.
        let turn = turn(key.clone());
        let _turn = turn.lock().unwrap_or_else(PoisonError::into_inner);
        let built = built_in(cache, &key, tools, results, &make);
        // A cache that is full is no fault of the design.
        let shortage = match &built {
            Ok(_) => None,
            Err(error) => match error.reason() {
                Reason::Io(place, error) if place.starts_with(cache) => {
                    Some(io::Error::new(error.kind(), error.to_string()))
                }
                _ => self.cache.shortage(cache),
            },
        };
        match shortage {
            Some(why) => built_in(self.cache.instead(&why).map_err(no_folder)?, &key, tools, results, &make),
            None => built,
        }
    }
}

/// Returns the folder of a built model in a cache. Unless it is whole already, `make` builds the model first.
fn built_in(
    cache: &Path,
    key: &str,
    tools: &str,
    results: &[&str],
    make: &impl Fn(&Path) -> Result<(), Error>,
) -> Result<Built, Error> {
    let folder = cache.join(key);
    if sealed::holds(&folder, results) {
        return Ok(Built { path: folder, own: None });
    }
    let io = |path: &Path| {
        let path = path.to_path_buf();
        move |error| Error::io(path, error)
    };
    owned::make_folders(cache).map_err(io(cache))?;
    let work = Temporary::folder_in(cache).map_err(io(cache))?;
    make(work.path())?;
    sealed::seal(work.path(), results, tools).map_err(io(work.path()))?;
    Ok(match sealed::place(work, &folder, results) {
        None => Built { path: folder, own: None },
        Some(work) => Built { path: work.path().to_path_buf(), own: Some(work) },
    })
}

/// A folder with a built model.
pub(super) struct Built {
    pub(super) path: PathBuf,
    /// The folder itself where it has no place in the cache; it is removed with this value.
    #[expect(dead_code, reason = "it is kept, not read")]
    own: Option<Temporary>,
}

/// Returns the lock that a thread must hold while it builds the model of this key.
fn turn(key: String) -> Arc<Mutex<()>> {
    static TURNS: Mutex<BTreeMap<String, Arc<Mutex<()>>>> = Mutex::new(BTreeMap::new());
    Arc::clone(TURNS.lock().unwrap_or_else(PoisonError::into_inner).entry(key).or_default())
}

/// Returns the SHA-256 of everything that a model depends on.
fn key(Model { dut, clock, settle, .. }: &Model, tools: &str) -> String {
    let Dut { files, beside, library, libraries, top, standard, clocks, reset, generics, .. } = dut;
    let mut hash = Sha256::new();
    let mut field = |text: &[u8]| {
        hash.update((text.len() as u64).to_le_bytes());
        hash.update(text);
    };
    [FLOW, PROGRAM, tools, &**library, &**top].iter().for_each(|text| field(text.as_bytes()));
    let frequency_hz = clock.frequency_hz();
    field(format!("{standard:?} {clocks:?} {reset:?} {generics:?} {libraries:?} {settle} {frequency_hz}").as_bytes());
    for (name, content) in files {
        field(name.as_bytes());
        field(content);
    }
    for file in beside {
        field(file.place.as_bytes());
        field(&file.content);
    }
    hexadecimal(hash.finalize())
}

/// Writes the design's files into a folder: under their own names, by which they include each other, and under the
/// plain names, by which the tools are called. Files that the design reads beside them have their places.
pub(super) fn write_files(dut: &Dut, folder: &Path) -> Result<(), Error> {
    for ((plain, own), (_, content)) in plain_names(dut).iter().zip(&dut.files) {
        write(folder, own, content)?;
        if **plain != **own {
            write(folder, plain, content)?;
        }
    }
    dut.beside.iter().try_for_each(|file| write(folder, &file.place, &file.content))
}

/// Writes a file into a folder.
pub(super) fn write(folder: &Path, name: &str, content: &[u8]) -> Result<(), Error> {
    let path = folder.join(name);
    if let Some(own) = path.parent() {
        fs::create_dir_all(own).map_err(|error: io::Error| Error::io(own, error))?;
    }
    fs::write(&path, content).map_err(|error: io::Error| Error::io(path, error))
}

/// Returns whether a signal inside the design, at this path, has the name of a clock. Such a signal would seem
/// constant, because signals are read only at clock edges.
pub(super) fn carries_clock(dut: &Dut, path: &str) -> bool {
    let leaf = path.rsplit('.').next().unwrap_or(path);
    dut.clocks.iter().any(|clock| clock.port.eq_ignore_ascii_case(leaf))
}

/// Returns the number of cycles of the fastest clock after which all clocks have the same phase as at the start.
pub(super) fn common_cycle(dut: &Dut) -> u64 {
    dut.clocks.iter().fold(1, |common, clock| lcm(common, clock.divide.into()))
}

fn lcm(one: u64, two: u64) -> u64 {
    let (mut a, mut b) = (one, two);
    while b != 0 {
        (a, b) = (b, a % b);
    }
    one / a * two
}
