-- foc_knob_loop : a knob behind field-oriented control: detents and a wall before the
-- current loops of a three-phase motor
--
-- The law makes a torque of the position and of its distance to the wall, in units of
-- the torque for 2^-FRAC codes of current; the wanted current is that torque, against
-- the penetration. The modulator's trigger starts the converters of the currents.
-- SAMPLE_DELAY clocks later both controllers take a sample; the modulator takes the
-- duties at its next valley. The wanted current along the flux is 0.
--
--   pins -> sync -> decoder -> counter -> counted -> chosen -> position
--                                 code, coded ---------^
--
--   position -> from_zero -> field -> angle -> sine, cosine
--      zero ------^
--   position -> offset -> delta -> wall -> contact, penetration -> law -> torque
--   reference ----^                                   position -----^       |
--                                                                           v
--   sine, cosine -------------------------+                  target <- against
--                                         v                     |
--   i_a, i_b -> stator -> alpha, beta -> rotor -> d, q          |
--                                                  |            |
--                                                  v            v
--              v_alpha, v_beta <- voltage <- control_d, control_q <- gains
--                    v               ^             ^
--                  duties            |             |
--                    |          sine, cosine     sample
--                    v                             |
--         duty_a, duty_b, duty_c -> modulator -----+-> gates, trigger
--
-- The counter, or the code, wraps at 2^POSITION_WIDTH counts: where these are no whole
-- number of turns of the rotor, the field's angle is wrong from there on.
--
-- generics POSITION_WIDTH .. SINUSOIDAL     of foc_loop
--          STIFFNESS_WIDTH, STIFFNESS_FRAC  bits of the stiffness, its fraction
--          DAMPING_WIDTH, DAMPING_FRAC      bits of the damping, its fraction
--          PERIOD_WIDTH                     bits of the law's period, 2 to 30
--          TABLE_BITS, SHIFT                of torque_table
--          T0 to T31                        torques in 2^-FRAC codes, within
--                                           +-(2^(CODE_WIDTH+FRAC-1) - 1)
-- in       a_pin, b_pin  (0,1,0)               encoder lines, asynchronous
--          code          (0,POSITION_WIDTH,0)  position of an absolute sensor
--          coded         (0,1,0)               '1': code is the position
--          reference     (0,POSITION_WIDTH,0)  where the wall begins
--          stiffness     (0,STIFFNESS_WIDTH-STIFFNESS_FRAC,STIFFNESS_FRAC)
--                                              2^-FRAC codes per count
--          damping       (0,DAMPING_WIDTH-DAMPING_FRAC,DAMPING_FRAC)
--                                              2^-FRAC codes per count per sample
--          period        (0,PERIOD_WIDTH,0)    law's sample period, 0 acts as 1
--          zero          (0,POSITION_WIDTH,0)  position with an electrical angle of 0
--          i_a, i_b      (1,CODE_WIDTH-1,0)    codes of the phase currents
--          proportional, integral (0,GAIN_WIDTH-GAIN_FRAC,GAIN_FRAC)
--                                              voltage for 2^-FRAC codes, of a sample
--          enable        (0,1,0)               '0': no samples, all gates off
-- out      a_high, a_low, b_high, b_low, c_high, c_low (0,1,0)   1 = gate on
--          trigger       (0,1,0)               the converters begin
-- latency  a pin comes to the position in 4 edges, to the sines in 5; a sample of the
--          law to the target in 1; one of the currents to the voltages in 1; then the
--          duties wait for the valley
-- reset    synchronous, to every clocked block
-- overflow as in the blocks
-- source   that of the blocks
-- differs from the hardware: as in its blocks; combinational paths settle within the
--          clock they change in.

library ieee;
use ieee.std_logic_1164.all;

entity foc_knob_loop is
  generic (
    POSITION_WIDTH  : positive := 16;
    POLE_PAIRS      : positive := 7;
    COUNTS          : positive := 4096;
    PHASE_WIDTH     : positive := 36;
    ITERATIONS      : positive := 17;
    GUARD           : natural  := 4;
    TRIG_FRAC       : positive := 14;
    CODE_WIDTH      : positive := 12;
    FRAC            : natural  := 3;
    FILTER_FRAC     : natural  := 5;
    GAIN_WIDTH      : positive := 24;
    GAIN_FRAC       : natural  := 16;
    VOLTAGE_WIDTH   : positive := 15;
    LIMIT           : positive := 9459;
    DUTY_WIDTH      : positive := 11;
    STEPS           : positive := 1250;
    DEAD_TIME       : natural  := 25;
    MIN_PULSE       : natural  := 20;
    SAMPLE_DELAY    : positive := 100;
    PEAK            : boolean  := false;
    SINUSOIDAL      : boolean  := false;
    STIFFNESS_WIDTH : positive := 20;
    STIFFNESS_FRAC  : natural  := 8;
    DAMPING_WIDTH   : positive := 20;
    DAMPING_FRAC    : natural  := 4;
    PERIOD_WIDTH    : positive range 2 to 30 := 24;
    TABLE_BITS      : positive range 1 to 5 := 4;
    SHIFT           : natural  := 3;
    T0              : integer  := 0;
    T1              : integer  := 77;
    T2              : integer  := 141;
    T3              : integer  := 185;
    T4              : integer  := 200;
    T5              : integer  := 185;
    T6              : integer  := 141;
    T7              : integer  := 77;
    T8              : integer  := 0;
    T9              : integer  := -77;
    T10             : integer  := -141;
    T11             : integer  := -185;
    T12             : integer  := -200;
    T13             : integer  := -185;
    T14             : integer  := -141;
    T15             : integer  := -77;
    T16             : integer  := 0;
    T17             : integer  := 0;
    T18             : integer  := 0;
    T19             : integer  := 0;
    T20             : integer  := 0;
    T21             : integer  := 0;
    T22             : integer  := 0;
    T23             : integer  := 0;
    T24             : integer  := 0;
    T25             : integer  := 0;
    T26             : integer  := 0;
    T27             : integer  := 0;
    T28             : integer  := 0;
    T29             : integer  := 0;
    T30             : integer  := 0;
    T31             : integer  := 0
  );
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    a_pin        : in  std_logic;
    b_pin        : in  std_logic;
    code         : in  std_logic_vector(POSITION_WIDTH - 1 downto 0);
    coded        : in  std_logic;
    reference    : in  std_logic_vector(POSITION_WIDTH - 1 downto 0);
    stiffness    : in  std_logic_vector(STIFFNESS_WIDTH - 1 downto 0);
    damping      : in  std_logic_vector(DAMPING_WIDTH - 1 downto 0);
    period       : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    zero         : in  std_logic_vector(POSITION_WIDTH - 1 downto 0);
    i_a          : in  std_logic_vector(CODE_WIDTH - 1 downto 0);
    i_b          : in  std_logic_vector(CODE_WIDTH - 1 downto 0);
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

architecture rtl of foc_knob_loop is

  -- A count in 2^PHASE_WIDTH of a turn of the field.
  constant COUNT_PHASE : natural
    := integer(real(POLE_PAIRS) * 2.0**PHASE_WIDTH / real(COUNTS));

  constant TORQUE_WIDTH : positive := CODE_WIDTH + FRAC - 1;

  signal a           : std_logic;
  signal b           : std_logic;
  signal step        : std_logic_vector(1 downto 0);
  signal error       : std_logic;  -- for the waveform only
  signal counted     : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal position    : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal delta       : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal contact     : std_logic;
  signal penetration : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal torque      : std_logic_vector(TORQUE_WIDTH + 1 downto 0);
  signal texture     : std_logic_vector(TORQUE_WIDTH downto 0);  -- for the waveform only
  signal target      : std_logic_vector(CODE_WIDTH + FRAC downto 0);
  signal field       : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal sine        : std_logic_vector(TRIG_FRAC + 1 downto 0);
  signal cosine      : std_logic_vector(TRIG_FRAC + 1 downto 0);
  signal valid       : std_logic;  -- for the waveform only
  signal alpha       : std_logic_vector(CODE_WIDTH + FRAC downto 0);
  signal beta        : std_logic_vector(CODE_WIDTH + FRAC downto 0);
  signal d           : std_logic_vector(CODE_WIDTH + FRAC downto 0);
  signal q           : std_logic_vector(CODE_WIDTH + FRAC downto 0);
  signal filtered_d  : std_logic_vector(CODE_WIDTH + FRAC + FILTER_FRAC downto 0);  -- for the waveform only
  signal v_d         : std_logic_vector(VOLTAGE_WIDTH - 1 downto 0);
  signal filtered_q  : std_logic_vector(CODE_WIDTH + FRAC + FILTER_FRAC downto 0);  -- for the waveform only
  signal v_q         : std_logic_vector(VOLTAGE_WIDTH - 1 downto 0);
  signal v_alpha     : std_logic_vector(VOLTAGE_WIDTH - 1 downto 0);
  signal v_beta      : std_logic_vector(VOLTAGE_WIDTH - 1 downto 0);
  signal duty_a      : std_logic_vector(DUTY_WIDTH - 1 downto 0);
  signal duty_b      : std_logic_vector(DUTY_WIDTH - 1 downto 0);
  signal duty_c      : std_logic_vector(DUTY_WIDTH - 1 downto 0);
  signal sample      : std_logic;

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
      position => counted
    );

  chosen : entity work.position_select
    generic map (
      WIDTH => POSITION_WIDTH
    )
    port map (
      count    => counted,
      code     => code,
      coded    => coded,
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

  wall : entity work.unilateral
    generic map (
      WIDTH => POSITION_WIDTH
    )
    port map (
      delta       => delta,
      contact     => contact,
      penetration => penetration
    );

  law : entity work.torque_table
    generic map (
      WIDTH           => POSITION_WIDTH,
      STIFFNESS_WIDTH => STIFFNESS_WIDTH,
      STIFFNESS_FRAC  => STIFFNESS_FRAC,
      DAMPING_WIDTH   => DAMPING_WIDTH,
      DAMPING_FRAC    => DAMPING_FRAC,
      PERIOD_WIDTH    => PERIOD_WIDTH,
      TORQUE_WIDTH    => TORQUE_WIDTH,
      TABLE_BITS      => TABLE_BITS,
      SHIFT           => SHIFT,
      T0              => T0,
      T1              => T1,
      T2              => T2,
      T3              => T3,
      T4              => T4,
      T5              => T5,
      T6              => T6,
      T7              => T7,
      T8              => T8,
      T9              => T9,
      T10             => T10,
      T11             => T11,
      T12             => T12,
      T13             => T13,
      T14             => T14,
      T15             => T15,
      T16             => T16,
      T17             => T17,
      T18             => T18,
      T19             => T19,
      T20             => T20,
      T21             => T21,
      T22             => T22,
      T23             => T23,
      T24             => T24,
      T25             => T25,
      T26             => T26,
      T27             => T27,
      T28             => T28,
      T29             => T29,
      T30             => T30,
      T31             => T31
    )
    port map (
      clk         => clk,
      rst         => rst,
      position    => position,
      delta       => delta,
      contact     => contact,
      penetration => penetration,
      stiffness   => stiffness,
      damping     => damping,
      period      => period,
      scale       => (others => '0'),
      torque      => torque,
      memory      => texture
    );

  -- Multiplies by -1.
  against : entity work.truncating_multiplier
    generic map (
      A_WIDTH   => TORQUE_WIDTH + 2,
      B_WIDTH   => 2,
      A_SIGNED  => true,
      B_SIGNED  => true,
      OUT_WIDTH => CODE_WIDTH + FRAC + 1
    )
    port map (
      a       => torque,
      b       => (others => '1'),
      product => target
    );

  from_zero : entity work.displacement
    generic map (
      WIDTH => POSITION_WIDTH
    )
    port map (
      position  => position,
      reference => zero,
      delta     => field
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
      count  => field,
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
