//! The columns of a trace of a segment on a gimbal.

use hpu_signal::Real;

use crate::result::columns::{ARM_BETWEEN, ARM_REALS, real};
use hpu_scene::joined::joined;

/// The continuous outputs of a segment on a gimbal; only a scene with shear has the last two.
pub const GIMBAL_REALS: [Real; 15] = [
    ARM_REALS[0],
    ARM_REALS[1],
    ARM_REALS[2],
    real("target_x_m", "Position that the host, or with shear the stress, asks of the tip"),
    real("target_y_m", "Position that the host asks of the tip"),
    real("target_z_m", "Position that the host asks of the tip"),
    real("torque1_nm", "Torque that the servo of the pitch would have at no speed, positive along its positive angle"),
    real("torque2_nm", "Torque that the servo of the roll would have at no speed, positive along its positive angle"),
    real("torque3_nm", "Torque that the crank's servo would have at no speed, positive along its positive angle"),
    real("tip_radius_m", "Distance of the tip from the centre of the gimbal"),
    real("error_m", "Distance of the tip from the target"),
    real("finger_force_n", "Force of the finger on the segment, positive inwards"),
    real("finger_radius_m", "Distance of the finger's pad, at rest, from the centre of the gimbal; 0 without a finger"),
    real("asked_stress_pa", "Shear stress that the target's motion asks for, along x"),
    real("rendered_stress_pa", "Shear stress of the skin at the tip's displacement, along x"),
];

/// Columns of a gimbal's row.
pub const GIMBAL_ROW: [Real; 24] = joined(&[&GIMBAL_REALS, &ARM_BETWEEN]);

/// Index of the radius in a row of a gimbal.
pub const RADIUS: usize = 9;
/// Index of the distance from the target in a row of a gimbal.
pub const ERROR: usize = 10;
/// Index of the force of the finger in a row of a gimbal.
pub const FORCE: usize = 11;

/// Indices of the stress asked for and of the rendered one in a row of a gimbal.
pub const STRESSES: [usize; 2] = [13, 14];
