// SPDX-License-Identifier: BSD-3-Clause
// What a station may ask of a vehicle that lifts off: to end it, and nothing that would fly it on.
#include "tests/daemon/plan/mission_rig.hpp"

namespace backwash::daemon::test {
namespace {

TEST_F(MissionTest, WhileItLiftsOffLandAndStopAreTakenAndEveryFlightIsRefused) {
  view_.mode = Mode::lifting;
  for (const std::uint8_t verb : {kTakeoff, kGoto, kHold, kEnable}) {
    look();
    const Decision refused = mission_.handle(gcs_.next(verb), now_s_);
    ASSERT_TRUE(refused.answer);
    EXPECT_EQ(refused.answer->result, kRefused) << int{verb};
    EXPECT_FALSE(refused.order || refused.job) << int{verb};
  }
  for (const auto& [verb, request] : {std::pair{kLand, Request::land}, std::pair{kStop, Request::stop}}) {
    const Decision taken = mission_.handle(gcs_.next(verb), now_s_);
    ASSERT_TRUE(taken.answer && taken.order) << int{verb};
    EXPECT_EQ(taken.answer->result, kAccepted) << int{verb};
    EXPECT_EQ(taken.order->request, request);
  }
}

// The line may have lost both commands, and the autopilot hovers: nobody else asks again.
TEST_F(MissionTest, WhileItLandsAnotherLandAndStopReachTheControlThread) {
  view_.mode = Mode::land;
  look();
  const Decision land = give(gcs_.next(kLand));
  ASSERT_TRUE(land.order) << land.answer->reason;
  EXPECT_EQ(land.order->request, Request::land);
  EXPECT_EQ(result(land), kAccepted);
  look();
  const Decision stop = give(other_.next(kStop));
  ASSERT_TRUE(stop.order);
  EXPECT_EQ(stop.order->request, Request::stop);
}

}  // namespace
}  // namespace backwash::daemon::test
