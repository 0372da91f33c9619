-- sequential_divider : unsigned division, one bit of the quotient an edge
--
--   quotient := saturate(floor(num * 2^FRAC / den))      all ones for den = 0
--
-- Restoring: every edge one bit of num * 2^FRAC enters the rest from below, and
-- den leaves it when it can, which is the next bit of the quotient. Zero can
-- always leave, so that den = 0 gives all ones by itself.
--
-- generics NUM_WIDTH bits of the dividend
--          DEN_WIDTH bits of the divisor
--          FRAC      fraction bits of the quotient
--          OUT_WIDTH bits of the quotient, at most NUM_WIDTH+FRAC
-- in       start     (0,1,0)          begins a division, gives up one under way
--          num       (0,NUM_WIDTH,0)  read with start
--          den       (0,DEN_WIDTH,0)  read with start
-- out      quotient  (0,OUT_WIDTH-FRAC,FRAC)
--          busy      (0,1,0)  a division is under way
--          ready     (0,1,0)  for one edge, together with a new quotient
-- latency  NUM_WIDTH+FRAC edges from the edge with start to the edge that writes
--          the quotient; a start on that edge too gives the division up
-- reset    outputs 0, nothing under way
-- overflow the quotient saturates
-- source   the long division of every textbook; by it 1/interval of edge_timer
--          becomes a velocity
-- differs from the hardware: a design of this project, not of a paper. The
--          emulator computes the quotient at the start and shows it when it is
--          ready: the ports are exact at every edge, the registers within are
--          not modelled.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity sequential_divider is
  generic (
    NUM_WIDTH : positive := 24;
    DEN_WIDTH : positive := 16;
    FRAC      : natural  := 8;
    OUT_WIDTH : positive := 24
  );
  port (
    clk      : in  std_logic;
    rst      : in  std_logic;
    start    : in  std_logic;
    num      : in  std_logic_vector(NUM_WIDTH - 1 downto 0);
    den      : in  std_logic_vector(DEN_WIDTH - 1 downto 0);
    quotient : out std_logic_vector(OUT_WIDTH - 1 downto 0);
    busy     : out std_logic;
    ready    : out std_logic
  );
end entity;

architecture rtl of sequential_divider is

  constant STEPS : positive := NUM_WIDTH + FRAC;

  -- Gated instead of chosen, so that an unknown value stays unknown.
  function saturate(value : std_logic_vector(STEPS - 1 downto 0)) return std_logic_vector is
    variable above : std_logic := '0';
  begin
    for i in OUT_WIDTH to STEPS - 1 loop
      above := above or value(i);
    end loop;
    return value(OUT_WIDTH - 1 downto 0) or above;
  end function;

begin

  process (clk)
    -- The edges to the end of the division, 0 when none is under way.
    variable remaining  : natural range 0 to STEPS;
    -- The dividend leaves at the top, the quotient enters from below.
    variable bits       : unsigned(STEPS - 1 downto 0);
    variable divisor    : unsigned(DEN_WIDTH - 1 downto 0);
    variable rest       : unsigned(DEN_WIDTH downto 0);
    variable difference : unsigned(DEN_WIDTH + 1 downto 0);
  begin
    if rising_edge(clk) then
      ready <= '0';

      if start = '1' then
        bits      := shift_left(resize(unsigned(num), STEPS), FRAC);
        divisor   := unsigned(den);
        rest      := (others => '0');
        remaining := STEPS;
        busy      <= '1';
      elsif remaining > 0 then
        rest       := rest(DEN_WIDTH - 1 downto 0) & bits(STEPS - 1);
        difference := ('0' & rest) - divisor;
        bits       := bits(STEPS - 2 downto 0) & not difference(DEN_WIDTH + 1);
        if difference(DEN_WIDTH + 1) /= '1' then
          rest := difference(DEN_WIDTH downto 0);
        end if;

        remaining := remaining - 1;
        if remaining = 0 then
          quotient <= saturate(std_logic_vector(bits));
          busy     <= '0';
          ready    <= '1';
        end if;
      end if;

      if rst = '1' then
        quotient  <= (others => '0');
        busy      <= '0';
        ready     <= '0';
        remaining := 0;
      end if;
    end if;
  end process;

end architecture;
