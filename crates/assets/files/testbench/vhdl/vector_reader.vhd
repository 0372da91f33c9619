-- vector_reader : reads golden vectors and keeps the score of a testbench
--
-- A vector file is text: line 1 is the format line, every further line is one
-- row of hex words (inputs, then expected outputs), the last line counts rows.
--
--   # position_counter in rst(0,1,0) step(1,1,0) out position(0,12,0) generics WIDTH=12
--   1 0 000
--   0 3 fff
--   # end 2 rows
--
-- Ends with one line for programs to read: RESULT rows=<n> mismatches=<n>
-- A stale or cut file stops the simulation with a failure instead.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library std;
use std.textio.all;

package vector_reader is

  -- The three numbers of a word format (S,I,F).
  type word_format is array (0 to 2) of integer;

  -- Format of a port, as the format line has it.
  impure function format_of(format_line : string; port_name : string) return word_format;

  -- Bits of a port.
  impure function bits(format_line : string; port_name : string) return positive;

  type vector_file is protected
    -- Opens a file whose line 1 must be exactly this.
    procedure open_set(path : string; format_line : string);
    -- Goes to the next row; false after the last.
    impure function next_row return boolean;
    -- Takes the row's next word.
    impure function word(width : positive) return std_logic_vector;
    impure function word return std_logic;
    -- Takes the row's next word and holds an output against it.
    procedure check(name : string; got : std_logic_vector);
    procedure check(name : string; got : std_logic);
    -- Writes the result.
    procedure finish;
  end protected;

end package;

package body vector_reader is

  impure function format_of(format_line : string; port_name : string) return word_format is
    constant KEY    : string := " " & port_name & "(";
    variable result : word_format := (others => 0);
    variable field  : natural := 0;
    variable sign   : integer := 1;
  begin
    for i in format_line'low to format_line'high - KEY'length loop
      if format_line(i to i + KEY'length - 1) = KEY then
        for k in i + KEY'length to format_line'high loop
          case format_line(k) is
            when ')' =>
              result(field) := sign * result(field);
              return result;
            when ',' =>
              result(field) := sign * result(field);
              sign  := 1;
              field := field + 1;
            when '-' =>
              sign := -1;
            when others =>
              result(field) := 10 * result(field) + character'pos(format_line(k)) - character'pos('0');
          end case;
        end loop;
      end if;
    end loop;
    report "no port " & port_name & " in " & format_line severity failure;
    return result;
  end function;

  impure function bits(format_line : string; port_name : string) return positive is
    constant FORMAT : word_format := format_of(format_line, port_name);
  begin
    return FORMAT(0) + FORMAT(1) + FORMAT(2);
  end function;

  -- The bits, and the value they stand for where an integer holds it.
  impure function shown(format : word_format; word : std_logic_vector) return string is
    variable value : integer;
  begin
    if is_x(word) or word'length > 31 then
      return to_string(word);
    elsif format(0) = 1 then
      value := to_integer(signed(word));
    else
      value := to_integer(unsigned(word));
    end if;
    if format(2) = 0 then
      return to_string(word) & " (" & integer'image(value) & ")";
    end if;
    return to_string(word) & " (" & to_string(real(value) / 2.0**format(2), 6) & ")";
  end function;

  -- Hex digits in lower case, as vector files have them; unknown digits stay upper.
  function hex(word : std_logic_vector) return string is
    variable text : string(1 to (word'length + 3) / 4) := to_hstring(word);
  begin
    for i in text'range loop
      if text(i) >= 'A' and text(i) <= 'F' then
        text(i) := character'val(character'pos(text(i)) + 32);
      end if;
    end loop;
    return text;
  end function;

  type vector_file is protected body

    constant KEPT     : positive := 64;  -- rows that are told up to the first mismatch
    constant FOLLOWED : natural := 64;   -- and after it

    type line_array is array (0 to KEPT - 1) of line;

    file     source      : text;
    variable header      : line;
    variable current     : line;
    variable unread      : line;
    variable got_words   : line;
    variable history     : line_array;
    variable rows        : natural := 0;
    variable mismatches  : natural := 0;
    variable in_history  : boolean := false;  -- the first mismatch is in this row
    variable to_tell     : natural := 0;      -- rows after it that are still to be told

    procedure put(text : string) is
      variable message : line;
    begin
      write(message, text);
      writeline(output, message);
    end procedure;

    -- Closes the row: into the history, which is told once, after the row with the first mismatch;
    -- the rows after that are told as they come.
    procedure keep_row is
    begin
      deallocate(history(rows mod KEPT));
      history(rows mod KEPT) :=
        new string'("HISTORY row=" & integer'image(rows) & " " & current.all & " got" & got_words.all);
      if in_history then
        for i in maximum(rows - KEPT + 1, 1) to rows loop
          put(history(i mod KEPT).all);
        end loop;
        in_history := false;
        to_tell := FOLLOWED;
      elsif to_tell > 0 then
        put(history(rows mod KEPT).all);
        to_tell := to_tell - 1;
      end if;
    end procedure;

    procedure open_set(path : string; format_line : string) is
    begin
      file_open(source, path, read_mode);
      header := new string'(format_line);
      got_words := new string'("");
      if endfile(source) then
        report path & " is empty" severity failure;
      end if;
      readline(source, current);
      if current.all /= format_line then
        report path & ":1: stale vectors; expected `" & format_line & "`, found `" & current.all
          & "`; refresh them with `hpu vectors --update`" severity failure;
      end if;
    end procedure;

    impure function next_row return boolean is
    begin
      if rows > 0 then
        keep_row;
      end if;
      if endfile(source) then
        report "vectors cut after row " & integer'image(rows) severity failure;
        return false;
      end if;
      deallocate(current);
      readline(source, current);
      if current'length > 0 and current(current'left) = '#' then
        if current.all /= "# end " & integer'image(rows) & " rows" then
          report integer'image(rows) & " rows read, but the file ends with `" & current.all & "`" severity failure;
        end if;
        return false;
      end if;
      deallocate(unread);
      unread := new string'(current.all);
      deallocate(got_words);
      got_words := new string'("");
      rows := rows + 1;
      return true;
    end function;

    impure function word(width : positive) return std_logic_vector is
      variable result : std_logic_vector(width - 1 downto 0);
      variable good   : boolean;
    begin
      hread(unread, result, good);
      if not good then
        report "row " & integer'image(rows) & ": `" & current.all & "` is not a row of `" & header.all & "`"
          severity failure;
      end if;
      return result;
    end function;

    impure function word return std_logic is
      constant RESULT : std_logic_vector(0 downto 0) := word(1);
    begin
      return RESULT(0);
    end function;

    procedure check(name : string; got : std_logic_vector) is
      constant EXPECTED : std_logic_vector(got'length - 1 downto 0) := word(got'length);
      variable longer   : line;
    begin
      longer := new string'(got_words.all & " " & hex(got));
      deallocate(got_words);
      got_words := longer;
      if got /= EXPECTED then
        if mismatches = 0 then
          put("MISMATCH row=" & integer'image(rows) & " signal=" & name
            & " expected=" & shown(format_of(header.all, name), EXPECTED)
            & " got=" & shown(format_of(header.all, name), got));
          in_history := true;
        end if;
        mismatches := mismatches + 1;
      end if;
    end procedure;

    procedure check(name : string; got : std_logic) is
      constant WORD_GOT : std_logic_vector(0 downto 0) := (0 => got);
    begin
      check(name, WORD_GOT);
    end procedure;

    procedure finish is
    begin
      put("RESULT rows=" & integer'image(rows) & " mismatches=" & integer'image(mismatches));
      file_close(source);
    end procedure;

  end protected body;

end package body;
