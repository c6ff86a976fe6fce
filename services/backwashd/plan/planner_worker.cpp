// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/plan/planner_worker.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "core/log/raw/tick_log.hpp"
#include "core/plan/rest.hpp"
#include "core/plan/search/ends.hpp"
#include "core/plan/stop.hpp"
#include "core/reach/rest.hpp"
#include "core/track/rebase.hpp"
#include "core/types/angle.hpp"
#include "core/types/minimum_jerk.hpp"
#include "core/types/text.hpp"
#include "services/backwashd/channels.hpp"

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

constexpr int kPlans = 5;          // of one route, while the state moves on
constexpr double kPatience = 2.0;  // s at rest in which more of the way may become known

constexpr double kReserve = 0.1;        // m of clearance towards what may turn out to be a wall
constexpr double kLeastReserve = 0.02;  // m, where there is no room for that: for the set, larger since the start

/// `apart_m`: AcceptedSegment::apart_m.
plan::PlanOptions limits_of(const plan::World& world, double apart_m) {
  plan::PlanOptions options{};
  options.least_clearance_m = apart_m;
  options.v_max = world.reach.vehicle.limits.v_max;
  options.a_max = world.reach.vehicle.limits.a_max;
  return options;
}

/// Whether more of the map may make hovering at p safe: it is unknown there, or unknown voxels are nearer than any
/// obstacle within a metre.
bool may_become_clear(const map::OccupancyGrid& grid, const Vec3& p_W) {
  const Index3 at = grid.index(p_W);
  if (!grid.inside(at) || grid.occupied(at)) return false;
  const int reach = static_cast<int>(std::ceil(1.0 / grid.resolution()));
  double unknown = INFINITY, occupied = INFINITY;
  for (int k = -reach; k <= reach; ++k)
    for (int j = -reach; j <= reach; ++j)
      for (int i = -reach; i <= reach; ++i) {
        const Index3 v = at + Index3(i, j, k);
        if (!grid.inside(v) || grid.free(v)) continue;
        double& nearest = grid.occupied(v) ? occupied : unknown;
        nearest = std::min(nearest, (grid.center(v) - p_W).norm());
      }
  return unknown < occupied;
}

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

// The way to a goal: by one whole plan, or towards what the map does not show yet.

/// Where the map ends the airflow of what is behind is not known: a way with something to spare comes first. From rest
/// at last one with nothing to spare: what has come to light may have left nothing where the vehicle is already.
plan::Replan PlannerWorker::onward(const plan::World& world, const plan::Route& route, std::size_t now,
                                   std::size_t branch, const Vec3& goal_W, double apart_m) const {
  plan::ReplanOptions options{limits_of(world, apart_m)};
  plan::Replan next;
  for (const double reserve : {kReserve, kLeastReserve, 0.0}) {
    if (reserve == 0 && branch > 0) break;
    options.reserve_m = reserve;
    next = plan::replan(world, route, now, branch, goal_W, options);
    if (next.kind == plan::Replan::Kind::extended) break;
  }
  return next;
}

/// Plans again from the newest state when the tube of the one planned from no longer holds.
std::optional<std::string> PlannerWorker::go_to(const PlanJob& job) {
  std::optional<std::string> why;
  for (int attempt = 0; attempt < kPlans; ++attempt) {
    const bool partial = channels_.map_partial;  // before the newest world is taken
    if (!current()) return kEnded;
    if (partial && !world_->grid.inside(world_->grid.index(job.position)))
      return "the map is still being made there; what is around the vehicle can be flown: ask again";
    if (channels_.world_moves && !world_->grid.inside(world_->grid.index(job.position))) {
      const auto& grid = world_->grid;
      const Vec3 high = grid.origin() + grid.resolution() * grid.size().cast<double>();
      return "goal " + to_text(job.position) + " is outside the world of the window, " + to_text(grid.origin()) +
             " to " + to_text(high) + ": use waypoints in it";
    }
    const auto world = world_;  // a newer one may come while this is planned in
    const std::uint32_t closures = view_.closures;
    const auto options = limits_of(*world, view_.residual_m);
    auto planned = plan::plan(*world, {view_.state, view_.command}, job.position, options);
    const bool stated = world->bounds.model().stated.has_value();
    spdlog::info("plan: {} ({:.0f} ms search, {:.0f} ms optimisation, {:.0f} ms verification, clearance {:.3f} m{})",
                 plan::to_string(planned.status), planned.metrics.search_ms, planned.metrics.optimise_ms,
                 planned.metrics.verify_ms, planned.metrics.min_clearance_m,
                 stated ? ", risk " + fmt::format("{:.2g}", planned.metrics.risk.total) : "");
    const bool hidden =
        planned.status == plan::PlanStatus::no_path ||
        (planned.status == plan::PlanStatus::goal_blocked && may_become_clear(world->grid, job.position));
    if (hidden && !plan::optimistic_way(*world, view_.command.p_W, job.position).empty()) return explore(job);
    if (planned.status != plan::PlanStatus::ok)
      return std::string(plan::to_string(planned.status)) + ": " + planned.message;
    if (job.yaw) {
      const auto turn = plan::turned_to(planned.commands.back(), *job.yaw, options.yaw);
      planned.commands.insert(planned.commands.end(), turn.begin(), turn.end());
    }
    why = fly(std::move(planned.commands), planned.metrics, std::nullopt, closures);
    if (why) continue;  // current() ends this for what has been ended
    pursuit_ = Pursuit{job.position, job.yaw};
    return why;
  }
  return why;
}

/// From rest, the first segment of a flight whose way is not known yet; waits a little for scans that show more of it.
/// A world that came while a plan was made is planned in once more, however long that took.
std::optional<std::string> PlannerWorker::explore(const PlanJob& job) {
  const std::int64_t until_ns = view_.t_ns + static_cast<std::int64_t>(kPatience * 1e9);
  std::string why;
  while (!channels_.stop) {
    if (!current()) return kEnded;
    const bool last = view_.t_ns >= until_ns;
    const auto world = world_;
    new_world_ = false;
    const std::uint32_t closures = view_.closures;
    plan::Route here{view_.state, view_.command, {}, {}};
    here.commands.assign(1, {view_.command.p_W, Vec3::Zero(), Vec3::Zero(), view_.command.yaw});
    auto next = onward(*world, here, 0, 0, job.position, view_.residual_m);
    why = next.message;
    if (next.kind == plan::Replan::Kind::extended) {
      spdlog::info("towards a goal that is not known to be clear yet: {} commands", next.route.commands.size());
      auto refused = fly(std::move(next.route.commands), next.metrics, std::nullopt, closures);
      if (!refused) pursuit_ = Pursuit{job.position, job.yaw};
      return refused;
    }
    while (current() && !new_world_ && view_.t_ns < until_ns && !channels_.stop) pause_();
    if (last || !new_world_) break;
  }
  return "nothing more of the way became known" + (why.empty() ? "" : ": " + why);
}

// In flight, between jobs: is what flies still right, in a new world or after a loop closure, and where does it go on?

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
