//! The world of a PHANToM: the arm with its three encoders, motors behind DACs, and, on some platforms, a host
//! computer.

use hpu_datapath::phantom::{PhantomIn, PhantomIoIn, PhantomIoOut, PhantomOut};
use hpu_plant::arm::{Arm, ArmState as MotionState, kinematics};
use hpu_plant::{Band, Method, Pace};
use hpu_signal::Real;

use crate::arm_body::ArmBody;
use crate::columns::three;
use crate::encoder::Encoder;
use crate::host::{Host, HostState};
use crate::scene::MOST_EDGES;
use crate::summary::EnergyAudit;
use crate::world::World;

/// The continuous outputs of a PHANToM.
pub const ARM_REALS: [Real; 9] = [
    Real { name: "tip_x_m", doc: "Position of the tip" },
    Real { name: "tip_y_m", doc: "Position of the tip" },
    Real { name: "tip_z_m", doc: "Position of the tip" },
    Real { name: "logged_x_m", doc: "Position of the tip, as the encoders' counts tell it" },
    Real { name: "logged_y_m", doc: "Position of the tip, as the encoders' counts tell it" },
    Real { name: "logged_z_m", doc: "Position of the tip, as the encoders' counts tell it" },
    Real { name: "torque1_nm", doc: "Torque of the motor on joint 1, positive along its positive angle" },
    Real { name: "torque2_nm", doc: "Torque of the motor on joint 2, positive along its positive angle" },
    Real { name: "torque3_nm", doc: "Torque of the motor on joint 3, positive along its positive angle" },
];

/// The immutable laws of a PHANToM's world.
pub struct ArmPlant {
    pub(crate) arm: Arm,
    /// The method and the clock edges of a step, if the arm is stepped.
    pub(crate) stepping: Option<(Method, u64)>,
    /// Angle of one count of each joint, in rad.
    pub(crate) count_rad: [f64; 3],
    /// Torque of one count of each joint's DAC, in N·m.
    pub(crate) command_nm: [f64; 3],
    /// Angles and speeds at the start, in rad and rad/s.
    pub(crate) start_rad: [f64; 3],
    pub(crate) start_rad_per_s: [f64; 3],
    /// Whether the joints' limits are known.
    pub(crate) limited: bool,
    /// The tables of sines hold the counts in `-half..half`.
    pub(crate) half: i64,
    /// The axis of a drop test, and how high the tip may rise along it, in m.
    pub(crate) axis: usize,
    pub(crate) opposite_m: f64,
    /// The host, if one computes the force.
    pub(crate) host: Option<Host>,
}

impl ArmPlant {
    /// Returns angles rounded down to whole counts, as counters read them.
    pub(crate) fn counted_rad(&self, angles_rad: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|joint| (angles_rad[joint] / self.count_rad[joint]).floor() * self.count_rad[joint])
    }

    /// Returns the joints' angles at these counts.
    fn angles_rad(&self, counts: [i64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|joint| counts[joint] as f64 * self.count_rad[joint])
    }

    /// Returns the tip's position at these counts.
    fn logged_m(&self, counts: [i64; 3]) -> [f64; 3] {
        kinematics::tip_m(self.arm.model().lengths_m, self.angles_rad(counts))
    }
}

/// The arm and its encoders, at one clock edge.
#[derive(Clone)]
pub(crate) struct ArmState<'p> {
    pub(crate) plant: &'p ArmPlant,
    pub(crate) motion: ArmBody<'p>,
    encoders: [Encoder; 3],
    pub(crate) edge: u64,
    /// The edge of the motion's next event if the drive does not change before it.
    ahead: Option<u64>,
    pub(crate) command: [i64; 3],
    /// Crossings too near a clock edge to be decided in plain `f64`.
    redecided: u64,
    over: Option<&'static str>,
}

impl<'p> ArmState<'p> {
    pub(crate) fn new(plant: &'p ArmPlant) -> Self {
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
        } else if counts.iter().any(|count| !(-plant.half..plant.half).contains(count)) {
            self.over = Some("a joint left the tables of sines: the datapath says invalid, torques are zero");
        } else if plant.limited && !kinematics::within_limits_1_5(plant.angles_rad(counts)) {
            self.over = Some("a joint left its limits");
        } else if kinematics::is_singular(plant.arm.model().lengths_m, plant.angles_rad(counts)) {
            self.over = Some("the arm is nearly singular");
        } else if plant.logged_m(counts)[plant.axis] > plant.opposite_m {
            self.over = Some("the tip reached the opposite wall");
        }
    }

    /// Returns the edge of the arm's next event, up to `limit`.
    fn next(&mut self, limit: u64) -> u64 {
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

    fn drive(&mut self, command: [i64; 3]) {
        if command != self.command {
            self.command = command;
            self.ahead = None;
            let torque = |i: usize| command[i] as f64 * self.plant.command_nm[i];
            self.motion.drive(self.edge, [torque(0), torque(1), torque(2)]);
        }
    }

    /// Moves to an edge before which only the encoders change, and returns the continuous outputs there.
    pub(crate) fn pass(&mut self, edge: u64) -> [f64; 9] {
        self.edge = edge;
        let state = self.motion.state(edge);
        self.sense(state.motor_angles_rad);
        self.shown(&state)
    }

    fn reals(&self, edge: u64) -> [f64; 9] {
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
        let tip = kinematics::tip_m(self.plant.arm.model().lengths_m, state.angles_rad);
        let logged = self.plant.logged_m(self.counts());
        let [t1, t2, t3] = state.torques_nm;
        [tip[0], tip[1], tip[2], logged[0], logged[1], logged[2], t1, t2, t3]
    }

    pub(crate) fn audit(&self) -> EnergyAudit {
        let energy = self.motion.energy(self.edge);
        let stored_j = self.motion.stored_j(self.edge);
        let dissipated_j = energy.viscous_j + energy.coulomb_j + energy.transmission_j;
        EnergyAudit {
            source_j: energy.source_j,
            supplied_j: energy.source_j,
            stored_j,
            viscous_j: energy.viscous_j,
            coulomb_j: energy.coulomb_j,
            transmission_j: energy.transmission_j,
            dissipated_j,
            exchanged_j: energy.exchanged_j,
            residual_j: energy.source_j - stored_j - dissipated_j,
            ..EnergyAudit::default()
        }
    }

    /// Returns why the motion cannot go on, or `None` if it can.
    pub(crate) fn over(&self) -> Option<&'static str> {
        self.over
    }

    pub(crate) fn encoder_edges(&self) -> u64 {
        self.encoders.iter().map(|encoder| encoder.edges).sum()
    }
}

/// The arm around an FPGA that computes the force.
#[derive(Clone)]
pub struct FpgaWorld<'p> {
    state: ArmState<'p>,
}

impl<'p> FpgaWorld<'p> {
    /// Creates the world at edge 0.
    #[must_use]
    pub fn new(plant: &'p ArmPlant) -> Self {
        Self { state: ArmState::new(plant) }
    }
}

impl World for FpgaWorld<'_> {
    type In = PhantomIn<i64>;
    type Out = PhantomOut<i64>;
    type Row = [f64; 9];
    const REALS: &'static [Real] = &ARM_REALS;

    fn edge(&self) -> u64 {
        self.state.edge
    }

    #[inline]
    fn place(&self, input: &mut PhantomIn<i64>) {
        [input.a_pin1, input.b_pin1, input.a_pin2, input.b_pin2, input.a_pin3, input.b_pin3] = self.state.pins();
    }

    fn sense(&mut self) {
        self.state.go(self.state.edge + 1);
    }

    fn advance(&mut self, limit: u64, before: impl FnOnce(&Self, u64)) {
        let edge = self.state.next(limit);
        before(self, edge);
        self.state.go(edge);
    }

    fn drive(&mut self, out: PhantomOut<i64>, _: &[i64]) {
        self.state.drive([out.command1, out.command2, out.command3]);
    }

    fn reals(&self, edge: u64) -> Self::Row {
        self.state.reals(edge)
    }

    fn measure(&mut self, stride: u64) {
        self.state.measure(stride);
    }

    fn measured(&self, edge: u64, row: &mut Vec<f64>) {
        self.state.measured(edge, row);
    }

    fn audit(&self) -> EnergyAudit {
        self.state.audit()
    }

    fn encoder_edges(&self) -> u64 {
        self.state.encoder_edges()
    }

    fn mode_changes(&self) -> u64 {
        self.state.motion.mode_changes()
    }

    fn redecided(&self) -> u64 {
        self.state.redecided
    }

    fn steps(&self) -> u64 {
        self.state.motion.steps()
    }

    fn over(&self) -> Option<&'static str> {
        self.state.over
    }
}

/// The arm around an FPGA that only counts and drives the DACs, and the host that computes the force.
#[derive(Clone)]
pub struct HostWorld<'p> {
    state: ArmState<'p>,
    host: HostState<'p>,
    /// The counters' values as the host reads them.
    positions: [i64; 3],
}

impl<'p> HostWorld<'p> {
    /// Creates the world at edge 0.
    ///
    /// # Panics
    ///
    /// When the plant has no host.
    #[must_use]
    pub fn new(plant: &'p ArmPlant) -> Self {
        let host = plant.host.as_ref().expect("a plant with a host");
        Self { state: ArmState::new(plant), host: HostState::new(host), positions: [0; 3] }
    }

    /// Lets the host do all that is due at the present edge.
    fn due(&mut self) {
        let Self { state, host, positions } = self;
        let law = host.host();
        while host.due() <= state.edge {
            let angles_rad = || state.motion.state(state.edge).motor_angles_rad;
            host.act(state.edge, || law.counted_rad(*positions), angles_rad);
        }
    }
}

impl World for HostWorld<'_> {
    type In = PhantomIoIn<i64>;
    type Out = PhantomIoOut<i64>;
    type Row = [f64; 9];
    const REALS: &'static [Real] = &ARM_REALS;

    fn edge(&self) -> u64 {
        self.state.edge
    }

    #[inline]
    fn place(&self, input: &mut PhantomIoIn<i64>) {
        [input.a_pin1, input.b_pin1, input.a_pin2, input.b_pin2, input.a_pin3, input.b_pin3] = self.state.pins();
        [input.host1, input.host2, input.host3] = self.host.command();
    }

    fn sense(&mut self) {
        self.state.go(self.state.edge + 1);
        self.due();
    }

    fn advance(&mut self, limit: u64, before: impl FnOnce(&Self, u64)) {
        let limit = limit.min(self.host.due());
        let edge = self.state.next(limit);
        before(self, edge);
        self.state.go(edge);
        self.due();
    }

    fn drive(&mut self, out: PhantomIoOut<i64>, _: &[i64]) {
        self.state.drive([out.command1, out.command2, out.command3]);
        self.positions = [out.position1, out.position2, out.position3];
    }

    fn reals(&self, edge: u64) -> Self::Row {
        self.state.reals(edge)
    }

    fn measure(&mut self, stride: u64) {
        self.state.measure(stride);
    }

    fn measured(&self, edge: u64, row: &mut Vec<f64>) {
        self.state.measured(edge, row);
    }

    fn audit(&self) -> EnergyAudit {
        self.state.audit()
    }

    fn encoder_edges(&self) -> u64 {
        self.state.encoder_edges()
    }

    fn mode_changes(&self) -> u64 {
        self.state.motion.mode_changes()
    }

    fn redecided(&self) -> u64 {
        self.state.redecided
    }

    fn steps(&self) -> u64 {
        self.state.motion.steps()
    }

    fn over(&self) -> Option<&'static str> {
        self.state.over
    }
}
