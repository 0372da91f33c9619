//! Faults between device and logic, as a scene asks for them.

pub(crate) mod read;
pub(crate) mod rows;
mod times;

/// The times at which a fault happens.
#[derive(Clone, PartialEq, Debug)]
pub enum Times {
    /// This number of random times over the run, drawn by its seed.
    Random(u64),
    /// At these times, in seconds.
    At(Vec<f64>),
}

hpu_signal::named! {
    /// A line of the encoder.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum EncoderLine {
        /// Line A.
        A = "encoder.a",
        /// Line B.
        B = "encoder.b",
    }
}

hpu_signal::named! {
    /// A switch of the bridge.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum Switch {
        /// The high switch at the motor's plus terminal.
        PlusHigh = "bridge.plus_high",
        /// The low switch at the plus terminal.
        PlusLow = "bridge.plus_low",
        /// The high switch at the minus terminal.
        MinusHigh = "bridge.minus_high",
        /// The low switch at the minus terminal.
        MinusLow = "bridge.minus_low",
    }
}

/// A switch that does not follow its gate.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Stuck {
    /// The switch.
    pub switch: Switch,
    /// Whether it stays closed; else it stays open.
    pub closed: bool,
    /// The time from which it sticks, in seconds.
    pub from_s: f64,
    /// The time until which it sticks, in seconds; `None`: to the end.
    pub to_s: Option<f64>,
}

/// Faults between device and logic: of the encoder's lines, of the bridge's switches, of the clock.
#[derive(Clone, PartialEq, Debug)]
pub struct Faults {
    /// Edges of the encoder that the lines do not show: for each time, the first edge from then on.
    pub missed_edge: Times,
    /// Edges of the encoder after which the lines go one count farther.
    pub doubled_edge: Times,
    /// Clocks from such an edge to the extra count.
    pub doubled_clocks: u64,
    /// Edges of the encoder after which the lines go back and forth.
    pub bounce: Times,
    /// Number of times that they go back.
    pub bounces: u64,
    /// Greatest duration of a level during a bounce, in clocks: random from 1 on.
    pub bounce_clocks: u64,
    /// Times at which a line is inverted for some clocks.
    pub glitch: Times,
    /// The line of the glitch.
    pub glitch_line: EncoderLine,
    /// Duration of a glitch, in clocks.
    pub glitch_clocks: u64,
    /// The time from which A and B are exchanged, in seconds.
    pub swapped_from_s: Option<f64>,
    /// An inverted line, and the time from which it is inverted, in seconds.
    pub inverted: Option<(EncoderLine, f64)>,
    /// Whether the index never comes.
    pub lost_index: bool,
    /// A switch that does not follow its gate.
    pub stuck: Option<Stuck>,
    /// The most by which a clock edge comes earlier than its ideal time, in seconds.
    pub jitter_s: f64,
}
