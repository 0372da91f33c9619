-- cordic : length and angle of a vector, one rotation an edge
--
--   radius := hypot(x, y)    angle := atan2(y, x) in half turns
--
-- With start, x and y are shifted left by GUARD and turned by half a turn where
-- x < 0:
--   x, y, z = -x, -y, -1  when x < 0, else  x, y, 0
-- then for i = 0 .. ROTATIONS-1, with d = 1 when y >= 0 and -1 when y < 0:
--   x, y, z = x + d*floor(y/2^i),  y - d*floor(x/2^i),  z + d*A(i)
--   A(i) = round(2^(ANGLE_WIDTH-1+GUARD) * atan(2^-i) / pi)
-- z is in half turns, has GUARD more fraction bits than the angle, and wraps. At
-- the end, with C = round(2^(WIDTH+2) * prod 1/sqrt(1 + 2^-2i)), prod over the same
-- i as the rotations:
--   radius := floor(x*C / 2^(WIDTH+2+GUARD) + 1/2)
--   angle  := floor(z / 2^GUARD + 1/2)
-- For x = y = 0 both are 0. x and y in the rotations have WIDTH+GUARD+2 bits.
--
-- generics WIDTH        bits of x and y, 3 to 25
--          ANGLE_WIDTH  bits of the angle, 3 to 24
--          GUARD        bits below those of coordinates and angle, at most 7
--          ROTATIONS    at least 4, at most WIDTH+GUARD or 4
-- in       start  (0,1,0)              begins, gives up what is under way
--          x, y   (1,WIDTH-1,0)        read with start
-- out      radius (0,WIDTH,0)          in units of x and y
--          angle  (1,0,ANGLE_WIDTH-1)  [half turn]
--          busy   (0,1,0)  rotations are under way
--          ready  (0,1,0)  for one edge, together with new results
-- latency  ROTATIONS+1 edges from the edge with start to the edge that writes
--          radius and angle; a start on that edge too gives them up
-- reset    outputs 0, nothing under way
-- overflow none; an angle nearest to 1 wraps to -1, the same direction
-- source   Volder 1959, the vectoring mode
-- differs from the hardware: a design of this project, not of a paper. The
--          emulator computes the results at the start and shows them when they
--          are ready: the ports are exact at every edge, the registers within
--          are not modelled.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity cordic is
  generic (
    WIDTH       : positive := 21;
    ANGLE_WIDTH : positive := 20;
    GUARD       : natural  := 4;
    ROTATIONS   : positive := 20
  );
  port (
    clk    : in  std_logic;
    rst    : in  std_logic;
    start  : in  std_logic;
    x      : in  std_logic_vector(WIDTH - 1 downto 0);
    y      : in  std_logic_vector(WIDTH - 1 downto 0);
    radius : out std_logic_vector(WIDTH - 1 downto 0);
    angle  : out std_logic_vector(ANGLE_WIDTH - 1 downto 0);
    busy   : out std_logic;
    ready  : out std_logic
  );
end entity;

architecture rtl of cordic is

  constant LONG_WIDTH : positive := WIDTH + GUARD + 2;
  constant TURN_WIDTH : positive := ANGLE_WIDTH + GUARD;
  constant GAIN_WIDTH : positive := WIDTH + 3;
  constant DROP       : positive := WIDTH + 2 + GUARD;

  subtype coordinate is signed(LONG_WIDTH - 1 downto 0);
  subtype turn       is signed(TURN_WIDTH - 1 downto 0);

  -- atan(2^-i) in units of z. The first is a quarter of a half turn; the series
  -- of the others leaves out terms below 2^-60.
  function rotation(i : natural) return turn is
    constant TANGENT : real := 2.0**(-i);
    variable power   : real := TANGENT;
    variable sum     : real := 0.0;
  begin
    if i = 0 then
      return to_signed(integer(2.0**(TURN_WIDTH - 3)), TURN_WIDTH);
    end if;
    for n in 0 to 29 loop
      sum   := sum + power / real(2 * n + 1);
      power := -power * TANGENT * TANGENT;
    end loop;
    sum := sum * 2.0**(TURN_WIDTH - 1) / 3.14159265358979323846;
    return to_signed(integer(sum), TURN_WIDTH);
  end function;

  -- C, the inverse of what the rotations stretch by: sqrt by Newton's method.
  function shrinking return signed is
    variable square : real := 1.0;
    variable root   : real := 1.5;
  begin
    for i in 0 to ROTATIONS - 1 loop
      square := square * (1.0 + 4.0**(-i));
    end loop;
    for n in 1 to 6 loop
      root := 0.5 * (root + square / root);
    end loop;
    return to_signed(integer(2.0**(WIDTH + 2) / root), GAIN_WIDTH);
  end function;

  type rotation_words is array (0 to ROTATIONS - 1) of turn;

  function fill return rotation_words is
    variable words : rotation_words;
  begin
    for i in words'range loop
      words(i) := rotation(i);
    end loop;
    return words;
  end function;

  constant A : rotation_words                  := fill;
  constant C : signed(GAIN_WIDTH - 1 downto 0) := shrinking;

  -- x and its sign at the word's left, with GUARD bits at its right.
  function extended(word : std_logic_vector) return coordinate is
  begin
    return shift_left(resize(signed(word), LONG_WIDTH), GUARD);
  end function;

  -- floor(value / 2^i): a slice, because GHDL 2.0 writes shift_right into a Verilog
  -- netlist without the sign.
  function part(value : coordinate; i : natural) return coordinate is
  begin
    return resize(value(LONG_WIDTH - 1 downto i), LONG_WIDTH);
  end function;

begin

  process (clk)
    -- The edges to the results, 0 when nothing is under way.
    variable remaining : natural range 0 to ROTATIONS + 1;
    variable along     : coordinate;
    variable across    : coordinate;
    variable turned    : turn;
    variable is_zero   : std_logic;
    variable by_along  : coordinate;
    variable by_across : coordinate;
    variable by        : turn;
    variable product   : signed(LONG_WIDTH + GAIN_WIDTH - 1 downto 0);
    variable nearest   : signed(TURN_WIDTH downto 0);
  begin
    if rising_edge(clk) then
      ready <= '0';

      if start = '1' then
        is_zero := (nor x) and (nor y);
        along   := extended(x);
        across  := extended(y);
        turned  := (others => '0');
        if x(x'high) = '1' then
          along  := -along;
          across := -across;
          turned(turned'high) := '1';
        end if;
        remaining := ROTATIONS + 1;
        busy      <= '1';
      elsif remaining > 1 then
        by_along  := along;
        by_across := across;
        by        := A(0);
        for i in 1 to ROTATIONS - 1 loop
          if remaining = ROTATIONS + 1 - i then
            by_along  := part(along, i);
            by_across := part(across, i);
            by        := A(i);
          end if;
        end loop;

        if across(across'high) = '0' then
          along  := along + by_across;
          across := across - by_along;
          turned := turned + by;
        else
          along  := along - by_across;
          across := across + by_along;
          turned := turned - by;
        end if;
        remaining := remaining - 1;
      elsif remaining = 1 then
        product := along * C;
        product := product + shift_left(to_signed(1, product'length), DROP - 1);
        radius  <= std_logic_vector(product(DROP + WIDTH - 1 downto DROP));

        -- Half of the bits to drop is added where there are any.
        nearest := resize(turned, nearest'length) + 2**GUARD / 2;
        angle   <= std_logic_vector(nearest(TURN_WIDTH - 1 downto GUARD))
                   and not is_zero;

        remaining := 0;
        busy      <= '0';
        ready     <= '1';
      end if;

      if rst = '1' then
        radius    <= (others => '0');
        angle     <= (others => '0');
        busy      <= '0';
        ready     <= '0';
        remaining := 0;
      end if;
    end if;
  end process;

end architecture;
