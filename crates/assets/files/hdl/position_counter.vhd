-- position_counter : the angle of the handle, in encoder counts
--
--   position := (position + step) mod 2^WIDTH
--
-- generics WIDTH               bits of the counter
-- in       step     (1,1,0)    counts since the last edge; -2, which the
--                              decoder never sends, counts -2
-- out      position (0,WIDTH,0)
-- latency  1 edge
-- reset    position 0
-- overflow wraps; displacement takes the short way round the wrap
-- source   Vasudevan et al. 2007, the measured angle theta
-- differs from the hardware: no index pulse and no preset, so zero is wherever
--          the handle was at reset.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity position_counter is
  generic (
    WIDTH : positive := 12
  );
  port (
    clk      : in  std_logic;
    rst      : in  std_logic;
    step     : in  std_logic_vector(1 downto 0);
    position : out std_logic_vector(WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of position_counter is
begin

  process (clk)
    -- One bit more than the counter, so that even a 1-bit counter has room for
    -- the whole step; the top bit is dropped, which is the modulo.
    variable sum : signed(WIDTH downto 0);
  begin
    if rising_edge(clk) then
      sum      := signed('0' & position) + signed(step);
      position <= std_logic_vector(sum(WIDTH - 1 downto 0));

      if rst = '1' then
        position <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
