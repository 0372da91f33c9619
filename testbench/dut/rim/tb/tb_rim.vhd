-- Self-checking testbench of the rim stop: decoder, index check, polarity, dead
-- time, speed, and the wall in closed loop with a motor and a hand.
library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use work.rim_types.all;

entity tb_rim is
  generic (LOOP_CLOCKS : natural := 1200000);
end entity tb_rim;

architecture bench of tb_rim is

  constant DEAD  : positive := 5;
  constant DUTY  : positive := 10;

  signal clk     : std_logic := '0';
  signal stop    : boolean   := false;
  signal rst_n   : std_logic := '0';
  signal bench   : std_logic_vector(1 downto 0) := "11";
  signal bench_z : std_logic := '0';
  signal plant   : std_logic_vector(1 downto 0) := "00";
  signal plant_z : std_logic := '0';
  signal closed  : boolean := false;
  signal enc_a, enc_b, enc_z          : std_logic;
  signal ah, al, bh, bl, lost         : std_logic;
  signal speed                        : signed(15 downto 0);
  signal count                        : signed(17 downto 0);
  signal lost2                        : std_logic;
  signal probe                        : signed(DUTY downto 0) := (others => '0');
  signal leg_a, leg_b                 : gate_pair;
  -- clocks that upper gates were on in the last period
  signal on_a, on_b, probe_a, probe_b : natural := 0;
  -- dead time seen
  signal shoots                       : natural := 0;
  signal least                        : natural := 999;

  signal theta_mean, theta_swing, theta_want : real := 0.0;
  signal loop_done : boolean := false;

begin

  clk <= not clk after 50 ns when not stop else '0';

  enc_a <= plant(1) when closed else bench(1);
  enc_b <= plant(0) when closed else bench(0);
  enc_z <= plant_z  when closed else bench_z;

  dut : entity work.rim_stop
    generic map (DEAD_CLOCKS => DEAD, DUTY_BITS => DUTY)
    port map (clk => clk, rst_n => rst_n, enc_a => enc_a, enc_b => enc_b, enc_z => enc_z,
              gate_ah => ah, gate_al => al, gate_bh => bh, gate_bl => bl,
              lost => lost, speed => speed);

  -- The parts whose values the top does not show.
  counter : entity work.rim_encoder
    port map (clk => clk, rst_n => rst_n, enc_a => enc_a, enc_b => enc_b, enc_z => enc_z,
              count => count, lost => lost2);

  bridge : entity work.rim_bridge
    generic map (DUTY_BITS => DUTY, DEAD_CLOCKS => DEAD)
    port map (clk => clk, rst_n => rst_n, duty => probe, leg_a => leg_a, leg_b => leg_b);

  -- Both gates of a leg, and the clocks between one and the other.
  guard : process (clk)
    type four is array (0 to 3) of gate_pair;
    type gaps is array (0 to 3) of natural;
    variable leg  : four;
    variable last : four := (others => GATES_OFF);
    variable off  : gaps := (others => 999);
    variable n    : natural := 0;
    variable a, b, pa, pb : natural := 0;
  begin
    if falling_edge(clk) then
      leg(0) := (ah, al); leg(1) := (bh, bl); leg(2) := leg_a; leg(3) := leg_b;
      for i in leg'range loop
        if leg(i).high = '1' and leg(i).low = '1' then
          shoots <= shoots + 1;
        elsif leg(i) = GATES_OFF then
          if off(i) < 999 then
            off(i) := off(i) + 1;
          end if;
        else
          if last(i) /= GATES_OFF and leg(i) /= last(i) and off(i) < least then
            least <= off(i);
          end if;
          last(i) := leg(i);
          off(i)  := 0;
        end if;
      end loop;

      if ah = '1' then a := a + 1; end if;
      if bh = '1' then b := b + 1; end if;
      if leg_a.high = '1' then pa := pa + 1; end if;
      if leg_b.high = '1' then pb := pb + 1; end if;
      n := n + 1;
      if n = 2 ** DUTY then
        on_a <= a; on_b <= b; probe_a <= pa; probe_b <= pb;
        n := 0; a := 0; b := 0; pa := 0; pb := 0;
      end if;
    end if;
  end process guard;

  -- The motor, the hand and the encoder.
  motor : process (clk)
    constant DT : real := 100.0e-9;
    constant TAU : real := 651.8986;
    variable amps, omega, theta, hand, rate, va, vb, t, total, lo, hi, k : real := 0.0;
    variable n, c, q : integer := 0;
  begin
    if rising_edge(clk) and closed then
      t := t + DT;
      if t < 0.060 then rate := 2.2 / 0.060; else rate := 0.0; end if;
      hand := hand + rate * DT;
      if ah = '1' or (al = '0' and amps < 0.0) then va := 24.0; else va := 0.0; end if;
      if bh = '1' or (bl = '0' and amps > 0.0) then vb := 24.0; else vb := 0.0; end if;
      amps  := amps + DT * (va - vb - 2.346 * amps - 25.9e-3 * omega) / 0.226e-3;
      omega := omega + DT * (25.9e-3 * amps - 1.3e-6 * omega
               + 0.3 * (hand - theta) + 0.1e-3 * (rate - omega)) / 1.37e-6;
      theta := theta + DT * omega;
      c := integer(theta * TAU + 65536.0 - 0.5) - 65536;
      q := c mod 4;
      case q is
        when 0      => plant <= "00";
        when 1      => plant <= "01";
        when 2      => plant <= "11";
        when others => plant <= "10";
      end case;
      if c mod 4096 < 4 then plant_z <= '1'; else plant_z <= '0'; end if;
      if n = 0 then lo := 1.0e9; hi := -1.0e9; end if;
      if t > 0.100 then
        if theta < lo then lo := theta; end if;
        if theta > hi then hi := theta; end if;
        total := total + theta;
        n := n + 1;
      end if;
      if n = 200000 then
        k := 95.0 / 16.0 / 1024.0 * (25.9e-3 * 24.0 / 2.346) * TAU;
        theta_mean  <= total / real(n);
        theta_swing <= hi - lo;
        theta_want  <= (0.3 * 2.2 + k * 1.5) / (0.3 + k);
        loop_done   <= true;
      end if;
    end if;
  end process motor;

  script : process
    variable fails : natural := 0;

    procedure check (ok : boolean; what : string; got, want : integer) is
    begin
      if ok then
        report "PASS  " & what & ": " & integer'image(got) severity note;
      else
        fails := fails + 1;
        report "FAIL  " & what & ": " & integer'image(got) & ", expected "
               & integer'image(want) severity warning;
      end if;
    end procedure check;

    procedure check (what : string; got, want : integer) is
    begin
      check(got = want, what, got, want);
    end procedure check;

    procedure clocks (n : natural) is
    begin
      for i in 1 to n loop wait until rising_edge(clk); end loop;
      wait for 13 ns;
    end procedure clocks;

    procedure hop (n : integer; each : positive) is
    begin
      for i in 1 to abs n loop
        if (n > 0) = (bench(1) = bench(0)) then
          bench(0) <= not bench(0);
        else
          bench(1) <= not bench(1);
        end if;
        clocks(each);
      end loop;
    end procedure hop;

    function bit_of (s : std_logic) return integer is
    begin
      if s = '1' then return 1; elsif s = '0' then return 0; else return -1; end if;
    end function bit_of;
  begin
    clocks(3);
    check("all gates off in reset", bit_of(ah or al or bh or bl), 0);
    rst_n <= '1';
    clocks(20);
    check("count after reset at lines 11", to_integer(count), 0);
    check("lower gates on at rest", bit_of(al and bl), 1);
    hop(10, 4);  clocks(5);
    check("ten steps forward", to_integer(count), 10);
    hop(-25, 4); clocks(5);
    check("twenty-five back", to_integer(count), -15);
    check("nothing lost", bit_of(lost), 0);

    hop(993, 4); clocks(3100);
    check("at the wall", to_integer(count), 978);
    check("leg A at the wall", on_a, 0);
    check("leg B at the wall", on_b, 0);
    hop(50, 4);
    clocks(60000);                              -- the speed filter runs out
    check("speed at rest", to_integer(speed), 0);
    check("leg A 50 beyond: upper gate off", on_a, 0);
    check("leg B 50 beyond: clocks on", on_b, 95 * 50 / 16);

    -- one count every 100 clocks is 10 a sample
    hop(400, 100);
    check(abs (to_integer(speed) - 2560) <= 64, "speed at 10 a sample", to_integer(speed), 2560);
    hop(-400, 100);
    check(abs (to_integer(speed) + 2560) <= 64, "speed at 10 back", to_integer(speed), -2560);
    hop(200, 4); clocks(60000);
    check("limited duty", on_b, 2 ** DUTY - 1 - 4 * DEAD);

    -- the bridge by itself, both ways
    probe <= to_signed(100, DUTY + 1);  clocks(3100);
    check("duty +100, leg A", probe_a, 100);
    check("duty +100, leg B", probe_b, 0);
    probe <= to_signed(-1, DUTY + 1);   clocks(3100);
    check("duty -1, leg A", probe_a, 0);
    check("duty -1, leg B", probe_b, 1);
    probe <= to_signed(-1024, DUTY + 1); clocks(3100);
    check("duty -1024, leg B limited", probe_b, 2 ** DUTY - 1 - 4 * DEAD);
    probe <= to_signed(1023, DUTY + 1); clocks(3100);
    check("duty +1023, leg A limited", probe_a, 2 ** DUTY - 1 - 4 * DEAD);

    -- the index: twice in the same place, then half a turn away
    bench_z <= '1'; clocks(5); bench_z <= '0'; clocks(5);
    hop(4096, 4);
    bench_z <= '1'; clocks(5); bench_z <= '0'; clocks(5);
    check("index a turn later is right", bit_of(lost), 0);
    hop(40, 4);
    bench_z <= '1'; clocks(5); bench_z <= '0'; clocks(5);
    check("index 40 counts off is noticed", bit_of(lost), 1);
    rst_n <= '0';
    wait for 1 ns;
    check("reset is asynchronous: gates off", bit_of(ah or al or bh or bl), 0);
    clocks(3);
    rst_n <= '1';
    clocks(20);
    check("lost is cleared", bit_of(lost), 0);
    bench <= not bench;  clocks(6);
    check("both lines at once is noticed", bit_of(lost), 1);

    if LOOP_CLOCKS > 0 then
      rst_n <= '0'; closed <= true; clocks(4); rst_n <= '1';
      wait until loop_done for LOOP_CLOCKS * 110 ns;
      check(loop_done, "closed loop ended, clocks at most", LOOP_CLOCKS, LOOP_CLOCKS);
      check(abs (theta_mean - theta_want) < 0.01, "rest position, 0.1 mrad",
            integer(theta_mean * 1.0e4), integer(theta_want * 1.0e4));
      check(theta_swing < 0.010, "swing at rest below 10 mrad, urad", integer(theta_swing * 1.0e6), 10000);
      check("encoder followed in the loop", bit_of(lost), 0);
    end if;

    check("clocks with both gates of a leg on", shoots, 0);
    check("least dead time, clocks", least, DEAD);

    if fails = 0 then
      report "rim_stop: ALL PASSED" severity note;
    else
      report "rim_stop: " & integer'image(fails) & " FAILED" severity error;
    end if;
    stop <= true;
    wait;
  end process script;

end architecture bench;
