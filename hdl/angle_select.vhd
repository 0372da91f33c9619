-- angle_select : the angle of the encoder, or that of an analog sensor
--
--   angle = delta when analog = 0, else code read as two's complement
--
-- generics WIDTH                     bits of the angle
--          CODE_WIDTH                bits of the analog sensor's code, at most WIDTH
-- in       delta  (1,WIDTH-1,0)      angle of the encoder
--          code   (0,CODE_WIDTH,0)   angle of the analog sensor, modulo its width
--          analog (0,1,0)            the analog sensor is read
-- out      angle  (1,WIDTH-1,0)
-- latency  0, combinational
-- reset    none
-- overflow none
-- source   enable_EncoderAngle in the firmware of EPFL's haptic paddle
-- differs from the hardware: none known.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity angle_select is
  generic (
    WIDTH      : positive := 14;
    CODE_WIDTH : positive := 12
  );
  port (
    delta  : in  std_logic_vector(WIDTH - 1 downto 0);
    code   : in  std_logic_vector(CODE_WIDTH - 1 downto 0);
    analog : in  std_logic;
    angle  : out std_logic_vector(WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of angle_select is

  signal word : std_logic_vector(WIDTH - 1 downto 0);

begin

  word  <= std_logic_vector(resize(signed(code), WIDTH));
  -- Gated instead of chosen, so that an unknown value stays unknown.
  angle <= (word and analog) or (delta and not analog);

end architecture;
