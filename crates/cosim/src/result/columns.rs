//! The columns of a trace: names, units and meanings.
//!
//! Every torque and force is positive along the positive direction of the position that it acts on, so a wall at a
//! positive position pushes back with a negative one. A row of an axis has the outputs at its instant, then mean, least
//! and greatest current, speed and torque (see [`hpu_plant::Gauge`]), then the hand's angle and torque. A row of an
//! arm has its outputs, then mean, least and greatest torque of each motor.

use std::sync::Mutex;

use hpu_plant::{Measured, REALS};
use hpu_scene::joined::joined;
use hpu_scene::{Sensor, SensorKind, kept};
use hpu_signal::Real;

/// The convention of signs, as traces, waveforms and summaries state it.
pub const SIGNS: &str = "torques and forces are positive along the positive direction of the position that they act \
                         on; a wall at a positive position pushes back with a negative one; a net is the value of its \
                         word, and a positive command of an axis asks for a negative torque or force, one of a PHANToM \
                         for a positive one";

pub(crate) const fn real(name: &'static str, doc: &'static str) -> Real {
    Real { name, doc }
}

const MEAN: &str = "Mean over whole periods of the modulator since the row before, or over the row";
const LEAST: &str = "Least value since the row before";
const GREATEST: &str = "Greatest value since the row before";

/// Columns of a motor's row.
pub const AXIS_ROW: [Real; 15] = [
    REALS[0],
    REALS[1],
    REALS[2],
    REALS[3],
    real("current_mean_a", MEAN),
    real("current_least_a", LEAST),
    real("current_greatest_a", GREATEST),
    real("speed_mean_rad_per_s", MEAN),
    real("speed_least_rad_per_s", LEAST),
    real("speed_greatest_rad_per_s", GREATEST),
    real("torque_mean_nm", MEAN),
    real("torque_least_nm", LEAST),
    real("torque_greatest_nm", GREATEST),
    real("hand_angle_rad", "The hand's intention where it has one, else the shaft's angle"),
    real("hand_torque_nm", "Torque of the hand on the shaft, positive along the positive angle"),
];

/// Columns of a mass's row. Its amplifier is known by its force.
pub const RAIL_ROW: [Real; 15] = [
    real("current_a", "The force, as the current of an amplifier that gives one newton an ampere"),
    real("speed_m_per_s", "Speed of the mass"),
    real("position_m", "Position of the mass"),
    real("force_n", "Force of the amplifier on the mass, positive along the positive position"),
    real("current_mean_a", "The same"),
    real("current_least_a", "The same"),
    real("current_greatest_a", "The same"),
    real("speed_mean_m_per_s", MEAN),
    real("speed_least_m_per_s", LEAST),
    real("speed_greatest_m_per_s", GREATEST),
    real("force_mean_n", MEAN),
    real("force_least_n", LEAST),
    real("force_greatest_n", GREATEST),
    real("hand_position_m", "The hand's intention where it has one, else the position of the mass"),
    real("hand_force_n", "Force of the hand on the mass, positive along the positive position"),
];

/// Columns of [`RAIL_ROW`] without information of their own: the amplifier's current is its force by another name.
pub(crate) const CURRENTS: [usize; 4] = [0, 4, 5, 6];

/// Indices of the mean, least and greatest current in a row of an axis.
pub(crate) const CURRENT_BETWEEN: [usize; 3] = [4, 5, 6];
/// Indices of the mean, least and greatest speed in a row of an axis.
pub(crate) const SPEED_BETWEEN: [usize; 3] = [7, 8, 9];
/// Indices of the mean, least and greatest torque or force in a row of an axis.
pub const TORQUE_BETWEEN: [usize; 3] = [10, 11, 12];

/// The continuous outputs of an arm.
pub const ARM_REALS: [Real; 9] = [
    Real { name: "tip_x_m", doc: "Position of the tip" },
    Real { name: "tip_y_m", doc: "Position of the tip" },
    Real { name: "tip_z_m", doc: "Position of the tip" },
    Real { name: "logged_x_m", doc: "Position of the tip, as the encoders' counts tell it" },
    Real { name: "logged_y_m", doc: "Position of the tip, as the encoders' counts tell it" },
    Real { name: "logged_z_m", doc: "Position of the tip, as the encoders' counts tell it" },
    Real { name: "torque1_nm", doc: "Torque of the motor on joint 1, positive along its positive angle" },
    Real { name: "torque2_nm", doc: "Torque of the motor on joint 2, positive along its positive angle" },
    Real { name: "torque3_nm", doc: "Torque of the motor on joint 3, positive along its positive angle" },
];

/// Means and extremes of the torques of an arm's motors.
pub(crate) const ARM_BETWEEN: [Real; 9] = [
    real("torque1_mean_nm", MEAN),
    real("torque1_least_nm", LEAST),
    real("torque1_greatest_nm", GREATEST),
    real("torque2_mean_nm", MEAN),
    real("torque2_least_nm", LEAST),
    real("torque2_greatest_nm", GREATEST),
    real("torque3_mean_nm", MEAN),
    real("torque3_least_nm", LEAST),
    real("torque3_greatest_nm", GREATEST),
];

/// Columns of an arm's row.
pub const ARM_ROW: [Real; 18] = joined(&[&ARM_REALS, &ARM_BETWEEN]);

/// Returns the columns of a row of a network: those of an axis, then one for each of its sensors. Rows are static, so a
/// program keeps one for each set of sensors.
pub(crate) fn with_sensors(row: &'static [Real], sensors: &[Sensor]) -> &'static [Real] {
    static ROWS: Mutex<Vec<&'static [Real]>> = Mutex::new(Vec::new());
    if sensors.is_empty() {
        return row;
    }
    let of = |sensor: &Sensor| match sensor.kind {
        SensorKind::Encoder(..) => {
            real(kept(&format!("sensor_{}_count", sensor.name)), "Count of the encoder, from position 0")
        }
        SensorKind::Hall(_) => real(kept(&format!("sensor_{}_a", sensor.name)), "Level of the Hall switch a"),
        SensorKind::Modulator(_) => real(kept(&format!("sensor_{}_bit", sensor.name)), "Bit of the modulator"),
        SensorKind::Sampled(_) => real(kept(&format!("sensor_{}_word", sensor.name)), "Word of the sensor, in counts"),
    };
    let row: Vec<Real> = row.iter().copied().chain(sensors.iter().map(of)).collect();
    let mut rows = ROWS.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(known) = rows.iter().find(|known| ***known == row[..]) {
        return known;
    }
    rows.push(row.leak());
    rows[rows.len() - 1]
}

/// Returns mean, least and greatest value of one output over a row, in the column's unit.
pub(crate) fn three(measured: &Measured, scale: f64) -> [f64; 3] {
    [measured.mean, measured.extent.least, measured.extent.greatest].map(|x| scale * x)
}

/// Appends to a row of an axis the measured current, speed and torque between rows, and the hand's angle and torque.
pub(crate) fn tell(torque_constant: f64, [current, speed]: &[Measured; 2], felt: [f64; 2], row: &mut Vec<f64>) {
    let torque = three(current, torque_constant);
    for values in [three(current, 1.0), three(speed, 1.0), torque] {
        row.extend(values);
    }
    row.extend(felt);
}
