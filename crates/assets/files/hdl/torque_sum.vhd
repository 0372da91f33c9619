-- torque_sum : the torque of the wall, spring plus damper
--
--   torque = spring + damping   when contact
--            0                  otherwise
--
-- generics SPRING_WIDTH, DAMPING_WIDTH, OUT_WIDTH   bits of the words
-- in       spring  (0,SPRING_WIDTH,0)
--          damping (1,DAMPING_WIDTH-1,0)   +B * velocity
--          contact (0,1,0)                 inside the wall
-- out      torque  (1,OUT_WIDTH-1,0)       positive = against the penetration
-- latency  0, combinational
-- reset    none
-- overflow never with the defaults; a narrower OUT_WIDTH wraps
-- source   Vasudevan et al. 2007, Eqs. (6) and (7); Eq. (5) prints tau2 + tau3
--          for tau1 + tau2
-- differs from the hardware: no propagation delay, so no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity torque_sum is
  generic (
    SPRING_WIDTH  : positive := 12;
    DAMPING_WIDTH : positive := 13;
    OUT_WIDTH     : positive := 14
  );
  port (
    spring  : in  std_logic_vector(SPRING_WIDTH - 1 downto 0);
    damping : in  std_logic_vector(DAMPING_WIDTH - 1 downto 0);
    contact : in  std_logic;
    torque  : out std_logic_vector(OUT_WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of torque_sum is
begin

  process (all)
    -- Holds either term and the result, whichever is widest: the terms are
    -- only ever extended, and the result is cut by dropping upper bits.
    variable sum : signed(
      maximum(maximum(SPRING_WIDTH + 1, DAMPING_WIDTH), OUT_WIDTH) - 1 downto 0);
  begin
    sum := resize(signed('0' & spring), sum'length)
         + resize(signed(damping), sum'length);

    torque <= (others => '0');
    if contact = '1' then
      torque <= std_logic_vector(sum(OUT_WIDTH - 1 downto 0));
    end if;
  end process;

end architecture;
