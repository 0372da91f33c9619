-- passive_spring : a discrete spring that gives back no more than it took
--
-- The extension is what follows the spring's energy k*x^2/2, not the position:
-- a step d of the device moves the virtual spring by ALPHA*d and adds to the
-- energy exactly the work k*x*ALPHA*d done against the torque that was held
-- meanwhile. At a sample edge:
--   d        := (position - previous) mod 2^WIDTH, read as two's complement
--   previous := position
--   engage   := x = 0 and contact = 1 and (contact at the last such edge = 0 or REVIVE)
--   square   := penetration^2                                engage
--               max(0, x^2 + 2 * x * (ALPHA / 2^8) * d)      otherwise
--   force    := stiffness * scale
-- and LATENCY edges later, with that edge's force:
--   x      := sqrt(square), floored to EXTENSION_FRAC fraction bits, at most all ones
--   torque := min(floor(force * x), 2^TORQUE_WIDTH - 1)
-- x and square are exact: x has EXTENSION_FRAC fraction bits, square twice as many,
-- stiffness and scale those of their formats. Sample edges up to and including the
-- one that writes x are passed over: d then spans several samples.
-- An x that has come to 0 stays there until engage: REVIVE allows it while in
-- contact, otherwise the device must leave the wall first.
--
-- generics WIDTH                            bits of the position
--          STIFFNESS_WIDTH, STIFFNESS_FRAC  bits of the stiffness, its fraction
--          DAMPING_WIDTH, DAMPING_FRAC      bits of the damping, its fraction
--          PERIOD_WIDTH                     bits of the sample period, 2 to 30
--          SCALE_WIDTH, SCALE_FRAC          bits of the scale, its fraction
--          TORQUE_WIDTH                     bits of the torque's magnitude, at most 30
--          EXTENSION_FRAC                   fraction bits of the extension, at
--                                           least 8; WIDTH+EXTENSION_FRAC at most 30
--          ALPHA                            virtual motion for one of the device,
--                                           8 fraction bits
--          REVIVE                           engage again without leaving the wall
-- in       position    (0,WIDTH,0)
--          delta       (1,WIDTH-1,0)  ignored
--          contact     (0,1,0)        inside the wall
--          penetration (0,WIDTH,0)
--          stiffness   (0,STIFFNESS_WIDTH-STIFFNESS_FRAC,STIFFNESS_FRAC)
--                                     PWM counts per count, read at the sample edge
--          damping     (0,DAMPING_WIDTH-DAMPING_FRAC,DAMPING_FRAC)  ignored
--          period      (0,PERIOD_WIDTH,0)  sample period in clocks, 0 acts as 1
--          scale       (0,SCALE_WIDTH-SCALE_FRAC,SCALE_FRAC)  force shown for one
--                                     of the virtual spring, read at the sample edge
-- out      torque      (1,TORQUE_WIDTH+1,0)  positive = against the penetration
--          memory      (0,WIDTH,EXTENSION_FRAC)  the extension x
-- latency  LATENCY = WIDTH+EXTENSION_FRAC+3 edges after a sample edge; a new
--          period takes effect at the next sample edge, passed over or not
-- reset    torque 0, x 0, out of contact; the first edge after it is a sample edge
-- overflow d wraps with the counter; the square, x and the torque saturate
-- source   the energy-level update of passivity-preserving discrete springs, with
--          power scaling
-- differs from the hardware: the products take one edge, so no limit on the
--          clock. The emulator computes the root at the sample edge and shows
--          it LATENCY edges later: the ports are exact at every edge, the
--          registers of the root are not modelled.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity passive_spring is
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
    EXTENSION_FRAC  : natural  := 8;
    ALPHA           : natural  := 256;
    REVIVE          : boolean  := true
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
    memory      : out std_logic_vector(WIDTH + EXTENSION_FRAC - 1 downto 0)
  );
end entity;

architecture rtl of passive_spring is

  constant EXTENSION_WIDTH : positive := WIDTH + EXTENSION_FRAC;
  constant ROOT_WIDTH      : positive := 2 * EXTENSION_WIDTH + 2;
  constant ALPHA_WIDTH     : positive := 32;

  -- Room for x^2 + 2 * x * ALPHA * d with 2*EXTENSION_FRAC fraction bits, and for
  -- stiffness * x * scale. All products are of signed words: of one of
  -- unsigned words GHDL 2.0 loses the top bit in a VHDL netlist.
  constant SQUARE_WIDTH    : positive := ROOT_WIDTH + ALPHA_WIDTH + 2;
  constant FORCE_FRAC      : natural  := STIFFNESS_FRAC + EXTENSION_FRAC + SCALE_FRAC;
  constant FORCE_WIDTH     : positive
    := maximum(STIFFNESS_WIDTH + EXTENSION_WIDTH + SCALE_WIDTH, FORCE_FRAC + TORQUE_WIDTH) + 3;

  -- A length never is negative: its sign bit is 0.
  subtype length_word is signed(EXTENSION_WIDTH downto 0);

  signal previous : unsigned(WIDTH - 1 downto 0);
  signal x        : length_word;
  -- Stiffness and scale as of the sample edge: a torque is made of one sample.
  signal k        : signed(STIFFNESS_WIDTH downto 0);
  signal beta     : signed(SCALE_WIDTH downto 0);
  signal d        : signed(WIDTH - 1 downto 0);
  signal pace     : signed(WIDTH + ALPHA_WIDTH - 1 downto 0);                        -- alpha * d
  signal gained   : signed(EXTENSION_WIDTH + WIDTH + ALPHA_WIDTH downto 0);          -- x * alpha * d
  signal area     : signed(ROOT_WIDTH - 1 downto 0);                                 -- x^2
  signal depth    : length_word;
  signal reached  : length_word;
  signal pull     : signed(STIFFNESS_WIDTH + EXTENSION_WIDTH + 1 downto 0);          -- k * x
  signal push     : signed(STIFFNESS_WIDTH + EXTENSION_WIDTH + SCALE_WIDTH + 2 downto 0);
  signal start    : std_logic;
  signal square   : std_logic_vector(ROOT_WIDTH - 1 downto 0);
  signal root     : std_logic_vector(EXTENSION_WIDTH downto 0);
  signal rooting  : std_logic;
  signal ready    : std_logic;
  signal busy     : std_logic;

  -- Between 0 and the largest word of `bits` bits. Gated instead of chosen, so
  -- that an unknown value stays unknown.
  function clamp(value : signed; bits : positive) return std_logic_vector is
    constant WORD  : std_logic_vector(value'length - 1 downto 0) := std_logic_vector(value);
    variable above : std_logic := '0';
  begin
    for i in bits to WORD'high - 1 loop
      above := above or WORD(i);
    end loop;
    return (WORD(bits - 1 downto 0) or above) and not WORD(WORD'high);
  end function;

begin

  d       <= signed(unsigned(position) - previous);
  pace    <= d * to_signed(ALPHA, ALPHA_WIDTH);
  gained  <= x * pace;
  area    <= x * x;
  depth   <= shift_left(resize(signed('0' & penetration), depth'length), EXTENSION_FRAC);
  reached <= signed('0' & clamp(signed('0' & root), EXTENSION_WIDTH));
  pull    <= k * reached;
  push    <= pull * beta;

  busy <= start or rooting or ready;

  root_of_square : entity work.square_root
    generic map (
      WIDTH => ROOT_WIDTH
    )
    port map (
      clk   => clk,
      rst   => rst,
      start => start,
      x     => square,
      root  => root,
      busy  => rooting,
      ready => ready
    );

  process (clk)
    -- 2^PERIOD_WIDTH - 2, written to stay inside an integer for 31 bits.
    variable countdown : natural range 0 to 2 * (2**(PERIOD_WIDTH - 1) - 1);
    variable touched   : std_logic;  -- contact at the last sample edge not passed over
  begin
    if rising_edge(clk) then
      start <= '0';

      if countdown = 0 then
        if busy = '0' then
          if std_logic_vector(x) = (x'range => '0') and contact = '1'
             and (touched = '0' or REVIVE) then
            square <= std_logic_vector(depth * depth);
          else
            -- x^2 + 2 * x * alpha * d, in which alpha has 8 fraction bits.
            square <= clamp(resize(area, SQUARE_WIDTH)
                            + shift_left(resize(gained, SQUARE_WIDTH), EXTENSION_FRAC - 7), ROOT_WIDTH);
          end if;
          previous <= unsigned(position);
          touched  := contact;
          k        <= signed('0' & stiffness);
          beta     <= signed('0' & scale);
          start    <= '1';
        end if;
        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        countdown := countdown - 1;
      end if;

      if ready = '1' then
        x      <= reached;
        torque <= "00" & clamp(shift_right(resize(push, FORCE_WIDTH), FORCE_FRAC), TORQUE_WIDTH);
        memory <= std_logic_vector(reached(EXTENSION_WIDTH - 1 downto 0));
      end if;

      if rst = '1' then
        countdown := 0;
        previous  <= (others => '0');
        x         <= (others => '0');
        touched   := '0';
        start     <= '0';
        square    <= (others => '0');
        torque    <= (others => '0');
        memory    <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
