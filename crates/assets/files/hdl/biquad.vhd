-- biquad : second-order section, sampled with a programmable period
--
-- At a sample edge, in direct form I:
--   y(k) := saturate(round(B0 x(k) + B1 x(k-1) + B2 x(k-2) - A1 y(k-1) - A2 y(k-2)))
--
-- The sum is exact and rounded once; what comes back is the word that left.
--
-- generics IN_INT, IN_FRAC        format of the input
--          OUT_INT, OUT_FRAC      format of the output
--          COEF_INT, COEF_FRAC    format of the coefficients, at most 32 bits
--          B0, B1, B2, A1, A2     coefficients, words of (1,COEF_INT,COEF_FRAC)
--          PERIOD_WIDTH           bits of the period, 2 to 30
--          ROUNDING               how y is rounded, of rounding_pkg; 2 is to the nearest,
--                                 ties up
-- in       x      (1,IN_INT,IN_FRAC)
--          period (0,PERIOD_WIDTH,0)   sample period in clocks, 0 acts as 1
-- out      y      (1,OUT_INT,OUT_FRAC)
-- latency  1 edge, sample edges only; a new period takes effect at the next
--          sample edge
-- reset    y 0, all earlier samples 0; the first edge after it is a sample edge
-- overflow saturates; rounds as ROUNDING says
-- source   the second-order section of every textbook
-- differs from the hardware: five products and their sum take one edge, so no
--          limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.rounding_pkg.all;

entity biquad is
  generic (
    IN_INT       : natural  := 12;
    IN_FRAC      : natural  := 4;
    OUT_INT      : natural  := 14;
    OUT_FRAC     : natural  := 8;
    COEF_INT     : natural  := 2;
    COEF_FRAC    : natural  := 16;
    B0           : integer  := 65536;
    B1           : integer  := 0;
    B2           : integer  := 0;
    A1           : integer  := 0;
    A2           : integer  := 0;
    PERIOD_WIDTH : positive range 2 to 30 := 24;
    ROUNDING     : rounding_mode := NEAREST_UP
  );
  port (
    clk    : in  std_logic;
    rst    : in  std_logic;
    x      : in  std_logic_vector(IN_INT + IN_FRAC downto 0);
    period : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    y      : out std_logic_vector(OUT_INT + OUT_FRAC downto 0)
  );
end entity;

architecture rtl of biquad is

  -- Samples of the input and of the output are aligned to the finer of the two.
  constant FRAC         : natural  := maximum(IN_FRAC, OUT_FRAC);
  constant DROP         : natural  := FRAC + COEF_FRAC - OUT_FRAC;
  constant SAMPLE_WIDTH : positive := maximum(IN_INT, OUT_INT) + FRAC + 1;
  constant COEF_WIDTH   : positive := COEF_INT + COEF_FRAC + 1;
  constant OUT_WIDTH    : positive := OUT_INT + OUT_FRAC + 1;

  -- Room for the magnitude of a coefficient: GHDL 2.0 writes no constant factor of
  -- more than 32 bits into a netlist, so that the lowest integer has none.
  constant FACTOR_WIDTH : positive := minimum(COEF_WIDTH + 1, 32);

  -- Room for five products and half an LSB of the output.
  constant TOTAL_WIDTH  : positive := SAMPLE_WIDTH + COEF_WIDTH + 2;

  subtype sample_word is signed(SAMPLE_WIDTH - 1 downto 0);
  subtype total_word  is signed(TOTAL_WIDTH - 1 downto 0);
  subtype out_word    is signed(OUT_WIDTH - 1 downto 0);

  constant HIGHEST : out_word := not shift_left(to_signed(-1, OUT_WIDTH), OUT_WIDTH - 1);

  function aligned(word : std_logic_vector; word_frac : natural) return sample_word is
  begin
    return shift_left(resize(signed(word), SAMPLE_WIDTH), FRAC - word_frac);
  end function;

  -- By the magnitude: GHDL 2.0 writes a negative constant factor wrongly into a
  -- netlist when the product has more than 32 bits.
  function product(coefficient : integer; sample : sample_word) return total_word is
    constant WORD : signed(FACTOR_WIDTH - 1 downto 0) := to_signed(coefficient, FACTOR_WIDTH);
  begin
    if coefficient = integer'low then
      return -shift_left(resize(sample, TOTAL_WIDTH), 31);
    elsif coefficient < 0 then
      return -resize((-WORD) * sample, TOTAL_WIDTH);
    end if;
    return resize(WORD * sample, TOTAL_WIDTH);
  end function;

  -- A value fits when it survives the way to OUT_WIDTH bits and back. Compared
  -- as plain vectors, so that an unknown value stays unknown.
  function saturate(value : total_word) return std_logic_vector is
    constant WORD : out_word   := resize(value, OUT_WIDTH);
    constant BACK : total_word := resize(WORD, TOTAL_WIDTH);
  begin
    if std_logic_vector(BACK) = std_logic_vector(value) then
      return std_logic_vector(WORD);
    elsif value(value'high) = '1' then
      return std_logic_vector(not HIGHEST);
    end if;
    return std_logic_vector(HIGHEST);
  end function;

  signal x0, x1, x2, y1, y2 : sample_word;
  signal p0, p1, p2, q1, q2 : total_word;
  signal word               : std_logic_vector(OUT_WIDTH - 1 downto 0);

begin

  x0 <= aligned(x, IN_FRAC);

  p0 <= product(B0, x0);
  p1 <= product(B1, x1);
  p2 <= product(B2, x2);
  q1 <= product(A1, y1);
  q2 <= product(A2, y2);

  word <= saturate(rounded(p0 + p1 + p2 - q1 - q2, DROP, ROUNDING));

  process (clk)
    -- 2^PERIOD_WIDTH - 2, written to stay inside an integer for 31 bits.
    variable countdown : natural range 0 to 2 * (2**(PERIOD_WIDTH - 1) - 1);
  begin
    if rising_edge(clk) then
      if countdown = 0 then
        x1 <= x0;
        x2 <= x1;
        y1 <= aligned(word, OUT_FRAC);
        y2 <= y1;
        y  <= word;

        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        countdown := countdown - 1;
      end if;

      if rst = '1' then
        countdown := 0;
        x1        <= (others => '0');
        x2        <= (others => '0');
        y1        <= (others => '0');
        y2        <= (others => '0');
        y         <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
