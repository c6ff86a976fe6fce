// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>

#include "tests/study_worlds/summary.hpp"

namespace study_worlds {

/// How often the null of flipped flights rejects, at 0.05 and 0.03, a regressor that has no effect, per channel and
/// kind of regressor: one value per dwell drawn anew, or one random course of time shared by all flights.
using NullSize = std::map<std::pair<std::string, std::string>, std::pair<Rate, Rate>>;

/// One world without a hidden cause, several regressors of each kind in each channel.
NullSize null_size(std::uint64_t seed, int flights, const std::filesystem::path& folder);
void add(NullSize& sum, const NullSize& one);
std::string markdown(const NullSize& sizes);

}  // namespace study_worlds
