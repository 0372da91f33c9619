//! A device whose drive is held over steps of one length, as under a sampled law.
//!
//! While a mode lasts, a whole step is one affine map, `x + P(T) (A x + f)`, tabulated for its length: the same flow as
//! the [`Device`]'s, in `f64` from step to step instead of in double-double from the start. The energies of a step are
//! its exact integrals. The device itself flows over a step in which friction may end or begin to act, and over a step
//! of any other length.

use crate::axis::Shaft;
use crate::energy::{Energy, Powers};
use crate::flow::double::{Double, Product, versions};
use crate::flow::guard::dyadic;
use crate::flow::leap::{Integrals, Leap, Quadrature};
use crate::flow::linear::{Linear, Stride};
use crate::flow::matrix::{ANGLE, CURRENT, SPEED, State, dot, plus, sizes};
use crate::{Circuit, Device, Drive};

/// The map of a step in one mode.
struct Map<'a> {
    system: &'a Linear,
    stride: Stride,
    quadrature: Quadrature,
    /// Bound: the speed changes over a step by at most this times the sizes of the slope at the step's start.
    reach: State,
}

impl<'a> Map<'a> {
    fn new(system: &'a Linear, edges: u64) -> Self {
        let length_s = Double::product(edges as f64, system.edge_s());
        let bound = system.bound(dyadic(edges));
        Self {
            system,
            stride: system.stride(edges),
            quadrature: Quadrature::of(&Leap::of(system.matrix(), &system.squares, length_s.hi)),
            reach: bound[SPEED].map(|size| size * length_s.hi),
        }
    }
}

/// An axis in motion whose drive is set anew every fixed number of edges.
pub struct HeldDevice<'a> {
    /// Its drive and mode are always the present ones; its state is the present one only while `ahead` is not set.
    device: Device<'a>,
    edges: u64,
    step_s: f64,
    map: Option<Box<Map<'a>>>,
    /// Whether `x` below is the present state, not the device's.
    ahead: bool,
    x: State,
    f: State,
    powers: Powers,
    energy: Energy,
}

impl<'a> HeldDevice<'a> {
    /// Creates a device that mostly flows by this number of edges at a time.
    pub fn new(device: Device<'a>, edges: u64) -> Self {
        let (x, f, powers, energy) = (*device.motion.anchor(), [0.0; 4], Powers::default(), Energy::default());
        let step_s = edges as f64 * device.motion.system().edge_s();
        Self { device, edges, step_s, map: None, ahead: false, x, f, powers, energy }
    }

    /// Returns how often a mode has changed.
    pub fn mode_changes(&self) -> u64 {
        self.device.mode_changes()
    }

    /// Returns the decisions made again in double-double; see [`Device::redecided`].
    pub fn redecided(&self) -> u64 {
        self.device.redecided()
    }

    /// Returns the energy exchanged until `edge`, to which the device has flowed.
    pub fn energy(&self, edge: u64) -> Energy {
        if self.ahead { self.energy } else { self.device.energy(edge) }
    }

    /// Sets the drive from `edge` on, to which the device has flowed, and returns the state then.
    ///
    /// # Panics
    ///
    /// As [`Device::driven`].
    #[inline(always)]
    pub fn driven(&mut self, edge: u64, drive: Drive) -> State {
        let axis = self.device.axis;
        match drive {
            Drive::Current(current_a) if self.ahead && self.device.circuit == Circuit::Amplified => {
                if axis.motor.inductance_h != 0.0 {
                    self.energy.surge(axis.motor.inductance_h, self.x[CURRENT], current_a);
                }
                self.x[CURRENT] = current_a;
                self.powers.source_v = axis.motor.resistance_ohm * current_a;
                self.powers.source_nm = axis.motor.torque_constant_nm_per_a * current_a;
            }
            Drive::Average(duty) if self.ahead && matches!(self.device.drive, Drive::Average(_)) => {
                let circuit = axis.bridge.averaged(duty);
                self.device.circuit = circuit;
                self.powers.source_v = axis.bridge.voltage_v(circuit);
                if axis.is_resistive() {
                    self.x[CURRENT] = axis.ohmic_a(self.powers.source_v, 2, self.x[SPEED]);
                } else {
                    self.f[CURRENT] = self.powers.source_v / axis.motor.inductance_h;
                }
            }
            _ => {
                self.settle(edge);
                self.device.driven(edge, drive);
                return self.device.state(edge);
            }
        }
        self.device.drive = drive;
        self.x
    }

    /// Sets the hand's intended angle and speed, as [`Device::intend`] does; returns the state then.
    pub fn intend(&mut self, edge: u64, angle_rad: f64, speed_rad_per_s: f64) -> State {
        self.settle(edge);
        self.device.intend(edge, angle_rad, speed_rad_per_s);
        self.device.state(edge)
    }

    /// Flows from one edge to another, through every change of mode, and returns the state there.
    #[inline(always)]
    pub fn flow(&mut self, from: u64, to: u64) -> State {
        if to - from == self.edges && (self.ahead || self.lead(from)) && self.stride() {
            return self.x;
        }
        self.settle(from);
        if self.device.is_stuck() && self.device.motion.w.hi == [0.0; 4] {
            // Nothing moves, so no mode ends.
            return *self.device.motion.anchor();
        }
        self.device.flow(from, to)
    }

    /// Moves the device to the present state.
    #[inline(always)]
    fn settle(&mut self, edge: u64) {
        if self.ahead {
            self.caught_up(edge);
        }
    }

    versions! {
        fn caught_up[caught_up_fused, caught_up_native, caught_up_with](self: &mut Self, edge: u64)
    }

    #[inline(always)]
    fn caught_up_with<P: Product>(&mut self, edge: u64) {
        self.ahead = false;
        self.device.energy = self.energy;
        self.device.enter_with::<P>(edge, self.x.into());
    }

    /// Takes over from the device, if its mode allows whole steps. Returns whether it does.
    fn lead(&mut self, edge: u64) -> bool {
        let device = &self.device;
        if matches!(device.shaft, Shaft::Stuck | Shaft::Creep) || matches!(device.drive, Drive::Gates(_)) {
            return false;
        }
        let system = &device.mode.system;
        if dyadic(self.edges) >= system.dyadic() {
            return false;
        }
        if self.map.as_ref().is_none_or(|map| !std::ptr::eq(map.system, system)) {
            self.map = Some(Box::new(Map::new(system, self.edges)));
        }
        (self.x, self.energy) = (device.state(edge), device.energy(edge));
        (self.f, self.powers) = (device.motion.f.hi, device.powers);
        self.ahead = true;
        true
    }

    versions! {
        /// Makes a whole step if the mode certainly lasts for it. Returns whether it did.
        fn stride[stride_fused, stride_native, stride_with](self: &mut Self) -> bool
    }

    #[inline(always)]
    fn stride_with<P: Product>(&mut self) -> bool {
        let Some(map) = &self.map else { return false };
        let x = self.x;
        let w = map.stride.slope(&x, &self.f);
        if let Shaft::Slip(sign @ (-1 | 1)) = self.device.shaft {
            let left = f64::from(sign) * x[SPEED] - self.device.axis.creep_rad_per_s;
            let surely = left > dot(&map.reach, &sizes(&w));
            if !surely {
                return false;
            }
        }
        let change = map.stride.change(&w);
        self.x = plus(&x, &change);
        let mut done = Integrals::default();
        map.quadrature.add_with::<P>(&map.system.squares, &x, &w, &mut done);
        self.energy.turned(&self.powers, self.step_s, change[ANGLE], &x, &self.x, &done);
        true
    }
}
