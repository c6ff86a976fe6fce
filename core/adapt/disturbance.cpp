// SPDX-License-Identifier: BSD-3-Clause
#include "core/adapt/disturbance.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::adapt {
namespace {

bool usable(const FlownSample& s) noexcept {
  const auto& [p, v, a, yaw] = s.command;
  return std::isfinite(s.t_s) && s.state.p_W.allFinite() && s.state.v_W.allFinite() && s.a_W.allFinite() &&
         p.allFinite() && v.allFinite() && a.allFinite();
}

}  // namespace

Disturbance::Around Disturbance::around(double t_s) const noexcept {
  std::size_t n = 0;
  while (n + 1 < count_ && back(n).t_s > t_s) ++n;
  const FlownSample &before = back(n), &after = back(n > 0 ? n - 1 : 0);
  const double interval = after.t_s - before.t_s;
  return {before, after, interval > 0 ? std::clamp((t_s - before.t_s) / interval, 0.0, 1.0) : 0.0};
}

Vec3 Disturbance::commanded(double now_s) const noexcept {
  const Vec3 kp(controller_.kp.horizontal, controller_.kp.horizontal, controller_.kp.vertical);
  const Vec3 kd(controller_.kd.horizontal, controller_.kd.horizontal, controller_.kd.vertical);
  const Around sent = around(now_s - controller_.latency), felt = around(now_s - controller_.feedback_delay);
  const auto between = [](const Vec3& x, const Vec3& y, double share) -> Vec3 { return x + share * (y - x); };
  const auto &c0 = sent.before.command, &c1 = sent.after.command;
  const State &s0 = felt.before.state, &s1 = felt.after.state;
  const Vec3 off = between(c0.p_W, c1.p_W, sent.share) - between(s0.p_W, s1.p_W, felt.share);
  const Vec3 late = between(c0.v_W, c1.v_W, sent.share) - between(s0.v_W, s1.v_W, felt.share);
  return between(c0.a_W, c1.a_W, sent.share) + kp.cwiseProduct(off) + kd.cwiseProduct(late);
}

std::optional<Vec3> Disturbance::add(const FlownSample& sample) noexcept {
  if (!usable(sample) || (count_ > 0 && !(sample.t_s > back(0).t_s))) return std::nullopt;
  const double dt = count_ > 0 ? sample.t_s - back(0).t_s : 0;
  if (dt > kGap) count_ = 0;
  const bool begins = count_ == 0;
  newest_ = (newest_ + 1) % kKept, kept_[newest_] = sample, count_ = std::min(count_ + 1, kKept);
  const Vec3 u = commanded(sample.t_s);
  const double lag = controller_.attitude_lag, follows = lag > 0 ? 1 - std::exp(-dt / lag) : 1;
  if (begins)
    begun_s_ = sample.t_s, rotors_ = u;
  else
    rotors_ += follows * ((lag > 0 ? Vec3(0.5 * (last_ + u)) : u) - rotors_);
  last_ = u;
  const double late = std::max(controller_.latency, controller_.feedback_delay);
  if (sample.t_s - begun_s_ < std::max(kLeast, kSettled * lag + late)) return std::nullopt;
  return sample.a_W - rotors_;
}

}  // namespace backwash::adapt
