// SPDX-License-Identifier: BSD-3-Clause
// Obstacles in the sets ahead: the tick brakes, freezes, or goes on around them.
#include "tests/track/flown/straight_flight.hpp"

namespace backwash::track::test {
namespace {

// Row 14: at command 101 the next stop leaves at 110.
TEST(FlightTick, AnObstacleInTheSetsAheadStopsTheVehicleOnTheNextVerifiedStopFromTheSameTick) {
  Flight flight;
  ASSERT_EQ(flight.tracker().index(), 101u);
  flight.in.surroundings.tube_blocked = true;
  flight.step();
  EXPECT_EQ(flight.out.supervisor.mode, Mode::hold);
  EXPECT_EQ(flight.out.supervisor.reason, Reason::obstacle_ahead);
  flight.in.surroundings.tube_blocked = false;  // what is ahead now is the stop, and it is clear
  const auto& stop = flight.segment.stops[11];
  ASSERT_EQ(stop.branch, 110u);
  for (std::size_t k = 102; k < 110; ++k) EXPECT_EQ(flight.step().command.p_W, flight.segment.commands[k].p_W) << k;
  for (const Setpoint& c : stop.commands) EXPECT_EQ(flight.step().command.p_W, c.p_W);
  for (int n = 0; n < 50; ++n) {
    EXPECT_EQ(flight.step().command.p_W, stop.commands.back().p_W);
    EXPECT_EQ(flight.out.command.v_W, Vec3::Zero());
  }
}

TEST(FlightTick, WhatIsAheadWhileItBrakesIsTheStop) {
  Flight flight;
  flight.in.surroundings.tube_blocked = true;
  flight.step();
  const auto ahead = flight.tracker().ahead();
  EXPECT_EQ(ahead[0].size(), 8u);  // entries 102 to 109 of the segment
  EXPECT_EQ(ahead[1].size(), flight.segment.stops[11].tube.size());
  EXPECT_EQ(flight.tracker().next_stop(), nullptr);
}

TEST(FlightTick, IfTheStopIsBlockedTooTheSetpointIsFrozenAtOnce) {
  Flight flight;
  const Vec3 last = flight.out.command.p_W;
  flight.in.surroundings.tube_blocked = flight.in.surroundings.stop_blocked = true;
  for (int n = 0; n < 50; ++n) {
    flight.step();
    EXPECT_EQ(flight.out.supervisor.mode, Mode::hold);
    EXPECT_EQ(flight.out.command.p_W, last);
    EXPECT_EQ(flight.out.command.v_W, Vec3::Zero());
  }
}

TEST(FlightTick, AnObstacleInTheStopItBrakesOnFreezesTheSetpoint) {
  Flight flight;
  flight.in.surroundings.tube_blocked = true;
  flight.step();
  flight.in.surroundings.tube_blocked = false;
  for (int n = 0; n < 15; ++n) flight.step();
  const Vec3 last = flight.out.command.p_W;
  flight.in.surroundings.tube_blocked = true;
  EXPECT_EQ(flight.step().command.p_W, last);
  EXPECT_EQ(flight.out.command.v_W, Vec3::Zero());
}

/// Leaves the stop that the flight brakes on, at command 120, with the commands flown until then.
AcceptedSegment around(const Flight& flight) {
  const auto& stop = flight.segment.stops[11];
  AcceptedSegment on = flight.segment;
  on.id = 99;
  on.continues = flight.segment.id;
  on.branch = 120;
  on.stops.clear();
  for (std::size_t k = stop.branch; k < on.commands.size(); ++k) {
    on.commands[k] = k < on.branch ? stop.commands[k - stop.branch] : on.commands[on.branch - 1];
    if (k < on.branch) continue;
    on.commands[k].p_W.y() += 0.001 * static_cast<double>(k - on.branch);
    on.commands[k].v_W = {0, 0.05, 0};
  }
  on.tube = tube_of(on.commands);
  return on;
}

// Row 14: it need not come to rest first.
TEST(FlightTick, AFlightThatBrakesForAnObstacleGoesOnAroundItAlongItsStop) {
  Flight flight;
  const auto on = around(flight);
  flight.in.surroundings.tube_blocked = true;
  flight.step();
  flight.in.surroundings.tube_blocked = false;
  for (int n = 0; n < 12; ++n) flight.step();
  ASSERT_EQ(flight.tracker().index(), 114u);
  flight.in.segment = &on;
  flight.step();
  EXPECT_TRUE(flight.out.accepted);
  EXPECT_EQ(flight.out.supervisor.mode, Mode::tracking);
  EXPECT_EQ(flight.out.command.p_W, flight.segment.stops[11].commands[4].p_W);
  for (std::size_t k = 115; k < 140; ++k) EXPECT_EQ(flight.step().command.p_W, on.commands[k].p_W) << k;
}

TEST(FlightTick, WhileItBrakesASegmentThatDoesNotKnowOfTheStopIsRefused) {
  for (const std::size_t branch : {std::size_t{105}, std::size_t{111}, std::size_t{120}}) {
    Flight flight;
    AcceptedSegment unaware = flight.segment;  // its commands go on at full speed
    unaware.id = 99;
    unaware.continues = flight.segment.id;
    unaware.branch = branch;
    flight.in.surroundings.tube_blocked = true;
    flight.step();
    flight.in.surroundings.tube_blocked = false;
    flight.in.segment = &unaware;
    flight.step();
    EXPECT_TRUE(flight.out.refused) << branch;
    EXPECT_EQ(flight.out.supervisor.mode, Mode::hold);
    EXPECT_TRUE(flight.tracker().braking());
  }
}

TEST(FlightTick, AnOperatorsStopWinsOverAFlightThatWouldGoOn) {
  for (const int late : {0, 1, 3}) {  // ticks from the stop to the segment
    Flight flight;
    const auto on = around(flight);
    flight.in.surroundings.tube_blocked = true;
    flight.step();
    flight.in.surroundings.tube_blocked = false;
    for (int n = 0; n < 3; ++n) flight.step();
    flight.in.request = Request::stop;
    if (late == 0) flight.in.segment = &on;
    flight.step();
    for (int n = 1; n <= late; ++n) {
      if (n == late) flight.in.segment = &on;
      flight.step();
      EXPECT_EQ(flight.out.refused, n == late);
    }
    for (int n = 0; n < 300; ++n) flight.step();
    EXPECT_EQ(flight.out.supervisor.mode, Mode::hold) << late;
    EXPECT_EQ(flight.out.supervisor.reason, Reason::stop_requested);
    EXPECT_EQ(flight.out.command.v_W, Vec3::Zero());
  }
}

// Which plans and orders a tick takes, what it arms and disarms, and what it gives back.

// Row 39.
TEST(FlightTick, ASegmentOfAnotherEpochIsRefusedInEveryMode) {
  for (const Epoch wrong : {Epoch{1, 0}, Epoch{0, 1}, Epoch{0, static_cast<std::uint64_t>(-1)}}) {
    Flight flight;
    AcceptedSegment on = flight.segment;
    on.id = 99;
    on.continues = flight.segment.id;
    on.branch = 130;
    flight.in.segment = &on;
    on.epoch = {flight.epoch().order + wrong.order, flight.epoch().lapse + wrong.lapse};
    flight.step();
    EXPECT_TRUE(flight.out.refused);
    on.epoch = flight.epoch();
    flight.in.segment = &on;
    flight.step();
    EXPECT_TRUE(flight.out.accepted);
  }
}

TEST(FlightTick, EveryHoldButTheOneForAnObstacleEndsWhatWasPlanned) {
  Flight flight;
  const Epoch before = flight.epoch();
  flight.in.surroundings.tube_blocked = true;
  flight.step();
  EXPECT_EQ(flight.out.supervisor.reason, Reason::obstacle_ahead);
  EXPECT_EQ(flight.epoch(), before);
  flight.in.surroundings.tube_blocked = false;
  flight.in.request = Request::stop;
  flight.in.order = 5;
  flight.step();
  EXPECT_EQ(flight.epoch(), (Epoch{5, before.lapse + 1}));
  Flight late;
  late.in.surroundings.late = true;
  late.step();
  EXPECT_EQ(late.out.supervisor.mode, Mode::hold);
  EXPECT_EQ(late.epoch().lapse, before.lapse + 1);
}

// Row 54: the stop is the verified one, and only a later command flies on.
TEST(FlightTick, InAirThatIsRougherThanItWasVerifiedInItComesToRestOnTheNextVerifiedStop) {
  Flight flight;
  const Epoch before = flight.epoch();
  const auto* stop = flight.tracker().next_stop();
  ASSERT_TRUE(stop);
  const Vec3 end = stop->commands.back().p_W;
  flight.in.surroundings.rougher = true;
  flight.step();
  EXPECT_EQ(flight.out.supervisor.mode, Mode::hold);
  EXPECT_EQ(flight.out.supervisor.reason, Reason::air_rougher);
  EXPECT_TRUE(flight.tracker().braking());
  EXPECT_EQ(flight.epoch().lapse, before.lapse + 1);
  flight.in.surroundings.rougher = false;
  for (int n = 0; n < 300; ++n) flight.step();
  EXPECT_EQ(flight.out.supervisor.mode, Mode::hold);
  EXPECT_EQ(flight.out.supervisor.reason, Reason::air_rougher);
  EXPECT_LT((flight.out.command.p_W - end).norm(), 1e-9);
}

// Row 40: the motors start in the tick that accepts a take-off, and on the ground a stop stops them.
TEST(FlightTick, ArmsInTheTickThatAcceptsATakeoffAloneAndDisarmsOnTheGroundAloneAfterAStop) {
  for (const bool arms : {true, false}) {
    for (const bool stands : {true, false}) {
      Flight flight;
      flight.in.autopilot.armed = false;
      flight.in.autopilot.landed = true;
      flight.step();  // disarmed: passive
      flight.step();  // the vehicle was put elsewhere: its pose is believed again from the next tick on
      flight.in.request = Request::enable;
      flight.step();
      flight.step();
      ASSERT_EQ(flight.out.supervisor.mode, Mode::tracking);
      AcceptedSegment up = flight.segment;
      up.epoch = flight.epoch();
      up.arms = arms;
      const Vec3 from = flight.out.command.p_W - up.commands[0].p_W;
      for (auto& command : up.commands) command.p_W += from;
      up.tube = tube_of(up.commands);
      flight.in.segment = &up;
      flight.step();
      ASSERT_TRUE(flight.out.accepted);
      EXPECT_EQ(flight.out.arm, arms);
      for (int n = 0; n < 20; ++n) EXPECT_FALSE(flight.step().arm);
      flight.in.autopilot.armed = true;
      flight.in.autopilot.landed = stands;
      flight.in.request = Request::stop;
      int disarmed = flight.step().disarm;
      // No hold is verified below the lowest hover height: what rises comes down again.
      EXPECT_EQ(flight.out.supervisor.mode, arms ? Mode::land : Mode::hold) << to_string(flight.out.supervisor.reason);
      for (int n = 0; n < 200; ++n) disarmed += flight.step().disarm;
      EXPECT_EQ(disarmed > 0, stands && arms) << "what flies a segment does not stand, whatever it says";
      EXPECT_LE(disarmed, 7);
    }
  }
}

/// Seen to stand disarmed, and passive.
void stand(Flight& flight) {
  flight.in.autopilot.armed = flight.in.autopilot.offboard = false;
  flight.in.autopilot.landed = true;
  for (int n = 0; n < 3; ++n) flight.step();
  ASSERT_EQ(flight.out.supervisor.mode, Mode::passive);
}

// Row 25: whoever armed it beside us.
TEST(FlightTick, AStopDisarmsNoVehicleThatAPilotArmedOnTheGround) {
  for (const bool enabling : {false, true}) {
    Flight flight;
    stand(flight);
    flight.in.autopilot.armed = true;
    flight.step();
    if (enabling) {
      flight.in.request = Request::enable;
      flight.step();
      ASSERT_EQ(flight.out.supervisor.mode, Mode::enabling);
    }
    flight.in.request = Request::stop;
    EXPECT_FALSE(flight.step().disarm);
    for (int n = 0; n < 200; ++n) EXPECT_FALSE(flight.step().disarm) << n;
    EXPECT_EQ(flight.out.supervisor.mode, Mode::passive);
  }
}

TEST(FlightTick, AStoppedTakeoffIsNotDisarmedByUsOnceWeAreQuietOrAPilotHasIt) {
  for (const Mode end : {Mode::hold, Mode::passive, Mode::quiet}) {
    Flight flight;
    stand(flight);
    flight.in.request = Request::enable;
    flight.step();
    flight.in.autopilot.offboard = flight.in.autopilot.armed = true;
    flight.step();
    flight.in.request = Request::stop;
    flight.step();
    ASSERT_EQ(flight.out.supervisor.mode, Mode::hold);
    if (end == Mode::passive) flight.in.autopilot.offboard = false;
    if (end == Mode::quiet) flight.in.autopilot.port_open = false;
    int asked = 0;
    for (int n = 0; n < 200; ++n) asked += flight.step().disarm;
    EXPECT_EQ(asked > 0, end == Mode::hold);
    EXPECT_EQ(flight.out.supervisor.mode, end);
  }
}

// Rows 9, 10 and 13, as far as the tick decides them.
TEST(FlightTick, HoldsOutsideTheMapAndOnALateMapAndDoesNotEnableWithoutOne) {
  for (const bool outside : {true, false}) {
    Flight flight;
    (outside ? flight.in.surroundings.outside : flight.in.surroundings.late) = true;
    flight.step();
    EXPECT_EQ(flight.out.supervisor.mode, Mode::hold);
    EXPECT_EQ(flight.out.supervisor.reason, outside ? Reason::outside_map : Reason::map_late);
  }
  FlightTick tick(vehicle(), 0);
  TickInput in;
  in.autopilot.heartbeat_age = 0;
  in.autopilot.pose = AutopilotFacts::Pose{};
  in.odometry = OdometrySample{};
  in.request = Request::enable;
  in.surroundings.missing = true;
  EXPECT_EQ(tick.step(in).supervisor.mode, Mode::passive);
  EXPECT_EQ(tick.step(in).supervisor.reason, Reason::map_missing);
  in.surroundings = {};
  in.odometry->received_ns = in.odometry->stamp_ns = in.now_ns = 20'000'000;
  EXPECT_EQ(tick.step(in).supervisor.mode, Mode::enabling);
}

TEST(FlightTick, GivesEverySegmentBackExactlyOnce) {
  Flight flight;
  const AcceptedSegment elsewhere = [&flight] {
    auto s = straight();
    s.id = 2;
    s.epoch = flight.epoch();
    for (auto& set : s.tube) set.center.p_W.y() += 5;
    return s;
  }();
  flight.in.segment = &elsewhere;
  flight.step();
  EXPECT_TRUE(flight.out.refused);
  EXPECT_EQ(flight.out.released[0], &elsewhere);
  EXPECT_EQ(flight.out.released[1], nullptr);
  flight.in.autopilot.offboard = false;
  flight.step();
  EXPECT_EQ(flight.out.supervisor.mode, Mode::passive);
  EXPECT_EQ(flight.out.released[0], &flight.segment);
  EXPECT_EQ(flight.tracker().segment(), 0u);
}

}  // namespace
}  // namespace backwash::track::test
