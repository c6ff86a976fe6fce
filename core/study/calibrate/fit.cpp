// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/calibrate/fit.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <nlopt.hpp>

#include "core/study/calibrate/calibration_rules.hpp"
#include "core/types/normal.hpp"

namespace backwash::study::calibrate {
namespace {

constexpr double kSmoothing = kCalibrationRules.smoothing, kLeastBase = kCalibrationRules.least_base;
constexpr double kLargestDecay = kCalibrationRules.largest_decay;

/// Levels of the flights, per group.
using Levels = std::vector<std::array<double, kGroups>>;

/// Smoothed ρ_q(r) and its slope: the pinball loss under a logistic kernel.
struct Smooth {
  double value, slope;
};
Smooth smooth_pinball(double r, double q) {
  const double e = std::exp(-std::abs(r) / kSmoothing);
  const double below = r < 0 ? 1 / (1 + e) : e / (1 + e);
  return {q * r + kSmoothing * std::log1p(e) + std::max(0.0, -r), q - below};
}

/// The smoothed loss over scaled parameters x: amplitude = scale·x, x ≥ 0; the last two are ln k2 themselves.
class Loss {
 public:
  Loss(const Data& data, std::span<const double> weights, double q, const Free& free)
      : data_(data), weights_(weights), q_(q), free_(free) {
    for (const auto& h : data_.hovers) total_ += 3 * weights_[h.flight] * static_cast<double>(h.ln_variance.size());
    set_scales();
  }
  void set_levels(const Levels& levels) { levels_ = levels; }
  const Parameters& scales() const { return scale_; }

  double operator()(const Parameters& x, Parameters& gradient) const {
    gradient.fill(0);
    double sum = 0;
    for (const auto& h : data_.hovers) {
      const double weight = weights_[h.flight] / total_;
      if (weight == 0) continue;
      const FeaturesAt d = at_decays(h.features, x[kGroundK2], x[kWallK2]);
      const FeaturesAt slopes{d.ground_slope, 0, d.wall_xx_slope, 0, d.wall_slope, 0};
      for (int axis = 0; axis < 3; ++axis) {
        const auto f = factors(h.features, d, axis), by_k2 = factors(h.features, slopes, axis);
        double sigma = 0;
        for (std::size_t j = 0; j < kAmplitudes; ++j) sigma += f[j] * scale_[j] * x[j];
        const double at = std::log(sigma) + levels_[h.flight][group(axis)];
        double slope = 0;
        for (const auto& v : h.ln_variance) {
          const Smooth rho = smooth_pinball(v[axis] - at, q_);
          sum += weight * rho.value;
          slope += rho.slope;
        }
        slope *= -weight / sigma;
        for (std::size_t j = 0; j < kAmplitudes; ++j) gradient[j] += slope * f[j] * scale_[j];
        for (const Parameter p : {kGroundK1H, kGroundK1Z}) gradient[kGroundK2] += slope * by_k2[p] * scale_[p] * x[p];
        for (const Parameter p : {kWallN, kWallT, kWallZ}) gradient[kWallK2] += slope * by_k2[p] * scale_[p] * x[p];
      }
    }
    for (std::size_t j = 0; j < kParameters; ++j) {
      if (!free_[j]) gradient[j] = 0;
    }
    return sum;
  }

 private:
  /// An amplitude's scale makes its mean contribution the typical variance: x of order 1.
  void set_scales() {
    Parameters mean{};
    double ln_variance = 0, windows = 0;
    const double ln_decay = std::log(kCalibrationRules.first_decay);
    for (const auto& h : data_.hovers) {
      const FeaturesAt d = at_decays(h.features, ln_decay, ln_decay);
      for (int axis = 0; axis < 3; ++axis) {
        const auto f = factors(h.features, d, axis);
        for (std::size_t j = 0; j < kAmplitudes; ++j) mean[j] += f[j] / static_cast<double>(data_.hovers.size());
      }
      for (const auto& v : h.ln_variance) {
        ln_variance += v.mean();
        windows += 1;
      }
    }
    scale_.fill(1);
    for (std::size_t j = 0; j < kAmplitudes; ++j) {
      if (mean[j] > 0) scale_[j] = std::exp(ln_variance / windows) / mean[j];
    }
  }

  const Data& data_;
  std::span<const double> weights_;
  double q_, total_ = 0;
  Free free_;
  Levels levels_;
  Parameters scale_{};
};

struct Call {
  const Loss* loss;
  Parameters best_x;
  double best;
};

double evaluate(const std::vector<double>& x, std::vector<double>& gradient, void* data) {
  auto& call = *static_cast<Call*>(data);
  Parameters at, slope;
  std::copy(x.begin(), x.end(), at.begin());
  const double value = (*call.loss)(at, slope);
  if (!gradient.empty()) std::copy(slope.begin(), slope.end(), gradient.begin());
  if (value < call.best) {
    call.best = value;
    call.best_x = at;
  }
  return value;
}

/// Minimum near x; the best point seen stands if the solver stops early.
Parameters minimised(const Loss& loss, const Parameters& x, const Free& free, double tolerance) {
  nlopt::opt solver(nlopt::LD_LBFGS, kParameters);
  std::vector<double> low(kParameters, 0.0), high(kParameters, kCalibrationRules.largest_scaled);
  low[kBaseH] = kLeastBase / loss.scales()[kBaseH];
  low[kBaseZ] = kLeastBase / loss.scales()[kBaseZ];
  low[kGroundK2] = low[kWallK2] = std::log(kCalibrationRules.least_decay);
  high[kGroundK2] = high[kWallK2] = std::log(kLargestDecay);
  std::vector<double> at(x.begin(), x.end());
  for (std::size_t j = 0; j < kParameters; ++j) {
    if (!free[j]) low[j] = high[j] = at[j];
    at[j] = std::clamp(at[j], low[j], high[j]);
  }
  solver.set_lower_bounds(low);
  solver.set_upper_bounds(high);
  solver.set_ftol_rel(tolerance);
  solver.set_maxeval(static_cast<int>(kCalibrationRules.evaluations));
  Call call{&loss, x, std::numeric_limits<double>::infinity()};
  std::copy(at.begin(), at.end(), call.best_x.begin());
  solver.set_min_objective(evaluate, &call);
  double value = 0;
  try {
    solver.optimize(at, value);
  } catch (const nlopt::roundoff_limited&) {
  } catch (const std::runtime_error&) {  // "nlopt failure" of a line search
  }
  return call.best_x;
}

/// Level of each flight and the scatter between and within them.
struct LevelScatter {
  Levels levels;  ///< shrunk
  Levels means;   ///< mean residual less that of the place, not shrunk
  std::array<double, kGroups> between{}, within{};
};

/// Sums of one group by flight.
struct Sums {
  Eigen::ArrayXd first, second, count;
  explicit Sums(Eigen::Index n) : first(n), second(n), count(n) { first = second = count = Eigen::ArrayXd::Zero(n); }
};

void analyse(const Data& data, std::span<const double> weights, const Sums& r, Group g, LevelScatter& s) {
  const auto flights = static_cast<Eigen::Index>(weights.size());
  const Eigen::ArrayXd all = Eigen::Map<const Eigen::ArrayXd>(weights.data(), flights), n = r.count.max(1);
  const Eigen::ArrayXd weight = (r.count > 0).select(all, 0);
  Eigen::ArrayXd mean = r.first / n;
  const double total = weight.sum(), freedom = (weight * (n - 1)).sum();
  const double within = freedom > 0 ? (weight * (r.second - n * mean.square())).sum() / freedom : 0;
  const auto places = static_cast<Eigen::Index>(1 + *std::ranges::max_element(data.place));
  Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(places), of = sum;
  const auto place = [&](Eigen::Index f) { return static_cast<Eigen::Index>(data.place[static_cast<std::size_t>(f)]); };
  for (Eigen::Index f = 0; f < flights; ++f) {
    sum[place(f)] += weight[f] * mean[f];
    of[place(f)] += weight[f];
  }
  for (Eigen::Index f = 0; f < flights; ++f) mean[f] = weight[f] > 0 ? mean[f] - sum[place(f)] / of[place(f)] : 0;
  const double explained = within * (weight / n).sum() / total, free = total - static_cast<double>((of > 0).count());
  const double variance = free > 0 ? std::max(0.0, (weight * mean.square()).sum() / free - explained) : 0;
  s.between[g] = std::sqrt(variance);
  s.within[g] = std::sqrt(within);
  for (Eigen::Index f = 0; f < flights; ++f) {
    const auto k = static_cast<std::size_t>(f);
    s.means[k][g] = mean[f];
    s.levels[k][g] = variance > 0 ? variance / (variance + within / n[f]) * mean[f] : 0;
  }
}

/// Calls each(flight, axis, ln variance of a window less that of the fitted Σ) for the flights of any weight.
template <typename Each>
void for_each_residual(const Data& data, std::span<const double> weights, const Parameters& parameters,
                       const Each& each) {
  for (const auto& h : data.hovers) {
    if (weights[h.flight] == 0) continue;
    const Vec3 at = bound_variance(h.features, parameters).array().log();
    for (const auto& v : h.ln_variance)
      for (int axis = 0; axis < 3; ++axis) each(h.flight, axis, v[axis] - at[axis]);
  }
}

LevelScatter scatter(const Data& data, std::span<const double> weights, const Parameters& parameters) {
  const std::size_t flights = weights.size();
  LevelScatter s{Levels(flights), Levels(flights), {}, {}};
  const auto n = static_cast<Eigen::Index>(flights);
  std::array<Sums, kGroups> sums{Sums(n), Sums(n)};
  for_each_residual(data, weights, parameters, [&](std::size_t number, int axis, double r) {
    auto& g = sums[group(axis)];
    const auto flight = static_cast<Eigen::Index>(number);
    g.first[flight] += r;
    g.second[flight] += r * r;
    g.count[flight] += 1;
  });
  for (const Group g : {kHorizontal, kVertical}) analyse(data, weights, sums[g], g, s);
  return s;
}

/// ln of the factor on a group's Σ that a new flight's windows stay below with probability q.
double level_shift(const Data& data, std::span<const double> weights, const Parameters& parameters,
                   const LevelScatter& s, Group g, double q) {
  std::vector<std::pair<double, double>> within;  // residual about its flight's level, weight
  double total = 0;
  for_each_residual(data, weights, parameters, [&](std::size_t flight, int axis, double r) {
    if (group(axis) != g) return;
    within.emplace_back(r - s.means[flight][g], weights[flight]);
    total += weights[flight];
  });
  const double sd = std::max(s.between[g], kCalibrationRules.least_between.value);
  const auto covered = [&](double shift) {
    double sum = 0;
    for (const auto& [r, weight] : within) sum += weight * normal::below((shift - r) / sd);
    return sum / total;
  };
  double low = -kCalibrationRules.level_range, high = kCalibrationRules.level_range;
  for (int i = 0; i < kCalibrationRules.level_halvings; ++i) {
    const double middle = 0.5 * (low + high);
    (covered(middle) < q ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

constexpr bool vertical(std::size_t p) {
  return p == kBaseZ || p == kGroundLambdaZ || p == kGroundK1Z || p == kCornerZ || p == kWallZ;
}

}  // namespace

Vec3 bound_variance(const Features& features, const Parameters& parameters) noexcept {
  const FeaturesAt d = at_decays(features, std::log(parameters[kGroundK2]), std::log(parameters[kWallK2]));
  Vec3 sigma;
  for (int axis = 0; axis < 3; ++axis) {
    const auto f = factors(features, d, axis);
    sigma[axis] = 0;
    for (std::size_t j = 0; j < kAmplitudes; ++j) sigma[axis] += f[j] * parameters[j];
  }
  return sigma;
}

Fit fit(const Data& data, std::span<const double> flight_weights, const Parameters& start, const FitOptions& options) {
  Loss loss(data, flight_weights, options.quantile, options.free);
  const auto scaled = [&](Parameters p, int direction) {
    for (std::size_t j = 0; j < kAmplitudes; ++j) p[j] *= direction > 0 ? 1 / loss.scales()[j] : loss.scales()[j];
    for (const std::size_t j : {kGroundK2, kWallK2}) p[j] = direction > 0 ? std::log(p[j]) : std::exp(p[j]);
    return p;
  };
  Fit result{start, 0, {}, {}};
  for (int round = 0; round < options.rounds; ++round) {
    loss.set_levels(scatter(data, flight_weights, result.parameters).levels);
    const double tolerance =
        round + 1 < options.rounds ? kCalibrationRules.rough_tolerance : kCalibrationRules.fine_tolerance;
    result.parameters = scaled(minimised(loss, scaled(result.parameters, 1), options.free, tolerance), -1);
  }
  const LevelScatter s = scatter(data, flight_weights, result.parameters);
  result.between_sd = s.between;
  result.within_sd = s.within;
  for (const Group g : {kHorizontal, kVertical}) {
    const double factor = std::exp(level_shift(data, flight_weights, result.parameters, s, g, options.quantile));
    for (std::size_t j = 0; j < kAmplitudes; ++j) {
      if (options.free[j] && vertical(j) == (g == kVertical)) result.parameters[j] *= factor;
    }
  }
  double total = 0;
  for (const auto& h : data.hovers) {
    const Vec3 at = bound_variance(h.features, result.parameters).array().log();
    for (const auto& v : h.ln_variance) {
      for (int axis = 0; axis < 3; ++axis)
        result.loss += flight_weights[h.flight] * pinball(v[axis] - at[axis], options.quantile);
      total += 3 * flight_weights[h.flight];
    }
  }
  result.loss /= total;
  return result;
}

}  // namespace backwash::study::calibrate
