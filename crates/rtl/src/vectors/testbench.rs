//! Testbenches in plain VHDL-2008, generated from a block's port list, that compare its entity with a vector file.

use hpu_datapath::AnyBlock;
use hpu_signal::Signal;

use crate::vectors::package::{GENERATED, lines, vhdl_type};

/// The hand-written package with which every testbench reads its vectors.
pub const VECTOR_READER: &str = hpu_assets::text("testbench/vhdl/vector_reader.vhd");

/// Returns the generics of the entity, with the package's values as defaults, one a line.
pub(crate) fn generic_clause(block: &dyn AnyBlock) -> String {
    let clause = |(name, value)| format!("    {name} : {} := work.{}_pkg.{name};\n", vhdl_type(value), block.name());
    block.generics().into_iter().map(clause).collect()
}

/// Returns the instance of the block, its generics and ports connected to signals of the same names.
pub(crate) fn instance(block: &dyn AnyBlock) -> String {
    let clock = if block.clocked() { &["clk", "rst"][..] } else { &[] };
    let (inputs, outputs) = (block.inputs(), block.outputs());
    let ports = clock.iter().copied().chain(inputs.iter().chain(&outputs).map(|signal| signal.name));
    let map = |kind: &str, names: Vec<&str>| {
        let all: Vec<_> = names.iter().map(|name| format!("{name} => {name}")).collect();
        let map = format!("\n    {kind} map ({})", all.join(", "));
        if all.is_empty() { String::new() } else { lines(&map, ", ", 113).join("\n      ").replace(" \n", "\n") }
    };
    let generics = block.generics().iter().map(|(name, _)| *name).collect();
    format!("  dut : entity work.{}{}{};\n", block.name(), map("generic", generics), map("port", ports.collect()))
}

/// Returns the VHDL type of a port whose width is read from the format line. A port of one bit is a scalar.
pub(crate) fn port_type(signal: &Signal) -> String {
    match signal.format.width() {
        1 => "std_logic".to_string(),
        _ => format!("std_logic_vector(bits(FORMAT, \"{}\") - 1 downto 0)", signal.name),
    }
}

/// Returns the path of the vectors that the committed testbench of a block reads unless it is told of others.
pub(crate) fn committed_vectors(block: &dyn AnyBlock) -> String {
    format!("vectors/{}/default-directed.txt", block.name())
}

/// Returns the text of `tb_<block>.vhd`, whose generics have the values of the block's package, and which reads these
/// vectors unless it is told of others.
pub fn testbench(block: &dyn AnyBlock, vectors: &str) -> String {
    let name = block.name();
    let (inputs, outputs) = (block.inputs(), block.outputs());
    let clock =
        if block.clocked() { "  signal clk : std_logic := '0';\n  signal rst : std_logic := '0';\n" } else { "" };
    let signals: String = inputs
        .iter()
        .chain(&outputs)
        .map(|signal| format!("  signal {} : {};\n", signal.name, port_type(signal)))
        .collect();
    let take = |name: &str, width: u32| match width {
        1 => format!("      {name} <= rows.word;\n"),
        _ => format!("      {name} <= rows.word({name}'length);\n"),
    };
    let rst = if block.clocked() { take("rst", 1) } else { String::new() };
    let drive: String = inputs.iter().map(|signal| take(signal.name, signal.format.width())).collect();
    let rise = if block.clocked() { "      clk <= '1';\n      wait for 5 ns;\n" } else { "" };
    let fall = if block.clocked() { "      clk <= '0';\n" } else { "" };
    let check: String =
        outputs.iter().map(|Signal { name, .. }| format!("      rows.check(\"{name}\", {name});\n")).collect();
    format!(
        "{GENERATED}--
-- Holds {name} against a vector file, one row an edge. Ends with the line
--   RESULT rows=<n> mismatches=<n>

library ieee;
use ieee.std_logic_1164.all;
use work.vector_reader.all;

entity tb_{name} is
  generic (
{generics}    FORMAT : string := work.{name}_pkg.FORMAT;
    VECTORS : string := \"{vectors}\"
  );
end entity;

architecture test of tb_{name} is
{clock}{signals}begin

{instance}
  process
    variable rows : vector_file;
  begin
    rows.open_set(VECTORS, FORMAT);
    while rows.next_row loop
{rst}{drive}      wait for 5 ns;
{rise}{check}{fall}    end loop;
    rows.finish;
    wait;
  end process;

end architecture;
",
        generics = generic_clause(block),
        instance = instance(block),
    )
}
