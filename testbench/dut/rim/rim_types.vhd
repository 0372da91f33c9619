-- rim_types: what the files of the rim stop have in common.  Compile first.
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

package rim_types is

  -- Gains are given in 1/16, speeds in 1/256 count a sample.
  constant GAIN_FRACTION  : natural := 4;
  constant SPEED_FRACTION : natural := 8;

  -- What the encoder lines did between two clocks.
  type step_kind is (STAY, FORTH, BACK, SLIP);

  -- The two gates of one leg of the bridge.
  type gate_pair is record
    high : std_logic;
    low  : std_logic;
  end record;

  constant GATES_OFF  : gate_pair := (high => '0', low => '0');
  constant GATES_HIGH : gate_pair := (high => '1', low => '0');
  constant GATES_LOW  : gate_pair := (high => '0', low => '1');

  -- Lines are given as "AB".
  function step_of (was, now : std_logic_vector(1 downto 0)) return step_kind;

  -- Resize that stops at the ends of the range instead of wrapping.
  function clip (x : signed; bits : positive) return signed;

end package rim_types;

package body rim_types is

  function step_of (was, now : std_logic_vector(1 downto 0)) return step_kind is
    variable lines : std_logic_vector(3 downto 0);
  begin
    lines := was & now;
    case lines is
      when "0001" | "0111" | "1110" | "1000" => return FORTH;
      when "0010" | "1011" | "1101" | "0100" => return BACK;
      when "0011" | "1100" | "0110" | "1001" => return SLIP;
      when others                            => return STAY;
    end case;
  end function step_of;

  function clip (x : signed; bits : positive) return signed is
    constant TOP : natural := x'length - 1;
    variable v   : signed(TOP downto 0);
    variable r   : signed(bits - 1 downto 0);
  begin
    v := x;
    r := resize(v, bits);
    -- When the value survives the way there and back, it fits.
    if resize(r, x'length) /= v and bits < x'length then
      r           := (others => not v(TOP));
      r(bits - 1) := v(TOP);
    end if;
    return r;
  end function clip;

end package body rim_types;
