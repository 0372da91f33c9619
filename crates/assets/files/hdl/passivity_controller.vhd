-- passivity_controller : a wall with a passivity observer and controller in series
--
-- The observer adds up what flows into the wall, torque times displacement; once
-- that is negative, the wall has given back more than it took, and the controller
-- changes the torque by what takes the deficit back in one more step like the
-- last. With P = TORQUE_WIDTH and clamp(v) = max(-(2^P - 1), min(v, 2^P - 1)), at
-- a sample edge:
--   d        := (position - previous) mod 2^WIDTH, read as two's complement
--   previous := position
--   wanted := clamp(spring + drag) when contact, 0 otherwise, with
--     spring = min(floor(penetration * stiffness / 2^STIFFNESS_FRAC), 2^P - 1)
--     drag   = max(-2^P, min(floor(damping * d / 2^DAMPING_FRAC), 2^P - 1))
--   energy := saturate(energy + wanted*d + correction*d(last))   not EXACT
--             saturate(energy + torque*d)                        EXACT
--   energy := min(energy, CREDIT)                                CREDIT > 0
-- and LATENCY edges later, with d and wanted of that sample edge:
--   need       := min(floor(|energy| / |d|), 2^P - 1) with the sign of d
--                                                   energy < 0 and d /= 0
--                 0                                 otherwise
--   torque     := clamp(wanted + need)
--   correction := torque - wanted
-- Sample edges up to and including that one are passed over: d then spans several
-- samples, and d(last) is that of the last one not passed over. saturate is to the
-- range of the energy's word.
-- Not EXACT is the published observer, one sample behind the torque; EXACT counts
-- the torque that was held while the device moved.
--
-- generics WIDTH                            bits of the position
--          STIFFNESS_WIDTH, STIFFNESS_FRAC  bits of the stiffness, its fraction
--          DAMPING_WIDTH, DAMPING_FRAC      bits of the damping, its fraction
--          PERIOD_WIDTH                     bits of the sample period, 2 to 30
--          SCALE_WIDTH, SCALE_FRAC          bits of the scale, its fraction
--          TORQUE_WIDTH                     bits of the torque's magnitude, at most 30
--          EXACT                            which observer
--          ENERGY_WIDTH                     bits of the energy, TORQUE_WIDTH to 48
--          CREDIT                           the most energy to hold, 0 for no limit
-- in       position    (0,WIDTH,0)
--          delta       (1,WIDTH-1,0)  ignored
--          contact     (0,1,0)        inside the wall
--          penetration (0,WIDTH,0)
--          stiffness   (0,STIFFNESS_WIDTH-STIFFNESS_FRAC,STIFFNESS_FRAC)
--                                     PWM counts per count
--          damping     (0,DAMPING_WIDTH-DAMPING_FRAC,DAMPING_FRAC)
--                                     PWM counts per count/sample
--          period      (0,PERIOD_WIDTH,0)  sample period in clocks, 0 acts as 1
--          scale       (0,SCALE_WIDTH-SCALE_FRAC,SCALE_FRAC)  ignored
-- out      torque      (1,TORQUE_WIDTH+1,0)  positive = against the penetration
--          memory      (1,ENERGY_WIDTH-1,0)  the energy, PWM counts times counts,
--                                     written on the sample edge
-- latency  LATENCY = ENERGY_WIDTH+2 edges after a sample edge; a new period takes
--          effect at the next sample edge, passed over or not
-- reset    torque 0, energy 0, correction 0, previous 0; the first edge after it
--          is a sample edge
-- overflow d wraps with the counter; the energy saturates; spring, drag, quotient
--          and torque clamp, all torques to +-(2^TORQUE_WIDTH - 1)
-- source   Hannaford, Ryu 2002, time-domain passivity control
-- differs from the hardware: the products take one edge, so no limit on the
--          clock. The emulator computes the quotient at the sample edge and
--          shows it LATENCY edges later: the ports are exact at every edge, the
--          registers of the division are not modelled.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity passivity_controller is
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
    EXACT           : boolean  := false;
    ENERGY_WIDTH    : positive := 32;
    CREDIT          : natural  := 0
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
    memory      : out std_logic_vector(ENERGY_WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of passivity_controller is

  -- Room for the total less CREDIT. An energy is at most 2^(ENERGY_WIDTH-1) from 0, a
  -- torque times a displacement less than 2^(TORQUE_WIDTH+WIDTH-1). A correction has
  -- the sign of its displacement and is at most |energy|/|d|: their product is never
  -- negative, and never takes an energy beyond 0. So the total stays within 2^M of 0,
  -- M = max(ENERGY_WIDTH, TORQUE_WIDTH + WIDTH), and CREDIT < 2^31 leaves it within
  -- 2^(max(M, 31)+1).
  constant WIDE_WIDTH : positive
    := maximum(maximum(ENERGY_WIDTH, TORQUE_WIDTH + WIDTH), 31) + 2;

  subtype wide_word   is signed(WIDE_WIDTH - 1 downto 0);
  subtype energy_word is signed(ENERGY_WIDTH - 1 downto 0);

  signal moved      : signed(WIDTH - 1 downto 0);         -- d of the last sample edge
  signal shown      : signed(TORQUE_WIDTH downto 0);
  signal correction : signed(TORQUE_WIDTH + 1 downto 0);

  -- Torques times displacements: of the one that was shown, of the one wanted, and of
  -- the correction in force.
  signal exactly  : signed(TORQUE_WIDTH + WIDTH downto 0);
  signal asked    : signed(TORQUE_WIDTH + WIDTH downto 0);
  signal added    : signed(TORQUE_WIDTH + WIDTH + 1 downto 0);

  signal previous : std_logic_vector(WIDTH - 1 downto 0);
  signal d        : std_logic_vector(WIDTH - 1 downto 0);
  signal spring   : std_logic_vector(TORQUE_WIDTH - 1 downto 0);
  signal drag     : std_logic_vector(TORQUE_WIDTH downto 0);
  signal sum      : std_logic_vector(TORQUE_WIDTH + 1 downto 0);
  signal wanted   : std_logic_vector(TORQUE_WIDTH downto 0);
  signal start    : std_logic;
  signal deficit  : std_logic_vector(ENERGY_WIDTH - 1 downto 0);
  signal distance : std_logic_vector(WIDTH - 1 downto 0);
  signal need     : std_logic_vector(TORQUE_WIDTH - 1 downto 0);
  signal dividing : std_logic;
  signal ready    : std_logic;
  signal busy     : std_logic;

  function wide(value : signed) return wide_word is
  begin
    return resize(value, WIDE_WIDTH);
  end function;

  -- min(value, 2^TORQUE_WIDTH - 1). Gated instead of chosen, so that an unknown value
  -- stays unknown; and no constant: GHDL 2.0 writes one of more than 32 bits wrongly
  -- into a Verilog netlist.
  function topped(value : wide_word) return wide_word is
    constant WORD : std_logic_vector(wide_word'range) := std_logic_vector(value);
    variable over : std_logic := '0';
  begin
    for i in TORQUE_WIDTH to WIDE_WIDTH - 2 loop
      over := over or WORD(i);
    end loop;
    over := over and not WORD(WORD'high);
    return signed((WORD(WIDE_WIDTH - 1 downto TORQUE_WIDTH) and not over)
                  & (WORD(TORQUE_WIDTH - 1 downto 0) or over));
  end function;

  -- The same on both sides.
  function limited(value : wide_word) return wide_word is
  begin
    return -topped(-topped(value));
  end function;

  -- The bits above an energy's must all be its sign; where they are not, all others
  -- become the opposite of the sign. Gated again.
  function saturate(value : wide_word) return energy_word is
    constant SIGN : std_logic := value(value'high);
    constant WORD : std_logic_vector(ENERGY_WIDTH - 2 downto 0)
      := std_logic_vector(value(ENERGY_WIDTH - 2 downto 0));
    variable over : std_logic := '0';
  begin
    for i in ENERGY_WIDTH - 1 to WIDE_WIDTH - 2 loop
      over := over or (value(i) xor SIGN);
    end loop;
    return signed(SIGN & ((WORD and not over) or (over and not SIGN)));
  end function;

  -- Not abs: GHDL 2.0 writes it into a Verilog netlist as it stands.
  function magnitude(value : signed) return std_logic_vector is
  begin
    if value(value'high) = '1' then
      return std_logic_vector(-value);
    end if;
    return std_logic_vector(value);
  end function;

begin

  torque  <= std_logic_vector(resize(shown, torque'length));

  exactly <= shown * signed(d);
  asked   <= signed(wanted) * signed(d);
  added   <= correction * moved;

  busy <= start or dividing or ready;

  displaced : entity work.displacement
    generic map (
      WIDTH => WIDTH
    )
    port map (
      position  => position,
      reference => previous,
      delta     => d
    );

  spring_mult : entity work.truncating_multiplier
    generic map (
      A_WIDTH    => WIDTH,
      B_WIDTH    => STIFFNESS_WIDTH,
      DROP_LOWER => STIFFNESS_FRAC,
      OUT_WIDTH  => TORQUE_WIDTH
    )
    port map (
      a       => penetration,
      b       => stiffness,
      product => spring
    );

  damping_mult : entity work.truncating_multiplier
    generic map (
      A_WIDTH    => WIDTH,
      B_WIDTH    => DAMPING_WIDTH,
      A_SIGNED   => true,
      DROP_LOWER => DAMPING_FRAC,
      OUT_WIDTH  => TORQUE_WIDTH + 1
    )
    port map (
      a       => d,
      b       => damping,
      product => drag
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
      contact => contact,
      torque  => sum
    );

  limiter : entity work.saturator
    generic map (
      IN_WIDTH  => TORQUE_WIDTH + 2,
      OUT_WIDTH => TORQUE_WIDTH + 1,
      LIMIT     => 2**TORQUE_WIDTH - 1
    )
    port map (
      value   => sum,
      limited => wanted
    );

  divider : entity work.sequential_divider
    generic map (
      NUM_WIDTH => ENERGY_WIDTH,
      DEN_WIDTH => WIDTH,
      FRAC      => 0,
      OUT_WIDTH => TORQUE_WIDTH
    )
    port map (
      clk      => clk,
      rst      => rst,
      start    => start,
      num      => deficit,
      den      => distance,
      quotient => need,
      busy     => dividing,
      ready    => ready
    );

  process (clk)
    -- 2^PERIOD_WIDTH - 2, written to stay inside an integer for 31 bits.
    variable countdown : natural range 0 to 2 * (2**(PERIOD_WIDTH - 1) - 1);
    variable energy    : energy_word;
    variable demand    : wide_word;  -- wanted of the last sample edge
    variable total     : wide_word;
    variable excess    : wide_word;  -- what CREDIT does not hold
  begin
    if rising_edge(clk) then
      start <= '0';

      if countdown = 0 then
        if busy = '0' then
          if EXACT then
            total := wide(energy) + wide(exactly);
          else
            total := wide(energy) + wide(asked) + wide(added);
          end if;
          if CREDIT > 0 then
            excess := total - CREDIT;
            total  := total - signed(std_logic_vector(excess) and not excess(excess'high));
          end if;
          energy   := saturate(total);
          moved    <= signed(d);
          demand   := wide(signed(wanted));
          previous <= position;
          memory   <= std_logic_vector(energy);
          deficit  <= magnitude(energy);
          distance <= magnitude(signed(d));
          start    <= '1';
        end if;
        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        countdown := countdown - 1;
      end if;

      if ready = '1' then
        total := demand;
        if energy(energy'high) = '1' and moved /= 0 then
          if moved(moved'high) = '1' then
            total := limited(demand - wide(signed('0' & need)));
          else
            total := limited(demand + wide(signed('0' & need)));
          end if;
        end if;
        shown      <= total(shown'range);
        total      := total - demand;
        correction <= total(correction'range);
      end if;

      if rst = '1' then
        countdown  := 0;
        energy     := (others => '0');
        moved      <= (others => '0');
        demand     := (others => '0');
        shown      <= (others => '0');
        correction <= (others => '0');
        previous   <= (others => '0');
        start      <= '0';
        deficit    <= (others => '0');
        distance   <= (others => '0');
        memory     <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
