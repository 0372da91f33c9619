-- knob : a knob behind field-oriented control, with detents, and with the motor's cogging
-- taken out
--
--   target = ripple * sin(ORDER * angle) - torque of the detents and of their drag
--
-- The torques are those of torque_table; the current is controlled by foc_loop. The sine
-- comes an edge after its position and is rounded to 14 fraction bits.
--
-- generics DETENT                    the greatest current of a detent
--          ORDER                     waves of the cogging in a turn
--          COUNTS                    counts in a turn
--          PERIOD                    clocks from one torque to the next
-- in       a_pin, b_pin  (0,1,0)     encoder lines, asynchronous
--          i_a, i_b      (1,11,0)    codes of the phase currents
--          detents       (0,1,0)     '0': the knob turns freely
--          damping       (0,12,0)    current per count per PERIOD
--          ripple        (0,10,0)    current of the cogging
--          proportional, integral    of foc_loop
-- out      the gates and the start of the converters, of foc_loop
--
-- Currents are in eighths of a code.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity knob is
  generic (
    DETENT : natural  := 400;
    ORDER  : positive := 42;
    COUNTS : positive := 4096;
    PERIOD : positive := 25000
  );
  port (
    clk          : in  std_logic;
    rst          : in  std_logic;
    a_pin        : in  std_logic;
    b_pin        : in  std_logic;
    i_a          : in  std_logic_vector(11 downto 0);
    i_b          : in  std_logic_vector(11 downto 0);
    detents      : in  std_logic;
    damping      : in  std_logic_vector(11 downto 0);
    ripple       : in  std_logic_vector(9 downto 0);
    proportional : in  std_logic_vector(23 downto 0);
    integral     : in  std_logic_vector(23 downto 0);
    a_high       : out std_logic;
    a_low        : out std_logic;
    b_high       : out std_logic;
    b_low        : out std_logic;
    c_high       : out std_logic;
    c_low        : out std_logic;
    trigger      : out std_logic
  );
end entity;

architecture rtl of knob is

  signal a, b     : std_logic;
  signal step     : std_logic_vector(1 downto 0);
  signal error    : std_logic;
  signal position : std_logic_vector(15 downto 0);
  signal torque   : std_logic_vector(13 downto 0);
  signal texture  : std_logic_vector(12 downto 0);
  signal sine     : std_logic_vector(15 downto 0);
  signal cosine   : std_logic_vector(15 downto 0);
  signal valid    : std_logic;
  signal wave     : signed(26 downto 0);
  signal felt     : signed(15 downto 0);
  signal target   : signed(15 downto 0);

begin

  sync : entity work.synchronizer
    port map (clk => clk, rst => rst, a_pin => a_pin, b_pin => b_pin, a => a, b => b);

  decoder : entity work.quadrature_decoder
    port map (clk => clk, rst => rst, a => a, b => b, step => step, error => error);

  counter : entity work.position_counter
    generic map (WIDTH => 16)
    port map (clk => clk, rst => rst, step => step, position => position);

  -- 32 detents in 4096 counts; a sine in 16 straight lines each.
  law : entity work.torque_table
    generic map (
      WIDTH => 16, TORQUE_WIDTH => 12, TABLE_BITS => 4, SHIFT => 3,
      T0 => 0, T1 => 383 * DETENT / 1000, T2 => 707 * DETENT / 1000, T3 => 924 * DETENT / 1000,
      T4 => DETENT, T5 => 924 * DETENT / 1000, T6 => 707 * DETENT / 1000, T7 => 383 * DETENT / 1000,
      T8 => 0, T9 => -383 * DETENT / 1000, T10 => -707 * DETENT / 1000, T11 => -924 * DETENT / 1000,
      T12 => -DETENT, T13 => -924 * DETENT / 1000, T14 => -707 * DETENT / 1000, T15 => -383 * DETENT / 1000
    )
    port map (
      clk => clk, rst => rst, position => position, delta => (others => '0'), contact => '1',
      penetration => (others => '0'), stiffness => (others => '0'), damping => damping,
      period => std_logic_vector(to_unsigned(PERIOD, 24)), scale => (others => '0'),
      torque => torque, memory => texture
    );

  cogging : entity work.trig_cordic
    generic map (
      COUNT_WIDTH => 16, ITERATIONS => 17, GUARD => 4, PHASE_WIDTH => 36,
      STEP => integer(real(ORDER) * 2.0**36 / real(COUNTS)), TRIG_INT => 1, TRIG_FRAC => 14
    )
    port map (clk => clk, rst => rst, count => position, sine => sine, cosine => cosine, valid => valid);

  wave   <= signed('0' & ripple) * signed(sine);
  felt   <= resize(signed(torque), 16) when detents = '1' else (others => '0');
  target <= resize(shift_right(wave, 14), 16) - felt;

  current : entity work.foc_loop
    port map (
      clk => clk, rst => rst, a_pin => a_pin, b_pin => b_pin, offset => (others => '0'),
      i_a => i_a, i_b => i_b, target => std_logic_vector(target),
      proportional => proportional, integral => integral, enable => '1',
      a_high => a_high, a_low => a_low, b_high => b_high, b_low => b_low,
      c_high => c_high, c_low => c_low, trigger => trigger
    );

end architecture;
