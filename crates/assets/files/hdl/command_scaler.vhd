-- command_scaler : joint torque to the word of the D/A converter
--
--   command = saturate(round(torque * GAIN))   when all three joints are valid
--             0                                otherwise
--
-- A joint outside its table has no known angle; then every motor is off.
--
-- generics TORQUE_INT, TORQUE_FRAC  format of the torque
--          GAIN, GAIN_FRAC          GAIN / 2^GAIN_FRAC converter counts per N.m
--          COMMAND_WIDTH            bits of the command
-- in       torque  (1,TORQUE_INT,TORQUE_FRAC) [N.m]
--          valid1, valid2, valid3 (0,1,0)
-- out      command (1,COMMAND_WIDTH-1,0) converter counts
-- latency  0, combinational
-- reset    none
-- overflow saturates; rounds to nearest, ties up
-- source   Sevcik et al. 2009, the motor commands of the FPGA
-- differs from the hardware: no propagation delay, so no limit on the clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity command_scaler is
  generic (
    TORQUE_INT    : natural  := 3;
    TORQUE_FRAC   : natural  := 20;
    GAIN          : natural  := 220289;
    GAIN_FRAC     : natural  := 3;
    COMMAND_WIDTH : positive := 16
  );
  port (
    torque  : in  std_logic_vector(TORQUE_INT + TORQUE_FRAC downto 0);
    valid1  : in  std_logic;
    valid2  : in  std_logic;
    valid3  : in  std_logic;
    command : out std_logic_vector(COMMAND_WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of command_scaler is

  constant DROP       : natural  := TORQUE_FRAC + GAIN_FRAC;
  constant FULL_WIDTH : positive := TORQUE_INT + TORQUE_FRAC + 33 + GAIN_FRAC;

  constant HIGHEST : signed(COMMAND_WIDTH - 1 downto 0)
    := '0' & (COMMAND_WIDTH - 2 downto 0 => '1');

  -- Drops DROP bits, rounding to nearest, ties up.
  function rounded(value : signed) return signed is
    constant WIDE : signed(FULL_WIDTH - 1 downto 0) := resize(value, FULL_WIDTH);
  begin
    if DROP = 0 then
      return WIDE;
    end if;
    return shift_right(WIDE + shift_left(to_signed(1, FULL_WIDTH), DROP - 1), DROP);
  end function;

  -- A value fits when it survives the way to COMMAND_WIDTH bits and back.
  -- Compared as plain vectors, so that an unknown value stays unknown.
  function saturate(value : signed) return signed is
    constant WORD : signed(COMMAND_WIDTH - 1 downto 0) := resize(value, COMMAND_WIDTH);
    constant BACK : signed(value'length - 1 downto 0) := resize(WORD, value'length);
  begin
    if std_logic_vector(BACK) = std_logic_vector(value) then
      return WORD;
    elsif value(value'high) = '1' then
      return not HIGHEST;
    end if;
    return HIGHEST;
  end function;

begin

  command <= std_logic_vector(saturate(rounded(signed(torque) * to_signed(GAIN, 32))))
             and (valid1 and valid2 and valid3);

end architecture;
