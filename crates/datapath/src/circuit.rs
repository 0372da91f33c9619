//! Circuits: the blocks of a wiring and the nets between them, described once.
//!
//! `circuit!` makes of a description what a loop needs of it: the struct of the blocks, the index of
//! each net, one clock edge, `quiet` and `skip`, the settling of the combinational nets with the bits lost, and the
//! instances, from which the VHDL of the method loops is generated.

use hpu_signal::Signal;

use crate::{Block, Connection, Instance, flatten};

/// Whether a net's value was rounded, and whether it overflowed.
pub type Lost = (bool, bool);

/// The blocks of a circuit with at most `N` nets. Its own inputs come first among the nets, then its outputs.
pub trait Circuit<const N: usize>: Clone {
    /// The number of nets.
    const COUNT: usize;
    /// Applies one edge of reset to every clocked block; their outputs are 0 after it.
    fn reset(&mut self);
    /// Computes one edge of the clocked blocks: they read `now` and write their outputs to `next`.
    fn tick(&mut self, now: &[i64; N], next: &mut [i64; N]);
    /// Lets the nets follow the inputs and registers. Without `before`, the words that were settled before, all
    /// blocks are computed; else, of those without registers, only those with other inputs.
    fn follow(&mut self, before: Option<&[i64; N]>, words: &mut [i64; N], lost: &mut [Lost; N]);
    /// Returns for how many edges all clocked blocks are quiet.
    fn quiet(&self, words: &[i64; N]) -> u64;
    /// Skips that many edges of all clocked blocks.
    fn skip(&mut self, edges: u64, words: &[i64; N]);
    /// Returns the names of the nets.
    fn names() -> Vec<&'static str>;
    /// Returns the instances, in the order of the description.
    fn instances(&self) -> Vec<Instance>;
}

/// Defines a circuit: `nets` in their order, then the instances. `port: net` connects a port to a net; a port alone is
/// at the net of its name. An instance or a net with `if` exists only where the constant is true; elsewhere the net is
/// the other one that is given. `generics` states the instance's generics that are not the circuit's of the same name.
macro_rules! circuit {
    (
        $(#[$meta:meta])*
        pub struct $name:ident[$($declared:tt)*][$($given:tt)*][$most:literal] { $($field:ident: $kind:ty),* }
        nets { $($net:ident $(if $exists:ident else $other:ident)?),* $(,)? }
        $(
            $label:ident: $type:ty = $module:ident
                { $($in:ident $(: $at:ident)?),* } -> { $($out:ident $(: $to:ident)?),* }
                $(if $present:ident)? $(generics { $($generics:tt)* })?;
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
                $(let ($net, next) = $crate::circuit::circuit!(@place next $(, $exists $other)?);)*
                Nets { $($net,)* count: next }
            };
        }

        impl<$($declared)*> $crate::circuit::Circuit<$most> for $name<$($given)*> {
            const COUNT: usize = Self::NET.count;

            fn reset(&mut self) {
                $(self.$label.reset();)*
            }

            #[inline]
            fn tick(&mut self, now: &[i64; $most], next: &mut [i64; $most]) {
                $(if <$type as $crate::Block>::CLOCKED $(&& $present)? {
                    let input = $module::In { $($in: now[$crate::circuit::circuit!(@net $in $($at)?)]),* };
                    let $module::Out { $($out),* } = self.$label.tick(input);
                    $(next[$crate::circuit::circuit!(@net $out $($to)?)] = $out;)*
                })*
            }

            #[inline]
            fn follow(
                &mut self,
                before: Option<&[i64; $most]>,
                words: &mut [i64; $most],
                lost: &mut [$crate::circuit::Lost; $most],
            ) {
                $(if true $(&& $present)? {
                    let input = |words: &[i64; $most]| $module::In {
                        $($in: words[$crate::circuit::circuit!(@net $in $($at)?)]),*
                    };
                    let now = input(words);
                    if <$type as $crate::Block>::CLOCKED || before.is_none_or(|before| input(before) != now) {
                        let shown = $module::Out { $($out: words[$crate::circuit::circuit!(@net $out $($to)?)]),* };
                        let $module::Out { $($out),* } = $crate::part::Part::follow(&mut self.$label, &now, shown);
                        $(
                            words[$crate::circuit::circuit!(@net $out $($to)?)] = $out.word;
                            lost[$crate::circuit::circuit!(@net $out $($to)?)] = ($out.rounded, $out.overflowed);
                        )*
                    }
                })*
            }

            #[inline]
            fn quiet(&self, words: &[i64; $most]) -> u64 {
                let least = u64::MAX;
                $(let least = if <$type as $crate::Block>::CLOCKED $(&& $present)? {
                    let input = $module::In { $($in: words[$crate::circuit::circuit!(@net $in $($at)?)]),* };
                    least.min(self.$label.quiet(&input))
                } else {
                    least
                };)*
                least
            }

            #[inline]
            fn skip(&mut self, edges: u64, words: &[i64; $most]) {
                $(if <$type as $crate::Block>::CLOCKED $(&& $present)? {
                    let input = $module::In { $($in: words[$crate::circuit::circuit!(@net $in $($at)?)]),* };
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
                $(if true $(&& $present)? {
                    let nets = [
                        $($crate::circuit::circuit!(@net $in $($at)?),)*
                        $($crate::circuit::circuit!(@net $out $($to)?),)*
                    ];
                    let instance = $crate::circuit::instance(stringify!($label), &self.$label, &nets);
                    $(let instance = instance.mapped($($generics)*);)?
                    all.push(instance);
                })*
                all
            }
        }
    };
    (@place $next:expr) => { ($next, $next + 1) };
    (@place $next:expr, $exists:ident $other:ident) => { if $exists { ($next, $next + 1) } else { ($other, $next) } };
    (@net $port:ident) => { Self::NET.$port };
    (@net $port:ident $net:ident) => { Self::NET.$net };
}

/// Returns an instance whose ports, inputs first, are connected to these nets.
pub(crate) fn instance<B: Block + Clone + 'static>(label: &'static str, block: &B, nets: &[usize]) -> Instance {
    let mut ports = flatten(&block.inputs());
    ports.extend(flatten(&block.outputs()));
    debug_assert_eq!(ports.len(), nets.len());
    let connections = ports.into_iter().zip(nets).map(|(port, &net)| Connection { port, net }).collect();
    let mut model = Box::new(block.clone());
    Block::reset(&mut *model);
    Instance { label, model, connections, tied: Vec::new(), generics: Vec::new() }
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
