-- torque_table : a table of torques over the position, with a wall as its end stop
--
-- At a sample edge, with n = position mod 2^(TABLE_BITS + SHIFT), i the TABLE_BITS upper
-- bits of n, part its SHIFT lower ones, and d the motion since the last one:
--   texture' := T(i) + floor((T(i + 1) - T(i)) * part / 2^SHIFT)
--   torque'  := clamp(wanted + texture', -(2^P - 1), 2^P - 1)
-- where T(2^TABLE_BITS) is T0, with the torque of spring and drag, in contact only,
--   wanted = clamp(spring + drag, -(2^P - 1), 2^P - 1)
--   spring = min(floor(penetration * stiffness / 2^STIFFNESS_FRAC), 2^P - 1)
--   drag   = clamp(floor(damping * d / 2^DAMPING_FRAC), -2^P, 2^P - 1)
-- and P = TORQUE_WIDTH.
--
-- generics WIDTH                            bits of the position
--          STIFFNESS_WIDTH, STIFFNESS_FRAC  bits of the stiffness, its fraction
--          DAMPING_WIDTH, DAMPING_FRAC      bits of the damping, its fraction
--          PERIOD_WIDTH                     bits of the period, 2 to 30
--          SCALE_WIDTH, SCALE_FRAC          bits of the scale, its fraction
--          TORQUE_WIDTH                     bits of a torque's magnitude, at most 30
--          TABLE_BITS                       the table has 2^TABLE_BITS torques, 1 to 5
--          SHIFT                            2^SHIFT counts from one to the next
--          T0 to T31                        torques, within +-(2^P - 1); those beyond
--                                           the table are ignored
-- in       position    (0,WIDTH,0)
--          delta       (1,WIDTH-1,0)        ignored
--          contact     (0,1,0)
--          penetration (0,WIDTH,0)
--          stiffness   (0,STIFFNESS_WIDTH-STIFFNESS_FRAC,STIFFNESS_FRAC)
--                                           PWM counts per position count
--          damping     (0,DAMPING_WIDTH-DAMPING_FRAC,DAMPING_FRAC)
--                                           PWM counts per count per sample
--          period      (0,PERIOD_WIDTH,0)   sample period in clocks, 0 acts as 1
--          scale       (0,SCALE_WIDTH-SCALE_FRAC,SCALE_FRAC)  ignored
-- out      torque      (1,TORQUE_WIDTH+1,0) positive resists penetration
--          memory      (1,TORQUE_WIDTH,0)   the texture
-- latency  1 edge, sample edges only; a new period takes effect at the next
--          sample edge
-- reset    everything 0; the first edge after it is a sample edge
-- overflow products and torque clamp
-- source   straight lines between the entries of a table, as of every textbook
-- differs from the hardware: all products take one edge, so no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity torque_table is
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
    TABLE_BITS      : positive range 1 to 5 := 4;
    SHIFT           : natural  := 4;
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
    memory      : out std_logic_vector(TORQUE_WIDTH downto 0)
  );
end entity;

architecture rtl of torque_table is

  constant TOP         : natural  := 2**TORQUE_WIDTH - 1;
  constant WIDE        : positive := TORQUE_WIDTH + SHIFT + 4;

  type table is array (0 to 31) of integer;
  constant WORDS       : table :=
    (T0, T1, T2, T3, T4, T5, T6, T7, T8, T9, T10, T11, T12, T13, T14, T15, T16,
     T17, T18, T19, T20, T21, T22, T23, T24, T25, T26, T27, T28, T29, T30, T31);

  subtype texture_word is signed(TORQUE_WIDTH downto 0);

  -- The torque of the table at a position.
  function texture_of(place : std_logic_vector) return texture_word is
    variable index : natural range 0 to 2**TABLE_BITS - 1;
    variable part  : signed(SHIFT + 1 downto 0);
    variable here  : signed(TORQUE_WIDTH + 1 downto 0);
    variable there : signed(TORQUE_WIDTH + 1 downto 0);
    variable sloped: signed(WIDE - 1 downto 0);
  begin
    if is_x(place) then
      return (others => 'X');
    end if;
    index := to_integer(unsigned(place(TABLE_BITS + SHIFT - 1 downto SHIFT)));
    part  := resize(signed('0' & place(SHIFT - 1 downto 0)), SHIFT + 2);
    here  := to_signed(WORDS(index), TORQUE_WIDTH + 2);
    there := to_signed(WORDS((index + 1) mod 2**TABLE_BITS), TORQUE_WIDTH + 2);
    sloped := shift_left(resize(here, WIDE), SHIFT) + resize((there - here) * part, WIDE);
    return sloped(SHIFT + TORQUE_WIDTH downto SHIFT);
  end function;

  signal previous : std_logic_vector(WIDTH - 1 downto 0);
  signal d        : std_logic_vector(WIDTH - 1 downto 0);
  signal spring   : std_logic_vector(TORQUE_WIDTH - 1 downto 0);
  signal drag     : std_logic_vector(TORQUE_WIDTH downto 0);
  signal sum      : std_logic_vector(TORQUE_WIDTH + 1 downto 0);
  signal wanted   : std_logic_vector(TORQUE_WIDTH downto 0);
  signal texture  : texture_word;
  signal total    : signed(TORQUE_WIDTH + 1 downto 0);
  signal limited  : std_logic_vector(TORQUE_WIDTH downto 0);

begin

  texture <= texture_of(position);
  total   <= resize(texture, TORQUE_WIDTH + 2) + signed(wanted);

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
      LIMIT     => TOP
    )
    port map (
      value   => sum,
      limited => wanted
    );

  bridge : entity work.saturator
    generic map (
      IN_WIDTH  => TORQUE_WIDTH + 2,
      OUT_WIDTH => TORQUE_WIDTH + 1,
      LIMIT     => TOP
    )
    port map (
      value   => std_logic_vector(total),
      limited => limited
    );

  process (clk)
    -- 2^PERIOD_WIDTH - 2, written to stay inside an integer for 31 bits.
    variable countdown : natural range 0 to 2 * (2**(PERIOD_WIDTH - 1) - 1);
  begin
    if rising_edge(clk) then
      if countdown = 0 then
        previous  <= position;
        memory    <= std_logic_vector(texture);
        torque    <= std_logic_vector(resize(signed(limited), TORQUE_WIDTH + 2));
        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        countdown := countdown - 1;
      end if;

      if rst = '1' then
        countdown := 0;
        previous  <= (others => '0');
        memory    <= (others => '0');
        torque    <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
