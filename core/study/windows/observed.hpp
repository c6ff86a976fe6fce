// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/study/windows/observation.hpp"
#include "core/study/windows/signals/delays.hpp"
#include "core/study/windows/signals/texture.hpp"

namespace backwash::study {

/// What an Observer keeps of flights until it is asked: of one flight, all that a study needs of its log. Nothing of
/// one flight depends on another's, so flights may be looked at anywhere and put together in their order.
struct Observed {
  Observations seen;
  Delays delays;
  std::vector<Fourth> tails;   ///< of every window
  std::set<std::string> ever;  ///< columns that some flight had
  bool strayed = false;        ///< some flight had set-points that it did not follow

  Observed() { seen.first.push_back(0); }
};

/// What was looked at, as bytes, and back again to the last bit. For the same program on machines of one byte order.
std::string packed(Observed flights);
/// Nothing where the bytes are none of packed(), or not all of them.
std::optional<Observed> unpacked(std::string_view bytes);

}  // namespace backwash::study
