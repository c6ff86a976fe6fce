// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fstream>
#include <iterator>

#include "tests/daemon/plan/planner_rig.hpp"

namespace backwash::daemon::test {

/// A planner with a flight under way through a room.
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
  /// Of the stop that the control thread brakes on if it is told to now.
  std::size_t next_branch() const {
    const auto& stops = offers_.back().stops;
    return std::ranges::find_if(stops, [this](const auto& stop) { return stop.branch >= view_.index; })->branch;
  }
  bool blocked() const { return channels_->blocked_segment != 0; }
  bool rough() const { return channels_->rough_segment != 0; }
  /// The same map, in air that is rougher by these factors.
  void learn(const AirFactors& factors) {
    world_ = plan::rebuilt(*world_, {.air = factors});
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

}  // namespace backwash::daemon::test
