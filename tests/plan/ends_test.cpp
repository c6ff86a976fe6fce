// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/search/ends.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"

namespace backwash::plan {
namespace {

const Vehicle kVehicle = config::load_vehicle("builtin:quad-5in").value();
const Model kModel = config::load_model("builtin:quad-5in").value();
const PlanOptions kOptions{.v_max = 1.5, .a_max = 2};

PlanStart at_rest(const Vec3& p_W) { return {{p_W, Vec3::Zero()}, {p_W, Vec3::Zero(), Vec3::Zero(), 0}}; }

TEST(RefusedAtOnce, SaysOfAnyGoalWhatTheWorldSays) {
  const auto grid = map::builtin_scene("apartment").value();
  for (const auto method : {reach::Method::tight, reach::Method::paper}) {
    Vehicle vehicle = kVehicle;
    if (method == reach::Method::paper) {
      vehicle.controller.latency = 0;
      vehicle.controller.attitude_lag = 0;
    }
    const auto world = build_world(grid, kModel, vehicle, method);
    const Vec3 start(3, 4, 1.2), extent = grid.resolution() * grid.size().cast<double>();
    std::mt19937 random(1);
    std::uniform_real_distribution<double> u(-0.02, 1.02);
    int clear = 0, unbounded = 0, narrow = 0, not_free = 0;
    for (int n = 0; n < 150; ++n) {
      const double x = u(random), y = u(random), z = u(random);
      Vec3 goal = grid.origin() + extent.cwiseProduct(Vec3(x, y, z));
      if (n % 5 == 0) goal.z() = 0.02;  // on the floor
      const auto said = refused_at_once(grid, kModel, vehicle, method, std::nullopt, at_rest(start), goal, kOptions);
      const auto why = why_no_rest(*world, goal, 0);
      ASSERT_EQ(said.has_value(), why.has_value()) << goal.transpose() << ": " << (why ? *why : said->message);
      if (!why) {
        ++clear;
        continue;
      }
      EXPECT_EQ(said->status, PlanStatus::goal_blocked);
      EXPECT_EQ(said->message, "goal " + *why);
      (why->find("clearance") != std::string::npos ? narrow
       : why->find("bound") != std::string::npos   ? unbounded
                                                   : not_free) += 1;
    }
    EXPECT_GT(clear, 20);
    EXPECT_GT(narrow, 5);
    EXPECT_GT(unbounded + narrow, 15);
    EXPECT_GT(not_free, 10);
  }
}

TEST(RefusedAtOnce, NamesTheStartFirst) {
  const auto grid = map::builtin_scene("apartment").value();
  const auto said = refused_at_once(grid, kModel, kVehicle, reach::Method::tight, std::nullopt, at_rest({-5, 4, 1.2}),
                                    {-6, 4, 1.2}, kOptions);
  ASSERT_TRUE(said);
  EXPECT_EQ(said->status, PlanStatus::start_blocked);
  EXPECT_EQ(said->message, "start (-5.00, 4.00, 1.20) is outside the map");
}

TEST(RefusedAtOnce, LeavesToTheWorldWhatOnlyItCanSay) {
  const auto grid = map::builtin_scene("apartment").value();
  const Vec3 free(3, 4, 1.2), near_a_wall(3, 0.1, 2.2);
  const auto refuses = [&](const Model& model, std::optional<double> margin) {
    return refused_at_once(grid, model, kVehicle, reach::Method::tight, margin, at_rest(free), near_a_wall, kOptions)
        .has_value();
  };
  EXPECT_TRUE(refuses(kModel, std::nullopt));
  EXPECT_FALSE(refuses(kModel, 0.1));
  Model extended = kModel;
  extended.extension.push_back({});
  EXPECT_FALSE(refuses(extended, std::nullopt));
}

}  // namespace
}  // namespace backwash::plan
