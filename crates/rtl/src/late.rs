//! Where a comparison of a closed loop begins: shortly before the wall is reached, so that it contains contact.
//!
//! The emulator runs to the edge at which its datapath first sees the wall, and once more to an edge before that. There
//! the world stands as it is: the device in its motion, its encoders, the hand on its path, the ramps of words. The
//! FPGA, in VHDL and in the emulator alike, comes out of reset at that moment. It counts from where it is reset, as in
//! every scene; so an axis's `reference` is the wall's position less the counts passed until then. A PHANToM's FPGA
//! needs angles: its encoders are turned, a count a clock, from the counts of the scene's start to those of the arm,
//! which stands still until they are.

use hpu_cosim::scene::{Experiment, Loop};
use hpu_cosim::{ClosedLoop, Pins, World};
use hpu_datapath::{Wiring, flatten};
use hpu_signal::{Cycle, Format, Observe, Ports, Signal};

/// Edges that are compared where nothing else is asked for.
const EDGES: u64 = 150_000;
/// Edges that any datapath takes to see what its sample took, and those that lead to the sample.
const SETTLED: u64 = 1000;
/// What an edge is ahead of the next sample for the sample to be seen.
const AHEAD: u64 = 64;

/// Edges within which a datapath that first sees the wall after `waits` edges has seen it, wherever it began.
fn least(waits: u64) -> u64 {
    waits + waits / 2 + SETTLED
}

/// The edges that a comparison of a scene takes for contact to be among them: 150 000, or more where the position is
/// sampled so seldom that they might hold no sample.
#[must_use]
pub fn comparison_edges(experiment: &Experiment) -> u64 {
    let waits = match experiment {
        Experiment::Axis(scene) if scene.method.kind == Loop::Conventional => scene.period_clocks(),
        _ => 0,
    };
    EDGES.max(least(waits)).min(experiment.edges())
}

/// What a comparison knows of contact.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Late {
    /// The edge of the scene at which the comparison begins, with the FPGA out of reset.
    pub from_edge: u64,
    /// The edge of the scene at which the datapath first sees the wall; `None` when it never does.
    pub reached: Option<u64>,
    /// Whether the comparison is long enough to contain contact.
    pub is_long: bool,
}

/// The state of a scene at the beginning of a comparison.
pub(crate) struct Begin<E: World> {
    pub(crate) world: E,
    pub(crate) input: E::In,
    pub(crate) homing: Option<Homing>,
    pub(crate) late: Late,
}

impl<E: World> Begin<E> {
    /// Looks for it, for a comparison of so many edges of a scene of so many.
    pub(crate) fn find<W>(wiring: &W, world: &E, input: E::In, (edges, end): (u64, u64), modulated: bool) -> Self
    where
        W: Wiring<In<i64> = E::In, Out<i64> = E::Out> + Clone,
    {
        let nets = wiring.nets();
        let at = |name: &str| nets.iter().position(|net| net.name == name);
        let start = || {
            let mut wiring = wiring.clone();
            if !modulated {
                wiring.rest_modulator();
            }
            ClosedLoop::new(wiring, world.clone(), input, u64::MAX)
        };
        let mut contact = Contact { nets: touching(&nets), at: None };
        let mut run = start();
        while contact.at.is_none() && run.edge() < end && run.world.over().is_none() {
            run.leap(end, &mut contact);
        }
        // A position that is held shows the wall only at its samples.
        let words = flatten(&input);
        let waits = if at("held").is_some() { at("period").map_or(0, |net| words[net].unsigned_abs()) } else { 0 };
        let is_long = edges >= least(waits);
        let before = if is_long { (edges / 3).max(waits + AHEAD) } else { 0 };
        let from_edge = contact.at.map_or(0, |reached| reached.saturating_sub(before).min(end.saturating_sub(edges)));
        let late = Late { from_edge, reached: contact.at, is_long };
        if from_edge == 0 {
            return Self { world: world.clone(), input, homing: None, late };
        }
        let mut run = start();
        while run.edge() < from_edge {
            run.leap(from_edge, &mut ());
        }
        let now = run.wiring.words();
        let (mut words, mut homing) = (words, None);
        match (at("reference"), at("position")) {
            (Some(reference), Some(position)) => {
                let passed = i128::from(words[reference]) - i128::from(now[position]);
                words[reference] = nets[reference].format.wrap(passed);
            }
            _ => homing = Some(Homing::to(&nets, now)),
        }
        let mut next = words.into_iter();
        let input = E::In::build(|| next.next().expect("as many words as ports"));
        Self { world: run.world, input, homing, late }
    }
}

/// The nets of which one is not 0 where a datapath sees the wall: the depth of an axis, the room's contact, or the
/// commands of a host, which pushes nowhere else.
pub(crate) fn touching(nets: &[Signal]) -> Vec<usize> {
    let of =
        |names: &[&str]| -> Vec<usize> { (0..nets.len()).filter(|&net| names.contains(&nets[net].name)).collect() };
    let all = [&["penetration"][..], &["contact"], &["host1", "host2", "host3"]];
    all.into_iter().map(of).find(|found| !found.is_empty()).unwrap_or_default()
}

/// Looks for the first edge at which the wall is seen.
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

/// Encoders that are turned to where they are, while the device stands still.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Homing {
    /// Of each encoder the places of its lines among the inputs, and the count to come to.
    joints: Vec<(usize, usize, i64)>,
    /// Counts turned; below zero while the decoders settle after reset.
    turned: i64,
}

/// Edges that decoders take to settle after reset, and more.
const SETTLE: i64 = 8;

impl Homing {
    /// To the positions that counters have.
    fn to(nets: &[Signal], words: &[i64]) -> Self {
        let at = |name: String| nets.iter().position(|net| net.name == name);
        let joint = |joint: usize| {
            let position = at(format!("position{joint}"))?;
            let signed = Format::signed(nets[position].format.width());
            Some((at(format!("a_pin{joint}"))?, at(format!("b_pin{joint}"))?, signed.wrap(words[position].into())))
        };
        Self { joints: (1..=3).filter_map(joint).collect(), turned: -SETTLE }
    }

    /// Edges that it takes.
    pub(crate) fn edges(&self) -> u64 {
        let most = self.joints.iter().map(|joint| joint.2.unsigned_abs()).max().unwrap_or(0);
        most + SETTLE.unsigned_abs() + 1
    }

    /// Turns every encoder by a count, unless it is there; false when all are.
    pub(crate) fn turn(&mut self, input: &mut [i64]) -> bool {
        let turned = self.turned.max(0);
        for &(a, b, count) in &self.joints {
            Pins { a: input[a], b: input[b] } = Pins::at(count.clamp(-turned, turned));
        }
        self.turned += 1;
        self.joints.iter().any(|joint| joint.2.abs() >= turned) || turned == 0
    }
}
