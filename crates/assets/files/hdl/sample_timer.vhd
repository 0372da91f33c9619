-- sample_timer : marks the edges at which other blocks sample
--
-- sample is '1' for one edge in every period.
--
-- generics PERIOD_WIDTH  bits of the period, 2 to 30
-- in       period (0,PERIOD_WIDTH,0)   sample period in clocks, 0 acts as 1
-- out      sample (0,1,0)              the next edge samples
-- latency  1 edge; a new period takes effect when sample next rises
-- reset    sample 0; it rises at the first edge after it
-- overflow none
-- source   Pediredla et al., the loop at 1 kHz
-- differs from the hardware: samples exactly every period, without jitter.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity sample_timer is
  generic (
    PERIOD_WIDTH : positive range 2 to 30 := 24
  );
  port (
    clk    : in  std_logic;
    rst    : in  std_logic;
    period : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    sample : out std_logic
  );
end entity;

architecture rtl of sample_timer is
begin

  process (clk)
    -- 2^PERIOD_WIDTH - 2, written to stay inside an integer for 31 bits.
    variable countdown : natural range 0 to 2 * (2**(PERIOD_WIDTH - 1) - 1);
  begin
    if rising_edge(clk) then
      if countdown = 0 then
        sample    <= '1';
        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        sample    <= '0';
        countdown := countdown - 1;
      end if;

      if rst = '1' then
        sample    <= '0';
        countdown := 0;
      end if;
    end if;
  end process;

end architecture;
