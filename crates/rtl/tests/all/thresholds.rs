//! Directed rows come to every threshold of a block, in every configuration: a threshold that lies one unit higher or
//! lower shows another output in some row. The thresholds are those of the block's equations, which are the VHDL's too:
//! each comparison, clamp and saturation is moved by one unit, one at a time.
//!
//! Covered are the blocks of `BLOCKS` in all listed configurations and in those of `OWN`. Not covered are blocks whose
//! inner thresholds show after long motions only: `foaw`, `levant_differentiator`, `input_shaper`, `trig_cordic`, other
//! blocks of a gimbal and the laws. Proofs hold the VHDL of these to their equations.

use std::cell::Cell;
use std::ops::{Add, Mul, Neg, Sub};

use hpu_cosim::named_block;
use hpu_datapath::{AnyBlock, variants_of};
use hpu_rtl::{Stimulus, generics_label, stimuli};
use hpu_signal::{Equations, Machine, Narrowing, Overflow, Reading, Rounding, Word};

/// The threshold that is moved, counted from 0 in the order of the equations, and by how much its two ends move.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Moved {
    place: usize,
    by: [i128; 2],
}

/// The operation that has a threshold.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    Comparison,
    /// The greater or the lesser of two. If the choice is moved up, it shows the same number.
    Choice,
    Ends,
}

thread_local! {
    static MOVED: Cell<Option<Moved>> = const { Cell::new(None) };
    /// The thresholds met in a reading.
    static MET: Cell<usize> = const { Cell::new(0) };
    static KINDS: Cell<Vec<Kind>> = const { Cell::new(Vec::new()) };
}

/// Returns by how much the ends of the next threshold move.
fn next(kind: Kind) -> [i128; 2] {
    let place = MET.replace(MET.get() + 1);
    let mut kinds = KINDS.take();
    kinds.resize(kinds.len().max(place + 1), kind);
    KINDS.set(kinds);
    MOVED.get().filter(|moved| moved.place == place).map_or([0, 0], |moved| moved.by)
}

/// A word of the machine whose thresholds may be moved.
#[derive(Clone, Copy, Debug)]
struct Mutant(Machine<i128>);

impl Add for Mutant {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl Sub for Mutant {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}

impl Mul for Mutant {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0)
    }
}

impl Neg for Mutant {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Word for Mutant {
    type Bit = bool;

    fn int(value: i128) -> Self {
        Self(Machine::int(value))
    }
    fn of_bit(bit: bool) -> Self {
        Self(Machine::of_bit(bit))
    }
    fn shl(self, bits: u32) -> Self {
        Self(self.0.shl(bits))
    }
    fn shr(self, bits: u32) -> Self {
        Self(self.0.shr(bits))
    }
    fn round(self, rounding: Rounding, drop: i32) -> Self {
        Self(self.0.round(rounding, drop))
    }
    fn narrow(self, rule: &Narrowing) -> Self {
        let whole = self.round(rule.rounding, rule.from_frac - rule.to.frac());
        match rule.overflow {
            Overflow::Wrap => whole.wrap(rule.to),
            Overflow::Saturate => whole.limit(rule.to.min(), rule.to.max()),
        }
    }
    fn wrap(self, to: hpu_signal::Format) -> Self {
        Self(self.0.wrap(to))
    }
    fn at_least(self, other: Self) -> bool {
        let [by, _] = next(Kind::Comparison);
        self.0.at_least(other.0 + Machine::int(by))
    }
    fn equals(self, other: Self) -> bool {
        self.0.equals(other.0)
    }
    fn branch<const N: usize>(bit: bool, yes: impl FnOnce() -> [Self; N], no: impl FnOnce() -> [Self; N]) -> [Self; N] {
        if bit { yes() } else { no() }
    }
    fn look_up<T: Copy + Into<i64>>(self, table: &[T]) -> Self {
        Self(self.0.look_up(table))
    }
    fn lesser(self, other: Self) -> Self {
        let [by, _] = next(Kind::Choice);
        if other.0.at_least(self.0 + Machine::int(by)) { self } else { other }
    }
    fn greater(self, other: Self) -> Self {
        let [by, _] = next(Kind::Choice);
        if self.0.at_least(other.0 + Machine::int(by)) { self } else { other }
    }
    fn limit(self, least: i128, most: i128) -> Self {
        let [lower, upper] = next(Kind::Ends);
        Self(self.0.limit(least + lower, most + upper))
    }
}

/// Reads a block's equations as words of the machine, from its registers and inputs.
struct Read<'b> {
    equations: Equations,
    reading: Reading<Mutant>,
    block: &'b dyn AnyBlock,
    registers: Vec<Option<i64>>,
    formats: Vec<hpu_signal::Format>,
}

impl<'b> Read<'b> {
    fn new(block: &'b dyn AnyBlock) -> Option<Self> {
        let step = block.equations()?;
        let formats = step.registers.iter().map(|register| register.format);
        let formats = formats.chain(block.inputs().iter().map(|signal| signal.format)).collect();
        let registers = step.registers.iter().map(|register| register.reset).collect();
        Some(Self { equations: step.recorded(), reading: Reading::default(), block, registers, formats })
    }

    /// Returns the registers after an edge, and the outputs before it.
    fn step(&mut self, held: &[i64], words: &[i64]) -> (Vec<i64>, Vec<i64>) {
        MET.set(0);
        let given = self.formats.iter().zip(held.iter().chain(words));
        let given: Vec<_> = given.map(|(format, &word)| Mutant(Machine::exact(format.value(word)))).collect();
        let read = self.equations.read_in(&mut self.reading, &given);
        let mut next: Vec<_> = read.iter().map(|word| word.0.narrowed().word).collect();
        let shown = next.split_off(held.len());
        (next, shown)
    }

    /// Returns the number of rows up to the first in which outputs differ from these; `None` when all are equal.
    fn differs(&mut self, rows: &[Stimulus], expected: &[Vec<i64>]) -> Option<usize> {
        let mut held: Vec<i64> = self.registers.iter().map(|reset| reset.unwrap_or(0)).collect();
        let clocked = self.block.clocked();
        // An output that an input reaches without a register sees that input as 0 in a reset.
        let zeros = vec![0; self.block.inputs().len()];
        (0..rows.len()).find(|&row| {
            let Stimulus { rst, words } = &rows[row];
            if clocked && *rst {
                let set = held.iter().zip(&self.registers).map(|(&held, reset)| reset.unwrap_or(held));
                held = set.collect();
            } else if clocked {
                held = self.step(&held, words).0;
            }
            self.step(&held, if clocked && *rst { &zeros } else { words }).1 != expected[row]
        })
    }
}

/// Returns the moved thresholds of a block that its directed rows do not tell from those that are right.
fn survivors(block: &mut dyn AnyBlock) -> (usize, Vec<Moved>) {
    let rows = stimuli::directed(block);
    block.reset();
    let expected: Vec<_> =
        rows.iter().map(|row| if row.rst { block.reset() } else { block.tick(&row.words) }).collect();
    block.reset();
    let Some(mut read) = Read::new(block) else { return (0, Vec::new()) };
    MOVED.set(None);
    KINDS.take();
    assert_eq!(read.differs(&rows, &expected), None, "{}", block.name());
    let kinds = KINDS.take();
    let mutants = kinds.iter().enumerate().flat_map(|(place, kind)| {
        let all: &[[i128; 2]] = match kind {
            Kind::Comparison => &[[1, 0], [-1, 0]],
            Kind::Choice => &[[-1, 0]],
            Kind::Ends => &[[1, 0], [-1, 0], [0, 1], [0, -1]],
        };
        all.iter().map(move |&by| Moved { place, by })
    });
    let mutants: Vec<_> = mutants.collect();
    let count = mutants.len();
    let alive = mutants.into_iter().filter(|moved| {
        MOVED.set(Some(*moved));
        read.reading = Reading::default();
        read.differs(&rows, &expected).is_none()
    });
    let alive = alive.collect();
    MOVED.set(None);
    (count, alive)
}

/// Blocks whose thresholds are seen after a few edges. A table's address has none.
const BLOCKS: [&str; 23] = [
    "unilateral",
    "sample_timer",
    "sample_register",
    "command_register",
    "fractional_difference",
    "truncating_multiplier",
    "velocity_register",
    "zero_order_hold",
    "torque_sum",
    "saturator",
    "command_limiter",
    "pwm",
    "sequential_divider",
    "square_root",
    "cordic",
    "biquad",
    "filtered_difference",
    "window_difference",
    "edge_timer",
    "cube_room",
    "phantom_torque",
    "command_scaler",
    "servo_control",
];

/// Configurations beside the listed ones.
const OWN: [(&str, &[(&str, &str)]); 7] = [
    ("unilateral", &[("WIDTH", "14")]),
    ("saturator", &[("IN_WIDTH", "9"), ("OUT_WIDTH", "7"), ("LIMIT", "37")]),
    ("saturator", &[("IN_WIDTH", "30"), ("OUT_WIDTH", "24"), ("LIMIT", "4000001")]),
    ("command_limiter", &[("LIMIT", "1001"), ("SETTLING", "3")]),
    ("truncating_multiplier", &[("A_WIDTH", "10"), ("B_WIDTH", "23"), ("A_SIGNED", "true"), ("OUT_WIDTH", "21")]),
    ("velocity_register", &[("WIDTH", "19"), ("OUT_WIDTH", "7")]),
    ("pwm", &[("WIDTH", "5"), ("DEAD_TIME", "2")]),
];

/// Thresholds that may lie one unit off without a difference: the ends of a clamp that no value comes to, and choices
/// between equal words.
fn is_equal(name: &str, label: &str, Moved { place, by }: Moved) -> bool {
    match (name, label) {
        // A product of unsigned factors is never below 0, nor is a quotient.
        ("truncating_multiplier", "default" | "saturate_fraction") | ("sequential_divider", _) if by == [-1, 0] => true,
        // A quotient without fraction bits is no greater than its numerator.
        ("sequential_divider", "integer" | "wide") => (place, by) == (1, [0, 1]),
        // The velocity's word is as wide as the difference, or wider.
        ("velocity_register", "default" | "8_bit") => place == 1 && (by == [-1, 0] || by == [0, 1]),
        ("velocity_register", "wide") => place == 1,
        // Both ends are 0.
        ("saturator", "limit_0") => true,
        // A command of 0 has no pulse, and one of 1 none that outlasts the dead time.
        ("pwm", "dead_time_floating") => place == 2,
        ("pwm", _) => (place, by) == (2, [1, 0]),
        // A vector on the axis turns either way to words that are the same when they are coarse.
        ("cordic", "coarse") => (place, by) == (0, [1, 0]),
        // Its output has two integer bits more than its input and a gain of 1; a high-pass stays within its word.
        ("biquad", "default" | "high_pass") => place == 1,
        // On a wall, or beyond it by 0, there is no depth.
        ("cube_room", _) => [1, 4, 7].contains(&place) && by == [1, 0],
        // Its command is wider than the greatest torque needs.
        ("command_scaler", "aligned") => true,
        // Asked only where the position moves, so never about 0.
        ("edge_timer", _) => (place, by) == (0, [1, 0]),
        _ => false,
    }
}

#[test]
fn directed_rows_see_every_threshold_that_is_off_by_one_in_every_configuration() {
    let mut total = 0;
    let mut all = Vec::new();
    for name in BLOCKS {
        let listed = variants_of(|one| one == name).into_iter();
        let own = OWN.iter().filter(|(one, _)| *one == name).map(|(_, generics)| {
            let generics: Vec<_> = generics.iter().map(|(name, value)| (name.to_string(), value.to_string())).collect();
            (generics_label(&generics), named_block(name, &generics).expect("its generics"))
        });
        for (label, mut block) in listed.chain(own.collect::<Vec<_>>()) {
            let (count, alive) = survivors(&mut *block);
            total += count;
            let seen = alive.into_iter().filter(|moved| !is_equal(name, &label, *moved));
            all.extend(seen.map(|moved| format!("{name} {label}: {} by {:?}", moved.place, moved.by)));
        }
    }
    assert!(total > 400, "{total}");
    assert!(all.is_empty(), "{total} mutants; alive:\n{}", all.join("\n"));
}
