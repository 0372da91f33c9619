//! The sections of a scene, and those that every scene has.

use crate::head::accuracy::{OfOutputs, Output};
use crate::head::outcome::OutcomeKind;
use crate::schema::Otherwise::{Is, Required, Said};
use crate::schema::quantity as q;
use crate::schema::quantity::Sense::{Any, Positive, Within};
use crate::schema::value::Expected;
use crate::schema::{Choice, Flag, Group, Key, Own, Quantity, Takes, Text, Whole, keys, named};

keys! { top: "" of [];
    /// Tells what the scene shows and what to look for; `hpu scenes` lists its first sentence.
    about: Text = Text("a few sentences that say what to look for", Required);
    /// The device that the hand holds.
    device: Own = Own::section(Required);
}

keys! { top_axis: "" of ["axis", "dut", "epfl_paddle", "foc"];
    /// The encoder on the motor's shaft or along the rail.
    encoder: Own = Own::section(Said("its keys' defaults"));
    /// The H-bridge of a motor; a mass has none.
    bridge: Own = Own::section(Said("its keys' defaults"));
    /// The force amplifier of a mass; a motor has none.
    amplifier: Own = Own::section(Said("none"));
}

keys! { top_clock: "" of [];
    /// The clock of the FPGA.
    clock: Own = Own::section(Required);
}

keys! { top_method: "" of ["axis", "epfl_paddle", "foc"];
    /// The control law that closes the loop, as hpu's own blocks.
    method: Own = Own::section(Required);
}

keys! { top_dut: "" of ["dut"];
    /// A design of your own that closes the loop, in the place of `[method]`.
    dut: Own = Own::section(Required);
}

keys! { top_wall_dut: "" of ["dut"];
    /// The virtual wall that the design renders.
    wall: Own = Own::section(Said("none"));
}

keys! { top_hand: "" of ["axis", "dut", "epfl_paddle", "foc"];
    /// The hand that moves the device.
    hand: Own = Own::section(Required);
    /// Faults of encoder lines, switches and clock.
    faults: Own = Own::section(Said("none"));
}

keys! { top_run: "" of [];
    /// How much physics is modelled; `model = "auto"` leaves the choice to `hpu fit`.
    model: Own = Own::section(Said("its keys' defaults"));
    /// How long the scene runs.
    run: Own = Own::section(Required);
    /// Settings of the recording.
    record: Own = Own::section(Said("its keys' defaults"));
    /// The verdict and numbers that a run is judged by.
    expect: Own = Own::section(Said("nothing is judged"));
    /// The outputs by which `hpu fit` and `hpu chart` compare models.
    accuracy: Own = Own::section(Said("its keys' defaults"));
}

keys! { clock: "clock" of [];
    /// Frequency of the clock, a whole number of hertz.
    frequency: Quantity = Quantity::new(&q::FREQUENCY, Within(1.0, 1e10), Required);
}

keys! { run: "run" of [];
    /// Simulated time; 1 to 2^62 clock cycles.
    duration: Quantity = Quantity::new(&q::TIME, Positive, Required);
    /// Seed of everything random.
    seed: Whole<u64> = Whole::new(0, i64::MAX as u64, Is(0));
}

keys! { record: "record" of ["axis", "dut", "epfl_paddle", "foc"];
    /// Rate at which the device's motion is recorded.
    plant_rate: Quantity = Quantity::new(&q::FREQUENCY, Positive, Is(10e3));
}

keys! { record_all: "record" of [];
    /// Records the clock signal too.
    clock: Flag = Flag(false);
    /// Records, in waveforms, a bit for each net that can lose upper bits: 1 while its word has overflowed. The
    /// emulator's datapath alone has them.
    overflows: Flag = Flag(false);
}

keys! { expect: "expect" of ["axis", "dut", "epfl_paddle", "foc"];
    /// Verdict that the run must reach: the motion settles, keeps a limit cycle, diverges, or is inside a wall that
    /// gives no torque; the run is too short to tell (`not_told`), or the hand, or the target, moves nearly to its end
    /// (`hand_moves`, `tracking`).
    outcome: Choice<OutcomeKind> = Choice::new(|| {
        use OutcomeKind::{Diverged, HandMoves, LimitCycle, NoWallTorque, NotTold, PositionLost, Settled, Tracking};
        let all = [Settled, LimitCycle, Diverged, NoWallTorque, PositionLost, NotTold, HandMoves, Tracking];
        named(&all, OutcomeKind::name)
    }, Said("not judged"));
    /// Angle or position at the end.
    final_angle: Expected = Expected::along(|axis| axis.position);
    /// Greatest recorded angle or position.
    peak_angle: Expected = Expected::along(|axis| axis.position);
    /// Greatest recorded depth in the wall.
    peak_penetration: Expected = Expected::along(|axis| axis.position);
    /// Amplitude of the limit cycle.
    amplitude: Expected = Expected::along(|axis| axis.position);
    /// Frequency of the limit cycle.
    frequency: Expected = Expected::new(&q::FREQUENCY, Any);
    /// Greatest recorded torque of the motor, or force of the amplifier.
    peak_torque: Expected = Expected::along(|axis| axis.effort);
    /// Share of the clock cycles in which the spring's product overflows.
    spring_overflow_share: Expected = Expected::new(&q::RATIO, Any);
    /// Number of changes of the encoder lines.
    encoder_edges: Expected = Expected::new(&q::RATIO, Any);
    /// Share of the judged window in which the device is in the wall.
    contact_share: Expected = Expected::new(&q::RATIO, Any);
    /// Distance from a target that moves nearly to the end: its root mean square over the judged window.
    rms: Expected = Expected::along(|axis| axis.position);
    /// The log of a real device, or of another simulator, that the run must follow.
    recording: Own = Own::section(Said("none"));
}

keys! { metric: "expect.METRIC" of [];
    /// The number, in the unit of its metric.
    value: Own = Own::new(|| Takes::Quantity(vec![]), Required);
    /// How far the run may be off, in the same unit.
    tolerance: Own = Own::new(|| Takes::Quantity(vec![]), Required);
}

keys! { accuracy: "accuracy" of ["axis", "dut", "epfl_paddle", "foc"];
    /// Outputs that must agree.
    outputs: OfOutputs = OfOutputs(&Output::OF_AN_AXIS);
}

keys! { accuracy_all: "accuracy" of [];
    /// Relative error that each output may have.
    within: Quantity = Quantity::new(&q::RATIO, Within(1e-9, 1e3), Is(0.01));
}
