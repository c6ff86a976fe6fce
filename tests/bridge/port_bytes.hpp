// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <unistd.h>

#include <array>
#include <numeric>

#include "tests/bridge/pseudo_terminal.hpp"

namespace backwash::firmware_bridge::test {

/// 0, 1, … 255.
inline Bytes every_byte() {
  Bytes bytes(256);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  return bytes;
}

/// Reads until `size` bytes have come, for at most a second.
template <class AnyPort>
Bytes read_all(AnyPort& port, std::size_t size) {
  Bytes all;
  std::array<std::uint8_t, 512> chunk;
  for (int i = 0; i < 1000 && all.size() < size; ++i) {
    const auto n = port.read(chunk);
    if (!n) break;
    all.insert(all.end(), chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(*n));
    if (*n == 0) ::usleep(1000);
  }
  return all;
}

}  // namespace backwash::firmware_bridge::test
