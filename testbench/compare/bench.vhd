-- bench : hybrid_loop closed around the C++ plant by VHPIDIRECT, nothing recorded
--
-- generics EDGES   clock edges to run
--          others  words of the scene that stay

library ieee;
use ieee.std_logic_1164.all;

package plant is
  impure function plant_edge(gates : integer) return integer;
  attribute foreign of plant_edge : function is "VHPIDIRECT ./libplant.so plant_edge";
end package;

package body plant is
  impure function plant_edge(gates : integer) return integer is
  begin
    report "not linked" severity failure;
    return 0;
  end function;
end package body;

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.plant.all;

entity bench is
  generic (
    EDGES     : natural;
    REFERENCE : natural;
    STIFFNESS : natural;
    DAMPING   : natural;
    PERIOD    : natural;
    SCALE     : natural
  );
end entity;

architecture test of bench is
  signal clk    : std_logic := '0';
  signal rst    : std_logic := '1';
  signal a_pin  : std_logic := '0';
  signal b_pin  : std_logic := '0';
  signal a_high : std_logic;
  signal a_low  : std_logic;
  signal b_high : std_logic;
  signal b_low  : std_logic;
begin

  dut : entity work.hybrid_loop
    generic map (
      DAMPING_FRAC => 4
    )
    port map (
      clk       => clk,
      rst       => rst,
      a_pin     => a_pin,
      b_pin     => b_pin,
      reference => std_logic_vector(to_unsigned(REFERENCE, 12)),
      stiffness => std_logic_vector(to_unsigned(STIFFNESS, 12)),
      damping   => std_logic_vector(to_unsigned(DAMPING, 12)),
      period    => std_logic_vector(to_unsigned(PERIOD, 24)),
      scale     => std_logic_vector(to_unsigned(SCALE, 16)),
      a_high    => a_high,
      a_low     => a_low,
      b_high    => b_high,
      b_low     => b_low
    );

  process
    function bit_of(level : std_logic; weight : natural) return natural is
    begin
      if level = '1' then
        return weight;
      end if;
      return 0;
    end function;

    function level(bits : natural; place : natural) return std_logic is
    begin
      if (bits / 2**place) mod 2 = 1 then
        return '1';
      end if;
      return '0';
    end function;

    variable pins : natural;
  begin
    wait for 10 ns;
    clk <= '1';
    wait for 10 ns;
    clk <= '0';
    rst <= '0';
    for edge in 1 to EDGES loop
      pins  := plant_edge(bit_of(a_high, 1) + bit_of(a_low, 2) + bit_of(b_high, 4) + bit_of(b_low, 8));
      a_pin <= level(pins, 0);
      b_pin <= level(pins, 1);
      wait for 10 ns;
      clk <= '1';
      wait for 10 ns;
      clk <= '0';
    end loop;
    wait;
  end process;

end architecture;
