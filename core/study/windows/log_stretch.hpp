// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "core/log/columns/log_columns.hpp"
#include "core/study/windows/hover_windows.hpp"

namespace backwash::study {

using Rows = std::vector<double>;

/// A stretch of a log without gaps, evenly sampled.
struct Even {
  double t0, rate;
  std::vector<Vec3> p, v, a, w;  ///< w: the disturbance
  std::vector<Eigen::Quaterniond> q;
  std::vector<std::optional<int>> segment;  ///< hover position; none in transit
  std::size_t size() const { return p.size(); }
};

/// Rows `raw` of a log (no gap inside) at even spacing 1/rate, with the disturbance as `signal` defines it
/// (flight_windows() has the equation). New hover positions are numbered from `next_segment` on.
Even even_stretch(const log::FlightLog& log, SampleRange raw, double rate, Signal signal,
                  const std::optional<Vehicle>& vehicle, const WindowOptions& options, int& next_segment);

}  // namespace backwash::study
