//! The source of a command's VHDL, and the time limit of its tools.

use std::path::{Path, PathBuf};
use std::time::Duration;

use hpu_cosim::scene::{DutScene, Experiment};
use hpu_rtl::dut::{Simulators, is_forbidden};
use hpu_rtl::{Hdl, Setup};

use crate::shell::cache::cache_folder;
use crate::shell::exit::Failure;
use crate::shell::values;

/// The VHDL and its tools.
#[derive(Default, clap::Args)]
pub struct Vhdl {
    /// Folder of the VHDL [default: hdl, where the command runs, if it holds VHDL of a block, else what hpu carries]
    #[arg(long, value_name = "DIR")]
    hdl: Option<PathBuf>,
    /// Kill a tool (GHDL, Yosys, nextpnr) that runs longer [default: 1800, more for a simulation of many rows or edges]
    #[arg(long, value_name = "SECONDS", value_parser = values::limit)]
    tool_timeout: Option<Duration>,
}

/// The simulators of a design of the user's own.
#[derive(clap::Args)]
pub struct Simulated {
    /// Kill a simulator of the scene's own design that runs longer without an answer [default: 20; 1800 for its
    /// compilation]
    #[arg(long, value_name = "SECONDS", value_parser = values::limit)]
    tool_timeout: Option<Duration>,
}

/// Refuses a time limit of tools for a scene without a design of the user's own, of which no tool runs.
fn agree(timeout: Option<Duration>, scene: &Experiment, reads: &str) -> Result<(), Failure> {
    match (timeout, scene) {
        (None, _) | (_, Experiment::Dut(_)) => Ok(()),
        _ => Err(Failure::usage(format!(
            "--tool-timeout: {} does not read it, because no tool runs; a scene with a [dut] reads it{reads}",
            scene.name
        ))),
    }
}

impl Simulated {
    /// Refuses options that this scene does not read.
    pub fn agree(&self, scene: &Experiment) -> Result<(), Failure> {
        agree(self.tool_timeout, scene, "")
    }

    /// Returns the simulators of designs of the user's own.
    pub fn simulators(&self) -> Simulators {
        simulators(Setup { hdl: Hdl::Carried, timeout: self.tool_timeout })
    }
}

fn simulators(setup: Setup) -> Simulators {
    Simulators { cache: cache_folder("dut", "built models").with_programs(), setup }
}

impl Vhdl {
    /// Refuses options that a run of this scene does not read, unless it is a run of VHDL.
    pub fn agree(&self, scene: &Experiment) -> Result<(), Failure> {
        agree(self.tool_timeout, scene, ", and so does --driver rtl")
    }

    /// Refuses a folder of VHDL for a design of the user's own, which has its files in the scene.
    pub fn agree_with_design(&self, scene: &DutScene) -> Result<(), Failure> {
        match self.hdl {
            Some(_) => Err(Failure::usage(format!("--hdl: the VHDL of {} is in the scene's dut.files", scene.name))),
            None => Ok(()),
        }
    }

    /// Returns the VHDL, the library and the time limit that these options ask for.
    pub fn setup(&self) -> Setup {
        let hdl = match &self.hdl {
            Some(folder) => Hdl::Folder(folder.clone()),
            // VHDL where the command runs may be somebody else's.
            None if is_forbidden() => Hdl::Carried,
            None => Hdl::of_folder_or_carried(Path::new("hdl")),
        };
        Setup { hdl, timeout: self.tool_timeout }
    }

    /// Returns the simulators of designs of the user's own.
    pub fn simulators(&self) -> Simulators {
        simulators(self.setup())
    }
}
