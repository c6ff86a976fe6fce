// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/calibrate/height_effect.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <set>

#include "core/study/calibrate/calibration_rules.hpp"

namespace backwash::study::calibrate {
namespace {

using Eigen::MatrixXd, Eigen::VectorXd;

/// Share of the wash that comes back from the ground.
double returned(double height, double length) { return 1 / (1 + height * height / (length * length)); }

/// One flight: sums of (columns, 1, y) over its rows.
struct FlightSums {
  int day;
  double count = 0;
  VectorXd sum;
  MatrixXd square;
};

/// Columns of a row: those asked for, then speed, plate and (if some flight does not say) the unsaid plate.
using Columns = std::function<std::vector<double>(const HeightRow&)>;

class Regression {
 public:
  Regression(const std::vector<HeightRow>& rows, const Columns& columns) {
    std::map<std::size_t, FlightSums> flights;
    for (const auto& r : rows) {
      auto x = columns(r);
      x.insert(x.end(), {r.ln_speed, r.plate == Plate::above ? 1.0 : 0.0, r.plate == Plate::not_said ? 1.0 : 0.0, 1.0,
                         r.ln_variance_z});
      const VectorXd v = Eigen::Map<const VectorXd>(x.data(), static_cast<Eigen::Index>(x.size()));
      auto& f =
          flights
              .try_emplace(r.flight, FlightSums{r.day, 0, VectorXd::Zero(v.size()), MatrixXd::Zero(v.size(), v.size())})
              .first->second;
      f.count += 1;
      f.sum += v;
      f.square += v * v.transpose();
    }
    for (auto& [number, f] : flights) flights_.push_back(std::move(f));
    columns_ = flights_.front().sum.size() - 2;
  }
  std::size_t flights() const { return flights_.size(); }
  Eigen::Index plate() const { return columns_ - 2; }

  /// β with flights weighing `times` (empty: once each): λ = σ_b²/σ_e².
  VectorXd fit(double lambda, const std::vector<double>& times) const {
    const Eigen::Index n = columns_ + 2, one = columns_;
    std::map<int, MatrixXd> days;
    for (std::size_t k = 0; k < flights_.size(); ++k) {
      const auto& f = flights_[k];
      // V⁻¹ ∝ I − λ/(1 + λ n) 11ᵀ
      const MatrixXd own = f.square - lambda / (1 + lambda * f.count) * f.sum * f.sum.transpose();
      days.try_emplace(f.day, MatrixXd::Zero(n, n)).first->second += (times.empty() ? 1 : times[k]) * own;
    }
    MatrixXd sum = MatrixXd::Zero(n, n);
    for (const auto& [day, g] : days)
      if (g(one, one) > 0) sum += g - g.col(one) * g.row(one) / g(one, one);  // the day's level
    const MatrixXd A = sum.topLeftCorner(columns_, columns_) +
                       kCalibrationRules.height_ridge.value * MatrixXd::Identity(columns_, columns_);
    return A.ldlt().solve(sum.topRightCorner(columns_, 1));
  }

  /// σ_e² and σ_b² of what β leaves, by moments: within flights, and of the flights' means within days.
  std::pair<double, double> components(const VectorXd& beta) const {
    VectorXd r = VectorXd::Zero(columns_ + 2);
    r.head(columns_) = -beta;
    r[columns_ + 1] = 1;
    double sse = 0, free = 0, ssb = 0, spread = 0, members = 0;
    std::map<int, Eigen::Array4d> days;  // n, Σn m, Σn m², Σn²
    for (const auto& f : flights_) {
      const double mean = r.dot(f.sum) / f.count;
      sse += r.dot(f.square * r) - f.count * mean * mean;
      free += f.count - 1;
      days.try_emplace(f.day, Eigen::Array4d::Zero()).first->second +=
          Eigen::Array4d(f.count, f.count * mean, f.count * mean * mean, f.count * f.count);
      members += 1;
    }
    for (const auto& [day, s] : days) {
      ssb += s[2] - s[1] * s[1] / s[0];
      spread += s[0] - s[3] / s[0];
      members -= 1;
    }
    const double within = free > 0 ? sse / free : 1;
    return {within, spread > 0 ? std::max(0.0, (ssb - members * within) / spread) : 0};
  }

 private:
  std::vector<FlightSums> flights_;
  Eigen::Index columns_ = 0;
};

/// e^{c'β} of several contrasts with intervals over resampled flights; and the scatter.
struct Contrasts {
  std::vector<CalibratedValue> ratios;
  double within, between;
};
Contrasts contrasts(const Regression& fit, const std::vector<std::pair<Eigen::Index, double>>& wanted, int bootstraps,
                    std::uint64_t seed) {
  const auto [within, start] = fit.components(fit.fit(0, {}));
  const auto [sigma, between] = fit.components(fit.fit(start / within, {}));
  const double lambda = between / sigma;
  const auto ratios = [&](const std::vector<double>& times) {
    const VectorXd beta = fit.fit(lambda, times);
    std::vector<double> all;
    all.reserve(wanted.size());
    for (const auto& [column, span] : wanted) all.push_back(std::exp(span * beta[column]));
    return all;
  };
  std::vector<std::vector<double>> drawn(wanted.size());
  std::mt19937_64 random(seed);
  for (int b = 0; b < bootstraps; ++b) {
    std::vector<double> times(fit.flights());
    for (std::size_t i = 0; i < fit.flights(); ++i)
      times[static_cast<std::size_t>(static_cast<double>(random() >> 11) * 0x1p-53 *
                                     static_cast<double>(fit.flights()))] += 1;
    const auto refit = ratios(times);
    for (std::size_t k = 0; k < refit.size(); ++k) drawn[k].push_back(refit[k]);
  }
  constexpr double kTail = kCalibrationRules.interval_tail;
  Contrasts all{{}, std::sqrt(sigma), std::sqrt(between)};
  const auto value = ratios({});
  for (std::size_t k = 0; k < value.size(); ++k) {
    auto& x = drawn[k];
    std::sort(x.begin(), x.end());
    const auto n = static_cast<double>(x.size() - 1);
    all.ratios.push_back(
        {value[k],
         {x[static_cast<std::size_t>(kTail * n)], x[static_cast<std::size_t>(std::lround((1 - kTail) * n))]}});
  }
  return all;
}

bool within_two(double height, double of) { return height >= of / 2 && height < 2 * of; }

}  // namespace

std::vector<HeightRow> height_rows(const FlightWindows& windows, const log::FlightLog& log, std::size_t flight) {
  const auto first = [&](const char* column, double otherwise) {
    return log.has(column) && !log.column(column).empty() ? log.column(column).front() : otherwise;
  };
  const double ceiling = first("ceiling", 0), stood = first("stood_z_m", 0);
  const Plate plate = ceiling < 0 ? Plate::not_said : ceiling > 0 ? Plate::above : Plate::none;
  std::vector<HeightRow> rows;
  for (const auto& w : windows.windows) {
    const double height = w.p_W.z() - stood;
    if (height < kWindowRules.clear || !(w.variance.z() > 0) || !(w.speed_mps > 0)) continue;
    rows.push_back(
        {flight, static_cast<int>(first("day", 0)), std::log(w.variance.z()), std::log(w.speed_mps), height, plate});
  }
  return rows;
}

HeightEffect height_effect(const std::vector<HeightRow>& rows, double low_m, double high_m, double length_m,
                           int bootstraps, std::uint64_t seed) {
  std::set<std::size_t> flights, low, high, plated, bare;
  std::set<int> days;
  for (const auto& r : rows) {
    flights.insert(r.flight);
    days.insert(r.day);
    if (within_two(r.height, low_m)) low.insert(r.flight);
    if (within_two(r.height, high_m)) high.insert(r.flight);
    if (r.plate != Plate::not_said) (r.plate == Plate::above ? plated : bare).insert(r.flight);
  }
  HeightEffect effect{{},          std::nullopt, std::nullopt, low_m, high_m, rows.size(), flights.size(),
                      days.size(), low.size(),   high.size(),  0,     0};
  const Regression law(rows, [&](auto& r) { return std::vector{returned(r.height, length_m)}; });
  const auto by_law =
      contrasts(law, {{0, returned(low_m, length_m) - returned(high_m, length_m)}, {law.plate(), 1}}, bootstraps, seed);
  effect.low_over_high = by_law.ratios[0];
  effect.within = by_law.within;
  effect.between = by_law.between;
  if (!plated.empty() && !bare.empty()) effect.ceiling = by_law.ratios[1];
  if (low.empty() || high.empty()) return effect;
  std::vector<HeightRow> binned;
  std::copy_if(rows.begin(), rows.end(), std::back_inserter(binned),
               [&](auto& r) { return r.height >= low_m / 2 && r.height < 2 * high_m; });
  const Regression steps(binned, [&](auto& r) {
    const bool in_low = within_two(r.height, low_m), in_high = within_two(r.height, high_m);
    const bool upper = r.height >= std::sqrt(low_m * high_m);
    return std::vector<double>{in_low ? 1.0 : 0.0, !in_low && !in_high && !upper ? 1.0 : 0.0,
                               !in_low && !in_high && upper ? 1.0 : 0.0};  // against high_m
  });
  effect.bins = contrasts(steps, {{0, 1}}, bootstraps, seed).ratios[0];
  return effect;
}

std::optional<HeightEffects> height_effects(const std::vector<HeightRow>& rows, std::uint64_t seed) {
  constexpr auto kFewest = static_cast<std::size_t>(kCalibrationRules.fewest_height_rows);
  const auto effect = [seed](const std::vector<HeightRow>& some) {
    return height_effect(some, kCalibrationRules.low_height, kCalibrationRules.high_height,
                         kCalibrationRules.height_length, static_cast<int>(kCalibrationRules.height_draws), seed);
  };
  if (rows.size() < kFewest) return std::nullopt;
  std::vector<HeightRow> slow;
  std::copy_if(rows.begin(), rows.end(), std::back_inserter(slow),
               [](auto& r) { return std::exp(r.ln_speed) < WindowOptions{}.still_mps; });
  HeightEffects effects{effect(rows), std::nullopt};
  if (slow.size() >= kFewest) effects.hovers = effect(slow);
  return effects;
}

}  // namespace backwash::study::calibrate
