// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "core/study/calibrate/height_effect.hpp"
#include "core/study/findings/consequence.hpp"
#include "core/study/findings/study.hpp"
#include "core/study/inference/rotors/rotor_reference.hpp"
#include "services/backwash/json.hpp"

namespace backwash::services {

/// JSON of `backwash study` (docs/interfaces.md, "backwash study"). `logs`: names of the observed flights, in their
/// order.
Json to_json(const study::StudyResult& result, const study::Observations& seen, const Vehicle& vehicle,
             const std::vector<std::string>& logs);
Json to_json(const study::Consequence& consequence);
Json to_json(const study::RotorVerdict& verdict);
Json to_json(const study::calibrate::HeightEffects& height);
/// The same for people, on stdout.
void print_text(const study::StudyResult& result, const study::Observations& seen, const Vehicle& vehicle,
                const std::vector<std::string>& logs, const std::optional<study::Consequence>& consequence,
                const std::optional<study::RotorVerdict>& rotors,
                const std::optional<study::calibrate::HeightEffects>& height);

/// Every constant of the inference with unit and reason, and of each form the size from which on it is an effect.
void print_rules(bool json);

}  // namespace backwash::services
