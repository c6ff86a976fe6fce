// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "core/types/geometry.hpp"

namespace backwash::config {

/// A mapper's occupancy window that moves along (docs/interfaces.md, "A window that moves").
struct MapWindow {
  std::string occupied, free;     ///< topics of its clouds, whole names on the wire; the first empty: there is none
  Vec3 size = Vec3::Zero();       ///< edges of the box around the vehicle, m
  double resolution = 0;          ///< edge of its voxels, m
  double keep_voxels = 16777216;  ///< of what it has said so many are kept: beyond them the farthest are let go

  bool declared() const noexcept { return !occupied.empty(); }
  /// Its voxels along each axis: all that it can meet, wherever the vehicle is within one.
  Index3 voxels() const noexcept { return (size / resolution - Vec3::Constant(1e-6)).array().ceil().cast<int>() + 1; }
  /// Those of the world that is made around it where no whole map has one: half as much again, so that the world need
  /// not move with each cloud.
  Index3 world() const noexcept { return (1.5 * size / resolution).array().round().max(1).cast<int>(); }
};

/// Of a snapshot of the world and of the live grid behind it, at most: grid 1, misses and marks 2, distance 4, Σ 24,
/// bounds 4 + 64, hover map 16.
constexpr std::size_t kWorldBytesPerVoxel = 115;
constexpr double kMaxMib = 512;  ///< map.max_mib where a file does not say it

/// What is wrong with a declared window beside this map.max_mib, by its key; nothing: it is good.
std::optional<std::pair<std::string_view, std::string>> wrong_window(const MapWindow& window, double max_mib);

}  // namespace backwash::config
