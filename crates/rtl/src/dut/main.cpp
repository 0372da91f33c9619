// A design as a process that answers requests: see crates/vhpi/src/lib.rs.
//
// Two models are clocked side by side, whose unknown values were made up differently, until their states are the same:
// from there on they cannot differ. An output in which they differ depends on a value that nobody has set.

#include <algorithm>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <memory>
#include <sched.h>
#include <string>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>
#include <vector>

#include "Vdut.h"
#include "Vdut___024root.h"
#include "verilated.h"

// Edges clocked so far.
static uint64_t edges = 0;

// What a model says at this edge, a line each. Its first character tells what it is: see crates/rtl/src/dut/said.
struct Voice {
  std::string text;
  std::vector<std::string> lines;
  bool has_failed = false, is_over = false;
};
static Voice voices[2];
static Voice* voice = voices;

// The places of `$fatal`.
struct Place {
  const char* file;
  int line;
};
static constexpr Place FATAL[] = {@FATAL@{"", 0}};

static void note(char kind, const std::string& line) { voice->lines.push_back(kind + (" " + line)); }

static std::string at(const char* file, int line) { return std::string(file) + ":" + std::to_string(line); }

// The functions of Verilator that print and that end the simulation are replaced by these.
int hpu_print(const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  char* text = nullptr;
  const int length = vasprintf(&text, format, arguments);
  va_end(arguments);
  if (length < 0) return length;
  voice->has_failed = std::strstr(text, "%Error: ") != nullptr;
  voice->text.append(text, length);
  std::free(text);
  size_t begin = 0;
  for (size_t end; (end = voice->text.find('\n', begin)) != std::string::npos; begin = end + 1)
    note('=', voice->text.substr(begin, end - begin));
  voice->text.erase(0, begin);
  if (voice->text.size() > 4096) voice->text.clear();
  return length;
}

void vl_finish(const char* file, int line, const char*) {
  note('E', "$finish " + at(file, line));
  voice->is_over = true;
}

// After the message of an assertion, `$error` or `$fatal`, and for `$stop`.
void vl_stop_maybe(const char* file, int line, const char*, bool) {
  if (std::exchange(voice->has_failed, false)) {
    const char* slash = std::strrchr(file, '/');
    const char* name = slash ? slash + 1 : file;
    const auto is_here = [&](const Place& place) { return place.line == line && std::strcmp(place.file, name) == 0; };
    if (std::none_of(std::begin(FATAL), std::end(FATAL), is_here)) return;
    note('F', at(file, line));
  } else {
    note('E', "$stop " + at(file, line));
  }
  voice->is_over = true;
}

// A warning of Verilator's own library. It would go on without a memory's file, with values that nothing has set.
void vl_warn(const char* file, int line, const char*, const char* said) {
  if (std::strstr(said, "file not found")) {
    std::fprintf(stderr, "the design reads `%s` ($readmem), and no such file is beside its files\n", file);
    _exit(1);
  }
  std::fprintf(stderr, "%s:%d: %s\n", file, line, said);
}

namespace {

constexpr int DESCRIPTOR = 3;
// How often the parent is looked for without sleeping.
constexpr int SPINS = 100;
// The ports without clocks and reset. Signals inside are numbered after them.
constexpr size_t PORTS = @PORTS@;
constexpr const char* NAMES[] = {@NAMES@};
constexpr bool OUTPUTS[] = {@OUTPUTS@};
constexpr bool MAKES_UP = @MAKES_UP@;
// Whether the design waits for times of its own, and the frequency of its fastest clock in Hz.
constexpr bool TIMED = @TIMED@;
constexpr uint64_t FREQUENCY = @FREQUENCY@;
// All clocks rise at the halves of a cycle that this divides.
constexpr uint64_t COMMON = 2 * @COMMON@;
using Bits = std::vector<uint64_t>;

void put(Vdut& top, const Bits& bits) {
@PUTS@}

void get(const Vdut& top, Bits& bits) {
@GETS@}

// A signal inside: its place and its bytes.
struct Signal {
  const void* at;
  size_t bytes;

  uint64_t read() const {
    switch (bytes) {
      case 1: return *static_cast<const CData*>(at);
      case 2: return *static_cast<const SData*>(at);
      case 4: return *static_cast<const IData*>(at);
      default: return *static_cast<const QData*>(at);
    }
  }
};

std::vector<Signal> all_inside([[maybe_unused]] const Vdut& top) {
  return {
@INSIDE@  };
}

void levels(Vdut& top, uint64_t half) {
@LEVELS@}

void reset(Vdut& top, bool active) {
@RESETS@}

bool same(const Vdut___024root& one, const Vdut___024root& two) {
@SAME@  return !MAKES_UP;
}

// The parent's end, or nobody's any more.
bool take(uint64_t* words, size_t count) {
  char* to = reinterpret_cast<char*>(words);
  size_t left = count * sizeof(uint64_t);
  // To sleep and to be woken takes longer than the parent mostly needs.
  for (int turn = 0; left != 0;) {
    const ssize_t got = recv(DESCRIPTOR, to, left, turn < SPINS ? MSG_DONTWAIT : 0);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) {
      ++turn;
      sched_yield();
      continue;
    }
    if (got <= 0) return false;
    to += got;
    left -= got;
  }
  return true;
}

bool tell(const std::vector<uint64_t>& words) {
  const char* from = reinterpret_cast<const char*>(words.data());
  size_t left = words.size() * sizeof(uint64_t);
  while (left != 0) {
    const ssize_t put = write(DESCRIPTOR, from, left);
    if (put <= 0) return false;
    from += put;
    left -= put;
  }
  return true;
}

// What a line is about where it is a failure: its place. Where it is none, nothing.
std::string failure(const std::string& line) {
  const size_t begin = std::min(line.find("%Error: "), line.find("%Fatal: "));
  return begin == std::string::npos ? "" : line.substr(begin, line.find(": ", begin + 8) - begin);
}

// Writes out what was said at this edge. A failure of only one of two models depends on a value that nothing has set.
// Returns whether the design has ended the run.
bool speak(bool has_twin) {
  auto& [one, two] = voices;
  const auto is_of = [](const Voice& voice, const std::string& line) {
    const auto same = [&](const std::string& other) { return failure(other) == failure(line); };
    return std::any_of(voice.lines.begin(), voice.lines.end(), same);
  };
  const auto tell = [](char kind, const std::string& line) {
    std::printf("%llu %c%s\n", static_cast<unsigned long long>(edges), kind, line.c_str() + 1);
  };
  for (const std::string& line : one.lines)
    tell(has_twin && !failure(line).empty() && !is_of(two, line) ? '?' : line[0], line);
  for (const std::string& line : two.lines)
    if (line[0] != '=' && !one.is_over && edges != 0)
      tell(line[0], line);
    else if (!failure(line).empty() && !is_of(one, line))
      tell('?', line);
  // Before the end of the reset, values that nothing has set mean nothing.
  const bool is_over = edges == 0 && has_twin ? one.is_over && two.is_over : one.is_over || two.is_over;
  one.lines.clear();
  two.lines.clear();
  one.is_over = two.is_over = false;
  return is_over;
}

bool has_said() { return !voices[0].lines.empty() || !voices[1].lines.empty(); }

struct Model {
  Model(int seed, Voice* own) : own(own) {
    context->randReset(2);
    context->randSeed(seed);
    top = std::make_unique<Vdut>(context.get(), "top");
  }
  // Simulates a design with delays up to the begin of a half cycle. The first one begins before all clocks rise.
  void wait(uint64_t half) {
    unsigned __int128 time = half - (COMMON - 1);
    for (int digit = context->timeprecision(); digit < 0; ++digit) time *= 10;
    const uint64_t end = static_cast<uint64_t>(time / (2 * FREQUENCY));
    while (top->eventsPending() && top->nextTimeSlot() < end) {
      context->time(top->nextTimeSlot());
      top->eval();
    }
    context->time(end);
  }
  // The inputs, while the clocks come to the second half of a cycle, and the edge of the next one.
  void cycle(const Bits& bits, uint64_t half) {
    voice = own;
    if (TIMED) {
      // What the edge and the rest of its cycle bring is shown before the next edge.
      wait(half);
      put(*top, bits);
      levels(*top, half);
      top->eval();
      wait(half + 1);
      levels(*top, half + 1);
      top->eval();
      wait(half + 2);
      return;
    }
    put(*top, bits);
    levels(*top, half - 1);
    top->eval();
    levels(*top, half);
    top->eval();
    context->timeInc(2);
  }
  Voice* own;
  std::unique_ptr<VerilatedContext> context = std::make_unique<VerilatedContext>();
  std::unique_ptr<Vdut> top;
};

}  // namespace

// The arguments are the places of the signals inside that are shown.
int main(int count, char** arguments) {
  Model model(1, &voices[0]);
  const std::vector<Signal> known = all_inside(*model.top);
  std::vector<Signal> inside;
  for (int argument = 1; argument < count; ++argument)
    inside.push_back(known.at(std::strtoul(arguments[argument], nullptr, 10)));
  const size_t all = PORTS + inside.size();
  uint64_t told = 0;
  if (!take(&told, 1) || told != all) return 1;
  Bits drives(all), bits(all), now(all), before(all), other(all), request(2 + all);
  if (!take(drives.data(), all) || !take(bits.data(), all)) return 1;
  auto twin = std::make_unique<Model>(2, &voices[1]);
  uint64_t half = COMMON - 2, look = 1;

  auto initial = [&](Model& one) {
    voice = one.own;
    put(*one.top, bits);
    reset(*one.top, true);
    levels(*one.top, COMMON - 1);
    one.top->eval();
  };
  initial(model);
  initial(*twin);
  bool is_over = has_said() && speak(true);
  for (uint64_t cycle = 0; cycle < @SETTLE@ && !is_over; ++cycle) {
    half += 2;
    model.cycle(bits, half);
    twin->cycle(bits, half);
    is_over = has_said() && speak(true);
  }
  reset(*model.top, false);
  reset(*twin->top, false);
  const auto get_inside = [&] {
    for (size_t signal = 0; signal < inside.size(); ++signal) now[PORTS + signal] = inside[signal].read();
  };
  const auto is_told = [&](size_t port) { return port >= PORTS || OUTPUTS[port]; };
  get(*model.top, now);
  get_inside();

  std::vector<uint64_t> answer{0, 0, 0};
  for (size_t port = 0; port < all; ++port)
    if (is_told(port)) answer.insert(answer.end(), {0, port, now[port], 1});
  before = now;
  for (;;) {
    answer[1] = (answer.size() - 3) / 4;
    answer[2] = is_over;
    std::fflush(stdout);
    if (!tell(answer)) return 0;
    if (!take(request.data(), request.size())) return 0;
    // What is asked for: 0 outputs that drive, 1 all outputs, 2 also signals inside.
    const uint64_t wanted = request[0], asked = request[1];
    const size_t end = asked == 2 ? all : PORTS;
    std::copy(request.begin() + 2, request.end(), bits.begin());
    uint64_t done = 0;
    answer.assign(3, 0);
    for (bool changed = false; !changed && !is_over && done < wanted;) {
      ++done;
      ++edges;
      half += 2;
      model.cycle(bits, half);
      get(*model.top, now);
      if (asked == 2) get_inside();
      if (twin) {
        twin->cycle(bits, half);
        get(*twin->top, other);
        for (size_t port = 0; port < PORTS; ++port)
          if (OUTPUTS[port] && now[port] != other[port]) {
            std::fprintf(stderr,
                         "output `%s` depends on a value that nothing has set: with two random initial states it is "
                         "%llx and %llx after clock edge %llu\n",
                         NAMES[port], static_cast<unsigned long long>(now[port]),
                         static_cast<unsigned long long>(other[port]), static_cast<unsigned long long>(edges));
            _exit(1);
          }
        if (edges >= look) {
          look = edges + (edges < 4096 ? edges : 4096);
          if (same(*model.top->rootp, *twin->top->rootp)) twin.reset();
        }
      }
      if (has_said()) is_over = speak(twin != nullptr);
      for (size_t port = 0; port < end; ++port) {
        if (now[port] == before[port] || !is_told(port) || (asked == 0 && drives[port] == 0)) continue;
        // A word that is not told stays new for the request that asks for it.
        before[port] = now[port];
        changed |= drives[port] != 0;
        answer.insert(answer.end(), {done, port, now[port], 1});
      }
    }
    answer[0] = done;
  }
}
