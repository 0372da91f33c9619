-- cube_room : virtual walls around the tip, a pair to each axis
--
-- For each axis, here x:
--   depth   = x - x_high  when x > x_high
--             x - x_low   when x < x_low, and not x > x_high
--             0           otherwise
--   force_x = clamp(narrow(-(stiffness * depth)), -FORCE_LIMIT, +FORCE_LIMIT)
--             when room(0), else 0
--   contact(0) = 1 when beyond a wall and room(0), else 0
--
-- The depth is exact, one bit wider than a position; the exact product is
-- negated, rounded to FORCE_FRAC, and clamped then.
--
-- generics POSITION_INT, POSITION_FRAC    format of the positions
--          STIFFNESS_INT, STIFFNESS_FRAC  format of the stiffness
--          FORCE_INT, FORCE_FRAC          format of the forces
--          FORCE_LIMIT                    largest force, a word of that format
-- in       x, y, z                 (1,POSITION_INT,POSITION_FRAC) [m] the tip
--          x_low, x_high, y_low, y_high, z_low, z_high
--                                  (1,POSITION_INT,POSITION_FRAC) [m] the walls
--          room      (0,3,0)       the pairs that are there: bit 0 x, 1 y, 2 z
--          stiffness (0,STIFFNESS_INT,STIFFNESS_FRAC) [N/m]
-- out      force_x, force_y, force_z (1,FORCE_INT,FORCE_FRAC) [N] on the tip
--          contact   (0,3,0)       the axes beyond a wall: bit 0 x, 1 y, 2 z
-- latency  0, combinational
-- reset    none
-- overflow forces clamp to +-FORCE_LIMIT; rounds to nearest, ties up
-- source   Sevcik et al. 2009, the virtual walls of the drop test
-- differs from the hardware: no propagation delay, so no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity cube_room is
  generic (
    POSITION_INT   : natural  := 0;
    POSITION_FRAC  : natural  := 24;
    STIFFNESS_INT  : natural  := 16;
    STIFFNESS_FRAC : natural  := 2;
    FORCE_INT      : natural  := 4;
    FORCE_FRAC     : natural  := 16;
    FORCE_LIMIT    : positive := 557056
  );
  port (
    x         : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    y         : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    z         : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    x_low     : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    x_high    : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    y_low     : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    y_high    : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    z_low     : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    z_high    : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    room      : in  std_logic_vector(2 downto 0);
    stiffness : in  std_logic_vector(STIFFNESS_INT + STIFFNESS_FRAC - 1 downto 0);
    force_x   : out std_logic_vector(FORCE_INT + FORCE_FRAC downto 0);
    force_y   : out std_logic_vector(FORCE_INT + FORCE_FRAC downto 0);
    force_z   : out std_logic_vector(FORCE_INT + FORCE_FRAC downto 0);
    contact   : out std_logic_vector(2 downto 0)
  );
end entity;

architecture rtl of cube_room is

  constant POSITION_WIDTH  : positive := POSITION_INT + POSITION_FRAC + 1;
  constant STIFFNESS_WIDTH : positive := STIFFNESS_INT + STIFFNESS_FRAC;
  constant FORCE_WIDTH     : positive := FORCE_INT + FORCE_FRAC + 1;

  constant DROP : integer := STIFFNESS_FRAC + POSITION_FRAC - FORCE_FRAC;

  -- Bits of a rounded force before it is clamped: none is lost, and the limit
  -- fits with one to spare.
  constant FULL_WIDTH : positive := STIFFNESS_WIDTH + POSITION_WIDTH + FORCE_WIDTH + 3;
  constant LIMIT      : signed(FULL_WIDTH - 1 downto 0) := to_signed(FORCE_LIMIT, FULL_WIDTH);

  -- a > b, as the sign of b - a, so that an unknown word gives an unknown answer.
  function exceeds(a, b : std_logic_vector) return std_logic is
    constant DIFFERENCE : signed(a'length downto 0)
      := resize(signed(b), a'length + 1) - signed(a);
  begin
    return DIFFERENCE(DIFFERENCE'high);
  end function;

  -- How far beyond which wall: positive beyond the high one, negative beyond the
  -- low one. Gated instead of chosen, for the unknown words again.
  function depth(position, low, high : std_logic_vector) return signed is
    constant WIDE       : signed(POSITION_WIDTH downto 0)
      := resize(signed(position), POSITION_WIDTH + 1);
    constant OVER_HIGH  : std_logic_vector(WIDE'range) := std_logic_vector(WIDE - signed(high));
    constant OVER_LOW   : std_logic_vector(WIDE'range) := std_logic_vector(WIDE - signed(low));
    constant BEYOND_TOP : std_logic := exceeds(position, high);
    constant BEYOND_LOW : std_logic := exceeds(low, position) and not BEYOND_TOP;
  begin
    return signed((OVER_HIGH and BEYOND_TOP) or (OVER_LOW and BEYOND_LOW));
  end function;

  -- Drops DROP bits (appends, when negative), rounding to nearest, ties up.
  function rounded(value : signed) return signed is
    variable word : signed(FULL_WIDTH + abs DROP downto 0);
  begin
    word := resize(value, word'length);
    if DROP > 0 then
      word := shift_right(word + shift_left(to_signed(1, word'length), DROP - 1), DROP);
    else
      word := shift_left(word, -DROP);
    end if;
    return word(FULL_WIDTH - 1 downto 0);
  end function;

  -- An unknown value has no sign beyond either limit, and passes unknown.
  function clamp(value : signed) return signed is
    constant ABOVE : signed(FULL_WIDTH - 1 downto 0) := LIMIT - value;
    constant BELOW : signed(FULL_WIDTH - 1 downto 0) := LIMIT + value;
  begin
    if ABOVE(ABOVE'high) = '1' then
      return resize(LIMIT, FORCE_WIDTH);
    elsif BELOW(BELOW'high) = '1' then
      return resize(-LIMIT, FORCE_WIDTH);
    end if;
    return resize(value, FORCE_WIDTH);
  end function;

  function push(distance : signed; stiff : std_logic_vector; there : std_logic)
    return std_logic_vector is
  begin
    return std_logic_vector(clamp(rounded(-(signed('0' & stiff) * distance)))) and there;
  end function;

  signal depth_x : signed(POSITION_WIDTH downto 0);
  signal depth_y : signed(POSITION_WIDTH downto 0);
  signal depth_z : signed(POSITION_WIDTH downto 0);

begin

  depth_x <= depth(x, x_low, x_high);
  depth_y <= depth(y, y_low, y_high);
  depth_z <= depth(z, z_low, z_high);

  force_x <= push(depth_x, stiffness, room(0));
  force_y <= push(depth_y, stiffness, room(1));
  force_z <= push(depth_z, stiffness, room(2));

  contact(0) <= room(0) and (exceeds(x, x_high) or exceeds(x_low, x));
  contact(1) <= room(1) and (exceeds(y, y_high) or exceeds(y_low, y));
  contact(2) <= room(2) and (exceeds(z, z_high) or exceeds(z_low, z));

end architecture;
