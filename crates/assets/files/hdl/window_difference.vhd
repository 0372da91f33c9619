-- window_difference : the way of the last WINDOW sample periods
--
-- At a sample edge, x(k) being the position now:
--   velocity := (x(k) - x(k-WINDOW)) mod 2^WIDTH, read as two's complement
--
-- A backward difference over a longer time: WINDOW times finer for the same
-- sample period, and WINDOW/2 sample periods late.
--
-- generics WIDTH         bits of the position
--          PERIOD_WIDTH  bits of the period, 2 to 30
--          WINDOW        samples
-- in       position (0,WIDTH,0)
--          period   (0,PERIOD_WIDTH,0)   sample period in clocks, 0 acts as 1
-- out      velocity (1,WIDTH-1,0) counts per window
-- latency  1 edge, sample edges only; a new period takes effect at the next
--          sample edge
-- reset    velocity 0, all earlier positions 0; the first edge after it is a
--          sample edge
-- overflow the difference wraps with the counter
-- source   the fixed-time method over a window of samples
-- differs from the hardware: none known.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity window_difference is
  generic (
    WIDTH        : positive := 12;
    PERIOD_WIDTH : positive range 2 to 30 := 24;
    WINDOW       : positive := 8
  );
  port (
    clk      : in  std_logic;
    rst      : in  std_logic;
    position : in  std_logic_vector(WIDTH - 1 downto 0);
    period   : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    velocity : out std_logic_vector(WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of window_difference is

  type history is array (1 to WINDOW) of unsigned(WIDTH - 1 downto 0);

begin

  process (clk)
    -- 2^PERIOD_WIDTH - 2, written to stay inside an integer for 31 bits.
    variable countdown : natural range 0 to 2 * (2**(PERIOD_WIDTH - 1) - 1);
    -- The position j samples ago.
    variable earlier   : history;
  begin
    if rising_edge(clk) then
      if countdown = 0 then
        velocity <= std_logic_vector(unsigned(position) - earlier(WINDOW));
        for j in WINDOW downto 2 loop
          earlier(j) := earlier(j - 1);
        end loop;
        earlier(1) := unsigned(position);

        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        countdown := countdown - 1;
      end if;

      if rst = '1' then
        countdown := 0;
        earlier   := (others => (others => '0'));
        velocity  <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
