// SPDX-License-Identifier: BSD-3-Clause
// The general adjoint reproduces published reachable sets; the tabulated response of the vehicle's loop is held against
// it.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>

#include "core/reach/response/error_dynamics.hpp"
#include "tests/support/linear_support.hpp"

namespace backwash::reach {
namespace {

// Non-zero entries of A, B and C, one a line; `output` is the row of C, or where there is none the state.
LinearSystem read_system(const std::string& path, Eigen::Index states, Eigen::Index inputs, Eigen::Index output) {
  LinearSystem system{Eigen::MatrixXd::Zero(states, states), Eigen::MatrixXd::Zero(states, inputs),
                      Eigen::RowVectorXd::Zero(states)};
  std::ifstream file(path);
  std::string line, matrix, row, column, value;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream fields(line);
    std::getline(fields, matrix, ',');
    std::getline(fields, row, ',');
    std::getline(fields, column, ',');
    std::getline(fields, value);
    const Eigen::Index i = std::stol(row), j = std::stol(column);
    if (matrix == "A") system.A(i, j) = std::stod(value);
    if (matrix == "B") system.B(i, j) = std::stod(value);
    if (matrix == "C" && i == output) system.c[j] = std::stod(value);
  }
  return system;
}

struct Extremes {
  double low = 1e300, high = -1e300;
};
Extremes extremes(const std::vector<OutputRange>& ranges) {
  Extremes e;
  for (const OutputRange& r : ranges) {
    e.low = std::min(e.low, r.low);
    e.high = std::max(e.high, r.high);
  }
  return e;
}

const std::string kFolder = BACKWASH_SOURCE_DIR "/tests/data/reach/";

// Published values hold for inputs that vary in time, at the ends of steps of 0.5 ms (BLDF01: its peak at 77.5 ms falls
// between coarser ones, 4.4537e-3 at 1 ms) and 1 ms (ISSF01).
TEST(LinearSupport, ReproducesTheBuildingOfTheReachabilityCompetition) {
  LinearSystem building = read_system(kFolder + "building.csv", 48, 1, 0);
  building.c = Eigen::RowVectorXd::Unit(48, 24);
  Box initial{Eigen::VectorXd::Zero(48), Eigen::VectorXd::Zero(48)};
  initial.centre.head(10).setConstant(0.000225);
  initial.half.head(10).setConstant(0.000025);
  initial.half[24] = 0.0001;
  const Box input{Eigen::VectorXd::Constant(1, 0.9), Eigen::VectorXd::Constant(1, 0.1)};
  const auto varying = output_range(building, initial, input, InputKind::varying, 5e-4, 40000);
  EXPECT_NEAR(varying.back().t, 20, 1e-9);
  EXPECT_NEAR(extremes(varying).high, 4.4547e-3, 0.5e-7);
  EXPECT_NEAR(varying.back().low, -0.7995e-3, 0.5e-7);
  EXPECT_LE(extremes(varying).high, 5.1e-3);  // the property that holds
  EXPECT_GT(extremes(varying).high, 4e-3);    // and the one that does not
  // An input that is unknown but constant would have died out by then.
  const auto constant = output_range(building, initial, input, InputKind::constant, 5e-4, 40000);
  EXPECT_GT(constant.back().low, -1e-5);
}

TEST(LinearSupport, ReproducesTheSpaceStationOfTheReachabilityCompetition) {
  const LinearSystem station = read_system(kFolder + "iss.csv", 270, 3, 2);
  const Box initial{Eigen::VectorXd::Zero(270), Eigen::VectorXd::Constant(270, 1e-4)};
  const Box input{Eigen::Vector3d(0.05, 0.9, 0.95), Eigen::Vector3d(0.05, 0.1, 0.05)};
  const Extremes varying = extremes(output_range(station, initial, input, InputKind::varying, 1e-3, 20000));
  const double largest = std::max(varying.high, -varying.low);
  EXPECT_NEAR(largest, 5.988e-4, 0.5e-7);
  EXPECT_LE(largest, 7e-4);
  EXPECT_GT(largest, 5e-4);
  const Extremes constant = extremes(output_range(station, initial, input, InputKind::constant, 1e-3, 20000));
  EXPECT_LT(std::max(constant.high, -constant.low), 2e-4);
}

// Two ways to the same sets: the general adjoint here, the vehicle's response there.
TEST(LinearSupport, OfTheVehiclesLoopIsItsTabulatedResponse) {
  const AxisLoop axis{10, 5.5, 0, 0.05};
  const AxisResponse response = axis_response(axis, Loop::vehicle);
  LinearSystem loop{Eigen::Matrix3d::Zero(), Eigen::Vector3d::UnitY(), Eigen::RowVector3d::UnitX()};
  loop.A << 0, 1, 0, 0, 0, 1, -axis.kp / axis.attitude_lag, -axis.kd / axis.attitude_lag, -1 / axis.attitude_lag;
  const Box none{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  const Box input{Eigen::VectorXd::Zero(1), Eigen::VectorXd::Ones(1)};
  const double h = kControlPeriod / AxisResponse::kPhases;
  const auto ranges = output_range(loop, none, input, InputKind::varying, h, response.P.size() - 1);
  for (std::size_t m = 0; m < ranges.size(); ++m) {
    ASSERT_NEAR(ranges[m].high, response.P[m], 1e-6) << m;
    ASSERT_EQ(ranges[m].low, -ranges[m].high);
  }
  const Box start{Eigen::Vector3d(0.1, 0, 0), Eigen::Vector3d(0, 0.2, 0)}, calm{input.centre, input.centre};
  const auto coasting = output_range(loop, start, calm, InputKind::varying, h, 200);
  EXPECT_NEAR(coasting[0].low, 0.1, 1e-15);
  EXPECT_NEAR(coasting[0].high, 0.1, 1e-15);
}

}  // namespace
}  // namespace backwash::reach
