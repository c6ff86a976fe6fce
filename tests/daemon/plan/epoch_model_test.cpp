// SPDX-License-Identifier: BSD-3-Clause
// STOP means stop, model-checked (docs/faults.md rows 39 and 40): every order of up to kDepth events between the real
// Mission, PlanFront, Orders and FlightTick, by a deterministic scheduler. What takes milliseconds in flight, planning,
// is a segment made here; everything that decides is the daemon's own. Events that change nothing now are left out: the
// sequences with them are those without, and shorter.
#include "tests/daemon/plan/epoch_model.hpp"

#include <cstdlib>

namespace backwash::daemon::test::epoch {
namespace {

const std::vector<int> kFlying{kGo, kJobTaken, kPlanned, kOffered, kTick, kTick, kMissionLooks};
std::vector<int> braking() {
  auto events = kFlying;
  events.insert(events.end(), {kWorldChanges, kTick, kMissionLooks});
  return events;
}
const Start kStarts[] = {{"on the ground", false, {}},
                         {"at rest in the air", true, {}},
                         {"taking off", false, kFlying},
                         {"flying", true, kFlying},
                         {"braking for an obstacle", true, braking()}};

int depth() {
  const char* asked = std::getenv("BACKWASH_MODEL_DEPTH");
  return asked ? std::atoi(asked) : 8;
}

}  // namespace

Daemon EpochModel::start(const Start& from) {
  air_ = from.air;
  from_ = from.name;
  Daemon d;
  d.before = {0, 0, air_ ? 1.0 : 0.2};
  d.in.autopilot.heartbeat_age = 0.1;
  MissionInput world;
  world.world = corridor();
  d.mission.observe(world);
  d.in.autopilot.armed = air_;
  for (int n = 0; n < 30; ++n) tick(d);
  d.before = {0, 0, air_ ? 1.0 : 0.2};
  apply(d, kMissionLooks);
  EXPECT_TRUE(command(d, kEnable));
  tick(d);
  d.in.autopilot.offboard = true;
  tick(d);
  apply(d, kMissionLooks);
  EXPECT_EQ(d.view.mode, Mode::tracking);
  EXPECT_EQ(d.before.z(), air_ ? 1.0 : 0.2);
  for (const int event : from.events) EXPECT_TRUE(apply(d, event)) << from_ << ": " << kNames[event];
  EXPECT_EQ(d.view.segment != 0, !from.events.empty())
      << from_ << ": " << to_string(d.view.mode) << ", " << to_string(d.view.reason);
  return d;
}

/// Whatever is still on its way arrives, in its natural order, until nothing happens any more.
void EpochModel::settle(Daemon d) {
  if (d.since_end < 0) return;
  for (int round = 0; round < 3; ++round) {
    for (const int event : {kMissionLooks, kJobTaken, kTick, kPlanned, kOffered}) apply(d, event);
    for (int n = 0; n < (d.held ? kRunOutHold : kRunOut) + 2; ++n) tick(d);
  }
}

void EpochModel::search(const Daemon& d, int depth) {
  if (depth == 0 || failed_) {
    ++sequences_;
    return settle(d);
  }
  for (int event = 0; event < kEvents && !failed_; ++event) {
    Daemon next = d;
    path_.push_back(event);
    ++steps_;
    if (apply(next, event)) search(next, depth - 1);
    path_.pop_back();
  }
}

TEST_P(EpochModel, AfterAnAcknowledgedEndNothingMovesAndNothingArmsWithoutALaterCommand) {
  for (const Start& from : kStarts) search(start(from), depth());
  std::printf("%llu sequences of %d events, %llu steps\n", static_cast<unsigned long long>(sequences_), depth(),
              static_cast<unsigned long long>(steps_));
}

INSTANTIATE_TEST_SUITE_P(Ends, EpochModel, testing::Values(kStop, kLand, kHold, kDisable), [](const auto& verb) {
  return verb.param == kStop ? "Stop" : verb.param == kLand ? "Land" : verb.param == kHold ? "Hold" : "Disable";
});

}  // namespace backwash::daemon::test::epoch
