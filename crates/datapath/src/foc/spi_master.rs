//! A master of a serial peripheral interface (SPI) for one slave: a word out and a word in, the highest bit first.
//!
//! - **Frame**: `start` lets `select_n` fall. The clock has `2 WIDTH` edges: the first `LEAD` clocks later, the others
//!   `DIVIDER` clocks apart. `TRAIL` clocks after the last one `select_n` rises and `word` is loaded; `GAP` clocks
//!   later `busy` falls, and another frame may start.
//! - **Mode**: the clock rests at `CPOL`. Without `CPHA`, `mosi` has the first bit from the start on; bits are read at
//!   odd edges and change at even ones. With `CPHA`, they change at odd edges and are read at even ones. Behind the
//!   last bit, `mosi` is 0 without `CPHA`, and keeps it with `CPHA`.
//! - **Ports**: `start` (0,1,0), `data` (0,WIDTH,0), read with `start`, `miso` (0,1,0) in; `select_n`, `sclk`, `mosi`
//!   (0,1,0), `word` (0,WIDTH,0), `busy`, `ready` (0,1,0) out. Parity is the user's: both words are all bits of the
//!   frame.
//! - **Latency**: `LEAD + (2 WIDTH - 1) DIVIDER + TRAIL` edges from the edge with `start` to the one that loads `word`.
//! - **Edge**: with `start` while `busy` is 0, a frame begins; `start` is ignored otherwise. `ready` is 1 for one clock
//!   with a new word. `miso` is read at the clock's edge itself, through no synchroniser: the slave has had half a
//!   period of the clock.
//! - **Reset**: idle, `select_n` 1, `sclk` as `CPOL`, all else 0. **Overflow**: none.
//! - **VHDL twin**: `hdl/spi_master.vhd`.
//! - **Source**: common practice. The default is mode 1 with 16 bits, as the angle sensor AS5047P has it, at 50 MHz: a
//!   clock of 8.33 MHz (the sensor takes 10), 360 ns before it and 380 ns between frames.
//! - **Differs from the hardware**: pins follow the clock edge, with no delay of drivers and lines.

use hpu_signal::{Format, Word};

use crate::base::config::within;
use crate::base::listed::Listed;
use crate::{Block, ConfigError, Register, Step};

hpu_signal::ports! {
    /// Inputs of the master.
    pub struct In of |block: &SpiMaster| {
        start, "A frame begins, unless one is under way";
        data: block.word(), "1", "Word to be sent, read with the start";
        miso, "Line from the slave";
    }
    /// Outputs of the master.
    pub struct Out of |block: &SpiMaster| {
        select_n, "0 selects the slave";
        sclk, "Clock of the slave";
        mosi, "Line to the slave";
        word: block.word(), "1", "Word of the latest frame";
        busy, "A frame is under way, or the gap behind it";
        ready, "The word is new, for one edge";
    }
}

crate::base::listed::configuration! {
    /// The words and times of a master.
    pub struct SpiMasterConfig {
        /// Bits of a frame.
        width: u32 = 16, ["WIDTH"];
        /// Clocks of half a period of the slave's clock.
        divider: u32 = 3, ["DIVIDER"];
        /// Clocks from the select to the first edge of the slave's clock.
        lead: u32 = 18, ["LEAD"];
        /// Clocks from the last edge to the end of the select.
        trail: u32 = 4, ["TRAIL"];
        /// Clocks without a select before another frame.
        gap: u32 = 19, ["GAP"];
        /// Level at which the slave's clock rests.
        cpol: bool = false, ["CPOL"];
        /// Whether bits are read at even edges; otherwise at odd ones.
        cpha: bool = true, ["CPHA"];
    }
}

/// The registers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct State<W> {
    /// Clocks before the next change of a pin.
    timer: W,
    /// Edges of the slave's clock since the start, then 1 more in the gap.
    edges: W,
    /// Bits to be sent, the next one on top.
    out: W,
    /// Bits that were read, the latest one below.
    read: W,
    select_n: W,
    sclk: W,
    mosi: W,
    word: W,
    busy: W,
    ready: W,
}

/// A master of a serial peripheral interface; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SpiMaster {
    config: SpiMasterConfig,
    state: State<i64>,
}

impl SpiMaster {
    /// Returns a master with this configuration.
    ///
    /// # Errors
    ///
    /// Returns an error unless a frame has 2 to 32 bits and each time is 1 to 65535 clocks.
    pub fn new(config: SpiMasterConfig) -> Result<Self, ConfigError> {
        within(Self::NAME, "WIDTH", config.width, 2..=32)?;
        let SpiMasterConfig { divider, lead, trail, gap, .. } = config;
        for (name, clocks) in [("DIVIDER", divider), ("LEAD", lead), ("TRAIL", trail), ("GAP", gap)] {
            within(Self::NAME, name, clocks, 1..=65_535)?;
        }
        let mut block = Self { config, state: State::of(&[0; 10]) };
        Block::reset(&mut block);
        Ok(block)
    }

    fn word(&self) -> Format {
        Format::unsigned(self.config.width)
    }

    /// Returns the registers after an edge.
    #[inline]
    fn next<W: Word>(&self, state: State<W>, input: &In<W>) -> State<W> {
        let SpiMasterConfig { width, divider, lead, trail, gap, cpha, .. } = self.config;
        let [zero, one, last] = [0, 1, 2 * i128::from(width)].map(W::int);
        let top = |word: W| W::of_bit(word.bit(width - 1));
        let up = |word: W| word.shl(1).wrap(self.word());
        let wait = |clocks: u32| W::int(i128::from(clocks) - 1);
        let idle = State { ready: zero, ..state };
        let begins = || {
            let (mosi, out) = if cpha { (state.mosi, input.data) } else { (top(input.data), up(input.data)) };
            State { timer: wait(lead), edges: zero, out, mosi, select_n: zero, busy: one, ..idle }.all()
        };
        let waits = || State { timer: state.timer - one, ..idle }.all();
        let clocks = || {
            let read = (state.read.shl(1) + input.miso).wrap(self.word());
            let reads = || State { read, ..idle }.all();
            let shifts = || State { mosi: top(state.out), out: up(state.out), ..idle }.all();
            let is_second = state.edges.bit(0);
            let moved = State::of(&W::branch(if cpha { is_second } else { !is_second }, reads, shifts));
            let edges = state.edges + one;
            let timer = W::select(edges.equals(last), wait(trail), wait(divider));
            State { timer, edges, sclk: one - state.sclk, ..moved }.all()
        };
        let ends = || {
            let (edges, word) = (last + one, state.read);
            State { timer: wait(gap), edges, word, select_n: one, ready: one, ..idle }.all()
        };
        let acts = || {
            let behind = || W::branch(state.edges.equals(last), ends, || State { busy: zero, ..idle }.all());
            W::branch(last.above(state.edges), clocks, behind)
        };
        let goes_on = || W::branch(state.timer.is_set(), waits, acts);
        let starts = || W::branch(input.start.is_set(), begins, || idle.all());
        State::of(&W::branch(state.busy.is_set(), goes_on, starts))
    }

    #[inline]
    fn shown(&self) -> Out<i64> {
        let State { select_n, sclk, mosi, word, busy, ready, .. } = self.state;
        Out { select_n, sclk, mosi, word, busy, ready }
    }
}

impl<W: Copy> State<W> {
    /// Returns the registers in their order.
    #[inline]
    fn all(self) -> [W; 10] {
        let Self { timer, edges, out, read, select_n, sclk, mosi, word, busy, ready } = self;
        [timer, edges, out, read, select_n, sclk, mosi, word, busy, ready]
    }

    #[inline]
    fn of(all: &[W; 10]) -> Self {
        let [timer, edges, out, read, select_n, sclk, mosi, word, busy, ready] = *all;
        Self { timer, edges, out, read, select_n, sclk, mosi, word, busy, ready }
    }
}

impl Step for SpiMaster {
    fn registers(&self) -> Vec<Register> {
        let SpiMasterConfig { width, divider, lead, trail, gap, cpol, .. } = self.config;
        let longest = divider.max(lead).max(trail).max(gap);
        let bit = |name| Register::new(name, Format::BIT);
        let word = |name| Register::new(name, self.word());
        vec![
            Register::new("timer", Format::unsigned(longest.ilog2() + 1)),
            Register::new("edges", Format::unsigned((2 * width + 1).ilog2() + 1)),
            word("outgoing"),
            word("incoming"),
            Register::set("select_n", Format::BIT, 1),
            Register::set("sclk", Format::BIT, cpol.into()),
            bit("mosi"),
            word("word"),
            bit("busy"),
            bit("ready"),
        ]
    }

    fn step<W: Word>(&self, registers: &[W], input: In<W>) -> (Vec<W>, Out<W>) {
        let state = State::of(registers.try_into().expect("ten registers"));
        let State { select_n, sclk, mosi, word, busy, ready, .. } = state;
        (self.next(state, &input).all().to_vec(), Out { select_n, sclk, mosi, word, busy, ready })
    }
}

crate::base::listed::configured!(SpiMaster: SpiMasterConfig);

impl Block for SpiMaster {
    const NAME: &'static str = "spi_master";
    crate::base::block::clocked!();

    fn reset(&mut self) -> Out<i64> {
        self.state = State { select_n: 1, sclk: self.config.cpol.into(), ..State::of(&[0; 10]) };
        self.shown()
    }

    #[inline]
    fn tick(&mut self, input: In<i64>) -> Out<i64> {
        let of = hpu_signal::Machine::<i64>::of;
        let next = self.next(State::of(&self.state.all().map(of)), &input.map(of));
        self.state = State::of(&next.all().map(|register| register.narrowed().word));
        self.shown()
    }

    #[inline]
    fn quiet(&self, input: &In<i64>) -> u64 {
        match self.state {
            State { ready: 1, .. } => 0,
            State { busy: 1, timer, .. } => timer.unsigned_abs(),
            _ if input.start == 0 => u64::MAX,
            _ => 0,
        }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &In<i64>) {
        debug_assert!(edges <= self.quiet(input));
        if self.state.busy == 1 {
            self.state.timer -= edges.cast_signed();
        }
    }
}

impl Listed for SpiMaster {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let short = SpiMasterConfig { width: 5, divider: 1, lead: 2, trail: 3, gap: 4, cpol: false, cpha: false };
        Ok(vec![
            ("mode_0", Self::new(short)?),
            ("mode_1", Self::new(SpiMasterConfig { cpha: true, divider: 2, lead: 1, ..short })?),
            ("mode_2", Self::new(SpiMasterConfig { cpol: true, gap: 1, ..short })?),
            ("mode_3", Self::new(SpiMasterConfig { cpol: true, cpha: true, trail: 1, ..short })?),
        ])
    }
}
