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

/// The same, and nothing within 0.12 s of places that were held for longer than 0.24 s: an estimate that froze goes on
/// by a leap, which is no motion. Positions that are logged at 5 Hz or more are not held so long.
std::vector<std::optional<LocalMotion>> local_cubics_but_for_holds(const std::vector<double>& t,
                                                                   const std::vector<Vec3>& p);

}  // namespace backwash::log
