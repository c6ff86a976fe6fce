// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/spline/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "core/plan/rest.hpp"

namespace backwash::plan {

namespace {

constexpr double kOptimiseShare = 0.97;              ///< of the limits: re-timing has little left to do
constexpr double kFirstMargin = 0.02;                ///< m beyond the tube, in the collision cost of the first round
constexpr double kMoreMargin = 0.02;                 ///< m, after each round that fails verification
constexpr std::size_t kFailures = 4;                 ///< of verification, per pace
constexpr double kWorthwhile = 0.005;                ///< share of the cost that a round of polishing must gain
constexpr double kQuickenings[] = {1.0, 0.5, 0.25};  ///< share of what the limits leave
constexpr double kPaces[] = {1.0, 0.7, 0.45};        ///< share of the searched path's speed

/// Time between control points: 0.6 m of flight at full speed. Half of it costs 0.7 times more and smooths no better.
double knot_span(double v_max) { return std::clamp(0.6 / v_max, 0.15, 0.6); }

BSpline fit_path(const std::vector<Motion>& motions, const PlanStart& start, const Vec3& goal_W, double v_max,
                 double pace) {
  PathSamples samples = sample(motions, pace * knot_span(v_max * pace));
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

BSpline retimed(BSpline spline, const PlanStart& start, const MotionLimits& limits) {
  for (int i = 0; i < 30; ++i) {
    const double stretch = stretch_needed(spline, limits);
    if (stretch <= 1) break;
    spline = with_knot_span(std::move(spline), start, 1.0001 * std::min(stretch, 1.5) * spline.knot_span);
  }
  return spline;
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

/// What ∫‖p⃛‖² dt is when every trajectory takes the same time.
double jerk2_at_equal_time(const BSpline& spline) { return spline.jerk2() * std::pow(spline.duration(), 5); }

class Refiner {
 public:
  Refiner(const World& world, const PlanStart& start, const PlanOptions& options, Clock::time_point deadline)
      : world_(world),
        start_(start),
        options_(options),
        deadline_(deadline),
        limits_{Vec3::Constant(options.v_max), start.command.a_W.cwiseAbs().cwiseMax(options.a_max),
                start.command.v_W} {}

  /// Rounds from one spline, and what they keep as fast as it may be.
  void run(BSpline spline) {
    polish(std::move(spline));
    if (options_.polish > 0 && result_.found) quicken();
  }
  const Refinement& result() const noexcept { return result_; }

 private:
  void polish(BSpline spline) {
    reach::ReachTube tube = fly(spline).tube;
    std::size_t polish = options_.polish;
    double margin = kFirstMargin;
    for (std::size_t failures = 0; failures < kFailures;) {
      result_.out_of_time = Clock::now() > deadline_;
      if (result_.out_of_time) return;
      const bool polishing = result_.found.has_value();
      const auto round = optimised(spline, tube, margin, polishing ? polish : options_.evaluations);
      if (polishing) polish -= std::min(polish, round.evaluations);
      spline = retimed(round.spline, start_, limits_);
      Refined candidate = fly(spline);
      if (!verified(candidate)) {
        ++failures;
        margin += kMoreMargin;
        tube = candidate.tube;
      } else {
        // An unfinished curve may need more time than it will in the end: polished at the pace it had.
        const bool slowed = spline.knot_span > round.spline.knot_span;
        if (slowed) spline = round.spline;
        tube = slowed && polish > 0 ? fly(spline).tube : candidate.tube;
        if (!keep(std::move(candidate)) || round.converged) return;
      }
      if (result_.found && polish == 0) return;
    }
  }

  /// Less time for the same curve, up to the limits: the most of it that is verified. From a motion another pace is
  /// another curve, taken if it costs no more.
  void quicken() {
    const BSpline polished = result_.found->trajectory;
    const double most = 1 - stretch_needed(polished, limits_);
    for (const double share : kQuickenings) {
      if (share * most < kWorthwhile || Clock::now() > deadline_) return;
      const double knot_span = (1 - share * most) * polished.knot_span;
      Refined candidate = fly(retimed(with_knot_span(polished, start_, knot_span), start_, limits_));
      if (jerk2_at_equal_time(candidate.trajectory) > (1 + 1e-9) * jerk2_at_equal_time(polished)) return;
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

  OptimizerResult optimised(const BSpline& spline, const reach::ReachTube& tube, double margin,
                            std::size_t evaluations) {
    const auto begun = Clock::now();
    const SplineCost cost(world_, spline, tube, margin, limits_.scaled(kOptimiseShare), {}, options_.norm_cost);
    auto optimum = optimise(cost, std::min(evaluations, options_.evaluations), deadline_);
    result_.optimise_ms += ms_since(begun);
    result_.evaluations += optimum.evaluations;
    return optimum;
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
    if (clear && stretch_needed(candidate.trajectory, limits_) <= 1) return true;
    result_.why = clear ? "no timing keeps the limits from this start" : touching(nearest);
    return false;
  }

  /// Keeps what costs less; whether it does by as much as a round is worth.
  bool keep(Refined candidate) {
    const double now = result_.found ? jerk2_at_equal_time(result_.found->trajectory) : INFINITY;
    const double then = jerk2_at_equal_time(candidate.trajectory);
    if (then < now) result_.found = std::move(candidate);
    return then < (1 - kWorthwhile) * now;
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
    refiner.run(fit_path(path, start, goal_W, options.v_max, pace));
    if (refiner.result().found || refiner.result().out_of_time) break;
  }
  return refiner.result();
}

}  // namespace backwash::plan
