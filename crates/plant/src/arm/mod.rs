//! The arm of a PHANToM: three joints, two links held by a parallelogram, all motors on the base.
//!
//! Joint 1 turns about the vertical; joints 2 and 3 are the *absolute* angles of upper link and forearm. With speeds
//! `ω`:
//!
//! | equation | |
//! |---|---|
//! | `M11 = a0 + a2 cos 2θ2 + a3 cos 2θ3 + P cos θ2 sin θ3` | `M22`, `M33` constant, `M12 = M13 = 0` |
//! | `M23 = -P/2 sin(θ2 - θ3)` | a rigid joint's rotor adds to its diagonal |
//! | `(M11 ω1)' = T1 - N1` | momenta, so that no acceleration enters a product |
//! | `(M22 ω2 + M23 ω3)' = T2 - N2 + ½ ∂2M11 ω1² - P/2 cos(θ2-θ3) ω2 ω3` | |
//! | `(M33 ω3 + M23 ω2)' = T3 - N3 + ½ ∂3M11 ω1² + P/2 cos(θ2-θ3) ω2 ω3` | |
//! | `N = ∂U/∂θ`, `U = -g·[s1 R, A s2 - B c3, c1 R]`, `R = A c2 + B s3` | gravity `g`, y up |
//! | rigid joint: `T = τ - b ω - friction` | stuck: `ω = 0` while the torque to hold it is within `f` |
//! | flexible: `T = k (φ - θ) + d (φ' - ω)`, `J φ'' = τ - T - b φ' - friction` | encoder and friction at the motor |
//! | `τ' = (u - τ)/T_a`, or `τ = u` | `u` is held between changes |
//!
//! All motor quantities are reflected to the joint. Valid for rigid links without play; no stops at the joint limits.
//! Equations: Çavuşoğlu, Feygin and Tendick 2002, with their Coriolis term made skew-symmetric again.
//!
//! The motion is a chain of Taylor series. Each starts at an *anchor*. It lasts until its own coefficients show that
//! its truncation reaches the tolerance, until friction changes its mode, or until a command really changes. All of
//! this is a function of the anchor alone, so asking edge by edge and leaping from event to event give the same bits.
//! An anchor is a sum of two numbers, and the angle that an encoder sees is compared with its limits before rounding.
//! Crossings that are nearer to a clock edge than the run's error are counted.

mod doubt;
mod dynamics;
mod energy;
mod finger;
mod friction;
mod fused;
mod gimbal;
mod joints;
pub mod kinematics;
mod links;
mod model;
mod motion;
mod recorded;
mod series;
mod stepper;

pub use dynamics::{Dual, Dynamics, Scalar};
pub use energy::ArmEnergy;
pub use finger::{Finger, Touch};
pub use gimbal::{Form, Gimbal};
pub use joints::{ArmError, Joints, Transmission};
pub use links::{Arm, Links};
pub use model::ArmModel;
pub use motion::{ArmMotion, ArmState};
pub use recorded::Recorded;
pub use stepper::SteppedArm;
