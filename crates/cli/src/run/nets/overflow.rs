//! The first edges at which nets had overflowed.

use std::collections::BTreeMap;

use hpu_cosim::{Simulation, Wired, WiredSimulation};
use hpu_datapath::AnyWiring;

/// The first edges at which nets had overflowed, by the indices of the nets.
#[derive(Default)]
pub(crate) struct Overflows(BTreeMap<usize, u64>);

impl Overflows {
    /// Looks at a wiring that has just come to an edge. It must be called after each leap of a loop: a net begins to
    /// overflow at an edge that is ticked, and its count since then tells that edge.
    pub fn see(&mut self, wiring: &dyn AnyWiring, edge: u64) {
        for (net, usage) in wiring.uses().iter().enumerate().filter(|(_, usage)| usage.overflowed > 0) {
            self.0.entry(net).or_insert((edge + 1).saturating_sub(usage.overflowed));
        }
    }

    /// Returns the net that had overflowed first, and the edge.
    pub fn first(&self) -> Option<(usize, u64)> {
        self.0.iter().map(|(net, edge)| (*net, *edge)).min_by_key(|(_, edge)| *edge)
    }

    /// Runs a scene up to the first overflow, and returns its net and edge.
    pub fn find(simulation: &WiredSimulation) -> Option<(usize, u64)> {
        let mut running = simulation.closed_loop();
        let mut found = Self::default();
        while running.edge() < simulation.edges() && running.world().over().is_none() {
            running.leap(simulation.edges(), &mut ());
            found.see(running.wiring(), running.edge());
            if let Some(first) = found.first() {
                return Some(first);
            }
        }
        None
    }
}
