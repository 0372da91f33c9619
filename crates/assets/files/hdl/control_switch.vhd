-- control_switch : position or impedance control of the crank
--
-- At an edge with sample:
--   mode        := finger_force > threshold_on           in position control
--                  not (finger_force < threshold_off)    in impedance control
--   equilibrium := rest                            not TAKE_RADIUS
--                  radius                          TAKE_RADIUS, unless mode was
--                                                  and stays 1: then it is kept
-- At the edge after each edge with sample, with law the drive of the mode as it
-- now is, position_drive or impedance_drive:
--   offset      := drive - law                     the mode is another than at the
--                                                  last such edge
--                  offset - offset / 2^DECAY       else, rounded towards zero
--                  0                               not BUMPLESS
--   drive       := saturate(law + offset)
--
-- So the drive stays as it is at a switch, and the offset then decays to 0. The
-- rounding makes it smaller by at least 1 at every sample. Equal thresholds are a
-- switch without hysteresis. The drive is read one edge after the equilibrium has
-- changed, because that is an input of the impedance's law.
--
-- generics DRIVE_WIDTH                bits of the drives
--          FORCE_WIDTH                bits of force and thresholds
--          LENGTH_WIDTH, LENGTH_FRAC  bits of lengths, their fraction
--          TAKE_RADIUS                the equilibrium is the radius at the switch to
--                                     impedance control
--          BUMPLESS                   the drive stays at a switch
--          DECAY                      the offset loses 2^-DECAY of itself at every
--                                     sample, 0 to 15
-- in       position_drive  (1,DRIVE_WIDTH-1,0)
--          impedance_drive (1,DRIVE_WIDTH-1,0)
--          finger_force    (0,FORCE_WIDTH,0)
--          threshold_on    (0,FORCE_WIDTH,0)
--          threshold_off   (0,FORCE_WIDTH,0)
--          radius          (1,LENGTH_WIDTH-LENGTH_FRAC-1,LENGTH_FRAC) [m], ignored
--                                                         unless TAKE_RADIUS
--          rest            (1,LENGTH_WIDTH-LENGTH_FRAC-1,LENGTH_FRAC) [m], ignored
--                                                         with TAKE_RADIUS
--          sample          (0,1,0)                        the edge samples
-- out      drive           (1,DRIVE_WIDTH-1,0)
--          mode            (0,1,0)                        1 = impedance control
--          equilibrium     (1,LENGTH_WIDTH-LENGTH_FRAC-1,LENGTH_FRAC) [m]
-- latency  from an edge with sample 1 edge to mode and equilibrium, 2 to the drive
-- reset    all 0: position control, whose drive was the last
-- overflow the drive saturates
-- source   Pediredla et al.: position control while the finger moves along the
--          surface, impedance control when it probes radially; no threshold is
--          given
-- differs from the hardware: hysteresis, offset and latched radius are additions
--          to the paper's design. The sum takes one edge, so no limit on the
--          clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity control_switch is
  generic (
    DRIVE_WIDTH  : positive := 11;
    FORCE_WIDTH  : positive := 12;
    LENGTH_WIDTH : positive := 20;
    LENGTH_FRAC  : natural  := 22;
    TAKE_RADIUS  : boolean  := true;
    BUMPLESS     : boolean  := true;
    DECAY        : natural range 0 to 15 := 4
  );
  port (
    clk             : in  std_logic;
    rst             : in  std_logic;
    position_drive  : in  std_logic_vector(DRIVE_WIDTH - 1 downto 0);
    impedance_drive : in  std_logic_vector(DRIVE_WIDTH - 1 downto 0);
    finger_force    : in  std_logic_vector(FORCE_WIDTH - 1 downto 0);
    threshold_on    : in  std_logic_vector(FORCE_WIDTH - 1 downto 0);
    threshold_off   : in  std_logic_vector(FORCE_WIDTH - 1 downto 0);
    radius          : in  std_logic_vector(LENGTH_WIDTH - 1 downto 0);
    rest            : in  std_logic_vector(LENGTH_WIDTH - 1 downto 0);
    sample          : in  std_logic;
    drive           : out std_logic_vector(DRIVE_WIDTH - 1 downto 0);
    mode            : out std_logic;
    equilibrium     : out std_logic_vector(LENGTH_WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of control_switch is

  constant OFFSET_WIDTH : positive := DRIVE_WIDTH + 1;

  subtype offset_word is signed(OFFSET_WIDTH - 1 downto 0);
  subtype share_word  is signed(OFFSET_WIDTH + DECAY - 1 downto 0);

  -- a > b, as the sign of b - a, so that an unknown word gives an unknown answer.
  function exceeds(a, b : std_logic_vector) return std_logic is
    constant DIFFERENCE : unsigned(FORCE_WIDTH downto 0)
      := resize(unsigned(b), FORCE_WIDTH + 1) - unsigned(a);
  begin
    return DIFFERENCE(FORCE_WIDTH);
  end function;

  -- Gated instead of chosen, so that an unknown value stays unknown.
  function choose(first : std_logic; a, b : std_logic_vector) return std_logic_vector is
  begin
    return (a and first) or (b and not first);
  end function;

  -- value * (1 - 2^-DECAY), towards zero: of a negative value, the fraction is
  -- rounded up.
  function decayed(value : offset_word) return offset_word is
    constant MOST  : share_word := to_signed(2**DECAY - 1, OFFSET_WIDTH + DECAY);
    constant UP    : share_word := signed(std_logic_vector(MOST) and value(value'high));
    constant SHARE : share_word
      := shift_left(resize(value, OFFSET_WIDTH + DECAY), DECAY) - value + UP;
  begin
    return SHARE(SHARE'high downto DECAY);
  end function;

  -- A value fits when both of its upper bits are the same; where they are not, all
  -- others become the opposite of the sign.
  function saturate(value : signed) return std_logic_vector is
    constant SIGN : std_logic := value(value'high);
    variable over : std_logic := '0';
  begin
    for i in DRIVE_WIDTH - 1 to value'high - 1 loop
      over := over or (value(i) xor SIGN);
    end loop;
    return SIGN & choose(over, (DRIVE_WIDTH - 2 downto 0 => not SIGN),
                         std_logic_vector(value(DRIVE_WIDTH - 2 downto 0)));
  end function;

begin

  process (clk)
    -- The edge after a sample loads the drive.
    variable loads  : std_logic;
    -- The mode whose law made the drive.
    variable driven : std_logic;
    variable offset : offset_word;
    variable law    : std_logic_vector(DRIVE_WIDTH - 1 downto 0);
    variable leap   : offset_word;
    variable probes : std_logic;
  begin
    if rising_edge(clk) then
      if loads = '1' then
        law := choose(mode, impedance_drive, position_drive);
        if BUMPLESS then
          leap   := resize(signed(drive), OFFSET_WIDTH) - signed(law);
          offset := signed(choose(mode xor driven, std_logic_vector(leap),
                                  std_logic_vector(decayed(offset))));
          drive  <= saturate(resize(signed(law), OFFSET_WIDTH + 1) + offset);
          driven := mode;
        else
          drive  <= law;
        end if;
      end if;

      loads := sample;
      if sample = '1' then
        probes := (mode and not exceeds(threshold_off, finger_force))
                  or (not mode and exceeds(finger_force, threshold_on));
        if not TAKE_RADIUS then
          equilibrium <= rest;
        else
          equilibrium <= choose(mode and probes, equilibrium, radius);
        end if;
        mode <= probes;
      end if;

      if rst = '1' then
        loads       := '0';
        driven      := '0';
        offset      := (others => '0');
        drive       <= (others => '0');
        mode        <= '0';
        equilibrium <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
