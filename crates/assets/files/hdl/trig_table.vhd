-- trig_table : sine and cosine of an encoder count, from a full table
--
--   sine   := round(sin(2*pi * count * TURN_NUM/TURN_DEN) * 2^TRIG_FRAC)
--   cosine := the same of cos
--   valid  := -2^(DEPTH_WIDTH-1) <= count < 2^(DEPTH_WIDTH-1)
--
-- Outside that range sine and cosine are 0. The table has a word of each for
-- every count of its range and is addressed by the count itself: no angle, no
-- scaling, no interpolation.
--
-- generics COUNT_WIDTH          bits of the count
--          DEPTH_WIDTH          address bits of the table, at most COUNT_WIDTH
--          TURN_NUM, TURN_DEN   turns of the joint per count, as a fraction;
--                               2^(DEPTH_WIDTH-1) * TURN_NUM stays below 2^31
--          TRIG_INT, TRIG_FRAC  format of the sines and cosines: at least 1, at
--                               most 30
-- in       count  (1,COUNT_WIDTH-1,0)
-- out      sine   (1,TRIG_INT,TRIG_FRAC)
--          cosine (1,TRIG_INT,TRIG_FRAC)
--          valid  (0,1,0)
-- latency  1 edge
-- reset    sine 0, cosine 0, valid 0
-- overflow none
-- source   Sevcik et al. 2009, the look-up table indexed by encoder counts
-- differs from the hardware: the paper's table covers its own workspace, whose
--          size in counts it does not give.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity trig_table is
  generic (
    COUNT_WIDTH : positive := 16;
    DEPTH_WIDTH : positive := 13;
    TURN_NUM    : positive := 1;
    TURN_DEN    : positive := 28000;
    TRIG_INT    : positive := 9;
    TRIG_FRAC   : positive := 22
  );
  port (
    clk    : in  std_logic;
    rst    : in  std_logic;
    count  : in  std_logic_vector(COUNT_WIDTH - 1 downto 0);
    sine   : out std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    cosine : out std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    valid  : out std_logic
  );
end entity;

architecture rtl of trig_table is

  type table is array (natural range <>) of std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);

  -- sin(angle), or cos(angle) when it starts with the even terms, for angles up
  -- to pi/4: the terms left out are below 2^-60.
  function series(angle : real; even : boolean) return real is
    variable term : real := 1.0;
    variable sum  : real := 0.0;
  begin
    for n in 1 to 18 loop
      if (n mod 2 = 1) = even then
        sum := sum + term;
      end if;
      term := term * angle / real(n);
      if n mod 2 = 0 then
        term := -term;
      end if;
    end loop;
    return sum;
  end function;

  -- The word of the sine of TURN_NUM/TURN_DEN * place + quarters/4 turns. The
  -- angle is reduced to an eighth of a turn in integers, so nothing is lost;
  -- the doublings are written so that they stay inside an integer.
  function word(place : integer; quarters : natural) return std_logic_vector is
    variable rest   : natural := (place * TURN_NUM) mod TURN_DEN;
    variable octant : natural := 0;
    variable even   : boolean;
    variable value  : integer;
  begin
    for doubling in 1 to 3 loop
      octant := 2 * octant;
      if rest >= TURN_DEN - rest then
        octant := octant + 1;
        rest   := rest - (TURN_DEN - rest);
      else
        rest   := 2 * rest;
      end if;
    end loop;
    octant := (octant + 2 * quarters) mod 8;

    if octant mod 2 = 1 then
      rest := TURN_DEN - rest;
    end if;
    even  := octant mod 4 = 1 or octant mod 4 = 2;
    value := integer(series(0.78539816339744830962 * real(rest) / real(TURN_DEN), even)
                     * 2.0**TRIG_FRAC);
    if octant >= 4 then
      value := -value;
    end if;
    return std_logic_vector(to_signed(value, TRIG_INT + TRIG_FRAC + 1));
  end function;

  -- The words of `size` counts from `first` on. A long table is put together from
  -- halves: as one local variable it can be more than a simulator's stack takes.
  function fill(first : integer; size : positive; quarters : natural) return table is
    variable words : table(0 to minimum(size, 1024) - 1);
  begin
    if size > words'length then
      return fill(first, size / 2, quarters) & fill(first + size / 2, size / 2, quarters);
    end if;
    for i in words'range loop
      words(i) := word(first + i, quarters);
    end loop;
    return words;
  end function;

  constant HALF : positive := 2**(DEPTH_WIDTH - 1);

  -- In the order of the address: the counts from 0, then those below.
  constant SINES   : table(0 to 2 * HALF - 1) := fill(0, HALF, 0) & fill(-HALF, HALF, 0);
  constant COSINES : table(0 to 2 * HALF - 1) := fill(0, HALF, 1) & fill(-HALF, HALF, 1);

begin

  process (clk)
    variable upper  : std_logic_vector(COUNT_WIDTH - 1 downto DEPTH_WIDTH - 1);
    variable inside : std_logic;
    variable index  : natural range SINES'range;
  begin
    if rising_edge(clk) then
      -- Inside when the bits from the table's sign bit upwards are all the same.
      upper  := count(upper'range);
      inside := (and upper) or (nor upper);
      valid  <= inside;

      if is_x(count) then
        sine   <= (others => 'X');
        cosine <= (others => 'X');
      else
        index  := to_integer(unsigned(count(DEPTH_WIDTH - 1 downto 0)));
        sine   <= SINES(index);
        cosine <= COSINES(index);
        -- An override and no gate, so that synthesis finds a memory with a
        -- registered and cleared output: block RAM.
        if inside = '0' then
          sine   <= (others => '0');
          cosine <= (others => '0');
        end if;
      end if;

      if rst = '1' then
        sine   <= (others => '0');
        cosine <= (others => '0');
        valid  <= '0';
      end if;
    end if;
  end process;

end architecture;
