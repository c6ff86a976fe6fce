// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/log/raw/raw_log.hpp"
#include "core/map/distance_field.hpp"
#include "core/types/vehicle.hpp"

namespace backwash::services {

/// A stretch of the routes whose clearances were measured to one map, or could not be.
struct JudgedStretch {
  double from_s = 0, until_s = 0;     ///< its first and last tick, since the log's first tick
  std::size_t ticks = 0, map = 0;     ///< which of the maps, from 1 on in the order of their acceptance; 0: none
  std::optional<double> clearance_m;  ///< least; none: it was not judged
  std::string why;                    ///< why not; empty where it was
};

/// What the maps of a raw log can say of a flight. A log holds whole maps; of scans and of a mapper's window it holds
/// how many there were, and no voxel. So each place is judged by the whole map that was the newest then.
struct JudgedMaps {
  std::vector<double> accepted_s;  ///< of each whole map, since the log's first tick
  std::vector<JudgedStretch> stretches;
  std::size_t scans = 0, window_clouds = 0;     ///< that were taken
  std::size_t let_go = 0, let_go_occupied = 0;  ///< voxels of the window that were forgotten far from it
  std::size_t judged = 0, not_judged = 0;       ///< ticks on the routes
  std::size_t not_judged_rising = 0;            ///< ticks of take-offs
  std::optional<double> beside_m;               ///< least beside a take-off, body to obstacle; none: none was judged
  std::optional<double> left_over_m;            ///< least that the sets of the routes leave, body and estimation off
  std::size_t contradicted = 0;  ///< map whose obstacle was met though scans or a window may have freed it; 0: none
};

/// To be said of something touched: a map is no witness where others than maps have spoken since. Else empty.
std::string unless_freed(const JudgedMaps& maps);

/// Measures clearances to the whole maps of a raw log.
class MapJudge {
 public:
  /// `zero_ns`: the log's first tick. The log outlives this.
  MapJudge(const log::RawLog& log, std::int64_t zero_ns, const Vehicle& vehicle);

  /// Of a body on a route, m: body to the nearest voxel that is not free. Nothing, with a stretch that says why: no map
  /// was there, or none that knows this place though others than maps showed it.
  std::optional<double> clearance(std::int64_t t_ns, const Vec3& p_W);
  /// Of a body that rises: what stands beside it counts, not the floor that it comes from.
  void judge_rising(std::int64_t t_ns, const Vec3& p_W);
  /// What the set that a tick on a route was judged by leaves.
  void judge_set(std::int64_t t_ns, const log::TickRecord& tick);

  const JudgedMaps& maps() const noexcept { return maps_; }

 private:
  void count(const log::RawRecord& record);
  std::size_t use_newest(std::int64_t t_ns);
  bool meets_occupied(const Vec3& p_W) const;
  void note(double t_s, std::size_t map, std::optional<double> clearance_m, const std::string& why);

  std::vector<const log::RawRecord*> records_;  // of accepted maps
  std::int64_t zero_ns_;
  std::optional<std::int64_t> seen_ns_;  // of the first scan or cloud
  Vehicle vehicle_;
  std::size_t used_ = 0;  // which map the two below are of
  std::optional<map::OccupancyGrid> grid_;
  std::optional<map::DistanceField> distance_;
  std::string unreadable_;
  JudgedMaps maps_;
};

}  // namespace backwash::services
