-- conventional_loop : the wall as a sampled controller renders it
--
-- As hybrid_loop, but the position is sampled and held as well. Both paths see
-- the same sample edges, so the torque stands still between them: a zero-order
-- hold in the forward path.
--
--   pins -> sync -> decoder -> counter -+-> hold -> offset -> wall -> spring_mult
--                                       |                               |
--                                       |                               v
--                                       +-> velocity_reg -> damping_mult -> sum
--                                                                           |
--                          gates <- modulator <- limiter <------------------+
--
--   spring  = fit(floor(penetration * stiffness / 2^STIFFNESS_FRAC)), PWM_WIDTH bits
--   drag    = fit(floor(velocity * damping / 2^DAMPING_FRAC)), PWM_WIDTH+1 bits, signed
--   torque  = spring + drag when contact, 0 otherwise
--   command = clamp(torque, -L, +L), L = 2^PWM_WIDTH - 1, behind SETTLING registers
-- fit saturates to the bits that follow it, or drops the upper ones, not SATURATE.
--
-- generics POSITION_WIDTH                   bits of the position
--          STIFFNESS_WIDTH, STIFFNESS_FRAC  bits of the stiffness, its fraction
--          DAMPING_WIDTH, DAMPING_FRAC      bits of the damping, its fraction
--          PERIOD_WIDTH                     bits of the sample period, 2 to 30
--          VELOCITY_WIDTH                   bits of the velocity
--          RESCALED, SCALE_WIDTH, SCALE_FRAC  see velocity_register
--          SATURATE                         see truncating_multiplier
--          PWM_WIDTH                        bits of the torque's magnitude, at most 30
--          ANTIPHASE, LATCHED, FLOATING, DEAD_TIME  see pwm
--          SETTLING                         see command_limiter
-- in       a_pin, b_pin (0,1,0)    encoder lines
--          reference    (0,POSITION_WIDTH,0)
--          stiffness    (0,STIFFNESS_WIDTH-STIFFNESS_FRAC,STIFFNESS_FRAC)
--                                  PWM counts per position count
--          damping      (0,DAMPING_WIDTH-DAMPING_FRAC,DAMPING_FRAC)
--                                  PWM counts per velocity count
--          period       (0,PERIOD_WIDTH,0)  sample period in clocks
--          scale        (0,SCALE_WIDTH-SCALE_FRAC,SCALE_FRAC)
-- out      a_high, a_low, b_high, b_low (0,1,0)  gates of the H-bridge
-- latency  pin to position 4 edges (2 sync, 1 decoder, 1 counter); then both
--          paths wait for the next sample edge, and SETTLING edges more
-- reset    synchronous, to every clocked block
-- overflow products clamp (or wrap, not SATURATE); the sum cannot overflow; the
--          command clamps to +-(2^PWM_WIDTH - 1)
-- source   Vasudevan et al. 2007, the conventional loop it compares with
-- differs from the hardware: samples exactly every period; a controller in
--          software has jitter and a computing delay. Combinational paths
--          settle within the clock they change in, whatever their length;
--          SETTLING says how much later they would.

library ieee;
use ieee.std_logic_1164.all;

entity conventional_loop is
  generic (
    POSITION_WIDTH  : positive := 12;
    STIFFNESS_WIDTH : positive := 12;
    STIFFNESS_FRAC  : natural  := 0;
    DAMPING_WIDTH   : positive := 12;
    DAMPING_FRAC    : natural  := 0;
    PERIOD_WIDTH    : positive range 2 to 30 := 24;
    VELOCITY_WIDTH  : positive := 12;
    RESCALED        : boolean  := false;
    SCALE_WIDTH     : positive := 16;
    SCALE_FRAC      : natural  := 8;
    PWM_WIDTH       : positive := 12;
    SATURATE        : boolean  := true;
    ANTIPHASE       : boolean  := false;
    LATCHED         : boolean  := true;
    FLOATING        : boolean  := false;
    DEAD_TIME       : natural  := 0;
    SETTLING        : natural  := 0
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

architecture rtl of conventional_loop is

  signal a           : std_logic;
  signal b           : std_logic;
  signal step        : std_logic_vector(1 downto 0);
  signal error       : std_logic;  -- for the waveform only
  signal position    : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal held        : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal delta       : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal contact     : std_logic;
  signal penetration : std_logic_vector(POSITION_WIDTH - 1 downto 0);
  signal spring      : std_logic_vector(PWM_WIDTH - 1 downto 0);
  signal velocity    : std_logic_vector(VELOCITY_WIDTH - 1 downto 0);
  signal drag        : std_logic_vector(PWM_WIDTH downto 0);
  signal torque      : std_logic_vector(PWM_WIDTH + 1 downto 0);
  signal command     : std_logic_vector(PWM_WIDTH downto 0);

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

  hold : entity work.zero_order_hold
    generic map (
      WIDTH        => POSITION_WIDTH,
      PERIOD_WIDTH => PERIOD_WIDTH
    )
    port map (
      clk    => clk,
      rst    => rst,
      d      => position,
      period => period,
      q      => held
    );

  offset : entity work.displacement
    generic map (
      WIDTH => POSITION_WIDTH
    )
    port map (
      position  => held,
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

  spring_mult : entity work.truncating_multiplier
    generic map (
      A_WIDTH    => POSITION_WIDTH,
      B_WIDTH    => STIFFNESS_WIDTH,
      A_SIGNED   => false,
      B_SIGNED   => false,
      DROP_LOWER => STIFFNESS_FRAC,
      OUT_WIDTH  => PWM_WIDTH,
      SATURATE   => SATURATE
    )
    port map (
      a       => penetration,
      b       => stiffness,
      product => spring
    );

  velocity_reg : entity work.velocity_register
    generic map (
      WIDTH        => POSITION_WIDTH,
      PERIOD_WIDTH => PERIOD_WIDTH,
      RESCALED     => RESCALED,
      SCALE_WIDTH  => SCALE_WIDTH,
      SCALE_FRAC   => SCALE_FRAC,
      OUT_WIDTH    => VELOCITY_WIDTH
    )
    port map (
      clk      => clk,
      rst      => rst,
      position => position,
      period   => period,
      scale    => scale,
      velocity => velocity
    );

  damping_mult : entity work.truncating_multiplier
    generic map (
      A_WIDTH    => VELOCITY_WIDTH,
      B_WIDTH    => DAMPING_WIDTH,
      A_SIGNED   => true,
      B_SIGNED   => false,
      DROP_LOWER => DAMPING_FRAC,
      OUT_WIDTH  => PWM_WIDTH + 1,
      SATURATE   => SATURATE
    )
    port map (
      a       => velocity,
      b       => damping,
      product => drag
    );

  sum : entity work.torque_sum
    generic map (
      SPRING_WIDTH  => PWM_WIDTH,
      DAMPING_WIDTH => PWM_WIDTH + 1,
      OUT_WIDTH     => PWM_WIDTH + 2
    )
    port map (
      spring  => spring,
      damping => drag,
      contact => contact,
      torque  => torque
    );

  limiter : entity work.command_limiter
    generic map (
      IN_WIDTH  => PWM_WIDTH + 2,
      OUT_WIDTH => PWM_WIDTH + 1,
      LIMIT     => 2**PWM_WIDTH - 1,
      SETTLING  => SETTLING
    )
    port map (
      clk     => clk,
      rst     => rst,
      value   => torque,
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
