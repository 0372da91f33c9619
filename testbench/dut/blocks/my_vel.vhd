-- A backward difference of somebody else's: VHDL-93, asynchronous reset, one process.
library ieee;
use ieee.std_logic_1164.all;
use ieee.std_logic_arith.all;
use ieee.std_logic_unsigned.all;

entity my_vel is
  generic (W : natural := 10; T : natural := 20);
  port (
    ck_i, nrst_i : in  std_ulogic;
    pos_i        : in  std_logic_vector(W - 1 downto 0);
    every_i      : in  std_logic_vector(T - 1 downto 0);
    vel_o        : out std_logic_vector(W - 1 downto 0)
  );
end my_vel;

architecture rtl of my_vel is
  signal last : std_logic_vector(W - 1 downto 0);
  signal left : std_logic_vector(T - 1 downto 0);
begin
  process (ck_i, nrst_i)
  begin
    if nrst_i = '0' then
      last  <= (others => '0');
      left  <= (others => '0');
      vel_o <= (others => '0');
    elsif ck_i'event and ck_i = '1' then
      if left = 0 then
        vel_o <= pos_i - last;
        last  <= pos_i;
        if every_i > 1 then
          left <= every_i - 1;
        end if;
      else
        left <= left - 1;
      end if;
    end if;
  end process;
end rtl;
