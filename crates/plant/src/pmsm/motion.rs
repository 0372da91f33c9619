//! The motor in motion: its anchor, the end of each segment, and its state at a clock edge.

use super::Pmsm;
use crate::device::{Drive, Event, REALS};
use crate::energy::Energy;
use crate::flow::gauge::{Measured, Pace};
use crate::flow::matrix::State;

/// A motor of three phases in motion.
#[derive(Clone)]
pub struct PmsmDevice<'a> {
    laws: &'a Pmsm,
}

impl<'a> PmsmDevice<'a> {
    /// Creates a device at edge 0 with all legs open, with currents `i_d` and `i_q` in A, a speed in rad/s and an angle
    /// in rad; the hand intends that angle.
    pub fn new(laws: &'a Pmsm, _dq_a: [f64; 2], _speed_rad_per_s: f64, _angle_rad: f64) -> Self {
        Self { laws }
    }

    /// Returns `i_q` in A, the speed in rad/s, the angle and the hand's intention in rad, at an edge that has not been
    /// left yet.
    pub fn state(&self, _edge: u64) -> State {
        todo!()
    }

    /// Returns the [`state`](Self::state): it does not depend on who asked before.
    pub fn exact_state(&self, edge: u64) -> State {
        self.state(edge)
    }

    /// Returns the outputs of the state at an edge, in the order of [`REALS`](crate::REALS). The torque is that of the
    /// motor at that edge, which with `L_d != L_q` depends on `i_d` too.
    pub fn shown(&self, _edge: u64, _x: &State) -> [f64; REALS.len()] {
        todo!()
    }

    /// Returns the outputs named by [`REALS`](crate::REALS) at an edge.
    pub fn reals(&self, edge: u64) -> [f64; REALS.len()] {
        self.shown(edge, &self.state(edge))
    }

    /// Returns the outputs at this edge and at all later ones, if nothing moves as the device is driven.
    pub fn still(&self, _edge: u64) -> Option<[f64; REALS.len()]> {
        todo!()
    }

    /// Returns the hand's angle in rad and its torque in N·m at an edge.
    pub fn felt(&self, _edge: u64) -> [f64; 2] {
        todo!()
    }

    /// Returns the currents into the three phases at an edge, in A; they sum to 0, and that of a floating phase is 0.
    pub fn phases(&self, _edge: u64) -> [f64; 3] {
        todo!()
    }

    /// Returns the charges that flowed into the three phases until an edge, in A·s.
    pub fn charges(&self, _edge: u64) -> [f64; 3] {
        todo!()
    }

    /// Returns `i_d` and `i_q` at an edge, in A.
    pub fn dq(&self, _edge: u64) -> [f64; 2] {
        todo!()
    }

    /// Returns the voltages of the three terminals against ground from an edge on, in V. If no phase carries a current
    /// and no switch is on, the star point is taken at half the supply.
    pub fn voltages(&self, _edge: u64) -> [f64; 3] {
        todo!()
    }

    /// Returns the current out of the supply from an edge on, in A; negative where it flows back.
    pub fn supply_current(&self, _edge: u64) -> f64 {
        todo!()
    }

    /// Returns whether friction holds the shaft.
    pub fn is_stuck(&self) -> bool {
        todo!()
    }

    /// Returns the current of phase 0, 1 or 2 at an edge, in A.
    pub fn reading(&self, phase: usize, edge: u64) -> f64 {
        self.phases(edge)[phase]
    }

    /// Returns the greatest integer up to `scale` times the current of a phase at an edge, or times `i_q` without a
    /// phase.
    pub fn floor(&self, _phase: Option<usize>, _edge: u64, _scale: f64) -> i64 {
        todo!()
    }

    /// Gathers means of `i_q` and speed between rows from edge 0 on, and extremes where they are `read`.
    pub fn measure(&mut self, _pace: Pace, _read: [bool; 2]) {
        todo!()
    }

    /// Returns means and extremes of `i_q` and speed since the row before the row at this edge, at which the state is
    /// `x`; `None` unless [`measure`](Self::measure) asked for them.
    pub fn measured(&self, _edge: u64, _x: &State) -> Option<[Measured; 2]> {
        todo!()
    }

    /// Sets the hand's intended angle in rad and its speed in rad/s from `edge` on.
    pub fn intend(&mut self, _edge: u64, _angle_rad: f64, _speed_rad_per_s: f64) {
        todo!()
    }

    /// Sets the legs of the inverter from `edge` on: [`Drive::Legs`] or [`Drive::Averages`]. Shares are limited to 0
    /// to 1.
    ///
    /// # Panics
    ///
    /// When the drive is of another kind.
    pub fn driven(&mut self, _edge: u64, _drive: Drive) {
        todo!()
    }

    /// Returns the first edge in (`from`, `to`] at which the angle leaves `[low_rad, high_rad)`, a mode ends, or the
    /// series that describe the motion end, where none of it has happened at `from`.
    #[must_use]
    pub fn next_event(&mut self, _from: u64, _to: u64, _band: (f64, f64)) -> Option<Event> {
        todo!()
    }

    /// Moves to the edge of an event, and returns the state there.
    pub fn arrive(&mut self, (edge, _): Event) -> State {
        self.step(edge)
    }

    /// Moves to an edge at or after the last one, and returns the state there.
    pub fn step(&mut self, _edge: u64) -> State {
        todo!()
    }

    /// Returns where the angle lies with respect to the band from `low_rad`, inclusive, to `high_rad`, at an edge where
    /// its `f64` value is `angle_rad`: -1 below, 0 inside, 1 above.
    pub fn side_of_band(&self, _edge: u64, _angle_rad: f64, _band: (f64, f64)) -> i8 {
        todo!()
    }

    /// Returns whether an angle lies within a band by more than the rounding of its `f64` value.
    pub fn is_surely_within(&self, _edge: u64, _angle_rad: f64, (_low_rad, _high_rad): (f64, f64)) -> bool {
        todo!()
    }

    /// Returns the energy exchanged until `edge`.
    pub fn energy(&self, _edge: u64) -> Energy {
        todo!()
    }

    /// Returns the energy stored at `edge` minus that at the start, in J.
    pub fn stored_j(&self, _edge: u64) -> f64 {
        todo!()
    }

    /// Returns how often friction or a diode has begun or ceased to hold.
    pub fn mode_changes(&self) -> u64 {
        todo!()
    }

    /// Returns the number of segments computed so far.
    pub fn segments(&self) -> u64 {
        todo!()
    }
}
