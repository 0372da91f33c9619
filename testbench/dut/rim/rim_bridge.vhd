-- rim_bridge: H bridge from a signed duty, sign-magnitude, slow decay.
--
-- One leg chops, the other keeps its lower gate on; between pulses both lower
-- gates are on and the motor is shorted.  A positive duty chops leg A (motor
-- voltage positive), a negative one leg B.  A period is 2**DUTY_BITS clocks and
-- the duty is taken over at its start.
--
-- A leg's upper gate comes on DEAD_CLOCKS late, so pulses are asked for that much
-- longer: |duty| is the number of clocks that the upper gate is on.  It is limited
-- to 2**DUTY_BITS - 1 - 4 * DEAD_CLOCKS, which leaves the lower gate on for long
-- enough to charge the supply of the upper.
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.rim_types.all;

entity rim_bridge is
  generic (
    DUTY_BITS   : positive range 6 to 14 := 10;
    DEAD_CLOCKS : positive range 1 to 63 := 5
  );
  port (
    clk   : in  std_logic;
    rst_n : in  std_logic;
    duty  : in  signed(DUTY_BITS downto 0);
    leg_a : out gate_pair;
    leg_b : out gate_pair
  );
end entity rim_bridge;

architecture rtl of rim_bridge is

  constant MOST : positive := 2 ** DUTY_BITS - 1 - 4 * DEAD_CLOCKS;

  signal saw     : unsigned(DUTY_BITS - 1 downto 0);
  signal width   : unsigned(DUTY_BITS - 1 downto 0);
  signal reverse : std_logic;
  signal want_a  : std_logic;
  signal want_b  : std_logic;

begin

  modulate : process (clk, rst_n)
    variable size : unsigned(DUTY_BITS downto 0);
  begin
    if rst_n = '0' then
      saw     <= (others => '0');
      width   <= (others => '0');
      reverse <= '0';
      want_a  <= '0';
      want_b  <= '0';
    elsif rising_edge(clk) then
      saw <= saw + 1;

      if saw = 2 ** DUTY_BITS - 1 then
        size := unsigned(abs duty);
        if size > MOST then
          size := to_unsigned(MOST, DUTY_BITS + 1);
        end if;
        if size /= 0 then
          size := size + DEAD_CLOCKS;
        end if;
        width   <= size(DUTY_BITS - 1 downto 0);
        reverse <= duty(DUTY_BITS);
      end if;

      want_a <= '0';
      want_b <= '0';
      if saw < width then
        want_a <= not reverse;
        want_b <= reverse;
      end if;
    end if;
  end process modulate;

  a : entity work.rim_leg
    generic map (DEAD_CLOCKS => DEAD_CLOCKS)
    port map (clk => clk, rst_n => rst_n, want => want_a, gates => leg_a);

  b : entity work.rim_leg
    generic map (DEAD_CLOCKS => DEAD_CLOCKS)
    port map (clk => clk, rst_n => rst_n, want => want_b, gates => leg_b);

end architecture rtl;
