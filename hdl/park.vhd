-- park : a vector of the stator, as the rotor sees it
--
--   d = narrow(alpha*cosine + beta*sine)
--   q = narrow(beta*cosine - alpha*sine)
--
-- Each sum is exact and narrowed once. For sine and cosine as these words, d and q
-- are off by at most 1/2 of their lowest bit.
--
-- generics WIDTH                bits of a vector's words, 2 to 32
--          TRIG_INT, TRIG_FRAC  format of sine and cosine: TRIG_INT at least 1,
--                               TRIG_FRAC 4 to 30
-- in       alpha, beta (1,WIDTH-1,0)
--          sine, cosine (1,TRIG_INT,TRIG_FRAC)  of the rotor's electrical angle
-- out      d (1,WIDTH-1,0)   along the rotor's flux
--          q (1,WIDTH-1,0)   across the rotor's flux, a quarter of a turn ahead
-- latency  0, combinational
-- reset    none
-- overflow saturates; with an exact sine and cosine, no vector does that is at most
--          2^(WIDTH-1)-1 long; narrowing rounds to nearest, ties up
-- source   Park 1929
-- differs from the hardware: no propagation delay, so no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity park is
  generic (
    WIDTH     : positive := 16;
    TRIG_INT  : positive := 1;
    TRIG_FRAC : positive := 14
  );
  port (
    alpha  : in  std_logic_vector(WIDTH - 1 downto 0);
    beta   : in  std_logic_vector(WIDTH - 1 downto 0);
    sine   : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    cosine : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    d      : out std_logic_vector(WIDTH - 1 downto 0);
    q      : out std_logic_vector(WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of park is

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

  signal alpha_sine   : product_word;
  signal alpha_cosine : product_word;
  signal beta_sine    : product_word;
  signal beta_cosine  : product_word;

begin

  alpha_sine   <= signed(alpha) * signed(sine);
  alpha_cosine <= signed(alpha) * signed(cosine);
  beta_sine    <= signed(beta) * signed(sine);
  beta_cosine  <= signed(beta) * signed(cosine);

  d <= narrow(resize(alpha_cosine, SUM_WIDTH) + beta_sine);
  q <= narrow(resize(beta_cosine, SUM_WIDTH) - alpha_sine);

end architecture;
