// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "core/config/file_hash.hpp"
#include "services/backwashd/map/map_parts.hpp"
#include "services/dds/map_sending.hpp"

namespace backwash::daemon {

constexpr std::int64_t kMs = 1'000'000, kSecond = 1000 * kMs;
constexpr WriterId kOne{1}, kAnother{2};

inline std::vector<std::uint8_t> bytes(std::size_t count) {
  std::mt19937 random(1);
  std::vector<std::uint8_t> data(count);
  std::ranges::generate(data, [&] { return static_cast<std::uint8_t>(random()); });
  return data;
}

/// Parts of a map of these bytes.
struct Map {
  explicit Map(std::size_t count) : data(bytes(count)) {
    part.transfer = 7;
    part.frame_id = dds::c_string(frame);
    part.id = dds::c_string(id);
    part.binary = true;
    part.resolution = 0.1;
    part.size = static_cast<std::uint32_t>(count);
    part.hash = config::fnv1a({reinterpret_cast<const char*>(data.data()), count});
  }
  dds::MapPart of(std::uint32_t number, std::int64_t sent_ns) {
    const std::size_t begin = number * dds::kPartBytes;
    const auto size = static_cast<std::uint32_t>(std::min(dds::kPartBytes, data.size() - begin));
    part.number = number;
    part.sent = static_cast<std::uint64_t>(sent_ns);
    part.data = {size, size, data.data() + begin, false};
    return part;
  }
  std::string frame = "map", id = "OcTree";
  std::vector<std::uint8_t> data;
  dds::MapPart part{};
};

}  // namespace backwash::daemon
