// SPDX-License-Identifier: BSD-3-Clause
// Routes of several goals: how one is told, and when it goes on by itself.
#include <cmath>
#include <utility>

#include "services/backwashd/mission.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {
namespace {

Decision invalid(std::string why) { return {Answer{backwash_msgs_msg_dds__ACK_INVALID, std::move(why)}, {}, {}}; }

/// The heading from a place towards a point that is faced; none where the point is the place itself, or above or below.
std::optional<double> heading_towards(const Vec3& place, const Vec3& point) {
  constexpr double kNear = 1e-3;  // m
  const Vec3 d = point - place;
  return d.head<2>().norm() < kNear ? std::nullopt : std::optional(std::atan2(d.y(), d.x()));
}

}  // namespace

Decision Mission::follow(const CommandMessage& command) {
  const bool facing = command.verb == backwash_msgs_msg_dds__COMMAND_FOLLOW_FACING;
  const std::size_t each = facing ? 2 : 1, most = command.kMostWaypoints / each;
  if (command.waypoints == 0 || command.waypoints > command.kMostWaypoints || command.waypoints % each != 0)
    return invalid("follow needs 1 to " + std::to_string(most) + (facing ? " pairs of waypoints" : " waypoints"));
  std::deque<Goal> route;
  for (std::size_t n = 0; n < command.waypoints; n += each) {
    const auto &p = command.waypoint[n], &ahead = command.waypoint[n + each - 1];
    const Vec3 place(p[0], p[1], p[2]), faced(ahead[0], ahead[1], ahead[2]);
    if (!place.allFinite() || !faced.allFinite()) return invalid("a waypoint is not finite");
    route.push_back({place, heading_towards(place, faced)});
  }
  return fly(std::move(route));
}

// To the next goal of a route at rest at the last one; and to the same goal again where the flight came to rest on the
// way: something stood in it, or the map did not show more of it yet.
std::optional<PlanJob> Mission::continue_route(double now_s) {
  constexpr double kAtGoal = 0.01, kRest = 0.1;  // m, m/s
  const bool tracking = view_.mode == Mode::tracking;
  const bool obstacle = view_.mode == Mode::hold && view_.reason == Reason::obstacle_ahead;
  // Any other mode, and any other hold, is an operator's to end: by a route, too, whose flight has yet to be accepted.
  if (tracking) held_ = std::nullopt;
  const bool ending = view_.mode == Mode::hold && held_ == view_.epoch.lapse;
  if (!tracking && !obstacle && !ending) {
    route_.clear();
    if (task_.starts_with(kToGo)) task_.clear();
  }
  if (route_.empty() || job_ || order_under_way() || !view_.finished) return std::nullopt;
  if (tracking && (view_.command.p_W - route_.front().position).norm() < kAtGoal) {
    route_.pop_front();
    if (!route_.empty()) return start(PlanJob::Kind::go_to, route_.front()).job;
  } else if (view_.state.v_W.norm() < kRest && now_s > retry_at_s_) {
    return start(PlanJob::Kind::go_to, route_.front()).job;
  }
  return std::nullopt;
}

}  // namespace backwash::daemon
