//! Signals, bundles of ports, and the observation of runs.

use std::ops::Range;

use crate::{Cycle, Format};

/// A signal as described by the block that owns it. Waveforms, vector files, packages and port tables are made from it.
///
/// ```
/// use hpu_signal::{Format, Signal};
/// let speed = Signal::new("velocity", Format::new(true, 9, 4).unwrap(), "count/sample", "The speed.");
/// assert_eq!(speed.shown(-24), -1.5);
/// ```
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Signal {
    /// Name, which is the same in every language.
    pub name: &'static str,
    /// Word format.
    pub format: Format,
    /// Unit of the value (the word times 2^-F), such as `count`.
    pub unit: &'static str,
    /// One line of documentation.
    pub doc: &'static str,
}

impl Signal {
    /// Returns a signal.
    pub fn new(name: &'static str, format: Format, unit: &'static str, doc: &'static str) -> Self {
        Self { name, format, unit, doc }
    }

    /// Whether the signal counts from its start, modulo its width. Its word is unsigned; traces and waveforms read it
    /// as signed, so that a count that passes below zero stays smooth.
    pub fn is_counter(&self) -> bool {
        !self.format.is_signed() && ["position", "held"].contains(&self.name.trim_end_matches(['1', '2', '3']))
    }

    /// Returns the value of a word as traces show it.
    pub fn shown(&self, word: i64) -> f64 {
        if self.is_counter() {
            return Format::signed(self.format.width()).wrap(word.into()) as f64;
        }
        self.format.to_f64(word)
    }

    /// Returns a one-bit signal.
    pub fn bit(name: &'static str, doc: &'static str) -> Self {
        Self::new(name, Format::BIT, "1", doc)
    }
}

/// A bundle of ports: a struct that is generic over the type of its ports. `In<Signal>` describes the ports, `In<i64>`
/// carries their words.
///
/// Every block has a bundle of inputs and one of outputs. [`ports!`](crate::ports) implements the trait for them, so
/// that the compiler checks order and completeness.
pub trait Ports<T>: Sized {
    /// Builds the bundle; calls `next` for each port in order.
    fn build(next: impl FnMut() -> T) -> Self;
    /// Calls `visit` with each port in order.
    fn each(&self, visit: impl FnMut(&T));
}

/// Defines bundles of ports. A row of a described bundle is everything that is known of a port: its name, format, unit
/// and meaning. The name alone with a meaning is a bit. `= signal` describes the port as another block's; a meaning
/// after it replaces the one there. The bundle's function `of` returns the descriptions for a block. A bundle without
/// descriptions lists its names.
///
/// ```
/// use hpu_signal::{Format, ports};
///
/// /// A counter.
/// pub struct Counter {
///     width: u32,
/// }
///
/// ports! {
///     /// Inputs of the counter.
///     pub struct In of |block: &Counter| {
///         enable, "Counts at this edge";
///         start: Format::unsigned(block.width), "count", "Where it begins";
///     }
///     /// Outputs of the counter.
///     pub struct Out of |block: &Counter| {
///         position = In::of(block).start, "Where it is";
///     }
/// }
/// ports! {
///     /// Its registers.
///     pub struct Registers { position }
/// }
///
/// let Out { position } = Out::of(&Counter { width: 12 });
/// assert_eq!((position.name, position.format, position.doc), ("position", Format::unsigned(12), "Where it is"));
/// ```
#[macro_export]
macro_rules! ports {
    ($($(#[$meta:meta])* pub struct $name:ident of$([$($generic:tt)*])? |$block:tt: $Block:ty| {
        $($port:ident $(: $format:expr, $unit:literal)? $(= $signal:expr)? $(, $doc:literal)?;)*
    })+) => {$(
        $crate::ports! {
            $(#[$meta])*
            pub struct $name { $($(#[doc = $doc])? $port),* }
        }

        impl $name<$crate::Signal> {
            /// Describes the ports of a block.
            pub(crate) fn of$(<$($generic)*>)?($block: $Block) -> Self {
                Self { $($port: $crate::ports!(@ $port $(: $format, $unit)? $(= $signal)? $(, $doc)?)),* }
            }
        }
    )+};
    (@ $port:ident: $format:expr, $unit:literal, $doc:literal) => {
        $crate::Signal::new(stringify!($port), $format, $unit, $doc)
    };
    (@ $port:ident = $signal:expr $(, $doc:literal)?) => {
        $crate::Signal { name: stringify!($port), $(doc: $doc,)? ..$signal }
    };
    (@ $port:ident, $doc:literal) => {
        $crate::Signal::bit(stringify!($port), $doc)
    };
    ($(#[$meta:meta])* pub struct $name:ident { $($(#[$about:meta])* $port:ident),* $(,)? }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, PartialEq, Eq, Debug)]
        #[allow(missing_docs, reason = "a port without a meaning here is documented by the signal that describes it")]
        pub struct $name<T> { $($(#[$about])* pub $port: T),* }

        impl<T> $name<T> {
            /// Returns the bundle with the results of `change` for each port, called in order.
            #[allow(dead_code, reason = "not every bundle is changed port by port")]
            #[inline]
            pub fn map<U>(self, mut change: impl FnMut(T) -> U) -> $name<U> {
                $name { $($port: change(self.$port)),* }
            }
        }

        impl<T> $crate::Ports<T> for $name<T> {
            #[inline]
            fn build(mut next: impl FnMut() -> T) -> Self {
                Self { $($port: next()),* }
            }
            #[inline(always)]
            fn each(&self, mut visit: impl FnMut(&T)) {
                $(visit(&self.$port);)*
            }
        }
    };
}

/// A continuous output of the plant, recorded beside the signals.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Real {
    /// Name with its SI unit, such as `angle_rad`.
    pub name: &'static str,
    /// One line of documentation.
    pub doc: &'static str,
}

/// An observer of a run. Traces, recordings of waveforms, rows and metrics implement it; the run calls it as it goes.
/// An observer must not change the run. Observers compose as pairs.
///
/// ```
/// use hpu_signal::{Cycle, Observe};
/// /// Counts the cycles after which net 0 is not 0.
/// struct Contact(u64);
/// impl Observe for Contact {
///     fn nets(&mut self, _: Cycle, words: &[i64]) {
///         self.0 += u64::from(words[0] != 0);
///     }
///     fn reals(&mut self, _: Cycle, _: &[f64]) {}
/// }
/// let mut contact = Contact(0);
/// contact.nets(Cycle(7), &[1]);
/// assert_eq!(contact.0, 1);
/// ```
pub trait Observe {
    /// Receives the words of all nets after `cycle`. It is called at the start and at every edge that was ticked, so at
    /// every edge at which a net changed, and also at edges at which none did.
    fn nets(&mut self, cycle: Cycle, words: &[i64]);
    /// Receives the continuous outputs of the plant at `cycle`, in SI units. It is called at the rate at which the
    /// scene records them.
    fn reals(&mut self, cycle: Cycle, values: &[f64]);
    /// Receives a row with means and extremes: `shown` has the outputs as exact values rounded once. `judged` is the
    /// same row with the outputs of a run without means and extremes, which may be off by some units in the last place.
    /// A trace reads `judged`, so that verdicts do not depend on who watches.
    fn row(&mut self, cycle: Cycle, _judged: &[f64], shown: &[f64]) {
        self.reals(cycle, shown);
    }
    /// Receives successive rows of [`reals`](Self::reals), one every `stride` cycles from `first` on, `width` values to
    /// a row.
    #[inline]
    fn block(&mut self, first: Cycle, stride: u64, width: usize, values: &[f64]) {
        for (row, index) in values.chunks_exact(width).zip(0..) {
            self.reals(Cycle(first.0 + index * stride), row);
        }
    }
    /// Receives `count` successive rows of [`reals`](Self::reals) that are all alike.
    #[inline]
    fn still(&mut self, first: Cycle, stride: u64, count: u64, values: &[f64]) {
        for index in 0..count {
            self.reals(Cycle(first.0 + index * stride), values);
        }
    }
    /// Whether the observer looks at anything at all. If not, a run does not call it.
    fn watches(&self) -> bool {
        true
    }
    /// Whether the rows of [`reals`](Self::reals) must contain means and extremes too, after the plant's outputs.
    fn measures(&self) -> bool {
        false
    }
    /// Whether the observer reads any of these columns of a row with means and extremes. If not, a run need not find
    /// the extremes, and the columns hold any numbers.
    fn reads(&self, _columns: Range<usize>) -> bool {
        true
    }
    /// Whether the observer looks at any of these nets. If not, a run may pass over edges at which no other nets
    /// change.
    fn follows(&self, _nets: Range<usize>) -> bool {
        true
    }
    /// Whether the observer must be shown rows and nets in the order of their edges. If not, a run may show rows later
    /// than nets of later edges, many rows at once, also those of whole periods of a motion that repeats; rows among
    /// themselves always come in order.
    fn relates(&self) -> bool {
        true
    }
    /// Whether the observer looks at overflows. If not, a run does not call [`overflows`](Self::overflows).
    fn watches_overflows(&self) -> bool {
        false
    }
    /// Receives the nets that have lost upper bits after `cycle`, as the set of their indices: bit `n` is net `n`. It
    /// is called after [`nets`](Self::nets), at every edge that was ticked, for a datapath with words.
    fn overflows(&mut self, _cycle: Cycle, _nets: u64) {}
}

/// The observer that looks at nothing.
impl Observe for () {
    fn watches(&self) -> bool {
        false
    }
    fn relates(&self) -> bool {
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

/// Implements [`Observe`] by passing everything on to each of several observers, which may be missing.
macro_rules! passes_on {
    ($self:ident: $([$observer:expr, $to:expr]),+) => {
        fn watches(&$self) -> bool {
            $($observer.is_some_and(|observer| observer.watches()))||+
        }
        fn measures(&$self) -> bool {
            $($observer.is_some_and(|observer| observer.measures()))||+
        }
        fn reads(&$self, columns: Range<usize>) -> bool {
            $($observer.is_some_and(|observer| observer.measures() && observer.reads(columns.clone())))||+
        }
        #[inline]
        fn follows(&$self, nets: Range<usize>) -> bool {
            $($observer.is_some_and(|observer| observer.follows(nets.clone())))||+
        }
        fn relates(&$self) -> bool {
            $($observer.is_some_and(|observer| observer.relates()))||+
        }
        fn watches_overflows(&$self) -> bool {
            $($observer.is_some_and(|observer| observer.watches_overflows()))||+
        }
        #[inline]
        fn nets(&mut $self, cycle: Cycle, words: &[i64]) {
            $(if let Some(observer) = $to { observer.nets(cycle, words) })+
        }
        #[inline]
        fn reals(&mut $self, cycle: Cycle, values: &[f64]) {
            $(if let Some(observer) = $to { observer.reals(cycle, values) })+
        }
        fn row(&mut $self, cycle: Cycle, judged: &[f64], shown: &[f64]) {
            $(if let Some(observer) = $to { observer.row(cycle, judged, shown) })+
        }
        #[inline]
        fn block(&mut $self, first: Cycle, stride: u64, width: usize, values: &[f64]) {
            $(if let Some(observer) = $to { observer.block(first, stride, width, values) })+
        }
        #[inline]
        fn still(&mut $self, first: Cycle, stride: u64, count: u64, values: &[f64]) {
            $(if let Some(observer) = $to { observer.still(first, stride, count, values) })+
        }
        #[inline]
        fn overflows(&mut $self, cycle: Cycle, nets: u64) {
            $(if let Some(observer) = $to { observer.overflows(cycle, nets) })+
        }
    };
}

/// An observer that belongs to another part of the program.
impl<O: Observe + ?Sized> Observe for &mut O {
    passes_on!(self: [Some(&**self), Some(&mut **self)]);
}

/// An observer that may be missing.
impl<O: Observe> Observe for Option<O> {
    passes_on!(self: [self.as_ref(), self.as_mut()]);
}

/// Two observers of the same run: each event is passed on to the first, then to the second.
impl<A: Observe, B: Observe> Observe for (A, B) {
    passes_on!(self: [Some(&self.0), Some(&mut self.0)], [Some(&self.1), Some(&mut self.1)]);
}

/// The use that a run made of one signal: its range, and for how long it had lost bits.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SignalUse {
    /// The least word seen.
    pub min: i64,
    /// The greatest word seen.
    pub max: i64,
    /// Number of clock edges during which the signal had lost bits below its least significant bit.
    pub rounded: u64,
    /// Number of clock edges during which the signal had overflowed.
    pub overflowed: u64,
}

/// Measures the use of `N` signals: their ranges, and the number of clock edges for which each had lost bits.
///
/// ```
/// use hpu_signal::Meter;
/// let mut meter = Meter::<1>::default();
/// meter.range(&[3]);
/// meter.range(&[-2]);
/// meter.lost(0, false, true, 5);
/// let seen = meter.uses()[0];
/// assert_eq!((seen.min, seen.max, seen.overflowed), (-2, 3, 5));
/// ```
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
    /// Extends the ranges by the present words.
    #[inline]
    pub fn range(&mut self, words: &[i64; N]) {
        for (seen, &word) in self.uses.iter_mut().zip(words) {
            seen.min = seen.min.min(word);
            seen.max = seen.max.max(word);
        }
    }

    /// Extends the range of one signal by its present word.
    #[inline]
    pub fn range_of(&mut self, index: usize, word: i64) {
        let seen = &mut self.uses[index];
        // In most cases the range stays, and nothing is written.
        if word < seen.min {
            seen.min = word;
        }
        if word > seen.max {
            seen.max = word;
        }
    }

    /// Adds lost bits of one signal for a number of edges.
    #[inline]
    pub fn lost(&mut self, index: usize, rounded: bool, overflowed: bool, edges: u64) {
        self.uses[index].rounded += u64::from(rounded) * edges;
        self.uses[index].overflowed += u64::from(overflowed) * edges;
    }

    /// Counts the use between two states of this meter so many times more, at least once.
    pub fn repeat(&mut self, [then, now]: [&Self; 2], times: u64) {
        for (used, (then, now)) in self.uses.iter_mut().zip(then.uses.iter().zip(&now.uses)) {
            (used.min, used.max) = (used.min.min(now.min), used.max.max(now.max));
            used.rounded += times * (now.rounded - then.rounded);
            used.overflowed += times * (now.overflowed - then.overflowed);
        }
    }

    /// Returns the uses, in the order of the signals.
    pub fn uses(&self) -> &[SignalUse; N] {
        &self.uses
    }
}
