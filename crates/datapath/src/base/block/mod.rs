//! The interface of every block: `Block` with its port types, and `AnyBlock` without them for tools that list, feed and
//! print blocks.

mod parts;
pub(crate) mod step;

use hpu_signal::{Format, Ports, Signal};

use step::ClockEdge;

pub(crate) use parts::renamed;
pub use parts::{Connection, Instance, Parts};

/// A value of a VHDL generic.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Generic {
    /// `natural` or `positive`.
    Integer(i64),
    /// `boolean`.
    Boolean(bool),
}

/// The name of the generic that says how a block rounds: the number of a [`Rounding`](hpu_signal::Rounding). Wirings
/// leave it at the block's default.
pub const ROUNDING: &str = "ROUNDING";

/// A lookup table inside a block, as the constant of its VHDL twin holds it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Rom {
    /// Name of the constant, in small letters.
    pub name: &'static str,
    /// Format of its words.
    pub format: Format,
    /// The word at each address, from 0 on.
    pub words: Vec<i64>,
}

/// A clocked or combinational block of the datapath. Every block and wiring implements it, so that drivers, vectors,
/// waveforms and proofs can use all of them in the same way.
///
/// The law of [`quiet`](Block::quiet) and [`skip`](Block::skip): for any `n <= quiet(input)`, `skip(n, input)` leaves
/// the state that `n` ticks with that input leave, and no output changes.
///
/// ```
/// use hpu_datapath::{AnyBlock, Block, Generic};
/// use hpu_signal::{Format, Signal};
///
/// hpu_signal::ports! { /// Inputs.
///     pub struct In { enable } }
/// hpu_signal::ports! { /// Outputs.
///     pub struct Out { count } }
///
/// /// Counts the clock cycles in which `enable` is set, modulo 16.
/// struct Counter(i64);
///
/// impl Block for Counter {
///     const NAME: &'static str = "counter";
///     const CLOCKED: bool = true;
///     type In<T> = In<T>;
///     type Out<T> = Out<T>;
///     fn inputs(&self) -> In<Signal> {
///         In { enable: Signal::bit("enable", "Counts.") }
///     }
///     fn outputs(&self) -> Out<Signal> {
///         Out { count: Signal::new("count", Format::unsigned(4), "count", "The count.") }
///     }
///     fn generics(&self) -> Vec<(&'static str, Generic)> {
///         Vec::new()
///     }
///     fn reset(&mut self) -> Out<i64> {
///         self.0 = 0;
///         Out { count: 0 }
///     }
///     fn tick(&mut self, input: In<i64>) -> Out<i64> {
///         self.0 = (self.0 + input.enable) % 16;
///         Out { count: self.0 }
///     }
///     fn quiet(&self, input: &In<i64>) -> u64 {
///         if input.enable == 0 { u64::MAX } else { 0 }
///     }
///     fn skip(&mut self, _: u64, _: &In<i64>) {}
/// }
///
/// let mut counter = Counter(0);
/// Block::reset(&mut counter);
/// assert_eq!(Block::tick(&mut counter, In { enable: 1 }), Out { count: 1 });
/// // As every tool takes it: without its types.
/// assert_eq!((AnyBlock::name(&counter), AnyBlock::tick(&mut counter, &[1])), ("counter", vec![2]));
/// ```
pub trait Block {
    /// Name of the module, the VHDL entity, the vector folder and the waveform scope.
    const NAME: &'static str;
    /// Whether the VHDL entity has `clk` and `rst`.
    const CLOCKED: bool;
    /// Input ports.
    type In<T>: Ports<T>;
    /// Output ports.
    type Out<T>: Ports<T>;

    /// Describes the input ports.
    fn inputs(&self) -> Self::In<Signal>;
    /// Describes the output ports.
    fn outputs(&self) -> Self::Out<Signal>;
    /// Returns the VHDL generics of this configuration, by name, in the order of the entity.
    fn generics(&self) -> Vec<(&'static str, Generic)>;
    /// Returns the lookup tables of the block itself. The tables of blocks inside a wiring belong to those blocks.
    fn roms(&self) -> Vec<Rom> {
        Vec::new()
    }
    /// Returns its clock edge as equations, if the block has them.
    fn equations(&self) -> Option<ClockEdge<'_>> {
        None
    }
    /// Returns the blocks inside, if the block is made of blocks alone. Proofs compare them with the VHDL.
    fn parts(&self) -> Option<Parts> {
        None
    }
    /// Returns the output that counts up and down modulo its width, if there is one. The number of steps has no limit.
    fn counts(&self) -> Option<&'static str> {
        None
    }
    /// Returns the combinational blocks with which a block without equations of its own computes. They are connected by
    /// its ports: the nets are its inputs, then its outputs.
    fn inside(&self) -> Vec<Instance> {
        Vec::new()
    }
    /// Returns the edge after reset that first shows the results of the blocks [`inside`](Block::inside), if they are
    /// shown once a `period`; `None` if they are shown at once.
    fn first_shown(&self) -> Option<u64> {
        None
    }
    /// Computes one edge with `rst = '1'`. An output that an input reaches without a register sees that input as 0.
    fn reset(&mut self) -> Self::Out<i64>;
    /// Computes one edge with `rst = '0'` and returns the outputs as seen after it. A combinational block answers its
    /// inputs.
    fn tick(&mut self, input: Self::In<i64>) -> Self::Out<i64>;
    /// Returns for how many further edges with this input the outputs certainly stay; 0 promises nothing.
    fn quiet(&self, input: &Self::In<i64>) -> u64;
    /// Does `edges` ticks at once, in constant time. The number must not exceed [`quiet`](Block::quiet).
    fn skip(&mut self, edges: u64, input: &Self::In<i64>);
}

/// A block whose port bundles are slices, in port order. Every [`Block`] implements it; tools use it for any block.
///
/// ```
/// use hpu_datapath::{AnyBlock, Generic, configured};
/// let set = [("WIDTH", Generic::Integer(4))];
/// let mut counter = configured("position_counter", &set).expect("a block").expect("a width that it takes");
/// counter.reset();
/// // 4 bits: -1 is 15.
/// assert_eq!((counter.tick(&[-1]), counter.outputs()[0].format.width()), (vec![15], 4));
/// ```
pub trait AnyBlock {
    /// See [`Block::NAME`].
    fn name(&self) -> &'static str;
    /// See [`Block::CLOCKED`].
    fn clocked(&self) -> bool;
    /// Returns the inputs in port order.
    fn inputs(&self) -> Vec<Signal>;
    /// Returns the outputs in port order.
    fn outputs(&self) -> Vec<Signal>;
    /// See [`Block::generics`].
    fn generics(&self) -> Vec<(&'static str, Generic)>;
    /// See [`Block::roms`].
    fn roms(&self) -> Vec<Rom>;
    /// See [`Block::equations`].
    fn equations(&self) -> Option<ClockEdge<'_>>;
    /// See [`Block::counts`].
    fn counts(&self) -> Option<&'static str>;
    /// See [`Block::inside`].
    fn inside(&self) -> Vec<Instance>;
    /// See [`Block::first_shown`].
    fn first_shown(&self) -> Option<u64>;
    /// See [`Block::parts`].
    fn parts(&self) -> Option<Parts>;
    /// See [`Block::reset`].
    fn reset(&mut self) -> Vec<i64>;
    /// See [`Block::tick`].
    fn tick(&mut self, input: &[i64]) -> Vec<i64>;
    /// See [`Block::quiet`].
    fn quiet(&self, input: &[i64]) -> u64;
    /// See [`Block::skip`].
    fn skip(&mut self, edges: u64, input: &[i64]);
}

/// Returns the bundle's content in port order.
pub fn flatten<T: Clone, P: Ports<T>>(bundle: &P) -> Vec<T> {
    // Few bundles have more ports, so one allocation suffices.
    let mut all = Vec::with_capacity(16);
    bundle.each(|port| all.push(port.clone()));
    all
}

/// Makes a bundle from words in port order.
///
/// # Panics
///
/// When there are fewer words than ports.
pub fn bundle<P: Ports<i64>>(words: &[i64]) -> P {
    let mut next = words.iter();
    P::build(|| *next.next().expect("one word a port"))
}

impl<B: Block> AnyBlock for B {
    fn name(&self) -> &'static str {
        B::NAME
    }
    fn clocked(&self) -> bool {
        B::CLOCKED
    }
    fn inputs(&self) -> Vec<Signal> {
        flatten(&Block::inputs(self))
    }
    fn outputs(&self) -> Vec<Signal> {
        flatten(&Block::outputs(self))
    }
    fn generics(&self) -> Vec<(&'static str, Generic)> {
        Block::generics(self)
    }
    fn roms(&self) -> Vec<Rom> {
        Block::roms(self)
    }
    fn equations(&self) -> Option<ClockEdge<'_>> {
        Block::equations(self)
    }
    fn counts(&self) -> Option<&'static str> {
        Block::counts(self)
    }
    fn inside(&self) -> Vec<Instance> {
        Block::inside(self)
    }
    fn first_shown(&self) -> Option<u64> {
        Block::first_shown(self)
    }
    fn parts(&self) -> Option<Parts> {
        Block::parts(self)
    }
    fn reset(&mut self) -> Vec<i64> {
        flatten(&Block::reset(self))
    }
    fn tick(&mut self, input: &[i64]) -> Vec<i64> {
        flatten(&Block::tick(self, bundle(input)))
    }
    fn quiet(&self, input: &[i64]) -> u64 {
        Block::quiet(self, &bundle(input))
    }
    fn skip(&mut self, edges: u64, input: &[i64]) {
        Block::skip(self, edges, &bundle(input));
    }
}

/// Implements `Default`: the configuration of the data sheet, which the block accepts.
macro_rules! data_sheet {
    ($Block:ty = $made:expr) => {
        impl Default for $Block {
            fn default() -> Self {
                $made.expect("the data sheet's default")
            }
        }
    };
}

/// The ports of an `impl Block` or `impl LoopCircuit`: the bundles, `In` and `Out` unless they are named, as they are
/// described for `self` or for `$of`.
macro_rules! described {
    () => {
        crate::base::block::described!(In, Out);
    };
    ($In:ident, $Out:ident) => {
        crate::base::block::described!($In, $Out, self => self);
    };
    ($self:ident => $of:expr) => {
        crate::base::block::described!(In, Out, $self => $of);
    };
    ($In:ident, $Out:ident, $self:ident => $of:expr) => {
        type In<T> = $In<T>;
        type Out<T> = $Out<T>;

        fn inputs(&$self) -> $In<hpu_signal::Signal> {
            $In::of($of)
        }

        fn outputs(&$self) -> $Out<hpu_signal::Signal> {
            $Out::of($of)
        }
    };
}

/// The part of `impl Block` that is alike in the clocked blocks whose ports are `In` and `Out` and whose clock edge is
/// written as equations.
macro_rules! clocked {
    ($($of:tt)*) => {
        const CLOCKED: bool = true;
        crate::base::block::described!($($of)*);

        fn generics(&self) -> Vec<(&'static str, $crate::Generic)> {
            self.told()
        }

        fn equations(&self) -> Option<$crate::ClockEdge<'_>> {
            Some($crate::ClockEdge::of(self))
        }
    };
}

/// The part of `impl Block` that is alike in the blocks that compute for many edges after a start: a computation from
/// what `started` returns, which begins with `$idle`.
macro_rules! computing {
    ($idle:expr) => {
        crate::base::block::clocked!();

        fn reset(&mut self) -> Out<i64> {
            self.computation.reset($idle);
            self.shown()
        }

        #[inline]
        fn tick(&mut self, input: In<i64>) -> Out<i64> {
            let started = self.started(&input);
            self.computation.tick(started);
            self.shown()
        }

        #[inline]
        fn quiet(&self, input: &In<i64>) -> u64 {
            self.computation.quiet(input.start != 0)
        }

        #[inline]
        fn skip(&mut self, edges: u64, input: &In<i64>) {
            debug_assert!(edges <= self.quiet(input));
            let started = self.started(input);
            self.computation.skip(edges, started);
        }
    };
}

/// The part of `impl Block` that is alike in all blocks without registers: they answer their inputs, and nothing else.
macro_rules! combinational {
    ($self:ident, $input:ident => $answer:expr) => {
        const CLOCKED: bool = false;
        crate::base::block::described!();

        fn generics(&self) -> Vec<(&'static str, $crate::Generic)> {
            self.told()
        }

        fn equations(&self) -> Option<$crate::ClockEdge<'_>> {
            Some($crate::ClockEdge::of(self))
        }

        fn reset(&mut self) -> Self::Out<i64> {
            self.tick(hpu_signal::Ports::build(|| 0))
        }

        #[inline]
        fn tick(&mut $self, $input: Self::In<i64>) -> Self::Out<i64> {
            $answer
        }

        #[inline]
        fn quiet(&self, _: &Self::In<i64>) -> u64 {
            u64::MAX
        }

        #[inline]
        fn skip(&mut self, _: u64, _: &Self::In<i64>) {}
    };
}

pub(crate) use {clocked, combinational, computing, data_sheet, described};
