// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string_view>
#include <type_traits>
#include <vector>

#include "core/log/little_endian.hpp"

namespace backwash::log {

/// A ROS 2 message as the bytes that go over the wire: plain CDR, little-endian, behind the four bytes that say so.
/// Each number is aligned to its own size, counted from behind those four.
class CdrWriter {
 public:
  template <typename T>
  void number(T value) {
    static_assert(std::is_arithmetic_v<T>);
    while ((bytes_.size() - kHead) % sizeof value != 0) bytes_.push_back(0);
    put_little(bytes_, value);
  }
  /// Elements that follow in a sequence.
  void count(std::size_t elements) { number(static_cast<std::uint32_t>(elements)); }
  void text(std::string_view text) {
    count(text.size() + 1);
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    bytes_.push_back(0);
  }
  const std::vector<std::uint8_t>& bytes() const noexcept { return bytes_; }

 private:
  static constexpr std::size_t kHead = 4;
  std::vector<std::uint8_t> bytes_{0, 1, 0, 0};
};

}  // namespace backwash::log
