-- three_phase_pwm : three legs around an up-down carrier, with dead time and trigger
--
-- One period is 2*STEPS clocks, from valley to valley of the carrier. Each edge, in
-- this order:
--   1. at phase 0, with PEAK also at phase STEPS: the duties are taken, trigger is '1'
--      for one clock. Taken are
--        0      for a duty < MIN_PULSE
--        STEPS  for a duty > STEPS - MIN_PULSE
--        duty   otherwise
--   2. sample is '1' for one clock, SAMPLE_DELAY clocks after trigger, if enable is '1'
--   3. wanted legs
--        off   while enable is '0'
--        high  while STEPS - duty <= phase < STEPS + duty
--        low   otherwise
--   4. a leg whose wanted state changes waits DEAD_TIME clocks with both gates off,
--      another change on the way begins the wait again; then it takes that state
--   5. phase := (phase + 1) mod 2*STEPS, also while enable is '0'
--
-- So a pulse lies around the peak, and at the valley the low switches carry the
-- currents. While enable stays, no pulse and no gap that is wanted is shorter than
-- MIN_PULSE clocks, with a constant duty than 2*MIN_PULSE; the dead time is taken off
-- a pulse.
--
-- generics DUTY_WIDTH    bits of the duties, 2 to 16
--          STEPS         steps from valley to peak, each a clock
--          DEAD_TIME     clocks between the gates of one leg, below STEPS
--          MIN_PULSE     the least duty that is not dropped, at most STEPS/2
--          SAMPLE_DELAY  clocks from trigger to sample, 1 to STEPS-1
--          PEAK          duties are taken at the peak too
-- in       duty_a, duty_b, duty_c (0,DUTY_WIDTH,0)   steps
--          enable  (0,1,0)   '0' turns all gates off
-- out      a_high, a_low, b_high, b_low, c_high, c_low (0,1,0)   1 = gate on
--          trigger (0,1,0)   converters begin
--          sample  (0,1,0)   the converters' words are there
-- latency  1 edge; a duty waits for the valley (PEAK: or the peak); a gate turns on
--          DEAD_TIME clocks later, off at once
-- reset    phase 0, duties 0, all legs off, all outputs 0
-- overflow a duty above STEPS is STEPS
-- source   common practice; the timers of motor controllers have the same parts
-- differs from the hardware: gates switch at the clock edge, with no driver delay
--          and no rise or fall time.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity three_phase_pwm is
  generic (
    DUTY_WIDTH   : positive := 11;
    STEPS        : positive := 1250;
    DEAD_TIME    : natural  := 25;
    MIN_PULSE    : natural  := 20;
    SAMPLE_DELAY : positive := 100;
    PEAK         : boolean  := false
  );
  port (
    clk     : in  std_logic;
    rst     : in  std_logic;
    duty_a  : in  std_logic_vector(DUTY_WIDTH - 1 downto 0);
    duty_b  : in  std_logic_vector(DUTY_WIDTH - 1 downto 0);
    duty_c  : in  std_logic_vector(DUTY_WIDTH - 1 downto 0);
    enable  : in  std_logic;
    a_high  : out std_logic;
    a_low   : out std_logic;
    b_high  : out std_logic;
    b_low   : out std_logic;
    c_high  : out std_logic;
    c_low   : out std_logic;
    trigger : out std_logic;
    sample  : out std_logic
  );
end entity;

architecture rtl of three_phase_pwm is

  constant PERIOD : positive := 2 * STEPS;

  subtype phase_number is natural range 0 to PERIOD - 1;
  subtype duty_number  is natural range 0 to STEPS;

  type level is (off, low, high);

  type half_bridge is record
    target : level;
    dead   : natural range 0 to DEAD_TIME;
  end record;

  function taken(word : std_logic_vector) return duty_number is
    constant DUTY : natural := to_integer(unsigned(word));
  begin
    if DUTY < MIN_PULSE then
      return 0;
    elsif DUTY > STEPS - MIN_PULSE then
      return STEPS;
    end if;
    return DUTY;
  end function;

  -- Whether that many clocks have passed since the valley, or since the peak.
  function marks(phase : phase_number; clocks : natural) return boolean is
  begin
    return phase = clocks or (PEAK and phase = STEPS + clocks);
  end function;

  function wanted(phase : phase_number; held : duty_number; runs : std_logic) return level is
  begin
    if runs = '0' then
      return off;
    elsif phase >= STEPS - held and phase < STEPS + held then
      return high;
    end if;
    return low;
  end function;

  -- A new target restarts the dead time, even in the middle of another one.
  procedure drive(leg : inout half_bridge; target : in level) is
  begin
    if target /= leg.target then
      leg := (target => target, dead => DEAD_TIME);
    elsif leg.dead > 0 then
      leg.dead := leg.dead - 1;
    end if;
  end procedure;

  function gate(leg : half_bridge; side : level) return std_logic is
  begin
    if leg.target = side and leg.dead = 0 then
      return '1';
    end if;
    return '0';
  end function;

begin

  process (clk)
    variable phase  : phase_number;
    variable held_a : duty_number;
    variable held_b : duty_number;
    variable held_c : duty_number;
    variable leg_a  : half_bridge;
    variable leg_b  : half_bridge;
    variable leg_c  : half_bridge;
  begin
    if rising_edge(clk) then
      trigger <= '0';
      if marks(phase, 0) then
        held_a  := taken(duty_a);
        held_b  := taken(duty_b);
        held_c  := taken(duty_c);
        trigger <= '1';
      end if;

      sample <= '0';
      if marks(phase, SAMPLE_DELAY) then
        sample <= enable;
      end if;

      drive(leg_a, wanted(phase, held_a, enable));
      drive(leg_b, wanted(phase, held_b, enable));
      drive(leg_c, wanted(phase, held_c, enable));
      a_high <= gate(leg_a, high);
      a_low  <= gate(leg_a, low);
      b_high <= gate(leg_b, high);
      b_low  <= gate(leg_b, low);
      c_high <= gate(leg_c, high);
      c_low  <= gate(leg_c, low);

      if phase = PERIOD - 1 then
        phase := 0;
      else
        phase := phase + 1;
      end if;

      if rst = '1' then
        phase   := 0;
        held_a  := 0;
        held_b  := 0;
        held_c  := 0;
        leg_a   := (target => off, dead => 0);
        leg_b   := (target => off, dead => 0);
        leg_c   := (target => off, dead => 0);
        a_high  <= '0';
        a_low   <= '0';
        b_high  <= '0';
        b_low   <= '0';
        c_high  <= '0';
        c_low   <= '0';
        trigger <= '0';
        sample  <= '0';
      end if;
    end if;
  end process;

end architecture;
