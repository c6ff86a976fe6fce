// SPDX-License-Identifier: BSD-3-Clause
// What the control thread makes of new voxels (docs/faults.md row 14): the same as holding each against each set, and
// in a tick also on a long flight.
#include "services/backwashd/plan/lookout.hpp"

#include <gtest/gtest.h>
#include <time.h>

#include <cmath>
#include <memory>
#include <random>

#include "core/reach/clearance.hpp"
#include "services/backwashd/channels.hpp"

namespace backwash::daemon {
namespace {

Vehicle vehicle() {
  Vehicle v;
  v.body.radius = 0.16;
  v.estimation.position = 0.02;
  v.initial_error = {0.02, 0.05};
  v.limits = {1.5, 2};
  return v;
}

/// Flies a minute of a spiral, the tick and the lookout as in the daemon.
struct LongFlight {
  std::unique_ptr<Channels> channels = std::make_unique<Channels>();
  track::FlightTick flight{vehicle(), 0};
  Lookout lookout{*channels, *channels, vehicle(), {}};
  track::AcceptedSegment segment;
  track::TickInput in;

  explicit LongFlight(std::size_t sets = 3000, double clearance = 0, double apart = 0) {
    segment.id = 1;
    segment.clearance = clearance;
    segment.apart_m = apart;
    segment.closures = closures;
    for (std::size_t k = 0; k <= sets; ++k) {
      const double t = 0.02 * static_cast<double>(k);
      reach::TubeStep s{};
      s.shape.setIdentity();
      s.center = {{2 * std::sin(0.4 * t), 2 - 2 * std::cos(0.4 * t), 1 + 0.02 * t}, Vec3::Zero()};
      s.half_widths.fill(0.05 + 0.03 * std::sin(t));
      s.half_widths_interval = s.half_widths;
      segment.tube.push_back(s);
      if (k < sets) segment.commands.push_back({s.center.p_W, Vec3::Zero(), Vec3::Zero(), 0});
    }
    plan::Stop stop;
    stop.branch = 40;
    stop.commands.assign(50, segment.commands[40]);
    stop.tube.assign(51, segment.tube[40]);
    segment.stops.push_back(stop);
    in.now_ns = 1'000'000'000;
    for (int n = 0; n < 60; ++n) tick();
    tick(track::Request::enable);
    for (int n = 0; n < 60; ++n) tick();
    segment.epoch = flight.epoch();
    segment.closures = closures;
    in.segment = &segment;
    tick();
    in.segment = nullptr;
    EXPECT_EQ(flight.tracker().segment(), 1u);
  }
  void tick(track::Request request = track::Request::none) {
    in.now_ns += 20'000'000;
    OdometrySample s;
    s.received_ns = s.stamp_ns = in.now_ns;
    s.state = closure.state(segment.tube.front().center);
    s.q = {std::cos(closure.yaw / 2), 0, 0, std::sin(closure.yaw / 2)};
    s.closures = closures;
    s.map_from_odom = closure;
    in.odometry = s;
    in.request = request;
    in.autopilot.heartbeat_age = 0;
    in.autopilot.offboard = true;
    in.autopilot.pose = {in.now_ns, segment.tube.front().center, {1, 0, 0, 0}, in.now_ns, Vec3::Zero()};
    flight.step(in);
  }
  std::uint32_t closures = 1;
  track::RigidShift closure;  // map from odometry
};

NewVoxels one(const Vec3& p) {
  NewVoxels v;
  v.edge = 0.1;
  v.count = 1;
  v.centers[0] = {p.x(), p.y(), p.z()};
  return v;
}

TEST(Lookout, FindsAVoxelInTheWayExactlyWhereTheSetsDo) {
  LongFlight f(3000, 0, 0.07);  // the frames were apart by that when it was verified
  const double taken = vehicle().body.radius + vehicle().estimation.position + 0.07;
  const auto ahead = f.flight.tracker().ahead();
  const plan::Stop* stop = f.flight.tracker().next_stop();
  ASSERT_TRUE(stop);
  const auto in_way = [&](auto sets, const Vec3& p) {
    return !sets.empty() && reach::first_blocked(sets, 0, {p, 0.1}, taken) < sets.size();
  };
  std::mt19937_64 rng(1);
  std::uniform_real_distribution<double> across(-0.6, 0.6);
  std::size_t in_tube = 0, in_stop = 0, beside = 0;
  for (int n = 0; n < 3000; ++n) {
    // Near some set, of every run and of its ends.
    const auto& near = f.segment.tube[(n % 2 ? 32u * (rng() % 90) : rng() % 3000) + rng() % 2].center.p_W;
    const Vec3 p = (n % 5 ? near : f.segment.tube[rng() % 60].center.p_W) + Vec3(across(rng), across(rng), across(rng));
    EXPECT_TRUE(f.channels->scan_voxels.push(one(p)));
    const auto seen = f.lookout.look(f.flight, f.in.now_ns);
    const bool tube = in_way(ahead[0], p);
    ASSERT_EQ(seen.tube_blocked, tube) << p.transpose();
    const bool by_stop = in_way(ahead[0].first(stop->branch - f.flight.tracker().index()), p) ||
                         in_way(std::span<const reach::TubeStep>(stop->tube), p);
    ASSERT_EQ(seen.stop_blocked, by_stop) << p.transpose();
    in_tube += tube;
    in_stop += by_stop;
    beside += !tube;
  }
  EXPECT_GT(in_tube, 300u);
  EXPECT_GT(in_stop, 100u);
  EXPECT_GT(beside, 300u);
}

// After a loop closure that turned the map, the cubes that come are turned against the sets: every point of them
// counts.
TEST(Lookout, MissesNoPartOfAVoxelThatIsTurnedAgainstTheSets) {
  LongFlight f;
  f.closures = 2;
  f.closure = {0.15, {0.1, -0.1, 0}};
  f.tick();
  ASSERT_EQ(f.flight.tracker().closures(), 2u);
  const double taken = vehicle().body.radius + vehicle().estimation.position;
  const auto sets = f.flight.tracker().ahead()[0];
  const track::RigidShift back = f.flight.tracker().shift().inverse();
  const auto in_way = [&](const Vec3& p_old, double edge) {
    return reach::first_blocked(sets, 0, {p_old, edge}, taken) < sets.size();
  };
  std::mt19937_64 rng(2);
  std::uniform_real_distribution<double> across(-1, 1);
  constexpr double kEdge = 0.8;
  int by_a_corner_alone = 0, clear = 0;
  for (int n = 0; n < 400; ++n) {
    const Vec3 centre = f.closure.point(Vec3(3 * across(rng), 2 + 3 * across(rng), 1.5 + across(rng)));
    bool touches = false;
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 half = kEdge / 2 * Vec3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
      touches = touches || in_way(back.point(centre + half), 1e-9);
    }
    NewVoxels voxel = one(centre);
    voxel.edge = kEdge;
    EXPECT_TRUE(f.channels->scan_voxels.push(voxel));
    const bool seen = f.lookout.look(f.flight, f.in.now_ns).tube_blocked;
    EXPECT_TRUE(seen || !touches) << centre.transpose();
    by_a_corner_alone += touches && !in_way(back.point(centre), kEdge);
    clear += !seen;
  }
  EXPECT_GT(by_a_corner_alone, 2);
  EXPECT_GT(clear, 50);
}

// What a scan found before a loop closure lies elsewhere in the map of after it: the way back is not held against it.
TEST(Lookout, AVoxelOfBeforeALoopClosureIsNotHeldAgainstASegmentOfAfterIt) {
  for (const bool closes : {false, true}) {
    LongFlight f;
    const Vec3 t(0, -0.6, 0), beside = f.segment.tube[30].center.p_W + t;
    NewVoxels voxel = one(beside);
    voxel.received_ns = 1;  // after the map of any segment here
    EXPECT_TRUE(f.channels->scan_voxels.push(voxel));
    EXPECT_FALSE(f.lookout.look(f.flight, f.in.now_ns).tube_blocked);
    if (closes) {
      f.closures = 2;
      f.closure.t = t;
      f.tick();
    }
    track::AcceptedSegment on = f.segment;  // through where the voxel was in the map of then
    on.id = 2;
    on.continues = 1;
    on.branch = 20;
    on.closures = f.closures;
    for (auto& c : on.commands) c.p_W += t;
    for (auto& s : on.tube) s.center.p_W += t;
    on.stops.clear();
    f.in.segment = &on;
    f.tick();
    f.in.segment = nullptr;
    ASSERT_EQ(f.flight.tracker().segment(), 2u);
    EXPECT_EQ(f.lookout.look(f.flight, f.in.now_ns).tube_blocked, !closes);
  }
}

// What the planner or the tick was told of: the vehicle brakes on a stop that leads away from the flight.
// Row 54.
TEST(Lookout, AFlightThatIsNotClearInRougherAirIsToldByItsNumberAloneUntilItBrakes) {
  LongFlight f;
  f.channels->rough_segment = 2;
  EXPECT_FALSE(f.lookout.look(f.flight, f.in.now_ns).rougher);
  f.channels->rough_segment = 1;
  const auto seen = f.lookout.look(f.flight, f.in.now_ns);
  EXPECT_TRUE(seen.rougher);
  EXPECT_FALSE(seen.tube_blocked);
  f.in.surroundings.rougher = true;
  f.tick();
  ASSERT_TRUE(f.flight.tracker().braking());
  EXPECT_FALSE(f.lookout.look(f.flight, f.in.now_ns).rougher);
}

TEST(Lookout, WhileItBrakesTheStopIsWhatIsAheadAndTheBlockedFlightIsNoMore) {
  LongFlight f;
  for (reach::TubeStep& s : f.segment.stops[0].tube) s.center.p_W.z() += 3;
  f.channels->blocked_segment = f.segment.id;
  EXPECT_TRUE(f.lookout.look(f.flight, f.in.now_ns).tube_blocked);
  f.in.surroundings.tube_blocked = true;
  f.tick();
  f.in.surroundings.tube_blocked = false;
  ASSERT_TRUE(f.flight.tracker().braking());
  EXPECT_FALSE(f.lookout.look(f.flight, f.in.now_ns).tube_blocked);
  for (auto* ring : {&f.channels->scan_voxels, &f.channels->map_voxels}) {
    EXPECT_TRUE(ring->push(one(f.segment.tube[2000].center.p_W)));
    EXPECT_FALSE(f.lookout.look(f.flight, f.in.now_ns).tube_blocked) << "it does not come to that";
    EXPECT_TRUE(ring->push(one(f.segment.stops[0].tube[30].center.p_W)));
    EXPECT_TRUE(f.lookout.look(f.flight, f.in.now_ns).tube_blocked);
  }
}

TEST(Lookout, ALiveMapThatNeverCameIsLateFromTheClocksFirstSecondOn) {
  LongFlight f(3000, 1);  // clear by more than anything could have come nearer
  MapSettings live;
  live.live = true;
  Lookout lookout(*f.channels, *f.channels, vehicle(), live);
  ASSERT_EQ(f.channels->map_ns.load(), std::nullopt);
  for (const std::int64_t now : {std::int64_t{20'000'000}, f.in.now_ns}) EXPECT_TRUE(lookout.look(f.flight, now).late);
}

TEST(Lookout, AClosingObstacleHasWhatTheFramesLeaveOfTheClearanceAlone) {
  for (const bool apart : {false, true}) {
    LongFlight f(3000, 0.3, apart ? 0.2 : 0);
    MapSettings live;
    live.live = true;
    live.closing_speed = 0.5;
    Lookout lookout(*f.channels, *f.channels, vehicle(), live);
    f.channels->map_ns.store(f.in.now_ns - 400'000'000);
    EXPECT_EQ(lookout.look(f.flight, f.in.now_ns).late, apart);
  }
}

double processor_s() {
  timespec t{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// As many voxels as a scan hands over, a little beside a minute of flight, against holding each against each set.
TEST(Lookout, OfALongFlightCostsATickATenthOfWhatEachAgainstEachWould) {
  LongFlight f;
  NewVoxels many;
  many.edge = 0.1;
  many.count = NewVoxels::kMost;
  for (std::size_t n = 0; n < many.count; ++n) many.centers[n] = {0.01 * static_cast<double>(n) - 1.2, 2, 1.5};
  const auto sets = f.flight.tracker().ahead()[0];
  double each = 1e9, look = 1e9;
  for (int n = 0; n < 5; ++n) {
    double from = processor_s();
    for (const auto& c : many.centers)
      ASSERT_EQ(reach::first_blocked(sets, 0, {{c[0], c[1], c[2]}, 0.1}, 0.18), sets.size());
    each = std::min(each, processor_s() - from);
    EXPECT_TRUE(f.channels->scan_voxels.push(many));
    from = processor_s();
    const auto seen = f.lookout.look(f.flight, f.in.now_ns);
    look = std::min(look, processor_s() - from);
    ASSERT_FALSE(seen.tube_blocked || seen.stop_blocked);
  }
  std::printf("256 voxels and %zu sets: %.3f ms, each against each %.3f ms\n", sets.size(), 1e3 * look, 1e3 * each);
  EXPECT_LT(look, each / 10);
}

}  // namespace
}  // namespace backwash::daemon
