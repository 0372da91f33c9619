//! What a run tells of the time after its end.
//!
//! A verdict is an observation over a window. Two things tell more. A state that comes back to the last bit repeats for
//! ever ([`Recurrence`](crate::Recurrence)). And where the latest count has passed through all registers, the logic
//! changes nothing but the modulator's pulses until the next count arrives: if the motion under these pulses is proved
//! to stay within the count, no count ever arrives.

use hpu_datapath::Instance;
use hpu_plant::Standing;

/// A run's state at one clock edge was, to the last bit, that at an earlier one.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Recurrence {
    /// The earlier edge. The state may have recurred before, which was not looked at.
    pub from: u64,
    /// The clock edges from one to the other. It may be a multiple of the least period.
    pub period: u64,
}

/// A device under outputs that repeat for ever as long as no count arrives.
#[derive(Clone, PartialEq, Debug)]
pub struct Rest {
    /// The clock edge.
    pub edge: u64,
    /// The angles in rad between which the encoder's count stays, and the width of a count.
    pub band_rad: [f64; 2],
    /// The state of the device at that edge.
    pub standing: Standing,
    /// The voltages from that edge on, as shares of the supply, each with the clocks for which it lasts.
    pub lead: Vec<(f64, u64)>,
    /// The voltages after them, which repeat; one that lasts for `u64::MAX` clocks stays.
    pub cycle: Vec<(f64, u64)>,
}

/// The proof that no count arrives after an edge.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Quiet {
    /// The edge from which on it holds.
    pub from_edge: u64,
    /// Whether friction holds the shaft for ever, so that nothing moves.
    pub is_stuck: bool,
    /// The least distance to a neighbouring count, in counts; of a stuck shaft that to the end of friction, as a share
    /// of it.
    pub margin: f64,
    /// A bound of the half of the range of the motion to come, in counts, when what is left of the motion before has
    /// died out: the ripple of the pulses.
    pub ripple_counts: f64,
}

/// The proof that a wall stays in contact from a state on, with bounds of its motion.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct InContact {
    /// The edge of the state.
    pub from_edge: u64,
    /// The clock edges of the window that begins there.
    pub edges: u64,
    /// A bound of the rms of the angle about its rest over that window, in counts. Of later windows none is told.
    pub rms_counts: f64,
    /// A bound of the angle's distance from its rest from that state on, for ever, in counts.
    pub half_range_counts: f64,
    /// A bound of the rms in the long run, in counts.
    pub long_run_counts: f64,
}

/// The events of a period after which the emulator's state came back.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Period {
    /// Its clock edges.
    pub edges: u64,
    /// Edges at which the logic was computed or a count arrived.
    pub events: u64,
    /// Changes of mode, as by friction.
    pub mode_changes: u64,
    /// Decisions for which `f64` was not exact enough; see [`Summary::redecided`](crate::Summary::redecided).
    pub redecided: u64,
    /// The angle in rad at its end.
    pub angle_rad: f64,
}

/// How a run goes on for ever, if the hand stays where it is at the end.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Forever {
    /// No count of the encoder ever arrives.
    Quiet(Quiet),
    /// The run repeats, in all nets that the device depends on.
    Recurs {
        /// The states that are equal.
        recurrence: Recurrence,
        /// The rms of the position about its mean over a period, in encoder counts.
        rms_counts: f64,
        /// The distance in counts within which a motion of real numbers, without the emulator's rounding, repeats with
        /// the same period and the same words; or why none is told.
        model_counts: Result<f64, &'static str>,
    },
    /// The output stays within bounds, whatever its words round away.
    Bounded {
        /// The edge from which on it does.
        from_edge: u64,
        /// The least and the greatest output.
        ends: [f64; 2],
        /// Its greatest distance from its rest at the samples, when what is left of the motion before has died out, in
        /// counts: in steps of the ADC.
        off_counts: f64,
    },
    /// The wall stays in contact for ever, and the rms over one window is bounded.
    InContact(InContact),
    /// The plant leaves for ever, whatever drives it.
    Grows {
        /// The edge from which on it does.
        from_edge: u64,
        /// The factor by which it grows from sample to sample by itself, at least.
        growth: f64,
    },
}

/// Why nothing is told of the time after a run.
pub type NotTold = String;

/// Returns the nets on which those of a set depend, bit `n` net `n`, in a wiring of these instances whose first nets
/// are inputs: those with a word keep it.
pub type Live<'a> = dyn Fn(&[Instance], &[Option<i64>], u64) -> u64 + Sync + 'a;

/// The question how a run goes on for ever.
pub struct Beyond<'a> {
    /// The clock edges after the end of the run up to which a recurrence is looked for.
    pub edges: u64,
    /// The nets that gates and device depend on.
    pub live: &'a Live<'a>,
    /// The proof that a device at rest stays there, or why there is none.
    pub prove: &'a (dyn Fn(&Rest) -> Result<Quiet, String> + Sync),
    /// The clocks until the modulator next reads the encoder, of a device under outputs that last until a pulse begins,
    /// and the pulse; or why [`window`](Self::window) has no proof.
    pub until_read: &'a (dyn Fn(&Rest) -> Result<u64, String> + Sync),
    /// The proof that the wall stays in contact from such a state on, where the modulator reads the encoder; or why
    /// there is none.
    pub window: &'a (dyn Fn(&Rest) -> Result<InContact, String> + Sync),
    /// The proof that a motion of real numbers repeats as the emulator does, within so many counts; or why there is
    /// none.
    pub follow: &'a (dyn Fn(&Period) -> Result<f64, &'static str> + Sync),
    /// The proof how the words of a plant as a transfer function go on, which are looked at up to this edge; or why
    /// there is none.
    pub words: &'a (dyn Fn(u64) -> Result<Forever, NotTold> + Sync),
}
