-- displacement : signed distance from the wall, in encoder counts
--
--   delta = (position - reference) mod 2^WIDTH, read as two's complement
--
-- generics WIDTH                   bits of both positions and of the difference
-- in       position  (0,WIDTH,0)
--          reference (0,WIDTH,0)   where the wall begins
-- out      delta     (1,WIDTH-1,0) positive inside the wall
-- latency  0, combinational
-- reset    none
-- overflow the shortest way round the counter's wrap; a true distance of half
--          a turn of the counter or more shows on the other side
-- source   Vasudevan et al. 2007, theta - theta_ref of Eqs. (1) and (7)
-- differs from the hardware: no propagation delay, so no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity displacement is
  generic (
    WIDTH : positive := 12
  );
  port (
    position  : in  std_logic_vector(WIDTH - 1 downto 0);
    reference : in  std_logic_vector(WIDTH - 1 downto 0);
    delta     : out std_logic_vector(WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of displacement is
begin

  delta <= std_logic_vector(unsigned(position) - unsigned(reference));

end architecture;
