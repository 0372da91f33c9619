-- command_limiter : the actuator's full scale, and the clocks of the way to it
--
--   limited = clamp(value, -LIMIT, +LIMIT), behind SETTLING registers in a row
--
-- generics IN_WIDTH, OUT_WIDTH         bits of the words
--          LIMIT                       full scale, less than 2^(OUT_WIDTH-1)
--          SETTLING                    registers in a row behind the limiter, at
--                                      most 64; 0: none
-- in       value   (1,IN_WIDTH-1,0)
-- out      limited (1,OUT_WIDTH-1,0)
-- latency  SETTLING edges; 0 is combinational
-- reset    synchronous, all registers 0
-- overflow clamped, the same on both sides: the most negative word of the
--          output is not used
-- source   Vasudevan et al. 2007, Eq. (8); the row is common practice where the
--          logic before it takes longer than a clock
-- differs from the hardware: SETTLING = 0 has no propagation delay. Otherwise
--          synthesis may move the registers into the logic before them, which
--          shows only at the first edges after a reset. A design that declares
--          a path of several clocks instead of registering it shows
--          intermediate words meanwhile, this one never.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity command_limiter is
  generic (
    IN_WIDTH  : positive := 14;
    OUT_WIDTH : positive := 13;
    LIMIT     : natural  := 4095;
    SETTLING  : natural  := 0
  );
  port (
    clk     : in  std_logic;
    rst     : in  std_logic;
    value   : in  std_logic_vector(IN_WIDTH - 1 downto 0);
    limited : out std_logic_vector(OUT_WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of command_limiter is

  function clamp(word : std_logic_vector) return std_logic_vector is
  begin
    if signed(word) > LIMIT then
      return std_logic_vector(to_signed(LIMIT, OUT_WIDTH));
    elsif signed(word) < -LIMIT then
      return std_logic_vector(to_signed(-LIMIT, OUT_WIDTH));
    end if;
    return std_logic_vector(resize(signed(word), OUT_WIDTH));
  end function;

begin

  -- One process for both, as only a generate statement could tell them apart, and
  -- would put a scope of its own into every waveform.
  process (clk, value)
    type row is array (0 to SETTLING) of std_logic_vector(OUT_WIDTH - 1 downto 0);
    variable late : row;
  begin
    if SETTLING = 0 then
      limited <= clamp(value);
    elsif rising_edge(clk) then
      late(0) := clamp(value);
      for i in SETTLING downto 1 loop
        late(i) := late(i - 1);
      end loop;

      if rst = '1' then
        late := (others => (others => '0'));
      end if;

      limited <= late(SETTLING);
    end if;
  end process;

end architecture;
