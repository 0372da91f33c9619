-- trig_cordic : sine and cosine of an encoder count, by rotations that only shift
-- and add
--
--   phase = count * STEP mod 2^PHASE_WIDTH                       2^PHASE_WIDTH a turn
--   z     = the upper 30 bits of phase, as two's complement
--   z >= 2^28 or z < -2^28, beyond a quarter of a turn: z moves by half a turn
--   (2^29) into it, flip
--
--   x = round(2^(TRIG_FRAC+GUARD) * prod 1/sqrt(1 + 2^-2i)), y = 0, prod over the
--   same i as the rotations
--   for i = 0 .. ITERATIONS-1, with d = 1 when z >= 0 and -1 when z < 0:
--     x, y, z = x - d*floor(y/2^i),  y + d*floor(x/2^i),  z - d*A(i)
--     A(i) = round(2^30 * atan(2^-i) / (2*pi))
--
--   sine := narrow(y, or -y when flip)    cosine: likewise x    valid := 1
--
-- All rotations lie between two registers. narrow drops the GUARD bits.
--
-- generics COUNT_WIDTH          bits of the count
--          ITERATIONS           rotations, at most 28
--          GUARD                bits below those of the result
--          PHASE_WIDTH          bits of the phase, at least 31
--          STEP                 phase of one count
--          TRIG_INT, TRIG_FRAC  format of the sines and cosines: TRIG_INT at
--                               least 1, TRIG_FRAC + GUARD at most 28
-- in       count  (1,COUNT_WIDTH-1,0)
-- out      sine   (1,TRIG_INT,TRIG_FRAC)
--          cosine (1,TRIG_INT,TRIG_FRAC)
--          valid  (0,1,0)
-- latency  1 edge
-- reset    sine 0, cosine 0, valid 0
-- overflow the phase wraps, as the angle does; x and y fit
--          (1,2,TRIG_FRAC+GUARD); narrowing rounds to nearest, ties up
-- source   Volder 1959; an alternative to the table of Sevcik et al. 2009
-- differs from the hardware: all rotations settle within one clock, so no limit
--          on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity trig_cordic is
  generic (
    COUNT_WIDTH : positive := 16;
    ITERATIONS  : positive := 24;
    GUARD       : natural  := 4;
    PHASE_WIDTH : positive := 40;
    STEP        : natural  := 39268273;
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

architecture rtl of trig_cordic is

  constant ANGLE_WIDTH : positive := 30;
  constant WIDTH       : positive := TRIG_FRAC + GUARD + 3;
  constant OUT_WIDTH   : positive := TRIG_INT + TRIG_FRAC + 1;

  -- atan(2^-i) in units of 2^-30 turns. The first is an eighth of a turn; the
  -- series of the others leaves out terms below 2^-60.
  function rotation(i : natural) return signed is
    constant TANGENT : real := 2.0**(-i);
    variable power   : real := TANGENT;
    variable sum     : real := 0.0;
  begin
    if i = 0 then
      return to_signed(2**27, ANGLE_WIDTH);
    end if;
    for n in 0 to 29 loop
      sum   := sum + power / real(2 * n + 1);
      power := -power * TANGENT * TANGENT;
    end loop;
    return to_signed(integer(sum * 2.0**29 / 3.14159265358979323846), ANGLE_WIDTH);
  end function;

  -- What the rotations stretch by, undone in advance: sqrt by Newton's method.
  function start return signed is
    variable square : real := 1.0;
    variable root   : real := 1.5;
  begin
    for i in 0 to ITERATIONS - 1 loop
      square := square * (1.0 + 4.0**(-i));
    end loop;
    for n in 1 to 6 loop
      root := 0.5 * (root + square / root);
    end loop;
    return to_signed(integer(2.0**(TRIG_FRAC + GUARD) / root), WIDTH);
  end function;

  type rotations is array (0 to ITERATIONS - 1) of signed(ANGLE_WIDTH - 1 downto 0);

  function fill return rotations is
    variable angles : rotations;
  begin
    for i in rotations'range loop
      angles(i) := rotation(i);
    end loop;
    return angles;
  end function;

  constant A : rotations := fill;
  constant K : signed(WIDTH - 1 downto 0) := start;

  -- Drops the GUARD bits, rounding to nearest, ties up.
  function narrow(value : signed(WIDTH - 1 downto 0)) return std_logic_vector is
    variable word : signed(WIDTH + OUT_WIDTH downto 0);
  begin
    word := resize(value, word'length);
    if GUARD > 0 then
      word := shift_right(word + 2**GUARD / 2, GUARD);
    end if;
    return std_logic_vector(word(OUT_WIDTH - 1 downto 0));
  end function;

begin

  process (clk)
    variable turned : signed(COUNT_WIDTH + PHASE_WIDTH + 31 downto 0);
    variable flip   : std_logic;
    variable x      : signed(WIDTH - 1 downto 0);
    variable y      : signed(WIDTH - 1 downto 0);
    variable z      : signed(ANGLE_WIDTH - 1 downto 0);
    variable last_x : signed(WIDTH - 1 downto 0);
  begin
    if rising_edge(clk) then
      if is_x(count) then
        sine   <= (others => 'X');
        cosine <= (others => 'X');
      else
        turned := resize(signed(count) * to_signed(STEP, 32), turned'length);
        z      := turned(PHASE_WIDTH - 1 downto PHASE_WIDTH - ANGLE_WIDTH);

        -- Half a turn more or less is the other sign bit: it becomes that of a
        -- word within a quarter of a turn.
        flip := z(z'high) xor z(z'high - 1);
        z(z'high) := z(z'high - 1);

        x := K;
        y := (others => '0');
        for i in 0 to ITERATIONS - 1 loop
          last_x := x;
          if z(z'high) = '0' then
            x := x - shift_right(y, i);
            y := y + shift_right(last_x, i);
            z := z - A(i);
          else
            x := x + shift_right(y, i);
            y := y - shift_right(last_x, i);
            z := z + A(i);
          end if;
        end loop;

        if flip = '1' then
          x := -x;
          y := -y;
        end if;
        sine   <= narrow(y);
        cosine <= narrow(x);
      end if;
      valid <= '1';

      if rst = '1' then
        sine   <= (others => '0');
        cosine <= (others => '0');
        valid  <= '0';
      end if;
    end if;
  end process;

end architecture;
