// The plant for bench.vhd: one edge a call, gates in, pins out.

#include "plant.hpp"

extern "C" int32_t plant_edge(int32_t gates) {
  static Plant<double> plant;
  plant.drive(gates & 1, gates & 2, gates & 4, gates & 8);
  plant.flow();
  return plant.a() + 2 * plant.b();
}
