// SPDX-License-Identifier: BSD-3-Clause
#include "core/adapt/innovations.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::adapt {

std::optional<Innovation> Innovations::add(const AirSample& s) noexcept {
  const bool usable =
      std::isfinite(s.t_s) && s.w_W.allFinite() && s.sigma.allFinite() && s.noise.allFinite() && s.sigma.minCoeff() > 0;
  if (!usable || (last_t_ && !(s.t_s > *last_t_))) {
    ++refused_;
    return std::nullopt;
  }
  const double interval = last_t_ ? s.t_s - *last_t_ : 0;
  const bool gap = interval > kLongestInterval || (interval_ > 0 && interval > kGap * interval_);
  const bool begins = !last_t_ || gap;
  last_t_ = s.t_s;
  if (begins) {  // how long it stands for is not known
    before_.reset(), group_ = {}, interval_ = 0;
    return std::nullopt;
  }
  interval_ = interval;
  const Vec3 inverse = s.sigma.cwiseSqrt().cwiseInverse();
  if (group_.samples == 0) group_.air = s.air;
  group_.mixed = group_.mixed || group_.air != s.air;
  group_.samples += 1, group_.seconds += interval;
  group_.y += s.w_W.cwiseProduct(inverse), group_.inverse += inverse;
  group_.noise += (gusts_.noise + s.noise).cwiseQuotient(s.sigma);
  return group_.seconds >= law_.group_s() - interval / 2 ? ended() : std::nullopt;
}

std::optional<Innovation> Innovations::ended() noexcept {
  const double n = group_.samples;
  group_.y /= n, group_.inverse /= n, group_.noise /= n * n * (gusts_.differences ? n : 1);
  const std::optional<Group> before = before_;
  const Group now = group_;
  before_ = now, group_ = {};
  if (!before || now.mixed) return std::nullopt;
  if (means_ == MeansOf::pairs) {
    if (before->mixed || before->air != now.air) return std::nullopt;
    before_.reset();
  }
  const auto [rho, most, least] = law_.at(now.samples, now.seconds);
  const Vec3 push(gusts_.mean_horizontal, gusts_.mean_horizontal, gusts_.mean_vertical);
  const Vec3 e = now.y - rho * before->y;
  const Vec3 steady = push.cwiseProduct(now.inverse - rho * before->inverse);
  const Vec3 beside = now.noise + rho * rho * before->noise + steady.cwiseAbs2();
  return Innovation{now.air, now.seconds, e.cwiseAbs2(), beside, law_.block_s(), most, least};
}

}  // namespace backwash::adapt
