// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <functional>

#include "services/backwashd/channels.hpp"
#include "services/backwashd/plan/planner_worker.hpp"
#include "tests/daemon/lockstep/lockstep.hpp"

namespace backwash::daemon::test {

using map::Cell;
using map::OccupancyGrid;

/// A room of 6 × 4 × 2 m with solid floor, at 0.1 m.
inline OccupancyGrid room() {
  OccupancyGrid grid({0, 0, 0}, 0.1, {60, 40, 20}, Cell::free);
  for (int j = 0; j < 40; ++j)
    for (int i = 0; i < 60; ++i) grid.set({i, j, 0}, Cell::occupied);
  return grid;
}

inline void fill(OccupancyGrid& grid, const Index3& low, const Index3& high) {
  for (int k = low.z(); k <= high.z(); ++k)
    for (int j = low.y(); j <= high.y(); ++j)
      for (int i = low.x(); i <= high.x(); ++i) grid.set({i, j, k}, Cell::occupied);
}

inline std::shared_ptr<const plan::World> world_of(const OccupancyGrid& grid) {
  return plan::build_world(grid, Model{}, vehicle_5in());
}

/// A planner alone; the test plays mission and control thread.
class PlannerOffers : public testing::Test {
 protected:
  static constexpr std::int64_t kSeen_ns = 4711;
  std::string log_ = std::filesystem::temp_directory_path() / ("backwash_offers." + std::to_string(getpid()));
  std::unique_ptr<Channels> channels_ = std::make_unique<Channels>();
  Recorder recorder_{log_};
  ControlView view_;
  std::vector<track::AcceptedSegment> offers_;
  std::int64_t pause_ns_ = 20'000'000;
  std::function<void()> meanwhile_ = [] {};  ///< what else happens in a pause
  std::function<void(const track::AcceptedSegment&)> answer_ = [this](const auto& s) { view_.segment = s.id; };
  PlannerWorker planner_{*channels_, recorder_, [](const auto&) {}, [this] { control(); }};
  std::shared_ptr<const plan::World> world_;

  ~PlannerOffers() override {
    channels_->worlds.collect();
    channels_->segments.collect();
    std::filesystem::remove(log_);
  }
  void stand(const Vec3& p_W) {
    view_.mode = Mode::tracking;
    view_.state = {p_W, Vec3::Zero()};
    view_.command = {p_W, Vec3::Zero(), Vec3::Zero(), 0.3};
    view_.epoch = {7, 2};
    show();
  }
  void show() { channels_->view_planner.write(view_); }
  void know(const OccupancyGrid& grid) {
    world_ = world_of(grid);
    channels_->worlds.offer({world_, kSeen_ns});
  }
  /// The control thread's part of a pause.
  void control() {
    if (const auto* s = channels_->segments.take()) {
      offers_.push_back(*s);
      channels_->segments.give_back(s);
      answer_(*s);
    }
    // The autopilot lifts in no time.
    if (view_.mode == Mode::lifting) {
      view_.mode = Mode::tracking;
      view_.reason = Reason::lifted_off;
      view_.state = {offers_.back().commands.back().p_W, Vec3::Zero()};
      view_.command = offers_.back().commands.back();
      view_.segment = 0;
    } else if (!offers_.empty() && view_.segment == offers_.back().id && offers_.back().arms) {
      view_.mode = Mode::lifting;
    }
    view_.t_ns += pause_ns_;
    meanwhile_();
    show();
  }
  /// "", or why not.
  std::string ask(PlanJob::Kind kind, const Vec3& position, const track::Epoch& epoch = {7, 2},
                  PlannerWorker* by = nullptr) {
    channels_->jobs.offer(std::make_unique<const PlanJob>(PlanJob{kind, 1, position, {}, epoch}));
    EXPECT_TRUE((by ? *by : planner_).step());
    const auto outcome = channels_->outcomes.pop();
    return outcome->ok ? "" : outcome->reason.data();
  }
};

}  // namespace backwash::daemon::test
