//! The words between a wiring and the world of an axis: inputs, and the gates or the command.

use hpu_datapath::foc::{FocOut, KnobIn};
use hpu_datapath::paddle::PaddleIn;
use hpu_datapath::{LoopIn, LoopOut};
use hpu_signal::Ports;

use super::AxisWorld;
use crate::world::actuator::Actuator;
use crate::world::encoder::Pins;

/// The inputs of a wiring that an axis's world drives, with the outputs of that wiring. Implemented by those of the
/// haptic loops, of the paddle's, and of the loop behind field-oriented control.
pub trait Placed: Ports<i64> + Copy + PartialEq {
    /// The outputs of the wiring.
    type Out: Ports<i64> + Copy + PartialEq;
    /// Returns the gates of an H-bridge; all 0 of another one.
    fn bridge(out: &Self::Out) -> LoopOut<i64>;
    /// Returns the word that an actuator which takes commands gets.
    fn command(world: &AxisWorld<Self>, out: &Self::Out, words: &[i64]) -> i64;
    /// Writes the present values.
    fn placed(&mut self, world: &AxisWorld<Self>);
    /// Whether these are the present values.
    #[inline]
    fn is_placed(&self, world: &AxisWorld<Self>) -> bool {
        let mut placed = *self;
        placed.placed(world);
        placed == *self
    }
}

/// The part of `impl Placed` that is alike for wirings with an H-bridge.
macro_rules! on_an_h_bridge {
    () => {
        type Out = LoopOut<i64>;

        #[inline(always)]
        fn bridge(out: &LoopOut<i64>) -> LoopOut<i64> {
            *out
        }

        #[inline(always)]
        fn command(world: &AxisWorld<Self>, _: &LoopOut<i64>, words: &[i64]) -> i64 {
            words[world.command]
        }
    };
}

impl Placed for LoopIn<i64> {
    on_an_h_bridge!();

    #[inline]
    fn placed(&mut self, world: &AxisWorld) {
        self.a_pin = world.pins.a;
        self.b_pin = world.pins.b;
        if world.is_scheduled {
            self.stiffness = world.stiffness.unwrap_or(self.stiffness);
            self.scale = world.scale.unwrap_or(self.scale);
            self.reference = world.reference.unwrap_or(self.reference);
        }
    }

    #[inline]
    fn is_placed(&self, world: &AxisWorld) -> bool {
        let Pins { a, b } = world.pins;
        (self.a_pin, self.b_pin) == (a, b)
            && (!world.is_scheduled
                || world.stiffness.is_none_or(|stiffness| stiffness == self.stiffness)
                    && world.scale.is_none_or(|scale| scale == self.scale)
                    && world.reference.is_none_or(|reference| reference == self.reference))
    }
}

impl Placed for PaddleIn<i64> {
    on_an_h_bridge!();

    #[inline]
    fn placed(&mut self, world: &AxisWorld<Self>) {
        self.a_pin = world.pins.a;
        self.b_pin = world.pins.b;
        if let Some(target) = world.reference {
            self.target = target;
        }
        let is_on = world.edge >= world.begins.0;
        [self.proportional, self.integral, self.derivative] = if is_on { world.begins.1 } else { [0; 3] };
        let (Some(sensors), [code, hall, _]) = (&world.sensors, world.read) else { return };
        if let Some(code) = code {
            self.code = sensors.pins()[code][0];
        }
        if let Some(hall) = hall {
            self.hall = sensors.pins()[hall][0];
        }
    }
}

/// Bits of a command to three legs that switch them.
const LEGS: u32 = 6;
/// Bits of a duty in a command to averaged legs, and the duties of open switches.
pub(super) const DUTY: u32 = 16;
pub(super) const OPEN: i64 = (1 << (3 * DUTY)) - 1;

impl Placed for KnobIn<i64> {
    type Out = FocOut<i64>;

    fn bridge(_: &FocOut<i64>) -> LoopOut<i64> {
        LoopOut { a_high: 0, a_low: 0, b_high: 0, b_low: 0 }
    }

    #[inline]
    fn command(world: &AxisWorld<Self>, out: &FocOut<i64>, words: &[i64]) -> i64 {
        let FocOut { a_high, a_low, b_high, b_low, c_high, c_low, trigger } = *out;
        let started = || match trigger {
            0 => 0,
            _ => world.read[..2].iter().flatten().fold(0, |bits, sensor| bits | 1 << sensor),
        };
        match world.plant.actuator {
            Actuator::ThreeLegs => {
                let gates = a_high | a_low << 1 | b_high << 2 | b_low << 3 | c_high << 4 | c_low << 5;
                gates | started() << LEGS
            }
            // The modulator takes the duties at the edge at which it starts the converters.
            Actuator::AveragedLegs { .. } if trigger == 1 && world.edge >= world.begins.0 => {
                let duties = &words[world.command..world.command + 3];
                duties.iter().rev().fold(0, |word, duty| word << DUTY | duty) | started() << (3 * DUTY)
            }
            Actuator::AveragedLegs { .. } => world.commanded.unwrap_or(OPEN) & OPEN | started() << (3 * DUTY),
            _ => words[world.command],
        }
    }

    #[inline]
    fn placed(&mut self, world: &AxisWorld<Self>) {
        self.a_pin = world.pins.a;
        self.b_pin = world.pins.b;
        let Some(sensors) = &world.sensors else { return };
        self.enable = i64::from(world.edge >= world.begins.0);
        for (word, sensor) in [&mut self.i_a, &mut self.i_b, &mut self.code].into_iter().zip(world.read) {
            if let Some(sensor) = sensor {
                *word = sensors.pins()[sensor][0];
            }
        }
    }

    #[inline]
    fn is_placed(&self, world: &AxisWorld<Self>) -> bool {
        let Pins { a, b } = world.pins;
        let Some(sensors) = &world.sensors else { return (self.a_pin, self.b_pin) == (a, b) };
        let is_read = |sensor: Option<usize>, word: i64| sensor.is_none_or(|sensor| sensors.pins()[sensor][0] == word);
        (self.a_pin, self.b_pin) == (a, b)
            && (self.enable != 0) == (world.edge >= world.begins.0)
            && is_read(world.read[0], self.i_a)
            && is_read(world.read[1], self.i_b)
            && is_read(world.read[2], self.code)
    }
}
