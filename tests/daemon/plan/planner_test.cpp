// SPDX-License-Identifier: BSD-3-Clause
// The planner's work in lockstep with the control loop: headings, flights into unknown space and around what appears.
// While the planner waits, ticks pass; while it computes, none do.
#include "services/backwashd/plan/planner_worker.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <numbers>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/map/octomap/octomap_message.hpp"
#include "services/backwashd/map/map_worker.hpp"
#include "services/backwashd/map/scan_placement.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

using map::Cell;
using map::OccupancyGrid;

void fill_box(OccupancyGrid& grid, const Vec3& low, const Vec3& high, Cell cell) {
  const Index3 a = grid.index(low + Vec3::Constant(1e-6)), b = grid.index(high - Vec3::Constant(1e-6));
  for (int k = a.z(); k <= b.z(); ++k)
    for (int j = a.y(); j <= b.y(); ++j)
      for (int i = a.x(); i <= b.x(); ++i) grid.set({i, j, k}, cell);
}

double turn_between(double from, double to) { return std::remainder(to - from, 2 * std::numbers::pi); }

class PlannerFlight : public testing::Test {
 protected:
  std::string log_ = std::filesystem::temp_directory_path() / ("backwash_planner." + std::to_string(getpid()));
  Lockstep rig_;
  Recorder recorder_{log_};
  MapSettings settings_;
  MapWorker map_{*rig_.channels, recorder_, Model{}, vehicle_5in(), settings_};
  PlannerWorker planner_{*rig_.channels, recorder_, [this](const auto&) { ++segments_; }, [this] { tick(); }};
  OccupancyGrid truth_ = map::builtin_scene("parallel-walls-4m").value();
  map::DistanceField distance_{truth_};
  int scan_every_ = 0;  // ticks; 0: never
  std::uint64_t segments_ = 0;
  std::optional<Setpoint> last_;
  double last_rate_ = 0, fastest_turn_ = 0, hardest_turn_ = 0, nearest_ = INFINITY;
  int ticks_ = 0, held_ = 0;

  ~PlannerFlight() override { std::filesystem::remove(log_); }

  void stands(const Vec3& low, const Vec3& high) {
    fill_box(truth_, low, high, Cell::occupied);
    distance_ = map::DistanceField(truth_);
  }

  /// One tick; every set-point must go on where the last one was, in position, velocity and heading.
  void tick() {
    const Wire& wire = rig_.tick();
    ++ticks_;
    ASSERT_EQ(wire.setpoints.size(), 1u);
    const Setpoint now = rig_.in_map(wire.setpoints[0]);
    const bool tracking = rig_.mode() == Mode::tracking;
    if (last_) {
      EXPECT_LT((now.p_W - last_->p_W - kControlPeriod / 2 * (last_->v_W + now.v_W)).norm(), 3e-3) << ticks_;
      EXPECT_LT((now.v_W - last_->v_W).norm(), 3.5 * kControlPeriod) << ticks_;  // a_max is 2 m/s² per axis
      const double rate = turn_between(last_->yaw, now.yaw) / kControlPeriod;
      fastest_turn_ = std::max(fastest_turn_, std::abs(rate));
      if (tracking) hardest_turn_ = std::max(hardest_turn_, std::abs(rate - last_rate_) / kControlPeriod);
      last_rate_ = rate;
    }
    last_ = now;
    held_ += rig_.mode() == Mode::hold;
    nearest_ = std::min(nearest_, distance_.exact(truth_, rig_.autopilot->truth().p_W));
    if (scan_every_ > 0 && ticks_ % scan_every_ == 0) scan();
    if (ticks_ % kWorldEvery == 0) map_.step();
  }

  /// What a range sensor that looks everywhere sees of the truth: its new voxels to the control thread at once, the
  /// whole scan to the map worker.
  void scan() {
    const Vec3 from = rig_.autopilot->truth().p_W;
    std::vector<Vec3> points;
    constexpr int kRays = 1500;
    for (int n = 0; n < kRays; ++n) {  // a spiral over the sphere
      const double z = 1 - (2 * n + 1.0) / kRays, a = n * 2.399963;
      const Vec3 ray(std::sqrt(1 - z * z) * std::cos(a), std::sqrt(1 - z * z) * std::sin(a), z);
      double s = 0;
      while (s < kSees && !truth_.occupied(truth_.index(from + s * ray))) s += 0.02;
      points.push_back(from + (s < kSees ? s : 2 * settings_.sensor_range) * ray);
    }
    auto scan = std::make_unique<Scan>(Scan{points, from, rig_.now_ns()});
    know();
    const NewVoxels voxels = new_voxels(known_->grid, *scan, settings_.sensor_range);
    if (voxels.count > 0) {
      EXPECT_TRUE(rig_.channels->scan_voxels.push(voxels));
    }
    EXPECT_TRUE(rig_.channels->scans.push(scan.release()));
  }
  static constexpr double kSees = 3;      // m
  static constexpr int kWorldEvery = 20;  // ticks between the map worker's turns

  void know(const OccupancyGrid& grid) {
    rig_.channels->maps.offer(std::make_unique<const MapMessage>(
        MapMessage{map::encode_octomap(grid), grid.resolution(), true, "OcTree", rig_.now_ns()}));
    ASSERT_TRUE(map_.step());
    know();
  }
  /// As the mission does.
  void know() {
    if (const auto* world = rig_.channels->worlds.mission.take()) {
      known_ = world->world;
      rig_.channels->worlds.mission.give_back(world);
    }
  }
  std::shared_ptr<const plan::World> known_;

  /// The planner is asked to fly there; its answer.
  std::string go(const Vec3& goal, std::optional<double> yaw = {}) {
    know();
    rig_.channels->jobs.offer(
        std::make_unique<const PlanJob>(PlanJob{PlanJob::Kind::go_to, ++jobs_, goal, yaw, rig_.view().epoch}));
    EXPECT_TRUE(planner_.step());
    const auto outcome = rig_.channels->outcomes.pop();
    return outcome->ok ? "" : outcome->reason.data();
  }
  std::uint64_t jobs_ = 0;

  /// Ticks, and what the planner does between them, until the vehicle is at rest; `each` after each tick.
  template <typename Each>
  void fly(int most, const Each& each) {
    for (int n = 0; n < most && !(rig_.view().finished && n > 5); ++n) {
      tick();
      if (HasFatalFailure()) return;
      planner_.step();
      each();
    }
  }
  void fly(int most) {
    fly(most, [] {});
  }
};

TEST_F(PlannerFlight, TheHeadingFollowsThePathWithinItsLimitsAndIsContinuousFromFlightToFlight) {
  rig_.take_off();
  know(truth_);
  for (const Vec3& goal : {Vec3(1.6, 0.8, 1.2), Vec3(-1.6, -0.8, 1.2), Vec3(-1.6, 0.9, 1.2)}) {
    const Vec3 from = rig_.view().command.p_W;
    ASSERT_EQ(go(goal), "");
    fly(1500);
    EXPECT_LT((last_->p_W - goal).norm(), 0.03);
    EXPECT_LT(std::abs(turn_between(std::atan2(goal.y() - from.y(), goal.x() - from.x()), last_->yaw)), 0.2);
    const auto q = rig_.autopilot->attitude();
    const Vec3 nose = q * Vec3::UnitX();
    EXPECT_LT(std::abs(turn_between(std::atan2(nose.y(), nose.x()), last_->yaw)), 0.05) << "the vehicle turned with it";
  }
  std::printf("turned at up to %.3f rad/s, %.3f rad/s2\n", fastest_turn_, hardest_turn_);
  const plan::YawLimits limits;
  EXPECT_LE(fastest_turn_, limits.rate + 1e-3);
  EXPECT_LE(hardest_turn_, limits.acceleration + 1e-2);
  EXPECT_GT(fastest_turn_, 0.9 * limits.rate) << "there was something to turn";
  EXPECT_EQ(rig_.view().shown.samples_outside, 0u);
}

TEST_F(PlannerFlight, AHeadingAskedForIsTurnedToAtTheGoal) {
  rig_.take_off();
  know(truth_);
  ASSERT_EQ(go({0.5, 0.5, 1.2}, -2.0), "");
  fly(1500);
  EXPECT_NEAR(turn_between(last_->yaw, -2.0), 0, 0.03);  // the frames are known to 3 degrees
  const Vec3 nose = rig_.autopilot->attitude() * Vec3::UnitX();
  EXPECT_NEAR(turn_between(std::atan2(nose.y(), nose.x()), -2.0), 0, 0.05);
  EXPECT_LE(fastest_turn_, plan::YawLimits{}.rate + 1e-3);
}

/// A crate stands in the way from when the vehicle has come some way; row 14 of docs/faults.md.
class CrateAppears : public PlannerFlight {
 protected:
  const Vec3 goal_{2, 0, 1.2};
  int seen_ = -1, held_at_ = -1;

  void SetUp() override {
    rig_.take_off();
    know(truth_);
    ASSERT_EQ(go(goal_), "");
    scan_every_ = 10;
  }
  void appear() {  // 15 ticks before the next world
    if (seen_ >= 0 || rig_.view().command.p_W.x() < -1.2 || ticks_ % kWorldEvery != 5) return;
    stands({0.5, -0.4, 0.8}, {0.9, 0.2, 1.6});
    scan();
    seen_ = ticks_;
  }
};

TEST_F(CrateAppears, ItIsBrakedForWithinTwoTicksAndFlownAroundWithoutComingToRest) {
  double slowest = 10;
  int finished = 0;
  fly(3000, [&] {
    appear();
    if (held_at_ < 0 && held_ > 0) held_at_ = ticks_;
    if (held_at_ >= 0 && last_->p_W.x() < 0.9) {
      slowest = std::min(slowest, last_->v_W.norm());
      finished += rig_.view().finished;
    }
  });
  std::printf("held after %d ticks for %d, slowest %.2f m/s, %llu segments, nearest %.3f m\n", held_at_ - seen_, held_,
              slowest, static_cast<unsigned long long>(segments_), nearest_);
  ASSERT_GT(held_, 0);
  EXPECT_LE(held_at_ - seen_, 2);
  EXPECT_EQ(finished, 0);
  EXPECT_GT(slowest, 0.1);
  EXPECT_LT((last_->p_W - goal_).norm(), 0.03);
  EXPECT_GT(nearest_, vehicle_5in().body.radius);
  EXPECT_EQ(rig_.view().shown.samples_outside, 0u);
}

TEST_F(CrateAppears, AnOperatorsStopEndsTheFlightAlsoWhileItBrakesForTheCrate) {
  bool stopped = false;
  fly(3000, [&] {
    appear();
    if (!stopped && rig_.mode() == Mode::hold) stopped = rig_.channels->orders.push({track::Request::stop});
  });
  ASSERT_TRUE(stopped);
  EXPECT_EQ(rig_.mode(), Mode::hold);
  EXPECT_EQ(rig_.reason(), Reason::stop_requested);
  EXPECT_EQ(segments_, 1u);
  EXPECT_GT(nearest_, vehicle_5in().body.radius);
}

/// The corridor with a wall across three quarters of it, of which the map knows the near end only.
class UnknownRoom : public PlannerFlight {
 protected:
  void SetUp() override {
    stands({0.4, -2, 0}, {0.6, 0.7, 3.5});
    rig_.take_off();
    OccupancyGrid known = truth_;
    fill_box(known, {-0.2, -2.1, 0}, {2.6, 2.1, 3.5}, Cell::unknown);
    know(known);
    scan_every_ = 20;
  }
};

TEST_F(UnknownRoom, IsFlownThroughToAGoalBehindItsWallWithoutAContact) {
  const Vec3 goal(1.8, -0.6, 1.2);
  ASSERT_FALSE(known_->grid.free(known_->grid.index(goal)));
  ASSERT_EQ(go(goal), "");
  int rests = 0;
  for (; (last_->p_W - goal).norm() > 0.03 && rests < 3; ++rests) {
    fly(4000);
    if ((last_->p_W - goal).norm() > 0.03) {
      ASSERT_EQ(go(goal), "");  // as the mission does
    }
  }
  std::printf("%d flights, %llu segments, %d ticks, held %d, nearest %.3f m\n", rests,
              static_cast<unsigned long long>(segments_), ticks_, held_, nearest_);
  EXPECT_LT((last_->p_W - goal).norm(), 0.03);
  EXPECT_GT(segments_, 3u);
  EXPECT_EQ(held_, 0);
  EXPECT_EQ(rig_.view().shown.samples_outside, 0u);
  EXPECT_GT(nearest_, vehicle_5in().body.radius);
}

TEST_F(UnknownRoom, AGoalThatNothingLeadsToIsRefusedFromRest) {
  stands({0.4, -2, 0}, {0.6, 2, 3.5});
  ASSERT_EQ(go({1.8, -0.6, 1.2}), "");
  fly(4000);
  EXPECT_LT(rig_.autopilot->truth().p_W.x(), 0.2);
  EXPECT_EQ(rig_.mode(), Mode::tracking);
  EXPECT_NE(go({1.8, -0.6, 1.2}).find("goal_blocked"), std::string::npos);
  EXPECT_GT(nearest_, vehicle_5in().body.radius);
}

}  // namespace
}  // namespace backwash::daemon::test
