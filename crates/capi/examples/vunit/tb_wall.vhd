-- tb_wall : the hybrid loop of hdl/ around the plant of a scene, in VUnit
--
-- Each test opens a plant of its own: overrides stand behind the scene's name.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library vunit_lib;
context vunit_lib.vunit_context;

use work.hpu_plant.all;

entity tb_wall is
  generic (
    runner_cfg : string
  );
end entity;

architecture test of tb_wall is

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

    variable plant, lines : integer := 0;
    -- The deepest that the handle has been in the wall, in counts.
    variable depth        : integer := 0;

    procedure clock is
    begin
      wait for 10 ns;
      clk <= '1';
      wait for 10 ns;
      clk <= '0';
    end procedure;

    -- Closes the loop from the start of a scene to its end.
    procedure play(scene : string) is
      variable passed : integer;
    begin
      plant := hpu_open(scene);
      check(plant > 0, "the scene is refused");
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
        passed := hpu_input(plant, "count") - to_integer(unsigned(reference));
        depth  := maximum(depth, passed);
      end loop;
      check_equal(lines, HPU_END, "the plant cannot go on");
    end procedure;

  begin
    test_runner_setup(runner, runner_cfg);
    while test_suite loop
      depth := 0;
      if run("the hand reaches the wall") then
        play("hybrid-wall;run.duration=2 ms;wall.position=0.0016 rad");
        check(depth > 0, "the wall is not reached");
      elsif run("the motor stands still without a hand") then
        play("hybrid-wall;run.duration=1 ms;hand={ kind = ""none"" }");
        check_equal(hpu_state(plant, "angle_rad"), 0.0);
      end if;
      check_equal(hpu_close(plant), 0);
    end loop;
    test_runner_cleanup(runner);
  end process;

end architecture;
