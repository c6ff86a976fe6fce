// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>

namespace backwash::services {

/// The name that was probably meant: the nearest by letters put in, left out or changed, at most one for three
/// letters said or begun, case aside. Empty: none is near.
std::string nearest(const std::string& said, std::span<const std::string> known);

/// A message of CLI11 about an option's number of values, in words that say what would be right; others as they are.
std::string in_plain_words(const std::string& message);

/// One line that no terminal obeys: control characters and bytes that are no UTF-8 as \xNN, a newline as a space.
std::string printable(const std::string& text);

/// Says `WHO: what` on stderr, as one printable line.
void say_error(const std::string& who, const std::string& what);

}  // namespace backwash::services
