-- phantom_forward : forward kinematics of the PHANToM
--
--   radius = narrow(L1*cosine2 + L2*sine3)
--   x      = narrow(sine1*radius)
--   y      = narrow(L2 - L2*cosine3 + L1*sine2)
--   z      = narrow(cosine1*radius - L1)
--
-- y points up, the origin is the tip at the neutral pose; joint 1 turns about
-- the vertical, joints 2 and 3 are the absolute angles of the two links. Each
-- sum is exact and narrowed once; x and z take the narrowed radius.
--
-- generics TRIG_INT, TRIG_FRAC          format of the sines and cosines
--          LENGTH_FRAC                  fraction bits of the lengths, at most 30
--          LENGTH_1, LENGTH_2           L1, L2 in units of 2^-LENGTH_FRAC m
--          POSITION_INT, POSITION_FRAC  format of the position
-- in       sine1, cosine1, sine2, cosine2, sine3, cosine3 (1,TRIG_INT,TRIG_FRAC)
-- out      x, y, z, radius (1,POSITION_INT,POSITION_FRAC) [m]
-- latency  0, combinational
-- reset    none
-- overflow wraps; narrowing rounds to nearest, ties up
-- source   Sevcik et al. 2009; kinematics after Cavusoglu et al. 2002
-- differs from the hardware: no propagation delay, so no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity phantom_forward is
  generic (
    TRIG_INT      : natural  := 9;
    TRIG_FRAC     : natural  := 22;
    LENGTH_FRAC   : natural  := 24;
    LENGTH_1      : positive := 2348810;
    LENGTH_2      : positive := 2348810;
    POSITION_INT  : natural  := 0;
    POSITION_FRAC : natural  := 24
  );
  port (
    sine1   : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    cosine1 : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    sine2   : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    cosine2 : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    sine3   : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    cosine3 : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    x       : out std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    y       : out std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    z       : out std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    radius  : out std_logic_vector(POSITION_INT + POSITION_FRAC downto 0)
  );
end entity;

architecture rtl of phantom_forward is

  constant TRIG_WIDTH     : positive := TRIG_INT + TRIG_FRAC + 1;
  constant POSITION_WIDTH : positive := POSITION_INT + POSITION_FRAC + 1;

  -- Fraction bits of a length times a sine, and of all that is added up in z.
  constant SUM_FRAC : natural := LENGTH_FRAC + TRIG_FRAC;
  constant Z_FRAC   : natural := maximum(TRIG_FRAC + POSITION_FRAC, LENGTH_FRAC);

  constant SUM_WIDTH : positive := 32 + TRIG_WIDTH + 2;
  constant Z_WIDTH   : positive := 32 + TRIG_WIDTH + POSITION_WIDTH + LENGTH_FRAC;

  constant L1 : signed(31 downto 0) := to_signed(LENGTH_1, 32);
  constant L2 : signed(31 downto 0) := to_signed(LENGTH_2, 32);

  -- Drops `drop` bits (appends, when negative), rounding to nearest, ties up,
  -- and keeps the lower `width` bits.
  function narrow(value : signed; drop : integer; width : positive) return signed is
    variable word : signed(value'length + abs drop + width downto 0);
  begin
    word := resize(value, word'length);
    if drop > 0 then
      word := shift_right(word + shift_left(to_signed(1, word'length), drop - 1), drop);
    else
      word := shift_left(word, -drop);
    end if;
    return word(width - 1 downto 0);
  end function;

  signal r      : signed(POSITION_WIDTH - 1 downto 0);
  signal height : signed(SUM_WIDTH - 1 downto 0);
  signal reach  : signed(Z_WIDTH - 1 downto 0);

begin

  r <= narrow(resize(L1 * signed(cosine2), SUM_WIDTH) + L2 * signed(sine3),
              SUM_FRAC - POSITION_FRAC, POSITION_WIDTH);

  height <= shift_left(resize(L2, SUM_WIDTH), TRIG_FRAC)
            - L2 * signed(cosine3) + L1 * signed(sine2);

  reach <= shift_left(resize(signed(cosine1) * r, Z_WIDTH), Z_FRAC - TRIG_FRAC - POSITION_FRAC)
           - shift_left(resize(L1, Z_WIDTH), Z_FRAC - LENGTH_FRAC);

  radius <= std_logic_vector(r);
  x      <= std_logic_vector(narrow(signed(sine1) * r, TRIG_FRAC, POSITION_WIDTH));
  y      <= std_logic_vector(narrow(height, SUM_FRAC - POSITION_FRAC, POSITION_WIDTH));
  z      <= std_logic_vector(narrow(reach, Z_FRAC - POSITION_FRAC, POSITION_WIDTH));

end architecture;
