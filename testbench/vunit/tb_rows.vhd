-- tb_rows : two blocks against vectors that VUnit's load_csv reads
--
-- A row is one edge, its inputs before its outputs, the columns in the order of
-- the ports, `rst` first: for position_counter rst, step, position; for
-- displacement, which settles instead, position, reference, delta.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library vunit_lib;
context vunit_lib.vunit_context;
use vunit_lib.integer_array_pkg.all;

entity tb_rows is
  generic (
    runner_cfg : string;
    VECTORS    : string
  );
end entity;

architecture test of tb_rows is

  signal clk  : std_logic := '0';
  signal rst  : std_logic := '0';
  signal step : std_logic_vector(1 downto 0) := "00";

  signal count     : std_logic_vector(11 downto 0);
  signal position  : std_logic_vector(11 downto 0) := (others => '0');
  signal reference : std_logic_vector(11 downto 0) := (others => '0');
  signal delta     : std_logic_vector(11 downto 0);

begin

  counter : entity work.position_counter
    port map (clk => clk, rst => rst, step => step, position => count);

  difference : entity work.displacement
    port map (position => position, reference => reference, delta => delta);

  main : process
    variable rows : integer_array_t;

    -- A cell of the table: VUnit counts columns first.
    impure function cell(row, column : natural) return integer is
    begin
      return get(rows, column, row);
    end function;
  begin
    test_runner_setup(runner, runner_cfg);

    while test_suite loop
      if run("position_counter") then
        rows := load_csv(VECTORS & "/position_counter.csv");
        check_equal(width(rows), 3, "columns");
        check(height(rows) > 0, "rows");
        for row in 0 to height(rows) - 1 loop
          rst  <= '1' when cell(row, 0) = 1 else '0';
          step <= std_logic_vector(to_signed(cell(row, 1), step'length));
          wait for 5 ns;
          clk <= '1';
          wait for 5 ns;
          check_equal(unsigned(count), cell(row, 2), "position in row " & to_string(row + 1));
          clk <= '0';
        end loop;
        info(to_string(height(rows)) & " rows agree");

      elsif run("displacement") then
        rows := load_csv(VECTORS & "/displacement.csv");
        check_equal(width(rows), 3, "columns");
        check(height(rows) > 0, "rows");
        for row in 0 to height(rows) - 1 loop
          position  <= std_logic_vector(to_unsigned(cell(row, 0), position'length));
          reference <= std_logic_vector(to_unsigned(cell(row, 1), reference'length));
          wait for 10 ns;
          check_equal(signed(delta), cell(row, 2), "delta in row " & to_string(row + 1));
        end loop;
        info(to_string(height(rows)) & " rows agree");
      end if;
    end loop;

    test_runner_cleanup(runner);
  end process;

end architecture;
