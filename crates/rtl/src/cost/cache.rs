//! What blocks cost, remembered.

use std::fs;
use std::io::Write;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use hpu_datapath::AnyBlock;
use sha2::{Digest, Sha256};

use super::entry::{self, Content};
use super::{Cost, CostError, Counts, DEVICE, SEEDS, bench, ecp5_script, ice40_script, tool_versions};
use crate::ghdl::GhdlError;
use crate::hdl::Setup;
use crate::sources::vhdl;
use crate::temporary::{self, Temporary, sweep_files};
use crate::vector::literal;

/// Goes up when the flow gives other numbers from the same VHDL, tools, scripts and bench.
const FLOW: &str = "1";

/// A folder of costs, one small file each, by the SHA-256 of all that they depend on: the VHDL of the entity and of
/// what it instantiates, its generics, the versions of the tools, and the flow. A file that is not whole by its
/// checksum, or of another key, is measured again and replaced. Several programs may share a folder: files appear
/// whole.
#[derive(Debug)]
pub struct Cache {
    dir: PathBuf,
    tools: [String; 3],
    measured: AtomicU64,
}

impl Cache {
    /// The cache in a folder, which is made when it is missing.
    ///
    /// # Errors
    ///
    /// [`CostError`] when a tool is not installed: a cost is one by the tools at hand; and when there can be no such
    /// folder.
    pub fn open(dir: impl Into<PathBuf>) -> Result<Self, CostError> {
        let (dir, tools) = (dir.into(), tool_versions()?);
        fs::create_dir_all(&dir).map_err(|error| refused(&dir, error))?;
        sweep_files(&dir);
        Ok(Self { dir, tools, measured: AtomicU64::new(0) })
    }

    /// What a block costs; see [`cost`](super::cost).
    ///
    /// # Errors
    ///
    /// As [`cost`](super::cost), and when the folder cannot be read or written.
    pub fn cost(&self, block: &dyn AnyBlock, setup: impl Into<Setup>) -> Result<Cost, CostError> {
        self.remembered(block, &setup.into(), |block, setup| super::cost(block, setup))
    }

    /// The primitives of a block by Yosys alone; see [`counts`](super::counts).
    ///
    /// # Errors
    ///
    /// As [`cost`](Self::cost).
    pub fn counts(&self, block: &dyn AnyBlock, setup: impl Into<Setup>) -> Result<Counts, CostError> {
        self.remembered(block, &setup.into(), |block, setup| super::counts(block, setup))
    }

    /// How many answers the tools had to give, since the cache was opened.
    pub fn measured(&self) -> u64 {
        self.measured.load(Ordering::Relaxed)
    }

    /// The tools with their versions.
    pub fn tools(&self) -> &[String; 3] {
        &self.tools
    }

    fn remembered<C: Content>(
        &self,
        block: &dyn AnyBlock,
        setup: &Setup,
        measure: impl FnOnce(&dyn AnyBlock, &Setup) -> Result<C, CostError>,
    ) -> Result<C, CostError> {
        let generics: Vec<_> =
            block.generics().iter().map(|(name, value)| format!("{name}={}", literal(*value))).collect();
        let about = format!("{} {} by {}", block.name(), generics.join(" "), self.tools.join(", "));
        let key = self.key(block, &about, &vhdl(block.name(), &setup.hdl)?);
        let place = self.dir.join(format!("{key}.{}", C::EXTENSION));
        match fs::read(&place) {
            Ok(bytes) => {
                if let Some(found) = std::str::from_utf8(&bytes).ok().and_then(|text| entry::read(&key, text)) {
                    return Ok(found);
                }
            }
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => return Err(refused(&place, error)),
        }
        let found = measure(block, setup)?;
        self.measured.fetch_add(1, Ordering::Relaxed);
        let written = Temporary::file(&self.dir, &key).and_then(|file| {
            file.open()?.write_all(entry::write(&key, &about, &found).as_bytes())?;
            temporary::place(vec![(file, place.clone())]).map_err(|(_, error)| error)
        });
        written.map_err(|error| refused(&place, error))?;
        Ok(found)
    }

    /// SHA-256 of all that a cost depends on, in hexadecimal digits; every part with its length, so that none runs into
    /// the next.
    fn key(&self, block: &dyn AnyBlock, about: &str, vhdl: &str) -> String {
        let (name, seeds) = (block.name(), SEEDS.map(|seed| seed.to_string()).join(" "));
        let (device, scripts) = (DEVICE.join(" "), [ice40_script(name), ecp5_script(name)]);
        let bench = bench::bench(block);
        let parts = [FLOW, about, vhdl, &bench, &seeds, &device, &scripts[0], &scripts[1]];
        let mut hash = Sha256::new();
        for part in parts {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part);
        }
        entry::hexadecimal(hash.finalize())
    }
}

fn refused(place: &Path, error: io::Error) -> CostError {
    GhdlError::Io(place.to_path_buf(), error).into()
}
