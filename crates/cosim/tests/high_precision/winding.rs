//! The paths of a winding's current by the gates: a terminal is tied to the supply or to ground, or left to the diodes;
//! the winding may be open. Each path is linear while the diodes' current keeps its direction, or while the back-EMF
//! does not open them.

use crate::fixed::Fixed;
use crate::flow::{CURRENT, SPEED, Vector};

/// A terminal: tied to the supply (`true`) or to ground, or left to the diodes between both.
pub type Leg = Option<bool>;

/// The path of the current.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Path {
    /// Imposed, or driven whatever its direction.
    Driven,
    /// Through at least one diode; forward is in at plus and out at minus.
    Diodes { forward: bool },
    /// No path.
    Open,
}

/// The bridge around the winding, with the present state of its legs.
#[derive(Clone, Copy)]
pub struct Bridge<const N: usize> {
    pub supply_v: Fixed<N>,
    pub drop_v: Fixed<N>,
    /// The motor's constant, in volts per speed.
    pub constant: Fixed<N>,
    pub plus: Leg,
    pub minus: Leg,
}

impl<const N: usize> Bridge<N> {
    fn node(&self, leg: Leg, takes: bool) -> Fixed<N> {
        match leg {
            Some(true) => self.supply_v,
            Some(false) => Fixed::ZERO,
            // Current that leaves the motor flows up to the supply; current that enters it comes from ground.
            None if takes => self.supply_v + self.drop_v,
            None => -self.drop_v,
        }
    }

    /// Returns the voltage that drives a current of this direction.
    fn volts(&self, forward: bool) -> Fixed<N> {
        self.node(self.plus, !forward) - self.node(self.minus, forward)
    }

    /// Returns the path of the current in a state.
    pub fn path(&self, x: &Vector<N>) -> Path {
        let (current, emf) = (x[CURRENT], self.constant * x[SPEED]);
        if self.plus.is_some() && self.minus.is_some() {
            Path::Driven
        } else if current != Fixed::ZERO {
            Path::Diodes { forward: !current.is_negative() }
        } else if emf < self.volts(true) {
            Path::Diodes { forward: true }
        } else if emf > self.volts(false) {
            Path::Diodes { forward: false }
        } else {
            Path::Open
        }
    }

    /// Returns the path that follows at the end of a path.
    pub fn next(&self, path: Path, x: &Vector<N>) -> Path {
        match path {
            Path::Open => {
                let middle = self.volts(true) + self.volts(false);
                Path::Diodes { forward: self.constant * x[SPEED] + self.constant * x[SPEED] < middle }
            }
            _ => self.path(x),
        }
    }

    /// Returns the voltage on a path, and the number of switches in it.
    pub fn drive(&self, path: Path) -> (Fixed<N>, usize) {
        let switches = usize::from(self.plus.is_some()) + usize::from(self.minus.is_some());
        match path {
            Path::Driven => (self.volts(true), switches),
            Path::Diodes { forward } => (self.volts(forward), switches),
            Path::Open => (Fixed::ZERO, 0),
        }
    }

    /// Returns the distance of the state from the path's end, negative beyond it.
    pub fn margin(&self, path: Path, x: &Vector<N>) -> Fixed<N> {
        match path {
            Path::Driven => Fixed::ZERO,
            Path::Diodes { forward: true } => x[CURRENT],
            Path::Diodes { forward: false } => -x[CURRENT],
            Path::Open => {
                let emf = self.constant * x[SPEED];
                (emf - self.volts(true)).min(self.volts(false) - emf)
            }
        }
    }

    /// Returns whether the path certainly lasts while current and speed change by at most these amounts.
    pub fn lasts(&self, path: Path, x: &Vector<N>, current: f64, speed: f64) -> bool {
        let most = match path {
            Path::Driven => return true,
            Path::Diodes { .. } => current,
            Path::Open => self.constant.float() * speed,
        };
        let size = x[CURRENT].float().abs() + self.constant.float() * x[SPEED].float().abs() + self.supply_v.float();
        most + size * 1e-12 < self.margin(path, x).float()
    }
}
