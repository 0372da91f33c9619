//! A device with the hand that holds it, as a linear system with three inputs.

use hpu_cosim::scene::{Device, Scene, Winding};

use super::response::{Flow, Output, Parts};
use crate::interval::Interval;

/// The response of the speed and of the distance from the hand to one input.
pub struct Channel {
    pub speed: Parts,
    /// `None` where nothing pulls back.
    pub angle: Option<Parts>,
    /// Total change of the speed's response and of the angle's, per second.
    pub bends: [f64; 2],
}

/// `A` and the columns of the inputs. The states are the current, the speed, and the distance from the hand. There is
/// no current if the winding is resistive or there is none, and no distance if the hand does not hold the device.
pub struct System {
    pub(crate) a: Vec<Vec<Interval>>,
    pub(crate) drive: Vec<Interval>,
    pub(crate) torque: Vec<Interval>,
    pub(crate) path: Vec<Interval>,
    speed: Vec<Interval>,
    held: bool,
}

impl System {
    pub(crate) fn new(scene: &Scene, (grip, grip_damping): (f64, f64), held: bool) -> Self {
        let number = Interval::exact;
        let zero = Interval::ZERO;
        let negative = |x: Interval| zero.minus(x);
        let (inertia, viscous) = match scene.device {
            Device::Motor(motor) => (motor.inertia_kg_m2(), motor.viscous_friction_nm_s_per_rad),
            Device::Mass(mass) => (mass.mass_kg, mass.damping_n_s_per_m),
        };
        let mut drag = number(viscous).plus(number(grip_damping));
        // The row of the drive's effect on the speed, and the row of the current.
        let (mut current, mut by_drive) = (None, zero);
        match scene.device {
            Device::Motor(motor) => {
                let k = number(motor.torque_constant_nm_per_a);
                let ohm = number(motor.resistance_ohm).plus(number(2.0 * scene.bridge.on_resistance_ohm));
                match scene.model.winding {
                    Winding::Inductive => current = Some((k, ohm, motor.inductance_h)),
                    Winding::Resistive => {
                        drag = drag.plus(k.times(k).divided(ohm));
                        by_drive = k.divided(ohm).over(inertia);
                    }
                }
            }
            Device::Mass(_) => by_drive = number(1.0).over(inertia),
        }
        let mut a = Vec::new();
        let (mut drive, mut torque, mut path) = (Vec::new(), Vec::new(), Vec::new());
        let slow = negative(drag.over(inertia));
        let back = negative(number(grip).over(inertia));
        let wound = current.is_some();
        let row = |cells: [Interval; 3]| {
            let mut row = cells.to_vec();
            if !held {
                row.pop();
            }
            if !wound {
                row.remove(0);
            }
            row
        };
        if let Some((k, ohm, henry)) = current {
            a.push(row([negative(ohm.over(henry)), negative(k.over(henry)), zero]));
            drive.push(number(1.0).over(henry));
            torque.push(zero);
            path.push(zero);
        }
        let pull = current.map_or(zero, |(k, ..)| k.over(inertia));
        a.push(row([pull, slow, back]));
        drive.push(by_drive);
        torque.push(number(1.0).over(inertia));
        path.push(number(grip_damping).over(inertia));
        if held {
            a.push(row([zero, number(1.0), zero]));
            drive.push(zero);
            torque.push(zero);
            path.push(number(-1.0));
        }
        let speed = (0..a.len()).map(|state| number(f64::from(u8::from(state == usize::from(wound))))).collect();
        Self { a, drive, torque, path, speed, held }
    }

    /// Returns the row of the distance from the hand; zeros if there is none.
    fn gap(&self) -> Vec<Interval> {
        let mut row = vec![Interval::ZERO; self.a.len()];
        if let (true, Some(last)) = (self.held, row.last_mut()) {
            *last = Interval::exact(1.0);
        }
        row
    }

    pub(crate) fn start(&self, scene: &Scene, gap: Interval) -> Vec<Interval> {
        let (current, speed) = match scene.device {
            Device::Motor(motor) => (motor.initial_current_a, motor.initial_speed_rad_per_s),
            Device::Mass(mass) => (0.0, mass.initial_speed_m_per_s),
        };
        let mut all = vec![Interval::exact(speed)];
        if self.a.len() > 1 + usize::from(self.held) {
            all.insert(0, Interval::exact(current));
        }
        if self.held {
            all.push(gap);
        }
        all
    }

    /// Returns the speed, its slope without the inputs, and the distance from the hand.
    pub fn outputs<'f>(&self, flow: &'f Flow) -> [Output<'f>; 3] {
        [flow.output(&self.speed), flow.output(&self.a[self.at()]), flow.output(&self.gap())]
    }

    /// Returns the index of the speed.
    fn at(&self) -> usize {
        self.speed.iter().position(|&c| c != Interval::ZERO).unwrap_or_default()
    }

    pub(crate) fn channel(&self, [speed, slope, gap]: &[Output; 3], b: &[Interval]) -> Channel {
        let speed = speed.parts(b);
        // The derivative of the speed's response is c A e^(At) b, with a jump of c b at the start.
        let bend = (slope.parts(b).both() + b[self.at()].size()).next_up();
        let angle = self.held.then(|| gap.parts(b));
        let jump = if self.held { b[b.len() - 1].size() } else { 0.0 };
        Channel { speed, angle, bends: [bend, (speed.both() + jump).next_up()] }
    }
}
