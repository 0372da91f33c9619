// trace EDGES REFERENCE STIFFNESS DAMPING PERIOD SCALE WORLD: every net of the loop in Verilator, a line for each edge
// after which any has changed. WORLD is f64 or extended, the plant stepped in double or long double, or a trace, whose
// pins are replayed.

#include <array>
#include <cstdio>
#include <fstream>
#include <string>

#include "Vhybrid_nets.h"
#include "model.hpp"
#include "plant.hpp"

namespace {

using Words = std::array<uint32_t, 24>;

Words nets(const Vhybrid_nets& top) {
  return {top.a_pin, top.b_pin, top.__SYM__reference, top.stiffness, top.damping, top.period, top.scale, top.a_high,
          top.a_low, top.b_high, top.b_low, top.a, top.b, top.step, top.error, top.position, top.delta, top.contact,
          top.penetration, top.spring, top.velocity, top.drag, top.torque, top.command};
}

// The pins at each edge, of the lines of a trace; what is driven changes nothing.
class Replay {
 public:
  explicit Replay(const char* path) : lines_(path) {
    std::string header;
    std::getline(lines_, header);
    read();
  }

  void flow() {
    ++edge_;
    while (more_ && next_edge_ <= edge_) {
      a_ = next_a_;
      b_ = next_b_;
      read();
    }
  }

  void drive(bool, bool, bool, bool) {}
  bool a() const { return a_; }
  bool b() const { return b_; }

 private:
  void read() {
    std::string line;
    more_ = std::getline(lines_, line) && std::sscanf(line.c_str(), "%llu,%d,%d", &next_edge_, &next_a_, &next_b_) == 3;
  }

  std::ifstream lines_;
  unsigned long long edge_ = 0, next_edge_ = 0;
  int a_ = 0, b_ = 0, next_a_ = 0, next_b_ = 0;
  bool more_ = false;
};

template <class World>
void show(World world, char** arguments) {
  const uint64_t edges = std::strtoull(arguments[1], nullptr, 10);
  Vhybrid_nets top;
  Words shown{};
  start(top, arguments + 2);
  for (uint64_t edge = 1; edge <= edges; ++edge) {
    world.flow();
    top.a_pin = world.a();
    top.b_pin = world.b();
    clock(top);
    world.drive(top.a_high, top.a_low, top.b_high, top.b_low);
    const Words now = nets(top);
    if (now == shown) continue;
    shown = now;
    std::printf("%llu", static_cast<unsigned long long>(edge));
    for (uint32_t word : now) std::printf(",%u", word);
    std::putchar('\n');
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 8) return 2;
  const std::string world = argv[7];
  if (world == "f64") {
    show(Plant<double>(), argv);
  } else if (world == "extended") {
    show(Plant<long double>(), argv);
  } else {
    show(Replay(argv[7]), argv);
  }
}
