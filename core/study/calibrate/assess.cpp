// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/calibrate/assess.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/study/calibrate/calibration_rules.hpp"

namespace backwash::study::calibrate {
namespace {

constexpr double kWallEdges[] = {0, 0.35, 0.6, 1.0, 1.5, kFar};
constexpr double kHeightEdges[] = {0, 0.4, 0.8, 1.3, 1.9, kFar};

double quantile_of(std::vector<double>& values, double q) {
  const auto at = std::min(values.size() - 1, static_cast<std::size_t>(q * static_cast<double>(values.size())));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
  return values[at];
}

/// Summed loss of the best constant.
double least_loss(std::vector<double>& values, double q) {
  const double best = quantile_of(values, q);
  double sum = 0;
  for (const double v : values) sum += pinball(v - best, q);
  return sum;
}

std::vector<Bin> bins(std::span<const double> edges) {
  std::vector<Bin> all;
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) all.push_back({edges[i], edges[i + 1], 0, Vec3::Zero()});
  return all;
}

void count(std::vector<Bin>& all, double at, const Vec3& covered) {
  for (auto& bin : all) {
    if (at < bin.low || at >= bin.high) continue;
    bin.windows += 1;
    bin.coverage += covered;
    return;
  }
  if (!all.empty()) {
    all.back().windows += 1;
    all.back().coverage += covered;
  }  // infinite: no wall, no floor
}

}  // namespace

std::vector<Vec3> ln_bounds(const Data& data, const Parameters& parameters) {
  std::vector<Vec3> all;
  for (const auto& h : data.hovers) all.push_back(bound_variance(h.features, parameters).array().log());
  return all;
}

Assessment assess(const Data& data, std::span<const Vec3> ln_bound, double q) {
  Assessment a{0,
               Vec3::Zero(),
               std::vector<Vec3>(data.place.size(), Vec3::Zero()),
               std::vector<std::size_t>(data.place.size()),
               bins(kWallEdges),
               bins(kHeightEdges),
               Vec3::Zero(),
               0,
               0,
               0};
  std::array<std::vector<double>, 3> ratio, all;
  std::array<std::map<int, std::vector<double>>, 3> by_height;
  for (std::size_t n = 0; n < data.hovers.size(); ++n) {
    const Hover& h = data.hovers[n];
    for (const auto& v : h.ln_variance) {
      Vec3 covered;
      for (int axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<std::size_t>(axis);
        const double r = v[axis] - ln_bound[n][axis];
        covered[axis] = r <= 0 ? 1 : 0;
        a.loss += pinball(r, q);
        ratio[i].push_back(-r);
        all[i].push_back(v[axis]);
        by_height[i][static_cast<int>(std::min(h.features.height, kCalibrationRules.highest.value) /
                                      kCalibrationRules.height_step)]
            .push_back(v[axis]);
      }
      a.windows += 1;
      a.coverage += covered;
      a.flight_coverage[h.flight] += covered;
      a.flight_windows[h.flight] += 1;
      count(a.by_wall_distance, h.features.wall_distance, covered);
      count(a.by_height, h.features.height, covered);
    }
  }
  if (a.windows == 0) return a;
  for (std::size_t i = 0; i < 3; ++i) {
    a.bound_over_observed[static_cast<Eigen::Index>(i)] = std::exp(quantile_of(ratio[i], 0.5));
    a.constant_loss += least_loss(all[i], q);
    for (auto& [step, values] : by_height[i]) a.height_loss += least_loss(values, q);
  }
  const double n = static_cast<double>(a.windows);
  a.coverage /= n;
  for (double* loss : {&a.loss, &a.constant_loss, &a.height_loss}) *loss /= 3 * n;
  for (std::size_t f = 0; f < data.place.size(); ++f)
    a.flight_coverage[f] /= std::max(1.0, static_cast<double>(a.flight_windows[f]));
  for (auto* group : {&a.by_wall_distance, &a.by_height}) {
    for (auto& bin : *group) bin.coverage /= std::max(1.0, static_cast<double>(bin.windows));
  }
  return a;
}

std::vector<Vec3> held_out_ln_bounds(const Data& data, const Parameters& start, const FitOptions& options, int folds) {
  std::vector<int> fold(data.place.size());
  std::map<std::size_t, int> next;
  for (std::size_t f = 0; f < fold.size(); ++f) fold[f] = next[data.place[f]]++ % folds;
  std::vector<Vec3> ln_bound(data.hovers.size());
  for (int left_out = 0; left_out < folds; ++left_out) {
    std::vector<double> weights(data.place.size());
    for (std::size_t f = 0; f < fold.size(); ++f) weights[f] = fold[f] == left_out ? 0 : 1;
    const Fit fitted = fit(data, weights, start, options);
    for (std::size_t n = 0; n < data.hovers.size(); ++n) {
      if (fold[data.hovers[n].flight] == left_out)
        ln_bound[n] = bound_variance(data.hovers[n].features, fitted.parameters).array().log();
    }
  }
  return ln_bound;
}

}  // namespace backwash::study::calibrate
