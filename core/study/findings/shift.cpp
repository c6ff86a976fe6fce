// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/findings/shift.hpp"

#include <algorithm>
#include <cmath>

#include "core/study/inference/intervals.hpp"
#include "core/study/inference/rules.hpp"

namespace backwash::study {

bool ShiftCheck::refuted() const { return tested && high < kRules.refuted_shift; }

namespace {

/// Push of a form and its companions in each window, m/s².
std::vector<Vec3> pushes(const Accepted& cause, const std::vector<double>& beside, const Observations& seen) {
  std::vector<Vec3> push(seen.windows.size(), Vec3::Zero());
  const auto add = [&](const DesignColumn& column, double by) {
    for (const auto& part : column.parts)
      for (std::size_t i = 0; i < push.size() && part.channel <= kMeanZ; ++i)
        push[i][static_cast<Eigen::Index>(part.channel)] += by * part.x[i];
  };
  for (std::size_t k = 0; k < cause.columns.size(); ++k)
    add(cause.columns[k], cause.theta[static_cast<Eigen::Index>(k)]);
  const auto open = companions(*cause.form, seen);
  for (std::size_t k = 0; k < std::min(open.size(), beside.size()); ++k) add(open[k], beside[k]);
  return push;
}

/// Sums over the hovers of one flight.
struct Sums {
  double product = 0, predicted = 0, measured = 0, n = 0;
};

}  // namespace

ShiftCheck check_shift(const Accepted& cause, const std::vector<double>& beside, const Observations& seen) {
  if (cause.form->in_sensor) return {};
  const auto push = pushes(cause, beside, seen);
  std::vector<Sums> flights(seen.flights);
  Sums all;
  for (std::size_t i = 0; i < seen.windows.size(); ++i) {
    const auto& w = seen.windows[i];
    if (!w.led || w.held_off || w.speed > kRules.hovering) continue;
    const Vec3 shift = push[i].cwiseProduct(w.led->give);
    for (Sums* s : {&flights[w.flight], &all}) {
      s->product += shift.dot(w.led->off_W);
      s->predicted += shift.squaredNorm();
      s->measured += w.led->off_W.squaredNorm();
      s->n += 1;
    }
  }
  ShiftCheck check;
  if (!(all.n > 0)) return check;
  check.predicted = std::sqrt(all.predicted / all.n);
  check.measured = std::sqrt(all.measured / all.n);
  std::vector<double> left;
  for (const Sums& s : flights)
    if (s.predicted > 0 && all.predicted - s.predicted > 0)
      left.push_back((all.product - s.product) / (all.predicted - s.predicted));
  if (static_cast<double>(left.size()) < kRules.fewest_shifted || check.predicted < kRules.least_shift) return check;
  check.slope = all.product / all.predicted;
  const double n = static_cast<double>(left.size());
  double mean = 0, square = 0;
  for (const double x : left) mean += x / n;
  for (const double x : left) square += (x - mean) * (x - mean);
  const double error = student_975(n - 1) * std::sqrt((n - 1) / n * square);
  check.low = check.slope - error;
  check.high = check.slope + error;
  check.tested = 2 * error < kRules.shift_interval;
  return check;
}

}  // namespace backwash::study
