//! The sides of a PHANToM's world: an FPGA that computes the force, or one that counts for a host.

use hpu_datapath::phantom::{PhantomIn, PhantomIoIn, PhantomIoOut, PhantomOut};
use hpu_plant::arm::Links;
use hpu_signal::Real;

use super::host::{Host, HostState};
use crate::result::columns::ARM_REALS;
use crate::world::arm::ArmState;
use crate::world::arm_world::Side;

/// The side of an FPGA that computes the force.
#[derive(Clone)]
pub(super) struct FpgaSide;

impl Side for FpgaSide {
    type In = PhantomIn<i64>;
    type Out = PhantomOut<i64>;
    type Row = [f64; ARM_REALS.len()];
    const REALS: &'static [Real] = &ARM_REALS;

    #[inline]
    fn place<L: Links>(&self, arm: &ArmState<L>, input: &mut PhantomIn<i64>) {
        [input.a_pin1, input.b_pin1, input.a_pin2, input.b_pin2, input.a_pin3, input.b_pin3] = arm.pins();
    }

    #[inline]
    fn drive(&mut self, out: PhantomOut<i64>) -> [i64; 3] {
        [out.command1, out.command2, out.command3]
    }

    fn row<L: Links>(&self, arm: &ArmState<L>, edge: u64) -> Self::Row {
        arm.reals(edge)
    }
}

/// The side of an FPGA that only counts and drives the DACs, and the host that computes the force.
#[derive(Clone)]
pub(super) struct HostSide<'p> {
    host: HostState<'p>,
    /// The counters' values as the host reads them.
    positions: [i64; 3],
}

impl<'p> HostSide<'p> {
    /// Creates the side at edge 0.
    pub(super) fn new(host: &'p Host) -> Self {
        Self { host: HostState::new(host), positions: [0; 3] }
    }
}

impl Side for HostSide<'_> {
    type In = PhantomIoIn<i64>;
    type Out = PhantomIoOut<i64>;
    type Row = [f64; ARM_REALS.len()];
    const REALS: &'static [Real] = &ARM_REALS;

    #[inline]
    fn due(&self) -> u64 {
        self.host.due()
    }

    #[inline]
    fn act<L: Links>(&mut self, arm: &mut ArmState<L>) {
        let (host, positions) = (&mut self.host, self.positions);
        let law = host.host();
        while host.due() <= arm.edge {
            host.act(arm.edge, || law.counted_rad(positions), || arm.motion.state(arm.edge).motor_angles_rad);
        }
    }

    #[inline]
    fn place<L: Links>(&self, arm: &ArmState<L>, input: &mut PhantomIoIn<i64>) {
        [input.a_pin1, input.b_pin1, input.a_pin2, input.b_pin2, input.a_pin3, input.b_pin3] = arm.pins();
        [input.host1, input.host2, input.host3] = self.host.command();
    }

    #[inline]
    fn drive(&mut self, out: PhantomIoOut<i64>) -> [i64; 3] {
        self.positions = [out.position1, out.position2, out.position3];
        [out.command1, out.command2, out.command3]
    }

    fn row<L: Links>(&self, arm: &ArmState<L>, edge: u64) -> Self::Row {
        arm.reals(edge)
    }
}
