// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>

#include "services/backwash/learn/calibrate_input.hpp"

namespace backwash::services {

/// What a calibration's page says beside its numbers.
struct CalibratePageContext {
  double quantile;                  ///< that was asked for
  std::string vehicle, base_model;  ///< as given; the vehicle may be none
};

/// A calibration as a self-contained HTML page: how much of flights that were not fitted lay below the bound, by
/// distance and height; each constant with its interval; what was refused and the flight that would decide it; the
/// bound over the raw variances.
std::string calibrate_page(const study::calibrate::Calibration& calibration, const Campaign& campaign,
                           std::span<const study::calibrate::Refusal> refused, const CalibratePageContext& context);

}  // namespace backwash::services
