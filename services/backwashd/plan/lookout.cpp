// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/plan/lookout.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "core/reach/clearance.hpp"

namespace backwash::daemon {
namespace {

constexpr double kLate = 1.0;              // s (docs/faults.md row 13)
constexpr std::size_t kRecordsInTick = 4;  // of a ring: a full one is empty after two (row 14)
static_assert(2 * kRecordsInTick >= kVoxelRecords);

using Sets = std::span<const reach::TubeStep>;

}  // namespace

/// Sets with boxes around runs of them: a cube far from a run costs a comparison, not one for each set. A minute of
/// flight has 3,000 sets and 1 MB: held each against the voxels of a tick they took several control periods.
class Lookout::Runs {
 public:
  explicit Runs(Sets sets) noexcept : sets_(sets), length_(std::max(kShortest, (sets.size() + kMost - 1) / kMost)) {
    for (std::size_t n = 0; n < sets.size(); ++n) {
      const auto& h = sets[n].half_widths_interval;
      const Vec3 half(h[kX], h[kY], h[kZ]);
      const Vec3 &from = sets[n].center.p_W, &to = sets[std::min(n + 1, sets.size() - 1)].center.p_W;
      boxes_[n / length_].extend(Box(from.cwiseMin(to) - half, from.cwiseMax(to) + half));
    }
  }
  bool blocked(const reach::Cube& cube, double taken) const noexcept {
    constexpr double kRounding = 1e-9;
    const Vec3 margin = Vec3::Constant(taken + cube.edge / 2 + kRounding) + cube.more / 2;
    for (std::size_t from = 0; from < sets_.size(); from += length_) {
      const Box& box = boxes_[from / length_];
      const Vec3 low = box.min() - margin, high = box.max() + margin;
      if ((cube.center.array() < low.array()).any() || (cube.center.array() > high.array()).any()) continue;
      // And the set behind the run: the run's last one is swept until there.
      const Sets run = sets_.subspan(from, std::min(length_ + 1, sets_.size() - from));
      if (reach::first_blocked(run, 0, cube, taken) < run.size()) return true;
    }
    return false;
  }

 private:
  using Box = Eigen::AlignedBox3d;
  static constexpr std::size_t kMost = 128, kShortest = 32;
  Sets sets_;
  std::size_t length_;
  std::array<Box, kMost> boxes_;  // empty at first
};

// Its age shrinks what a live map is trusted for: something may have come nearer meanwhile. The floor that a vehicle is
// lifted off does not, and is what it is nearest to.
bool Lookout::late(const track::FlightTick& flight, std::int64_t now_ns) const noexcept {
  const auto& tracker = flight.tracker();
  if (!map_.live || tracker.finished()) return false;
  const std::optional<double> age = mapped_.map_age(now_ns);
  const bool lifted = flight.mode() == Mode::lifting;
  return !age || *age > kLate || (!lifted && map_.closing_speed * *age > tracker.clearance());
}

// What is ahead, made once in a tick that has something to hold against it.
struct Lookout::Ahead {
  Ahead(const track::Tracker& tracker, double body) noexcept
      : taken(body + tracker.apart_m()),
        back(tracker.shift().inverse()),
        first(tracker.ahead()[0]),
        second(tracker.ahead()[1]),
        to_stop(own(tracker)),
        stopping(tracker.next_stop() ? Sets(tracker.next_stop()->tube) : Sets()) {}
  // The way to the stop's branch is the flight's own; it may be the present entry alone.
  static Sets own(const track::Tracker& tracker) noexcept {
    const plan::Stop* stop = tracker.next_stop();
    const Sets sets = tracker.ahead()[0];
    return sets.first(stop ? std::min(sets.size(), stop->branch - std::min(stop->branch, tracker.index())) : 0);
  }
  // After a loop closure the sets are in the old map frame; a box that is turned a little fits into a larger one.
  reach::Cube box(const NewVoxels& voxels, std::size_t n) const noexcept {
    const double c = std::abs(std::cos(back.yaw)), s = std::abs(std::sin(back.yaw));
    const auto& [x, y, z] = voxels.centers[n];
    const Vec3 more = voxels.edge * Vec3(voxels.more[n][0], voxels.more[n][1], voxels.more[n][2]);
    return {back.point({x, y, z}),
            voxels.edge * (c + s),
            {c * more.x() + s * more.y(), c * more.y() + s * more.x(), more.z()}};
  }

  double taken;            // by the body, and by how far the frames are apart: what the segment was verified with
  track::RigidShift back;  // into the sets' frame
  Runs first, second, to_stop, stopping;
};

void Lookout::hold_against(const NewVoxels& voxels, const Ahead& ahead, track::Surroundings& result) const noexcept {
  for (std::size_t n = 0; n < voxels.count; ++n) {
    const reach::Cube box = ahead.box(voxels, n);
    const auto in = [&](const Runs& runs) { return runs.blocked(box, ahead.taken); };
    if (!result.tube_blocked) result.tube_blocked = in(ahead.first) || in(ahead.second);
    if (!result.stop_blocked) result.stop_blocked = in(ahead.to_stop) || in(ahead.stopping);
  }
}

// What was seen between the snapshot that the segment was verified in and its acceptance, up to record `end`. False:
// not all of it is kept.
bool Lookout::catch_up(std::size_t end, std::int64_t seen_ns, const Ahead& ahead,
                       track::Surroundings& result) noexcept {
  const std::size_t oldest = recorded_ - std::min(recorded_, kKept);
  const bool lost = unchecked_ < oldest && oldest > 0 && recent_[oldest % kKept].received_ns > seen_ns;
  unchecked_ = std::max(unchecked_, oldest);
  for (std::size_t n = 0; unchecked_ < end && n < kRecordsInTick; ++unchecked_) {
    const NewVoxels& voxels = recent_[unchecked_ % kKept];
    if (voxels.received_ns <= seen_ns) continue;
    hold_against(voxels, ahead, result);
    ++n;
  }
  return !lost;
}

void Lookout::take_new(std::int64_t now_ns) noexcept {
  const auto keep = [&](const NewVoxels& voxels) { recent_[recorded_++ % kKept] = voxels; };
  for (auto* ring : {&mapped_.scan_voxels, &mapped_.map_voxels})
    for (std::size_t n = 0; n < kRecordsInTick; ++n)
      if (const auto voxels = ring->pop()) keep(*voxels);
  const std::uint64_t lost = mapped_.scan_voxels.lost() + mapped_.map_voxels.lost();
  if (std::exchange(lost_, lost) != lost) {
    constexpr double kEverywhere = 1e9;  // m
    keep({now_ns, kEverywhere, 1});
  }
}

track::Surroundings Lookout::look(const track::FlightTick& flight, std::int64_t now_ns) noexcept {
  if (const auto* newest = mapped_.worlds.control.take())
    mapped_.worlds.control.give_back(std::exchange(world_, newest));
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
  result.late = late(flight, now_ns);

  // Voxels of before a loop closure are where the map was then.
  if (std::exchange(closures_, tracker.closures()) != tracker.closures()) recorded_ = unchecked_ = 0;
  if (std::exchange(segment_, tracker.segment()) != tracker.segment()) unchecked_ = 0;
  const std::size_t before = recorded_;
  take_new(now_ns);
  if (unchecked_ < recorded_) {
    const Ahead ahead(tracker, taken_);
    if (segment_ != 0 && !catch_up(before, tracker.seen_ns(), ahead, result))
      result.tube_blocked = result.stop_blocked = true;
    for (std::size_t n = before; n < recorded_; ++n) hold_against(recent_[n % kKept], ahead, result);
    if (segment_ == 0 || unchecked_ == before) unchecked_ = recorded_;
  }
  // The planner has found that the newest snapshot does not leave the flight clear.
  const bool goes_on = segment_ != 0 && !tracker.finished() && !tracker.braking();
  if (goes_on && planned_.blocked_segment.load(std::memory_order_relaxed) == segment_) result.tube_blocked = true;
  result.rougher = goes_on && planned_.rough_segment.load(std::memory_order_relaxed) == segment_;
  return result;
}

}  // namespace backwash::daemon
