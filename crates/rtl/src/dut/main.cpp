// A design as a process that answers requests: see crates/vhpi/src/lib.rs.
//
// Beside the model, others are clocked whose unset bits have other values, until their states are the model's: from
// there on they cannot differ. An output in which one of them differs depends on a value that nobody has set. Its bits
// are unknown, and it must not drive the device.
//
// Arguments: how the registers are filled that nothing sets ("unknown", "zero" or "random"), a seed, and the
// places of the signals inside that are shown.

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdarg>
#include <cstddef>
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
// Of the model and of the first of those beside it, and of all others, which nobody hears.
static Voice voices[2], mute;
static Voice* voice = voices;

// The places of `$fatal`.
struct Place {
  const char* file;
  int line;
};
static constexpr Place FATAL[] = {@FATAL@{"", 0}};

// Whether any voice has a line.
static bool has_said = false;

static void note(char kind, const std::string& line) {
  voice->lines.push_back(kind + (" " + line));
  has_said = true;
}

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

// A model that cannot go on, as one whose logic does not come to rest. What it has said so far is lost with it.
void vl_fatal(const char* file, int line, const char*, const char* said) {
  std::fprintf(stderr, "%s:%d: %s\n", file, line, said);
  _exit(1);
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
// Whether the model keeps the time, for these or for `$time`.
constexpr bool KEEPS_TIME = TIMED || @TELLS_TIME@;
constexpr uint64_t FREQUENCY = @FREQUENCY@;
// All clocks rise at the halves of a cycle that this divides.
constexpr uint64_t COMMON = 2 * @COMMON@;
// Cycles of the fastest clock for which the reset lasts.
constexpr uint64_t SETTLE = @SETTLE@;
// How many models are clocked beside the first one, and after how many edges at most one is left.
constexpr int OTHERS = 7;
constexpr uint64_t SOON = 64;
// What the scene may say, for messages.
constexpr const char* WAY = @WAY@;
using Bits = std::vector<uint64_t>;

void put(Vdut& top, const Bits& bits) {
@PUTS@}

void get(const Vdut& top, uint64_t* bits) {
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

// A part of the design's state: its path in the design, whether it was made up for an X that the design assigns, and
// where it is.
struct Variable {
  const char* name;
  bool made_up;
  size_t at, size;
  char* of(Vdut___024root& root) const { return reinterpret_cast<char*>(&root) + at; }
  bool same(Vdut___024root& one, Vdut___024root& two) const { return std::memcmp(of(one), of(two), size) == 0; }
};

#pragma GCC diagnostic ignored "-Winvalid-offsetof"
const std::vector<Variable> VARIABLES = {
@VARIABLES@};

bool same(Vdut& one, Vdut& two) {
  for (const Variable& each : VARIABLES)
    if (!each.made_up && !each.same(*one.rootp, *two.rootp)) return false;
  return !MAKES_UP;
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
  mute.lines.clear();
  one.is_over = two.is_over = has_said = false;
  return is_over;
}

// How Verilator fills a model's unset bits.
enum Fill { ZEROS, ONES, RANDOM };

struct Model {
  Model(Fill fill, int seed, Voice* own) : own(own) {
    context->randReset(fill);
    context->randSeed(seed);
    // A model that asks for arguments (`$value$plusargs`) finds none.
    const char* program = "model";
    context->commandArgs(1, &program);
    top = std::make_unique<Vdut>(context.get(), "top");
  }
  // Simulates a design up to the begin of a half cycle, with its delays if it has some. As in the bench of GHDL, the clocks rise for the
  // first time after a whole cycle, and rest for another one where the reset ends.
  void wait(uint64_t half) {
    unsigned __int128 time = half + rested - (COMMON - 2);
    for (int digit = context->timeprecision(); digit < 0; ++digit) time *= 10;
    const uint64_t end = static_cast<uint64_t>(time / (2 * FREQUENCY));
    while (TIMED && top->eventsPending() && top->nextTimeSlot() < end) {
      context->time(top->nextTimeSlot());
      top->eval();
    }
    context->time(end);
  }
  // Verilator takes the scopes of a model out of the thread's context, which must be its own and last on.
  ~Model() {
    VerilatedContext* const before = Verilated::threadContextp();
    Verilated::threadContextp(context.get());
    top.reset();
    Verilated::threadContextp(before == context.get() ? lasting : before);
  }
  static VerilatedContext* lasting;
  // The clocks come to the second half of a cycle; then the inputs change, if they do; then the next cycle's edge.
  void cycle(const Bits& bits, bool changed, uint64_t half) {
    voice = own;
    if (KEEPS_TIME) wait(half - 1);
    levels(*top, half - 1);
    top->eval();
    if (changed) {
      put(*top, bits);
      top->eval();
    }
    if (KEEPS_TIME) wait(half);
    levels(*top, half);
    top->eval();
    // What delays bring is shown up to the end of the edge's half cycle.
    if (TIMED) wait(half + 1);
  }
  Voice* own;
  // The halves for which the clocks have rested.
  uint64_t rested = 0;
  std::unique_ptr<VerilatedContext> context = std::make_unique<VerilatedContext>();
  std::unique_ptr<Vdut> top;
};

VerilatedContext* Model::lasting = nullptr;

// The half after the reset at which the clocks last rose.
constexpr uint64_t BEGIN = COMMON - 2 + 2 * SETTLE;

// Lets a model come out of its reset. The clocks are low when it begins and when it ends, as in the bench of GHDL.
void start(Model& one, const Bits& bits) {
  voice = one.own;
  put(*one.top, bits);
  levels(*one.top, COMMON - 1);
  reset(*one.top, false);
  one.top->eval();
  if (KEEPS_TIME) one.wait(COMMON - 1);
  reset(*one.top, true);
  one.top->eval();
  for (uint64_t half = COMMON; half <= BEGIN; half += 2) one.cycle(bits, false, half);
  levels(*one.top, BEGIN + 1);
  one.top->eval();
  if (KEEPS_TIME) one.wait(BEGIN + 2);
  one.rested = 2;
  reset(*one.top, false);
  one.top->eval();
}

// A model that has not begun and differs from the first one: in every unset bit, or in those of another seed. The
// inverse alone would not do: a decoder of two lines answers alike to inverted ones.
std::unique_ptr<Model> another(int which) {
  auto made = std::make_unique<Model>(RANDOM, 1 + which, &mute);
  if (which > 1) return made;
  const Model first(RANDOM, 1, &mute), zeros(ZEROS, 1, &mute), ones(ONES, 1, &mute);
  for (const Variable& each : VARIABLES)
    for (size_t byte = 0; byte < each.size; ++byte)
      each.of(*made->top->rootp)[byte] = each.of(*first.top->rootp)[byte] ^ each.of(*zeros.top->rootp)[byte] ^
                                         each.of(*ones.top->rootp)[byte];
  return made;
}

// The inputs since the end of the reset, for as long as they fit.
struct Past {
  static constexpr size_t MOST = 1 << 22;
  Bits first, words;
  bool whole = true;
  void add(uint64_t edges, const Bits& bits) {
    whole = whole && words.size() + bits.size() < MOST;
    if (!whole) return Bits().swap(words);
    words.push_back(edges);
    words.insert(words.end(), bits.begin(), bits.end());
  }
  // An output's bits at the end of the past, where these variables began as in another model.
  uint64_t output(size_t port, const std::vector<const Variable*>& some, int which) const {
    Model one(RANDOM, 1, &mute);
    const auto other = another(which);
    for (const Variable* each : some) std::memcpy(each->of(*one.top->rootp), each->of(*other->top->rootp), each->size);
    start(one, first);
    uint64_t half = BEGIN;
    Bits bits(first);
    const size_t all = first.size();
    for (size_t at = 0; at < words.size(); at += 1 + all) {
      std::copy(words.begin() + at + 1, words.begin() + at + 1 + all, bits.begin());
      for (uint64_t edge = 0; edge < words[at]; ++edge) one.cycle(bits, edge == 0, half += 2);
    }
    get(*one.top, bits.data());
    return bits[port];
  }
};

// A least set of variables on whose first values an output depends, which has other bits in another model; empty where
// the search takes too long.
std::vector<const Variable*> culprits(const Past& past, size_t port, uint64_t word, int which) {
  if (!past.whole) return {};
  const auto begun = std::chrono::steady_clock::now();
  std::vector<const Variable*> all;
  const Model first(RANDOM, 1, &mute);
  const auto other = another(which);
  for (const Variable& each : VARIABLES)
    if (!each.same(*first.top->rootp, *other->top->rootp)) all.push_back(&each);
  // Parts are left out, half of them first and single ones last, as long as the output still differs.
  for (size_t part = (all.size() + 1) / 2; part > 0; part = part > 1 ? (part + 1) / 2 : 0)
    for (size_t at = 0; at < all.size() && all.size() > 1;) {
      if (std::chrono::steady_clock::now() - begun > std::chrono::seconds(5)) return {};
      auto left = all;
      left.erase(left.begin() + at, left.begin() + std::min(at + part, left.size()));
      if (!left.empty() && past.output(port, left, which) != word) all = left;
      else at += part;
    }
  return all;
}

[[noreturn]] void refuse(const Past& past, size_t port, uint64_t one, uint64_t two, int which) {
  std::string names, last;
  const auto found = culprits(past, port, one, which);
  for (const Variable* each : found)
    if (names.size() < 100 && each->name != last) {
      last = each->name;
      const std::string name = each->made_up ? "an X that the design assigns" : "register `" + last + "`";
      names += (names.empty() ? ": that of " : " and ") + name;
    }
  std::fprintf(stderr,
               "output `%s` depends on a value that nothing has set%s; after clock edge %llu the output is %llx or "
               "%llx. Let the reset or an initial value set it, or write %s\n",
               NAMES[port], names.c_str(), static_cast<unsigned long long>(edges), static_cast<unsigned long long>(one),
               static_cast<unsigned long long>(two), WAY);
  _exit(@UNSET@);
}

}  // namespace

// A model beside the first one, with its number and its signals inside.
struct Other {
  int which;
  std::unique_ptr<Model> model;
  std::vector<Signal> inside;
};

int main(int count, char** arguments) {
  if (count < 3) return 1;
  const std::string registers = arguments[1];
  // Verilator takes 0 for another seed every time.
  const int seed = registers == "random" ? 1 + std::strtoull(arguments[2], nullptr, 10) % 0x7ffffffe : 1;
  Model model(registers == "zero" ? ZEROS : RANDOM, seed, &voices[0]);
  Model::lasting = model.context.get();
  const auto shown = [&](const Model& of) {
    const std::vector<Signal> known = all_inside(*of.top);
    std::vector<Signal> inside;
    for (int argument = 3; argument < count; ++argument)
      inside.push_back(known.at(std::strtoul(arguments[argument], nullptr, 10)));
    return inside;
  };
  const std::vector<Signal> inside = shown(model);
  const size_t all = PORTS + inside.size();
  uint64_t told = 0;
  if (!take(&told, 1) || told != all) return 1;
  Bits drives(all), bits(all), now(all), before(all), other(all), differing(all), request(2 + all);
  if (!take(drives.data(), all) || !take(bits.data(), all)) return 1;
  // One of the others has all bits inverted.
  std::vector<Other> others;
  for (int which = 1; registers == "unknown" && which <= OTHERS; ++which) {
    auto made = another(which);
    auto signals = shown(*made);
    others.push_back({which, std::move(made), std::move(signals)});
    others.front().model->own = &voices[1];
    start(*others.back().model, bits);
  }
  start(model, bits);
  bool is_over = has_said && speak(!others.empty());
  uint64_t half = BEGIN, look = 1;
  Past past;
  past.first = bits;

  const auto is_told = [&](size_t port) { return port >= PORTS || OUTPUTS[port]; };
  // The model in which an output differs, if one does: now, and when it was last told.
  std::vector<int> differs(all, 0), was(all, 0);
  const auto read = [&](const Model& one, const std::vector<Signal>& signals, Bits& to, size_t end) {
    get(*one.top, to.data());
    if (end > PORTS)
      for (size_t signal = 0; signal < signals.size(); ++signal) to[PORTS + signal] = signals[signal].read();
  };
  const auto look_at = [&](size_t end) {
    read(model, inside, now, end);
    if (others.empty()) return;
    std::fill(differs.begin(), differs.end(), 0);
    for (const Other& each : others) {
      read(*each.model, each.inside, other, end);
      for (size_t port = 0; port < end; ++port)
        if (is_told(port) && now[port] != other[port]) {
          differs[port] = each.which;
          differing[port] = other[port];
        }
    }
  };
  look_at(all);
  std::vector<uint64_t> answer{0, 0, 0};
  for (size_t port = 0; port < all; ++port)
    if (is_told(port)) {
      was[port] = differs[port];
      answer.insert(answer.end(), {0, port, now[port], differs[port] == 0});
    }
  before = now;
  // The bits that are asked for: of the outputs that drive, and of all. Once nothing is unknown, they alone can have
  // news.
  Bits masks[2] = {Bits(PORTS), Bits(PORTS)};
  for (size_t port = 0; port < PORTS; ++port) {
    masks[1][port] = is_told(port) ? ~uint64_t{0} : 0;
    masks[0][port] = drives[port] != 0 ? masks[1][port] : 0;
  }
  bool is_settled = others.empty();
  const auto has_news = [now = now.data(), before = before.data()](const uint64_t* mask) {
    uint64_t news = 0;
    for (size_t port = 0; port < PORTS; ++port) news |= (now[port] ^ before[port]) & mask[port];
    return news != 0;
  };
  for (;;) {
    answer[1] = (answer.size() - 3) / 4;
    answer[2] = is_over;
    std::fflush(stdout);
    if (!tell(answer)) return 0;
    if (!take(request.data(), request.size())) return 0;
    // What is asked for: 0 outputs that drive, 1 all outputs, 2 also signals inside.
    const uint64_t wanted = request[0], asked = request[1];
    const size_t end = asked == 2 ? all : PORTS;
    bool fresh = !std::equal(bits.begin(), bits.end(), request.begin() + 2);
    std::copy(request.begin() + 2, request.end(), bits.begin());
    uint64_t done = 0;
    answer.assign(3, 0);
    for (bool changed = false; !changed && !is_over && done < wanted;) {
      const uint64_t* const mask = asked < 2 ? masks[asked].data() : nullptr;
      bool is_fresh;
      do {
        ++done;
        ++edges;
        half += 2;
        is_fresh = std::exchange(fresh, false);
        model.cycle(bits, is_fresh, half);
        get(*model.top, now.data());
      } while (is_settled && mask && done < wanted && !has_said && !has_news(mask));
      for (const Other& each : others) each.model->cycle(bits, is_fresh, half);
      // Alone, the model has been read already, up to its ports.
      if (!is_settled || end > PORTS) look_at(end);
      if (has_said) is_over = speak(!others.empty());
      for (size_t port = 0; port < end; ++port) {
        if (!is_told(port)) continue;
        if (differs[port] != 0 && drives[port] != 0) {
          past.add(done, bits);
          refuse(past, port, now[port], differing[port], differs[port]);
        }
        const bool is_same = now[port] == before[port] && (differs[port] == 0) == (was[port] == 0);
        if (is_same || (asked == 0 && drives[port] == 0)) continue;
        // A word that is not told stays new for the request that asks for it.
        before[port] = now[port];
        was[port] = differs[port];
        changed |= drives[port] != 0;
        answer.insert(answer.end(), {done, port, now[port], differs[port] == 0});
      }
      is_settled = others.empty();
      if (!others.empty() && edges >= look) {
        look = edges + (edges < 4096 ? edges : 4096);
        const auto is_same = [&](const Other& each) { return same(*model.top, *each.model->top); };
        others.erase(std::remove_if(others.begin(), others.end(), is_same), others.end());
        // Most of what is not set shows soon, and one more model halves the speed.
        if (edges >= SOON && others.size() > 1) others.erase(others.begin() + 1, others.end());
        if (others.empty()) std::fill(differs.begin(), differs.end(), 0);
        else others.front().model->own = &voices[1];
      }
    }
    answer[0] = done;
    if (!others.empty()) past.add(done, bits);
  }
}
