//! The rows of a run, which its observer is shown.

use hpu_plant::Energy;
use hpu_signal::{Cycle, Observe};

use crate::world::World;

/// The rows of a run: the plant's outputs every `stride` edges.
pub(crate) struct Rows {
    /// The edge of the next row.
    pub(super) next: u64,
    pub(super) stride: u64,
    /// The edge of the row from which torque and position are averaged, and the energies at it.
    pub(super) window: u64,
    before: Option<Energy>,
    /// Whether rows may be shown after the nets of later edges.
    pub(super) wait: bool,
    /// The present row, if rows have means and extremes.
    pub(super) row: Option<Vec<f64>>,
    /// The rows that may be shown again, if any.
    tape: Option<Recorded>,
}

/// Rows to be shown again.
struct Recorded {
    /// The edge of the first.
    first: u64,
    values: Vec<f64>,
    /// The edge of a row that is so many repetitions before the one from which torque and position are averaged, and
    /// the energies at it.
    like: u64,
    before: Option<Energy>,
}

impl Rows {
    /// Creates rows from edge 0 on.
    pub(crate) fn new(stride: u64) -> Self {
        Self { next: 0, stride: stride.max(1), window: u64::MAX, before: None, wait: false, row: None, tape: None }
    }

    /// Returns the rows with means of the actuator's torque and of the position from the row at this edge on. If
    /// `measured` is set, rows also have means and extremes.
    pub(crate) fn averaged(mut self, from: u64, measured: bool) -> Self {
        self.window = from;
        self.row = measured.then(Vec::new);
        self
    }

    /// Returns the means of torque and position from the requested row to an edge at which the world stands.
    pub(crate) fn averages(&self, world: &impl World, edge: u64, edge_s: f64) -> Option<[f64; 2]> {
        let before = self.before?;
        let edges = edge.checked_sub(self.window).filter(|edges| *edges > 0)?;
        let [current, angle] = world.energy(edge).current_and_angle_since(&before);
        let length_s = edges as f64 * edge_s;
        Some([world.effort_per_a() * current / length_s, angle / length_s])
    }

    /// Shows the rows up to `edge`, which the world must not have left yet.
    #[inline(always)]
    pub(crate) fn log<O: Observe + ?Sized>(&mut self, world: &impl World, edge: u64, observer: &mut O) {
        if self.next <= edge {
            self.show(world, edge, observer);
        }
    }

    /// Shows the rows before `edge`, to which the world is about to go, unless they can wait.
    #[inline(always)]
    pub(super) fn leave<O: Observe + ?Sized>(&mut self, world: &impl World, edge: u64, observer: &mut O) {
        if self.next < edge && !(self.wait && world.keeps(edge)) {
            self.show(world, edge - 1, observer);
        }
    }

    /// Drives the world from its edge on. Rows that wait are shown before.
    #[inline(always)]
    pub(super) fn drive<E: World, O: Observe>(&mut self, world: &mut E, out: E::Out, words: &[i64], observer: &mut O) {
        if !world.is_driven_by(&out, words) {
            self.log(world, world.edge() - 1, observer);
            world.drive(out, words);
        }
    }

    /// Holds the rows of this number of edges from the next row on.
    pub(super) fn record(&mut self, edges: u64) {
        let like = if self.window < self.next { u64::MAX } else { self.next + (self.window - self.next) % edges };
        self.tape = Some(Recorded { first: self.next, values: Vec::new(), like, before: None });
    }

    /// Lets go of the rows held to be shown again.
    pub(super) fn forget(&mut self) {
        self.tape = None;
    }

    /// Shows the rows that were recorded again, this number of edges later.
    pub(super) fn show_again<O: Observe + ?Sized>(&self, edges: u64, width: usize, observer: &mut O) {
        if let Some(tape) = &self.tape {
            observer.block(Cycle(tape.first + edges), self.stride, width, &tape.values);
        }
    }

    /// Goes on after the rows that were shown again so many times. Each time takes this number of edges. The energies
    /// are those before and after one time.
    pub(super) fn repeat(&mut self, edges: u64, times: u64, [then, now]: &[Energy; 2]) {
        let Some(Recorded { like, before, .. }) = self.tape.take() else { return };
        self.next += times * edges;
        if let Some(mut before) = before.filter(|_| (like + 1..self.next).contains(&self.window)) {
            before.repeat([then, now], (self.window - like) / edges);
            self.before = Some(before);
        }
    }

    #[inline(never)]
    fn show<O: Observe + ?Sized>(&mut self, world: &impl World, edge: u64, observer: &mut O) {
        if (self.next..=edge).contains(&self.window) {
            self.before = Some(world.energy(self.window));
        }
        // In most cases it is one row.
        let count = if edge - self.next < self.stride { 1 } else { (edge - self.next) / self.stride + 1 };
        if let Some(tape) = &mut self.tape {
            if (self.next..=edge).contains(&tape.like) {
                tape.before = Some(world.energy(tape.like));
            }
            for edge in (0..count).map(|index| self.next + index * self.stride) {
                tape.values.extend_from_slice(world.reals(edge).as_ref());
            }
        }
        if let Some(row) = &mut self.row {
            for edge in (0..count).map(|index| self.next + index * self.stride) {
                row.clear();
                row.extend_from_slice(world.reals(edge).as_ref());
                world.measured(edge, row);
                observer.reals(Cycle(edge), row);
            }
        } else {
            world.rows(self.next, self.stride, count, observer);
        }
        self.next += count * self.stride;
    }
}
