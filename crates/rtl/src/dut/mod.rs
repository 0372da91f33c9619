//! Designs of the user's own, built and simulated by GHDL or Verilator. Each is a process that answers one kind of
//! request: clock so many edges with these inputs.
//!
//! A built model is kept in a folder whose name is the SHA-256 of the design's files, its generics, its interface to
//! the world and the tools.
//!
//! GHDL runs the files under a generated bench whose signals have the ports' own types, and shows signals inside by
//! VPI. Verilator makes a program of Verilog, or of GHDL's synthesis of VHDL with the same repairs as for costs. It
//! knows no X: so models whose unset registers begin with other values are clocked beside the first one until their
//! states are equal.

mod build;
mod clocks;
mod cost;
mod declared;
mod fallback;
mod files;
mod flattened;
mod ghdl;
mod icarus;
pub(crate) mod leap;
mod past;
mod process;
mod program;
mod said;
mod synthesised;
mod text;
mod transition;
mod translated;
mod verilator;
mod vhdl;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use hpu_cosim::dut::{Design, Designs, Fault, Inside, Port};
use hpu_cosim::scene::{Dut, DutScene, Engine, Language, Registers, SourceFile};

use crate::engines::cache_folder::CacheFolder;
use crate::engines::error::{Error, Reason};
use crate::engines::hdl::Setup;
use crate::engines::note::note;
use crate::engines::tool::{Tool, ToolError};

pub(crate) use build::Model;
pub use cost::DutCost;
pub(crate) use files::refuses;
pub(crate) use ghdl::{bench, bridge, simulate};
pub(crate) use process::{ANSWER, Process};
use text::delay::{first, left_out};
pub(crate) use transition::{INVARIANT, Transition};
pub(crate) use vhdl::{Names, interface};

use fallback::Fallback;

/// Whether this program must simulate no design, because its caller has asked so.
static FORBIDDEN: AtomicBool = AtomicBool::new(false);

/// Makes this program refuse to simulate designs from here on.
pub fn forbid() {
    FORBIDDEN.store(true, Ordering::Relaxed);
}

/// Returns whether designs must not be simulated: after [`forbid`], and where the variable `HPU_NO_DUT` is set, unless
/// it is empty or 0.
pub fn is_forbidden() -> bool {
    let is_set = || std::env::var_os("HPU_NO_DUT").is_some_and(|value| !value.is_empty() && value != "0");
    FORBIDDEN.load(Ordering::Relaxed) || is_set()
}

/// Whether a design was not simulated because that [is forbidden](is_forbidden).
static REFUSED: AtomicBool = AtomicBool::new(false);

/// Returns whether this program has refused to simulate a design. What it has computed then lacks a part, and must not
/// be kept as a result.
pub fn was_refused() -> bool {
    REFUSED.load(Ordering::Relaxed)
}

/// Refuses to simulate a design where that [is forbidden](is_forbidden).
fn allowed(dut: &Dut) -> Result<(), Error> {
    if !is_forbidden() {
        return Ok(());
    }
    REFUSED.store(true, Ordering::Relaxed);
    Err(Error::usage(format!(
        "the design `{}` is not simulated: a design is code that runs on this machine, and HPU_NO_DUT or --no-dut \
         forbids it; leave both out if you trust the design",
        dut.top
    )))
}

/// Returns the error of a scene's design as a fault: where the scene's text is wrong, with its line.
pub fn at(error: Error, scene: &DutScene) -> Fault {
    if let Reason::Key(key, why) = error.reason() {
        return scene.error(key, why.clone()).into();
    }
    if let Reason::Port(name, why) = error.reason() {
        let of_port = |port: &str| port.split(['.', '(', '[']).next().is_some_and(|own| own.eq_ignore_ascii_case(name));
        let connected = scene.dut.ports.iter().find(|connected| of_port(&connected.port));
        let key = connected.map_or("dut.ports".to_string(), hpu_cosim::scene::Connected::path);
        return scene.error(&key, why.clone()).into();
    }
    let Reason::Generic(name, why) = error.reason() else { return error.into() };
    let keys = ["generics", "parameters"].map(|section| format!("dut.{section}.{name}"));
    let key = keys.iter().find(|key| scene.gives(key)).unwrap_or(&keys[0]);
    scene.error(key, why.clone()).into()
}

/// Returns the error of a tool that worked on a design: the tool refused the design, or failed by itself. Files have
/// their own names in it.
pub(crate) fn of_tool(dut: &Dut, error: ToolError) -> Error {
    if !error.refused() {
        return error.into();
    }
    let said = files::plain_names(dut).iter().fold(error.said, |said, (plain, own)| said.replace(&**plain, own));
    let said = dut.beside.iter().fold(said, |said, file| said.replace(&file.place, &file.path));
    refuses(error.tool, dut, text::verilog::with_places(&said))
}

/// The installed simulators.
#[derive(Clone, Debug)]
pub struct Simulators {
    /// The folder in which built models are kept.
    pub cache: CacheFolder,
    /// The shared library that GHDL calls, and the time limit of a tool.
    pub setup: Setup,
}

impl Simulators {
    /// Builds a design that is compared with a block: VHDL in GHDL, which knows unknown bits, Verilog in Verilator.
    pub(crate) fn of_model(&self, model: &Model) -> Result<Box<dyn Design>, Error> {
        allowed(model.dut)?;
        if is_vhdl(&model.dut.files) {
            return Ok(Box::new(self.ghdl(model, "", Inside::Nothing)?));
        }
        Ok(Box::new(self.verilator(model, Inside::Nothing)?))
    }

    /// Returns the ports of such a design, of which no program is made.
    pub(crate) fn ports_of_model(&self, model: &Model) -> Result<Vec<Port>, Error> {
        if is_vhdl(&model.dut.files) {
            return Ok(self.ghdl(model, "", Inside::Nothing)?.ports().to_vec());
        }
        self.ports_of_verilog(model)
    }
}

impl Designs for Simulators {
    fn build(&self, scene: &DutScene, inside: Inside) -> Result<Arc<dyn Design>, Fault> {
        allowed(&scene.dut)?;
        let prepared = self.prepared(&scene.dut).map_err(|error| at(error, scene))?;
        let (is_vhdl, model) = (is_vhdl(&scene.dut.files), Model::of(scene, &prepared));
        let built: Result<Arc<dyn Design>, Error> = match (scene.dut.engine, is_vhdl) {
            (Engine::Ghdl, false) => {
                return Err(scene.error("dut.engine", "GHDL reads VHDL; write \"verilator\" or \"auto\"").into());
            }
            (Engine::Auto, _) => self.automatic(&model, scene, inside),
            (Engine::Leap, _) => self.leaping_alone(&model, inside),
            (Engine::Ghdl, true) => self.ghdl(&model, "", inside).map(|design| Arc::new(design) as Arc<dyn Design>),
            (Engine::Verilator, true) if let Some(delay) = lost_delay(&model) => {
                let reason = format!("{delay}: {LOST}; write \"ghdl\" or \"auto\", which keep it");
                return Err(scene.error("dut.engine", reason).into());
            }
            (Engine::Verilator, _) => self.verilator(&model, inside).map(|design| Arc::new(design) as _),
        };
        built.map_err(|error| at(error, scene))
    }
}

/// Why a delay keeps VHDL from Verilator.
const LOST: &str = "synthesis, the way of VHDL to Verilator, loses this delay, which does not end within half a clock \
                    cycle";

impl Simulators {
    /// Builds a design as a netlist that leaps.
    fn leaping_alone(&self, model: &Model, inside: Inside) -> Result<Arc<dyn Design>, Error> {
        let refused = |why: String| Error::key("dut.engine", format!("{why}; write \"auto\""));
        if let Some(delay) = is_vhdl(&model.dut.files).then(|| lost_delay(model)).flatten() {
            return Err(refused(format!("{delay}: {LOST}")));
        }
        match self.leaping(model, inside)? {
            Ok(design) => Ok(Arc::new(design)),
            Err(why) => Err(refused(format!("the design cannot leap: {why}"))),
        }
    }

    /// Builds a design as a netlist that leaps where it has one, else for Verilator or GHDL.
    fn automatic(&self, model: &Model, scene: &DutScene, inside: Inside) -> Result<Arc<dyn Design>, Error> {
        if is_vhdl(&model.dut.files) && lost_delay(model).is_some() {
            return self.clocked(model, scene, inside, None);
        }
        // What fails on the way to a netlist is told by the other simulators, or is no matter to them.
        let why = match self.leaping_at_first(model, scene, inside) {
            Ok(Ok(design)) => return Ok(design),
            Ok(Err(why)) => why,
            Err(error) => first_line(&error.to_string()),
        };
        self.clocked(model, scene, inside, Some(&why))
    }

    /// Builds a design for Verilator where it takes it, else for GHDL. `why` tells why it does not leap.
    fn clocked(
        &self,
        model: &Model,
        scene: &DutScene,
        inside: Inside,
        why: Option<&str>,
    ) -> Result<Arc<dyn Design>, Error> {
        if !is_vhdl(&model.dut.files) {
            return self.verilator(model, inside).map(|design| Arc::new(design.without_leaps(why)) as _);
        }
        match lost_delay(model) {
            Some(delay) => self.instead(model, inside, &format!("{delay}: {LOST}"), "leave that delay out"),
            None => self.verilator_or_ghdl(model, scene, inside, why),
        }
    }

    /// Builds a design in VHDL for Verilator, or for GHDL if only the way through Verilog fails.
    fn verilator_or_ghdl(
        &self,
        model: &Model,
        scene: &DutScene,
        inside: Inside,
        why: Option<&str>,
    ) -> Result<Arc<dyn Design>, Error> {
        let error = match self.verilator(model, inside).map(|design| design.without_leaps(why)) {
            Ok(design) if model.dut.registers != Registers::Unknown => return Ok(Arc::new(design)),
            Ok(design) => return Ok(Arc::new(Fallback::new(self, scene, model, design))),
            Err(error) => error,
        };
        match error.tool() {
            None => {
                let why = format!("Verilator does not take it: {}", first_line(&error.to_string()));
                self.instead(model, inside, &why, "write what it names as synthesis takes it")
            }
            Some(tool) if tool.tool == Tool::Verilator && tool.is_unusable() => {
                self.instead(model, inside, "there is no Verilator", &error.to_string())
            }
            Some(tool) if tool.crashed() && tool.step == synthesised::SYNTHESIS => {
                let remedy = "write the design as synthesis takes it";
                self.instead(model, inside, "GHDL's synthesis ends by an error of its own", remedy)
            }
            // A design that GHDL itself refuses is refused.
            Some(_) => Err(error),
        }
    }

    /// Builds a design for GHDL in the place of Verilator, and says so: why, what that costs, and what avoids it.
    fn instead(&self, model: &Model, inside: Inside, why: &str, remedy: &str) -> Result<Arc<dyn Design>, Error> {
        if model.dut.registers != Registers::Unknown {
            let reason = format!("it needs Verilator; {why}; {remedy}, or leave this out");
            return Err(Error::key("dut.registers", reason));
        }
        let design = self.ghdl(model, &format!("; {why}"), inside)?;
        note_of_ghdl(model.dut, why, remedy);
        Ok(Arc::new(design))
    }
}

/// Tells that GHDL simulates a design in the place of Verilator: why, what that costs, and what avoids it.
fn note_of_ghdl(dut: &Dut, why: &str, remedy: &str) {
    note(format!(
        "GHDL simulates `{}`, 50 to 400 times more slowly than Verilator: {why}; to avoid it, {remedy}; dut.engine = \
         \"verilator\" refuses instead",
        dut.top
    ));
}

/// Returns the first delay of a design in VHDL that must not be lost. Tells of shorter ones, without which whatever is
/// clocked sees the same.
fn lost_delay(model: &Model) -> Option<String> {
    let (short, long): (Vec<_>, Vec<_>) =
        vhdl::delays(model.dut).into_iter().partition(|delay| delay.is_short(model.clock));
    let lost = first(&long);
    if let (None, Some(short)) = (&lost, first(&short)) {
        note(left_out(&short));
    }
    lost
}

/// A design as its tools take it, and the names of its ports there.
pub(crate) struct Prepared {
    pub(crate) dut: Dut,
    pub(crate) names: Names,
}

impl Simulators {
    /// Returns a design as its tools take it: files behind those that they use; VHDL in its libraries, with the values
    /// of its generics, and with a port for each word.
    pub(crate) fn prepared(&self, dut: &Dut) -> Result<Prepared, Error> {
        if !is_vhdl(&dut.files) {
            return Ok(Prepared { dut: files::order::of_verilog(dut)?, names: Names::default() });
        }
        let mut dut = vhdl::prepared(dut)?;
        let names = self.flattened(&mut dut)?;
        Ok(Prepared { dut, names })
    }
}

/// Returns a simulator's name with a remark behind the tools, before what it tells of registers.
pub(crate) fn with_reason(engine: &str, remark: &str) -> String {
    match engine.split_once(';') {
        Some((tools, rest)) => format!("{tools} ({remark});{rest}"),
        None => format!("{engine} ({remark})"),
    }
}

/// Joins the head of a message and the line after it.
fn first_line(said: &str) -> String {
    let mut lines = said.lines();
    let (head, next) = (lines.next().unwrap_or_default(), lines.next().unwrap_or_default());
    format!("{} {}", head.trim_end_matches(':'), next.trim()).trim().to_string()
}

/// Returns whether a design is VHDL.
pub(crate) fn is_vhdl(files: &[SourceFile]) -> bool {
    Language::of(files) == Language::Vhdl
}
