// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/types/geometry.hpp"

namespace backwash::services {

/// What `simulate` flies (README.md, "Flight specification"): straight lines between hover points.
struct FlightSpec {
  struct Hover {
    Vec3 p_W;        ///< m
    double dwell_s;  ///< s
  };
  Vec3 start_W;        ///< where the vehicle hovers at first, m
  std::uint64_t seed;  ///< of airflow and VIO error
  std::vector<Hover> hovers;
};

/// Reads a specification; throws Failure 66 if there is none, 78 with FILE:LINE for an unknown, missing or wrong key.
FlightSpec read_flight_spec(const std::string& path);

}  // namespace backwash::services
