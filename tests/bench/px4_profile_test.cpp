// SPDX-License-Identifier: BSD-3-Clause
// The bench's profile of PX4 against the real autopilot: the same script, the same figures.
#include <gmock/gmock.h>

#include "tests/bench/figures.hpp"

namespace backwash::autopilots {
namespace {

constexpr double kLand = 100925440, kOffboard = 393216;  // PX4's custom modes

/// The recordings' settings (tests/autopilots/px4.params).
Pair px4(const std::string& script, const std::string& trace, std::map<std::string, double> parameters = {}) {
  parameters.try_emplace("COM_OBL_RC_ACT", 4);
  return {recorded("px4-" + trace), played(Kind::px4, "px4-" + script, parameters)};
}
Pair px4(const std::string& script) { return px4(script, script); }

TEST(Px4Profile, LandsBlindlyForASecondAfterAPauseAndGoesOn) {
  const Pair p = px4("sigstop");
  // A HEARTBEAT that was due at once may still say what it did before.
  const auto told = [](const Trace& t) {
    auto said = heartbeats(t, "signal cont");
    said.erase(said.begin(), std::ranges::find_if(said, [](auto& h) { return h.starts_with("HEARTBEAT 157"); }));
    return said;
  };
  EXPECT_EQ(told(p.own), told(p.real));
  const auto sunk = [](double after) {
    return [after](const Trace& t) -> std::optional<double> {
      const double back = t.note("signal cont").value();
      return t.truth(back, 2) - t.truth(back + after, 2);
    };
  };
  compare(p, "sunk 0.5 s after 3 s of standstill, m", 0.1, sunk(0.5));
  compare_share(p, "sunk 1.1 s after it, m", 0.25, sunk(1.1));
  compare(p, "higher again after it, s", 0.3, [](const Trace& t) -> std::optional<double> {
    const double back = t.note("signal cont").value();
    return since(t.crosses(2, t.truth(back, 2) - 0.45, back + 1), back);
  });
  compare_share(p, "gone in the 4 s after it, m", 0.25, moved("signal cont", 4));
}

TEST(Px4Profile, LandsWithoutSticks) {
  compare_failsafe(px4("rc", "rc", {{"COM_RC_IN_MODE", 1}, {"COM_RCL_EXCEPT", 0}, {"NAV_RCL_ACT", 3}}), "sticks off",
                   kLand, 4);
}
TEST(Px4Profile, LandsWithoutAGroundStation) {
  compare_failsafe(px4("gcs", "gcs", {{"NAV_DLL_ACT", 3}, {"COM_DL_LOSS_T", 5}}), "station off", kLand, 11);
}
TEST(Px4Profile, LandsWithAnEmptyBattery) {
  compare_failsafe(px4("battery", "battery", {{"COM_LOW_BAT_ACT", 2}, {"CBRK_SUPPLY_CHK", 0}}), "set SIM_BAT_DRAIN 1",
                   kLand, 6);
}

TEST(Px4Profile, SaysInAirBeforeItLifts) {
  const Pair p = px4("flight");
  compare(p, "landed state 2 after arming, s", 0.3, after_arming("EXTENDED_SYS_STATE", 2));
  for (const double h : {0.005, 0.1, 0.5}) compare(p, ("height " + std::to_string(h) + " m, s").c_str(), 0.3, rise(h));
  compare(p, "height 1 m, s", 0.7, rise(1.0));
}
TEST(Px4Profile, FollowsStepsAndMovements) { compare_steps(px4("flight"), 0.37, 0.10); }
TEST(Px4Profile, Lands) { compare_landing(px4("flight"), 0.02); }
TEST(Px4Profile, DriftsWithoutOdometryLandsAndTakesOffAgainByItself) {
  const Pair p = px4("vio");
  const auto back = [](const Trace& t) { return t.note("odometry on", t.note("odometry off").value()); };
  compare(p, "estimate moved 3 s without ODOMETRY, m", 0.15, estimate_wrong("odometry off", 3));
  compare(p, "estimate moved 4.5 s without ODOMETRY, m", 0.25, estimate_wrong("odometry off", 4.5));
  compare(p, "descends after ODOMETRY stopped, s", 0.4, descends_after("odometry off"));
  compare(p, "AUTO.LAND in HEARTBEAT, s", 1.0, heartbeat_after("odometry off", kLand));
  compare(p, "offboard again after ODOMETRY came back, s", 1.0, [&](const Trace& t) {
    return since(t.at("in", "HEARTBEAT", {145, kOffboard}, back(t).value()), back(t));
  });
  compare(p, "in air again after it came back, s", 0.7,
          [&](const Trace& t) { return since(t.at("in", "EXTENDED_SYS_STATE", {2}, back(t).value()), back(t)); });
  compare(p, "5 cm up again after it came back, s", 0.7, [&](const Trace& t) {
    const double least = t.truth(back(t).value(), 2);
    return since(t.crosses(2, least + 0.05, back(t).value()), back(t));
  });
  EXPECT_EQ(heartbeats(p.own, "odometry off"), heartbeats(p.real, "odometry off"));
}

TEST(Px4Profile, AnswersTwiceAndTakesNoPilotsModeInTheAir) {
  const Pair p = px4("modes");
  EXPECT_EQ(heartbeats(p.own, "command 176 1 3"), heartbeats(p.real, "command 176 1 3"));
  EXPECT_EQ(acks(p.own, "command 176 1 3"), acks(p.real, "command 176 1 3"));
  compare(p, "AUTO.LAND in HEARTBEAT, s", 1.0, heartbeat_after("command 176 1 4 6", kLand));
  compare(p, "AUTO.LAND in EXTENDED_SYS_STATE, s", 0.25, [](const Trace& t) {
    const double begun = t.note("command 176 1 4 6").value();
    return since(t.at("in", "EXTENDED_SYS_STATE", {4}, begun), begun);
  });
}

TEST(Px4Profile, TakesEveryModeOnTheGroundAndDisarmsWhenNotRaised) {
  const Pair p = px4("refused");
  EXPECT_EQ(heartbeats(p.own, "command 176 1 6"), heartbeats(p.real, "command 176 1 6"));
  EXPECT_EQ(acks(p.own, "command 176 1 6"), acks(p.real, "command 176 1 6"));
  compare(p, "disarmed again, told after, s", 1.0, [](const Trace& t) {
    const double on = t.at("in", "HEARTBEAT", {145}).value();
    return since(t.at("in", "HEARTBEAT", {17}, on), t.armed());
  });
  compare(
      p, "height reached with the set-point below the ground, m", 0.001,
      [](const Trace& t) -> std::optional<double> { return t.most(0, 25, [&](double s) { return t.truth(s, 2); }); });
}

TEST(Px4Profile, AnswersParametersByTheirBytesAndUnknownOnesNot) {
  const Pair p = px4("flight");
  EXPECT_EQ(asked_values(p.own), asked_values(p.real));
  EXPECT_EQ(p.own.said("note", "waited in vain"), p.real.said("note", "waited in vain"));
}

TEST(Px4Profile, RunsOutWithItsTimeoutOf1s) { compare_run_out(px4("loss", "loss1")); }
TEST(Px4Profile, RunsOutWithATimeoutOf03s) { compare_run_out(px4("loss", "loss0.3", {{"COM_OF_LOSS_T", 0.3}})); }
// It is allowed by enable as a hold, and lands: there is no global position.
TEST(Px4Profile, RunsOutAndLandsWhereItShallHold) {
  const Pair p = px4("loss", "loss0.3hold", {{"COM_OF_LOSS_T", 0.3}, {"COM_OBL_RC_ACT", 5}});
  compare_run_out(p);
  compare(p, "AUTO.LAND in HEARTBEAT, s", 1.0, heartbeat_after("stream off", kLand));
  compare(p, "descends, s", 0.5, descends_after("stream off"));
}
TEST(Px4Profile, RunsOutAndSinksInPositionMode) {
  compare_run_out(px4("loss", "loss0.3pos", {{"COM_OF_LOSS_T", 0.3}, {"COM_OBL_RC_ACT", 0}}));
}

}  // namespace
}  // namespace backwash::autopilots
