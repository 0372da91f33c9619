-- ssi_master : a synchronous serial interface (SSI), which reads an encoder's word
--
-- sclk rests at '1'. A frame, from the edge with start:
--   0 clocks       sclk falls, which freezes the encoder's word
--   DIVIDER each   2*WIDTH + 1 more edges of sclk, the last one rising
--   with that one  word is loaded, ready is '1' for one clock
--   PAUSE          busy falls
--
-- The encoder puts a bit out at each rising edge, the highest first; it is read at the
-- falling edge after it. data is read at the edge itself, through no synchroniser: the
-- encoder has had half a period of sclk. A Gray code and checks are the user's: the
-- word is all bits of the frame.
--
-- generics WIDTH    bits of a frame, 2 to 32
--          DIVIDER  clocks of half a period of sclk, 1 to 65535
--          PAUSE    clocks before another frame, by which the encoder must have a new
--                   word, 1 to 65535
-- in       start (0,1,0)      a frame begins; ignored while busy
--          data  (0,1,0)
-- out      sclk  (0,1,0)
--          word  (0,WIDTH,0)  of the latest frame
--          busy  (0,1,0)      a frame is under way, or the pause behind it
--          ready (0,1,0)      for one edge, together with a new word
-- latency  (2*WIDTH+1)*DIVIDER edges from the edge with start to the edge that loads
--          word
-- reset    idle, sclk '1', all else 0
-- overflow none
-- source   common practice of absolute encoders; the default is for 50 MHz: 1 MHz, and
--          a pause of 20 us
-- differs from the hardware: pins follow the clock edge, with no delay of drivers and
--          lines.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity ssi_master is
  generic (
    WIDTH   : positive := 13;
    DIVIDER : positive := 25;
    PAUSE   : positive := 1000
  );
  port (
    clk   : in  std_logic;
    rst   : in  std_logic;
    start : in  std_logic;
    data  : in  std_logic;
    sclk  : out std_logic;
    word  : out std_logic_vector(WIDTH - 1 downto 0);
    busy  : out std_logic;
    ready : out std_logic
  );
end entity;

architecture rtl of ssi_master is

  constant LAST : positive := 2 * WIDTH + 1;

begin

  process (clk)
    -- Clocks before the next change.
    variable timer    : natural range 0 to maximum(DIVIDER, PAUSE);
    -- Edges of sclk since the start.
    variable edges    : natural range 0 to LAST;
    variable incoming : std_logic_vector(WIDTH - 1 downto 0);
  begin
    if rising_edge(clk) then
      ready <= '0';

      if busy = '0' then
        if start = '1' then
          sclk  <= '0';
          busy  <= '1';
          edges := 0;
          timer := DIVIDER - 1;
        end if;
      elsif timer > 0 then
        timer := timer - 1;
      elsif edges < LAST then
        -- Odd edges fall.
        if edges mod 2 = 1 then
          incoming := incoming(WIDTH - 2 downto 0) & data;
        end if;
        sclk  <= not sclk;
        timer := DIVIDER - 1;
        edges := edges + 1;
        if edges = LAST then
          word  <= incoming;
          ready <= '1';
          timer := PAUSE - 1;
        end if;
      else
        busy <= '0';
      end if;

      if rst = '1' then
        timer    := 0;
        edges    := 0;
        incoming := (others => '0');
        sclk     <= '1';
        word     <= (others => '0');
        busy     <= '0';
        ready    <= '0';
      end if;
    end if;
  end process;

end architecture;
