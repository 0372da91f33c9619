-- space_vector : a voltage of the stator as the duties of three legs
--
-- The phases, with R the root of 3 to the nearest of F = DUTY_WIDTH + 2 fraction bits:
--   u_a = alpha
--   u_b = (-alpha + R*beta) / 2
--   u_c = (-alpha - R*beta) / 2
-- Their greatest and least are moved equally far from the middle:
--   common = (max(u_a, u_b, u_c) + min(u_a, u_b, u_c)) / 2
--   common = 0   when SINUSOIDAL
-- Each duty is clamped to 0 and STEPS:
--   duty = floor(STEPS * (1/2 + (u - common) / 2^(WIDTH-1)) + 1/2)
--
-- Without a clamp a duty is off by less than 5/8 of a step: 1/2 of rounding, less than
-- 1/8 of R. Beyond an amplitude of 1/sqrt(3) of the supply, of 1/2 when SINUSOIDAL,
-- duties clamp each for itself, and the voltage has another direction.
--
-- generics WIDTH       bits of the voltages, 2 to 22
--          DUTY_WIDTH  bits of the duties, 2 to 16
--          STEPS       the greatest duty
--          SINUSOIDAL  the phases are sines
-- in       alpha, beta (1,WIDTH-1,0)   2^(WIDTH-1) is the supply's voltage
-- out      duty_a, duty_b, duty_c (0,DUTY_WIDTH,0)   steps
-- latency  0, combinational
-- reset    none
-- overflow the duties clamp; rounding is to nearest, ties up
-- source   van der Broeck, Skudelny and Stanke 1988
-- differs from the hardware: no propagation delay, so no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity space_vector is
  generic (
    WIDTH      : positive := 16;
    DUTY_WIDTH : positive := 11;
    STEPS      : positive := 1250;
    SINUSOIDAL : boolean  := false
  );
  port (
    alpha  : in  std_logic_vector(WIDTH - 1 downto 0);
    beta   : in  std_logic_vector(WIDTH - 1 downto 0);
    duty_a : out std_logic_vector(DUTY_WIDTH - 1 downto 0);
    duty_b : out std_logic_vector(DUTY_WIDTH - 1 downto 0);
    duty_c : out std_logic_vector(DUTY_WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of space_vector is

  constant F           : positive := DUTY_WIDTH + 2;
  constant DROP        : positive := F + WIDTH + 1;
  -- The phases in units of 2^-(F+1), and twice a phase less the common part.
  constant PHASE_WIDTH : positive := WIDTH + F + 3;
  constant MOVED_WIDTH : positive := PHASE_WIDTH + 2;
  -- At most 62: GHDL 2.0 writes constants of 64 bits into a netlist without their
  -- upper half.
  constant TOTAL_WIDTH : positive := MOVED_WIDTH + DUTY_WIDTH + 1;

  subtype phase_word is signed(PHASE_WIDTH - 1 downto 0);
  subtype moved_word is signed(MOVED_WIDTH - 1 downto 0);
  subtype total_word is signed(TOTAL_WIDTH - 1 downto 0);
  subtype whole_word is signed(TOTAL_WIDTH - DROP - 1 downto 0);

  constant R    : signed(F + 1 downto 0) := to_signed(integer(1.73205080756887729353 * 2.0**F), F + 2);
  -- One half, and STEPS halves.
  constant HALF   : total_word := shift_left(to_signed(1, TOTAL_WIDTH), DROP - 1);
  constant MIDDLE : total_word := shift_left(to_signed(STEPS, TOTAL_WIDTH), DROP - 1);
  constant MOST   : whole_word := to_signed(STEPS, TOTAL_WIDTH - DROP);

  function greater(a, b : phase_word) return phase_word is
  begin
    if b > a then
      return b;
    end if;
    return a;
  end function;

  function lesser(a, b : phase_word) return phase_word is
  begin
    if a > b then
      return b;
    end if;
    return a;
  end function;

  function clamped(total : total_word) return std_logic_vector is
    constant UP    : total_word := total + HALF;
    constant WHOLE : whole_word := UP(TOTAL_WIDTH - 1 downto DROP);
  begin
    if WHOLE(WHOLE'high) = '1' then
      return std_logic_vector(to_unsigned(0, DUTY_WIDTH));
    elsif WHOLE > MOST then
      return std_logic_vector(MOST(DUTY_WIDTH - 1 downto 0));
    end if;
    return std_logic_vector(WHOLE(DUTY_WIDTH - 1 downto 0));
  end function;

  signal across  : phase_word;
  signal along   : phase_word;
  signal phase_a : phase_word;
  signal phase_b : phase_word;
  signal phase_c : phase_word;
  signal most_u  : phase_word;
  signal least_u : phase_word;
  signal common  : moved_word;
  signal total_a : total_word;
  signal total_b : total_word;
  signal total_c : total_word;

  function total(phase : phase_word; less : moved_word) return total_word is
    constant MOVED : moved_word := shift_left(resize(phase, MOVED_WIDTH), 1) - less;
  begin
    return MOVED * to_signed(STEPS, DUTY_WIDTH + 1) + MIDDLE;
  end function;

begin

  across  <= resize(signed(beta) * R, PHASE_WIDTH);
  along   <= shift_left(resize(signed(alpha), PHASE_WIDTH), F);
  phase_a <= shift_left(resize(signed(alpha), PHASE_WIDTH), F + 1);
  phase_b <= across - along;
  phase_c <= -across - along;

  most_u  <= greater(greater(phase_a, phase_b), phase_c);
  least_u <= lesser(lesser(phase_a, phase_b), phase_c);

  centred : if not SINUSOIDAL generate
    common <= resize(most_u, MOVED_WIDTH) + resize(least_u, MOVED_WIDTH);
  end generate;

  plain : if SINUSOIDAL generate
    common <= (others => '0');
  end generate;

  total_a <= total(phase_a, common);
  total_b <= total(phase_b, common);
  total_c <= total(phase_c, common);

  duty_a <= clamped(total_a);
  duty_b <= clamped(total_b);
  duty_c <= clamped(total_c);

end architecture;
