// SPDX-License-Identifier: BSD-3-Clause
// The mission's thread: what it decides from and where its decisions go.
#include <spdlog/spdlog.h>

#include <cstdio>
#include <thread>
#include <vector>

#include "services/backwashd/channels.hpp"
#include "services/backwashd/plan/mission.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {
namespace {

double seconds_now() { return static_cast<double>(now_ns()) * 1e-9; }

void show(sync::LatestValue<std::array<char, 192>>& where, const std::string& text) {
  std::array<char, 192> line{};
  std::snprintf(line.data(), line.size(), "%s", text.c_str());
  where.write(line);
}

/// The order first: a plan that is made after it belongs to it. False: the control thread takes no orders.
bool carry_out(Channels& channels, const Decision& decision) {
  if (decision.order && !channels.orders.push(*decision.order)) return false;
  if (decision.air && !channels.air_orders.push(*decision.air)) return false;
  if (decision.job) channels.jobs.offer(std::make_unique<const PlanJob>(*decision.job));
  return true;
}

Decision observe(Channels& channels, Mission& mission) {
  channels.jobs.collect();
  MissionInput in;
  in.now_s = seconds_now();
  // Before the view: what has come to an end is then seen in it.
  std::vector<PlanOutcome> outcomes;
  while (const auto outcome = channels.outcomes.pop()) {
    if (!outcome->ok) spdlog::warn("refused: {}", outcome->reason.data());
    outcomes.push_back(*outcome);
  }
  in.outcomes = outcomes;
  in.view = channels.view_mission.read_new();
  in.other_daemon = channels.other_daemon.read_new();
  in.odometry_doubt = channels.odometry_doubt.read_new();
  if (const auto* world = channels.worlds.mission.take()) {
    in.world = world->world;
    channels.worlds.mission.give_back(world);
  }
  return mission.observe(in);
}

}  // namespace

void run_mission(Channels& channels, Mission& mission, const SendAnswer& answer) {
  constexpr std::uint8_t kRefused = backwash_msgs_msg_dds__ACK_REFUSED;
  while (!channels.stop) {
    carry_out(channels, observe(channels, mission));
    while (const auto command = channels.commands.pop()) {
      if (command->verb == backwash_msgs_msg_dds__COMMAND_ENABLE) channels.enable_asked_ns.store(now_ns());
      const Decision decision = mission.handle(*command, seconds_now());
      const bool done = carry_out(channels, decision);
      if (!decision.answer) continue;
      const Answer a = done ? *decision.answer : Answer{kRefused, "the control thread takes no orders: it has stopped"};
      if (a.result != backwash_msgs_msg_dds__ACK_ACCEPTED) ++channels.commands_refused;
      spdlog::info("command {} from {}: {}", command->verb, command->station.data(), a.reason);
      answer(*command, a);
    }
    channels.accepted.write(mission.accepted());
    show(channels.task, mission.task());
    show(channels.place, mission.place());
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

}  // namespace backwash::daemon
