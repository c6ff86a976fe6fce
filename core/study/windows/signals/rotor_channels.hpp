// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <span>

#include "core/study/windows/observation.hpp"
#include "core/study/windows/signals/series.hpp"

namespace backwash::study {

struct RotorPhases {
  /// Of each rotor at every sample, rad: the integral of its rpm reading (median of three, so that a dropout does not
  /// turn it). Empty where the log has no such column.
  std::array<std::vector<double>, 4> phase;
  std::array<double, 4> step{};  ///< in which its rpm was written down, the least difference of two rows
};
RotorPhases rotor_phases(const log::FlightLog& log, const Series& s);

/// Lines, motor shares, rpm against command and dropouts of the rows [begin, end). `residual`: detrended vertical
/// residual of those rows, m/s². `lines`: each rotor's, where the log tells its rate. Rotors of one rate have one line,
/// which must not count several times: it is the value of one of them, of each in `turn` (the window's number).
std::vector<ChannelValue> rotor_values(const log::FlightLog& log, const Series& s, const RotorPhases& phases,
                                       const Vehicle& vehicle, std::span<const double> residual, std::size_t begin,
                                       std::size_t end, std::size_t turn,
                                       std::array<std::optional<RotorLine>, 4>& lines);

}  // namespace backwash::study
