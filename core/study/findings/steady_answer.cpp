// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/findings/steady_answer.hpp"

#include <algorithm>
#include <cmath>

#include "core/study/inference/intervals.hpp"
#include "core/study/inference/rules.hpp"

namespace backwash::study {

bool SteadyAnswer::Axes::matters() const { return predicted >= kRules.least_shift; }
bool SteadyAnswer::Axes::told() const { return !matters() || high - low < kRules.shift_interval; }
bool SteadyAnswer::Axes::keeps() const { return !matters() || (told() && left >= kRules.kept_shift); }

namespace {

constexpr std::array<std::array<int, 2>, 2> kAxes{{{0, 1}, {2, 2}}};  // level, up: first and last

bool hovers(const WindowRow& w) { return w.led && !w.held_off && w.speed <= kRules.hovering; }

/// What is left along an axis of the push of each window, divided by k_p, at a rate of decay (8-11), m.
std::vector<double> shift_left(std::span<const Vec3> push_W, const Observations& seen, int axis, double rate) {
  std::vector<double> shift(push_W.size(), 0);
  for (std::size_t f = 0; f + 1 < seen.first.size(); ++f) {
    double t = 0, push = 0, left = 0;
    for (std::size_t i = seen.first[f]; i < seen.first[f + 1]; ++i) {
      const WindowRow& w = seen.windows[i];
      const double dt = std::max(0.0, w.t - t);
      // The first push has acted since the flight began, a change since half the way from the window before.
      left =
          std::exp(-rate * dt) * left + std::exp(-rate * (i == seen.first[f] ? dt : dt / 2)) * (push_W[i][axis] - push);
      push = push_W[i][axis];
      t = w.t;
      if (w.led) shift[i] = left * w.led->give[axis];
    }
  }
  return shift;
}

/// Sums over the hovers, of shifts that were predicted without decay, with it, and measured.
struct Sums {
  double predicted = 0, decayed = 0, measured = 0, square = 0, n = 0;
};

std::vector<Sums> sums_of(std::span<const Vec3> push_W, const Observations& seen, std::size_t group, double rate) {
  std::vector<Sums> flights(seen.flights);
  for (int axis = kAxes[group].front(); axis <= kAxes[group].back(); ++axis) {
    const auto kept = shift_left(push_W, seen, axis, 0), left = shift_left(push_W, seen, axis, rate);
    for (std::size_t i = 0; i < kept.size(); ++i) {
      const WindowRow& w = seen.windows[i];
      if (!hovers(w)) continue;
      Sums& s = flights[w.flight];
      s.predicted += kept[i] * kept[i];
      s.decayed += kept[i] * left[i];
      s.measured += kept[i] * w.led->off_W[axis];
      s.square += w.led->off_W[axis] * w.led->off_W[axis];
      s.n += 1;
    }
  }
  return flights;
}

Sums total(const std::vector<Sums>& flights) {
  Sums all;
  for (const Sums& s : flights) {
    all.predicted += s.predicted;
    all.decayed += s.decayed;
    all.measured += s.measured;
    all.square += s.square;
    all.n += s.n;
  }
  return all;
}

/// The rate at which as much is left as was measured (8-12), 1/s: no faster than once within a window.
double rate_of(double left, std::span<const Vec3> push_W, const Observations& seen, std::size_t group) {
  double low = 0, high = 1 / kWindowRules.window_length;
  const auto left_at = [&](double rate) {
    const Sums all = total(sums_of(push_W, seen, group, rate));
    return all.decayed / all.predicted;
  };
  if (left <= left_at(high)) return high;
  for (int i = 0; i < kRules.power_halvings; ++i) (left_at((low + high) / 2) > left ? low : high) = (low + high) / 2;
  return high;
}

}  // namespace

std::vector<Vec3> pushes(std::span<const Accepted> causes, std::span<const std::vector<double>> beside,
                         const Observations& seen) {
  std::vector<Vec3> push_W(seen.windows.size(), Vec3::Zero());
  const auto add = [&](Channel c, std::size_t i, double x) {
    if (c <= kMeanZ) push_W[i][static_cast<Eigen::Index>(c)] += x;
  };
  for (std::size_t c = 0; c < causes.size(); ++c) {
    const Accepted& cause = causes[c];
    if (cause.form->in_sensor) continue;
    each_value(cause.columns, cause.theta, add);
    auto open = companions(*cause.form, seen);
    open.resize(std::min(open.size(), beside[c].size()));
    each_value(open, beside[c], add);
  }
  return push_W;
}

SteadyAnswer steady_answer(std::span<const Vec3> push_W, const Observations& seen) {
  SteadyAnswer answer;
  for (std::size_t group = 0; group < answer.axes.size(); ++group) {
    const auto flights = sums_of(push_W, seen, group, 0);
    const Sums all = total(flights);
    std::vector<double> without;
    for (const Sums& s : flights)
      if (s.predicted > 0 && all.predicted > s.predicted)
        without.push_back((all.measured - s.measured) / (all.predicted - s.predicted));
    const double n = static_cast<double>(without.size());
    if (n < kRules.fewest_shifted) continue;
    SteadyAnswer::Axes& axes = answer.axes[group];
    axes.predicted = std::sqrt(all.predicted / all.n);
    axes.measured = std::sqrt(all.square / all.n);
    if (!axes.matters()) continue;
    axes.left = all.measured / all.predicted;
    double mean = 0, square = 0;
    for (const double x : without) mean += x / n;
    for (const double x : without) square += (x - mean) * (x - mean);
    const double error = student_975(n - 1) * std::sqrt((n - 1) / n * square);
    axes.low = axes.left - error;
    axes.high = axes.left + error;
    if (axes.told() && !axes.keeps()) axes.rate = rate_of(axes.left, push_W, seen, group);
  }
  return answer;
}

}  // namespace backwash::study
