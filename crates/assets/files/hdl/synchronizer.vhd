-- synchronizer : brings the encoder lines into the clock domain
--
-- Two flip-flops in series per line. The first may go metastable when its pin
-- moves at the clock edge; it has one period to settle before the second one
-- passes it on.
--
--   a := stage_a;  stage_a := a_pin        (likewise b)
--
-- in       a_pin  (0,1,0)  encoder line A, asynchronous
--          b_pin  (0,1,0)  encoder line B, asynchronous
-- out      a      (0,1,0)  line A, two edges later
--          b      (0,1,0)  line B, two edges later
-- latency  2 edges
-- reset    all four flip-flops 0
-- overflow none
-- source   common practice; the encoder input of Vasudevan et al. 2007
-- differs from the hardware: no flip-flop is ever metastable here: a line that
--          moves at the edge is read as its value just before it.

library ieee;
use ieee.std_logic_1164.all;

entity synchronizer is
  port (
    clk   : in  std_logic;
    rst   : in  std_logic;
    a_pin : in  std_logic;
    b_pin : in  std_logic;
    a     : out std_logic;
    b     : out std_logic
  );
end entity;

architecture rtl of synchronizer is
begin

  process (clk)
    variable stage_a : std_logic;
    variable stage_b : std_logic;
  begin
    if rising_edge(clk) then
      -- The old stage leaves before the new one enters: these are registers.
      a       <= stage_a;
      b       <= stage_b;
      stage_a := a_pin;
      stage_b := b_pin;

      if rst = '1' then
        a       <= '0';
        b       <= '0';
        stage_a := '0';
        stage_b := '0';
      end if;
    end if;
  end process;

end architecture;
