-- virtual_coupling : a massless tool between the device and the virtual wall
--
-- The device pulls the tool by a spring and a damper, the coupling, and feels
-- only their force. `extension` is the device before the tool. At a sample edge,
-- with all lengths in counts, floored to EXTENSION_FRAC fraction bits, and torques
-- floored to whole PWM counts:
--   free := floor(FREE * extension / 2^GAIN_FRAC)     the tool outside the wall
--   tool := delta - free                              how deep it is then
--   tool > 0:
--     reached   := saturate(floor((SHARE*delta + HELD*extension) / 2^GAIN_FRAC))
--     push      := floor(stiffness * reached) + floor(damping * (reached - extension))
--     torque    := clamp(push, 0, 2^TORQUE_WIDTH - 1)
--     extension := reached
--   else:
--     torque    := 0
--     extension := free
--
-- Both are the massless tool at rest between its forces, with K_c, B_c the
-- coupling, K_e the wall and T the sample period: K_c e + B_c/T (e - e(last)) is
-- K_e * (delta - e) inside the wall and 0 outside. Solved for e:
--   SHARE = K_e     / (K_e + K_c + B_c/T) * 2^GAIN_FRAC
--   HELD  = (B_c/T) / (K_e + K_c + B_c/T) * 2^GAIN_FRAC
--   FREE  = (B_c/T) / (K_c + B_c/T)       * 2^GAIN_FRAC
-- A rigid wall has SHARE = 2^GAIN_FRAC and HELD = 0.
--
-- generics WIDTH                            bits of the position
--          STIFFNESS_WIDTH, STIFFNESS_FRAC  bits of the stiffness, its fraction
--          DAMPING_WIDTH, DAMPING_FRAC      bits of the damping, its fraction
--          PERIOD_WIDTH                     bits of the sample period, 2 to 30
--          SCALE_WIDTH, SCALE_FRAC          bits of the scale, its fraction
--          TORQUE_WIDTH                     bits of the torque's magnitude, at most 30
--          EXTENSION_FRAC                   fraction bits of the extension
--          GAIN_FRAC                        fraction bits of the gains, at most 30
--          SHARE, FREE, HELD                gains, 0 to 2^GAIN_FRAC
-- in       position    (0,WIDTH,0)    ignored
--          delta       (1,WIDTH-1,0)  device beyond the wall
--          contact     (0,1,0)        ignored
--          penetration (0,WIDTH,0)    ignored
--          stiffness   (0,STIFFNESS_WIDTH-STIFFNESS_FRAC,STIFFNESS_FRAC)
--                                     of the coupling, PWM counts per count
--          damping     (0,DAMPING_WIDTH-DAMPING_FRAC,DAMPING_FRAC)
--                                     of the coupling, PWM counts per count/sample
--          period      (0,PERIOD_WIDTH,0)  sample period in clocks, 0 acts as 1
--          scale       (0,SCALE_WIDTH-SCALE_FRAC,SCALE_FRAC)  ignored
-- out      torque      (1,TORQUE_WIDTH+1,0)  positive = against the penetration
--          memory      (1,WIDTH-1,EXTENSION_FRAC)  the extension
-- latency  1 edge, sample edges only; a new period takes effect at the next
--          sample edge
-- reset    torque 0, extension 0; the first edge after it is a sample edge
-- overflow `reached` saturates to the range of the memory; the torque clamps: it
--          never pulls
-- source   Colgate, Stanley, Brown 1995; Adams, Hannaford 1999
-- differs from the hardware: all products take one edge, so no limit on the
--          clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity virtual_coupling is
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
    EXTENSION_FRAC  : natural  := 8;
    GAIN_FRAC       : natural  := 16;
    SHARE           : natural  := 65536;
    FREE            : natural  := 0;
    HELD            : natural  := 0
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
    memory      : out std_logic_vector(WIDTH + EXTENSION_FRAC - 1 downto 0)
  );
end entity;

architecture rtl of virtual_coupling is

  constant EXTENSION_WIDTH : positive := WIDTH + EXTENSION_FRAC;

  -- Room for two extensions times a gain, and for the force of spring and damper.
  constant TOTAL_WIDTH     : positive := EXTENSION_WIDTH + GAIN_FRAC + 3;
  constant FORCE_WIDTH     : positive
    := maximum(maximum(STIFFNESS_WIDTH, DAMPING_WIDTH) + EXTENSION_WIDTH, TORQUE_WIDTH) + 3;

  subtype extension_word is signed(EXTENSION_WIDTH - 1 downto 0);
  subtype total_word     is signed(TOTAL_WIDTH - 1 downto 0);
  subtype force_word     is signed(FORCE_WIDTH - 1 downto 0);

  -- gain * word / 2^GAIN_FRAC, with its fraction still there.
  function gained(gain : natural; word : extension_word) return total_word is
  begin
    return resize(to_signed(gain, GAIN_FRAC + 2) * word, TOTAL_WIDTH);
  end function;

  -- The floor of what gained made, saturated: the bits above an extension's must all
  -- be its sign; where they are not, all others become the opposite of the sign.
  -- Gated instead of chosen, so that an unknown value stays unknown.
  function saturate(value : total_word) return extension_word is
    constant SIGN : std_logic := value(value'high);
    constant WORD : std_logic_vector(EXTENSION_WIDTH - 2 downto 0)
      := std_logic_vector(value(GAIN_FRAC + EXTENSION_WIDTH - 2 downto GAIN_FRAC));
    variable over : std_logic := '0';
  begin
    for i in GAIN_FRAC + EXTENSION_WIDTH - 1 to TOTAL_WIDTH - 2 loop
      over := over or (value(i) xor SIGN);
    end loop;
    return signed(SIGN & ((WORD and not over) or (over and not SIGN)));
  end function;

  -- The floor of a product with `places` fraction bits. A slice, not shift_right:
  -- GHDL 2.0 writes that into a Verilog netlist without the sign.
  function floored(value : signed; places : natural) return force_word is
  begin
    return resize(value(value'high downto places), FORCE_WIDTH);
  end function;

  -- Gated again.
  function choose(first : std_logic; a, b : extension_word) return extension_word is
  begin
    return signed((std_logic_vector(a) and first) or (std_logic_vector(b) and not first));
  end function;

  -- Between 0 and the most a torque can be.
  function clamp(value : force_word) return std_logic_vector is
    constant WORD  : std_logic_vector(TORQUE_WIDTH - 1 downto 0)
      := std_logic_vector(value(TORQUE_WIDTH - 1 downto 0));
    variable above : std_logic := '0';
  begin
    for i in TORQUE_WIDTH to FORCE_WIDTH - 2 loop
      above := above or value(i);
    end loop;
    return (WORD or above) and not value(value'high);
  end function;

  signal extension : extension_word;
  signal depth     : extension_word;
  signal loose     : extension_word;
  signal reached   : extension_word;
  signal outside   : signed(EXTENSION_WIDTH downto 0);
  signal inside    : std_logic;
  signal stretch   : signed(EXTENSION_WIDTH downto 0);
  signal spring    : force_word;
  signal drag      : force_word;

begin

  depth   <= shift_left(resize(signed(delta), EXTENSION_WIDTH), EXTENSION_FRAC);
  loose   <= saturate(gained(FREE, extension));
  reached <= saturate(gained(SHARE, depth) + gained(HELD, extension));
  outside <= resize(loose, EXTENSION_WIDTH + 1) - depth;
  inside  <= outside(outside'high);

  stretch <= resize(reached, EXTENSION_WIDTH + 1) - extension;
  spring  <= floored(signed('0' & stiffness) * reached, STIFFNESS_FRAC + EXTENSION_FRAC);
  drag    <= floored(signed('0' & damping) * stretch, DAMPING_FRAC + EXTENSION_FRAC);

  memory  <= std_logic_vector(extension);

  process (clk)
    -- 2^PERIOD_WIDTH - 2, written to stay inside an integer for 31 bits.
    variable countdown : natural range 0 to 2 * (2**(PERIOD_WIDTH - 1) - 1);
  begin
    if rising_edge(clk) then
      if countdown = 0 then
        torque    <= "00" & (clamp(spring + drag) and inside);
        extension <= choose(inside, reached, loose);
        countdown := maximum(to_integer(unsigned(period)), 1) - 1;
      else
        countdown := countdown - 1;
      end if;

      if rst = '1' then
        countdown := 0;
        extension <= (others => '0');
        torque    <= (others => '0');
      end if;
    end if;
  end process;

end architecture;
