-- square_root : floor of the square root, one bit an edge
--
--   root := floor(sqrt(x))
--
-- Restoring, two bits of x for one of the root: with r the root of the upper
-- bits of x and rest what is left of them, the next bit is 1 when
-- (2r+1)^2 - (2r)^2 = 4r+1 can leave 4*rest + (next two bits).
--
-- generics WIDTH bits of x, even
-- in       start (0,1,0)       begins a root, gives up one under way
--          x     (0,WIDTH,0)   read with start
-- out      root  (0,WIDTH/2,0)
--          busy  (0,1,0)  a root is under way
--          ready (0,1,0)  for one edge, together with a new root
-- latency  WIDTH/2 edges from the edge with start to the edge that writes the
--          root; a start on that edge too gives it up
-- reset    outputs 0, nothing under way
-- overflow none
-- source   the digit-by-digit root of every textbook
-- differs from the hardware: a design of this project, not of a paper. The
--          emulator computes the root at the start and shows it when it is
--          ready: the ports are exact at every edge, the registers within are
--          not modelled.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity square_root is
  generic (
    WIDTH : positive := 24
  );
  port (
    clk   : in  std_logic;
    rst   : in  std_logic;
    start : in  std_logic;
    x     : in  std_logic_vector(WIDTH - 1 downto 0);
    root  : out std_logic_vector(WIDTH / 2 - 1 downto 0);
    busy  : out std_logic;
    ready : out std_logic
  );
end entity;

architecture rtl of square_root is

  constant STEPS : positive := WIDTH / 2;

begin

  process (clk)
    -- The edges to the end of the root, 0 when none is under way.
    variable remaining  : natural range 0 to STEPS;
    variable bits       : unsigned(WIDTH - 1 downto 0);
    variable partial    : unsigned(STEPS - 1 downto 0);
    -- What is left is at most twice the root so far, and shifted by two bits.
    variable rest       : unsigned(STEPS + 1 downto 0);
    variable difference : unsigned(STEPS + 2 downto 0);
  begin
    if rising_edge(clk) then
      ready <= '0';

      if start = '1' then
        bits      := unsigned(x);
        partial   := (others => '0');
        rest      := (others => '0');
        remaining := STEPS;
        busy      <= '1';
      elsif remaining > 0 then
        rest       := rest(STEPS - 1 downto 0) & bits(WIDTH - 1 downto WIDTH - 2);
        bits       := shift_left(bits, 2);
        difference := ('0' & rest) - (partial & "01");
        partial    := partial(STEPS - 2 downto 0) & not difference(STEPS + 2);
        if difference(STEPS + 2) /= '1' then
          rest := difference(STEPS + 1 downto 0);
        end if;

        remaining := remaining - 1;
        if remaining = 0 then
          root  <= std_logic_vector(partial);
          busy  <= '0';
          ready <= '1';
        end if;
      end if;

      if rst = '1' then
        root      <= (others => '0');
        busy      <= '0';
        ready     <= '0';
        remaining := 0;
      end if;
    end if;
  end process;

end architecture;
