//! A world that a logic outside this crate drives edge by edge.
//!
//! The logic may be a design of the user's own in a simulator that `hpu` has started, or a program that calls libhpu.
//! Both use [`DrivenWorld`] and nothing else to read their inputs, to drive the device and to move it on. So a design
//! moves the device to the same bits wherever it runs.
//!
//! The world is asked only where something changes. In between, an edge is a step of a counter: the world has told up
//! to which edge nothing changes by itself while the outputs stay. A new output makes the world flow to the present
//! edge first.

use std::{mem, slice};

use hpu_signal::Observe;

use crate::dut::{Misdriven, Wires};
use crate::result::summary::Summary;
use crate::run::untyped::AnyWorld;
use crate::world::axis_encoder::AxisEncoder;

/// The fewest and the most edges to look ahead. A look of the world costs as much as about a hundred edges of a design.
/// A look of the drive's own rhythm is seldom in vain, and a simulator has to answer within a fraction of a second.
const LOOK: [u64; 2] = [64, 1 << 14];

/// The outputs of an axis's wiring, which a command makes meaningless.
const GATES_OFF: [i64; 4] = [0; 4];

/// The reason why a world has not reached the edge that it was asked for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Halt {
    /// The scene has ended.
    End,
    /// The world cannot go on.
    Over(&'static str),
}

/// The logic that drives a world.
#[derive(Clone)]
pub enum Logic<'s> {
    /// A wiring of a scene's own, or a logic in its place.
    Wiring {
        /// The words of its inputs; the world sets those that it drives.
        input: Vec<i64>,
        /// Number of its outputs.
        outputs: usize,
        /// Whether its only output drives an axis as a command; else its outputs are those of the wiring.
        commands: bool,
        /// The encoder of an axis; `None` for other devices.
        encoder: Option<AxisEncoder>,
    },
    /// A design of the user's own around an axis. Its outputs are those that drive the device.
    Design(&'s Wires),
}

/// `DrivenWorld` is a world at a clock edge, joined to a logic that runs elsewhere. It exists so that the simulators of
/// `[dut]` scenes and the functions `hpu_*` of libhpu move the device by the same methods, and by no others.
///
/// At each edge the logic reads its [`inputs`](Self::inputs) as the world is at that instant; the outputs that it then
/// [drives](Self::drive) hold until the next edge. For [`quiet`](Self::quiet) edges neither call is needed unless an
/// output changes, so a simulator can clock them in one request. No promise of repeated outputs is made, so no motor
/// cruises.
///
/// `W` is a world whose type the caller knows, or `dyn AnyWorld`.
pub struct DrivenWorld<'s, W: ?Sized> {
    world: Box<W>,
    logic: Logic<'s>,
    encoder: Option<AxisEncoder>,
    /// The encoder's count at the start.
    start: i64,
    /// The words that the logic gets: `own` ones of the wiring or the design, then those of the encoder.
    inputs: Vec<i64>,
    own: usize,
    outputs: Vec<i64>,
    /// The present edge. The world stands there or before, and nothing changes between the two.
    edge: u64,
    /// The edge at which the world has to be asked.
    next: u64,
    /// The edge at which the world was asked last.
    asked: u64,
    end: u64,
    over: Option<&'static str>,
}

impl<'s> DrivenWorld<'s, dyn AnyWorld<'s> + 's> {
    /// Returns a copy, which goes on by itself.
    #[must_use]
    pub fn copy(&self) -> Self {
        Self {
            world: self.world.copy(),
            logic: self.logic.clone(),
            inputs: self.inputs.clone(),
            outputs: self.outputs.clone(),
            ..*self
        }
    }
}

impl<'s, W: AnyWorld<'s> + ?Sized> DrivenWorld<'s, W> {
    /// Joins a world at edge 0, which ends at the edge `end`, to a logic. All outputs are 0, and nothing is driven.
    pub fn new(world: Box<W>, mut logic: Logic<'s>, end: u64) -> Self {
        let (mut inputs, outputs, encoder) = match &mut logic {
            Logic::Wiring { input, outputs, encoder, .. } => (mem::take(input), *outputs, *encoder),
            Logic::Design(wires) => (vec![0; wires.given().len()], wires.outputs().len(), Some(wires.encoder)),
        };
        let own = inputs.len();
        inputs.resize(own + encoder.map_or(0, |_| AxisEncoder::WORDS), 0);
        let mut driven = Self {
            start: world.encoder().map_or(0, |state| state.count),
            over: world.over(),
            world,
            logic,
            encoder,
            inputs,
            own,
            outputs: vec![0; outputs],
            edge: 0,
            next: 0,
            asked: 0,
            end,
        };
        driven.sense();
        driven.ask();
        driven
    }

    /// Drives the device with the words that the outputs have after the reset. To be called once, at edge 0, or at
    /// edge 1 if one of them was unknown before.
    ///
    /// # Errors
    ///
    /// When both switches of a leg would be closed. Nothing is driven then.
    pub fn begin(&mut self, outputs: &[i64]) -> Result<(), Misdriven> {
        self.set(outputs)
    }

    /// Reads the inputs from the world at the edge at which it stands.
    fn sense(&mut self) {
        let state = self.world.encoder();
        let (own, rest) = self.inputs.split_at_mut(self.own);
        match &self.logic {
            Logic::Wiring { .. } => self.world.place(own),
            Logic::Design(wires) => {
                let Some(state) = state else { unreachable!("a design has an axis") };
                for (word, wire) in own.iter_mut().zip(wires.given()) {
                    *word = wires.word(wire, (state, self.world.sensors()), self.start);
                }
            }
        }
        if let (Some(encoder), Some(state)) = (&self.encoder, state) {
            rest.copy_from_slice(&encoder.words(state, self.start));
        }
    }

    /// Gives these outputs to the world at the present edge, and asks how long nothing changes.
    fn set(&mut self, outputs: &[i64]) -> Result<(), Misdriven> {
        let asked;
        let (gates, words): (&[i64], &[i64]) = match &self.logic {
            Logic::Wiring { commands: true, .. } => (&GATES_OFF, outputs),
            Logic::Wiring { .. } => (outputs, &[]),
            Logic::Design(wires) => {
                asked = wires.drive(outputs)?;
                (&asked.0, slice::from_ref(&asked.1))
            }
        };
        self.follow();
        self.world.drive(gates, words);
        self.outputs.copy_from_slice(outputs);
        self.over = self.world.over();
        self.ask();
        Ok(())
    }

    /// Asks the world, which stands at the present edge, for the edge at which it has to be asked next.
    fn ask(&mut self) {
        let [least, most] = LOOK;
        let look = (2 * (self.edge - self.asked)).clamp(least, most);
        self.asked = self.edge;
        self.next = match (self.over, self.edge == self.end) {
            (Some(_), _) => self.edge,
            (None, true) => u64::MAX,
            (None, false) => self.world.next_change((self.edge + look).min(self.end)),
        };
    }

    /// Moves the world to the edge at which it has to be asked.
    #[inline(never)]
    fn meet(&mut self) -> Result<(), Halt> {
        if let Some(why) = self.over {
            return Err(Halt::Over(why));
        }
        self.world.advance(self.next);
        self.edge = self.world.edge();
        self.sense();
        self.over = self.world.over();
        self.ask();
        self.over.map_or(Ok(()), |why| Err(Halt::Over(why)))
    }

    /// Moves the world to the present edge, before which nothing changes.
    fn follow(&mut self) {
        if self.world.edge() < self.edge {
            self.world.advance(self.edge);
        }
    }

    /// Returns the present edge.
    pub fn edge(&self) -> u64 {
        self.edge
    }

    /// Moves by this number of edges, or to the edge at which the scene or the world ends.
    ///
    /// # Errors
    ///
    /// When the scene or the world ends on the way; the present edge is then the edge at which that happened.
    #[inline]
    pub fn advance(&mut self, edges: u64) -> Result<(), Halt> {
        let wanted = self.edge.saturating_add(edges);
        let target = wanted.min(self.end);
        while self.next <= target {
            self.meet()?;
        }
        self.edge = target;
        if wanted > target { Err(Halt::End) } else { Ok(()) }
    }

    /// Moves the end of the scene to a later edge.
    pub(crate) fn go_on(&mut self, end: u64) {
        self.end = end;
        self.ask();
    }

    /// Returns for how many edges the inputs certainly keep their words, if the outputs keep theirs. It may be 0, and
    /// never leads past the end of the scene.
    pub fn quiet(&self) -> u64 {
        self.next.saturating_sub(1).min(self.end).saturating_sub(self.edge)
    }

    /// Sets the words of the outputs from the present edge on.
    ///
    /// # Errors
    ///
    /// When both switches of a leg would be closed. The world is then driven as before.
    #[inline]
    pub fn drive(&mut self, outputs: &[i64]) -> Result<(), Misdriven> {
        if self.outputs == outputs { Ok(()) } else { self.set(outputs) }
    }

    /// Returns the words of the inputs at the present edge: those of the logic; of an axis then index, count from the
    /// start, and contact (1 while the encoder's count is beyond the wall's).
    #[inline]
    pub fn inputs(&self) -> &[i64] {
        &self.inputs
    }

    /// Returns the words of the outputs.
    pub fn outputs(&self) -> &[i64] {
        &self.outputs
    }

    /// Returns the continuous output of this index at the present edge.
    pub fn real(&self, index: usize) -> f64 {
        self.world.real(self.edge, index)
    }

    /// Returns why the run cannot go on, or `None` if it can.
    pub fn over(&self) -> Option<&'static str> {
        self.over
    }

    /// Returns the world, which stands at the present edge or before it. Nothing changes between the two, so it can
    /// tell the continuous outputs at every edge in between.
    pub fn world(&self) -> &W {
        &self.world
    }

    /// Makes the world gather means and extremes; see [`World::measure`](crate::World::measure).
    pub fn measure(&mut self, stride: u64, observer: &dyn Observe) {
        self.world.measure(stride, observer);
    }

    /// Returns the world's part of a summary at the present edge.
    pub fn summary(&mut self) -> Summary {
        self.follow();
        self.world.summary()
    }
}
