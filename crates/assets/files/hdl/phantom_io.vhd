-- phantom_io : the FPGA of a platform whose host computes the haptic loop
--
-- The FPGA only counts the encoders and passes the host's commands on.
--
--   pins -> sync -> decoder -> counter -> positions
--                      host -> hold -> commands
--
-- generics POSITION_WIDTH  bits of the encoder counters
--          COMMAND_WIDTH   bits of a command
-- in       a_pin1, b_pin1 .. a_pin3, b_pin3 (0,1,0)  encoder lines of the joints
--          host1, host2, host3 (1,COMMAND_WIDTH-1,0) converter counts
-- out      position1, position2, position3 (0,POSITION_WIDTH,0)
--          command1, command2, command3 (1,COMMAND_WIDTH-1,0) converter counts
-- latency  pin to position 4 edges (2 sync, 1 decoder, 1 counter); host to
--          command 1 edge
-- reset    synchronous, to every clocked block
-- overflow positions wrap
-- source   Sevcik et al. 2009, the real-time and desktop platforms
-- differs from the hardware: the bus between host and FPGA is not in it; the
--          time it takes is a part of the host's delay.

library ieee;
use ieee.std_logic_1164.all;

entity phantom_io is
  generic (
    POSITION_WIDTH : positive := 16;
    COMMAND_WIDTH  : positive := 16
  );
  port (
    clk       : in  std_logic;
    rst       : in  std_logic;
    a_pin1    : in  std_logic;
    b_pin1    : in  std_logic;
    a_pin2    : in  std_logic;
    b_pin2    : in  std_logic;
    a_pin3    : in  std_logic;
    b_pin3    : in  std_logic;
    host1     : in  std_logic_vector(COMMAND_WIDTH - 1 downto 0);
    host2     : in  std_logic_vector(COMMAND_WIDTH - 1 downto 0);
    host3     : in  std_logic_vector(COMMAND_WIDTH - 1 downto 0);
    position1 : out std_logic_vector(POSITION_WIDTH - 1 downto 0);
    position2 : out std_logic_vector(POSITION_WIDTH - 1 downto 0);
    position3 : out std_logic_vector(POSITION_WIDTH - 1 downto 0);
    command1  : out std_logic_vector(COMMAND_WIDTH - 1 downto 0);
    command2  : out std_logic_vector(COMMAND_WIDTH - 1 downto 0);
    command3  : out std_logic_vector(COMMAND_WIDTH - 1 downto 0)
  );
end entity;

architecture rtl of phantom_io is

  signal a1     : std_logic;
  signal b1     : std_logic;
  signal a2     : std_logic;
  signal b2     : std_logic;
  signal a3     : std_logic;
  signal b3     : std_logic;
  signal step1  : std_logic_vector(1 downto 0);
  signal error1 : std_logic;  -- for the waveform only
  signal step2  : std_logic_vector(1 downto 0);
  signal error2 : std_logic;  -- for the waveform only
  signal step3  : std_logic_vector(1 downto 0);
  signal error3 : std_logic;  -- for the waveform only

begin

  sync1 : entity work.synchronizer
    port map (
      clk   => clk,
      rst   => rst,
      a_pin => a_pin1,
      b_pin => b_pin1,
      a     => a1,
      b     => b1
    );

  sync2 : entity work.synchronizer
    port map (
      clk   => clk,
      rst   => rst,
      a_pin => a_pin2,
      b_pin => b_pin2,
      a     => a2,
      b     => b2
    );

  sync3 : entity work.synchronizer
    port map (
      clk   => clk,
      rst   => rst,
      a_pin => a_pin3,
      b_pin => b_pin3,
      a     => a3,
      b     => b3
    );

  decoder1 : entity work.quadrature_decoder
    port map (
      clk   => clk,
      rst   => rst,
      a     => a1,
      b     => b1,
      step  => step1,
      error => error1
    );

  decoder2 : entity work.quadrature_decoder
    port map (
      clk   => clk,
      rst   => rst,
      a     => a2,
      b     => b2,
      step  => step2,
      error => error2
    );

  decoder3 : entity work.quadrature_decoder
    port map (
      clk   => clk,
      rst   => rst,
      a     => a3,
      b     => b3,
      step  => step3,
      error => error3
    );

  counter1 : entity work.position_counter
    generic map (
      WIDTH => POSITION_WIDTH
    )
    port map (
      clk      => clk,
      rst      => rst,
      step     => step1,
      position => position1
    );

  counter2 : entity work.position_counter
    generic map (
      WIDTH => POSITION_WIDTH
    )
    port map (
      clk      => clk,
      rst      => rst,
      step     => step2,
      position => position2
    );

  counter3 : entity work.position_counter
    generic map (
      WIDTH => POSITION_WIDTH
    )
    port map (
      clk      => clk,
      rst      => rst,
      step     => step3,
      position => position3
    );

  hold : entity work.command_register
    generic map (
      WIDTH        => COMMAND_WIDTH,
      PERIOD_WIDTH => 2,
      DELAY        => 0
    )
    port map (
      clk    => clk,
      rst    => rst,
      d1     => host1,
      d2     => host2,
      d3     => host3,
      period => "01",
      q1     => command1,
      q2     => command2,
      q3     => command3
    );

end architecture;
