//! The worlds of a PHANToM: the arm around an FPGA that computes the force, or around one that counts for a host.

use hpu_datapath::phantom::{PhantomIn, PhantomIoIn, PhantomIoOut, PhantomOut};
use hpu_plant::arm::{ArmModel, Links};
use hpu_signal::Real;

use super::PhantomPlant;
use super::host::HostState;
use crate::arm::ArmState;
use crate::columns::ARM_REALS;
use crate::summary::EnergyAudit;
use crate::world::World;

/// The arm around an FPGA that computes the force.
#[derive(Clone)]
pub struct FpgaWorld<'p, L: Links = ArmModel> {
    state: ArmState<'p, L>,
}

impl<'p, L: Links> FpgaWorld<'p, L> {
    /// Creates the world at edge 0.
    #[must_use]
    pub fn new(plant: &'p PhantomPlant<L>) -> Self {
        Self { state: ArmState::new(&plant.arm) }
    }
}

impl<L: Links> World for FpgaWorld<'_, L> {
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
    pub fn new(plant: &'p PhantomPlant) -> Self {
        let host = plant.host.as_ref().expect("a plant with a host");
        Self { state: ArmState::new(&plant.arm), host: HostState::new(host), positions: [0; 3] }
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
