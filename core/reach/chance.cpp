// SPDX-License-Identifier: BSD-3-Clause
#include "core/reach/chance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/reach/response/response_builder.hpp"

namespace backwash::reach {
namespace {

constexpr double kSpent = 0.9;  // share of the probability that the levels spend
const std::size_t kStepsPerSecond = static_cast<std::size_t>(std::lround(1 / kControlPeriod));

struct Coloured {
  ColouredStep horizontal, vertical;
};

/// The Gaussian part in all five directions over one step of 20 ms.
struct GaussianStep {
  PerDirection deviation{};  ///< σ_e at its start, m
  PerDirection largest{};    ///< bound on σ_e from its start to its end, m
  PerDirection turned{};     ///< rad
  std::array<bool, kDirections> started{};
};

class GaussianError {
 public:
  explicit GaussianError(const Coloured& coloured)
      : direction_{ErrorCovariance(coloured.horizontal), ErrorCovariance(coloured.horizontal),
                   ErrorCovariance(coloured.vertical), ErrorCovariance(coloured.horizontal),
                   ErrorCovariance(coloured.horizontal)} {}
  PerDirection deviations() const noexcept {
    PerDirection sigma;
    for (std::size_t d = 0; d < kDirections; ++d) sigma[d] = direction_[d].position_deviation();
    return sigma;
  }
  GaussianStep step(const PerDirection& s) noexcept {
    GaussianStep result;
    result.deviation = result.largest = deviations();
    for (std::size_t d = 0; d < kDirections; ++d) {
      for (int phase = 0; phase < kPhases; ++phase) {
        direction_[d].advance(s[d]);
        result.largest[d] = std::max(result.largest[d], direction_[d].largest_deviation());
        result.turned[d] += direction_[d].turned();
        result.started[d] = result.started[d] || direction_[d].started();
      }
    }
    return result;
  }

 private:
  std::array<ErrorCovariance, kDirections> direction_;
};

/// Levels of each begun second, at least those given, that keep the exits in it within `share` (of what there is of
/// it).
std::vector<PerDirection> sufficient(std::vector<PerDirection> level, const std::vector<GaussianStep>& steps,
                                     double share) {
  PerDirection before;
  before.fill(std::numeric_limits<double>::infinity());
  for (std::size_t n = 0; n < level.size(); ++n) {
    const std::size_t begin = n * kStepsPerSecond;
    PerDirection turned{};
    const std::size_t end = std::min(begin + kStepsPerSecond, steps.size());
    for (std::size_t k = begin; k < end; ++k) {
      for (std::size_t d = 0; d < kDirections; ++d) {
        turned[d] += steps[k].turned[d];
        if (steps[k].started[d]) before[d] = std::numeric_limits<double>::infinity();
      }
    }
    for (std::size_t d = 0; d < kDirections; ++d) {
      const double part = static_cast<double>(end - begin) / static_cast<double>(kStepsPerSecond);
      level[n][d] = std::max(level[n][d], exit_level(turned[d], before[d], part * share));
    }
    before = level[n];
  }
  return level;
}

/// Widens the deterministic tube by level × σ.
PerDirection sum(PerDirection h, const PerDirection& level, const PerDirection& sigma) {
  for (std::size_t d = 0; d < kDirections; ++d) h[d] += level[d] * sigma[d];
  return h;
}

void check(const Reachability& reach, double probability) {
  if (!(probability > 0) || !(probability < 1))
    throw std::invalid_argument("chance-constrained sets need a probability above 0 and below 1");
  if (reach.method != Method::tight) throw std::invalid_argument("chance-constrained sets have no ellipsoids");
  if (has_integrator(reach.vehicle))
    throw std::invalid_argument(
        "controller.velocity_integrator: chance-constrained sets do not know it; leave it out or ask for the worst "
        "case");
  if (reach.loop == Loop::sampled)
    throw std::invalid_argument(
        "chance-constrained sets know continuous feedback only; choose the loop vehicle or continuous");
}

/// The tube under the mean push alone: centres and deterministic half widths.
ReachTube mean_tube(const Reachability& reach, const State& start, const Setpoint& previous,
                    std::span<const Setpoint> commands, const BoundModel& model) {
  const std::vector<DisturbanceBound> mean(commands.size(), bound(Variance{}, model));
  return tube_with_bounds(reach, start, previous, commands, mean);
}

/// The same with the mean push of an extended model. What it varies by is taken over the worst case's sets, which are
/// wider.
ReachTube mean_tube_over_field(const Reachability& reach, const State& start, const Setpoint& previous,
                               std::span<const Setpoint> commands, const BoundField& bounds, const BoundModel& model) {
  if (bounds.extension().none()) return mean_tube(reach, start, previous, commands, model);
  const ReachTube worst = tube_over_field(reach, start, previous, commands, bounds);
  std::vector<DisturbanceBound> mean(commands.size(), bound(Variance{}, model));
  std::vector<Vec3> pushes;
  for (std::size_t k = 0; k < commands.size(); ++k) {
    const State &from = worst[k].center, &to = worst[k + 1].center;
    const auto& h = worst[k].half_widths_interval;
    const Vec3 extent(h[kX], h[kY], h[kZ]);
    pushes.push_back(bounds.push(from.p_W, from.v_W));
    const PerDirection spread = bounds.push_spread(pushes.back(), from.v_W, from.p_W.cwiseMin(to.p_W) - extent,
                                                   from.p_W.cwiseMax(to.p_W) + extent);
    for (std::size_t d = 0; d < kDirections; ++d) mean[k].w[d] += spread[d];
  }
  return tube_with_bounds(reach, start, previous, commands, mean, pushes);
}

/// s of a step, given the level in force, the error at its start and its number.
template <typename ScaleOf>
ChanceTube propagate(const Reachability& reach, const BoundModel& model, ReachTube mean, double probability,
                     const ScaleOf& scale_of) {
  const Coloured coloured{ColouredStep(axis_loop(reach.vehicle, false, reach.loop), model.tau_w),
                          ColouredStep(axis_loop(reach.vehicle, true, reach.loop), model.tau_w)};
  const double share = kSpent * probability / static_cast<double>(kDirections);
  // The levels follow from how fast the error turns, that from the scales, and those from the sets and so the levels:
  // raised until they suffice for themselves. Scales hardly change them, so one or two rounds do.
  std::vector<PerDirection> level((mean.size() + kStepsPerSecond - 1) / kStepsPerSecond, PerDirection{});
  std::vector<GaussianStep> steps;
  std::vector<PerDirection> scales;
  for (bool enough = false; !enough;) {
    steps.clear();
    scales.clear();
    GaussianError error(coloured);
    PerDirection s{};
    for (std::size_t k = 0; k < mean.size(); ++k) {
      if (k + 1 < mean.size()) s = scale_of(k, mean, level[k / kStepsPerSecond], error);  // else: the last one held
      scales.push_back(s);
      steps.push_back(error.step(s));
    }
    const auto needed = sufficient(level, steps, share);
    enough = needed == level;
    level = needed;
  }
  for (std::size_t k = 0; k < mean.size(); ++k) {
    TubeStep& step = mean[k];
    const PerDirection& eta = level[k / kStepsPerSecond];
    step.half_widths = sum(step.half_widths, eta, steps[k].deviation);
    step.half_widths_interval = sum(step.half_widths_interval, eta, steps[k].largest);
    step.w_bar.w = scales[k];
    step.r_max = Vec3(step.half_widths[kX], step.half_widths[kY], step.half_widths[kZ]).norm();
  }
  return {std::move(mean), std::move(level)};
}

}  // namespace

ChanceTube chance_tube_with_variances(const Reachability& reach, const State& start, const Setpoint& previous,
                                      std::span<const Setpoint> commands, std::span<const Variance> sigma,
                                      const BoundModel& model, double probability) {
  check(reach, probability);
  if (commands.size() != sigma.size())
    throw std::invalid_argument("chance_tube_with_variances: one variance per command is needed");
  const BoundModel deviation{1, 0, 0, model.tau_w};
  return propagate(reach, model, mean_tube(reach, start, previous, commands, model), probability,
                   [&](std::size_t k, const auto&...) { return bound(sigma[k], deviation).w; });
}

ChanceTube chance_tube_over_field(const Reachability& reach, const State& start, const Setpoint& previous,
                                  std::span<const Setpoint> commands, const BoundField& bounds, const BoundModel& model,
                                  double probability) {
  check(reach, probability);
  if (!(model.kappa > 0)) throw std::invalid_argument("chance-constrained sets over a field need kappa above 0");
  const PerDirection mean_push = bound(Variance{}, model).w;
  const auto over_set = [&](std::size_t k, const ReachTube& mean, const PerDirection& level,
                            const GaussianError& error) {
    const Vec3 low = mean[k].center.p_W.cwiseMin(mean[k + 1].center.p_W);
    const Vec3 high = mean[k].center.p_W.cwiseMax(mean[k + 1].center.p_W);
    // From below to the smallest fixed point; the maxima only grow, through finitely many values.
    PerDirection s{};
    for (bool grown = true; grown;) {
      GaussianError trial = error;
      const PerDirection h = sum(mean[k].half_widths_interval, level, trial.step(s).largest);
      const Vec3 extent(h[kX], h[kY], h[kZ]);
      const Vec3 push = bounds.push(mean[k].center.p_W, mean[k].center.v_W);
      const DisturbanceBound found = bounds.max_about(push, mean[k].center.v_W, low - extent, high + extent);
      grown = false;
      for (std::size_t d = 0; d < kDirections; ++d) {
        const double scale = std::max(0.0, (found.w[d] - mean_push[d]) / model.kappa);
        if (scale > s[d]) {
          s[d] = scale;
          grown = true;
        }
      }
    }
    return s;
  };
  return propagate(reach, model, mean_tube_over_field(reach, start, previous, commands, bounds, model), probability,
                   over_set);
}

}  // namespace backwash::reach
