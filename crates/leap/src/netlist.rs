//! Netlists of words.

use crate::operation::{MOST_BITS, Operation, Widths, mask};

/// A word of a netlist: a constant, an input, the output of a register, or that of a cell.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Net(pub(crate) u32);

impl Net {
    #[inline]
    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }
}

/// A cell: an operation, the words that it takes, and the word that it makes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Cell {
    /// Its operation.
    pub operation: Operation,
    /// Its operands; those that the operation does not have repeat the first one.
    pub operands: [Net; 3],
    /// Its result.
    pub output: Net,
    /// The widths of both.
    pub widths: Widths,
}

/// A register on the rising edge of the clock, or on an edge of a clock that the design makes.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Register {
    /// Its name in the design.
    pub name: String,
    /// Its word.
    pub output: Net,
    /// The word that it takes at the next edge. It is that of the asynchronous reset while the reset is active.
    pub data: Net,
    /// The word with which it begins, of which only the bits of `set` are known.
    pub initial: u64,
    /// The bits that have an initial value.
    pub set: u64,
    /// Its asynchronous reset.
    pub reset: Option<AsynchronousReset>,
    /// Its own clock, if it is not that of the netlist.
    pub clock: Option<MadeClock>,
}

/// A clock that the design makes: a bit of a register on the netlist's clock.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct MadeClock {
    /// The bit.
    pub net: Net,
    /// Whether registers take their words at its rising edge, not the falling one.
    pub rises: bool,
}

/// A reset that acts at once, between two edges too.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct AsynchronousReset {
    /// The word of one bit that resets.
    pub net: Net,
    /// The bit at which it resets.
    pub active: bool,
    /// The word to which it resets.
    pub word: u64,
    /// Whether it acts at the start too, if it is active then. In Verilog an input has no edge at the start.
    pub at_start: bool,
}

/// An output, or a word inside that is looked at.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Output {
    /// Its name in the design.
    pub name: String,
    /// Its word.
    pub net: Net,
}

/// A synthesised design with one clock, of which it may make others, as words of at most [`MOST_BITS`] bits.
///
/// A cell takes words that are in the netlist already, so the cells are in topological order, and none depends on its
/// own result.
#[derive(Clone, Default, Debug)]
pub struct Netlist {
    pub(crate) widths: Vec<u8>,
    pub(crate) constants: Vec<(Net, u64)>,
    pub(crate) cells: Vec<Cell>,
    pub(crate) registers: Vec<Register>,
    pub(crate) inputs: Vec<(String, Net)>,
    pub(crate) outputs: Vec<Output>,
}

impl Netlist {
    fn net(&mut self, width: u8) -> Net {
        assert!((1..=MOST_BITS).contains(&width), "a word has 1 to {MOST_BITS} bits, not {width}");
        let net = Net(u32::try_from(self.widths.len()).expect("fewer than 2^32 words"));
        self.widths.push(width);
        net
    }

    /// Returns the width of a word in bits.
    pub fn width(&self, net: Net) -> u8 {
        self.widths[net.index()]
    }

    /// Adds a constant; bits of the word above the width are dropped.
    ///
    /// # Panics
    ///
    /// If the width is not in 1..=[`MOST_BITS`]. The same holds for inputs and registers.
    pub fn constant(&mut self, word: u64, width: u8) -> Net {
        let net = self.net(width);
        self.constants.push((net, word & mask(width)));
        net
    }

    /// Adds an input.
    pub fn input(&mut self, name: &str, width: u8) -> Net {
        let net = self.net(width);
        self.inputs.push((name.to_string(), net));
        net
    }

    /// Adds a cell with a result of `width` bits.
    ///
    /// # Panics
    ///
    /// If the operation has another number of operands, or does not fit the widths.
    pub fn cell(&mut self, operation: Operation, operands: &[Net], width: u8) -> Net {
        assert_eq!(operands.len(), operation.operands(), "operands of {operation:?}");
        let at = |index: usize| operands.get(index).copied().unwrap_or(operands[0]);
        let widths = Widths { result: width, a: self.width(at(0)), b: self.width(at(1)) };
        let fits = operation.fits(widths) && (operands.len() < 3 || self.width(at(2)) == width);
        assert!(fits, "{operation:?} of {widths:?}");
        let output = self.net(width);
        self.cells.push(Cell { operation, operands: [at(0), at(1), at(2)], output, widths });
        output
    }

    /// Adds a register, which keeps its word until it is [connected](Self::connect). Only the bits of `set` have an
    /// initial value, that of `initial`.
    pub fn register(&mut self, name: &str, width: u8, (initial, set): (u64, u64)) -> Net {
        let output = self.net(width);
        let (initial, set) = (initial & set & mask(width), set & mask(width));
        let (name, reset, clock) = (name.to_string(), None, None);
        self.registers.push(Register { name, output, data: output, initial, set, reset, clock });
        output
    }

    /// Connects the data of a register, by the net of its output, and its asynchronous reset if it has one.
    ///
    /// # Panics
    ///
    /// If there is no such register, the data have another width, or the reset has more than one bit.
    pub fn connect(&mut self, register: Net, data: Net, reset: Option<AsynchronousReset>) {
        let at = self.registers.iter().position(|one| one.output == register).expect("a register");
        let width = self.width(register);
        assert_eq!(self.width(data), width, "data of {}", self.registers[at].name);
        let mut taken = data;
        if let Some(reset) = reset {
            let word = self.constant(reset.word, width);
            let choices = if reset.active { [reset.net, data, word] } else { [reset.net, word, data] };
            taken = self.cell(Operation::Mux, &choices, width);
        }
        (self.registers[at].data, self.registers[at].reset) = (taken, reset);
    }

    /// Gives a register a clock of its own, by the net of its output. The register takes its word after those on the
    /// netlist's clock have theirs. The clock must be a bit of a register on the netlist's clock whose reset, if it has
    /// one, depends on inputs alone.
    ///
    /// # Panics
    ///
    /// If there is no such register, or the clock has more than one bit.
    pub fn clock_by(&mut self, register: Net, clock: MadeClock) {
        assert_eq!(self.width(clock.net), 1, "a clock has one bit");
        let at = self.registers.iter().position(|one| one.output == register).expect("a register");
        self.registers[at].clock = Some(clock);
    }

    /// Returns the netlist with an input that keeps a word, such as a reset that is over. Choices by such words are
    /// left out, and what nothing reads then. Registers, inputs and outputs are those of before, in their order.
    ///
    /// # Panics
    ///
    /// If there is no such input.
    #[must_use]
    pub fn with_input(&self, input: usize, word: u64) -> Self {
        let mut made = self.clone();
        let (net, mut words) = (self.inputs[input].1, vec![None; self.widths.len()]);
        let mut to: Vec<_> = (0..self.widths.len() as u32).map(Net).collect();
        made.inputs[input].1 = made.net(self.width(net));
        made.constants.push((net, word & mask(self.width(net))));
        made.constants.iter().for_each(|(net, word)| words[net.index()] = Some(*word));
        made.cells.clear();
        for cell in &self.cells {
            let cell = Cell { operands: cell.operands.map(|net| to[net.index()]), ..*cell };
            let [select, a, b] = cell.operands;
            let given = cell.operands.map(|net| words[net.index()]);
            if let (Operation::Mux, Some(word)) = (cell.operation, words[select.index()]) {
                to[cell.output.index()] = if word == 0 { a } else { b };
            } else if let [Some(x), Some(y), Some(z)] = given {
                let word = cell.operation.word(cell.widths, [x, y, z]);
                words[cell.output.index()] = Some(word);
                made.constants.push((cell.output, word));
            } else {
                made.cells.push(cell);
            }
        }
        let at = |net: Net| to[net.index()];
        for register in &mut made.registers {
            register.data = at(register.data);
            register.reset = register.reset.map(|reset| AsynchronousReset { net: at(reset.net), ..reset });
            register.clock = register.clock.map(|clock| MadeClock { net: at(clock.net), ..clock });
        }
        made.outputs.iter_mut().for_each(|output| output.net = at(output.net));
        let mut is_read = vec![false; made.widths.len()];
        let resets = made.registers.iter().filter_map(|register| Some(register.reset?.net));
        let clocks = made.registers.iter().filter_map(|register| Some(register.clock?.net));
        let ends = made.registers.iter().map(|register| register.data).chain(resets).chain(clocks);
        ends.chain(made.outputs.iter().map(|output| output.net)).for_each(|net| is_read[net.index()] = true);
        made.reach(&mut is_read);
        made.cells.retain(|cell| is_read[cell.output.index()]);
        made
    }

    /// Adds an output, or a word inside that is looked at.
    pub fn output(&mut self, name: &str, net: Net) {
        self.outputs.push(Output { name: name.to_string(), net });
    }

    /// Returns the cells, in topological order.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// Returns the registers.
    pub fn registers(&self) -> &[Register] {
        &self.registers
    }

    /// Returns of each register whether the outputs that `takes` chooses by their places depend on it.
    pub fn live(&self, takes: impl Fn(usize) -> bool) -> Vec<bool> {
        let mut reached = vec![false; self.widths.len()];
        let wanted = self.outputs.iter().enumerate().filter(|(at, _)| takes(*at)).map(|(_, output)| output.net);
        wanted.for_each(|net| reached[net.index()] = true);
        loop {
            self.reach(&mut reached);
            let mut is_new = false;
            for register in &self.registers {
                let (reset, clock) = (register.reset.map(|reset| reset.net), register.clock.map(|clock| clock.net));
                let taken = [register.data].into_iter().chain(reset).chain(clock);
                for net in taken.filter(|_| reached[register.output.index()]).collect::<Vec<_>>() {
                    is_new |= !std::mem::replace(&mut reached[net.index()], true);
                }
            }
            if !is_new {
                return self.registers.iter().map(|register| reached[register.output.index()]).collect();
            }
        }
    }

    /// Takes the operands of cells with words among these for such, too.
    fn reach(&self, reached: &mut [bool]) {
        for cell in self.cells.iter().rev() {
            if reached[cell.output.index()] {
                cell.operands.iter().for_each(|net| reached[net.index()] = true);
            }
        }
    }

    /// Returns the names of the inputs and their words.
    pub fn inputs(&self) -> &[(String, Net)] {
        &self.inputs
    }

    /// Returns the outputs.
    pub fn outputs(&self) -> &[Output] {
        &self.outputs
    }
}
