-- epfl_paddle_loop : the position and the current controller of EPFL's haptic paddle
--
-- The position controller asks for a current, the current controller sets the duty
-- of the bridge. Each samples at the second edge of its own period.
--
--   pins -> sync -> decoder -> counter -> offset -> delta -+
--                                          hall, analog -> select -> angle
--                target, share, gains ---+                           |
--                haptic_timer ---------> haptic <--------------------+
--                                          |
--                                         aim
--                                          v
--   code -> window_of_codes -> sum -> current_control -> command -> modulator -> gates
--                current_timer ------------^
--
-- generics POSITION_WIDTH, HALL_WIDTH   bits of the encoder's angle, of the analog code
--          FRAC .. HAPTIC_SUM_FRAC      of filtered_pid, of the angle; AIM_WIDTH,
--                                       AIM_LEAST, AIM_MOST of the wanted current
--          CODE_WIDTH, WINDOW, SUM_WIDTH  of window_sum
--          CURRENT_FRAC .. CURRENT_SUM_FRAC  of filtered_pid, of the current;
--                                       DUTY_WIDTH, DUTY_LEAST, DUTY_MOST of the duty
--          PRESCALE, STEPS, CENTRE      of timer_pwm
--          PERIOD_WIDTH                 bits of a period, 2 to 30
-- in       a_pin, b_pin (0,1,0)                encoder lines, asynchronous
--          reference    (0,POSITION_WIDTH,0)   position that is the angle 0
--          hall         (0,HALL_WIDTH,0)       code of the analog angle sensor
--          analog       (0,1,0)                that sensor is read
--          code         (1,CODE_WIDTH-1,0)     code of the current's converter
--          zero         (1,SUM_WIDTH-1,0)      WINDOW codes that stand for 0
--          target       (1,TARGET_WIDTH-1-TARGET_FRAC,TARGET_FRAC)  wanted angle
--          share        (0,0,16)               of a new angle in the filter
--          proportional, integral, derivative (0,GAIN_WIDTH-GAIN_FRAC,GAIN_FRAC)
--          current_share (0,0,16)              of a new sum in the filter
--          current_proportional, current_integral, forward
--                        (0,CURRENT_GAIN_WIDTH-CURRENT_GAIN_FRAC,CURRENT_GAIN_FRAC)
--          adc_period, current_period, haptic_period (0,PERIOD_WIDTH,0)  in clocks,
--                                              0 acts as 1
-- out      a_high, a_low, b_high, b_low (0,1,0)  gates of the H-bridge
-- latency  a pin comes to the angle in 4 edges, a code to the sum in 1; a controller
--          takes 1 edge; then the modulator waits for its period
-- reset    synchronous, to every clocked block
-- overflow as in the blocks
-- source   the firmware of EPFL's haptic paddle of 12 April 2018
-- differs from the hardware: the firmware computes in float32 on a microcontroller,
--          whose interrupts start some microseconds late; here a sample takes one
--          edge.

library ieee;
use ieee.std_logic_1164.all;

entity epfl_paddle_loop is
  generic (
    POSITION_WIDTH     : positive := 14;
    HALL_WIDTH         : positive := 12;
    FRAC               : natural  := 12;
    TARGET_WIDTH       : positive := 26;
    TARGET_FRAC        : natural  := 12;
    GAIN_WIDTH         : positive := 30;
    GAIN_FRAC          : natural  := 14;
    AIM_WIDTH          : positive := 16;
    AIM_LEAST          : integer  := -24339;
    AIM_MOST           : integer  := 24339;
    HAPTIC_SUM_LIMIT   : natural  := 2147483647;
    HAPTIC_SUM_FRAC    : natural  := 0;
    CODE_WIDTH         : positive := 12;
    WINDOW             : positive := 33;
    SUM_WIDTH          : positive := 18;
    CURRENT_FRAC       : natural  := 12;
    CURRENT_GAIN_WIDTH : positive := 24;
    CURRENT_GAIN_FRAC  : natural  := 24;
    DUTY_WIDTH         : positive := 10;
    DUTY_LEAST         : integer  := -501;
    DUTY_MOST          : integer  := 500;
    CURRENT_SUM_LIMIT  : natural  := 223259307;
    CURRENT_SUM_FRAC   : natural  := 20;
    PRESCALE           : positive := 5;
    STEPS              : positive := 1024;
    CENTRE             : natural  := 511;
    PERIOD_WIDTH       : positive range 2 to 30 := 24
  );
  port (
    clk                  : in  std_logic;
    rst                  : in  std_logic;
    a_pin                : in  std_logic;
    b_pin                : in  std_logic;
    reference            : in  std_logic_vector(POSITION_WIDTH - 1 downto 0);
    hall                 : in  std_logic_vector(HALL_WIDTH - 1 downto 0);
    analog               : in  std_logic;
    code                 : in  std_logic_vector(CODE_WIDTH - 1 downto 0);
    zero                 : in  std_logic_vector(SUM_WIDTH - 1 downto 0);
    target               : in  std_logic_vector(TARGET_WIDTH - 1 downto 0);
    share                : in  std_logic_vector(15 downto 0);
    proportional         : in  std_logic_vector(GAIN_WIDTH - 1 downto 0);
    integral             : in  std_logic_vector(GAIN_WIDTH - 1 downto 0);
    derivative           : in  std_logic_vector(GAIN_WIDTH - 1 downto 0);
    current_share        : in  std_logic_vector(15 downto 0);
    current_proportional : in  std_logic_vector(CURRENT_GAIN_WIDTH - 1 downto 0);
    current_integral     : in  std_logic_vector(CURRENT_GAIN_WIDTH - 1 downto 0);
    forward              : in  std_logic_vector(CURRENT_GAIN_WIDTH - 1 downto 0);
    adc_period           : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    current_period       : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    haptic_period        : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    a_high               : out std_logic;
    a_low                : out std_logic;
    b_high               : out std_logic;
    b_low                : out std_logic
  );
end entity;

architecture rtl of epfl_paddle_loop is

  signal a              : std_logic;
  signal b              : std_logic;
  signal step           : std_logic_vector(1 downto 0);
  signal error          : std_logic;  -- for the waveform only
  signal position       : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal delta          : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal angle          : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal haptic_sample  : std_logic;
  signal filtered       : std_logic_vector(POSITION_WIDTH + FRAC - 1 downto 0);  -- for the waveform only
  signal aim            : std_logic_vector(AIM_WIDTH - 1 downto 0);
  signal sum            : std_logic_vector(SUM_WIDTH downto 0);
  signal current_sample : std_logic;
  signal current        : std_logic_vector(SUM_WIDTH + CURRENT_FRAC downto 0);  -- for the waveform only
  signal command        : std_logic_vector(DUTY_WIDTH - 1 downto 0);

begin

  sync : entity work.synchronizer
    port map (
      clk   => clk,
      rst   => rst,
      a_pin => a_pin,
      b_pin => b_pin,
      a     => a,
      b     => b
    );

  decoder : entity work.quadrature_decoder
    port map (
      clk   => clk,
      rst   => rst,
      a     => a,
      b     => b,
      step  => step,
      error => error
    );

  counter : entity work.position_counter
    generic map (
      WIDTH => POSITION_WIDTH
    )
    port map (
      clk      => clk,
      rst      => rst,
      step     => step,
      position => position
    );

  offset : entity work.displacement
    generic map (
      WIDTH => POSITION_WIDTH
    )
    port map (
      position  => position,
      reference => reference,
      delta     => delta
    );

  select_angle : entity work.angle_select
    generic map (
      WIDTH      => POSITION_WIDTH,
      CODE_WIDTH => HALL_WIDTH
    )
    port map (
      delta  => delta,
      code   => hall,
      analog => analog,
      angle  => angle
    );

  haptic_timer : entity work.sample_timer
    generic map (
      PERIOD_WIDTH => PERIOD_WIDTH
    )
    port map (
      clk    => clk,
      rst    => rst,
      period => haptic_period,
      sample => haptic_sample
    );

  haptic : entity work.filtered_pid
    generic map (
      WIDTH         => POSITION_WIDTH,
      FRAC          => FRAC,
      TARGET_WIDTH  => TARGET_WIDTH,
      TARGET_FRAC   => TARGET_FRAC,
      GAIN_WIDTH    => GAIN_WIDTH,
      GAIN_FRAC     => GAIN_FRAC,
      COMMAND_WIDTH => AIM_WIDTH,
      LEAST         => AIM_LEAST,
      MOST          => AIM_MOST,
      SUM_LIMIT     => HAPTIC_SUM_LIMIT,
      SUM_FRAC      => HAPTIC_SUM_FRAC
    )
    port map (
      clk          => clk,
      rst          => rst,
      target       => target,
      measured     => angle,
      share        => share,
      proportional => proportional,
      integral     => integral,
      derivative   => derivative,
      forward      => (others => '0'),
      sample       => haptic_sample,
      filtered     => filtered,
      command      => aim
    );

  window_of_codes : entity work.window_sum
    generic map (
      CODE_WIDTH   => CODE_WIDTH,
      WINDOW       => WINDOW,
      SUM_WIDTH    => SUM_WIDTH,
      PERIOD_WIDTH => PERIOD_WIDTH
    )
    port map (
      clk    => clk,
      rst    => rst,
      code   => code,
      zero   => zero,
      period => adc_period,
      sum    => sum
    );

  current_timer : entity work.sample_timer
    generic map (
      PERIOD_WIDTH => PERIOD_WIDTH
    )
    port map (
      clk    => clk,
      rst    => rst,
      period => current_period,
      sample => current_sample
    );

  current_control : entity work.filtered_pid
    generic map (
      WIDTH         => SUM_WIDTH + 1,
      FRAC          => CURRENT_FRAC,
      TARGET_WIDTH  => AIM_WIDTH,
      TARGET_FRAC   => 0,
      GAIN_WIDTH    => CURRENT_GAIN_WIDTH,
      GAIN_FRAC     => CURRENT_GAIN_FRAC,
      COMMAND_WIDTH => DUTY_WIDTH,
      LEAST         => DUTY_LEAST,
      MOST          => DUTY_MOST,
      SUM_LIMIT     => CURRENT_SUM_LIMIT,
      SUM_FRAC      => CURRENT_SUM_FRAC
    )
    port map (
      clk          => clk,
      rst          => rst,
      target       => aim,
      measured     => sum,
      share        => current_share,
      proportional => current_proportional,
      integral     => current_integral,
      derivative   => (others => '0'),
      forward      => forward,
      sample       => current_sample,
      filtered     => current,
      command      => command
    );

  modulator : entity work.timer_pwm
    generic map (
      COMMAND_WIDTH => DUTY_WIDTH,
      PRESCALE      => PRESCALE,
      STEPS         => STEPS,
      CENTRE        => CENTRE
    )
    port map (
      clk     => clk,
      rst     => rst,
      command => command,
      a_high  => a_high,
      a_low   => a_low,
      b_high  => b_high,
      b_low   => b_low
    );

end architecture;
