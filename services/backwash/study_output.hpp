// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "core/study/calibrate/height_effect.hpp"
#include "core/study/discrepancy/consequence.hpp"
#include "core/study/discrepancy/rotor_reference.hpp"
#include "core/study/discrepancy/study.hpp"
#include "services/backwash/json.hpp"

namespace backwash::services {

/// JSON of `backwash study` (core/study/discrepancy/README.md, "JSON").
Json to_json(const study::discrepancy::StudyResult& result, const study::discrepancy::Observations& seen);
Json to_json(const study::discrepancy::Consequence& consequence);
Json to_json(const study::discrepancy::RotorVerdict& verdict);
Json to_json(const study::calibrate::HeightEffects& height);
/// The same for people, on stdout.
void print_text(const study::discrepancy::StudyResult& result, const study::discrepancy::Observations& seen,
                const std::optional<study::discrepancy::RotorVerdict>& rotors,
                const std::optional<study::calibrate::HeightEffects>& height);

}  // namespace backwash::services
