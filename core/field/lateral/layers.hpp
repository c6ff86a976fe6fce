// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace backwash::field {

/// 128 bits with the operators of an unsigned integer that the sweep uses, for targets whose compiler has none as wide
/// (32-bit ARM). Shifts by 0 … 127.
class TwoWords {
 public:
  constexpr TwoWords(std::uint64_t lower = 0, std::uint64_t upper = 0) noexcept : lower_(lower), upper_(upper) {}
  explicit constexpr operator std::uint64_t() const noexcept { return lower_; }
  friend constexpr bool operator==(const TwoWords&, const TwoWords&) = default;
  constexpr TwoWords operator~() const noexcept { return {~lower_, ~upper_}; }
  constexpr TwoWords& operator|=(const TwoWords& b) noexcept {
    lower_ |= b.lower_;
    upper_ |= b.upper_;
    return *this;
  }
  friend constexpr TwoWords operator&(const TwoWords& a, const TwoWords& b) noexcept {
    return {a.lower_ & b.lower_, a.upper_ & b.upper_};
  }
  friend constexpr TwoWords operator-(const TwoWords& a, const TwoWords& b) noexcept {
    return {a.lower_ - b.lower_, a.upper_ - b.upper_ - (a.lower_ < b.lower_ ? 1 : 0)};
  }
  friend constexpr TwoWords operator<<(const TwoWords& a, int n) noexcept {
    if (n >= 64) return {0, a.lower_ << (n - 64)};
    return n == 0 ? a : TwoWords{a.lower_ << n, a.upper_ << n | a.lower_ >> (64 - n)};
  }
  friend constexpr TwoWords operator>>(const TwoWords& a, int n) noexcept {
    if (n >= 64) return a.upper_ >> (n - 64);
    return n == 0 ? a : TwoWords{a.lower_ >> n | a.upper_ << (64 - n), a.upper_ >> n};
  }

 private:
  std::uint64_t lower_, upper_;
};

/// The occupied layers of a column, one bit each.
#ifdef __SIZEOF_INT128__
__extension__ using Layers = unsigned __int128;
#else
using Layers = TwoWords;
#endif

}  // namespace backwash::field
