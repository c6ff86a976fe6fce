// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>

#include "core/study/findings/study.hpp"

/// Causes that act in some flights only, as the study tells them.
namespace backwash::study {

/// Such a cause with its gain and with why it does not join the model. `rest`: evidence of the observations that it was
/// taken out of, scatter estimated.
NamedCause named(const InSomeFlights& cause, const Evidence& rest);

/// "rotor 3, flights 5-8, since 34 s in flight 5"; flights count from 1. Empty for a cause of all flights.
std::string where(const NamedCause& cause);

}  // namespace backwash::study
