// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdio>
#include <optional>
#include <string>

#include "core/types/text.hpp"

namespace backwash::services {

/// What a command record of the raw log asks for.
struct Asked {
  std::string what;
  bool ends = false;  ///< it ends what is flown; otherwise, or where `beside`, that goes on
  bool beside = false;
  bool session = false;  ///< it gives the session back, as each call of backwashctl does: nothing of the flight changes
};

/// Nothing: the text is no command that is known. Verbs are those of idl/backwash_msgs.idl.
inline std::optional<Asked> asked_for(const std::string& text) {
  constexpr const char* kVerbs[] = {"",
                                    "enable",
                                    "disable",
                                    "take off",
                                    "go to",
                                    "hold",
                                    "land",
                                    "end the session",
                                    "stop",
                                    "follow",
                                    "go to, then turn",
                                    "follow, turning",
                                    "reset the air",
                                    "freeze the air",
                                    "thaw the air"};
  constexpr unsigned kEnable = 1, kTakeOff = 3, kGoTo = 4, kRelease = 7, kGoToFacing = 10, kOfAir = 12;
  const auto at = text.find(" verb ");
  unsigned verb = 0;
  Vec3 p;
  if (at == text.npos || std::sscanf(text.c_str() + at, " verb %u (%lf, %lf, %lf)", &verb, &p.x(), &p.y(), &p.z()) != 4)
    return std::nullopt;
  if (verb == 0 || verb >= std::size(kVerbs)) return std::nullopt;
  std::string what = std::string("asked to ") + kVerbs[verb];
  if (verb == kGoTo || verb == kGoToFacing) what += " " + to_text(p);
  if (verb == kTakeOff && p.z() != 0) what += " to " + to_text(p.z(), 2) + " m";
  return Asked{what, verb != kEnable && verb != kRelease, verb >= kOfAir, verb == kRelease};
}

}  // namespace backwash::services
