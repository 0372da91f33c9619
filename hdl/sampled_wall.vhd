-- sampled_wall : spring, and damping by any velocity estimator at its own rate
--
--   torque = clamp(spring + drag - relief, -L, L)   spring and drag in contact only
--   spring = min(floor(penetration * stiffness / 2^STIFFNESS_FRAC), 2^P - 1)
--   drag   = clamp(floor(damping * v / 2^(DAMPING_FRAC + V)), -2^P, 2^P - 1)
--   relief = clamp(floor(RELIEF * v / 2^(DAMPING_FRAC + V)), -2^P, 2^P - 1)
-- with P = TORQUE_WIDTH, L = 2^(P+1) - 1, V = VELOCITY_FRAC, and v the velocity as
-- an integer in units of 2^-V. For the spring, contact and penetration are sampled
-- every period, or live; v is sampled every RATIO periods. Stiffness and damping
-- are live. Relief is a negative damping that is always there.
--
--   contact, penetration -> hold -> spring_mult -> wall -> total -> limiter -> torque
--                                                   ^        ^
--   position -> estimator -+- v -> drag_mult -------+        |
--                          +-----> relief_mult --------------+
--
-- ESTIMATOR 0  velocity_register                counts per sample
--           1  filtered_difference by SHIFT and WEIGHT
--                                               counts per sample
--           2  window_difference over WINDOW    counts per window
--           3  foaw by WINDOW and NOISE         counts per sample
--           4  edge_timer and a division        counts per sample
--           5  levant_differentiator by ROOT_GAIN and SLEW
--                                               counts per sample
--           6  butterworth_difference by B0, A1 and GUARD
--                                               counts per sample
-- For 4, at a sample edge of the velocity: its period p (here 0 stays 0) and the
-- interval, forward and stopped of edge_timer, of TIME_WIDTH = PERIOD_WIDTH, are
-- captured as they stood before that edge. PERIOD_WIDTH+3+V edges later:
--   q = min(floor(p * 2^V / interval), 2^(W-1+V) - 1)
--   v := 0 when stopped, q when forward, else -q
-- Sample edges of the velocity up to and including that one are passed over.
--
-- generics WIDTH                            bits of the position, W
--          STIFFNESS_WIDTH, STIFFNESS_FRAC  bits of the stiffness, its fraction
--          DAMPING_WIDTH, DAMPING_FRAC      bits of the damping, its fraction
--          PERIOD_WIDTH                     bits of the period, 2 to 30; at
--                                           most 61-V too for ESTIMATOR 4
--          SCALE_WIDTH, SCALE_FRAC          bits of the scale, its fraction
--          TORQUE_WIDTH                     bits of a torque's magnitude, P, at
--                                           most 30
--          SPRING_HELD                      sample the spring every period
--          ESTIMATOR                        which velocity, see above
--          RATIO                            periods to a sample of the velocity
--          SHIFT, WEIGHT, WINDOW, NOISE     see the estimators
--          VELOCITY_FRAC                    fraction bits of the velocity, V
--          RELIEF                           gain of the relief, a word of
--                                           DAMPING_FRAC fraction bits
--          ROOT_GAIN, SLEW                  see levant_differentiator
--          B0, A1, GUARD                    see butterworth_difference
-- in       position    (0,W,0)
--          delta       (1,W-1,0)            ignored
--          contact     (0,1,0)
--          penetration (0,W,0)
--          stiffness   (0,STIFFNESS_WIDTH-STIFFNESS_FRAC,STIFFNESS_FRAC)
--                                           PWM counts per position count
--          damping     (0,DAMPING_WIDTH-DAMPING_FRAC,DAMPING_FRAC)
--                                           PWM counts per velocity count
--          period      (0,PERIOD_WIDTH,0)   sample period in clocks, 0 acts as 1
--          scale       (0,SCALE_WIDTH-SCALE_FRAC,SCALE_FRAC)  ignored
-- out      torque      (1,P+1,0)            positive resists penetration
--          memory      (1,W-1,V)            the velocity v
-- latency  all from the sample edge: 0 to a held spring and to the velocity, which
--          that very edge writes; PERIOD_WIDTH+3+V to the velocity of ESTIMATOR 4,
--          that of its block to the velocity of ESTIMATOR 5.
--          Not SPRING_HELD: contact and penetration act at once, combinational
-- reset    velocity 0, nothing held; the first edge after it is a sample edge
-- overflow products clamp, and so does the torque; the period of the velocity,
--          period * RATIO, wraps at 2^PERIOD_WIDTH
-- source   Vasudevan et al. 2007, Eqs. (1) to (8); the relief is the negative
--          virtual damping of Brown and Colgate; the estimators have their own
-- differs from the hardware: combinational paths settle within the clock they
--          change in, whatever their length. With ESTIMATOR 4 the emulator
--          models the ports of the divider, not the registers within.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity sampled_wall is
  generic (
    WIDTH           : positive := 12;
    STIFFNESS_WIDTH : positive := 12;
    STIFFNESS_FRAC  : natural  := 0;
    DAMPING_WIDTH   : positive := 12;
    DAMPING_FRAC    : natural  := 0;
    PERIOD_WIDTH    : positive range 2 to 30 := 24;
    SCALE_WIDTH     : positive := 16;
    SCALE_FRAC      : natural  := 8;
    TORQUE_WIDTH    : positive := 12;
    SPRING_HELD     : boolean  := true;
    ESTIMATOR       : natural range 0 to 6 := 0;
    RATIO           : positive := 1;
    SHIFT           : natural  := 3;
    WEIGHT          : positive := 1;
    WINDOW          : positive := 8;
    NOISE           : natural  := 1;
    VELOCITY_FRAC   : natural  := 8;
    RELIEF          : natural  := 0;
    ROOT_GAIN       : natural  := 94;
    SLEW            : natural  := 17;
    B0              : natural  := 576782;
    A1              : integer  := -2075951210;
    GUARD           : natural  := 10
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
    memory      : out std_logic_vector(WIDTH + VELOCITY_FRAC - 1 downto 0)
  );
end entity;

architecture rtl of sampled_wall is

  constant VELOCITY_WIDTH : positive := WIDTH + VELOCITY_FRAC;
  constant WHOLE          : std_logic_vector(VELOCITY_FRAC - 1 downto 0) := (others => '0');
  constant RATIO_WORD     : unsigned(30 downto 0) := to_unsigned(RATIO, 31);
  constant RELIEF_WORD    : std_logic_vector(30 downto 0)
    := std_logic_vector(to_unsigned(RELIEF, 31));

  signal touching        : std_logic_vector(WIDTH downto 0);
  signal touched         : std_logic_vector(WIDTH downto 0);
  signal contact_s       : std_logic;
  signal penetration_s   : std_logic_vector(WIDTH - 1 downto 0);
  signal velocity_period : std_logic_vector(PERIOD_WIDTH - 1 downto 0);
  signal velocity        : std_logic_vector(VELOCITY_WIDTH - 1 downto 0);
  signal spring          : std_logic_vector(TORQUE_WIDTH - 1 downto 0);
  signal drag            : std_logic_vector(TORQUE_WIDTH downto 0);
  signal relief_torque   : std_logic_vector(TORQUE_WIDTH downto 0);
  signal wall_torque     : std_logic_vector(TORQUE_WIDTH + 1 downto 0);
  signal total           : std_logic_vector(TORQUE_WIDTH + 2 downto 0);

begin

  touching <= contact & penetration;

  g_held : if SPRING_HELD generate
    hold : entity work.zero_order_hold
      generic map (
        WIDTH        => WIDTH + 1,
        PERIOD_WIDTH => PERIOD_WIDTH
      )
      port map (
        clk    => clk,
        rst    => rst,
        d      => touching,
        period => period,
        q      => touched
      );
  end generate;

  g_live : if not SPRING_HELD generate
    touched <= touching;
  end generate;

  contact_s     <= touched(WIDTH);
  penetration_s <= touched(WIDTH - 1 downto 0);

  velocity_period <= std_logic_vector(resize(unsigned(period) * RATIO_WORD, PERIOD_WIDTH));

  g_difference : if ESTIMATOR = 0 generate
    signal counts : std_logic_vector(WIDTH - 1 downto 0);
  begin
    estimate : entity work.velocity_register
      generic map (
        WIDTH        => WIDTH,
        PERIOD_WIDTH => PERIOD_WIDTH,
        RESCALED     => false,
        SCALE_WIDTH  => SCALE_WIDTH,
        SCALE_FRAC   => SCALE_FRAC,
        OUT_WIDTH    => WIDTH
      )
      port map (
        clk      => clk,
        rst      => rst,
        position => position,
        period   => velocity_period,
        scale    => scale,
        velocity => counts
      );

    velocity <= counts & WHOLE;
  end generate;

  g_filtered : if ESTIMATOR = 1 generate
    estimate : entity work.filtered_difference
      generic map (
        WIDTH        => WIDTH,
        PERIOD_WIDTH => PERIOD_WIDTH,
        SHIFT        => SHIFT,
        WEIGHT       => WEIGHT,
        OUT_FRAC     => VELOCITY_FRAC
      )
      port map (
        clk      => clk,
        rst      => rst,
        position => position,
        period   => velocity_period,
        velocity => velocity
      );
  end generate;

  g_window : if ESTIMATOR = 2 generate
    signal counts : std_logic_vector(WIDTH - 1 downto 0);
  begin
    estimate : entity work.window_difference
      generic map (
        WIDTH        => WIDTH,
        PERIOD_WIDTH => PERIOD_WIDTH,
        WINDOW       => WINDOW
      )
      port map (
        clk      => clk,
        rst      => rst,
        position => position,
        period   => velocity_period,
        velocity => counts
      );

    velocity <= counts & WHOLE;
  end generate;

  g_adaptive : if ESTIMATOR = 3 generate
    estimate : entity work.foaw
      generic map (
        WIDTH        => WIDTH,
        PERIOD_WIDTH => PERIOD_WIDTH,
        WINDOW       => WINDOW,
        NOISE        => NOISE,
        OUT_FRAC     => VELOCITY_FRAC
      )
      port map (
        clk      => clk,
        rst      => rst,
        position => position,
        period   => velocity_period,
        velocity => velocity
      );
  end generate;

  g_timer : if ESTIMATOR = 4 generate
    signal interval : std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    signal forward  : std_logic;
    signal stopped  : std_logic;
    signal start    : std_logic;
    signal num      : std_logic_vector(PERIOD_WIDTH downto 0);
    signal den      : std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    signal quotient : std_logic_vector(VELOCITY_WIDTH - 2 downto 0);
    signal busy     : std_logic;
    signal ready    : std_logic;
  begin
    timer : entity work.edge_timer
      generic map (
        WIDTH      => WIDTH,
        TIME_WIDTH => PERIOD_WIDTH
      )
      port map (
        clk      => clk,
        rst      => rst,
        position => position,
        interval => interval,
        forward  => forward,
        stopped  => stopped
      );

    divider : entity work.sequential_divider
      generic map (
        NUM_WIDTH => PERIOD_WIDTH + 1,
        DEN_WIDTH => PERIOD_WIDTH,
        FRAC      => VELOCITY_FRAC,
        OUT_WIDTH => VELOCITY_WIDTH - 1
      )
      port map (
        clk      => clk,
        rst      => rst,
        start    => start,
        num      => num,
        den      => den,
        quotient => quotient,
        busy     => busy,
        ready    => ready
      );

    sample : process (clk)
      -- 2^PERIOD_WIDTH - 2, written to stay inside an integer for 31 bits.
      variable countdown : natural range 0 to 2 * (2**(PERIOD_WIDTH - 1) - 1);
      variable upwards   : std_logic;
      variable standing  : std_logic;
    begin
      if rising_edge(clk) then
        if ready = '1' then
          if standing = '1' then
            velocity <= (others => '0');
          elsif upwards = '1' then
            velocity <= '0' & quotient;
          else
            velocity <= std_logic_vector(-signed('0' & quotient));
          end if;
        end if;

        start <= '0';
        if countdown = 0 then
          if (start or busy or ready) = '0' then
            start    <= '1';
            num      <= '0' & velocity_period;
            den      <= interval;
            upwards  := forward;
            standing := stopped;
          end if;
          countdown := maximum(to_integer(unsigned(velocity_period)), 1) - 1;
        else
          countdown := countdown - 1;
        end if;

        if rst = '1' then
          countdown := 0;
          upwards   := '0';
          standing  := '0';
          start     <= '0';
          num       <= (others => '0');
          den       <= (others => '0');
          velocity  <= (others => '0');
        end if;
      end if;
    end process;
  end generate;

  g_levant : if ESTIMATOR = 5 generate
    estimate : entity work.levant_differentiator
      generic map (
        WIDTH        => WIDTH,
        PERIOD_WIDTH => PERIOD_WIDTH,
        OUT_FRAC     => VELOCITY_FRAC,
        ROOT_GAIN    => ROOT_GAIN,
        SLEW         => SLEW
      )
      port map (
        clk      => clk,
        rst      => rst,
        position => position,
        period   => velocity_period,
        velocity => velocity
      );
  end generate;

  g_butterworth : if ESTIMATOR = 6 generate
    estimate : entity work.butterworth_difference
      generic map (
        WIDTH        => WIDTH,
        PERIOD_WIDTH => PERIOD_WIDTH,
        B0           => B0,
        A1           => A1,
        GUARD        => GUARD,
        OUT_FRAC     => VELOCITY_FRAC
      )
      port map (
        clk      => clk,
        rst      => rst,
        position => position,
        period   => velocity_period,
        velocity => velocity
      );
  end generate;

  spring_mult : entity work.truncating_multiplier
    generic map (
      A_WIDTH    => WIDTH,
      B_WIDTH    => STIFFNESS_WIDTH,
      A_SIGNED   => false,
      B_SIGNED   => false,
      DROP_LOWER => STIFFNESS_FRAC,
      OUT_WIDTH  => TORQUE_WIDTH,
      SATURATE   => true
    )
    port map (
      a       => penetration_s,
      b       => stiffness,
      product => spring
    );

  drag_mult : entity work.truncating_multiplier
    generic map (
      A_WIDTH    => VELOCITY_WIDTH,
      B_WIDTH    => DAMPING_WIDTH,
      A_SIGNED   => true,
      B_SIGNED   => false,
      DROP_LOWER => DAMPING_FRAC + VELOCITY_FRAC,
      OUT_WIDTH  => TORQUE_WIDTH + 1,
      SATURATE   => true
    )
    port map (
      a       => velocity,
      b       => damping,
      product => drag
    );

  relief_mult : entity work.truncating_multiplier
    generic map (
      A_WIDTH    => VELOCITY_WIDTH,
      B_WIDTH    => RELIEF_WORD'length,
      A_SIGNED   => true,
      B_SIGNED   => false,
      DROP_LOWER => DAMPING_FRAC + VELOCITY_FRAC,
      OUT_WIDTH  => TORQUE_WIDTH + 1,
      SATURATE   => true
    )
    port map (
      a       => velocity,
      b       => RELIEF_WORD,
      product => relief_torque
    );

  wall : entity work.torque_sum
    generic map (
      SPRING_WIDTH  => TORQUE_WIDTH,
      DAMPING_WIDTH => TORQUE_WIDTH + 1,
      OUT_WIDTH     => TORQUE_WIDTH + 2
    )
    port map (
      spring  => spring,
      damping => drag,
      contact => contact_s,
      torque  => wall_torque
    );

  total <= std_logic_vector(resize(signed(wall_torque), total'length) - signed(relief_torque));

  -- Only the upper limit is ever met: the total is never below -(2^(P+1) - 1).
  limiter : entity work.saturator
    generic map (
      IN_WIDTH  => TORQUE_WIDTH + 3,
      OUT_WIDTH => TORQUE_WIDTH + 2,
      LIMIT     => 2 * (2**TORQUE_WIDTH - 1) + 1
    )
    port map (
      value   => total,
      limited => torque
    );

  memory <= velocity;

end architecture;
