//! What gates make of a winding: its terminals are tied to the supply, lead through diodes, or hang free. Each is
//! linear while the diodes' current keeps its direction, or while the back-EMF does not open them.

use crate::fixed::Fixed;
use crate::flow::{CURRENT, SPEED, Vector};

/// A terminal: tied to the supply (`true`) or to ground, or left to the diodes between both.
pub type Leg = Option<bool>;

/// How the current goes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Path {
    /// It is imposed, or driven whatever its direction.
    Driven,
    /// Through a diode at least; forward is in at plus and out at minus.
    Diodes { forward: bool },
    /// Nowhere.
    Open,
}

/// The bridge around the winding, its legs as they are.
#[derive(Clone, Copy)]
pub struct Bridge<const N: usize> {
    pub supply_v: Fixed<N>,
    pub drop_v: Fixed<N>,
    /// Of the motor, in volts for its speed.
    pub constant: Fixed<N>,
    pub plus: Leg,
    pub minus: Leg,
}

impl<const N: usize> Bridge<N> {
    fn node(&self, leg: Leg, takes: bool) -> Fixed<N> {
        match leg {
            Some(true) => self.supply_v,
            Some(false) => Fixed::ZERO,
            // What leaves the motor goes up to the supply, what enters it comes from ground.
            None if takes => self.supply_v + self.drop_v,
            None => -self.drop_v,
        }
    }

    /// What drives a current of that direction.
    fn volts(&self, forward: bool) -> Fixed<N> {
        self.node(self.plus, !forward) - self.node(self.minus, forward)
    }

    /// The path of a state, and the volts on it.
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

    /// The path at the end of one.
    pub fn next(&self, path: Path, x: &Vector<N>) -> Path {
        match path {
            Path::Open => {
                let middle = self.volts(true) + self.volts(false);
                Path::Diodes { forward: self.constant * x[SPEED] + self.constant * x[SPEED] < middle }
            }
            _ => self.path(x),
        }
    }

    /// The volts on a path, and how many switches it goes through.
    pub fn drive(&self, path: Path) -> (Fixed<N>, usize) {
        let switches = usize::from(self.plus.is_some()) + usize::from(self.minus.is_some());
        match path {
            Path::Driven => (self.volts(true), switches),
            Path::Diodes { forward } => (self.volts(forward), switches),
            Path::Open => (Fixed::ZERO, 0),
        }
    }

    /// How far the state is from the path's end, negative beyond it.
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

    /// Whether no margin is used up, for certain, while the current and the speed move by so much at most.
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
