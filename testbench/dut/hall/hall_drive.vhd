-- A wall by a torque drive with Hall switches: six steps of 60 electrical degrees, pulse-width modulation of all legs.
-- The torque is that of a voltage: the motor's own resistance makes the current.
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity hall_drive is
  generic (
    PWM_BITS : natural := 10;
    DEAD     : natural := 10);  -- clocks between the switches of a leg
  port (
    clk     : in  std_logic;
    rst_n   : in  std_logic;
    hall    : in  std_logic_vector(2 downto 0);  -- c, b, a
    count   : in  std_logic_vector(15 downto 0);
    wall    : in  std_logic_vector(15 downto 0);
    gain    : in  std_logic_vector(7 downto 0);  -- steps of duty for a count, in 1/8
    high    : out std_logic_vector(2 downto 0);  -- c, b, a
    low     : out std_logic_vector(2 downto 0));
end entity;

architecture rtl of hall_drive is
  signal ramp   : unsigned(PWM_BITS - 1 downto 0);
  signal duty   : unsigned(PWM_BITS - 1 downto 0);
  signal pushes : std_logic;
  signal legs   : std_logic_vector(2 downto 0);

  -- The legs that are high for a torque in the positive direction: the field is 90 to 150 degrees ahead of the magnets.
  function step(h : std_logic_vector(2 downto 0)) return std_logic_vector is
  begin
    case h is
      when "101"  => return "010";  -- c and a: 0 to 60 degrees
      when "001"  => return "110";
      when "011"  => return "100";
      when "010"  => return "101";
      when "110"  => return "001";
      when "100"  => return "011";
      when others => return "000";
    end case;
  end function;
begin
  process (clk, rst_n)
    variable depth  : signed(16 downto 0);
    variable pushed : signed(25 downto 0);
    constant MOST   : integer := 2 ** PWM_BITS - 1;
  begin
    if rst_n = '0' then
      ramp   <= (others => '0');
      duty   <= (others => '0');
      pushes <= '0';
      legs   <= (others => '0');
    elsif rising_edge(clk) then
      ramp <= ramp + 1;
      if ramp = MOST then
        depth  := resize(signed(count), 17) - resize(signed(wall), 17);
        pushed := depth * signed('0' & gain) / 8;
        pushes <= '0';
        duty   <= (others => '0');
        if depth > 0 then
          pushes <= '1';
          if pushed > MOST then
            duty <= to_unsigned(MOST, PWM_BITS);
          else
            duty <= unsigned(pushed(PWM_BITS - 1 downto 0));
          end if;
        end if;
      end if;
      -- Out of the wall: against the positive direction.
      if pushes = '1' and ramp < duty then
        legs <= not step(hall);
      else
        legs <= (others => '0');
      end if;
    end if;
  end process;

  each : for i in 0 to 2 generate
    leg : entity work.hall_leg
      generic map (DEAD => DEAD)
      port map (clk => clk, rst_n => rst_n, on_high => legs(i), high => high(i), low => low(i));
  end generate;
end architecture;
