//! Both drivers side by side.

use hpu_datapath::Wiring;
use hpu_signal::{Cycle, Observe};

use super::ClosedLoop;
use crate::world::World;

/// An observer that asks for everything and ignores it.
struct Everything;

impl Observe for Everything {
    fn nets(&mut self, _: Cycle, _: &[i64]) {}
    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

/// Where two drivers first differed.
#[derive(Clone, PartialEq, Debug)]
pub struct Difference {
    /// The edge.
    pub edge: u64,
    /// The net or plant state.
    pub name: &'static str,
    /// Its value under `events`.
    pub events: f64,
    /// Its value under `clock`.
    pub clock: f64,
}

/// The result of a comparison of drivers.
#[derive(Clone, PartialEq, Debug)]
pub struct Comparison {
    /// Edges compared.
    pub edges: u64,
    /// Words and plant states that differed, over all edges.
    pub mismatches: u64,
    /// The first difference.
    pub first: Option<Difference>,
}

/// Runs `events` and `clock` side by side and compares every net, and every state of the plant bit by bit, at every
/// edge.
pub fn compare<E, W>(wiring: W, world: E, input: E::In, edges: u64) -> Comparison
where
    E: World,
    W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone,
{
    let nets = wiring.nets();
    let mut events = ClosedLoop::new(wiring.clone(), world.clone(), input, u64::MAX);
    let mut clock = ClosedLoop::new(wiring, world, input, u64::MAX);
    let mut found = Comparison { edges, mismatches: 0, first: None };
    let mut note = |edge, name, events: f64, clock: f64| {
        found.mismatches += 1;
        found.first.get_or_insert(Difference { edge, name, events, clock });
    };
    let mut before = (events.world.clone(), events.wiring.words().to_vec());
    for edge in 1..=edges {
        if clock.world.over().is_some() {
            found.edges = edge - 1;
            break;
        }
        clock.step(&mut ());
        while events.world.edge() < edge {
            before.0.clone_from(&events.world);
            before.1.copy_from_slice(events.wiring.words());
            events.leap(edges, &mut Everything);
        }
        // Between its events the leaping loop has the words of before the leap; its world is flowed on from there.
        let words = if events.edge() <= edge { events.wiring.words() } else { &before.1 };
        for ((net, &leapt), &stepped) in nets.iter().zip(words).zip(clock.wiring.words()) {
            if leapt != stepped {
                note(edge, net.name, leapt as f64, stepped as f64);
            }
        }
        let leapt = if events.world.edge() == edge { events.world.reals(edge) } else { before.0.reals(edge) };
        let clocked = clock.world.reals(edge);
        for (real, (&x, &y)) in E::REALS.iter().zip(leapt.as_ref().iter().zip(clocked.as_ref())) {
            if x.to_bits() != y.to_bits() {
                note(edge, real.name, x, y);
            }
        }
    }
    let (leapt, stepped) = (events.world.summary().energy, clock.world.summary().energy);
    // Compared as text, where NaN equals itself: an arm that passed a singular pose has no energy.
    if format!("{leapt:?}") != format!("{stepped:?}") {
        note(edges, "energy_j", leapt.exchanged_j, stepped.exchanged_j);
    }
    found
}
