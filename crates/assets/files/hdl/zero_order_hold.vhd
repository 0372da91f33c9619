-- zero_order_hold : samples a word and holds it for a programmable period
--
-- At a sample edge:  q := d
--
-- With the same period it samples on the same edges as a velocity_register.
--
-- generics WIDTH         bits of the word
--          PERIOD_WIDTH  bits of the period, 2 to 30
-- in       d      (0,WIDTH,0)
--          period (0,PERIOD_WIDTH,0)   sample period in clocks, 0 acts as 1
-- out      q      (0,WIDTH,0)
-- latency  1 edge, sample edges only; a new period takes effect at the next
--          sample edge
-- reset    q 0; the first edge after it is a sample edge
-- overflow none
-- source   Vasudevan et al. 2007, the sampler and hold of the conventional loop
-- differs from the hardware: samples exactly every period; a controller in
--          software has jitter and a computing delay.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity zero_order_hold is
  generic (
    WIDTH        : positive := 12;
    PERIOD_WIDTH : positive range 2 to 30 := 24
  );
  port (
    clk    : in  std_logic;
    rst    : in  std_logic;
    d      : in  std_logic_vector(WIDTH - 1 downto 0);
    period : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    q      : out std_logic_vector(WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of zero_order_hold is
begin

  process (clk)
    -- 2^PERIOD_WIDTH - 2, written to stay inside an integer for 31 bits.
    variable countdown : natural range 0 to 2 * (2**(PERIOD_WIDTH - 1) - 1);
  begin
    if rising_edge(clk) then
      if countdown = 0 then
        q         <= d;
        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        countdown := countdown - 1;
      end if;

      if rst = '1' then
        q         <= (others => '0');
        countdown := 0;
      end if;
    end if;
  end process;

end architecture;
