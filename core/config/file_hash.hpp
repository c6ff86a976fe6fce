// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "core/config/config.hpp"

namespace backwash::config {

/// 64-bit FNV-1a of these bytes, going on from `hash`.
constexpr std::uint64_t fnv1a(std::string_view bytes, std::uint64_t hash = 0xcbf29ce484222325) noexcept {
  for (const char byte : bytes) hash = (hash ^ static_cast<std::uint8_t>(byte)) * 0x100000001b3;
  return hash;
}

/// Of the texts of a vehicle and a model file, or of the built-in ones: tells files apart, and is no proof against
/// anybody. Error: one of them cannot be read.
tl::expected<std::uint64_t, ConfigError> hash_of_files(const std::string& vehicle, const std::string& model);

}  // namespace backwash::config
