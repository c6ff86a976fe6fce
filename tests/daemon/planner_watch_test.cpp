// SPDX-License-Identifier: BSD-3-Clause
// What the planner does about a flight under way: in a new world, after a loop closure, when it is to brake.
#include <fstream>

#include "core/plan/stop.hpp"
#include "tests/daemon/planner_rig.hpp"

namespace backwash::daemon::test {
namespace {

class PlannerWatch : public PlannerOffers {
 protected:
  /// Flies along the room and has come past x, at speed.
  void fly_past(double x, const AirFactors& air = kModelledAir) {
    know(room());
    stand({1.05, 2.05, 1.05});
    if (air != kModelledAir) learn(air);
    ASSERT_EQ(ask(PlanJob::Kind::go_to, {5.05, 2.05, 1.05}), "");
    const auto& commands = offers_.at(0).commands;
    while (view_.index < commands.size() && commands[view_.index].p_W.x() < x) ++view_.index;
    ASSERT_GT(commands.at(view_.index).v_W.x(), 0.5);
    view_.command = commands[view_.index];
    view_.state = offers_[0].tube[view_.index].center;
    view_.finished = false;
    show();
    EXPECT_FALSE(planner_.step());
    EXPECT_EQ(offers_.size(), 1u) << "as long as nothing is new the flight goes on as it is";
  }
  /// The room with a wall across it at x, and a gap in it beside the straight way.
  static OccupancyGrid walled(double x, bool gap) {
    OccupancyGrid grid = room();
    const int i = static_cast<int>(x / 0.1);
    fill(grid, {i, gap ? 15 : 0, 1}, {i, 39, 19});
    return grid;
  }
  bool blocked() const { return channels_->blocked_segment != 0; }
  bool rough() const { return channels_->rough_segment != 0; }
  /// The same map, in air that is rougher by these factors.
  void learn(const AirFactors& factors) {
    world_ = plan::with_air(*world_, factors, Model{});
    channels_->worlds.offer({world_, kSeen_ns + 1});
    view_.air.emplace().factors = factors;
    view_.air->ln_evidence.fill(7.25);
    show();
  }
  std::string recorded() {
    recorder_.drain(*channels_);
    std::ifstream file(log_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
};

TEST_F(PlannerWatch, ATakeoffIsBlockedByWhatComesToStandInItsWayAndByNothingElse) {
  know(room());
  stand({3.05, 2.05, 0.3});
  ASSERT_EQ(ask(PlanJob::Kind::takeoff, {0, 0, 1.2}), "");
  view_.finished = false;
  show();
  OccupancyGrid grid = room();
  fill(grid, {50, 5, 1}, {52, 7, 19});
  know(grid);
  planner_.step();
  EXPECT_FALSE(blocked());
  fill(grid, {31, 19, 9}, {33, 21, 10});
  know(grid);
  planner_.step();
  EXPECT_EQ(channels_->blocked_segment, view_.segment);
}

TEST_F(PlannerWatch, AFlightGoesOnRoundAnObstacleWithVerifiedStops) {
  fly_past(1.4);
  know(walled(3.8, true));
  planner_.step();
  ASSERT_EQ(offers_.size(), 2u);
  const auto& s = offers_[1];
  EXPECT_FALSE(blocked());
  EXPECT_LT((s.commands.back().p_W - Vec3(5.05, 2.05, 1.05)).norm(), 1e-6);
  EXPECT_GT(s.clearance, 0);
  EXPECT_GT(s.stops.size(), 3u);
  for (const plan::Stop& stop : s.stops) EXPECT_GT(plan::tube_clearance(*world_, stop.tube), 0) << stop.branch;
}

TEST_F(PlannerWatch, AFlightWithoutAClearWayOnIsBlocked) {
  fly_past(2.5);
  know(walled(view_.state.p_W.x() + 0.6, false));
  planner_.step();
  EXPECT_EQ(channels_->blocked_segment, view_.segment);
  EXPECT_EQ(offers_.size(), 1u);
}

// Row 54.
TEST_F(PlannerWatch, AFlightThatIsClearInRougherAirGoesOnAndKeepsItsSets) {
  fly_past(1.4);
  const auto sets = offers_[0].tube;
  learn({1.2, 1.2, 1.2, 1.2, 1});
  planner_.step();
  EXPECT_FALSE(blocked());
  EXPECT_FALSE(rough());
  EXPECT_EQ(offers_.size(), 1u) << "what was accepted is judged by the sets that it was accepted with";
}

TEST_F(PlannerWatch, AFlightThatIsNotClearInRougherAirIsStoppedForTheAirAndSaysWhich) {
  fly_past(2.5);
  learn({1, 100, 1, 1, 1});
  planner_.step();
  EXPECT_FALSE(blocked());
  EXPECT_EQ(channels_->rough_segment, view_.segment);
  const std::string log = recorded();
  EXPECT_NE(log.find("ground 100.00 times the model's variance, ln evidence 7.2"), std::string::npos);
  EXPECT_EQ(log.find("free_air 1"), std::string::npos) << "a class that is as modelled is not named";
}

TEST_F(PlannerWatch, AFlightThatBeganInCalmerAirGetsStopsOfTheAirThatThereIs) {
  fly_past(1.4, {0.3, 0.3, 0.3, 0.3, 1});
  learn(kModelledAir);
  planner_.step();
  ASSERT_EQ(offers_.size(), 2u);
  const auto &before = offers_[0], &after = offers_[1];
  EXPECT_EQ(after.continues, before.id);
  ASSERT_EQ(after.commands.size(), before.commands.size());
  for (std::size_t k = 0; k < after.commands.size(); ++k) ASSERT_EQ(after.commands[k].p_W, before.commands[k].p_W);
  ASSERT_FALSE(after.stops.empty());
  for (const plan::Stop& stop : after.stops) EXPECT_GT(plan::tube_clearance(*world_, stop.tube), 0) << stop.branch;
  EXPECT_GT(after.stops.back().tube.back().half_widths[0], 1.5 * before.stops.back().tube.back().half_widths[0]);
  planner_.step();
  EXPECT_EQ(offers_.size(), 2u) << "once";
}

TEST_F(PlannerWatch, StopsOfCalmerAirAreLookedAtUntilTheyAreRenewed) {
  fly_past(1.4, {0.3, 0.3, 0.3, 0.3, 1});
  learn(kModelledAir);
  answer_ = [](const auto&) {};  // it was past the branch
  planner_.step();
  ASSERT_EQ(offers_.size(), 2u);
  answer_ = [this](const auto& s) { view_.segment = s.id; };
  planner_.step();
  EXPECT_EQ(offers_.size(), 3u);
}

// The map worker may be at another map for minutes.
TEST_F(PlannerWatch, NothingNewIsFlownBySetsOfCalmerAirThanIsKnownYet) {
  know(room());
  stand({1.05, 2.05, 1.05});
  learn({0.3, 0.3, 0.3, 0.3, 1});
  view_.air->factors[1] = 1;
  show();
  EXPECT_NE(ask(PlanJob::Kind::go_to, {5.05, 2.05, 1.05}).find("being made anew"), std::string::npos);
  EXPECT_TRUE(offers_.empty());
  int pauses = 0;
  meanwhile_ = [&] {
    if (++pauses == 5) learn({0.3, 1, 0.3, 0.3, 1});
  };
  EXPECT_EQ(ask(PlanJob::Kind::go_to, {5.05, 2.05, 1.05}), "") << "the world comes";
  EXPECT_EQ(offers_.size(), 1u);
}

TEST_F(PlannerWatch, AnObstacleInAirThatWasRoughBeforeIsAnObstacle) {
  fly_past(1.4);
  learn({1.2, 1.2, 1.2, 1.2, 1});
  planner_.step();
  world_ = plan::with_air(*world_of(walled(view_.state.p_W.x() + 0.6, false)), {1.2, 1.2, 1.2, 1.2, 1}, Model{});
  channels_->worlds.offer({world_, kSeen_ns + 2});
  planner_.step();
  EXPECT_FALSE(rough());
  EXPECT_EQ(channels_->blocked_segment, view_.segment);
}

TEST_F(PlannerWatch, AFlightThatWasStoppedIsNotExtended) {
  fly_past(1.4);
  view_.mode = Mode::hold;
  view_.reason = Reason::operator_request;
  view_.braking = true;
  show();
  know(walled(3.8, true));
  planner_.step();
  EXPECT_EQ(offers_.size(), 1u);
}

TEST_F(PlannerWatch, AfterALoopClosureTheFlightGoesBackToItsPlaceInTheMapIfThatIsClear) {
  for (const double sideways : {0.1, -1.85}) {  // within the room, and against its side
    offers_.clear();
    view_ = {};
    channels_->blocked_segment = 0;
    fly_past(1.8);
    view_.closures = 1;
    view_.shift.t = {0, sideways, 0};
    show();
    planner_.step();
    const bool clear = sideways > 0;
    EXPECT_EQ(blocked(), !clear);
    ASSERT_EQ(offers_.size(), clear ? 2u : 1u);
    if (!clear) continue;
    EXPECT_EQ(offers_[1].closures, 1u);
    EXPECT_LT((offers_[1].commands.back().p_W - Vec3(5.05, 2.05, 1.05)).norm(), 1e-6);
  }
}

TEST_F(PlannerWatch, AfterALoopClosureAFlightThatWasToldToHoldStaysWhereItIs) {
  for (const bool at_rest : {false, true}) {
    offers_.clear();
    view_ = {};
    channels_->blocked_segment = 0;
    fly_past(1.8);
    if (at_rest) {
      view_.index = offers_.back().commands.size();
      view_.finished = true;
      show();
    }
    EXPECT_EQ(ask(PlanJob::Kind::brake, Vec3::Zero()), "");
    const std::vector<Setpoint> flown = offers_.back().commands;
    for (const std::uint32_t closures : {1u, 2u}) {
      view_.closures = closures;
      view_.shift.t = {0, 0.1, 0};
      show();
      planner_.step();
      EXPECT_FALSE(blocked());
      ASSERT_EQ(offers_.back().closures, closures);
      ASSERT_EQ(offers_.back().commands.size(), flown.size());
      for (std::size_t k = 0; k < flown.size(); k += 10)
        EXPECT_LT((offers_.back().commands[k].p_W - flown[k].p_W - Vec3(0, 0.1 * closures, 0)).norm(), 1e-9) << k;
    }
  }
}

// A narrow gap, passed 8 cm beside its middle: a set that rests there grows into its side, one that passes does not.
TEST_F(PlannerWatch, AHoldInANarrowGapIsARestBehindIt) {
  constexpr double kGap = 3.0;  // m, along x
  OccupancyGrid grid = room();
  fill(grid, {29, 0, 1}, {30, 15, 19}), fill(grid, {29, 24, 1}, {30, 39, 19});
  know(grid);
  stand({1.05, 2.13, 1.05});
  ASSERT_EQ(ask(PlanJob::Kind::go_to, {5.05, 2.13, 1.05}), "");
  const track::AcceptedSegment flown = offers_.at(0);
  view_.index = 70;
  view_.command = flown.commands[view_.index];
  view_.state = flown.tube[view_.index].center;
  view_.finished = false;
  show();
  const auto at_once = plan::stop_along(flown.commands, view_.index + 15, world_->reach.vehicle.limits.a_max);
  ASSERT_LE(plan::tube_clearance(*world_, reach::tube_over_field(world_->reach, {flown.commands[0].p_W, Vec3::Zero()},
                                                                 flown.commands[0], at_once, world_->bounds)),
            0);

  EXPECT_EQ(ask(PlanJob::Kind::brake, Vec3::Zero()), "");
  ASSERT_EQ(offers_.size(), 2u);
  const auto& held = offers_[1];
  EXPECT_EQ(held.continues, flown.id);
  EXPECT_GT(held.clearance, 0);
  EXPECT_GT(held.commands.back().p_W.x(), kGap);
  EXPECT_LT(held.commands.back().p_W.x(), 5.0) << "it does not fly on to its goal";
  EXPECT_TRUE(held.commands.back().v_W.isZero());
  EXPECT_FALSE(held.stops.empty()) << "on the way there it can still be stopped";
}

TEST_F(PlannerWatch, BrakingThatWouldTouchIsNotOffered) {
  fly_past(2.5);
  know(walled(view_.state.p_W.x() + 0.6, false));
  EXPECT_NE(ask(PlanJob::Kind::brake, Vec3::Zero()).find("not clear"), std::string::npos);
  EXPECT_EQ(offers_.size(), 1u);
}

}  // namespace
}  // namespace backwash::daemon::test
