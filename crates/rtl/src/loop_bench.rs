//! Testbenches of closed loops: the wiring in VHDL, the plant behind `loop_bridge`.

use hpu_cosim::TheLoop;
use hpu_datapath::{AnyBlock, ConventionalLoop, HybridLoop};
use hpu_signal::Signal;

use crate::package::GENERATED;
use crate::testbench::{generic_clause, instance, port_type};

/// The hand-written package that declares the shared library's functions.
pub const LOOP_BRIDGE: &str = include_str!("../../../testbench/vhdl/loop_bridge.vhd");

/// All nets of a wiring, by its name.
fn nets(wiring: &dyn AnyBlock) -> Vec<Signal> {
    let either = [TheLoop::Hybrid(HybridLoop::default()), TheLoop::Conventional(ConventionalLoop::default())];
    either.iter().find(|either| either.name() == wiring.name()).map(TheLoop::nets).expect("one of two wirings")
}

/// The text of `testbench/vhdl/generated/probe_<wiring>.vhd`.
#[must_use]
pub fn probe(wiring: &dyn AnyBlock) -> String {
    let name = wiring.name();
    let port = |net: &Signal| {
        let kind = if net.format.width() == 1 { "std_logic" } else { "std_logic_vector" };
        format!("    {} : in {kind}", net.name)
    };
    let ports: Vec<_> = nets(wiring).iter().map(port).collect();
    let tell = |(index, net): (usize, &Signal)| format!("  tell({index}, {});\n", net.name);
    let tells: String = nets(wiring).iter().enumerate().map(tell).collect();
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
pub(crate) fn probe_instance(wiring: &dyn AnyBlock) -> String {
    let map: Vec<_> = nets(wiring).iter().map(|net| format!("{0} => {0}", net.name)).collect();
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
    let constants: String = (inputs.iter().enumerate().skip(2))
        .map(|(index, Signal { name, .. })| format!("    {name} <= take({index}, {name}'length);\n"))
        .collect();
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
    type lines is array (0 to 3) of std_logic_vector(1 downto 0);
    constant LEVELS : lines := (\"00\", \"01\", \"10\", \"11\");
    variable pins : integer;
  begin
    (a_pin, b_pin) <= LEVELS(0);
{constants}    wait for 5 ns;
    clk <= '1';
    wait for 5 ns;
    clk <= '0';
    rst <= '0';
    loop
      pins := hpu_loop_pins;
      exit when pins < 0;
      (a_pin, b_pin) <= LEVELS(pins);
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
    )
}
