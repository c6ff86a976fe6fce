// SPDX-License-Identifier: BSD-3-Clause
// What the mission asks for: take-off, go to, brake. planner_watch.cpp has what happens in flight.
#include "services/backwashd/planner_worker.hpp"

#include <spdlog/spdlog.h>

#include <cmath>
#include <cstdio>
#include <thread>
#include <utility>

#include "core/log/tick_log.hpp"
#include "core/plan/stop.hpp"

namespace backwash::daemon {
namespace {

constexpr int kAttempts = 25;               // offers of one segment, each from a fresh state
constexpr int kPlans = 5;                   // of one route, while the state moves on
constexpr std::size_t kBrakeAfter = 15;     // commands (0.3 s) that a stop on request leaves untouched
constexpr double kPatience = 2.0;           // s at rest in which more of the way may become known
constexpr double kLeastLift = 0.3;          // m: what an autopilot can tell from standing
constexpr std::size_t kAnswerPauses = 100;  // for the control thread to take a segment or not

constexpr double kReserve = 0.1;        // m of clearance towards what may turn out to be a wall
constexpr double kLeastReserve = 0.02;  // m, where there is no room for that: for the set, larger since the start

/// `apart_m`: at rest, the frame that the autopilot holds its position in is off the map by so much. Its controller
/// does not see that error, so that no set shrinks it: clearance has to be left for it. In motion most of it is delay.
plan::PlanOptions limits_of(const plan::World& world, double apart_m = 0) {
  plan::PlanOptions options{};
  options.least_clearance_m = apart_m;
  options.v_max = world.reach.vehicle.limits.v_max;
  options.a_max = world.reach.vehicle.limits.a_max;
  return options;
}

const std::string kEnded = "a later command, or what happened meanwhile, ended it";

std::string not_clear(const std::string& what, double clearance) {
  char line[128];
  std::snprintf(line, sizeof line, "%s is not clear enough: %.3f m", what.c_str(), clearance);
  return line;
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
  channels_.outcomes.push(outcome);
  return true;
}

void PlannerWorker::refresh() {
  channels_.segments.collect();
  if (const auto view = channels_.view_planner.read_new()) view_ = *view;
  if (const auto* world = channels_.worlds.planner.take()) {
    world_ = world->world;
    seen_ns_ = world->seen_ns;
    channels_.worlds.planner.give_back(world);
    new_world_ = true;
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

/// Where the map ends the airflow of what is behind is not known: a way with something to spare comes first. From rest
/// at last one with nothing to spare: what has come to light may have left nothing where the vehicle is already.
plan::Replan PlannerWorker::onward(const plan::World& world, const plan::Route& route, std::size_t now,
                                   std::size_t branch, const Vec3& goal_W) const {
  plan::ReplanOptions options{limits_of(world)};
  plan::Replan next;
  for (const double reserve : {kReserve, kLeastReserve, 0.0}) {
    if (reserve == 0 && branch > 0) break;
    options.reserve_m = reserve;
    next = plan::replan(world, route, now, branch, goal_W, options);
    if (next.kind == plan::Replan::Kind::extended) break;
  }
  return next;
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
  const auto column = plan::takeoff_column(*world_, here);
  if (!column) return "there is no clear hover height above a known floor here";
  Vec3 lift = here, target = here;
  lift.z() = std::max(here.z() + kLeastLift, column->z_safe);
  target.z() = std::max(job.position.z(), lift.z());
  for (const Vec3& hover : {lift, target})
    if (!world_->hover.safe(world_->grid.index(hover))) return "hovering at the height asked for is not safe";
  const std::uint32_t closures = view_.closures;
  Flying whole{{0, 0, 0, rise(here, target), {}, {}, closures}, view_.state, view_.command, {}, column->z_safe};
  verify(whole, *world_);
  if (!(whole.segment.clearance > view_.residual_m)) return not_clear("the way up", whole.segment.clearance);
  if (auto why = fly(rise(here, lift), {}, column->z_safe, closures, true)) return why;
  if (auto why = lift_off(flying_->segment.id)) return why;
  // From here on the sets hold: from the state in which the autopilot has come to fly.
  return fly(rise(view_.command.p_W, target), {}, column->z_safe, closures);
}

std::vector<Setpoint> PlannerWorker::rise(const Vec3& from, const Vec3& to) const {
  const auto& limits = world_->reach.vehicle.limits;
  auto commands = plan::vertical_commands(from, to, limits.v_max, limits.a_max);
  for (Setpoint& command : commands) command.yaw = view_.command.yaw;
  return commands;
}

/// Waits until the autopilot has lifted the vehicle; the supervisor gives it its time.
std::optional<std::string> PlannerWorker::lift_off(std::uint64_t lift) {
  while (!channels_.stop) {
    if (!current()) return "the take-off ended: " + std::string(to_string(view_.reason));
    if (view_.segment != lift && view_.mode == track::Mode::tracking) return std::nullopt;
    if (std::exchange(new_world_, false)) verify_again();
    pause_();
  }
  return kEnded;
}

/// Plans again from the newest state when the tube of the one planned from no longer holds.
std::optional<std::string> PlannerWorker::go_to(const PlanJob& job) {
  std::optional<std::string> why;
  for (int attempt = 0; attempt < kPlans; ++attempt) {
    if (!current()) return kEnded;
    const auto world = world_;  // a newer one may come while this is planned in
    const std::uint32_t closures = view_.closures;
    const auto options = limits_of(*world, view_.residual_m);
    auto planned = plan::plan(*world, {view_.state, view_.command}, job.position, options);
    spdlog::info("plan: {} ({:.0f} ms search, {:.0f} ms optimisation, {:.0f} ms verification, clearance {:.3f} m)",
                 plan::to_string(planned.status), planned.metrics.search_ms, planned.metrics.optimise_ms,
                 planned.metrics.verify_ms, planned.metrics.min_clearance_m);
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
    auto next = onward(*world, here, 0, 0, job.position);
    why = next.message;
    if (next.kind == plan::Replan::Kind::extended) {
      spdlog::info("towards a goal that is not known to be clear yet: {} commands", next.route.commands.size());
      const auto refused = fly(std::move(next.route.commands), next.metrics, std::nullopt, closures);
      if (!refused) pursuit_ = Pursuit{job.position, job.yaw};
      return refused;
    }
    while (current() && !new_world_ && view_.t_ns < until_ns && !channels_.stop) pause_();
    if (last || !new_world_) break;
  }
  return "nothing more of the way became known" + (why.empty() ? "" : ": " + why);
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
  if (!(next.segment.clearance > 0)) return not_clear("braking here", next.segment.clearance);
  return offer(std::move(next)) ? std::nullopt : std::optional<std::string>("the flight was already past the branch");
}

/// Offers the commands with a tube from the newest state until the control thread accepts: by then the vehicle may
/// have moved further than the first set allows.
/// A lift-off arms the vehicle when it is accepted: only here, where it was found clear.
std::optional<std::string> PlannerWorker::fly(std::vector<Setpoint> commands, const plan::PlanMetrics& metrics,
                                              std::optional<double> z_safe, std::uint32_t closures, bool lifts) {
  append_hold(commands);
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    if (!current()) return kEnded;
    if (view_.mode != track::Mode::tracking && view_.mode != track::Mode::hold) return "control was lost meanwhile";
    if (view_.closures != closures) return "a loop closure moved the map meanwhile";
    Flying next{{0, 0, 0, commands, {}, {}, closures}, view_.state, view_.command, metrics, z_safe};
    next.segment.arms = lifts;
    verify(next, *world_);
    if (!(next.segment.clearance > view_.residual_m))
      return not_clear("the tube from the state estimated now", next.segment.clearance);
    add_guards(next, *world_);
    if (offer(std::move(next))) return std::nullopt;
  }
  if (view_.mode == track::Mode::hold)
    return "nothing flies out of the hold for its cause: " + std::string(to_string(view_.reason));
  return "the vehicle is not still enough to start: its state left the first set each time";
}

/// A segment that shares its start and its first commands with what flies.
Flying PlannerWorker::continued(std::size_t branch, std::vector<Setpoint> commands) {
  append_hold(commands);
  Flying next{{0, flying_->segment.id, branch, std::move(commands), {}, {}, view_.closures},
              flying_->start,
              flying_->previous,
              flying_->metrics,
              flying_->z_safe};
  return next;
}

bool PlannerWorker::offer(Flying next) {
  front_.stamp(next.segment);
  next.segment.seen_ns = seen_ns_;  // every caller verified it in the newest world
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
      return true;
    }
    if (fate == PlanFront::Fate::refused) return false;
  }
  return false;
}

void run_planner(Channels& channels, Recorder& recorder, const SegmentAccepted& accepted) {
  using namespace std::chrono_literals;
  PlannerWorker planner(channels, recorder, accepted, [] { std::this_thread::sleep_for(1ms); });
  while (!channels.stop)
    if (!planner.step()) std::this_thread::sleep_for(2ms);
}

}  // namespace backwash::daemon
