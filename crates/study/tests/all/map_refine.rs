//! Refinement against verdicts that are known everywhere: it finds the map of the full grid with a quarter of the runs.

use std::collections::BTreeSet;

use hpu_study::map::{Refinement, STRIDE};

/// Returns the map that refinement makes of a verdict, and how many cells it ran.
fn refined<C: PartialEq + Copy>(width: usize, height: usize, verdict: impl Fn(usize, usize) -> C) -> (Vec<C>, usize) {
    let class = |cell: usize| verdict(cell % width, cell / width);
    let mut grid = Refinement::new(width, height);
    while grid.refine(class) {}
    let mut map: Vec<Option<C>> = vec![None; width * height];
    for &cell in grid.wanted() {
        map[cell] = Some(class(cell));
    }
    for (cell, like) in grid.inferred() {
        assert!(map[cell].is_none() && grid.wanted().contains(&like), "{cell} as {like}");
        map[cell] = Some(class(like));
    }
    (map.into_iter().map(|class| class.expect("every cell is known")).collect(), grid.wanted().len())
}

fn full<C>(width: usize, height: usize, verdict: impl Fn(usize, usize) -> C) -> Vec<C> {
    (0..width * height).map(|cell| verdict(cell % width, cell / width)).collect()
}

/// Asserts that refinement finds the full map with at most this share of its runs.
fn assert_found<C: PartialEq + Copy + std::fmt::Debug>(
    name: &str,
    (width, height): (usize, usize),
    share: f64,
    verdict: impl Fn(usize, usize) -> C,
) {
    let (map, runs) = refined(width, height, &verdict);
    assert!(map == full(width, height, &verdict), "{name}: another map than the full one");
    let most = share * (width * height) as f64;
    assert!((runs as f64) < most, "{name}: {runs} runs of {}, at most {most}", width * height);
}

#[test]
fn a_sharp_boundary_is_that_of_the_full_grid_from_a_quarter_of_its_runs() {
    for size in [41, 60, 100, 101] {
        let s = size as f64;
        let at = |i: usize| (i as f64 + 0.37) / s;
        assert_found("a straight line", (size, size), 0.25, |x, y| at(y) > 0.3 + 0.45 * at(x));
        // Two branches across the whole map: on the smallest grid the boundary is a large part of it and needs a little
        // more.
        let share = if size < 60 { 0.3 } else { 0.25 };
        assert_found("a parabola", (size, size), share, |x, y| at(y) > 4.0 * (at(x) - 0.45).powi(2));
        assert_found("a hyperbola", (size, size), 0.25, |x, y| at(x) * at(y) > 0.2);
        assert_found("a disc", (size, size), 0.25, |x, y| (at(x) - 0.6).hypot(at(y) - 0.5) < 0.22);
    }
    // Three outcomes that meet in a point.
    assert_found("a fork", (100, 100), 0.25, |x, y| match (x < 50, y < 30 + x / 3) {
        (_, true) => 'a',
        (true, false) => 'b',
        (false, false) => 'c',
    });
}

#[test]
fn a_straight_line_of_any_slope_and_place_is_found_to_the_cell() {
    let (width, height) = (33, 27);
    for slope in -12..=12i64 {
        for offset in (-40..=40i64).step_by(5) {
            let verdict = |x: usize, y: usize| 4 * (y as i64) > slope * (x as i64 - 16) + 4 * offset;
            let (map, _) = refined(width, height, verdict);
            let differ: Vec<usize> =
                (0..map.len()).filter(|cell| map[*cell] != verdict(cell % width, cell / width)).collect();
            // A corner of the map that the line cuts off is narrower than a square, so it may be missed.
            let known: BTreeSet<usize> = Refinement::new(width, height).wanted().clone();
            let near = |cell: usize| known.iter().any(|k| k % width == cell % width && k / width == cell / width);
            assert!(differ.iter().all(|cell| !near(*cell)));
            assert!(differ.len() <= 3 * STRIDE, "slope {slope}/4 offset {offset}: {differ:?}");
        }
    }
}

#[test]
fn a_map_of_one_outcome_runs_the_corners_of_the_first_squares_only() {
    for (width, height) in [(2, 2), (3, 2), (5, 5), (41, 41), (100, 7)] {
        let (map, runs) = refined(width, height, |_, _| 'a');
        assert_eq!(map.len(), width * height);
        let corners = |cells: usize| (cells - 1).div_ceil(STRIDE) + 1;
        assert_eq!(runs, corners(width) * corners(height), "{width} by {height}");
    }
}

#[test]
fn a_map_without_any_order_is_run_whole() {
    let noise = |x: usize, y: usize| (x * 7919 + y * 104_729).wrapping_mul(2_654_435_761) >> 7 & 1;
    let (map, runs) = refined(40, 30, noise);
    assert_eq!(map, full(40, 30, noise));
    assert!(runs > 1150, "{runs} of 1200");
}

#[test]
fn a_strip_that_is_one_cell_wide_is_followed_wherever_it_meets_a_known_cell() {
    // Column 8 is an edge of the first squares; column 9 lies between two such edges.
    let strip = |column: usize| move |x: usize, _: usize| x == column;
    let (map, _) = refined(41, 41, strip(8));
    assert_eq!(map, full(41, 41, strip(8)));
    // The documentation of `Refinement` says what is missed, and this must be missed: it may promise neither less nor
    // more.
    let (map, _) = refined(41, 41, strip(9));
    assert!(map.iter().all(|found| !found));
    // A tongue that starts at a known region is followed through the squares that this region cuts.
    let tongue = |x: usize, y: usize| y < 10 || (x == 9 && y < 12);
    let (map, _) = refined(41, 41, tongue);
    assert_eq!(map, full(41, 41, tongue));
}

#[test]
fn a_boundary_that_is_not_sharp_is_searched_two_cells_around() {
    // In each fifth row there is a hole behind the boundary, and a speck before it that meets no square's corner.
    let verdict = |x: usize, y: usize| match (y % 5, x) {
        (2, 22) => false,
        (2, 19) => true,
        _ => x >= 21,
    };
    let (map, runs) = refined(60, 60, verdict);
    assert!(map == full(60, 60, verdict));
    assert!(4 * runs < map.len(), "{runs} runs");
}

#[test]
fn an_island_of_the_stride_in_both_directions_is_always_found() {
    for left in 0..12 {
        for top in 0..12 {
            let island =
                |x: usize, y: usize| (left..left + STRIDE + 1).contains(&x) && (top..top + STRIDE + 1).contains(&y);
            let (map, _) = refined(30, 30, island);
            assert_eq!(map, full(30, 30, island), "at {left}, {top}");
        }
    }
}
