// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/calibrate/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "core/study/calibrate/calibration_rules.hpp"
#include "core/types/normal.hpp"

namespace backwash::study::calibrate {
namespace {

/// Uniform integer below n from 53 random bits: the standard fixes mt19937_64's numbers, not its distributions'.
std::size_t below(std::mt19937_64& random, std::size_t n) {
  return static_cast<std::size_t>(static_cast<double>(random() >> 11) * 0x1p-53 * static_cast<double>(n));
}

/// How often each flight is drawn: as many as there are, within each place.
std::vector<double> drawn(const Data& data, std::mt19937_64& random) {
  std::vector<std::vector<std::size_t>> by_place;
  for (std::size_t f = 0; f < data.place.size(); ++f) {
    if (data.place[f] >= by_place.size()) by_place.resize(data.place[f] + 1);
    by_place[data.place[f]].push_back(f);
  }
  std::vector<double> weights(data.place.size());
  for (const auto& flights : by_place) {
    for (std::size_t i = 0; i < flights.size(); ++i) weights[flights[below(random, flights.size())]] += 1;
  }
  return weights;
}

double weighted_quantile(std::vector<std::pair<double, double>>& values, double q) {
  std::sort(values.begin(), values.end());
  double total = 0, sum = 0;
  for (const auto& [value, weight] : values) total += weight;
  for (const auto& [value, weight] : values) {
    sum += weight;
    if (sum >= q * total) return value;
  }
  return values.empty() ? 0 : values.back().first;
}

/// Largest steady push: the 95 % quantile over hovers of its size, less what the noise of the means adds on average.
double push(const Data& data, std::span<const double> weights, Group g) {
  std::vector<std::pair<double, double>> sizes;
  double square = 0, noise = 0;
  for (const auto& h : data.hovers) {
    const double weight = weights[h.flight];
    if (weight == 0) continue;
    const double size = g == kVertical ? std::abs(h.push.z()) : h.push.head<2>().norm();
    sizes.emplace_back(size, weight);
    square += weight * size * size;
    noise += weight * (g == kVertical ? h.push_noise.z() : h.push_noise.head<2>().sum());
  }
  const double kept = square > 0 ? std::max(0.0, 1 - noise / square) : 0;
  return weighted_quantile(sizes, kCalibrationRules.push_quantile) * std::sqrt(kept);
}

double tau(const Data& data, std::span<const double> weights) {
  std::vector<std::pair<double, double>> times;
  for (const auto& h : data.hovers) {
    if (weights[h.flight] > 0) times.emplace_back(h.tau_w, weights[h.flight]);
  }
  return weighted_quantile(times, 0.5);
}

/// How much wider than the bootstrap's percentiles an interval must be when `flights` are resampled within `places`:
/// resampling n flights sees only (n − 1)/n of their variance, and few flights have Student's tails.
double widening(std::size_t flights, std::size_t places) {
  const double n = static_cast<double>(flights), freedom = std::max(1.0, n - static_cast<double>(places));
  constexpr double kZ = normal::k975;
  return std::sqrt(n / freedom) * (1 + (kZ * kZ + 1) / (4 * freedom));  // t/z to first order in 1/freedom
}

/// 2.5 and 97.5 % of refits, widened about the estimate: in the logarithm, since all these numbers are ≥ 0.
Interval interval(double estimate, std::vector<double> refits, double wider) {
  if (refits.empty() || !(estimate > 0))
    return {0, refits.empty() ? 0 : *std::max_element(refits.begin(), refits.end())};
  std::sort(refits.begin(), refits.end());
  const auto at = [&](double q) {
    const double position = q * static_cast<double>(refits.size() - 1);
    const auto i = std::min(static_cast<std::size_t>(position), refits.size() - 1),
               j = std::min(i + 1, refits.size() - 1);
    return refits[i] + (position - static_cast<double>(i)) * (refits[j] - refits[i]);
  };
  const auto widened = [&](double end) { return end > 0 ? estimate * std::pow(end / estimate, wider) : 0; };
  return {std::min(estimate, widened(at(kCalibrationRules.interval_tail))),
          std::max(estimate, widened(at(1 - kCalibrationRules.interval_tail)))};
}

}  // namespace

Calibration calibrate(const Data& data, const Model& gates, std::span<const Refusal> undetermined, bool pushes,
                      const Options& options) {
  Calibration c{};
  FitOptions first = options.fit;
  c.determined.set();
  for (const auto& refusal : undetermined) {
    for (const Parameter p : refusal.parameters) c.determined.reset(p);
  }
  first.free &= c.determined;
  c.determined = first.free;
  const std::vector<double> all(data.place.size(), 1.0);
  c.fitted = fit(data, all, parameters_of(gates), first);

  FitOptions again = first;
  again.rounds = 1;
  std::array<std::vector<double>, kParameters> samples;
  std::vector<double> horizontal, vertical, times;
  std::mt19937_64 random(options.seed);
  for (int b = 0; b < options.bootstraps; ++b) {
    const auto weights = drawn(data, random);
    const Fit refit = fit(data, weights, c.fitted.parameters, again);
    for (std::size_t j = 0; j < kParameters; ++j) samples[j].push_back(refit.parameters[j]);
    horizontal.push_back(push(data, weights, kHorizontal));
    vertical.push_back(push(data, weights, kVertical));
    times.push_back(tau(data, weights));
    options.progress(horizontal.size(), static_cast<std::size_t>(options.bootstraps));
  }
  const double wider = widening(data.place.size(), 1 + *std::max_element(data.place.begin(), data.place.end()));
  for (std::size_t j = 0; j < kParameters; ++j) c.ci95[j] = interval(c.fitted.parameters[j], samples[j], wider);
  if (pushes) {
    const double h = push(data, all, kHorizontal), v = push(data, all, kVertical);
    c.push = SteadyPush{{h, interval(h, horizontal, wider)}, {v, interval(v, vertical, wider)}};
  }
  const double typical_tau = tau(data, all);
  c.tau_w = {typical_tau, interval(typical_tau, times, wider)};
  c.model = with_parameters(gates, c.fitted.parameters);
  if (c.push) {
    c.model.bound.mean_horizontal = c.push->horizontal.value;
    c.model.bound.mean_vertical = c.push->vertical.value;
  }
  c.model.bound.tau_w = c.tau_w.value;
  c.on_fitted = assess(data, ln_bounds(data, c.fitted.parameters), first.quantile);
  again.rounds = 2;
  c.held_out = assess(data, held_out_ln_bounds(data, c.fitted.parameters, again, options.folds), first.quantile);
  return c;
}

std::vector<Hover> hovers_of(const FlightWindows& flight, std::size_t number, const map::OccupancyGrid& grid,
                             const Model& gates) {
  std::vector<Hover> hovers;
  std::vector<Vec3> at;
  std::vector<int> segment;
  for (const auto& w : flight.windows) {
    if ((w.variance.array() <= 0).any()) continue;
    if (segment.empty() || segment.back() != w.segment || (w.p_W - at.back()).norm() > kCalibrationRules.same_place) {
      hovers.push_back({number, Vec3::Zero(), {}, {}, Vec3::Zero(), Vec3::Zero(), 0});
      at.push_back(Vec3::Zero());
      segment.push_back(w.segment);
    }
    Hover& h = hovers.back();
    const double n = static_cast<double>(h.ln_variance.size() + 1);
    const auto include = [n](Vec3& mean, const Vec3& x) { mean += (x - mean) / n; };
    include(at.back(), w.p_W);
    include(h.push, w.mean);
    const double tau_w = flight.tau_w(w);
    h.tau_w += (tau_w - h.tau_w) / n;
    include(h.push_noise, 2 * tau_w * w.variance);
    h.ln_variance.push_back(w.variance.array().log());
  }
  const auto found = features(grid, gates, at);
  for (std::size_t i = 0; i < hovers.size(); ++i) {
    hovers[i].p_W = at[i];
    hovers[i].features = found[i];
    hovers[i].push_noise /=
        kWindowRules.window_length * static_cast<double>(hovers[i].ln_variance.size());  // over its time
  }
  return hovers;
}

}  // namespace backwash::study::calibrate
