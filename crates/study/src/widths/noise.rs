//! Computes the law in `f64` beside the words, and by how much every word differs from it.
//!
//! The law runs through the wiring's own blocks. It reads each block's equations in real numbers ([`super::real`]) and
//! loads their registers on the same edges. It takes the encoder counts from the words, and the gains as the scene asks
//! for them. So the difference is what fixed-point arithmetic does, the rounding of gains included. For a method, the
//! law is its reference law in floats.
//!
//! In addition, every word is compared with the exact value of the words that it was computed from ([`super::exact`]).
//! This tells the losses by rounding and overflow in that block.

use hpu_cosim::LawConfig;
use hpu_datapath::Instance;
use hpu_signal::{Cycle, Format, Observe, Signal};

use super::Loss;
use super::book::Book;
use super::method::Method;
use super::parts::{Part, Parts};

/// The number that the law uses in place of a word that the scene sets.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Asked {
    /// This number.
    Is(f64),
    /// The word's value times this number.
    Share(f64),
}

/// The law beside the words of a run.
#[derive(Clone, Debug)]
pub struct Beside {
    all: Parts,
    inputs: usize,
    asked: Vec<Option<Asked>>,
    books: Vec<Book>,
    words: Vec<i64>,
    /// The value of every net in the law, and in words.
    law: Vec<f64>,
    values: Vec<f64>,
    /// The losses of every net by rounding and by overflow, in units of its least significant bit.
    lost: Vec<[f64; 2]>,
    /// The nets that count, each with its unwound range.
    spans: Vec<(usize, (f64, f64))>,
    /// Nets that equations or a method's law drive, and nets that count.
    driven: Vec<bool>,
    /// Nets that the law reads or drives, or that a narrowing drives.
    watched: Vec<usize>,
    /// Whether each part's losses are told at this edge.
    told: Vec<bool>,
}

impl Beside {
    /// Makes the law of a wiring with these nets; the first `inputs` nets are inputs.
    ///
    /// `asked` names inputs for which the law uses another number than the word. `law` is the law of a method loop,
    /// with the clock cycles that its datapath takes.
    pub fn new(
        nets: &[Signal],
        inputs: usize,
        instances: &[Instance],
        asked: &[(&str, Asked)],
        law: Option<(LawConfig, u64)>,
    ) -> Self {
        let all = Parts::new(instances, law);
        let mut books: Vec<Book> = nets.iter().map(|net| Book::of(net.format)).collect();
        for net in all.parts.iter().flat_map(Part::outputs) {
            (books[net].in_law, books[net].is_told) = (true, true);
        }
        let torques = || all.method.iter().flat_map(|method| &method.torques).copied();
        torques().for_each(|net| books[net].in_law = true);
        let asked: Vec<_> =
            nets.iter().map(|net| asked.iter().find(|(name, _)| *name == net.name).map(|(_, asked)| *asked)).collect();
        // A held position wraps as the position does.
        for (net, source) in all.parts.iter().flat_map(Part::handed_on) {
            books[net].in_law &= !all.counters.contains(&source);
        }
        for (book, asked) in books.iter_mut().zip(&asked) {
            book.in_law |= matches!(asked, Some(Asked::Share(_)));
        }
        let mut driven = vec![false; nets.len()];
        let outputs = all.parts.iter().flat_map(Part::outputs).chain(all.counters.iter().copied());
        outputs.chain(torques()).for_each(|net| driven[net] = true);
        let mut watched: Vec<usize> = (0..inputs).filter(|&net| nets[net].format != Format::BIT).collect();
        watched.extend(all.parts.iter().flat_map(Part::reads).chain((0..nets.len()).filter(|&net| driven[net])));
        watched.sort_unstable();
        watched.dedup();
        Self {
            spans: all.counters.iter().map(|&net| (net, (0.0, 0.0))).collect(),
            driven,
            watched,
            told: Vec::new(),
            all,
            inputs,
            asked,
            books,
            words: vec![0; nets.len()],
            law: vec![0.0; nets.len()],
            values: vec![0.0; nets.len()],
            lost: vec![[0.0; 2]; nets.len()],
        }
    }

    /// Closes the books at the last edge of the run.
    pub fn finish(&mut self, last: u64) {
        self.load_before(last + 1);
        self.books.iter_mut().for_each(|book| book.close(last + 1));
    }

    /// Returns the signal-to-noise ratio of a net in decibels; infinite when word and law never differed, `None` where
    /// there is no law or no signal.
    pub fn sqnr_db(&self, net: usize) -> Option<f64> {
        self.books[net].sqnr_db()
    }

    /// Returns the least and the greatest count, unwound, of a net that counts and wraps; `None` for any other net.
    pub fn span(&self, net: usize) -> Option<(f64, f64)> {
        self.spans.iter().find(|(counter, _)| *counter == net).map(|(_, span)| *span)
    }

    /// Returns the losses of a net by rounding and by overflow; `None` where its block does not report them.
    pub fn losses(&self, net: usize) -> Option<[Loss; 2]> {
        let book = &self.books[net];
        book.is_told.then_some(book.losses)
    }

    /// Hands the inputs to the law. Returns whether one has changed.
    fn take_inputs(&mut self, words: &[i64]) -> bool {
        let changed = self.words[..self.inputs] != words[..self.inputs];
        if changed {
            for (net, &word) in words[..self.inputs].iter().enumerate() {
                let value = self.books[net].format.to_f64(word);
                self.words[net] = word;
                self.values[net] = value;
                self.law[net] = match self.asked[net] {
                    None => value,
                    Some(Asked::Is(value)) => value,
                    Some(Asked::Share(share)) => value * share,
                };
            }
        }
        changed
    }

    /// Lets the combinational blocks of the law settle.
    fn settle(&mut self) {
        let Self { all, law, .. } = self;
        if let Some(method) = &all.method
            && let Some(torque) = method.live(law)
        {
            method.torques.iter().for_each(|&net| law[net] = torque);
        }
        all.parts.iter_mut().filter(|part| part.clock.is_none()).for_each(|part| part.settle(law));
    }

    /// Returns the next edge at which a register of the law may change.
    fn due(&self) -> u64 {
        let clocks = self.all.parts.iter().filter_map(|part| part.clock).filter(|clock| !clock.idle);
        let method = self.all.method.as_ref().map(Method::due);
        clocks.map(|clock| clock.next).fold(method.unwrap_or(u64::MAX), u64::min)
    }

    /// Loads the registers that are due at an edge. Returns whether anything changed.
    fn load(&mut self, edge: u64) -> bool {
        let Self { all, law, words, values, lost, .. } = self;
        let mut loaded: Vec<(usize, f64)> = Vec::new();
        let mut changed = false;
        for part in &mut all.parts {
            if part.clock.is_some_and(|clock| !clock.idle && clock.next == edge) {
                changed |= part.load(law, words, &mut loaded, lost);
            }
        }
        if let Some(method) = all.method.as_mut().filter(|method| method.due() == edge)
            && let Some(torque) = method.load(law, values)
        {
            changed |= method.torques.iter().any(|&net| law[net] != torque);
            loaded.extend(method.torques.iter().map(|&net| (net, torque)));
        }
        loaded.into_iter().for_each(|(net, value)| law[net] = value);
        changed
    }

    /// Makes registers load again that have rested up to an edge.
    fn wake(&mut self, edge: u64) {
        self.all.parts.iter_mut().filter_map(|part| part.clock.as_mut()).for_each(|clock| clock.wake(edge));
    }

    /// Does the loads that the law's registers do by themselves before an edge.
    fn load_before(&mut self, edge: u64) {
        while self.due() < edge {
            let due = self.due();
            if self.load(due) {
                self.settle();
                self.wake(due + 1);
                self.book(due);
            }
        }
    }

    /// Enters the values of every net at an edge into its book.
    fn book(&mut self, edge: u64) {
        for (net, book) in self.books.iter_mut().enumerate() {
            book.enter(edge, self.words[net], self.law[net], self.lost[net]);
        }
    }
}

impl Observe for Beside {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        let Cycle(edge) = cycle;
        if self.watched.iter().all(|&net| self.words[net] == words[net]) {
            return;
        }
        self.load_before(edge);
        if self.take_inputs(words) {
            self.wake(edge);
        }
        if self.due() == edge {
            self.settle();
        }
        while self.due() == edge {
            self.load(edge);
            self.wake(edge + 1);
        }
        for (net, (least, most)) in &mut self.spans {
            let format = Format::signed(self.books[*net].format.width());
            self.law[*net] += format.wrap(i128::from(words[*net]) - i128::from(self.words[*net])) as f64;
            (*least, *most) = (least.min(self.law[*net]), most.max(self.law[*net]));
        }
        let computed = |part: &Part| part.outputs().any(|net| self.words[net] != words[net]);
        let mut told = std::mem::take(&mut self.told);
        told.clear();
        told.extend(self.all.parts.iter().map(|part| part.tells_at_once() || part.computes() && computed(part)));
        for (net, &word) in words.iter().enumerate() {
            if self.words[net] != word {
                self.words[net] = word;
                self.values[net] = self.books[net].format.to_f64(word);
                // The law takes a net that no equation drives from the words.
                if net >= self.inputs && !self.driven[net] {
                    self.law[net] = self.values[net];
                }
            }
        }
        for (part, _) in self.all.parts.iter_mut().zip(&told).filter(|(_, told)| **told) {
            part.tell(&self.words, &mut self.lost);
        }
        self.told = told;
        self.settle();
        self.wake(edge + 1);
        self.book(edge);
    }

    fn reals(&mut self, _: Cycle, _: &[f64]) {}

    fn follows(&self, nets: std::ops::Range<usize>) -> bool {
        self.watched.iter().any(|net| nets.contains(net))
    }
}
