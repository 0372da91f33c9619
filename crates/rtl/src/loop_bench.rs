//! Testbenches of closed loops: the wiring in VHDL, the plant behind `loop_bridge`.

use hpu_cosim::TheLoop;
use hpu_datapath::AnyBlock;
use hpu_signal::Signal;

use crate::package::GENERATED;
use crate::testbench::{generic_clause, instance, port_type};

/// The hand-written package that declares the shared library's functions.
pub const LOOP_BRIDGE: &str = include_str!("../../../testbench/vhdl/loop_bridge.vhd");

/// The text of `testbench/vhdl/generated/probe_<wiring>.vhd`.
#[must_use]
pub fn probe(wiring: &TheLoop) -> String {
    let (name, nets) = (wiring.name(), wiring.nets());
    let port = |net: &Signal| {
        let kind = if net.format.width() == 1 { "std_logic" } else { "std_logic_vector" };
        format!("    {} : in {kind}", net.name)
    };
    let ports: Vec<_> = nets.iter().map(port).collect();
    let tell = |(index, net): (usize, &Signal)| format!("  tell({index}, {});\n", net.name);
    let tells: String = nets.iter().enumerate().map(tell).collect();
    format!(
        "{GENERATED}--
-- Tells the emulator every net of {name} whenever it changes. GHDL 2.0 reads no
-- external names, so an instance of this is added to a copy of the wiring.

library ieee;
use ieee.std_logic_1164.all;
use work.loop_bridge.all;

entity probe_{name} is
  port (
{}
  );
end entity;

architecture test of probe_{name} is
begin
{tells}end architecture;
",
        ports.join(";\n")
    )
}

/// The statement that is added to the copy.
pub(crate) fn probe_instance(wiring: &TheLoop) -> String {
    let map: Vec<_> = wiring.nets().iter().map(|net| format!("{0} => {0}", net.name)).collect();
    format!("  probe : entity work.probe_{} port map ({});\n\n", wiring.name(), map.join(", "))
}

/// The text of `testbench/vhdl/generated/tb_loop_<wiring>.vhd`. The wiring must be in its default configuration.
#[must_use]
pub fn loop_bench(wiring: &dyn AnyBlock) -> String {
    let name = wiring.name();
    let (inputs, outputs) = (wiring.inputs(), wiring.outputs());
    let signals: String = inputs
        .iter()
        .chain(&outputs)
        .map(|signal| format!("  signal {} : {};\n", signal.name, port_type(signal)))
        .collect();
    let numbered = || inputs.iter().enumerate();
    let bits = numbered().filter(|(_, signal)| signal.format.width() == 1);
    let levels: String = bits
        .clone()
        .enumerate()
        .map(|(place, (_, signal))| format!("      {} <= level(pins, {place});\n", signal.name))
        .collect();
    // Before the first edge the lines are where the encoders are.
    let first_levels: String =
        bits.map(|(index, signal)| format!("    {} <= take({index}, 1)(0);\n", signal.name)).collect();
    let words = |indent: &str| -> String {
        let wide = numbered().filter(|(_, signal)| signal.format.width() > 1);
        wide.map(|(index, Signal { name, .. })| format!("{indent}{name} <= take({index}, {name}'length);\n")).collect()
    };
    format!(
        "{GENERATED}--
-- {name} closed around the emulator's plant, every net compared after every
-- edge. Ends with the line RESULT rows=<edges> mismatches=<n>

library ieee;
use ieee.std_logic_1164.all;
use work.vector_reader.bits;
use work.loop_bridge.all;

entity tb_loop_{name} is
  generic (
{generics}    FORMAT : string := work.{name}_pkg.FORMAT
  );
end entity;

architecture test of tb_loop_{name} is
  signal clk : std_logic := '0';
  signal rst : std_logic := '1';
{signals}begin

{instance}
  process
    variable pins : integer := 0;
  begin
{first_levels}{first_words}    wait for 5 ns;
    clk <= '1';
    wait for 5 ns;
    clk <= '0';
    rst <= '0';
    loop
      pins := hpu_loop_pins;
      exit when pins < 0;
{levels}      if pins >= WORDS_CHANGED then
{words}      end if;
      wait for 5 ns;
      clk <= '1';
      wait for 5 ns;
      hpu_loop_edge;
      clk <= '0';
    end loop;
    wait;
  end process;

end architecture;
",
        generics = generic_clause(wiring),
        instance = instance(wiring),
        first_words = words("    "),
        words = words("        "),
    )
}
