//! A block's arithmetic and its clock edge over any [`Word`]: written once, read by machines and by solvers.

use hpu_signal::{Format, Machine, Ports, Reach, Signal, Term, Word};

use crate::block::flatten;
use crate::{AnyBlock, Block};

/// A block without registers.
pub trait Combinational: Block {
    /// The outputs of these inputs.
    fn made<W: Word>(&self, input: Self::In<W>) -> Self::Out<W>;
}

/// A register of a block, or bits of one: its twin in VHDL is a variable or an output.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Register {
    /// Name of the variable or the output.
    pub name: &'static str,
    /// Its lowest bit among those of the variable, which may be an array or a record.
    pub low: u32,
    /// Its format: every word that it can hold has it.
    pub format: Format,
    /// Its word after a reset; none where the reset does not set it, and the block loads it before it reads it.
    pub reset: Option<i64>,
}

impl Register {
    /// A whole variable, 0 after a reset.
    pub(crate) fn new(name: &'static str, format: Format) -> Self {
        Self { name, low: 0, format, reset: Some(0) }
    }

    /// One that a reset sets to something else.
    pub(crate) fn set(name: &'static str, format: Format, reset: i64) -> Self {
        Self { reset: Some(reset), ..Self::new(name, format) }
    }

    /// One that a reset leaves as it was.
    pub(crate) fn kept(name: &'static str, format: Format) -> Self {
        Self { reset: None, ..Self::new(name, format) }
    }
}

/// A block whose clock edge is told as equations between registers.
pub trait Step: Block {
    /// Its registers.
    fn registers(&self) -> Vec<Register>;
    /// The registers after an edge without a reset, and the outputs that these registers and inputs show before it.
    fn step<W: Word>(&self, registers: &[W], input: Self::In<W>) -> (Vec<W>, Self::Out<W>);

    /// Whether 64 bits suffice for all that is computed on the way, whatever the registers and inputs.
    fn fits_64(&self) -> bool {
        let registers: Vec<_> = self.registers().iter().map(|register| Reach::of(register.format)).collect();
        let inputs: Vec<_> = flatten(&self.inputs()).iter().map(|signal: &Signal| Reach::of(signal.format)).collect();
        let (next, shown) = stepped(self, &registers, &inputs);
        Reach::fit_64(&next) && Reach::fit_64(&shown)
    }
}

impl<C: Combinational> Step for C {
    fn registers(&self) -> Vec<Register> {
        Vec::new()
    }
    fn step<W: Word>(&self, _: &[W], input: Self::In<W>) -> (Vec<W>, Self::Out<W>) {
        (Vec::new(), self.made(input))
    }
}

/// [`Step`] with the types erased.
pub trait AnyStep: AnyBlock {
    /// See [`Step::registers`].
    fn registers(&self) -> Vec<Register>;
    /// The registers after an edge and the outputs before it, as words of the machine.
    fn words(&self, registers: &[i64], input: &[i64]) -> (Vec<i64>, Vec<i64>);
    /// The same as terms.
    fn terms(&self, registers: &[Term], input: &[Term]) -> (Vec<Term>, Vec<Term>);
}

impl<S: Step> AnyStep for S {
    fn registers(&self) -> Vec<Register> {
        Step::registers(self)
    }
    fn words(&self, registers: &[i64], input: &[i64]) -> (Vec<i64>, Vec<i64>) {
        let formats = Step::registers(self).into_iter().map(|register| register.format);
        let registers: Vec<_> = formats.zip(registers).map(|(format, &word)| machine(format, word)).collect();
        let formats = flatten(&Block::inputs(self)).into_iter().map(|signal: Signal| signal.format);
        let input: Vec<_> = formats.zip(input).map(|(format, &word)| machine(format, word)).collect();
        let (next, shown) = stepped(self, &registers, &input);
        let words = |all: Vec<Machine<i128>>| all.into_iter().map(|word| word.narrowed().word).collect();
        (words(next), words(shown))
    }
    fn terms(&self, registers: &[Term], input: &[Term]) -> (Vec<Term>, Vec<Term>) {
        stepped(self, registers, input)
    }
}

fn machine(format: Format, word: i64) -> Machine<i128> {
    Machine::exact(format.value(word))
}

fn stepped<S: Step + ?Sized, W: Word>(block: &S, registers: &[W], input: &[W]) -> (Vec<W>, Vec<W>) {
    let mut words = input.iter();
    let (next, shown) = block.step(registers, Ports::build(|| *words.next().expect("one word a port")));
    (next, flatten(&shown))
}

/// The countdown between two samples after an edge, and whether that edge samples; what [`Countdown`] does, in words.
///
/// [`Countdown`]: crate::countdown::Countdown
pub(crate) fn counted_down<W: Word>(left: W, period: W) -> (W, W::Bit) {
    let (one, samples) = (W::int(1), left.equals(W::int(0)));
    (W::select(samples, period.greater(one) - one, left - one), samples)
}

/// Reads a block's equations as words of the machine: of 64 bits where these suffice, of 128 else.
macro_rules! in_machine {
    ($fits_64:expr, $input:expr, $made:expr) => {
        if $fits_64 {
            $made($input.map(hpu_signal::Machine::<i64>::of)).map(hpu_signal::Machine::narrowed)
        } else {
            $made($input.map(hpu_signal::Machine::<i128>::of)).map(hpu_signal::Machine::narrowed)
        }
    };
}
pub(crate) use in_machine;
