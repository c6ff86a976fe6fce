// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/plan/mission.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/plan/planner.hpp"
#include "core/types/formatted.hpp"
#include "services/backwashd/control/doubts.hpp"
#include "services/backwashd/control/switch_reaction.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {
namespace {

using track::Request;

constexpr std::uint8_t kAccepted = backwash_msgs_msg_dds__ACK_ACCEPTED;
constexpr std::uint8_t kRefused = backwash_msgs_msg_dds__ACK_REFUSED;
constexpr std::uint8_t kNotYours = backwash_msgs_msg_dds__ACK_NOT_YOURS;
constexpr std::uint8_t kInvalid = backwash_msgs_msg_dds__ACK_INVALID;

constexpr double kRetry = 1.0;             // s from the end of one job to the next try
constexpr double kJudgeEvery = 1.0;        // s
constexpr std::uint64_t kMostOrders = 16;  // on their way at once; a STOP always finds room behind them

Decision only(std::uint8_t result, std::string what) { return {Answer{result, std::move(what)}, {}, {}}; }
Decision refused(std::string why) { return only(kRefused, std::move(why)); }

constexpr const char* kGroundUnknown = "the autopilot does not say whether the vehicle stands on the ground";

bool flies(Mode mode) { return mode == Mode::tracking || mode == Mode::hold; }

Decision invalid(std::string why) { return {Answer{backwash_msgs_msg_dds__ACK_INVALID, std::move(why)}, {}, {}}; }

/// The heading from a place towards a point that is faced; none where the point is the place itself, or above or below.
std::optional<double> heading_towards(const Vec3& place, const Vec3& point) {
  constexpr double kNear = 1e-3;  // m
  const Vec3 d = point - place;
  return d.head<2>().norm() < kNear ? std::nullopt : std::optional(std::atan2(d.y(), d.x()));
}

}  // namespace

Decision Mission::observe(const MissionInput& in) {
  if (in.view) view_ = *in.view;
  if (in.world) world_ = *in.world;
  if (in.other_daemon) other_daemon_ = in.other_daemon->data();
  if (in.odometry_doubt) odometry_doubt_ = in.odometry_doubt->data();
  for (const PlanOutcome& outcome : in.outcomes) {
    if (job_ != outcome.job) continue;  // a newer command took its place
    job_.reset();
    task_ = outcome.ok ? (route_.size() > 1 ? kToGo + std::to_string(route_.size()) : "")
                       : std::string(kRefusedTask) + outcome.reason.data();
    retry_at_s_ = in.now_s + kRetry;
    if (!outcome.ok && view_.reason != Reason::obstacle_ahead) route_.clear();
  }
  if (in.now_s >= judge_at_s_) {
    judge_at_s_ = in.now_s + kJudgeEvery;
    place_ = judge_place();
  }
  return {{}, {}, continue_route(in.now_s)};
}

// Whether map and vehicle overlap such that it could take off: for `backwashctl check`.
std::string Mission::judge_place() const {
  if (!world_) return "no map was received yet";
  const Index3 v = world_->grid.index(view_.state.p_W);
  if (!world_->grid.inside(v)) return "the vehicle is outside the map";
  if (!world_->grid.free(v)) return "the vehicle is in a voxel that is not free";
  if (view_.landed.value_or(false) && !plan::takeoff_column(*world_, view_.state.p_W, view_.residual_m))
    return "there is no clear hover height above a known floor here";
  return "";
}

std::string Mission::station(double now_s) const {
  return lease_ && now_s < lease_->until_s ? lease_->station : std::string();
}

void Mission::end_lease() {
  if (!lease_) return;
  ended_.push_back(lease_->session);
  if (ended_.size() > kEndedSessions) ended_.pop_front();
  lease_.reset();
}

/// Why the command is not this session's to give now, or the answer that it got before; nothing if it is to be decided.
std::optional<Answer> Mission::session(const CommandMessage& command, double now_s) {
  const std::string from(command.station.data());
  const bool ours = lease_ && lease_->writer == command.writer && lease_->session == command.session;
  if (!ours) {
    if (std::ranges::find(ended_, command.session) != ended_.end())
      return Answer{kInvalid, "session " + std::to_string(command.session) + " is over: a station begins a new one"};
    const std::string holder = station(now_s);
    if (!holder.empty() && lease_->writer != command.writer)
      return Answer{kNotYours, "session held by " + holder + (holder == from ? ", another process of that name" : "")};
    end_lease();
    lease_ = Lease{command.writer, from, command.session, command.sequence, 0, command.verb, {}};
    return std::nullopt;
  }
  if (command.sequence == lease_->sequence) return lease_->last;
  if (command.sequence < lease_->sequence)
    return Answer{kInvalid, "sequence number " + std::to_string(command.sequence) + " is older than " +
                                std::to_string(lease_->sequence)};
  return std::nullopt;
}

Decision Mission::handle(const CommandMessage& command, double now_s) {
  if (command.departed) {
    if (lease_ && lease_->writer == command.writer) end_lease();
    return {};
  }
  // Whoever sees that the flight must end may end it, whatever else is wrong with the command; the lease stays where it
  // is. Only the repeat of a STOP is no new one.
  const bool stops = command.verb == backwash_msgs_msg_dds__COMMAND_STOP;
  if (command.station[0] == 0 || !command.position.allFinite() || !std::isfinite(command.yaw))
    return stops ? stop(command) : only(kInvalid, "a command needs a station name and finite numbers");
  if (const auto answered = session(command, now_s)) {
    const bool repeat = lease_ && lease_->session == command.session && lease_->writer == command.writer &&
                        lease_->sequence == command.sequence && lease_->verb == command.verb;
    return stops && !repeat ? stop(command) : Decision{answered, {}, {}};
  }
  Decision decision = decide(command);
  lease_->sequence = command.sequence;
  lease_->verb = command.verb;
  lease_->until_s = now_s + kLease;
  lease_->last = *decision.answer;
  const bool releases = command.verb == backwash_msgs_msg_dds__COMMAND_RELEASE;
  if (!releases && !decision.air && decision.answer->result == kAccepted)
    accepted_ = {command.session, command.sequence};
  if (releases) end_lease();
  return decision;
}

Decision Mission::decide(const CommandMessage& command) {
  switch (command.verb) {
    case backwash_msgs_msg_dds__COMMAND_ENABLE:
      return enable();
    case backwash_msgs_msg_dds__COMMAND_DISABLE:
      if (view_.armed && view_.mode != Mode::enabling) return refused("the vehicle is armed: land first");
      return order(Request::disable, "disabling");
    case backwash_msgs_msg_dds__COMMAND_TAKEOFF:
      return take_off(command);
    case backwash_msgs_msg_dds__COMMAND_GOTO:
    case backwash_msgs_msg_dds__COMMAND_GOTO_FACING:
      return go_to(command);
    case backwash_msgs_msg_dds__COMMAND_FOLLOW:
    case backwash_msgs_msg_dds__COMMAND_FOLLOW_FACING:
      return follow(command);
    case backwash_msgs_msg_dds__COMMAND_HOLD:
      return hold();
    case backwash_msgs_msg_dds__COMMAND_STOP:
      return stop(command);
    case backwash_msgs_msg_dds__COMMAND_LAND:
      return land();
    case backwash_msgs_msg_dds__COMMAND_RELEASE:
      return only(kAccepted, "session released");
    case backwash_msgs_msg_dds__COMMAND_AIR_RESET:
      return ask_of_air(adapt::AirOrder::reset);
    case backwash_msgs_msg_dds__COMMAND_AIR_FREEZE:
      return ask_of_air(adapt::AirOrder::freeze);
    case backwash_msgs_msg_dds__COMMAND_AIR_THAW:
      return ask_of_air(adapt::AirOrder::thaw);
    default:
      return only(kInvalid, "unknown command " + std::to_string(command.verb));
  }
}

/// An order to the control thread: it ends what was asked for before it. The same order again, while that is still on
/// its way, is that order: nothing was planned since. So however many ask, there is always room for another one.
Decision Mission::order(Request request, std::string answer) {
  const bool again = order_under_way() && request == last_request_;
  if (!again && request != Request::stop && orders_ >= view_.epoch.order + kMostOrders)
    return refused("the last orders are still being carried out: ask again");
  route_.clear();
  job_.reset();
  task_.clear();
  Decision decision{Answer{kAccepted, std::move(answer)}, {}, {}};
  if (again) return decision;
  last_request_ = request;
  decision.order = track::Order{request, ++orders_};
  return decision;
}

// What has to be right before the daemon takes control; the frames are judged by the supervisor while it is enabling.
Decision Mission::enable() {
  if (order_under_way()) return refused("the last order is still being carried out: ask again");
  if (view_.mode == Mode::hold)
    return refused(std::string("already hold (") + to_string(view_.reason) + ")" +
                   (view_.landed.value_or(false) ? ": land ends it, then enable" : ""));
  if (track::commanding(view_.mode)) return refused(std::string("already ") + to_string(view_.mode));
  if (!may_fly(view_.stop_switch)) return refused(refusal(view_.stop_switch));
  if (!other_daemon_.empty()) return refused(other_daemon_);
  if (!odometry_doubt_.empty()) return refused(odometry_doubt_);
  if (!world_) return refused("no map was received yet");
  if (view_.mismatch != Mismatch::none)
    return refused(std::string("map and autopilot disagree: ") + to_string(view_.mismatch));
  if (view_.odometry_age > view_.odometry_lost_after) return refused("no odometry");
  if (view_.heartbeat_age > track::Supervisor::kHeartbeatLost) return refused("no heartbeat from the autopilot");
  if (view_.pose_age > track::Supervisor::kPoseSilent)
    return refused("no pose from the autopilot: its estimator does not follow the VIO yet, or its stream is off");
  for (const auto& [what, doubt] : doubts_of(view_, vehicle_))
    if (std::string_view(what) != dds::kArming) return refused(std::string(what) + ": " + doubt);
  if (!world_->grid.inside(world_->grid.index(view_.state.p_W))) return refused("the vehicle is outside the map");
  const std::string forbids =
      firmware_bridge::forbidding_parameter(*view_.autopilot, view_.parameters, vehicle_, view_.untold_delay);
  if (!forbids.empty()) return refused(forbids);
  return order(Request::enable, "enabling");
}

Decision Mission::take_off(const CommandMessage& command) {
  if (view_.mode == Mode::lifting) return refused("taking off already");
  if (view_.mode != Mode::tracking) return refused("not enabled");
  if (!view_.landed) return refused(kGroundUnknown);
  if (!*view_.landed) return refused("already in the air");
  if (!view_.finished) return refused("already taking off");
  return start(PlanJob::Kind::takeoff, {command.position, {}});
}

Decision Mission::go_to(const CommandMessage& command) {
  Goal goal{command.position, {}};
  if (command.verb == backwash_msgs_msg_dds__COMMAND_GOTO_FACING) goal.yaw = command.yaw;
  return fly({goal});
}

/// To the first goal, and from each to the next one.
Decision Mission::fly(std::deque<Goal> route) {
  if (view_.mode == Mode::lifting) return refused("taking off: wait until it is in the air");
  if (!flies(view_.mode)) return refused("not enabled");
  if (!view_.landed) return refused(kGroundUnknown);
  if (*view_.landed) return refused("on the ground: take off first");
  if (!view_.finished)
    return refused(view_.mode == Mode::hold ? "it is still coming to rest: ask again" : "flying: hold first");
  Decision decision = start(PlanJob::Kind::go_to, route.front());
  if (decision.job) {
    route_ = std::move(route);
    if (view_.mode == Mode::hold) held_ = view_.epoch.lapse;
  }
  return decision;
}

/// It flies in the mode that follows set-points, and nobody sends any: of a daemon that died, or went quiet.
bool Mission::abandoned() const {
  return (view_.mode == Mode::passive || view_.mode == Mode::quiet) && view_.armed && view_.offboard;
}

/// Also where it was asked for before: the line may have lost that.
Decision Mission::land() {
  const bool followed = view_.mode == Mode::enabling && view_.armed && view_.offboard;
  const bool ours = flies(view_.mode) || view_.mode == Mode::lifting || view_.mode == Mode::land;
  return ours || followed || abandoned() ? order(Request::land, "landing") : refused("not enabled");
}

/// What was planned ends at once; a plan that slows the flight down on its path follows.
Decision Mission::hold() {
  if (!flies(view_.mode)) return refused("not enabled");
  Decision decision = order(Request::hold, "planning");
  if (world_ && decision.answer->result == kAccepted) decision.job = start(PlanJob::Kind::brake).job;
  return decision;
}

/// Goes to the control thread in every mode: what is shown here may be a moment old, and an order to enable on its way.
Decision Mission::stop(const CommandMessage& command) {
  const bool idle = view_.mode == Mode::passive || view_.mode == Mode::quiet;
  const bool pending = order_under_way();
  const bool standing = view_.landed.value_or(false) && !view_.armed;
  const Mode mode = view_.mode;
  const char* const alone = abandoned() ? "landing: no stop is verified" : "stopping";
  Decision decision = order(Request::stop, standing ? "disabling" : alone);
  if (mode == Mode::land) decision.answer = {kRefused, "landing: the autopilot lands, and ends that by itself"};
  if (idle && !pending && !abandoned()) decision.answer = {kRefused, "not enabled"};
  if (decision.answer->result == kAccepted) accepted_ = {command.session, command.sequence};
  return decision;
}

/// Neither freezing nor thawing makes a set smaller, so both are taken in flight; a reset does.
Decision Mission::ask_of_air(adapt::AirOrder order) const {
  if (!view_.air) return refused("nothing is learnt of the air: adaptation.enabled is false");
  const bool resets = order == adapt::AirOrder::reset;
  if (resets && (view_.armed || track::commanding(view_.mode)))
    return refused(std::string("a reset makes sets smaller: not while ") +
                   (view_.armed ? "the vehicle is armed: land first" : "enabled: disable first"));
  Decision decision = only(kAccepted, resets ? "resetting" : order == adapt::AirOrder::freeze ? "freezing" : "thawing");
  decision.air = order;
  return decision;
}

Decision Mission::start(PlanJob::Kind kind, const Goal& goal) {
  if (!may_fly(view_.stop_switch)) return refused(refusal(view_.stop_switch));
  if (!world_) return refused("no map was received yet");
  if (kind != PlanJob::Kind::brake) {
    if (job_) return refused("still planning the last command");
    // A station may have set it since: the autopilot tells each change, unasked.
    const std::string changed =
        firmware_bridge::forbidding_parameter(*view_.autopilot, view_.parameters, vehicle_, view_.untold_delay, false);
    if (!changed.empty()) return refused(changed);
    if (order_under_way()) return refused("the last order is still being carried out: ask again");
  }
  job_ = ++last_job_;
  task_ = "planning";
  return {
      Answer{kAccepted, "planning"}, {}, PlanJob{kind, *job_, goal.position, goal.yaw, {orders_, view_.epoch.lapse}}};
}

// Routes of several goals: how one is told, and when it goes on by itself.

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
