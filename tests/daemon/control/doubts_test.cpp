// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/control/doubts.hpp"

#include <gtest/gtest.h>

#include "firmware_bridge/line_budget.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
namespace {

std::string all(const ControlView& view) {
  std::string text;
  for (const auto& [what, doubt] : doubts_of(view, vehicle_5in())) text += std::string(what) + ": " + doubt + "\n";
  return text;
}

TEST(Doubts, AreOnlyOfWhatIsKnown) { EXPECT_EQ(all({}), ""); }

TEST(Doubts, OfALineBeginWhereHalfOfOdometryIsLostAndNameBothShares) {
  ControlView view;
  view.loss = {{0.02, 0.08, 0.49}};
  EXPECT_EQ(all(view), "");
  view.loss = {{0.02, 0.081, 0.51}};
  const std::string text = all(view);
  EXPECT_NE(text.find("2.0 % of the autopilot's frames, 8.1 % of our short ones and so 51 % of ODOMETRY"),
            std::string::npos)
      << text;
}

TEST(Doubts, OfALineBeginWhereItTakesLongerThanTheSetsAllow) {
  ControlView view;
  const double allowed = firmware_bridge::line_allowed(vehicle_5in(), 0);
  view.round_trip = allowed;
  EXPECT_EQ(all(view), "");
  view.round_trip = allowed + 0.001;
  EXPECT_EQ(all(view).rfind("line: ", 0), 0U) << all(view);
}

TEST(Doubts, OfTheEstimatorAndOfArmingAreTheAutopilotsOwn) {
  ControlView view;
  view.estimator_follows = true;
  view.would_arm = false;
  EXPECT_EQ(all(view), "") << "it is not asked to arm in this mode";
  view.offboard = true;
  view.estimator_follows = false;
  EXPECT_EQ(all(view).rfind("estimator: ", 0), 0U);
  EXPECT_NE(all(view).find("\narming: "), std::string::npos);
  view.armed = true;
  EXPECT_EQ(all(view).find("arming: "), std::string::npos) << "it is armed";
}

}  // namespace
}  // namespace backwash::daemon::test
