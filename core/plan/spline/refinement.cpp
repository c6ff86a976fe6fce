// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/spline/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "core/plan/rest.hpp"
#include "core/plan/spline/least_jerk.hpp"

namespace backwash::plan {

namespace {

constexpr double kOptimiseShare = 0.97;        ///< of the limits: re-timing has little left to do
constexpr double kFirstMargin = 0.02;          ///< m beyond the set, in the first round
constexpr double kMoreMargin = 0.02;           ///< m, after each round that fails verification
constexpr double kMostStretch = 1.5;           ///< of a curve's time, for the limits' sake
constexpr int kTries = 4;                      ///< per pace
constexpr double kPaces[] = {1.0, 0.7, 0.45};  ///< share of the searched path's speed, and of the limit

/// Time between control points: 0.6 m of flight at full speed. Half of it costs 0.7 times more and smooths no better.
double knot_span(double v_max) { return std::clamp(0.6 / v_max, 0.15, 0.6); }

BSpline fit_path(const std::vector<Motion>& motions, const PlanStart& start, const Vec3& goal_W, double v_max,
                 double pace) {
  PathSamples samples = sample(motions, pace * knot_span(v_max));
  samples.positions.front() = start.command.p_W;
  samples.positions.back() = goal_W;
  return fit(samples.positions, samples.step / pace, start.command.v_W, start.command.a_W, Vec3::Zero(), Vec3::Zero());
}

/// By what the knot span may change for the control points of velocity and acceleration to keep the limits: above 1 it
/// must grow. What the start fixes (its velocity and acceleration) is kept and not judged.
double stretch_needed(const BSpline& spline, const MotionLimits& limits) {
  const auto velocity = spline.velocity_points(), acceleration = spline.acceleration_points();
  double stretch = 0;
  for (std::size_t n = 2; n < velocity.size(); ++n)
    stretch = std::max(stretch, (velocity[n].array().abs() / limits.velocity(n, spline.knot_span).array()).maxCoeff());
  for (std::size_t n = 1; n < acceleration.size(); ++n)
    stretch = std::max(stretch, std::sqrt((acceleration[n].array().abs() / limits.a.array()).maxCoeff()));
  return stretch;
}

/// The same curve with another knot span; its start keeps velocity and acceleration.
BSpline with_knot_span(BSpline spline, const PlanStart& start, double knot_span) {
  spline.knot_span = knot_span;
  std::ranges::copy(end_control_points(start.command.p_W, start.command.v_W, start.command.a_W, knot_span),
                    spline.control_points.begin());
  return spline;
}

bool at_rest(const PlanStart& start) { return start.command.v_W.isZero(0) && start.command.a_W.isZero(0); }

/// The same curve as fast as the limits let it be. From a motion another pace is another curve: slower alone, where it
/// must be, and not every one is slow enough in kMostStretch times its time.
BSpline retimed(BSpline spline, const PlanStart& start, const MotionLimits& limits) {
  if (at_rest(start)) {
    const double quickest = stretch_needed(spline, limits) * spline.knot_span;
    spline = with_knot_span(std::move(spline), start, std::max(quickest, kControlPeriod));
  }
  const double longest = kMostStretch * spline.knot_span;
  for (;;) {
    const double stretch = stretch_needed(spline, limits);
    if (!(stretch > 1) || !(spline.knot_span <= longest)) return spline;
    spline = with_knot_span(std::move(spline), start, 1.0001 * std::min(stretch, 1.5) * spline.knot_span);
  }
}

std::string touching(const Approach& nearest) {
  const Vec3& p = nearest.center.p_W;
  char buffer[128];
  std::snprintf(buffer, sizeof buffer, "the tube touches at (%.2f, %.2f, %.2f): clearance %.3f m", p.x(), p.y(), p.z(),
                nearest.clearance);
  return buffer;
}

std::string too_risky(const World& world, const reach::Risk& risk) {
  const Vec3& p = risk.center_W;
  const double stated = world.bounds.model().stated->touch;
  char buffer[200];
  if (risk.total > stated)
    std::snprintf(buffer, sizeof buffer,
                  "the risk of touching is %.2g or more, %.2g is stated; %.0f %% of it is about (%.2f, %.2f, %.2f)",
                  risk.total, stated, 100 * risk.largest / risk.total, p.x(), p.y(), p.z());
  else
    std::snprintf(buffer, sizeof buffer,
                  "the risk of touching is %.2g in a minute of resting at its end, %.2g is stated", risk.a_minute,
                  stated);
  return buffer;
}

class Refiner {
 public:
  Refiner(const World& world, const PlanStart& start, const PlanOptions& options, Clock::time_point deadline)
      : world_(world),
        start_(start),
        options_(options),
        deadline_(deadline),
        limits_{Vec3::Constant(options.v_max), start.command.a_W.cwiseAbs().cwiseMax(options.a_max),
                start.command.v_W} {}

  /// Rounds from the searched path's spline: about hover sets first, then about the sets of what failed. The last is
  /// that spline itself: it lies where hovering is safe.
  void run(const BSpline& path, double pace) {
    MotionLimits limits = limits_;
    if (at_rest(start_)) limits = {pace * limits_.v, pace * pace * limits_.a, limits_.v_start};
    std::optional<Refined> failed;
    for (int round = 0; round < kTries; ++round) {
      result_.out_of_time = Clock::now() > deadline_;
      if (result_.out_of_time) return;
      const double margin = kFirstMargin + round * kMoreMargin;
      const BSpline& begun = failed ? failed->trajectory : path;
      const BSpline curve = retimed(round + 1 < kTries ? optimised(begun, failed, margin) : path, start_, limits);
      if (!(stretch_needed(curve, limits_) <= 1)) {
        result_.why = "no timing keeps the limits from this start";
        continue;
      }
      Refined candidate = fly(curve);
      if (verified(candidate)) {
        result_.found = std::move(candidate);
        if (pace < 1 && at_rest(start_)) quicken(pace);
        return;
      }
      failed = std::move(candidate);
    }
  }
  const Refinement& result() const noexcept { return result_; }

 private:
  /// What passed at a slower pace may pass faster: at the limits, or half way to them.
  void quicken(double pace) {
    for (const double faster : {1.0, (1 + pace) / 2}) {
      Refined candidate = fly(retimed(result_.found->trajectory, start_,
                                      {faster * limits_.v, faster * faster * limits_.a, limits_.v_start}));
      if (!verified(candidate)) continue;
      result_.found = std::move(candidate);
      return;
    }
  }

  Refined fly(const BSpline& spline) {
    const auto begun = Clock::now();
    Refined flight{spline, spline.commands(), {}, 0};
    hold_until_settled(world_.reach, flight.commands);
    flight.tube = tube_to_rest(world_, start_.estimated, start_.command, flight.commands);
    result_.tubes_ms += ms_since(begun);
    return flight;
  }

  BSpline optimised(const BSpline& begun, const std::optional<Refined>& failed, double margin) {
    const auto from = Clock::now();
    std::optional<Flown> flown;
    if (failed) flown.emplace(Flown{failed->trajectory, failed->tube});
    auto optimum = least_jerk(world_, begun, flown ? &*flown : nullptr, margin, limits_.scaled(kOptimiseShare),
                              options_.norm_cost);
    result_.optimise_ms += ms_since(from);
    result_.evaluations += optimum.steps;
    return std::move(optimum.curve);
  }

  bool verified(Refined& candidate) {
    const auto begun = Clock::now();
    const Approach nearest = nearest_approach(world_, candidate.tube);
    candidate.clearance_m = nearest.clearance;
    const bool clear = nearest.clearance > options_.least_clearance_m;
    if (clear) candidate.risk = risk_of(world_, candidate.tube, 0, options_.least_clearance_m);
    result_.verify_ms += ms_since(begun);
    if (clear && !keeps(world_, candidate.risk)) {
      result_.why = too_risky(world_, candidate.risk);
      return false;
    }
    if (!clear) result_.why = touching(nearest);
    return clear;
  }

  const World& world_;
  const PlanStart& start_;
  const PlanOptions& options_;
  Clock::time_point deadline_;
  MotionLimits limits_;
  Refinement result_;
};

}  // namespace

Refinement refine(const World& world, const std::vector<Motion>& path, const PlanStart& start, const Vec3& goal_W,
                  const PlanOptions& options, Clock::time_point deadline) {
  Refiner refiner(world, start, options, deadline);
  for (const double pace : kPaces) {
    refiner.run(fit_path(path, start, goal_W, options.v_max, pace), pace);
    if (refiner.result().found || refiner.result().out_of_time) break;
  }
  return refiner.result();
}

}  // namespace backwash::plan
