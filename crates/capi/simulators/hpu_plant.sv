// hpu_plant: the plant of a scene in a testbench of one's own, by DPI-C. The functions are in hpu_sim.c.
package hpu_plant;

  // What hpu_sim_step returns at the end of the scene; any other result below 0 is a status code of hpu.h, negated.
  localparam int HPU_END = -5;

  // Opens the plant of a scene: its name or path, then KEY=VALUE, each after a semicolon.
  import "DPI-C" function int hpu_sim_open(input string text);

  // Drives the four gates of a bridge {a_high, a_low, b_high, b_low}, moves on by a clock edge, and returns the
  // encoder's lines {A, B}.
  import "DPI-C" function int hpu_sim_step(input int plant, input int gates);

  // The index of an output by its name, for hpu_sim_set.
  import "DPI-C" function int hpu_sim_output(input int plant, input string name);

  // Sets an output by its index from the present edge on: a gate, a duty, a force, a command.
  import "DPI-C" function int hpu_sim_set(input int plant, input int output_index, input int word);

  // Moves on by this number of clock edges. HPU_END at the end.
  import "DPI-C" function int hpu_sim_advance(input int plant, input int edges);

  // For how many clock edges the lines and all other inputs keep their words if the outputs keep theirs. A testbench
  // that counts them need not call the plant meanwhile; hpu_sim_advance then moves it on by the edges counted.
  import "DPI-C" function int hpu_sim_quiet(input int plant);

  // The word of an input, such as the wall's stiffness.
  import "DPI-C" function int hpu_sim_input(input int plant, input string name);

  // A state in SI units, such as angle_rad.
  import "DPI-C" function real hpu_sim_state(input int plant, input string name);

  // Closes the plant.
  import "DPI-C" function int hpu_sim_close(input int plant);

endpackage
