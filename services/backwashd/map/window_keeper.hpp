// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/map/scan/scan.hpp"
#include "core/map/scan/seen_window.hpp"
#include "services/backwashd/map/map_news.hpp"
#include "services/backwashd/plan/lookout.hpp"

namespace backwash::daemon {

/// What the world is made of where a mapper's window is declared (docs/interfaces.md, "A window that moves"): what the
/// window has said, else what the last whole map says, else nothing is known. A whole map whose world fits into
/// map.max_mib has its own place. Otherwise the world is a box around the vehicle, and moves. Used by the map worker
/// alone.
class WindowKeeper {
 public:
  explicit WindowKeeper(const MapSettings& settings);

  /// Voxels that a whole map may have: kept in a byte each beside the world of the window.
  std::size_t most_voxels() const noexcept { return most_whole_; }
  /// Whether the world has a place of its own, that of the whole map.
  bool fixed() const noexcept { return fixed_; }

  /// Takes a whole map, and says what its world holds. What the window called free before it is not any more. Nothing:
  /// its world does not fit; the next is that of moved().
  std::optional<map::OccupancyGrid> whole(map::OccupancyGrid map);
  /// The grid of a world around the vehicle: where there is none yet and both clouds have come, or a whole map; or
  /// where the window has reached the edge of that one. `live`: the grid in use, whose content is taken along where
  /// both are; null: there is none, or a new whole map speaks.
  std::optional<map::OccupancyGrid> moved(const Vec3& vehicle_W, const map::OccupancyGrid* live) const;

  struct Changes {
    map::ScanChange said, gone;     ///< by the clouds, and by what was let go; each with a box of its own
    std::size_t let_go = 0;         ///< voxels that had been said something of
    std::size_t let_go_blocks = 0;  ///< of them the occupied ones
  };
  /// Takes a cloud, and into the live grid, null if there is none yet, what it says that was not known; what is
  /// occupied is so again where scans had freed it. Lets go of what is too much: where the grid still holds what the
  /// window had said, and no scan has found it, it holds what the whole map says again. What is outside it is left out.
  Changes take(const WindowCloud& cloud, map::LiveMap* live);

  /// Parts of what the window has said that are held now.
  std::size_t parts() const noexcept { return seen_.parts(); }

 private:
  map::Cell of_whole(const Index3& v) const noexcept;  // of the lattice
  map::OccupancyGrid composed(const Index3& low, const Index3& size, const map::OccupancyGrid* live) const;

  config::MapWindow told_;
  std::size_t most_fixed_, most_whole_;
  map::SeenWindow seen_;
  std::optional<map::OccupancyGrid> whole_;
  bool fixed_ = false, occupied_came_ = false, free_came_ = false;
};

}  // namespace backwash::daemon
