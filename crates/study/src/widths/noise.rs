//! The law in `f64` beside the words: by how much every word misses what it should be.
//!
//! The law runs through the wiring's own blocks, each by the equation of its data sheet ([`super::equations`]), its
//! registers loaded on the same edges, from the encoder counts as the words have them and the scene's gains as they
//! were asked for: what is left is what words do, the rounding of gains among it. A method's law is its reference law
//! in floats. Beside that every narrowing is held against the exact value of the words that went into it: that is what
//! rounding and overflow lost there.
//!
//! Exact here means `f64`: products of up to 53 bits.

use hpu_cosim::LawConfig;
use hpu_datapath::Instance;
use hpu_signal::{Cycle, Format, Observe, Signal};

use super::Loss;
use super::book::Book;
use super::equations::{Equation, Side};
use super::parts::{Method, Part, Parts, Source};

/// What the law takes in place of a word that the scene sets.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Asked {
    /// This number.
    Is(f64),
    /// The word's value times this.
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
    /// Every net as the law has it, and as the words have it.
    law: Vec<f64>,
    values: Vec<f64>,
    /// The exact value of every narrowed net, of the words that went into it.
    exact: Vec<f64>,
    /// The nets that count, and how far.
    spans: Vec<(usize, (f64, f64))>,
    /// Nets that an equation drives, or that count.
    driven: Vec<bool>,
    /// Nets that the law or a narrowing has to do with.
    watched: Vec<usize>,
    room: Vec<f64>,
}

impl Beside {
    /// The law of a wiring with these nets, of which `inputs` are inputs.
    ///
    /// `asked` are inputs that the law takes otherwise than as words; `law` is that of a method loop, with the edges
    /// that its datapath computes for.
    #[must_use]
    pub fn new(
        nets: &[Signal],
        inputs: usize,
        instances: &[Instance],
        asked: &[(&str, Asked)],
        law: Option<(LawConfig, u64)>,
    ) -> Self {
        let all = Parts::new(nets.len(), instances, law);
        let mut books: Vec<Book> = nets.iter().map(|net| Book::of(net.format)).collect();
        for part in &all.parts {
            for &net in part.outputs.iter().filter(|&&net| net < nets.len()) {
                books[net].in_law = true;
            }
            for &net in &part.told {
                let book = &mut books[net];
                book.narrowed = narrows(&part.equation);
                book.to_nearest = part.equation.rounds_to_nearest();
                let limit = match part.equation {
                    Equation::Limit(limit) => limit,
                    Equation::Room(limit) | Equation::Engine { limit, .. } if nets[net].unit == "N" => {
                        limit / book.format.lsb()
                    }
                    _ => f64::INFINITY,
                };
                book.ends = [book.ends[0].max(-limit), book.ends[1].min(limit)];
            }
        }
        let method = all.method.as_ref().map(|method| method.torque);
        method.into_iter().for_each(|net| books[net].in_law = true);
        let asked: Vec<_> =
            nets.iter().map(|net| asked.iter().find(|(name, _)| *name == net.name).map(|(_, asked)| *asked)).collect();
        // A held position counts round and round as the position does.
        let is_counter = |source: &Source| all.counters.iter().any(|&net| *source == Source::Net(net));
        for part in
            all.parts.iter().filter(|part| part.equation == Equation::Copy && part.inputs.iter().any(is_counter))
        {
            part.outputs.iter().for_each(|&net| books[net].in_law = false);
        }
        for (book, asked) in books.iter_mut().zip(&asked) {
            book.in_law |= matches!(asked, Some(Asked::Share(_)));
        }
        let count = all.nets[1];
        let mut driven = vec![false; count];
        let outputs = all.parts.iter().flat_map(|part| &part.outputs).chain(&all.counters).copied();
        outputs.chain(method).for_each(|net| driven[net] = true);
        let mut watched: Vec<usize> = (0..inputs).filter(|&net| nets[net].format != Format::BIT).collect();
        let read = all.parts.iter().flat_map(|part| &part.inputs).filter_map(|source| match source {
            Source::Net(net) => Some(*net),
            Source::Tied(_) => None,
        });
        watched.extend(read.chain((0..count).filter(|&net| driven[net])).filter(|&net| net < nets.len()));
        watched.sort_unstable();
        watched.dedup();
        Self {
            spans: all.counters.iter().map(|&net| (net, (0.0, 0.0))).collect(),
            driven,
            watched,
            all,
            inputs,
            asked,
            books,
            words: vec![0; nets.len()],
            law: vec![0.0; count],
            values: vec![0.0; count],
            exact: vec![0.0; count],
            room: Vec::new(),
        }
    }

    /// Ends the books at the last edge of the run.
    pub fn finish(&mut self, last: u64) {
        self.load_before(last + 1);
        self.books.iter_mut().for_each(|book| book.close(last + 1));
    }

    /// Signal over noise of a net in decibels; infinite when word and law never differed, none where there is no law or
    /// no signal.
    #[must_use]
    pub fn sqnr_db(&self, net: usize) -> Option<f64> {
        self.books[net].sqnr_db()
    }

    /// The least and the greatest count of a net that counts round and round, unwound; none of any other.
    #[must_use]
    pub fn span(&self, net: usize) -> Option<(f64, f64)> {
        self.spans.iter().find(|(counter, _)| *counter == net).map(|(_, span)| *span)
    }

    /// What a net has lost by rounding and by overflow; none where its block does not tell.
    #[must_use]
    pub fn losses(&self, net: usize) -> Option<[Loss; 2]> {
        let book = &self.books[net];
        book.narrowed.then_some(book.losses)
    }

    /// Takes an input as the law has it.
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

    /// Lets the law's combinational blocks settle.
    fn settle(&mut self) {
        let Self { all, law, room, .. } = self;
        if let Some(method) = &all.method
            && let Some(torque) = method.live(law)
        {
            law[method.torque] = torque;
        }
        for part in all.parts.iter_mut().filter(|part| part.clock.is_none()) {
            part.eval(Side::Law, law, room);
            part.outputs.iter().zip(&*room).for_each(|(&net, &value)| law[net] = value);
        }
    }

    /// The next edge at which a register of the law may change anything.
    fn due(&self) -> u64 {
        let clocks = self.all.parts.iter().filter_map(|part| part.clock).filter(|clock| !clock.idle);
        let method = self.all.method.as_ref().map(Method::due);
        clocks.map(|clock| clock.next).chain(method).min().unwrap_or(u64::MAX)
    }

    /// Loads the registers that are due at an edge; says whether anything changed.
    fn load(&mut self, edge: u64) -> bool {
        let Self { all, law, values, exact, room, .. } = self;
        let mut loaded: Vec<(usize, f64)> = Vec::new();
        let mut changed = false;
        for part in &mut all.parts {
            let Some(mut clock) = part.clock.filter(|clock| !clock.idle && clock.next == edge) else { continue };
            let period = clock.period.of(law).max(1.0) as u64;
            let before = part.remembers();
            part.eval(Side::Law, law, room);
            clock.next += period;
            clock.idle =
                before == part.remembers() && part.outputs.iter().zip(&*room).all(|(&net, &new)| law[net] == new);
            changed |= !clock.idle;
            part.clock = Some(clock);
            loaded.extend(part.outputs.iter().copied().zip(room.iter().copied()));
            if narrows(&part.equation) && !matches!(part.equation, Equation::Engine { .. }) {
                part.eval(Side::Words, values, room);
                part.told.iter().zip(&*room).for_each(|(&net, &value)| exact[net] = value);
            }
        }
        if let Some(method) = all.method.as_mut().filter(|method| method.due() == edge)
            && let Some(torque) = method.load(law, values)
        {
            changed |= law[method.torque] != torque;
            loaded.push((method.torque, torque));
        }
        loaded.into_iter().for_each(|(net, value)| law[net] = value);
        changed
    }

    /// Wakes the registers that rested until an edge.
    fn wake(&mut self, edge: u64) {
        let law = &self.law;
        for part in &mut self.all.parts {
            if let Some(clock) = part.clock.as_mut().filter(|clock| clock.idle) {
                let period = clock.period.of(law).max(1.0) as u64;
                clock.next += edge.saturating_sub(clock.next).div_ceil(period) * period;
                clock.idle = false;
            }
        }
    }

    /// What the law's registers do by themselves before an edge.
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

    /// Brings every book up to date at an edge.
    fn book(&mut self, edge: u64) {
        for (net, book) in self.books.iter_mut().enumerate() {
            book.enter(edge, self.words[net], self.law[net], self.exact[net]);
        }
    }
}

/// Whether words may be lost on the way out of a block.
fn narrows(equation: &Equation) -> bool {
    !matches!(equation, Equation::Copy | Equation::Displacement(_) | Equation::Unilateral | Equation::Sine(_))
}

/// The engine's exact values, and those of combinational blocks, of the words as they stand.
fn exact_of(part: &mut Part, values: &[f64], exact: &mut [f64], room: &mut Vec<f64>) {
    part.eval(Side::Words, values, room);
    part.told.iter().zip(&*room).for_each(|(&net, &value)| exact[net] = value);
}

impl Observe for Beside {
    fn nets(&mut self, cycle: Cycle, words: &[i64]) {
        let Cycle(edge) = cycle;
        if self.watched.iter().all(|&net| self.words[net] == words[net]) {
            return;
        }
        self.load_before(edge);
        if self.take_inputs(words) {
            self.settle();
            self.wake(edge);
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
        let computed = self.all.parts.iter().any(|part| {
            matches!(part.equation, Equation::Engine { .. })
                && part.outputs.iter().any(|&net| self.words[net] != words[net])
        });
        for (net, &word) in words.iter().enumerate() {
            if self.words[net] != word {
                self.words[net] = word;
                self.values[net] = self.books[net].format.to_f64(word);
                // What no equation drives, the law takes as it is.
                if net >= self.inputs && !self.driven[net] {
                    self.law[net] = self.values[net];
                }
            }
        }
        let Self { all, values, exact, room, .. } = self;
        for part in &mut all.parts {
            let engine = matches!(part.equation, Equation::Engine { .. });
            if part.clock.is_none() && narrows(&part.equation) || engine && computed {
                exact_of(part, values, exact, room);
            }
        }
        self.settle();
        self.wake(edge + 1);
        self.book(edge);
    }

    fn reals(&mut self, _: Cycle, _: &[f64]) {}

    fn follows(&self, nets: std::ops::Range<usize>) -> bool {
        self.watched.iter().any(|net| nets.contains(net))
    }
}
