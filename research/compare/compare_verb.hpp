// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "services/backwash/verb.hpp"

namespace backwash::services {

/// The paper's Table I (research/compare/README.md).
Verb compare_verb(Command& app);

}  // namespace backwash::services
