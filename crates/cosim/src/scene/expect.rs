//! What a scene expects of its run.

/// The verdict a scene expects.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum OutcomeKind {
    /// It comes to rest.
    Settled,
    /// It keeps swinging.
    LimitCycle,
    /// It swings ever wider.
    Diverged,
    /// A drop test: it rests on the wall.
    Passive,
    /// A drop test: it chatters on the wall.
    NonPassive,
    /// A drop test: it had to be aborted.
    HighlyUnstable,
}

/// What is expected of a run.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Expect {
    /// The verdict.
    pub outcome: Option<OutcomeKind>,
    /// The numbers.
    pub numbers: Vec<Expectation>,
}

/// A number that a run shall give, in SI units.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Expectation {
    /// Which number.
    pub metric: Metric,
    /// What it shall be, in the metric's SI unit.
    pub value: f64,
    /// How far off it may be, in the same unit.
    pub tolerance: f64,
}

/// A number that a run gives.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Metric {
    /// Angle at the end, rad.
    FinalAngle,
    /// Greatest angle in the recorded rows, rad.
    PeakAngle,
    /// Greatest angle beyond the wall in the recorded rows, rad.
    PeakPenetration,
    /// Amplitude of the verdict, rad.
    Amplitude,
    /// Frequency of the verdict, Hz.
    Frequency,
    /// Greatest torque of the motor in the recorded rows, N·m.
    PeakTorque,
    /// Share of the edges on which the spring's product did not fit, 0 to 1.
    SpringOverflowShare,
    /// Changes of the encoder's lines.
    EncoderEdges,
    /// Share of the judged window in which the wall sees penetration, 0 to 1.
    ContactShare,
    /// rms about the steady value at the end of a drop test, m.
    Rms,
}

impl Metric {
    /// Those of an axis.
    pub const OF_AN_AXIS: [Self; 9] = [
        Self::FinalAngle,
        Self::PeakAngle,
        Self::PeakPenetration,
        Self::Amplitude,
        Self::Frequency,
        Self::PeakTorque,
        Self::SpringOverflowShare,
        Self::EncoderEdges,
        Self::ContactShare,
    ];

    /// Its key in a scene.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::FinalAngle => "final_angle",
            Self::PeakAngle => "peak_angle",
            Self::PeakPenetration => "peak_penetration",
            Self::Amplitude => "amplitude",
            Self::Frequency => "frequency",
            Self::PeakTorque => "peak_torque",
            Self::SpringOverflowShare => "spring_overflow_share",
            Self::EncoderEdges => "encoder_edges",
            Self::ContactShare => "contact_share",
            Self::Rms => "rms",
        }
    }
}
