//! Whole netlists, held against stepping every cell at every edge by the Verilog standard.

use hpu_leap::{AsynchronousReset, Leap, MadeClock, Net, Netlist, Operation, Share};

use crate::random::Random;
use crate::verilog;

/// Place, active level and word of an asynchronous reset.
type Reset = (usize, u64, u64);

/// A netlist as the tests step it: words by their places.
#[derive(Default)]
struct Plain {
    netlist: Netlist,
    nets: Vec<Net>,
    widths: Vec<u8>,
    words: Vec<u64>,
    inputs: Vec<usize>,
    cells: Vec<(Operation, Vec<usize>, usize)>,
    /// Place of the register, place of its data, and its asynchronous reset.
    registers: Vec<(usize, usize, Option<Reset>)>,
    outputs: Vec<usize>,
    /// Registers on clocks that the netlist makes: their places, those of the clocks, the level after an edge.
    made: Vec<(usize, usize, u64)>,
    /// The edges that these clocks have had.
    rose: u64,
}

impl Plain {
    fn add(&mut self, net: Net, word: u64) -> usize {
        self.widths.push(self.netlist.width(net));
        self.nets.push(net);
        self.words.push(word);
        self.nets.len() - 1
    }

    fn constant(&mut self, word: u64, width: u8) -> usize {
        let net = self.netlist.constant(word, width);
        self.add(net, word)
    }

    fn input(&mut self, width: u8) -> usize {
        let net = self.netlist.input("input", width);
        let place = self.add(net, 0);
        self.inputs.push(place);
        place
    }

    fn register(&mut self, width: u8, word: u64) -> usize {
        let net = self.netlist.register("register", width, (word, u64::MAX));
        let place = self.add(net, word);
        self.registers.push((place, place, None));
        place
    }

    fn connect(&mut self, register: usize, data: usize, reset: Option<Reset>) {
        let asynchronous = reset.map(|(net, active, word)| AsynchronousReset {
            net: self.nets[net],
            active: active == 1,
            word,
            at_start: true,
        });
        self.netlist.connect(self.nets[register], self.nets[data], asynchronous);
        let at = self.registers.iter().position(|one| one.0 == register).expect("a register");
        self.registers[at] = (register, data, reset);
    }

    fn clock_by(&mut self, register: usize, clock: usize, rises: bool) {
        self.netlist.clock_by(self.nets[register], MadeClock { net: self.nets[clock], rises });
        self.made.push((register, clock, u64::from(rises)));
    }

    fn cell(&mut self, operation: Operation, operands: &[usize], width: u8) -> usize {
        let nets: Vec<_> = operands.iter().map(|place| self.nets[*place]).collect();
        let net = self.netlist.cell(operation, &nets, width);
        let place = self.add(net, 0);
        self.cells.push((operation, operands.to_vec(), place));
        place
    }

    /// Returns a word as one of another width, by one of the operations that do so.
    fn fitted(&mut self, word: usize, width: u8, random: &mut Random) -> usize {
        match self.widths[word] {
            own if own == width => word,
            own if own < width && random.below(4) == 0 => {
                let other = self.constant(random.below(1 << (width - own)), width - own);
                let operands = if random.below(2) == 0 { [word, other] } else { [other, word] };
                self.cell(Operation::Concat, &operands, width)
            }
            own if own < width => self.cell(Operation::Extend { signed: random.below(2) == 0 }, &[word], width),
            own => self.cell(Operation::Slice { low: random.below((own - width + 1).into()) as u8 }, &[word], width),
        }
    }

    fn output(&mut self, place: usize) {
        self.netlist.output("output", self.nets[place]);
        self.outputs.push(place);
    }

    fn settle(&mut self) {
        for _ in 0..=self.registers.len() {
            for (operation, operands, place) in &self.cells {
                let at = |index: usize| operands.get(index).copied().unwrap_or(operands[0]);
                let widths = [0, 1, 2].map(|index| self.widths[at(index)]);
                let words = [0, 1, 2].map(|index| self.words[at(index)]);
                self.words[*place] = verilog::word(*operation, self.widths[*place], widths, words);
            }
            let mut has_reset = false;
            for (register, _, reset) in &self.registers {
                if let Some((net, active, word)) = reset
                    && self.words[*net] == *active
                {
                    has_reset |= self.words[*register] != *word;
                    self.words[*register] = *word;
                }
            }
            // The cells are in their order: what is behind no other reset has settled.
            if !has_reset {
                break;
            }
        }
    }

    fn edge(&mut self) {
        let is_made = |register: usize| self.made.iter().any(|made| made.0 == register);
        let own: Vec<_> = self.registers.iter().filter(|one| !is_made(one.0)).copied().collect();
        let before = self.words.clone();
        self.take(&own);
        let has_edge = |register: usize| {
            let mut clocks = self.made.iter().filter(|made| made.0 == register);
            clocks.any(|&(_, clock, active)| before[clock] != active && self.words[clock] == active)
        };
        let made: Vec<_> = self.registers.iter().filter(|one| has_edge(one.0)).copied().collect();
        self.rose += made.len() as u64;
        if !made.is_empty() {
            self.take(&made);
        }
    }

    /// Gives registers their next words, all at once.
    fn take(&mut self, registers: &[(usize, usize, Option<Reset>)]) {
        let next = registers.iter().map(|(_, data, reset)| match reset {
            Some((net, active, word)) if self.words[*net] == *active => *word,
            _ => self.words[*data],
        });
        let next: Vec<_> = next.collect();
        for ((register, ..), word) in registers.iter().zip(next) {
            self.words[*register] = word;
        }
        self.settle();
    }

    fn leap(&self, ranks: &[u8]) -> Leap {
        let initial: Vec<_> = self.registers.iter().map(|(place, ..)| self.words[*place]).collect();
        let given = vec![0; self.inputs.len()];
        Leap::new(&self.netlist, (&initial, &given), ranks)
    }
}

/// Steps both for `edges` edges with inputs that change at random, and compares all outputs at every edge. Returns the
/// share of edges that were leapt over.
fn same(plain: &mut Plain, edges: u64, random: &mut Random) -> f64 {
    same_for(plain, edges, 400, random)
}

/// The same with inputs that rest for up to `most` edges.
fn same_for(plain: &mut Plain, edges: u64, most: u64, random: &mut Random) -> f64 {
    let ranks: Vec<u8> = plain.outputs.iter().map(|_| random.below(3) as u8).collect();
    let mut leap = plain.leap(&ranks);
    plain.settle();
    let (mut edge, mut shown) = (0, plain.outputs.iter().map(|place| plain.words[*place]).collect::<Vec<_>>());
    leap.tell(shown.iter().map(|word| Some(*word)));
    // In the second half, an input keeps its word, and is left out of the netlist.
    let (mut half, mut kept) = (Share::default(), None);
    while edge < edges {
        if edge > edges / 2 && kept.is_none() && !plain.inputs.is_empty() {
            let input = random.below(plain.inputs.len() as u64) as usize;
            let given: Vec<_> = plain.inputs.iter().map(|place| plain.words[*place]).collect();
            let registers: Vec<_> = leap.registers().collect();
            (half, kept) = (leap.share(), Some((input, given[input])));
            leap = Leap::new(&plain.netlist.with_input(input, given[input]), (&registers, &given), &ranks);
            leap.tell(shown.iter().map(|word| Some(*word)));
        }
        let mut words: Vec<_> = plain.inputs.iter().map(|place| random.below(1 << plain.widths[*place])).collect();
        kept.iter().for_each(|(input, word)| words[*input] = *word);
        for (place, word) in plain.inputs.iter().zip(&words) {
            plain.words[*place] = *word;
        }
        plain.settle();
        leap.input(&words);
        let most = if random.below(3) == 0 { 40 } else { most };
        let until = edge + 1 + random.below(most);
        while edge < until {
            let asked = random.below(3) as u8;
            let mut changes = Vec::new();
            let done = leap.clock(until - edge, asked, |at, output, word| changes.push((at, output, word)));
            assert!(done > 0 && done <= until - edge);
            let mut expected = Vec::new();
            for at in 1..=done {
                plain.edge();
                for (output, place) in plain.outputs.iter().enumerate().filter(|(output, _)| ranks[*output] <= asked) {
                    if plain.words[*place] != shown[output] {
                        shown[output] = plain.words[*place];
                        expected.push((at, output, shown[output]));
                    }
                }
                let ends = expected.iter().any(|(_, output, _)| ranks[*output] == 0);
                assert!(at == done || !ends, "a request goes on past a change");
                if at == done && !ends {
                    assert_eq!(done, until - edge, "a request ends early");
                }
            }
            assert_eq!(changes, expected, "after edge {edge}");
            edge += done;
            let registers: Vec<_> = plain.registers.iter().map(|(place, ..)| plain.words[*place]).collect();
            assert_eq!(leap.registers().collect::<Vec<_>>(), registers, "after edge {edge}");
        }
    }
    assert_eq!(half.edges + leap.share().edges, edge);
    (half.leapt + leap.share().leapt) as f64 / edge as f64
}

/// Which registers outputs depend on, held against following each word forwards until nothing is new.
#[test]
fn live_registers_are_those_that_an_output_depends_on() {
    let (mut dead, mut all) = (0, 0);
    for seed in 1..=300u64 {
        let mut random = Random(seed.wrapping_mul(0x9e6c_63d0_876a_68f3));
        let plain = random_netlist(&mut random);
        let shown = plain.outputs[random.below(plain.outputs.len() as u64) as usize];
        let live = plain.netlist.live(|output| plain.outputs[output] == shown);
        for (at, (own, ..)) in plain.registers.iter().enumerate() {
            let mut reached = vec![false; plain.nets.len()];
            reached[*own] = true;
            for _ in 0..plain.nets.len() {
                for (_, operands, place) in &plain.cells {
                    reached[*place] |= operands.iter().any(|place| reached[*place]);
                }
                for (register, data, reset) in &plain.registers {
                    let by_clock = plain.made.iter().any(|made| made.0 == *register && reached[made.1]);
                    reached[*register] |= reached[*data] || by_clock || reset.is_some_and(|reset| reached[reset.0]);
                }
            }
            assert_eq!(live[at], reached[shown], "netlist {seed}, register {at}");
            (dead, all) = (dead + u32::from(!live[at]), all + 1);
        }
    }
    assert!(dead > 50 && dead + 50 < all, "{dead} of {all} are dead");
}

/// Returns a netlist with counters, accumulators, random logic, asynchronous resets, and clocks that it makes.
fn random_netlist(random: &mut Random) -> Plain {
    let mut plain = Plain::default();
    if random.below(8) == 0 {
        // Registers and outputs at rest before all others, which then have numbers from 64 on.
        for _ in 0..64 {
            let rests = plain.register(1, 0);
            plain.output(rests);
        }
    }
    for _ in 0..1 + random.below(3) {
        plain.input(1 + random.below(6) as u8);
    }
    for _ in 0..2 {
        let width = 1 + random.below(8) as u8;
        plain.constant(random.below(1 << width), width);
    }
    let mut registers = Vec::new();
    for _ in 0..3 + random.below(6) {
        let width = if random.below(4) == 0 { 1 } else { 4 + random.below(9) as u8 };
        registers.push(plain.register(width, random.below(1 << width)));
    }
    for _ in 0..12 + random.below(40) {
        let mut any = |plain: &Plain| random.below(plain.nets.len() as u64) as usize;
        let (a, b, c) = (any(&plain), any(&plain), any(&plain));
        let width = plain.widths[b];
        match random.below(16) {
            0 | 1 => {
                let other = plain.fitted(c, width, random);
                let operations = [Operation::And, Operation::Or, Operation::Xor];
                plain.cell(operations[random.below(3) as usize], &[b, other], width)
            }
            2..=5 => {
                let other = plain.fitted(c, width, random);
                plain.cell([Operation::Add, Operation::Sub][random.below(2) as usize], &[b, other], width)
            }
            6..=9 => {
                let other = plain.fitted(c, width, random);
                let signed = random.below(2) == 0;
                let operations =
                    [Operation::Less { signed }, Operation::AtMost { signed }, Operation::Equal, Operation::Differ];
                plain.cell(operations[random.below(4) as usize], &[b, other], 1)
            }
            10..=13 => {
                let (selector, other) = (plain.fitted(a, 1, random), plain.fitted(c, width, random));
                plain.cell(Operation::Mux, &[selector, b, other], width)
            }
            14 => {
                let operations = [Operation::ShiftLeft, Operation::ShiftRight { signed: random.below(2) == 0 }];
                plain.cell(operations[random.below(2) as usize], &[b, c], width)
            }
            _ if random.below(2) == 0 => plain.cell(Operation::Not, &[b], width),
            _ => {
                let other = plain.fitted(c, width, random);
                plain.cell(Operation::Mul, &[b, other], width)
            }
        };
    }
    let (source, makes) = (registers[0], random.below(3) == 0);
    for &register in &registers {
        let width = plain.widths[register];
        let picked = random.below(plain.nets.len() as u64) as usize;
        let data = match random.below(5) {
            // A counter, which a condition may clear.
            0 | 1 => {
                let step = plain.constant(1 + random.below(3), width.max(2));
                let step = plain.fitted(step, width, random);
                let next = plain.cell(Operation::Add, &[register, step], width);
                let (clear, zero) = (plain.fitted(picked, 1, random), plain.constant(0, width));
                if random.below(2) == 0 { next } else { plain.cell(Operation::Mux, &[clear, next, zero], width) }
            }
            // An accumulator of any other word.
            2 => {
                let step = plain.fitted(picked, width, random);
                plain.cell(Operation::Add, &[register, step], width)
            }
            // A register with a clock enable.
            3 => {
                let (enable, next) = (plain.fitted(picked, 1, random), random.below(plain.nets.len() as u64) as usize);
                let next = plain.fitted(next, width, random);
                plain.cell(Operation::Mux, &[enable, register, next], width)
            }
            _ => plain.fitted(picked, width, random),
        };
        let is_reset = random.below(6) == 0 && !(makes && register == source);
        let reset = is_reset.then(|| {
            let trigger = random.below(plain.nets.len() as u64) as usize;
            (plain.fitted(trigger, 1, random), random.below(2), random.below(1 << width))
        });
        plain.connect(register, data, reset);
    }
    if makes {
        let low = random.below(u64::from(plain.widths[source]).min(5)) as u8;
        let bit = plain.cell(Operation::Slice { low }, &[source], 1);
        for &register in &registers[1..] {
            if random.below(2) == 0 {
                plain.clock_by(register, bit, random.below(3) > 0);
            }
        }
    }
    for _ in 0..4 {
        plain.output(random.below(plain.nets.len() as u64) as usize);
    }
    plain
}

#[test]
fn random_netlists_have_the_words_of_plain_stepping() {
    let (mut leapt, mut resets, mut made) = (0.0, 0, 0);
    const NETLISTS: u64 = 500;
    for seed in 1..=NETLISTS {
        let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut plain = random_netlist(&mut random);
        resets += u32::from(plain.registers.iter().any(|(.., reset)| reset.is_some()));
        leapt += same(&mut plain, 3000, &mut random);
        made += u32::from(plain.rose > 20);
    }
    assert!(made > 50, "{made} netlists with clocks of their own");
    let share = leapt / NETLISTS as f64;
    assert!(share > 0.2, "only {share} of the edges are leapt over");
    assert!(resets > 50, "{resets} netlists with asynchronous resets");
}

/// Returns a netlist whose counters and accumulators wait for prescalers, dividers and clocks that it makes.
fn prescaled_netlist(random: &mut Random) -> Plain {
    let mut plain = Plain::default();
    let input = plain.input(1 + random.below(4) as u8);
    let zero = plain.constant(0, 1);
    let mut enables = Vec::new();
    let mut prescalers = Vec::new();
    for _ in 0..1 + random.below(2) {
        let width = 1 + random.below(5) as u8;
        let (prescaler, one) = (plain.register(width, 0), plain.constant(1, width));
        let next = plain.cell(Operation::Add, &[prescaler, one], width);
        let last = plain.constant(random.below(1 << width), width);
        let is_last = plain.cell(Operation::Equal, &[prescaler, last], 1);
        let none = plain.constant(0, width);
        let data = if random.below(4) == 0 { next } else { plain.cell(Operation::Mux, &[is_last, next, none], width) };
        plain.connect(prescaler, data, None);
        enables.push(match random.below(3) {
            0 => plain.cell(Operation::Slice { low: random.below(width.into()) as u8 }, &[prescaler], 1),
            _ => is_last,
        });
        prescalers.push(prescaler);
    }
    let toggle = plain.register(1, 0);
    let other = plain.cell(Operation::Xor, &[toggle, enables[0]], 1);
    plain.connect(toggle, other, None);
    enables.push(plain.cell(Operation::And, &[toggle, enables[0]], 1));
    let mut counters = Vec::new();
    for _ in 0..2 + random.below(3) {
        counters.push(plain.register(5 + random.below(8) as u8, 0));
    }
    let mut bits = vec![zero];
    for at in 0..counters.len() {
        let (own, with) = (counters[at], counters[random.below(counters.len() as u64) as usize]);
        let width = plain.widths[own];
        let step = match random.below(4) {
            0 => with,
            1 => input,
            _ => plain.constant(1 + random.below(3), 2),
        };
        let step = plain.fitted(step, width, random);
        let next = plain.cell([Operation::Add, Operation::Sub][random.below(2) as usize], &[own, step], width);
        let limit = if random.below(2) == 0 { with } else { plain.constant(random.below(1 << width), width) };
        let limit = plain.fitted(limit, width, random);
        let operation = [Operation::Less { signed: random.below(2) == 0 }, Operation::Equal][random.below(2) as usize];
        let bit = plain.cell(operation, &[own, limit], 1);
        bits.push(bit);
        let none = plain.constant(random.below(4), width);
        let next = if random.below(2) == 0 { next } else { plain.cell(Operation::Mux, &[bit, next, none], width) };
        let enable = enables[random.below(enables.len() as u64) as usize];
        let data = plain.cell(Operation::Mux, &[enable, own, next], width);
        let reset = (random.below(5) == 0).then(|| {
            let trigger = bits[random.below(bits.len() as u64) as usize];
            (trigger, random.below(2), random.below(1 << width))
        });
        plain.connect(own, data, reset);
        if reset.is_none() && random.below(4) == 0 {
            plain.clock_by(own, toggle, random.below(2) == 0);
        }
    }
    let flag = plain.register(1, 0);
    let bit = bits[random.below(bits.len() as u64) as usize];
    let data = plain.cell(Operation::Mux, &[enables[0], flag, bit], 1);
    plain.connect(flag, data, None);
    plain.output(flag);
    for _ in 0..random.below(3) {
        plain.output(bits[random.below(bits.len() as u64) as usize]);
    }
    plain.output(counters[0]);
    plain.output(prescalers[0]);
    plain
}

/// Prescalers, dividers and clocks of the design: jumps over whole periods, under inputs that change now and then.
#[test]
fn periods_of_prescalers_have_the_words_of_plain_stepping() {
    let (mut leapt, mut well) = (0.0, 0);
    const NETLISTS: u64 = 200;
    for seed in 1..=NETLISTS {
        let mut random = Random(seed.wrapping_mul(0xd134_2543_de82_ef95));
        let mut plain = prescaled_netlist(&mut random);
        let share = same_for(&mut plain, 12_000, 6000, &mut random);
        leapt += share;
        well += u32::from(share > 0.5);
    }
    let share = leapt / NETLISTS as f64;
    assert!(share > 0.2 && well > 25, "only {share} of the edges are leapt over, {well} netlists well");
}

/// Returns a netlist with generators of random bits, dividers and shifted toggles, which a word may hold, and which
/// counters and flags see only while a gate is open.
fn clustered_netlist(random: &mut Random) -> Plain {
    let mut plain = Plain::default();
    let (gate, hold, value) = (plain.input(1), plain.input(1), plain.input(4));
    let (zero, one) = (plain.constant(0, 10), plain.constant(1, 10));
    let mode = plain.register(1, 0);
    let data = plain.cell(Operation::Mux, &[hold, mode, gate], 1);
    plain.connect(mode, data, None);
    let mut bits = Vec::new();
    for _ in 0..1 + random.below(2) {
        let width = 3 + random.below(5) as u8;
        let first = plain.register(width, 1 + random.below(7));
        let next = match random.below(3) {
            0 => {
                let taps = plain.constant(1 + random.below((1 << width) - 1), width);
                let tapped = plain.cell(Operation::And, &[first, taps], width);
                let bit = plain.cell(Operation::Parity, &[tapped], 1);
                let low = plain.cell(Operation::Slice { low: 0 }, &[first], width - 1);
                plain.cell(Operation::Concat, &[low, bit], width)
            }
            1 => {
                let last = 1 + random.below((1 << width) - 1).min(11);
                let [none, step, last] = [0, 1, last].map(|word| plain.constant(word, width));
                let next = plain.cell(Operation::Add, &[first, step], width);
                let is_last = plain.cell(Operation::AtMost { signed: false }, &[last, first], 1);
                plain.cell(Operation::Mux, &[is_last, next, none], width)
            }
            _ => plain.cell(Operation::Not, &[first], width),
        };
        let held = [hold, mode, gate][random.below(3) as usize];
        let data = if random.below(2) == 0 { next } else { plain.cell(Operation::Mux, &[held, next, first], width) };
        let bit = plain.cell(Operation::Slice { low: random.below(width.into()) as u8 }, &[first], 1);
        let reset = match random.below(6) {
            0 => Some((hold, random.below(2), random.below(1 << width))),
            1 => Some((bit, random.below(2), random.below(1 << width))),
            _ => None,
        };
        plain.connect(first, data, reset);
        let shifted = plain.register(2, 0);
        let low = plain.cell(Operation::Slice { low: 0 }, &[shifted], 1);
        let data = plain.cell(Operation::Concat, &[low, bit], 2);
        plain.connect(shifted, data, None);
        let late = plain.cell(Operation::Slice { low: 1 }, &[shifted], 1);
        let other = plain.cell(Operation::Xor, &[late, [hold, bit][random.below(2) as usize]], 1);
        bits.extend([bit, late, other]);
    }
    let any = |random: &mut Random| bits[random.below(bits.len() as u64) as usize];
    let gated = any(random);
    let gated = plain.cell(Operation::And, &[gated, gate], 1);
    let ramp = plain.register(10, 0);
    let next = plain.cell(Operation::Add, &[ramp, one], 10);
    let next = if random.below(3) == 0 { plain.cell(Operation::Mux, &[gated, next, zero], 10) } else { next };
    plain.connect(ramp, next, None);
    let low = plain.constant(random.below(64), 6);
    let limit = plain.cell(Operation::Concat, &[value, low], 10);
    let pulse = plain.cell(Operation::Less { signed: false }, &[ramp, limit], 1);
    let sum = plain.register(10, 0);
    let added = [gated, any(random), pulse][random.below(3) as usize];
    let added = plain.cell(Operation::And, &[added, gate], 1);
    let step = plain.fitted(added, 10, random);
    let next = plain.cell(Operation::Add, &[sum, step], 10);
    let reset = (random.below(4) == 0).then(|| (gated, random.below(2), random.below(1 << 10)));
    plain.connect(sum, next, reset);
    if reset.is_none() && random.below(4) == 0 {
        let bit = plain.register(1, 0);
        let source = any(random);
        let data = if random.below(2) == 0 { gated } else { source };
        plain.connect(bit, data, None);
        plain.clock_by(sum, bit, random.below(2) == 0);
    }
    let flag = plain.register(1, 0);
    let data = plain.cell(Operation::Mux, &[gated, flag, pulse], 1);
    plain.connect(flag, data, None);
    plain.output(pulse);
    plain.output(flag);
    let shown = plain.cell(Operation::Slice { low: 5 }, &[sum], 1);
    plain.output(shown);
    if random.below(4) == 0 {
        let bit = any(random);
        plain.output(bit);
    }
    plain
}

/// Clusters run for themselves for as long as nothing that they take changes, whether anything sees them or not.
#[test]
fn clusters_have_the_words_of_plain_stepping() {
    let (mut leapt, mut well) = (0.0, 0);
    const NETLISTS: u64 = 200;
    for seed in 1..=NETLISTS {
        let mut random = Random(seed.wrapping_mul(0xa076_1d64_78bd_642f));
        let mut plain = clustered_netlist(&mut random);
        let share = same_for(&mut plain, 12_000, 6000, &mut random);
        leapt += share;
        well += u32::from(share > 0.4);
    }
    let share = leapt / NETLISTS as f64;
    assert!(share > 0.2 && well > 50, "only {share} of the edges are leapt over, {well} netlists well");
}

/// A generator of 31 states that nothing sees while a gate is closed, beside a counter: jumps are those of the counter
/// alone. The generator has the words of plain stepping behind them, and where the gate opens.
#[test]
fn a_generator_that_nothing_sees_bounds_no_jump() {
    let mut plain = Plain::default();
    let (gate, one) = (plain.input(1), plain.constant(1, 10));
    let (noise, count) = (plain.register(5, 1), plain.register(10, 0));
    let taps = plain.constant(0b1_0100, 5);
    let tapped = plain.cell(Operation::And, &[noise, taps], 5);
    let bit = plain.cell(Operation::Parity, &[tapped], 1);
    let low = plain.cell(Operation::Slice { low: 0 }, &[noise], 4);
    let next = plain.cell(Operation::Concat, &[low, bit], 5);
    plain.connect(noise, next, None);
    let next = plain.cell(Operation::Add, &[count, one], 10);
    plain.connect(count, next, None);
    let half = plain.cell(Operation::Slice { low: 9 }, &[count], 1);
    let gated = plain.cell(Operation::And, &[bit, gate], 1);
    let shown = plain.cell(Operation::Xor, &[half, gated], 1);
    plain.output(shown);
    let mut leap = plain.leap(&[0]);
    plain.settle();
    leap.tell([Some(0)]);
    let mut last = 0;
    for (word, edges, most) in [(0, 100_000, 2000), (1, 5000, 5001), (0, 100_000, 2000)] {
        leap.input(&[word]);
        plain.words[gate] = word;
        plain.settle();
        let (mut done, before) = (0, leap.share().steps);
        while done < edges {
            let mut said = last;
            let more = leap.clock(edges - done, 0, |_, _, word| said = word);
            for _ in 0..more {
                assert!(plain.words[shown] == last || done == 0);
                plain.edge();
            }
            assert_eq!((said, plain.words[noise]), (plain.words[shown], leap.registers().next().unwrap()));
            (last, done) = (said, done + more);
        }
        assert!(leap.share().steps - before < most, "{:?}", leap.share());
    }
}

/// A slow counter behind a divider lets a register take an input at one of 1000 edges. The input changes between.
#[test]
fn a_register_that_waits_for_a_slow_counter_bounds_a_jump_once_it_is_to_change() {
    let mut random = Random(0x5851_f42d_4c95_7f2d);
    let mut plain = Plain::default();
    let input = plain.input(4);
    let [phase, pace, taken, ramp] = [2, 8, 4, 12].map(|width| plain.register(width, 0));
    let next = |plain: &mut Plain, own, width, last| {
        let [one, last, none] = [1, last, 0].map(|word| plain.constant(word, width));
        let next = plain.cell(Operation::Add, &[own, one], width);
        let is_last = plain.cell(Operation::Equal, &[own, last], 1);
        (is_last, plain.cell(Operation::Mux, &[is_last, next, none], width))
    };
    let (rises, data) = next(&mut plain, phase, 2, 3);
    plain.connect(phase, data, None);
    let (is_last, data) = next(&mut plain, pace, 8, 249);
    let data = plain.cell(Operation::Mux, &[rises, pace, data], 8);
    plain.connect(pace, data, None);
    let data = plain.cell(Operation::Mux, &[is_last, taken, input], 4);
    let data = plain.cell(Operation::Mux, &[rises, taken, data], 4);
    plain.connect(taken, data, None);
    let (_, data) = next(&mut plain, ramp, 12, 2999);
    plain.connect(ramp, data, None);
    plain.output(taken);
    let top = plain.cell(Operation::Slice { low: 11 }, &[ramp], 1);
    plain.output(top);
    let share = same_for(&mut plain, 200_000, 3000, &mut random);
    assert!(share > 0.9, "{share}");
}

/// A flag takes a comparison at the nine edges of ten at which its counter is not enabled, and rests at the tenth.
/// Behind a period it has the word that it takes, and in a later period it has not.
#[test]
fn a_flag_of_the_edges_between_ends_a_jump_over_periods() {
    // The counter reaches the latter where the first period of a request ends.
    [600, 601].into_iter().for_each(flagged);
}

fn flagged(limit: u64) {
    let mut plain = Plain::default();
    let [one, last, none] = [1, 9, 0].map(|word| plain.constant(word, 4));
    let (step, limit) = (plain.constant(1, 10), plain.constant(limit, 10));
    let [phase, ramp, flag] = [(4, 0), (10, 0), (1, 0)].map(|(width, word)| plain.register(width, word));
    let enable = plain.cell(Operation::Equal, &[phase, last], 1);
    let next = plain.cell(Operation::Add, &[phase, one], 4);
    let data = plain.cell(Operation::Mux, &[enable, next, none], 4);
    plain.connect(phase, data, None);
    let next = plain.cell(Operation::Add, &[ramp, step], 10);
    let data = plain.cell(Operation::Mux, &[enable, ramp, next], 10);
    plain.connect(ramp, data, None);
    let pulse = plain.cell(Operation::Less { signed: false }, &[ramp, limit], 1);
    let data = plain.cell(Operation::Mux, &[enable, pulse, flag], 1);
    plain.connect(flag, data, None);
    let top = plain.cell(Operation::Slice { low: 9 }, &[ramp], 1);
    let outputs = [flag, top];
    outputs.iter().for_each(|output| plain.output(*output));
    let mut leap = plain.leap(&[0, 0]);
    plain.settle();
    leap.tell([Some(0), Some(0)]);
    let (mut said, mut done) = (Vec::new(), 0);
    while done < 100_000 {
        // Macro-steps begin at the edge behind an enabled one.
        done += leap.clock(2000 - done % 2000, 0, |at, output, word| said.push((done + at, output, word)));
    }
    let (mut expected, mut last) = (Vec::new(), [0; 2]);
    for edge in 1..=100_000 {
        plain.edge();
        for (output, place) in outputs.iter().enumerate() {
            if std::mem::replace(&mut last[output], plain.words[*place]) != last[output] {
                expected.push((edge, output, last[output]));
            }
        }
    }
    assert_eq!(said, expected);
    assert!(leap.share().steps < 5000, "{:?}", leap.share());
}

/// A ring of bits takes a bit of a counter. The counter rests while the ring is found to run freely, and goes on at the
/// edge at which another counter has wrapped. Then a jump begins at once, in which the ring must not keep to its orbit.
#[test]
fn a_cluster_ends_where_a_counter_moves_what_it_takes() {
    let mut plain = Plain::default();
    let enable = plain.input(1);
    let [one, last, none] = [1, 999, 0].map(|word| plain.constant(word, 10));
    let [ramp, count, ring] = [(10, 0), (10, 0), (5, 1)].map(|(width, word)| plain.register(width, word));
    let next = plain.cell(Operation::Add, &[ramp, one], 10);
    let is_last = plain.cell(Operation::Equal, &[ramp, last], 1);
    let data = plain.cell(Operation::Mux, &[is_last, next, none], 10);
    plain.connect(ramp, data, None);
    let next = plain.cell(Operation::Add, &[count, one], 10);
    let data = plain.cell(Operation::Mux, &[enable, count, next], 10);
    plain.connect(count, data, None);
    let (low, top) = (Operation::Slice { low: 0 }, Operation::Slice { low: 4 });
    let [low, top] = [(low, 4), (top, 1)].map(|(part, width)| plain.cell(part, &[ring], width));
    let turned = plain.cell(Operation::Concat, &[low, top], 5);
    let bit = plain.cell(Operation::Slice { low: 3 }, &[count], 1);
    let data = plain.cell(Operation::Mux, &[bit, turned, ring], 5);
    plain.connect(ring, data, None);
    let shown = plain.cell(Operation::Slice { low: 9 }, &[ramp], 1);
    plain.output(shown);
    let mut leap = plain.leap(&[0]);
    plain.settle();
    for (word, edges, more) in [(1, 100, 0), (0, 2900, 10), (1, 512, 10), (0, 488, 10)] {
        leap.input(&[word]);
        plain.words[enable] = word;
        plain.settle();
        // But for the first time, the output changes at the last edge, and ends a longer request.
        let mut done = 0;
        while done < edges {
            done += leap.clock(edges - done + more, 0, |_, _, _| {});
        }
        assert_eq!(done, edges);
        (0..edges).for_each(|_| plain.edge());
        let words = [ramp, count, ring].map(|place| plain.words[place]);
        assert_eq!(leap.registers().collect::<Vec<_>>(), words);
    }
}

/// A sawtooth of 1023 steps, compared with a word that is taken from an input at each wrap, after inputs that change
/// too often for jumps. The sawtooth stays a counter whether it wraps while clusters are looked for or not: with its
/// words from an orbit, each edge would bound a jump.
#[test]
fn a_counter_that_wraps_while_clusters_are_looked_for_stays_one() {
    for begin in (0..1023).step_by(93) {
        let mut plain = Plain::default();
        let wanted = plain.input(10);
        let (ramp, held) = (plain.register(10, begin), plain.register(10, 700));
        let [one, last, none] = [1, 1022, 0].map(|word| plain.constant(word, 10));
        let next = plain.cell(Operation::Add, &[ramp, one], 10);
        let is_last = plain.cell(Operation::Equal, &[ramp, last], 1);
        let data = plain.cell(Operation::Mux, &[is_last, next, none], 10);
        plain.connect(ramp, data, None);
        let data = plain.cell(Operation::Mux, &[is_last, held, wanted], 10);
        plain.connect(held, data, None);
        let pulse = plain.cell(Operation::Less { signed: false }, &[ramp, held], 1);
        plain.output(pulse);
        let mut leap = plain.leap(&[0]);
        plain.settle();
        let (mut random, mut shown) = (Random(begin + 1), plain.words[pulse]);
        let requests = (0..400).map(|_| 7).chain([100_000]);
        for edges in requests {
            let word = 100 + random.below(800);
            leap.input(&[word]);
            plain.words[wanted] = word;
            plain.settle();
            let (mut done, before) = (0, leap.share().steps);
            while done < edges {
                let mut said = shown;
                let more = leap.clock(edges - done, 0, |_, _, word| said = word);
                (0..more).for_each(|_| plain.edge());
                assert_eq!((said, leap.registers().next()), (plain.words[pulse], Some(plain.words[ramp])));
                (shown, done) = (said, done + more);
            }
            // Three jumps a period, and the edges in which periods and clusters are looked for.
            assert!(edges == 7 || leap.share().steps - before < 2000, "from {begin}: {:?}", leap.share());
        }
    }
}

/// A prescaler counts up at every edge, and a counter down at every twentieth. Over whole periods only the counter
/// moves; between two edges only the prescaler does, so that their sum does not rest.
#[test]
fn slopes_of_periods_end_with_them() {
    let mut plain = Plain::default();
    let (prescaler, count) = (plain.register(8, 0), plain.register(8, 200));
    let [one, last, none] = [1, 19, 0].map(|word| plain.constant(word, 8));
    let next = plain.cell(Operation::Add, &[prescaler, one], 8);
    let is_last = plain.cell(Operation::Equal, &[prescaler, last], 1);
    let data = plain.cell(Operation::Mux, &[is_last, next, none], 8);
    plain.connect(prescaler, data, None);
    let less = plain.cell(Operation::Sub, &[count, one], 8);
    let data = plain.cell(Operation::Mux, &[is_last, count, less], 8);
    plain.connect(count, data, None);
    let sum = plain.cell(Operation::Add, &[prescaler, count], 8);
    plain.output(none);
    plain.output(sum);
    let mut leap = plain.leap(&[0, 1]);
    leap.tell([Some(0), Some(200)]);
    plain.settle();
    let (mut leapt, mut shown) = (0, 200);
    for request in 0..400u64 {
        // Long requests do not ask for the sum.
        let (edges, asked) = if request % 2 == 0 { (3000, 0) } else { (7 + request % 30, 1) };
        let (before, mut changes) = (leap.share().leapt, Vec::new());
        assert_eq!(leap.clock(edges, asked, |at, output, word| changes.push((at, output, word))), edges);
        leapt = leapt.max(leap.share().leapt - before);
        let mut expected = Vec::new();
        for at in 1..=edges {
            plain.edge();
            if asked == 1 && std::mem::replace(&mut shown, plain.words[sum]) != plain.words[sum] {
                expected.push((at, 1, shown));
            }
        }
        changes.retain(|change| change.1 == 1);
        if request > 1 {
            assert_eq!(changes, expected, "request {request}");
        }
    }
    assert!(leapt > 2500, "{leapt} edges of a request are leapt over");
}

/// A counter that an input holds, an accumulator of its words and a ramp, all at every tenth edge. Where the counter
/// comes back to the word at which it was held, the accumulator moves for a period as it was assumed, and not in the
/// next one.
#[test]
fn a_slope_that_holds_for_one_period_is_not_that_of_the_next() {
    let mut plain = Plain::default();
    let gate = plain.input(1);
    let [phase, count, sum, ramp] = [4, 4, 12, 12].map(|width| plain.register(width, 0));
    let [one, last, none] = [1, 9, 0].map(|word| plain.constant(word, 4));
    let enable = plain.cell(Operation::Equal, &[phase, last], 1);
    let next = plain.cell(Operation::Add, &[phase, one], 4);
    let data = plain.cell(Operation::Mux, &[enable, next, none], 4);
    plain.connect(phase, data, None);
    let step = plain.cell(Operation::Extend { signed: false }, &[gate], 4);
    let next = plain.cell(Operation::Add, &[count, step], 4);
    let data = plain.cell(Operation::Mux, &[enable, count, next], 4);
    plain.connect(count, data, None);
    let step = plain.constant(1, 12);
    let taken = plain.cell(Operation::Extend { signed: false }, &[count], 12);
    for (register, step) in [(sum, taken), (ramp, step)] {
        let next = plain.cell(Operation::Add, &[register, step], 12);
        let data = plain.cell(Operation::Mux, &[enable, register, next], 12);
        plain.connect(register, data, None);
        let top = plain.cell(Operation::Slice { low: 11 }, &[register], 1);
        plain.output(top);
    }
    same_for(&mut plain, 300_000, 9000, &mut Random(0x1405_7b7e_f767_814f));
}

/// A counter that takes a step now and then, and an accumulator of the counter's old words: the next word of the
/// accumulator is a line, but with another slope than the accumulator was assumed to have. The figures are from a model
/// in Python.
#[test]
fn slopes_that_do_not_last_are_not_leapt_over() {
    let mut plain = Plain::default();
    let x = plain.input(8);
    let (cnt, acc) = (plain.register(8, 0), plain.register(20, 0));
    let next = plain.cell(Operation::Add, &[cnt, x], 8);
    plain.connect(cnt, next, None);
    let wide = plain.cell(Operation::Extend { signed: false }, &[cnt], 20);
    let sum = plain.cell(Operation::Add, &[acc, wide], 20);
    plain.connect(acc, sum, None);
    let top = plain.cell(Operation::Slice { low: 19 }, &[acc], 1);
    plain.output(top);
    let mut leap = plain.leap(&[0]);
    leap.tell([Some(0)]);
    let inputs = [(1, 1), (4, 0), (501, 1), (505, 0), (901, 1), (1501, 0), (1601, 1), (200_001, 0)];
    let mut changes = Vec::new();
    for pair in inputs.windows(2) {
        let ((mut edge, word), (until, _)) = (pair[0], pair[1]);
        leap.input(&[word]);
        while edge < until {
            edge += leap.clock(until - edge, 0, |at, _, _| changes.push(edge + at - 1));
        }
    }
    assert_eq!((changes.len(), &changes[..4], changes[47]), (48, &[5039, 9144, 13_250, 17_355][..], 198_310));
    assert_eq!(leap.registers().collect::<Vec<_>>(), [95, 213_684]);
}

/// A reset by an input that is active from the start has had no edge: its register keeps its initial word up to the
/// first edge of its clock.
#[test]
fn a_reset_without_an_edge_waits_for_the_clock() {
    for at_start in [false, true] {
        let mut netlist = Netlist::default();
        let clear = netlist.input("clear", 1);
        let register = netlist.register("register", 8, (5, 255));
        netlist.connect(register, register, Some(AsynchronousReset { net: clear, active: true, word: 9, at_start }));
        netlist.output("output", register);
        let mut leap = Leap::new(&netlist, (&[5], &[1]), &[0]);
        assert_eq!(leap.output(0), if at_start { 9 } else { 5 });
        leap.clock(1, 0, |_, _, _| {});
        assert_eq!(leap.output(0), 9);
        let mut leap = Leap::new(&netlist, (&[5], &[0]), &[0]);
        leap.input(&[1]);
        assert_eq!(leap.output(0), 9);
    }
}

/// A word that an input reaches without a register is told after the next edge, however long the jump could be.
#[test]
fn a_change_through_logic_alone_is_told_after_the_next_edge() {
    let mut plain = Plain::default();
    let (x, cnt) = (plain.input(1), plain.register(16, 0));
    let one = plain.constant(1, 16);
    let next = plain.cell(Operation::Add, &[cnt, one], 16);
    plain.connect(cnt, next, None);
    let not = plain.cell(Operation::Not, &[x], 1);
    plain.output(not);
    plain.output(cnt);
    let mut leap = plain.leap(&[0, 1]);
    leap.tell([Some(1), Some(0)]);
    let mut changes = Vec::new();
    assert_eq!(leap.clock(1000, 0, |at, output, word| changes.push((at, output, word))), 1000);
    leap.input(&[1]);
    assert_eq!(leap.clock(1000, 0, |at, output, word| changes.push((at, output, word))), 1);
    // The counter has not been asked for: at the next edge it is told, though its change is an older one.
    assert_eq!(leap.clock(1, 1, |at, output, word| changes.push((at, output, word))), 1);
    assert_eq!(changes, [(1, 0, 0), (1, 1, 1002)]);
    assert!(leap.share().leapt > 900, "{:?}", leap.share());
}
