-- fractional_difference : fractional derivative with a finite memory, one product
--                         an edge
--
-- After an edge with sample at which nothing is under way:
--   y := saturate(round(gain * (w(0)*u + w(1)*u(-1) + .. + w(MEMORY-1)*u(1-MEMORY))))
-- where u(-k) is that k samples ago, and the sum is exact.
--
-- The weights are those of (1 - z)^a with a = ORDER_NUM / ORDER_DEN: w(0) = 1 and
-- w(k) = w(k-1) * (k-1-a)/k, as words of COEF_FRAC fraction bits:
--   m(0) := 2^(COEF_FRAC+10)
--   m(k) := floor(m(k-1) * |p| / q + 1/2)    p := (k-1)*ORDER_DEN - ORDER_NUM
--                                            q := k*ORDER_DEN
--   w(k) := floor(m(k) / 2^10 + 1/2)         negated when an odd number of the p
--                                            up to this one are negative
--
-- The oldest sample comes first. The memory turns by one place at every product,
-- so that always its last place is read, and is as before after all of them.
--
-- generics IN_INT, IN_FRAC        format of u
--          OUT_INT, OUT_FRAC      format of y; the integer bits of either may be
--                                 negative
--          GAIN_WIDTH, GAIN_FRAC  bits of the gain, its fraction
--          COEF_FRAC              fraction bits of the weights, 1 to 30
--          ORDER_NUM, ORDER_DEN   order of the derivative, above 0 and below 2;
--                                 ORDER_DEN is at most 1000
--          MEMORY                 samples that count, 2 to 254
-- in       u      (1,IN_INT,IN_FRAC)
--          gain   (0,GAIN_WIDTH-GAIN_FRAC,GAIN_FRAC)  sample period to the power of
--                                                     -a, read with the load of y
--          sample (0,1,0)                             the edge samples
-- out      y      (1,OUT_INT,OUT_FRAC)
-- latency  MEMORY+1 edges from the edge with sample to the edge that loads y;
--          samples up to and including that edge are passed over
-- reset    y 0, all earlier samples 0, nothing under way
-- overflow y saturates; rounds to nearest, ties up
-- source   Gruenwald and Letnikov; Podlubny 1999 for the finite memory
-- differs from the hardware: a design of this project; the paper makes its
--          reference offline. The emulator computes the sum at the sample: the
--          ports are exact at every edge, the registers within are not
--          modelled.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity fractional_difference is
  generic (
    IN_INT     : integer  := 7;
    IN_FRAC    : natural  := 8;
    OUT_INT    : integer  := 15;
    OUT_FRAC   : natural  := 8;
    GAIN_WIDTH : positive := 24;
    GAIN_FRAC  : natural  := 8;
    COEF_FRAC  : positive := 16;
    ORDER_NUM  : positive := 1;
    ORDER_DEN  : positive := 2;
    MEMORY     : positive range 2 to 254 := 16
  );
  port (
    clk    : in  std_logic;
    rst    : in  std_logic;
    u      : in  std_logic_vector(IN_INT + IN_FRAC downto 0);
    gain   : in  std_logic_vector(GAIN_WIDTH - 1 downto 0);
    sample : in  std_logic;
    y      : out std_logic_vector(OUT_INT + OUT_FRAC downto 0)
  );
end entity;

architecture rtl of fractional_difference is

  constant IN_WIDTH   : positive := IN_INT + IN_FRAC + 1;
  constant OUT_WIDTH  : positive := OUT_INT + OUT_FRAC + 1;
  -- The weights add up to less than 8 in magnitude.
  constant SUM_WIDTH  : positive := IN_WIDTH + COEF_FRAC + 3;
  constant DROP       : natural  := IN_FRAC + COEF_FRAC + GAIN_FRAC - OUT_FRAC;
  constant FULL_WIDTH : positive := SUM_WIDTH + GAIN_WIDTH + 2 + OUT_WIDTH;

  -- Fraction bits of the recursion beyond those of a weight.
  constant GUARD      : positive := 10;

  -- The values of `remaining`, up to all ones.
  function ones(most : positive) return positive is
    variable all_ones : positive := 1;
  begin
    while all_ones < most loop
      all_ones := 2 * all_ones + 1;
    end loop;
    return all_ones;
  end function;

  constant LAST : positive := ones(MEMORY + 1);

  subtype in_word     is signed(IN_WIDTH - 1 downto 0);
  subtype sum_word    is signed(SUM_WIDTH - 1 downto 0);
  subtype full_word   is signed(FULL_WIDTH - 1 downto 0);
  subtype weight_word is signed(COEF_FRAC + 1 downto 0);
  subtype magnitude   is unsigned(COEF_FRAC + GUARD + 1 downto 0);
  type table          is array (0 to LAST) of weight_word;
  type history        is array (0 to MEMORY - 1) of in_word;

  constant HIGHEST : signed(OUT_WIDTH - 1 downto 0) := '0' & (OUT_WIDTH - 2 downto 0 => '1');

  -- floor(value * p / q + 1/2), by long division: every bit of the value brings p
  -- into the rest, which q leaves as often as it can.
  function scaled(value : magnitude; p, q : natural) return magnitude is
    variable quotient : magnitude := (others => '0');
    variable rest     : natural   := 0;
  begin
    for i in value'range loop
      quotient := quotient(quotient'high - 1 downto 0) & '0';
      rest     := 2 * rest;
      if value(i) = '1' then
        rest := rest + p;
      end if;
      while rest >= q loop
        quotient := quotient + 1;
        rest     := rest - q;
      end loop;
    end loop;
    if 2 * rest >= q then
      quotient := quotient + 1;
    end if;
    return quotient;
  end function;

  -- At the address `remaining`: the weight of the present sample at 2.
  function weights return table is
    variable words    : table     := (others => (others => '0'));
    variable m        : magnitude := (others => '0');
    variable half     : magnitude := (others => '0');
    variable near     : magnitude;
    variable negative : boolean   := false;
    variable p        : integer;
  begin
    m(COEF_FRAC + GUARD) := '1';
    half(GUARD - 1)      := '1';
    for k in 0 to MEMORY - 1 loop
      if k > 0 then
        p := (k - 1) * ORDER_DEN - ORDER_NUM;
        if p < 0 then
          negative := not negative;
          p        := -p;
        end if;
        m := scaled(m, p, k * ORDER_DEN);
      end if;
      near         := m + half;
      words(k + 2) := signed(near(magnitude'high downto GUARD));
      if negative then
        words(k + 2) := -words(k + 2);
      end if;
    end loop;
    return words;
  end function;

  constant WEIGHT_OF : table := weights;

  -- Drops DROP bits, rounding to nearest, ties up. Of no bits there is no half.
  function rounded(value : full_word) return signed is
    constant ONE   : full_word := to_signed(1, FULL_WIDTH);
    variable total : full_word;
  begin
    total := value;
    if DROP > 0 then
      total := total + shift_left(ONE, DROP - 1);
    end if;
    return total(FULL_WIDTH - 1 downto DROP);
  end function;

  -- A value fits when it survives the way to OUT_WIDTH bits and back. Compared as
  -- plain vectors, so that an unknown value stays unknown.
  function saturate(value : signed) return std_logic_vector is
    constant WORD : signed(OUT_WIDTH - 1 downto 0) := resize(value, OUT_WIDTH);
    constant BACK : signed(value'length - 1 downto 0) := resize(WORD, value'length);
  begin
    if std_logic_vector(BACK) = std_logic_vector(value) then
      return std_logic_vector(WORD);
    elsif value(value'high) = '1' then
      return std_logic_vector(not HIGHEST);
    end if;
    return std_logic_vector(HIGHEST);
  end function;

begin

  process (clk)
    -- 0: nothing is under way; 1: the next edge loads y; k + 2: it adds the product
    -- with weight k.
    variable remaining : natural range 0 to LAST;
    variable earlier   : history;
    variable sum       : sum_word;
    variable term      : signed(IN_WIDTH + COEF_FRAC + 1 downto 0);
  begin
    if rising_edge(clk) then
      if remaining > 1 then
        term      := earlier(MEMORY - 1) * WEIGHT_OF(remaining);
        sum       := sum + term;
        earlier   := earlier(MEMORY - 1) & earlier(0 to MEMORY - 2);
        remaining := remaining - 1;
      elsif remaining = 1 then
        y         <= saturate(rounded(resize(sum * signed('0' & gain), FULL_WIDTH)));
        remaining := 0;
      elsif sample = '1' then
        earlier   := signed(u) & earlier(0 to MEMORY - 2);
        sum       := (others => '0');
        remaining := MEMORY + 1;
      end if;

      if rst = '1' then
        remaining := 0;
        earlier   := (others => (others => '0'));
        sum       := (others => '0');
        y         <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
