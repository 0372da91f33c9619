-- position_select : the position of the encoder's counter, or that of an absolute sensor
--
--   position = count when coded = 0, else code
--
-- generics WIDTH                    bits of the position
-- in       count    (0,WIDTH,0)     position of the encoder, modulo its width
--          code     (0,WIDTH,0)     position of the absolute sensor, modulo its width
--          coded    (0,1,0)         the absolute sensor is read
-- out      position (0,WIDTH,0)
-- latency  0, combinational
-- reset    none
-- overflow none
-- source   none needed
-- differs from the hardware: no propagation delay.

library ieee;
use ieee.std_logic_1164.all;

entity position_select is
  generic (
    WIDTH : positive := 16
  );
  port (
    count    : in  std_logic_vector(WIDTH - 1 downto 0);
    code     : in  std_logic_vector(WIDTH - 1 downto 0);
    coded    : in  std_logic;
    position : out std_logic_vector(WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of position_select is
begin

  -- Gated instead of chosen, so that an unknown value stays unknown.
  position <= (code and coded) or (count and not coded);

end architecture;
