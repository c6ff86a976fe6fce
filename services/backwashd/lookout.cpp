// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/lookout.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "core/reach/clearance.hpp"

namespace backwash::daemon {
namespace {

constexpr double kLate = 1.0;      // s (docs/faults.md row 13)
constexpr int kRecordsInTick = 2;  // of a ring: more than scans come in 20 ms

using Sets = std::span<const reach::TubeStep>;

bool blocked(Sets sets, const reach::Cube& cube, double taken) noexcept {
  return !sets.empty() && reach::first_blocked(sets, 0, cube, taken) < sets.size();
}

}  // namespace

// Its age shrinks what a live map is trusted for: something may have come nearer meanwhile.
bool Lookout::late(const track::Tracker& tracker, std::int64_t now_ns) const noexcept {
  if (!map_.live || tracker.finished()) return false;
  const std::int64_t seen = channels_.map_ns.load(std::memory_order_relaxed);
  const double age = static_cast<double>(now_ns - seen) * 1e-9;
  return seen < 0 || age > kLate || map_.closing_speed * age > tracker.clearance();
}

void Lookout::hold_against(const NewVoxels& voxels, const track::Tracker& tracker,
                           track::Surroundings& result) const noexcept {
  const auto ahead = tracker.ahead();
  const plan::Stop* stop = tracker.next_stop();
  // After a loop closure the sets are in the old map frame; a cube that is turned a little fits into a larger one.
  const track::RigidShift back = tracker.shift().inverse();
  const double edge = voxels.edge * (std::abs(std::cos(back.yaw)) + std::abs(std::sin(back.yaw)));
  for (std::size_t n = 0; n < voxels.count; ++n) {
    const reach::Cube cube{back.point({voxels.centers[n][0], voxels.centers[n][1], voxels.centers[n][2]}), edge};
    if (!result.tube_blocked) result.tube_blocked = blocked(ahead[0], cube, taken_) || blocked(ahead[1], cube, taken_);
    if (!stop || result.stop_blocked) continue;
    // The way to the stop's branch is the flight's own; it may be the present entry alone.
    const std::size_t own = std::min(ahead[0].size(), stop->branch - std::min(stop->branch, tracker.index()));
    result.stop_blocked = blocked(ahead[0].first(own), cube, taken_) || blocked(stop->tube, cube, taken_);
  }
}

// What was seen between the snapshot that the segment was verified in and its acceptance. False: not all of it is kept.
bool Lookout::catch_up(const track::Tracker& tracker, track::Surroundings& result) noexcept {
  const std::size_t oldest = recorded_ - std::min(recorded_, kKept);
  const bool lost = unchecked_ < oldest && oldest > 0 && recent_[oldest % kKept].received_ns > tracker.seen_ns();
  unchecked_ = std::max(unchecked_, oldest);
  for (int n = 0; unchecked_ < recorded_ && n < kRecordsInTick; ++unchecked_) {
    const NewVoxels& voxels = recent_[unchecked_ % kKept];
    if (voxels.received_ns <= tracker.seen_ns()) continue;
    hold_against(voxels, tracker, result);
    ++n;
  }
  return !lost;
}

track::Surroundings Lookout::look(const track::FlightTick& flight, std::int64_t now_ns) noexcept {
  if (const auto* newest = channels_.worlds.control.take())
    channels_.worlds.control.give_back(std::exchange(world_, newest));
  track::Surroundings result;
  result.missing = world_ == nullptr;
  const auto& tracker = flight.tracker();
  if (world_ && flight.odometry()) {
    const auto& grid = world_->world->grid;
    const Vec3& p = flight.odometry()->state.p_W;
    const Vec3 off = (p - grid.origin()) / grid.resolution();
    // Compared before anything is made an integer.
    result.outside = !((off.array() >= 0).all() && (off.array() < grid.size().cast<double>().array()).all());
  }
  result.late = late(tracker, now_ns);

  // Voxels of before a loop closure are where the map was then.
  if (std::exchange(closures_, tracker.closures()) != tracker.closures()) recorded_ = unchecked_ = 0;
  if (std::exchange(segment_, tracker.segment()) != tracker.segment()) unchecked_ = 0;
  if (segment_ != 0 && !catch_up(tracker, result)) result.tube_blocked = result.stop_blocked = true;
  for (auto* ring : {&channels_.scan_voxels, &channels_.map_voxels}) {
    for (int n = 0; n < kRecordsInTick; ++n) {
      const auto voxels = ring->pop();
      if (!voxels) break;
      hold_against(*voxels, tracker, result);
      unchecked_ += unchecked_ == recorded_;
      recent_[recorded_++ % kKept] = *voxels;
    }
  }
  // The planner has found that the newest snapshot does not leave the flight clear.
  if (segment_ != 0 && channels_.blocked_segment.load(std::memory_order_relaxed) == segment_ && !tracker.finished() &&
      !tracker.braking())
    result.tube_blocked = true;
  return result;
}

}  // namespace backwash::daemon
