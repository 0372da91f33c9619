-- motor_tb : hybrid_loop of hdl/ around the plant of the scene SCENE, in a testbench by hand
--
-- Runs to the end of the scene, then tells the number of clock edges and the states.
--
--   cargo build --release -p hpu-capi
--   cd crates/capi/examples; export LD_LIBRARY_PATH=.:../../../target/release
--   cc -O2 -shared -fPIC -I../include -o libhpu_sim.so ../simulators/hpu_sim.c -L../../../target/release -lhpu
--   ghdl -i --std=08 ../../../hdl/*.vhd ../simulators/hpu_plant.vhd motor_tb.vhd
--   ghdl -m --std=08 motor_tb
--   ghdl -r --std=08 motor_tb "-gSCENE=hybrid-wall;run.duration=4 ms;wall.position=0.01 rad"

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use std.textio.all;
use work.hpu_plant.all;

entity motor_tb is
  generic (
    SCENE : string := "hybrid-wall"
  );
end entity;

architecture test of motor_tb is

  signal clk, rst                       : std_logic := '0';
  signal a_pin, b_pin                   : std_logic := '0';
  signal a_high, a_low, b_high, b_low   : std_logic;
  signal reference, stiffness, damping  : std_logic_vector(11 downto 0) := (others => '0');
  signal period                         : std_logic_vector(23 downto 0) := (others => '0');

begin

  wall : entity work.hybrid_loop
    generic map (
      DAMPING_FRAC => 4
    )
    port map (
      clk       => clk,
      rst       => rst,
      a_pin     => a_pin,
      b_pin     => b_pin,
      reference => reference,
      stiffness => stiffness,
      damping   => damping,
      period    => period,
      scale     => (15 downto 0 => '0'),
      a_high    => a_high,
      a_low     => a_low,
      b_high    => b_high,
      b_low     => b_low
    );

  process

    variable plant, lines, edges : integer := 0;

    procedure clock is
    begin
      wait for 10 ns;
      clk <= '1';
      wait for 10 ns;
      clk <= '0';
    end procedure;

    procedure tell(name : string; value : real) is
      variable row : line;
    begin
      write(row, name & " " & to_string(value, "%.17g"));
      writeline(output, row);
    end procedure;

  begin
    plant := hpu_open(SCENE);
    assert plant > 0 report "the scene is refused" severity failure;
    reference <= std_logic_vector(to_unsigned(hpu_input(plant, "reference"), 12));
    stiffness <= std_logic_vector(to_unsigned(hpu_input(plant, "stiffness"), 12));
    damping   <= std_logic_vector(to_unsigned(hpu_input(plant, "damping"), 12));
    period    <= std_logic_vector(to_unsigned(hpu_input(plant, "period"), 24));

    rst <= '1';
    clock;
    rst <= '0';
    loop
      lines := hpu_step(plant, to_integer(unsigned'(a_high & a_low & b_high & b_low)));
      exit when lines < 0;
      a_pin <= '1' when lines >= 2 else '0';
      b_pin <= '1' when lines mod 2 = 1 else '0';
      clock;
      edges := edges + 1;
    end loop;
    assert lines = HPU_END report "the run has failed" severity failure;

    tell("edge", real(edges));
    tell("current_a", hpu_state(plant, "current_a"));
    tell("speed_rad_per_s", hpu_state(plant, "speed_rad_per_s"));
    tell("angle_rad", hpu_state(plant, "angle_rad"));
    lines := hpu_close(plant);
    wait;
  end process;

end architecture;
