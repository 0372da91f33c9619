//! Computes kinematics, room, Jacobian and scaling by one multiplier, one product an edge.
//!
//! - **Equation**: word for word that of `phantom_forward`, `cube_room`, `phantom_torque` and one `command_scaler` a
//!   joint, of the inputs as the computation has captured them.
//! - **Ports**: `sine1` `cosine1` `sine2` `cosine2` `sine3` `cosine3` (1,TRIG_INT,TRIG_FRAC), `valid1` `valid2`
//!   `valid3`, `x_low` `x_high` `y_low` `y_high` `z_low` `z_high` (1,POSITION_INT,POSITION_FRAC), `room` (0,3,0),
//!   `stiffness` (0,STIFFNESS_INT,STIFFNESS_FRAC), `period` (0,PERIOD_WIDTH,0) in clocks, 0 acts as 1, in; `x` `y` `z`
//!   `radius`, `force_x` `force_y` `force_z` (1,FORCE_INT,FORCE_FRAC), `contact` (0,3,0), `torque1` `torque2` `torque3`
//!   (1,TORQUE_INT,TORQUE_FRAC), `command1` `command2` `command3` (1,COMMAND_WIDTH-1,0) out.
//! - **Latency**: 32 edges from the capture to the outputs, which change all at once.
//! - **Edge**: with the countdown at 0, the inputs are captured, the computation starts (a running one is given up,
//!   even on its last edge: periods up to 32 never show a result), and the countdown restarts at `max(period,1) - 1`;
//!   else it counts down and the computation goes on.
//! - **Reset**: outputs 0, nothing running, countdown `DELAY`, so that it captures `DELAY` edges after the samples of a
//!   `sample_register` with the same period.
//! - **Overflow**: as in the blocks it replaces.
//! - **VHDL twin**: `hdl/phantom_engine.vhd`.
//! - **Source**: a shared datapath as a smaller FPGA would need for Sevcik et al. 2009.
//! - **Differs from the hardware**: the paper does not say how its logic is shared. The emulator computes the words at
//!   the start edge and shows them 32 edges later: the ports are exact at every edge, the registers of the multiplier
//!   are not modelled.

use hpu_signal::{Format, Narrowed, Ports, Signal};

use super::Config;
use super::force_path::{self, ForcePath, path};
use super::variants::paths;
use crate::base::config::{COUNTER, within};
use crate::base::countdown::{Countdown, edges};
use crate::base::listed::{Configured, Given, Listed};
use crate::base::words::natural;
use crate::circuit::part::exact;
use crate::{Block, ConfigError, Generic, Instance};

hpu_signal::ports! {
    /// Inputs of the engine.
    pub struct In of |block: &PhantomEngine| {
        sine1 = block.path.forward.inputs().sine1;
        cosine1 = block.path.forward.inputs().cosine1;
        sine2 = block.path.forward.inputs().sine2;
        cosine2 = block.path.forward.inputs().cosine2;
        sine3 = block.path.forward.inputs().sine3;
        cosine3 = block.path.forward.inputs().cosine3;
        valid1 = block.path.scale[0].inputs().valid1;
        valid2 = block.path.scale[0].inputs().valid2;
        valid3 = block.path.scale[0].inputs().valid3;
        x_low = block.path.room_walls.inputs().x_low;
        x_high = block.path.room_walls.inputs().x_high;
        y_low = block.path.room_walls.inputs().y_low;
        y_high = block.path.room_walls.inputs().y_high;
        z_low = block.path.room_walls.inputs().z_low;
        z_high = block.path.room_walls.inputs().z_high;
        room = block.path.room_walls.inputs().room;
        stiffness = block.path.room_walls.inputs().stiffness;
        period: Format::unsigned(block.config.period_width), "clock", "Sample period; 0 acts as 1";
    }
}

pub use super::force_path::Out;

/// Edges from the capture of the inputs to the outputs.
pub const LATENCY: u64 = 32;

/// See the [module](self).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PhantomEngine {
    config: Config,
    path: ForcePath,
    countdown: Countdown,
    /// The inputs that the latest computation captured; `None` since reset. `next` is its result, shown or not.
    captured: Option<force_path::In<i64>>,
    next: Out<Narrowed>,
    /// Edges until the computation is done; 0 when none is running.
    left: u64,
    out: Out<Narrowed>,
}

impl PhantomEngine {
    /// Returns an engine for that PHANToM, `config.delay` edges behind the samples.
    ///
    /// # Errors
    ///
    /// Returns an error when one of the blocks that it replaces refuses its words, and unless the period has 2 to 30
    /// bits and the delay is at most `2^16`.
    pub fn new(config: Config) -> Result<Self, ConfigError> {
        within(Self::NAME, "PERIOD_WIDTH", config.period_width, COUNTER)?;
        within(Self::NAME, "DELAY", config.delay, 0..=1 << 16)?;
        let zero = Out::build(|| exact(0));
        Ok(Self {
            config,
            path: ForcePath::new(&config)?,
            countdown: Countdown::after(config.delay),
            captured: None,
            next: zero,
            left: 0,
            out: zero,
        })
    }

    /// Returns the outputs, each with the bits that were lost to make it.
    #[inline]
    pub fn latest(&self) -> &Out<Narrowed> {
        &self.out
    }
}

impl In<i64> {
    /// Returns the inputs that a computation captures: all but the period, which comes last.
    #[inline]
    fn captured(&self) -> force_path::In<i64> {
        let mut words = [0; 18];
        let mut next = words.iter_mut();
        self.each(|word| *next.next().expect("18 words") = *word);
        let mut words = words.iter();
        force_path::In::build(|| *words.next().expect("17 words"))
    }
}

crate::base::block::data_sheet!(PhantomEngine = Self::new(Config::default().shared()));

impl Block for PhantomEngine {
    const NAME: &'static str = "phantom_engine";
    const CLOCKED: bool = true;
    type In<T> = In<T>;
    type Out<T> = Out<T>;

    fn inputs(&self) -> In<Signal> {
        In::of(self)
    }

    fn outputs(&self) -> Out<Signal> {
        Out::of(&self.path)
    }

    fn generics(&self) -> Vec<(&'static str, Generic)> {
        let mut all = vec![natural("PERIOD_WIDTH", self.config.period_width), natural("DELAY", self.config.delay)];
        all.extend(self.config.path_generics());
        all
    }

    fn inside(&self) -> Vec<Instance> {
        // The ports are six sines, three validities, eight words of the scene, the period, and the outputs.
        let ports: Vec<usize> = (0..18 + 14).collect();
        path(&self.path, &ports[..6], &ports[6..9], &ports[9..17], &ports[18..])
    }

    fn first_shown(&self) -> Option<u64> {
        // The first edge samples if there is no delay.
        Some(1 + u64::from(self.config.delay) + LATENCY)
    }

    fn reset(&mut self) -> Out<i64> {
        self.countdown = Countdown::after(self.config.delay);
        self.captured = None;
        self.next = Out::build(|| exact(0));
        self.left = 0;
        self.out = self.next;
        Out::build(|| 0)
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        if self.countdown.tick(input.period) {
            let captured = input.captured();
            if self.captured != Some(captured) {
                self.next = self.path.eval(&captured);
                self.captured = Some(captured);
            }
            self.left = LATENCY;
        } else if self.left > 0 {
            self.left -= 1;
            if self.left == 0 {
                self.out = self.next;
            }
        }
        self.out.map(|port| port.word)
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        let start = self.countdown.left();
        let changes = self.next != self.out;
        if changes && self.left > 0 && self.left <= start {
            return self.left - 1;
        }
        if self.captured != Some(input.captured()) {
            return start;
        }
        // Every computation from the next one on captures the same inputs.
        if changes && edges(input.period) > LATENCY { start + LATENCY } else { u64::MAX }
    }

    #[inline]
    fn skip(&mut self, count: u64, input: &In<i64>) {
        debug_assert!(count <= self.quiet(input));
        self.left = if self.countdown.skip(count, input.period) {
            let since_start = edges(input.period) - 1 - self.countdown.left();
            LATENCY.saturating_sub(since_start)
        } else {
            self.left.saturating_sub(count)
        };
    }
}

crate::circuit::part::registers!(PhantomEngine, self => *self.latest());

impl Configured for PhantomEngine {
    fn of_generics(given: &Given) -> Result<Self, ConfigError> {
        Self::new(Config::given(given)?)
    }
}

impl Listed for PhantomEngine {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        paths().into_iter().map(|(label, config)| Ok((label, Self::new(config)?))).collect()
    }
}
