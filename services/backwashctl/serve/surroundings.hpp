// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <string>

#include "core/plan/world/world.hpp"
#include "services/backwashctl/serve/feed.hpp"
#include "services/backwashctl/serve/gate.hpp"

namespace backwash::ctl {

/// What this station computes of the map that the daemon flies in: the disturbance's bound, and ways with their tubes
/// before they are asked for. The daemon plans anew, with what its scans and its flight have taught it.
class Surroundings {
 public:
  Surroundings(const Feed& feed, const Vehicle& vehicle, const Model& model)
      : feed_(feed), vehicle_(vehicle), model_(model) {}

  /// Plans to {page, goal} from where the vehicle rests; what comes of it is in preview().
  Reply propose(const nlohmann::json& said);
  /// {number, goal, state, message} and, where there is a way, {path, tube, time_s, clearance_m}; null for a page that
  /// proposed nothing, or of which another page proposed since.
  nlohmann::json preview(const std::string& page) const;
  /// The bound along x at the voxels of the layer at z: {values, most}, values in 0.01 m/s², x running fastest, 0 where
  /// the vehicle cannot be; the map's largest in m/s². Null until it is computed of this map.
  nlohmann::json bounds_at(const map::OccupancyGrid& grid, double z) const;
  /// Thread body.
  void run(const std::stop_token& stopped);

 private:
  struct Proposal {
    std::string page;
    Vec3 goal_W;
    std::uint64_t number;
  };
  void build(const std::shared_ptr<const map::OccupancyGrid>& grid);
  nlohmann::json planned(const Proposal& proposal) const;

  const Feed& feed_;
  Vehicle vehicle_;
  Model model_;
  mutable std::mutex mutex_;
  std::condition_variable proposed_;
  std::shared_ptr<const map::OccupancyGrid> grid_;  // that world_ is of
  std::shared_ptr<const plan::World> world_;
  std::string failure_;  // why there is none
  std::optional<Proposal> proposal_;
  std::string page_;  // whose the preview is
  nlohmann::json preview_;
  std::uint64_t numbers_ = 0;
};

}  // namespace backwash::ctl
