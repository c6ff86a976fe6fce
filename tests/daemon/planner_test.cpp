// SPDX-License-Identifier: BSD-3-Clause
// The planner's work in lockstep with the control loop: headings, flights into unknown space and around what appears.
// While the planner waits, ticks pass; while it computes, none do.
#include "services/backwashd/planner_worker.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <numbers>

#include "core/config/config.hpp"
#include "core/map/load_map.hpp"
#include "core/map/octomap_message.hpp"
#include "services/backwashd/map_worker.hpp"
#include "tests/daemon/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

using map::Cell;
using map::OccupancyGrid;

void fill(OccupancyGrid& grid, const Vec3& low, const Vec3& high, Cell cell) {
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
  int scan_every_ = 0;  // ticks; 0: never
  std::uint64_t segments_ = 0;
  std::optional<Setpoint> last_;
  double last_rate_ = 0, fastest_turn_ = 0, hardest_turn_ = 0, nearest_ = INFINITY;
  int ticks_ = 0, held_ = 0, rested_ = 0;

  ~PlannerFlight() override { std::filesystem::remove(log_); }

  /// One tick; every set-point must go on where the last one was, in position, velocity and heading.
  void tick() {
    const Wire& wire = rig_.tick();
    ++ticks_;
    ASSERT_EQ(wire.setpoints.size(), 1u);
    const Setpoint now = rig_.in_map(wire.setpoints[0]);
    const bool tracking = rig_.mode() == track::Mode::tracking;
    if (last_) {
      EXPECT_LT((now.p_W - last_->p_W - kControlPeriod / 2 * (last_->v_W + now.v_W)).norm(), 3e-3) << ticks_;
      EXPECT_LT((now.v_W - last_->v_W).norm(), 3.5 * kControlPeriod) << ticks_;  // a_max is 2 m/s² per axis
      const double rate = turn_between(last_->yaw, now.yaw) / kControlPeriod;
      fastest_turn_ = std::max(fastest_turn_, std::abs(rate));
      if (tracking) hardest_turn_ = std::max(hardest_turn_, std::abs(rate - last_rate_) / kControlPeriod);
      last_rate_ = rate;
    }
    last_ = now;
    held_ += rig_.mode() == track::Mode::hold;
    rested_ += rig_.view().finished;
    nearest_ = std::min(nearest_, map::DistanceField(truth_).exact(truth_, rig_.autopilot->truth().p_W));
    if (scan_every_ > 0 && ticks_ % scan_every_ == 0) scan();
  }

  /// What a range sensor that looks everywhere sees of the truth, to the map worker as a scan.
  void scan() {
    const Vec3 from = rig_.autopilot->truth().p_W;
    std::vector<Vec3> points;
    constexpr int kRays = 3000;
    for (int n = 0; n < kRays; ++n) {  // a spiral over the sphere
      const double z = 1 - (2 * n + 1.0) / kRays, a = n * 2.399963;
      const Vec3 ray(std::sqrt(1 - z * z) * std::cos(a), std::sqrt(1 - z * z) * std::sin(a), z);
      double s = 0;
      while (s < kSees && !truth_.occupied(truth_.index(from + s * ray))) s += 0.02;
      if (s < kSees || kFreesBeyond) points.push_back(from + (s < kSees ? s : 2 * settings_.sensor_range) * ray);
    }
    rig_.channels->scans.push(new Scan{points, from, rig_.now_ns()});
    map_.step();
  }
  static constexpr double kSees = 3;  // m
  static constexpr bool kFreesBeyond = true;

  void know(const OccupancyGrid& grid) {
    rig_.channels->maps.offer(std::make_unique<const MapMessage>(
        MapMessage{map::encode_octomap(grid), grid.resolution(), true, "OcTree", rig_.now_ns()}));
    ASSERT_TRUE(map_.step());
    const auto* world = rig_.channels->worlds.mission.take();
    ASSERT_TRUE(world);
    known_ = *world;
    rig_.channels->worlds.mission.give_back(world);
  }
  std::shared_ptr<const plan::World> known_;

  /// The planner is asked to fly there; its answer.
  std::string go(const Vec3& goal, std::optional<double> yaw = {}) {
    rig_.channels->jobs.offer(
        std::make_unique<const PlanJob>(PlanJob{PlanJob::Kind::go_to, ++jobs_, goal, yaw, known_}));
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
    ASSERT_EQ(go(goal), "");
    int faced = 0, fast = 0;
    fly(1500, [&] {
      if (last_->v_W.norm() < 0.5 * vehicle_5in().limits.v_max) return;
      ++fast;
      faced += std::abs(turn_between(std::atan2(last_->v_W.y(), last_->v_W.x()), last_->yaw)) < 0.2;
    });
    const Vec3 way = goal - Vec3(0, 0, 0);
    EXPECT_LT((last_->p_W - goal).norm(), 0.03) << way.transpose();
    const auto q = rig_.autopilot->attitude();
    const Vec3 nose = q * Vec3::UnitX();
    EXPECT_LT(std::abs(turn_between(std::atan2(nose.y(), nose.x()), last_->yaw)), 0.05) << "the vehicle turned with it";
    std::printf("faced the path in %d of %d fast ticks; yaw %.3f\n", faced, fast, last_->yaw);
    EXPECT_GT(fast, 0);
  }
  std::printf("turned at up to %.3f rad/s, %.3f rad/s2\n", fastest_turn_, hardest_turn_);
  const plan::YawLimits limits;
  EXPECT_LE(fastest_turn_, limits.rate + 1e-3);
  EXPECT_LE(hardest_turn_, limits.acceleration + 1e-2);
  EXPECT_GT(fastest_turn_, 0.9 * limits.rate) << "there was something to turn";
  EXPECT_EQ(rig_.view().outside, 0u);
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

/// The corridor with a wall across three quarters of it, of which the map knows the near end only.
class UnknownRoom : public PlannerFlight {
 protected:
  void SetUp() override {
    fill(truth_, {0.4, -2, 0}, {0.6, 0.7, 3.5}, Cell::occupied);
    rig_.take_off();
    OccupancyGrid known = truth_;
    fill(known, {-0.2, -2.1, 0}, {2.6, 2.1, 3.5}, Cell::unknown);
    know(known);
    scan_every_ = 20;
    rested_ = 0;
  }
};

TEST_F(UnknownRoom, IsFlownThroughToAGoalBehindItsWallWithoutAStopOrAContact) {
  const Vec3 goal(1.8, -0.6, 1.2);
  ASSERT_FALSE(known_->grid.free(known_->grid.index(goal)));
  ASSERT_EQ(go(goal), "");
  rested_ = 0;
  fly(4000);
  std::printf("%llu segments, %d ticks, held %d, nearest %.3f m\n", (unsigned long long)segments_, ticks_, held_, nearest_);
  EXPECT_LT((last_->p_W - goal).norm(), 0.03);
  EXPECT_GT(segments_, 3u);
  EXPECT_EQ(held_, 0);
  EXPECT_EQ(rig_.view().outside, 0u);
  EXPECT_GT(nearest_, vehicle_5in().body.radius);
}

TEST_F(UnknownRoom, AGoalThatNothingLeadsToIsRefusedFromRest) {
  fill(truth_, {0.4, -2, 0}, {0.6, 2, 3.5}, Cell::occupied);
  ASSERT_EQ(go({1.8, -0.6, 1.2}), "");
  fly(4000);
  EXPECT_LT(rig_.autopilot->truth().p_W.x(), 0.2);
  EXPECT_EQ(rig_.mode(), track::Mode::tracking);
  EXPECT_NE(go({1.8, -0.6, 1.2}), "");
  EXPECT_GT(nearest_, vehicle_5in().body.radius);
}

}  // namespace
}  // namespace backwash::daemon::test
