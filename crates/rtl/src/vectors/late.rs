//! Finds the place where the comparison of a closed loop begins: shortly before the wall is reached, so that the
//! comparison contains contact. A scene that has nothing to touch is compared from its begin.
//!
//! The emulator runs to the edge at which its datapath first sees the wall, then a second time to an edge before that.
//! The comparison starts there from the state of the world: the motion of the device, its encoders, the path of the
//! hand, the ramps of words. The FPGA, in VHDL and in the emulator alike, comes out of reset at that edge. It counts
//! positions from its reset, as in every scene. The `reference` of an axis is therefore the wall's position less the
//! counts passed until then. An arm's FPGA needs angles. Its encoders are turned, a count a clock, from the counts
//! at the scene's start to those of the arm, and the arm stands still until they get there.

use hpu_cosim::scene::{Experiment, Loop};
use hpu_cosim::{AnyWorld, Pins, Wired};
use hpu_signal::{Cycle, Format, Observe, Signal};

/// Number of edges compared, unless the user asks for another number.
const EDGES: u64 = 150_000;
/// Edges that any datapath needs to see a sampled contact, including the edges that lead to the sample.
const SETTLED: u64 = 1000;
/// Edges that the comparison begins ahead of a sample, so that it sees the sample.
const AHEAD: u64 = 64;

/// Returns the number of edges within which a datapath has seen the wall, wherever the comparison began, if the
/// datapath first sees it after `waits` edges.
fn least(waits: u64) -> u64 {
    waits + waits / 2 + SETTLED
}

/// Returns the number of edges for which a scene is compared, so that the comparison contains contact: 150 000, or more
/// where the position is sampled so seldom that 150 000 edges might not contain a sample.
pub fn comparison_edges(experiment: &Experiment) -> u64 {
    let waits = match experiment {
        Experiment::Axis(scene) if scene.method.kind == Loop::Conventional => scene.period_clocks(),
        _ => 0,
    };
    EDGES.max(least(waits)).min(experiment.edges())
}

/// The contact in a comparison.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Late {
    /// The edge of the scene at which the comparison begins, with the FPGA out of reset.
    pub from_edge: u64,
    /// The edge of the scene at which the datapath first sees the wall; `None` if it never sees it.
    pub reached: Option<u64>,
    /// Whether the comparison is long enough to contain contact.
    pub is_long: bool,
}

/// The state of a scene at the beginning of a comparison.
pub(crate) struct Begin<'s> {
    pub(crate) world: Box<dyn AnyWorld<'s> + 's>,
    pub(crate) input: Vec<i64>,
    pub(crate) homing: Option<Homing>,
    pub(crate) late: Option<Late>,
}

impl<'s> Begin<'s> {
    /// Finds the beginning of a comparison of `edges` edges in a scene with these nets.
    pub(crate) fn find(simulation: &'s impl Wired, nets: &[Signal], edges: u64) -> Self {
        let at = |name: &str| nets.iter().position(|net| net.name == name);
        let end = simulation.edges();
        let start = || {
            let mut run = simulation.closed_loop();
            if !simulation.gates_drive() {
                run.wiring_mut().rest_modulator();
            }
            run
        };
        let mut contact = Contact { nets: touching(nets), at: None };
        let mut run = start();
        let mut words = run.constants();
        if !simulation.has_contact() {
            return Self { world: run.world().copy(), input: words, homing: None, late: None };
        }
        while contact.at.is_none() && run.edge() < end && run.world().over().is_none() {
            run.leap(end, &mut contact);
        }
        // A position that is held shows the wall only when it is sampled.
        let waits = if at("held").is_some() { at("period").map_or(0, |net| words[net].unsigned_abs()) } else { 0 };
        let is_long = edges >= least(waits);
        let before = if is_long { (edges / 3).max(waits + AHEAD) } else { 0 };
        let from_edge = contact.at.map_or(0, |reached| reached.saturating_sub(before).min(end.saturating_sub(edges)));
        let late = Some(Late { from_edge, reached: contact.at, is_long });
        let mut run = start();
        if from_edge == 0 {
            return Self { world: run.world().copy(), input: words, homing: None, late };
        }
        while run.edge() < from_edge {
            run.leap(from_edge, &mut ());
        }
        let (now, mut homing) = (run.wiring().words(), None);
        match (at("reference"), at("position")) {
            (Some(reference), Some(position)) => {
                let passed = i128::from(words[reference]) - i128::from(now[position]);
                words[reference] = nets[reference].format.wrap(passed);
            }
            _ => homing = Some(Homing::to(nets, now)),
        }
        Self { world: run.world().copy(), input: words, homing, late }
    }
}

/// Returns the nets of which at least one is not 0 while a datapath sees the wall: the depth of an axis, the contact
/// with a room, the mode of a control that a touch switches, or the commands of a host, which pushes nowhere else.
pub(crate) fn touching(nets: &[Signal]) -> Vec<usize> {
    let of =
        |names: &[&str]| -> Vec<usize> { (0..nets.len()).filter(|&net| names.contains(&nets[net].name)).collect() };
    let all = [&["penetration"][..], &["contact"], &["mode"], &["host1", "host2", "host3"]];
    all.into_iter().map(of).find(|found| !found.is_empty()).unwrap_or_default()
}

/// Observes the first edge at which the datapath sees the wall.
struct Contact {
    nets: Vec<usize>,
    at: Option<u64>,
}

impl Observe for Contact {
    fn follows(&self, _: std::ops::Range<usize>) -> bool {
        false
    }

    #[inline]
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        if self.at.is_none() && self.nets.iter().any(|&net| words[net] != 0) {
            self.at = Some(cycle.0);
        }
    }

    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

/// Turns the encoders to the position of the device, while the device stands still.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Homing {
    /// For each encoder: the indices of its two lines among the inputs, and the count to reach.
    joints: Vec<(usize, usize, i64)>,
    /// Counts turned; below 0 while the decoders settle after reset.
    turned: i64,
}

/// Edges for the decoders to settle after reset, with a margin.
const SETTLE: i64 = 8;

impl Homing {
    /// Returns the homing to the positions of the counters.
    fn to(nets: &[Signal], words: &[i64]) -> Self {
        let at = |name: String| nets.iter().position(|net| net.name == name);
        let joint = |joint: usize| {
            let position = at(format!("position{joint}"))?;
            let signed = Format::signed(nets[position].format.width());
            Some((at(format!("a_pin{joint}"))?, at(format!("b_pin{joint}"))?, signed.wrap(words[position].into())))
        };
        Self { joints: (1..=3).filter_map(joint).collect(), turned: -SETTLE }
    }

    /// Returns the number of edges that the homing takes.
    pub(crate) fn edges(&self) -> u64 {
        let most = self.joints.iter().map(|joint| joint.2.unsigned_abs()).max().unwrap_or(0);
        most + SETTLE.unsigned_abs() + 1
    }

    /// Turns every encoder by one count, unless it has reached its position. Returns false when all have.
    pub(crate) fn turn(&mut self, input: &mut [i64]) -> bool {
        let turned = self.turned.max(0);
        for &(a, b, count) in &self.joints {
            Pins { a: input[a], b: input[b] } = Pins::at(count.clamp(-turned, turned));
        }
        self.turned += 1;
        self.joints.iter().any(|joint| joint.2.abs() >= turned) || turned == 0
    }
}
