// SPDX-License-Identifier: BSD-3-Clause
// The normal equations of the study against dense matrices and drawn data.
#include <gtest/gtest.h>

#include <random>

#include "core/study/discrepancy/evidence.hpp"
#include "core/study/discrepancy/search.hpp"

namespace {

using namespace backwash::study::discrepancy;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kFlights = 10, kWindows = 8, kAll = kFlights * kWindows;

/// Flights that measure one channel only, each with a level of its own.
Observations one_channel(std::mt19937_64& rng) {
  std::normal_distribution draw;
  Observations seen;
  seen.flights = kFlights;
  seen.windows.resize(kAll);
  seen.missing["attitude"] = "none here";
  for (auto& y : seen.y) y.assign(kAll, 0);
  for (auto& w : seen.weight) w.assign(kAll, 0);
  for (std::size_t f = 0; f <= kFlights; ++f) seen.first.push_back(f * kWindows);
  for (std::size_t f = 0; f < kFlights; ++f) {
    const double level = 0.5 * draw(rng);
    for (std::size_t i = f * kWindows; i < (f + 1) * kWindows; ++i) {
      seen.windows[i].flight = f;
      seen.weight[kMeanZ][i] = 1 + static_cast<double>(i % 3);
      seen.y[kMeanZ][i] = level + draw(rng) / std::sqrt(seen.weight[kMeanZ][i]);
    }
  }
  return seen;
}

Column in_mean_z(const VectorXd& x) { return {{{kMeanZ, std::vector<double>(x.data(), x.data() + x.size())}}}; }

/// The whole problem as dense matrices: V, the column without what the constant explains of it, and the projection.
struct Dense {
  MatrixXd inverse, project, root;
  VectorXd x;
  Dense(const Observations& seen, const Evidence& evidence, const VectorXd& column) {
    MatrixXd V = MatrixXd::Zero(kAll, kAll);
    for (std::size_t i = 0; i < kAll; ++i)
      for (std::size_t j = 0; j < kAll; ++j) {
        const auto a = static_cast<Eigen::Index>(i), b = static_cast<Eigen::Index>(j);
        if (i / kWindows == j / kWindows) V(a, b) = evidence.between(kMeanZ);
        if (i == j) V(a, b) += evidence.within(kMeanZ) / seen.weight[kMeanZ][i];
      }
    root = V.llt().matrixL();
    inverse = V.inverse();
    const VectorXd one = VectorXd::Ones(kAll);
    project = MatrixXd::Identity(kAll, kAll) - one * (one.transpose() * inverse) / one.dot(inverse * one);
    x = project * column;
  }
  /// Σ s_f b_f of data y from which the constant was fitted.
  double moved(const VectorXd& y, const std::vector<int>& signs) const {
    VectorXd turned = project * y;
    for (std::size_t i = 0; i < kAll; ++i) turned[static_cast<Eigen::Index>(i)] *= signs[i / kWindows];
    return x.dot(inverse * turned);
  }
};

TEST(Evidence, FlippedGainsAreInUnitsOfTheFlippedSumsOwnScatter) {
  std::mt19937_64 rng(7);
  std::normal_distribution draw;
  const Observations seen = one_channel(rng);
  const Evidence evidence(seen);
  VectorXd column(kAll);
  for (std::size_t f = 0; f < kFlights; ++f)
    column.segment(static_cast<Eigen::Index>(f * kWindows), kWindows).setConstant(f == 3 ? 4 : draw(rng));
  const Normal normal = evidence.normal({in_mean_z(column)}, {in_mean_z(VectorXd::Ones(kAll))});
  ASSERT_TRUE(normal.solvable);
  const Dense dense(seen, evidence, column);
  EXPECT_NEAR(normal.total(0, 0), dense.x.dot(dense.inverse * dense.x), 1e-9 * normal.total(0, 0));

  double largest = 1;
  for (const auto& signs : sign_draws(kFlights, 6, 3)) {
    double square = 0;
    constexpr int kDraws = 4000;
    for (int k = 0; k < kDraws; ++k) {
      const VectorXd y = dense.root * VectorXd::NullaryExpr(kAll, [&] { return draw(rng); });
      square += std::pow(dense.moved(y, signs), 2) / kDraws;
    }
    double raw = 0, sum = 0;  // the gain as it would be without the units
    for (std::size_t f = 0; f < kFlights; ++f) sum += signs[f] * normal.b[f][0];
    for (std::size_t f = 0; f < kFlights; ++f) {
      const double own = signs[f] * normal.b[f][0], theta = (sum - own) / (normal.total(0, 0) - normal.A[f](0, 0));
      raw += theta * own - 0.5 * theta * theta * normal.A[f](0, 0);
    }
    const double scatter = square / normal.total(0, 0);  // standard error 2 %
    if (raw > 0) {
      EXPECT_NEAR(normal.gain(signs) / raw, 1 / scatter, 0.08 / scatter);
    }
    largest = std::max(largest, 1 / scatter);
  }
  EXPECT_GT(largest, 1.2) << "no draw would show the difference";
}

TEST(Evidence, GainOfTheDataIsThatOfNoFlip) {
  std::mt19937_64 rng(8);
  std::normal_distribution draw;
  const Observations seen = one_channel(rng);
  const VectorXd column = VectorXd::NullaryExpr(kAll, [&] { return draw(rng); });
  const Normal normal = Evidence(seen).normal({in_mean_z(column)}, {in_mean_z(VectorXd::Ones(kAll))});
  EXPECT_NEAR(normal.gain(), normal.gain(std::vector<int>(kFlights, 1)), 1e-9);
}

}  // namespace
