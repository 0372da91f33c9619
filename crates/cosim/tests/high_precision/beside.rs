//! Two worlds of one scene, each in a loop of its own, compared at every edge that is ticked.

use std::fmt;

use hpu_cosim::scene::{Device, Experiment, Scene, shipped};
use hpu_cosim::{AxisSimulation, AxisWorld, ClosedLoop, Simulation, TheLoop, Wired, World, with_axis_loop};
use hpu_datapath::{LoopIn, LoopOut, Wiring};
use hpu_signal::{Cycle, Observe};

use crate::laws::Laws;
use crate::world::PreciseWorld;

/// The first difference between the registers of two loops: those of the expected loop, and those of the other.
#[derive(Debug)]
pub struct Difference {
    pub edges: [u64; 2],
    /// A net with its two words, unless only the edges differ.
    pub net: Option<(&'static str, [i64; 2])>,
    /// Distance from the angle to a limit of its count at the earlier edge.
    pub gap_rad: f64,
}

/// The result of a comparison.
#[derive(Debug)]
pub struct Outcome {
    /// Edges over which all agreed.
    pub edges: u64,
    /// The ticked ones of these edges; between them nothing changes.
    pub ticks: u64,
    /// Edges of the encoder's lines.
    pub crossings: u64,
    /// How often friction held the shaft, released it or turned against it, and diodes opened or closed.
    pub mode_changes: u64,
    /// Difference of the angles at the end.
    pub off_rad: f64,
    /// The least distance of a crossing from a clock edge, as a distance between angle and limit at that edge.
    pub nearest_rad: f64,
    pub difference: Option<Difference>,
}

impl Outcome {
    /// Returns the outcome of an empty comparison.
    pub fn none() -> Self {
        Self {
            edges: 0,
            ticks: 0,
            crossings: 0,
            mode_changes: 0,
            off_rad: 0.0,
            nearest_rad: f64::INFINITY,
            difference: None,
        }
    }

    /// Adds the figures of another run.
    pub fn add(&mut self, other: &Self) {
        self.edges += other.edges;
        self.ticks += other.ticks;
        self.crossings += other.crossings;
        self.mode_changes += other.mode_changes;
        self.off_rad = self.off_rad.max(other.off_rad);
        self.nearest_rad = self.nearest_rad.min(other.nearest_rad);
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { edges, ticks, crossings, mode_changes, nearest_rad, .. } = self;
        write!(f, "{edges:>12} {ticks:>10} {crossings:>10} {mode_changes:>10} {nearest_rad:>8.0e}")
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let edges = self.edges;
        match self.net {
            None => write!(f, "ticked at edge {}, not {}", edges[1], edges[0])?,
            Some((name, words)) => write!(f, "at edge {}, {name} is {}, not {}", edges[0], words[1], words[0])?,
        }
        write!(f, ", {:.1e} from the limit", self.gap_rad)
    }
}

/// Runs the first loop with the expected world and the second with the other, from tick to tick, to an edge or for a
/// number of ticks. Returns the first world both as before the last tick and at the end.
fn beside<E, O, W>(
    wiring: &W,
    expected: E,
    other: O,
    input: LoopIn<i64>,
    [end, ticks]: [u64; 2],
) -> (Outcome, [E; 2], O)
where
    E: World<In = LoopIn<i64>, Out = LoopOut<i64>>,
    O: World<In = LoopIn<i64>, Out = LoopOut<i64>>,
    W: Wiring<In<i64> = LoopIn<i64>, Out<i64> = LoopOut<i64>> + Clone,
{
    let mut expected = ClosedLoop::new(wiring.clone(), expected, input, u64::MAX);
    let mut other = ClosedLoop::new(wiring.clone(), other, input, u64::MAX);
    let mut outcome = Outcome::none();
    let mut before = expected.world.clone();
    while expected.edge() < end && expected.ticks() < ticks && outcome.difference.is_none() {
        before.clone_from(&expected.world);
        tick(&mut expected, end);
        tick(&mut other, end);
        let edges = [expected.edge(), other.edge()];
        let words = expected.wiring.words().iter().zip(other.wiring.words());
        let net = words
            .clone()
            .position(|(one, another)| one != another)
            .map(|index| (wiring.nets()[index].name, [expected.wiring.words()[index], other.wiring.words()[index]]));
        if edges[0] != edges[1] || net.is_some() {
            outcome.difference = Some(Difference { edges, net: net.filter(|_| edges[0] == edges[1]), gap_rad: 0.0 });
        } else {
            outcome.edges = edges[0];
        }
    }
    outcome.ticks = expected.ticks();
    let summary = expected.world.summary();
    (outcome.crossings, outcome.mode_changes) = (summary.encoder_edges, summary.mode_changes);
    let changes = [outcome.mode_changes, other.world.summary().mode_changes];
    if outcome.difference.is_none() && changes[0] != changes[1] {
        let net = Some(("the number of modes", changes.map(u64::cast_signed)));
        outcome.difference = Some(Difference { edges: [expected.edge(); 2], net, gap_rad: 0.0 });
    }
    (outcome, [before, expected.world], other.world)
}

/// An observer that follows every net, so that no edge is passed over.
struct Everything;

impl Observe for Everything {
    fn nets(&mut self, _: Cycle, _: &[i64]) {}
    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

/// Runs to the next edge that is ticked, or to the end.
fn tick<E: World, W: Wiring<In<i64> = E::In, Out<i64> = E::Out>>(run: &mut ClosedLoop<W, E>, end: u64) {
    let ticks = run.ticks();
    while run.ticks() == ticks && run.edge() < end {
        run.leap(end, &mut Everything);
    }
}

/// Evaluates an expression with the wiring of a simulation bound to a name, whatever its type.
macro_rules! with_wiring {
    ($simulation:expr, $wiring:ident => $call:expr) => {
        match $simulation.wiring() {
            TheLoop::Axis(axis_loop) => with_axis_loop!(axis_loop, $wiring => $call),
            TheLoop::Law($wiring) => $call,
            TheLoop::Device(_) | TheLoop::Floats(_) => panic!("an axis"),
        }
    };
}

/// Compares the engine's plant with the precise one, to the end of a scene or for a number of ticks.
pub fn engine_beside_precise(scene: &Scene, ticks: u64) -> Outcome {
    let simulation = AxisSimulation::new(scene).unwrap_or_else(|error| panic!("{}: {error}", scene.name));
    let laws = Laws::<4>::new(scene);
    let command = command(&simulation);
    let precise = PreciseWorld::new(&laws, command, simulation.words().schedule.clone());
    let shipped = AxisWorld::new(simulation.plant(), command, simulation.words().schedule.clone());
    with_wiring!(simulation, wiring => {
        let (mut outcome, [mut before, precise], shipped) =
            beside(wiring, precise, shipped, simulation.input(), [scene.edges(), ticks]);
        if let Some(difference) = &mut outcome.difference {
            let earlier = difference.edges[0].min(difference.edges[1]);
            while before.edge() < earlier {
                before.advance(earlier, |_, _| {});
            }
            difference.gap_rad = before.gap().float();
        }
        outcome.nearest_rad = precise.nearest;
        outcome.off_rad = (shipped.reals(shipped.edge())[2] - precise.angle().float()).abs();
        outcome
    })
}

/// Compares the precise plant in the same way with one of twice as many places.
pub fn precise_beside_twice_as_precise(scene: &Scene, ticks: u64) -> Outcome {
    let simulation = AxisSimulation::new(scene).unwrap_or_else(|error| panic!("{}: {error}", scene.name));
    let (laws, wide_laws) = (Laws::<4>::new(scene), Laws::<7>::new(scene));
    let (command, schedule) = (command(&simulation), simulation.words().schedule.clone());
    let (precise, wide) =
        (PreciseWorld::new(&laws, command, schedule.clone()), PreciseWorld::new(&wide_laws, command, schedule));
    with_wiring!(simulation, wiring => {
        let (mut outcome, [_, wide], precise) =
            beside(wiring, wide, precise, simulation.input(), [scene.edges(), ticks]);
        outcome.off_rad = (precise.angle().widened() - wide.angle()).abs().float();
        outcome
    })
}

/// Differences of outputs from those of the precise plant, in units of the last place of these.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Ulps {
    /// Values that differ.
    pub differing: u64,
    /// The greatest difference.
    pub most: f64,
}

/// The least size of a value that is compared: below, a unit of the last place is less than the plant's own rounding.
const LEAST: f64 = 1e-9;

/// Compares the engine's outputs with the precise plant's, half way between ticks. Returns the number of values, and
/// the differences of the outputs that verdicts read and of those that are shown.
pub fn outputs_beside_precise(scene: &Scene, ticks: u64) -> (u64, [Ulps; 2]) {
    let simulation = AxisSimulation::new(scene).unwrap_or_else(|error| panic!("{}: {error}", scene.name));
    let laws = Laws::<4>::new(scene);
    let (command, schedule, input) = (command(&simulation), simulation.words().schedule.clone(), simulation.input());
    let (mut values, mut off) = (0, [Ulps::default(); 2]);
    with_wiring!(simulation, wiring => {
        let precise = PreciseWorld::new(&laws, command, schedule.clone());
        let mut precise = ClosedLoop::new(wiring.clone(), precise, input, u64::MAX);
        let shipped = AxisWorld::new(simulation.plant(), command, schedule.clone());
        let mut shipped = ClosedLoop::new(wiring.clone(), shipped, input, u64::MAX);
        while precise.ticks() < ticks && precise.edge() < scene.edges() {
            let (mut before, mut own) = (precise.world.clone(), shipped.world.clone());
            let edge = precise.edge();
            tick(&mut precise, scene.edges());
            tick(&mut shipped, scene.edges());
            assert_eq!(precise.edge(), shipped.edge(), "{}", scene.name);
            let middle = edge + (precise.edge() - edge) / 2;
            while before.edge() < middle {
                before.advance(middle, |_, _| {});
            }
            while own.edge() < middle {
                own.advance(middle, |_, _| {});
            }
            let (read, shown) = (own.reals(middle), own.exact(middle));
            let outputs = before.outputs(middle).into_iter().enumerate();
            for (index, value) in outputs.filter(|(_, value)| value.float().abs() > LEAST) {
                values += 1;
                let value = value.nearest();
                let ulp = value.abs().next_up() - value.abs();
                for (ulps, found) in off.iter_mut().zip([read[index], shown[index]]) {
                    ulps.differing += u64::from(found != value);
                    ulps.most = ulps.most.max((found - value).abs() / ulp);
                }
            }
        }
    });
    (values, off)
}

fn command(simulation: &AxisSimulation) -> usize {
    simulation.nets().iter().position(|net| net.name == "command").expect("a haptic loop has a command")
}

/// Returns the shipped scenes of a motor or a mass.
pub fn axis_scenes() -> Vec<Scene> {
    let parsed = |scene: &hpu_cosim::scene::Shipped| scene.parse(&[]).unwrap_or_else(|error| panic!("{error}"));
    let is_alone = |scene: &Scene| scene.network.is_none();
    shipped().iter().map(parsed).filter_map(Experiment::axis).filter(is_alone).collect()
}

/// Returns the scene with its start this many counts further on.
pub fn begun_at(mut scene: Scene, counts: f64) -> Scene {
    let ahead = counts * scene.encoder.count_rad();
    match &mut scene.device {
        Device::Motor(motor) => motor.initial_angle_rad += ahead,
        Device::Mass(mass) => mass.initial_position_m += ahead,
    }
    scene
}
