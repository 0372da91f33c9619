//! The keys of a loop behind field-oriented control.

pub(crate) use crate::axis::rows::*;

use crate::head::model::{BridgeModel, Solver};
pub(crate) use crate::method::FOC;
use crate::method::table::TORQUES;
use crate::schema::Otherwise::{Is, Required, Said};
use crate::schema::quantity as q;
use crate::schema::quantity::Sense::{Any, NotNegative, Positive};
use crate::schema::{Choice, GainFormat, Group, Key, Own, Quantity, Shape, Takes, Text, Whole, keys, named};

keys! { top_wall_foc: "" of [FOC];
    /// The virtual wall; required without `method.torques`.
    wall: Own = Own::section(Said("none"));
}

keys! { method_foc: "method" of [FOC];
    /// The control law: a sampled wall and a table of torques in front of field-oriented control of the currents.
    kind: Choice<&'static str> = Choice::new(|| named(&[FOC], |it| it), Required);
    /// Rate at which wall and table sample, rounded to whole clock cycles.
    sample_rate: Quantity = Quantity::new(&q::FREQUENCY, Positive, Required);
    /// The position that is read: the encoder, or a sensor of kind "absolute" by its name.
    position: Text = Text("\"encoder\" or the name of an absolute sensor in device.sensors", Said("encoder"));
    /// Width of the encoder's position counter; a word of an absolute sensor has its own.
    position_bits: Whole<u32> = Whole::bits(4, 24, 16);
    /// Torques towards greater angles at even distances, from the start on (of an absolute sensor from angle 0 on);
    /// between them a straight line. The table repeats, in both directions.
    torques: Own = Own::new(|| Takes::Own(Shape::List, TORQUES), Said("none"));
    /// Counts from one torque to the next: a power of two.
    spacing: Whole<u32> = Whole::new(1, 1 << 16, Is(1));
    /// Format of the stiffness gain, in units of the wanted current, 2^-3 codes of a converter, per position count.
    stiffness_format: GainFormat = GainFormat(12, 8);
    /// Format of the damping gain, in these units per count and sample.
    damping_format: GainFormat = GainFormat(16, 4);
    /// Bandwidth of the current controllers, 2 pi of which the gains are times the inductance and the resistance.
    current_bandwidth: Quantity = Quantity::new(&q::FREQUENCY, Positive, Is(1000.0));
    /// Frequency of the modulator, whose period is rounded to an even number of clock cycles.
    pwm_frequency: Quantity = Quantity::new(&q::FREQUENCY, Positive, Is(20e3));
    /// Time for which both switches of a leg are open when it changes, rounded to clock cycles.
    dead_time: Quantity = Quantity::new(&q::TIME, NotNegative, Is(500e-9));
    /// Least pulse of a leg, rounded to clock cycles; a shorter one is dropped.
    min_pulse: Quantity = Quantity::new(&q::TIME, NotNegative, Is(400e-9));
    /// Time for which all switches stay open at the start.
    enable_after: Quantity = Quantity::new(&q::TIME, NotNegative, Is(0.0));
    /// Angle of the rotor that the logic takes for the zero of the field's angle; the true one is 0.
    zero: Quantity = Quantity::new(&q::ANGLE, Any, Is(0.0));
}

keys! { wall_foc: "wall" of [FOC];
    /// Stiffness of the wall's spring.
    stiffness: Quantity = Quantity::along(|axis| axis.stiffness, NotNegative, Required);
    /// Damping of the wall.
    damping: Quantity = Quantity::along(|axis| axis.damping, NotNegative, Is(0.0));
}

keys! { model_foc: "model" of [FOC];
    /// How the device is advanced: exactly from event to event, or exactly at every clock cycle.
    solver: Choice<Solver> = Choice::new(|| named(&[Solver::Events, Solver::Clock], Solver::name), Is(Solver::Events));
    /// How law and current controllers are computed: by the blocks in fixed point, or by the same equations in floats.
    datapath: Choice<bool> = Choice::new(|| vec![("words", false), ("float64", true)], Is(false));
    /// Models every switching of the bridge, or its mean voltages in each period of the modulator, without dead time
    /// and diodes.
    bridge: Choice<BridgeModel> =
        Choice::new(|| named(&BridgeModel::ALL, BridgeModel::name), Is(BridgeModel::Switching));
    /// Models the current loops with their winding, or a torque that is the wanted one, beside an averaged bridge; then
    /// winding, bridge and cogging are not modelled.
    currents: Choice<bool> = Choice::new(|| vec![("loops", false), ("ideal", true)], Is(false));
    /// Time by which an ideal torque follows the wanted one, a pure delay; only beside `currents = "ideal"`.
    current_delay: Quantity = Quantity::new(&q::TIME, NotNegative, Is(0.0));
}
