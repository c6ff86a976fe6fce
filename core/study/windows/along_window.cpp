// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "core/study/windows/observation.hpp"

namespace backwash::study {

Vec3 WindowRow::ln_sigma_at(const Vec3& offset_W) const {
  constexpr double kHalf = (kOffsetsAside - 1) / 2.0;
  Vec3 ln = Vec3::Zero();
  std::array<std::size_t, 2> low;
  std::array<double, 2> share;
  for (int i = 0; i < 2; ++i) {
    const double q = std::clamp(offset_W[i] / kOffsetStep + kHalf, 0.0, 2 * kHalf);
    const auto k = static_cast<std::size_t>(i);
    low[k] = std::min(static_cast<std::size_t>(q), kOffsetsAside - 2);
    share[k] = q - static_cast<double>(low[k]);
  }
  for (std::size_t n = 0; n < 4; ++n) {
    const std::size_t i = n / 2, j = n % 2;
    const double weight = (i ? share[0] : 1 - share[0]) * (j ? share[1] : 1 - share[1]);
    ln += weight * ln_sigma_moved[(low[0] + i) * kOffsetsAside + low[1] + j];
  }
  return ln;
}

/// Σ along the window (a moving vehicle crosses different air), as it is and with the window moved; surfaces too.
void Observer::look_along(WindowRow& row, SampleRange w, const std::vector<Vec3>& p, const std::vector<Vec3>& v) {
  const auto sample = [&](std::size_t k) { return w.begin + (2 * k + 1) * w.size() / (2 * kPoints); };
  const auto at = [&](std::size_t k) -> const Vec3& { return p[sample(k)]; };
  const bool still = (at(0) - at(kPoints - 1)).norm() + (at(0) - at(kPoints / 2)).norm() < kWindowRules.one_place;
  // An offset that puts the craft into a solid says nothing of the air there: as far along it as is free.
  const auto sigma = [&](const Vec3& from_W, const Vec3& offset_W) {
    double share = 1;
    while (share > 0 && surroundings_.inside_solid(from_W + share * offset_W)) share -= kWindowRules.offset_retreat;
    return surroundings_.sigma(from_W + share * offset_W);
  };
  const auto along = [&](const Vec3& offset_W) {
    if (still) return sigma(row.p_W, offset_W);
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = 0; k < kPoints; ++k) sum += sigma(at(k), offset_W) / kPoints;
    return sum;
  };
  row.sigma = along(Vec3::Zero());
  for (std::size_t k = 0; k < kPoints; ++k) {
    row.speeds[k] = v[sample(k)].norm();
    row.climbs[k] = v[sample(k)].z();
    row.shares[k] = still ? 1.0 / kPoints : surroundings_.sigma(at(k)).sum() / (kPoints * row.sigma.sum());
  }
  for (std::size_t k = 0; k < kPoints && !still && surroundings_.has_map(); ++k)
    row.path.push_back(surroundings_.around(at(k)));
  for (std::size_t n = 0; n < row.ln_sigma_moved.size(); ++n) {
    constexpr std::size_t kMiddle = (kOffsetsAside - 1) / 2;
    const std::size_t x = n / kOffsetsAside, y = n % kOffsetsAside;
    const Vec3 offset_W = kOffsetStep * (Vec3(static_cast<double>(x), static_cast<double>(y), 0) -
                                         Vec3(static_cast<double>(kMiddle), static_cast<double>(kMiddle), 0));
    row.ln_sigma_moved[n] = (along(offset_W).array() / row.sigma.array())
                                .log()
                                .max(-kWindowRules.offset_limit)
                                .min(kWindowRules.offset_limit);
  }
}

}  // namespace backwash::study
