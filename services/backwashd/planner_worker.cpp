// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/planner_worker.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <optional>
#include <thread>
#include <utility>

#include "core/plan/planner.hpp"
#include "core/plan/stop.hpp"
#include "core/study/tick_log.hpp"
#include "core/track/rebase.hpp"

namespace backwash::daemon {
namespace {

using namespace std::chrono_literals;

constexpr int kAttempts = 25;           // offers of one segment, each from a fresh state
constexpr int kPlans = 5;               // of one route, while the state moves on
constexpr int kBranchAfter = 15;        // commands (0.3 s) that a continued segment leaves untouched
constexpr std::size_t kStopEvery = 10;  // commands (0.2 s) between verified stops
constexpr double kHoldAfter = 2.0;      // s of hover at the end, so that the last set is the hover set's

/// The segment that flies now, with what is needed to continue it.
struct Flying {
  track::AcceptedSegment segment;
  State start;
  Setpoint previous;
  plan::PlanMetrics metrics;
  std::optional<double> z_safe;  // of a take-off: below it only what is beside counts, m
};

double clearance_of(const Flying& flying, const plan::World& world, const reach::ReachTube& tube) {
  return flying.z_safe ? plan::takeoff_clearance(world, tube, *flying.z_safe) : plan::tube_clearance(world, tube);
}

class Planner {
 public:
  Planner(Channels& channels, Recorder& recorder, const SegmentAccepted& accepted)
      : channels_(channels), recorder_(recorder), accepted_(accepted) {}

  /// Why the job could not be done; nothing when it is flying.
  std::optional<std::string> perform(const PlanJob& job) {
    switch (job.kind) {
      case PlanJob::Kind::takeoff:
        return take_off(job);
      case PlanJob::Kind::go_to:
        return go_to(job);
      default:
        return brake(job);
    }
  }
  void refresh() {
    channels_.segments.collect();
    if (const auto view = channels_.view_planner.read_new()) view_ = *view;
    if (const auto* world = channels_.worlds.planner.take()) {
      world_ = *world;
      channels_.worlds.planner.give_back(world);
      new_world_ = true;
    }
  }
  /// Between jobs: is what flies still right, after a loop closure or in a new world?
  void watch() {
    refresh();
    if (!flying_ || view_.segment != flying_->segment.id || view_.braking || blocked_ == view_.segment) return;
    if (view_.closures != flying_->segment.closures) {
      if (const auto why = rectify()) block("after a loop closure: " + *why);
    } else if (std::exchange(new_world_, false)) {
      verify_again();
    }
  }

 private:
  std::optional<std::string> take_off(const PlanJob& job) {
    refresh();
    const Vec3 here = view_.state.p_W;
    const auto column = plan::takeoff_column(*job.world, here);
    if (!column) return "there is no clear hover height above a known floor here";
    Vec3 target = here;
    target.z() = std::max(job.position.z(), column->z_safe);
    if (target.z() > here.z() && !job.world->hover.safe(job.world->grid.index(target)))
      return "hovering at the height asked for is not safe";
    const auto& limits = job.world->reach.vehicle.limits;
    const auto commands = plan::vertical_commands(here, target, limits.v_max, limits.a_max);
    // The motors start only for a take-off that is known to be clear.
    const auto tube = reach::tube_over_field(job.world->reach, view_.state, view_.command, commands, job.world->bounds);
    if (!(plan::takeoff_clearance(*job.world, tube, column->z_safe) > 0)) return "the take-off column is not clear";
    channels_.arm.store(true);
    return fly(job, commands, {}, column->z_safe, view_.closures);
  }

  /// Plans again from the newest state when the tube of the one planned from no longer holds.
  std::optional<std::string> go_to(const PlanJob& job) {
    const auto& limits = job.world->reach.vehicle.limits;
    plan::PlanOptions options{};
    options.v_max = limits.v_max;
    options.a_max = limits.a_max;
    std::optional<std::string> why;
    for (int attempt = 0; attempt < kPlans; ++attempt) {
      refresh();
      const std::uint32_t closures = view_.closures;
      const auto planned = plan::plan(*job.world, {view_.state, view_.command}, job.position, options);
      spdlog::info("plan: {} ({:.0f} ms search, {:.0f} ms optimisation, {:.0f} ms verification, clearance {:.3f} m)",
                   plan::to_string(planned.status), planned.metrics.search_ms, planned.metrics.optimise_ms,
                   planned.metrics.verify_ms, planned.metrics.min_clearance_m);
      if (planned.status != plan::PlanStatus::ok)
        return std::string(plan::to_string(planned.status)) + ": " + planned.message;
      why = fly(job, planned.commands, planned.metrics, std::nullopt, closures);
      if (!why) return why;
    }
    return why;
  }

  /// The current segment, slowed to rest on its own path from a little ahead of now.
  std::optional<std::string> brake(const PlanJob& job) {
    refresh();
    if (view_.finished || !flying_ || view_.segment != flying_->segment.id) return std::nullopt;  // already at rest
    if (view_.closures != flying_->segment.closures) return "a loop closure is being worked in: ask again";
    const std::size_t branch = view_.index + kBranchAfter;
    auto commands = plan::stop_along(flying_->segment.commands, branch, job.world->reach.vehicle.limits.a_max);
    if (commands.empty()) return std::nullopt;  // it ends by itself before that
    append_hold(commands);
    Flying next = *flying_;
    next.segment = {++last_id_, flying_->segment.id, branch, std::move(commands), {}, {}, view_.closures};
    next.segment.tube =
        reach::tube_over_field(job.world->reach, next.start, next.previous, next.segment.commands, job.world->bounds);
    next.segment.clearance = clearance_of(next, *job.world, next.segment.tube);
    if (!(next.segment.clearance > 0))
      return "braking here is not clear: " + std::to_string(next.segment.clearance) + " m";
    return offer(std::move(next)) ? std::nullopt : std::optional<std::string>("the flight was already past the branch");
  }

  static void append_hold(std::vector<Setpoint>& commands) {
    Setpoint hold = commands.back();
    hold.v_W = hold.a_W = Vec3::Zero();
    commands.insert(commands.end(), static_cast<std::size_t>(kHoldAfter / kControlPeriod), hold);
  }

  /// Offers the commands with a tube from the newest state until the control thread accepts: by then the vehicle may
  /// have moved further than the first set allows.
  std::optional<std::string> fly(const PlanJob& job, std::vector<Setpoint> commands, const plan::PlanMetrics& metrics,
                                 std::optional<double> z_safe, std::uint32_t closures) {
    append_hold(commands);
    for (Setpoint& command : commands) command.yaw = view_.command.yaw;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      refresh();
      if (view_.mode != track::Mode::tracking && view_.mode != track::Mode::hold) return "control was lost meanwhile";
      if (view_.closures != closures) return "a loop closure moved the map meanwhile";
      Flying next{{++last_id_, 0, 0, commands, {}, {}, closures}, view_.state, view_.command, metrics, z_safe};
      next.segment.tube =
          reach::tube_over_field(job.world->reach, next.start, next.previous, commands, job.world->bounds);
      next.segment.clearance = clearance_of(next, *job.world, next.segment.tube);
      if (!(next.segment.clearance > 0)) {
        char line[96];
        std::snprintf(line, sizeof line, "the tube from the state estimated now is not clear: %.3f m",
                      next.segment.clearance);
        return line;
      }
      next.segment.stops = stops_of(next, *job.world);
      if (offer(std::move(next))) return std::nullopt;
    }
    return "the vehicle is not still enough to start: its state left the first set each time";
  }

  static std::vector<plan::Stop> stops_of(const Flying& flying, const plan::World& world) {
    return plan::verified_stops(world, flying.start, flying.previous, flying.segment.commands, kStopEvery,
                                [&](const reach::ReachTube& tube) { return clearance_of(flying, world, tube); });
  }

  /// The flight does not go on as it was accepted: the control thread brakes it on its next verified stop.
  void block(const std::string& why) {
    blocked_ = flying_->segment.id;
    channels_.blocked_segment.store(blocked_, std::memory_order_relaxed);
    spdlog::warn("the flight is stopped: {}", why);
  }

  /// The sets still to be flown, in the newest world: what is in it now, and with the bounds it has now.
  void verify_again() {
    const auto& s = flying_->segment;
    const auto tube =
        reach::tube_over_field(world_->reach, flying_->start, flying_->previous, s.commands, world_->bounds);
    const auto from = static_cast<std::ptrdiff_t>(std::min<std::size_t>(view_.index, tube.size() - 1));
    const double clearance = clearance_of(*flying_, *world_, {tube.begin() + from, tube.end()});
    if (!(clearance > 0)) block("the rest of it is not clear in the new map: " + std::to_string(clearance) + " m");
  }

  /// After a loop closure: the same flight, back to its place in the map from a little ahead of now.
  std::optional<std::string> rectify() {
    constexpr int kTries = 3;
    for (int attempt = 0; attempt < kTries; ++attempt) {
      const auto& limits = world_->reach.vehicle.limits;
      const track::RigidShift D = view_.shift;
      const std::size_t branch = view_.index + kBranchAfter;
      auto commands = track::rectified(flying_->segment.commands, branch, D, limits.v_max, limits.a_max);
      if (commands.size() > flying_->segment.commands.size()) append_hold(commands);
      Flying next{{++last_id_, flying_->segment.id, branch, std::move(commands), {}, {}, view_.closures},
                  D.state(flying_->start),
                  D.setpoint(flying_->previous),
                  flying_->metrics,
                  flying_->z_safe};
      next.segment.tube =
          reach::tube_over_field(world_->reach, next.start, next.previous, next.segment.commands, world_->bounds);
      const auto& tube = next.segment.tube;
      const auto from = static_cast<std::ptrdiff_t>(std::min<std::size_t>(view_.index, tube.size() - 1));
      next.segment.clearance = clearance_of(next, *world_, {tube.begin() + from, tube.end()});
      if (!(next.segment.clearance > 0))
        return "the way back is not clear: " + std::to_string(next.segment.clearance) + " m";
      next.segment.stops = stops_of(next, *world_);
      spdlog::info("loop closure {}: {:.3f} m and {:.2f} degrees, rectified from command {} on", view_.closures,
                   (D.point(view_.command.p_W) - view_.command.p_W).norm(), D.yaw * 180 / 3.14159265358979, branch);
      if (offer(std::move(next))) return std::nullopt;
      refresh();
      if (view_.closures == flying_->segment.closures || view_.braking) return std::nullopt;
    }
    return "the flight was past the branch each time";
  }

  bool offer(Flying next) {
    const std::uint64_t id = next.segment.id;
    recorder_.append(study::RecordKind::offer, study::encode(next.segment));
    channels_.segments.offer(std::make_unique<const track::AcceptedSegment>(next.segment));
    for (int wait = 0; wait < 100 && !channels_.stop; ++wait) {
      std::this_thread::sleep_for(1ms);
      refresh();
      if (view_.segment == id) {
        record(next);
        accepted_(next.segment);
        flying_ = std::move(next);
        return true;
      }
      if (view_.refused_segment == id) return false;
    }
    return false;
  }

  void record(const Flying& flying) {
    const auto& s = flying.segment;
    study::SegmentRecord head{};
    head.id = s.id;
    head.continues = s.continues;
    head.commands = s.commands.size();
    head.search_ms = flying.metrics.search_ms;
    head.optimise_ms = flying.metrics.optimise_ms;
    head.verify_ms = flying.metrics.verify_ms;
    std::copy_n(flying.start.p_W.data(), 3, head.start_p);
    std::copy_n(flying.start.v_W.data(), 3, head.start_v);
    std::vector<double> rows;
    const auto add = [&rows](const Setpoint& c) {
      for (const Vec3& v : {c.p_W, c.v_W, c.a_W}) rows.insert(rows.end(), v.data(), v.data() + 3);
      rows.push_back(c.yaw);
    };
    add(flying.previous);
    for (const Setpoint& c : s.commands) add(c);
    std::vector<std::uint8_t> bytes(sizeof head + rows.size() * sizeof(double));
    std::memcpy(bytes.data(), &head, sizeof head);
    std::memcpy(bytes.data() + sizeof head, rows.data(), rows.size() * sizeof(double));
    recorder_.append(study::RecordKind::segment, bytes);
  }

  Channels& channels_;
  Recorder& recorder_;
  const SegmentAccepted& accepted_;
  ControlView view_;
  std::shared_ptr<const plan::World> world_;
  bool new_world_ = false;
  std::uint64_t last_id_ = 0, blocked_ = 0;
  std::optional<Flying> flying_;
};

}  // namespace

void run_planner(Channels& channels, Recorder& recorder, const SegmentAccepted& accepted) {
  Planner planner(channels, recorder, accepted);
  while (!channels.stop) {
    const PlanJob* job = channels.jobs.take();
    if (!job) {
      std::this_thread::sleep_for(2ms);
      planner.watch();
      continue;
    }
    const auto refused = planner.perform(*job);
    PlanOutcome outcome{job->id, !refused, {}};
    if (refused) std::snprintf(outcome.reason.data(), outcome.reason.size(), "%s", refused->c_str());
    channels.jobs.give_back(job);
    channels.outcomes.push(outcome);
  }
}

}  // namespace backwash::daemon
