// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/mission.hpp"

#include <spdlog/spdlog.h>

#include <thread>

#include "core/plan/planner.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {
namespace {

constexpr std::uint8_t kAccepted = backwash_msgs_msg_dds__ACK_ACCEPTED;
constexpr std::uint8_t kRefused = backwash_msgs_msg_dds__ACK_REFUSED;
constexpr std::uint8_t kNotYours = backwash_msgs_msg_dds__ACK_NOT_YOURS;
constexpr std::uint8_t kInvalid = backwash_msgs_msg_dds__ACK_INVALID;

constexpr double kRetry = 1.0;  // s from the end of one job to the next try

Answer accepted(std::string what) { return {kAccepted, std::move(what)}; }
Answer refused(std::string why) { return {kRefused, std::move(why)}; }

double seconds_now() { return static_cast<double>(now_ns()) * 1e-9; }

}  // namespace

void Mission::refresh() {
  channels_.jobs.collect();
  if (const auto view = channels_.view_mission.read_new()) view_ = *view;
  if (const auto* world = channels_.worlds.mission.take()) {
    world_ = *world;
    channels_.worlds.mission.give_back(world);
  }
  while (const auto outcome = channels_.outcomes.pop()) {
    if (job_ != outcome->job) continue;  // a newer command took its place
    job_.reset();
    report(outcome->ok ? "" : std::string("refused: ") + outcome->reason.data());
    retry_at_s_ = seconds_now() + kRetry;
    if (outcome->ok) continue;
    spdlog::warn("refused: {}", outcome->reason.data());
    if (view_.reason != track::Reason::obstacle_ahead) route_.clear();
  }
  continue_route();
  judge_place(seconds_now());
}

// Whether map and vehicle overlap such that it could take off: for `backwashctl check`.
void Mission::judge_place(double now_s) {
  constexpr double kEvery = 1.0;  // s
  if (now_s < judge_at_s_) return;
  judge_at_s_ = now_s + kEvery;
  std::string why;
  if (!world_) {
    why = "no map was received yet";
  } else if (const Index3 v = world_->grid.index(view_.state.p_W); !world_->grid.inside(v)) {
    why = "the vehicle is outside the map";
  } else if (!world_->grid.free(v)) {
    why = "the vehicle is in a voxel that is not free";
  } else if (view_.landed && !plan::takeoff_column(*world_, view_.state.p_W)) {
    why = "there is no clear hover height above a known floor here";
  }
  std::array<char, 192> line{};
  std::snprintf(line.data(), line.size(), "%s", why.c_str());
  channels_.place.write(line);
}

// To the next goal of a route at rest at the last one; and to the same goal again where the flight came to rest on the
// way: something stood in it, or the map did not show more of it yet.
void Mission::continue_route() {
  constexpr double kAtGoal = 0.01, kRest = 0.1;  // m, m/s
  const bool tracking = view_.mode == track::Mode::tracking;
  if (!tracking && view_.mode != track::Mode::hold) route_.clear();
  if (route_.empty() || job_ || !view_.finished) return;
  if (tracking && (view_.command.p_W - route_.front().position).norm() < kAtGoal) {
    route_.pop_front();
    if (!route_.empty()) start(PlanJob::Kind::go_to, route_.front());
  } else if ((tracking || view_.reason == track::Reason::obstacle_ahead) && view_.state.v_W.norm() < kRest &&
             seconds_now() > retry_at_s_) {
    start(PlanJob::Kind::go_to, route_.front());
  }
}

void Mission::report(const std::string& task) {
  std::array<char, 192> line{};
  std::snprintf(line.data(), line.size(), "%s", task.c_str());
  channels_.task.write(line);
}

std::string Mission::station(double now_s) const {
  return lease_ && now_s < lease_->until_s ? lease_->station : std::string();
}

Answer Mission::handle(const CommandMessage& command, double now_s) {
  const std::string from(command.station.data());
  if (from.empty() || !command.position.allFinite() || !std::isfinite(command.yaw))
    return {kInvalid, "a command needs a station name and finite numbers"};
  if (const std::string holder = station(now_s); !holder.empty() && holder != from) {
    ++channels_.commands_refused;
    return {kNotYours, "session held by " + holder};
  }
  if (!lease_ || lease_->station != from || lease_->session != command.session) {
    lease_ = Lease{from, command.session, command.sequence, 0, {}};
  } else if (command.sequence == lease_->sequence) {
    return lease_->last;
  } else if (command.sequence < lease_->sequence) {
    return {kInvalid, "sequence number " + std::to_string(command.sequence) + " is older than " +
                          std::to_string(lease_->sequence)};
  }
  lease_->sequence = command.sequence;
  lease_->until_s = now_s + kLease;
  lease_->last = decide(command);
  const Answer answer = lease_->last;
  if (answer.result != kAccepted) ++channels_.commands_refused;
  if (command.verb == backwash_msgs_msg_dds__COMMAND_RELEASE) lease_.reset();
  return answer;
}

Answer Mission::decide(const CommandMessage& command) {
  const bool commanding = view_.mode == track::Mode::tracking || view_.mode == track::Mode::hold;
  switch (command.verb) {
    case backwash_msgs_msg_dds__COMMAND_ENABLE:
      return enable();
    case backwash_msgs_msg_dds__COMMAND_DISABLE:
      if (view_.armed) return refused("the vehicle is armed: land first");
      channels_.requests.push(track::Request::disable);
      return accepted("disabling");
    case backwash_msgs_msg_dds__COMMAND_TAKEOFF:
      return take_off(command);
    case backwash_msgs_msg_dds__COMMAND_GOTO:
    case backwash_msgs_msg_dds__COMMAND_GOTO_FACING:
      return go_to(command);
    case backwash_msgs_msg_dds__COMMAND_FOLLOW:
      return follow(command);
    case backwash_msgs_msg_dds__COMMAND_HOLD:
      if (!commanding) return refused("not enabled");
      route_.clear();
      return start(PlanJob::Kind::brake);
    case backwash_msgs_msg_dds__COMMAND_STOP:
      return stop();
    case backwash_msgs_msg_dds__COMMAND_LAND:
      if (!commanding) return refused("not enabled");
      route_.clear();
      channels_.requests.push(track::Request::land);
      return accepted("landing");
    case backwash_msgs_msg_dds__COMMAND_RELEASE:
      return accepted("session released");
    default:
      return {kInvalid, "unknown command " + std::to_string(command.verb)};
  }
}

// What has to be right before the daemon takes control; the frames are judged by the supervisor while it is enabling.
Answer Mission::enable() {
  if (view_.mode != track::Mode::passive && view_.mode != track::Mode::quiet)
    return refused(std::string("already ") + to_string(view_.mode));
  if (!world_) return refused("no map was received yet");
  if (view_.mismatch != track::Mismatch::none)
    return refused(std::string("map and autopilot disagree: ") + to_string(view_.mismatch));
  if (view_.odometry_age > track::Supervisor::kHoldAfter) return refused("no odometry");
  if (view_.heartbeat_age > track::Supervisor::kHeartbeatLost) return refused("no heartbeat from the autopilot");
  if (!world_->grid.inside(world_->grid.index(view_.state.p_W))) return refused("the vehicle is outside the map");
  channels_.requests.push(track::Request::enable);
  return accepted("enabling");
}

Answer Mission::take_off(const CommandMessage& command) {
  if (view_.mode != track::Mode::tracking) return refused("not enabled");
  if (!view_.landed) return refused("already in the air");
  return start(PlanJob::Kind::takeoff, {command.position, {}});
}

Answer Mission::go_to(const CommandMessage& command) {
  if (view_.mode != track::Mode::tracking && view_.mode != track::Mode::hold) return refused("not enabled");
  if (view_.landed) return refused("on the ground: take off first");
  if (!view_.finished) return refused("flying: hold first");
  Goal goal{command.position, {}};
  if (command.verb == backwash_msgs_msg_dds__COMMAND_GOTO_FACING) goal.yaw = command.yaw;
  const Answer answer = start(PlanJob::Kind::go_to, goal);
  if (answer.result == kAccepted) route_ = {goal};
  return answer;
}

Answer Mission::follow(const CommandMessage& command) {
  if (command.waypoints == 0 || command.waypoints > command.kMostWaypoints)
    return {kInvalid, "follow needs 1 to " + std::to_string(command.kMostWaypoints) + " waypoints"};
  CommandMessage first = command;
  std::deque<Goal> route;
  for (std::size_t n = 0; n < command.waypoints; ++n) {
    const auto& p = command.waypoint[n];
    route.push_back({{p[0], p[1], p[2]}, {}});
    if (!route.back().position.allFinite()) return {kInvalid, "a waypoint is not finite"};
  }
  first.position = route.front().position;
  const Answer answer = go_to(first);
  if (answer.result == kAccepted) route_ = std::move(route);
  return answer;
}

Answer Mission::stop() {
  if (view_.mode == track::Mode::passive || view_.mode == track::Mode::quiet) return refused("not enabled");
  route_.clear();
  job_.reset();
  const bool standing = view_.landed && !view_.armed;
  channels_.requests.push(standing ? track::Request::disable : track::Request::stop);
  return accepted(standing ? "disabling" : "stopping");
}

Answer Mission::start(PlanJob::Kind kind, const Goal& goal) {
  if (!world_) return refused("no map was received yet");
  if (job_ && kind != PlanJob::Kind::brake) return refused("still planning the last command");
  job_ = ++last_job_;
  channels_.jobs.offer(std::make_unique<const PlanJob>(PlanJob{kind, *job_, goal.position, goal.yaw, world_}));
  report("planning");
  return accepted("planning");
}

void run_mission(Channels& channels, Mission& mission, const SendAnswer& answer) {
  while (!channels.stop) {
    mission.refresh();
    while (const auto command = channels.commands.pop()) {
      if (command->departed) continue;
      const Answer a = mission.handle(*command, seconds_now());
      spdlog::info("command {} from {}: {}", command->verb, command->station.data(), a.reason);
      answer(*command, a);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

}  // namespace backwash::daemon
