// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/calibrate/height_effect.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <random>

namespace backwash::study::calibrate {
namespace {

/// (β_h, β_c) by least squares within days: every column less its day's weighted mean.
Eigen::Vector2d slopes(const std::vector<HeightRow>& rows, const std::vector<double>& flight_weights) {
  std::map<int, std::pair<Eigen::Vector4d, double>> days;  // sums and weight
  const auto columns = [](const HeightRow& r) {
    return Eigen::Vector4d(std::log(r.height), r.ceiling ? 1 : 0, r.ln_speed, r.ln_variance_z);
  };
  for (const auto& r : rows) {
    auto& [sum, weight] = days.try_emplace(r.day, Eigen::Vector4d::Zero(), 0.0).first->second;
    sum += flight_weights[r.flight] * columns(r), weight += flight_weights[r.flight];
  }
  Eigen::Matrix3d normal = 1e-9 * Eigen::Matrix3d::Identity();  // a day without contrast decides nothing
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const auto& r : rows) {
    const double weight = flight_weights[r.flight];
    if (weight == 0) continue;
    const auto& [sum, total] = days.at(r.day);
    const Eigen::Vector4d x = columns(r) - sum / total;
    normal += weight * x.head<3>() * x.head<3>().transpose(), right += weight * x.head<3>() * x[3];
  }
  return normal.ldlt().solve(right).head<2>();
}

}  // namespace

HeightEffect height_effect(const std::vector<HeightRow>& rows, double low_m, double high_m, int bootstraps,
                           std::uint64_t seed) {
  std::map<std::size_t, std::size_t> flights;
  std::map<int, int> days;
  std::size_t last = 0;
  bool plate = false;
  for (const auto& r : rows)
    flights[r.flight] += 1, days[r.day] += 1, last = std::max(last, r.flight), plate |= r.ceiling;
  const double span = std::log(low_m / high_m);
  const Eigen::Vector2d beta = slopes(rows, std::vector<double>(last + 1, 1.0));
  std::vector<std::size_t> numbers;
  for (const auto& [flight, count] : flights) numbers.push_back(flight);
  std::vector<double> height, ceiling;
  std::mt19937_64 random(seed);
  for (int b = 0; b < bootstraps; ++b) {
    std::vector<double> weights(last + 1);
    for (std::size_t i = 0; i < numbers.size(); ++i)
      weights[numbers[static_cast<std::size_t>(static_cast<double>(random() >> 11) * 0x1p-53 *
                                               static_cast<double>(numbers.size()))]] += 1;
    const Eigen::Vector2d refit = slopes(rows, weights);
    height.push_back(std::exp(span * refit[0])), ceiling.push_back(std::exp(refit[1]));
  }
  const auto interval = [](std::vector<double>& x) {
    std::sort(x.begin(), x.end());
    const auto n = static_cast<double>(x.size() - 1);
    return Interval{x[static_cast<std::size_t>(0.025 * n)], x[static_cast<std::size_t>(0.975 * n + 0.5)]};
  };
  return {{std::exp(span * beta[0]), interval(height)},
          plate ? Estimate{std::exp(beta[1]), interval(ceiling)} : Estimate{0, {0, 0}},
          low_m,
          high_m,
          rows.size(),
          flights.size(),
          days.size()};
}

}  // namespace backwash::study::calibrate
