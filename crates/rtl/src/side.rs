//! The two sides of a comparison: the emulator with its world, and the world that the VHDL drives.

use std::collections::VecDeque;

use hpu_cosim::{LoopVisitor, Summary, World};
use hpu_datapath::{Repeat, Wiring, flatten};
use hpu_signal::{Ports, Signal, SignalUse};

use crate::late::{Begin, Homing, Late};

/// Both sides of a comparison, without their types: `Lockstep` drives any wiring and world through this trait. `Both`
/// implements it.
pub(crate) trait Pair {
    /// Steps the emulator by one edge; it may be ahead of the VHDL's world. Returns the words of all nets after the
    /// edge.
    fn step(&mut self) -> &[i64];
    /// Moves the VHDL's world to the next edge, and writes the wiring's inputs at that edge to `input`.
    fn sense(&mut self, input: &mut Vec<i64>);
    /// Drives the VHDL's world by the words of the VHDL's nets; the outputs begin at index `outputs`. Called once for
    /// each step of the emulator. `agrees`: the emulator's promise about its outputs holds for the VHDL's outputs too.
    fn drive(&mut self, outputs: usize, words: &[i64], agrees: bool);
    /// Returns whether the encoders are still being turned to the arm's position while the worlds wait.
    fn is_homing(&self) -> bool;
    /// Makes the VHDL's world keep the means and extremes for rows every `stride` edges. Called before the world moves.
    fn measure(&mut self, stride: u64);
    /// Returns in `values` the row of the VHDL's world at the present edge.
    fn reals(&self, edge: u64, values: &mut Vec<f64>);
    /// Returns the reason why the VHDL's world cannot go on, if it cannot.
    fn over(&self) -> Option<&'static str>;
    /// Returns the summary of the VHDL's world, with the changes of the VHDL's outputs.
    fn summary(&self) -> Summary;
    /// Returns the emulator's use of its words. It is also the VHDL's, as long as both agree.
    fn uses(&self) -> Vec<SignalUse>;
}

/// A world, and the outputs that drive it.
struct Driven<E: World> {
    world: E,
    input: E::In,
    out: E::Out,
    output_changes: u64,
    homing: Option<Homing>,
}

impl<E: World> Driven<E> {
    /// Moves the world to the next edge, as the engine's `clock` driver does.
    #[inline]
    fn sense(&mut self) {
        if let Some(homing) = &mut self.homing {
            let mut words = flatten(&self.input);
            if homing.turn(&mut words) {
                let mut next = words.into_iter();
                self.input = E::In::build(|| next.next().expect("as many words as ports"));
                return;
            }
            self.homing = None;
        }
        self.world.sense();
        self.world.place(&mut self.input);
    }

    /// Takes the outputs at the present edge. A world that is promised how its outputs repeat goes on by itself, as in
    /// the engine. If the outputs then do not repeat, they drive the world.
    #[inline]
    fn drive(
        &mut self,
        out: E::Out,
        words: &[i64],
        repeats: impl FnOnce(&E::In) -> Option<Repeat<E::Out>>,
    ) -> Option<Repeat<E::Out>> {
        let changed = std::mem::replace(&mut self.out, out) != out;
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

struct Both<W, E: World> {
    wiring: W,
    emulated: Driven<E>,
    vhdl: Driven<E>,
    /// The emulator's promise of how its outputs repeat, for each edge that the VHDL has not reached yet.
    repeats: VecDeque<Option<Repeat<E::Out>>>,
}

impl<E: World, W: Wiring<In<i64> = E::In, Out<i64> = E::Out>> Pair for Both<W, E> {
    fn step(&mut self) -> &[i64] {
        let Self { wiring, emulated, repeats, .. } = self;
        emulated.sense();
        let out = wiring.tick(emulated.input);
        repeats.push_back(emulated.drive(out, wiring.words(), |input| wiring.repeats(input)));
        wiring.words()
    }

    fn sense(&mut self, input: &mut Vec<i64>) {
        self.vhdl.sense();
        input.clear();
        self.vhdl.input.each(|&word| input.push(word));
    }

    fn drive(&mut self, outputs: usize, words: &[i64], agrees: bool) {
        let mut next = words[outputs..].iter();
        let out = E::Out::build(|| *next.next().expect("outputs come before other nets"));
        // VHDL promises nothing. But as long as it agrees with the emulator, the emulator's promise is about the same
        // registers.
        let repeat = self.repeats.pop_front().flatten().filter(|_| agrees);
        self.vhdl.drive(out, words, |_| repeat);
    }

    fn is_homing(&self) -> bool {
        self.vhdl.homing.is_some()
    }

    fn measure(&mut self, stride: u64) {
        self.vhdl.world.measure(stride);
    }

    fn reals(&self, edge: u64, values: &mut Vec<f64>) {
        values.clear();
        values.extend_from_slice(self.vhdl.world.reals(edge).as_ref());
        self.vhdl.world.measured(edge, values);
    }

    fn over(&self) -> Option<&'static str> {
        self.vhdl.world.over()
    }

    fn summary(&self) -> Summary {
        Summary { output_changes: self.vhdl.output_changes, ..self.vhdl.world.summary() }
    }

    fn uses(&self) -> Vec<SignalUse> {
        self.wiring.uses()
    }
}

/// Both sides of a scene at the start of a comparison.
pub(crate) struct Sides<'s> {
    pub(crate) pair: Box<dyn Pair + 's>,
    /// The inputs at the start.
    pub(crate) input: Vec<i64>,
    pub(crate) nets: Vec<Signal>,
    pub(crate) late: Option<Late>,
    /// Edges until the encoders have been turned to the arm's position.
    pub(crate) homing: u64,
}

/// Visits a simulation and makes both of its sides: from its start or, with `late`, from shortly before the wall is
/// reached.
pub(crate) struct Pairing {
    /// The number of edges to compare, and the number of edges of the whole scene.
    pub(crate) late: Option<(u64, u64)>,
    /// Whether the gates drive the device.
    pub(crate) modulated: bool,
    /// The nets of the wiring. A visitor that asked the wiring for them would compile every block for each wiring.
    pub(crate) nets: Vec<Signal>,
}

impl<'s> LoopVisitor<'s> for Pairing {
    type Out = Sides<'s>;
    fn visit<E, W>(self, wiring: &W, mut world: E, mut input: E::In) -> Self::Out
    where
        E: World + 's,
        W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone + 'static,
    {
        let (mut late, mut homing) = (None, None);
        if let Some((edges, end)) = self.late {
            let begin = Begin::find(wiring, &self.nets, &world, input, (edges, end), self.modulated);
            (world, input, homing) = (begin.world, begin.input, begin.homing);
            late = Some(begin.late);
        }
        let mut wiring = wiring.clone();
        let out = wiring.reset();
        world.place(&mut input);
        let words = flatten(&input);
        let edges = homing.as_ref().map_or(0, Homing::edges);
        let side = |world, homing| Driven { world, input, out, output_changes: 0, homing };
        let (emulated, vhdl) = (side(world.clone(), homing.clone()), side(world, homing));
        Sides {
            pair: Box::new(Both { wiring, emulated, vhdl, repeats: VecDeque::new() }),
            input: words,
            nets: self.nets,
            late,
            homing: edges,
        }
    }
}
