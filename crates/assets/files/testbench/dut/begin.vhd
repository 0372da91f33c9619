-- A wall to begin with: quadrature in, PWM and direction out.
--
--   magnitude = gain * depth / 16, in PWM counts, limited to 0 .. 1023
--
-- depth is the number of encoder counts beyond wall_at. The wall only pushes back, so dir is always 0.
-- Latency: an edge of enc_a or enc_b is counted after 3 clocks; a new magnitude waits for the next PWM period,
-- which takes 1024 clocks.
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity begin_wall is
  port (
    clk     : in  std_logic;
    rst     : in  std_logic;                -- synchronous, active high
    enc_a   : in  std_logic;                -- asynchronous
    enc_b   : in  std_logic;                -- asynchronous; leads enc_a in the positive direction
    wall_at : in  signed(23 downto 0);      -- encoder counts from the start
    gain    : in  unsigned(15 downto 0);    -- 1/16 PWM count per encoder count
    pwm     : out std_logic;
    dir     : out std_logic                 -- 1: positive direction
  );
end entity;

architecture rtl of begin_wall is
  signal a, b   : std_logic_vector(2 downto 0);  -- two registers against metastability, one for the edge
  signal count  : signed(23 downto 0);
  signal period : unsigned(9 downto 0);
  signal duty   : unsigned(9 downto 0);
begin
  dir <= '0';

  process (clk)
    variable depth : signed(24 downto 0);
    variable push : signed(41 downto 0);
  begin
    if rising_edge(clk) then
      a <= a(1 downto 0) & enc_a;
      b <= b(1 downto 0) & enc_b;
      -- One line changes at a count; a b goes 00, 01, 11, 10 in the positive direction.
      if (a(1) xor a(2)) /= (b(1) xor b(2)) then
        if (a(1) xor b(2)) = '0' then
          count <= count + 1;
        else
          count <= count - 1;
        end if;
      end if;
      depth := resize(count, 25) - wall_at;
      push := shift_right(depth * signed('0' & gain), 4);
      period <= period + 1;
      if period = 1023 then
        if push < 0 then
          duty <= (others => '0');
        elsif push > 1023 then
          duty <= (others => '1');
        else
          duty <= unsigned(push(9 downto 0));
        end if;
      end if;
      pwm <= '1' when period < duty else '0';
      if rst = '1' then
        a <= (others => '0');
        b <= (others => '0');
        count <= (others => '0');
        period <= (others => '0');
        duty <= (others => '0');
        pwm <= '0';
      end if;
    end if;
  end process;
end architecture;
