-- timer_pwm : pulse-width modulation by the timer of a microcontroller
--
-- One period is PRESCALE * STEPS clocks. A command waits for the start of a period.
-- Locked antiphase:
--   B high, A low  while phase < PRESCALE * (command + CENTRE)
--   B low, A high  in the rest of the period
--
-- As with pwm, leg B drives the positive direction.
--
-- generics COMMAND_WIDTH  bits of the command
--          PRESCALE       clocks of a step
--          STEPS          steps of a period
--          CENTRE         steps for which B is high at a command of 0
-- in       command (1,COMMAND_WIDTH-1,0)   steps, from CENTRE
-- out      a_high, a_low, b_high, b_low (0,1,0)   gates of the H-bridge
-- latency  1 edge, up to a period
-- reset    phase 0, all gates 0
-- overflow none; a command outside of the steps is never or always on
-- source   TIM1 of an STM32F4 as the firmware of EPFL's haptic paddle sets it
-- differs from the hardware: gates switch at the clock edge, with no driver delay
--          and no dead time.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity timer_pwm is
  generic (
    COMMAND_WIDTH : positive := 10;
    PRESCALE      : positive := 5;
    STEPS         : positive := 1024;
    CENTRE        : natural  := 511
  );
  port (
    clk     : in  std_logic;
    rst     : in  std_logic;
    command : in  std_logic_vector(COMMAND_WIDTH - 1 downto 0);
    a_high  : out std_logic;
    a_low   : out std_logic;
    b_high  : out std_logic;
    b_low   : out std_logic
  );
end entity;

architecture rtl of timer_pwm is

  function bits(value : positive) return positive is
    variable left  : natural  := value / 2;
    variable count : positive := 1;
  begin
    while left > 0 loop
      left  := left / 2;
      count := count + 1;
    end loop;
    return count;
  end function;

  constant LAST        : positive := PRESCALE * STEPS - 1;
  constant PHASE_WIDTH : positive := bits(LAST);
  -- Room for PRESCALE times a command and the centre.
  constant PULSE_WIDTH : positive := maximum(COMMAND_WIDTH, bits(STEPS) + 1) + 1 + bits(PRESCALE) + 1;

  function pulse(word : signed) return signed is
    constant WIDTH : positive := maximum(COMMAND_WIDTH, bits(STEPS) + 1) + 1;
    constant DUTY  : signed(WIDTH - 1 downto 0) := resize(word, WIDTH) + to_signed(CENTRE, WIDTH);
  begin
    return DUTY * to_signed(PRESCALE, bits(PRESCALE) + 1);
  end function;

begin

  process (clk)
    variable phase : unsigned(PHASE_WIDTH - 1 downto 0);
    variable held  : signed(COMMAND_WIDTH - 1 downto 0);
    variable on_b  : boolean;
  begin
    if rising_edge(clk) then
      if phase = 0 then
        held := signed(command);
      end if;

      on_b := pulse(held) > signed(resize(phase, maximum(PHASE_WIDTH, PULSE_WIDTH) + 1));
      if on_b then
        a_high <= '0';
        a_low  <= '1';
        b_high <= '1';
        b_low  <= '0';
      else
        a_high <= '1';
        a_low  <= '0';
        b_high <= '0';
        b_low  <= '1';
      end if;

      if phase = LAST then
        phase := (others => '0');
      else
        phase := phase + 1;
      end if;

      if rst = '1' then
        phase  := (others => '0');
        held   := (others => '0');
        a_high <= '0';
        a_low  <= '0';
        b_high <= '0';
        b_low  <= '0';
      end if;
    end if;
  end process;

end architecture;
