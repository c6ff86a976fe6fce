// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "core/config/daemon_config.hpp"
#include "services/backwashd/map/map_news.hpp"
#include "services/backwashd/map/scan_placement.hpp"
#include "services/dds/topics.hpp"

namespace backwash::daemon {

/// Judges the clouds of a mapper's window (docs/interfaces.md, "A window that moves"). What it refuses it names by
/// topic, sender, field, value seen and wanted, and the setting. Used by the thread that reads them alone; pure.
class WindowClouds {
 public:
  explicit WindowClouds(const config::Daemon& config) : told_(config.map.window), frame_(config.frames.map) {}

  /// The cloud in voxels of the lattice, those within the window around the vehicle. A cloud older than one of its kind
  /// before is refused, and a free one whose clock is ahead of that of the occupied ones; so is all that looks like
  /// something else than voxels of the stated size.
  tl::expected<WindowCloud, std::string> judge(bool free, const dds::PointCloud& message, const dds::Guid& writer,
                                               const std::optional<Vec3>& vehicle_W, std::int64_t received_ns);
  /// One line of a good cloud of which a third or more lay outside the window, or nothing: of the last that was judged.
  const std::optional<std::string>& beyond() const noexcept { return beyond_; }
  /// The writer of this kind is gone: another one's stamps count from anew.
  void forget(bool free) noexcept { newest_ns_[free] = INT64_MIN; }

 private:
  std::optional<std::string> wrong(bool free, const dds::PointCloud& message, const Cloud& cloud) const;
  std::optional<std::string> wrong_stamp(bool free, std::int64_t stamp_ns, std::int64_t late_ns) const;
  std::optional<std::string> off_lattice(std::span<const Vec3> points, const std::vector<Index3>& voxels) const;
  std::string window_text(const Vec3& vehicle_W) const;

  config::MapWindow told_;
  std::string frame_;
  std::array<std::int64_t, 2> newest_ns_{INT64_MIN, INT64_MIN};  // stamps, of occupied and of free
  std::optional<std::int64_t> occupied_late_ns_;  // least from stamp to reception of the clouds of occupied voxels
  std::optional<std::string> beyond_;
};

/// The voxels of such a cloud that are free in a grid of the lattice, as those of a scan.
NewVoxels new_voxels(const map::OccupancyGrid& known, const WindowCloud& cloud);

}  // namespace backwash::daemon
