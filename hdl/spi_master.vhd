-- spi_master : a serial peripheral interface (SPI) for one slave, highest bit first
--
-- A frame, from the edge with start:
--   0 clocks              select_n falls
--   LEAD                  first edge of sclk
--   DIVIDER each          2*WIDTH - 1 more edges of sclk
--   TRAIL                 select_n rises, word is loaded, ready is '1' for one clock
--   GAP                   busy falls
--
-- sclk rests at CPOL. Without CPHA, mosi has the first bit from the start on, bits are
-- read at odd edges and change at even ones; with CPHA, they change at odd edges and
-- are read at even ones. Behind the last bit, mosi is '0' without CPHA, and keeps it
-- with CPHA. miso is read at the edge itself, through no synchroniser: the slave has
-- had half a period of sclk. Parity is the user's: both words are all bits of the
-- frame.
--
-- generics WIDTH    bits of a frame, 2 to 32
--          DIVIDER  clocks of half a period of sclk, 1 to 65535
--          LEAD     clocks from select_n to the first edge, 1 to 65535
--          TRAIL    clocks from the last edge to the end of select_n, 1 to 65535
--          GAP      clocks before another frame, 1 to 65535
--          CPOL     sclk rests at '1'
--          CPHA     bits are read at even edges
-- in       start    (0,1,0)      a frame begins; ignored while busy
--          data     (0,WIDTH,0)  word to be sent, read with start
--          miso     (0,1,0)
-- out      select_n (0,1,0)
--          sclk     (0,1,0)
--          mosi     (0,1,0)
--          word     (0,WIDTH,0)  of the latest frame
--          busy     (0,1,0)      a frame is under way, or the gap behind it
--          ready    (0,1,0)      for one edge, together with a new word
-- latency  LEAD + (2*WIDTH-1)*DIVIDER + TRAIL edges from the edge with start to the
--          edge that loads word
-- reset    idle, select_n '1', sclk as CPOL, all else 0
-- overflow none
-- source   common practice; the default is mode 1 with 16 bits, as the angle sensor
--          AS5047P has it, at 50 MHz
-- differs from the hardware: pins follow the clock edge, with no delay of drivers and
--          lines.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity spi_master is
  generic (
    WIDTH   : positive := 16;
    DIVIDER : positive := 3;
    LEAD    : positive := 18;
    TRAIL   : positive := 4;
    GAP     : positive := 19;
    CPOL    : boolean  := false;
    CPHA    : boolean  := true
  );
  port (
    clk      : in  std_logic;
    rst      : in  std_logic;
    start    : in  std_logic;
    data     : in  std_logic_vector(WIDTH - 1 downto 0);
    miso     : in  std_logic;
    select_n : out std_logic;
    sclk     : out std_logic;
    mosi     : out std_logic;
    word     : out std_logic_vector(WIDTH - 1 downto 0);
    busy     : out std_logic;
    ready    : out std_logic
  );
end entity;

architecture rtl of spi_master is

  constant LONGEST : positive := maximum(maximum(DIVIDER, LEAD), maximum(TRAIL, GAP));
  constant LAST    : positive := 2 * WIDTH;

  function level(high : boolean) return std_logic is
  begin
    if high then
      return '1';
    end if;
    return '0';
  end function;

begin

  process (clk)
    -- Clocks before the next change of a pin.
    variable timer    : natural range 0 to LONGEST;
    -- Edges of sclk since the start, then 1 more in the gap.
    variable edges    : natural range 0 to LAST + 1;
    variable outgoing : std_logic_vector(WIDTH - 1 downto 0);
    variable incoming : std_logic_vector(WIDTH - 1 downto 0);
  begin
    if rising_edge(clk) then
      ready <= '0';

      if busy = '0' then
        if start = '1' then
          outgoing := data;
          if not CPHA then
            mosi     <= outgoing(WIDTH - 1);
            outgoing := outgoing(WIDTH - 2 downto 0) & '0';
          end if;
          edges    := 0;
          timer    := LEAD - 1;
          select_n <= '0';
          busy     <= '1';
        end if;
      elsif timer > 0 then
        timer := timer - 1;
      elsif edges < LAST then
        if (edges mod 2 = 1) = CPHA then
          incoming := incoming(WIDTH - 2 downto 0) & miso;
        else
          mosi     <= outgoing(WIDTH - 1);
          outgoing := outgoing(WIDTH - 2 downto 0) & '0';
        end if;
        sclk  <= not sclk;
        edges := edges + 1;
        if edges = LAST then
          timer := TRAIL - 1;
        else
          timer := DIVIDER - 1;
        end if;
      elsif edges = LAST then
        select_n <= '1';
        word     <= incoming;
        ready    <= '1';
        edges    := LAST + 1;
        timer    := GAP - 1;
      else
        busy <= '0';
      end if;

      if rst = '1' then
        timer    := 0;
        edges    := 0;
        outgoing := (others => '0');
        incoming := (others => '0');
        select_n <= '1';
        sclk     <= level(CPOL);
        mosi     <= '0';
        word     <= (others => '0');
        busy     <= '0';
        ready    <= '0';
      end if;
    end if;
  end process;

end architecture;
