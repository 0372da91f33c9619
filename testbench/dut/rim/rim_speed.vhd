-- rim_speed: speed as the low-passed differences of the position.
--
-- Every SAMPLE_CLOCKS the difference d of the position is fed to
--
--     sum <= sum + 256 * d - y        y = sum / 2**FILTER_SHIFT, rounded
--
-- which is a first-order low pass of unit gain: y settles at 256 * d with a time
-- constant of 2**FILTER_SHIFT samples.  y is the output, 1/256 count a sample.
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.rim_types.all;

entity rim_speed is
  generic (
    COUNT_BITS    : positive             := 18;
    SPEED_BITS    : positive             := 16;
    FILTER_SHIFT  : natural range 0 to 8 := 2;
    SAMPLE_CLOCKS : positive             := 1000
  );
  port (
    clk   : in  std_logic;
    rst_n : in  std_logic;
    count : in  signed(COUNT_BITS - 1 downto 0);
    speed : out signed(SPEED_BITS - 1 downto 0)
  );
end entity rim_speed;

architecture rtl of rim_speed is

  constant SUM_BITS  : positive := SPEED_BITS + FILTER_SHIFT;
  constant DIFF_BITS : positive := SPEED_BITS - SPEED_FRACTION;
  constant HALF      : natural  := (2 ** FILTER_SHIFT) / 2;

  signal tick : natural range 0 to SAMPLE_CLOCKS - 1;
  signal last : signed(COUNT_BITS - 1 downto 0);
  signal sum  : signed(SUM_BITS - 1 downto 0);
  signal y    : signed(SUM_BITS downto 0);

begin

  -- One bit more than the sum, so that rounding cannot wrap.
  y     <= shift_right(resize(sum, SUM_BITS + 1) + HALF, FILTER_SHIFT);
  speed <= clip(y, SPEED_BITS);

  filter : process (clk, rst_n)
    variable diff : signed(DIFF_BITS - 1 downto 0);
    variable fed  : signed(SUM_BITS + 1 downto 0);
  begin
    if rst_n = '0' then
      tick <= 0;
      last <= (others => '0');
      sum  <= (others => '0');
    elsif rising_edge(clk) then
      if tick = SAMPLE_CLOCKS - 1 then
        tick <= 0;
        last <= count;
        diff := clip(count - last, DIFF_BITS);
        fed  := shift_left(resize(diff, SUM_BITS + 2), SPEED_FRACTION);
        sum  <= clip(resize(sum, SUM_BITS + 2) + fed - resize(y, SUM_BITS + 2), SUM_BITS);
      else
        tick <= tick + 1;
      end if;
    end if;
  end process filter;

end architecture rtl;
