-- loop_bridge : the emulator's side of a closed loop, called from VHDL
--
-- The plant lives in a shared library, which also ticks the emulator's wiring
-- beside the VHDL and compares every net after every edge. GHDL calls it
-- through VHPIDIRECT; the library is in the directory of the run.
--
-- Words cross in parts of 30 bits, the lowest first, as natural numbers.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

package loop_bridge is

  -- Part of the word of an input port.
  impure function hpu_loop_input(net : integer; part : integer) return integer;
  attribute foreign of hpu_loop_input : function is "VHPIDIRECT ./libhpu_rtl.so hpu_loop_input";

  -- Flows the plant by one clock: the inputs of one bit which the next edge
  -- samples, the first port lowest, plus WORDS_CHANGED when wider ones have
  -- changed; -1 after the last edge.
  impure function hpu_loop_pins return integer;
  attribute foreign of hpu_loop_pins : function is "VHPIDIRECT ./libhpu_rtl.so hpu_loop_pins";

  -- Part of the word that a net has now; -1 when it has an unknown bit.
  procedure hpu_loop_net(net : integer; part : integer; word : integer);
  attribute foreign of hpu_loop_net : procedure is "VHPIDIRECT ./libhpu_rtl.so hpu_loop_net";

  -- After an edge, all nets told: compares them and drives the plant.
  procedure hpu_loop_edge;
  attribute foreign of hpu_loop_edge : procedure is "VHPIDIRECT ./libhpu_rtl.so hpu_loop_edge";

  constant WORDS_CHANGED : integer := 2**24;

  -- One of those bits.
  function level(pins : integer; place : natural) return std_logic;

  -- The word of an input port.
  impure function take(net : natural; width : positive) return std_logic_vector;

  -- Tells a net's word; as a concurrent statement, whenever it changes.
  procedure tell(net : natural; word : std_logic_vector);
  procedure tell(net : natural; word : std_logic);

end package;

package body loop_bridge is

  constant PART_BITS : positive := 30;

  impure function hpu_loop_input(net : integer; part : integer) return integer is
  begin
    report "not linked" severity failure;
    return 0;
  end function;

  impure function hpu_loop_pins return integer is
  begin
    report "not linked" severity failure;
    return 0;
  end function;

  procedure hpu_loop_net(net : integer; part : integer; word : integer) is
  begin
    report "not linked" severity failure;
  end procedure;

  procedure hpu_loop_edge is
  begin
    report "not linked" severity failure;
  end procedure;

  function level(pins : integer; place : natural) return std_logic is
  begin
    if (pins / 2**place) mod 2 = 1 then
      return '1';
    end if;
    return '0';
  end function;

  impure function take(net : natural; width : positive) return std_logic_vector is
    constant PARTS : positive := (width + PART_BITS - 1) / PART_BITS;
    variable all_bits : unsigned(PARTS * PART_BITS - 1 downto 0) := (others => '0');
  begin
    for part in PARTS - 1 downto 0 loop
      all_bits := shift_left(all_bits, PART_BITS);
      all_bits(PART_BITS - 1 downto 0) := to_unsigned(hpu_loop_input(net, part), PART_BITS);
    end loop;
    return std_logic_vector(all_bits(width - 1 downto 0));
  end function;

  procedure tell(net : natural; word : std_logic_vector) is
    constant LOW_FIRST : std_logic_vector(word'length - 1 downto 0) := word;
    variable top       : natural;
    variable part      : natural := 0;
    variable low       : natural := 0;
  begin
    while low < word'length loop
      top := minimum(low + PART_BITS, word'length) - 1;
      if is_x(LOW_FIRST(top downto low)) then
        hpu_loop_net(net, part, -1);
      else
        hpu_loop_net(net, part, to_integer(unsigned(LOW_FIRST(top downto low))));
      end if;
      low  := low + PART_BITS;
      part := part + 1;
    end loop;
  end procedure;

  procedure tell(net : natural; word : std_logic) is
    constant ONE_BIT : std_logic_vector(0 downto 0) := (0 => word);
  begin
    tell(net, ONE_BIT);
  end procedure;

end package body;
