//! Arms used by several tests.

use hpu_plant::arm::ArmModel;

/// Returns a Premium 1.5 with friction at its joints: 0.01 N.m and 5e-4 N.m.s/rad, as in a public model of the device.
pub fn rubbing_1_5() -> ArmModel {
    ArmModel { viscous_nm_s_per_rad: [5e-4; 3], coulomb_nm: [0.01; 3], ..ArmModel::premium_1_5() }
}
