// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "tests/daemon/map/map_worker_rig.hpp"

namespace backwash::daemon {
namespace {

// Building one takes minutes where the map is large and the processor busy.
TEST_F(MapWorkerTest, AWorldInTheMakingIsGivenUpWhenTheDaemonEnds) {
  channels_->stop = true;
  send(grid_);
  EXPECT_EQ(world(), nullptr);
  EXPECT_EQ(channels_->maps_accepted, 0u);
  channels_->stop = false;
  send(grid_);
  const plan::World* whole = world();
  ASSERT_NE(whole, nullptr);
  channels_->stop = true;
  grid_.set(grid_.index({0, 0, 1}), map::Cell::occupied);
  send(grid_);
  EXPECT_EQ(world(), whole) << "the old world stays";
}

TEST_F(MapWorkerTest, InOneTermMapsAreTakenOfTheFirstWriterWhoseMapWasGood) {
  const auto send_from = [&](std::uint32_t term, std::uint8_t writer, std::vector<std::int8_t> data) {
    auto message = MapMessage{std::move(data), grid_.resolution(), true, "OcTree", 1};
    message.from = {term, {writer}};
    channels_->maps.offer(std::make_unique<const MapMessage>(std::move(message)));
    EXPECT_TRUE(worker_.step());
    return std::pair(channels_->maps_accepted.load(), channels_->maps_rejected.load());
  };
  const auto good = map::encode_octomap(grid_);
  EXPECT_EQ(send_from(0, 7, {3, 0, 3}), std::pair(0ul, 1ul));
  EXPECT_FALSE(channels_->map_writer.read_new()) << "a map that is refused binds nobody";
  EXPECT_EQ(send_from(0, 1, good), std::pair(1ul, 1ul));
  const auto bound = channels_->map_writer.read_new();
  ASSERT_TRUE(bound);
  EXPECT_EQ(bound->writer, WriterId{1});
  EXPECT_EQ(send_from(0, 7, good), std::pair(1ul, 2ul));
  EXPECT_EQ(send_from(0, 1, good), std::pair(2ul, 2ul));
  EXPECT_EQ(send_from(1, 7, good), std::pair(3ul, 2ul)) << "the first writer is gone: a new term";
  EXPECT_EQ(send_from(1, 1, good), std::pair(3ul, 3ul));
}

TEST_F(MapWorkerTest, AMapInPartsBindsNobodyAndItsVerdictIsTold) {
  const auto send_from = [&](std::uint8_t writer, std::optional<std::uint64_t> transfer,
                             std::vector<std::int8_t> data) {
    auto message = MapMessage{std::move(data), grid_.resolution(), true, "OcTree", 1};
    message.from = {0, {writer}};
    message.transfer = transfer;
    channels_->maps.offer(std::make_unique<const MapMessage>(std::move(message)));
    EXPECT_TRUE(worker_.step());
    return channels_->map_verdict.read_new();
  };
  const auto good = map::encode_octomap(grid_);
  for (const std::uint8_t writer : {1, 2}) {
    const auto verdict = send_from(writer, 10 + writer, good);
    ASSERT_TRUE(verdict);
    EXPECT_EQ(verdict->transfer, 10u + writer);
    EXPECT_TRUE(verdict->accepted) << verdict->why.data();
  }
  EXPECT_FALSE(channels_->map_writer.read_new());
  EXPECT_FALSE(send_from(3, std::nullopt, good)) << "a mapper, which is told by nobody";
  ASSERT_TRUE(channels_->map_writer.read_new());
  const auto verdict = send_from(1, 20, good);
  ASSERT_TRUE(verdict);
  EXPECT_FALSE(verdict->accepted);
  EXPECT_NE(std::string(verdict->why.data()).find("is in use"), std::string::npos);
}

// Row 54.
TEST_F(MapWorkerTest, GrownFactorsMakeTheWorldAnewAndLaterMapsAndScansKeepThem) {
  MapWorker worker(*channels_, recorder_, Model{}, config::load_vehicle("builtin:quad-5in").value(), settings_,
                   AirFactors{1, 1, 1.5, 1, 1});
  const auto take = [&](const map::OccupancyGrid& grid, std::int64_t at_ns) {
    channels_->maps.offer(std::make_unique<const MapMessage>(
        MapMessage{map::encode_octomap(grid), grid.resolution(), true, "OcTree", at_ns}));
    EXPECT_TRUE(worker.step());
    return world();
  };
  channels_->air.write({{1, 1, 1.5, 1, 1}, 0});
  EXPECT_FALSE(worker.step()) << "there is no world yet";
  const plan::World* before = take(grid_, 7);
  ASSERT_TRUE(before && before->air.known());
  EXPECT_EQ(before->air.factors, (AirFactors{1, 1, 1.5, 1, 1})) << "what earlier flights have learnt";
  channels_->air.write({{1.04, 1, 1.5, 1, 1}, 0});
  EXPECT_FALSE(worker.step()) << "less than a step";
  EXPECT_EQ(world(), before);
  channels_->air.write({{1.04, 1, 2, 1, 1}, 0});
  EXPECT_TRUE(worker.step());
  ASSERT_NE(world(), before);
  EXPECT_EQ(world()->air.factors, (AirFactors{1.04, 1, 2, 1, 1}));
  EXPECT_EQ(channels_->map_ns.load(), 7) << "the map is no younger for it";
  const Vec3 p(0, 0.5, 1.2);
  EXPECT_GT(world()->bounds.at(grid_.index(p)).w[kX], 0);
  channels_->air.write({{1, 1, 1, 1, 1}, 0});
  EXPECT_FALSE(worker.step()) << "no factor shrinks";
  grid_.set(grid_.index({0, 0, 1}), map::Cell::occupied);
  EXPECT_EQ(take(grid_, 8)->air.factors, (AirFactors{1.04, 1, 2, 1, 1}));
  EXPECT_EQ(take(map::builtin_scene("parallel-walls-4m", 0.2).value(), 9)->air.factors, (AirFactors{1.04, 1, 2, 1, 1}))
      << "a map of another place";
}

TEST_F(MapWorkerTest, AResetMakesTheWorldAnewAsModelledAndFactorsGrowFromThere) {
  MapWorker worker(*channels_, recorder_, Model{}, config::load_vehicle("builtin:quad-5in").value(), settings_,
                   AirFactors{1, 1, 2, 1, 1});
  channels_->maps.offer(std::make_unique<const MapMessage>(
      MapMessage{map::encode_octomap(grid_), grid_.resolution(), true, "OcTree", 7}));
  EXPECT_TRUE(worker.step());
  const auto bounds = [&] { return world()->bounds.at(grid_.index({0, 0.5, 1.2})).w; };
  const auto rough = bounds();
  channels_->air.write({kModelledAir, 1});
  EXPECT_TRUE(worker.step());
  EXPECT_EQ(world()->air.factors, kModelledAir);
  EXPECT_LT(bounds()[kX], rough[kX]);
  const auto modelled = plan::build_world(grid_, Model{}, config::load_vehicle("builtin:quad-5in").value());
  EXPECT_NEAR(bounds()[kX], modelled->bounds.at(grid_.index({0, 0.5, 1.2})).w[kX], 1e-3 * rough[kX]);
  channels_->air.write({kModelledAir, 2});
  EXPECT_FALSE(worker.step()) << "there is nothing to make anew";
  channels_->air.write({{1, 1, 1.5, 1, 1}, 2});
  EXPECT_TRUE(worker.step());
  channels_->air.write({{1, 1, 1.2, 1, 1}, 2});
  EXPECT_FALSE(worker.step()) << "no factor shrinks without a reset";
  EXPECT_EQ(world()->air.factors, (AirFactors{1, 1, 1.5, 1, 1}));
}

TEST_F(MapWorkerTest, AGoodMapBecomesAWorldForEveryThread) {
  EXPECT_FALSE(worker_.step());
  send(grid_);
  ASSERT_TRUE(world());
  EXPECT_EQ(world()->grid.size(), grid_.size());
  EXPECT_EQ(channels_->maps_accepted, 1u);
  EXPECT_EQ(channels_->map_ns.load(), 1);
  for (auto* to : {&channels_->worlds.mission, &channels_->worlds.planner, &channels_->worlds.reader}) {
    const auto* taken = to->take();
    ASSERT_TRUE(taken);
    EXPECT_EQ(taken->world.get(), world());
    to->give_back(taken);
  }
}

// docs/faults.md rows 10 and 12.
// Row 46: 5 Hz of 40 MB of anything must not fill the disk.
TEST_F(MapWorkerTest, ARejectedMapCostsTheRawLogAFewBytesThatTellItApart) {
  recorder_.drain(*channels_);
  const auto before = std::filesystem::file_size(log_);
  for (const int fill : {1, 1, 2}) send(std::vector<std::int8_t>(1 << 20, static_cast<std::int8_t>(fill)), 0.1);
  EXPECT_EQ(channels_->maps_rejected, 3u);
  recorder_.drain(*channels_);
  EXPECT_LT(std::filesystem::file_size(log_) - before, 300u);
  std::vector<log::RejectedMap> seen;
  const auto log = log::read_raw_log(log_);
  ASSERT_TRUE(log);
  for (const auto& record : log->records)
    if (record.header.kind == log::RecordKind::map) {
      ASSERT_EQ(record.bytes.size(), sizeof(log::MapRecord) + sizeof(log::RejectedMap));
      std::memcpy(&seen.emplace_back(), record.bytes.data() + sizeof(log::MapRecord), sizeof(log::RejectedMap));
    }
  ASSERT_EQ(seen.size(), 3u);
  EXPECT_EQ(seen[0].bytes, 1u << 20);
  EXPECT_EQ(seen[0].hash, seen[1].hash);
  EXPECT_NE(seen[0].hash, seen[2].hash);
}

TEST_F(MapWorkerTest, ACorruptEmptyOrForeignMapIsRejectedWholeAndTheOldWorldStays) {
  send(grid_);
  const auto* before = world();
  auto cut = map::encode_octomap(grid_);
  cut.resize(cut.size() / 2);
  send(cut, 0.2);
  send(std::vector<std::int8_t>{}, 0.2);
  send(map::encode_octomap(grid_), 0.1);   // another resolution than the map in use
  send(map::encode_octomap(grid_), 0.21);  // and one that no field is known for
  send(map::OccupancyGrid({0, 0, 0}, 0.2, {8, 8, 8}, map::Cell::occupied));
  EXPECT_EQ(channels_->maps_rejected, 5u);
  EXPECT_EQ(world(), before);
  EXPECT_EQ(channels_->map_ns.load(), 1);
}

TEST_F(MapWorkerTest, AFirstMapOfAResolutionThatNoFieldIsKnownForIsRejected) {
  for (const double resolution : {0.019, 0.21}) send(map::encode_octomap(grid_), resolution);
  EXPECT_EQ(channels_->maps_rejected, 2u);
  EXPECT_EQ(world(), nullptr);
}

TEST_F(MapWorkerTest, AMapOfAnotherPlaceOfTheSameSizeIsAWorldOfItsOwn) {
  send(grid_);
  map::OccupancyGrid elsewhere(grid_.origin() + Vec3(0.4, 0, 0), grid_.resolution(), grid_.size(), map::Cell::free);
  for (std::size_t n = 0; n < grid_.cell_count(); ++n) elsewhere.set(grid_.voxel(n), grid_.at(n));
  send(elsewhere);
  EXPECT_EQ(channels_->maps_accepted, 2u);
  EXPECT_LT((world()->grid.origin() - elsewhere.origin()).norm(), 1e-9);
}

TEST_F(MapWorkerTest, AScanIsAddedToTheNewestMap) {
  send(grid_);
  const Index3 v = grid_.index({1.1, 0.1, 1.1});
  grid_.set(v, map::Cell::occupied);
  send(grid_, 4);
  scan({{-1.1, 0.1, 1.1}}, {-0.1, 0.1, 1.1}, 9);
  EXPECT_TRUE(world()->grid.occupied(grid_.index({-1.1, 0.1, 1.1})));
  EXPECT_TRUE(world()->grid.occupied(v)) << "what the map before the scan had";
}

TEST_F(MapWorkerTest, AnEmptyMapIsNoMap) {
  send(std::vector<std::int8_t>{}, 0.2);
  EXPECT_EQ(world(), nullptr);
  EXPECT_EQ(channels_->map_ns.load(), std::nullopt);
}

// docs/faults.md row 11: of a snapshot, 115 bytes a voxel.
TEST_F(MapWorkerTest, TheCapIsThatOfTheSnapshotToAVoxel) {
  MapSettings settings;
  settings.max_mib = 1;
  MapWorker worker(*channels_, recorder_, Model{}, config::load_vehicle("builtin:quad-5in").value(), settings);
  const auto offer = [&](int edge) {
    const map::OccupancyGrid grid({0, 0, 0}, 0.2, {edge, 20, 20}, map::Cell::free);
    channels_->maps.offer(
        std::make_unique<const MapMessage>(MapMessage{map::encode_octomap(grid), 0.2, true, "OcTree", 1}));
    EXPECT_TRUE(worker.step());
  };
  offer(23);  // 9,200 voxels of 9,118
  EXPECT_EQ(channels_->maps_rejected, 1u);
  EXPECT_EQ(world(), nullptr);
  offer(22);  // 8,800
  EXPECT_EQ(channels_->maps_rejected, 1u);
  ASSERT_TRUE(world());
  EXPECT_EQ(world()->grid.size(), Index3(22, 20, 20));
}

TEST_F(MapWorkerTest, AScanChangesTheWorldWhereItSaysSomethingNew) {
  const Vec3 sensor(0.1, 0.1, 1.1), point(1.1, 0.1, 1.1);
  scan({point}, sensor, 5);
  EXPECT_EQ(channels_->scans_rejected, 1u) << "there is no map to put it in";
  send(grid_);
  ASSERT_TRUE(world());
  ASSERT_TRUE(world()->grid.free(world()->grid.index(point)));
  ASSERT_TRUE(world()->hover.safe(world()->grid.index({0.7, 0.1, 1.1})));
  scan({point}, sensor, 9);
  EXPECT_TRUE(world()->grid.occupied(world()->grid.index(point)));
  EXPECT_FALSE(world()->hover.safe(world()->grid.index({1.0, 0.1, 1.1})));
  EXPECT_EQ(channels_->map_ns.load(), 9);
  const auto* before = world();
  scan({point}, sensor, 12);
  EXPECT_EQ(world(), before) << "nothing new";
  EXPECT_EQ(channels_->map_ns.load(), 12) << "but the map is as old as that";
  scan({point}, {90, 0, 1}, 13);
  EXPECT_EQ(channels_->scans_rejected, 2u) << "the sensor is outside the map";
}

TEST_F(MapWorkerTest, ANewMapOfTheSamePlaceHandsItsNewVoxelsToTheControlThread) {
  send(grid_);
  EXPECT_FALSE(channels_->map_voxels.pop());
  const Index3 v = grid_.index({1.1, 0.1, 1.1});
  grid_.set(v, map::Cell::occupied);
  send(grid_, 4);
  const auto voxels = channels_->map_voxels.pop();
  ASSERT_TRUE(voxels);
  ASSERT_EQ(voxels->count, 1u);
  EXPECT_LT((Vec3(voxels->centers[0][0], voxels->centers[0][1], voxels->centers[0][2]) - grid_.center(v)).norm(), 1e-9);
  EXPECT_TRUE(world()->grid.occupied(v));
}

// What is made first of a large map, and when a map is said to be in use.

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
