// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/reach/response/error_dynamics.hpp"

// The two ways axis_response() computes a response, and what they share.
namespace backwash::reach {

inline constexpr int kPhases = AxisResponse::kPhases;
inline constexpr double kPhase = kControlPeriod / kPhases;  ///< s
/// A loop that has not contracted after this is refused, s.
inline constexpr double kLongestMemory = 120;
/// Share of h_inf that the tail may hold.
inline constexpr double kTailShare = 1e-6;

/// Response under continuous feedback. Errors: as axis_response().
AxisResponse continuous_response(const AxisLoop& axis);
/// Response under feedback sampled and held every 20 ms. Errors: as axis_response().
AxisResponse sampled_response(const AxisLoop& axis);
/// Throws the std::invalid_argument of axis_response(): names the gains, delay and lag, and `why`.
[[noreturn]] void refuse(const AxisLoop& axis, const char* why);

}  // namespace backwash::reach
