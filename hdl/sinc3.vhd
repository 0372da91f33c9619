-- sinc3 : words of a sigma-delta modulator's bits, by a sinc filter of the third order
--
-- With M = 2^RATIO_WIDTH, and x = 1 for a bit of '1', -1 for one of '0', at each bit:
--   sum1 := sum1 + x
--   sum2 := sum2 + sum1
--   sum3 := sum3 + sum2
-- and with the Mth bit since the last word:
--   first  := sum3 - last1
--   second := first - last2
--   value  := second - last3
--   last1  := sum3
--   last2  := first
--   last3  := second
--
-- A sum takes those of this edge; all are modulo 2^(3*RATIO_WIDTH+2), which the
-- differences undo. value is the response of three means over M bits, each times M. It
-- is even, -M^3 for bits that are all '0' and M^3 for bits that are all '1'. A step of
-- the density is seen in full from the third word on.
--
-- generics RATIO_WIDTH  the bits of a word are 2^RATIO_WIDTH, 2 to 10
-- in       data   (0,1,0)   bit of the modulator
--          strobe (0,1,0)   a bit is there
-- out      value  (1,3*RATIO_WIDTH+1,0)
--          ready  (0,1,0)   for one edge, together with a new word
-- latency  1 edge from the last bit of a word
-- reset    all 0
-- overflow none
-- source   Hogenauer 1981; the filter that makers of isolated sigma-delta modulators
--          recommend
-- differs from the hardware: three sums, or six in the clock of a word, take one edge,
--          so no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity sinc3 is
  generic (
    RATIO_WIDTH : positive := 7
  );
  port (
    clk    : in  std_logic;
    rst    : in  std_logic;
    data   : in  std_logic;
    strobe : in  std_logic;
    value  : out std_logic_vector(3 * RATIO_WIDTH + 1 downto 0);
    ready  : out std_logic
  );
end entity;

architecture rtl of sinc3 is

  subtype word is signed(3 * RATIO_WIDTH + 1 downto 0);

begin

  process (clk)
    variable count  : unsigned(RATIO_WIDTH - 1 downto 0);
    variable sum1   : word;
    variable sum2   : word;
    variable sum3   : word;
    variable last1  : word;
    variable last2  : word;
    variable last3  : word;
    variable first  : word;
    variable second : word;
  begin
    if rising_edge(clk) then
      ready <= '0';
      if strobe = '1' then
        if data = '1' then
          sum1 := sum1 + 1;
        else
          sum1 := sum1 - 1;
        end if;
        sum2  := sum2 + sum1;
        sum3  := sum3 + sum2;
        count := count + 1;
        if count = 0 then
          first  := sum3 - last1;
          second := first - last2;
          value  <= std_logic_vector(second - last3);
          ready  <= '1';
          last1  := sum3;
          last2  := first;
          last3  := second;
        end if;
      end if;

      if rst = '1' then
        count := (others => '0');
        sum1  := (others => '0');
        sum2  := (others => '0');
        sum3  := (others => '0');
        last1 := (others => '0');
        last2 := (others => '0');
        last3 := (others => '0');
        value <= (others => '0');
        ready <= '0';
      end if;
    end if;
  end process;

end architecture;
