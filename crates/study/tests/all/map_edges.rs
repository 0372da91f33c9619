//! The reasons why a region of rest ends, on maps made by hand.

use std::io;

use hpu_cosim::scene::{OutcomeKind, shipped};
use hpu_study::map::{Cell, Curve, Curves, Edge, Found, Map, Method, Reason};

/// Returns a map of four stiffnesses by two rates of a shipped scene.
fn map() -> Map {
    let scene = shipped().iter().find(|scene| scene.name == "hybrid-wall").expect("shipped");
    let x = "wall.stiffness=1..8 N.m/rad:4:log".parse().expect("an axis");
    let y = "method.sample_rate=1..2 kHz:2".parse().expect("an axis");
    let layer = Method { label: "scene".into(), set: Vec::new() };
    let mut load = |_: &str| Err(io::Error::from(io::ErrorKind::NotFound));
    Map::new((scene.name, scene.text), &[], (x, y), vec![layer], &mut load).expect("a map")
}

fn cell(outcome: OutcomeKind, counts: f64, frequency_hz: Option<f64>, overflow_share: f64) -> Found {
    let count_rad = std::f64::consts::TAU / 4096.0;
    Found::Run(Ok(Cell {
        outcome,
        rms: None,
        amplitude: Some(counts * count_rad),
        frequency_hz,
        hand_j: 0.0,
        source_j: 0.0,
        dissipated_j: 0.0,
        displayed: None,
        contact_share: Some(1.0),
        device_contact_share: Some(1.0),
        product_wraps: None,
        contact_unseen: false,
        position_lost_share: 0.0,
        stiffness_error: None,
        overflow_share,
        switching: None,
        edges: 1,
        telling_s: None,
        for_ever: None,
    }))
}

fn rest() -> Found {
    cell(OutcomeKind::Settled, 0.0, None, 0.0)
}

fn swing(counts: f64, frequency_hz: f64, overflow_share: f64) -> Found {
    cell(OutcomeKind::LimitCycle, counts, Some(frequency_hz), overflow_share)
}

#[test]
fn each_place_of_an_edge_has_its_reason_by_the_cell_beyond() {
    // Rows of 4: at rest up to 2 N.m/rad in the first row, up to 4 N.m/rad in the second.
    let found = vec![
        rest(),
        rest(),
        swing(2.0, 100.0, 0.5),
        swing(40.0, 120.0, 0.0),
        rest(),
        rest(),
        rest(),
        swing(40.0, 150.0, 0.02),
    ];
    let edge = Edge::new(&map(), &found, None, 0);
    // Along the rows: column 1 to 2 of row 0, and column 2 to 3 of row 1. Along the columns: column 2.
    assert_eq!(edge.places, 3);
    let shares: Vec<_> = edge.shares.iter().map(|share| (share.reason, share.places)).collect();
    // The encoder is the reason for an amplitude of two counts, whatever overflows meanwhile.
    assert_eq!(shares, [(Reason::Counts, 2), (Reason::FullScale, 1)]);
    assert_eq!(edge.shares[1].frequency_hz, Some((150.0, 150.0)));
    let (low, high) = edge.shares[0].amplitude_counts.expect("swings");
    assert!((low - 2.0).abs() < 1e-12 && (high - 2.0).abs() < 1e-12);
    assert_eq!(edge.nearest, None);
}

#[test]
fn growth_and_plain_swings_are_told_apart() {
    for (beyond, reason) in [
        (cell(OutcomeKind::Diverged, 9.0, None, 1.0), Reason::Grows),
        (swing(9.0, 80.0, 0.009), Reason::Swings),
        (swing(9.0, 80.0, 0.01), Reason::FullScale),
    ] {
        let row = [rest(), beyond, rest(), rest()];
        let found = [row.clone(), row].concat();
        let edge = Edge::new(&map(), &found, None, 0);
        assert_eq!(edge.shares.iter().map(|share| share.reason).collect::<Vec<_>>(), [reason]);
        assert_eq!(edge.places, 4, "two to either side of the column");
    }
}

#[test]
fn cells_that_do_not_tell_are_no_edge() {
    for untold in [OutcomeKind::NotTold, OutcomeKind::HandMoves] {
        let row = [rest(), cell(untold, 9.0, None, 0.0), swing(9.0, 80.0, 0.0), rest()];
        let found = [row.clone(), row].concat();
        let edge = Edge::new(&map(), &found, None, 0);
        // Only from the last column to the swing before it.
        assert_eq!((edge.places, edge.shares[0].reason), (2, Reason::Swings), "{untold:?}");
    }
}

#[test]
fn the_nearest_criterion_is_the_one_with_the_least_ratio_over_most_of_the_edge() {
    let row = [rest(), rest(), swing(9.0, 80.0, 0.0), swing(9.0, 80.0, 0.0)];
    let found = [row.clone(), row].concat();
    let curve =
        |name, limits: [Option<f64>; 2]| Curve { name, assumptions: String::new(), met: 0, limits: limits.to_vec() };
    // The edge lies between 2 and 4 N.m/rad: at their geometric mean.
    let middle = 8f64.sqrt();
    let curves = Curves {
        over_x: true,
        curves: vec![
            curve("far", [Some(1.0), Some(1.0)]),
            curve("near", [Some(middle / 0.9), Some(middle / 0.9)]),
            curve("seldom", [Some(middle), None]),
        ],
    };
    let (name, ratio) = Edge::new(&map(), &found, Some(&curves), 0).nearest.expect("one is nearest");
    assert_eq!(name, "near");
    assert!((ratio - 0.9).abs() < 1e-12);
}

#[test]
fn a_map_without_an_edge_says_nothing_of_one() {
    let edge = Edge::new(&map(), &vec![rest(); 8], None, 0);
    assert_eq!((edge.places, edge.text(), edge.short()), (0, None, None));
}
