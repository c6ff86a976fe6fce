// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "services/security/authority.hpp"

namespace backwash::security {

/// The two documents of DDS Security 1.1 (OMG formal/18-04-01, 9.4.1), unsigned. The names in them have been checked:
/// letters, digits and . _ - / alone.
std::string governance_xml(Protection protection);
std::string permissions_xml(const std::string& name, const std::string& subject, const Grant& grant,
                            const Validity& validity);

}  // namespace backwash::security
