// SPDX-License-Identifier: BSD-3-Clause
// In flight, between jobs: is what flies still right, in a new world or after a loop closure, and where does it go on?
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "core/plan/stop.hpp"
#include "core/reach/rest.hpp"
#include "core/track/rebase.hpp"
#include "core/types/angle.hpp"
#include "services/backwashd/planner_worker.hpp"

namespace backwash::daemon {
namespace {

constexpr std::size_t kRectifyAfter = 15;       // commands (0.3 s) that a rectified segment leaves untouched
constexpr std::size_t kStopAfter = 5;           // commands (0.1 s) before a stop that is chosen for the air
constexpr std::size_t kStopsTried = 20;         // of them, one every 0.2 s
constexpr double kBetter = 0.02;                // m that a later stop that is not clear has to be clearer by
constexpr std::size_t kRunsOut = 150;           // commands: 3 s of motion
constexpr std::int64_t kLook_ns = 500'000'000;  // between looks at a flight that runs out, without a new world

std::string metres(double d) { return std::to_string(d) + " m"; }

std::string left(const plan::World& world, double clearance) {
  const bool risky = clearance == 0 && world.bounds.model().stated;  // plan::tube_clearance()
  return risky ? "the stated risk is not kept" : metres(clearance);
}

}  // namespace

void PlannerWorker::watch() {
  refresh();
  if (!flying_ || view_.segment != flying_->segment.id) return pursuit_.reset();
  front_.begin(flying_->segment.epoch);
  // What flies is still watched over; nothing new is offered to it.
  const bool ended = front_.standing(view_) == PlanFront::Standing::ended;
  if (ended) pursuit_.reset();
  if (view_.closures != flying_->segment.closures) {
    if (view_.braking || blocked_ == view_.segment || (ended && view_.finished)) return;
    if (const auto why = rectify()) block("after a loop closure: " + *why);
  } else if (pursues()) {
    pursue();
  } else if (!pursuit_ && !view_.braking && blocked_ != view_.segment && std::exchange(new_world_, false)) {
    verify_again();
  }
}

/// Whether the flight to a goal is to be looked at now. It ends with any hold but the one for an obstacle.
bool PlannerWorker::pursues() {
  if (!pursuit_) return false;
  const bool braking_for_obstacle = view_.mode == Mode::hold && view_.reason == Reason::obstacle_ahead && view_.braking;
  if (view_.mode != Mode::tracking && !braking_for_obstacle) {
    pursuit_.reset();
    return false;
  }
  if (view_.finished) return false;  // the mission goes on from there
  const std::size_t moving = flying_->segment.commands.size() - reach::settling_periods(world_->reach);
  return new_world_ || (moving < view_.index + kRunsOut && view_.t_ns >= pursuit_->again_ns);
}

/// Extends the flight towards its goal in the newest world, around what has come to stand in its way; or finds that it
/// is still clear; or stops it.
void PlannerWorker::pursue() {
  new_world_ = false;
  Pursuit& p = *pursuit_;
  p.again_ns = view_.t_ns + kLook_ns;
  const bool braking = view_.braking;
  const plan::Route route{flying_->start, flying_->previous, flown_commands(*flying_, braking, view_.stop_branch), {}};
  const std::size_t now = view_.index, branch = now + p.lead;
  auto next = onward(*world_, route, now, branch, p.goal_W, flying_->segment.apart_m);
  using Kind = plan::Replan::Kind;
  if (next.kind == Kind::kept && !braking) keep();
  if (next.kind == Kind::kept || (braking && next.kind != Kind::extended)) return;
  // The next world may be minutes away: until then what flies has to be clear in this one.
  if (next.kind == Kind::extended && too_calm()) return braking ? void() : verify_again();
  if (next.kind == Kind::unsafe) return block("no way on is clear in the new map: " + left(*world_, next.clearance_m));
  auto commands = std::move(next.route.commands);
  if (next.reaches_goal && p.yaw) {
    const auto turn = plan::turned_to(commands.back(), *p.yaw, plan::YawLimits{});
    commands.insert(commands.end(), turn.begin(), turn.end());
  }
  Flying on = continued(branch, std::move(commands));
  on.metrics = next.metrics;
  verify(on, *world_, now);
  if (!on.clear()) return braking ? void() : verify_again();
  add_guards(on, *world_, now);
  // Nowhere to go on in rougher air: stopped as it is verified there, and held.
  const bool held = next.kind == Kind::stopping && !grown_air().empty() && !on.segment.stops.empty();
  const AirFactors before = air_;
  const bool taken = offer(std::move(on));
  spdlog::info("{} from command {} on: {}{}", next.kind == Kind::extended ? "extended" : "stopping", branch,
               next.reaches_goal ? "to the goal" : next.message, taken ? "" : " (too late)");
  p.lead = taken ? kLeastLead : std::min(2 * p.lead, kMostLead);
  if (!taken) p.again_ns = 0;
  if (!taken || !held) return;
  air_ = before;
  block("no way on is clear in it");
}

/// The flight does not go on as it was accepted: the control thread brakes it on its next verified stop.
void PlannerWorker::block(const std::string& why) {
  if (blocked_ == flying_->segment.id) return;
  const std::string air = grown_air(), stop = air.empty() ? "" : choose_stop();
  blocked_ = flying_->segment.id;
  if (!air.empty()) {
    channels_.rough_segment.store(blocked_, std::memory_order_relaxed);
    const std::string line = "the flight is stopped in rougher air: " + why + air + stop;
    recorder_.append(log::RecordKind::world, line);
    return spdlog::warn("{}", line);
  }
  channels_.blocked_segment.store(blocked_, std::memory_order_relaxed);
  spdlog::warn("the flight is stopped: {}", why);
}

/// Before a flight is stopped for its air: where its stops were verified in calmer air than the newest world's, it is
/// offered once more, to rest by the first stop that is clear in it; if none is, by the first that no later one
/// betters. What is to be said of it; "": its stops are of that air.
std::string PlannerWorker::choose_stop() {
  if (std::ranges::equal(flying_->segment.air, world_->air.factors, std::greater_equal{})) return "";
  const bool offers = !flying_->segment.arms && front_.standing(view_) != PlanFront::Standing::ended;
  for (const std::size_t lead : {kStopAfter, kRectifyAfter}) {  // the second where the first came too late
    const bool same_frame = view_.closures == flying_->segment.closures;
    if (!offers || !same_frame || view_.segment != flying_->segment.id || view_.braking) break;
    auto best = rest_from(view_.index + lead);
    if (!best) break;  // it rests before that
    const bool clear = best->clear();
    const double lacks = best->segment.apart_m - best->segment.clearance;
    if (!offer(std::move(*best))) continue;
    return clear ? "; it rests by a stop that is clear in it"
                 : "; no stop is clear in it, the one flown lacks " + metres(lacks);
  }
  return "; its stops are those of calmer air";
}

/// The flight, to rest by a stop that leaves it at `branch` or later, as choose_stop() says. Nothing: it ends before.
std::optional<Flying> PlannerWorker::rest_from(std::size_t branch) {
  std::optional<Flying> best;
  for (std::size_t n = 0; n < kStopsTried && !(best && best->clear()); ++n, branch += kStopEvery) {
    auto commands = plan::stop_along(flying_->segment.commands, branch, 2 * world_->reach.vehicle.limits.a_max);
    if (commands.empty()) break;
    Flying next = continued(branch, std::move(commands));
    verify(next, *world_, view_.index);
    if (!best || next.clear() || next.segment.clearance > best->segment.clearance + kBetter) best = std::move(next);
  }
  if (!best) return best;
  best->held = true;
  add_guards(*best, *world_, view_.index);
  add_own_stop(*best, best->segment.branch);
  return best;
}

/// The classes whose factors have grown since what flies was last found clear, with factor and evidence; "": none has.
std::string PlannerWorker::grown_air() const {
  std::string text;
  for (std::size_t k = 0; k < kAirClasses; ++k) {
    const double now = world_->air.factors[k];
    if (!(now > air_[k])) continue;
    char line[96];
    std::snprintf(line, sizeof line, "; %s %.2f times the model's variance, ln evidence %.1f",
                  to_string(static_cast<AirClass>(k)), now, view_.air ? view_.air->ln_evidence[k] : 0.0);
    text += line;
  }
  return text;
}

/// The sets still to be flown, in the newest world: what is in it now, and with the bounds it has now.
void PlannerWorker::verify_again() {
  Flying again = *flying_;
  verify(again, *world_, view_.index);
  if (!again.clear())
    block("the rest of it is not clear in the new map: " + left(*world_, again.segment.clearance));
  else
    keep();
}

/// What flies is clear in the newest world. Where its stops were verified in calmer air than there is, it is offered
/// once more as it is, with the stops that are clear now: a STOP must not brake on sets that the air does not allow.
void PlannerWorker::keep() {
  if (too_calm()) return;  // its world is being made
  const AirFactors before = std::exchange(air_, world_->air.factors);
  Flying next = *flying_;
  next.segment.continues = flying_->segment.id;
  next.segment.branch = view_.index + kRectifyAfter;
  const auto kept = [](double made, double now) { return made >= std::min(now, 1.0); };
  if (std::ranges::equal(before, air_, kept) || next.segment.arms ||
      next.segment.branch >= next.segment.commands.size() || front_.standing(view_) == PlanFront::Standing::ended)
    return;
  verify(next, *world_, view_.index);
  add_guards(next, *world_, view_.index);
  spdlog::info("the air is not as calm as the stops of this flight allow for: they are verified anew");
  if (offer(std::move(next))) return;
  air_ = before;  // looked at again
  new_world_ = true;
}

/// After a loop closure: the same flight, back to its place in the map from a little ahead of now. One that was told to
/// hold stays where the vehicle is: nothing but a later command moves it.
std::optional<std::string> PlannerWorker::rectify() {
  constexpr int kTries = 3;
  for (int attempt = 0; attempt < kTries; ++attempt) {
    const track::RigidShift D = view_.shift;
    const std::size_t branch = view_.index + kRectifyAfter;
    Flying next = continued(branch, moved_by_closure(branch));
    next.segment.closures = view_.closures;
    next.start = D.state(flying_->start);
    next.previous = D.setpoint(flying_->previous);
    next.held = flying_->held;
    verify(next, *world_, view_.index);
    if (!next.clear()) return "the way back is not clear: " + left(*world_, next.segment.clearance);
    add_guards(next, *world_, view_.index);
    spdlog::info("loop closure {}: {:.3f} m and {:.2f} degrees, {} from command {} on", view_.closures,
                 (D.point(view_.command.p_W) - view_.command.p_W).norm(), D.yaw / kDegree,
                 flying_->held ? "held where it is" : "rectified", branch);
    if (offer(std::move(next))) return std::nullopt;
    refresh();
    if (view_.closures == flying_->segment.closures || view_.braking) return std::nullopt;
  }
  return "the flight was past the branch each time";
}

/// What flies, in the map as the loop closure moved it.
std::vector<Setpoint> PlannerWorker::moved_by_closure(std::size_t branch) const {
  const auto& limits = world_->reach.vehicle.limits;
  std::vector<Setpoint> commands = flying_->segment.commands;
  if (flying_->held) {
    for (Setpoint& command : commands) command = view_.shift.setpoint(command);
    return commands;
  }
  return track::rectified(commands, branch, view_.shift, limits.v_max, limits.a_max);
}

}  // namespace backwash::daemon
