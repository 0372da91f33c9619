//! A world that somebody else's logic drives edge by edge.
//!
//! The world is asked only where something changes. In between, an edge is a step of a counter: the world has told up
//! to which edge nothing changes by itself while the outputs stay. A new output makes the world flow to the present
//! edge first, as the loop of a `[dut]` does.

use hpu_cosim::{Summary, World};
use hpu_datapath::bundle;
use hpu_signal::Ports;

/// The fewest and the most edges to look ahead. A look costs as much as some edges, and a look of the drive's own
/// rhythm is seldom in vain.
const LOOK: [u64; 2] = [64, 1 << 14];

/// The reason why a plant has not reached the edge that it was asked for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Halt {
    /// The scene has ended.
    End,
    /// The world cannot go on.
    Over(&'static str),
}

/// `Loop` hides the type of a world, so that a handle can hold any. [`Joined`] implements it.
pub(crate) trait Loop {
    /// Returns the present edge.
    fn edge(&self) -> u64;
    /// Moves by this number of edges, or to the edge at which the scene or the world ends.
    fn advance(&mut self, edges: u64) -> Result<(), Halt>;
    /// Sets the words of the outputs from the present edge on.
    fn drive(&mut self, outputs: &[i64]);
    /// Returns the words of the inputs at the present edge.
    fn inputs(&self) -> &[i64];
    /// Returns the continuous output of this index at the present edge.
    fn real(&self, index: usize) -> f64;
    /// Returns the world's part of a summary at the present edge.
    fn summary(&mut self) -> Summary;
}

/// The words beside a wiring's inputs that a world gives, such as an encoder's count.
pub(crate) type Beside<E> = Box<dyn Fn(&E, &mut Vec<i64>)>;

/// A world, and the logic's side of it.
pub(crate) struct Joined<E: World> {
    world: E,
    input: E::In,
    beside: Beside<E>,
    /// Number of the wiring's inputs that are given to the logic.
    given: usize,
    inputs: Vec<i64>,
    outputs: Vec<i64>,
    /// The factor of the one output that drives the world as a command; `None` if the wiring's outputs drive it.
    command: Option<i64>,
    /// The present edge. The world stands there or before, and nothing changes between the two.
    edge: u64,
    /// The edge at which the world has to be asked.
    next: u64,
    /// The edge at which the world was asked last.
    asked: u64,
    end: u64,
    over: Option<&'static str>,
}

impl<E: World> Joined<E> {
    /// Joins a world at edge 0, which ends at the edge `end`, to a logic with `outputs` outputs. `input` holds the
    /// constant words; `given` inputs of the wiring are given to the logic, then the words `beside`.
    pub(crate) fn new(
        world: E,
        (input, given): (E::In, usize),
        beside: Beside<E>,
        (outputs, command): (usize, Option<i64>),
        end: u64,
    ) -> Self {
        let mut joined = Self {
            over: world.over(),
            world,
            input,
            beside,
            given,
            inputs: Vec::new(),
            outputs: vec![0; outputs],
            command,
            edge: 0,
            next: 0,
            asked: 0,
            end,
        };
        joined.sense();
        joined.put();
        joined
    }

    /// Reads the inputs from the world at the edge at which it stands.
    fn sense(&mut self) {
        self.world.place(&mut self.input);
        self.inputs.clear();
        let (inputs, given) = (&mut self.inputs, self.given);
        self.input.each(|&word| {
            if inputs.len() < given {
                inputs.push(word);
            }
        });
        (self.beside)(&self.world, &mut self.inputs);
    }

    /// Gives the outputs to the world, which stands at the present edge, and asks how long nothing changes.
    fn put(&mut self) {
        match self.command {
            Some(factor) => self.world.drive(E::Out::build(|| 0), &[factor * self.outputs[0]]),
            None => self.world.drive(bundle(&self.outputs), &[]),
        }
        self.over = self.world.over();
        self.ask();
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
        self.world.advance(self.next, |_, _| {});
        self.edge = self.world.edge();
        self.sense();
        self.over = self.world.over();
        self.ask();
        self.over.map_or(Ok(()), |why| Err(Halt::Over(why)))
    }

    /// Moves the world to the present edge, before which nothing changes.
    fn follow(&mut self) {
        if self.world.edge() < self.edge {
            self.world.advance(self.edge, |_, _| {});
        }
    }
}

impl<E: World> Loop for Joined<E> {
    fn edge(&self) -> u64 {
        self.edge
    }

    #[inline]
    fn advance(&mut self, edges: u64) -> Result<(), Halt> {
        let wanted = self.edge.saturating_add(edges);
        let target = wanted.min(self.end);
        while self.next <= target {
            self.meet()?;
        }
        self.edge = target;
        if wanted > target { Err(Halt::End) } else { Ok(()) }
    }

    #[inline]
    fn drive(&mut self, outputs: &[i64]) {
        if self.outputs != outputs {
            self.outputs.copy_from_slice(outputs);
            self.follow();
            self.put();
        }
    }

    #[inline]
    fn inputs(&self) -> &[i64] {
        &self.inputs
    }

    fn real(&self, index: usize) -> f64 {
        self.world.reals(self.edge).as_ref()[index]
    }

    fn summary(&mut self) -> Summary {
        self.follow();
        self.world.summary()
    }
}
