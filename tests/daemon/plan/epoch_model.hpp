// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "core/track/orders.hpp"
#include "services/backwashd/plan/mission.hpp"
#include "services/backwashd/plan/plan_front.hpp"
#include "services/dds/topics.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

/// The daemon's deciding parts and the events between them, for epoch_model_test.cpp to try in every order.
namespace backwash::daemon::test::epoch {

using track::AcceptedSegment;

inline constexpr std::uint8_t kGoto = backwash_msgs_msg_dds__COMMAND_GOTO, kStop = backwash_msgs_msg_dds__COMMAND_STOP,
                              kLand = backwash_msgs_msg_dds__COMMAND_LAND, kHold = backwash_msgs_msg_dds__COMMAND_HOLD,
                              kDisable = backwash_msgs_msg_dds__COMMAND_DISABLE,
                              kEnable = backwash_msgs_msg_dds__COMMAND_ENABLE,
                              kTakeoff = backwash_msgs_msg_dds__COMMAND_TAKEOFF;
inline const char* const kNames[] = {"go",      "END",  "enable", "job taken", "planned",
                                     "offered", "tick", "world",  "pilot",     "mission"};
enum Event {
  kGo,
  kEnd,
  kEnableAgain,
  kJobTaken,
  kPlanned,
  kOffered,
  kTick,
  kWorldChanges,
  kPilot,
  kMissionLooks,
  kEvents
};

inline constexpr std::size_t kLength = 12, kStopEvery = 2;  // commands
inline constexpr double kStep = 0.004;                      // m a command
// Ticks after which the motion must have ended: to the next stop's branch and along it; for a hold the whole segment.
inline constexpr int kRunOut = 10, kRunOutHold = 2 * kLength + 4;

inline Vehicle vehicle() {
  Vehicle v = vehicle_5in();
  v.initial_error = {0.1, 0.5};
  return v;
}

/// Where the search begins: enabled and at rest, then these events.
struct Start {
  const char* name;
  bool air;
  std::vector<int> events;
};

/// Everything that the threads hold; copied at each branch of the search.
struct Daemon {
  track::FlightTick tick{vehicle(), 0};
  track::Orders orders;
  Mission mission{vehicle()};
  PlanFront front;
  ControlView view;                      // as the control thread wrote it last
  bool unread = false;                   // by the mission
  std::vector<track::Order> sent;        // orders under way
  std::optional<PlanJob> job, planning;  // handed over, begun
  std::optional<PlanOutcome> outcome;
  std::shared_ptr<AcceptedSegment> ready, flown;  // stamped and not yet offered; accepted
  std::shared_ptr<AcceptedSegment> offered;
  std::vector<std::shared_ptr<AcceptedSegment>> alive;  // that the tick may look at
  track::TickInput in;
  track::TickOutput out;
  std::uint32_t sequence = 0;
  bool world_changed = false;
  int arming = 0;

  // What must hold.
  int since_end = -1;  // ticks since an acknowledged END that nothing later revoked; −1: none
  bool held = false;   // that END was a hold
  bool takeoff_asked = false;
  Vec3 before = Vec3::Zero();
};

class EpochModel : public testing::TestWithParam<std::uint8_t> {
 protected:
  Daemon start(const Start& from);
  bool apply(Daemon& d, int event);
  void tick(Daemon& d);
  bool command(Daemon& d, std::uint8_t verb);
  bool carry_out(Daemon& d, const Decision& decision);
  void plan(Daemon& d);
  void search(const Daemon& d, int depth);
  void settle(Daemon d);
  void fail(const std::string& what);

  bool air_ = true;
  std::string from_;
  std::vector<int> path_;
  std::uint64_t sequences_ = 0, steps_ = 0;
  bool failed_ = false;
};

}  // namespace backwash::daemon::test::epoch
