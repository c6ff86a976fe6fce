// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstring>
#include <optional>
#include <vector>

namespace backwash::log {

/// The T that begins at p, little-endian as this machine's own numbers; needs no alignment.
template <typename T>
T little(const std::uint8_t* p) noexcept {
  T value;
  std::memcpy(&value, p, sizeof value);
  return value;
}

/// Appends a number, little-endian.
template <typename T>
void put_little(std::vector<std::uint8_t>& bytes, T value) {
  bytes.resize(bytes.size() + sizeof value);
  std::memcpy(bytes.data() + bytes.size() - sizeof value, &value, sizeof value);
}

/// The number at p of a type by its letter, as ULog's reader and DataFlash name them: b, h, i, q are integers of 1, 2,
/// 4 and 8 bytes, capitals those without a sign, f and d floating point. Nothing: another letter.
inline std::optional<double> number_at(const std::uint8_t* p, char type) noexcept {
  switch (type) {
    case 'b':
      return little<std::int8_t>(p);
    case 'B':
      return little<std::uint8_t>(p);
    case 'h':
      return little<std::int16_t>(p);
    case 'H':
      return little<std::uint16_t>(p);
    case 'i':
      return little<std::int32_t>(p);
    case 'I':
      return little<std::uint32_t>(p);
    case 'q':
      return static_cast<double>(little<std::int64_t>(p));
    case 'Q':
      return static_cast<double>(little<std::uint64_t>(p));
    case 'f':
      return little<float>(p);
    case 'd':
      return little<double>(p);
    default:
      return std::nullopt;
  }
}

}  // namespace backwash::log
