// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/study/inference/search.hpp"

namespace backwash::study {

/// Error of a channel's windows without a cause and with it, in the channel's unit: m/s², s or ln. Three ln variances
/// are one.
struct ChannelGain {
  Channel channel;
  double before, after;
  std::size_t windows;
};

/// What a cause is worth on flights that its parameters were not fitted to: the gain that the search claims.
struct Gain {
  double held_out_nats = 0;
  double low_nats = 0, high_nats = 0;              ///< 95 %, over flights
  double rmse_before = 0, rmse_after = 0;          ///< of the cause's first channel, m/s² or ln
  double coverage_before = 0, coverage_after = 0;  ///< share of samples in the model's central 90 % interval
  std::vector<ChannelGain> channels = {};          ///< that the cause moves, the first one it is told by
};

/// What something adds to each channel by window; empty where it adds nothing.
using Moved = std::array<std::vector<double>, kChannels>;
/// Adds Σ θ x of columns in windows begin … end − 1.
void add(Moved& moved, std::span<const DesignColumn> columns, const SmallVector& theta, std::size_t begin,
         std::size_t end, const Observations& seen);

/// Share of the windows' samples within the central 90 %, without and with what a cause moves beside `others`.
struct Covered {
  double before = 0, after = 0;
};
Covered covered(const Observations& seen, const Moved& own, const Moved& others);

/// 95 % interval of a sum over flights that are draws.
std::pair<double, double> interval_of_sum(std::span<const double> parts);

/// Of an accepted cause beside the others. Errors are of the windows, weights and free offsets of the claim (8-13 of
/// docs/model.md), so that what is likelier is nearer too: each channel's r̃ᵀV⁻¹r̃ over Σ weight/σ_w². θ is that
/// without the window's flight.
Gain held_out(const Evidence& evidence, const std::vector<Accepted>& accepted, std::size_t which);

/// What the extension by a cause does to flights that it was not fitted to. Everything that will be applied is applied
/// and nothing else: θ and the coefficients of the companions, both fitted without the flight, and no free offset. The
/// level of Σ stays free: it is calibrate's.
struct Applied {
  std::vector<double> beside;                      ///< coefficients of the form's companions, fitted to all flights
  double nats = 0;                                 ///< held out
  double coverage_before = 0, coverage_after = 0;  ///< share of samples in the model's central 90 % interval
  std::string refused;                             ///< why it does not join the model; empty: it does
};

/// One for each accepted cause. Refused is, the worst first and the others judged anew without it, a cause with which
/// flights that were not fitted are less likely, or of whose samples fewer lie in the central 90 % interval, fewer than
/// 90 % that is. `refused`: why each is refused before that, and the others judged without it; empty: none is.
std::vector<Applied> judge(const Evidence& evidence, const std::vector<Accepted>& accepted,
                           const std::vector<std::string>& refused);

}  // namespace backwash::study
