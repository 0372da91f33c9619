-- rim_encoder: position from the lines A, B and index Z of an encoder.
--
-- All three lines are synchronised by two flip-flops.  Each edge of A or B is a
-- count (x4); (A,B) = 00, 01, 11, 10 is forward.  Counting begins three clocks
-- after reset, when the synchroniser holds the lines as they are, so that the
-- count starts from 0 wherever the encoder stands.
--
-- The index does not set the count.  With CHECK_INDEX, its rising edges are
-- compared: two of them have to be a whole number of turns apart, give or take
-- INDEX_SLACK counts (an index is some counts wide and is met from both sides).
-- Where they are not, or where both lines changed at once, "lost" is set and
-- stays set until reset.
--
-- Latency: line to count, three clocks.
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.rim_types.all;

entity rim_encoder is
  generic (
    COUNT_BITS  : positive := 18;
    TURN_BITS   : positive := 12;              -- 2**TURN_BITS counts a turn
    INDEX_SLACK : natural  := 8;
    CHECK_INDEX : boolean  := true
  );
  port (
    clk   : in  std_logic;
    rst_n : in  std_logic;
    enc_a : in  std_logic;
    enc_b : in  std_logic;
    enc_z : in  std_logic;
    count : out signed(COUNT_BITS - 1 downto 0);
    lost  : out std_logic
  );
end entity rim_encoder;

architecture rtl of rim_encoder is

  type line_pipe is array (0 to 1) of std_logic_vector(2 downto 0);

  signal pipe     : line_pipe;
  signal was      : std_logic_vector(2 downto 0);
  signal settle   : natural range 0 to 3;
  signal tally    : signed(COUNT_BITS - 1 downto 0);
  signal mark     : signed(TURN_BITS - 1 downto 0);
  signal marked   : std_logic;
  signal astray   : std_logic;

begin

  count <= tally;
  lost  <= astray;

  follow : process (clk, rst_n)
    variable off : signed(TURN_BITS - 1 downto 0);
  begin
    if rst_n = '0' then
      pipe   <= (others => (others => '0'));
      was    <= (others => '0');
      settle <= 0;
      tally  <= (others => '0');
      mark   <= (others => '0');
      marked <= '0';
      astray <= '0';
    elsif rising_edge(clk) then
      pipe(0) <= enc_a & enc_b & enc_z;
      pipe(1) <= pipe(0);
      was     <= pipe(1);

      if settle /= 3 then
        settle <= settle + 1;
      else
        case step_of(was(2 downto 1), pipe(1)(2 downto 1)) is
          when FORTH => tally  <= tally + 1;
          when BACK  => tally  <= tally - 1;
          when SLIP  => astray <= '1';
          when STAY  => null;
        end case;

        if CHECK_INDEX and was(0) = '0' and pipe(1)(0) = '1' then
          if marked = '0' then
            marked <= '1';
            mark   <= tally(TURN_BITS - 1 downto 0);
          else
            off := tally(TURN_BITS - 1 downto 0) - mark;   -- modulo one turn
            if off > INDEX_SLACK or off < -INDEX_SLACK then
              astray <= '1';
            end if;
          end if;
        end if;
      end if;
    end if;
  end process follow;

end architecture rtl;
