// What a Verilated loop needs, whichever of its two forms it has.
#pragma once

#include <cstdlib>

template <class Model>
void clock(Model& top) {
  top.clk = 1;
  top.eval();
  top.clk = 0;
  top.eval();
}

// The words that stay, from the command line, and one edge of reset.
template <class Model>
void start(Model& top, char** words) {
  top.__SYM__reference = std::atoi(words[0]);
  top.stiffness = std::atoi(words[1]);
  top.damping = std::atoi(words[2]);
  top.period = std::atoi(words[3]);
  top.scale = std::atoi(words[4]);
  top.rst = 1;
  clock(top);
  top.rst = 0;
}
