//! A loop that a design of the user's own closes.
//!
//! A simulator of the design is asked to clock a number of edges with the same inputs, up to the first after which an
//! output that drives the device has another word ([`RunningDesign::clock`]). The world tells for how many edges its
//! inputs certainly stay as they are, and flows exactly to the edge that the design has reached. So the design closes
//! its own loop, edge by edge, and simulator and world meet only where something changes.
//!
//! At a clock edge the design samples its inputs as the world is at that instant; its outputs after the edge drive the
//! world until the next one. An output that changes between two edges of the fastest clock is seen at the next edge.

mod closed;
mod connect;
pub(crate) mod driven_world;

use std::error::Error;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

use hpu_signal::Format;

use crate::result::outline::Outline;
use crate::result::stays::Places;
use crate::run::simulation::Simulation;
use crate::world::actuator::{Actuator, Shaping};
use crate::world::faults::FaultPlan;
use crate::world::plant::{Around, Plant};
use hpu_scene::{Connection, Driving, DutScene, Layout, SceneError};

pub use crate::result::heard::{End, Failure, Heard, MOST_FAILURES, MOST_MESSAGES, Said, Severity, Unfit, place};
pub use connect::{Misdriven, Wire, Wires};

/// The reason why a design could not be simulated: a message of its simulator, or a fault of the design itself.
pub type Fault = Box<dyn Error + Send + Sync>;

/// A port of a design, as it was elaborated.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Port {
    /// Its name.
    pub name: String,
    /// Whether it is an input.
    pub is_input: bool,
    /// Its width in bits, and whether they are a signed number.
    pub format: Format,
    /// Whether it is a signal inside the design, not a port; its name is then its path from the top, as in
    /// `decoder.count`.
    pub is_inside: bool,
    /// Whether it has one of VHDL's number types, which have 32 bits whatever their range.
    pub is_number: bool,
    /// Whether its bits are a number, as far as its type tells: it is no enumeration, no structure and no bits alone.
    /// Waveforms draw such words as curves.
    pub is_quantity: bool,
    /// The names of its bits, as far as its declaration is known; else they are counted from 0 at the right.
    pub layout: Layout,
    /// The word of an input that is left open, if the design gives one and it is a literal.
    pub default: Option<i64>,
}

/// The signals inside a design that are to be shown.
#[derive(Clone, Copy)]
pub enum Inside<'a> {
    /// None.
    Nothing,
    /// All that the simulator can show.
    All,
    /// Those of them whose paths this function takes.
    Chosen(&'a dyn Fn(&str) -> bool),
}

impl Inside<'_> {
    /// Returns whether any signal may be shown.
    pub fn is_any(self) -> bool {
        !matches!(self, Self::Nothing)
    }

    /// Returns whether the signal at this path is to be shown.
    pub fn shows(self, path: &str) -> bool {
        match self {
            Self::Nothing => false,
            Self::All => true,
            Self::Chosen(takes) => takes(path),
        }
    }
}

/// The changes that a request asks for; each kind includes those before it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Asked {
    /// Those of outputs that drive the device.
    Driving,
    /// Those of all outputs.
    Outputs,
    /// Those of the signals inside that are shown.
    Inside,
}

/// A `Design` is a compiled design that can be simulated. It separates this crate from the simulators: `rtl::dut`
/// implements it for GHDL and Verilator.
pub trait Design: Send + Sync {
    /// Returns the ports, followed by the signals inside that are shown.
    fn ports(&self) -> &[Port];
    /// Returns the signals inside that the design declares and that are not shown, as far as they are known. Some of
    /// them may not be in the simulation at all, because nothing depends on them.
    fn hidden(&self) -> &[Port] {
        &[]
    }
    /// Returns whether names of ports that differ only in case are the same.
    fn ignores_case(&self) -> bool;
    /// Returns the simulator's name as messages show it.
    fn engine(&self) -> &str;
    /// Starts a simulation at the end of the reset, with all clocks low. `words` holds the bits of each port (those of
    /// outputs are ignored), and `drives` tells for each port whether it is an output that drives the device. Appends
    /// the bits of the outputs to `changes`.
    ///
    /// # Errors
    ///
    /// When no simulator is installed, or it fails.
    fn start(&self, words: &[u64], drives: &[bool], changes: &mut Vec<Change>)
    -> Result<Box<dyn RunningDesign>, Fault>;
}

/// A `RunningDesign` is a running simulation of a [`Design`], which starts it. The loop calls it once per stretch of
/// edges.
pub trait RunningDesign {
    /// Clocks up to `edges` edges of the fastest clock, with the bits in `words` at the inputs, and stops after the
    /// first edge after which an output that drives the device has another word. Returns the number of edges done.
    /// Appends the changes on the way that are asked for. A signal that was not asked for before changes at the first
    /// edge, unless it has the word that was told last.
    ///
    /// # Errors
    ///
    /// When the simulator fails, ends, or does not answer.
    fn clock(&mut self, words: &[u64], edges: u64, asked: Asked, changes: &mut Vec<Change>) -> Result<u64, Fault>;

    /// Appends the words on which all further words of the outputs that drive the device depend, beside the inputs.
    /// Returns `false` if they are not known, and appends nothing then.
    fn state(&self, _words: &mut Vec<u64>) -> bool {
        false
    }

    /// Returns whether the design has ended the run, as by `$finish`. It is then clocked no more.
    fn is_over(&self) -> bool {
        false
    }

    /// Returns everything that the design has said since its start, and ends the simulation.
    fn heard(&mut self) -> Heard {
        Heard::default()
    }
}

/// A change of an output.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Change {
    /// The edge after which it changes, counted from 1; 0: after the reset.
    pub edge: u64,
    /// Index of the port.
    pub port: usize,
    /// Its bits; `None` if one of them is unknown.
    pub bits: Option<u64>,
}

/// `Designs` builds designs for simulation. It exists because this crate knows no simulators; `rtl` implements it.
pub trait Designs: Sync {
    /// Builds the design of a scene, and shows these signals inside it where the simulator can.
    ///
    /// # Errors
    ///
    /// When a tool is missing, or refuses the design.
    fn build(&self, scene: &DutScene, inside: Inside) -> Result<Arc<dyn Design>, Fault>;
}

static PROVIDED: OnceLock<Box<dyn Designs + Send>> = OnceLock::new();

/// Registers the builder of designs that studies use, for the whole life of the program. A later call changes nothing.
pub fn provide(designs: impl Designs + Send + 'static) {
    // A second call comes with an equivalent builder, so its failure is ignored.
    let _ = PROVIDED.set(Box::new(designs));
}

/// Returns the builder registered by [`provide`].
///
/// # Errors
///
/// When none was registered: this program contains no simulators.
pub fn provided() -> Result<&'static dyn Designs, Fault> {
    PROVIDED
        .get()
        .map(|designs| &**designs as &dyn Designs)
        .ok_or_else(|| "no simulator of designs is at hand here".into())
}

/// A scene with a design of the user's own, made ready.
pub struct DutSimulation<'s> {
    scene: &'s DutScene,
    plant: Plant,
    design: Arc<dyn Design>,
    wires: Wires,
    outline: Outline,
    /// The edges at which the signals inside are asked for.
    looked: Range<u64>,
}

impl<'s> DutSimulation<'s> {
    /// Makes a scene ready: builds its design and connects its ports. The signals `inside` that the simulator shows are
    /// nets too.
    ///
    /// # Errors
    ///
    /// When the design cannot be built; when a port is missing, has another width or direction than its connection, or
    /// has no connection; when a format is of no signal of the design, or of another width; when the device makes no
    /// plant.
    pub fn new(scene: &'s DutScene, designs: &dyn Designs, inside: Inside) -> Result<Self, Fault> {
        let design = designs.build(scene, inside)?;
        let wires = Wires::new(scene, &*design)?;
        let (device, wall) =
            ((&scene.device, scene.encoder.count_rad()), scene.wall_rad.map(|wall_rad| (wall_rad, scene.wall_push())));
        let loop_of = (&*scene.dut.top, wires.nets.clone());
        let mut plant = plant(scene)?;
        plant.places.reach = wires.counter().map(|(_, reach)| reach);
        let outline = Outline::of_axis(scene, device, wall, loop_of, Vec::new(), true);
        let outline = outline.with_hand(scene.hand.path()).with_sensors(scene.sensors());
        Ok(Self { plant, scene, design, wires, outline, looked: 0..u64::MAX })
    }

    /// Asks for the signals inside at these edges alone. A run is as fast as without them at the others.
    #[must_use]
    pub fn looking_inside(self, looked: Range<u64>) -> Self {
        Self { looked, ..self }
    }

    /// Returns the scene.
    pub fn scene(&self) -> &DutScene {
        self.scene
    }

    /// Returns the simulator's name as messages show it.
    pub fn engine(&self) -> &str {
        self.design.engine()
    }

    /// Returns the signals inside that the design declares and that are not among its [`wires`](Self::wires).
    pub fn hidden(&self) -> &[Port] {
        self.design.hidden()
    }

    /// Returns the ports with their connections, then the signals inside that are shown.
    pub fn wires(&self) -> &[Wire] {
        &self.wires.wires
    }
}

/// Returns the laws of the world around a design: the device, its hand and its actuator, whatever the design is.
///
/// # Errors
///
/// When a parameter is impossible, or the connections name no way to drive the device.
pub fn plant(scene: &DutScene) -> Result<Plant, Fault> {
    let around = Around {
        network: scene.network.as_deref(),
        pmsm: scene.pmsm.as_deref(),
        device: &scene.device,
        bridge: scene.bridge,
        hand: &scene.hand,
        friction: scene.model.friction,
        winding: scene.model.winding,
        clock: scene.clock,
        count_rad: scene.encoder.count_rad(),
        actuator: actuator(scene)?,
        modulator: None,
        stepping: None,
        faults: scene.faults.as_ref().map(|all| FaultPlan::new(all, scene.clock, scene.run, scene.edges())),
        // Known only with the widths of the design's ports, if at all: it may count by itself.
        places: Places { wall: scene.wall_count(), reach: None },
        horizon: scene.edges(),
        late: scene.host_clocks,
        seed: scene.run.seed,
    };
    Ok(Plant::around(around)?)
}

/// Returns the actuator of the scene's device. A command of 1 asks for one ulp of the design's word, against the
/// positive direction.
fn actuator(scene: &DutScene) -> Result<Actuator, SceneError> {
    let format = |scene: &DutScene| {
        scene.dut.ports.iter().find_map(|connected| match connected.connection {
            Connection::Duty(format, _) | Connection::Force(format, _) | Connection::Current(format, _) => Some(format),
            _ => None,
        })
    };
    let driving = scene.driving()?;
    if scene.pmsm.is_some() {
        return Ok(Actuator::ThreeLegs);
    }
    if let Some(dac) = scene.network.as_ref().and_then(|network| network.dac) {
        let width = format(scene).map_or(0, |format| format.frac().max(0).cast_unsigned());
        return Ok(Actuator::Converted { dac, width, sign: 1.0 });
    }
    Ok(match (driving, format(scene), scene.amplifier) {
        (Driving::Duty, Some(format), _) => Actuator::Averaged { full_scale: format.lsb().recip(), latch: None },
        (Driving::Force, Some(format), Some(amplifier)) => {
            let hold = |hold_s| scene.clock.edges(hold_s).max(1);
            let shaping = amplifier
                .shaper
                .map(|shaper| Shaping::new(shaper.cutoff_hz, scene.clock.period_s(), hold(shaper.hold_s)));
            Actuator::Amplified { quantum_n: amplifier.full_scale_n * format.lsb(), shaping }
        }
        _ => Actuator::Switching,
    })
}

impl Simulation for DutSimulation<'_> {
    fn outline(&self) -> &Outline {
        &self.outline
    }
}
