// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/pose_drift.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace backwash::track {
namespace {

/// `v` less what lies along `by`, of which at most `most` times is taken.
Vec3 without(const Vec3& v, const Vec3& by, double most) noexcept {
  const double squared = by.squaredNorm();
  return squared > 0 ? Vec3(v - std::clamp(v.dot(by) / squared, -most, most) * by) : v;
}

double bound(const DriftLaw& law, double position, double variance) noexcept {
  return std::hypot(law.ends * position, law.deviations * std::sqrt(variance));
}

}  // namespace

double PoseDrift::slowest(double position, double velocity_error, const DriftLaw& law) noexcept {
  double least = std::numeric_limits<double>::infinity();
  for (const double T : law.over)
    least = std::min(least, bound(law, position, kSettle * velocity_error * velocity_error * T / 2) / T);
  return least;
}

// Written so that what is no number is not explained.
bool PoseDrift::explains(const Step& step) noexcept {
  auto next = scales_;
  for (std::size_t n = 0; n < next.size(); ++n) {
    const double kept = std::exp(-step.dt / law_.over[n]);
    Scale& s = next[n];
    s.left = kept * s.left + (step.moved - step.claimed);
    s.way = kept * s.way + step.claimed;
    s.change = kept * s.change + step.change;
    s.variance = kept * kept * s.variance + kSettle * step.velocity_error * step.velocity_error * step.dt;
    const Vec3 unexplained = without(without(s.left, s.way, law_.scale), s.change, law_.lag);
    if (!(unexplained.norm() <= bound(law_, position_, s.variance))) return false;
  }
  scales_ = next;
  return true;
}

void PoseDrift::rebase(const RigidShift& D) noexcept {
  for (Scale& s : scales_) {
    s.left = D.rotate(s.left);
    s.way = D.rotate(s.way);
    s.change = D.rotate(s.change);
  }
}

}  // namespace backwash::track
