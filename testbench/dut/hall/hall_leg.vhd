-- One leg of a bridge: a switch opens at once, the other one closes DEAD clocks later.
library ieee;
use ieee.std_logic_1164.all;

entity hall_leg is
  generic (DEAD : natural := 10);
  port (
    clk     : in  std_logic;
    rst_n   : in  std_logic;
    on_high : in  std_logic;
    high    : out std_logic;
    low     : out std_logic);
end entity;

architecture rtl of hall_leg is
  signal was  : std_logic;
  signal left : natural range 0 to DEAD;
begin
  process (clk, rst_n)
  begin
    if rst_n = '0' then
      was  <= '0';
      left <= DEAD;
      high <= '0';
      low  <= '0';
    elsif rising_edge(clk) then
      if on_high /= was then
        was  <= on_high;
        left <= DEAD;
        high <= '0';
        low  <= '0';
      elsif left > 0 then
        left <= left - 1;
      else
        high <= was;
        low  <= not was;
      end if;
    end if;
  end process;
end architecture;
