-- levant_differentiator : velocity by a sliding mode (super-twisting)
--
-- At a sample edge:
--   e := (z - position * 2^V) mod 2^(WIDTH+V), read as two's complement
--   r := floor(sqrt(|e| * 2^V))
-- WIDTH/2 + V + 2 edges later, rounded up, with W the velocity and s the sign of e:
--   z := (z + W - s * floor(ROOT_GAIN * r / 2^8)) mod 2^(WIDTH+V)
--   W := clamp(W - s * SLEW, -2^(WIDTH+V-1), 2^(WIDTH+V-1) - 1)
-- with V = OUT_FRAC. z follows the position with a slope of which W is the part
-- without jumps: where the acceleration stays below SLEW / 1.1, W follows the
-- velocity in finite time and without the lag of a low pass.
--
-- generics WIDTH         bits of the position
--          PERIOD_WIDTH  bits of the period, 2 to 30
--          OUT_FRAC      fraction bits of the velocity, V
--          ROOT_GAIN     counts per sample for one count of error, with 8 fraction
--                        bits, less than 2^20
--          SLEW          velocity added in a sample, in LSB of the velocity, less
--                        than 2^20
-- in       position (0,WIDTH,0)
--          period   (0,PERIOD_WIDTH,0)   sample period in clocks, 0 acts as 1
-- out      velocity (1,WIDTH-1,OUT_FRAC) counts per sample
-- latency  from a sample edge to the velocity: half of the root's width and 2 edges.
--          Sample edges up to and including that one are passed over
-- reset    velocity 0, z 0; the first edge after it is a sample edge
-- overflow the error wraps with the counter; the velocity clamps
-- source   Levant 1998, with the gains 1.5 sqrt(L) and 1.1 L; as a velocity
--          estimator of haptic devices Chawda, Celik and O'Malley 2011
-- differs from the hardware: the papers step in floats. The emulator computes
--          the root at the sample edge and shows the velocity at the load: the
--          ports are exact at every edge, the registers of the root are not
--          modelled.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity levant_differentiator is
  generic (
    WIDTH        : positive := 12;
    PERIOD_WIDTH : positive range 2 to 30 := 24;
    OUT_FRAC     : natural  := 8;
    ROOT_GAIN    : natural  := 94;
    SLEW         : natural  := 17
  );
  port (
    clk      : in  std_logic;
    rst      : in  std_logic;
    position : in  std_logic_vector(WIDTH - 1 downto 0);
    period   : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    velocity : out std_logic_vector(WIDTH + OUT_FRAC - 1 downto 0)
  );
end entity;

architecture rtl of levant_differentiator is

  constant OUT_WIDTH  : positive := WIDTH + OUT_FRAC;
  -- Even, and at least that of |e| * 2^V.
  constant ROOT_WIDTH : positive := 2 * ((OUT_WIDTH + OUT_FRAC + 1) / 2);
  constant FRACTION   : unsigned(OUT_FRAC - 1 downto 0) := (others => '0');
  -- Sums of a velocity and a step of it.
  constant SUM_WIDTH  : positive := OUT_WIDTH + 22;
  constant MOST       : signed(SUM_WIDTH - 1 downto 0)
    := shift_left(to_signed(1, SUM_WIDTH), OUT_WIDTH - 1) - 1;

  subtype sum_word is signed(SUM_WIDTH - 1 downto 0);

  signal start     : std_logic;
  signal radicand  : std_logic_vector(ROOT_WIDTH - 1 downto 0);
  signal root      : std_logic_vector(ROOT_WIDTH / 2 - 1 downto 0);
  signal rooting   : std_logic;
  signal ready     : std_logic;
  signal slope     : signed(OUT_WIDTH - 1 downto 0);
  signal corrected : unsigned(ROOT_WIDTH / 2 + 20 - 1 downto 0);

  -- The sum minus the step, plus it or itself: by the sign of the error.
  function corrected_by(
    sum      : sum_word;
    step     : sum_word;
    negative : std_logic;
    zero     : std_logic
  ) return sum_word is
  begin
    if zero = '1' then
      return sum;
    elsif negative = '1' then
      return sum + step;
    end if;
    return sum - step;
  end function;

  -- Its size. Not abs: GHDL 2.0 writes that into a Verilog netlist as in VHDL.
  function size_of(value : signed(OUT_WIDTH - 1 downto 0)) return unsigned is
  begin
    if value(value'high) = '1' then
      return unsigned(-value);
    end if;
    return unsigned(value);
  end function;

  -- The nearest velocity.
  function clamped(value : sum_word) return signed is
  begin
    if value > MOST then
      return MOST(OUT_WIDTH - 1 downto 0);
    elsif value < -MOST - 1 then
      return not MOST(OUT_WIDTH - 1 downto 0);
    end if;
    return value(OUT_WIDTH - 1 downto 0);
  end function;

begin

  velocity  <= std_logic_vector(slope);
  corrected <= to_unsigned(ROOT_GAIN, 20) * unsigned(root);

  root_of_error : entity work.square_root
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
    variable estimate  : unsigned(OUT_WIDTH - 1 downto 0);
    variable negative  : std_logic;
    variable zero      : std_logic;
    variable e         : signed(OUT_WIDTH - 1 downto 0);
    variable sum       : sum_word;
  begin
    if rising_edge(clk) then
      start <= '0';

      if countdown = 0 then
        if (start or rooting or ready) = '0' then
          e        := signed(estimate - (unsigned(position) & FRACTION));
          negative := e(e'high);
          zero     := '0';
          if e = 0 then
            zero := '1';
          end if;
          radicand <= std_logic_vector(shift_left(resize(size_of(e), ROOT_WIDTH), OUT_FRAC));
          start    <= '1';
        end if;
        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        countdown := countdown - 1;
      end if;

      if ready = '1' then
        sum      := resize(signed('0' & shift_right(corrected, 8)), SUM_WIDTH);
        sum      := corrected_by(resize(slope, SUM_WIDTH), sum, negative, zero);
        estimate := estimate + unsigned(sum(OUT_WIDTH - 1 downto 0));
        sum      := corrected_by(resize(slope, SUM_WIDTH), to_signed(SLEW, SUM_WIDTH), negative, zero);
        slope    <= clamped(sum);
      end if;

      if rst = '1' then
        countdown := 0;
        estimate  := (others => '0');
        slope     <= (others => '0');
        negative  := '0';
        zero      := '0';
        start     <= '0';
        radicand  <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
