// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

namespace backwash::ctl {

/// What became of a command.
struct Outcome {
  std::string verb;
  bool accepted = false;
  std::optional<bool> done;  ///< with --wait
  std::string why;           ///< empty: accepted, and done if that was waited for
  bool good() const noexcept { return why.empty(); }
};

/// Says it: why not on stderr, with `json` the whole as one JSON object on stdout. Returns the exit code, 0 or 69.
int say(const Outcome& outcome, bool json);

}  // namespace backwash::ctl
