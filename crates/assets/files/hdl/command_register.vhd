-- command_register : three commands, taken together once a sample period
--
-- At a load edge:  q_i := d_i
--
-- The first load edge is the one DELAY edges after the first edge that follows
-- reset. Started together with a sample_register, and with a period above
-- DELAY, it loads DELAY edges after each of its sample edges: the time that the
-- logic between the two has.
--
-- generics WIDTH         bits of a command
--          PERIOD_WIDTH  bits of the period, 2 to 30
--          DELAY         edges from a sample edge to its load edge, at most 2^16
-- in       d1, d2, d3 (1,WIDTH-1,0)
--          period     (0,PERIOD_WIDTH,0)  sample period in clocks, 0 acts as 1
-- out      q1, q2, q3 (1,WIDTH-1,0)
-- latency  1 edge, load edges only; a new period takes effect at the next load
--          edge
-- reset    q 0, countdown DELAY
-- overflow none
-- source   Sevcik et al. 2009, the motor commands of the FPGA
-- differs from the hardware: loads exactly every period, without jitter; the
--          conversion time of the D/A converter is not in it.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity command_register is
  generic (
    WIDTH        : positive := 16;
    PERIOD_WIDTH : positive range 2 to 30 := 24;
    DELAY        : natural  := 8
  );
  port (
    clk    : in  std_logic;
    rst    : in  std_logic;
    d1     : in  std_logic_vector(WIDTH - 1 downto 0);
    d2     : in  std_logic_vector(WIDTH - 1 downto 0);
    d3     : in  std_logic_vector(WIDTH - 1 downto 0);
    period : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    q1     : out std_logic_vector(WIDTH - 1 downto 0);
    q2     : out std_logic_vector(WIDTH - 1 downto 0);
    q3     : out std_logic_vector(WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of command_register is
begin

  process (clk)
    -- 2^PERIOD_WIDTH - 2, written to stay inside an integer for 31 bits.
    variable countdown : natural range 0 to maximum(2 * (2**(PERIOD_WIDTH - 1) - 1), DELAY);
  begin
    if rising_edge(clk) then
      if countdown = 0 then
        q1        <= d1;
        q2        <= d2;
        q3        <= d3;
        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        countdown := countdown - 1;
      end if;

      if rst = '1' then
        q1        <= (others => '0');
        q2        <= (others => '0');
        q3        <= (others => '0');
        countdown := DELAY;
      end if;
    end if;
  end process;

end architecture;
