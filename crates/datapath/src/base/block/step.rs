//! A block's arithmetic and its clock edge over any [`Word`]: written once, used by machines and by solvers.
//!
//! Clocked blocks write `reset`, `tick`, `quiet` and `skip` by hand beside [`Step::step`], and tests hold both to each
//! other. A wrapper that derives them from `step` was measured and left out. A clock edge of `zero_order_hold`,
//! `velocity_register` and `biquad` that samples every fifth edge takes 11, 16 and 56 instructions by hand, and 498,
//! 626 and 950 by `step`: it returns its registers as a list made anew at each edge, and shows the outputs before the
//! edge, so that those after it take a second call.

use hpu_signal::{Equations, Format, Machine, Ports, Reach, Reading, Signal, Term, Word};

use super::{AnyBlock, Block, flatten};

/// A block without registers that computes its outputs over any [`Word`]. Every combinational block implements it.
///
/// ```
/// use hpu_datapath::{Combinational, TruncatingMultiplier, truncating_multiplier::In};
/// use hpu_signal::{Machine, Word};
///
/// let block = TruncatingMultiplier::default();
/// // The arithmetic of the VHDL on machine words; solvers and enclosures read the same function.
/// let out = block.made(In { a: Machine::<i64>::of(3), b: Machine::of(5) });
/// assert_eq!(out.product.narrowed().word, 15);
/// ```
pub trait Combinational: Block {
    /// Computes the outputs of these inputs.
    fn made<W: Word>(&self, input: Self::In<W>) -> Self::Out<W>;
}

/// A register of a block, or some of its bits. Its twin in VHDL is a variable or an output.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Register {
    /// The instance that contains it, below the block itself.
    pub instance: Option<&'static str>,
    /// Name of the variable or the output.
    pub name: &'static str,
    /// Its lowest bit within the bits of the variable, which may be an array or a record.
    pub low: u32,
    /// Its format, which holds every word that it can have.
    pub format: Format,
    /// Its word after a reset; `None` if the reset does not set it, and the block loads it before it reads it.
    pub reset: Option<i64>,
    /// Whether the variable's other bits belong to no other register or logic: they are zeros below it, and its sign
    /// above it.
    pub is_alone: bool,
}

impl Register {
    /// Name of a register that counts down to the next sample edge, and does nothing else in between.
    pub const COUNTDOWN: &'static str = "countdown";

    /// Returns a register that is a whole variable and 0 after a reset.
    pub(crate) fn new(name: &'static str, format: Format) -> Self {
        Self { instance: None, name, low: 0, format, reset: Some(0), is_alone: true }
    }

    /// Returns a register that a reset sets to another word.
    pub(crate) fn set(name: &'static str, format: Format, reset: i64) -> Self {
        Self { reset: Some(reset), ..Self::new(name, format) }
    }

    /// Returns a register that a reset leaves as it is.
    pub(crate) fn kept(name: &'static str, format: Format) -> Self {
        Self { reset: None, ..Self::new(name, format) }
    }

    /// Returns the registers of a block that is an instance of this name in another block.
    pub(crate) fn inside<S: Step>(instance: &'static str, block: &S) -> impl Iterator<Item = Self> {
        let registers = Step::registers(block).into_iter();
        registers.map(move |register| Self { instance: Some(instance), ..register })
    }

    /// Returns its name in the VHDL, behind the name of its instance.
    pub fn path(&self) -> String {
        self.instance.map_or_else(|| self.name.to_string(), |instance| format!("{instance}.{}", self.name))
    }
}

/// A block whose clock edge is written as equations between registers, so that proofs and width studies read the same
/// arithmetic that the machine computes. Clocked blocks implement it; [`Combinational`] blocks implement it without
/// registers.
///
/// ```
/// use hpu_datapath::{PositionCounter, Step, position_counter::In};
/// use hpu_signal::{Machine, Word};
///
/// let block = PositionCounter::default();
/// let names: Vec<_> = Step::registers(&block).iter().map(|register| register.name).collect();
/// assert_eq!(names, ["position"]);
/// // One edge with a step of -1, from position 7.
/// let (after, _) = block.step(&[Machine::<i64>::of(7)], In { step: Machine::of(-1) });
/// assert_eq!(after[0].narrowed().word, 6);
/// ```
pub trait Step: Block {
    /// Returns its registers.
    fn registers(&self) -> Vec<Register>;
    /// Computes the registers after an edge without a reset, and the outputs that these registers and inputs show
    /// before it.
    fn step<W: Word>(&self, registers: &[W], input: Self::In<W>) -> (Vec<W>, Self::Out<W>);

    /// Returns claims about these equations over several edges, as steps of an induction; most blocks have none.
    fn lemmas(&self) -> Vec<Lemma<'_>> {
        Vec::new()
    }

    /// Returns whether 64 bits suffice for all intermediate results, for any registers and inputs.
    fn fits_64(&self) -> bool {
        let registers: Vec<_> = self.registers().iter().map(|register| Reach::of(register.format)).collect();
        let inputs: Vec<_> = flatten(&self.inputs()).iter().map(|signal: &Signal| Reach::of(signal.format)).collect();
        Reach::fit_64(&recorded(self).read(&[registers, inputs].concat()))
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

/// A claim: one condition implies another, for any words of these formats.
pub struct Lemma<'s> {
    /// The formats of the words.
    pub any: Vec<Format>,
    /// Returns the given condition and the implied one, from the words.
    pub follows: Box<Follows<'s>>,
}

/// A function from words to the given condition and the implied one.
type Follows<'s> = dyn Fn(&[Term]) -> (Holds, Holds) + 's;

/// The truth of a condition, as a term.
pub type Holds = <Term as Word>::Bit;

/// The clock edge of a block as equations, without the types of the block: registers, claims, and the equations
/// recorded for any reading, so that each reading is compiled once. [`Block::equations`] returns it.
pub struct ClockEdge<'b> {
    /// The block.
    pub block: &'b dyn AnyBlock,
    /// See [`Step::registers`].
    pub registers: Vec<Register>,
    lemmas: Box<dyn Fn() -> Vec<Lemma<'b>> + 'b>,
    recorded: Box<dyn Fn() -> Equations + 'b>,
}

impl<'b> ClockEdge<'b> {
    /// Returns the clock edge of a block.
    pub fn of<S: Step>(block: &'b S) -> Self {
        Self {
            block,
            registers: block.registers(),
            lemmas: Box::new(|| block.lemmas()),
            recorded: Box::new(|| recorded(block)),
        }
    }

    /// See [`Step::lemmas`].
    pub fn lemmas(&self) -> Vec<Lemma<'b>> {
        (self.lemmas)()
    }

    /// Returns the equations for any reading. Their inputs are the registers and then the inputs of the block; their
    /// results are the registers after an edge and then the outputs before it.
    pub fn recorded(&self) -> Equations {
        (self.recorded)()
    }

    /// Returns a function that computes the registers after an edge and the outputs before it, from the registers and
    /// the inputs, as words of the machine.
    pub fn in_words(&self) -> impl FnMut(&[i64], &[i64]) -> (Vec<i64>, Vec<i64>) + use<> {
        let equations = self.recorded();
        let inputs = self.block.inputs().into_iter().map(|signal| signal.format);
        let formats: Vec<_> = self.registers.iter().map(|register| register.format).chain(inputs).collect();
        let mut reading = Reading::default();
        move |registers, inputs| {
            let given = formats.iter().zip(registers.iter().chain(inputs));
            let given: Vec<_> = given.map(|(format, &word)| Machine::<i128>::exact(format.value(word))).collect();
            let read = equations.read_in(&mut reading, &given).iter().map(|word| word.narrowed().word);
            split(read.collect(), registers.len())
        }
    }

    /// Computes the same as terms.
    pub fn in_terms(&self, registers: &[Term], inputs: &[Term]) -> (Vec<Term>, Vec<Term>) {
        in_terms(&self.recorded(), registers, inputs)
    }
}

fn in_terms(equations: &Equations, registers: &[Term], inputs: &[Term]) -> (Vec<Term>, Vec<Term>) {
    split(equations.read(&[registers, inputs].concat()), registers.len())
}

/// Cuts the results of a block's equations into registers and outputs.
fn split<W>(mut results: Vec<W>, registers: usize) -> (Vec<W>, Vec<W>) {
    let shown = results.split_off(registers);
    (results, shown)
}

/// Records a block's equations; see [`ClockEdge::recorded`].
fn recorded(block: &(impl Step + ?Sized)) -> Equations {
    let (registers, inputs) = (block.registers().len(), flatten(&block.inputs()).len());
    Equations::of(registers + inputs, |given| {
        let (registers, inputs) = given.split_at(registers);
        let mut inputs = inputs.iter();
        let (mut next, shown) = block.step(registers, Ports::build(|| *inputs.next().expect("one word a port")));
        shown.each(|word| next.push(*word));
        next
    })
}

/// Returns the countdown between two samples after an edge, and whether that edge samples: the equations of
/// [`Countdown`].
///
/// [`Countdown`]: crate::base::countdown::Countdown
pub(crate) fn counted_down<W: Word>(left: W, period: W) -> (W, W::Bit) {
    let (one, samples) = (W::int(1), left.equals(W::int(0)));
    (W::select(samples, period.greater(one) - one, left - one), samples)
}

/// Reads a block's equations as words of the machine: of 64 bits where these suffice, else of 128.
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

/// Returns the condition that all words of two lists are equal in pairs.
pub(crate) fn equal(these: &[Term], those: &[Term]) -> Holds {
    let pairs = these.iter().zip(those).map(|(one, other)| one.equals(*other));
    pairs.reduce(|all, pair| all & pair).expect("words")
}

/// Claims that registers which a reset does not set do not matter. The claim is about two states that differ only in
/// these registers and for which `idles` holds. They show the same outputs, and their next states agree in all other
/// registers. The next states also agree in these registers, or `idles` holds for them too. `idles` must hold after a
/// reset.
pub(crate) fn loads_first<'s, S: Step>(block: &'s S, idles: impl Fn(&[Term], &[Term]) -> Holds + 's) -> Lemma<'s> {
    let registers = Step::registers(block);
    let is_kept: Vec<_> = registers.iter().map(|register| register.reset.is_none()).collect();
    let formats = registers.iter().map(|register| register.format);
    let kept = registers.iter().filter(|register| register.reset.is_none()).map(|register| register.format);
    let inputs = flatten(&block.inputs()).into_iter().map(|signal: Signal| signal.format);
    let (count, equations) = (registers.len(), recorded(block));
    let any: Vec<_> = formats.chain(inputs).chain(kept).collect();
    let inputs = count..any.len() - is_kept.iter().filter(|kept| **kept).count();
    let follows = move |any: &[Term]| {
        let mut others = any[inputs.end..].iter();
        let other = |(&word, &is_kept): (&Term, &bool)| if is_kept { *others.next().expect("a word") } else { word };
        let one = &any[..count];
        let other: Vec<_> = one.iter().zip(&is_kept).map(other).collect();
        let (next, shown) = in_terms(&equations, one, &any[inputs.clone()]);
        let (next_too, shown_too) = in_terms(&equations, &other, &any[inputs.clone()]);
        let of = |kept: bool, all: &[Term]| -> Vec<_> {
            all.iter().zip(&is_kept).filter(|(_, is)| **is == kept).map(|(word, _)| *word).collect()
        };
        let same = equal(&of(false, &next), &of(false, &next_too)) & equal(&shown, &shown_too);
        let loaded = equal(&of(true, &next), &of(true, &next_too));
        (idles(one, &other), same & (loaded | idles(&next, &next_too)))
    };
    Lemma { any, follows: Box::new(follows) }
}
