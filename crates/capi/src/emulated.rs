//! The loop of a scene with its own blocks, moved on step by step.

use std::sync::atomic::Ordering;

use hpu_cosim::scene::Experiment;
use hpu_cosim::{AnyClosedLoop, Control, Driver, SceneFile, Simulation, Summary, Wired, WiredSimulation};
use hpu_signal::{Clock, Cycle, Observe, Real, Signal};

use crate::error::{Error, Status};
use crate::plant::{Owned, no_index};

/// Events from one look at the control to the next.
const LOOK: u32 = 256;

/// The loop of a scene, its blocks and its plant, at a clock edge. The motion is that of a whole run, to the bit.
pub struct Emulated {
    // Before the fields that it borrows from: fields are dropped in this order.
    running: Box<dyn AnyClosedLoop<'static>>,
    simulation: Owned<WiredSimulation<'static>>,
    _scene: Owned<Experiment>,
    nets: Vec<Signal>,
    now: Now,
}

// SAFETY: as for a plant: it owns all that it borrows from, and none of it has state that threads share.
unsafe impl Send for Emulated {}

/// The words of the nets at the present edge.
struct Now(Vec<i64>);

impl Observe for Now {
    fn nets(&mut self, _: Cycle, words: &[i64]) {
        self.0.clear();
        self.0.extend_from_slice(words);
    }

    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

impl Emulated {
    /// Opens the loop of a scene with these overrides, keys and values as those of `--set`, as after the reset.
    ///
    /// # Errors
    ///
    /// [`Status::Refused`] when the scene is refused, when it has no clock, or when its loop is closed by a design of
    /// the user's own.
    pub fn open(file: &SceneFile, overrides: &[(String, String)]) -> Result<Self, Error> {
        let refused = |text: &dyn std::fmt::Display| Error::new(Status::Refused, text);
        let scene = Owned::new(file.parse(overrides).map_err(|error| refused(&format!("{error:#}")))?);
        let named = |error: &dyn std::fmt::Display| refused(&format!("{}: {error}", file.name));
        // SAFETY: what borrows from the scene is dropped before it, in `Emulated` as here.
        let simulation = WiredSimulation::new(unsafe { scene.lent() }).map_err(|error| named(&error))?;
        let nets = simulation.nets();
        let simulation = Owned::new(simulation);
        // SAFETY: as above.
        let lent = unsafe { simulation.lent() };
        if lent.direct().is_some() {
            return Err(named(&"with this model.solver it runs without a clock; run it whole"));
        }
        let mut running = lent.closed_loop();
        if !lent.gates_drive() {
            running.wiring_mut().rest_modulator();
        }
        let now = Now(running.wiring().words().to_vec());
        Ok(Self { running, simulation, _scene: scene, nets, now })
    }

    fn simulation(&self) -> &WiredSimulation<'static> {
        // SAFETY: the reference lives no longer than `self`.
        unsafe { self.simulation.lent() }
    }

    /// Returns the nets of the loop.
    pub fn nets(&self) -> &[Signal] {
        &self.nets
    }

    /// Returns the words of the nets at the present edge, in the order of [`nets`](Self::nets); at edge 0 those of the
    /// reset.
    pub fn words(&self) -> &[i64] {
        &self.now.0
    }

    /// Returns the continuous states; none where a recording stands in the device's place.
    pub fn states(&self) -> Vec<Real> {
        self.simulation().reals().to_vec()
    }

    /// Returns the state of this index at the present edge, in SI units.
    ///
    /// # Errors
    ///
    /// [`Status::Argument`] when there is no such state.
    pub fn state(&self, index: usize) -> Result<f64, Error> {
        let count = self.simulation().reals().len();
        if index >= count {
            return Err(Error::new(Status::Argument, no_index(index, "state", count)));
        }
        Ok(self.running.world().real(self.edge(), index))
    }

    /// Returns the FPGA's clock.
    pub fn clock(&self) -> Clock {
        self.simulation().clock()
    }

    /// Returns the clock edges of the scene.
    pub fn edges(&self) -> u64 {
        self.simulation().edges()
    }

    /// Returns the present clock edge, counted from 0 at the start.
    pub fn edge(&self) -> u64 {
        self.running.edge()
    }

    /// Moves on by this number of clock edges, or until `control` stops it.
    ///
    /// # Errors
    ///
    /// [`Status::End`] when the scene ends before, and [`Status::Over`] when the run cannot go on; the loop then stands
    /// at the edge at which that happened.
    pub fn step(&mut self, edges: u64, control: &Control) -> Result<(), Error> {
        self.go(edges, false, control).map(drop)
    }

    /// Moves on as [`step`](Self::step) does, but at most to the first clock edge at which a word of a net has changed.
    /// Returns whether it stopped there.
    ///
    /// # Errors
    ///
    /// Those of [`step`](Self::step).
    pub fn step_to_change(&mut self, edges: u64, control: &Control) -> Result<bool, Error> {
        self.go(edges, true, control)
    }

    fn go(&mut self, edges: u64, stops: bool, control: &Control) -> Result<bool, Error> {
        let before = stops.then(|| self.words().to_vec());
        let (wanted, end) = (self.edge().saturating_add(edges), self.edges());
        let (target, driver) = (wanted.min(end), self.simulation().driver());
        let mut events = 0_u32;
        while self.edge() < target && self.running.world().over().is_none() {
            match driver {
                Driver::Events => self.running.leap(target, &mut self.now),
                Driver::Clock => self.running.step(),
            }
            if let Some(before) = &before {
                if driver == Driver::Clock {
                    self.now.nets(Cycle(self.edge()), self.running.wiring().words());
                }
                if self.words() != before && self.running.world().over().is_none() {
                    return Ok(true);
                }
            }
            events = (events + 1) % LOOK;
            if events == 0 && control.stop.load(Ordering::Relaxed) {
                break;
            }
        }
        if driver == Driver::Clock {
            self.now.nets(Cycle(self.edge()), self.running.wiring().words());
        }
        if let Some(why) = self.running.world().over() {
            return Err(Error::new(Status::Over, format!("{why}, at clock edge {}", self.edge())));
        }
        if wanted > end {
            let text = format!("the scene ends at clock edge {end}; a longer run.duration lets it go on");
            return Err(Error::new(Status::End, text));
        }
        Ok(false)
    }

    /// Goes on with the constant words of the scene with these overrides, from the next clock edge on.
    ///
    /// # Errors
    ///
    /// [`Status::Refused`] when the scene is refused, and [`Status::Argument`] when it has other blocks: formats that
    /// the scene leaves open are chosen by the values. The loop then goes on as before.
    pub fn tune(&mut self, file: &SceneFile, overrides: &[(String, String)]) -> Result<(), Error> {
        let other = Self::open(file, overrides)?;
        let (now, then) = (self.running.wiring(), other.running.wiring());
        if other.nets != self.nets || then.generics() != now.generics() {
            let text = "other formats would be chosen for it; set it before the start, or choose them in the scene";
            return Err(Error::new(Status::Argument, text));
        }
        self.running.tune(&other.running.constants());
        self.now.nets(Cycle(self.edge()), self.running.wiring().words());
        Ok(())
    }

    /// Returns the plant's part of a run's summary, from the start to the present edge.
    pub fn summary(&self) -> Summary {
        self.running.world().summary()
    }
}
