// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "core/config/config.hpp"
#include "core/types/waypoint.hpp"

namespace backwash::config {

/// Reads what `backwashctl follow` flies (docs/interfaces.md, "Points CSV"). Errors (FILE:LINE: what is wrong): no
/// file, another first line, a row that holds other than three finite numbers and where the file has headings one or
/// none, more rows than a command holds.
tl::expected<std::vector<Waypoint>, ConfigError> read_route(const std::string& path);

/// Whether any row has a heading: the command then is FOLLOW_FACING, else FOLLOW.
bool has_headings(const std::vector<Waypoint>& route);

/// The command's waypoints, m, map. Of a route with headings each row is two: its place, and a point 1 m ahead that is
/// faced from there, or the place again where the row has none (idl/backwash_msgs.idl).
std::vector<Vec3> waypoints_of(const std::vector<Waypoint>& route);

}  // namespace backwash::config
