//! Observers compose: as pairs, behind references, and where one may be missing.

use std::ops::Range;

use hpu_signal::{Cycle, Observe};

/// An observer that reads one column of means, if any, and keeps the edges of what it is shown.
#[derive(Default, PartialEq, Debug)]
struct Seen {
    column: Option<usize>,
    edges: Vec<u64>,
}

impl Observe for Seen {
    fn nets(&mut self, cycle: Cycle, _: &[i64]) {
        self.edges.push(cycle.0);
    }
    fn reals(&mut self, cycle: Cycle, _: &[f64]) {
        self.edges.push(100 + cycle.0);
    }
    fn measures(&self) -> bool {
        self.column.is_some()
    }
    fn follows(&self, nets: Range<usize>) -> bool {
        nets.contains(&7)
    }
}

fn shown(observer: &mut impl Observe) {
    observer.nets(Cycle(1), &[0]);
    observer.block(Cycle(2), 3, 1, &[0.0, 0.0]);
    observer.still(Cycle(8), 3, 1, &[0.0]);
}

#[test]
fn both_of_a_pair_and_one_behind_a_reference_see_what_an_observer_alone_sees() {
    let mut alone = Seen::default();
    shown(&mut alone);
    assert_eq!(alone.edges, [1, 102, 105, 108]);
    let mut one = Seen::default();
    let mut pair = (&mut one as &mut dyn Observe, (Some(Seen::default()), None::<Seen>));
    shown(&mut pair);
    assert_eq!(pair.1, (Some(Seen { edges: alone.edges.clone(), column: None }), None));
    assert_eq!(one, alone);
}

#[test]
fn a_pair_asks_for_what_either_of_it_looks_at() {
    let measures = Seen { column: Some(2), ..Seen::default() };
    let pair = (Seen::default(), (measures, ()));
    assert!(pair.watches() && pair.measures() && pair.reads(2..3));
    assert!(pair.follows(7..8) && !pair.follows(0..7));
    // An observer without means and extremes reads none of their columns, whatever it answers.
    assert!(!(Seen::default(), ()).reads(0..9));
    assert!(!((), None::<Seen>).watches() && !((), ()).relates());
}
