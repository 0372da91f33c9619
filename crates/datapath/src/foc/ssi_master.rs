//! A master of a synchronous serial interface (SSI): it clocks the word of an encoder out, the highest bit first.
//!
//! - **Frame**: `sclk` rests at 1. `start` lets it fall, which freezes the encoder's word. It then changes every
//!   `DIVIDER` clocks, up to its rising edge `WIDTH + 1`. The encoder puts a bit out at each rising edge; the master
//!   reads it at the falling edge after it. With the last rising edge `word` is loaded. `PAUSE` clocks later `busy`
//!   falls, and another frame may start: by then the encoder must have a new word.
//! - **Ports**: `start`, `data` (0,1,0) in; `sclk` (0,1,0), `word` (0,WIDTH,0), `busy`, `ready` (0,1,0) out. A Gray
//!   code and checks are the user's: the word is all bits of the frame.
//! - **Latency**: `(2 WIDTH + 1) DIVIDER` edges from the edge with `start` to the one that loads `word`.
//! - **Edge**: with `start` while `busy` is 0, a frame begins; `start` is ignored otherwise. `ready` is 1 for one clock
//!   with a new word. `data` is read at the clock's edge itself, through no synchroniser: the encoder has had half a
//!   period of the clock.
//! - **Reset**: idle, `sclk` 1, all else 0. **Overflow**: none.
//! - **VHDL twin**: `hdl/ssi_master.vhd`.
//! - **Source**: common practice of absolute encoders. The default is for 50 MHz: 1 MHz, and a pause of 20 us.
//! - **Differs from the hardware**: pins follow the clock edge, with no delay of drivers and lines.

use hpu_signal::{Format, Word};

use crate::base::config::within;
use crate::base::listed::Listed;
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the master.
    pub struct In of |_: &SsiMaster| {
        start, "A frame begins, unless one is under way";
        data, "Line from the encoder";
    }
    /// Outputs of the master.
    pub struct Out of |block: &SsiMaster| {
        sclk, "Clock of the encoder";
        word: block.word(), "1", "Word of the latest frame";
        busy, "A frame is under way, or the pause behind it";
        ready, "The word is new, for one edge";
    }
}

crate::base::listed::configuration! {
    /// The words and times of a master.
    pub struct SsiMasterConfig {
        /// Bits of a frame.
        width: u32 = 13, ["WIDTH"];
        /// Clocks of half a period of the encoder's clock.
        divider: u32 = 25, ["DIVIDER"];
        /// Clocks before another frame.
        pause: u32 = 1000, ["PAUSE"];
    }
}

/// The registers: the clocks before the next change, the edges of the encoder's clock since the start, the bits that
/// were read, and the outputs.
type State<W> = [W; 7];

/// A master of a synchronous serial interface; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SsiMaster {
    config: SsiMasterConfig,
    state: State<i64>,
}

impl SsiMaster {
    /// Returns a master with this configuration.
    ///
    /// # Errors
    ///
    /// Returns an error unless a frame has 2 to 32 bits and each time is 1 to 65535 clocks.
    pub fn new(config: SsiMasterConfig) -> Result<Self, ConfigError> {
        within(Self::NAME, "WIDTH", config.width, 2..=32)?;
        within(Self::NAME, "DIVIDER", config.divider, 1..=65_535)?;
        within(Self::NAME, "PAUSE", config.pause, 1..=65_535)?;
        let mut block = Self { config, state: [0; 7] };
        Block::reset(&mut block);
        Ok(block)
    }

    fn word(&self) -> Format {
        Format::unsigned(self.config.width)
    }

    /// Returns the registers after an edge.
    #[inline]
    fn next<W: Word>(
        &self,
        [timer, edges, read, sclk, word, busy, _]: State<W>,
        In { start, data }: In<W>,
    ) -> State<W> {
        let SsiMasterConfig { width, divider, pause } = self.config;
        let [zero, one, last] = [0, 1, 2 * i128::from(width) + 1].map(W::int);
        let [half, rest] = [divider, pause].map(|clocks| W::int(i128::from(clocks) - 1));
        let idle = || [timer, edges, read, sclk, word, busy, zero];
        let begins = || [half, zero, read, zero, word, one, zero];
        let waits = || [timer - one, edges, read, sclk, word, busy, zero];
        let clocks = || {
            let shifted = (read.shl(1) + data).wrap(self.word());
            // The edges after the start are counted from 0, and begin with a rising one.
            let read = W::select(edges.bit(0), shifted, read);
            [half, edges + one, read, one - sclk, word, busy, zero]
        };
        let ends = || {
            let loads = || [rest, last, read, one - sclk, read, busy, one];
            let behind = || [timer, edges, read, sclk, word, zero, zero];
            let is_last = edges.equals(last - one);
            W::branch(is_last, loads, behind)
        };
        let acts = || W::branch((last - one).above(edges), clocks, ends);
        let goes_on = || W::branch(timer.is_set(), waits, acts);
        W::branch(busy.is_set(), goes_on, || W::branch(start.is_set(), begins, idle))
    }

    #[inline]
    fn shown(&self) -> Out<i64> {
        let [.., sclk, word, busy, ready] = self.state;
        Out { sclk, word, busy, ready }
    }
}

impl Step for SsiMaster {
    fn registers(&self) -> Vec<Register> {
        let SsiMasterConfig { width, divider, pause } = self.config;
        vec![
            Register::new("timer", Format::unsigned(divider.max(pause).ilog2() + 1)),
            Register::new("edges", Format::unsigned((2 * width + 1).ilog2() + 1)),
            Register::new("incoming", self.word()),
            Register::set("sclk", Format::BIT, 1),
            Register::new("word", self.word()),
            Register::new("busy", Format::BIT),
            Register::new("ready", Format::BIT),
        ]
    }

    fn step<W: Word>(&self, registers: &[W], input: In<W>) -> (Vec<W>, Out<W>) {
        let state: State<W> = registers.try_into().expect("seven registers");
        let [.., sclk, word, busy, ready] = state;
        (self.next(state, input).to_vec(), Out { sclk, word, busy, ready })
    }
}

crate::base::listed::configured!(SsiMaster: SsiMasterConfig);

impl Block for SsiMaster {
    const NAME: &'static str = "ssi_master";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        self.state = [0, 0, 0, 1, 0, 0, 0];
        self.shown()
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        let of = hpu_signal::Machine::<i64>::of;
        self.state = self.next(self.state.map(of), input.map(of)).map(|register| register.narrowed().word);
        self.shown()
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        match self.state {
            [.., 1] => 0,
            [timer, .., 1, _] => timer.unsigned_abs(),
            _ if input.start == 0 => u64::MAX,
            _ => 0,
        }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        let [timer, .., busy, _] = &mut self.state;
        if *busy == 1 {
            *timer -= edges.cast_signed();
        }
    }
}

impl Listed for SsiMaster {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let of = |width, divider, pause| Self::new(SsiMasterConfig { width, divider, pause });
        Ok(vec![("short", of(5, 2, 3)?), ("at_once", of(4, 1, 1)?)])
    }
}
