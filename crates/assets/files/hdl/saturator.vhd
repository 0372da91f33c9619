-- saturator : the actuator's full scale
--
--   limited = clamp(value, -LIMIT, +LIMIT)
--
-- generics IN_WIDTH, OUT_WIDTH         bits of the words
--          LIMIT                       full scale, less than 2^(OUT_WIDTH-1)
-- in       value   (1,IN_WIDTH-1,0)
-- out      limited (1,OUT_WIDTH-1,0)
-- latency  0, combinational
-- reset    none
-- overflow clamped, the same on both sides: the most negative word of the
--          output is not used
-- source   Vasudevan et al. 2007, Eq. (8)
-- differs from the hardware: no propagation delay, so no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity saturator is
  generic (
    IN_WIDTH  : positive := 14;
    OUT_WIDTH : positive := 13;
    LIMIT     : natural  := 4095
  );
  port (
    value   : in  std_logic_vector(IN_WIDTH - 1 downto 0);
    limited : out std_logic_vector(OUT_WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of saturator is
begin

  process (all)
  begin
    if signed(value) > LIMIT then
      limited <= std_logic_vector(to_signed(LIMIT, OUT_WIDTH));
    elsif signed(value) < -LIMIT then
      limited <= std_logic_vector(to_signed(-LIMIT, OUT_WIDTH));
    else
      limited <= std_logic_vector(resize(signed(value), OUT_WIDTH));
    end if;
  end process;

end architecture;
