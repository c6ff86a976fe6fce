// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "core/study/findings/extend.hpp"

namespace backwash::services {

/// The study's own terms of a model file that it has extended before; none in others.
std::vector<study::ExtensionTerm> read_terms(const std::string& path);
/// The [[extension.term]] tables of a model file as they stand there; empty if it has none.
std::string earlier_terms(const std::string& path);

}  // namespace backwash::services
