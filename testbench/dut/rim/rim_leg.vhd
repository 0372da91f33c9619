-- rim_leg: one leg of the bridge, with dead time.
--
-- want = '1' asks for the upper gate, '0' for the lower.  When the wish changes,
-- both gates are off for exactly DEAD_CLOCKS clocks, then the new one is on.
-- In reset both are off.
library ieee;
use ieee.std_logic_1164.all;
use work.rim_types.all;

entity rim_leg is
  generic (
    DEAD_CLOCKS : positive range 1 to 63 := 5
  );
  port (
    clk   : in  std_logic;
    rst_n : in  std_logic;
    want  : in  std_logic;
    gates : out gate_pair
  );
end entity rim_leg;

architecture rtl of rim_leg is
  signal held : std_logic;
  signal left : natural range 0 to DEAD_CLOCKS - 1;
begin

  switch : process (clk, rst_n)
  begin
    if rst_n = '0' then
      gates <= GATES_OFF;
      held  <= '0';
      left  <= DEAD_CLOCKS - 1;
    elsif rising_edge(clk) then
      if want /= held then
        held  <= want;
        gates <= GATES_OFF;
        left  <= DEAD_CLOCKS - 1;
      elsif left /= 0 then
        left <= left - 1;
      elsif held = '1' then
        gates <= GATES_HIGH;
      else
        gates <= GATES_LOW;
      end if;
    end if;
  end process switch;

end architecture rtl;
