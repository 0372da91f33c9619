//! The two sides of a comparison: the emulator with its world, and the world that the VHDL drives.

use std::collections::VecDeque;

use hpu_cosim::{AnyWorld, Summary, Sums, Wired};
use hpu_datapath::{AnyWiring, Repeat};
use hpu_signal::{Observe, Signal, SignalUse};

use crate::vectors::late::{Begin, Homing, Late};

/// A world, and the outputs that drive it.
struct Driven<'s> {
    world: Box<dyn AnyWorld<'s> + 's>,
    input: Vec<i64>,
    out: Vec<i64>,
    output_changes: u64,
    homing: Option<Homing>,
}

impl Driven<'_> {
    /// Moves the world to the next edge, as the engine's `clock` driver does.
    fn sense(&mut self) {
        if let Some(homing) = &mut self.homing {
            if homing.turn(&mut self.input) {
                return;
            }
            self.homing = None;
        }
        self.world.sense();
        self.world.place(&mut self.input);
    }

    /// Takes the words of all nets at the present edge. A world that is promised how its outputs repeat goes on by
    /// itself, as in the engine. If the outputs then do not repeat, they drive the world.
    fn drive(
        &mut self,
        words: &[i64],
        repeats: impl FnOnce(&[i64]) -> Option<Repeat<Vec<i64>>>,
    ) -> Option<Repeat<Vec<i64>>> {
        let out = &words[self.input.len()..][..self.out.len()];
        let changed = self.out != out;
        self.out.copy_from_slice(out);
        self.output_changes += u64::from(changed);
        if self.homing.is_some() {
            return None;
        }
        self.world.drive(out, words);
        let repeat = if changed { repeats(&self.input) } else { None };
        if let Some(repeat) = &repeat {
            self.world.foresee(repeat);
        }
        repeat
    }
}

/// Both sides of a comparison: the emulator with its world, and the world that the VHDL drives.
pub(crate) struct Pair<'s> {
    wiring: Box<dyn AnyWiring>,
    emulated: Driven<'s>,
    vhdl: Driven<'s>,
    /// The emulator's promise of how its outputs repeat, for each edge that the VHDL has not reached yet.
    repeats: VecDeque<Option<Repeat<Vec<i64>>>>,
}

impl Pair<'_> {
    /// Steps the emulator by one edge; it may be ahead of the VHDL's world. Returns the words of all nets after the
    /// edge.
    pub(crate) fn step(&mut self) -> &[i64] {
        let Self { wiring, emulated, repeats, .. } = self;
        emulated.sense();
        wiring.step(&emulated.input);
        repeats.push_back(emulated.drive(wiring.words(), |input| wiring.repeats(input)));
        wiring.words()
    }

    /// Moves the VHDL's world to the next edge, and writes the wiring's inputs at that edge to `input`.
    pub(crate) fn sense(&mut self, input: &mut Vec<i64>) {
        self.vhdl.sense();
        input.clone_from(&self.vhdl.input);
    }

    /// Drives the VHDL's world by the words of the VHDL's nets. Called once for each step of the emulator. `agrees`:
    /// the emulator's promise about its outputs holds for the VHDL's outputs too.
    pub(crate) fn drive(&mut self, words: &[i64], agrees: bool) {
        // VHDL promises nothing. But as long as it agrees with the emulator, the emulator's promise is about the same
        // registers.
        let repeat = self.repeats.pop_front().flatten().filter(|_| agrees);
        self.vhdl.drive(words, |_| repeat);
    }

    /// Returns whether the encoders are still being turned to the arm's position while the worlds wait.
    pub(crate) fn is_homing(&self) -> bool {
        self.vhdl.homing.is_some()
    }

    /// Makes the VHDL's world keep the means and extremes for rows every `stride` edges. Called before the world moves.
    pub(crate) fn measure(&mut self, stride: u64, observer: &dyn Observe) {
        self.vhdl.world.measure(stride, observer);
    }

    /// Returns the row of the VHDL's world at the present edge: as it is judged, and as it is shown.
    pub(crate) fn row(&self, edge: u64, [judged, shown]: &mut [Vec<f64>; 2]) {
        judged.clear();
        shown.clear();
        self.vhdl.world.shown(edge, shown);
        self.vhdl.world.reals(edge, judged);
        judged.extend_from_slice(&shown[judged.len()..]);
    }

    /// Returns the sums of the VHDL's world from the start up to the present edge.
    pub(crate) fn sums(&self, edge: u64) -> Sums {
        self.vhdl.world.sums(edge)
    }

    /// Returns the reason why the VHDL's world cannot go on, if it cannot.
    pub(crate) fn over(&self) -> Option<&'static str> {
        self.vhdl.world.over()
    }

    /// Returns the summary of the VHDL's world, with the changes of the VHDL's outputs.
    pub(crate) fn summary(&self) -> Summary {
        Summary { output_changes: self.vhdl.output_changes, ..self.vhdl.world.summary() }
    }

    /// Returns the emulator's use of its words. It is also the VHDL's, as long as both agree.
    pub(crate) fn uses(&self) -> Vec<SignalUse> {
        self.wiring.uses()
    }
}

/// Both sides of a scene at the start of a comparison.
pub(crate) struct Sides<'s> {
    pub(crate) pair: Pair<'s>,
    /// The inputs at the start.
    pub(crate) input: Vec<i64>,
    pub(crate) nets: Vec<Signal>,
    pub(crate) late: Option<Late>,
    /// Edges until the encoders have been turned to the arm's position.
    pub(crate) homing: u64,
}

impl<'s> Sides<'s> {
    /// Makes both sides of a simulation: from its start or, for this number of edges to compare, from shortly before
    /// the wall is reached.
    pub(crate) fn of(simulation: &'s impl Wired, edges: Option<u64>) -> Self {
        let nets = simulation.wiring().nets();
        let fresh = simulation.closed_loop();
        let mut begin = match edges {
            Some(edges) => Begin::find(simulation, &nets, edges),
            None => Begin { world: fresh.world().copy(), input: fresh.constants(), homing: None, late: None },
        };
        begin.world.place(&mut begin.input);
        let Begin { world, input, homing, late } = begin;
        let wiring = fresh.wiring_copy();
        // All outputs come out of reset as 0.
        let out = vec![0; wiring.outputs().len()];
        let edges = homing.as_ref().map_or(0, Homing::edges);
        let side = |world, homing| Driven { world, input: input.clone(), out: out.clone(), output_changes: 0, homing };
        let (emulated, vhdl) = (side(world.copy(), homing.clone()), side(world, homing));
        Self { pair: Pair { wiring, emulated, vhdl, repeats: VecDeque::new() }, input, nets, late, homing: edges }
    }
}
