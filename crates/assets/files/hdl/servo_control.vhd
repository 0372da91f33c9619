-- servo_control : position control of one servo
--
-- At the edge with sample number n, the first after a reset being 0:
--   measured := round(count * STEP / 2^STEP_FRAC)
--   e(n)     := desired - measured
--   d        := e(n) - e(max(n - WINDOW, 0))
--   drive    := saturate(round(proportional * e(n) + derivative * d))
--
-- The error is exact: desired is a word of half a turn at most, measured of less
-- than two half turns, and neither wraps, because a servo has stops. The sample
-- period and WINDOW are in the word of derivative. A first sample without a
-- derivative makes no leap of the drive; it sets all errors of the window to its
-- own. In a longer window, one count of a coarse sensor is a smaller part of the
-- drive.
--
-- generics ANGLE_WIDTH      bits of the desired angle
--          COUNT_WIDTH      bits of the servo's position word
--          STEP, STEP_FRAC  STEP / 2^STEP_FRAC LSBs of the angle per count; with
--                           any count less than two half turns
--          P_WIDTH, P_FRAC  bits of the gain of the error, its fraction
--          D_WIDTH, D_FRAC  bits of the gain of its change, its fraction
--          DRIVE_WIDTH      bits of the drive
--          WINDOW           samples over which the derivative is taken, 1 to 64
-- in       desired      (1,0,ANGLE_WIDTH-1)       half turns
--          count        (1,COUNT_WIDTH-1,0)
--          proportional (0,P_WIDTH-P_FRAC,P_FRAC) drive counts per half turn
--          derivative   (0,D_WIDTH-D_FRAC,D_FRAC) drive counts per half turn a
--                                                 window
--          sample       (0,1,0)                   the edge samples
-- out      drive        (1,DRIVE_WIDTH-1,0)
-- latency  1 edge, edges with sample only
-- reset    drive 0; the next sample has d = 0
-- overflow the drive saturates; both roundings are to nearest, ties up
-- source   Pediredla et al., the PD control of the three motors
-- differs from the hardware: the paper's controller runs in software and takes
--          the speed from the servo; this one differences the error. Both
--          products take one edge, so no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity servo_control is
  generic (
    ANGLE_WIDTH : positive := 20;
    COUNT_WIDTH : positive := 11;
    STEP        : positive := 873813;
    STEP_FRAC   : natural  := 10;
    P_WIDTH     : positive := 16;
    P_FRAC      : natural  := 4;
    D_WIDTH     : positive := 24;
    D_FRAC      : natural  := 0;
    DRIVE_WIDTH : positive := 11;
    WINDOW      : positive := 1
  );
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    desired      : in  std_logic_vector(ANGLE_WIDTH - 1 downto 0);
    count        : in  std_logic_vector(COUNT_WIDTH - 1 downto 0);
    proportional : in  std_logic_vector(P_WIDTH - 1 downto 0);
    derivative   : in  std_logic_vector(D_WIDTH - 1 downto 0);
    sample       : in  std_logic;
    drive        : out std_logic_vector(DRIVE_WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of servo_control is

  constant ERROR_WIDTH : positive := ANGLE_WIDTH + 2;
  constant SCALE_WIDTH : positive := COUNT_WIDTH + 32;
  constant FRAC        : natural  := maximum(P_FRAC, D_FRAC);
  constant DROP        : positive := FRAC + ANGLE_WIDTH - 1;

  -- Room for both products at the finer fraction, their sum, half an LSB and the
  -- bits of the drive.
  constant TOTAL_WIDTH : positive
    := maximum(maximum(P_WIDTH - P_FRAC, D_WIDTH - D_FRAC), DRIVE_WIDTH) + FRAC + ERROR_WIDTH + 4;

  subtype error_word is signed(ERROR_WIDTH - 1 downto 0);
  subtype total_word is signed(TOTAL_WIDTH - 1 downto 0);
  type history is array (1 to WINDOW) of error_word;

  constant HIGHEST : signed(DRIVE_WIDTH - 1 downto 0) := '0' & (DRIVE_WIDTH - 2 downto 0 => '1');

  -- The angle of a count, to the nearest, ties up.
  function angle(word : std_logic_vector) return error_word is
    constant HALF  : signed(SCALE_WIDTH - 1 downto 0) := to_signed(2**STEP_FRAC / 2, SCALE_WIDTH);
    constant TURNS : signed(SCALE_WIDTH - 1 downto 0) := signed(word) * to_signed(STEP, 32) + HALF;
  begin
    return resize(TURNS(SCALE_WIDTH - 1 downto STEP_FRAC), ERROR_WIDTH);
  end function;

  -- A gain times an error, at the finer fraction.
  function gained(gain : std_logic_vector; gain_frac : natural; value : signed) return total_word is
  begin
    return shift_left(resize(signed('0' & gain) * value, TOTAL_WIDTH), FRAC - gain_frac);
  end function;

  -- To the nearest, ties up. A value fits when it survives the way to DRIVE_WIDTH
  -- bits and back. Compared as plain vectors, so that an unknown value stays
  -- unknown.
  function narrowed(value : total_word) return std_logic_vector is
    constant HALF  : total_word := shift_left(to_signed(1, TOTAL_WIDTH), DROP - 1);
    constant SUM   : total_word := value + HALF;
    constant WHOLE : signed(TOTAL_WIDTH - DROP - 1 downto 0) := SUM(TOTAL_WIDTH - 1 downto DROP);
    constant WORD  : signed(DRIVE_WIDTH - 1 downto 0) := WHOLE(DRIVE_WIDTH - 1 downto 0);
  begin
    if std_logic_vector(resize(WORD, WHOLE'length)) = std_logic_vector(WHOLE) then
      return std_logic_vector(WORD);
    elsif SUM(SUM'high) = '1' then
      return std_logic_vector(not HIGHEST);
    end if;
    return std_logic_vector(HIGHEST);
  end function;

  -- The error j samples ago.
  signal before : history;
  -- An error before this one is known.
  signal primed : std_logic;
  signal e      : error_word;
  signal d      : signed(ERROR_WIDTH downto 0);
  signal pull   : total_word;
  signal drag   : total_word;

begin

  e    <= resize(signed(desired), ERROR_WIDTH) - angle(count);
  -- Gated instead of chosen, so that an unknown value stays unknown.
  d    <= signed(std_logic_vector(resize(e, ERROR_WIDTH + 1) - before(WINDOW)) and primed);
  pull <= gained(proportional, P_FRAC, e);
  drag <= gained(derivative, D_FRAC, d);

  process (clk)
  begin
    if rising_edge(clk) then
      if sample = '1' then
        drive  <= narrowed(pull + drag);
        primed <= '1';
        before(1) <= e;
        for j in 2 to WINDOW loop
          -- Gated instead of chosen, so that an unknown value stays unknown.
          before(j) <= signed((std_logic_vector(before(j - 1)) and primed)
                              or (std_logic_vector(e) and not primed));
        end loop;
      end if;

      if rst = '1' then
        before <= (others => (others => '0'));
        primed <= '0';
        drive  <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
