-- window_sum : the sum of the newest codes of a converter, less a zero
--
-- At a sample edge, c(k) being the code now:
--   sum := c(k) + c(k-1) + ... + c(k-WINDOW+1) - zero
--
-- The first code after a reset fills the window. The zero has the units of the
-- sum, so it is WINDOW times finer than a code.
--
-- generics CODE_WIDTH    bits of a code
--          WINDOW        codes, 2 to 64
--          SUM_WIDTH     bits of the sum of the codes, at least CODE_WIDTH +
--                        ceil(log2 WINDOW)
--          PERIOD_WIDTH  bits of the period, 2 to 30
-- in       code   (1,CODE_WIDTH-1,0)
--          zero   (1,SUM_WIDTH-1,0)    sum of the codes that stand for 0
--          period (0,PERIOD_WIDTH,0)   sample period in clocks, 0 acts as 1
-- out      sum    (1,SUM_WIDTH,0)
-- latency  1 edge, sample edges only; a new period takes effect at the next
--          sample edge
-- reset    all 0; the first edge after it is a sample edge
-- overflow none
-- source   the mean of 33 codes in the current loop of EPFL's haptic paddle
-- differs from the hardware: the firmware sums a buffer that a DMA channel fills.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity window_sum is
  generic (
    CODE_WIDTH   : positive := 12;
    WINDOW       : positive := 33;
    SUM_WIDTH    : positive := 18;
    PERIOD_WIDTH : positive range 2 to 30 := 24
  );
  port (
    clk    : in  std_logic;
    rst    : in  std_logic;
    code   : in  std_logic_vector(CODE_WIDTH - 1 downto 0);
    zero   : in  std_logic_vector(SUM_WIDTH - 1 downto 0);
    period : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    sum    : out std_logic_vector(SUM_WIDTH downto 0)
  );
end entity;

architecture rtl of window_sum is

  subtype code_word is signed(CODE_WIDTH - 1 downto 0);
  subtype total_word is signed(SUM_WIDTH - 1 downto 0);
  type history is array (1 to WINDOW) of code_word;

begin

  process (clk)
    -- 2^PERIOD_WIDTH - 2, written to stay inside an integer for 31 bits.
    variable countdown : natural range 0 to 2 * (2**(PERIOD_WIDTH - 1) - 1);
    -- The code j samples ago.
    variable earlier   : history;
    -- A code fills the window.
    variable primed    : std_logic;
    variable total     : total_word;
  begin
    if rising_edge(clk) then
      if countdown = 0 then
        if primed = '1' then
          total := total + signed(code) - earlier(WINDOW);
          for j in WINDOW downto 2 loop
            earlier(j) := earlier(j - 1);
          end loop;
          earlier(1) := signed(code);
        else
          total   := resize(signed(code) * to_signed(WINDOW, 8), SUM_WIDTH);
          earlier := (others => signed(code));
        end if;
        primed    := '1';
        sum       <= std_logic_vector(resize(total, SUM_WIDTH + 1) - signed(zero));
        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        countdown := countdown - 1;
      end if;

      if rst = '1' then
        countdown := 0;
        earlier   := (others => (others => '0'));
        primed    := '0';
        total     := (others => '0');
        sum       <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
