//! Position of the tip: known answers, finite differences, round trips.

use std::f64::consts::FRAC_PI_2;

use hpu_plant::arm::ArmModel;
use hpu_plant::arm::kinematics::{angles_rad, determinant_m3, jacobian_m, tip_m, torques_nm, within_limits_1_5};

const LENGTHS: [f64; 2] = [0.1397; 2];
const ANGLES: [f64; 3] = [0.2, 0.3, 0.5];

fn close(got: f64, expected: f64, tolerance: f64) {
    assert!((got - expected).abs() <= tolerance, "got {got}, expected {expected}");
}

fn poses() -> impl Iterator<Item = [f64; 3]> {
    let steps = |low: f64, high: f64| (0..9).map(move |k| low + (high - low) * f64::from(k) / 8.0);
    steps(-1.2, 1.2).flat_map(move |a| steps(-0.5, 1.1).flat_map(move |b| steps(-0.4, 1.0).map(move |c| [a, b, c])))
}

#[test]
fn tip_determinant_and_torques_are_the_known_ones() {
    for (got, expected) in tip_m(LENGTHS, ANGLES).into_iter().zip([0.03982054, 0.05838589, 0.05674087]) {
        close(got, expected, 5e-9);
    }
    close(determinant_m3(LENGTHS, ANGLES), 3.83375779e-3, 5e-12);
    let torques = torques_nm(LENGTHS, ANGLES, [1.0, 2.0, 3.0]);
    for (got, expected) in torques.into_iter().zip([0.07697926, 0.1373354, 0.51877146]) {
        close(got, expected, 5e-9);
    }
}

#[test]
fn the_neutral_tip_is_the_origin() {
    assert_eq!(tip_m([0.215, 0.17], [0.0; 3]), [0.0; 3]);
}

#[test]
fn the_jacobian_is_the_slope_of_the_tip_and_its_determinant_the_known_product() {
    let lengths = [0.215, 0.17];
    for pose in poses() {
        let rows = jacobian_m(lengths, pose);
        for joint in 0..3 {
            let moved = |by: f64| tip_m(lengths, std::array::from_fn(|i| pose[i] + if i == joint { by } else { 0.0 }));
            let (ahead, behind) = (moved(1e-5), moved(-1e-5));
            for (axis, row) in rows.iter().enumerate() {
                close(row[joint], (ahead[axis] - behind[axis]) / 2e-5, 1e-10);
            }
        }
        let [a, b, c] = rows;
        let determinant = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
            + a[2] * (b[0] * c[1] - b[1] * c[0]);
        close(determinant_m3(lengths, pose), determinant, 1e-15);
    }
}

#[test]
fn the_inverse_finds_the_angles_again() {
    let lengths = [0.215, 0.17];
    for pose in poses() {
        let found = angles_rad(lengths, tip_m(lengths, pose)).expect("a tip in reach");
        for joint in 0..3 {
            close(found[joint], pose[joint], 1e-9);
        }
    }
}

#[test]
fn nothing_out_of_reach_has_angles() {
    assert_eq!(angles_rad([0.14; 2], [0.3, 0.0, 0.0]), None);
    assert_eq!(angles_rad([0.215, 0.17], [0.0, 0.17, -0.215 + 0.04]), None, "between the folded links");
    assert_eq!(angles_rad([0.14; 2], [f64::NAN, 0.0, 0.0]), None);
}

#[test]
fn limits_hold_for_each_joint_and_between_the_links() {
    let degrees = |a: f64, b: f64, c: f64| [a, b, c].map(f64::to_radians);
    assert!(within_limits_1_5(degrees(0.0, 0.0, 0.0)));
    assert!(within_limits_1_5(degrees(89.9, 64.9, 0.0)) && !within_limits_1_5(degrees(90.1, 0.0, 0.0)));
    assert!(!within_limits_1_5(degrees(0.0, 65.1, 0.0)) && !within_limits_1_5(degrees(0.0, 0.0, 55.1)));
    assert!(!within_limits_1_5(degrees(0.0, 119.1, 100.0)) && !within_limits_1_5(degrees(0.0, -50.0, -29.1)));
}

#[test]
fn the_links_of_a_premium_1_5_weigh_what_is_published() {
    let mass = ArmModel::premium_1_5().mass_kg_m2([0.0; 3]);
    close(mass[0][0], 3.57348e-3, 5e-9);
    close(mass[1][1], 2.42640e-3, 5e-9);
    close(mass[2][2], 9.31886e-4, 5e-10);
    assert_eq!(mass[1][2], 0.0);
}

#[test]
fn a_point_mass_weighs_the_same_everywhere() {
    let model = ArmModel::premium_1_0();
    for pose in poses() {
        let (mass, rows) = (model.mass_kg_m2(pose), jacobian_m(model.lengths_m, pose));
        for i in 0..3 {
            for j in 0..3 {
                let expected = 0.075 * (0..3).map(|axis| rows[axis][i] * rows[axis][j]).sum::<f64>();
                close(mass[i][j], expected, 1e-17);
            }
        }
    }
}

#[test]
fn a_weight_at_the_tip_has_the_potential_of_its_height_along_any_gravity() {
    let gravity_m_per_s2 = [1.0, -9.0, 3.0];
    let model = ArmModel { gravity_m_per_s2, ..ArmModel::premium_1_0().with_tip_mass(0.015) };
    let potential = |pose| {
        let tip = tip_m(model.lengths_m, pose);
        -0.015 * (0..3).map(|axis| gravity_m_per_s2[axis] * tip[axis]).sum::<f64>()
    };
    for pose in poses() {
        let got = model.gravity_j(pose) - model.gravity_j([0.0, FRAC_PI_2, 0.1]);
        close(got, potential(pose) - potential([0.0, FRAC_PI_2, 0.1]), 1e-16);
    }
}
