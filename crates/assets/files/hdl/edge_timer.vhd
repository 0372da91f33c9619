-- edge_timer : the time between counts, the fixed-position method
--
-- At every edge:
--   d        := (position - previous) mod 2^WIDTH, read as two's complement
--   previous := position
--   elapsed  := min(timer + 1, all ones), the edges since the last change
--
--   d /= 0   a change, one whatever its size. In the direction of the last one:
--              interval := elapsed, stopped := 0
--            a reversal, or the first change after reset or a standstill:
--              interval := all ones, stopped := 1
--            in both: forward := d > 0, timer := 0
--   d = 0    timer := elapsed, interval := max(interval, elapsed): an overdue
--            count bounds the speed from above. A timer at all ones is a
--            standstill: stopped := 1
--
-- The velocity is f_clock/interval counts/s, by a sequential_divider.
--
-- generics WIDTH      bits of the position
--          TIME_WIDTH bits of the interval, 2 to 30
-- in       position (0,WIDTH,0)
-- out      interval (0,TIME_WIDTH,0) in clocks
--          forward  (0,1,0)  the last change was upwards
--          stopped  (0,1,0)  the interval is not known
-- latency  1 edge
-- reset    interval all ones, stopped 1, forward 0, timer 0, previous 0
-- overflow the difference wraps with the counter; the timer saturates
-- source   the fixed-position method, with a rule for reversal and standstill
-- differs from the hardware: none known.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity edge_timer is
  generic (
    WIDTH      : positive := 12;
    TIME_WIDTH : positive range 2 to 30 := 20
  );
  port (
    clk      : in  std_logic;
    rst      : in  std_logic;
    position : in  std_logic_vector(WIDTH - 1 downto 0);
    interval : out std_logic_vector(TIME_WIDTH - 1 downto 0);
    forward  : out std_logic;
    stopped  : out std_logic
  );
end entity;

architecture rtl of edge_timer is

  -- 2^TIME_WIDTH - 1, written to stay inside an integer for 31 bits.
  constant LONGEST : positive := 2 * (2**(TIME_WIDTH - 1) - 1) + 1;

begin

  process (clk)
    variable previous : unsigned(WIDTH - 1 downto 0);
    variable d        : signed(WIDTH - 1 downto 0);
    -- At LONGEST there is no change to measure from.
    variable timer    : natural range 0 to LONGEST;
    variable elapsed  : unsigned(TIME_WIDTH - 1 downto 0);
    variable known    : std_logic;
  begin
    if rising_edge(clk) then
      d        := signed(unsigned(position) - previous);
      previous := unsigned(position);
      known    := '0';
      if timer /= LONGEST then
        timer := timer + 1;
        known := forward xnor not d(WIDTH - 1);
      end if;
      elapsed := to_unsigned(timer, TIME_WIDTH);

      if d /= 0 then
        -- Gated instead of chosen, and both ways, so that an unknown position
        -- leaves unknown words.
        interval <= (std_logic_vector(elapsed) and known) or not known;
        forward  <= not d(WIDTH - 1);
        stopped  <= not known;
        timer    := 0;
      elsif timer = LONGEST then
        interval <= (others => '1');
        stopped  <= '1';
      elsif elapsed > unsigned(interval) then
        interval <= std_logic_vector(elapsed);
      end if;

      if rst = '1' then
        previous := (others => '0');
        timer    := LONGEST;
        interval <= (others => '1');
        forward  <= '0';
        stopped  <= '1';
      end if;
    end if;
  end process;

end architecture;
