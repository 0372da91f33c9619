-- position_pid : a PID controller whose target is the reference of the loop
--
--   target = (position - delta) mod 2^WIDTH, the loop's reference
--   torque = -command
-- where command is that of a pid with measured = position, the gains
--   proportional = stiffness, derivative = damping, integral = INTEGRAL
-- and, at a sample edge,
--   d            := (target - memory) mod 2^WIDTH, read as two's complement
--   feed_forward := clamp(floor(FEED_FORWARD * d / 2^DAMPING_FRAC), -LIMIT, LIMIT)
--   memory       := target
-- The controller's gains have one format: as many integer bits, and as many
-- fraction bits, as the one of the three that has the most.
--
-- generics WIDTH                            bits of the position
--          STIFFNESS_WIDTH, STIFFNESS_FRAC  bits of the stiffness, its fraction
--          DAMPING_WIDTH, DAMPING_FRAC      bits of the damping, its fraction
--          PERIOD_WIDTH                     bits of the period, 2 to 30
--          SCALE_WIDTH, SCALE_FRAC          bits of the scale, its fraction
--          TORQUE_WIDTH                     bits of a torque's magnitude, at most 30
--          INTEGRAL                         gain of the sum of errors, a word of
--          INTEGRAL_WIDTH, INTEGRAL_FRAC    so many bits, and its fraction; all three
--                                           gains together have at most 24 bits
--          LIMIT                            the greatest torque
--          BACK_CALCULATION, BACK           see pid
--          FEED_FORWARD                     torque for a motion of the target, a word
--                                           of DAMPING_FRAC fraction bits; 0 for none,
--                                           at most 2^24 - 1
-- in       position    (0,WIDTH,0)
--          delta       (1,WIDTH-1,0)        position minus reference
--          contact     (0,1,0)              ignored
--          penetration (0,WIDTH,0)          ignored
--          stiffness   (0,STIFFNESS_WIDTH-STIFFNESS_FRAC,STIFFNESS_FRAC)
--                                           PWM counts per position count
--          damping     (0,DAMPING_WIDTH-DAMPING_FRAC,DAMPING_FRAC)
--                                           PWM counts per count per sample
--          period      (0,PERIOD_WIDTH,0)   sample period in clocks, 0 acts as 1
--          scale       (0,SCALE_WIDTH-SCALE_FRAC,SCALE_FRAC)  ignored
-- out      torque      (1,TORQUE_WIDTH+1,0) against the positive direction
--          memory      (0,WIDTH,0)          the target of the latest sample
-- latency  1 edge, sample edges only; a new period takes effect at the next
--          sample edge
-- reset    everything 0; the first edge after it is a sample edge
-- overflow command, sum and feed-forward clamp; differences wrap
-- source   that of pid; the feed-forward of the target's speed as in servo drives
-- differs from the hardware: as in pid.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity position_pid is
  generic (
    WIDTH            : positive := 12;
    STIFFNESS_WIDTH  : positive := 12;
    STIFFNESS_FRAC   : natural  := 0;
    DAMPING_WIDTH    : positive := 12;
    DAMPING_FRAC     : natural  := 0;
    PERIOD_WIDTH     : positive range 2 to 30 := 24;
    SCALE_WIDTH      : positive := 16;
    SCALE_FRAC       : natural  := 8;
    TORQUE_WIDTH     : positive := 12;
    INTEGRAL         : natural  := 16;
    INTEGRAL_WIDTH   : positive := 12;
    INTEGRAL_FRAC    : natural  := 8;
    LIMIT            : positive := 4095;
    BACK_CALCULATION : boolean  := false;
    BACK             : natural  := 4;
    FEED_FORWARD     : natural  := 0
  );
  port (
    clk         : in  std_logic;
    rst         : in  std_logic;
    position    : in  std_logic_vector(WIDTH - 1 downto 0);
    delta       : in  std_logic_vector(WIDTH - 1 downto 0);
    contact     : in  std_logic;
    penetration : in  std_logic_vector(WIDTH - 1 downto 0);
    stiffness   : in  std_logic_vector(STIFFNESS_WIDTH - 1 downto 0);
    damping     : in  std_logic_vector(DAMPING_WIDTH - 1 downto 0);
    period      : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    scale       : in  std_logic_vector(SCALE_WIDTH - 1 downto 0);
    torque      : out std_logic_vector(TORQUE_WIDTH + 1 downto 0);
    memory      : out std_logic_vector(WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of position_pid is

  constant GAIN_FRAC  : natural
    := maximum(maximum(STIFFNESS_FRAC, DAMPING_FRAC), INTEGRAL_FRAC);
  constant GAIN_WIDTH : positive
    := GAIN_FRAC + maximum(maximum(STIFFNESS_WIDTH - STIFFNESS_FRAC,
                                   DAMPING_WIDTH - DAMPING_FRAC),
                           INTEGRAL_WIDTH - INTEGRAL_FRAC);
  -- Room for a constant of 24 bits, a motion and their fraction.
  constant WIDE       : positive := maximum(25 + WIDTH, TORQUE_WIDTH + 2 + DAMPING_FRAC);

  constant MOST       : signed(WIDE - 1 downto 0) := to_signed(LIMIT, WIDE);

  function gain(word : std_logic_vector; frac : natural) return std_logic_vector is
  begin
    return std_logic_vector(shift_left(resize(unsigned(word), GAIN_WIDTH), GAIN_FRAC - frac));
  end function;

  signal target       : std_logic_vector(WIDTH - 1 downto 0);
  signal motion       : signed(WIDTH - 1 downto 0);
  signal product      : signed(WIDE - 1 downto 0);
  signal ahead        : signed(WIDE - 1 downto 0);
  signal limited      : signed(WIDE - 1 downto 0);
  signal given        : std_logic_vector(TORQUE_WIDTH downto 0);
  signal proportional : std_logic_vector(GAIN_WIDTH - 1 downto 0);
  signal summing      : std_logic_vector(GAIN_WIDTH - 1 downto 0);
  signal derivative   : std_logic_vector(GAIN_WIDTH - 1 downto 0);
  signal command      : std_logic_vector(TORQUE_WIDTH downto 0);
  signal aimed        : std_logic_vector(WIDTH - 1 downto 0);

begin

  target       <= std_logic_vector(unsigned(position) - unsigned(delta));
  proportional <= gain(stiffness, STIFFNESS_FRAC);
  derivative   <= gain(damping, DAMPING_FRAC);
  summing      <= gain(std_logic_vector(to_unsigned(INTEGRAL, INTEGRAL_WIDTH)), INTEGRAL_FRAC);

  motion       <= signed(unsigned(target) - unsigned(aimed));
  product      <= resize(to_signed(FEED_FORWARD, 25) * motion, WIDE);
  -- A slice, not shift_right: GHDL 2.0 writes that into a Verilog netlist without the
  -- sign.
  ahead        <= resize(product(WIDE - 1 downto DAMPING_FRAC), WIDE);
  limited      <= MOST when ahead > MOST else -MOST when ahead < -MOST else ahead;
  given        <= std_logic_vector(limited(TORQUE_WIDTH downto 0));

  controller : entity work.pid
    generic map (
      WIDTH            => WIDTH,
      GAIN_WIDTH       => GAIN_WIDTH,
      GAIN_FRAC        => GAIN_FRAC,
      COMMAND_WIDTH    => TORQUE_WIDTH + 1,
      LIMIT            => LIMIT,
      BACK_CALCULATION => BACK_CALCULATION,
      BACK             => BACK,
      FORWARDED        => FEED_FORWARD > 0,
      PERIOD_WIDTH     => PERIOD_WIDTH
    )
    port map (
      clk          => clk,
      rst          => rst,
      target       => target,
      measured     => position,
      feed_forward => given,
      proportional => proportional,
      integral     => summing,
      derivative   => derivative,
      period       => period,
      command      => command
    );

  torque <= std_logic_vector(-resize(signed(command), TORQUE_WIDTH + 2));
  memory <= aimed;

  process (clk)
    -- 2^PERIOD_WIDTH - 2, written to stay inside an integer for 31 bits.
    variable countdown : natural range 0 to 2 * (2**(PERIOD_WIDTH - 1) - 1);
  begin
    if rising_edge(clk) then
      if countdown = 0 then
        aimed     <= target;
        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        countdown := countdown - 1;
      end if;

      if rst = '1' then
        countdown := 0;
        aimed     <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
