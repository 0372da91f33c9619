-- push_tb : pushes the handle of rail-drop by its amplifier's command, and tells where it is

use std.textio.all;
use work.hpu_plant.all;

entity push_tb is
end entity;

architecture test of push_tb is
begin

  process
    variable plant, status : integer;
    variable row           : line;
  begin
    plant := hpu_open("rail-drop;run.duration=20 ms");
    assert plant > 0 report "the scene is refused" severity failure;
    status := hpu_set(plant, hpu_output(plant, "command"), 300);
    assert status = 0 report "the command is refused" severity failure;
    assert hpu_output(plant, "a_high") < 0 report "an amplifier has no gates" severity failure;
    status := hpu_advance(plant, 100000);
    assert status = 0 report "the plant ends before 100000 clocks" severity failure;
    write(row, "position_m " & to_string(hpu_state(plant, "position_m"), "%.17g"));
    writeline(output, row);
    status := hpu_advance(plant, 2000000000);
    assert status = HPU_END report "the scene goes on beyond its end" severity failure;
    assert hpu_close(plant) = 0 report "the plant is not open" severity failure;
    wait;
  end process;

end architecture;
