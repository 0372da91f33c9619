//! The plant of a scene: everything outside the FPGA, in the loop of somebody else's logic.
//!
//! No promise of repeated outputs is made, so no motor cruises: a program moves edge by edge at the cost of three
//! calls, and the motion is that of a `[dut]` with the same outputs, to the bit.

use std::ptr::NonNull;
use std::sync::Arc;

use hpu_cosim::dut::{Wire, Wires};
use hpu_cosim::scene::{Device, DutScene, Experiment};
use hpu_cosim::{
    AXIS_ROW, AnyWorld, AxisEncoder, AxisSimulation, AxisWorld, DrivenWorld, EnergyAudit, Halt, Logic, RAIL_ROW,
    SceneFile, Schedule, Simulation, Summary, Wired, WiredSimulation, dut,
};
use hpu_datapath::flatten;
use hpu_signal::{Clock, Cycle, Format, Real, Signal};

use crate::block::fit;
use crate::error::{Error, Status};

/// The world of any device, in the loop of somebody else's logic.
type Driven = DrivenWorld<'static, dyn AnyWorld<'static>>;

const NS_PER_S: u128 = 1_000_000_000;

/// The plant of a scene at a clock edge.
///
/// At each edge the logic reads its [inputs](Self::words) as the plant is at that instant; the outputs that it then
/// [drives](Self::drive) hold until the next edge. A scene with a method of the project's own gives that method's words
/// beside the encoder's lines; its blocks do not run. A motor's scene may have neither method nor design; the logic
/// then has the encoder's lines and the gates of the bridge. The plant promises nothing about what the logic does next,
/// so its motion is that of a `[dut]` with the same outputs, to the bit: a [`DrivenWorld`] moves both.
pub struct Plant {
    // Before the fields that it borrows from: fields are dropped in this order.
    world: Driven,
    laws: Arc<Owned<Laws>>,
    scene: Arc<Owned<Experiment>>,
    inputs: Vec<Signal>,
    outputs: Vec<Signal>,
    /// The continuous outputs, with their indices in the world's rows.
    states: Vec<(usize, Real)>,
    /// Whether the outputs are the four gates of a wiring's bridge.
    has_legs: bool,
    /// The part of a clock edge that calls in nanoseconds have asked for and not got, in 1e-9 of an edge.
    owed: u128,
}

// SAFETY: a plant owns all that its world borrows from, alone or with its copies, and none of it has state that threads
// share: no Rc, no cell, no thread-local. `Plant` has no method that changes it through a shared reference, and what
// copies share is never changed.
unsafe impl Send for Plant {}

/// The parts of a plant that its world borrows.
#[allow(clippy::large_enum_variant, reason = "one of them exists a plant")]
enum Laws {
    Wired(WiredSimulation<'static>),
    Dut(hpu_cosim::Plant, Wires),
}

/// A value on the heap that others borrow from while it is owned here.
pub(crate) struct Owned<T>(NonNull<T>);

// SAFETY: it owns its value, and lends it only to be read.
unsafe impl<T: Send> Send for Owned<T> {}
// SAFETY: as above.
unsafe impl<T: Sync> Sync for Owned<T> {}

impl<T> Owned<T> {
    pub(crate) fn new(value: T) -> Self {
        Self(NonNull::from(Box::leak(Box::new(value))))
    }

    /// Returns the value.
    ///
    /// # Safety
    ///
    /// The reference must not be used after the owner has been dropped.
    pub(crate) unsafe fn lent(&self) -> &'static T {
        // SAFETY: the value lives as long as its owner, which never hands out a mutable reference.
        unsafe { self.0.as_ref() }
    }
}

impl<T> Drop for Owned<T> {
    fn drop(&mut self) {
        // SAFETY: the pointer came from a box and is freed once.
        drop(unsafe { Box::from_raw(self.0.as_ptr()) });
    }
}

/// A world joined to a logic, and the signals between the two.
struct Joint {
    world: Driven,
    inputs: Vec<Signal>,
    outputs: Vec<Signal>,
    states: Vec<(usize, Real)>,
}

impl Plant {
    /// Opens the plant of a scene with these overrides, keys and values as those of `--set`.
    ///
    /// # Errors
    ///
    /// [`Status::Refused`] when the scene is refused, with file, line and what is accepted, or when it has no clock
    /// or no plant.
    pub fn open(file: &SceneFile, overrides: &[(String, String)]) -> Result<Self, Error> {
        let refused = |text: &dyn std::fmt::Display| Error::new(Status::Refused, text);
        let scene = file.plant(overrides).map_err(|error| refused(&format!("{error:#}")))?;
        let named = |error: &dyn std::fmt::Display| refused(&format!("{}: {error}", file.name));
        let scene = Owned::new(scene);
        // SAFETY: what borrows from the scene is dropped before it, in `Plant` as here.
        let lent = unsafe { scene.lent() };
        let laws = Owned::new(match lent {
            Experiment::Dut(scene) => {
                let plant = dut::plant(scene).map_err(|error| refused(&error))?;
                Laws::Dut(plant, Wires::of_scene(scene).map_err(|error| refused(&error))?)
            }
            ours => Laws::Wired(WiredSimulation::new(ours).map_err(|error| named(&error))?),
        });
        // SAFETY: as above.
        let joint = match (unsafe { laws.lent() }, lent) {
            (Laws::Wired(simulation), _) if simulation.direct().is_some() => {
                return Err(named(&"with this model.solver it runs without a clock, and pins have one"));
            }
            (Laws::Wired(WiredSimulation::Axis(simulation)), _) => of_axis(simulation),
            (Laws::Wired(simulation), _) if !simulation.gates_drive() => {
                return Err(named(&"with this model the device follows words inside the loop, and pins are gates"));
            }
            (Laws::Wired(arm), _) => of_arm(arm),
            (Laws::Dut(plant, wires), Experiment::Dut(scene)) => of_dut(scene, plant, wires),
            (Laws::Dut(..), _) => unreachable!("only the scene of a design has its laws"),
        };
        let Joint { world, inputs, outputs, states } = joint;
        let is_design = matches!(lent, Experiment::Dut(scene) if !scene.dut.files.is_empty());
        let has_legs = !is_design && outputs.len() == 4 && outputs[0].name == "a_high";
        let (laws, scene) = (Arc::new(laws), Arc::new(scene));
        Ok(Self { world, laws, scene, inputs, outputs, states, has_legs, owed: 0 })
    }

    /// Returns a copy, which goes on by itself from the present edge.
    #[must_use]
    pub fn copy(&self) -> Self {
        Self {
            world: self.world.copy(),
            laws: Arc::clone(&self.laws),
            scene: Arc::clone(&self.scene),
            inputs: self.inputs.clone(),
            outputs: self.outputs.clone(),
            states: self.states.clone(),
            has_legs: self.has_legs,
            owed: self.owed,
        }
    }

    /// Returns the inputs of the logic, which the plant gives: the encoders' lines first.
    pub fn inputs(&self) -> &[Signal] {
        &self.inputs
    }

    /// Returns the outputs of the logic, which drive the plant.
    pub fn outputs(&self) -> &[Signal] {
        &self.outputs
    }

    /// Returns the continuous states; none where a recording stands in the device's place.
    pub fn states(&self) -> impl ExactSizeIterator<Item = Real> + '_ {
        self.states.iter().map(|(_, real)| *real)
    }

    /// Returns the FPGA's clock.
    pub fn clock(&self) -> Clock {
        self.experiment().clock
    }

    /// Returns the clock edges of the scene.
    pub fn edges(&self) -> u64 {
        self.experiment().edges()
    }

    fn experiment(&self) -> &Experiment {
        // SAFETY: the reference lives no longer than `self`.
        unsafe { self.scene.lent() }
    }

    /// Returns the present clock edge, counted from 0 at the start.
    pub fn edge(&self) -> u64 {
        self.world.edge()
    }

    /// Returns the time of the present edge in seconds.
    pub fn seconds(&self) -> f64 {
        self.clock().seconds(Cycle(self.edge()))
    }

    /// Returns the words of the inputs at the present edge, in the order of [`inputs`](Self::inputs).
    #[inline]
    pub fn words(&self) -> &[i64] {
        self.world.inputs()
    }

    /// Returns the words that the outputs have, in the order of [`outputs`](Self::outputs).
    pub fn driven(&self) -> &[i64] {
        self.world.outputs()
    }

    /// Sets the words of all outputs from the present edge on, in the order of [`outputs`](Self::outputs). They are 0
    /// at the start.
    ///
    /// # Errors
    ///
    /// [`Status::Argument`] when there are more or fewer words than outputs, a word does not fit its output, or both
    /// switches of a leg are closed. The plant is then driven as before.
    #[inline]
    pub fn drive(&mut self, words: &[i64]) -> Result<(), Error> {
        fit(&self.outputs, words, "output")?;
        if self.has_legs && (words[0] & words[1] | words[2] & words[3]) != 0 {
            let leg = if words[0] & words[1] == 0 { 'b' } else { 'a' };
            let text = format!(
                "both switches of leg {leg} are closed at clock edge {}, which shorts the supply; accepted: at most \
                 one of {leg}_high and {leg}_low",
                self.edge()
            );
            return Err(Error::new(Status::Argument, text));
        }
        let driven = self.world.drive(words);
        driven.map_err(|fault| Error::new(Status::Argument, fault.text(self.edge(), self.seconds())))
    }

    /// Sets the word of one output from the present edge on; the others stay.
    ///
    /// # Errors
    ///
    /// [`Status::Argument`] when there is no such output, and as [`drive`](Self::drive).
    pub fn set(&mut self, output: usize, word: i64) -> Result<(), Error> {
        let mut words = self.world.outputs().to_vec();
        let count = words.len();
        let place = words.get_mut(output);
        *place.ok_or_else(|| Error::new(Status::Argument, no_index(output, "output", count)))? = word;
        self.drive(&words)
    }

    /// Moves on by this number of clock edges.
    ///
    /// # Errors
    ///
    /// [`Status::End`] when the scene ends before, and [`Status::Over`] when the run cannot go on; the plant then
    /// stands at the edge at which that happened.
    #[inline]
    pub fn advance(&mut self, edges: u64) -> Result<(), Error> {
        self.world.advance(edges).map_err(|halt| self.halted(halt))
    }

    #[cold]
    fn halted(&self, halt: Halt) -> Error {
        match halt {
            Halt::Over(why) => Error::new(Status::Over, format!("{why}, at clock edge {}", self.edge())),
            Halt::End => {
                let text = "the scene ends at clock edge";
                Error::new(Status::End, format!("{text} {}; a longer run.duration lets it go on", self.edge()))
            }
        }
    }

    /// Returns a number of clock edges for which the inputs certainly keep their words, if the outputs keep theirs. It
    /// may be 0, and never leads past the end of the scene.
    pub fn quiet(&self) -> u64 {
        self.world.quiet()
    }

    /// Moves on by this time. The clock edges of all calls together are those of the sum of their times, rounded down,
    /// so no time is lost between calls.
    ///
    /// # Errors
    ///
    /// As [`advance`](Self::advance).
    pub fn advance_ns(&mut self, nanoseconds: u64) -> Result<(), Error> {
        let edges = self.edges_of(nanoseconds);
        self.advance(edges)
    }

    /// Returns the clock edges by which [`advance_ns`](Self::advance_ns) moves on, for a caller that does so in parts.
    /// The rest of the time counts toward the next call.
    pub fn edges_of(&mut self, nanoseconds: u64) -> u64 {
        let asked = self.owed + u128::from(nanoseconds) * u128::from(self.clock().frequency_hz());
        self.owed = asked % NS_PER_S;
        u64::try_from(asked / NS_PER_S).unwrap_or(u64::MAX)
    }

    /// Returns the state of this index at the present edge, in SI units.
    ///
    /// # Errors
    ///
    /// [`Status::Argument`] when there is no such state.
    pub fn state(&self, index: usize) -> Result<f64, Error> {
        match self.states.get(index) {
            Some((column, _)) => Ok(self.world.real(*column)),
            None => Err(Error::new(Status::Argument, no_index(index, "state", self.states.len()))),
        }
    }

    /// Returns the energies from the start to the present edge.
    pub fn energy(&mut self) -> EnergyAudit {
        self.summary().energy
    }

    /// Returns the plant's part of a run's summary, from the start to the present edge.
    pub fn summary(&mut self) -> Summary {
        self.world.summary()
    }
}

/// Returns the message of an index that is out of range.
pub(crate) fn no_index(index: usize, what: &str, count: usize) -> String {
    if count == 0 {
        format!("no {what} {index}: there is none")
    } else {
        format!("no {what} {index}; accepted: 0 to {}", count - 1)
    }
}

/// Joins the world of an axis whose method lends its words.
fn of_axis(simulation: &'static AxisSimulation<'static>) -> Joint {
    let (scene, wiring) = (simulation.scene(), simulation.wiring());
    let world = AxisWorld::new(simulation.plant(), 0, simulation.words().schedule.clone());
    let (inputs, outputs) = (wiring.block().inputs(), wiring.block().outputs());
    let is_switched = simulation.gates_drive();
    let outputs = if is_switched {
        outputs
    } else {
        let command = wiring.nets().into_iter().find(|net| net.name == "command");
        vec![command.expect("the loop of an axis has a command")]
    };
    let encoder = AxisEncoder::new(scene.encoder, scene.wall.position_rad);
    let logic = Logic::Wiring {
        input: flatten(&simulation.input()),
        outputs: outputs.len(),
        commands: !is_switched,
        encoder: Some(encoder),
    };
    let states = simulation.columns().into_iter().filter(|column| *column < simulation.reals().len());
    let states = states.map(|column| (column, simulation.row()[column])).collect();
    let world = driven(Box::new(world), logic, scene.edges());
    Joint { world, inputs: of_axis_inputs(inputs), outputs, states }
}

/// Joins the world around a logic of the user's own. Its ports are those that the scene connects; a scene without a
/// design has the pins of a motor.
fn of_dut(scene: &'static DutScene, plant: &'static hpu_cosim::Plant, wires: &'static Wires) -> Joint {
    let world = AxisWorld::new(plant, 0, Schedule::default());
    let of = |is: &dyn Fn(&Wire) -> bool| -> Vec<Signal> {
        let all = wires.wires().iter().zip(wires.nets());
        all.filter(|(wire, _)| is(wire)).map(|(_, net)| net.clone()).collect()
    };
    let (inputs, outputs) = (of(&|wire| wire.port.is_input), of(&Wire::drives));
    let columns = if matches!(scene.device, Device::Mass(_)) { 1..4 } else { 0..4 };
    let row = if matches!(scene.device, Device::Mass(_)) { RAIL_ROW } else { AXIS_ROW };
    let states = columns.map(|column| (column, row[column])).collect();
    let world = driven(Box::new(world), Logic::Design(wires), scene.edges());
    Joint { world, inputs: of_axis_inputs(inputs), outputs, states }
}

/// Returns the inputs of a logic around an axis: its own, then those that every axis gives.
fn of_axis_inputs(mut inputs: Vec<Signal>) -> Vec<Signal> {
    inputs.extend([
        Signal::bit("index", "Encoder's index: 1 at one count of a revolution"),
        Signal::new("count", Format::signed(64), "count", "Count that the encoder's lines show, from 0 at the start"),
        Signal::bit("contact", "1 while the encoder's count is beyond the wall's"),
    ]);
    inputs
}

/// Joins the world of a device with joints to the signals of its wiring.
fn of_arm(simulation: &'static WiredSimulation<'static>) -> Joint {
    let block = simulation.wiring().block();
    let (inputs, outputs) = (block.inputs(), block.outputs());
    let start = simulation.closed_loop();
    let logic = Logic::Wiring { input: start.constants(), outputs: outputs.len(), commands: false, encoder: None };
    let world = driven(start.world().copy(), logic, simulation.edges());
    let states = simulation.reals().iter().copied().enumerate().collect();
    Joint { world, inputs, outputs, states }
}

/// Joins a world to a logic whose outputs are all 0.
fn driven(world: Box<dyn AnyWorld<'static>>, logic: Logic<'static>, end: u64) -> Driven {
    let mut driven = Driven::new(world, logic, end);
    let off = driven.outputs().to_vec();
    // A design may invert its outputs so that a leg would be shorted: its world is then not driven yet.
    let _ = driven.begin(&off);
    driven
}
