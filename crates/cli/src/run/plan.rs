//! What `hpu run` is asked for, as one value: the comparison of both drivers, or a run by one engine.

use std::fs;
use std::path::PathBuf;

use hpu_cosim::dut::DutSimulation;
use hpu_cosim::scene::{Datapath, Experiment};
use hpu_cosim::{
    AnySimulation, Beyond, Control, Driver, SceneFile, Simulation, Summary, Trace, Wired, WiredSimulation,
};
use hpu_rtl::{CheckRow, Hdl, LoopScene, Setup, run_vhdl};
use hpu_signal::Observe;
use hpu_study::fit::Fit;

use super::nets::{self, NetComparison, Pairs};
use super::{Args, DriverArg};
use crate::fit;
use crate::scene::{self, Loaded, quoted};
use crate::shell::{Failure, Watch};

/// A validated command: what its options, its scene and the scene's kind of simulation ask for together.
pub enum Plan<'s> {
    /// The drivers `events` and `clock` on one scene, compared.
    Compare(&'s WiredSimulation<'s>),
    /// A run.
    Run(Engine<'s>),
}

/// What moves the device of a run.
pub enum Engine<'s> {
    /// The emulator, by a driver; with its name, or that of the solver of a law in floats without a clock.
    Emulator(&'s WiredSimulation<'s>, Driver, &'static str),
    /// The VHDL, in GHDL beside the emulator.
    Vhdl(&'s WiredSimulation<'s>, LoopScene, Setup),
    /// A design of the user's own, in its simulator.
    Design(&'s DutSimulation<'s>),
    /// A design whose ports are compared with nets of a scene of ours.
    Beside(&'s DutSimulation<'s>, Pairs, &'s WiredSimulation<'s>),
}

/// A scene as it is run, and the model that was chosen if the scene leaves it open.
pub type Read = (Loaded, Option<Fit>);

/// The result of an engine.
pub struct Advanced {
    /// The summary.
    pub summary: Summary,
    /// The comparison with the VHDL, and the source of the VHDL.
    pub rtl: Option<(CheckRow, Hdl)>,
    /// The comparison of a design's ports with nets.
    pub held: Option<NetComparison>,
}

/// Reads the scene of a command; `None` when interrupted.
pub fn read(args: &Args, watch: Watch) -> Result<Option<Read>, Failure> {
    let source = scene::source(&args.scene)?;
    if !args.dut.is_empty() && !source.text.contains("dut") {
        let reason =
            "--dut is for a scene with a [dut], which says what its ports are connected to: hpu new NAME --dut";
        return Err(Failure::usage(format!("{}: {reason}", args.scene)));
    }
    let set = changes(args)?;
    let Some((loaded, fitted)) = load(&source, &set, args.edges, watch)? else { return Ok(None) };
    if args.driver != Some(DriverArg::Rtl) {
        args.hdl.agree(&loaded.scene)?;
    }
    let expect = &loaded.scene.expect;
    if args.expect && expect.outcome.is_none() && expect.numbers.is_empty() && expect.recording.is_none() {
        let said = "expects nothing; write [expect], or --set expect.outcome=settled";
        return Err(Failure::usage(format!("--expect: {} {said}", loaded.scene.name)));
    }
    crate::scenes::tell_changed_defaults(&loaded.scene, &source, &set)?;
    Ok(Some((loaded, fitted)))
}

/// Returns the changes of the scene that `--set` and `--dut` ask for.
fn changes(args: &Args) -> Result<Vec<(String, String)>, Failure> {
    let mut set = args.set.set.clone();
    if !args.dut.is_empty() {
        // The files that a scene names are beside the scene, but these are relative to the working directory.
        let place = |file: &PathBuf| {
            let place = fs::canonicalize(file).map_err(|error| Failure::at(file, error))?;
            Ok(format!("{:?}", place.display().to_string()))
        };
        let places = args.dut.iter().map(place).collect::<Result<Vec<_>, Failure>>()?;
        set.push(("dut.files".to_string(), format!("[{}]", places.join(", "))));
    }
    Ok(set)
}

/// Reads a scene, and chooses its model if it leaves the model open; `None` when interrupted.
pub fn load(
    source: &SceneFile,
    set: &[(String, String)],
    edges: Option<u64>,
    watch: Watch,
) -> Result<Option<Read>, Failure> {
    let mut loaded = Loaded::of(source.clone(), set, edges)?;
    let mut fitted = None;
    if loaded.scene.auto {
        let Some(found) = fit::least(source, set, None, watch.control())? else { return Ok(None) };
        let set: Vec<_> = set.iter().chain(&found.set).cloned().collect();
        loaded = Loaded::of(source.clone(), &set, edges)?;
        fitted = Some(found);
    }
    if let Experiment::Axis(scene) = &loaded.scene
        && scene.model.datapath == Datapath::Linear
    {
        let error = scene.error("model.datapath", "\"linear\" is a law without a datapath to run; see hpu limits");
        return Err(if error.is_override() { Failure::usage(error) } else { Failure::file(error) });
    }
    Ok(Some((loaded, fitted)))
}

impl<'s> Plan<'s> {
    /// Returns what a command asks of this simulation of its scene. `beside` is the scene of `--beside`, made ready.
    pub fn new(
        args: &Args,
        loaded: &Loaded,
        simulation: &'s AnySimulation<'s>,
        beside: Option<&'s WiredSimulation<'s>>,
    ) -> Result<Self, Failure> {
        agree_for_ever(args, simulation)?;
        let refuse = |why: &str| Err(Failure::usage(format!("{}: {why}", simulation.name())));
        Ok(match (simulation, args.compare.as_deref(), args.driver) {
            (AnySimulation::Dut(_), Some([]), _) | (AnySimulation::Dut(_), _, Some(_)) => {
                return refuse(
                    "a design of your own is clocked by its simulator: write dut.engine for --driver, and --compare \
                     PORT=NET --beside SCENE",
                );
            }
            (AnySimulation::Ours(ours), Some(_), _) | (AnySimulation::Ours(ours), _, Some(_))
                if ours.direct().is_some() =>
            {
                return refuse(
                    "a law in floats with this model.solver runs without a clock, so no driver advances it; leave out \
                     --driver and --compare",
                );
            }
            (AnySimulation::Ours(_), Some([_, ..]), _) => {
                return refuse("PORT=NET is for a scene with a [dut]; VHDL of ours is compared by --driver rtl");
            }
            (AnySimulation::Ours(_), Some([]), _) if args.junit.is_some() => {
                return Err(Failure::usage(
                    "--junit tells of a run; leave out --compare, or name PORT=NET of a design of yours",
                ));
            }
            (AnySimulation::Ours(ours), Some([]), _) => Self::Compare(ours),
            (AnySimulation::Ours(_), None, _) | (AnySimulation::Dut(_), None, None) => {
                Self::Run(Engine::new(args, loaded, simulation))
            }
            (AnySimulation::Dut(design), Some(pairs), None) => {
                let ours = beside.expect("--compare PORT=NET stands beside a scene");
                Self::Run(Engine::Beside(design, Pairs::new(simulation, ours, (pairs, args.latency))?, ours))
            }
        })
    }
}

/// Checks that a run which is to look on after its end is one that can.
pub fn agree_for_ever(args: &Args, simulation: &AnySimulation) -> Result<(), Failure> {
    let is_told = match simulation {
        AnySimulation::Ours(ours) => ours.direct().is_none(),
        AnySimulation::Dut(_) => true,
    };
    if args.for_ever.is_none() || is_told && args.driver != Some(DriverArg::Rtl) {
        return Ok(());
    }
    Err(Failure::usage(format!(
        "{}: --for-ever is told of a run by events or by clock, or of a design of your own that leaps; not of \
         --driver rtl, or of a law in floats that runs without a clock",
        simulation.name()
    )))
}

impl<'s> Engine<'s> {
    /// Returns the engine of a run that is compared with no scene of ours.
    pub fn new(args: &Args, loaded: &Loaded, simulation: &'s AnySimulation<'s>) -> Self {
        let ours = match simulation {
            AnySimulation::Dut(design) => return Self::Design(design),
            AnySimulation::Ours(ours) => ours,
        };
        match args.driver {
            Some(DriverArg::Rtl) => Self::Vhdl(ours, loaded.in_vhdl(loaded.scene.edges()), args.hdl.setup()),
            Some(DriverArg::Clock) => Self::Emulator(ours, Driver::Clock, "clock"),
            Some(DriverArg::Events) => Self::Emulator(ours, Driver::Events, "events"),
            None if ours.direct().is_some() => {
                Self::Emulator(ours, ours.driver(), loaded.scene.setup().solver().name())
            }
            None if ours.driver() == Driver::Clock => Self::Emulator(ours, Driver::Clock, "clock"),
            None => Self::Emulator(ours, Driver::Events, "events"),
        }
    }

    /// Returns the name of the driver.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Emulator(_, _, name) => name,
            Self::Vhdl(..) => "rtl",
            Self::Design(_) | Self::Beside(..) => "dut",
        }
    }

    /// Returns whether the nets are compared, so that the trace shows whether any has differed.
    pub fn compares(&self) -> bool {
        matches!(self, Self::Vhdl(..) | Self::Beside(..))
    }

    /// Returns the options of the command that runs this VHDL.
    pub fn options(&self) -> String {
        match self {
            Self::Vhdl(_, _, Setup { hdl: Hdl::Carried, .. }) => " --driver rtl".to_string(),
            Self::Vhdl(_, _, setup) => format!(" --driver rtl --hdl {}", quoted(&setup.hdl.to_string())),
            _ => String::new(),
        }
    }

    /// Runs the scene to its end, or until it is stopped; the emulator also looks on after it, if it is asked.
    pub fn advance(
        &self,
        trace: &mut Trace,
        observer: &mut dyn Observe,
        control: &Control,
        beyond: Option<&Beyond>,
    ) -> Result<Advanced, Failure> {
        let alone = |summary| Advanced { summary, rtl: None, held: None };
        Ok(match self {
            Self::Emulator(ours, driver, _) => alone(ours.run_beyond(*driver, trace, observer, control, beyond)),
            Self::Design(design) => alone(design.run_beyond(true, trace, observer, control, beyond)?),
            Self::Vhdl(ours, scene, setup) => {
                let (summary, row) = run_vhdl(scene, setup, *ours, trace, observer, control)?;
                Advanced { rtl: Some((row, setup.hdl.clone())), ..alone(summary) }
            }
            Self::Beside(design, pairs, ours) => {
                let (summary, held) = nets::hold(pairs.clone(), ours, observer, |observer| {
                    let summary = design.run(true, trace, observer, control)?;
                    let edges = summary.edges;
                    Ok((summary, edges))
                })?;
                Advanced { held: Some(held), ..alone(summary) }
            }
        })
    }
}
