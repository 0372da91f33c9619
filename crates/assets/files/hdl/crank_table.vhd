-- crank_table : radius of the tip and its slope, from the position of the crank's
-- servo
--
--   n      = clamp(count, 0, COUNT_DEN / COUNT_NUM)
--   psi    = pi * n * COUNT_NUM / COUNT_DEN
--   root   = sqrt(ROD_LENGTH^2 - CRANK_LENGTH^2 * sin(psi)^2)
--   radius := round(OFFSET + CRANK_LENGTH*cos(psi) + root)
--   slope  := round(-CRANK_LENGTH*sin(psi) * (1 + CRANK_LENGTH*cos(psi)/root))
--
-- The slope is the derivative of the radius by psi; it is never positive. A table
-- has a word of each for every count of half a turn; counts beyond it read its ends.
-- COUNT_DEN / COUNT_NUM is the quotient of whole numbers.
--
-- generics LENGTH_WIDTH          bits of radius and slope, 4 to 24
--          LENGTH_FRAC           their fraction bits, at most 30
--          CRANK_LENGTH, ROD_LENGTH, OFFSET  in units of 2^-LENGTH_FRAC m: lengths of
--                                the crank and of the longer rod, distance from
--                                the centre to the crank's axis
--          COUNT_WIDTH           bits of the count
--          COUNT_NUM, COUNT_DEN  half turns of the crank per count, as a fraction
-- in       count  (1,COUNT_WIDTH-1,0)
-- out      radius (1,LENGTH_WIDTH-1-LENGTH_FRAC,LENGTH_FRAC) [m]
--          slope  (1,LENGTH_WIDTH-1-LENGTH_FRAC,LENGTH_FRAC) [m/rad]
-- latency  1 edge
-- reset    radius 0, slope 0
-- overflow none
-- source   Pediredla, Chandrasekaran, Annamraju, Thondiyath
-- differs from the hardware: the paper computes on a host; its device has no such
--          table.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity crank_table is
  generic (
    LENGTH_WIDTH : positive := 20;
    LENGTH_FRAC  : natural  := 22;
    CRANK_LENGTH : positive := 52429;
    ROD_LENGTH   : positive := 243270;
    OFFSET       : natural  := 0;
    COUNT_WIDTH  : positive := 11;
    COUNT_NUM    : positive := 5;
    COUNT_DEN    : positive := 3072
  );
  port (
    clk    : in  std_logic;
    rst    : in  std_logic;
    count  : in  std_logic_vector(COUNT_WIDTH - 1 downto 0);
    radius : out std_logic_vector(LENGTH_WIDTH - 1 downto 0);
    slope  : out std_logic_vector(LENGTH_WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of crank_table is

  constant LAST : positive := COUNT_DEN / COUNT_NUM;

  type table is array (0 to LAST) of std_logic_vector(LENGTH_WIDTH - 1 downto 0);

  -- The sine of an angle up to a quarter of a turn: the terms left out are below
  -- 2^-60.
  function sine(angle : real) return real is
    variable term : real := angle;
    variable sum  : real := 0.0;
  begin
    for n in 1 to 14 loop
      sum  := sum + term;
      term := -term * angle * angle / real(2 * n * (2 * n + 1));
    end loop;
    return sum;
  end function;

  -- Newton's method, from a value that is not too small.
  function square_root(square : real; first : real) return real is
    variable root : real := first;
  begin
    for n in 1 to 40 loop
      root := 0.5 * (root + square / root);
    end loop;
    return root;
  end function;

  -- The word of a count: its slope or its radius.
  function word(place : natural; is_slope : boolean) return std_logic_vector is
    constant QUARTER : real := 1.57079632679489661923;
    constant HALVES  : real := real(place * COUNT_NUM) / real(COUNT_DEN);
    constant PSI     : real := 2.0 * QUARTER * HALVES;
    constant L1      : real := real(CRANK_LENGTH);
    constant L2      : real := real(ROD_LENGTH);
    constant ALONG   : real := L1 * sine(QUARTER - PSI);
    variable across  : real;
    variable root    : real;
    variable value   : real;
  begin
    if PSI <= QUARTER then
      across := L1 * sine(PSI);
    else
      across := L1 * sine(2.0 * QUARTER - PSI);
    end if;
    root  := square_root(L2 * L2 - across * across, L2);
    value := real(OFFSET) + ALONG + root;
    if is_slope then
      value := -across * (1.0 + ALONG / root);
    end if;
    return std_logic_vector(to_signed(integer(value), LENGTH_WIDTH));
  end function;

  function fill(is_slope : boolean) return table is
    variable words : table;
  begin
    for i in words'range loop
      words(i) := word(i, is_slope);
    end loop;
    return words;
  end function;

  constant RADII  : table := fill(false);
  constant SLOPES : table := fill(true);

begin

  process (clk)
    variable index : natural range 0 to LAST;
  begin
    if rising_edge(clk) then
      if is_x(count) then
        radius <= (others => 'X');
        slope  <= (others => 'X');
      else
        index := 0;
        if count(count'high) = '0' then
          index := LAST;
          if unsigned(count) < LAST then
            index := to_integer(unsigned(count));
          end if;
        end if;
        radius <= RADII(index);
        slope  <= SLOPES(index);
      end if;

      if rst = '1' then
        radius <= (others => '0');
        slope  <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
