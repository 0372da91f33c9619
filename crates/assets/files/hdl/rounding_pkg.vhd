-- rounding_pkg : the eight ways to drop the lower bits of a word
--
--   rounded(value, drop, rounding) = value / 2^drop, as a whole number:
--
--   0 TRUNCATE        down, towards -infinity: a shift, without logic
--   1 TOWARD_ZERO     towards zero
--   2 NEAREST_UP      to the nearest; ties up, towards +infinity
--   3 NEAREST_DOWN    to the nearest; ties down, towards -infinity
--   4 NEAREST_AWAY    to the nearest; ties away from zero
--   5 NEAREST_INWARD  to the nearest; ties towards zero
--   6 NEAREST_EVEN    to the nearest; ties to the even neighbour
--   7 NEAREST_ODD     to the nearest; ties to the odd neighbour
--
-- Each of them is one adder: what is added, below one unit of the result, depends
-- on the mode, on the sign and on the lowest bit that is kept. The modes are numbers,
-- so that a tool can set them as generics of a top entity.
--
-- value    needs room: the sum of it and of one unit of the result, 2^drop, has
--          to fit its bits
-- returns  a word of as many bits
-- unknown  bits stay unknown

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

package rounding_pkg is

  subtype rounding_mode is natural range 0 to 7;

  constant TRUNCATE       : rounding_mode := 0;
  constant TOWARD_ZERO    : rounding_mode := 1;
  constant NEAREST_UP     : rounding_mode := 2;
  constant NEAREST_DOWN   : rounding_mode := 3;
  constant NEAREST_AWAY   : rounding_mode := 4;
  constant NEAREST_INWARD : rounding_mode := 5;
  constant NEAREST_EVEN   : rounding_mode := 6;
  constant NEAREST_ODD    : rounding_mode := 7;

  function rounded(value : signed; drop : natural; rounding : rounding_mode) return signed;

end package;

package body rounding_pkg is

  -- Whether a tie goes up, in the modes in which that depends on the value.
  function goes_up(sign, lowest : std_logic; rounding : rounding_mode) return std_logic is
  begin
    case rounding is
      when NEAREST_AWAY   => return not sign;
      when NEAREST_INWARD => return sign;
      when NEAREST_EVEN   => return lowest;
      when NEAREST_ODD    => return not lowest;
      when others         => return '0';
    end case;
  end function;

  function rounded(value : signed; drop : natural; rounding : rounding_mode) return signed is
    constant WIDTH : positive := value'length;
    constant WHOLE : signed(WIDTH - 1 downto 0) := value;
    variable added : signed(WIDTH - 1 downto 0) := (others => '0');
  begin
    if drop = 0 or rounding = TRUNCATE then
      return shift_right(WHOLE, drop);
    elsif drop >= WIDTH then
      -- Below one half, whatever the sign.
      return WHOLE and added;
    elsif rounding = NEAREST_UP then
      return shift_right(WHOLE + shift_left(to_signed(1, WIDTH), drop - 1), drop);
    elsif rounding = TOWARD_ZERO then
      added(drop - 1 downto 0) := (others => WHOLE(WIDTH - 1));
    else
      -- One half less the lowest bit, and that bit again when a tie goes up: so
      -- one half is a bit, or the bits below it.
      added(drop - 1) := goes_up(WHOLE(WIDTH - 1), WHOLE(drop), rounding);
      if drop > 1 then
        added(drop - 2 downto 0) := (others => not added(drop - 1));
      end if;
    end if;
    return shift_right(WHOLE + added, drop);
  end function;

end package body;
