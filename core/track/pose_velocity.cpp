// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/pose_velocity.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/types/time.hpp"

namespace backwash::track {
namespace {

using Mat3 = Eigen::Matrix3d;

/// What a sample t seconds before the newest weighs in the slope there, of a parabola with these moments Σ tⁱ⁺ʲ.
double weight(const Mat3& inverse_moments, double t) { return inverse_moments.row(1).dot(Vec3(1, t, t * t)); }

}  // namespace

std::optional<Vec3> PoseVelocity::add(std::int64_t stamp_ns, const Vec3& p_W) noexcept {
  const auto back = [&](std::size_t n) -> Sample& { return samples_[(next_ + kMost - 1 - n) % kMost]; };
  if (count_ > 0) {
    const double dt = seconds(stamp_ns - back(0).stamp_ns);
    if (dt <= 0 && dt > -kGap) return std::nullopt;
    if (dt > kGap || dt < 0) count_ = 0;
  }
  samples_[next_] = {stamp_ns, p_W};
  next_ = (next_ + 1) % kMost;
  count_ = std::min(count_ + 1, kMost);
  Mat3 moments = Mat3::Zero(), sums = Mat3::Zero();  // sums: column j is Σ tʲ (p − newest)
  double oldest = 0;
  std::size_t used = 0;
  for (; used < count_; ++used) {
    const double t = seconds(back(used).stamp_ns - stamp_ns);
    if (t < -kWindow && used >= kLeast) break;
    const Vec3 powers(1, t, t * t);
    moments += powers * powers.transpose();
    sums += (back(used).p_W - p_W) * powers.transpose();
    oldest = t;
  }
  count_ = used;
  if (used < kLeast || -oldest < kWindow * 2 / 3) return std::nullopt;
  return sums * moments.inverse().row(1).transpose();
}

double PoseVelocity::error(double rate) noexcept {
  const auto samples = std::max<int>(kLeast, static_cast<int>(std::floor(kWindow * rate)) + 1);
  Mat3 moments = Mat3::Zero();
  for (int n = 0; n < samples; ++n) {
    const Vec3 powers(1, -n / rate, n / rate * n / rate);
    moments += powers * powers.transpose();
  }
  const Mat3 inverse = moments.inverse();
  double noise = 0, cubic = 0;
  for (int n = 0; n < samples; ++n) {
    const double t = -n / rate, w = weight(inverse, t);
    noise += w * w;
    cubic += w * t * t * t / 6;
  }
  return 3 * kNoise * std::sqrt(noise) + kJerk * std::abs(cubic);
}

}  // namespace backwash::track
