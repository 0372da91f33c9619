-- hpu_dut_bridge : how a bench around somebody's own design talks to hpu
--
-- In the subset of VHDL-93, so that it goes with designs of either standard;
-- what stands between `only 93` and `end` is left out for VHDL-2008, where
-- std_logic_vector and std_ulogic_vector are one type. The shared library in the
-- directory of the run is called through VHPIDIRECT.
--
-- Bits cross in parts of 30, the lowest first, as natural numbers.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

package hpu_dut_bridge is

  -- Not 0 when the bench is to tell what its ports are, and end.
  impure function hpu_dut_asks return integer;
  attribute foreign of hpu_dut_asks : function is "VHPIDIRECT ./libhpu_vhpi.so hpu_dut_asks";

  -- A port: its bits, and 1 when they are a signed word, 2 when they are a number.
  procedure hpu_dut_port(width : integer; kind : integer);
  attribute foreign of hpu_dut_port : procedure is "VHPIDIRECT ./libhpu_vhpi.so hpu_dut_port";

  -- Meets hpu; 1.
  impure function hpu_dut_open return integer;
  attribute foreign of hpu_dut_open : function is "VHPIDIRECT ./libhpu_vhpi.so hpu_dut_open";

  -- Part of the bits at an input.
  impure function hpu_dut_input(port_index : integer; part : integer) return integer;
  attribute foreign of hpu_dut_input : function is "VHPIDIRECT ./libhpu_vhpi.so hpu_dut_input";

  -- Part of the bits at an output that has so many; -1 when one of them is unknown.
  procedure hpu_dut_word(port_index : integer; part : integer; word : integer; width : integer);
  attribute foreign of hpu_dut_word : procedure is "VHPIDIRECT ./libhpu_vhpi.so hpu_dut_word";

  -- After the reset.
  procedure hpu_dut_reset;
  attribute foreign of hpu_dut_reset : procedure is "VHPIDIRECT ./libhpu_vhpi.so hpu_dut_reset";

  -- Answers, and takes the next request: edges to clock, -1 at the end.
  impure function hpu_dut_next return integer;
  attribute foreign of hpu_dut_next : function is "VHPIDIRECT ./libhpu_vhpi.so hpu_dut_next";

  -- After an edge: not 0 when an output that drives the device has changed.
  impure function hpu_dut_edge return integer;
  attribute foreign of hpu_dut_edge : function is "VHPIDIRECT ./libhpu_vhpi.so hpu_dut_edge";

  -- Tells what a port is.
  procedure hpu_dut_kind(signal s : in std_ulogic);
  procedure hpu_dut_kind(signal s : in bit);
  procedure hpu_dut_kind(signal s : in boolean);
  procedure hpu_dut_kind(signal s : in integer);
  procedure hpu_dut_kind(signal s : in std_ulogic_vector);
  -- only 93
  procedure hpu_dut_kind(signal s : in std_logic_vector);
  -- end
  procedure hpu_dut_kind(signal s : in bit_vector);
  procedure hpu_dut_kind(signal s : in unsigned);
  procedure hpu_dut_kind(signal s : in signed);

  -- Puts at an input what the world gives.
  procedure hpu_dut_give(signal s : out std_ulogic; port_index : in natural);
  procedure hpu_dut_give(signal s : out bit; port_index : in natural);
  procedure hpu_dut_give(signal s : out boolean; port_index : in natural);
  procedure hpu_dut_give(signal s : out integer; port_index : in natural);
  procedure hpu_dut_give(signal s : out std_ulogic_vector; port_index : in natural);
  -- only 93
  procedure hpu_dut_give(signal s : out std_logic_vector; port_index : in natural);
  -- end
  procedure hpu_dut_give(signal s : out bit_vector; port_index : in natural);
  procedure hpu_dut_give(signal s : out unsigned; port_index : in natural);
  procedure hpu_dut_give(signal s : out signed; port_index : in natural);

  -- Tells an output; as a concurrent statement, whenever it changes.
  procedure hpu_dut_tell(port_index : in natural; signal s : in std_ulogic);
  procedure hpu_dut_tell(port_index : in natural; signal s : in bit);
  procedure hpu_dut_tell(port_index : in natural; signal s : in boolean);
  procedure hpu_dut_tell(port_index : in natural; signal s : in integer);
  procedure hpu_dut_tell(port_index : in natural; signal s : in std_ulogic_vector);
  -- only 93
  procedure hpu_dut_tell(port_index : in natural; signal s : in std_logic_vector);
  -- end
  procedure hpu_dut_tell(port_index : in natural; signal s : in bit_vector);
  procedure hpu_dut_tell(port_index : in natural; signal s : in unsigned);
  procedure hpu_dut_tell(port_index : in natural; signal s : in signed);

end package;

package body hpu_dut_bridge is

  constant PART_BITS : positive := 30;

  impure function hpu_dut_asks return integer is
  begin
    report "not linked" severity failure;
    return 0;
  end;

  procedure hpu_dut_port(width : integer; kind : integer) is
  begin
    report "not linked" severity failure;
  end;

  impure function hpu_dut_open return integer is
  begin
    report "not linked" severity failure;
    return 0;
  end;

  impure function hpu_dut_input(port_index : integer; part : integer) return integer is
  begin
    report "not linked" severity failure;
    return 0;
  end;

  procedure hpu_dut_word(port_index : integer; part : integer; word : integer; width : integer) is
  begin
    report "not linked" severity failure;
  end;

  procedure hpu_dut_reset is
  begin
    report "not linked" severity failure;
  end;

  impure function hpu_dut_next return integer is
  begin
    report "not linked" severity failure;
    return 0;
  end;

  impure function hpu_dut_edge return integer is
  begin
    report "not linked" severity failure;
    return 0;
  end;

  -- The bits at an input.
  impure function take(port_index : natural; width : positive) return unsigned is
    constant PARTS    : positive := (width + PART_BITS - 1) / PART_BITS;
    variable all_bits : unsigned(PARTS * PART_BITS - 1 downto 0) := (others => '0');
  begin
    for part in PARTS - 1 downto 0 loop
      all_bits := shift_left(all_bits, PART_BITS);
      all_bits(PART_BITS - 1 downto 0) := to_unsigned(hpu_dut_input(port_index, part), PART_BITS);
    end loop;
    return all_bits(width - 1 downto 0);
  end;

  procedure put(port_index : natural; word : std_ulogic_vector) is
    constant LOW_FIRST : std_ulogic_vector(word'length - 1 downto 0) := word;
    variable top       : natural;
    variable part      : natural := 0;
    variable low       : natural := 0;
    variable number    : natural;
    variable known     : boolean;
  begin
    while low < word'length loop
      top := low + PART_BITS - 1;
      if top > word'length - 1 then
        top := word'length - 1;
      end if;
      number := 0;
      known := true;
      for index in top downto low loop
        number := 2 * number;
        case LOW_FIRST(index) is
          when '1' | 'H' => number := number + 1;
          when '0' | 'L' => null;
          when others    => known := false;
        end case;
      end loop;
      if known then
        hpu_dut_word(port_index, part, number, word'length);
      else
        hpu_dut_word(port_index, part, -1, word'length);
      end if;
      low := low + PART_BITS;
      part := part + 1;
    end loop;
  end;

  procedure put(port_index : natural; bit_of_it : std_ulogic) is
    variable one_bit : std_ulogic_vector(0 downto 0);
  begin
    one_bit(0) := bit_of_it;
    put(port_index, one_bit);
  end;

  procedure hpu_dut_kind(signal s : in std_ulogic) is
  begin
    hpu_dut_port(1, 0);
  end;

  procedure hpu_dut_kind(signal s : in bit) is
  begin
    hpu_dut_port(1, 0);
  end;

  procedure hpu_dut_kind(signal s : in boolean) is
  begin
    hpu_dut_port(1, 0);
  end;

  procedure hpu_dut_kind(signal s : in integer) is
  begin
    hpu_dut_port(32, 2);
  end;

  procedure hpu_dut_kind(signal s : in std_ulogic_vector) is
  begin
    hpu_dut_port(s'length, 0);
  end;

  -- only 93
  procedure hpu_dut_kind(signal s : in std_logic_vector) is
  begin
    hpu_dut_port(s'length, 0);
  end;
  -- end

  procedure hpu_dut_kind(signal s : in bit_vector) is
  begin
    hpu_dut_port(s'length, 0);
  end;

  procedure hpu_dut_kind(signal s : in unsigned) is
  begin
    hpu_dut_port(s'length, 0);
  end;

  procedure hpu_dut_kind(signal s : in signed) is
  begin
    hpu_dut_port(s'length, 1);
  end;

  procedure hpu_dut_give(signal s : out std_ulogic; port_index : in natural) is
    constant WORD : unsigned(0 downto 0) := take(port_index, 1);
  begin
    s <= WORD(0);
  end;

  procedure hpu_dut_give(signal s : out bit; port_index : in natural) is
    constant WORD : unsigned(0 downto 0) := take(port_index, 1);
  begin
    s <= to_bit(WORD(0));
  end;

  procedure hpu_dut_give(signal s : out boolean; port_index : in natural) is
    constant WORD : unsigned(0 downto 0) := take(port_index, 1);
  begin
    s <= WORD(0) = '1';
  end;

  procedure hpu_dut_give(signal s : out integer; port_index : in natural) is
  begin
    s <= to_integer(signed(take(port_index, 32)));
  end;

  procedure hpu_dut_give(signal s : out std_ulogic_vector; port_index : in natural) is
  begin
    s <= std_ulogic_vector(take(port_index, s'length));
  end;

  -- only 93
  procedure hpu_dut_give(signal s : out std_logic_vector; port_index : in natural) is
  begin
    s <= std_logic_vector(take(port_index, s'length));
  end;
  -- end

  procedure hpu_dut_give(signal s : out bit_vector; port_index : in natural) is
  begin
    s <= to_bitvector(std_logic_vector(take(port_index, s'length)));
  end;

  procedure hpu_dut_give(signal s : out unsigned; port_index : in natural) is
  begin
    s <= take(port_index, s'length);
  end;

  procedure hpu_dut_give(signal s : out signed; port_index : in natural) is
  begin
    s <= signed(take(port_index, s'length));
  end;

  procedure hpu_dut_tell(port_index : in natural; signal s : in std_ulogic) is
  begin
    put(port_index, s);
  end;

  procedure hpu_dut_tell(port_index : in natural; signal s : in bit) is
  begin
    put(port_index, to_stdulogic(s));
  end;

  procedure hpu_dut_tell(port_index : in natural; signal s : in boolean) is
  begin
    if s then
      put(port_index, '1');
    else
      put(port_index, '0');
    end if;
  end;

  procedure hpu_dut_tell(port_index : in natural; signal s : in integer) is
  begin
    put(port_index, std_ulogic_vector(to_signed(s, 32)));
  end;

  procedure hpu_dut_tell(port_index : in natural; signal s : in std_ulogic_vector) is
  begin
    put(port_index, s);
  end;

  -- only 93
  procedure hpu_dut_tell(port_index : in natural; signal s : in std_logic_vector) is
  begin
    put(port_index, std_ulogic_vector(s));
  end;
  -- end

  procedure hpu_dut_tell(port_index : in natural; signal s : in bit_vector) is
  begin
    put(port_index, to_stdulogicvector(s));
  end;

  procedure hpu_dut_tell(port_index : in natural; signal s : in unsigned) is
  begin
    put(port_index, std_ulogic_vector(s));
  end;

  procedure hpu_dut_tell(port_index : in natural; signal s : in signed) is
  begin
    put(port_index, std_ulogic_vector(s));
  end;

end package body;
