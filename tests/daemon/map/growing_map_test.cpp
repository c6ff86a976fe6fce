// SPDX-License-Identifier: BSD-3-Clause
// A live map has another extent with nearly every message (docs/faults.md row 14): control thread and map worker in
// lockstep. The world of the new map is never made, as if that took minutes.
#include <unistd.h>

#include <filesystem>
#include <ostream>

#include "core/map/octomap/octomap_message.hpp"
#include "services/backwashd/map/map_worker.hpp"
#include "tests/daemon/map/map_faults.hpp"

namespace backwash::daemon {
namespace {

using map::Cell;
using map::OccupancyGrid;

/// What the new map is, against the one that is flown in.
struct Change {
  const char* name;
  Index3 low{0, 0, 0}, high{0, 0, 0};  // rows more at either end; below 0: fewer
};

void PrintTo(const Change& change, std::ostream* out) { *out << change.name; }

class GrowingMap : public MapFaults, public testing::WithParamInterface<Change> {
 protected:
  std::string log_ = testing::TempDir() + "growing_map." + std::to_string(getpid());
  Recorder recorder_{log_};
  MapWorker worker_{*channels_, recorder_, Model{}, kVehicle, settings_};
  OccupancyGrid known_ = map::builtin_scene("parallel-walls-4m", 0.2).value();

  ~GrowingMap() override { std::filesystem::remove(log_); }
  void SetUp() override {
    map_moves_on_ = false;
    lookout_ = std::make_unique<Lookout>(*channels_, *channels_, kVehicle, settings_);
    send(known_);
    enable();
    fly();
    for (int n = 0; n < 150; ++n) tick();
    ASSERT_EQ(out_.supervisor.mode, Mode::tracking);
    channels_->stop = true;
  }
  void TearDown() override { channels_->worlds.collect(); }
  void send(const OccupancyGrid& grid) {
    channels_->maps.offer(std::make_unique<const MapMessage>(
        MapMessage{map::encode_octomap(grid), grid.resolution(), true, "OcTree", now_ns_}));
    worker_.step();
  }
  OccupancyGrid changed() const {
    const auto& [name, low, high] = GetParam();
    OccupancyGrid grid(known_.origin() - 0.2 * low.cast<double>(), 0.2, known_.size() + low + high, Cell::free);
    map::for_each_voxel(map::common({low, low + known_.size() - Index3::Ones()}, map::all_of(grid.size())),
                        [&](const Index3& v) { grid.set(v, known_.at(Index3(v - low))); });
    return grid;
  }
  Vec3 ahead() const { return {in_map().x() + 1.2, 0, 1}; }
};

TEST_P(GrowingMap, ThatSaysNothingOfTheWayLetsTheFlightGoOn) {
  send(changed());
  EXPECT_EQ(ticks_until(Mode::hold, 10), 11);
}

TEST_P(GrowingMap, HasAnObstacleOnTheWayAndTheFlightIsHeldInTheNextTick) {
  OccupancyGrid grid = changed();
  grid.set(grid.index(ahead()), Cell::occupied);
  send(grid);
  EXPECT_EQ(ticks_until(Mode::hold, 1), 1);
  EXPECT_EQ(out_.supervisor.reason, Reason::obstacle_ahead);
}

TEST_P(GrowingMap, DoesNotKnowTheWayAnyMoreAndTheFlightIsHeldInTheNextTick) {
  OccupancyGrid grid = changed();
  const Index3 at = grid.index(ahead());
  map::for_each_voxel({at - Index3(1, 3, 3), at + Index3(2, 3, 3)}, [&](const Index3& v) {
    if (grid.inside(v)) grid.set(v, Cell::unknown);
  });
  send(grid);
  EXPECT_EQ(ticks_until(Mode::hold, 1), 1);
}

INSTANTIATE_TEST_SUITE_P(Extents, GrowingMap,
                         testing::Values(Change{"Same"}, Change{"Row", {0, 0, 0}, {0, 1, 0}},
                                         Change{"Corner", {2, 1, 0}, {0, 0, 1}},
                                         Change{"Shift", {1, -1, 0}, {-1, 1, 0}},
                                         Change{"Smaller", {-1, -1, 0}, {-1, -1, 0}},
                                         Change{"Larger", {20, 20, 0}, {20, 20, 5}}),
                         [](const auto& each) { return each.param.name; });

using EndingMap = GrowingMap;
TEST_P(EndingMap, BeforeTheFlightDoesHoldsItInTheNextTick) {
  map::VoxelBox part = map::all_of(known_.size());
  part.high.x() = known_.index(ahead()).x();
  send(map::part_of(known_, part));
  EXPECT_EQ(ticks_until(Mode::hold, 1), 1);
}
INSTANTIATE_TEST_SUITE_P(Extents, EndingMap, testing::Values(Change{"Ends"}));

}  // namespace
}  // namespace backwash::daemon
