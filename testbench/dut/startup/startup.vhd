-- Small processes, one way of starting up each; see testbench/startup.py. Each answers with a byte.
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity startup is
  port (
    clk, rst, a : in std_logic;
    rise_of_reset, fall_of_reset, sync_counter, async_counter, async_low_counter, initial_only, divided, gated,
      falling_clock, reset_synchroniser, states, power_on, clocks_in_reset, variables : out unsigned(7 downto 0));
end entity;

architecture rtl of startup is
  type state is (waiting, going, resting);
  signal now : state;
  signal seen : std_logic := '0';
  signal falls, counted, edges_in_reset, ungated : unsigned(7 downto 0) := x"00";
  signal n_sync, n_async, n_low, n_falling, n_synchronised, n_divided, n_power, n_states : unsigned(7 downto 0);
  signal turning : unsigned(7 downto 0) := x"5a";
  signal half, one, two, gate : std_logic;
  signal rst_n : std_logic;
  signal left : integer range 0 to 9 := 9;
begin

  rise_of_reset <= (0 => seen, others => '0');
  process (rst) begin if rising_edge(rst) then seen <= '1'; end if; end process;

  fall_of_reset <= falls;
  process (rst) begin if falling_edge(rst) then falls <= falls + 1; end if; end process;

  sync_counter <= n_sync;
  process (clk) begin
    if rising_edge(clk) then
      if rst = '1' then n_sync <= x"03"; else n_sync <= n_sync + 1; end if;
    end if;
  end process;

  async_counter <= n_async;
  process (clk, rst) begin
    if rst = '1' then n_async <= x"05"; elsif rising_edge(clk) then n_async <= n_async + 1; end if;
  end process;

  rst_n <= not rst;
  async_low_counter <= n_low;
  process (clk, rst_n) begin
    if rst_n = '0' then n_low <= x"07"; elsif clk'event and clk = '1' then n_low <= n_low + 1; end if;
  end process;

  initial_only <= turning;
  process (clk) begin if rising_edge(clk) then turning <= turning(6 downto 0) & turning(7); end if; end process;

  divided <= n_divided;
  process (clk, rst) begin
    if rst = '1' then half <= '0'; elsif rising_edge(clk) then half <= not half; end if;
  end process;
  process (half, rst) begin
    if rst = '1' then n_divided <= x"00"; elsif rising_edge(half) then n_divided <= n_divided + 1; end if;
  end process;

  gated <= ungated;
  gate <= clk and not rst;
  process (gate) begin if rising_edge(gate) then ungated <= ungated + 1; end if; end process;

  falling_clock <= n_falling;
  process (clk) begin
    if falling_edge(clk) then
      if rst = '1' then n_falling <= x"00"; else n_falling <= n_falling + 1; end if;
    end if;
  end process;

  reset_synchroniser <= n_synchronised;
  process (clk, rst) begin
    if rst = '1' then one <= '1'; two <= '1'; elsif rising_edge(clk) then one <= '0'; two <= one; end if;
  end process;
  process (clk, two) begin
    if two = '1' then n_synchronised <= x"00"; elsif rising_edge(clk) then n_synchronised <= n_synchronised + 1; end if;
  end process;

  states <= n_states;
  process (clk) begin
    if rising_edge(clk) then
      if rst = '1' then
        now <= waiting;
        n_states <= x"00";
      else
        case now is
          when waiting => now <= going;
          when going   => n_states <= n_states + 3; now <= resting;
          when resting => now <= waiting;
        end case;
      end if;
    end if;
  end process;

  power_on <= n_power;
  process (clk) begin
    if rising_edge(clk) then
      if left /= 0 then left <= left - 1; n_power <= x"00"; else n_power <= n_power + 1; end if;
    end if;
  end process;

  clocks_in_reset <= edges_in_reset;
  process (clk) begin
    if rising_edge(clk) then
      if rst = '1' then edges_in_reset <= edges_in_reset + 1; end if;
    end if;
  end process;

  variables <= counted;
  process (clk)
    variable sum : unsigned(7 downto 0) := x"01";
  begin
    if rising_edge(clk) then
      if rst = '1' then sum := x"02"; else sum := sum + sum(3 downto 0) + 1; end if;
      counted <= sum;
    end if;
  end process;

end architecture;
