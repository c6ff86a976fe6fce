// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/study/findings/study.hpp"

/// Causes that do not act in all flights alike, as the study tells them.
namespace backwash::study {

/// Such a cause with its gain and with why it does not join the model. `rest`: evidence of the observations that it was
/// taken out of, scatter estimated.
NamedCause named(const Change& change, const Evidence& rest);

/// "from flight 7 on", "flights 1, 3-5", "from flight 5 on, since 34 s in flight 5", "since 60 s of each flight",
/// "growing from flight to flight"; flights count from 1. `flights`: how many there are.
std::string when(When when, const std::vector<ActingFlight>& acting, std::size_t flights);

/// What of the rotors is measured in some flights, and in which others (from 0) it is not, as their logs lack a column.
struct NotMeasured {
  std::string what;
  std::vector<std::size_t> flights;
};
std::vector<NotMeasured> not_measured(const Observations& seen);
/// "rpm over command, not measured in all flights; without: up to flight 6".
std::string to_text(const NotMeasured& gap, std::size_t flights);

/// "rotor 3, flights 5-8"; empty for a cause of all flights.
std::string where(const NamedCause& cause);

}  // namespace backwash::study
