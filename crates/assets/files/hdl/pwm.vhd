-- pwm : counter-compare modulator with the four gates of an H-bridge
--
-- One period is 2^WIDTH clocks. Each edge, in this order:
--   1. held := command, at phase 0 only when LATCHED
--   2. active := phase < |held|                       sign/magnitude
--                phase < floor((held + 2^WIDTH) / 2)  ANTIPHASE
--   3. wanted legs          A     B
--        active, held > 0   high  low
--        active, held < 0   low   high
--        not active         low   low   (brake; both off when FLOATING)
--      ANTIPHASE
--        active             high  low
--        not active         low   high
--   4. a leg whose wanted state changes waits DEAD_TIME clocks with both gates off,
--      another change on the way begins the wait again; then it takes that state
--   5. phase := (phase + 1) mod 2^WIDTH
--
-- generics WIDTH      bits of the magnitude, at most 30
--          ANTIPHASE  locked antiphase instead of sign/magnitude
--          LATCHED    the command is held for a whole period
--          FLOATING   coast instead of brake; sign/magnitude only
--          DEAD_TIME  clocks between the gates of one leg; 0 switches at once
-- in       command (1,WIDTH,0)  duty in clocks of the period; sign = direction
-- out      a_high, a_low, b_high, b_low (0,1,0)  1 = gate on
-- latency  1 edge, plus the rest of the period when LATCHED, plus DEAD_TIME
-- reset    phase 0, held 0, all legs off, all gates 0
-- overflow a magnitude of 2^WIDTH is 100 %
-- source   Vasudevan et al. 2007, the PWM drive of the motor; the gates and the
--          dead time are common practice
-- differs from the hardware: gates switch at the clock edge, with no driver
--          delay and no rise or fall time.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity pwm is
  generic (
    WIDTH     : positive := 12;
    ANTIPHASE : boolean  := false;
    LATCHED   : boolean  := true;
    FLOATING  : boolean  := false;
    DEAD_TIME : natural  := 0
  );
  port (
    clk     : in  std_logic;
    rst     : in  std_logic;
    command : in  std_logic_vector(WIDTH downto 0);
    a_high  : out std_logic;
    a_low   : out std_logic;
    b_high  : out std_logic;
    b_low   : out std_logic
  );
end entity;

architecture rtl of pwm is

  constant FULL : positive := 2**WIDTH;

  type level is (off, low, high);

  type half_bridge is record
    target : level;
    dead   : natural range 0 to DEAD_TIME;
  end record;

  -- A new target restarts the dead time, even in the middle of another one.
  procedure drive(leg : inout half_bridge; wanted : in level) is
  begin
    if wanted /= leg.target then
      leg := (target => wanted, dead => DEAD_TIME);
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
    variable phase  : natural range 0 to FULL - 1;
    variable held   : integer range -FULL to FULL - 1;
    variable active : boolean;
    variable want_a : level;
    variable want_b : level;
    variable leg_a  : half_bridge;
    variable leg_b  : half_bridge;
  begin
    if rising_edge(clk) then
      if phase = 0 or not LATCHED then
        held := to_integer(signed(command));
      end if;

      if ANTIPHASE then
        active := phase < (held + FULL) / 2;
      else
        -- One of the two is below zero, where no phase is.
        active := phase < held or phase < -held;
      end if;

      if active and (held > 0 or ANTIPHASE) then
        want_a := high;
        want_b := low;
      elsif active or ANTIPHASE then
        want_a := low;
        want_b := high;
      elsif FLOATING then
        want_a := off;
        want_b := off;
      else
        want_a := low;
        want_b := low;
      end if;

      drive(leg_a, want_a);
      drive(leg_b, want_b);
      a_high <= gate(leg_a, high);
      a_low  <= gate(leg_a, low);
      b_high <= gate(leg_b, high);
      b_low  <= gate(leg_b, low);

      phase := (phase + 1) mod FULL;

      if rst = '1' then
        phase  := 0;
        held   := 0;
        leg_a  := (target => off, dead => 0);
        leg_b  := (target => off, dead => 0);
        a_high <= '0';
        a_low  <= '0';
        b_high <= '0';
        b_low  <= '0';
      end if;
    end if;
  end process;

end architecture;
