-- WRONG: an assertion of severity failure is violated at the 100th clock after reset.
library ieee;
use ieee.std_logic_1164.all;

entity assert_fail is
  port (
    clk   : in  std_logic;
    rst   : in  std_logic;
    enc_a : in  std_logic;
    enc_b : in  std_logic;
    pwm   : out std_logic;
    dir   : out std_logic
  );
end entity assert_fail;

architecture rtl of assert_fail is
  signal n : natural range 0 to 127;
begin
  process (clk)
  begin
    if rising_edge(clk) then
      if rst = '1' then
        n   <= 0;
        pwm <= '0';
        dir <= '0';
      else
        n   <= (n + 1) mod 128;
        pwm <= enc_a;
        dir <= enc_b;
        assert n /= 99 report "the counter has reached 99" severity failure;
      end if;
    end if;
  end process;
end architecture rtl;
