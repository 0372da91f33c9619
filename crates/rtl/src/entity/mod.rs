//! Compares a block by somebody else with one of ours: both get the same stimuli, and each answer is compared.
//!
//! In this module "ours" is the emulator's block, and "theirs" is the other block. Theirs is simulated like the design
//! of a scene: VHDL by GHDL, Verilog by Verilator, in a process that is given the bits at its inputs and reports those
//! at its outputs. It is first clocked some times in reset.

mod block_comparison;
mod ours;
mod proof;
mod wires;

use std::time::Instant;

use hpu_cosim::dut::{Asked, Change, Design, Port};
use hpu_cosim::named_block;
use hpu_cosim::scene::{self, BesideFile, Dut, DutClock, Engine, Identifier, Part, Registers, SourceFile, Standard};
use hpu_datapath::{AnyBlock, Generic, block_names, variants_of};
use hpu_signal::Clock;

use crate::check::{all_stimuli, generics_label};
use crate::dut::{Model, Names, Prepared, Simulators, is_vhdl};
use crate::engines::error::Error;
use crate::engines::tool::Tool;
use crate::vectors::report::{CheckRow, Tally};
use crate::vectors::vector::Vectors;
use block_comparison::BlockComparison;
use ours::Ours;
use wires::{What, Wire, not_taken, same, there_are};

/// Clock cycles before the first row. The block has the inputs of that row, and is in reset if it has one.
const SETTLE: u64 = 16;
/// The clock's frequency. A design with one clock cannot see it.
const CLOCK_HZ: u64 = 100_000_000;

/// A block by somebody else, and the block of ours that it has to equal.
#[derive(Clone, Debug)]
pub struct Entity {
    /// Its files, in any order.
    pub files: Vec<SourceFile>,
    /// Files that they read beside them: headers, and the data of memories.
    pub beside: Vec<BesideFile>,
    /// The VHDL library that they are compiled into.
    pub library: Identifier,
    /// Its topmost entity or module.
    pub top: Identifier,
    /// The VHDL standard of its files.
    pub standard: Standard,
    /// Its clock. Without a name it is the port `clk`, if there is one.
    pub clock: Option<Identifier>,
    /// Its reset, and whether the reset is active at 0. Without a name it is the port `rst`, if there is one.
    pub reset: Option<(Identifier, bool)>,
    /// Its ports or parts of them, and the ports of ours that they correspond to. A port with the same name as one of
    /// ours may be left out.
    pub ports: Vec<(String, Part, Link)>,
    /// Outputs of ours that theirs does not have.
    pub without: Vec<String>,
    /// Its generics and their values: a value is the name of a generic of ours, such as `WIDTH`, or is written as in
    /// the language.
    pub generics: Vec<(Identifier, String)>,
    /// The name of our block.
    pub block: String,
    /// Labels of the configurations of ours to compare with. If empty, the configurations that differ in generics that
    /// theirs has too.
    pub variants: Vec<String>,
    /// Generics of ours, as text. If there are any, a single configuration is compared; its other generics have their
    /// defaults.
    pub set: Vec<(String, String)>,
    /// Clock cycles by which its outputs come later than ours.
    pub latency: i64,
    /// For a proof: its registers or other signals, and the registers of ours that they equal. Registers with the same
    /// name may be left out.
    pub state: Vec<(String, String)>,
    /// For a proof: Verilog expressions that hold in every state of theirs.
    pub invariants: Vec<String>,
    /// Random rows, beside the directed ones.
    pub rows: usize,
    /// Seed of the random rows.
    pub seed: u64,
}

/// The counterpart of a port of theirs.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Link {
    /// A port of ours.
    Port(String),
    /// An input that stays constant.
    Constant(i64),
    /// An output that is not compared.
    Open,
}

/// The ports of a design, connected to those of a block of ours.
struct Connected {
    /// The ports without the clock.
    ports: Vec<Port>,
    /// The connections of each port, in the order of the ports.
    wires: Vec<Wire>,
    has_clock: bool,
}

/// Returns theirs as a model to be simulated.
fn model<'a>(dut: &'a Dut, names: &'a Names) -> Model<'a> {
    Model { dut, clock: Clock::new(CLOCK_HZ).expect("a clock"), settle: SETTLE, seed: 0, names }
}

/// Returns whether a text is a real number with a point, as both languages write it.
fn is_real(text: &str) -> bool {
    text.contains('.') && text.starts_with(|c: char| c.is_ascii_digit() || c == '-') && text.parse::<f64>().is_ok()
}

fn refused<T>(why: String) -> Result<T, Error> {
    Err(Error::usage(why))
}

/// Returns the bits at the ports of theirs in a row.
fn given(ours: &Ours, connected: &Connected, row: usize) -> Vec<u64> {
    words(connected, |wire| wire.given(ours, row))
}

/// Returns the bits at the ports of theirs while it settles: in reset, whatever the first row asks for.
fn settling(ours: &Ours, connected: &Connected) -> Vec<u64> {
    words(connected, |wire| match wire.what {
        What::Reset { active_low } => u64::from(!active_low),
        _ => wire.given(ours, 0),
    })
}

/// Returns the bits at the ports of theirs from those of each connection.
fn words(Connected { ports, wires, .. }: &Connected, bits: impl Fn(&Wire) -> u64) -> Vec<u64> {
    let mut words = vec![0; ports.len()];
    wires.iter().for_each(|wire| words[wire.place] |= bits(wire) << wire.shift);
    words
}

/// A configuration of a block, and its label.
pub(crate) type Labelled = (String, Box<dyn AnyBlock>);

/// The result for one configuration.
#[derive(Debug)]
pub struct Compared {
    /// The row of the report.
    pub row: CheckRow,
    /// Inputs of ours that theirs does not take.
    pub not_taken: Vec<&'static str>,
    /// The name of the simulator that ran theirs.
    pub engine: String,
    /// Whether theirs has a reset. Without one no row resets, and its state after power-up is compared.
    pub has_reset: bool,
}

impl Entity {
    /// Returns the configurations of ours to compare with, by their labels.
    ///
    /// # Errors
    ///
    /// An error when the block, a configuration or a generic does not exist.
    pub fn configurations(&self) -> Result<Vec<Labelled>, Error> {
        let name = &self.block;
        if !block_names().contains(&name.as_str()) {
            return refused(format!("no block `{name}`; there are {}", block_names().join(", ")));
        }
        let listed = || variants_of(|block| block == name).into_iter();
        if !self.set.is_empty() {
            let block = named_block(name, &self.set).map_err(|error| Error::usage(error.to_string()))?;
            return Ok(vec![(generics_label(&self.set), block)]);
        }
        if !self.variants.is_empty() {
            let labels: Vec<_> = listed().map(|(label, _)| label).collect();
            if let Some(label) = self.variants.iter().find(|label| !labels.contains(label)) {
                return refused(format!("{name} has no variant `{label}`; there are {}", labels.join(", ")));
            }
            return Ok(listed().filter(|(label, _)| self.variants.contains(label)).collect());
        }
        let default = hpu_datapath::block_by_name(name).expect("it is known");
        let is_theirs_too = |generic: &str| self.generics.iter().any(|(_, value)| value == generic);
        let can_be = |block: &dyn AnyBlock| {
            default.generics().iter().all(|own| is_theirs_too(own.0) || block.generics().contains(own))
        };
        Ok(listed().filter(|(_, block)| can_be(&**block)).collect())
    }

    /// Compares theirs with a configuration of ours, row by row.
    ///
    /// # Errors
    ///
    /// An error when the ports or generics do not fit, the design does not compile, or the simulation fails. A
    /// difference is a result.
    pub fn compare(&self, (label, block): &mut Labelled, simulators: &Simulators) -> Result<Compared, Error> {
        let began = Instant::now();
        let theirs = self.dut(&**block);
        let Prepared { dut, names } = simulators.prepared(&theirs)?;
        let design = simulators.of_model(&model(&dut, &names))?;
        let connected = self.connected(&**block, &dut, design.ports())?;
        let has_clock = connected.has_clock;
        let shift = self.shift(&**block, has_clock)?;

        let has_reset = connected.wires.iter().any(|wire| matches!(wire.what, What::Reset { .. }));
        let stimuli = all_stimuli(&**block, label, self.rows, self.seed);
        let stimuli: Vec<_> = stimuli.into_iter().filter(|stimulus| has_reset || !stimulus.rst).collect();
        let resets: Vec<bool> = stimuli.iter().map(|stimulus| stimulus.rst).collect();
        block.reset();
        let ours = Ours { vectors: Vectors::record(&mut **block, stimuli), resets, shift };
        let mut found = CheckRow::new(&self.top, label);
        let version = || Tool::Icarus.version(simulators.setup.timeout);
        let in_icarus = if self.is_vhdl() { None } else { Some(version()?) };
        let compared = match in_icarus {
            Some(version) => self.twice(&*design, (simulators, &dut, &version), &ours, &connected),
            None => self.simulate(&*design, &ours, &connected).map(|tally| (tally, design.engine().to_string())),
        };
        let (comparison, engine) = match compared {
            Ok((tally, engine)) => (Ok(tally), engine),
            Err(fault) => (Err(fault.to_string()), design.engine().to_string()),
        };
        found.add(comparison, has_clock, began.elapsed().as_secs_f64());
        Ok(Compared { row: found, not_taken: not_taken(&**block, &connected.wires), engine, has_reset })
    }

    /// Compares the answers of theirs in Icarus Verilog, to which a bit may be X or Z, and where they are equal, in
    /// Verilator, to which it is 0 or 1. Returns the result with the simulators' names.
    fn twice(
        &self,
        design: &dyn Design,
        (simulators, dut, version): (&Simulators, &Dut, &str),
        ours: &Ours,
        connected: &Connected,
    ) -> Result<(Tally, String), Error> {
        let engine = design.engine();
        let engine = match self.in_icarus(simulators, dut, ours, connected)? {
            Some(tally) if tally.mismatches > 0 => return Ok((tally, format!("Icarus Verilog {version}"))),
            Some(_) => format!("{engine} and Icarus Verilog {version}"),
            None => format!("{engine} alone: Icarus Verilog, which knows X and Z, does not take it"),
        };
        Ok((self.simulate(design, ours, connected)?, engine))
    }

    /// Simulates theirs in Icarus Verilog, and compares the answers. Returns `None` if it does not take the design.
    fn in_icarus(
        &self,
        simulators: &Simulators,
        dut: &Dut,
        ours: &Ours,
        connected: &Connected,
    ) -> Result<Option<Tally>, Error> {
        let Connected { ports, wires, has_clock } = connected;
        let rows: Vec<_> = [settling(ours, connected)]
            .into_iter()
            .chain((0..ours.vectors.rows.len()).map(|row| given(ours, connected, row)))
            .collect();
        let Some(answers) = simulators.answers(&model(dut, Names::NONE), (ports, *has_clock), &rows)? else {
            return Ok(None);
        };
        let outputs: Vec<_> = (0..ports.len()).filter(|port| !ports[*port].is_input).collect();
        let mut comparison = BlockComparison::new(ours, (wires, ports.len()), "verilog");
        for (number, answer) in answers.into_iter().enumerate() {
            let change = |(&port, bits)| Change { edge: u64::from(number > 0), port, bits };
            let changes: Vec<_> = outputs.iter().zip(answer).map(change).collect();
            match number {
                0 => comparison.begin(&changes),
                _ => comparison.rows(number - 1..number, &changes),
            }
        }
        Ok(Some(comparison.tally()))
    }

    /// Connects the ports of the design to those of a configuration of ours.
    fn connected(&self, block: &dyn AnyBlock, dut: &Dut, ports: &[Port]) -> Result<Connected, Error> {
        let is_clock = |name: &str| dut.clocks.iter().any(|clock| same(&clock.port, name));
        let (clocks, ports): (Vec<_>, Vec<_>) = ports.iter().cloned().partition(|port| is_clock(&port.name));
        if let (Some(clock), []) = (&self.clock, &clocks[..]) {
            return refused(format!("`{}` has no clock `{clock}`; {}", self.top, there_are(&ports)));
        }
        let wires = self.wires(block, &ports)?;
        Ok(Connected { ports, wires, has_clock: !clocks.is_empty() })
    }

    /// Simulates theirs on the rows that ours was given, and compares the answers.
    fn simulate(&self, design: &dyn Design, ours: &Ours, connected: &Connected) -> Result<Tally, Error> {
        let beside = if self.is_vhdl() { "vhdl" } else { "verilog" };
        let count_of_ports = connected.ports.len();
        let mut comparison = BlockComparison::new(ours, (&connected.wires, count_of_ports), beside);
        let count = ours.vectors.rows.len();
        let bits = |row: usize| given(ours, connected, row);
        let words = settling(ours, connected);
        let mut changes = Vec::new();
        let mut running = design.start(&words, &vec![false; count_of_ports], &mut changes)?;
        comparison.begin(&changes);
        let mut row = 0;
        while row < count {
            // Consecutive rows with the same inputs are one request.
            let words = bits(row);
            let end = (row + 1..count).find(|&next| bits(next) != words).unwrap_or(count);
            changes.clear();
            running.clock(&words, (end - row) as u64, Asked::Outputs, &mut changes)?;
            comparison.rows(row..end, &changes);
            row = end;
        }
        Ok(comparison.tally())
    }

    fn is_vhdl(&self) -> bool {
        is_vhdl(&self.files)
    }

    /// Returns theirs as a design to be simulated, with the generics of this configuration.
    fn dut(&self, block: &dyn AnyBlock) -> Dut {
        let value = |text: &String| match block.generics().iter().find(|(name, _)| name == text) {
            Some((_, Generic::Integer(value))) => scene::Generic::Integer(*value),
            Some((_, Generic::Boolean(value))) => scene::Generic::Flag(*value),
            None => match (text.parse(), text.to_lowercase().as_str()) {
                (Ok(value), _) => scene::Generic::Integer(value),
                (_, "true") => scene::Generic::Flag(true),
                (_, "false") => scene::Generic::Flag(false),
                _ if is_real(text) => scene::Generic::real(text.parse().unwrap_or_default()),
                _ => scene::Generic::Text(text.clone()),
            },
        };
        let clock = self.clock.clone().unwrap_or_else(|| Identifier::fixed("clk"));
        let named = |(port, part, _): &(String, Part, Link)| scene::Connected {
            port: port.clone(),
            part: *part,
            connection: scene::Connection::Open,
            key: port.clone(),
            is_pin: false,
        };
        Dut {
            files: self.files.clone(),
            beside: self.beside.clone(),
            library: self.library.clone(),
            libraries: Vec::new(),
            top: self.top.clone(),
            standard: self.standard,
            engine: Engine::Auto,
            registers: Registers::Unknown,
            clocks: vec![DutClock { port: clock, divide: 1 }],
            reset: None,
            generics: self.generics.iter().map(|(name, text)| (name.clone(), value(text))).collect(),
            ports: self.ports.iter().map(named).collect(),
            floats: false,
            formats: Vec::new(),
        }
    }

    /// Returns the number of rows by which the answers of theirs come later than ours. The output of a register is seen
    /// after its clock edge, in the row of the inputs that went into it, like a combinational output.
    fn shift(&self, block: &dyn AnyBlock, has_clock: bool) -> Result<i64, Error> {
        let shift = self.latency - i64::from(has_clock) + i64::from(block.clocked());
        if block.clocked() && !has_clock && self.latency >= 0 {
            let (block, top) = (&self.block, &self.top);
            return refused(format!(
                "{block} has registers, and no port of `{top}` is a clock: name it (--clock), or say by how many \
                 clocks its answers come earlier (--latency -1)"
            ));
        }
        if has_clock && !block.clocked() && self.latency < 1 {
            return refused(format!(
                "{} has no registers: what `{}` answers after a clock edge comes 1 clock later, or more (--latency)",
                self.block, self.top
            ));
        }
        if shift.unsigned_abs() > 4096 {
            return refused("a latency of more than 4096 clocks".to_string());
        }
        Ok(shift)
    }
}
