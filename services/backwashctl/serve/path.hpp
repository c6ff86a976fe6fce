// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <vector>

#include "core/types/geometry.hpp"

namespace backwash::ctl {

/// One set of a tube: around where the vehicle is predicted, m, map.
struct ShownSet {
  Vec3 center_W;
  PerDirection half_widths;
};

/// A trajectory with its tube, as topics or a plan have it: commands every 20 ms, and one set more.
struct ShownPath {
  std::vector<Vec3> commands_W;  ///< m, map
  std::vector<ShownSet> tube;
};

/// Error over bound along the five directions: beyond 1 or −1 is outside.
using OverBound = std::array<double, kDirections>;

/// By how much of its bound a vehicle at `measured_W` is off that was last commanded to `setpoint_W`: against the
/// motion of the period before that command, since the sample is of some moment in it. Nothing where the path has no
/// such command (to 1 mm), as while a stop beside it is flown. Of several such commands the last counts.
std::optional<OverBound> error_over_bound(const ShownPath& path, const Vec3& measured_W, const Vec3& setpoint_W);

/// {path: [[x, y, z] …], tube: [[x, y, z, half width …] …]} in mm, of every `kEvery`th entry and the last ones; a set
/// stands for those that are left out before it too.
nlohmann::json json_of(const ShownPath& path);

}  // namespace backwash::ctl
