//! Signals, and bundles of them.

use std::ops::Range;

use crate::{Cycle, Format};

/// A signal as its block describes it: everything that waveforms, vector files, packages and port tables need to know.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Signal {
    /// Name, the same in every language.
    pub name: &'static str,
    /// Word format.
    pub format: Format,
    /// Unit of the value (the word times 2^-F), as in `count`.
    pub unit: &'static str,
    /// One line of documentation.
    pub doc: &'static str,
}

impl Signal {
    /// A signal.
    #[must_use]
    pub fn new(name: &'static str, format: Format, unit: &'static str, doc: &'static str) -> Self {
        Self { name, format, unit, doc }
    }

    /// Whether it counts modulo its width from the place where it began. Its word is unsigned; traces and waveforms
    /// read it as signed, so that one that passes below zero goes on smoothly.
    #[must_use]
    pub fn is_counter(&self) -> bool {
        !self.format.is_signed() && ["position", "held"].contains(&self.name.trim_end_matches(['1', '2', '3']))
    }

    /// The value of a word as traces show it.
    #[must_use]
    pub fn shown(&self, word: i64) -> f64 {
        if self.is_counter() {
            return Format::signed(self.format.width()).wrap(word.into()) as f64;
        }
        self.format.to_f64(word)
    }

    /// A one-bit signal.
    #[must_use]
    pub fn bit(name: &'static str, doc: &'static str) -> Self {
        Self::new(name, Format::BIT, "1", doc)
    }
}

/// A bundle of ports: a struct generic over what it holds. `In<Signal>` describes, `In<i64>` carries.
///
/// Made by [`ports!`](crate::ports), so that order and completeness are the compiler's business.
pub trait Ports<T>: Sized {
    /// Builds the bundle, asking `next` for each port in order.
    fn build(next: impl FnMut() -> T) -> Self;
    /// Visits each port in order.
    fn each(&self, visit: impl FnMut(&T));
}

/// Defines a port bundle: `ports! { /// Inputs. pub struct In { position, reference } }`.
#[macro_export]
macro_rules! ports {
    ($(#[$meta:meta])* pub struct $name:ident { $($port:ident),* $(,)? }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, PartialEq, Eq, Debug)]
        #[allow(missing_docs, reason = "each port is documented by the signal that describes it")]
        pub struct $name<T> { $(pub $port: T),* }

        impl<T> $name<T> {
            /// The bundle of what `change` makes of each port, in order.
            #[allow(dead_code, reason = "not every bundle is changed port by port")]
            #[inline]
            #[must_use]
            pub fn map<U>(self, mut change: impl FnMut(T) -> U) -> $name<U> {
                $name { $($port: change(self.$port)),* }
            }
        }

        impl<T> $crate::Ports<T> for $name<T> {
            #[inline]
            fn build(mut next: impl FnMut() -> T) -> Self {
                Self { $($port: next()),* }
            }
            #[inline]
            fn each(&self, mut visit: impl FnMut(&T)) {
                $(visit(&self.$port);)*
            }
        }
    };
}

/// A continuous output of the plant, recorded beside the signals.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Real {
    /// Name with its SI unit, as in `angle_rad`.
    pub name: &'static str,
    /// One line of documentation.
    pub doc: &'static str,
}

/// Somebody who watches a run. Watching never changes what is watched.
pub trait Observe {
    /// The words of all nets after `cycle`; called at the start and at every edge that was ticked, whether or not one
    /// of them changed, and so at every edge at which one did.
    fn nets(&mut self, cycle: Cycle, words: &[i64]);
    /// The continuous outputs of the plant at `cycle`, in SI units; called at the rate the scene records them.
    fn reals(&mut self, cycle: Cycle, values: &[f64]);
    /// Whether it looks at anything at all. If not, a run leaves it out.
    fn watches(&self) -> bool {
        true
    }
    /// Whether the rows of [`reals`](Self::reals) have to tell means and extremes too, after the plant's outputs.
    fn measures(&self) -> bool {
        false
    }
    /// Whether it looks at any of these nets. If not, a run may pass over edges at which no others change.
    fn follows(&self, _nets: Range<usize>) -> bool {
        true
    }
}

/// Nobody watches.
impl Observe for () {
    fn watches(&self) -> bool {
        false
    }
    #[inline]
    fn follows(&self, _: Range<usize>) -> bool {
        false
    }
    #[inline]
    fn nets(&mut self, _: Cycle, _: &[i64]) {}
    #[inline]
    fn reals(&mut self, _: Cycle, _: &[f64]) {}
}

/// The use that a run made of one signal.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SignalUse {
    /// Least word seen.
    pub min: i64,
    /// Greatest word seen.
    pub max: i64,
    /// Clock edges during which the signal had lost bits below its least significant one.
    pub rounded: u64,
    /// Clock edges during which the signal had overflowed.
    pub overflowed: u64,
}

/// Measures the use of `N` signals: ranges, and for how many clock edges each had lost bits.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Meter<const N: usize> {
    uses: [SignalUse; N],
}

impl<const N: usize> Default for Meter<N> {
    fn default() -> Self {
        Self { uses: [SignalUse { min: i64::MAX, max: i64::MIN, rounded: 0, overflowed: 0 }; N] }
    }
}

impl<const N: usize> Meter<N> {
    /// Takes in the words as they stand.
    #[inline]
    pub fn range(&mut self, words: &[i64; N]) {
        for (seen, &word) in self.uses.iter_mut().zip(words) {
            seen.min = seen.min.min(word);
            seen.max = seen.max.max(word);
        }
    }

    /// Takes in some words in a row, from one signal on; the others stand as before.
    #[inline]
    pub fn range_from(&mut self, first: usize, words: &[i64]) {
        for (seen, &word) in self.uses[first..].iter_mut().zip(words) {
            seen.min = seen.min.min(word);
            seen.max = seen.max.max(word);
        }
    }

    /// Counts lost bits on one signal for a number of edges.
    #[inline]
    pub fn lost(&mut self, index: usize, rounded: bool, overflowed: bool, edges: u64) {
        self.uses[index].rounded += u64::from(rounded) * edges;
        self.uses[index].overflowed += u64::from(overflowed) * edges;
    }

    /// What was measured, in the order of the signals.
    #[must_use]
    pub fn uses(&self) -> &[SignalUse; N] {
        &self.uses
    }
}
