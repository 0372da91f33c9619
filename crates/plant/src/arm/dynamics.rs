//! The dynamics of a mechanism, written once over any scalar.

use std::ops::{Add, Mul, Neg, Sub};

/// A `Scalar` is a number that [`Dynamics`] are written in. Implemented by `f64`, which evaluates them in a pose, by
/// [`Dual`], which differentiates them by the joints' angles, and by the expressions that
/// [`Recorded`](super::Recorded) reads as Taylor series. Has no order and no equality, because an expression has none;
/// that is why `num_traits::Num` is not asked for.
pub trait Scalar:
    Clone + From<f64> + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    /// Returns sine and cosine.
    fn sin_cos(&self) -> (Self, Self);
    /// Returns the square root of a positive number.
    fn sqrt(&self) -> Self;
    /// Returns 1 divided by a number other than 0.
    fn recip(&self) -> Self;
}

impl Scalar for f64 {
    fn sin_cos(&self) -> (Self, Self) {
        libm::sincos(*self)
    }

    fn sqrt(&self) -> Self {
        libm::sqrt(*self)
    }

    fn recip(&self) -> Self {
        1.0 / self
    }
}

/// `Dynamics` describe the links of an arm with three joints, each with a motor. A mechanism that implements this trait
/// moves: [`Arm::of`](super::Arm::of) makes it flow by its Taylor series and move in steps, with the friction, motors
/// and transmissions of its [`Joints`](super::Joints). Implemented by [`ArmModel`](super::ArmModel) and by
/// every other mechanism of this module.
///
/// A pendulum about joint 1, whose other joints turn wheels:
///
/// ```
/// use hpu_plant::arm::{Arm, ArmMotion, Dynamics, Joints, Scalar};
///
/// struct Pendulum;
///
/// impl Dynamics for Pendulum {
///     fn mass_kg_m2<T: Scalar>(&self, _: &[T; 3]) -> [[T; 3]; 3] {
///         std::array::from_fn(|i| std::array::from_fn(|j| T::from(if i == j { 0.5 } else { 0.0 })))
///     }
///     fn potential_j<T: Scalar>(&self, angles_rad: &[T; 3]) -> T {
///         T::from(-9.81) * angles_rad[0].sin_cos().1
///     }
///     fn tip_m<T: Scalar>(&self, angles_rad: &[T; 3]) -> [T; 3] {
///         let (sine, cosine) = angles_rad[0].sin_cos();
///         [sine, -cosine, T::from(0.0)]
///     }
/// }
///
/// let arm = Arm::of(&Pendulum, Joints { free: [true, false, false], ..Joints::default() }, 1e-6).unwrap();
/// let mut motion = ArmMotion::new(&arm, [1.0, 0.0, 0.0], [0.0; 3]);
/// motion.step(1_000_000);
/// assert!(motion.stored_j(1_000_000).abs() < 1e-12);
/// ```
pub trait Dynamics {
    /// Returns the links' mass matrix in kg·m², without rotors. It is symmetric.
    fn mass_kg_m2<T: Scalar>(&self, angles_rad: &[T; 3]) -> [[T; 3]; 3];
    /// Returns the potential energy in J.
    fn potential_j<T: Scalar>(&self, angles_rad: &[T; 3]) -> T;
    /// Returns the tip's position in m.
    fn tip_m<T: Scalar>(&self, angles_rad: &[T; 3]) -> [T; 3];
    /// Returns the height in m of the surface on which a finger can press; `None` where no finger can. The finger's
    /// force is opposite to growing heights; see [`Arm::with_finger`](super::Arm::with_finger).
    fn surface_m<T: Scalar>(&self, _angles_rad: &[T; 3]) -> Option<T> {
        None
    }
}

/// A value and its slopes by the angles of the three joints.
#[derive(Clone, Debug)]
pub struct Dual<T> {
    /// The value.
    pub value: T,
    /// Its slopes.
    pub slopes: [T; 3],
}

impl<T: Scalar> Dual<T> {
    /// Returns the angles of the joints, each with slope 1 by itself.
    pub fn of(angles: [T; 3]) -> [Self; 3] {
        let [one, two, three] = angles;
        [(0, one), (1, two), (2, three)].map(|(joint, value)| {
            let slopes = std::array::from_fn(|i| T::from(if i == joint { 1.0 } else { 0.0 }));
            Self { value, slopes }
        })
    }

    fn chain(value: T, slope: &T, of: &Self) -> Self {
        Self { value, slopes: of.slopes.clone().map(|by| slope.clone() * by) }
    }
}

impl<T: Scalar> From<f64> for Dual<T> {
    fn from(value: f64) -> Self {
        Self { value: value.into(), slopes: [0.0; 3].map(T::from) }
    }
}

/// Returns the slopes of both, joined joint by joint.
fn joined<T: Scalar>(one: [T; 3], other: [T; 3], join: impl Fn(T, T) -> T) -> [T; 3] {
    let mut pairs = one.into_iter().zip(other).map(|(one, other)| join(one, other));
    std::array::from_fn(|_| pairs.next().expect("three joints"))
}

impl<T: Scalar> Add for Dual<T> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, slopes: joined(self.slopes, other.slopes, T::add) }
    }
}

impl<T: Scalar> Sub for Dual<T> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self { value: self.value - other.value, slopes: joined(self.slopes, other.slopes, T::sub) }
    }
}

impl<T: Scalar> Mul for Dual<T> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let one = self.slopes.map(|slope| slope * other.value.clone());
        let two = other.slopes.map(|slope| self.value.clone() * slope);
        Self { value: self.value * other.value, slopes: joined(one, two, T::add) }
    }
}

impl<T: Scalar> Neg for Dual<T> {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, slopes: self.slopes.map(T::neg) }
    }
}

impl<T: Scalar> Scalar for Dual<T> {
    fn sin_cos(&self) -> (Self, Self) {
        let (sine, cosine) = self.value.sin_cos();
        (Self::chain(sine.clone(), &cosine, self), Self::chain(cosine, &-sine, self))
    }

    fn sqrt(&self) -> Self {
        let root = self.value.sqrt();
        Self::chain(root.clone(), &(T::from(0.5) * root.recip()), self)
    }

    fn recip(&self) -> Self {
        let recip = self.value.recip();
        Self::chain(recip.clone(), &-(recip.clone() * recip), self)
    }
}
