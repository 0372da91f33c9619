//! What blocks cost, remembered.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

use hpu_datapath::AnyBlock;

use super::{Cost, CostError, Counts, DEVICE, SEEDS, bench, ecp5_script, ice40_script, tool_versions};
use crate::entry::{self, Content, Entries};
use crate::hdl::Setup;
use crate::sources::vhdl;
use crate::vector::literal;

/// Goes up when the flow gives other numbers from the same VHDL, tools, scripts and bench.
const FLOW: &str = "1";

/// A folder of costs, by the SHA-256 of all that they depend on: the VHDL of the entity and of what it instantiates, its
/// generics, the versions of the tools, and the flow.
#[derive(Debug)]
pub struct Cache {
    entries: Entries,
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
        let tools = tool_versions()?;
        Ok(Self { entries: Entries::open(dir.into())?, tools, measured: AtomicU64::new(0) })
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
        if let Some(found) = self.entries.find(&key)? {
            return Ok(found);
        }
        let found = measure(block, setup)?;
        self.measured.fetch_add(1, Ordering::Relaxed);
        self.entries.keep(&key, &about, &found)?;
        Ok(found)
    }

    /// SHA-256 of all that a cost depends on.
    fn key(&self, block: &dyn AnyBlock, about: &str, vhdl: &str) -> String {
        let (name, seeds) = (block.name(), SEEDS.map(|seed| seed.to_string()).join(" "));
        let (device, scripts) = (DEVICE.join(" "), [ice40_script(name), ecp5_script(name)]);
        let bench = bench::bench(block);
        entry::key(&[FLOW, about, vhdl, &bench, &seeds, &device, &scripts[0], &scripts[1]])
    }
}
