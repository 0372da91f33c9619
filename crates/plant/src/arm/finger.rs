//! A finger that presses on the surface of a mechanism.
//!
//! The finger's pad is a spring `k` beside a damper `c`, between the surface at height `s` and a target `x` that moves
//! at a constant speed until it is told otherwise:
//!
//! | situation | condition | force on the mechanism |
//! |---|---|---|
//! | apart | `s <= x` | 0 |
//! | pressed | `s > x` and `k (s - x) + c (s' - x') > 0` | `F = k (s - x) + c (s' - x')` against growing heights |
//! | relaxing | `s > x`, but the pad would pull | 0 |
//!
//! The pad has no mass. Its situation changes at a real instant, a zero of the series of depth or force, like the ends
//! of friction's modes.

use crate::flow::polynomial::{Lanes, Polynomial};

/// The pad of a finger.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Finger {
    /// Stiffness in N/m.
    pub stiffness_n_per_m: f64,
    /// Damping in N·s/m.
    pub damping_n_s_per_m: f64,
}

/// The situation of a finger.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Touch {
    /// Its target is above the surface.
    #[default]
    Apart,
    /// Its target is below the surface, but the pad would pull: it goes back to its form by itself.
    Relaxing,
    /// It presses.
    Pressed,
}

/// A finger at the start of a series: its target, the target's speed, its situation.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Press {
    pub(super) target_m: f64,
    pub(super) speed_m_per_s: f64,
    pub(super) touch: Touch,
}

/// The lanes of a series of the touch.
pub(super) const DEPTH: usize = 0;
pub(super) const FORCE: usize = 1;
pub(super) const SPEED: usize = 2;

impl Finger {
    /// Returns the force of a pad that presses: depth and speed of the surface relative to the target.
    pub(super) fn force_n(&self, depth_m: f64, speed_m_per_s: f64) -> f64 {
        self.stiffness_n_per_m * depth_m + self.damping_n_s_per_m * speed_m_per_s
    }

    /// Returns the situation at a depth and a force.
    pub(super) fn touch(depth_m: f64, force_n: f64) -> Touch {
        match (depth_m > 0.0, force_n > 0.0) {
            (false, _) => Touch::Apart,
            (true, false) => Touch::Relaxing,
            (true, true) => Touch::Pressed,
        }
    }

    /// Returns the ways in which a situation can end: the lane that passes 0, the lane's sign before, and the situation
    /// afterwards.
    pub(super) fn ends(touch: Touch) -> &'static [(usize, f64, Touch)] {
        match touch {
            Touch::Apart => &[(DEPTH, -1.0, Touch::Pressed)],
            Touch::Relaxing => &[(FORCE, -1.0, Touch::Pressed), (DEPTH, 1.0, Touch::Apart)],
            Touch::Pressed => &[(FORCE, 1.0, Touch::Relaxing)],
        }
    }

    /// Returns one lane of the touch, from the terms of its series, with its sign, over `[0, end_s]`. `zero` is the
    /// lane that is 0 at the start: the sign of its first power then gives the direction. Without damping, force and
    /// depth are 0 together.
    pub(super) fn watched(
        &self,
        terms: &[Lanes],
        (lane, sign): (usize, f64),
        zero: Option<usize>,
        end_s: f64,
    ) -> Polynomial {
        let is_zero = zero.is_some_and(|zero| zero == lane || self.damping_n_s_per_m == 0.0);
        Polynomial::new(terms, lane, sign, usize::from(is_zero), end_s)
    }
}
