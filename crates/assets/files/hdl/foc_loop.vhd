-- foc_loop : the current loops of a three-phase motor under field-oriented control
--
-- The modulator's trigger starts the converters of the currents. SAMPLE_DELAY clocks
-- later both controllers take a sample; the modulator takes the duties at its next
-- valley. The wanted current along the flux is 0, that across it is target.
--
--   pins -> sync -> decoder -> counter -> from_zero -> delta -> angle -> sine, cosine
--                                  offset ---^                             |
--   i_a, i_b -> stator -> alpha, beta -> rotor <---------------------------+
--                                          |                               |
--                                         d, q                             |
--                                          v                               |
--        target, gains ---> control_d, control_q -> v_d, v_q -> voltage <--+
--                                          ^                       |
--                                          |                v_alpha, v_beta
--                                        sample                    v
--                                          |                     duties
--                                          |                       |
--              gates, trigger <- modulator +<- duty_a, duty_b, duty_c
--
-- A count is POLE_PAIRS / COUNTS turns of the field, to the nearest of 2^PHASE_WIDTH
-- in a turn. The counter wraps at 2^POSITION_WIDTH counts: where these are no whole
-- number of turns of the rotor, the angle is wrong from there on.
--
-- generics POSITION_WIDTH               bits of the position, 4 to 24
--          POLE_PAIRS                   turns of the field in one of the rotor
--          COUNTS                       counts in a turn of the rotor, at most 2^20
--          PHASE_WIDTH .. TRIG_FRAC     of trig_cordic
--          CODE_WIDTH, FRAC             of clarke
--          FILTER_FRAC .. GAIN_FRAC     of filtered_pid
--          VOLTAGE_WIDTH                bits of the voltages; 2^(VOLTAGE_WIDTH-1) is
--                                       the supply
--          LIMIT                        the greatest voltage of each controller, and
--                                       of its sum
--          DUTY_WIDTH .. PEAK           of three_phase_pwm
--          SINUSOIDAL                   of space_vector
-- in       a_pin, b_pin  (0,1,0)                 encoder lines, asynchronous
--          offset        (0,POSITION_WIDTH,0)    position with an electrical angle of 0
--          i_a, i_b      (1,CODE_WIDTH-1,0)      codes of the phase currents
--          target        (1,CODE_WIDTH,FRAC)     wanted current across the flux
--          proportional, integral (0,GAIN_WIDTH-GAIN_FRAC,GAIN_FRAC)
--                                                voltage for 2^-FRAC codes, of a sample
--          enable        (0,1,0)                 '0': no samples, all gates off
-- out      a_high, a_low, b_high, b_low, c_high, c_low (0,1,0)   1 = gate on
--          trigger       (0,1,0)                 the converters begin
-- latency  a pin comes to the sines in 5 edges; a sample to the voltages in 1; then
--          the duties wait for the valley
-- reset    synchronous, to every clocked block
-- overflow as in the blocks; the vector of both voltages has no limit of its own:
--          beyond the modulator's range the duties clamp
-- source   the control in the coordinates of the field of the textbooks, as in
--          Blaschke 1972
-- differs from the hardware: combinational paths settle within the clock they change
--          in; SAMPLE_DELAY and the wait for the valley are the time a real one would
--          be given.

library ieee;
use ieee.std_logic_1164.all;

entity foc_loop is
  generic (
    POSITION_WIDTH : positive := 16;
    POLE_PAIRS     : positive := 7;
    COUNTS         : positive := 4096;
    PHASE_WIDTH    : positive := 36;
    ITERATIONS     : positive := 17;
    GUARD          : natural  := 4;
    TRIG_FRAC      : positive := 14;
    CODE_WIDTH     : positive := 12;
    FRAC           : natural  := 3;
    FILTER_FRAC    : natural  := 5;
    GAIN_WIDTH     : positive := 24;
    GAIN_FRAC      : natural  := 16;
    VOLTAGE_WIDTH  : positive := 15;
    LIMIT          : positive := 9459;
    DUTY_WIDTH     : positive := 11;
    STEPS          : positive := 1250;
    DEAD_TIME      : natural  := 25;
    MIN_PULSE      : natural  := 20;
    SAMPLE_DELAY   : positive := 100;
    PEAK           : boolean  := false;
    SINUSOIDAL     : boolean  := false
  );
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    a_pin        : in  std_logic;
    b_pin        : in  std_logic;
    offset       : in  std_logic_vector(POSITION_WIDTH - 1 downto 0);
    i_a          : in  std_logic_vector(CODE_WIDTH - 1 downto 0);
    i_b          : in  std_logic_vector(CODE_WIDTH - 1 downto 0);
    target       : in  std_logic_vector(CODE_WIDTH + FRAC downto 0);
    proportional : in  std_logic_vector(GAIN_WIDTH - 1 downto 0);
    integral     : in  std_logic_vector(GAIN_WIDTH - 1 downto 0);
    enable       : in  std_logic;
    a_high       : out std_logic;
    a_low        : out std_logic;
    b_high       : out std_logic;
    b_low        : out std_logic;
    c_high       : out std_logic;
    c_low        : out std_logic;
    trigger      : out std_logic
  );
end entity;

architecture rtl of foc_loop is

  -- A count in 2^PHASE_WIDTH of a turn of the field.
  constant COUNT_PHASE : natural
    := integer(real(POLE_PAIRS) * 2.0**PHASE_WIDTH / real(COUNTS));

  signal a          : std_logic;
  signal b          : std_logic;
  signal step       : std_logic_vector(1 downto 0);
  signal error      : std_logic;  -- for the waveform only
  signal position   : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal delta      : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal sine       : std_logic_vector(TRIG_FRAC + 1 downto 0);
  signal cosine     : std_logic_vector(TRIG_FRAC + 1 downto 0);
  signal valid      : std_logic;  -- for the waveform only
  signal alpha      : std_logic_vector(CODE_WIDTH + FRAC downto 0);
  signal beta       : std_logic_vector(CODE_WIDTH + FRAC downto 0);
  signal d          : std_logic_vector(CODE_WIDTH + FRAC downto 0);
  signal q          : std_logic_vector(CODE_WIDTH + FRAC downto 0);
  signal filtered_d : std_logic_vector(CODE_WIDTH + FRAC + FILTER_FRAC downto 0);  -- for the waveform only
  signal v_d        : std_logic_vector(VOLTAGE_WIDTH - 1 downto 0);
  signal filtered_q : std_logic_vector(CODE_WIDTH + FRAC + FILTER_FRAC downto 0);  -- for the waveform only
  signal v_q        : std_logic_vector(VOLTAGE_WIDTH - 1 downto 0);
  signal v_alpha    : std_logic_vector(VOLTAGE_WIDTH - 1 downto 0);
  signal v_beta     : std_logic_vector(VOLTAGE_WIDTH - 1 downto 0);
  signal duty_a     : std_logic_vector(DUTY_WIDTH - 1 downto 0);
  signal duty_b     : std_logic_vector(DUTY_WIDTH - 1 downto 0);
  signal duty_c     : std_logic_vector(DUTY_WIDTH - 1 downto 0);
  signal sample     : std_logic;

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

  from_zero : entity work.displacement
    generic map (
      WIDTH => POSITION_WIDTH
    )
    port map (
      position  => position,
      reference => offset,
      delta     => delta
    );

  angle : entity work.trig_cordic
    generic map (
      COUNT_WIDTH => POSITION_WIDTH,
      ITERATIONS  => ITERATIONS,
      GUARD       => GUARD,
      PHASE_WIDTH => PHASE_WIDTH,
      STEP        => COUNT_PHASE,
      TRIG_INT    => 1,
      TRIG_FRAC   => TRIG_FRAC
    )
    port map (
      clk    => clk,
      rst    => rst,
      count  => delta,
      sine   => sine,
      cosine => cosine,
      valid  => valid
    );

  stator : entity work.clarke
    generic map (
      WIDTH => CODE_WIDTH,
      FRAC  => FRAC,
      THREE => false
    )
    port map (
      a     => i_a,
      b     => i_b,
      c     => (others => '0'),
      alpha => alpha,
      beta  => beta
    );

  rotor : entity work.park
    generic map (
      WIDTH     => CODE_WIDTH + FRAC + 1,
      TRIG_INT  => 1,
      TRIG_FRAC => TRIG_FRAC
    )
    port map (
      alpha  => alpha,
      beta   => beta,
      sine   => sine,
      cosine => cosine,
      d      => d,
      q      => q
    );

  control_d : entity work.filtered_pid
    generic map (
      WIDTH         => CODE_WIDTH + FRAC + 1,
      FRAC          => FILTER_FRAC,
      TARGET_WIDTH  => CODE_WIDTH + FRAC + 1,
      TARGET_FRAC   => 0,
      GAIN_WIDTH    => GAIN_WIDTH,
      GAIN_FRAC     => GAIN_FRAC,
      COMMAND_WIDTH => VOLTAGE_WIDTH,
      LEAST         => -LIMIT,
      MOST          => LIMIT,
      SUM_LIMIT     => LIMIT,
      SUM_FRAC      => 0
    )
    port map (
      clk          => clk,
      rst          => rst,
      target       => (others => '0'),
      measured     => d,
      share        => (others => '1'),
      proportional => proportional,
      integral     => integral,
      derivative   => (others => '0'),
      forward      => (others => '0'),
      sample       => sample,
      filtered     => filtered_d,
      command      => v_d
    );

  control_q : entity work.filtered_pid
    generic map (
      WIDTH         => CODE_WIDTH + FRAC + 1,
      FRAC          => FILTER_FRAC,
      TARGET_WIDTH  => CODE_WIDTH + FRAC + 1,
      TARGET_FRAC   => 0,
      GAIN_WIDTH    => GAIN_WIDTH,
      GAIN_FRAC     => GAIN_FRAC,
      COMMAND_WIDTH => VOLTAGE_WIDTH,
      LEAST         => -LIMIT,
      MOST          => LIMIT,
      SUM_LIMIT     => LIMIT,
      SUM_FRAC      => 0
    )
    port map (
      clk          => clk,
      rst          => rst,
      target       => target,
      measured     => q,
      share        => (others => '1'),
      proportional => proportional,
      integral     => integral,
      derivative   => (others => '0'),
      forward      => (others => '0'),
      sample       => sample,
      filtered     => filtered_q,
      command      => v_q
    );

  voltage : entity work.inverse_park
    generic map (
      WIDTH     => VOLTAGE_WIDTH,
      TRIG_INT  => 1,
      TRIG_FRAC => TRIG_FRAC
    )
    port map (
      d      => v_d,
      q      => v_q,
      sine   => sine,
      cosine => cosine,
      alpha  => v_alpha,
      beta   => v_beta
    );

  duties : entity work.space_vector
    generic map (
      WIDTH      => VOLTAGE_WIDTH,
      DUTY_WIDTH => DUTY_WIDTH,
      STEPS      => STEPS,
      SINUSOIDAL => SINUSOIDAL
    )
    port map (
      alpha  => v_alpha,
      beta   => v_beta,
      duty_a => duty_a,
      duty_b => duty_b,
      duty_c => duty_c
    );

  modulator : entity work.three_phase_pwm
    generic map (
      DUTY_WIDTH   => DUTY_WIDTH,
      STEPS        => STEPS,
      DEAD_TIME    => DEAD_TIME,
      MIN_PULSE    => MIN_PULSE,
      SAMPLE_DELAY => SAMPLE_DELAY,
      PEAK         => PEAK
    )
    port map (
      clk     => clk,
      rst     => rst,
      duty_a  => duty_a,
      duty_b  => duty_b,
      duty_c  => duty_c,
      enable  => enable,
      a_high  => a_high,
      a_low   => a_low,
      b_high  => b_high,
      b_low   => b_low,
      c_high  => c_high,
      c_low   => c_low,
      trigger => trigger,
      sample  => sample
    );

end architecture;
