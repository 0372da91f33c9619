//! The motors whose data a scene can name.

/// A motor whose data a scene can name: what its winding and its rotor are.
#[derive(PartialEq)]
pub(crate) struct NamedMotor {
    pub name: &'static str,
    pub resistance_ohm: f64,
    pub inductance_h: f64,
    pub torque_constant_nm_per_a: f64,
    pub rotor_inertia_kg_m2: f64,
    pub viscous_friction_nm_s_per_rad: f64,
}

/// The motors that a scene can name.
pub(crate) static MOTORS: &[NamedMotor] = &[
    // Assumed values of the 22 W motor of Vasudevan et al. 2007. Its published stall torque at 24 V is 265 mN·m; no
    // data sheet of that winding was available.
    NamedMotor {
        name: "vasudevan_2007",
        resistance_ohm: 25.9e-3 * 24.0 / 0.265,
        inductance_h: 0.226e-3,
        torque_constant_nm_per_a: 25.9e-3,
        rotor_inertia_kg_m2: 1.37e-6,
        viscous_friction_nm_s_per_rad: 1.3e-6,
    },
];
