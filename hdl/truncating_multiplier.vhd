-- truncating_multiplier : one-step product of two words, cut to a chosen width
--
--   product = narrow(rounded(a * b / 2^DROP_LOWER)) to OUT_WIDTH bits
--
-- The full product has A_WIDTH + B_WIDTH bits and is signed when either factor
-- is. Four uses:
--   full product      OUT_WIDTH = A_WIDTH + B_WIDTH, DROP_LOWER = 0
--   drop upper bits   DROP_LOWER = 0, not SATURATE: the paper's truncation
--   drop lower bits   DROP_LOWER = A_WIDTH + B_WIDTH - OUT_WIDTH
--   fixed point       DROP_LOWER = fraction bits to lose, SATURATE
--
-- generics A_WIDTH, B_WIDTH    bits of the factors
--          A_SIGNED, B_SIGNED  how each factor is read
--          DROP_LOWER          bits to lose at the bottom
--          OUT_WIDTH           bits of the result; a longer word than is left
--                              is sign or zero extended
--          SATURATE            clamp to the range of the result, or else wrap
--          ROUNDING            how they are lost, of rounding_pkg; 0 truncates, towards
--                              -infinity
-- in       a        A_WIDTH bits, (1,A_WIDTH-1,0) or (0,A_WIDTH,0)
--          b        B_WIDTH bits, (1,B_WIDTH-1,0) or (0,B_WIDTH,0)
-- out      product  OUT_WIDTH bits, signed when either factor is
-- latency  0, combinational
-- reset    none
-- overflow SATURATE: clamped; otherwise the upper bits are dropped
-- source   Vasudevan et al. 2007, the one-step multiplier and its truncation
-- differs from the hardware: no propagation delay, so no limit on the clock;
--          the product of the paper, whose device had no multiplier blocks,
--          ripples. SATURATE and ROUNDING are additions, the paper's multiplier
--          drops upper bits.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.rounding_pkg.all;

entity truncating_multiplier is
  generic (
    A_WIDTH    : positive := 12;
    B_WIDTH    : positive := 12;
    A_SIGNED   : boolean  := false;
    B_SIGNED   : boolean  := false;
    DROP_LOWER : natural  := 0;
    OUT_WIDTH  : positive := 12;
    SATURATE   : boolean  := true;
    ROUNDING   : rounding_mode := TRUNCATE
  );
  port (
    a       : in  std_logic_vector(A_WIDTH - 1 downto 0);
    b       : in  std_logic_vector(B_WIDTH - 1 downto 0);
    product : out std_logic_vector(OUT_WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of truncating_multiplier is

  constant FULL_WIDTH : positive := A_WIDTH + B_WIDTH + 2;

  -- An unsigned result is handled as a signed word whose sign bit is 0.
  constant SIGN_BIT   : natural  := boolean'pos(not (A_SIGNED or B_SIGNED));
  constant HIGHEST    : signed(OUT_WIDTH + SIGN_BIT - 1 downto 0)
    := '0' & (OUT_WIDTH + SIGN_BIT - 2 downto 0 => '1');

  -- Every factor as a signed word: one bit more holds either reading.
  function extend(word : std_logic_vector; is_signed : boolean) return signed is
  begin
    if is_signed then
      return resize(signed(word), word'length + 1);
    end if;
    return signed('0' & word);
  end function;

  -- A value fits when it survives the way to the result's bits and back. Compared
  -- as plain vectors, so that an unknown value stays unknown. The sign is read
  -- from the value: numeric_std's narrowing keeps it, GHDL 2.0's synthesis of
  -- that narrowing does not.
  function clamp(value : signed) return signed is
    constant WORD : signed(HIGHEST'range) := resize(value, HIGHEST'length);
    constant BACK : signed(value'length - 1 downto 0) := resize(WORD, value'length);
  begin
    if std_logic_vector(BACK) = std_logic_vector(value) then
      return value;
    elsif value(value'high) = '1' then
      return resize(not HIGHEST, value'length);
    end if;
    return resize(HIGHEST, value'length);
  end function;

begin

  process (all)
    variable full : signed(FULL_WIDTH - 1 downto 0);
    -- Wide enough to be cut or extended by taking its lower OUT_WIDTH bits;
    -- numeric_std's own narrowing would keep the sign bit instead.
    variable word : signed(maximum(FULL_WIDTH, OUT_WIDTH + 1) - 1 downto 0);
  begin
    full := extend(a, A_SIGNED) * extend(b, B_SIGNED);
    word := resize(rounded(full, DROP_LOWER, ROUNDING), word'length);

    if SATURATE then
      word := clamp(word);
    end if;
    product <= std_logic_vector(word(OUT_WIDTH - 1 downto 0));
  end process;

end architecture;
