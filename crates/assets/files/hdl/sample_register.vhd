-- sample_register : three counts, captured together once a sample period
--
-- At a sample edge:  count_i := position_i, read as two's complement
--
-- generics WIDTH         bits of a count
--          PERIOD_WIDTH  bits of the period, 2 to 30
-- in       position1, position2, position3 (0,WIDTH,0)
--          period (0,PERIOD_WIDTH,0)   sample period in clocks, 0 acts as 1
-- out      count1, count2, count3 (1,WIDTH-1,0)
-- latency  1 edge, sample edges only; a new period takes effect at the next
--          sample edge
-- reset    counts 0; the first edge after it is a sample edge
-- overflow none; the upper half of the counter is the negative half of a count
-- source   Sevcik et al. 2009, the loop rate of the FPGA
-- differs from the hardware: samples exactly every period, without jitter.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity sample_register is
  generic (
    WIDTH        : positive := 16;
    PERIOD_WIDTH : positive range 2 to 30 := 24
  );
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    position1 : in  std_logic_vector(WIDTH - 1 downto 0);
    position2 : in  std_logic_vector(WIDTH - 1 downto 0);
    position3 : in  std_logic_vector(WIDTH - 1 downto 0);
    period    : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    count1    : out std_logic_vector(WIDTH - 1 downto 0);
    count2    : out std_logic_vector(WIDTH - 1 downto 0);
    count3    : out std_logic_vector(WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of sample_register is
begin

  process (clk)
    -- 2^PERIOD_WIDTH - 2, written to stay inside an integer for 31 bits.
    variable countdown : natural range 0 to 2 * (2**(PERIOD_WIDTH - 1) - 1);
  begin
    if rising_edge(clk) then
      if countdown = 0 then
        count1    <= position1;
        count2    <= position2;
        count3    <= position3;
        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        countdown := countdown - 1;
      end if;

      if rst = '1' then
        count1    <= (others => '0');
        count2    <= (others => '0');
        count3    <= (others => '0');
        countdown := 0;
      end if;
    end if;
  end process;

end architecture;
