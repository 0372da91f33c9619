-- phantom_torque : force on the tip to joint torques, the Jacobian transposed
--
--   radial  = narrow(sine1*force_x + cosine1*force_z)
--   upper   = narrow(cosine2*force_y - sine2*radial)
--   fore    = narrow(sine3*force_y + cosine3*radial)
--   torque1 = narrow((z + L1)*force_x - x*force_z)
--   torque2 = narrow(L1*upper)
--   torque3 = narrow(L2*fore)
--
-- radial is the force along the arm's reach; upper and fore are those across the
-- two links. The three have one integer bit more than a force:
-- (1,FORCE_INT+1,FORCE_FRAC). Each sum is exact and narrowed once.
--
-- generics TRIG_INT, TRIG_FRAC          format of the sines and cosines
--          LENGTH_FRAC                  fraction bits of the lengths, at most 30
--          LENGTH_1, LENGTH_2           L1, L2 in units of 2^-LENGTH_FRAC m
--          POSITION_INT, POSITION_FRAC  format of the position
--          FORCE_INT, FORCE_FRAC        format of the forces
--          TORQUE_INT, TORQUE_FRAC      format of the torques
-- in       sine1, cosine1, sine2, cosine2, sine3, cosine3 (1,TRIG_INT,TRIG_FRAC)
--          x, z (1,POSITION_INT,POSITION_FRAC) [m]
--          force_x, force_y, force_z (1,FORCE_INT,FORCE_FRAC) [N]
-- out      torque1, torque2, torque3 (1,TORQUE_INT,TORQUE_FRAC) [N.m]
-- latency  0, combinational
-- reset    none
-- overflow wraps; narrowing rounds to nearest, ties up
-- source   Sevcik et al. 2009; kinematics after Cavusoglu et al. 2002
-- differs from the hardware: no propagation delay, so no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity phantom_torque is
  generic (
    TRIG_INT      : natural  := 9;
    TRIG_FRAC     : natural  := 22;
    LENGTH_FRAC   : natural  := 24;
    LENGTH_1      : positive := 2348810;
    LENGTH_2      : positive := 2348810;
    POSITION_INT  : natural  := 0;
    POSITION_FRAC : natural  := 24;
    FORCE_INT     : natural  := 4;
    FORCE_FRAC    : natural  := 16;
    TORQUE_INT    : natural  := 3;
    TORQUE_FRAC   : natural  := 20
  );
  port (
    sine1   : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    cosine1 : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    sine2   : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    cosine2 : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    sine3   : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    cosine3 : in  std_logic_vector(TRIG_INT + TRIG_FRAC downto 0);
    x       : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    z       : in  std_logic_vector(POSITION_INT + POSITION_FRAC downto 0);
    force_x : in  std_logic_vector(FORCE_INT + FORCE_FRAC downto 0);
    force_y : in  std_logic_vector(FORCE_INT + FORCE_FRAC downto 0);
    force_z : in  std_logic_vector(FORCE_INT + FORCE_FRAC downto 0);
    torque1 : out std_logic_vector(TORQUE_INT + TORQUE_FRAC downto 0);
    torque2 : out std_logic_vector(TORQUE_INT + TORQUE_FRAC downto 0);
    torque3 : out std_logic_vector(TORQUE_INT + TORQUE_FRAC downto 0)
  );
end entity;

architecture rtl of phantom_torque is

  constant TRIG_WIDTH     : positive := TRIG_INT + TRIG_FRAC + 1;
  constant POSITION_WIDTH : positive := POSITION_INT + POSITION_FRAC + 1;
  constant FORCE_WIDTH    : positive := FORCE_INT + FORCE_FRAC + 1;
  constant BEAM_WIDTH     : positive := FORCE_WIDTH + 1;
  constant TORQUE_WIDTH   : positive := TORQUE_INT + TORQUE_FRAC + 1;

  -- The lever arms of joint 1, aligned to the finer of position and length.
  constant ARM_FRAC  : natural  := maximum(POSITION_FRAC, LENGTH_FRAC);
  constant ARM_WIDTH : positive := 33 + POSITION_WIDTH + LENGTH_FRAC;

  constant BEAM_SUM_WIDTH : positive := TRIG_WIDTH + BEAM_WIDTH + 1;
  constant ARM_SUM_WIDTH  : positive := ARM_WIDTH + FORCE_WIDTH + 1;

  constant L1 : signed(31 downto 0) := to_signed(LENGTH_1, 32);
  constant L2 : signed(31 downto 0) := to_signed(LENGTH_2, 32);

  -- Drops `drop` bits (appends, when negative), rounding to nearest, ties up,
  -- and keeps the lower `width` bits.
  function narrow(value : signed; drop : integer; width : positive) return signed is
    variable word : signed(value'length + abs drop + width downto 0);
  begin
    word := resize(value, word'length);
    if drop > 0 then
      word := shift_right(word + shift_left(to_signed(1, word'length), drop - 1), drop);
    else
      word := shift_left(word, -drop);
    end if;
    return word(width - 1 downto 0);
  end function;

  signal radial : signed(BEAM_WIDTH - 1 downto 0);
  signal upper  : signed(BEAM_WIDTH - 1 downto 0);
  signal fore   : signed(BEAM_WIDTH - 1 downto 0);
  signal arm_x  : signed(ARM_WIDTH - 1 downto 0);
  signal arm_z  : signed(ARM_WIDTH - 1 downto 0);

begin

  radial <= narrow(resize(signed(sine1) * signed(force_x), BEAM_SUM_WIDTH)
                   + signed(cosine1) * signed(force_z), TRIG_FRAC, BEAM_WIDTH);
  upper  <= narrow(resize(signed(cosine2) * signed(force_y), BEAM_SUM_WIDTH)
                   - signed(sine2) * radial, TRIG_FRAC, BEAM_WIDTH);
  fore   <= narrow(resize(signed(sine3) * signed(force_y), BEAM_SUM_WIDTH)
                   + signed(cosine3) * radial, TRIG_FRAC, BEAM_WIDTH);

  arm_x <= shift_left(resize(signed(x), ARM_WIDTH), ARM_FRAC - POSITION_FRAC);
  arm_z <= shift_left(resize(signed(z), ARM_WIDTH), ARM_FRAC - POSITION_FRAC)
           + shift_left(resize(L1, ARM_WIDTH), ARM_FRAC - LENGTH_FRAC);

  torque1 <= std_logic_vector(narrow(resize(arm_z * signed(force_x), ARM_SUM_WIDTH)
                                     - arm_x * signed(force_z),
                                     ARM_FRAC + FORCE_FRAC - TORQUE_FRAC, TORQUE_WIDTH));
  torque2 <= std_logic_vector(narrow(L1 * upper, LENGTH_FRAC + FORCE_FRAC - TORQUE_FRAC,
                                     TORQUE_WIDTH));
  torque3 <= std_logic_vector(narrow(L2 * fore, LENGTH_FRAC + FORCE_FRAC - TORQUE_FRAC,
                                     TORQUE_WIDTH));

end architecture;
