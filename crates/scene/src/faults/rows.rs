//! The keys of the faults between device and logic.

use crate::faults::times::OfTimes;
use crate::faults::{EncoderLine, Switch};
use crate::schema::Otherwise::{Is, Said};
use crate::schema::quantity as q;
use crate::schema::quantity::Sense::{NotNegative, Positive};
use crate::schema::{Choice, Flag, Group, Key, Quantity, Whole, keys, named};

/// Clocks that a fault may take.
const MOST_CLOCKS: u64 = 1 << 32;

/// Returns all of these by name, behind `none`.
fn or_none<T: Copy, const N: usize>(all: [T; N], name: fn(T) -> &'static str) -> Vec<(&'static str, Option<T>)> {
    std::iter::once(("none", None)).chain(all.map(|it| (name(it), Some(it)))).collect()
}

keys! { faults: "faults" of [];
    /// Encoder edges that the lines do not show: a number of them at random, by `run.seed`, or the first after each
    /// time.
    missed_edge: OfTimes = OfTimes;
    /// Encoder edges after which the lines go one count farther.
    doubled_edge: OfTimes = OfTimes;
    /// Clock cycles from a doubled edge to the additional one.
    doubled_clocks beside doubled_edge: Whole<u64> = Whole::new(1, MOST_CLOCKS, Is(4));
    /// Encoder edges after which the lines go back and forth.
    bounce: OfTimes = OfTimes;
    /// How often a bouncing line goes back.
    bounces beside bounce: Whole<u64> = Whole::new(1, 1000, Is(3));
    /// Longest level of a bouncing line in clock cycles; each is random from 1 on.
    bounce_clocks beside bounce: Whole<u64> = Whole::new(1, MOST_CLOCKS, Is(50));
    /// Times at which a line is inverted for some clock cycles.
    glitch: OfTimes = OfTimes;
    /// Line of the glitch.
    glitch_line beside glitch: Choice<EncoderLine> =
        Choice::new(|| named(&EncoderLine::ALL, EncoderLine::name), Is(EncoderLine::A));
    /// Length of a glitch in clock cycles.
    glitch_clocks beside glitch: Whole<u64> = Whole::new(1, MOST_CLOCKS, Is(1));
    /// Exchanges lines A and B.
    swapped: Flag = Flag(false);
    /// Time from which the lines are exchanged.
    swapped_from beside swapped: Quantity = Quantity::new(&q::TIME, NotNegative, Is(0.0));
    /// Inverts a line.
    inverted: Choice<Option<EncoderLine>> =
        Choice::new(|| or_none(EncoderLine::ALL, EncoderLine::name), Is(None));
    /// Time from which the line is inverted.
    inverted_from beside inverted: Quantity = Quantity::new(&q::TIME, NotNegative, Is(0.0));
    /// Loses the encoder's index; of a scene with `[dut]`.
    lost_index: Flag = Flag(false);
    /// Switch of the bridge that does not follow its gate.
    stuck_switch: Choice<Option<Switch>> = Choice::new(|| or_none(Switch::ALL, Switch::name), Is(None));
    /// How the switch is stuck.
    stuck beside stuck_switch: Choice<bool> = Choice::new(|| vec![("open", false), ("closed", true)], Is(false));
    /// Time from which the switch is stuck.
    stuck_from beside stuck_switch: Quantity = Quantity::new(&q::TIME, NotNegative, Is(0.0));
    /// Time until which the switch is stuck.
    stuck_to beside stuck_switch: Quantity = Quantity::new(&q::TIME, Positive, Said("the end"));
    /// How much earlier than its ideal time a clock edge comes at most: up to a clock period.
    clock_jitter: Quantity = Quantity::new(&q::TIME, NotNegative, Is(0.0));
}
