// SPDX-License-Identifier: BSD-3-Clause
// Rows 8 to 11 of docs/faults.md on wire bytes: where the vehicle is, in the controller's frame and in the map.
#include <gtest/gtest.h>
#include <malloc.h>
#include <unistd.h>

#include <bit>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <random>

#include "core/map/octomap/octomap_message.hpp"
#include "services/backwashd/channels.hpp"
#include "services/backwashd/map/map_worker.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

/// In the air, at rest.
struct Hovering : Lockstep {
  Hovering() : Lockstep({0.7, Vec3(5, -3, 0.2)}, Medium::udp) { take_off(); }
};

// Each part of the frame alone, in motion: what goes out is the same place of the room, in the new frame.
TEST(EstimatorResetFault, AResetOfYawHeightOrOneAxisAloneIsHeldInTheNewFrameWithinTwoTicks) {
  struct Move {
    double yaw;
    Vec3 by;
  };
  for (const auto& [yaw, by] : {Move{0.3, {0, 0, 0}}, Move{-2.0, {0, 0, 0}}, Move{0, {0.4, 0, 0}},
                                Move{0, {0, -0.4, 0}}, Move{0, {0, 0, 0.4}}, Move{0, {0, 0, -30}}}) {
    InFlight rig(2);
    Setpoint last = rig.in_map(rig.wire().setpoints.at(0));
    rig.local_frame.yaw += yaw;
    rig.local_frame.origin += by;
    rig.in_hand().reset_estimator(rig.local_frame);
    const int ticks = rig.ticks_until(Mode::hold, 10);
    EXPECT_TRUE(ticks == 1 || ticks == 2) << ticks << " ticks: yaw " << yaw << ", by " << by.transpose();
    EXPECT_EQ(rig.reason(), Reason::autopilot_reset);
    for (int n = 0; n < 100; ++n) {
      ASSERT_EQ(rig.wire().setpoints.size(), 1u);
      const Setpoint now = rig.in_map(rig.wire().setpoints[0]);
      EXPECT_LT((now.p_W - last.p_W).norm(), n == 0 ? 0.10 : 0.04) << n << ": yaw " << yaw << ", by " << by.transpose();
      EXPECT_LT(std::abs(std::remainder(now.yaw - last.yaw, 2 * M_PI)), 0.06) << n;
      last = now;
      rig.tick();
    }
    EXPECT_EQ(last.v_W, Vec3::Zero()) << "it is still moving";
    EXPECT_EQ(rig.mode(), Mode::hold);
  }
}

// Too small to be told from noise by one sample: its counter says so, and the frame is taken anew.
TEST(EstimatorResetFault, ASmallResetThatIsCountedIsTakenIn) {
  InFlight rig(2);
  rig.say(mavlink::Odometry{.q = {1, 0, 0, 0}, .reset_counter = 3});
  rig.tick();
  const Vec3 before = rig.in_map(rig.wire().setpoints.at(0)).p_W;
  rig.local_frame.origin += Vec3(0.08, -0.06, 0);
  rig.in_hand().reset_estimator(rig.local_frame);
  rig.say(mavlink::Odometry{.q = {1, 0, 0, 0}, .reset_counter = 4});
  EXPECT_EQ(rig.ticks_until(Mode::hold, 3), 1);
  EXPECT_EQ(rig.reason(), Reason::autopilot_reset);
  EXPECT_LT((rig.in_map(rig.wire().setpoints.at(0)).p_W - before).norm(), 0.07) << "0.1 m off in the old frame";
}

/// A free box whose face on `side` (0…5: −x, +x, −y, +y, −z, +z) lies `beyond` metres behind the vehicle: positive, the
/// vehicle is inside.
std::shared_ptr<const plan::World> box_around(const Vec3& p, int side, double beyond) {
  constexpr double kEdge = 0.2;
  constexpr int kCells = 20;
  const int axis = side / 2;
  Vec3 low = p - Vec3::Constant(kCells * kEdge / 2);
  low[axis] = side % 2 == 0 ? p[axis] - beyond : p[axis] + beyond - kCells * kEdge;
  map::OccupancyGrid grid(low, kEdge, Index3::Constant(kCells), map::Cell::free);
  return plan::build_world(std::move(grid), Model{}, vehicle_5in());
}

TEST(OutsideTheMapFault, BeyondEachOfTheMapsSixSidesTheSetpointRests) {
  constexpr const char* kSides[] = {"-x", "+x", "-y", "+y", "-z", "+z"};
  for (int side = 0; side < 6; ++side) {
    Hovering rig;
    const Vec3 here = rig.view().state.p_W;
    rig.channels->worlds.offer({box_around(here, side, 0.15), rig.now_ns()});
    rig.ticks(20);
    EXPECT_EQ(rig.mode(), Mode::tracking) << "inside by 15 cm, " << kSides[side] << ": " << to_string(rig.reason());
    const Vec3 before = rig.in_map(rig.wire().setpoints.at(0)).p_W;
    rig.channels->worlds.offer({box_around(rig.view().state.p_W, side, -0.15), rig.now_ns()});
    rig.tick();
    EXPECT_EQ(rig.mode(), Mode::hold) << kSides[side];
    EXPECT_EQ(rig.reason(), Reason::outside_map) << kSides[side];
    for (int n = 0; n < 50; ++n) {
      ASSERT_EQ(rig.wire().setpoints.size(), 1u);
      EXPECT_LT((rig.in_map(rig.wire().setpoints[0]).p_W - before).norm(), 1e-3);
      EXPECT_EQ(rig.in_map(rig.wire().setpoints[0]).v_W, Vec3::Zero());
      rig.tick();
    }
  }
}

TEST(OutsideTheMapFault, BeyondEachOfTheMapsSixSidesEnablingIsRefused) {
  for (int side = 0; side < 6; ++side) {
    for (const double beyond : {-0.15, 0.15}) {
      Lockstep rig({0.7, Vec3(5, -3, 0.2)}, Medium::udp);
      rig.ticks(60);
      rig.channels->worlds.offer({box_around(rig.view().state.p_W, side, beyond), rig.now_ns()});
      EXPECT_TRUE(rig.channels->orders.push({track::Request::enable}));
      rig.tick();
      EXPECT_EQ(rig.mode(), beyond < 0 ? Mode::passive : Mode::enabling) << side;
      if (beyond > 0) continue;
      EXPECT_EQ(rig.reason(), Reason::outside_map) << side;
      for (int n = 0; n < 100; ++n) {
        const Wire& wire = rig.tick();
        ASSERT_TRUE(wire.setpoints.empty() && !wire.commanded(kCommandMode) && !wire.commanded(kCommandArm));
      }
    }
  }
}

/// A map worker behind a rig that starts without a map.
class Maps : public testing::Test {
 protected:
  std::string log_ = std::filesystem::temp_directory_path() / ("backwash_place." + std::to_string(getpid()));
  Recorder recorder_{log_};
  MapSettings settings_;
  std::unique_ptr<Channels> channels_ = std::make_unique<Channels>();
  std::unique_ptr<MapWorker> worker_;

  void use(Channels& channels) {
    worker_ = std::make_unique<MapWorker>(channels, recorder_, Model{}, vehicle_5in(), settings_);
  }
  ~Maps() override {
    worker_.reset();
    channels_->worlds.collect();
    std::filesystem::remove(log_);
  }
  void send(Channels& channels, std::vector<std::int8_t> data, double resolution = 0.2, bool binary = true) {
    channels.maps.offer(
        std::make_unique<const MapMessage>(MapMessage{std::move(data), resolution, binary, "OcTree", 1}));
    worker_->step();
  }
};
using HugeMapFault = Maps;

TEST_F(Maps, WithoutAMapOrWithAnEmptyOneNothingIsEverCommanded) {
  const map::OccupancyGrid solid({-3, -3, 0}, 0.2, {30, 30, 20}, map::Cell::occupied);
  const map::OccupancyGrid unknown({-3, -3, 0}, 0.2, {30, 30, 20}, map::Cell::unknown);
  const std::vector<std::int8_t> nothing[] = {{}, map::encode_octomap(solid), map::encode_octomap(unknown)};
  Lockstep rig({0.7, Vec3(5, -3, 0.2)}, Medium::udp);
  for (const auto& data : nothing) {
    rig.restart(false);
    use(*rig.channels);
    send(*rig.channels, data);
    EXPECT_EQ(rig.channels->maps_rejected, 1u);
    rig.ticks(60);
    for (int n = 0; n < 150; ++n) {
      if (n % 50 == 0) {
        EXPECT_TRUE(rig.channels->orders.push({track::Request::enable}));
      }
      const Wire& wire = rig.tick();
      ASSERT_EQ(rig.mode(), Mode::passive);
      ASSERT_TRUE(wire.setpoints.empty() && !wire.commanded(kCommandMode) && !wire.commanded(kCommandArm));
    }
    EXPECT_EQ(rig.reason(), Reason::map_missing);
    worker_.reset();
  }
}

long peak_kib() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) return std::strtol(line.c_str() + 6, nullptr, 10);
  return -1;
}
void forget_peak() { std::ofstream("/proc/self/clear_refs") << 5; }

/// Octants from the root down to depth 16 towards one corner of the tree, then one known leaf: in the binary form two
/// bits a child, 01 free, 10 occupied, 11 a node with children.
std::vector<std::int8_t> path_to(int octant, int leaf_bits) {
  std::vector<std::int8_t> data;
  for (int depth = 0; depth < 16; ++depth) {
    const int bits = (depth < 15 ? 3 : leaf_bits) << 2 * octant;
    data.push_back(static_cast<std::int8_t>(bits & 0xff));
    data.push_back(static_cast<std::int8_t>(bits >> 8));
  }
  return data;
}

/// Two such paths from the root: their leaves are as far apart as the tree is wide, 2¹⁶ voxels along each axis.
std::vector<std::int8_t> two_paths(int a, int b) {
  const auto first = path_to(std::min(a, b), 1), second = path_to(std::max(a, b), 1);
  const int root = 3 << 2 * a | 3 << 2 * b;
  std::vector<std::int8_t> data{static_cast<std::int8_t>(root & 0xff), static_cast<std::int8_t>(root >> 8)};
  data.insert(data.end(), first.begin() + 2, first.end());
  data.insert(data.end(), second.begin() + 2, second.end());
  return data;
}

TEST_F(HugeMapFault, AFewBytesThatMeanAHugeMapAreRefusedBeforeTheyCostMemoryOrTime) {
  use(*channels_);
  std::vector<std::vector<std::int8_t>> bombs;
  for (int a = 0; a < 8; ++a)
    for (int b = a + 1; b < 8; ++b)  // along one axis alone it is a long thin map, which is small
      if (std::popcount(static_cast<unsigned>(a ^ b)) > 1) bombs.push_back(two_paths(a, b));
  for (int octant = 0; octant < 8; ++octant) {
    const int free = 1 << 2 * octant;  // one leaf of 2¹⁵ voxels along each axis
    bombs.push_back({static_cast<std::int8_t>(free & 0xff), static_cast<std::int8_t>(free >> 8)});
  }
  bombs.push_back({0x55, 0x55});  // eight of them
  malloc_trim(0);
  forget_peak();
  const long before = peak_kib();
  const auto begun = std::chrono::steady_clock::now();
  std::uint64_t sent = 0;
  for (const auto& bomb : bombs)
    for (const double resolution : {0.02, 0.2}) {
      send(*channels_, bomb, resolution);
      ++sent;
    }
  EXPECT_EQ(channels_->maps_rejected, sent);
  EXPECT_EQ(channels_->maps_accepted, 0u);
  EXPECT_EQ(channels_->worlds.control.take(), nullptr);
  EXPECT_LT(peak_kib() - before, 4096) << "KiB at its peak";
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::milliseconds(20 * sent));
}

}  // namespace
}  // namespace backwash::daemon::test
