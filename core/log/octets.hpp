// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace backwash::log {

/// Takes a record or a message apart, from its first byte to its last. `good` is false once something was asked for
/// that is not there; what it gives from then on is zero or empty.
class Octets {
 public:
  /// `aligned`: numbers begin at multiples of their size, counted from here, as CDR has them.
  explicit Octets(std::string_view bytes, bool aligned = false, bool swapped = false)
      : bytes_(bytes), aligned_(aligned), swapped_(swapped) {}
  bool good = true;

  template <typename T>
  T number() {
    if (aligned_) take((sizeof(T) - at_ % sizeof(T)) % sizeof(T));
    const std::string_view raw = take(sizeof(T));
    if (!good) return T{};
    char ordered[sizeof(T)];
    for (std::size_t n = 0; n < sizeof(T); ++n) ordered[n] = raw[swapped_ ? sizeof(T) - 1 - n : n];
    T value;
    std::memcpy(&value, ordered, sizeof value);
    return value;
  }
  std::string_view take(std::uint64_t size) {
    good = good && size <= bytes_.size() - at_;
    if (!good) return {};
    at_ += size;
    return bytes_.substr(at_ - size, size);
  }
  /// A length of four bytes and as many characters; CDR counts a zero at the end that is none.
  std::string_view text() {
    std::string_view all = take(number<std::uint32_t>());
    if (aligned_ && all.ends_with('\0')) all.remove_suffix(1);
    return all;
  }
  std::string_view rest() const { return bytes_.substr(at_); }

 private:
  static_assert(std::endian::native == std::endian::little);
  std::string_view bytes_;
  std::uint64_t at_ = 0;
  bool aligned_, swapped_;
};

}  // namespace backwash::log
