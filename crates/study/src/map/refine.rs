//! Which cells of a grid are run: all along the boundaries, few elsewhere.
//!
//! The grid is cut into squares of [`STRIDE`] cells, whose corners are run. A square that holds cells of different classes,
//! its own corners or those of a smaller neighbour on its edge, is cut into four, down to single cells. What lies in a
//! square that is left whole is inferred: it is of the one class that all its known cells have.
//!
//! What this can miss: an island narrower than [`STRIDE`] cells that holds no corner of the first squares, and a tongue or
//! a gap of such width where it touches no square that is cut. Whatever reaches a known cell is followed to its end as
//! long as it is wider than the cells; `--full` runs all.

use std::collections::BTreeSet;

/// Cells along an edge of the first squares.
pub const STRIDE: usize = 4;

/// Corners of a square, both included: first and last column, first and last row.
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
    squares: Vec<Square>,
    wanted: BTreeSet<usize>,
}

/// The parts of an edge: from each of these to the next.
fn parts(ends: &[usize]) -> impl Iterator<Item = (usize, usize)> + Clone {
    ends.windows(2).map(|pair| (pair[0], pair[1]))
}

impl Refinement {
    /// The first squares of a grid of so many columns and rows; cells are numbered row by row.
    #[must_use]
    pub fn new(width: usize, height: usize) -> Self {
        let ends = |cells: usize| {
            let mut ends: Vec<usize> = (0..cells).step_by(STRIDE).collect();
            if ends.last() != Some(&(cells - 1)) {
                ends.push(cells - 1);
            }
            ends
        };
        let mut grid = Self { width, squares: Vec::new(), wanted: BTreeSet::new() };
        grid.add(&ends(width), &ends(height));
        grid
    }

    fn add(&mut self, columns: &[usize], rows: &[usize]) {
        let width = self.width;
        self.wanted.extend(rows.iter().flat_map(|y| columns.iter().map(move |x| y * width + x)));
        let squares = parts(rows).flat_map(|y| parts(columns).map(move |x| Square { x, y }));
        self.squares.extend(squares);
    }

    /// The cells that are to be run, in order.
    #[must_use]
    pub fn wanted(&self) -> &BTreeSet<usize> {
        &self.wanted
    }

    fn cells(&self, square: Square) -> impl Iterator<Item = usize> + use<> {
        let width = self.width;
        square.rows().flat_map(move |y| square.columns().map(move |x| y * width + x))
    }

    /// Cuts the squares that hold different classes; `false` when there is none left. `class` is asked of wanted cells.
    pub fn cut<C: PartialEq>(&mut self, class: impl Fn(usize) -> C) -> bool {
        let mixed = |square: &Square| {
            let mut classes = self.cells(*square).filter(|cell| self.wanted.contains(cell)).map(&class);
            let first = classes.next();
            !square.is_cut() && classes.any(|class| Some(&class) != first.as_ref())
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

    /// For each cell of the grid that is not wanted, a cell that is, of the same square: the nearest corner.
    #[must_use]
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
        // Cells on the edge between two squares are of both, whose classes are the same.
        inferred.dedup_by_key(|(cell, _)| *cell);
        inferred
    }
}
