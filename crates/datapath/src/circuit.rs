//! Circuits: the blocks of a wiring and the nets between them, described once.
//!
//! `circuit!` makes of a description what a loop needs of it: the struct of the blocks, the index of each net, one
//! clock edge, `quiet` and `skip`, the settling of the combinational nets with the bits lost, and the instances, from
//! which the VHDL of the method loops is generated.

use hpu_signal::{Narrowed, Signal};

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

/// The blocks of a circuit with at most `N` nets. Its own inputs come first among the nets, then its outputs.
pub trait Circuit<const N: usize>: Clone {
    /// The number of nets.
    const COUNT: usize;
    /// Applies one edge of reset to every clocked block; their outputs are 0 after it.
    fn reset(&mut self);
    /// Computes one edge of the clocked blocks, which all read the nets as they stand. Returns the nets that changed.
    fn tick(&mut self, words: &mut [i64; N]) -> Set;
    /// Returns whether a clocked block has lost other bits than these, which its outputs need not show.
    fn hides(&self, lost: &Lost) -> bool;
    /// Lets the nets follow the inputs and registers, of which these have changed. Returns all nets that changed.
    fn follow(&mut self, changed: Set, words: &mut [i64; N], lost: &mut Lost) -> Set;
    /// Returns for how many edges all clocked blocks are quiet.
    fn quiet(&self, words: &[i64; N]) -> u64;
    /// Skips that many edges of all clocked blocks.
    fn skip(&mut self, edges: u64, words: &[i64; N]);
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
            $(pub(crate) $field: $kind,)*
            $(pub(crate) $label: $type,)*
        }

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

            fn reset(&mut self) {
                $(self.$label.reset();)*
            }

            #[inline]
            fn tick(&mut self, words: &mut [i64; $most]) -> $crate::circuit::Set {
                $(let $label = (<$type as $crate::Block>::CLOCKED $(&& $present)? $(&& !$absent)?).then(|| {
                    self.$label.tick($module::In {
                        $($in: $crate::circuit::circuit!(@read words $in $(: $at)? $(= $tied)?)),*
                    })
                });)*
                // At most edges, no output changes.
                let mut differs = 0;
                $(if let Some($module::Out { $($out),* }) = &$label {
                    $(differs |= words[$crate::circuit::circuit!(@net $out $($to)?)] ^ $out;)*
                })*
                if differs == 0 {
                    return 0;
                }
                let mut changed = 0;
                $(if let Some($module::Out { $($out),* }) = $label {
                    $(changed |= $crate::circuit::put(words, $crate::circuit::circuit!(@net $out $($to)?), $out);)*
                })*
                changed
            }

            #[inline]
            fn hides(&self, lost: &$crate::circuit::Lost) -> bool {
                let differs = false;
                $(let differs = differs || true $(&& $present)? $(&& !$absent)?
                    && $crate::part::Part::hidden(&self.$label).is_some_and(|$module::Out { $($out),* }| {
                        false $(||
                            lost.of($crate::circuit::circuit!(@net $out $($to)?)) != ($out.rounded, $out.overflowed))*
                    });)*
                differs
            }

            #[inline(always)]
            fn follow(
                &mut self,
                mut changed: $crate::circuit::Set,
                words: &mut [i64; $most],
                lost: &mut $crate::circuit::Lost,
            ) -> $crate::circuit::Set {
                $(if <$type as $crate::part::Part>::FOLLOWS $(&& $present)? $(&& !$absent)? {
                    let at = 0 $(| $crate::circuit::circuit!(@bit $in $(: $at)? $(= $tied)?))*
                        $(| $crate::circuit::circuit!(@bit $out $(: $to)?))*;
                    if changed & at != 0 || $crate::part::Part::hidden(&self.$label).is_some() {
                        let input = $module::In {
                            $($in: $crate::circuit::circuit!(@read words $in $(: $at)? $(= $tied)?)),*
                        };
                        let shown = $module::Out { $($out: words[$crate::circuit::circuit!(@net $out $($to)?)]),* };
                        let $module::Out { $($out),* } = $crate::part::Part::follow(&mut self.$label, &input, shown);
                        $(
                            let net = $crate::circuit::circuit!(@net $out $($to)?);
                            changed |= $crate::circuit::put(words, net, $out.word);
                            lost.note(net, &$out);
                        )*
                    }
                })*
                changed
            }

            #[inline]
            fn quiet(&self, words: &[i64; $most]) -> u64 {
                let least = u64::MAX;
                // A block that changes at the next edge decides: the others need not be asked.
                $(let least = if <$type as $crate::Block>::CLOCKED $(&& $present)? $(&& !$absent)? && least != 0 {
                    let input = $module::In {
                        $($in: $crate::circuit::circuit!(@read words $in $(: $at)? $(= $tied)?)),*
                    };
                    least.min(self.$label.quiet(&input))
                } else {
                    least
                };)*
                least
            }

            #[inline]
            fn skip(&mut self, edges: u64, words: &[i64; $most]) {
                $(if <$type as $crate::Block>::CLOCKED $(&& $present)? $(&& !$absent)? {
                    let input = $module::In {
                        $($in: $crate::circuit::circuit!(@read words $in $(: $at)? $(= $tied)?)),*
                    };
                    self.$label.skip(edges, &input);
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
