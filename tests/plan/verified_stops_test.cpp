// SPDX-License-Identifier: BSD-3-Clause
#include "core/plan/verified_stops.hpp"

#include <gtest/gtest.h>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/plan/planner.hpp"
#include "core/reach/rest.hpp"

namespace backwash::plan {
namespace {

/// A flight along the corridor at 1 m/s, and its stops from its first command on, every 0.2 s.
class VerifiedStops : public testing::Test {
 protected:
  static constexpr std::size_t kEvery = 10;
  const Vehicle vehicle_ = config::load_vehicle("builtin:quad-5in").value();
  const std::shared_ptr<const World> world_ =
      build_world(map::builtin_scene("parallel-walls-4m", 0.2).value(), Model{}, vehicle_);
  std::vector<Setpoint> commands_;
  State start_{{-2, 0, 1.2}, {1, 0, 0}};

  VerifiedStops() {
    for (int k = 0; k < 150; ++k) commands_.push_back({{-2 + 0.02 * k, 0, 1.2}, {1, 0, 0}, Vec3::Zero(), 0});
  }
  std::vector<Stop> stops(const std::function<double(const reach::ReachTube&)>& clearance) const {
    return verified_stops(*world_, start_, commands_.front(), commands_, 0, kEvery, clearance);
  }
};

TEST_F(VerifiedStops, AreThoseWhoseWholeSweptTubeIsClearAndNoOthers) {
  const auto clear_before = [](double x) {
    return [x](const reach::ReachTube& tube) { return x - tube.back().center.p_W.x(); };
  };
  const auto all = stops([](const auto&) { return 1.0; });
  ASSERT_EQ(all.size(), commands_.size() / kEvery);
  std::size_t expected = 0;
  for (const Stop& s : all) expected += s.tube.back().center.p_W.x() < 0;
  ASSERT_GT(expected, 2u);
  ASSERT_LT(expected, all.size());
  const auto some = stops(clear_before(0));
  ASSERT_EQ(some.size(), expected);
  for (std::size_t n = 0; n < expected; ++n) EXPECT_EQ(some[n].branch, all[n].branch);
  EXPECT_TRUE(stops([](const auto&) { return 0.0; }).empty()) << "touching is not clear";
  const auto first = stops([](const auto& tube) { return tube.front().center.p_W.x() < -1.9 ? 1.0 : -1.0; });
  EXPECT_EQ(first.size(), all.size()) << "the tube is the whole one, from the flight's start";
}

TEST_F(VerifiedStops, BrakeWithinTheLimitOnTheFlightsOwnPathAndRestUntilTheLoopHasSettled) {
  const std::size_t rest = reach::settling_periods(world_->reach);
  std::size_t judged = 0;
  for (const Stop& s : stops([](const auto&) { return 1.0; })) {
    // The flight's own commands end at full speed: a stop that has no room before that is not judged.
    if (s.commands.back().p_W == commands_.back().p_W) continue;
    ++judged;
    ASSERT_EQ(s.tube.size(), s.commands.size() + 1);
    ASSERT_GT(s.commands.size(), rest + 3);
    Setpoint before = commands_[s.branch];
    for (const Setpoint& c : s.commands) {
      EXPECT_LE((c.v_W - before.v_W).cwiseAbs().maxCoeff() / kControlPeriod, vehicle_.limits.a_max * (1 + 1e-9));
      EXPECT_NEAR(c.p_W.y(), 0, 1e-12);
      before = c;
    }
    for (std::size_t n = s.commands.size() - rest; n < s.commands.size(); ++n) {
      EXPECT_EQ(s.commands[n].p_W, s.commands.back().p_W);
      EXPECT_EQ(s.commands[n].v_W, Vec3::Zero());
    }
    // The braking itself ends when it has to: the rest after it is no longer than that and a period.
    EXPECT_NE(s.commands[s.commands.size() - rest - 3].p_W, s.commands.back().p_W);
  }
  EXPECT_GT(judged, 5u);
}

}  // namespace
}  // namespace backwash::plan
