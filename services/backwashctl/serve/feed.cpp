// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/serve/feed.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/map/octomap/octomap_message.hpp"

namespace backwash::ctl {
namespace {

Vec3 vector_of(const geometry_msgs_msg_dds__Point_& p) { return {p.x, p.y, p.z}; }

/// Statuses that preflight's rates are made of.
constexpr std::chrono::seconds kWatch{2};

}  // namespace

Feed::Feed(const dds::Participant& participant, const std::string& name_space)
    : statuses_(dds::make_reader<dds::Status>(participant, name_space)),
      batteries_(dds::make_reader<dds::BatteryState>(participant, name_space)),
      trajectories_(dds::make_reader<dds::Path>(participant, name_space)),
      tubes_(dds::make_reader<dds::Tube>(participant, name_space)),
      maps_(dds::make_reader<dds::Octomap>(participant, name_space)),
      waitset_(participant) {
  waitset_.add(statuses_);
  waitset_.add(batteries_);
  waitset_.add(trajectories_);
  waitset_.add(tubes_);
  waitset_.add(maps_);
}

Seen Feed::seen() const {
  const std::lock_guard lock(mutex_);
  return seen_;
}

void Feed::step() {
  waitset_.wait(0.05);
  take_status();
  take_battery();
  take_path();
  take_map();
}

void Feed::take_status() {
  std::optional<StatusCopy> newest;
  statuses_.take([&](const dds::Status& s) { newest = copy_of(s); });
  if (!newest) return;
  const auto now = Clock::now();
  // What another daemon, or this one before a gap, has counted is no beginning of a rate.
  if (!lately_.empty() &&
      (now - lately_.back().first > kWatch || newest->said.ticks < lately_.back().second.said.ticks))
    lately_.clear();
  lately_.emplace_back(now, *newest);
  while (lately_.size() > 2 && now - lately_[1].first >= kWatch) lately_.pop_front();
  std::vector<Finding> findings;
  if (const auto spent = now - lately_.front().first; spent >= kWatch)
    findings = preflight(lately_.front().second, *newest, std::chrono::duration<double>(spent).count());
  const std::lock_guard lock(mutex_);
  seen_.status = std::move(newest);
  seen_.status_at = now;
  seen_.preflight = std::move(findings);
}

void Feed::take_battery() {
  const auto said = [](float value) { return std::isfinite(value) ? std::optional<double>(value) : std::nullopt; };
  batteries_.take([&](const dds::BatteryState& b) {
    const std::lock_guard lock(mutex_);
    seen_.battery = {dds::nanoseconds(b.header.stamp), said(b.percentage), said(b.voltage)};
  });
}

void Feed::take_path() {
  bool changed = trajectories_.take([&](const dds::Path& line) {
    path_.commands_W.clear();
    for (std::uint32_t n = 0; n < line.poses._length; ++n)
      path_.commands_W.push_back(vector_of(line.poses._buffer[n].pose.position));
    line_stamp_ = dds::nanoseconds(line.header.stamp);
  }) > 0;
  changed = tubes_.take([&](const dds::Tube& tube) {
    path_.tube.clear();
    for (std::uint32_t n = 0; n < tube.steps._length; ++n) {
      const dds::TubeStep& step = tube.steps._buffer[n];
      ShownSet set{vector_of(step.center), {}};
      std::copy_n(step.half_widths, kDirections, set.half_widths.begin());
      path_.tube.push_back(set);
    }
    tube_stamp_ = dds::nanoseconds(tube.header.stamp);
  }) > 0 || changed;
  if (!changed || line_stamp_ != tube_stamp_) return;
  const std::lock_guard lock(mutex_);
  ++seen_.path_number;
  seen_.path = std::make_shared<const ShownPath>(path_);
}

void Feed::take_map() {
  maps_.take([&](const dds::Octomap& m) {
    const auto* data = reinterpret_cast<const std::int8_t*>(m.data._buffer);
    auto grid = map::decode_octomap({data, m.data._length}, m.resolution, m.binary, m.id ? m.id : "");
    const std::lock_guard lock(mutex_);
    ++seen_.map_number;
    seen_.map_refused = grid ? "" : grid.error().message;
    seen_.grid = grid ? std::make_shared<const map::OccupancyGrid>(*std::move(grid)) : nullptr;
  });
}

}  // namespace backwash::ctl
