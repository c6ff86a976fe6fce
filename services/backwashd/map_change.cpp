// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/map_change.hpp"

#include <limits>

#include "services/backwashd/scan_placement.hpp"

namespace backwash::daemon {

bool same_place(const map::OccupancyGrid& a, const map::OccupancyGrid& b) {
  return a.size() == b.size() && a.resolution() == b.resolution() &&
         (a.origin() - b.origin()).cwiseAbs().maxCoeff() < 1e-6 * a.resolution();
}

map::ScanChange difference(const map::OccupancyGrid& before, const map::OccupancyGrid& after) {
  map::ScanChange change;
  for (std::size_t n = 0; n < after.cell_count(); ++n) {
    if (before.at(n) == after.at(n)) continue;
    change.box.add(after.voxel(n));
    if (after.at(n) == map::Cell::occupied) change.occupied.push_back(after.voxel(n));
  }
  return change;
}

NewVoxels as_new_voxels(const map::OccupancyGrid& before, const map::ScanChange& change, std::int64_t received_ns) {
  Scan scan;
  scan.received_ns = received_ns;
  for (const Index3& v : change.occupied) scan.points_W.push_back(before.center(v));
  return new_voxels(before, scan, std::numeric_limits<double>::infinity());
}

}  // namespace backwash::daemon
