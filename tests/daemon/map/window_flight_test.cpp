// SPDX-License-Identifier: BSD-3-Clause
// Flights whose world is a mapper's window alone (docs/interfaces.md, "A window that moves"; docs/faults.md row 55):
// control thread, planner and map worker in lockstep.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "core/map/load_map.hpp"
#include "services/backwashd/map/map_worker.hpp"
#include "services/backwashd/map/window_clouds.hpp"
#include "services/backwashd/plan/planner_worker.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

constexpr double kVoxel = 0.1;  // m

class WindowFlight : public testing::Test {
 protected:
  std::string log_ = testing::TempDir() + "window_flight." + std::to_string(::getpid());
  Lockstep rig_{{0.7, Vec3(5, -3, 0.2)}, Medium::udp};
  Recorder recorder_{log_};
  std::optional<MapWorker> map_;
  PlannerWorker planner_{*rig_.channels, recorder_, [](const auto&) {}, [this] { tick(); }};
  map::OccupancyGrid truth_ = map::builtin_scene("parallel-walls-4m", kVoxel).value();
  map::DistanceField distance_{truth_};
  std::shared_ptr<const plan::World> world_;  // the newest
  config::MapWindow window_;
  Vec3 moved_ = Vec3::Zero();   // the map, against where things are, by loop closures
  std::uint32_t closures_ = 1;  // the first is the identity
  bool mapper_ = true;
  int ticks_ = 0, held_ = 0;
  std::uint64_t jobs_ = 0;
  double nearest_ = INFINITY;  // m, of the body to what stands there

  ~WindowFlight() override {
    rig_.channels->worlds.collect();
    std::filesystem::remove(log_);
  }
  /// In the air, with a window of this size that sees the floor; none of what it has left is kept.
  void begin(double x, double y, double z) {
    MapSettings settings;
    settings.window = {"rt/occ", "rt/free", {x, y, z}, kVoxel, 0};
    window_ = settings.window;
    map_.emplace(*rig_.channels, recorder_, Model{}, vehicle_5in(), settings);
    rig_.spoil = [this](OdometrySample& s) {
      s.state.p_W += moved_;
      s.closures = closures_;
      s.map_from_odom.t = moved_;
    };
    rig_.take_off();
    look();
    map_->step();
    know();
    ASSERT_EQ(world_->grid.size(), window_.world()) << "the window's alone";
  }
  void know() {
    if (const auto* newest = rig_.channels->worlds.mission.take()) {
      world_ = newest->world;
      rig_.channels->worlds.mission.give_back(newest);
    }
  }
  /// What the mapper publishes: of both clouds one stamp.
  void look() {
    const Vec3 at = rig_.view().state.p_W;
    const Index3 size = window_.voxels();
    for (const bool free : {true, false}) {
      auto cloud = std::make_unique<WindowCloud>();
      cloud->free = free;
      cloud->window.low = (at / kVoxel - size.cast<double>() / 2).array().round().cast<int>();
      cloud->window.high = cloud->window.low + size - Index3::Ones();
      cloud->stamp_ns = cloud->received_ns = rig_.now_ns();
      map::for_each_voxel(cloud->window, [&](const Index3& v) {
        const Index3 there = truth_.index(kVoxel * (v.cast<double>() + Vec3::Constant(0.5)) - moved_);
        if (truth_.inside(there) && (free ? truth_.free(there) : truth_.occupied(there))) cloud->voxels.push_back(v);
      });
      if (!free && world_) {
        const NewVoxels voxels = new_voxels(world_->grid, *cloud);
        if (voxels.count > 0) {
          EXPECT_TRUE(rig_.channels->scan_voxels.push(voxels));
        }
      }
      ASSERT_TRUE(rig_.channels->windows.push(cloud.release()));
    }
  }
  void tick() {
    rig_.tick();
    ++ticks_;
    held_ += rig_.mode() == Mode::hold;
    nearest_ = std::min(nearest_, distance_.exact(truth_, rig_.autopilot->truth().p_W) - vehicle_5in().body.radius);
    if (mapper_ && map_ && ticks_ % 10 == 0) look();
    if (ticks_ % 20 == 0) map_->step();
    know();
  }
  /// "", or why not. `each` after each tick of the way.
  template <typename Each>
  std::string go(const Vec3& goal, const Each& each) {
    rig_.channels->jobs.offer(
        std::make_unique<const PlanJob>(PlanJob{PlanJob::Kind::go_to, ++jobs_, goal, {}, rig_.view().epoch}));
    planner_.step();
    const auto outcome = rig_.channels->outcomes.pop();
    if (!outcome || !outcome->ok) return outcome ? outcome->reason.data() : "no answer";
    for (int n = 0; n < 1500 && !(rig_.view().finished && n > 5); ++n) {
      tick();
      planner_.step();
      each();
    }
    return "";
  }
  std::string go(const Vec3& goal) {
    return go(goal, [] {});
  }
  void expect_at(const Vec3& goal) {
    EXPECT_EQ(rig_.mode(), Mode::tracking) << to_string(rig_.reason());
    EXPECT_LT((rig_.view().command.p_W - goal).norm(), 0.05) << rig_.view().command.p_W.transpose();
    EXPECT_GT(nearest_, 0);
    EXPECT_EQ(rig_.view().shown.samples_outside, 0u);
  }
  map::Cell at(const Vec3& p) const {
    const Index3 v = world_->grid.index(p);
    return world_->grid.inside(v) ? world_->grid.at(v) : map::Cell::unknown;
  }
  void stands(const Vec3& low, const Vec3& high) {
    map::for_each_voxel({truth_.index(low + Vec3::Constant(1e-6)), truth_.index(high - Vec3::Constant(1e-6))},
                        [this](const Index3& v) { truth_.set(v, map::Cell::occupied); });
    distance_ = map::DistanceField(truth_);
  }
  std::string recorded() {
    recorder_.drain(*rig_.channels);
    std::ifstream file(log_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
};

// The VIO's map moves by 0.2 m in flight, and the mapper's with it: what it had said before is 0.2 m beside it.
TEST_F(WindowFlight, AfterALoopClosureTheWindowSaysWhereThingsAreAndTheFlightGoesOn) {
  begin(3, 5, 3);
  const Vec3 goal(-0.2, -1, 1.2), wall(-1, -2.05, 1.25);
  ASSERT_EQ(at(wall), map::Cell::occupied);
  bool closed = false;
  ASSERT_EQ(go(goal,
               [&] {
                 if (closed || rig_.view().command.p_W.x() < -1.4) return;
                 closed = true;
                 moved_ = {0, -0.2, 0};
                 closures_ = 2;
               }),
            "");
  EXPECT_TRUE(closed);
  EXPECT_EQ(rig_.view().closures, 2u);
  expect_at(goal);
  EXPECT_EQ(at(wall + moved_), map::Cell::occupied);
  EXPECT_EQ(at(wall), map::Cell::free) << "where it was before the map moved";
  EXPECT_EQ(held_, 0);
}

// What it had left was let go, and meanwhile something has come to stand there.
TEST_F(WindowFlight, BackWhereTheWindowWasLetGoNothingOfBeforeIsTrustedAndACrateIsFlownAround) {
  begin(2, 2, 3);
  const Vec3 behind(-2.55, 0.05, 1.25);
  ASSERT_EQ(at(behind), map::Cell::free);
  for (double x = -1.5; x < 1.1; x += 0.5) ASSERT_EQ(go({x, 0, 1.2}), "") << x;
  expect_at({1, 0, 1.2});
  EXPECT_NE(recorded().find("are let go"), std::string::npos);
  stands({-1.2, -0.3, 0.8}, {-0.9, 0.3, 1.6});
  for (double x = 0.5; x > -0.1; x -= 0.5) ASSERT_EQ(go({x, 0, 1.2}), "") << x;
  for (const Vec3& to :
       {Vec3(-0.4, 0, 1.2), Vec3(-0.7, 0.6, 1.2), Vec3(-1.2, 0.6, 1.2), Vec3(-1.6, 0.2, 1.2), Vec3(-2, 0, 1.2)})
    ASSERT_EQ(go(to), "") << to.transpose();
  expect_at({-2, 0, 1.2});
  EXPECT_EQ(at(behind), map::Cell::free) << "said again";
}

// A window 2 m high at 1.2 m has not shown the floor: where it ends is taken for one, and the sets hold.
TEST_F(WindowFlight, AFloorThatNobodyHasShownIsTakenForOneAndNoSampleLeavesItsSet) {
  begin(2, 2, 2);
  ASSERT_EQ(at({-2, 0, 0.05}), map::Cell::unknown);
  for (double x = -1.6; x < 1.1; x += 0.4) ASSERT_EQ(go({x, 0, 1.2}), "") << x;
  expect_at({0.8, 0, 1.2});
  EXPECT_EQ(held_, 0);
}

// It dies in flight: the flight ends in what was said, and goes no further.
TEST_F(WindowFlight, WithoutItsMapperAFlightEndsInWhatIsKnownAndNoneBeginsBeyond) {
  begin(2, 2, 3);
  const Vec3 goal(-1.4, 0, 1.2);
  ASSERT_EQ(go(goal, [&] { mapper_ = mapper_ && rig_.view().command.p_W.x() < -1.8; }), "");
  EXPECT_FALSE(mapper_);
  expect_at(goal);
  for (const double x : {-0.6, 0.2, 1.0}) static_cast<void>(go({x, 0, 1.2}));
  EXPECT_LT(rig_.view().command.p_W.x(), -0.8) << "beyond it nothing was said";
  EXPECT_EQ(rig_.mode(), Mode::tracking);
  EXPECT_GT(nearest_, 0);
  EXPECT_EQ(rig_.view().shown.samples_outside, 0u);
  EXPECT_EQ(go({-2, 0, 1.2}), "") << "back is known";
  expect_at({-2, 0, 1.2});
}

}  // namespace
}  // namespace backwash::daemon::test
