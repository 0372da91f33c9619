-- energy_bounding_loop : a wall that gives no more than the device dissipates
--
-- The change of the torque, or the torque itself, is kept within what the damping
-- of the device can take up.
--
--   pins -> front -> position, delta, contact, penetration -> law -> shaper --+
--               ^                                              |             |
--           reference                                        memory          v
--                                   gates <- modulator <- limiter <----------+
--
-- generics POSITION_WIDTH                   bits of the position
--          STIFFNESS_WIDTH, STIFFNESS_FRAC  bits of the stiffness, its fraction
--          DAMPING_WIDTH, DAMPING_FRAC      bits of the damping, its fraction
--          PERIOD_WIDTH                     bits of the sample period, 2 to 30
--          SCALE_WIDTH, SCALE_FRAC          bits of the scale, its fraction
--          PWM_WIDTH                        bits of the torque's magnitude, at most 30
--          ANTIPHASE, LATCHED, FLOATING, DEAD_TIME  see pwm
--          SHAPER_ENABLED, SHAPER_PHASE,
--          SHAPER_B0, SHAPER_B1, SHAPER_B2,
--          SHAPER_A1, SHAPER_A2             see input_shaper
--          LEAST_CONSERVATIVE               bound the torque, or else its change
--          C1, C2                           see energy_bounding
--          BOUND_FRAC                       fraction bits of C1 and C2
--          BOUND_WIDTH                      bits of C1 and C2
--          ENERGY_WIDTH                     bits of the energy
--          ROOT_WIDTH                       bits under the root, even, at most 62
-- in       a_pin, b_pin (0,1,0)    encoder lines
--          reference    (0,POSITION_WIDTH,0)
--          stiffness    (0,STIFFNESS_WIDTH-STIFFNESS_FRAC,STIFFNESS_FRAC)
--                                  PWM counts per position count, of the wall
--          damping      (0,DAMPING_WIDTH-DAMPING_FRAC,DAMPING_FRAC)
--                                  PWM counts per count and sample, of the wall
--          period       (0,PERIOD_WIDTH,0)  sample period in clocks, 0 acts as 1
--          scale        (0,SCALE_WIDTH-SCALE_FRAC,SCALE_FRAC)  ignored
-- out      a_high, a_low, b_high, b_low (0,1,0)  gates of the H-bridge
-- latency  pin to position 4 edges (2 sync, 1 decoder, 1 counter); then the law
--          waits for its sample edge, and takes ROOT_WIDTH/2 + 2 edges;
--          the shaper, when enabled, waits for its own
-- reset    synchronous, to every clocked block
-- overflow as in energy_bounding; the command clamps to +-(2^PWM_WIDTH - 1)
-- source   the energy-bounding algorithm of Kim and Ryu, as energy_bounding has it
-- differs from the hardware: as in the law and the blocks around it;
--          combinational paths settle within the clock they change in, whatever
--          their length.

library ieee;
use ieee.std_logic_1164.all;

entity energy_bounding_loop is
  generic (
    POSITION_WIDTH     : positive := 12;
    STIFFNESS_WIDTH    : positive := 12;
    STIFFNESS_FRAC     : natural  := 0;
    DAMPING_WIDTH      : positive := 12;
    DAMPING_FRAC       : natural  := 0;
    PERIOD_WIDTH       : positive range 2 to 30 := 24;
    SCALE_WIDTH        : positive := 16;
    SCALE_FRAC         : natural  := 8;
    PWM_WIDTH          : positive := 12;
    ANTIPHASE          : boolean  := false;
    LATCHED            : boolean  := true;
    FLOATING           : boolean  := false;
    DEAD_TIME          : natural  := 0;
    SHAPER_ENABLED     : boolean  := false;
    SHAPER_PHASE       : natural  := 0;
    SHAPER_B0          : integer  := 0;
    SHAPER_B1          : integer  := 0;
    SHAPER_B2          : integer  := 0;
    SHAPER_A1          : integer  := 0;
    SHAPER_A2          : integer  := 0;
    LEAST_CONSERVATIVE : boolean  := false;
    C1                 : natural  := 320;
    C2                 : natural  := 320;
    BOUND_FRAC         : natural  := 4;
    BOUND_WIDTH        : positive := 14;
    ENERGY_WIDTH       : positive := 32;
    ROOT_WIDTH         : positive := 54
  );
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    a_pin     : in  std_logic;
    b_pin     : in  std_logic;
    reference : in  std_logic_vector(POSITION_WIDTH - 1 downto 0);
    stiffness : in  std_logic_vector(STIFFNESS_WIDTH - 1 downto 0);
    damping   : in  std_logic_vector(DAMPING_WIDTH - 1 downto 0);
    period    : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    scale     : in  std_logic_vector(SCALE_WIDTH - 1 downto 0);
    a_high    : out std_logic;
    a_low     : out std_logic;
    b_high    : out std_logic;
    b_low     : out std_logic
  );
end entity;

architecture rtl of energy_bounding_loop is

  signal position    : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal error       : std_logic;  -- for the waveform only
  signal delta       : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal contact     : std_logic;
  signal penetration : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal torque      : std_logic_vector(PWM_WIDTH + 1 downto 0);
  signal memory      : std_logic_vector(ENERGY_WIDTH - 1 downto 0);
  signal shaped      : std_logic_vector(PWM_WIDTH + 1 downto 0);
  signal command     : std_logic_vector(PWM_WIDTH downto 0);

begin

  front : entity work.axis_front
    generic map (
      POSITION_WIDTH => POSITION_WIDTH
    )
    port map (
      clk         => clk,
      rst         => rst,
      a_pin       => a_pin,
      b_pin       => b_pin,
      reference   => reference,
      position    => position,
      error       => error,
      delta       => delta,
      contact     => contact,
      penetration => penetration
    );

  law : entity work.energy_bounding
    generic map (
      WIDTH              => POSITION_WIDTH,
      STIFFNESS_WIDTH    => STIFFNESS_WIDTH,
      STIFFNESS_FRAC     => STIFFNESS_FRAC,
      DAMPING_WIDTH      => DAMPING_WIDTH,
      DAMPING_FRAC       => DAMPING_FRAC,
      PERIOD_WIDTH       => PERIOD_WIDTH,
      SCALE_WIDTH        => SCALE_WIDTH,
      SCALE_FRAC         => SCALE_FRAC,
      TORQUE_WIDTH       => PWM_WIDTH,
      LEAST_CONSERVATIVE => LEAST_CONSERVATIVE,
      C1                 => C1,
      C2                 => C2,
      BOUND_FRAC         => BOUND_FRAC,
      BOUND_WIDTH        => BOUND_WIDTH,
      ENERGY_WIDTH       => ENERGY_WIDTH,
      ROOT_WIDTH         => ROOT_WIDTH
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
      scale       => scale,
      torque      => torque,
      memory      => memory
    );

  shaper : entity work.input_shaper
    generic map (
      ENABLED      => SHAPER_ENABLED,
      TORQUE_WIDTH => PWM_WIDTH,
      PERIOD_WIDTH => PERIOD_WIDTH,
      PHASE        => SHAPER_PHASE,
      B0           => SHAPER_B0,
      B1           => SHAPER_B1,
      B2           => SHAPER_B2,
      A1           => SHAPER_A1,
      A2           => SHAPER_A2
    )
    port map (
      clk    => clk,
      rst    => rst,
      torque => torque,
      period => period,
      shaped => shaped
    );

  limiter : entity work.saturator
    generic map (
      IN_WIDTH  => PWM_WIDTH + 2,
      OUT_WIDTH => PWM_WIDTH + 1,
      LIMIT     => 2**PWM_WIDTH - 1
    )
    port map (
      value   => shaped,
      limited => command
    );

  modulator : entity work.pwm
    generic map (
      WIDTH     => PWM_WIDTH,
      ANTIPHASE => ANTIPHASE,
      LATCHED   => LATCHED,
      FLOATING  => FLOATING,
      DEAD_TIME => DEAD_TIME
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
