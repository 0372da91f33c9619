// time EDGES REFERENCE STIFFNESS DAMPING PERIOD SCALE: the closed loop in Verilator, nothing recorded.

#include "Vhybrid_loop.h"
#include "model.hpp"
#include "plant.hpp"

int main(int argc, char** argv) {
  if (argc != 7) return 2;
  const uint64_t edges = std::strtoull(argv[1], nullptr, 10);
  Vhybrid_loop top;
  Plant<double> plant;
  start(top, argv + 2);
  for (uint64_t edge = 1; edge <= edges; ++edge) {
    plant.flow();
    top.a_pin = plant.a();
    top.b_pin = plant.b();
    clock(top);
    plant.drive(top.a_high, top.a_low, top.b_high, top.b_low);
  }
}
