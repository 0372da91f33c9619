//! Answers of a block in Verilog, simulated by Icarus Verilog, which knows X and Z. To Verilator a bit is 0 or 1.

use std::fmt::Write as _;
use std::process::Command;

use hpu_cosim::dut::Port;
use hpu_cosim::scene::{Dut, Generic, Identifier};
use hpu_cosim::script::{Script, Verilog};

use super::build::{Model, write, write_files};
use super::process::ANSWER;
use super::verilator::sources;
use super::{Simulators, of_tool};
use crate::engines::error::Error;
use crate::engines::temporary::Temporary;
use crate::engines::tool::{Tool, run};

/// The bench's module.
const BENCH: &str = "hpu_bench";
/// The word before each row of outputs.
const ROW: &str = "HPU";
/// The file of the bench.
const SOURCE: &str = "hpu_bench.v";
/// The file of the rows.
const ROWS: &str = "hpu_rows.txt";
/// The file of the compiled design.
const PROGRAM: &str = "hpu_bench.vvp";

/// The bits at the outputs after a row, in the order of the ports; `None` where one of them is unknown.
pub(crate) type Answer = Vec<Option<u64>>;

impl Simulators {
    /// Simulates a design on rows of bits at its ports (those of outputs are ignored), each for one cycle of its clock
    /// if it has one. Before them the design settles on the first row, whose answer is the first. Returns `None` for a
    /// design that Icarus Verilog does not take.
    pub(crate) fn answers(
        &self,
        model: &Model,
        (ports, has_clock): (&[Port], bool),
        rows: &[Vec<u64>],
    ) -> Result<Option<Vec<Answer>>, Error> {
        let dut = model.dut;
        // A net is connected to no array.
        if ports.iter().any(|port| port.name.ends_with(']')) {
            return Ok(None);
        }
        let folder = Temporary::folder().map_err(|error| Error::io(crate::temporary::parent(), error))?;
        let folder = folder.path();
        write_files(dut, folder)?;
        let say = |error| of_tool(dut, error);
        let read = |top: &str, more: &[&str]| {
            let mut command = Command::new(Tool::Icarus.name());
            command.current_dir(folder).args(["-g2012", "-I.", "-s", top]).args(more).args(sources(dut));
            run(Tool::Icarus, "read a design", command, self.limit()).map_err(say)
        };
        match read(&dut.top, &["-t", "null"]) {
            Err(error) if error.is_refusal() => return Ok(None),
            other => other?,
        };
        write(folder, SOURCE, bench(dut, (ports, has_clock), rows.len(), model.settle).as_bytes())?;
        write(folder, ROWS, words(ports, rows).as_bytes())?;
        read(BENCH, &["-o", PROGRAM, SOURCE])?;
        let mut command = Command::new("vvp");
        command.current_dir(folder).args(["-n", PROGRAM]);
        let limit = self.setup.timeout.unwrap_or(ANSWER * (1 + rows.len() as u32 / 10_000));
        let said = run(Tool::Icarus, "simulate a design", command, limit).map_err(say)?;
        let answers: Vec<Answer> = said.out.lines().filter_map(answer).collect();
        if answers.len() != rows.len() {
            let done = answers.len();
            return Err(Error::ended(format!("the simulation by iverilog ended after row {done}:\n{}", said.all())));
        }
        Ok(Some(answers))
    }
}

/// Returns the bench: a module that gives each row to the design and prints the outputs.
fn bench(dut: &Dut, (ports, has_clock): (&[Port], bool), rows: usize, settle: u64) -> String {
    let width = inputs(ports).map(|port| port.format.width()).sum::<u32>().max(1);
    let (mut nets, mut map, mut shown) = (String::new(), Vec::new(), String::new());
    let mut high = width;
    for (index, port) in ports.iter().enumerate() {
        let bits = port.format.width();
        if port.is_input {
            map.push(format!(".{}(row[{} -: {bits}])", port.name, high - 1));
            high -= bits;
        } else {
            let _ = writeln!(nets, "  wire [{}:0] out_{index};", bits - 1);
            map.push(format!(".{}(out_{index})", port.name));
            let _ = write!(shown, ", out_{index}");
        }
    }
    for clock in dut.clocks.iter().filter(|_| has_clock) {
        map.push(format!(".{}(clock)", clock.port));
    }
    let form = " %b".repeat(ports.iter().filter(|port| !port.is_input).count());
    let generic = |(name, value): &(Identifier, Generic)| format!(".{name}({})", Script::<Verilog>::literal(value));
    let generics: Vec<_> = dut.generics.iter().map(generic).collect();
    let generics = if generics.is_empty() { String::new() } else { format!("#({}) ", generics.join(", ")) };
    format!(
        "`timescale 1ns / 1ns
module {BENCH};
  reg [{high}:0] rows [0:{last}];
  reg [{high}:0] row;
  reg clock;
  integer index;
{nets}  {top} {generics}dut ({map});
  initial begin
    $readmemb(\"{ROWS}\", rows);
    clock = 0;
    row = rows[0];
    repeat ({settle}) begin
      #1 clock = 1;
      #1 clock = 0;
    end
    for (index = 0; index <= {last}; index = index + 1) begin
      if (index > 0) begin
        clock = 0;
        #1 row = rows[index];
        #1 clock = 1;
      end
      #1 $display(\"{ROW}{form}\"{shown});
    end
    $finish;
  end
endmodule
",
        high = width - 1,
        last = rows.saturating_sub(1),
        top = dut.top,
        map = map.join(", "),
    )
}

/// Returns the rows as the bench reads them.
fn words(ports: &[Port], rows: &[Vec<u64>]) -> String {
    let mut text = String::new();
    for row in rows {
        for (port, bits) in ports.iter().zip(row).filter(|(port, _)| port.is_input) {
            let _ = write!(text, "{bits:0width$b}", width = port.format.width() as usize);
        }
        if inputs(ports).next().is_none() {
            text.push('0');
        }
        text.push('\n');
    }
    text
}

fn inputs(ports: &[Port]) -> impl Iterator<Item = &Port> {
    ports.iter().filter(|port| port.is_input)
}

/// Reads a row of outputs.
fn answer(line: &str) -> Option<Answer> {
    let words = line.strip_prefix(ROW)?.split_whitespace();
    Some(words.map(|word| u64::from_str_radix(word, 2).ok()).collect())
}
