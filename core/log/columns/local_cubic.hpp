// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "core/types/geometry.hpp"

namespace backwash::log {

/// Velocity (m/s) and acceleration (m/s²) at a row of positions.
struct LocalMotion {
  Vec3 v, a;
};

/// For each row the derivatives of a cubic through the positions `p` (m) within ± 0.12 s of it, by least squares. The
/// second one passes half the amplitude at 4.0 Hz and less than a tenth above 6.5 Hz. Nothing where fewer than six rows
/// are that near, or less than 0.06 s of them on one side: a gap, or an end. `t`: s, rising.
std::vector<std::optional<LocalMotion>> local_cubics(const std::vector<double>& t, const std::vector<Vec3>& p);

/// Rows [first, next) of places that were held for longer than 0.24 s, until something else was said: an estimate that
/// froze, or a craft that nothing measured. Positions that are logged at 5 Hz or more are not held so long.
struct Hold {
  std::size_t first, next;
};
std::vector<Hold> holds(const std::vector<double>& t, const std::vector<Vec3>& p);

/// The same as local_cubics, and nothing within 0.12 s of holds, which go on by a leap that is no motion.
std::vector<std::optional<LocalMotion>> local_cubics_but_for_holds(const std::vector<double>& t,
                                                                   const std::vector<Vec3>& p);

}  // namespace backwash::log
