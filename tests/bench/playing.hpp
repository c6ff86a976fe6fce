// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>

#include "tests/bench/trace.hpp"

namespace backwash::autopilots {

enum class Kind { ardupilot, px4 };

/// A recorded trace of the real autopilot: tests/autopilots/traces/NAME.csv.
const Trace& recorded(const std::string& name);

/// A script of tests/autopilots/scripts played against the bench's profile in lockstep, with these parameters in place
/// of the profile's own. Played once per program.
const Trace& played(Kind kind, const std::string& script, const std::map<std::string, double>& parameters = {});

}  // namespace backwash::autopilots
