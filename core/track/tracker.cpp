// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/tracker.hpp"

#include <algorithm>
#include <utility>

namespace backwash::track {

Tracker::Tracker(const Setpoint& hold) : hold_{hold.p_W, Vec3::Zero(), Vec3::Zero(), hold.yaw} {}

void Tracker::accept(std::shared_ptr<const AcceptedSegment> segment) {
  segment_ = std::move(segment);
  next_ = 0;
}

Inside Tracker::judge(const Vec3& measured_W) const noexcept {
  Inside result;
  if (!segment_ || segment_->tube.empty()) return result;
  // Entry k is the set at the tick of command k. The last one is exact at its instant only: later its interval is
  // meant.
  const std::size_t last = segment_->tube.size() - 1;
  const reach::TubeStep& set = segment_->tube[std::min(next_, last)];
  result.half_widths = next_ > last ? set.half_widths_interval : set.half_widths;
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
  hold_ = {command.p_W, Vec3::Zero(), Vec3::Zero(), command.yaw};
  return command;
}

bool Tracker::finished() const noexcept { return !segment_ || next_ >= segment_->commands.size(); }

}  // namespace backwash::track
