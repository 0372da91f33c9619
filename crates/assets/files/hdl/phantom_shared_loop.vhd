-- phantom_shared_loop : the haptic loop of the PHANToM around a single multiplier
--
-- The loop of phantom_loop with its kinematics, walls, torques and commands
-- computed by a phantom_engine, one product after the other.
--
--   pins -> sync -> decoder -> counter -> sample -> trig -> engine -> commands
--
-- generics POSITION_WIDTH                 bits of the encoder counters
--          PERIOD_WIDTH                   bits of the sample period, 2 to 30
--          DEPTH_WIDTH                    address bits of a table, see trig_table
--          TURN_NUM_i, TURN_DEN_i         turns of joint i per count
--          TRIG_INT, TRIG_FRAC            format of the sines and cosines
--          LENGTH_FRAC                    fraction bits of the lengths, at most 30
--          LENGTH_1, LENGTH_2             L1, L2 in units of 2^-LENGTH_FRAC m
--          POSITION_INT, POSITION_FRAC    format of the positions
--          STIFFNESS_INT, STIFFNESS_FRAC  format of the stiffness
--          FORCE_INT, FORCE_FRAC          format of the forces
--          FORCE_LIMIT                    largest force, a word of that format
--          TORQUE_INT, TORQUE_FRAC        format of the torques
--          GAIN_i, GAIN_FRAC              converter counts per N.m of joint i
--          COMMAND_WIDTH                  bits of a command
--          DELAY                          edges from a capture to the start of the
--                                         engine, at least 2
-- in       a_pin1, b_pin1 .. a_pin3, b_pin3 (0,1,0)  encoder lines of the joints
--          x_low, x_high, y_low, y_high, z_low, z_high
--                                  (1,POSITION_INT,POSITION_FRAC) [m] the walls
--          room      (0,3,0)       the pairs that are there: bit 0 x, 1 y, 2 z
--          stiffness (0,STIFFNESS_INT,STIFFNESS_FRAC) [N/m]
--          period    (0,PERIOD_WIDTH,0)  sample period in clocks, 0 acts as 1
-- out      command1, command2, command3 (1,COMMAND_WIDTH-1,0) converter counts
-- latency  pin to count 4 edges (2 sync, 1 decoder, 1 counter) and the wait for
--          the sample edge; DELAY + 32 edges from there to the commands; a period
--          of 32 or less never brings one
-- reset    synchronous, to every clocked block
-- overflow commands saturate, forces clamp, all other words wrap; outside the
--          range of a table all commands are 0
-- source   Sevcik et al. 2009, the FPGA platform; the sharing is this project's
-- differs from the hardware: the paper does not say how its logic is shared.
--          The emulator models the ports of phantom_engine, not the registers
--          within.

library ieee;
use ieee.std_logic_1164.all;

entity phantom_shared_loop is
  generic (
    POSITION_WIDTH : positive := 16;
    PERIOD_WIDTH   : positive range 2 to 30 := 24;
    DEPTH_WIDTH    : positive := 13;
    TURN_NUM_1     : positive := 3;
    TURN_DEN_1     : positive := 92000;
    TURN_NUM_2     : positive := 1;
    TURN_DEN_2     : positive := 28000;
    TURN_NUM_3     : positive := 1;
    TURN_DEN_3     : positive := 28000;
    TRIG_INT       : positive := 9;
    TRIG_FRAC      : positive := 22;
    LENGTH_FRAC    : natural  := 24;
    LENGTH_1       : positive := 2348810;
    LENGTH_2       : positive := 2348810;
    POSITION_INT   : natural  := 0;
    POSITION_FRAC  : natural  := 24;
    STIFFNESS_INT  : natural  := 16;
    STIFFNESS_FRAC : natural  := 2;
    FORCE_INT      : natural  := 4;
    FORCE_FRAC     : natural  := 16;
    FORCE_LIMIT    : positive := 557056;
    TORQUE_INT     : natural  := 3;
    TORQUE_FRAC    : natural  := 20;
    GAIN_1         : natural  := 201134;
    GAIN_2         : natural  := 220289;
    GAIN_3         : natural  := 220289;
    GAIN_FRAC      : natural  := 3;
    COMMAND_WIDTH  : positive := 16;
    DELAY          : natural  := 2
  );
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    a_pin1    : in  std_logic;
    b_pin1    : in  std_logic;
    a_pin2    : in  std_logic;
    b_pin2    : in  std_logic;
    a_pin3    : in  std_logic;
    b_pin3    : in  std_logic;
    x_low     : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    x_high    : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    y_low     : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    y_high    : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    z_low     : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    z_high    : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    room      : in  std_logic_vector(2 downto 0);
    stiffness : in  std_logic_vector(STIFFNESS_INT + STIFFNESS_FRAC - 1 downto 0);
    period    : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    command1  : out std_logic_vector(COMMAND_WIDTH - 1 downto 0);
    command2  : out std_logic_vector(COMMAND_WIDTH - 1 downto 0);
    command3  : out std_logic_vector(COMMAND_WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of phantom_shared_loop is

  signal a1        : std_logic;
  signal b1        : std_logic;
  signal a2        : std_logic;
  signal b2        : std_logic;
  signal a3        : std_logic;
  signal b3        : std_logic;
  signal step1     : std_logic_vector(1 downto 0);
  signal error1    : std_logic;  -- for the waveform only
  signal step2     : std_logic_vector(1 downto 0);
  signal error2    : std_logic;  -- for the waveform only
  signal step3     : std_logic_vector(1 downto 0);
  signal error3    : std_logic;  -- for the waveform only
  signal position1 : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal position2 : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal position3 : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal count1    : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal count2    : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal count3    : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal sine1     : std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
  signal cosine1   : std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
  signal valid1    : std_logic;
  signal sine2     : std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
  signal cosine2   : std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
  signal valid2    : std_logic;
  signal sine3     : std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
  signal cosine3   : std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
  signal valid3    : std_logic;
  signal x         : std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
  signal y         : std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
  signal z         : std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
  signal radius    : std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
  signal force_x   : std_logic_vector(FORCE_INT + FORCE_FRAC downto 0);
  signal force_y   : std_logic_vector(FORCE_INT + FORCE_FRAC downto 0);
  signal force_z   : std_logic_vector(FORCE_INT + FORCE_FRAC downto 0);
  signal contact   : std_logic_vector(2 downto 0);
  signal torque1   : std_logic_vector(TORQUE_INT + TORQUE_FRAC downto 0);
  signal torque2   : std_logic_vector(TORQUE_INT + TORQUE_FRAC downto 0);
  signal torque3   : std_logic_vector(TORQUE_INT + TORQUE_FRAC downto 0);

begin

  sync1 : entity work.synchronizer
    port map (
      clk   => clk,
      rst   => rst,
      a_pin => a_pin1,
      b_pin => b_pin1,
      a     => a1,
      b     => b1
    );

  sync2 : entity work.synchronizer
    port map (
      clk   => clk,
      rst   => rst,
      a_pin => a_pin2,
      b_pin => b_pin2,
      a     => a2,
      b     => b2
    );

  sync3 : entity work.synchronizer
    port map (
      clk   => clk,
      rst   => rst,
      a_pin => a_pin3,
      b_pin => b_pin3,
      a     => a3,
      b     => b3
    );

  decoder1 : entity work.quadrature_decoder
    port map (
      clk   => clk,
      rst   => rst,
      a     => a1,
      b     => b1,
      step  => step1,
      error => error1
    );

  decoder2 : entity work.quadrature_decoder
    port map (
      clk   => clk,
      rst   => rst,
      a     => a2,
      b     => b2,
      step  => step2,
      error => error2
    );

  decoder3 : entity work.quadrature_decoder
    port map (
      clk   => clk,
      rst   => rst,
      a     => a3,
      b     => b3,
      step  => step3,
      error => error3
    );

  counter1 : entity work.position_counter
    generic map (
      WIDTH => POSITION_WIDTH
    )
    port map (
      clk      => clk,
      rst      => rst,
      step     => step1,
      position => position1
    );

  counter2 : entity work.position_counter
    generic map (
      WIDTH => POSITION_WIDTH
    )
    port map (
      clk      => clk,
      rst      => rst,
      step     => step2,
      position => position2
    );

  counter3 : entity work.position_counter
    generic map (
      WIDTH => POSITION_WIDTH
    )
    port map (
      clk      => clk,
      rst      => rst,
      step     => step3,
      position => position3
    );

  sample : entity work.sample_register
    generic map (
      WIDTH        => POSITION_WIDTH,
      PERIOD_WIDTH => PERIOD_WIDTH
    )
    port map (
      clk       => clk,
      rst       => rst,
      position1 => position1,
      position2 => position2,
      position3 => position3,
      period    => period,
      count1    => count1,
      count2    => count2,
      count3    => count3
    );

  trig1 : entity work.trig_table
    generic map (
      COUNT_WIDTH => POSITION_WIDTH,
      DEPTH_WIDTH => DEPTH_WIDTH,
      TURN_NUM    => TURN_NUM_1,
      TURN_DEN    => TURN_DEN_1,
      TRIG_INT    => TRIG_INT,
      TRIG_FRAC   => TRIG_FRAC
    )
    port map (
      clk    => clk,
      rst    => rst,
      count  => count1,
      sine   => sine1,
      cosine => cosine1,
      valid  => valid1
    );

  trig2 : entity work.trig_table
    generic map (
      COUNT_WIDTH => POSITION_WIDTH,
      DEPTH_WIDTH => DEPTH_WIDTH,
      TURN_NUM    => TURN_NUM_2,
      TURN_DEN    => TURN_DEN_2,
      TRIG_INT    => TRIG_INT,
      TRIG_FRAC   => TRIG_FRAC
    )
    port map (
      clk    => clk,
      rst    => rst,
      count  => count2,
      sine   => sine2,
      cosine => cosine2,
      valid  => valid2
    );

  trig3 : entity work.trig_table
    generic map (
      COUNT_WIDTH => POSITION_WIDTH,
      DEPTH_WIDTH => DEPTH_WIDTH,
      TURN_NUM    => TURN_NUM_3,
      TURN_DEN    => TURN_DEN_3,
      TRIG_INT    => TRIG_INT,
      TRIG_FRAC   => TRIG_FRAC
    )
    port map (
      clk    => clk,
      rst    => rst,
      count  => count3,
      sine   => sine3,
      cosine => cosine3,
      valid  => valid3
    );

  engine : entity work.phantom_engine
    generic map (
      PERIOD_WIDTH   => PERIOD_WIDTH,
      DELAY          => DELAY,
      TRIG_INT       => TRIG_INT,
      TRIG_FRAC      => TRIG_FRAC,
      LENGTH_FRAC    => LENGTH_FRAC,
      LENGTH_1       => LENGTH_1,
      LENGTH_2       => LENGTH_2,
      POSITION_INT   => POSITION_INT,
      POSITION_FRAC  => POSITION_FRAC,
      STIFFNESS_INT  => STIFFNESS_INT,
      STIFFNESS_FRAC => STIFFNESS_FRAC,
      FORCE_INT      => FORCE_INT,
      FORCE_FRAC     => FORCE_FRAC,
      FORCE_LIMIT    => FORCE_LIMIT,
      TORQUE_INT     => TORQUE_INT,
      TORQUE_FRAC    => TORQUE_FRAC,
      GAIN_1         => GAIN_1,
      GAIN_2         => GAIN_2,
      GAIN_3         => GAIN_3,
      GAIN_FRAC      => GAIN_FRAC,
      COMMAND_WIDTH  => COMMAND_WIDTH
    )
    port map (
      clk       => clk,
      rst       => rst,
      sine1     => sine1,
      cosine1   => cosine1,
      sine2     => sine2,
      cosine2   => cosine2,
      sine3     => sine3,
      cosine3   => cosine3,
      valid1    => valid1,
      valid2    => valid2,
      valid3    => valid3,
      x_low     => x_low,
      x_high    => x_high,
      y_low     => y_low,
      y_high    => y_high,
      z_low     => z_low,
      z_high    => z_high,
      room      => room,
      stiffness => stiffness,
      period    => period,
      x         => x,
      y         => y,
      z         => z,
      radius    => radius,
      force_x   => force_x,
      force_y   => force_y,
      force_z   => force_z,
      contact   => contact,
      torque1   => torque1,
      torque2   => torque2,
      torque3   => torque3,
      command1  => command1,
      command2  => command2,
      command3  => command3
    );

end architecture;
