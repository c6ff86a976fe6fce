// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "core/report/page/page_data.hpp"
#include "core/study/windows/observation.hpp"

/// What a simulation says of measured flights whose set-points it flew, window by window.
namespace backwash::study {

/// The simulated value of each measured window, mean over replicas with other gusts; nothing where none was simulated.
using Told = std::array<std::vector<std::optional<double>>, kChannels>;
/// `simulated`: observations of the same flights in the same order, one for each replica. A window is that of its
/// flight whose middle is nearest in time, within 0.15 s.
Told told_of(const Observations& measured, std::span<const Observations> simulated);

/// Root mean square, by weight, of measured less simulated over the windows that have both; `about_mean`: about its own
/// mean. In the channel's unit (m/s², ln, or what its definition says). Nothing where no window has both.
struct ChannelError {
  double value;
  std::size_t windows;
};
std::optional<ChannelError> channel_error(const Observations& measured, const Told& told, Channel channel,
                                          bool about_mean = false);

/// A section of the page: per channel what was measured and what was simulated before and after, in the flights' order,
/// with both errors; its tables and plots come into `data`.
std::string residual_section(const Observations& measured, const Told& before, const Told& after,
                             report::PageData& data);

}  // namespace backwash::study
