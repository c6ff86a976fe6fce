// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/tracker.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::track {
namespace {

Setpoint at_rest(const Setpoint& s) noexcept { return {s.p_W, Vec3::Zero(), Vec3::Zero(), s.yaw}; }

}  // namespace

Tracker::Tracker(const Setpoint& hold, const Vehicle& vehicle)
    : hold_(at_rest(hold)), position_(vehicle.initial_error.position), velocity_(vehicle.initial_error.velocity) {}

bool Tracker::accept(const AcceptedSegment& segment, const State& measured) noexcept {
  if (segment.commands.empty() || segment.tube.size() != segment.commands.size() + 1) return false;
  if (segment.continues != 0) {
    if (!segment_ || segment.continues != segment_->id || next_ > segment.branch) return false;
  } else {
    const State& start = segment.tube.front().center;
    const double p = (measured.p_W - start.p_W).norm(), v = (measured.v_W - start.v_W).norm();
    // Written so that a state that is not a number, or a start without uncertainty, is refused.
    if (!(std::hypot(p / position_, v / velocity_) <= 1)) return false;
    next_ = 0;
  }
  segment_ = &segment;
  return true;
}

void Tracker::hold_at(const Setpoint& setpoint) noexcept {
  segment_ = nullptr;
  next_ = 0;
  hold_ = at_rest(setpoint);
}

Inside Tracker::judge(const Vec3& measured_W) const noexcept {
  Inside result;
  if (!segment_) return result;
  // Entry k is the set at the tick of command k. The last one is exact at its instant only: later its interval is
  // meant.
  const std::size_t last = segment_->tube.size() - 1;
  const reach::TubeStep& set = segment_->tube[std::min(next_, last)];
  result.judged = true;
  result.half_widths = next_ > last ? set.half_widths_interval : set.half_widths;
  result.center = set.center.p_W;
  const Vec3 e = measured_W - set.center.p_W;
  for (std::size_t d = 0; d < kDirections; ++d) {
    result.error[d] = unit(static_cast<Direction>(d)).dot(e);
    // Written so that an error that is not a number is not inside.
    if (!(std::abs(result.error[d]) <= result.half_widths[d])) result.inside = false;
  }
  return result;
}

Setpoint Tracker::step() noexcept {
  const std::size_t count = segment_ ? segment_->commands.size() : 0;
  if (next_ >= count) {
    next_ = count + 1;  // past the tube's last entry
    return hold_;
  }
  const Setpoint command = segment_->commands[next_++];
  hold_ = at_rest(command);
  return command;
}

}  // namespace backwash::track
