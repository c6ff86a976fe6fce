// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/columns/axes.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>

namespace backwash::log {
namespace {

/// All 24 turns of axes into axes.
std::vector<Turn> turns() {
  std::vector<Turn> all;
  for (const char* order : {"xyz", "yzx", "zxy", "xzy", "yxz", "zyx"})
    for (int signs = 0; signs < 8; ++signs) {
      std::string text;
      for (int i = 0; i < 3; ++i) text += std::string(signs >> i & 1 ? "-" : "") + order[i] + ",";
      if (const auto turn = turn_of(text)) all.push_back(*turn);
    }
  return all;
}

/// 20 s of a flight that tilts as it accelerates with `moved` times 1 m and turns by `yaw`, in axes that `world` and
/// `body` turn into ours; with its specific force or without.
FlightLog flight(const Turn& world, const Turn& body, double moved, double yaw, bool force = false) {
  FlightLog log;
  for (int k = 0; k < 2000; ++k) {
    const double t = 0.01 * k;
    const Vec3 rate(1.7, 1.3, 0.7), size = moved * Vec3(1, 0.8, 0.3);
    Vec3 p = Vec3(0, 0, 1.2), a = Vec3::Zero();
    for (int i = 0; i < 3; ++i) {
      p[i] += size[i] * std::sin(rate[i] * t);
      a[i] -= size[i] * rate[i] * rate[i] * std::sin(rate[i] * t);
    }
    const Vec3 f = a + Vec3(0, 0, kGravity);
    const Eigen::Quaterniond ours = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), f.normalized()) *
                                    Eigen::AngleAxisd(yaw * std::sin(0.4 * t), Vec3::UnitZ());
    const Eigen::Quaterniond q = Eigen::Quaterniond(Mat3(world.transpose())) * ours * Eigen::Quaterniond(body);
    const Vec3 theirs = world.transpose() * p, felt = body.transpose() * (ours.conjugate() * f);
    log.t_s.push_back(t);
    for (int i = 0; i < 3; ++i) {
      log.columns[std::string(1, "xyz"[i]) + "_m"].push_back(theirs[i]);
      if (force) log.columns[std::string("specific_force_") + "xyz"[i]].push_back(felt[i]);
    }
    log.columns["qw"].push_back(q.w());
    log.columns["qx"].push_back(q.x());
    log.columns["qy"].push_back(q.y());
    log.columns["qz"].push_back(q.z());
  }
  return log;
}

TEST(Axes, TurnsAreReadAsTheyAreWritten) {
  ASSERT_EQ(turns().size(), 24U);
  for (const Turn& turn : turns()) EXPECT_EQ(turn_of(text_of(turn)), turn);
  for (const char* wrong : {"", "x, y", "x, y, y", "x, y, -z", "x, y, z, z", "east, north, up"})
    EXPECT_FALSE(turn_of(wrong)) << wrong;
}

TEST(Axes, WhatIsUpIsToldOfEveryTurnThatMovesOrFeelsItsWeight) {
  for (const Turn& world : turns())
    for (const Turn& body : turns()) {
      const Vec3 up = world.transpose() * Vec3::UnitZ(), of_body = body.transpose() * Vec3::UnitZ();
      for (const bool force : {false, true}) {
        const auto told = up_axes(flight(world, body, force ? 0 : 1, 0.8, force));
        ASSERT_TRUE(told) << text_of(world) << "; " << text_of(body) << force;
        EXPECT_EQ(told->world, up);
        EXPECT_EQ(told->body, of_body);
      }
      EXPECT_EQ(upright_world(up) * up, Vec3::UnitZ());
      EXPECT_EQ(upright_body(of_body) * of_body, Vec3::UnitZ());
    }
}

TEST(Axes, AFlightThatDoesNotMoveDoesNotTell) {
  const Turn ours = Turn::Identity();
  EXPECT_FALSE(up_axes(flight(ours, ours, 0, 0.01)));
  EXPECT_TRUE(up_axes(flight(ours, ours, 1, 0)));
  FlightLog still = flight(ours, ours, 1, 0);
  still.columns.erase("qw");
  EXPECT_FALSE(up_axes(still));
}

TEST(Axes, AnAttitudeOfTheOtherSignIsNoOtherAxis) {
  const Turn ours = Turn::Identity();
  FlightLog log = flight(ours, ours, 1, 0);
  for (auto& v : log.columns["qy"]) v = -v;
  const auto told = up_axes(log);
  EXPECT_TRUE(!told || (told->world == Vec3::UnitZ() && told->body == Vec3::UnitZ()));
}

TEST(Axes, AHeightThatStaysAtTheFloorIsAsked) {
  FlightLog log = flight(*turn_of("x, -z, y"), Turn::Identity(), 0, 0);
  const auto flat = flat_height(log);
  ASSERT_TRUE(flat);
  EXPECT_EQ(flat->second, Vec3::UnitY());
  EXPECT_EQ(text_of(upright_world(flat->second)), "x, -z, y");
  EXPECT_FALSE(flat_height(flight(Turn::Identity(), Turn::Identity(), 0, 0)));
  const auto below = flat_height(flight(*turn_of("y, x, -z"), Turn::Identity(), 0.5, 0));
  ASSERT_TRUE(below);
  EXPECT_EQ(below->second, Vec3(-Vec3::UnitZ()));
}

}  // namespace
}  // namespace backwash::log
