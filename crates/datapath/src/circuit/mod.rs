//! Circuits: the blocks of a wiring and the nets between them, described once.
//!
//! `circuit!` makes of a description what a loop needs of it: the struct of the blocks, the index of each net, one
//! clock edge, the settling of the combinational nets with the bits lost, and the instances, from which the VHDL of the
//! method loops is generated.
//!
//! A clocked block of a circuit is not ticked at every edge: while its inputs stay and it is quiet, it lags behind. Its
//! [`Pace`] brings it up to date.

pub(crate) mod circuit_loop;
pub(crate) mod part;

use hpu_signal::{Narrowed, Ports, Signal};

use crate::{AnyBlock, Block, Connection, Instance};

/// A set of nets, a bit each. No circuit has more than 64.
pub type Set = u64;

/// The nets whose words were rounded, and those whose words overflowed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Lost {
    /// The rounded nets.
    pub rounded: Set,
    /// The overflowed nets.
    pub overflowed: Set,
}

impl Lost {
    /// Notes how the word of a net was made.
    #[inline]
    pub(crate) fn note(&mut self, net: usize, made: &Narrowed) {
        let put = |set: Set, lost: bool| set & !(1 << net) | Set::from(lost) << net;
        *self = Self { rounded: put(self.rounded, made.rounded), overflowed: put(self.overflowed, made.overflowed) };
    }

    /// Returns whether the word of a net was rounded, and whether it overflowed.
    #[inline]
    pub(crate) fn of(&self, net: usize) -> (bool, bool) {
        (self.rounded >> net & 1 == 1, self.overflowed >> net & 1 == 1)
    }
}

/// Puts a word on a net; returns the net if its word has changed.
#[inline]
pub(crate) fn put<const N: usize>(words: &mut [i64; N], net: usize, word: i64) -> Set {
    Set::from(std::mem::replace(&mut words[net], word) != word) << net
}

/// How far a clocked block of a circuit has come. The block lags behind while its inputs stay and its outputs certainly
/// stay; it catches up by [`skip`](Block::skip). So an edge costs only the blocks that it concerns.
///
/// Edges are counted from the reset on; the first is edge 1.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Pace<I> {
    /// The inputs that the block sees at each edge after `reached`.
    input: I,
    /// The edge up to which the block has been ticked.
    reached: u64,
    /// The next edge at which its outputs may change, if the inputs stay; [`NEVER`] if there is none.
    due: u64,
}

/// An edge that no run reaches.
pub(crate) const NEVER: u64 = u64::MAX;

impl<I: Ports<i64>> Default for Pace<I> {
    /// Returns the pace of a block that has just been reset and must [`look`](Self::look) at its inputs yet.
    fn default() -> Self {
        Self { input: I::build(|| 0), reached: 0, due: NEVER }
    }
}

impl<I: Copy> Pace<I> {
    /// Returns the next edge at which the block must be ticked.
    #[inline]
    pub(crate) fn due(&self) -> u64 {
        self.due
    }

    /// Returns whether the block has come to this edge and does not lag behind.
    #[inline]
    pub(crate) fn is_at(&self, edge: u64) -> bool {
        self.reached == edge
    }

    /// Makes an edge the next one at which the block must be ticked. It must not be later than the present one.
    #[inline]
    pub(crate) fn wake(&mut self, edge: u64) {
        self.due = edge;
    }

    /// Brings a block up to date with an edge before the due one.
    #[inline]
    pub(crate) fn catch_up<B: Block<In<i64> = I>>(&mut self, block: &mut B, edge: u64) {
        block.skip(edge - self.reached, &self.input);
        self.reached = edge;
    }

    /// Computes a block's outputs after an edge, which is the due one.
    #[inline]
    pub(crate) fn tick<B: Block<In<i64> = I>>(&mut self, block: &mut B, edge: u64) -> B::Out<i64> {
        self.catch_up(block, edge - 1);
        let out = block.tick(self.input);
        self.come(block, edge);
        out
    }

    /// Lets a block see other inputs from the edge after this one on.
    #[inline]
    pub(crate) fn look<B: Block<In<i64> = I>>(&mut self, block: &mut B, edge: u64, input: I) {
        self.catch_up(block, edge);
        self.input = input;
        self.come(block, edge);
    }

    /// Notes that a block sees these inputs, and that its outputs stay as they are after this edge while the inputs do.
    #[inline]
    pub(crate) fn rest(&mut self, edge: u64, input: I) {
        *self = Self { input, reached: edge, due: NEVER };
    }

    /// Brings a block up to date with an edge before the due one, and counts the edges from there.
    pub(crate) fn rebase<B: Block<In<i64> = I>>(&mut self, block: &mut B, edge: u64) {
        self.catch_up(block, edge);
        self.reached = 0;
        if self.due != NEVER {
            self.due -= edge;
        }
    }

    /// Notes that a block has been ticked up to an edge, and finds when it is due.
    #[inline]
    pub(crate) fn come<B: Block<In<i64> = I>>(&mut self, block: &B, edge: u64) {
        self.reached = edge;
        self.due = block.quiet(&self.input).saturating_add(edge + 1);
    }
}

/// The blocks of a circuit with at most `N` nets. Its own inputs come first among the nets, then its outputs.
///
/// At an edge, [`tick`](Circuit::tick), [`follow`](Circuit::follow) and [`look`](Circuit::look) are called one after
/// the other. Where nets change between two edges, `follow` and `look` are called with the edge before.
pub trait Circuit<const N: usize>: Clone {
    /// The number of nets.
    const COUNT: usize;
    /// The ports of the blocks whose outputs follow their inputs between two edges.
    const FOLLOWED: Set;
    /// Applies one edge of reset to every clocked block; their outputs are 0 after it. Edges are counted from here.
    fn reset(&mut self);
    /// Computes an edge of the clocked blocks that are due. Returns the nets that changed.
    fn tick(&mut self, edge: u64, words: &mut [i64; N], lost: &mut Lost) -> Set;
    /// Lets the nets follow the inputs and registers, of which these have changed. Returns all nets that changed. Does
    /// nothing unless one of [`FOLLOWED`](Circuit::FOLLOWED) has changed.
    fn follow(&mut self, edge: u64, changed: Set, words: &mut [i64; N], lost: &mut Lost) -> Set;
    /// Lets the clocked blocks see the nets, of which these have changed. Returns the next edge at which one is due.
    fn look(&mut self, edge: u64, changed: Set, words: &[i64; N]) -> u64;
    /// Brings every clocked block up to date with an edge before any is due, and counts the edges from there.
    fn rebase(&mut self, edge: u64);
    /// Resets every block that drives none of these nets, with its pace.
    #[cfg(not(target_family = "wasm"))]
    fn forget(&mut self, live: Set);
    /// Returns the names of the nets.
    fn names() -> Vec<&'static str>;
    /// Returns the instances, in the order of the description.
    fn instances(&self) -> Vec<Instance>;
}

/// Defines a circuit: `nets` in their order, then the instances in the order of the signal path. `port: net` connects a
/// port to a net; a port alone is at the net of its name; `port = word` ties it to a constant. An instance or a net
/// with `if` exists only where the constant is true, with `unless` only where it is false; elsewhere the net is the
/// other one that is given. `generics` states the instance's generics that are not the circuit's of the same name.
///
/// In brackets stand the circuit's generic parameters, the same without bounds, and the most nets that it has.
macro_rules! circuit {
    (
        $(#[$meta:meta])*
        pub struct $name:ident[$($declared:tt)*][$($given:tt)*][$most:literal] { $($field:ident: $kind:ty),* }
        nets {
            $($net:ident $(if $exists:ident else $other:ident)? $(unless $missing:ident else $instead:ident)?),* $(,)?
        }
        $(
            $label:ident: $type:ty = $module:ident
                { $($in:ident $(: $at:ident)? $(= $tied:literal)?),* $(,)? }
                -> { $($out:ident $(: $to:ident)?),* $(,)? }
                $(if $present:ident)? $(unless $absent:ident)? $(generics { $($generics:tt)* })?;
        )*
    ) => {
        $(#[$meta])*
        #[derive(Clone, PartialEq, Eq, Debug)]
        pub struct $name<$($declared)*> {
            pub(crate) paces: Paces,
            $(pub(crate) $field: $kind,)*
            $(pub(crate) $label: $type,)*
        }

        /// The pace of each clocked block; those of other blocks stay as they are.
        #[derive(Clone, PartialEq, Eq, Debug, Default)]
        pub(crate) struct Paces { $($label: $crate::circuit::Pace<$module::In<i64>>,)* }

        /// The index of each net, and their number.
        #[derive(Clone, Copy)]
        struct Nets { $($net: usize,)* count: usize }

        impl<$($declared)*> $name<$($given)*> {
            const NET: Nets = {
                let next = 0;
                $(let ($net, next) =
                    $crate::circuit::circuit!(@place next $(, $exists $other)? $(, !$missing $instead)?);)*
                Nets { $($net,)* count: next }
            };
        }

        impl<$($declared)*> $crate::circuit::Circuit<$most> for $name<$($given)*> {
            const COUNT: usize = Self::NET.count;
            const FOLLOWED: $crate::circuit::Set = 0 $(
                | if <$type as $crate::circuit::part::Part>::FOLLOWS $(&& $present)? $(&& !$absent)? {
                    $crate::circuit::circuit!(@bits $($in $(: $at)? $(= $tied)?,)* $($out $(: $to)?),*)
                } else {
                    0
                }
            )*;

            fn reset(&mut self) {
                $(self.$label.reset();)*
                self.paces = Paces::default();
            }

            #[inline]
            fn tick(
                &mut self,
                edge: u64,
                words: &mut [i64; $most],
                lost: &mut $crate::circuit::Lost,
            ) -> $crate::circuit::Set {
                let mut changed = 0;
                $(if <$type as $crate::Block>::CLOCKED $(&& $present)? $(&& !$absent)?
                    && self.paces.$label.due() <= edge
                {
                    let $module::Out { $($out),* } = self.paces.$label.tick(&mut self.$label, edge);
                    $(changed |= $crate::circuit::put(words, $crate::circuit::circuit!(@net $out $($to)?), $out);)*
                    if let Some($module::Out { $($out),* }) = $crate::circuit::part::Part::hidden(&self.$label) {
                        $(lost.note($crate::circuit::circuit!(@net $out $($to)?), &$out);)*
                    }
                })*
                changed
            }

            #[inline(always)]
            fn follow(
                &mut self,
                edge: u64,
                mut changed: $crate::circuit::Set,
                words: &mut [i64; $most],
                lost: &mut $crate::circuit::Lost,
            ) -> $crate::circuit::Set {
                $(if <$type as $crate::circuit::part::Part>::FOLLOWS $(&& $present)? $(&& !$absent)?
                    && changed & $crate::circuit::circuit!(@bits
                        $($in $(: $at)? $(= $tied)?,)* $($out $(: $to)?),*) != 0
                {
                    if <$type as $crate::Block>::CLOCKED {
                        self.paces.$label.catch_up(&mut self.$label, edge);
                    }
                    let input = $module::In {
                        $($in: $crate::circuit::circuit!(@read words $in $(: $at)? $(= $tied)?)),*
                    };
                    let shown = $module::Out { $($out: words[$crate::circuit::circuit!(@net $out $($to)?)]),* };
                    let $module::Out { $($out),* } =
                        $crate::circuit::part::Part::follow(&mut self.$label, &input, shown);
                    $(
                        let net = $crate::circuit::circuit!(@net $out $($to)?);
                        changed |= $crate::circuit::put(words, net, $out.word);
                        lost.note(net, &$out);
                    )*
                })*
                changed
            }

            #[inline(always)]
            fn look(&mut self, edge: u64, changed: $crate::circuit::Set, words: &[i64; $most]) -> u64 {
                let due = $crate::circuit::NEVER;
                $(let due = if <$type as $crate::Block>::CLOCKED $(&& $present)? $(&& !$absent)? {
                    if changed & $crate::circuit::circuit!(@bits $($in $(: $at)? $(= $tied)?),*) != 0 {
                        let input = $module::In {
                            $($in: $crate::circuit::circuit!(@read words $in $(: $at)? $(= $tied)?)),*
                        };
                        self.paces.$label.look(&mut self.$label, edge, input);
                    }
                    due.min(self.paces.$label.due())
                } else {
                    due
                };)*
                due
            }

            fn rebase(&mut self, edge: u64) {
                $(if <$type as $crate::Block>::CLOCKED $(&& $present)? $(&& !$absent)? {
                    self.paces.$label.rebase(&mut self.$label, edge);
                })*
            }

            #[cfg(not(target_family = "wasm"))]
            fn forget(&mut self, live: $crate::circuit::Set) {
                $(if true $(&& $present)? $(&& !$absent)?
                    && live & $crate::circuit::circuit!(@bits $($out $(: $to)?),*) == 0
                {
                    self.$label.reset();
                    self.paces.$label = Default::default();
                })*
            }

            fn names() -> Vec<&'static str> {
                let mut all = Vec::new();
                $(if Self::NET.$net == all.len() {
                    all.push(stringify!($net));
                })*
                all
            }

            fn instances(&self) -> Vec<$crate::Instance> {
                let mut all = Vec::new();
                $(if true $(&& $present)? $(&& !$absent)? {
                    let wires = [
                        $($crate::circuit::circuit!(@wire $in $(: $at)? $(= $tied)?),)*
                        $($crate::circuit::circuit!(@wire $out $(: $to)?),)*
                    ];
                    let instance = $crate::circuit::connected(stringify!($label), &self.$label, &wires);
                    $(let instance = instance.mapped($($generics)*);)?
                    all.push(instance);
                })*
                all
            }
        }
    };
    (@place $next:expr) => { ($next, $next + 1) };
    (@place $next:expr, $exists:ident $other:ident) => { if $exists { ($next, $next + 1) } else { ($other, $next) } };
    (@place $next:expr, !$missing:ident $instead:ident) => {
        if $missing { ($instead, $next) } else { ($next, $next + 1) }
    };
    (@read $words:ident $port:ident $(: $net:ident)?) => {
        $words[$crate::circuit::circuit!(@net $port $($net)?)]
    };
    (@read $words:ident $port:ident = $tied:literal) => { $tied };
    (@bits $($port:ident $(: $net:ident)? $(= $tied:literal)?),*) => {
        (0 $(| $crate::circuit::circuit!(@bit $port $(: $net)? $(= $tied)?))*)
    };
    (@bit $port:ident $(: $net:ident)?) => { 1 << $crate::circuit::circuit!(@net $port $($net)?) };
    (@bit $port:ident = $tied:literal) => { 0 };
    (@wire $port:ident $(: $net:ident)?) => {
        $crate::circuit::Wire::Net($crate::circuit::circuit!(@net $port $($net)?))
    };
    (@wire $port:ident = $tied:literal) => { $crate::circuit::Wire::Tied($tied) };
    (@net $port:ident) => { Self::NET.$port };
    (@net $port:ident $net:ident) => { Self::NET.$net };
}

/// The other end of a port's connection.
#[derive(Clone, Copy)]
pub(crate) enum Wire {
    /// A net, by its index.
    Net(usize),
    /// A constant.
    Tied(i64),
}

/// Returns an instance whose ports, inputs first, are connected to these nets.
pub(crate) fn instance<B: Block + Clone + 'static>(label: &'static str, block: &B, nets: &[usize]) -> Instance {
    let wires: Vec<_> = nets.iter().copied().map(Wire::Net).collect();
    connected(label, block, &wires)
}

/// Returns an instance whose ports, inputs first, are connected to these nets and constants.
pub(crate) fn connected<B: Block + Clone + 'static>(label: &'static str, block: &B, wires: &[Wire]) -> Instance {
    let mut model = Box::new(block.clone());
    Block::reset(&mut *model);
    wired(label, model, wires)
}

fn wired(label: &'static str, model: Box<dyn AnyBlock>, wires: &[Wire]) -> Instance {
    let ports: Vec<_> = model.inputs().into_iter().chain(model.outputs()).collect();
    debug_assert_eq!(ports.len(), wires.len());
    let mut instance = Instance { label, model, connections: Vec::new(), tied: Vec::new(), generics: Vec::new() };
    for (port, wire) in ports.into_iter().zip(wires) {
        match *wire {
            Wire::Net(net) => instance.connections.push(Connection { port, net }),
            Wire::Tied(word) => instance.tied.push((port.name, word)),
        }
    }
    instance
}

/// Returns nets with these names from `first` on, each as described by the block that drives it.
pub(crate) fn driven(names: &[&'static str], first: usize, instances: &[Instance]) -> Vec<Signal> {
    let described = |(net, name): (usize, &&'static str)| {
        let drives = |instance: &Instance| {
            let at = instance.connections.iter().find(|at| at.net == net)?.port.clone();
            instance.model.outputs().into_iter().find(|output| output.name == at.name)
        };
        Signal { name, ..instances.iter().find_map(drives).expect("every net is driven") }
    };
    names.iter().enumerate().skip(first).map(described).collect()
}

pub(crate) use circuit;
