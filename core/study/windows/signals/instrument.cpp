// SPDX-License-Identifier: BSD-3-Clause
#include "core/study/windows/signals/instrument.hpp"

#include <algorithm>
#include <numeric>

#include "core/study/windows/gates/window_rules.hpp"

namespace backwash::study {

std::vector<double> slow(const Series& s, SampleRange w, const std::vector<double>& z, double width) {
  std::vector<double> sum = z, weights(z.size(), 1);
  for (std::size_t i = 0; i < z.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      const double weight = bell(s, w.begin + i, w.begin + k, width);
      sum[i] += weight * z[k];
      sum[k] += weight * z[i];
      weights[i] += weight;
      weights[k] += weight;
    }
  for (std::size_t i = 0; i < z.size(); ++i) sum[i] /= weights[i];
  return detrended(sum);
}

void FirstStage::add(const std::array<std::vector<double>, 2>& z, const std::array<std::vector<double>, 2>& thrust) {
  const auto product = [](const std::vector<double>& a, const std::vector<double>& b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
  };
  for (std::size_t i = 0; i < 2; ++i)
    for (std::size_t k = 0; k < 2; ++k) {
      const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(k);
      instruments(row, column) += product(z[i], z[k]);
      followed(row, column) += product(z[i], thrust[k]);
    }
}

Eigen::Matrix2d FirstStage::coefficients() const {
  if (!(instruments.determinant() > kWindowRules.no_first_stage * instruments(0, 0) * instruments(1, 1)))
    return Eigen::Matrix2d::Identity();
  return instruments.ldlt().solve(followed);
}

namespace {

double between(const DelayStage::PerSecond& design, double shift) {
  std::size_t k = 1;
  while (k + 1 < kShifts.size() && kShifts[k] < shift) ++k;
  const double share = std::clamp((shift - kShifts[k - 1]) / (kShifts[k] - kShifts[k - 1]), 0.0, 1.0);
  return design[k - 1] + share * (design[k] - design[k - 1]);
}

}  // namespace

std::vector<std::pair<std::size_t, double>> DelayStage::designs() const {
  double shift = 0;
  for (int turn = 0; turn < kWindowRules.delay_turns; ++turn) {
    double product = 0, square = 0;
    for (const auto& w : seen_) {
      const double g = between(w.design, shift);
      product += g * w.y;
      square += g * g;
    }
    shift = square > 0 ? product / square : 0;
  }
  std::vector<std::pair<std::size_t, double>> all;
  for (const auto& w : seen_) all.emplace_back(w.window, between(w.design, shift));
  return all;
}

}  // namespace backwash::study
