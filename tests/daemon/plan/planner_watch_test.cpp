// SPDX-License-Identifier: BSD-3-Clause
// What the planner does about a flight under way: in a new world, after a loop closure, when it is to brake. In rougher
// air: planner_air_test.cpp.
#include "core/plan/rest.hpp"
#include "core/plan/stop.hpp"
#include "tests/daemon/plan/planner_watch_rig.hpp"

namespace backwash::daemon::test {
namespace {

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

/// A flight along the room, planned before a wall with a narrow gap is seen, and passing beside the gap's middle: a set
/// that rests there grows into its side, one that passes does not. What is planned in view of the gap keeps room to
/// rest in it.
class GapSeenLate : public PlannerWatch {
 protected:
  static constexpr double kGap = 3.0;  // m, along x
  void plan_and_see(double y) {
    know(room());
    stand({1.05, y, 1.05});
    ASSERT_EQ(ask(PlanJob::Kind::go_to, {5.05, y, 1.05}), "");
    flown_ = offers_.at(0);
    OccupancyGrid grid = room();
    fill(grid, {29, 0, 1}, {30, 15, 19});
    fill(grid, {29, 24, 1}, {30, 39, 19});
    know(grid);
  }
  void come_to(std::size_t index) {
    view_.segment = flown_.id;
    view_.index = index;
    view_.command = flown_.commands[index];
    view_.state = flown_.tube[index].center;
    view_.finished = false;
    show();
  }
  /// Of the flight that stops from there on, m.
  double left(std::size_t branch, double a_max) const {
    auto commands = plan::stop_along(flown_.commands, branch, a_max);
    plan::hold_until_settled(world_->reach, commands);
    const auto tube = plan::tube_to_rest(*world_, {flown_.commands[0].p_W, Vec3::Zero()}, flown_.commands[0], commands);
    return plan::tube_clearance(*world_, tube);
  }
  double a_max() const { return world_->reach.vehicle.limits.a_max; }
  track::AcceptedSegment flown_;
};

TEST_F(GapSeenLate, AHoldInTheGapIsARestBehindIt) {
  plan_and_see(2.12);
  std::size_t last = 0;  // from which a stop at once rests where no set has room
  for (std::size_t k = 20; k + 40 < flown_.commands.size(); ++k)
    if (left(k + 15, a_max()) <= 0) last = k;
  ASSERT_GT(last, 0u);
  come_to(last);

  EXPECT_EQ(ask(PlanJob::Kind::brake, Vec3::Zero()), "");
  ASSERT_EQ(offers_.size(), 2u);
  const auto& held = offers_[1];
  EXPECT_EQ(held.continues, flown_.id);
  EXPECT_GT(held.clearance, 0);
  EXPECT_GT(held.commands.back().p_W.x(), kGap);
  EXPECT_LT(held.commands.back().p_W.x(), 5.0) << "it does not fly on to its goal";
  EXPECT_TRUE(held.commands.back().v_W.isZero());
  ASSERT_FALSE(held.stops.empty());
  EXPECT_LT(held.stops.front().branch, held.branch) << "on the way there it can still be stopped";
}

// A STOP after a HOLD: what slows down already has a stop ahead until it rests, and each comes to rest in the clear.
TEST_F(PlannerWatch, AFlightThatSlowsDownForAHoldHasAStopAheadUntilItRests) {
  fly_past(1.8);
  ASSERT_EQ(ask(PlanJob::Kind::brake, Vec3::Zero()), "");
  ASSERT_EQ(offers_.size(), 2u);
  const auto& held = offers_[1];
  std::size_t moving = 0;
  for (std::size_t k = view_.index; !held.commands.at(k).v_W.isZero(); ++k, ++moving) {
    const auto stop = std::ranges::find_if(held.stops, [&](const auto& s) { return s.branch >= k; });
    ASSERT_NE(stop, held.stops.end()) << k;
    EXPECT_LE(stop->branch, k + 10) << k;
    EXPECT_TRUE(stop->commands.back().v_W.isZero());
    EXPECT_LE(stop->commands.back().p_W.x(), held.commands.back().p_W.x() + 1e-9) << "no later than the hold";
    EXPECT_GT(plan::tube_clearance(*world_, stop->tube), 0);
    EXPECT_EQ(stop->tube.size(), stop->commands.size() + 1);
  }
  EXPECT_GT(moving, 30u);
}

// Past the gap at speed: a hold rests behind it, the harder stops rest in it and are not clear. Its own way is the
// stop.
TEST_F(GapSeenLate, WhereNoHarderStopIsClearAHoldsOwnWayIsTheStop) {
  plan_and_see(2.12);
  std::size_t tried = 0;
  for (std::size_t now = 20; now + 40 < flown_.commands.size(); ++now) {
    if (left(now + 15, a_max()) <= 0 || left(now + 10, 2 * a_max()) > 0 || left(now + 20, 2 * a_max()) > 0) continue;
    ++tried;
    come_to(now);
    ASSERT_EQ(ask(PlanJob::Kind::brake, Vec3::Zero()), "");
    ASSERT_EQ(offers_.size(), 2u);
    const auto stop = std::ranges::find_if(offers_[1].stops, [&](const auto& x) { return x.branch >= now + 15; });
    ASSERT_NE(stop, offers_[1].stops.end());
    EXPECT_EQ(stop->branch, now + 15);
    EXPECT_EQ(stop->commands.back().p_W, offers_[1].commands.back().p_W);
    break;
  }
  EXPECT_EQ(tried, 1u);
}

// A STOP in the last 0.2 s of a flight.
TEST_F(PlannerWatch, AFlightHasAStopAheadUntilItRests) {
  fly_past(1.8);
  const auto& flown = offers_.at(0);
  for (std::size_t k = view_.index; !flown.commands.at(k).v_W.isZero(); ++k) {
    const auto stop = std::ranges::find_if(flown.stops, [&](const auto& s) { return s.branch >= k; });
    ASSERT_NE(stop, flown.stops.end()) << k << " of " << flown.commands.size();
    EXPECT_GT(plan::tube_clearance(*world_, stop->tube), 0);
  }
}

TEST_F(PlannerWatch, BrakingThatWouldTouchIsNotOffered) {
  fly_past(2.5);
  know(walled(view_.state.p_W.x() + 0.6, false));
  EXPECT_NE(ask(PlanJob::Kind::brake, Vec3::Zero()).find("not clear"), std::string::npos);
  EXPECT_EQ(offers_.size(), 1u);
}

// What the planner does about a flight under way in air that has become rougher (docs/faults.md row 54).

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
  // No stop is clear in such air: the one that lacks least is flown, and that is said.
  ASSERT_EQ(offers_.size(), 2u);
  EXPECT_LE(offers_[1].clearance, 0);
  EXPECT_GT(offers_[1].branch, view_.index);
  ASSERT_FALSE(offers_[1].stops.empty()) << "without one it would not brake, but freeze";
  EXPECT_EQ(offers_[1].stops.back().branch, offers_[1].branch);
  EXPECT_NE(log.find("no stop is clear in it, the one flown lacks 0."), std::string::npos);
}

/// A gap that the sets of calmer air pass, and rest in, and the model's do not.
class CalmGap : public PlannerWatch {
 protected:
  void come_to(double x, double factor = 0.1) {
    OccupancyGrid grid = room();
    fill(grid, {35, 0, 1}, {42, 17, 19});
    fill(grid, {35, 23, 1}, {42, 39, 19});
    know(grid);
    stand({1.05, 2.05, 1.05});
    learn({factor, factor, factor, factor, 1});
    ASSERT_EQ(ask(PlanJob::Kind::go_to, {5.05, 2.05, 1.05}), "");
    go_on_to(x);
    planner_.step();
    ASSERT_EQ(offers_.size(), 1u);
  }
  void go_on_to(double x) {
    const track::AcceptedSegment& flown = offers_.back();
    while (flown.commands.at(view_.index).p_W.x() < x) ++view_.index;
    view_.command = flown.commands[view_.index];
    view_.state = flown.tube[view_.index].center;
    view_.finished = false;
    show();
  }
  /// Of the flight from now on that rests by this stop, in the newest world, m.
  double clearance_of(const track::AcceptedSegment& s, const plan::Stop& stop) {
    std::vector<Setpoint> commands(s.commands.begin(), s.commands.begin() + static_cast<std::ptrdiff_t>(stop.branch));
    commands.insert(commands.end(), stop.commands.begin(), stop.commands.end());
    return clearance_of(s, commands);
  }
  double clearance_of(const track::AcceptedSegment& s, const std::vector<Setpoint>& commands) {
    auto tube = reach::tube_over_field(world_->reach, s.tube[0].center, s.commands[0], commands, world_->bounds);
    tube.erase(tube.begin(), tube.begin() + static_cast<std::ptrdiff_t>(view_.index));
    return plan::tube_clearance(*world_, tube);
  }
  /// What the control thread brakes on if it is told to now.
  const plan::Stop* next_stop(const track::AcceptedSegment& s) const {
    const auto next = std::ranges::find_if(s.stops, [this](const auto& stop) { return stop.branch >= view_.index; });
    return next == s.stops.end() ? nullptr : &*next;
  }
};

TEST_F(CalmGap, AFlightOfCalmerAirThatIsNotClearInTheModelsRestsByAStopThatIs) {
  // At first its next stop is clear in the model's air too; then it lacks room there, and one in between has it.
  for (const auto& [x, air, next_is_clear] : {std::tuple(1.7, 0.1, true), std::tuple(2.24, 0.25, false)}) {
    offers_.clear();
    view_ = {};
    channels_->rough_segment = 0;
    come_to(x, air);
    const track::AcceptedSegment before = offers_.back();
    learn(kModelledAir);
    ASSERT_LE(clearance_of(before, before.commands), 0);
    ASSERT_EQ(clearance_of(before, *next_stop(before)) > 0, next_is_clear);
    planner_.step();
    EXPECT_EQ(channels_->rough_segment, view_.segment);
    EXPECT_EQ(view_.segment, offers_.back().id);
    const auto& after = offers_.back();
    ASSERT_NE(next_stop(after), nullptr);
    for (const plan::Stop& stop : after.stops)
      EXPECT_TRUE(stop.branch < view_.index || clearance_of(after, stop) > 0) << stop.branch;
    EXPECT_GT(after.clearance, 0);
    EXPECT_EQ(after.branch, view_.index + 5) << "the first that is";
  }
}

// Told to hold, it has no goal, and its stops are of calmer air.
TEST_F(CalmGap, AFlightThatWasToldToHoldInCalmerAirRestsEarlierInTheModels) {
  come_to(2.0);
  ASSERT_EQ(ask(PlanJob::Kind::brake, Vec3::Zero()), "");
  ASSERT_EQ(offers_.size(), 2u);
  learn(kModelledAir);
  ASSERT_LE(clearance_of(offers_[1], offers_[1].commands), 0);
  planner_.step();
  EXPECT_EQ(channels_->rough_segment, view_.segment);
  ASSERT_EQ(offers_.size(), 3u);
  EXPECT_GT(offers_[2].clearance, 0);
  ASSERT_NE(next_stop(offers_[2]), nullptr);
}

// It came too late: once more, from a little further on. If that is too late as well it brakes on what it has, and that
// is said.
TEST_F(CalmGap, AStopThatCameTooLateIsOfferedOnceMore) {
  come_to(1.7);
  learn(kModelledAir);
  answer_ = [](const auto&) {};
  planner_.step();
  EXPECT_EQ(offers_.size(), 3u);
  EXPECT_EQ(channels_->rough_segment, view_.segment);
  EXPECT_EQ(view_.segment, offers_[0].id);
  EXPECT_NE(recorded().find("its stops are those of calmer air"), std::string::npos);
}

// What the planner may not extend, because its world has sets that the air does not allow any more, it still watches.
TEST_F(PlannerWatch, AFlightIsStillVerifiedWhileItMayNotBeExtendedInCalmerAir) {
  fly_past(1.4, {0.3, 0.3, 0.3, 0.3, 1});
  view_.air->factors = kModelledAir;
  show();
  world_ = plan::rebuilt(*world_of(walled(3.8, true)), {.air = AirFactors{0.3, 0.3, 0.3, 0.3, 1}});
  channels_->worlds.offer({world_, kSeen_ns + 2});
  planner_.step();
  EXPECT_EQ(offers_.size(), 1u) << "nothing new";
  EXPECT_EQ(channels_->blocked_segment, view_.segment) << "and not what a wall is in the way of";
  // Braking for it, it is led around the wall as soon as there are sets that the air allows.
  view_.mode = Mode::hold;
  view_.reason = Reason::obstacle_ahead;
  view_.braking = true;
  view_.stop_branch = next_branch();
  show();
  planner_.step();
  EXPECT_EQ(offers_.size(), 1u);
  learn(kModelledAir);
  planner_.step();
  EXPECT_EQ(offers_.size(), 2u);
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

// A world that is rougher than the flight's and calmer than the air by now is no world to renew its stops in.
TEST_F(PlannerWatch, StopsAreNotRenewedInAWorldThatIsTooCalmItself) {
  fly_past(1.4, {0.3, 0.3, 0.3, 0.3, 1});
  view_.air->factors = kModelledAir;
  show();
  world_ = plan::rebuilt(*world_, {.air = AirFactors{0.5, 0.5, 0.5, 0.5, 1}});
  channels_->worlds.offer({world_, kSeen_ns + 1});
  planner_.step();
  EXPECT_EQ(offers_.size(), 1u);
  learn(kModelledAir);
  planner_.step();
  ASSERT_EQ(offers_.size(), 2u);
  EXPECT_EQ(offers_[1].air, kModelledAir);
}

// Nor is a new way begun by the sets of a world that is smoother than the air by now.
TEST_F(PlannerWatch, NothingNewIsFlownBySetsOfSmootherAirThanIsKnownYet) {
  know(room());
  stand({1.05, 2.05, 1.05});
  learn({1, 1.2, 1, 1, 1});
  view_.air->factors[1] = 1.25;
  show();
  EXPECT_EQ(ask(PlanJob::Kind::go_to, {5.05, 2.05, 1.05}), "") << "no world is made anew for so little";
  offers_.clear();
  view_.segment = 0;
  stand({1.05, 2.05, 1.05});
  view_.air->factors[1] = 1.5;
  show();
  EXPECT_NE(ask(PlanJob::Kind::go_to, {5.05, 2.05, 1.05}).find("being made anew"), std::string::npos);
  EXPECT_TRUE(offers_.empty());
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
  world_ =
      plan::rebuilt(*world_of(walled(view_.state.p_W.x() + 0.6, false)), {.air = AirFactors{1.2, 1.2, 1.2, 1.2, 1}});
  channels_->worlds.offer({world_, kSeen_ns + 2});
  planner_.step();
  EXPECT_FALSE(rough());
  EXPECT_EQ(channels_->blocked_segment, view_.segment);
}

// A stop that is chosen for the air is a way in the frame that the flight was planned in: after a loop closure it would
// move the vehicle by that at once.
TEST_F(CalmGap, NoStopIsOfferedInTheFrameOfBeforeALoopClosure) {
  for (const bool between : {false, true}) {  // the two offers, or before both, where the way back is not clear
    SCOPED_TRACE(between);
    offers_.clear();
    view_ = {};
    channels_->rough_segment = 0;
    come_to(1.7);
    view_.shift.t = {0, 0.1, 0};
    if (between)
      answer_ = [this](const auto& s) {
        view_.closures = 1;
        view_.refused_segment = s.id;
      };
    else
      view_.closures = 1;
    learn(kModelledAir);
    planner_.step();
    EXPECT_EQ(channels_->rough_segment, view_.segment) << "it is stopped all the same";
    EXPECT_EQ(offers_.size(), between ? 2u : 1u);
    for (const auto& s : offers_) EXPECT_EQ(s.closures, 0u);
    answer_ = [this](const auto& s) { view_.segment = s.id; };
  }
}

}  // namespace
}  // namespace backwash::daemon::test
