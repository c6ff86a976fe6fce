// SPDX-License-Identifier: BSD-3-Clause
// What is made first of a large map, and when a map is said to be in use.
#include <atomic>
#include <chrono>
#include <optional>
#include <thread>

#include "services/backwashd/channels.hpp"
#include "tests/daemon/map/map_worker_rig.hpp"

namespace backwash::daemon {
namespace {

/// A hall of 30 × 30 × 2.4 m.
map::OccupancyGrid hall() {
  map::OccupancyGrid grid(Vec3(-3, 0, 0), 0.2, Index3(150, 150, 12), map::Cell::free);
  for (std::size_t n = 0; n < grid.cell_count(); ++n) {
    const Index3 v = grid.voxel(n), last = grid.size() - Index3::Ones();
    if ((v.array() == 0).any() || (v.array() == last.array()).any()) grid.set(v, map::Cell::occupied);
  }
  return grid;
}

// Take-off does not wait for the far end of a building.
TEST_F(MapWorkerTest, OfALargeMapWhatIsAroundTheVehicleIsHandedOutFirst) {
  const map::OccupancyGrid grid = hall();
  const Vec3 vehicle_W(4, 20, 0.3);
  channels_->vehicle_W.write(vehicle_W);
  std::vector<std::shared_ptr<const plan::World>> handed;
  std::atomic<bool> end{false};
  std::thread control([&] {  // takes each world as it comes
    while (!end) {
      if (const auto* world = this->world(); world && (handed.empty() || handed.back().get() != world))
        handed.push_back(held_->world);
    }
  });
  send(grid, 7);
  end = true;
  control.join();
  ASSERT_EQ(world()->grid.size(), grid.size());
  if (handed.empty() || handed.back().get() != world()) handed.push_back(held_->world);
  ASSERT_EQ(handed.size(), 2u);
  const plan::World &near = *handed.front(), &whole = *handed.back();
  EXPECT_EQ(near.grid.size(), Index3(51, 51, 12));
  std::size_t safe = 0;
  for (std::size_t n = 0; n < near.grid.cell_count(); ++n) {
    const Vec3 p_W = near.grid.center(near.grid.voxel(n));
    if (!near.hover.safe(near.grid.voxel(n))) continue;
    ++safe;
    EXPECT_TRUE(whole.hover.safe(whole.grid.index(p_W)));
    EXPECT_LT((p_W - vehicle_W).head<2>().cwiseAbs().maxCoeff(), 5.2);
  }
  EXPECT_GT(safe, 1000u);
  EXPECT_EQ(channels_->maps_accepted, 1u);
  EXPECT_FALSE(channels_->map_partial);
}

// The two come in any order, by other senders.
TEST_F(MapWorkerTest, ALargeMapThatComesBeforeTheFirstPoseHasItsNearPartToo) {
  std::atomic<bool> partial{false}, end{false};
  std::thread control([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    channels_->vehicle_W.write(Vec3(4, 20, 0.3));
    while (!end) partial = partial || channels_->map_partial;
  });
  send(hall(), 7);
  end = true;
  control.join();
  EXPECT_TRUE(partial);
  EXPECT_FALSE(channels_->map_partial);
  EXPECT_EQ(world()->grid.size(), hall().size());
}

TEST_F(MapWorkerTest, WithoutAPlaceInASmallMapOrForAnIntegratorTheWholeIsMadeAtOnce) {
  const Vehicle plain = config::load_vehicle("builtin:quad-5in").value();
  Vehicle integrator = plain;
  integrator.controller.velocity_integrator = {0.4, 0.4};
  const Vec3 inside(4, 20, 0.3);
  const struct {
    std::optional<Vec3> vehicle_W;
    map::OccupancyGrid grid;
    Vehicle vehicle;
  } cases[] = {{std::nullopt, hall(), plain},
               {Vec3(100, 0, 0), hall(), plain},
               {Vec3(0, 0, 0.5), grid_, plain},  // 6 × 2 m
               {inside, hall(), integrator}};    // its sets read the whole field's extremes
  for (const auto& [vehicle_W, grid, vehicle] : cases) {
    Channels channels;
    MapWorker worker(channels, recorder_, Model{}, vehicle, settings_);
    if (vehicle_W) channels.vehicle_W.write(*vehicle_W);
    channels.maps.offer(std::make_unique<const MapMessage>(
        MapMessage{map::encode_octomap(grid), grid.resolution(), true, "OcTree", 7}));
    EXPECT_TRUE(worker.step());
    const Snapshot* only = channels.worlds.control.take();
    ASSERT_TRUE(only);
    EXPECT_EQ(only->world->grid.size(), grid.size());
    EXPECT_FALSE(channels.map_partial);
    channels.worlds.control.give_back(only);
    channels.worlds.collect();
  }
}

TEST_F(MapWorkerTest, AMapInPartsIsNotSaidToBeInUseBeforeItIs) {
  auto message = MapMessage{map::encode_octomap(grid_), grid_.resolution(), true, "OcTree", 1};
  message.transfer = 7;
  channels_->stop = true;  // its world is never made
  channels_->maps.offer(std::make_unique<const MapMessage>(message));
  EXPECT_TRUE(worker_.step());
  ASSERT_EQ(world(), nullptr);
  EXPECT_FALSE(channels_->map_verdict.read_new());
  channels_->stop = false;
  channels_->maps.offer(std::make_unique<const MapMessage>(message));
  EXPECT_TRUE(worker_.step());
  ASSERT_NE(world(), nullptr);
  EXPECT_TRUE(channels_->map_verdict.read_new().value().accepted);
}

TEST_F(MapWorkerTest, SetsOfCalmerAirAreTheModelsAgainHoweverSmallTheStep) {
  MapWorker worker(*channels_, recorder_, Model{}, config::load_vehicle("builtin:quad-5in").value(), settings_,
                   kModelledAir);
  channels_->maps.offer(std::make_unique<const MapMessage>(
      MapMessage{map::encode_octomap(grid_), grid_.resolution(), true, "OcTree", 7}));
  EXPECT_TRUE(worker.step());
  channels_->air.write({{0.97, 1, 1, 1, 1}, 1});
  EXPECT_TRUE(worker.step());
  EXPECT_EQ(world()->air.factors[0], 0.97);
  channels_->air.write({kModelledAir, 1});
  EXPECT_TRUE(worker.step());
  EXPECT_EQ(world()->air.factors, kModelledAir);
}

}  // namespace
}  // namespace backwash::daemon
