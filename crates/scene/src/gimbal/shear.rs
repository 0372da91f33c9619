//! The shear stress that a segment renders: a fractional derivative of the target's lateral motion.
//!
//! The object is a layer of a springpot (Scott Blair), which the motion `u` shears by `u / layer`. Its stress is
//! `viscosity · Dᵅ(u / layer)`, with the order `α` between 0 (a spring) and 2 (a mass); at `α = 1` it is Newton's
//! law of viscosity. The device moves the tip sideways. The finger holds its place, so that its skin makes the stress
//! `skin · displacement / area`. So the tip has to move by `gain · Dᵅ u`, with
//! `gain = viscosity area / (skin layer)`. The stress does not act back on the servos.

use std::ops::RangeInclusive;

/// Most steps of [`Displacement`], whose cost is the square of their number.
const MOST_STEPS: f64 = 8192.0;

/// The shear stress that a segment renders.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Shear {
    /// Order of the derivative as a fraction, above 0 and below 2: numerator and denominator, of at most 1000.
    pub order: [u32; 2],
    /// Viscosity of the object, in Pa·s to the power of the order.
    pub viscosity: f64,
    /// Thickness of the object's sheared layer.
    pub layer_m: f64,
    /// Area of contact.
    pub area_m2: f64,
    /// Tangential stiffness of the skin.
    pub skin_n_per_m: f64,
    /// Samples that count in the datapath's derivative.
    pub memory: u32,
}

impl Shear {
    /// The orders that a scene may ask for.
    pub(crate) const ORDERS: RangeInclusive<f64> = 1e-3..=1.999;

    /// Returns the fraction of a denominator of at most 1000 that is nearest to an order.
    pub(crate) fn fraction(order: f64) -> [u32; 2] {
        let of = |den: u32| ((order * f64::from(den)).round(), f64::from(den));
        let miss = |&den: &u32| (of(den).0 / of(den).1 - order).abs();
        // Of equal ones the first, whose terms have no common factor. A fraction is neither 0 nor 2.
        let fits = |&den: &u32| (1.0..f64::from(2 * den)).contains(&of(den).0);
        let den = (1..=1000).filter(fits).min_by(|a, b| miss(a).total_cmp(&miss(b))).expect("1000 is one");
        [of(den).0 as u32, den]
    }

    /// Returns the order.
    pub fn order(&self) -> f64 {
        f64::from(self.order[0]) / f64::from(self.order[1])
    }

    /// Returns the displacement of the tip per fractional derivative of the motion, in s to the power of the order.
    pub fn gain(&self) -> f64 {
        self.viscosity * self.gain_per_viscosity()
    }

    /// Returns the gain of a viscosity of 1.
    pub(crate) fn gain_per_viscosity(&self) -> f64 {
        self.area_m2 / (self.skin_n_per_m * self.layer_m)
    }

    /// Returns the stress of a displacement of the tip, in Pa.
    pub fn stress_pa(&self, displacement_m: f64) -> f64 {
        self.skin_n_per_m * displacement_m / self.area_m2
    }

    /// Returns the displacement that a motion asks of the tip from 0 to `end_s`, in steps of at least `step_s`.
    pub(crate) fn displacement(&self, motion_m: impl Fn(f64) -> f64, step_s: f64, end_s: f64) -> Displacement {
        let step_s = step_s.max(end_s / MOST_STEPS);
        let count = (end_s / step_s).ceil() as usize + 1;
        let (order, scale) = (self.order(), self.gain() * libm::pow(step_s, -self.order()));
        let weights: Vec<f64> = std::iter::successors(Some((0.0, 1.0)), |(index, weight)| {
            Some((index + 1.0, weight * (index - order) / (index + 1.0)))
        })
        .map(|(_, weight)| weight)
        .take(count)
        .collect();
        // The sum of Grünwald and Letnikov is that of `order / 2` steps before, up to the square of a step.
        let motion_m: Vec<f64> = (0..count).map(|at| motion_m((at as f64 + 0.5 * order) * step_s)).collect();
        let sum = |at: usize| weights.iter().zip(motion_m[..=at].iter().rev()).map(|(w, u)| w * u).sum::<f64>();
        Displacement { step_s, values_m: (0..count).map(|at| scale * sum(at)).collect() }
    }
}

/// The displacement that a motion asks of the tip: its fractional derivative by the sum of Grünwald and Letnikov in
/// floats, over the whole past, centred, so that its error is of the second order in the step.
#[derive(Clone, PartialEq, Debug)]
pub struct Displacement {
    step_s: f64,
    values_m: Vec<f64>,
}

impl Displacement {
    /// Returns the displacement at a time from 0 on in m, straight between the steps and constant after the last.
    pub fn at(&self, time_s: f64) -> f64 {
        let steps = (time_s / self.step_s).clamp(0.0, (self.values_m.len() - 1) as f64);
        let before = steps.floor() as usize;
        let after = (before + 1).min(self.values_m.len() - 1);
        self.values_m[before] + (self.values_m[after] - self.values_m[before]) * steps.fract()
    }

    /// Returns times and values of all steps.
    pub(crate) fn steps(&self) -> impl Iterator<Item = (f64, f64)> {
        self.values_m.iter().enumerate().map(|(at, value_m)| (at as f64 * self.step_s, *value_m))
    }
}
