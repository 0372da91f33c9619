//! A cache of the costs of blocks.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use hpu_cosim::script::Fixed;
use hpu_datapath::AnyBlock;

use super::{Cost, Counts, DEVICE, SEEDS, bench, ecp5_script, ice40_script, tool_versions};
use crate::engines::entry::{self, Content, Entries};
use crate::engines::error::Error;
use crate::engines::hdl::Setup;
use crate::engines::sources::vhdl;
use crate::vectors::vector::literal;

/// Version of the flow. Raise it when the flow gives other numbers from the same VHDL, tools, scripts and bench.
const FLOW: &str = "1";

/// A folder of costs. An entry's key is the SHA-256 of everything that the cost depends on: the VHDL of the entity and
/// of the entities that it instantiates, its generics, the versions of the tools, and the flow.
#[derive(Debug)]
pub struct Cache {
    entries: Entries,
    tools: [String; 3],
    measured: AtomicU64,
}

impl Cache {
    /// Opens the cache in a folder, and makes the folder when it is missing. `limit` is the user's time limit of a
    /// tool, if there is one.
    ///
    /// # Errors
    ///
    /// [`Error`] when a tool is not installed, because a cost is valid only for the installed versions, and when
    /// the folder cannot be made.
    pub fn open(dir: impl Into<PathBuf>, limit: Option<Duration>) -> Result<Self, Error> {
        let tools = tool_versions(limit)?;
        Ok(Self { entries: Entries::open(dir.into())?, tools, measured: AtomicU64::new(0) })
    }

    /// Returns the cost of a block, from the cache or by [`cost`](super::cost).
    ///
    /// # Errors
    ///
    /// The errors of [`cost`](super::cost).
    pub fn cost(&self, block: &dyn AnyBlock, setup: impl Into<Setup>) -> Result<Cost, Error> {
        self.remembered(block, &setup.into(), |block, setup| super::cost(block, setup))
    }

    /// Returns the primitives of a block, counted by Yosys alone, from the cache or by [`counts`](super::counts).
    ///
    /// # Errors
    ///
    /// The errors of [`cost`](Self::cost).
    pub fn counts(&self, block: &dyn AnyBlock, setup: impl Into<Setup>) -> Result<Counts, Error> {
        self.remembered(block, &setup.into(), |block, setup| super::counts(block, setup))
    }

    /// Returns how many results the tools had to compute since the cache was opened.
    pub fn measured(&self) -> u64 {
        self.measured.load(Ordering::Relaxed)
    }

    /// Returns the tools with their versions.
    pub fn tools(&self) -> &[String; 3] {
        &self.tools
    }

    fn remembered<C: Content>(
        &self,
        block: &dyn AnyBlock,
        setup: &Setup,
        measure: impl FnOnce(&dyn AnyBlock, &Setup) -> Result<C, Error>,
    ) -> Result<C, Error> {
        let generics: Vec<_> =
            block.generics().iter().map(|(name, value)| format!("{name}={}", literal(*value))).collect();
        let about = format!("{} {} by {}", block.name(), generics.join(" "), self.tools.join(", "));
        let key = self.key(block, &about, &vhdl(block.name(), &setup.hdl)?);
        if let Some(found) = self.entries.find(&key) {
            return Ok(found);
        }
        let found = measure(block, setup)?;
        self.measured.fetch_add(1, Ordering::Relaxed);
        self.entries.keep(&key, &about, &found);
        Ok(found)
    }

    /// Returns the SHA-256 of everything that a cost depends on.
    fn key(&self, block: &dyn AnyBlock, about: &str, vhdl: &str) -> String {
        let (name, seeds) = (block.name(), SEEDS.map(|seed| seed.to_string()).join(" "));
        // The option by which Yosys reads Verilog changes no cost.
        let scripts = [ice40_script(name, Fixed("")), ecp5_script(name, Fixed(""))];
        let device = DEVICE.join(" ");
        let bench = bench::bench(block);
        entry::key(&[FLOW, about, vhdl, &bench, &seeds, &device, scripts[0].as_str(), scripts[1].as_str()])
    }
}
