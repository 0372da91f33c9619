-- WRONG: the output "dir" is never driven and stays 'U'.
library ieee;
use ieee.std_logic_1164.all;

entity x_out is
  port (
    clk   : in  std_logic;
    rst   : in  std_logic;
    enc_a : in  std_logic;
    enc_b : in  std_logic;
    pwm   : out std_logic;
    dir   : out std_logic
  );
end entity x_out;

architecture rtl of x_out is
begin
  process (clk)
  begin
    if rising_edge(clk) then
      if rst = '1' then
        pwm <= '0';
      else
        pwm <= enc_a xor enc_b;
      end if;
    end if;
  end process;
end architecture rtl;
