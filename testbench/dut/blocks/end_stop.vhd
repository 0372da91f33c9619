-- End stop of a knob: two processes, centre-aligned PWM, sign on two half-bridge inputs.
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity end_stop is
  generic (
    STOP_AT : integer := 800;      -- counts
    KP      : natural := 24;       -- PWM steps per count
    KD      : natural := 6;        -- PWM steps per (count per sample)
    DIVIDER : positive := 50000);  -- clocks per sample of the damper
  port (
    sys_clk : in  std_logic;
    nreset  : in  std_logic;
    qa, qb  : in  std_logic;
    in1, in2 : out std_logic);
end entity;

architecture behave of end_stop is
  signal qa_s, qb_s : std_logic_vector(2 downto 0);
  signal pos, last  : signed(15 downto 0);
  signal vel        : signed(15 downto 0);
  signal tick       : natural range 0 to 65535;
  signal tref        : signed(11 downto 0);   -- torque reference, -2048..2047
  signal saw        : unsigned(10 downto 0);
  signal up         : std_logic;
begin

  position : process (sys_clk)
  begin
    if rising_edge(sys_clk) then
      qa_s <= qa_s(1 downto 0) & qa;
      qb_s <= qb_s(1 downto 0) & qb;
      if (qa_s(2) xor qa_s(1) xor qb_s(2) xor qb_s(1)) = '1' then
        if (qa_s(1) xor qb_s(2)) = '0' then pos <= pos + 1; else pos <= pos - 1; end if;
      end if;
      if tick = DIVIDER - 1 then
        tick <= 0; vel <= pos - last; last <= pos;
      else
        tick <= tick + 1;
      end if;
      if nreset = '0' then
        qa_s <= "000"; qb_s <= "000"; pos <= (others => '0');
        last <= (others => '0'); vel <= (others => '0'); tick <= 0;
      end if;
    end if;
  end process;

  torque : process (sys_clk)
    variable depth : signed(15 downto 0);
    variable push  : signed(31 downto 0);
  begin
    if rising_edge(sys_clk) then
      depth := pos - to_signed(STOP_AT, 16);
      if depth > 0 then
        push := depth * to_signed(KP, 16) + vel * to_signed(KD, 16);
        if push > 2047 then push := to_signed(2047, 32); elsif push < 0 then push := (others => '0'); end if;
      else
        push := (others => '0');
      end if;
      if up = '1' then
        if saw = 2046 then up <= '0'; end if; saw <= saw + 1;
      else
        if saw = 1 then up <= '1'; tref <= resize(push, 12); end if; saw <= saw - 1;
      end if;
      in1 <= '0';
      if saw < unsigned(tref(10 downto 0)) then in2 <= '1'; else in2 <= '0'; end if;
      if nreset = '0' then
        tref <= (others => '0'); saw <= (others => '0'); up <= '1'; in1 <= '0'; in2 <= '0';
      end if;
    end if;
  end process;
end architecture;
