// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/map/occupancy_grid.hpp"
#include "services/backwashctl/preflight.hpp"
#include "services/backwashctl/serve/path.hpp"
#include "services/backwashctl/station.hpp"

namespace backwash::ctl {

using Clock = std::chrono::steady_clock;

/// What the autopilot says of its battery; what it does not say is absent.
struct BatterySeen {
  std::int64_t stamp_ns = 0;  ///< when the daemon was told, by its wall clock
  std::optional<double> share, voltage;
};

/// The newest of all that the vehicle's topics say.
struct Seen {
  std::optional<StatusCopy> status;
  Clock::time_point status_at{};
  std::optional<BatterySeen> battery;
  std::vector<Finding> preflight;  ///< over the last seconds; empty until two seconds were seen
  std::shared_ptr<const ShownPath> path;
  std::shared_ptr<const map::OccupancyGrid> grid;
  std::string map_refused;                        ///< why the newest map is not shown; "": it is
  std::uint64_t path_number = 0, map_number = 0;  ///< rise with each new one
};

/// Listens to status, battery, trajectory, tube and map, on readers of its own.
class Feed {
 public:
  Feed(const dds::Participant& participant, const std::string& name_space);
  /// Takes what came within the next 50 ms. Call from one thread.
  void step();
  /// A copy, for any thread.
  Seen seen() const;

 private:
  void take_status();
  void take_battery();
  void take_path();
  void take_map();

  dds::Reader<dds::Status> statuses_;
  dds::Reader<dds::BatteryState> batteries_;
  dds::Reader<dds::Path> trajectories_;
  dds::Reader<dds::Tube> tubes_;
  dds::Reader<dds::Octomap> maps_;
  dds::WaitSet waitset_;
  std::deque<std::pair<Clock::time_point, StatusCopy>> lately_;  // statuses of the last seconds
  ShownPath path_;
  std::int64_t line_stamp_ = 0, tube_stamp_ = 0;  // ns: those of one segment are equal
  mutable std::mutex mutex_;
  Seen seen_;
};

}  // namespace backwash::ctl
