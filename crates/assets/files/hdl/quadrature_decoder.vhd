-- quadrature_decoder : x4 decoding, one step per edge of either line
--
--   (a b)  00 -> 01 -> 11 -> 10 -> 00   step = +1
--          the reverse order            step = -1
--          no change                    step =  0
--          both lines changed           step =  0, error := 1
--
-- generics SETTLE         edges after reset that only load the previous lines;
--                         the synchronizer in front needs them to fill, and
--                         its zeros must not be decoded as a movement
-- in       a      (0,1,0) encoder line A, synchronous
--          b      (0,1,0) encoder line B, synchronous
-- out      step   (1,1,0) -1, 0 or +1
--          error  (0,1,0) a transition was lost; sticky until reset
-- latency  1 edge
-- reset    previous lines 00, step 0, error 0, SETTLE edges to wait
-- overflow a double change has no direction: it counts nothing, sets error
-- source   common practice; the encoder input of Vasudevan et al. 2007
-- differs from the hardware: no digital filter against glitches; the lines of a
--          real encoder also bounce and are not exactly 90 degrees apart.

library ieee;
use ieee.std_logic_1164.all;

entity quadrature_decoder is
  generic (
    SETTLE : natural := 3
  );
  port (
    clk   : in  std_logic;
    rst   : in  std_logic;
    a     : in  std_logic;
    b     : in  std_logic;
    step  : out std_logic_vector(1 downto 0);
    error : out std_logic
  );
end entity;

architecture rtl of quadrature_decoder is
begin

  process (clk)
    variable previous   : std_logic_vector(1 downto 0);
    variable transition : std_logic_vector(3 downto 0);
    variable settling   : natural range 0 to SETTLE;
  begin
    if rising_edge(clk) then
      transition := previous & a & b;
      previous   := a & b;

      step <= "00";
      if settling > 0 then
        settling := settling - 1;
      else
        case transition is
          when "0001" | "0111" | "1110" | "1000" => step  <= "01";
          when "0010" | "1011" | "1101" | "0100" => step  <= "11";
          when "0000" | "0101" | "1010" | "1111" => null;
          when others                            => error <= '1';
        end case;
      end if;

      if rst = '1' then
        previous := "00";
        settling := SETTLE;
        step     <= "00";
        error    <= '0';
      end if;
    end if;
  end process;

end architecture;
