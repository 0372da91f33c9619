//! An arm with three encoders, and motors behind DACs, at one clock edge. The world of a device joins it to the ports
//! of the device's loop.

use hpu_plant::arm::{Arm, ArmModel, ArmState as MotionState, Links};
use hpu_plant::{Band, Method, Pace};

use crate::result::columns::three;
use crate::result::summary::{EnergyAudit, Summary};
use crate::world::arm_body::ArmBody;
use crate::world::encoder::Encoder;
use hpu_scene::MOST_EDGES;

/// Returns why a run must be aborted at these counts, or `None`.
pub(crate) type Stops = Box<dyn Fn([i64; 3]) -> Option<&'static str> + Send + Sync>;

/// The immutable laws of an arm's world.
pub(crate) struct ArmPlant<L = ArmModel> {
    pub(crate) arm: Arm<L>,
    /// The method and the clock edges of a step, if the arm is stepped.
    pub(crate) stepping: Option<(Method, u64)>,
    /// Angle of one count of each joint, in rad; infinite where no encoder counts.
    pub(crate) count_rad: [f64; 3],
    /// Torque of one count of each joint's DAC, in N·m.
    pub(crate) command_nm: [f64; 3],
    /// Angles and speeds at the start, in rad and rad/s.
    pub(crate) start_rad: [f64; 3],
    pub(crate) start_rad_per_s: [f64; 3],
    /// The counts at which the device's test must be aborted.
    pub(crate) stops: Stops,
}

impl<L: Links> ArmPlant<L> {
    /// Returns the joints' angles at these counts.
    fn angles_rad(&self, counts: [i64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|joint| counts[joint] as f64 * self.count_rad[joint])
    }

    /// Returns the tip's position at these counts.
    fn logged_m(&self, counts: [i64; 3]) -> [f64; 3] {
        self.arm.tip_m(self.angles_rad(counts))
    }
}

/// The arm and its encoders, at one clock edge.
#[derive(Clone)]
pub(crate) struct ArmState<'p, L: Links = ArmModel> {
    pub(crate) plant: &'p ArmPlant<L>,
    pub(crate) motion: ArmBody<'p, L>,
    encoders: [Encoder; 3],
    pub(crate) edge: u64,
    /// The edge of the motion's next event if the drive does not change before it.
    ahead: Option<u64>,
    pub(crate) command: [i64; 3],
    /// Crossings too near a clock edge to be decided in plain `f64`.
    redecided: u64,
    /// Why the run cannot go on, if it cannot.
    pub(crate) over: Option<&'static str>,
}

impl<'p, L: Links> ArmState<'p, L> {
    pub(crate) fn new(plant: &'p ArmPlant<L>) -> Self {
        let encoder = |i: usize| Encoder::new(plant.count_rad[i], plant.start_rad[i]);
        Self {
            plant,
            motion: ArmBody::new(&plant.arm, plant.stepping, plant.start_rad, plant.start_rad_per_s),
            encoders: [encoder(0), encoder(1), encoder(2)],
            edge: 0,
            ahead: None,
            command: [0; 3],
            redecided: 0,
            over: None,
        }
    }

    pub(crate) fn counts(&self) -> [i64; 3] {
        [0, 1, 2].map(|i| self.encoders[i].count())
    }

    pub(crate) fn pins(&self) -> [i64; 6] {
        let [first, second, third] = [0, 1, 2].map(|i| self.encoders[i].pins());
        [first.a, first.b, second.a, second.b, third.a, third.b]
    }

    fn bands(&self) -> [Band; 3] {
        [0, 1, 2].map(|i| self.encoders[i].band())
    }

    /// Tells the encoders their present angles.
    #[inline]
    fn sense(&mut self, angles_rad: [f64; 3]) {
        let mut changed = false;
        for (joint, angle_rad) in angles_rad.into_iter().enumerate() {
            let encoder = &mut self.encoders[joint];
            let left = encoder.band();
            if encoder.sense(angle_rad) {
                changed = true;
                let limit_rad = if angle_rad < left.low { left.low } else { left.high };
                self.redecided += u64::from(self.motion.is_near(self.edge, joint, limit_rad));
            }
        }
        if changed {
            self.watch();
        }
    }

    /// Decides whether the test must be aborted. Called at every change of a count.
    #[cold]
    fn watch(&mut self) {
        let (plant, counts) = (self.plant, self.counts());
        if self.encoders.iter().any(|encoder| encoder.over().is_some()) {
            self.over = Some("the arm passed a singular pose, where its motion is not defined");
        } else if let Some(why) = (plant.stops)(counts) {
            self.over = Some(why);
        }
    }

    /// Returns the edge of the arm's next event, up to `limit`.
    pub(crate) fn next(&mut self, limit: u64) -> u64 {
        let ahead = match self.ahead {
            Some(ahead) => ahead,
            None => self.motion.next_event(self.edge, MOST_EDGES, &self.bands()).unwrap_or(MOST_EDGES),
        };
        self.ahead = Some(ahead);
        ahead.min(limit)
    }

    /// Moves the arm to an edge.
    pub(crate) fn go(&mut self, edge: u64) {
        self.edge = edge;
        if self.ahead.is_some_and(|ahead| ahead <= edge) {
            self.ahead = None;
        }
        let angles_rad = self.motion.step(edge);
        self.sense(angles_rad);
        if let Some(why) = self.motion.over() {
            self.over = Some(why);
        }
    }

    pub(crate) fn drive(&mut self, command: [i64; 3]) {
        if command != self.command {
            self.command = command;
            self.ahead = None;
            let torque = |i: usize| command[i] as f64 * self.plant.command_nm[i];
            self.motion.drive(self.edge, [torque(0), torque(1), torque(2)]);
        }
    }

    /// Tells the finger from the present edge on where its pad is at rest, and how fast it moves.
    pub(crate) fn press(&mut self, target_m: f64, speed_m_per_s: f64) {
        self.ahead = None;
        self.motion.press(self.edge, target_m, speed_m_per_s);
    }

    /// Moves to an edge before which only the encoders change, and returns the continuous outputs there.
    pub(crate) fn pass(&mut self, edge: u64) -> [f64; 9] {
        self.edge = edge;
        let state = self.motion.state(edge);
        self.sense(state.motor_angles_rad);
        self.shown(&state)
    }

    pub(crate) fn reals(&self, edge: u64) -> [f64; 9] {
        self.shown(&self.motion.state(edge))
    }

    /// Gathers from now on mean and extremes of the torques for the rows; a DAC has no modulator.
    pub(crate) fn measure(&mut self, stride: u64) {
        self.motion.measure(Pace { stride, period: None });
    }

    /// Appends mean, least and greatest torques to a row.
    pub(crate) fn measured(&self, edge: u64, row: &mut Vec<f64>) {
        for measured in self.motion.measured(edge).iter().flatten() {
            row.extend(three(measured, 1.0));
        }
    }

    fn shown(&self, state: &MotionState) -> [f64; 9] {
        let tip = self.plant.arm.tip_m(state.angles_rad);
        let logged = self.plant.logged_m(self.counts());
        let [t1, t2, t3] = state.torques_nm;
        [tip[0], tip[1], tip[2], logged[0], logged[1], logged[2], t1, t2, t3]
    }

    /// Returns the arm's part of a run's summary.
    pub(crate) fn summary(&self) -> Summary {
        let energy = self.motion.energy(self.edge);
        let stored_j = self.motion.stored_j(self.edge);
        let dissipated_j = energy.viscous_j + energy.coulomb_j + energy.transmission_j;
        let energy = EnergyAudit {
            source_j: energy.source_j,
            hand_j: energy.finger_j,
            supplied_j: energy.source_j + energy.finger_j,
            stored_j,
            viscous_j: energy.viscous_j,
            coulomb_j: energy.coulomb_j,
            transmission_j: energy.transmission_j,
            dissipated_j,
            exchanged_j: energy.exchanged_j,
            residual_j: energy.source_j + energy.finger_j - stored_j - dissipated_j,
            ..EnergyAudit::default()
        };
        Summary {
            encoder_edges: self.encoders.iter().map(|encoder| encoder.edges).sum(),
            mode_changes: self.motion.mode_changes(),
            steps: self.motion.steps(),
            redecided: self.redecided,
            energy,
            ..Summary::default()
        }
    }
}
