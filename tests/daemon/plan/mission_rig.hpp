// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include "services/backwashd/plan/mission.hpp"
#include "services/dds/topics.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {
using track::Request;

inline constexpr std::uint8_t kAccepted = backwash_msgs_msg_dds__ACK_ACCEPTED,
                              kRefused = backwash_msgs_msg_dds__ACK_REFUSED,
                              kNotYours = backwash_msgs_msg_dds__ACK_NOT_YOURS,
                              kInvalid = backwash_msgs_msg_dds__ACK_INVALID;
inline constexpr std::uint8_t kEnable = backwash_msgs_msg_dds__COMMAND_ENABLE,
                              kDisable = backwash_msgs_msg_dds__COMMAND_DISABLE,
                              kTakeoff = backwash_msgs_msg_dds__COMMAND_TAKEOFF,
                              kGoto = backwash_msgs_msg_dds__COMMAND_GOTO,
                              kFollow = backwash_msgs_msg_dds__COMMAND_FOLLOW,
                              kFollowFacing = backwash_msgs_msg_dds__COMMAND_FOLLOW_FACING,
                              kHold = backwash_msgs_msg_dds__COMMAND_HOLD, kStop = backwash_msgs_msg_dds__COMMAND_STOP,
                              kLand = backwash_msgs_msg_dds__COMMAND_LAND,
                              kRelease = backwash_msgs_msg_dds__COMMAND_RELEASE,
                              kAirReset = backwash_msgs_msg_dds__COMMAND_AIR_RESET,
                              kAirFreeze = backwash_msgs_msg_dds__COMMAND_AIR_FREEZE,
                              kAirThaw = backwash_msgs_msg_dds__COMMAND_AIR_THAW;

/// A process of a ground station.
struct Station {
  std::uint8_t writer;
  std::uint64_t session;
  const char* name = "gcs";
  std::uint32_t sequence = 0;

  CommandMessage next(std::uint8_t verb) { return at(++sequence, verb); }
  CommandMessage at(std::uint32_t number, std::uint8_t verb) const {
    CommandMessage c;
    c.writer[0] = writer;
    std::snprintf(c.station.data(), c.station.size(), "%s", name);
    c.session = session;
    c.sequence = number;
    c.verb = verb;
    c.position = {1, 0, 1.2};
    return c;
  }
};

/// A mission of a vehicle in the air; the test plays control thread, planner and ground stations.
class MissionTest : public testing::Test {
 protected:
  Mission mission_{Vehicle{}};
  ControlView view_;
  double now_s_ = 100;
  Station gcs_{1, 11}, other_{2, 22, "other"};

  /// In the air, at rest, tracking.
  void SetUp() override {
    view_.mode = Mode::tracking;
    view_.armed = view_.offboard = true;
    view_.landed = false;
    view_.odometry_age = view_.heartbeat_age = view_.pose_age = 0;
    view_.state.p_W = view_.command.p_W = {-2, 0, 1.2};
    MissionInput in;
    in.now_s = now_s_;
    in.view = view_;
    in.world = corridor();
    mission_.observe(in);
  }
  Decision look(std::span<const PlanOutcome> outcomes = {}) {
    MissionInput in;
    in.now_s = now_s_;
    in.view = view_;
    in.outcomes = outcomes;
    return mission_.observe(in);
  }
  Decision give(const CommandMessage& c) {
    Decision d = mission_.handle(c, now_s_);
    if (d.order) view_.epoch.order = d.order->number;  // the control thread takes it at once
    return d;
  }
  std::uint8_t result(const Decision& d) { return d.answer->result; }
};

}  // namespace backwash::daemon::test
