// SPDX-License-Identifier: BSD-3-Clause
// What each event does.
#include "tests/daemon/plan/epoch_model.hpp"

#include "core/plan/stop.hpp"
#include "tests/track/flown/flown.hpp"

namespace backwash::daemon::test::epoch {

using track::test::tube_of;

void EpochModel::fail(const std::string& what) {
  if (failed_) return;
  failed_ = true;
  std::string events;
  for (const int e : path_) events += std::string(events.empty() ? "" : ", ") + kNames[e];
  ADD_FAILURE() << what << " after: " << events << ", from " << from_;
}

void EpochModel::tick(Daemon& d) {
  d.in.now_ns += 20'000'000;
  for (const auto& order : d.sent) d.orders.add(order);
  d.sent.clear();
  const auto order = d.orders.next();
  d.in.request = order.request;
  d.in.order = order.number;
  const auto offered = std::exchange(d.offered, nullptr);
  d.in.segment = offered.get();
  d.in.surroundings.tube_blocked = std::exchange(d.world_changed, false);
  // A vehicle that follows perfectly; the motors run a tick after they were asked to.
  if (!d.in.odometry) d.in.odometry = OdometrySample{};
  d.in.odometry->received_ns = d.in.odometry->stamp_ns = d.in.now_ns;
  const Vec3 faster = d.out.command.v_W - d.in.odometry->state.v_W;  // by at most 10 m/s²
  d.in.odometry->state.v_W += std::min(1.0, 10 * kControlPeriod / std::max(1e-9, faster.norm())) * faster;
  // To the last bit no two samples of a flying vehicle are alike.
  d.in.odometry->state.p_W = d.before + Vec3(d.in.now_ns / 20'000'000 % 2 ? 1e-9 : 0, 0, 0);
  d.in.autopilot.pose = track::AutopilotFacts::Pose{d.in.now_ns, d.in.odometry->state, {1, 0, 0, 0}, d.in.now_ns};
  if (d.arming > 0 && --d.arming == 0) d.in.autopilot.armed = true;
  d.in.autopilot.landed = d.before.z() < 0.5;

  const bool armed_before = d.in.autopilot.armed;
  d.out = d.tick.step(d.in);
  const auto& out = d.out;
  if (out.accepted) {
    d.flown = offered;
    d.alive.push_back(offered);
  }
  if (out.arm) {
    if (!(out.accepted && offered->arms && d.takeoff_asked)) fail("armed without the take-off that was asked for");
    if (!armed_before) d.arming = 2;
  }
  if (out.disarm && d.in.autopilot.landed.value_or(false)) {
    d.in.autopilot.armed = false;
    d.arming = 0;
  }
  const bool follows = out.supervisor.send_setpoint;
  const Vec3 now = follows ? out.command.p_W : d.before;
  if (d.since_end >= 0) {
    ++d.since_end;
    const int run_out = d.held ? kRunOutHold : kRunOut;
    if (now != d.before && d.since_end > run_out)
      fail("a set-point moved " + std::to_string(d.since_end) + " ticks after an acknowledged end");
    if (out.accepted && !d.held) fail("a segment was accepted after an acknowledged end");
  }
  d.before = now;
  ControlView& v = d.view;
  const auto& tracker = d.tick.tracker();
  v.t_ns = d.in.now_ns;
  v.mode = out.supervisor.mode;
  v.reason = out.supervisor.reason;
  v.armed = d.in.autopilot.armed;
  v.landed = out.landed;
  v.odometry_age = v.heartbeat_age = v.pose_age = 0;
  v.state = d.in.odometry->state;
  v.command = out.command;
  v.epoch = d.tick.epoch();
  v.segment = tracker.segment();
  v.index = tracker.index();
  v.finished = tracker.finished();
  v.braking = tracker.braking();
  v.stop_branch = tracker.stop_branch();
  if (out.refused) v.refused_segment = offered->id;
  d.unread = true;
}

bool EpochModel::carry_out(Daemon& d, const Decision& decision) {
  if (decision.order) d.sent.push_back(*decision.order);
  if (decision.job) d.job = decision.job;
  return decision.answer && decision.answer->result == backwash_msgs_msg_dds__ACK_ACCEPTED;
}

/// False: refused, so that nothing has changed.
bool EpochModel::command(Daemon& d, std::uint8_t verb) {
  CommandMessage c;
  c.station[0] = 'a';
  c.session = 1;
  c.sequence = ++d.sequence;
  c.verb = verb;
  c.position = d.before + Vec3(1, 0, 0.6);
  const bool accepted = carry_out(d, d.mission.handle(c, static_cast<double>(d.in.now_ns) * 1e-9));
  if (!accepted) return false;
  const bool ends = verb == GetParam();
  if (ends) {
    d.since_end = 0;
    d.held = verb == kHold;
    d.takeoff_asked = false;
  }
  if (!ends) d.since_end = -1;
  if (verb == kTakeoff) d.takeoff_asked = true;
  return true;
}

/// What the planner makes of its job, or of what flies: a take-off and a goto from where the command is, a hold along
/// the flight's own path, an extension that leaves the flight (or the stop that it brakes on) a little ahead.
void EpochModel::plan(Daemon& d) {
  const bool continues = !d.planning || d.planning->kind == PlanJob::Kind::brake;
  auto s = std::make_shared<AcceptedSegment>();
  if (continues) {
    if (!d.flown || d.view.segment != d.flown->id || d.view.finished) return d.planning.reset();
    if (!d.planning) d.front.begin(d.flown->epoch);
    std::vector<Setpoint> flying = d.flown->commands;
    const auto stop = std::ranges::find(d.flown->stops, d.view.stop_branch, &plan::Stop::branch);
    if (d.view.braking && stop != d.flown->stops.end()) {
      flying.resize(stop->branch);
      flying.insert(flying.end(), stop->commands.begin(), stop->commands.end());
    }
    s->continues = d.flown->id;
    s->branch = std::min(flying.size(), std::max(d.view.index + 2, d.view.braking ? d.view.stop_branch + 2 : 0));
    s->commands.assign(flying.begin(), flying.begin() + static_cast<std::ptrdiff_t>(s->branch));
  }
  Vec3 at = s->commands.empty() ? d.view.command.p_W : s->commands.back().p_W;
  const bool rises = d.planning && d.planning->kind == PlanJob::Kind::takeoff;
  const bool rests = d.planning && d.planning->kind == PlanJob::Kind::brake;
  for (std::size_t k = 0; k < kLength; ++k) {
    if (!rests) at += rises ? Vec3(0, 0, 0.05) : Vec3(k < kLength - 2 ? kStep : 0, 0, 0);
    s->commands.push_back({at, Vec3::Zero(), Vec3::Zero(), 0});
  }
  s->arms = rises;
  s->tube = tube_of(s->commands);
  for (std::size_t branch = 0; branch < s->commands.size(); branch += kStopEvery) {
    const Vec3 from = s->commands[branch].p_W;
    const std::vector<Setpoint> stopping(3, Setpoint{from, Vec3::Zero(), Vec3::Zero(), 0});
    s->stops.push_back({branch, stopping, tube_of(stopping)});
  }
  if (d.front.standing(d.view) != PlanFront::Standing::current) {
    if (d.planning) d.outcome = PlanOutcome{d.planning->id, false, {}};
    return d.planning.reset();
  }
  d.front.stamp(*s);
  d.ready = s;
}

/// False: the event changes nothing here.
bool EpochModel::apply(Daemon& d, int event) {
  switch (event) {
    case kGo:
      return command(d, air_ ? kGoto : kTakeoff);
    case kEnd:
      return command(d, GetParam());
    case kEnableAgain:
      return command(d, kEnable);
    case kJobTaken:
      if (!d.job || d.planning || d.ready) return false;
      d.planning = std::exchange(d.job, std::nullopt);
      d.front.begin(d.planning->epoch);
      return true;
    case kPlanned:
      if (d.ready || (d.planning && d.front.standing(d.view) == PlanFront::Standing::early)) return false;
      if (!d.planning && (!d.flown || d.view.segment != d.flown->id || d.view.finished)) return false;
      plan(d);
      return true;
    case kOffered:
      if (!d.ready) return false;
      d.offered = std::exchange(d.ready, nullptr);
      if (d.planning) d.outcome = PlanOutcome{d.planning->id, true, {}};
      d.planning.reset();
      return true;
    case kTick:
      tick(d);
      return true;
    case kWorldChanges:
      return !std::exchange(d.world_changed, true);
    case kPilot:
      d.in.autopilot.offboard = !d.in.autopilot.offboard;
      return true;
    default: {
      if (!d.unread && !d.outcome) return false;
      MissionInput in;
      in.now_s = static_cast<double>(d.in.now_ns) * 1e-9;
      if (std::exchange(d.unread, false)) in.view = d.view;
      if (d.outcome) in.outcomes = std::span(&*d.outcome, 1);
      carry_out(d, d.mission.observe(in));
      d.outcome.reset();
      return true;
    }
  }
}

}  // namespace backwash::daemon::test::epoch
