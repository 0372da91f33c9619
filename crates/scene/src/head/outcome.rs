//! The verdicts that a scene can expect.

hpu_signal::named! {
    /// The verdict that a scene expects.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum OutcomeKind {
        /// The motion comes to rest.
        Settled = "settled",
        /// The motion is a limit cycle: it keeps oscillating.
        LimitCycle = "limit_cycle",
        /// The motion oscillates ever wider.
        Diverged = "diverged",
        /// The device is inside the wall, and the wall gives no torque.
        NoWallTorque = "no_wall_torque",
        /// The device rests out of the position counter's reach, so the logic reads another place.
        PositionLost = "position_lost",
        /// The device follows a moving target to the end.
        Tracking = "tracking",
        /// A drop test: the tip rests on the wall.
        Passive = "passive",
        /// A drop test: the tip chatters on the wall.
        NonPassive = "non_passive",
        /// A drop test that had to be aborted.
        HighlyUnstable = "highly_unstable",
        /// The motion may still come to rest: a longer run would tell.
        NotTold = "not_told",
        /// The hand moves nearly to the end of the run.
        HandMoves = "hand_moves",
    }
}

impl OutcomeKind {
    /// Whether the run was long enough to tell how the motion ends.
    pub fn tells(self) -> bool {
        !matches!(self, Self::NotTold | Self::HandMoves)
    }
}
