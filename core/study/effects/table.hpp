// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/effects/effect.hpp"

namespace backwash::study {

/// Every effect.
const std::vector<Effect>& effects();
/// Every form of every effect.
const std::vector<const Form*>& catalogue();
/// Why these observations cannot test a form; nothing if they can.
std::optional<std::string> why_not_tested(const Form& form, const Observations& seen);

}  // namespace backwash::study
