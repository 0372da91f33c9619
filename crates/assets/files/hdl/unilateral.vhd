-- unilateral : the wall pushes, it never pulls
--
--   E(x) = 1 for x <= 0, else 0, with x = theta_ref - theta = -delta
--   contact     = E(-delta)
--   penetration = delta when contact, else 0
--
-- generics WIDTH                     bits of the displacement
-- in       delta       (1,WIDTH-1,0) displacement into the wall
-- out      contact     (0,1,0)       1 when delta >= 0
--          penetration (0,WIDTH,0)   depth inside the wall
-- latency  0, combinational
-- reset    none
-- overflow none
-- source   Vasudevan et al. 2007, the operator E of Eq. (1); the sign of x is
--          the reading that agrees with Eq. (7)
-- differs from the hardware: no propagation delay, so no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;

entity unilateral is
  generic (
    WIDTH : positive := 12
  );
  port (
    delta       : in  std_logic_vector(WIDTH - 1 downto 0);
    contact     : out std_logic;
    penetration : out std_logic_vector(WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of unilateral is
begin

  process (all)
  begin
    -- The sign bit decides: delta = 0 touches the wall.
    contact     <= not delta(delta'high);
    penetration <= delta;
    if delta(delta'high) = '1' then
      penetration <= (others => '0');
    end if;
  end process;

end architecture;
