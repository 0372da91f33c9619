//! A table of torques over the position, with a wall as its end stop: detents, textures.
//!
//! - **Equation**: at a sample edge, with `n = position mod 2^(TABLE_BITS + SHIFT)`, `i = floor(n / 2^SHIFT)` and
//!   `part = n - i 2^SHIFT`: `texture' = T(i) + floor((T(i+1) - T(i)) part / 2^SHIFT)`, where `T(2^TABLE_BITS)` is
//!   `T0`; `torque' = clamp(wanted + texture')`. `wanted = clamp(spring + drag)` as every law has it, with the motion
//!   since the last sample: `spring = min(floor(penetration * stiffness), top)` and `drag = floor(damping * d)`, within
//!   `-top - 1 .. top`, inside the wall, 0 outside.
//! - **Ports**: those of every law; `scale` and `delta` are ignored. `memory` (1,TORQUE_WIDTH,0): the texture.
//! - **Latency**: 1 edge: the sample edge loads torque and memory.
//! - **Edge**: with the countdown at 0, everything is loaded and the countdown restarts at `max(period,1) - 1`; else it
//!   counts down. A new period takes effect at the next sample edge.
//! - **Reset**: everything 0; the first edge samples.
//! - **Overflow**: the torque saturates.
//! - **VHDL twin**: `hdl/torque_table.vhd`.
//! - **Source**: straight lines between the entries of a table, as of every textbook.
//! - **Differs from the hardware**: all products take one edge, so no limit on the clock.

use hpu_signal::{Format, Machine, Narrowed, Narrowing, Overflow, Rounding, Signal, Word};

use crate::base::config::within;
use crate::base::countdown::{Countdown, edges};
use crate::base::law::{Wanted, ZERO, shown};
use crate::base::listed::Listed;
use crate::methods::method_variants::{InLoops, bare, distinct, shaped, short};
use crate::step::counted_down;
use crate::{Block, ClockEdge, ConfigError, Generic, Law, LawIn, LawOut, LawWidths, MethodLoop, Register, Step};

/// The most torques of a table.
pub const MOST_TORQUES: usize = 32;

/// A sine of 200 PWM counts in 16 torques: a detent at 0.
const DETENT: [i32; MOST_TORQUES] = {
    let quarter = [0, 77, 141, 185, 200];
    let mut all = [0; MOST_TORQUES];
    let mut at = 0;
    while at < 16 {
        let half = if at % 8 > 4 { 8 - at % 8 } else { at % 8 };
        all[at] = if at < 8 { quarter[half] } else { -quarter[half] };
        at += 1;
    }
    all
};

crate::base::listed::configuration! {
    /// The widths and torques of a table.
    pub struct TableConfig {
        /// The widths and formats that every law has.
        widths: LawWidths = LawWidths::default(), [];
        /// Exponent of the number of torques.
        table_bits: u32 = 4, ["TABLE_BITS"];
        /// Exponent of the counts from one torque to the next.
        shift: u32 = 4, ["SHIFT"];
        /// The torques towards smaller counts, in PWM counts; those beyond `2^table_bits` are ignored.
        torques: [i32; MOST_TORQUES] = DETENT, [
            "T0", "T1", "T2", "T3", "T4", "T5", "T6", "T7", "T8", "T9", "T10", "T11", "T12", "T13", "T14",
            "T15", "T16", "T17", "T18", "T19", "T20", "T21", "T22", "T23", "T24", "T25", "T26", "T27", "T28",
            "T29", "T30", "T31"
        ];
    }
}

hpu_signal::ports! {
    /// The registers that a sample edge loads.
    pub struct Registers { previous, texture, torque }
}

const RESET: Registers<Narrowed> = Registers { previous: ZERO, texture: ZERO, torque: ZERO };

/// A table of torques; the [module](self) describes it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TorqueTable {
    config: TableConfig,
    motion: Format,
    wanted: Wanted,
    texture: Narrowing,
    fits_64: bool,
    countdown: Countdown,
    latest: Registers<Narrowed>,
}

impl TorqueTable {
    /// Returns a table with these widths and torques.
    ///
    /// # Errors
    ///
    /// Returns an error unless the widths pass [`LawWidths::check`], there are 2 to 32 torques, the position repeats
    /// them at least once, and the bridge can show each.
    pub fn new(config: TableConfig) -> Result<Self, ConfigError> {
        let TableConfig { widths, table_bits, shift, torques } = config;
        widths.check(Self::NAME)?;
        within(Self::NAME, "TABLE_BITS", table_bits, 1..=MOST_TORQUES.trailing_zeros().min(widths.width))?;
        within(Self::NAME, "SHIFT", shift, 0..=widths.width - table_bits)?;
        let top = widths.top();
        if let Some(at) = torques.iter().position(|&torque| i64::from(torque).abs() > top) {
            let found = format!("T{at} is {}", torques[at]);
            return Err(ConfigError::new(Self::NAME, found, format!("-{top} to {top}")));
        }
        let mut block = Self {
            config,
            motion: Format::signed(widths.width),
            wanted: Wanted::new(&widths),
            texture: Narrowing {
                from_frac: shift.cast_signed(),
                to: Format::signed(widths.torque_width + 1),
                rounding: Rounding::Truncate,
                overflow: Overflow::Saturate,
            },
            fits_64: false,
            countdown: Countdown::default(),
            latest: RESET,
        };
        block.fits_64 = Step::fits_64(&block);
        Ok(block)
    }

    /// Returns the widths and the torques.
    pub fn config(&self) -> &TableConfig {
        &self.config
    }

    /// Computes the torque of the table at a position.
    #[inline]
    fn texture<W: Word>(&self, position: W) -> W {
        let TableConfig { table_bits, shift, ref torques, .. } = self.config;
        let torques = &torques[..1 << table_bits];
        let whole = position.shr(shift);
        let index = whole.wrap(Format::unsigned(table_bits));
        let next = (index + W::int(1)).wrap(Format::unsigned(table_bits));
        let part = position - whole.shl(shift);
        let (here, there) = (index.look_up(torques), next.look_up(torques));
        (here.shl(shift) + (there - here) * part).narrow(&self.texture)
    }

    /// Computes the registers after a sample edge.
    #[inline]
    fn made<W: Word>(&self, input: LawIn<W>, previous: W) -> Registers<W> {
        let motion = (input.position - previous.shed()).wrap(self.motion);
        let texture = self.texture(input.position).cut("texture", self.texture.to.width());
        let total = self.wanted.torque(&input, motion) + texture.shed();
        Registers { previous: input.position, texture, torque: shown(total, self.config.widths.top()) }
    }

    /// Returns the registers that a sample edge would load now.
    #[inline]
    fn sample(&self, input: &LawIn<i64>, previous: i64) -> Registers<Narrowed> {
        if self.fits_64 {
            self.made(input.map(Machine::<i64>::of), Machine::of(previous)).map(Machine::narrowed)
        } else {
            self.made(input.map(Machine::<i128>::of), Machine::of(previous)).map(Machine::narrowed)
        }
    }

    #[inline]
    fn shown(&self) -> LawOut<Narrowed> {
        LawOut { torque: self.latest.torque, memory: self.latest.texture }
    }
}

impl Step for TorqueTable {
    fn registers(&self) -> Vec<Register> {
        let LawWidths { width, period_width, .. } = self.config.widths;
        vec![
            Register::new("countdown", Format::unsigned(period_width)),
            Register::new("previous", Format::unsigned(width)),
            Register::new("memory", self.texture.to),
            Register::new("torque", self.config.widths.torque()),
        ]
    }

    fn step<W: Word>(&self, registers: &[W], input: LawIn<W>) -> (Vec<W>, LawOut<W>) {
        let [left, previous, texture, torque] = *registers else { unreachable!("four registers") };
        let (left, samples) = counted_down(left, input.period);
        let sampled = || {
            let Registers { previous, texture, torque } = self.made(input, previous);
            [previous, texture, torque]
        };
        let next = W::branch(samples, sampled, || [previous, texture, torque]);
        ([&[left][..], &next].concat(), LawOut { torque, memory: texture })
    }
}

crate::base::listed::configured!(TorqueTable: TableConfig);

impl Law for TorqueTable {
    const LOOP: &'static str = "torque_table_loop";

    crate::base::law::law_config!();

    fn latency(&self) -> u32 {
        1
    }

    fn lost(&self) -> [(bool, bool); 2] {
        self.shown().lost()
    }
}

impl Block for TorqueTable {
    const NAME: &'static str = "torque_table";
    crate::base::law::law_ports!(self => self.texture.to, "PWM count", "Torque of the table");

    fn equations(&self) -> Option<ClockEdge<'_>> {
        Some(ClockEdge::of(self))
    }

    fn reset(&mut self) -> LawOut<i64> {
        self.countdown = Countdown::default();
        self.latest = RESET;
        self.shown().words()
    }

    #[inline]
    fn tick(&mut self, input: LawIn<i64>) -> LawOut<i64> {
        if self.countdown.tick(input.period) {
            self.latest = self.sample(&input, self.latest.previous.word);
        }
        self.shown().words()
    }

    #[inline]
    fn quiet(&self, input: &LawIn<i64>) -> u64 {
        let same = |previous: i64| {
            let Registers { texture, torque, .. } = self.sample(input, previous);
            torque == self.latest.torque && texture == self.latest.texture
        };
        // The next sample takes in the motion, every later one none.
        if !same(self.latest.previous.word) {
            self.countdown.left()
        } else if !same(input.position) {
            self.countdown.left() + edges(input.period)
        } else {
            u64::MAX
        }
    }

    #[inline]
    fn skip(&mut self, edges: u64, input: &LawIn<i64>) {
        debug_assert!(edges <= self.quiet(input));
        if self.countdown.skip(edges, input.period) {
            // After the first of the samples that were skipped, another one changes nothing.
            self.latest = self.sample(input, self.latest.previous.word);
        }
    }
}

impl Listed for TorqueTable {
    fn variants() -> Result<Vec<(&'static str, Self)>, ConfigError> {
        let narrow = |table_bits, shift| {
            let torques = DETENT.map(|torque| torque * 63 / 200);
            Self::new(TableConfig { widths: short(), table_bits, shift, torques })
        };
        let others = TableConfig { widths: distinct(), table_bits: 2, shift: 6, torques: apart() };
        Ok(vec![
            ("8_bit", narrow(4, 3)?),
            ("steps", narrow(3, 0)?),
            ("whole_range", narrow(4, 4)?),
            ("distinct", Self::new(others)?),
        ])
    }
}

/// Returns torques of which no two are the same.
fn apart() -> [i32; MOST_TORQUES] {
    let mut at = 0;
    [0; MOST_TORQUES].map(|_| {
        at += 1;
        (at * 617) % 1999 - 999
    })
}

impl InLoops for TorqueTable {
    fn loops() -> Result<Vec<(&'static str, MethodLoop<Self>)>, ConfigError> {
        let torques = DETENT.map(|torque| torque * 63 / 200);
        let narrow = Self::new(TableConfig { widths: short(), table_bits: 4, shift: 1, torques })?;
        let phase = narrow.latency() + 1;
        let others = TableConfig { widths: distinct(), table_bits: 2, shift: 6, torques: apart() };
        Ok(vec![("8_bit", shaped(narrow, phase)?), ("distinct", bare(Self::new(others)?)?)])
    }
}
