//! The side of a gimbal's world: servos on a bus, the converter of the force, the host that writes the target, and the
//! finger's motion.
//!
//! All of them act at instants of their own, each at whole multiples of its period. At an instant of the bus, the
//! positions of all servos are read, and the drives of pitch and roll are taken as the datapath shows them before that
//! edge. The crank's servo takes its drive at the instants of its pulses. So a drive is late by up to a period.

use hpu_datapath::gimbal::{GimbalIn, GimbalOut};
use hpu_plant::arm::{Gimbal, Links};
use hpu_signal::{Cycle, Real};

use super::GIMBAL_REALS;
use crate::world::arm::ArmState;
use crate::world::arm_world::Side;
use hpu_scene::SplitMix64;
use hpu_scene::{Displacement, GimbalScene, along};

/// The things that act at instants of their own, by their index.
const HOST: usize = 0;
const BUS: usize = 1;
const PULSE: usize = 2;
const FORCE: usize = 3;
const FINGER: usize = 4;

/// The immutable part of a side.
pub(super) struct Plan<'s> {
    scene: &'s GimbalScene,
    /// Clock edges from one instant to the next of host, bus, pulses and converter.
    periods: [u64; 4],
    /// Edges at which the finger's speed changes.
    knots: Vec<u64>,
    least_radius_m: f64,
    count_rad: f64,
    /// The displacement that a shear stress asks for, in the target's place along x.
    displacement: Option<Displacement>,
}

impl<'s> Plan<'s> {
    pub(super) fn new(scene: &'s GimbalScene) -> Self {
        let rates_hz =
            [scene.target.rate_hz, scene.tilt_servo.rate_hz, scene.crank_servo.rate_hz, scene.force_sensor.rate_hz];
        let knots = scene.probe.iter().flat_map(|probe| &probe.path).map(|point| scene.clock.edges(point.0));
        Self {
            scene,
            periods: rates_hz.map(|rate_hz| scene.clock.edges(1.0 / rate_hz).max(1)),
            knots: knots.filter(|edge| *edge > 0).collect(),
            least_radius_m: scene.gimbal.radii_m()[0],
            count_rad: scene.count_rad(),
            displacement: scene.displacement(),
        }
    }

    fn time_s(&self, edge: u64) -> f64 {
        self.scene.clock.seconds(Cycle(edge))
    }

    /// Returns the target that the host writes at an edge.
    fn target_m(&self, edge: u64) -> [f64; 3] {
        self.scene.tip_m(self.scene.target.at(self.time_s(edge)))
    }

    /// Returns the place at which the tip has to be when the host writes this target.
    fn asked_m(&self, edge: u64, [x_m, y_m, z_m]: [f64; 3]) -> [f64; 3] {
        [self.displacement.as_ref().map_or(x_m, |displacement| displacement.at(self.time_s(edge))), y_m, z_m]
    }

    /// Returns the height of the finger's pad above the centre of the gimbal, and its speed.
    fn finger(&self, edge: u64) -> Option<[f64; 2]> {
        let probe = self.scene.probe.as_ref()?;
        // Just after the edge, so that a knot begins the stretch after it.
        let [height_m, speed] = along(&probe.path, self.time_s(edge) + 0.5 * self.scene.clock.period_s());
        Some([self.least_radius_m + height_m - speed * 0.5 * self.scene.clock.period_s(), speed])
    }
}

/// Returns why a run ends in a posture in which the model does not hold; `None` elsewhere.
fn beyond([pitch_rad, roll_rad, crank_rad]: [f64; 3]) -> Option<&'static str> {
    if pitch_rad.abs().max(roll_rad.abs()) > Gimbal::TILT_RAD {
        Some("the segment tilted by more than 55 degrees, where the gimbal ends")
    } else if !(0.0..=std::f64::consts::PI).contains(&crank_rad) {
        Some("the crank passed a dead centre, behind which position control drives it the wrong way")
    } else {
        None
    }
}

/// See the [module](self).
#[derive(Clone)]
pub(super) struct GimbalSide<'p> {
    plan: &'p Plan<'p>,
    random: SplitMix64,
    /// The edges of the next instants.
    next: [u64; 5],
    due: u64,
    /// The words that the datapath reads: positions, target, force.
    counts: [i64; 3],
    target: [i64; 3],
    force: i64,
    /// The place at which the tip has to be.
    asked_m: [f64; 3],
    /// The drives that the datapath shows, and those that the servos follow.
    shown: [i64; 3],
    drives: [i64; 3],
}

impl<'p> GimbalSide<'p> {
    /// Creates the side at edge 0. The first instants are at edge 1: all words are there before the first sample.
    pub(super) fn new(plan: &'p Plan<'p>) -> Self {
        let mut side = Self {
            plan,
            random: SplitMix64::new(plan.scene.run.seed),
            next: [1; 5],
            due: 1,
            counts: [0; 3],
            target: [0; 3],
            force: 0,
            asked_m: plan.asked_m(0, plan.target_m(0)),
            shown: [0; 3],
            drives: [0; 3],
        };
        side.target = side.words(plan.target_m(0));
        side
    }

    /// Returns the words of a target.
    fn words(&self, target_m: [f64; 3]) -> [i64; 3] {
        let length = self.plan.scene.method.config.gimbal.length;
        target_m
            .map(|length_m| (length_m / length.lsb()).round().clamp(length.min() as f64, length.max() as f64) as i64)
    }

    /// Returns the word of a force with noise.
    fn converted(&mut self, force_n: f64) -> i64 {
        let mut unit = || (self.random.below(1 << 53) + 1) as f64 / (1u64 << 53) as f64;
        // Box and Muller's normal number, of two uniform ones.
        let (far, turn) = (unit(), unit());
        let normal = libm::sqrt(-2.0 * libm::log(far)) * libm::cos(std::f64::consts::TAU * turn);
        let scene = self.plan.scene;
        let most = (1i64 << scene.method.config.impedance.force_width) - 1;
        ((force_n + scene.force_sensor.noise_n * normal) / scene.force_lsb_n()).round().clamp(0.0, most as f64) as i64
    }

    fn work<L: Links>(&mut self, arm: &mut ArmState<L>) {
        let edge = arm.edge;
        for index in [HOST, BUS, PULSE, FORCE] {
            if self.next[index] > edge {
                continue;
            }
            self.next[index] = (edge / self.plan.periods[index] + 1) * self.plan.periods[index];
            match index {
                HOST => {
                    let target_m = self.plan.target_m(edge);
                    self.asked_m = self.plan.asked_m(edge, target_m);
                    self.target = self.words(target_m);
                }
                BUS => {
                    let angles_rad = arm.motion.state(edge).motor_angles_rad;
                    self.counts = angles_rad.map(|angle_rad| (angle_rad / self.plan.count_rad).round() as i64);
                    arm.over = arm.over.or_else(|| beyond(angles_rad));
                    [self.drives[0], self.drives[1], _] = self.shown;
                }
                PULSE => self.drives[2] = self.shown[2],
                _ => self.force = self.converted(arm.motion.state(edge).finger_n),
            }
        }
        arm.drive(self.drives);
        if self.next[FINGER] <= edge {
            if let Some([height_m, speed]) = self.plan.finger(edge) {
                arm.press(height_m, speed);
            }
            self.next[FINGER] = self.plan.knots.iter().copied().find(|knot| *knot > edge).unwrap_or(u64::MAX);
        }
        self.due = self.next.into_iter().min().expect("five");
    }
}

impl Side for GimbalSide<'_> {
    type In = GimbalIn<i64>;
    type Out = GimbalOut<i64>;
    type Row = [f64; GIMBAL_REALS.len()];
    const REALS: &'static [Real] = &GIMBAL_REALS;

    #[inline]
    fn due(&self) -> u64 {
        self.due
    }

    #[inline]
    fn act<L: Links>(&mut self, arm: &mut ArmState<L>) {
        if self.due <= arm.edge {
            self.work(arm);
        }
    }

    #[inline]
    fn place<L: Links>(&self, _: &ArmState<L>, input: &mut GimbalIn<i64>) {
        [input.count1, input.count2, input.count3] = self.counts;
        [input.x, input.y, input.z] = self.target;
        input.finger_force = self.force;
    }

    #[inline]
    fn drive(&mut self, out: GimbalOut<i64>) -> [i64; 3] {
        self.shown = [out.drive1, out.drive2, out.drive3];
        self.drives
    }

    fn row<L: Links>(&self, arm: &ArmState<L>, edge: u64) -> Self::Row {
        let state = arm.motion.state(edge);
        let tip = arm.plant.arm.tip_m(state.angles_rad);
        let [x, y, z] = self.asked_m;
        let [t1, t2, t3] = state.torques_nm;
        let radius_m = libm::hypot(tip[0], libm::hypot(tip[1], tip[2]));
        let error_m = libm::hypot(tip[0] - x, libm::hypot(tip[1] - y, tip[2] - z));
        let finger_m = self.plan.finger(edge).map_or(0.0, |finger| finger[0]);
        let stress_pa = |x_m| self.plan.scene.shear.map_or(0.0, |shear| shear.stress_pa(x_m));
        let [asked_pa, rendered_pa] = [x, tip[0]].map(stress_pa);
        let finger_n = state.finger_n;
        [tip[0], tip[1], tip[2], x, y, z, t1, t2, t3, radius_m, error_m, finger_n, finger_m, asked_pa, rendered_pa]
    }
}
