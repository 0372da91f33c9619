//! The rows of a run, which its observer is shown.

use hpu_signal::{Cycle, Observe};

use crate::result::stays::{Stays, Sums};
use crate::world::World;

/// The rows of a run: the plant's outputs every `stride` edges.
pub(crate) struct Rows {
    /// The edge of the next row.
    pub(super) next: u64,
    pub(super) stride: u64,
    /// The edge of the row from which on the run is judged, and the sums up to it.
    pub(super) window: u64,
    before: Option<Sums>,
    /// The edge of that row, until its sums are known.
    due: u64,
    /// Whether rows may be shown after the nets of later edges.
    pub(super) wait: bool,
    /// The present row, if rows have means and extremes: as it is shown, and as it is judged.
    pub(super) row: Option<[Vec<f64>; 2]>,
    /// The rows that may be shown again, if any.
    tape: Option<Recorded>,
}

/// Rows to be shown again.
pub(super) struct Recorded {
    /// The edge of the first.
    first: u64,
    values: Vec<f64>,
}

/// An observer of rows that also records them.
struct Tee<'o, O: ?Sized> {
    observer: &'o mut O,
    values: &'o mut Vec<f64>,
}

impl<O: Observe + ?Sized> Observe for Tee<'_, O> {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        self.observer.nets(cycle, words);
    }
    fn reals(&mut self, cycle: Cycle, values: &[f64]) {
        self.values.extend_from_slice(values);
        self.observer.reals(cycle, values);
    }
    fn block(&mut self, first: Cycle, stride: u64, width: usize, values: &[f64]) {
        self.values.extend_from_slice(values);
        self.observer.block(first, stride, width, values);
    }
    fn still(&mut self, first: Cycle, stride: u64, count: u64, values: &[f64]) {
        (0..count).for_each(|_| self.values.extend_from_slice(values));
        self.observer.still(first, stride, count, values);
    }
}

impl Rows {
    /// Creates rows from edge 0 on.
    pub(crate) fn new(stride: u64) -> Self {
        let (next, stride, window) = (0, stride.max(1), u64::MAX);
        Self { next, stride, window, before: None, due: window, wait: false, row: None, tape: None }
    }

    /// Creates rows of which none is ever due.
    #[cfg(not(target_family = "wasm"))]
    pub(crate) fn never() -> Self {
        Self { next: u64::MAX, ..Self::new(u64::MAX) }
    }

    /// Returns the rows with means of the actuator's torque and of the position from the row at this edge on. If
    /// `measured` is set, rows also have means and extremes.
    pub(crate) fn averaged(mut self, from: u64, measured: bool) -> Self {
        self.judge_from(from);
        self.row = measured.then(Default::default);
        self
    }

    /// Sets the edge of the row from which on the run is judged.
    pub(super) fn judge_from(&mut self, edge: u64) {
        (self.window, self.due) = (edge, edge);
    }

    /// Returns the means of torque and position, and the stays of the device, from the requested row to an edge at
    /// which the world stands.
    pub(crate) fn judged(&self, world: &impl World, edge: u64, edge_s: f64) -> Option<([f64; 2], Stays)> {
        let edges = edge.checked_sub(self.window)?;
        world.sums(edge).since(&self.before?, edges as f64 * edge_s)
    }

    /// Takes the sums up to the row from which on the run is judged, before the world leaves it.
    #[cold]
    fn begin(&mut self, world: &impl World) {
        self.before = Some(world.sums(self.due));
        self.due = u64::MAX;
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
        if self.due < edge {
            self.begin(world);
        }
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

    /// Records the rows from the next one on, to be shown again.
    pub(super) fn record(&mut self) {
        self.tape = Some(Recorded { first: self.next, values: Vec::new() });
    }

    /// Lets go of the rows recorded.
    pub(super) fn forget(&mut self) {
        self.tape = None;
    }

    /// Returns the rows recorded, and records no more.
    pub(super) fn recorded(&mut self) -> Option<Recorded> {
        self.tape.take()
    }

    /// Shows the rows before an edge by those that were recorded this number of edges earlier.
    pub(super) fn show_again<O: Observe + ?Sized>(
        &mut self,
        tape: &Recorded,
        edge: u64,
        later: u64,
        width: usize,
        observer: &mut O,
    ) {
        let count = edge.saturating_sub(self.next).div_ceil(self.stride);
        if count == 0 {
            return;
        }
        if width > 0 {
            let first = ((self.next - later - tape.first) / self.stride) as usize;
            let values = &tape.values[first * width..][..count as usize * width];
            observer.block(Cycle(self.next), self.stride, width, values);
        }
        self.next += count * self.stride;
    }

    #[inline(never)]
    fn show<O: Observe + ?Sized>(&mut self, world: &impl World, edge: u64, observer: &mut O) {
        if self.due <= edge {
            self.begin(world);
        }
        // In most cases it is one row.
        let count = if edge - self.next < self.stride { 1 } else { (edge - self.next) / self.stride + 1 };
        if let Some([shown, judged]) = &mut self.row {
            for edge in (0..count).map(|index| self.next + index * self.stride) {
                shown.clear();
                judged.clear();
                world.shown(edge, shown);
                judged.extend_from_slice(world.reals(edge).as_ref());
                judged.extend_from_slice(&shown[judged.len()..]);
                observer.row(Cycle(edge), judged, shown);
            }
        } else if let Some(Recorded { values, .. }) = &mut self.tape {
            world.rows(self.next, self.stride, count, &mut Tee { observer, values });
        } else {
            world.rows(self.next, self.stride, count, observer);
        }
        self.next += count * self.stride;
    }
}
