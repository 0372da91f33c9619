-- A multiplier of somebody else's whose product comes two clocks later and is never reset.
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity fast_mul is
  generic (N, KEEP : positive := 8; SATURATING : boolean := true);
  port (clock : in std_ulogic; x, y : in unsigned(N - 1 downto 0); p : out unsigned(KEEP - 1 downto 0));
end entity;

architecture rtl of fast_mul is
  signal full : unsigned(2 * N - 1 downto 0);
begin
  process (clock)
  begin
    if rising_edge(clock) then
      full <= x * y;
      p    <= resize(full, KEEP);
      if SATURATING and full > 2 ** KEEP - 1 then
        p <= (others => '1');
      end if;
    end if;
  end process;
end architecture;
