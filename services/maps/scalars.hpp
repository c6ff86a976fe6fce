// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace backwash::maps {

/// A number as a binary file holds it.
struct Scalar {
  enum class Kind { is_signed, is_unsigned, floating } kind;
  std::size_t bytes;  ///< 1, 2, 4 or 8
};

/// The value of `bytes`, whose length is the scalar's.
double value_of(Scalar scalar, std::string_view bytes, std::endian order) noexcept;

/// A number that fills the whole text ("nan" and "inf" are numbers), or nothing.
std::optional<double> number_of(std::string_view text) noexcept;
/// A count that fills the whole text, or nothing.
std::optional<std::size_t> count_of(std::string_view text) noexcept;

/// Cuts the next line, without its end, off a text.
std::string_view take_line(std::string_view& text) noexcept;
/// Cuts the next word off a line; empty at its end.
std::string_view take_word(std::string_view& line) noexcept;

/// A text in quotes as an error tells it: its first 40 characters, control characters as '?'.
std::string shown(std::string_view text);

}  // namespace backwash::maps
