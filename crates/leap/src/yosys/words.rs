//! Words from bits.

use std::collections::HashMap;

use super::Unfit;
use super::module::{Bit, Module, RawCell};
use crate::netlist::{AsynchronousReset, MadeClock, Net, Netlist};
use crate::operation::{MOST_BITS, Operation};

/// The width of the widest word, as a number of bits in a list.
pub(super) const MOST: usize = MOST_BITS as usize;

/// Where a bit comes from.
#[derive(Clone, Copy)]
enum Driver {
    /// A place in the words of the inputs.
    Input(usize),
    /// A cell or a register.
    Cell(usize),
}

/// Makes a netlist of a module.
pub(super) struct Reader<'m> {
    pub(super) module: &'m Module,
    pub(super) netlist: Netlist,
    /// The driver of each net, and the place of the bit in its word.
    drivers: HashMap<u64, (Driver, usize)>,
    /// The words of each input and of each cell, of 64 bits each and the rest; none before it is made.
    of_inputs: Vec<Vec<Net>>,
    of_cells: Vec<Vec<Net>>,
    /// The words that were made of these bits, of constants and of slices.
    made: HashMap<Vec<Bit>, Net>,
    constants: HashMap<(u64, u8), Net>,
    slices: HashMap<(Net, u8, u8), Net>,
    /// The bits that are 1 where slower clocks rise, by the edges of the netlist's clock for one of theirs.
    rises: HashMap<u32, Net>,
    /// The cells that take each bit.
    pub(super) users: HashMap<Bit, Vec<usize>>,
}

impl<'m> Reader<'m> {
    pub(super) fn new(module: &'m Module) -> Self {
        let mut users = HashMap::new();
        for (at, cell) in module.cells.iter().enumerate() {
            cell.taken().for_each(|bit| users.entry(bit).or_insert_with(Vec::new).push(at));
        }
        Self {
            users,
            module,
            netlist: Netlist::default(),
            drivers: HashMap::new(),
            of_inputs: Vec::new(),
            of_cells: vec![Vec::new(); module.cells.len()],
            made: HashMap::new(),
            constants: HashMap::new(),
            slices: HashMap::new(),
            rises: HashMap::new(),
        }
    }

    pub(super) fn netlist(mut self) -> Result<Netlist, Unfit> {
        let module = self.module;
        for (at, (name, bits)) in module.inputs.iter().enumerate() {
            self.drive(Driver::Input(at), bits)?;
            let words = bits.chunks(MOST).map(|bits| self.netlist.input(name, bits.len() as u8)).collect();
            self.of_inputs.push(words);
        }
        for (at, cell) in module.cells.iter().enumerate() {
            self.drive(Driver::Cell(at), cell.port(cell.result()))?;
        }
        for register in module.cells.iter().filter(|cell| cell.is_register()) {
            self.check_clock(register)?;
        }
        for (at, cell) in module.cells.iter().enumerate().filter(|(_, cell)| cell.is_register()) {
            let bits = cell.port("Q");
            let name = module.name(bits);
            self.of_cells[at] = bits.chunks(MOST).map(|bits| self.register(&name, bits)).collect();
        }
        for at in self.order()? {
            self.of_cells[at] = self.cell(&module.cells[at])?;
        }
        for (at, cell) in module.cells.iter().enumerate().filter(|(_, cell)| cell.is_register()) {
            self.connect(cell, at)?;
        }
        for (name, bits) in module.outputs.iter().filter(|(_, bits)| bits.len() <= MOST) {
            if bits.contains(&Bit::Unknown) {
                return Err(Unfit(format!("`{name}` may take a value x or z")));
            }
            let net = self.word(bits)?;
            self.netlist.output(name, net);
        }
        for (name, bits) in &module.inside {
            if let Ok(net) = self.word(bits) {
                self.netlist.output(name, net);
            }
        }
        Ok(self.netlist)
    }

    fn is_input(&self, bit: Bit) -> bool {
        self.module.inputs.iter().any(|(_, bits)| bits.contains(&bit))
    }

    /// Refuses a register whose clock is neither one of the scene nor a bit of a register on the fastest of these,
    /// which an input may reset. No register may be reset by other words than inputs then. Verilog alone may make
    /// clocks: Verilator lets the logic before a register settle before such a clock, and VHDL reads it as it was.
    fn check_clock(&self, register: &RawCell) -> Result<(), Unfit> {
        let (module, clock) = (self.module, register.port("CLK"));
        let name = |cell: &RawCell| module.name(cell.port("Q"));
        let own = |cell: &RawCell| module.clock(cell.port("CLK"));
        if own(register).is_some() && !register.is_set("CLK_POLARITY") {
            return Err(Unfit(format!(
                "register `{}` takes its word at the falling edge of the clock",
                name(register)
            )));
        }
        let makes = |cell: &&RawCell| {
            cell.is_register() && own(cell) == Some(1) && cell.port("ARST").iter().all(|bit| self.is_input(*bit))
        };
        let is_made =
            !module.is_vhdl && clock.first().and_then(|bit| self.driver(*bit)).is_some_and(|cell| makes(&cell));
        // Verilator lets a register that the design resets have its word of before at an edge of such a clock.
        let by_design = |cell: &&RawCell| !cell.port("ARST").iter().all(|bit| self.is_input(*bit));
        let is_reset = module.cells.iter().filter(|cell| cell.is_register()).find(by_design).filter(|_| is_made);
        if own(register).is_some() || is_made && is_reset.is_none() {
            return Ok(());
        }
        let clock = module.name(clock);
        if let Some(other) = is_reset {
            let (own, other) = (name(register), name(other));
            return Err(Unfit(format!("`{clock}` clocks register `{own}`, and the design resets `{other}`")));
        }
        Err(Unfit(format!("`{clock}` clocks register `{}`, and is no clock of the scene", name(register))))
    }

    fn drive(&mut self, driver: Driver, bits: &[Bit]) -> Result<(), Unfit> {
        for (place, bit) in bits.iter().enumerate() {
            let Bit::Net(net) = bit else { continue };
            if self.module.clock(&[*bit]).is_some() || self.drivers.insert(*net, (driver, place)).is_some() {
                return Err(Unfit(format!("`{}` has several drivers", self.module.name(&[*bit]))));
            }
        }
        Ok(())
    }

    fn register(&mut self, name: &str, bits: &[Bit]) -> Net {
        let (mut word, mut set) = (0, 0);
        for (at, bit) in bits.iter().enumerate() {
            let Bit::Net(net) = bit else { continue };
            if let Some(value) = self.module.initial.get(net) {
                word |= u64::from(*value) << at;
                set |= 1 << at;
            }
        }
        self.netlist.register(name, bits.len() as u8, (word, set))
    }

    fn connect(&mut self, cell: &RawCell, at: usize) -> Result<(), Unfit> {
        let registers = self.of_cells[at].clone();
        let words = cell.bits("ARST_VALUE");
        let reset = if cell.kind == "$adff" { Some(self.word(cell.port("ARST"))?) } else { None };
        for (part, (register, data)) in registers.into_iter().zip(cell.port("D").chunks(MOST)).enumerate() {
            let of = words.chunks(MOST).nth(part).unwrap_or_default();
            if cell.port("D").contains(&Bit::Unknown) || of.contains(&Bit::Unknown) {
                return Err(self.unknown(cell.port("Q")));
            }
            let data = self.word(data)?;
            let reset = reset.map(|net| {
                let word = of.iter().enumerate().map(|(at, bit)| u64::from(*bit == Bit::One) << at).sum();
                let at_start = self.module.is_vhdl || !cell.port("ARST").iter().all(|bit| self.is_input(*bit));
                AsynchronousReset { net, active: cell.is_set("ARST_POLARITY"), word, at_start }
            });
            let edges = self.module.clock(cell.port("CLK"));
            let data = self.at_rises(register, data, edges.unwrap_or(1));
            self.netlist.connect(register, data, reset);
            if edges.is_none() {
                let net = self.word(cell.port("CLK"))?;
                self.netlist.clock_by(register, MadeClock { net, rises: cell.is_set("CLK_POLARITY") });
            }
        }
        Ok(())
    }

    /// Returns the data of a register whose clock rises at the first edge and then after so many edges of the netlist's
    /// clock each.
    fn at_rises(&mut self, register: Net, data: Net, edges: u32) -> Net {
        if edges == 1 {
            return data;
        }
        let rises = self.rises.get(&edges).copied().unwrap_or_else(|| {
            let width = (u32::BITS - (edges - 1).leading_zeros()) as u8;
            let phase = self.netlist.register("a slower clock", width, (0, u64::MAX));
            let [none, one, last] = [0, 1, u64::from(edges) - 1].map(|word| self.constant(word, width));
            let next = self.netlist.cell(Operation::Add, &[phase, one], width);
            let is_last = self.netlist.cell(Operation::Equal, &[phase, last], 1);
            let next = self.netlist.cell(Operation::Mux, &[is_last, next, none], width);
            self.netlist.connect(phase, next, None);
            let rises = self.netlist.cell(Operation::Equal, &[phase, none], 1);
            *self.rises.entry(edges).or_insert(rises)
        });
        let width = self.netlist.width(register);
        self.netlist.cell(Operation::Mux, &[rises, register, data], width)
    }

    /// Returns the cells that are no registers, each behind those whose words it takes.
    fn order(&self) -> Result<Vec<usize>, Unfit> {
        let cells = &self.module.cells;
        let is_logic = |at: &usize| !cells[*at].is_register();
        let driver = |bit: &Bit| match bit {
            Bit::Net(net) => match self.drivers.get(net) {
                Some((Driver::Cell(at), _)) => Some(*at).filter(is_logic),
                _ => None,
            },
            _ => None,
        };
        let mut users = vec![Vec::new(); cells.len()];
        let mut waits = vec![0u32; cells.len()];
        for (at, cell) in cells.iter().enumerate().filter(|(at, _)| is_logic(at)) {
            let mut before: Vec<_> =
                ["A", "B", "S"].iter().flat_map(|port| cell.port(port)).filter_map(driver).collect();
            before.sort_unstable();
            before.dedup();
            waits[at] = before.len() as u32;
            before.into_iter().for_each(|other| users[other].push(at));
        }
        let mut order: Vec<_> = (0..cells.len()).filter(is_logic).filter(|at| waits[*at] == 0).collect();
        let mut next = 0;
        while let Some(&at) = order.get(next) {
            next += 1;
            for &user in &users[at] {
                waits[user] -= 1;
                if waits[user] == 0 {
                    order.push(user);
                }
            }
        }
        match (0..cells.len()).filter(is_logic).find(|at| waits[*at] > 0) {
            Some(at) => {
                let name = self.module.name(cells[at].port("Y"));
                Err(Unfit(format!("`{name}` is in a combinational loop, or depends on one")))
            }
            None => Ok(order),
        }
    }

    /// Returns the refusal of an unknown value that a word takes.
    pub(super) fn unknown(&self, bits: &[Bit]) -> Unfit {
        Unfit(format!("`{}` may take a value x or z", self.module.name(bits)))
    }

    /// Returns the cell that drives a bit.
    pub(super) fn driver(&self, bit: Bit) -> Option<&'m RawCell> {
        let Bit::Net(net) = bit else { return None };
        match self.drivers.get(&net)?.0 {
            Driver::Cell(at) => Some(&self.module.cells[at]),
            Driver::Input(_) => None,
        }
    }

    pub(super) fn constant(&mut self, word: u64, width: u8) -> Net {
        let netlist = &mut self.netlist;
        *self.constants.entry((word, width)).or_insert_with(|| netlist.constant(word, width))
    }

    /// Returns the word of a driver that has a net, and the place of the net in that word.
    fn place(&self, bit: Bit) -> Result<(Net, u8), Unfit> {
        let Bit::Net(net) = bit else { return Err(self.unknown(&[bit])) };
        let Some(&(driver, place)) = self.drivers.get(&net) else {
            let name = self.module.name(&[bit]);
            let is_clock = self.module.clock(&[bit]).is_some();
            let reads = |cell: &&RawCell| cell.kind.starts_with("$mem") && cell.port("RD_DATA").contains(&bit);
            if let Some(memory) = self.module.cells.iter().find(reads) {
                return Err(self.refused(memory));
            }
            return Err(Unfit(match is_clock {
                true => format!("the clock `{name}` is read as a signal"),
                false => format!("nothing drives `{name}`"),
            }));
        };
        let words = match driver {
            Driver::Input(at) => &self.of_inputs[at],
            Driver::Cell(at) => &self.of_cells[at],
        };
        Ok((words[place / MOST], (place % MOST) as u8))
    }

    /// Returns the word of 1 to 64 bits, the lowest one first.
    ///
    /// # Errors
    ///
    /// If a bit is unknown, is not driven, or is the clock.
    pub(super) fn word(&mut self, bits: &[Bit]) -> Result<Net, Unfit> {
        if let Some(net) = self.made.get(bits) {
            return Ok(*net);
        }
        let width = bits.len() as u8;
        let top = *bits.last().ok_or_else(|| Unfit("a word has no bits".to_string()))?;
        let copies = bits.iter().rev().take_while(|bit| **bit == top).count();
        let net = match top {
            Bit::Zero if copies < bits.len() => {
                let low = self.word(&bits[..bits.len() - copies])?;
                self.netlist.cell(Operation::Extend { signed: false }, &[low], width)
            }
            Bit::Net(_) if copies > 1 => {
                let low = self.word(&bits[..=bits.len() - copies])?;
                self.netlist.cell(Operation::Extend { signed: true }, &[low], width)
            }
            _ => self.joined(bits)?,
        };
        self.made.insert(bits.to_vec(), net);
        Ok(net)
    }

    /// Returns the concatenation of the longest runs of constants and of bits of one word.
    fn joined(&mut self, bits: &[Bit]) -> Result<Net, Unfit> {
        let mut whole: Option<Net> = None;
        let mut from = 0;
        while from < bits.len() {
            let rest = &bits[from..];
            let constants = rest.iter().take_while(|bit| matches!(bit, Bit::Zero | Bit::One)).count();
            let (part, length) = if constants > 0 {
                let word =
                    rest[..constants].iter().enumerate().map(|(at, bit)| u64::from(*bit == Bit::One) << at).sum();
                (self.constant(word, constants as u8), constants)
            } else {
                self.run(rest)?
            };
            from += length;
            whole = Some(match whole {
                None => part,
                Some(low) => self.netlist.cell(Operation::Concat, &[part, low], from as u8),
            });
        }
        whole.ok_or_else(|| Unfit("a word has no bits".to_string()))
    }

    /// Returns the longest run of bits of one word at the beginning of a list, or of copies of one bit, and its length.
    fn run(&mut self, bits: &[Bit]) -> Result<(Net, usize), Unfit> {
        let copies = bits.iter().take_while(|bit| **bit == bits[0]).count();
        let (net, low) = self.place(bits[0])?;
        if copies > 1 {
            let bit = self.slice(net, low, 1);
            return Ok((self.netlist.cell(Operation::Extend { signed: true }, &[bit], copies as u8), copies));
        }
        let mut length = 1;
        while length < bits.len()
            && let Ok(place) = self.place(bits[length])
            && place == (net, low + length as u8)
        {
            length += 1;
        }
        Ok((self.slice(net, low, length as u8), length))
    }

    pub(super) fn slice(&mut self, net: Net, low: u8, width: u8) -> Net {
        if (low, width) == (0, self.netlist.width(net)) {
            return net;
        }
        let netlist = &mut self.netlist;
        *self.slices.entry((net, low, width)).or_insert_with(|| netlist.cell(Operation::Slice { low }, &[net], width))
    }
}
