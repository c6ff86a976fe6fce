// SPDX-License-Identifier: BSD-3-Clause
// What a study refuses of a flight log: what no flight can be, and no more.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "core/log/columns/import_columns.hpp"
#include "core/types/geometry.hpp"

namespace backwash::log {
namespace {

constexpr double kG = 9.81;

/// 20 s at 50 Hz along a curve of three tones, tilted as it accelerates; every column follows from the curve.
FlightLog flown() {
  FlightLog log;
  const double size[] = {1.5, 1.2, 0.5}, omega[] = {0.8, 1.1, 0.9};
  for (int k = 0; k < 1000; ++k) {
    const double t = 0.02 * k;
    log.t_s.push_back(t);
    Vec3 a;
    for (int i = 0; i < 3; ++i) {
      const std::string axis(1, "xyz"[i]);
      const double s = size[i] * std::sin(omega[i] * t + i), c = size[i] * omega[i] * std::cos(omega[i] * t + i);
      a[i] = -omega[i] * omega[i] * s;
      log.columns[axis + "_m"].push_back(2 + s);
      log.columns["v" + axis + "_mps"].push_back(c);
      log.columns["a" + axis + "_mps2"].push_back(a[i]);
    }
    const auto q = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), Vec3(a + kG * Vec3::UnitZ()));
    log.columns["qw"].push_back(q.w());
    log.columns["qx"].push_back(q.x());
    log.columns["qy"].push_back(q.y());
    log.columns["qz"].push_back(q.z());
    log.columns["thrust"].push_back(0.5 * (a.z() + kG) / kG);
    for (const char* name : {"rpm1", "rpm2", "rpm3", "rpm4"}) log.columns[name].push_back(9000);
  }
  return log;
}

void scale(FlightLog& log, const std::vector<std::string>& names, double factor) {
  for (const auto& name : names)
    for (double& x : log.columns.at(name)) x *= factor;
}

std::string refusal(const std::function<void(FlightLog&)>& change) {
  auto log = flown();
  change(log);
  const auto left_out = leave_out_doubted(log);
  return left_out ? "" : left_out.error();
}

/// What is told of a log that is read all the same, and without which columns.
std::vector<std::string> told(const std::function<void(FlightLog&)>& change, const std::vector<std::string>& without) {
  auto log = flown();
  change(log);
  const auto left_out = leave_out_doubted(log);
  EXPECT_TRUE(left_out) << left_out.error();
  for (const auto& [name, column] : flown().columns)
    EXPECT_EQ(log.has(name), std::ranges::count(without, name) == 0) << name;
  return left_out.value_or(std::vector<std::string>{});
}

const std::vector<std::string> kP{"x_m", "y_m", "z_m"}, kV{"vx_mps", "vy_mps", "vz_mps"},
    kA{"ax_mps2", "ay_mps2", "az_mps2"}, kQ{"qw", "qx", "qy", "qz"};

TEST(Impossible, SaysNothingOfAFlightAndOfOneWhoseEstimatorIsPoor) {
  EXPECT_EQ(refusal([](auto&) {}), "");
  // Half of the velocity, as an estimator told that slipped: it goes on without.
  const auto words = told([](auto& log) { scale(log, kV, 0.5); }, kV);
  ASSERT_EQ(words.size(), 3u);
  EXPECT_NE(words[0].find("vx_mps is 0.5 to 0.5 times the derivative of x_m"), std::string::npos) << words[0];
}

TEST(Impossible, AnEstimateThatFrozeAndLeaptIsNoContradictionAndHidesNone) {
  // Along a line that is a little off x. All places are held while x turns round, and y goes on 1.2 m off.
  const auto frozen = [](FlightLog& log) {
    for (std::size_t k = 0; k < log.t_s.size(); ++k) {
      log.columns["y_m"][k] = 0.1 * log.column("x_m")[k] + (k >= 541 ? 1.2 : 0);
      log.columns["vy_mps"][k] = 0.1 * log.column("vx_mps")[k];
    }
    for (std::size_t k = 442; k < 541; ++k)
      for (const auto& name : kP) log.columns[name][k] = log.column(name)[441];
    for (const auto& names : {kA, kQ})
      for (const auto& name : names) log.columns.erase(name);
  };
  EXPECT_EQ(refusal(frozen), "");
  auto log = flown();
  frozen(log);
  scale(log, {"vz_mps"}, -1);
  const auto left_out = leave_out_doubted(log);
  ASSERT_TRUE(left_out) << left_out.error();
  ASSERT_EQ(left_out->size(), 1u);
  EXPECT_NE(left_out->front().find("turn the sign of vz_mps"), std::string::npos) << left_out->front();
}

TEST(Impossible, ALeapOnAWayBetweenTwoAxesIsNoContradictionButExchangedAxesAre) {
  const auto between = [](FlightLog& log) {
    for (std::size_t k = 0; k < log.t_s.size(); ++k) {
      const double slow = 0.5 * std::sin(0.5 * log.t_s[k]);
      log.columns["y_m"][k] = 0.3 * log.column("x_m")[k] + slow;
      log.columns["vy_mps"][k] = 0.3 * log.column("vx_mps")[k] + 0.25 * std::cos(0.5 * log.t_s[k]);
    }
    for (const auto& names : {kA, kQ})
      for (const auto& name : names) log.columns.erase(name);
  };
  EXPECT_EQ(refusal([&](FlightLog& log) {
              between(log);
              for (std::size_t k = 500; k < log.t_s.size(); ++k) log.columns["y_m"][k] += 0.5;
            }),
            "");
  auto log = flown();
  between(log);
  std::swap(log.columns.at("vx_mps"), log.columns.at("vy_mps"));
  const auto left_out = leave_out_doubted(log);
  ASSERT_TRUE(left_out) << left_out.error();
  ASSERT_EQ(left_out->size(), 2u);
  EXPECT_NE(left_out->front().find("are vx_mps and vy_mps exchanged"), std::string::npos) << left_out->front();
  EXPECT_FALSE(log.has("vx_mps"));
}

TEST(Impossible, UnitsFramesAndStampsAreToldByTheirColumn) {
  EXPECT_NE(refusal([](auto& log) { scale(log, kA, 1 / kG); }).find("ax_mps2 is in g"), std::string::npos);
  EXPECT_NE(refusal([](auto& log) { scale(log, kV, 100); }).find("vx_mps is in cm/s"), std::string::npos);
  EXPECT_NE(refusal([](auto& log) { scale(log, kV, 3.6); }).find("vx_mps is in km/h"), std::string::npos);
  auto places = flown();
  scale(places, kP, 1000);
  for (const auto& name : kA) places.columns.erase(name);
  const auto in_mm = leave_out_doubted(places);
  ASSERT_FALSE(in_mm);
  EXPECT_NE(in_mm.error().find("mm"), std::string::npos) << in_mm.error();
  EXPECT_NE(told([](auto& log) { scale(log, {"vy_mps"}, -1); }, {"vy_mps"}).at(0).find("turn the sign of vy_mps"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& log) {
              for (double& a : log.columns.at("az_mps2")) a += kG;
            }).find("gravity is in it"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& log) { scale(log, {"thrust"}, 100); }).find("thrust goes from"), std::string::npos);
  EXPECT_NE(refusal([](auto& log) {
              for (double& t : log.t_s) t *= 1e6;
            }).find("t_s goes on by 2e+04 a row"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& log) { std::reverse(log.t_s.begin(), log.t_s.end()); }).find("t_s does not rise"),
            std::string::npos);
}

TEST(Impossible, NorAreColumnsThatNothingHasMeasured) {
  const auto first = [](const auto& change, const auto& without) { return told(change, without).at(0); };
  EXPECT_NE(first([](auto& log) { scale(log, kV, 0); }, kV).find("are 0 in every row"), std::string::npos);
  EXPECT_NE(first([](auto& log) { scale(log, kA, 0); }, kA).find("are 0 in every row"), std::string::npos);
  EXPECT_NE(first([](auto& log) { scale(log, kQ, 0); }, kQ).find("1000 of 1000 rows"), std::string::npos);
  EXPECT_NE(first(
                [](auto& log) {
                  for (const auto& name : kQ) log.columns.at(name)[7] = 0;
                },
                kQ)
                .find("1 of 1000 rows"),
            std::string::npos);
}

TEST(Impossible, NorAreCommandsOfRotorsThatAreNoShares) {
  auto log = flown();
  for (const char* name : {"motor1", "motor2", "motor3", "motor4"}) log.columns[name].assign(log.t_s.size(), 0.4);
  const auto sane = log;
  for (const char* name : {"motor1", "motor2", "motor3", "motor4"}) log.columns[name].assign(log.t_s.size(), 1400);
  const auto left = leave_out_doubted(log);
  ASSERT_TRUE(left) << left.error();
  ASSERT_EQ(left->size(), 1u);
  EXPECT_EQ(left->front(),
            "motor1 goes from 1400 to 1400: it is a share, 0 … 1; give its unit; left out: motor1, motor2, "
            "motor3, motor4");
  EXPECT_FALSE(log.has("motor4"));
  auto again = sane;
  EXPECT_TRUE(leave_out_doubted(again)->empty());
}

TEST(Impossible, AnAttitudeInAnotherOrderIsToldWithTheOrderThatFits) {
  const auto rotated = [](std::size_t by) {
    return [by](FlightLog& log) {
      const FlightLog was = log;
      for (std::size_t k = 0; k < 4; ++k) log.columns[kQ[(k + by) % 4]] = was.column(kQ[k]);
    };
  };
  EXPECT_NE(refusal(rotated(3)).find("x, y, z, w"), std::string::npos) << refusal(rotated(3));
  EXPECT_NE(refusal(rotated(1)).find("z, w, x, y"), std::string::npos) << refusal(rotated(1));
}

TEST(Impossible, AWorldWhoseYIsUpIsRefusedWithTheKeyThatTurnsIt) {
  const auto words = refusal([](FlightLog& log) {
    for (const auto& [prefix, unit] : {std::pair{"", "_m"}, {"v", "_mps"}, {"a", "_mps2"}}) {
      auto &y = log.columns.at(std::string(prefix) + "y" + unit), &z = log.columns.at(std::string(prefix) + "z" + unit);
      std::swap(y, z);
      for (double& v : z) v = -v;
    }
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(-std::numbers::pi / 2, Vec3::UnitX()));
    for (std::size_t k = 0; k < log.t_s.size(); ++k) {
      const Eigen::Quaterniond q =
          turn * Eigen::Quaterniond(log.column("qw")[k], log.column("qx")[k], log.column("qy")[k], log.column("qz")[k]);
      log.columns["qw"][k] = q.w();
      log.columns["qx"][k] = q.x();
      log.columns["qy"][k] = q.y();
      log.columns["qz"][k] = q.z();
    }
  });
  EXPECT_NE(words.find("frame.world = \"x, -z, y\""), std::string::npos) << words;
}

TEST(SilentColumns, AreThoseOfASensorThatReadsNothingInAnyRow) {
  auto log = flown();
  EXPECT_TRUE(silent_columns(log).empty());
  scale(log, {"rpm2"}, 0);
  EXPECT_TRUE(silent_columns(log).empty()) << "one rotor's sensor is broken, and that is a finding";
  scale(log, {"rpm1", "rpm3", "rpm4"}, 0);
  EXPECT_EQ(silent_columns(log), (std::vector<std::string>{"rpm1", "rpm2", "rpm3", "rpm4"}));
  scale(log, {"thrust"}, 0);
  EXPECT_EQ(silent_columns(log).back(), "thrust");
}

}  // namespace
}  // namespace backwash::log
