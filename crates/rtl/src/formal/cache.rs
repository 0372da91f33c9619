//! Remembers proofs by the SHA-256 of both sides.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use hpu_datapath::{AnyBlock, ClockEdge};
use hpu_signal::{Format, Term};

use super::{Proof, TOOLS, Verdict, prove};
use crate::engines::entry::{self, Content, Entries};
use crate::engines::error::Error;
use crate::engines::hdl::Setup;
use crate::engines::sources::vhdl;
use crate::vectors::vector::literal;

/// The sources by which a proof is made. If one of them changes, earlier proofs no longer count, because questions or
/// netlist may differ.
const FLOW: [&str; 14] = [
    include_str!("mod.rs"),
    include_str!("../netlists/mod.rs"),
    include_str!("../netlists/cells.rs"),
    include_str!("../netlists/clocking.rs"),
    include_str!("netlist.rs"),
    include_str!("query.rs"),
    include_str!("solver.rs"),
    include_str!("tried.rs"),
    include_str!("../netlists/loops.rs"),
    include_str!("../netlists/unknown.rs"),
    include_str!("../netlists/unknown.v"),
    include_str!("../netlists/wiring.rs"),
    include_str!("../cost/verilog.rs"),
    include_str!("../check.rs"),
];

/// A folder of proofs. The key of a proof is the SHA-256 of everything that it depends on: the VHDL of the entity and
/// of the entities inside, the equations as terms, the generics, the versions of the tools, and the sources of this
/// module. Only proofs are remembered: a refutation is found again, and more time may decide an open block.
#[derive(Debug)]
pub struct Proofs {
    entries: Entries,
    tools: String,
    remembered: AtomicU64,
}

/// Returns the tools of a proof with their versions. `limit` is the user's time limit of a tool, if there is one.
///
/// # Errors
///
/// When a tool is missing or too old.
pub fn tools(limit: Option<Duration>) -> Result<String, Error> {
    TOOLS.iter().map(|tool| Ok(format!("{} {}, ", tool.name(), tool.version(limit)?))).collect()
}

impl Proofs {
    /// Opens the proofs in a folder, and makes the folder when it is missing. `limit` is the user's time limit of a
    /// tool, if there is one.
    ///
    /// # Errors
    ///
    /// [`Error`] when a tool is missing, because a proof counts only for the tools at hand; and when the folder
    /// cannot be made.
    pub fn open(dir: impl Into<PathBuf>, limit: Option<Duration>) -> Result<Self, Error> {
        let tools = tools(limit)?;
        Ok(Self { entries: Entries::open(dir.into())?, tools, remembered: AtomicU64::new(0) })
    }

    /// Proves a block, as [`prove`] does, unless the same has been proved before.
    ///
    /// # Errors
    ///
    /// As [`prove`].
    pub fn prove(&self, block: &dyn AnyBlock, setup: &Setup, limit: Duration) -> Result<Verdict, Error> {
        let Some(equations) = block.equations() else { return prove(block, setup.clone(), limit) };
        let (key, about) = self.key(block, &equations, setup)?;
        if let Some(Solvers(by)) = self.entries.find(&key) {
            self.remembered.fetch_add(1, Ordering::Relaxed);
            return Ok(Verdict::Proved(Proof::new(by)));
        }
        let found = prove(block, setup.clone(), limit)?;
        if let Verdict::Proved(Proof { by, .. }) = &found {
            self.entries.keep(&key, &about, &Solvers(by.clone()));
        }
        Ok(found)
    }

    /// Returns the tools that have proved a block, if such a proof is in the folder.
    ///
    /// # Errors
    ///
    /// [`Error`] when the VHDL cannot be read.
    pub fn find(&self, block: &dyn AnyBlock, setup: &Setup) -> Result<Option<Vec<&'static str>>, Error> {
        let Some(equations) = block.equations() else { return Ok(None) };
        let (key, _) = self.key(block, &equations, setup)?;
        Ok(self.entries.find(&key).map(|Solvers(by)| by))
    }

    /// Returns the key of a proof, and the words about it.
    fn key(&self, block: &dyn AnyBlock, equations: &ClockEdge, setup: &Setup) -> Result<(String, String), Error> {
        let generics: Vec<_> =
            block.generics().iter().map(|(name, value)| format!("{name}={}", literal(*value))).collect();
        let about = format!("{} {} by {}", block.name(), generics.join(" "), self.tools);
        let vhdl = vhdl(block.name(), &setup.hdl)?;
        Ok((entry::key(&[&FLOW.concat(), &about, &vhdl, &terms(equations)]), about))
    }

    /// Returns how many proofs were remembered since the folder was opened.
    pub fn remembered(&self) -> u64 {
        self.remembered.load(Ordering::Relaxed)
    }
}

/// The tools that made a proof.
struct Solvers(Vec<&'static str>);

impl Content for Solvers {
    const EXTENSION: &'static str = "proof";

    fn line(&self) -> String {
        format!("by {}", self.0.join(" "))
    }

    fn from_line(line: &str) -> Option<Self> {
        let known = |name: &str| TOOLS.iter().map(|tool| tool.name()).find(|known| *known == name);
        line.strip_prefix("by ")?.split_whitespace().map(known).collect::<Option<_>>().map(Self)
    }
}

/// Returns a block's registers, equations and lemmas as text.
fn terms(equations: &ClockEdge) -> String {
    let named = |role: &str, index: usize, format: Format| Term::of_bits(format, &format!("|{role} {index}|"));
    let all = |role: &str, formats: &[Format]| -> Vec<Term> {
        formats.iter().enumerate().map(|(index, format)| named(role, index, *format)).collect()
    };
    let registers = &equations.registers;
    let kept: Vec<_> = registers.iter().map(|register| register.format).collect();
    let inputs: Vec<_> = equations.block.inputs().iter().map(|input| input.format).collect();
    let defined = Term::defined(HashMap::new(), || {
        let (next, shown) = equations.in_terms(&all("register", &kept), &all("input", &inputs));
        let claims = equations.lemmas().into_iter().map(|lemma| {
            let (given, follows) = (lemma.follows)(&all("any", &lemma.any));
            format!("{:?} {given:?} {follows:?}", lemma.any)
        });
        format!("{next:?} {shown:?} {}", claims.collect::<String>())
    });
    let ports = format!("{:?} {:?} {registers:?}", equations.block.inputs(), equations.block.outputs());
    format!("{ports}\n{}\n{}\n{:?}", defined.built, defined.lines.join("\n"), defined.cuts)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::{FLOW, Solvers};
    use crate::engines::entry::Content;

    #[test]
    fn every_source_of_a_proof_is_in_its_key() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/src/formal");
        for file in fs::read_dir(folder).expect("the sources").map(|entry| entry.expect("an entry").path()) {
            // They find proofs and wirings, and make none.
            if ["cache.rs", "prover.rs"].iter().any(|name| file.ends_with(name)) {
                continue;
            }
            let text = fs::read_to_string(&file).expect("a source");
            assert!(FLOW.contains(&text.as_str()), "{} is not in FLOW", file.display());
        }
    }

    #[test]
    fn only_tools_that_there_are_have_proved_anything() {
        let read = |line| Solvers::from_line(line).map(|Solvers(by)| by);
        assert_eq!(read("by z3 yices-smt2 ghdl"), Some(vec!["z3", "yices-smt2", "ghdl"]));
        assert_eq!(Solvers(vec!["z3", "ghdl"]).line(), "by z3 ghdl");
        for line in ["", "z3", "by cvc5", "by z3 nobody"] {
            assert_eq!(read(line), None, "{line}");
        }
    }
}
