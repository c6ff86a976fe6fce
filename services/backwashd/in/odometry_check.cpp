// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/in/odometry_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace backwash::daemon {
namespace {

using config::Twist;

constexpr double kLongestGap = 0.5;   // s: after a longer one the comparison begins anew
constexpr int kIntervals = 20;        // messages until their rate is known
constexpr double kSmooth = 0.1;       // share of the newest interval
constexpr double kMostLatency = 0.2;  // s, of the key odometry.latency

std::string line(const char* format, auto... values) {
  char text[192];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

}  // namespace

std::optional<std::string> OdometryCheck::look(std::int64_t stamp_ns, const Vec3& p, const Eigen::Quaterniond& q,
                                               const Vec3& v, std::optional<double> latency) {
  if (!p.allFinite() || !v.allFinite() || !q.coeffs().allFinite()) return std::nullopt;
  const double dt = stamp_ns_ ? static_cast<double>(stamp_ns - *stamp_ns_) * 1e-9 : 0;
  const bool goes_on = stamp_ns_ && dt > 0 && dt < kLongestGap;
  if (stamp_ns_ && dt == 0) return std::nullopt;
  stamp_ns_ = stamp_ns;
  time(goes_on ? std::optional(dt) : std::nullopt, latency);
  if (goes_on) {
    compare(dt, p, q, v);
  } else {
    zero_from_.reset();
    zero_way_ = 0;
    count_ = 0;
    from_ = p;
    by_body_ = by_world_ = Vec3::Zero();
    lasted_ = 0;
  }
  std::string now = doubt();
  if (now == told_) return std::nullopt;
  return told_ = std::move(now);
}

void OdometryCheck::time(std::optional<double> dt, std::optional<double> latency) {
  intervals_ = dt ? std::min(intervals_ + 1, kIntervals) : 0;
  interval_ = dt && interval_ ? (1 - kSmooth) * *interval_ + kSmooth * *dt : dt;
  if (latency)
    latency_[latencies_++ % kLatencies] = *latency;
  else
    latencies_ = 0;
}

void OdometryCheck::compare(double dt, const Vec3& p, const Eigen::Quaterniond& q, const Vec3& v) {
  if (!v.isZero(0))
    zero_from_.reset();
  else if (!zero_from_)
    zero_from_ = p;
  zero_way_ = zero_from_ ? (p - *zero_from_).norm() : 0;
  by_body_ += dt * (q * v);
  by_world_ += dt * v;
  lasted_ += dt;
  const Vec3 way = p - from_;
  const bool long_enough = way.norm() >= kStretch;
  if (long_enough) stretches_[count_++ % kStretches] = {way.norm(), (way - by_body_).norm(), (way - by_world_).norm()};
  if (long_enough || lasted_ > kLongest) {
    from_ = p;
    by_body_ = by_world_ = Vec3::Zero();
    lasted_ = 0;
  }
}

std::string OdometryCheck::doubt() {
  if (std::string timing = timing_doubt(); !timing.empty()) return timing;
  return twist_ == Twist::none ? "" : twist_doubt();
}

// Told with the value that was seen first, so that a cause is told once.
std::string OdometryCheck::timing_doubt() {
  const bool slow = intervals_ == kIntervals && 1 / *interval_ < timing_.rate_least;
  const double latency = latencies_ < kLatencies ? timing_.latency : *std::ranges::min_element(latency_);
  const bool off = std::abs(latency - timing_.latency) > kLatencyOff;
  const Timing now = slow ? Timing::slow : off ? Timing::other_latency : Timing::right;
  if (now == timing_now_) return timing_told_;
  timing_now_ = now;
  timing_told_.clear();
  if (slow)
    timing_told_ = line(
        "odometry comes at %.1f Hz, less than odometry.rate_least = %g: each gap would be a HOLD; raise the "
        "estimator's rate, or set the key to its least, 9 or more",
        1 / *interval_, timing_.rate_least);
  else if (off)
    timing_told_ =
        line("odometry comes %.0f ms after its stamp, and odometry.latency says %.0f: set it to %.3f%s", latency * 1e3,
             timing_.latency * 1e3, latency, latency > kMostLatency ? ", which is too late to fly by" : "");
  return timing_told_;
}

std::string OdometryCheck::twist_doubt() const {
  if (zero_way_ >= kZeroWay)
    return line(
        "odometry: the twist is all zero while the pose moved %.1f m: this looks like FAST-LIO; set "
        "odometry.profile = \"fast_lio\", or \"custom\" with twist = \"none\"",
        kZeroWay);
  if (count_ < kStretches) return "";
  ComparedStretch sum{};
  for (const ComparedStretch& s : stretches_)
    sum = {sum.way + s.way, sum.in_body + s.in_body, sum.in_world + s.in_world};
  const double claimed = twist_ == Twist::body ? sum.in_body : sum.in_world;
  const double other = twist_ == Twist::body ? sum.in_world : sum.in_body;
  if (claimed < kOff * sum.way) return "";
  if (other > kFits * sum.way)
    return "odometry: twist and pose contradict each other, in the body's frame as in the pose's: look at the "
           "estimator's frames and units";
  return twist_ == Twist::body
             ? "odometry: the twist fits the pose in the pose's frame, not in the body's: this looks like VINS-Fusion; "
               "set odometry.profile = \"vins_fusion\", or \"custom\" with twist = \"world\""
             : "odometry: the twist fits the pose in the body's frame, not in the pose's: set odometry.profile = "
               "\"ros\", or \"custom\" with twist = \"body\"";
}

}  // namespace backwash::daemon
