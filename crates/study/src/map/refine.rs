//! Which cells of a grid are run: all along the boundaries, few elsewhere.
//!
//! The grid is cut into squares of [`STRIDE`] cells, whose corners are run. A square that holds cells of different
//! classes (its own corners, or those of a smaller neighbour on its edge) is cut into four, down to single cells. Cells
//! in a square that is left whole are inferred: they have the one class that all known cells of the square have. If a
//! cell differs from both of its neighbours in its row or its column, the boundary is not sharp there, and all cells
//! within two cells of it are run.
//!
//! The cost is one cell in sixteen, and three or four cells for each cell of the boundary's length.
//!
//! The method can miss an island narrower than [`STRIDE`] cells that holds no corner of the first squares. It can also
//! miss a tongue, a gap or a speck of such width where it touches no square that is cut. Anything that reaches a known
//! cell is followed to its end; `--full` runs all cells.

use std::collections::BTreeSet;

/// Number of cells along an edge of the first squares.
pub const STRIDE: usize = 4;
/// Distance, in cells, within which all cells are run around a cell that differs from its neighbours.
const RADIUS: usize = 2;

/// The ends of a square, both included: first and last column, first and last row.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Square {
    x: (usize, usize),
    y: (usize, usize),
}

impl Square {
    fn columns(self) -> std::ops::RangeInclusive<usize> {
        self.x.0..=self.x.1
    }

    fn rows(self) -> std::ops::RangeInclusive<usize> {
        self.y.0..=self.y.1
    }

    fn is_cut(self) -> bool {
        self.x.1 - self.x.0 <= 1 && self.y.1 - self.y.0 <= 1
    }
}

/// A grid under refinement.
#[derive(Clone, Debug)]
pub struct Refinement {
    width: usize,
    height: usize,
    squares: Vec<Square>,
    wanted: BTreeSet<usize>,
}

/// Returns the parts of an edge: from each of these ends to the next.
fn parts(ends: &[usize]) -> impl Iterator<Item = (usize, usize)> + Clone {
    ends.windows(2).map(|pair| (pair[0], pair[1]))
}

impl Refinement {
    /// Returns the first squares of a grid of so many columns and rows; cells are numbered row by row.
    pub fn new(width: usize, height: usize) -> Self {
        let ends = |cells: usize| {
            let mut ends: Vec<usize> = (0..cells).step_by(STRIDE).collect();
            if ends.last() != Some(&(cells - 1)) {
                ends.push(cells - 1);
            }
            ends
        };
        let mut grid = Self { width, height, squares: Vec::new(), wanted: BTreeSet::new() };
        grid.add(&ends(width), &ends(height));
        grid
    }

    fn add(&mut self, columns: &[usize], rows: &[usize]) {
        let width = self.width;
        self.wanted.extend(rows.iter().flat_map(|y| columns.iter().map(move |x| y * width + x)));
        let squares = parts(rows).flat_map(|y| parts(columns).map(move |x| Square { x, y }));
        self.squares.extend(squares);
    }

    /// Returns the cells that are to be run, in order.
    pub fn wanted(&self) -> &BTreeSet<usize> {
        &self.wanted
    }

    fn cells(&self, square: Square) -> impl Iterator<Item = usize> + use<> {
        let width = self.width;
        square.rows().flat_map(move |y| square.columns().map(move |x| y * width + x))
    }

    /// Asks for more cells where known cells differ; returns `false` if there is nothing to ask for. `class` is called
    /// for wanted cells only.
    pub fn refine<C: PartialEq>(&mut self, class: impl Fn(usize) -> C) -> bool {
        let mut known: Vec<Option<C>> = (0..self.width * self.height).map(|_| None).collect();
        for &cell in &self.wanted {
            known[cell] = Some(class(cell));
        }
        self.cut(&known) || self.widen(&known)
    }

    /// Cuts the squares that hold different classes.
    fn cut<C: PartialEq>(&mut self, known: &[Option<C>]) -> bool {
        let mixed = |square: &Square| {
            let mut classes = self.cells(*square).filter_map(|cell| known[cell].as_ref());
            let first = classes.next();
            !square.is_cut() && classes.any(|class| Some(class) != first)
        };
        let (mixed, whole): (Vec<_>, Vec<_>) = self.squares.iter().partition(|square| mixed(square));
        self.squares = whole;
        for Square { x, y } in &mixed {
            let ends = |(first, last): (usize, usize)| {
                let mut ends = vec![first, first.midpoint(last), last];
                ends.dedup();
                ends
            };
            self.add(&ends(*x), &ends(*y));
        }
        !mixed.is_empty()
    }

    /// Asks for all cells within [`RADIUS`] of a cell that differs from both of its neighbours in its row or its
    /// column.
    fn widen<C: PartialEq>(&mut self, known: &[Option<C>]) -> bool {
        let mut like: Vec<usize> = (0..known.len()).collect();
        for (cell, other) in self.inferred() {
            like[cell] = other;
        }
        let (width, height) = (self.width, self.height);
        let differ = |one: usize, other: usize| known[like[one]] != known[like[other]];
        let alone = |cell: usize, at: usize, cells: usize, step: usize| {
            at > 0 && at + 1 < cells && differ(cell, cell - step) && differ(cell, cell + step)
        };
        let before = self.wanted.len();
        for cell in 0..known.len() {
            let (x, y) = (cell % width, cell / width);
            if alone(cell, x, width, 1) || alone(cell, y, height, width) {
                let near = |at: usize, cells: usize| at.saturating_sub(RADIUS)..=(at + RADIUS).min(cells - 1);
                self.wanted.extend(near(y, height).flat_map(|y| near(x, width).map(move |x| y * width + x)));
            }
        }
        self.wanted.len() > before
    }

    /// Returns, for each cell of the grid that is not wanted, the nearest corner of its square, which is wanted.
    pub fn inferred(&self) -> Vec<(usize, usize)> {
        let mut inferred: Vec<(usize, usize)> = Vec::new();
        for &square in self.squares.iter().filter(|square| !square.is_cut()) {
            let near = |at: usize, (first, last): (usize, usize)| if 2 * at <= first + last { first } else { last };
            inferred.extend(self.cells(square).filter(|cell| !self.wanted.contains(cell)).map(|cell| {
                let corner = near(cell / self.width, square.y) * self.width + near(cell % self.width, square.x);
                (cell, corner)
            }));
        }
        inferred.sort_unstable();
        // A cell on the edge between two squares belongs to both; their classes are the same.
        inferred.dedup_by_key(|(cell, _)| *cell);
        inferred
    }
}
