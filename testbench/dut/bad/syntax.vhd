-- WRONG: syntax error in line 18, "<=" is missing between dir and enc_b.
library ieee;
use ieee.std_logic_1164.all;

entity syntax is
  port (
    clk, enc_a, enc_b : in  std_logic;
    pwm, dir          : out std_logic
  );
end entity syntax;

architecture rtl of syntax is
begin
  process (clk)
  begin
    if rising_edge(clk) then
      pwm <= enc_a;
      dir enc_b;
    end if;
  end process;
end architecture rtl;
