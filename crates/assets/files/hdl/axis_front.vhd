-- axis_front : from the pins of an encoder to the coordinates of the wall
--
--   a_pin, b_pin -> sync -> decoder -> counter -+-> position
--                              |                v
--                              v   reference -> offset -> wall -> contact,
--                            error                |               penetration
--                                                 v
--                                               delta
--
-- The first five blocks of hybrid_loop, which every method loop shares.
--
-- generics POSITION_WIDTH                    bits of the position
-- in       a_pin, b_pin (0,1,0)              encoder lines, asynchronous
--          reference    (0,POSITION_WIDTH,0) where the wall begins
-- out      position     (0,POSITION_WIDTH,0) counts since reset
--          error        (0,1,0)              a transition was lost; sticky
--          delta        (1,POSITION_WIDTH-1,0) positive inside the wall
--          contact      (0,1,0)              1 when delta >= 0
--          penetration  (0,POSITION_WIDTH,0) depth inside the wall
-- latency  pin to position 4 edges (2 sync, 1 decoder, 1 counter); delta,
--          contact and penetration follow position and reference at once
-- reset    synchronous, to every clocked block
-- overflow the position wraps, delta takes the short way round
-- source   Vasudevan et al. 2007, the encoder input and Eq. (1)
-- differs from the hardware: as in synchronizer, quadrature_decoder,
--          position_counter, displacement and unilateral.

library ieee;
use ieee.std_logic_1164.all;

entity axis_front is
  generic (
    POSITION_WIDTH : positive := 12
  );
  port (
    clk         : in  std_logic;
    rst         : in  std_logic;
    a_pin       : in  std_logic;
    b_pin       : in  std_logic;
    reference   : in  std_logic_vector(POSITION_WIDTH - 1 downto 0);
    position    : out std_logic_vector(POSITION_WIDTH - 1 downto 0);
    error       : out std_logic;
    delta       : out std_logic_vector(POSITION_WIDTH - 1 downto 0);
    contact     : out std_logic;
    penetration : out std_logic_vector(POSITION_WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of axis_front is

  signal a    : std_logic;
  signal b    : std_logic;
  signal step : std_logic_vector(1 downto 0);

begin

  sync : entity work.synchronizer
    port map (
      clk   => clk,
      rst   => rst,
      a_pin => a_pin,
      b_pin => b_pin,
      a     => a,
      b     => b
    );

  decoder : entity work.quadrature_decoder
    port map (
      clk   => clk,
      rst   => rst,
      a     => a,
      b     => b,
      step  => step,
      error => error
    );

  counter : entity work.position_counter
    generic map (
      WIDTH => POSITION_WIDTH
    )
    port map (
      clk      => clk,
      rst      => rst,
      step     => step,
      position => position
    );

  offset : entity work.displacement
    generic map (
      WIDTH => POSITION_WIDTH
    )
    port map (
      position  => position,
      reference => reference,
      delta     => delta
    );

  wall : entity work.unilateral
    generic map (
      WIDTH => POSITION_WIDTH
    )
    port map (
      delta       => delta,
      contact     => contact,
      penetration => penetration
    );

end architecture;
