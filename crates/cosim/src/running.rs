//! A run that goes on as far as it is told.

use hpu_datapath::Wiring;
use hpu_signal::Observe;

use crate::contact::Contact;
use crate::engine::{ClosedLoop, Control, Driver};
use crate::simulation::{LoopVisitor, Recorder, Simulation, Wired};
use crate::summary::Summary;
use crate::trace::Trace;
use crate::wired_simulation::WiredSimulation;
use crate::world::World;

/// A `Running` loop stands at a clock edge and goes on as far as it is told. It hides the types of wiring and world:
/// [`WiredSimulation::start`] returns it. How a run is cut into parts must not change it.
pub trait Running {
    /// Returns the present edge.
    fn edge(&self) -> u64;
    /// Runs to this edge, or until the device cannot go on. Shows every net to the observer; at edge 0 first the words
    /// after the reset. Returns whether the control let it go on.
    fn run_to(&mut self, edge: u64, observer: &mut dyn Observe, control: &Control) -> bool;
    /// Returns why the device cannot go on, if it cannot.
    fn over(&self) -> Option<&'static str>;
    /// Returns the plant's output of this index at the present edge, in SI units.
    fn real(&self, index: usize) -> f64;
    /// Returns the world's part of a summary at the present edge.
    fn summary(&mut self) -> Summary;
}

impl WiredSimulation<'_> {
    /// Starts the scene's loop with the scene's driver, as after the reset. `None` if the scene runs without a clock.
    pub fn start(&self) -> Option<Box<dyn Running + '_>> {
        let trace = Trace::new(self.clock(), self.edges() + 1, Vec::new(), Vec::new());
        let start = Start { driver: self.driver(), modulated: self.gates_drive(), end: self.edges(), trace };
        self.direct().is_none().then(|| self.visit(start))
    }
}

/// Starts a loop.
struct Start {
    driver: Driver,
    modulated: bool,
    end: u64,
    trace: Trace,
}

/// A loop, and the driver that moves it on. Rows are for a trace; here there is none but the first.
struct Started<W, E: World> {
    run: ClosedLoop<W, E>,
    driver: Driver,
    trace: Trace,
}

impl<'s> LoopVisitor<'s> for Start {
    type Out = Box<dyn Running + 's>;
    fn visit<E, W>(self, wiring: &W, world: E, input: E::In) -> Self::Out
    where
        E: World + 's,
        W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone + 'static,
    {
        let mut wiring = wiring.clone();
        if !self.modulated {
            wiring.rest_modulator();
        }
        let run = ClosedLoop::new(wiring, world, input, self.end + 1);
        Box::new(Started { run, driver: self.driver, trace: self.trace })
    }
}

impl<E: World, W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone> Running for Started<W, E> {
    fn edge(&self) -> u64 {
        self.run.edge()
    }

    fn run_to(&mut self, edge: u64, observer: &mut dyn Observe, control: &Control) -> bool {
        // The observer of a whole run, so that the loop is compiled once for both.
        let contact = Contact::of(0, u64::MAX);
        let mut observer = Recorder { trace: &mut self.trace, contact, observer: Some(observer), reals: usize::MAX };
        self.run.run(self.driver, edge, &mut observer, control)
    }

    fn over(&self) -> Option<&'static str> {
        self.run.world.over()
    }

    fn real(&self, index: usize) -> f64 {
        self.run.world.reals(self.run.edge()).as_ref()[index]
    }

    fn summary(&mut self) -> Summary {
        self.run.world.summary()
    }
}
