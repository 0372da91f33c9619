//! The keys of a three-phase motor.

use crate::schema::Otherwise::{Is, Required, Said};
use crate::schema::quantity as q;
use crate::schema::quantity::Sense::{Any, NotNegative, Positive};
use crate::schema::{Group, Key, Own, Quantity, Shape, Takes, Text, Whole, keys};

/// The form of a cogging torque.
pub(crate) const COGGING: &str = "a list of [order, amplitude, phase], as in [[42, \"1 mN.m\", 0]]";

keys! { pmsm: "device" of ["pmsm"];
    /// Pairs of poles: electrical turns in a turn of the rotor.
    pole_pairs: Whole<u32> = Whole::new(1, 1000, Required);
    /// Resistance of a phase, from its terminal to the star.
    resistance: Quantity = Quantity::new(&q::RESISTANCE, Positive, Required);
    /// Inductance of a phase, the same along the magnets' axis and across it; or both apart.
    inductance: Quantity = Quantity::new(&q::INDUCTANCE, Positive, Said("both apart"));
    /// Inductance along the magnets' axis, d.
    inductance_d beside inductance_q: Quantity = Quantity::new(&q::INDUCTANCE, Positive, Said("inductance"));
    /// Inductance across the magnets' axis, q.
    inductance_q beside inductance_d: Quantity = Quantity::new(&q::INDUCTANCE, Positive, Said("inductance"));
    /// Flux of the magnets through a phase, at its peak; or `torque_constant`.
    flux_linkage: Quantity = Quantity::new(&q::FLUX, Positive, Said("that of torque_constant"));
    /// Torque for one ampere across the magnets' axis, the peak of a phase's current: 3/2 of pole pairs times flux.
    torque_constant: Quantity = Quantity::new(&q::TORQUE_CONSTANT, Positive, Said("that of flux_linkage"));
    /// Moment of inertia of the rotor and of what turns with it.
    rotor_inertia: Quantity = Quantity::new(&q::INERTIA, Positive, Required);
    /// Viscous friction of the rotor.
    viscous_friction: Quantity = Quantity::new(&q::TORSIONAL_DAMPING, NotNegative, Is(0.0));
    /// Coulomb friction of the rotor.
    coulomb_friction: Quantity = Quantity::new(&q::TORQUE, NotNegative, Is(0.0));
    /// Friction up to which the rotor sticks, at least Coulomb friction.
    stiction: Quantity = Quantity::new(&q::TORQUE, NotNegative, Said("coulomb_friction"));
    /// Cogging torque: harmonics of the rotor's angle, each -amplitude sin(order angle + phase).
    cogging: Own = Own::new(|| Takes::Own(Shape::List, COGGING), Said("none"));
    /// Resistance of the supply, in series with the bridge.
    supply_resistance: Quantity = Quantity::new(&q::RESISTANCE, NotNegative, Is(0.0));
    /// Angle of the rotor at the start; at 0 the magnets' axis is that of phase a.
    initial_angle: Quantity = Quantity::new(&q::ANGLE, Any, Is(0.0));
    /// Speed of the rotor at the start.
    initial_speed: Quantity = Quantity::new(&q::ANGULAR_SPEED, Any, Is(0.0));
    /// Bodies around the rotor, each by its name; `rotor` is its own, with stops, a return spring and gravity alone.
    bodies: Own = Own::section(Said("the rotor alone"));
    /// Joints between bodies, each by its name.
    joints: Own = Own::section(Said("none"));
    /// Body in whose units the wall is given.
    units_at: Text = Text("the name of a body", Said("rotor"));
    /// Sensors beside the encoder, each by its name.
    sensors: Own = Own::section(Said("none"));
}
