-- energy_bounding : a wall whose torque is bounded by the energy it holds
--
-- With P = TORQUE_WIDTH, clamp(v) = max(-(2^P - 1), min(v, 2^P - 1)) and
-- c1 = C1 / 2^BOUND_FRAC, c2 likewise. At a sample edge:
--   d        := (position - previous) mod 2^WIDTH, read as two's complement
--   previous := position
--   wanted := clamp(spring + drag) when contact, 0 otherwise, with
--     spring = min(floor(penetration * stiffness / 2^STIFFNESS_FRAC), 2^P - 1)
--     drag   = max(-2^P, min(floor(damping * d / 2^DAMPING_FRAC), 2^P - 1))
-- and LATENCY edges later, from the torque and the energy of before:
-- not LEAST_CONSERVATIVE, by bounds on the change of the torque:
--   s      := sqrt((c2*d)^2 + 2*c2*energy), floored to BOUND_FRAC fraction bits
--   highest := floor(c2*d + s)
--   lowest := ceil(c2*d - s)
--   torque := max(min(wanted, torque + floor(c1*d), highest), lowest)    d > 0
--             min(max(wanted, torque + ceil(c1*d), lowest), highest)     d < 0
--             torque                                                     d = 0
--   torque := clamp(torque)
--   energy := min(energy + torque*d, all ones)
--   torque^2 <= 2*c2*energy then holds, so that the energy never is negative.
-- LEAST_CONSERVATIVE, the bound on the torque itself:
--   energy := max(0, min(energy + c1*d^2 + torque*d, all ones))  without its first
--                                                       term when torque = 0
--   bound  := floor(2*sqrt(c1*energy)), of the energy just written
--   torque := max(-bound, min(wanted, bound))
-- Sample edges up to and including that one are passed over: d then spans several
-- samples.
--
-- The published form divides: beta = (wanted - torque) / d, bounds on beta, then
-- torque + beta*d. But beta is only ever used as beta*d. With the bounds multiplied
-- by d, which turns min and max round for d < 0, nothing but a root is left.
--
-- generics WIDTH                            bits of the position
--          STIFFNESS_WIDTH, STIFFNESS_FRAC  bits of the stiffness, its fraction
--          DAMPING_WIDTH, DAMPING_FRAC      bits of the damping, its fraction
--          PERIOD_WIDTH                     bits of the sample period, 2 to 30
--          SCALE_WIDTH, SCALE_FRAC          bits of the scale, its fraction
--          TORQUE_WIDTH                     bits of the torque's magnitude, at most 30
--          LEAST_CONSERVATIVE               which form
--          C1, C2                           BOUND_FRAC fraction bits, less than
--                                           2^BOUND_WIDTH, PWM counts per count
--          BOUND_FRAC                       fraction bits of C1 and C2
--          BOUND_WIDTH                      bits of C1 and C2
--          ENERGY_WIDTH                     bits of the energy
--          ROOT_WIDTH                       bits under the root, even, at most 62, at
--                                           least 2*(BOUND_WIDTH+WIDTH) and
--                                           BOUND_WIDTH+ENERGY_WIDTH+BOUND_FRAC+2
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
--          memory      the energy, PWM counts times counts:
--                      (0,ENERGY_WIDTH,0)                      not LEAST_CONSERVATIVE
--                      (0,ENERGY_WIDTH-BOUND_FRAC,BOUND_FRAC)  LEAST_CONSERVATIVE
-- latency  LATENCY = ROOT_WIDTH/2+2 edges after a sample edge; a new period takes
--          effect at the next sample edge, passed over or not
-- reset    torque 0, energy 0, previous 0; the first edge after it is a sample edge
-- overflow d wraps with the counter; the energy saturates; spring, drag and torque
--          clamp, all torques to +-(2^TORQUE_WIDTH - 1)
-- source   Kim, Ryu 2010, the energy-bounding algorithm, and its least conservative
--          form
-- differs from the hardware: the products take one edge, so no limit on the
--          clock. The emulator computes the root at the sample edge and shows
--          it LATENCY edges later: the ports are exact at every edge, the
--          registers of the root are not modelled.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity energy_bounding is
  generic (
    WIDTH              : positive := 12;
    STIFFNESS_WIDTH    : positive := 12;
    STIFFNESS_FRAC     : natural  := 0;
    DAMPING_WIDTH      : positive := 12;
    DAMPING_FRAC       : natural  := 0;
    PERIOD_WIDTH       : positive range 2 to 30 := 24;
    SCALE_WIDTH        : positive := 16;
    SCALE_FRAC         : natural  := 8;
    TORQUE_WIDTH       : positive := 12;
    LEAST_CONSERVATIVE : boolean  := false;
    C1                 : natural  := 320;
    C2                 : natural  := 320;
    BOUND_FRAC         : natural  := 4;
    BOUND_WIDTH        : positive := 14;
    ENERGY_WIDTH       : positive := 32;
    ROOT_WIDTH         : positive := 54
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

architecture rtl of energy_bounding is

  -- Room for every sum of energies, and of torques with BOUND_FRAC fraction bits.
  constant WIDE_WIDTH : positive
    := maximum(maximum(ENERGY_WIDTH, BOUND_WIDTH + 2 * WIDTH),
               maximum(TORQUE_WIDTH + WIDTH + BOUND_FRAC, ROOT_WIDTH / 2)) + 4;

  subtype wide_word   is signed(WIDE_WIDTH - 1 downto 0);
  subtype energy_word is unsigned(ENERGY_WIDTH - 1 downto 0);

  signal moved    : signed(WIDTH - 1 downto 0);  -- d of the last sample edge
  signal demand   : wide_word;                   -- wanted of the last sample edge
  signal energy   : energy_word;
  signal shown    : signed(TORQUE_WIDTH + 1 downto 0);
  signal pull     : signed(BOUND_WIDTH + WIDTH - 1 downto 0);       -- c2 * d
  signal pulled   : signed(2 * (BOUND_WIDTH + WIDTH) - 1 downto 0); -- its square
  signal moved2   : signed(2 * WIDTH - 1 downto 0);                 -- d^2
  signal worked   : signed(TORQUE_WIDTH + WIDTH + 1 downto 0);      -- shown * d
  signal bounded  : signed(TORQUE_WIDTH + 1 downto 0);              -- the torque to come
  signal used     : signed(TORQUE_WIDTH + WIDTH downto 0);          -- what it takes
  signal previous : std_logic_vector(WIDTH - 1 downto 0);
  signal d        : std_logic_vector(WIDTH - 1 downto 0);
  signal spring   : std_logic_vector(TORQUE_WIDTH - 1 downto 0);
  signal drag     : std_logic_vector(TORQUE_WIDTH downto 0);
  signal sum      : std_logic_vector(TORQUE_WIDTH + 1 downto 0);
  signal wanted   : std_logic_vector(TORQUE_WIDTH downto 0);
  signal start    : std_logic;
  signal radicand : std_logic_vector(ROOT_WIDTH - 1 downto 0);
  signal root     : std_logic_vector(ROOT_WIDTH / 2 - 1 downto 0);
  signal rooting  : std_logic;
  signal ready    : std_logic;
  signal busy     : std_logic;

  -- Gated instead of chosen, so that an unknown value stays unknown.
  function choose(first : std_logic; a, b : wide_word) return wide_word is
  begin
    return signed((std_logic_vector(a) and first) or (std_logic_vector(b) and not first));
  end function;

  function smaller(a, b : wide_word) return wide_word is
    constant DIFFERENCE : wide_word := a - b;
  begin
    return choose(DIFFERENCE(DIFFERENCE'high), a, b);
  end function;

  function larger(a, b : wide_word) return wide_word is
    constant DIFFERENCE : wide_word := a - b;
  begin
    return choose(DIFFERENCE(DIFFERENCE'high), b, a);
  end function;

  -- min(value, 2^TORQUE_WIDTH - 1), gated again. No constants: GHDL 2.0 writes those
  -- of more than 32 bits wrongly into a Verilog netlist.
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

  function wide(value : signed) return wide_word is
  begin
    return resize(value, WIDE_WIDTH);
  end function;

  function wide(value : unsigned) return wide_word is
  begin
    return resize(signed('0' & value), WIDE_WIDTH);
  end function;

  -- bound * distance, BOUND_FRAC fraction bits.
  function product(bound : natural; distance : signed) return wide_word is
  begin
    return wide(to_signed(bound, BOUND_WIDTH + 1) * distance);
  end function;

  -- The floor and the ceiling of a word with BOUND_FRAC fraction bits.
  -- A slice, not shift_right: GHDL 2.0 writes that into a Verilog netlist without
  -- the sign.
  function below(value : wide_word) return wide_word is
  begin
    return resize(value(WIDE_WIDTH - 1 downto BOUND_FRAC), WIDE_WIDTH);
  end function;

  function above(value : wide_word) return wide_word is
  begin
    return -below(-value);
  end function;

  -- Between 0 and all ones, gated again.
  function clamp(value : wide_word) return energy_word is
    constant WORD : std_logic_vector(wide_word'range) := std_logic_vector(value);
    variable more : std_logic := '0';
  begin
    for i in ENERGY_WIDTH to WIDE_WIDTH - 2 loop
      more := more or WORD(i);
    end loop;
    return unsigned((WORD(energy_word'range) or more) and not WORD(WORD'high));
  end function;

  -- bound * energy * 2^places. A product of signed words, here too: of one of
  -- unsigned words GHDL 2.0 loses the top bit in a VHDL netlist.
  function under_root(bound : natural; energy : energy_word; places : natural) return unsigned is
    constant FULL : signed(BOUND_WIDTH + ENERGY_WIDTH + 1 downto 0)
      := to_signed(bound, BOUND_WIDTH + 1) * signed('0' & energy);
  begin
    return shift_left(resize(unsigned(FULL), ROOT_WIDTH), places);
  end function;

  -- The torque wanted within the bounds: by the root alone, or by c1 and c2.
  function within(wanted : wide_word; last : signed; moved : signed; bound : unsigned)
    return signed is
    variable total           : wide_word;
    variable highest, lowest : wide_word;
  begin
    if LEAST_CONSERVATIVE then
      highest := topped(below(wide(bound)));
      total   := larger(smaller(wanted, highest), -highest);
      return total(TORQUE_WIDTH + 1 downto 0);
    end if;
    highest := below(product(C2, moved) + wide(bound));
    lowest  := above(product(C2, moved) - wide(bound));
    total   := wide(last);
    if moved(moved'high) = '1' then
      total := total + above(product(C1, moved));
      total := smaller(larger(larger(wanted, total), lowest), highest);
    elsif moved /= 0 then
      total := total + below(product(C1, moved));
      total := larger(smaller(smaller(wanted, total), highest), lowest);
    end if;
    total := limited(total);
    return total(TORQUE_WIDTH + 1 downto 0);
  end function;

begin

  pull    <= resize(to_signed(C2, BOUND_WIDTH + 1) * signed(d), pull'length);
  pulled  <= pull * pull;
  moved2  <= signed(d) * signed(d);
  worked  <= shown * signed(d);
  bounded <= within(demand, shown, moved, unsigned(root));
  used    <= bounded(TORQUE_WIDTH downto 0) * moved;

  busy <= start or rooting or ready;

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

  root_of_energy : entity work.square_root
    generic map (
      WIDTH => ROOT_WIDTH
    )
    port map (
      clk   => clk,
      rst   => rst,
      start => start,
      x     => radicand,
      root  => root,
      busy  => rooting,
      ready => ready
    );

  process (clk)
    -- 2^PERIOD_WIDTH - 2, written to stay inside an integer for 31 bits.
    variable countdown : natural range 0 to 2 * (2**(PERIOD_WIDTH - 1) - 1);
    variable filled    : energy_word;  -- the energy to come
    variable total     : wide_word;
  begin
    if rising_edge(clk) then
      start <= '0';

      if countdown = 0 then
        if busy = '0' then
          moved    <= signed(d);
          demand   <= wide(signed(wanted));
          previous <= position;
          start    <= '1';

          if LEAST_CONSERVATIVE then
            total := product(C1, moved2) + shift_left(wide(worked), BOUND_FRAC);
            if shown /= 0 then
              total := total + wide(energy);
            end if;
            filled   := clamp(total);
            radicand <= std_logic_vector(under_root(C1, filled, 2));
          else
            radicand <= std_logic_vector(unsigned(resize(pulled, ROOT_WIDTH))
                                         + under_root(C2, energy, BOUND_FRAC + 1));
          end if;
        end if;
        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        countdown := countdown - 1;
      end if;

      if ready = '1' then
        if not LEAST_CONSERVATIVE then
          filled := clamp(wide(energy) + wide(used));
        end if;

        shown  <= bounded;
        energy <= filled;
        torque <= std_logic_vector(bounded);
        memory <= std_logic_vector(filled);
      end if;

      if rst = '1' then
        countdown := 0;
        moved     <= (others => '0');
        demand    <= (others => '0');
        energy    <= (others => '0');
        filled    := (others => '0');
        shown     <= (others => '0');
        previous  <= (others => '0');
        start     <= '0';
        radicand  <= (others => '0');
        torque    <= (others => '0');
        memory    <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
