//! The keys of the loop of EPFL's haptic paddle.

pub(crate) use crate::axis::rows::*;

use std::f64::consts::PI;

use crate::head::model::{BridgeModel, Solver};
pub(crate) use crate::method::PADDLE;
use crate::schema::Otherwise::{Is, Required};
use crate::schema::quantity as q;
use crate::schema::quantity::Sense::{Any, NotNegative, Positive, Within};
use crate::schema::{Choice, Group, Key, Quantity, Text, Whole, keys, named};

keys! { method_paddle: "method" of [PADDLE];
    /// The control law: the position and the current controller of EPFL's haptic paddle.
    kind: Choice<&'static str> = Choice::new(|| named(&[PADDLE], |it| it), Required);
    /// Current of the winding, a sensor of kind "current".
    current: Text = Text("the name of a current in device.sensors", Required);
    /// Wanted angle, as the firmware reads its sensor.
    target: Quantity = Quantity::new(&q::ANGLE, Any, Required);
    /// Time from which on the target is asked for; before it, the angle is filtered and no torque asked for.
    target_from: Quantity = Quantity::new(&q::TIME, NotNegative, Is(0.0));
    /// Torque at the paddle for an error of the angle.
    kp: Quantity = Quantity::new(&q::TORSIONAL_STIFFNESS, NotNegative, Required);
    /// Torque at the paddle for the error's integral, which has no limit; in N.m/rad a second.
    ki: Quantity = Quantity::new(&q::RATIO, NotNegative, Is(0.0));
    /// Torque at the paddle for the speed.
    kd: Quantity = Quantity::new(&q::TORSIONAL_DAMPING, NotNegative, Is(0.0));
    /// Cut-off of the filter of the angle, as the firmware computes it: a share of 2 pi cutoff 350 us of each reading.
    cutoff: Quantity = Quantity::new(&q::FREQUENCY, Within(0.01, 454.0), Is(100.0));
    /// Angle that the firmware takes one code of an absolute sensor for, where `position` names one.
    code_angle: Quantity = Quantity::new(&q::ANGLE, Positive, Is(33.0 * 2.5 / (4095.0 * 0.5 * 1.1) * PI / 180.0));
    /// Turns of the motor for one of the paddle, as the firmware divides the torque.
    reduction: Quantity = Quantity::new(&q::RATIO, Within(1e-2, 1e4), Is(15.0));
    /// Torque of an ampere at the motor, as the firmware divides the torque.
    torque_constant: Quantity = Quantity::new(&q::TORQUE_CONSTANT, Positive, Is(0.0538));
    /// Greatest torque at the motor that is asked for.
    torque_limit: Quantity = Quantity::new(&q::TORQUE, Positive, Is(0.0323));
    /// Codes of the current whose mean is taken.
    codes: Whole<u32> = Whole::new(2, 64, Is(33));
    /// Current that is the controller's 0: the mean of the codes without a duty, which is 511 of 1024 steps of the
    /// bridge and so not 0 V, or 0 A.
    zero: Choice<bool> = Choice::new(|| vec![("calibrated", true), ("exact", false)], Is(true));
    /// Share of a new mean in the current's filter; 1 leaves the filter out.
    current_share: Quantity = Quantity::new(&q::RATIO, Within(2e-5, 1.0), Is(0.05));
    /// Volts for an ampere of error of the current.
    current_proportional: Quantity = Quantity::new(&q::CURRENT_GAIN, Positive, Is(100.0));
    /// Volts that an ampere of error of the current adds in a second.
    current_integral: Quantity = Quantity::new(&q::RATIO, NotNegative, Is(5e5));
    /// Limit of what the current's error has added.
    integral_limit: Quantity = Quantity::new(&q::VOLTAGE, Positive, Is(10.0));
    /// Volts for an ampere of the wanted current.
    feed_forward: Quantity = Quantity::new(&q::CURRENT_GAIN, NotNegative, Is(15.6));
    /// Greatest duty.
    duty_limit: Quantity = Quantity::new(&q::RATIO, Within(0.01, 1.0), Is(0.98));
    /// Period of the current controller, rounded to whole clock cycles; the firmware takes it for 50 us.
    current_period: Quantity = Quantity::new(&q::TIME, Positive, Is(51e-6));
    /// Period of the position controller, rounded to whole clock cycles; the firmware takes it for 350 us.
    haptic_period: Quantity = Quantity::new(&q::TIME, Positive, Is(351e-6));
}

keys! { model_paddle: "model" of [PADDLE];
    /// How the device is advanced: exactly from event to event, or exactly at every clock cycle.
    solver: Choice<Solver> = Choice::new(|| named(&[Solver::Events, Solver::Clock], Solver::name), Is(Solver::Events));
    /// How the controllers are computed: by the blocks in fixed point, or by the firmware's own arithmetic.
    datapath: Choice<bool> = Choice::new(|| vec![("words", false), ("float32", true)], Is(false));
    /// Models every switching of the bridge, or its mean voltage in each period of the modulator.
    bridge: Choice<BridgeModel> =
        Choice::new(|| named(&BridgeModel::ALL, BridgeModel::name), Is(BridgeModel::Switching));
}
