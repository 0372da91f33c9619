//! A world that somebody else's logic drives edge by edge.
//!
//! The world is asked only where something changes. In between, an edge is a step of a counter: the world has told up
//! to which edge nothing changes by itself while the outputs stay. A new output makes the world flow to the present
//! edge first, as the loop of a `[dut]` does.

use hpu_cosim::dut::{Misdriven, Wire, Wires};
use hpu_cosim::{AnyWorld, EncoderState, Summary};
use hpu_datapath::flatten;

/// The fewest and the most edges to look ahead. A look costs as much as some edges, and a look of the drive's own
/// rhythm is seldom in vain.
const LOOK: [u64; 2] = [64, 1 << 14];

/// The outputs of an axis's wiring, which a command makes meaningless.
const GATES_OFF: [i64; 4] = [0; 4];

/// The reason why a plant has not reached the edge that it was asked for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Halt {
    /// The scene has ended.
    End,
    /// The world cannot go on.
    Over(&'static str),
}

/// An axis's encoder, of which the logic gets the index, the count and the contact too.
pub(crate) struct Encoder {
    /// The counts of a revolution; `None` for a linear encoder.
    pub(crate) revolution: Option<i64>,
    /// The wall's count.
    pub(crate) wall: i64,
    /// The count at the start.
    pub(crate) start: i64,
}

impl Encoder {
    /// Returns the words of index, count and contact.
    fn words(&self, EncoderState { count, shown, has_index, .. }: EncoderState) -> [i64; 3] {
        let index = self.revolution.is_some_and(|counts| has_index && count.rem_euclid(counts) == 0);
        [i64::from(index), shown - self.start, i64::from(count > self.wall)]
    }
}

/// Returns whether a wire is an output that drives the world.
pub(crate) fn is_output(wire: &Wire) -> bool {
    wire.connection.drives()
}

/// The logic that a world is joined to.
pub(crate) enum Logic {
    /// A wiring of a scene's own.
    Wiring {
        /// The words of its inputs.
        input: Vec<i64>,
        /// Number of its inputs that are given to the logic.
        given: usize,
        /// Whether the logic's only output drives an axis as a command; else its outputs are those of the wiring.
        commands: bool,
    },
    /// A design of the user's own.
    Design(Wires),
}

/// A world, and the logic's side of it.
pub(crate) struct Joined {
    world: Box<dyn AnyWorld<'static>>,
    logic: Logic,
    encoder: Option<Encoder>,
    /// The words that the logic gets: those of the wiring or the design, then those of the encoder.
    inputs: Vec<i64>,
    outputs: Vec<i64>,
    /// Room for the outputs before, for the case that new ones are refused.
    before: Vec<i64>,
    /// The present edge. The world stands there or before, and nothing changes between the two.
    edge: u64,
    /// The edge at which the world has to be asked.
    next: u64,
    /// The edge at which the world was asked last.
    asked: u64,
    end: u64,
    over: Option<&'static str>,
}

impl Joined {
    /// Joins a world at edge 0, which ends at the edge `end`, to a logic with so many outputs. An axis has an encoder.
    pub(crate) fn new(
        world: Box<dyn AnyWorld<'static>>,
        logic: Logic,
        encoder: Option<Encoder>,
        outputs: usize,
        end: u64,
    ) -> Self {
        let mut joined = Self {
            over: world.over(),
            world,
            logic,
            encoder,
            inputs: Vec::new(),
            outputs: vec![0; outputs],
            before: vec![0; outputs],
            edge: 0,
            next: 0,
            asked: 0,
            end,
        };
        joined.sense();
        // All outputs are 0. A design may invert them so that a leg would be shorted: its world is then not driven yet.
        if joined.put().is_err() {
            joined.ask();
        }
        joined
    }

    /// Reads the inputs from the world at the edge at which it stands.
    fn sense(&mut self) {
        self.inputs.clear();
        let state = self.world.encoder();
        match &mut self.logic {
            Logic::Wiring { input, given, .. } => {
                self.world.place(input);
                self.inputs.extend_from_slice(&input[..*given]);
            }
            Logic::Design(wires) => {
                let (Some(encoder), Some(state)) = (&self.encoder, state) else { unreachable!("a design has an axis") };
                let given = wires.wires().iter().filter(|wire| wire.port.is_input);
                self.inputs.extend(given.map(|wire| wires.word(wire, state, encoder.start)));
            }
        }
        if let (Some(encoder), Some(state)) = (&self.encoder, state) {
            self.inputs.extend(encoder.words(state));
        }
    }

    /// Gives the outputs to the world, which stands at the present edge, and asks how long nothing changes.
    fn put(&mut self) -> Result<(), Misdriven> {
        match &self.logic {
            Logic::Wiring { commands: true, .. } => self.world.drive(&GATES_OFF, &self.outputs),
            Logic::Wiring { .. } => self.world.drive(&self.outputs, &[]),
            Logic::Design(wires) => {
                let mut given = self.outputs.iter().copied();
                let words: Vec<_> =
                    wires.wires().iter().map(|wire| if is_output(wire) { given.next() } else { None }).collect();
                let (gates, command) = wires.drive(&words)?;
                self.world.drive(&flatten(&gates), &[command]);
            }
        }
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
    pub(crate) fn edge(&self) -> u64 {
        self.edge
    }

    /// Moves by this number of edges, or to the edge at which the scene or the world ends.
    #[inline]
    pub(crate) fn advance(&mut self, edges: u64) -> Result<(), Halt> {
        let wanted = self.edge.saturating_add(edges);
        let target = wanted.min(self.end);
        while self.next <= target {
            self.meet()?;
        }
        self.edge = target;
        if wanted > target { Err(Halt::End) } else { Ok(()) }
    }

    /// Returns for how many edges the inputs certainly keep their words, if the outputs keep theirs.
    pub(crate) fn quiet(&self) -> u64 {
        self.next.saturating_sub(1).min(self.end).saturating_sub(self.edge)
    }

    /// Sets the words of the outputs from the present edge on. The world is driven as before when they are refused.
    #[inline]
    pub(crate) fn drive(&mut self, outputs: &[i64]) -> Result<(), Misdriven> {
        if self.outputs != outputs {
            self.before.copy_from_slice(&self.outputs);
            self.outputs.copy_from_slice(outputs);
            self.follow();
            if let Err(fault) = self.put() {
                self.outputs.copy_from_slice(&self.before);
                return Err(fault);
            }
        }
        Ok(())
    }

    /// Returns the words of the inputs at the present edge.
    #[inline]
    pub(crate) fn inputs(&self) -> &[i64] {
        &self.inputs
    }

    /// Returns the words of the outputs.
    pub(crate) fn outputs(&self) -> &[i64] {
        &self.outputs
    }

    /// Returns the continuous output of this index at the present edge.
    pub(crate) fn real(&self, index: usize) -> f64 {
        self.world.real(self.edge, index)
    }

    /// Returns the world's part of a summary at the present edge.
    pub(crate) fn summary(&mut self) -> Summary {
        self.follow();
        self.world.summary()
    }
}
