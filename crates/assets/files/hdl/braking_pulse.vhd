-- braking_pulse : a wall that takes the momentum out at its entry
--
-- At a sample edge, with d the motion since the last one:
--   brake'   := min(floor(PULSE * d / 2^DAMPING_FRAC), 2^(P+8) - 1)  in contact, with
--               d > 0, when the last sample was not in contact or a pulse goes on; else 0
--   torque'  := clamp(wanted + brake', -(2^P - 1), 2^P - 1)
--   goes on  := brake' > 0 and wanted + brake' > 2^P - 1
-- with the torque of spring and drag, in contact only,
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
--          PULSE                            torque that takes out one count per
--                                           sample, with DAMPING_FRAC fraction bits
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
--          memory      (1,TORQUE_WIDTH+8,0) the pulse
-- latency  1 edge, sample edges only; a new period takes effect at the next
--          sample edge
-- reset    everything 0, outside the wall; the first edge after it is a sample edge
-- overflow products, pulse and torque clamp
-- source   Salcudean and Vlaar 1997: PULSE is the mass over the sample period. Their
--          pulse has one sample; this one goes on where the bridge could not show it
-- differs from the hardware: all products take one edge, so no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity braking_pulse is
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
    PULSE           : natural  := 1025
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
    memory      : out std_logic_vector(TORQUE_WIDTH + 8 downto 0)
  );
end entity;

architecture rtl of braking_pulse is

  constant TOP         : natural  := 2**TORQUE_WIDTH - 1;
  constant BRAKE_WIDTH : positive := TORQUE_WIDTH + 9;
  -- Room for every product and every pulse.
  constant WIDE        : positive := maximum(WIDTH + 32, BRAKE_WIDTH + DAMPING_FRAC + 2);

  subtype brake_word is signed(BRAKE_WIDTH - 1 downto 0);

  constant MOST : signed(WIDE - 1 downto 0)
    := shift_left(to_signed(1, WIDE), BRAKE_WIDTH - 1) - 1;

  -- The pulse of a motion; none when it goes back or no pulse is due. A slice, not
  -- shift_right: GHDL 2.0 writes that into a Verilog netlist without the sign.
  function pulse_of(moved : signed; due : std_logic) return brake_word is
    variable product : signed(WIDE - 1 downto 0);
    variable floored : signed(WIDE - 1 downto 0);
  begin
    product := resize(to_signed(PULSE, 32) * moved, WIDE);
    floored := resize(product(WIDE - 1 downto DAMPING_FRAC), WIDE);
    if due = '0' or moved(moved'high) = '1' then
      floored := (others => '0');
    elsif floored > MOST then
      floored := MOST;
    end if;
    return floored(BRAKE_WIDTH - 1 downto 0);
  end function;

  signal previous : std_logic_vector(WIDTH - 1 downto 0);
  signal touched  : std_logic;
  signal braking  : std_logic;
  signal d        : std_logic_vector(WIDTH - 1 downto 0);
  signal spring   : std_logic_vector(TORQUE_WIDTH - 1 downto 0);
  signal drag     : std_logic_vector(TORQUE_WIDTH downto 0);
  signal sum      : std_logic_vector(TORQUE_WIDTH + 1 downto 0);
  signal wanted   : std_logic_vector(TORQUE_WIDTH downto 0);
  signal brake    : brake_word;
  signal total    : signed(BRAKE_WIDTH downto 0);
  signal limited  : std_logic_vector(TORQUE_WIDTH downto 0);

begin

  brake <= pulse_of(signed(d), contact and (braking or not touched));
  total <= resize(brake, BRAKE_WIDTH + 1) + signed(wanted);

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
      IN_WIDTH  => BRAKE_WIDTH + 1,
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
        previous <= position;
        touched  <= contact;
        braking  <= '0';
        if brake > 0 and total > TOP then
          braking <= '1';
        end if;
        memory    <= std_logic_vector(brake);
        torque    <= std_logic_vector(resize(signed(limited), TORQUE_WIDTH + 2));
        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        countdown := countdown - 1;
      end if;

      if rst = '1' then
        countdown := 0;
        previous  <= (others => '0');
        touched   <= '0';
        braking   <= '0';
        memory    <= (others => '0');
        torque    <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
