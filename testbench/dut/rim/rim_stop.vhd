-- rim_stop: a wall on the rim of a knob.  Top of the design; compile last.
--
-- Beyond WALL_AT counts the motor is given the duty
--
--     -(STIFFNESS * depth + DAMPING * speed) / 16         in clocks of a period
--
-- with depth in counts and speed in counts a sample (SAMPLE_CLOCKS), low-passed.
-- With PUSH_ONLY the wall never pulls (a duty above 0 becomes 0).
--
-- Reset is asynchronous and active low; it is let go in step with the clock.
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.rim_types.all;

entity rim_stop is
  generic (
    STIFFNESS     : integer range 0 to 2047   := 95;    -- 1/16 clock a count
    DAMPING       : integer range 0 to 255    := 32;    -- 1/16 clock per count a sample
    WALL_AT       : integer                   := 978;   -- counts
    COUNT_BITS    : positive range 14 to 30   := 18;
    SPEED_BITS    : positive range 10 to 20   := 16;
    DUTY_BITS     : positive range 6 to 14    := 10;
    FILTER_SHIFT  : natural range 0 to 8      := 2;
    SAMPLE_CLOCKS : positive                  := 1000;
    DEAD_CLOCKS   : positive range 1 to 63    := 5;
    PUSH_ONLY     : boolean                   := true;
    CHECK_INDEX   : boolean                   := true
  );
  port (
    clk    : in  std_logic;                             -- 10 MHz
    rst_n  : in  std_logic;
    enc_a  : in  std_logic;
    enc_b  : in  std_logic;
    enc_z  : in  std_logic;
    gate_ah : out std_logic;                            -- leg A, upper
    gate_al : out std_logic;                            -- leg A, lower
    gate_bh : out std_logic;                            -- leg B, upper
    gate_bl : out std_logic;                            -- leg B, lower
    lost   : out std_logic;                             -- the encoder slipped
    speed  : out signed(SPEED_BITS - 1 downto 0)        -- 1/256 count a sample
  );
end entity rim_stop;

architecture rtl of rim_stop is

  constant DEPTH_BITS : positive := 13;                 -- signed: 0 .. 4095
  constant GAIN_BITS  : positive := 12;                 -- signed: 0 .. 2047
  constant FORCE_BITS : positive := 34;

  signal calm   : std_logic_vector(1 downto 0);
  signal run_n  : std_logic;
  signal count  : signed(COUNT_BITS - 1 downto 0);
  signal v      : signed(SPEED_BITS - 1 downto 0);
  signal depth  : signed(DEPTH_BITS - 1 downto 0);
  signal duty   : signed(DUTY_BITS downto 0);
  signal leg_a  : gate_pair;
  signal leg_b  : gate_pair;

begin

  -- Reset: at once when it comes, two clocks after it goes.
  let_go : process (clk, rst_n)
  begin
    if rst_n = '0' then
      calm <= "00";
    elsif rising_edge(clk) then
      calm <= calm(0) & '1';
    end if;
  end process let_go;

  run_n <= calm(1);

  encoder : entity work.rim_encoder
    generic map (
      COUNT_BITS  => COUNT_BITS,
      CHECK_INDEX => CHECK_INDEX
    )
    port map (
      clk   => clk,
      rst_n => run_n,
      enc_a => enc_a,
      enc_b => enc_b,
      enc_z => enc_z,
      count => count,
      lost  => lost
    );

  speedometer : entity work.rim_speed
    generic map (
      COUNT_BITS    => COUNT_BITS,
      SPEED_BITS    => SPEED_BITS,
      FILTER_SHIFT  => FILTER_SHIFT,
      SAMPLE_CLOCKS => SAMPLE_CLOCKS
    )
    port map (
      clk   => clk,
      rst_n => run_n,
      count => count,
      speed => v
    );

  speed <= v;

  wall : process (clk, run_n)
    variable beyond : signed(31 downto 0);
    variable damper : signed(FORCE_BITS - 1 downto 0);
    variable force  : signed(FORCE_BITS - 1 downto 0);
  begin
    if run_n = '0' then
      depth <= (others => '0');
      duty  <= (others => '0');
    elsif rising_edge(clk) then
      beyond := resize(count, 32) - to_signed(WALL_AT, 32);
      if beyond < 0 then
        depth <= (others => '0');
      else
        depth <= clip(beyond, DEPTH_BITS);
      end if;

      damper := resize(v * to_signed(DAMPING, GAIN_BITS), FORCE_BITS);
      force  := resize(depth * to_signed(STIFFNESS, GAIN_BITS), FORCE_BITS)
                + shift_right(damper, SPEED_FRACTION);
      force  := shift_right(force, GAIN_FRACTION);
      if depth = 0 or (PUSH_ONLY and force < 0) then
        duty <= (others => '0');
      else
        duty <= clip(-force, DUTY_BITS + 1);
      end if;
    end if;
  end process wall;

  bridge : entity work.rim_bridge
    generic map (
      DUTY_BITS   => DUTY_BITS,
      DEAD_CLOCKS => DEAD_CLOCKS
    )
    port map (
      clk   => clk,
      rst_n => run_n,
      duty  => duty,
      leg_a => leg_a,
      leg_b => leg_b
    );

  gate_ah <= leg_a.high;
  gate_al <= leg_a.low;
  gate_bh <= leg_b.high;
  gate_bl <= leg_b.low;

end architecture rtl;
