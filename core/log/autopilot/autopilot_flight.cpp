// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/autopilot/autopilot_flight.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/log/autopilot/turned_attitude.hpp"
#include "core/log/columns/median.hpp"
#include "core/log/raw/tick_log.hpp"

namespace backwash::log {
namespace {

/// The topic with all these columns, or what is missing.
template <std::size_t N>
tl::expected<const TopicLog::Topic*, std::string> topic_with(const TopicLog& topics, const char* name,
                                                             const std::array<const char*, N>& columns) {
  const auto* topic = topics.find(name);
  if (!topic) return tl::unexpected(std::string("has no topic ") + name + "; log it");
  for (const char* column : columns)
    if (!topic->columns.contains(column))
      return tl::unexpected(std::string("topic ") + name + " has no column " + column);
  return topic;
}

/// North, east, down as east, north, up.
Vec3 turned(const TopicLog::Topic& topic, const char* north, const char* east, const char* down, std::size_t row) {
  return {topic.columns.at(east)[row], topic.columns.at(north)[row], -topic.columns.at(down)[row]};
}

}  // namespace

tl::expected<std::vector<AutopilotPose>, std::string> autopilot_poses(const TopicLog& topics, const ClockLine& clock) {
  constexpr std::array kPosition{"x", "y", "z", "vx", "vy", "vz"};
  constexpr std::array kAttitude{"q[0]", "q[1]", "q[2]", "q[3]"};
  const auto position = topic_with(topics, "vehicle_local_position", kPosition);
  if (!position) return tl::unexpected(position.error());
  const auto attitude = topic_with(topics, "vehicle_attitude", kAttitude);
  if (!attitude) return tl::unexpected(attitude.error());
  const auto &p = **position, &a = **attitude;
  std::vector<AutopilotPose> poses;
  for (std::size_t row = 0; row < p.t_s.size(); ++row) {
    const auto after = std::ranges::upper_bound(a.t_s, p.t_s[row]) - a.t_s.begin();
    if (after == 0) continue;
    std::array<double, 4> q;
    for (std::size_t n = 0; n < q.size(); ++n) q[n] = a.columns.at(kAttitude[n])[static_cast<std::size_t>(after) - 1];
    const auto turn = flu_of_frd(enu_of_ned(Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized()));
    poses.push_back({clock.ours(p.t_s[row]),
                     {{turned(p, "x", "y", "z", row), turned(p, "vx", "vy", "vz", row)},
                      {turn.w(), turn.x(), turn.y(), turn.z()}}});
  }
  return poses;
}

std::optional<double> distance_from_link(const RawLog& log, std::span<const AutopilotPose> poses) {
  constexpr std::int64_t kNear_ns = 50'000'000;
  constexpr double kAway = 1;  // m: on its pad every flight is at one place, and a log may hold minutes of that
  std::vector<double> all, away;
  std::optional<Vec3> first_W;
  for (const RawRecord& record : log.records) {
    const auto* row = record.header.kind == RecordKind::tick_input ? payload<TickInputRecord>(record) : nullptr;
    const auto told = row ? decode(*row, nullptr).autopilot.pose : std::nullopt;
    if (!told) continue;
    const auto after = std::ranges::lower_bound(poses, told->at_ns, {}, &AutopilotPose::t_ns);
    if (after == poses.end() || after->t_ns - told->at_ns > kNear_ns) continue;
    const Vec3& here_W = told->state.p_W;
    const double distance = (after->moving.state.p_W - here_W).norm();
    if (!std::isfinite(distance)) continue;  // before the estimator has a position
    if (!first_W) first_W = here_W;
    all.push_back(distance);
    if ((here_W - *first_W).norm() > kAway) away.push_back(distance);
  }
  if (all.empty()) return std::nullopt;
  return median(std::move(away.empty() ? all : away));
}

}  // namespace backwash::log
