// SPDX-License-Identifier: BSD-3-Clause
#include "core/track/tracker.hpp"

#include <algorithm>
#include <cmath>

namespace backwash::track {
namespace {

Setpoint at_rest(const Setpoint& s) noexcept { return {s.p_W, Vec3::Zero(), Vec3::Zero(), s.yaw}; }

/// Whether the first n commands rest at one place, and others follow.
bool waits(const std::vector<Setpoint>& commands, std::size_t n) noexcept {
  return n < commands.size() &&
         std::all_of(commands.begin(), commands.begin() + static_cast<std::ptrdiff_t>(n), [&](const Setpoint& c) {
           return c.p_W == commands.front().p_W && c.yaw == commands.front().yaw && c.v_W.isZero(0) && c.a_W.isZero(0);
         });
}

}  // namespace

Tracker::Tracker(const Setpoint& hold, const Vehicle& vehicle)
    : hold_(at_rest(hold)), position_(vehicle.initial_error.position), velocity_(vehicle.initial_error.velocity) {}

bool Tracker::accept(const AcceptedSegment& segment, const State& measured, double age) noexcept {
  if (segment.commands.empty() || segment.tube.size() != segment.commands.size() + 1) return false;
  if (segment.closures != closures_) return false;
  if (segment.continues != 0) {
    if (!segment_ || segment.continues != segment_->id || next_ > segment.branch) return false;
    if (stop_ && !leaves_stop(segment)) return false;
  } else {
    const State& start = segment.tube.front().center;
    const double p = (measured.p_W - start.p_W).norm(), v = (measured.v_W - start.v_W).norm();
    // Written so that a state that is not a number, or a start without uncertainty, is refused.
    if (!(std::hypot(p / position_, v / velocity_) <= 1)) return false;
    constexpr double kRounding = 1e-6;  // of a period
    const auto gone = static_cast<std::size_t>(std::ceil(std::max(0.0, age / kControlPeriod - kRounding)));
    if (!waits(segment.commands, gone)) return false;
    next_ = gone;
  }
  past_ = 0;
  segment_ = &segment;
  stop_ = nullptr;
  shift_ = {};
  return true;
}

// The stop's second command is the first that differs from the segment's: whoever has it knew of the stop. The own ones
// and those at rest never differ: a segment that leaves those flies what the stop does.
bool Tracker::leaves_stop(const AcceptedSegment& segment) const noexcept {
  if (segment.branch < stop_->branch + 2 || segment.commands.size() < segment.branch) return false;
  for (std::size_t k = std::min(next_, stop_->branch + 1); k < segment.branch; ++k)
    if (segment.commands[k].p_W != command(k).p_W || segment.commands[k].yaw != command(k).yaw) return false;
  return true;
}

void Tracker::hold_at(const Setpoint& setpoint) noexcept {
  segment_ = nullptr;
  stop_ = nullptr;
  next_ = past_ = 0;
  hold_ = at_rest(setpoint);
  shift_ = {};
}

void Tracker::rebase(const RigidShift& D, std::uint32_t closures) noexcept {
  closures_ = closures;
  shift_ = segment_ ? D * shift_ : RigidShift{};
  hold_ = D.setpoint(hold_);
}

double Tracker::clearance() const noexcept {
  if (!segment_) return 0;
  const auto& ahead = segment_->clearance_ahead;
  const std::size_t second = next_ / AcceptedSegment::kClearanceEvery;
  return (ahead.empty() ? segment_->clearance : ahead[std::min(second, ahead.size() - 1)]) - segment_->apart_m;
}

const plan::Stop* Tracker::next_stop() const noexcept {
  if (!segment_ || stop_) return nullptr;
  for (const plan::Stop& stop : segment_->stops)
    if (stop.branch >= next_) return &stop;
  return nullptr;
}

bool Tracker::brake() noexcept {
  const plan::Stop* stop = next_stop();
  if (stop) stop_ = stop;
  return stop != nullptr;
}

std::size_t Tracker::end() const noexcept {
  return stop_ ? stop_->branch + stop_->commands.size() : segment_->commands.size();
}

// The last entry is the set of a place of rest (docs/model.md 5.2-8).
double Tracker::worst(std::size_t k) const noexcept { return k < end() ? segment_->worst : segment_->worst_at_rest; }

const reach::TubeStep& Tracker::set(std::size_t k) const noexcept {
  k = std::min(k, end());
  return stop_ && k >= stop_->branch ? stop_->tube[k - stop_->branch] : segment_->tube[k];
}

std::array<std::span<const reach::TubeStep>, 2> Tracker::ahead() const noexcept {
  if (!segment_) return {};
  const std::size_t from = std::min(next_, end());
  const std::span tube(segment_->tube);
  if (!stop_) return {tube.subspan(from), {}};
  const std::span tail(stop_->tube);
  if (from >= stop_->branch) return {std::span<const reach::TubeStep>{}, tail.subspan(from - stop_->branch)};
  return {tube.subspan(from, stop_->branch - from), tail};
}

// Entry k is the set at the tick of command k. The last one is exact at its instant only: later its interval is meant.
// So it is between two ticks.
Inside Tracker::judge(const Vec3& measured_W, double age) const noexcept {
  if (!segment_) return {};
  if (!(age > 0)) {
    const reach::TubeStep& predicted = set(next_);
    return judge(measured_W, predicted.center.p_W,
                 next_ > end() ? predicted.half_widths_interval : predicted.half_widths, worst(next_));
  }
  const double at = std::max(0.0, static_cast<double>(next_ + past_) - age / kControlPeriod);
  const auto before = static_cast<std::size_t>(at);
  const double share = at - static_cast<double>(before);
  const Vec3 &from = set(before).center.p_W, &to = set(before + 1).center.p_W;
  return judge(measured_W, from + share * (to - from), set(before).half_widths_interval, worst(before));
}

Inside Tracker::judge(const Vec3& measured_W, const Vec3& center, const PerDirection& half_widths,
                      double worst) const noexcept {
  Inside result;
  result.judged = true;
  for (std::size_t d = 0; d < kDirections; ++d) result.half_widths[d] = worst * half_widths[d];
  // A loop closure moves the map and not the vehicle: the error is judged in the frame that the sets are in.
  result.center = shift_.point(center);
  const Vec3 e = shift_.inverse().rotate(measured_W - result.center);
  for (std::size_t d = 0; d < kDirections; ++d) {
    result.error[d] = unit(static_cast<Direction>(d)).dot(e);
    // Written so that an error that is not a number is not inside.
    if (!(std::abs(result.error[d]) <= result.half_widths[d])) result.inside = false;
  }
  return result;
}

bool Tracker::within(const Vec3& measured_W) const noexcept {
  if (!segment_) return false;
  const Vec3 p = shift_.inverse().point(measured_W);
  return std::ranges::any_of(segment_->tube, [&p, this](const reach::TubeStep& set) {
    for (std::size_t d = 0; d < kDirections; ++d) {
      const double e = unit(static_cast<Direction>(d)).dot(p - set.center.p_W);
      if (!(std::abs(e) <= segment_->worst * set.half_widths_interval[d])) return false;
    }
    return true;
  });
}

Setpoint Tracker::command(std::size_t k) const noexcept {
  if (k >= end()) return at_rest(command(end() - 1));
  return stop_ && k >= stop_->branch ? stop_->commands[k - stop_->branch] : segment_->commands[k];
}

Setpoint Tracker::step() noexcept {
  if (!segment_ || next_ >= end()) {
    if (segment_ && next_ > end()) past_ = std::min(past_ + 1, kMostPast);
    next_ = segment_ ? end() + 1 : 1;  // past the tube's last entry
    return hold_;
  }
  Setpoint now = shift_.setpoint(command(next_++));
  hold_ = at_rest(now);
  return now;
}

}  // namespace backwash::track
