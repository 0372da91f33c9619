-- hpu_plant : the plant of a scene in a testbench of one's own, in GHDL
--
-- The functions of hpu_sim.c, called through VHPIDIRECT. GHDL looks for the shared
-- library where the system does (LD_LIBRARY_PATH); its LLVM back end links it, from
-- the folder where it elaborates:
--
--   cc -shared -fPIC -I<include> -o libhpu_sim.so hpu_sim.c -L<library> -lhpu
--
-- Texts end with NUL. A result below 0 is the status code of hpu.h, negated.

package hpu_plant is

  -- What hpu_step returns at the end of the scene.
  constant HPU_END : integer := -5;

  -- Opens the plant of a scene: its name or path, then KEY=VALUE, each after a semicolon.
  impure function hpu_open(text : string) return integer;

  -- Drives the four gates of a bridge (a_high in bit 3 to b_low in bit 0), moves on by a clock edge, and
  -- returns the encoder's lines there: A in bit 1, B in bit 0.
  impure function hpu_step(plant : integer; gates : integer) return integer;
  attribute foreign of hpu_step : function is "VHPIDIRECT libhpu_sim.so hpu_sim_step";

  -- The index of an output by its name, for hpu_set.
  impure function hpu_output(plant : integer; name : string) return integer;

  -- Sets an output by its index from the present edge on: a gate, a duty, a force, a command.
  impure function hpu_set(plant : integer; output : integer; word : integer) return integer;
  attribute foreign of hpu_set : function is "VHPIDIRECT libhpu_sim.so hpu_sim_set";

  -- Moves on by this number of clock edges. HPU_END at the end.
  impure function hpu_advance(plant : integer; edges : integer) return integer;
  attribute foreign of hpu_advance : function is "VHPIDIRECT libhpu_sim.so hpu_sim_advance";

  -- The word of an input, such as the wall's stiffness.
  impure function hpu_input(plant : integer; name : string) return integer;

  -- A state in SI units, such as angle_rad.
  impure function hpu_state(plant : integer; name : string) return real;

  -- Closes the plant.
  impure function hpu_close(plant : integer) return integer;
  attribute foreign of hpu_close : function is "VHPIDIRECT libhpu_sim.so hpu_sim_close";

  -- A text of a fixed length is a plain pointer for the foreign function.
  subtype long_text is string(1 to 4096);
  impure function hpu_sim_open(text : long_text) return integer;
  attribute foreign of hpu_sim_open : function is "VHPIDIRECT libhpu_sim.so hpu_sim_open";
  impure function hpu_sim_output(plant : integer; name : long_text) return integer;
  attribute foreign of hpu_sim_output : function is "VHPIDIRECT libhpu_sim.so hpu_sim_output";
  impure function hpu_sim_input(plant : integer; name : long_text) return integer;
  attribute foreign of hpu_sim_input : function is "VHPIDIRECT libhpu_sim.so hpu_sim_input";
  impure function hpu_sim_state(plant : integer; name : long_text) return real;
  attribute foreign of hpu_sim_state : function is "VHPIDIRECT libhpu_sim.so hpu_sim_state";

end package;

package body hpu_plant is

  function ended(text : string) return long_text is
    variable padded : long_text := (others => NUL);
  begin
    padded(1 to text'length) := text;
    return padded;
  end function;

  impure function hpu_open(text : string) return integer is
  begin
    return hpu_sim_open(ended(text));
  end function;

  impure function hpu_step(plant : integer; gates : integer) return integer is
  begin
    report "libhpu_sim.so is called instead" severity failure;
    return 0;
  end function;

  impure function hpu_output(plant : integer; name : string) return integer is
  begin
    return hpu_sim_output(plant, ended(name));
  end function;

  impure function hpu_set(plant : integer; output : integer; word : integer) return integer is
  begin
    report "libhpu_sim.so is called instead" severity failure;
    return 0;
  end function;

  impure function hpu_advance(plant : integer; edges : integer) return integer is
  begin
    report "libhpu_sim.so is called instead" severity failure;
    return 0;
  end function;

  impure function hpu_input(plant : integer; name : string) return integer is
  begin
    return hpu_sim_input(plant, ended(name));
  end function;

  impure function hpu_state(plant : integer; name : string) return real is
  begin
    return hpu_sim_state(plant, ended(name));
  end function;

  impure function hpu_close(plant : integer) return integer is
  begin
    report "libhpu_sim.so is called instead" severity failure;
    return 0;
  end function;

  impure function hpu_sim_open(text : long_text) return integer is
  begin
    report "libhpu_sim.so is called instead" severity failure;
    return 0;
  end function;

  impure function hpu_sim_output(plant : integer; name : long_text) return integer is
  begin
    report "libhpu_sim.so is called instead" severity failure;
    return 0;
  end function;

  impure function hpu_sim_input(plant : integer; name : long_text) return integer is
  begin
    report "libhpu_sim.so is called instead" severity failure;
    return 0;
  end function;

  impure function hpu_sim_state(plant : integer; name : long_text) return real is
  begin
    report "libhpu_sim.so is called instead" severity failure;
    return 0.0;
  end function;

end package body;
