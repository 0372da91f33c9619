-- input_shaper : the digital twin of the analog input shaper, one-directional
--
-- With u the torque sampled and held, and h = biquad(u), sampled at the same edges:
--   shaped = max(0, rounded(u - max(0, h)))     ENABLED
--   shaped = torque                             otherwise, without a register
--
-- The shaper takes from the torque what the filter, a high pass, finds in it, but
-- only where that lowers it, and only from a torque that pushes: a negative u
-- gives 0.
--
--   torque -+-> hold ---- u -+-> shape -> shaped
--           +-> filter -- h -+
--
-- generics ENABLED            shape, or else pass the torque on
--          TORQUE_WIDTH       bits of the command's magnitude, at most 30
--          PERIOD_WIDTH       bits of the period, 2 to 30
--          PHASE              edges after reset before the first sample edge, at
--                             most 4095
--          B0, B1, B2, A1, A2 coefficients of the filter, words of (1,1,30)
--          ROUNDING           how shaped is rounded, of rounding_pkg; 0 truncates,
--                             down
-- in       torque (1,TORQUE_WIDTH+1,0)
--          period (0,PERIOD_WIDTH,0)   sample period in clocks, 0 acts as 1
-- out      shaped (1,TORQUE_WIDTH+1,0)
-- latency  1 edge, sample edges only; a new period takes effect at the next
--          sample edge. Not ENABLED: 0, combinational
-- reset    u 0, h 0; after it PHASE edges and then a sample edge
-- overflow h, of (1,TORQUE_WIDTH+2,16), saturates; the difference never, it lies
--          between 0 and u
-- source   y = max(0, u - max(0, G_hpf u)), the analog input shaper's Figure 1
-- differs from the hardware: the published shaper is analog; here the filter
--          samples and rounds, and its products take one edge.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.rounding_pkg.all;

entity input_shaper is
  generic (
    ENABLED      : boolean  := false;
    TORQUE_WIDTH : positive := 12;
    PERIOD_WIDTH : positive range 2 to 30 := 24;
    PHASE        : natural  := 0;
    B0           : integer  := 0;
    B1           : integer  := 0;
    B2           : integer  := 0;
    A1           : integer  := 0;
    A2           : integer  := 0;
    ROUNDING     : rounding_mode := TRUNCATE
  );
  port (
    clk    : in  std_logic;
    rst    : in  std_logic;
    torque : in  std_logic_vector(TORQUE_WIDTH + 1 downto 0);
    period : in  std_logic_vector(PERIOD_WIDTH - 1 downto 0);
    shaped : out std_logic_vector(TORQUE_WIDTH + 1 downto 0)
  );
end entity;

architecture rtl of input_shaper is
begin

  g_through : if not ENABLED generate
    shaped <= torque;
  end generate;

  g_shaper : if ENABLED generate

    constant WORD_WIDTH : positive := TORQUE_WIDTH + 2;
    constant FRAC       : positive := 16;
    constant HIGH_WIDTH : positive := WORD_WIDTH + 1 + FRAC;

    signal early : std_logic;  -- before the phase
    signal quiet : std_logic;
    signal u     : std_logic_vector(WORD_WIDTH - 1 downto 0);
    signal h     : std_logic_vector(HIGH_WIDTH - 1 downto 0);

  begin

    delay : process (clk)
      variable remaining : natural range 0 to PHASE;
    begin
      if rising_edge(clk) then
        early <= '0';
        if remaining > 1 then
          early     <= '1';
          remaining := remaining - 1;
        end if;

        if rst = '1' then
          remaining := PHASE;
          early     <= '0';
          if PHASE > 0 then
            early <= '1';
          end if;
        end if;
      end if;
    end process;

    quiet <= rst or early;

    hold : entity work.zero_order_hold
      generic map (
        WIDTH        => WORD_WIDTH,
        PERIOD_WIDTH => PERIOD_WIDTH
      )
      port map (
        clk    => clk,
        rst    => quiet,
        d      => torque,
        period => period,
        q      => u
      );

    filter : entity work.biquad
      generic map (
        IN_INT       => TORQUE_WIDTH + 1,
        IN_FRAC      => 0,
        OUT_INT      => TORQUE_WIDTH + 2,
        OUT_FRAC     => FRAC,
        COEF_INT     => 1,
        COEF_FRAC    => 30,
        B0           => B0,
        B1           => B1,
        B2           => B2,
        A1           => A1,
        A2           => A2,
        PERIOD_WIDTH => PERIOD_WIDTH
      )
      port map (
        clk    => clk,
        rst    => quiet,
        x      => torque,
        period => period,
        y      => h
      );

    -- Gated instead of chosen, so that an unknown word stays unknown.
    shape : process (all)
      variable taken : signed(HIGH_WIDTH downto 0);
      variable rest  : signed(HIGH_WIDTH downto 0);
    begin
      taken := resize(signed(h and not h(h'high)), taken'length);
      rest  := shift_left(resize(signed(u), rest'length), FRAC) - taken;
      rest  := signed(std_logic_vector(rest) and not rest(rest'high));
      rest  := rounded(rest, FRAC, ROUNDING);

      shaped <= std_logic_vector(rest(WORD_WIDTH - 1 downto 0));
    end process;

  end generate;

end architecture;
