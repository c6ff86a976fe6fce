// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace backwash::dds {

/// What the status says of the air: `air` of idl/backwash_msgs.idl.
struct AirSaid {
  struct Class {
    std::string name;
    double factor = 1, ln_evidence = 0;
    double seconds = 0;   ///< of flight in it
    std::string cause{};  ///< of a factor above 1; empty: none
  };
  bool frozen = false;
  std::vector<Class> classes;  ///< that were flown in or have a factor
};

std::string to_text(const AirSaid& air);
/// Of to_text(), to the digits that it has. Nothing: a daemon of another version, or one that learns nothing.
std::optional<AirSaid> air_said(const std::string& text);

}  // namespace backwash::dds
