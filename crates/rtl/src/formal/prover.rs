//! Proves blocks and the wirings made of them; no proof is made twice.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use hpu_datapath::{AnyBlock, Generic, Parts};

use super::{Proofs, Verdict, prove};
use crate::engines::error::Error;
use crate::engines::hdl::Setup;
use crate::engines::sources::library;
use crate::netlists::cells::Modules;
use crate::netlists::wiring::{Leaf, leaves, other_generics};

/// An instance on which a wiring rests.
#[derive(Clone, PartialEq, Debug)]
pub struct Part {
    /// Its label behind those of the instances around it, as `front.sync`.
    pub place: String,
    /// The name of the block.
    pub block: &'static str,
    /// Its generics.
    pub generics: Vec<(&'static str, Generic)>,
    /// The result of its proof.
    pub verdict: Verdict,
}

/// Proves blocks of one VHDL, and wirings by the blocks inside; remembers the proof and the netlist of each block in
/// each configuration.
pub struct Prover {
    setup: Setup,
    limit: Duration,
    proofs: Option<Proofs>,
    known: Mutex<HashMap<String, Arc<Known>>>,
}

#[derive(Default)]
struct Known {
    netlist: Mutex<Option<Arc<str>>>,
    verdict: Mutex<Option<Verdict>>,
}

impl Prover {
    /// Returns a prover for this VHDL that gives each query this much time.
    pub fn new(setup: impl Into<Setup>, limit: Duration) -> Self {
        Self { setup: setup.into(), limit, proofs: None, known: Mutex::default() }
    }

    /// Returns the prover with a folder of proofs: a proof in it is not made again.
    #[must_use]
    pub fn remembering(self, proofs: Proofs) -> Self {
        Self { proofs: Some(proofs), ..self }
    }

    /// Returns how many proofs the folder had.
    pub fn remembered(&self) -> u64 {
        self.proofs.as_ref().map_or(0, Proofs::remembered)
    }

    /// Proves a block as [`prove`] does. For a block made of blocks, proves its wiring and all blocks inside.
    ///
    /// # Errors
    ///
    /// As [`prove`].
    pub fn prove(&self, block: &dyn AnyBlock) -> Result<Verdict, Error> {
        let Some(parts) = block.parts() else { return self.alone(block) };
        let leaves = match self.leaves(block, parts)? {
            Ok(leaves) => leaves,
            Err(why) => return Ok(Verdict::Miswired(why)),
        };
        let part = |Leaf { place, model, .. }| {
            let verdict = self.alone(&*model)?;
            Ok(Part { place, block: model.name(), generics: model.generics(), verdict })
        };
        Ok(Verdict::Wired(leaves.into_iter().map(part).collect::<Result<_, Error>>()?))
    }

    /// Returns the first difference between the wiring of a block and that of its VHDL. Returns `None` if they are
    /// equal, and for a block that is not made of blocks. The result proves nothing about the blocks inside, except
    /// that they are the same blocks in the same configurations.
    ///
    /// # Errors
    ///
    /// [`Error`] when a tool is missing, or the VHDL does not synthesise.
    pub fn wiring(&self, block: &dyn AnyBlock) -> Result<Option<String>, Error> {
        let Some(parts) = block.parts() else { return Ok(None) };
        Ok(self.leaves(block, parts)?.err())
    }

    /// Returns the leaves of a wiring that is equal, or the first difference.
    fn leaves(&self, block: &dyn AnyBlock, parts: Parts) -> Result<Result<Vec<Leaf>, String>, Error> {
        let library = library(block.name(), &self.setup).map_err(Error::of_input)?;
        let modules = Modules::new(block, &library)?;
        let unread = || Error::file(format!("the netlist of {} by Yosys is not understood", block.name()));
        let wired = modules.wired(block.name(), &library)?.ok_or_else(unread)?;
        let leaves = match leaves(&wired, block, parts) {
            Ok(leaves) => leaves,
            Err(why) => return Ok(Err(why)),
        };
        for leaf in &leaves {
            if *modules.netlist(&leaf.module) != *self.netlist(&*leaf.model)? {
                return Ok(Err(other_generics(leaf)));
            }
        }
        Ok(Ok(leaves))
    }

    fn known(&self, block: &dyn AnyBlock) -> Arc<Known> {
        let key = format!("{} {:?}", block.name(), block.generics());
        Arc::clone(lock(&self.known).entry(key).or_default())
    }

    /// Returns the proof of a block alone; another thread that asks for the same one waits.
    fn alone(&self, block: &dyn AnyBlock) -> Result<Verdict, Error> {
        let known = self.known(block);
        let mut verdict = lock(&known.verdict);
        if verdict.is_none() {
            *verdict = Some(match &self.proofs {
                Some(proofs) => proofs.prove(block, &self.setup, self.limit)?,
                None => prove(block, &self.setup, self.limit)?,
            });
        }
        Ok(verdict.clone().expect("it is proved"))
    }

    /// Returns the netlist of a block alone: that of its proof, apart from the numbers of nets.
    fn netlist(&self, block: &dyn AnyBlock) -> Result<Arc<str>, Error> {
        let known = self.known(block);
        let mut netlist = lock(&known.netlist);
        if netlist.is_none() {
            let library = library(block.name(), &self.setup).map_err(Error::of_input)?;
            *netlist = Some(Modules::new(block, &library)?.netlist(block.name()).into());
        }
        Ok(Arc::clone(netlist.as_ref().expect("it is synthesised")))
    }
}

/// Locks the mutex even after a panic: the data are whole, because no thread writes them in two steps.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
