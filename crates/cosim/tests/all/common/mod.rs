//! Helpers of the tests of PHANToM scenes: dense runs, and the textbook's law in floats.

use hpu_cosim::scene::{PhantomLaw, PhantomScene, Platform, shipped};
use hpu_cosim::{Control, Driver, PhantomSimulation, Simulation, Summary, Wired};
use hpu_signal::{Cycle, Observe};

/// Returns a shipped scene with overrides.
pub fn phantom(name: &str, overrides: &[(&str, &str)]) -> PhantomScene {
    let overrides: Vec<_> = overrides.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    let scene = shipped().iter().find(|scene| scene.name == name).expect("a shipped scene");
    scene.parse(&overrides).unwrap_or_else(|error| panic!("{error}")).phantom().expect("a PHANToM")
}

/// Returns whether the force is computed outside the FPGA.
pub fn by_host(scene: &PhantomScene) -> bool {
    !matches!(scene.platform, Platform::Fpga(_)) || scene.model.law != PhantomLaw::Words
}

/// Every change of the nets, and every row of the plant.
#[derive(Default)]
pub struct Dense {
    /// Edges, and the words after them.
    pub changes: Vec<(u64, Vec<i64>)>,
    /// The rows.
    pub rows: Vec<Vec<f64>>,
    /// The last edge.
    pub end: u64,
}

impl Observe for Dense {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        if self.changes.last().is_none_or(|(_, last)| last != words) {
            self.changes.push((cycle.0, words.to_vec()));
        }
    }

    fn reals(&mut self, _: Cycle, values: &[f64]) {
        self.rows.push(values.to_vec());
    }
}

impl Dense {
    /// Returns the words after each edge, from edge 0 to the last.
    pub fn every_edge(&self) -> impl Iterator<Item = &[i64]> {
        let ends = self.changes.iter().skip(1).map(|(edge, _)| *edge).chain([self.end + 1]);
        self.changes.iter().zip(ends).flat_map(|((edge, words), end)| (*edge..end).map(move |_| words.as_slice()))
    }
}

/// Runs a scene from event to event.
pub fn run(scene: &PhantomScene) -> (Summary, Dense) {
    let simulation = PhantomSimulation::new(scene).unwrap_or_else(|error| panic!("{error}"));
    let mut dense = Dense::default();
    let summary = simulation.run(Driver::Events, &mut simulation.trace(&[]), &mut dense, &Control::default());
    dense.end = summary.edges;
    (summary, dense)
}

/// Returns the DAC counts that the walls of a scene ask for at these joint angles: from the equations of the paper's
/// kinematics, with the force limited to 8.5 N, and a count being 0.17 N.m / 2^15 at the motor.
pub fn law(scene: &PhantomScene, [t1, t2, t3]: [f64; 3]) -> [i64; 3] {
    let [l1, l2] = scene.drop.lengths_m;
    let (s1, c1, s2, c2, s3, c3) = (t1.sin(), t1.cos(), t2.sin(), t2.cos(), t3.sin(), t3.cos());
    let reach = l1 * c2 + l2 * s3;
    let tip = [s1 * reach, l2 - l2 * c3 + l1 * s2, c1 * reach - l1];
    let [fx, fy, fz] = [0, 1, 2].map(|axis| {
        let inside = tip[axis].clamp(-scene.room.distance_m, scene.room.distance_m);
        let there = if scene.room.walls[axis] { scene.room.stiffness_n_per_m } else { 0.0 };
        (there * (inside - tip[axis])).clamp(-8.5, 8.5)
    });
    let torques = [
        c1 * reach * fx - s1 * reach * fz,
        -l1 * s1 * s2 * fx + l1 * c2 * fy - l1 * c1 * s2 * fz,
        l2 * s1 * c3 * fx + l2 * s3 * fy + l2 * c1 * c3 * fz,
    ];
    let ratios = [115.0 / 15.0, 7.0, 7.0];
    [0, 1, 2].map(|joint| {
        let counts: f64 = torques[joint] / (0.17 * ratios[joint] / 32_768.0);
        counts.round().clamp(-32_768.0, 32_767.0) as i64
    })
}

/// Returns the joint angles of an arm of two links of the same length with its tip at `tip_m`.
pub fn angles_rad(length_m: f64, tip_m: &[f64]) -> [f64; 3] {
    // In the plane of the arm the base is at (-l, l) of the tip's origin; the links' triangle is isosceles.
    let ground = tip_m[0].hypot(tip_m[2] + length_m);
    let height = tip_m[1] - length_m;
    let half = 0.5 * ground.hypot(height);
    let upper = height.atan2(ground) + (half / length_m).acos();
    let fore = upper + 2.0 * (half / length_m).asin() - std::f64::consts::FRAC_PI_2;
    [tip_m[0].atan2(tip_m[2] + length_m), upper, fore]
}
