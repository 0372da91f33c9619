//! Coulomb friction: a shaft that slips one way or the other, or is stuck. Each mode is linear; it ends at an instant that is found
//! to all places.

use crate::fixed::Fixed;
use crate::flow::{ANGLE, CURRENT, Flow, SPEED, Vector};

/// What friction makes of the shaft.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Shaft {
    /// There is no friction.
    Free,
    Slips {
        forward: bool,
    },
    Stuck,
}

/// The accelerations of a shaft.
#[derive(Clone, Copy)]
pub struct Friction<const N: usize> {
    /// What the state does to the speed.
    pub row: Vector<N>,
    /// Of friction, while it slips.
    pub least: Fixed<N>,
}

impl<const N: usize> Friction<N> {
    /// The shaft of a state. `pull` is the part of the acceleration that does not depend on the state.
    pub fn shaft(&self, x: &Vector<N>, pull: Fixed<N>) -> Shaft {
        let rests = x[SPEED] == Fixed::ZERO;
        let net = self.net(x, pull);
        if self.least == Fixed::ZERO {
            Shaft::Free
        } else if rests && net.abs() <= self.least {
            Shaft::Stuck
        } else {
            Shaft::Slips { forward: !(if rests { net } else { x[SPEED] }).is_negative() }
        }
    }

    /// The shaft that friction no longer holds.
    pub fn torn_off(&self, x: &Vector<N>, pull: Fixed<N>) -> Shaft {
        Shaft::Slips { forward: !self.net(x, pull).is_negative() }
    }

    /// The acceleration without friction, and without the speed's part: of a shaft at rest.
    fn net(&self, x: &Vector<N>, pull: Fixed<N>) -> Fixed<N> {
        self.row[CURRENT] * x[CURRENT] + self.row[ANGLE] * x[ANGLE] + pull
    }

    /// The acceleration that is not the state's.
    pub fn push(&self, shaft: Shaft, pull: Fixed<N>) -> Fixed<N> {
        match shaft {
            Shaft::Free => pull,
            Shaft::Slips { forward: true } => pull - self.least,
            Shaft::Slips { forward: false } => pull + self.least,
            Shaft::Stuck => Fixed::ZERO,
        }
    }

    /// How far the state is from the mode's end, negative beyond it.
    pub fn margin(&self, shaft: Shaft, x: &Vector<N>, pull: Fixed<N>) -> Fixed<N> {
        match shaft {
            Shaft::Free => Fixed::ZERO,
            Shaft::Slips { forward: true } => x[SPEED],
            Shaft::Slips { forward: false } => -x[SPEED],
            Shaft::Stuck => self.least - self.net(x, pull).abs(),
        }
    }

    /// How fast the margin changes.
    fn slope(&self, shaft: Shaft, x: &Vector<N>, rate: &Vector<N>, pull: Fixed<N>) -> f64 {
        match shaft {
            Shaft::Free => 0.0,
            Shaft::Slips { forward: true } => rate[SPEED].float(),
            Shaft::Slips { forward: false } => -rate[SPEED].float(),
            Shaft::Stuck => {
                let net_rate = self.row[CURRENT] * rate[CURRENT] + self.row[ANGLE] * rate[ANGLE];
                if self.net(x, pull).is_negative() { net_rate.float() } else { -net_rate.float() }
            }
        }
    }

    /// Whether no margin is used up during a time, for certain. A stuck shaft's current fades or grows to where it is driven, ever
    /// more slowly, and its hand moves steadily; a slipping one's speed is no less than `slowest`, in its own direction.
    pub fn lasts(
        &self,
        shaft: Shaft,
        x: &Vector<N>,
        rate: &Vector<N>,
        pull: Fixed<N>,
        time_s: f64,
        slowest: f64,
    ) -> bool {
        match shaft {
            Shaft::Free => true,
            Shaft::Slips { .. } => slowest > x[SPEED].float().abs() * 1e-9,
            Shaft::Stuck => {
                let most = (self.row[CURRENT] * rate[CURRENT]).abs() + (self.row[ANGLE] * rate[ANGLE]).abs();
                most.float() * time_s + self.least.float() * 1e-9 < self.margin(shaft, x, pull).float()
            }
        }
    }

    /// When the margin is used up, of which all is left at the start and none after `left`: by Newton's iteration.
    pub fn end(
        &self,
        shaft: Shaft,
        flow: &Flow<N>,
        x: &Vector<N>,
        g: &Vector<N>,
        pull: Fixed<N>,
        left: Fixed<N>,
    ) -> (Fixed<N>, Vector<N>) {
        let mut time = Fixed::ZERO;
        // A speed that is not zero now and has another sign then: not both ends are far from where it is.
        let (start, end) = (self.margin(shaft, x, pull), self.margin(shaft, &flow.part(left, x, g), pull));
        let share = start.float() / (start.float() - end.float());
        if share > 1e-9 {
            time = left * Fixed::of((share * 2f64.powi(40)).floor() / 2f64.powi(40));
        }
        for _ in 0..16 {
            let there = flow.part(time, x, g);
            let slope = self.slope(shaft, &there, &flow.rate(&there, g), pull);
            // More digits of the step than its own error has are worth nothing.
            let step = self.margin(shaft, &there, pull) * Fixed::of(f64::from((-1.0 / slope) as f32));
            let next = (time + step).max(Fixed::ZERO).min(left);
            if (next - time).abs().float() < 1e-48 {
                return (time, there);
            }
            time = next;
        }
        panic!("the end of {shaft:?} is not found");
    }
}
