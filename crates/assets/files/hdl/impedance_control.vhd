-- impedance_control : radial impedance with force feedback, as a drive of the crank
--
--   desired := clamp(round(stiffness * (rest - radius)), 0, FORCE_LIMIT)
--   push    := desired + feedback * (desired - finger_force)
--   drive   := saturate(round(slope * push * GAIN / 2^GAIN_FRAC))
--
-- Pressed inwards, the segment has a radius less than rest, and desired pushes
-- outwards; it never pulls. finger_force is that of the finger on the segment,
-- positive inwards. slope is dr/dpsi, never positive between the crank's dead
-- centres: there, a positive push makes a negative drive, and this turns the
-- crank towards psi = 0, outwards. The products are taken of words as integers: push
-- and the product with slope are exact, in LSBs of the force and of the lengths.
--
-- generics LENGTH_WIDTH, LENGTH_FRAC  bits of lengths and of the slope, their
--                                     fraction
--          FORCE_WIDTH                bits of the force
--          FORCE_LIMIT                the greatest force of the spring, a word of
--                                     the force
--          S_WIDTH, S_FRAC            bits of the stiffness, its fraction
--          K_WIDTH, K_FRAC            bits of the feedback, its fraction
--          GAIN, GAIN_FRAC            GAIN / 2^GAIN_FRAC drive counts per LSB of
--                                     the force times LSB of the slope
--          DRIVE_WIDTH                bits of the drive
-- in       rest         (1,LENGTH_WIDTH-LENGTH_FRAC-1,LENGTH_FRAC) [m]
--          radius       (1,LENGTH_WIDTH-LENGTH_FRAC-1,LENGTH_FRAC) [m]
--          slope        (1,LENGTH_WIDTH-LENGTH_FRAC-1,LENGTH_FRAC) [m/rad]
--          finger_force (0,FORCE_WIDTH,0)
--          stiffness    (0,S_WIDTH-S_FRAC,S_FRAC) force LSBs per length LSB
--          feedback     (0,K_WIDTH-K_FRAC,K_FRAC)
-- out      drive        (1,DRIVE_WIDTH-1,0)
-- latency  0, combinational
-- reset    none
-- overflow the drive saturates; both roundings are to nearest, ties up
-- source   Pediredla et al., the impedance control of the radial joint:
--          tau = J^T (F_d + K_f (F_d - F))
-- differs from the hardware: the paper's controller runs in software and sets no
--          limit to the desired force. No propagation delay, so no limit on the
--          clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity impedance_control is
  generic (
    LENGTH_WIDTH : positive := 20;
    LENGTH_FRAC  : natural  := 22;
    FORCE_WIDTH  : positive := 12;
    FORCE_LIMIT  : natural  := 3277;
    S_WIDTH      : positive := 16;
    S_FRAC       : natural  := 16;
    K_WIDTH      : positive := 8;
    K_FRAC       : natural  := 4;
    GAIN         : positive := 21695;
    GAIN_FRAC    : natural  := 32;
    DRIVE_WIDTH  : positive := 11
  );
  port (
    rest         : in  std_logic_vector(LENGTH_WIDTH - 1 downto 0);
    radius       : in  std_logic_vector(LENGTH_WIDTH - 1 downto 0);
    slope        : in  std_logic_vector(LENGTH_WIDTH - 1 downto 0);
    finger_force : in  std_logic_vector(FORCE_WIDTH - 1 downto 0);
    stiffness    : in  std_logic_vector(S_WIDTH - 1 downto 0);
    feedback     : in  std_logic_vector(K_WIDTH - 1 downto 0);
    drive        : out std_logic_vector(DRIVE_WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of impedance_control is

  -- Room for the product, half an LSB, and the limit.
  constant SPRING_WIDTH : positive := S_WIDTH + LENGTH_WIDTH + FORCE_WIDTH + 4;
  constant PUSH_WIDTH   : positive := FORCE_WIDTH + K_WIDTH + 3;
  constant TORQUE_WIDTH : positive := LENGTH_WIDTH + PUSH_WIDTH;
  constant DROP         : natural  := K_FRAC + GAIN_FRAC;
  constant TOTAL_WIDTH  : positive := TORQUE_WIDTH + 33 + DROP + DRIVE_WIDTH;

  subtype spring_word is signed(SPRING_WIDTH - 1 downto 0);
  subtype force_word  is signed(FORCE_WIDTH downto 0);
  subtype push_word   is signed(PUSH_WIDTH - 1 downto 0);

  constant HIGHEST : signed(DRIVE_WIDTH - 1 downto 0) := '0' & (DRIVE_WIDTH - 2 downto 0 => '1');

  -- Drops bits, rounding to nearest, ties up. Of no bits there is no half.
  function rounded(value : signed; bits : natural) return signed is
    constant ONE : signed(value'length - 1 downto 0) := to_signed(1, value'length);
    variable sum : signed(value'length - 1 downto 0);
  begin
    sum := value;
    if bits > 0 then
      sum := sum + shift_left(ONE, bits - 1);
    end if;
    return sum(sum'high downto bits);
  end function;

  -- An unknown value is not beyond a limit, and passes unknown.
  function limited(value : signed) return force_word is
    constant LIMIT : signed(value'length - 1 downto 0) := to_signed(FORCE_LIMIT, value'length);
    constant ABOVE : signed(value'length - 1 downto 0) := LIMIT - value;
  begin
    if value(value'high) = '1' then
      return to_signed(0, FORCE_WIDTH + 1);
    elsif ABOVE(ABOVE'high) = '1' then
      return resize(LIMIT, FORCE_WIDTH + 1);
    end if;
    return resize(value, FORCE_WIDTH + 1);
  end function;

  -- A value fits when it survives the way to DRIVE_WIDTH bits and back. Compared
  -- as plain vectors, so that an unknown value stays unknown.
  function saturate(value : signed) return std_logic_vector is
    constant WORD : signed(DRIVE_WIDTH - 1 downto 0) := resize(value, DRIVE_WIDTH);
    constant BACK : signed(value'length - 1 downto 0) := resize(WORD, value'length);
  begin
    if std_logic_vector(BACK) = std_logic_vector(value) then
      return std_logic_vector(WORD);
    elsif value(value'high) = '1' then
      return std_logic_vector(not HIGHEST);
    end if;
    return std_logic_vector(HIGHEST);
  end function;

  signal stretch : signed(LENGTH_WIDTH downto 0);
  signal spring  : spring_word;
  signal desired : force_word;
  signal lack    : signed(FORCE_WIDTH + 1 downto 0);
  signal push    : push_word;
  signal torque  : signed(TORQUE_WIDTH - 1 downto 0);
  signal scaled  : signed(TORQUE_WIDTH + 31 downto 0);

begin

  stretch <= resize(signed(rest), LENGTH_WIDTH + 1) - signed(radius);
  spring  <= resize(signed('0' & stiffness) * stretch, SPRING_WIDTH);
  desired <= limited(rounded(spring, S_FRAC));
  lack    <= resize(desired, FORCE_WIDTH + 2) - signed('0' & finger_force);
  push    <= shift_left(resize(desired, PUSH_WIDTH), K_FRAC)
             + resize(signed('0' & feedback) * lack, PUSH_WIDTH);
  torque  <= signed(slope) * push;
  scaled  <= torque * to_signed(GAIN, 32);
  drive   <= saturate(rounded(resize(scaled, TOTAL_WIDTH), DROP));

end architecture;
