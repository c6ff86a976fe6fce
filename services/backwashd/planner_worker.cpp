// SPDX-License-Identifier: BSD-3-Clause
// What the mission asks for: take-off and brake, and how a segment is offered. planner_goals.cpp has the way to a goal,
// planner_watch.cpp what happens in flight.
#include "services/backwashd/planner_worker.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <thread>
#include <utility>

#include "core/log/tick_log.hpp"
#include "core/plan/ends.hpp"
#include "core/plan/rest.hpp"
#include "core/plan/stop.hpp"
#include "core/types/minimum_jerk.hpp"

namespace backwash::daemon {
namespace {

constexpr int kAttempts = 25;               // offers of one segment, each from a fresh state
constexpr std::size_t kBrakeAfter = 15;     // commands (0.3 s) that a stop on request leaves untouched
constexpr std::size_t kLaterStops = 20;     // of the flight that are tried where braking at once is not clear
constexpr double kLeastLift = 0.3;          // m: what an autopilot can tell from standing
constexpr std::size_t kAnswerPauses = 100;  // for the control thread to take a segment or not

Setpoint at_rest(const Setpoint& s) { return {s.p_W, Vec3::Zero(), Vec3::Zero(), s.yaw}; }

std::string not_clear(const plan::World& world, const std::string& what, double clearance) {
  if (clearance == 0 && world.bounds.model().stated) return what + " does not keep the stated risk";
  char line[128];
  std::snprintf(line, sizeof line, "%s is not clear enough: %.3f m", what.c_str(), clearance);
  return line;
}

}  // namespace

bool PlannerWorker::step() {
  const PlanJob* job = channels_.jobs.take();
  if (!job) {
    watch();
    return false;
  }
  const auto refused = perform(*job);
  PlanOutcome outcome{job->id, !refused, {}};
  if (refused) std::snprintf(outcome.reason.data(), outcome.reason.size(), "%s", refused->c_str());
  channels_.jobs.give_back(job);
  while (!channels_.outcomes.push(outcome) && !channels_.stop) pause_();  // the mission waits for each
  return true;
}

void PlannerWorker::refresh() {
  channels_.segments.collect();
  if (const auto view = channels_.view_planner.read_new()) view_ = *view;
  if (const auto* world = channels_.worlds.planner.take()) {
    new_world_ = new_world_ || world_ != world->world;
    world_ = world->world;
    seen_ns_ = world->seen_ns;
    channels_.worlds.planner.give_back(world);
  }
}

/// Whether what is planned may still be flown; waits for the control thread to take the order that it was made under.
bool PlannerWorker::current() {
  refresh();
  for (std::size_t wait = 0; wait < kAnswerPauses && !channels_.stop; ++wait) {
    if (front_.standing(view_) != PlanFront::Standing::early) break;
    pause_();
    refresh();
  }
  return front_.standing(view_) == PlanFront::Standing::current;
}

/// Whether the newest world has sets that are too small for the air by now: the map worker makes one anew at once, or
/// after a map that it was at, which may take minutes.
bool PlannerWorker::too_calm() const {
  return !covers(world_->air.factors, view_.air ? view_.air->factors : kModelledAir);
}

/// Why the job could not be done; nothing when it is flying.
std::optional<std::string> PlannerWorker::perform(const PlanJob& job) {
  pursuit_.reset();
  front_.begin(job.epoch);
  if (!current()) return kEnded;
  if (!world_) return "no map was received yet";
  switch (job.kind) {
    case PlanJob::Kind::takeoff:
      return take_off(job);
    case PlanJob::Kind::go_to:
      return go_to(job);
    default:
      return brake();
  }
}

std::optional<std::string> PlannerWorker::take_off(const PlanJob& job) {
  const Vec3 here = view_.state.p_W;
  const auto column = plan::takeoff_column(*world_, here, view_.residual_m);
  if (!column) return "there is no clear hover height above a known floor here";
  Vec3 lift = here, target = here;
  lift.z() = std::max(here.z() + kLeastLift, column->z_safe);
  target.z() = std::max(job.position.z(), lift.z());
  for (const Vec3& hover : {lift, target})
    if (!plan::may_rest_at(*world_, hover, view_.residual_m)) return "hovering at the height asked for is not safe";
  const std::uint32_t closures = view_.closures;
  Flying whole{{0, 0, 0, rise(here, target), {}, {}, closures}, view_.state, view_.command, {}, column->z_safe};
  whole.segment.apart_m = view_.residual_m;
  verify(whole, *world_);
  if (!whole.clear()) return not_clear(*world_, "the way up", whole.segment.clearance);
  if (auto why = fly(rise(here, lift), {}, column->z_safe, closures, true)) return why;
  if (auto why = lift_off(flying_->segment.id)) return why;
  // From here on the sets hold: from the state in which the autopilot has come to fly.
  return fly(rise(view_.command.p_W, target), {}, column->z_safe, closures);
}

std::vector<Setpoint> PlannerWorker::rise(const Vec3& from, const Vec3& to) const {
  const auto& limits = world_->reach.vehicle.limits;
  auto commands = rest_to_rest(from, to, limits.v_max, limits.a_max);
  for (Setpoint& command : commands) command.yaw = view_.command.yaw;
  return commands;
}

/// Waits for as long as this lift-off is what the control thread is at: the supervisor gives it its time. What is not
/// tracking without its segment after that was no end of it that a flight may begin from.
std::optional<std::string> PlannerWorker::lift_off(std::uint64_t lift) {
  const auto lifting = [&] { return view_.mode == Mode::lifting && view_.segment == lift; };
  while (!channels_.stop && current() && lifting()) {
    if (std::exchange(new_world_, false)) verify_again();
    pause_();
  }
  if (channels_.stop) return kEnded;
  if (current() && view_.mode == Mode::tracking && view_.segment != lift) return std::nullopt;
  return "the take-off ended: " + std::string(to_string(view_.reason));
}

/// The current segment, slowed to rest on its own path from a little ahead of now. What rests already stays.
std::optional<std::string> PlannerWorker::brake() {
  if (!flying_ || view_.segment != flying_->segment.id) return std::nullopt;  // or about to
  if (view_.finished || view_.braking) {
    flying_->held = true;
    return std::nullopt;
  }
  if (view_.closures != flying_->segment.closures) return "a loop closure is being worked in: ask again";
  const std::size_t branch = view_.index + kBrakeAfter;
  auto commands = plan::stop_along(flying_->segment.commands, branch, world_->reach.vehicle.limits.a_max);
  if (commands.empty()) {  // it ends by itself before that
    flying_->held = true;
    return std::nullopt;
  }
  Flying next = continued(branch, std::move(commands));
  next.held = true;
  verify(next, *world_, view_.index);
  if (!next.clear())
    return brake_later() ? std::nullopt : std::optional(not_clear(*world_, "braking here", next.segment.clearance));
  add_guards(next, *world_, view_.index);
  add_own_stops(next, branch);
  return offer(std::move(next)) ? std::nullopt : std::optional<std::string>("the flight was already past the branch");
}

/// Where rest here is not clear, as in a doorway: by the first of the flight's own stops that still is, else at its
/// end.
bool PlannerWorker::brake_later() {
  std::size_t tries = 0;
  for (const plan::Stop& stop : flying_->segment.stops) {
    refresh();
    if (stop.branch < view_.index + kBrakeAfter) continue;
    if (++tries > kLaterStops) break;
    Flying next = continued(stop.branch, flown_commands(*flying_, true, stop.branch));
    next.held = true;
    verify(next, *world_, view_.index);
    if (!next.clear()) continue;
    add_guards(next, *world_, view_.index);
    add_own_stops(next, stop.branch);
    const double after = kControlPeriod * static_cast<double>(stop.branch - view_.index);
    if (!offer(std::move(next))) return false;
    spdlog::info("braking here is not clear: the flight comes to rest {:.1f} s later", after);
    return true;
  }
  Flying whole = *flying_;
  verify(whole, *world_, view_.index);
  const bool clear = whole.clear();
  flying_->held = flying_->held || clear;  // told once: a second order that cannot be followed does not take it back
  if (clear) spdlog::info("no rest before its end is clear: the flight comes to rest there");
  return clear;
}

/// Offers the commands with a tube from the newest state until the control thread accepts: by then the vehicle may
/// have moved further than the first set allows.
/// A lift-off arms the vehicle when it is accepted: only here, where it was found clear.
std::optional<std::string> PlannerWorker::fly(std::vector<Setpoint> commands, const plan::PlanMetrics& metrics,
                                              std::optional<double> z_safe, std::uint32_t closures, bool lifts) {
  plan::hold_until_settled(world_->reach, commands);
  // A lift-off begins on the ground, where nothing moves however old the pose is.
  if (!lifts) commands.insert(commands.begin(), lead_, at_rest(commands.front()));
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    for (std::size_t wait = 0; current() && too_calm() && wait < kAnswerPauses && !channels_.stop; ++wait) pause_();
    if (too_calm()) return "the air is rougher than the sets allow for, which are being made anew: ask again";
    if (!current()) return kEnded;
    if (view_.mode != Mode::tracking && view_.mode != Mode::hold) return "control was lost meanwhile";
    if (view_.closures != closures) return "a loop closure moved the map meanwhile";
    Flying next{{0, 0, 0, commands, {}, {}, closures}, view_.state, view_.command, metrics, z_safe};
    next.segment.arms = lifts;
    next.segment.apart_m = view_.residual_m;
    verify(next, *world_);
    if (!next.clear()) return not_clear(*world_, "the tube from the state estimated now", next.segment.clearance);
    add_guards(next, *world_);
    if (offer(std::move(next))) return std::nullopt;
  }
  if (view_.mode == Mode::hold)
    return "nothing flies out of the hold for its cause: " + std::string(to_string(view_.reason));
  return "the vehicle is not still enough to start: its state left the first set each time";
}

/// A segment that shares its start and its first commands with what flies, and so its map frame: where a loop closure
/// came since, the control thread refuses it.
Flying PlannerWorker::continued(std::size_t branch, std::vector<Setpoint> commands) {
  plan::hold_until_settled(world_->reach, commands);
  Flying next{{0, flying_->segment.id, branch, std::move(commands), {}, {}, flying_->segment.closures},
              flying_->start,
              flying_->previous,
              flying_->metrics,
              flying_->z_safe};
  next.segment.apart_m = flying_->segment.apart_m;
  return next;
}

bool PlannerWorker::offer(Flying next) {
  front_.stamp(next.segment);
  next.segment.seen_ns = seen_ns_;  // every caller verified it in the newest world
  const AirFactors air = world_->air.factors;
  recorder_.append(log::RecordKind::offer, log::encode(next.segment));
  channels_.segments.offer(std::make_unique<const track::AcceptedSegment>(next.segment));
  for (std::size_t wait = 0; wait < kAnswerPauses && !channels_.stop; ++wait) {
    pause_();
    refresh();
    const auto fate = front_.fate(view_);
    if (fate == PlanFront::Fate::accepted) {
      // The flight is judged from where its sets hold: a lift-off is an offer in the log, and no segment of it.
      if (!next.segment.arms) recorder_.append(log::RecordKind::segment, segment_record(next));
      accepted_(next.segment);
      flying_ = std::move(next);
      air_ = air;
      return true;
    }
    if (fate == PlanFront::Fate::refused) return false;
  }
  return false;
}

void run_planner(Channels& channels, Recorder& recorder, const SegmentAccepted& accepted,
                 const OdometryTiming& timing) {
  using namespace std::chrono_literals;
  PlannerWorker planner(
      channels, recorder, accepted, [] { std::this_thread::sleep_for(1ms); }, timing);
  while (!channels.stop)
    if (!planner.step()) std::this_thread::sleep_for(2ms);
}

}  // namespace backwash::daemon
