// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/study/effects/effect.hpp"

namespace backwash::study {

/// Every effect.
const std::vector<Effect>& effects();
/// Every form of every effect.
const std::vector<const Form*>& catalogue();
/// Why no flights ever tell a form: its columns are spanned by what stays free beside it (offsets, the craft's own
/// level of Σ), judged on drawn windows in which everything varies. Nothing: some do. A catalogue with such a form is
/// not made: effects() throws std::logic_error with it.
std::optional<std::string> stays_free(const Form& form);
/// Why these observations cannot test a form; nothing if they can.
std::optional<std::string> why_not_tested(const Form& form, const Observations& seen);

}  // namespace backwash::study
