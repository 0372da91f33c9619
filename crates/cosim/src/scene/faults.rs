//! Faults between device and logic, as a scene asks for them.

/// When something happens.
#[derive(Clone, PartialEq, Debug)]
pub enum Times {
    /// So many times, at random over the run, by its seed.
    Random(u64),
    /// At these times, in seconds.
    At(Vec<f64>),
}

/// A line of the encoder.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum EncoderLine {
    /// Line A.
    A,
    /// Line B.
    B,
}

/// A switch of the bridge.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Switch {
    /// The high one at the motor's plus terminal.
    PlusHigh,
    /// The low one there.
    PlusLow,
    /// The high one at the minus terminal.
    MinusHigh,
    /// The low one there.
    MinusLow,
}

/// A switch that does not follow its gate.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Stuck {
    /// Which.
    pub switch: Switch,
    /// Whether it stays closed, or open.
    pub closed: bool,
    /// From when on, in seconds.
    pub from_s: f64,
    /// Until when; `None` to the end.
    pub to_s: Option<f64>,
}

/// Faults between device and logic: of the encoder's lines, of the bridge's switches, of the clock.
#[derive(Clone, PartialEq, Debug)]
pub struct Faults {
    /// Edges of the encoder that the lines do not show: each the first from that time on.
    pub missed_edge: Times,
    /// Edges after which the lines go one count farther.
    pub doubled_edge: Times,
    /// Clocks from the edge to that.
    pub doubled_clocks: u64,
    /// Edges after which the lines go back and forth.
    pub bounce: Times,
    /// How often they go back.
    pub bounces: u64,
    /// Clocks of a level then, at most: random from 1 on.
    pub bounce_clocks: u64,
    /// A line inverted for some clocks.
    pub glitch: Times,
    /// Which.
    pub glitch_line: EncoderLine,
    /// For how many clocks.
    pub glitch_clocks: u64,
    /// From when on A and B are exchanged, in seconds.
    pub swapped_from_s: Option<f64>,
    /// A line that is inverted, and from when on, in seconds.
    pub inverted: Option<(EncoderLine, f64)>,
    /// Whether the index never comes.
    pub lost_index: bool,
    /// A switch that does not follow its gate.
    pub stuck: Option<Stuck>,
    /// How much earlier than its ideal time a clock edge comes at most, in seconds.
    pub jitter_s: f64,
}
