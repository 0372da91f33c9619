-- WRONG only when compiled before order_a.vhd: it uses the package order_pkg of that file.
library ieee;
use ieee.std_logic_1164.all;
use work.order_pkg.all;

entity order_b is
  port (
    clk   : in  std_logic;
    rst   : in  std_logic;
    enc_a : in  std_logic;
    enc_b : in  std_logic;
    pwm   : out std_logic;
    dir   : out std_logic
  );
end entity order_b;

architecture rtl of order_b is
  signal n : tick;
begin
  process (clk)
  begin
    if rising_edge(clk) then
      if rst = '1' then
        n   <= 0;
        pwm <= '0';
        dir <= '0';
      else
        if n = tick'high then n <= 0; else n <= n + 1; end if;
        pwm <= '0';
        if n < PERIOD / 4 then pwm <= enc_a; end if;
        dir <= enc_b;
      end if;
    end if;
  end process;
end architecture rtl;
