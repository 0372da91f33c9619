// The device and the hand of the scene hybrid-wall, stepped by one clock edge at a time.
//
// As one writes it beside Verilator: between two edges the motor is a linear system with constant input, so that one
// edge is x += (e^{A dt} - I) x, exact but for the rounding of Real, which gathers.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

template <class Real>
class Plant {
 public:
  Plant() {
    for (bool driven : {false, true}) step_[driven] = one_edge(driven);
    take_knot();
    count(0.0);
  }

  // Flows to the next edge.
  void flow() {
    const Matrix& step = step_[driven_];
    std::array<Real, STATES> change{};
    for (int row = 0; row < STATES; ++row)
      for (int column = 0; column < ALL; ++column) change[row] += step[row][column] * x_[column];
    for (int row = 0; row < STATES; ++row) x_[row] += change[row];
    ++edge_;
    if (next_knot_ < PATH.size() && edge_ == PATH[next_knot_].edge) take_knot();
    if (!(x_[ANGLE] >= low_rad_ && x_[ANGLE] < high_rad_)) count(x_[ANGLE]);
  }

  // The gates from this edge on. The motor's plus terminal is at leg B; without a gate on there is no current here.
  void drive(bool a_high, bool a_low, bool b_high, bool b_low) {
    driven_ = (a_high || a_low) && (b_high || b_low);
    x_[VOLTAGE] = SUPPLY_V * (b_high - a_high);
  }

  // The encoder's lines.
  bool a() const { return count_ >> 1 & 1; }
  bool b() const { return (count_ >> 1 ^ count_) & 1; }

 private:
  // hybrid-wall.toml, and what scenes have where they are silent.
  static constexpr double EDGE_S = 20e-9, SUPPLY_V = 24.0;
  static constexpr double RESISTANCE_OHM = 25.9e-3 * 24.0 / 0.265, INDUCTANCE_H = 0.226e-3;
  static constexpr double TORQUE_CONSTANT = 25.9e-3, INERTIA_KG_M2 = 1.37e-6, FRICTION_NM_S = 1.3e-6;
  static constexpr double HAND_NM = 0.3, HAND_NM_S = 0.1e-3;
  static constexpr double COUNT_RAD = 2.0 * M_PI / 4096;
  struct Knot {
    uint64_t edge;
    double angle_rad;
  };
  static constexpr std::array<Knot, 5> PATH{
      {{0, 0.0}, {7'500'000, 1.4}, {12'500'000, 1.9}, {20'000'000, 1.2}, {25'000'000, 1.8}}};

  // The state, and what holds during an edge.
  enum { CURRENT, SPEED, ANGLE, INTENT, STATES, INTENT_SPEED = STATES, VOLTAGE, ALL };
  using Matrix = std::array<std::array<Real, ALL>, ALL>;

  // e^{A dt} - I by its series.
  static Matrix one_edge(bool driven) {
    Matrix a{};
    if (driven) {
      a[CURRENT][CURRENT] = -RESISTANCE_OHM / INDUCTANCE_H;
      a[CURRENT][SPEED] = -TORQUE_CONSTANT / INDUCTANCE_H;
      a[CURRENT][VOLTAGE] = 1.0 / INDUCTANCE_H;
    }
    a[SPEED][CURRENT] = TORQUE_CONSTANT / INERTIA_KG_M2;
    a[SPEED][SPEED] = -(FRICTION_NM_S + HAND_NM_S) / INERTIA_KG_M2;
    a[SPEED][ANGLE] = -HAND_NM / INERTIA_KG_M2;
    a[SPEED][INTENT] = HAND_NM / INERTIA_KG_M2;
    a[SPEED][INTENT_SPEED] = HAND_NM_S / INERTIA_KG_M2;
    a[ANGLE][SPEED] = 1.0;
    a[INTENT][INTENT_SPEED] = 1.0;
    Matrix sum{}, term{};
    for (int i = 0; i < ALL; ++i) term[i][i] = 1.0;
    for (int order = 1; order <= 12; ++order) {
      Matrix next{};
      for (int i = 0; i < ALL; ++i)
        for (int j = 0; j < ALL; ++j)
          for (int k = 0; k < ALL; ++k) next[i][j] += term[i][k] * a[k][j] * (EDGE_S / order);
      term = next;
      for (int i = 0; i < ALL; ++i)
        for (int j = 0; j < ALL; ++j) sum[i][j] += term[i][j];
    }
    return sum;
  }

  void take_knot() {
    const Knot& from = PATH[next_knot_++];
    x_[INTENT] = from.angle_rad;
    x_[INTENT_SPEED] = 0.0;
    if (next_knot_ == PATH.size()) return;
    const Knot& to = PATH[next_knot_];
    x_[INTENT_SPEED] = (to.angle_rad - from.angle_rad) / (static_cast<double>(to.edge - from.edge) * EDGE_S);
  }

  void count(Real angle_rad) {
    count_ = static_cast<int64_t>(std::floor(angle_rad / COUNT_RAD));
    low_rad_ = static_cast<double>(count_) * COUNT_RAD;
    high_rad_ = static_cast<double>(count_ + 1) * COUNT_RAD;
  }

  std::array<Matrix, 2> step_;
  std::array<Real, ALL> x_{};
  bool driven_ = false;
  uint64_t edge_ = 0;
  size_t next_knot_ = 0;
  int64_t count_ = 0;
  double low_rad_ = 0.0, high_rad_ = 0.0;
};
