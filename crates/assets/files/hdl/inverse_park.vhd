-- inverse_park : a vector of the rotor, as the stator sees it
--
--   alpha = narrow(d*cosine - q*sine)
--   beta  = narrow(d*sine + q*cosine)
--
-- Each sum is exact and narrowed once. For sine and cosine as these words, alpha and beta
-- are off by at most 1/2 of their lowest bit.
--
-- generics WIDTH                bits of a vector's words, 2 to 32
--          TRIG_INT, TRIG_FRAC  format of sine and cosine: TRIG_INT at least 1,
--                               TRIG_FRAC 4 to 30
-- in       d, q (1,WIDTH-1,0)
--          sine, cosine (1,TRIG_INT,TRIG_FRAC)  of the rotor's electrical angle
-- out      alpha (1,WIDTH-1,0)   along phase a
--          beta  (1,WIDTH-1,0)   across phase a, a quarter of a turn ahead
-- latency  0, combinational
-- reset    none
-- overflow saturates; with an exact sine and cosine, no vector does that is at most
--          2^(WIDTH-1)-1 long; narrowing rounds to nearest, ties up
-- source   Park 1929
-- differs from the hardware: no propagation delay, so no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity inverse_park is
  generic (
    WIDTH     : positive := 16;
    TRIG_INT  : positive := 1;
    TRIG_FRAC : positive := 14
  );
  port (
    d      : in  std_logic_vector(WIDTH - 1 downto 0);
    q      : in  std_logic_vector(WIDTH - 1 downto 0);
    sine   : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    cosine : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    alpha  : out std_logic_vector(WIDTH - 1 downto 0);
    beta   : out std_logic_vector(WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of inverse_park is

  constant PRODUCT_WIDTH : positive := WIDTH + TRIG_INT + TRIG_FRAC + 1;
  -- Room for two products and one half.
  constant SUM_WIDTH     : positive := PRODUCT_WIDTH + 2;

  subtype product_word is signed(PRODUCT_WIDTH - 1 downto 0);
  subtype sum_word     is signed(SUM_WIDTH - 1 downto 0);

  constant HALF    : sum_word := shift_left(to_signed(1, SUM_WIDTH), TRIG_FRAC - 1);
  constant HIGHEST : signed(WIDTH - 1 downto 0) := '0' & (WIDTH - 2 downto 0 => '1');

  -- A value fits when it survives the way to WIDTH bits and back. Compared as plain
  -- vectors, so that an unknown value stays unknown.
  function narrow(sum : sum_word) return std_logic_vector is
    constant UP    : sum_word := sum + HALF;
    constant WHOLE : signed(SUM_WIDTH - TRIG_FRAC - 1 downto 0)
      := UP(SUM_WIDTH - 1 downto TRIG_FRAC);
    constant WORD  : signed(WIDTH - 1 downto 0) := WHOLE(WIDTH - 1 downto 0);
  begin
    if std_logic_vector(resize(WORD, WHOLE'length)) = std_logic_vector(WHOLE) then
      return std_logic_vector(WORD);
    elsif WHOLE(WHOLE'high) = '1' then
      return std_logic_vector(not HIGHEST);
    end if;
    return std_logic_vector(HIGHEST);
  end function;

  signal d_sine   : product_word;
  signal d_cosine : product_word;
  signal q_sine   : product_word;
  signal q_cosine : product_word;

begin

  d_sine   <= signed(d) * signed(sine);
  d_cosine <= signed(d) * signed(cosine);
  q_sine   <= signed(q) * signed(sine);
  q_cosine <= signed(q) * signed(cosine);

  alpha <= narrow(resize(d_cosine, SUM_WIDTH) - q_sine);
  beta  <= narrow(resize(d_sine, SUM_WIDTH) + q_cosine);

end architecture;
