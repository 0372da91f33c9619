-- Nothing is wrong here: the package that order_b.vhd needs; compile this first.
library ieee;
use ieee.std_logic_1164.all;

package order_pkg is
  constant PERIOD : positive := 16;
  subtype tick is natural range 0 to PERIOD - 1;
end package order_pkg;
