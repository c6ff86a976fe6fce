// SPDX-License-Identifier: BSD-3-Clause
#include "core/files/base64.hpp"

#include <array>
#include <cstdint>

namespace backwash::files {
namespace {

constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

constexpr std::array<int, 256> values() {
  std::array<int, 256> value{};
  value.fill(-1);
  for (std::size_t k = 0; k < kLetters.size(); ++k)
    value[static_cast<unsigned char>(kLetters[k])] = static_cast<int>(k);
  return value;
}
constexpr std::array<int, 256> kValues = values();

}  // namespace

std::string base64(std::string_view bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : kLetters[three >> (18 - 6 * k) & 63u];
  }
  return text;
}

std::optional<std::string> from_base64(std::string_view text) {
  if (text.size() % 4 != 0) return std::nullopt;
  const std::size_t padding = text.ends_with("==") ? 2 : text.ends_with('=') ? 1 : 0;
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3);
  for (std::size_t i = 0; i < text.size(); i += 4) {
    std::uint32_t four = 0;
    for (std::size_t k = i; k < i + 4; ++k) {
      const int value = k + padding >= text.size() ? 0 : kValues[static_cast<unsigned char>(text[k])];
      if (value < 0) return std::nullopt;
      four = four << 6 | static_cast<std::uint32_t>(value);
    }
    for (const unsigned shift : {16u, 8u, 0u}) bytes += static_cast<char>(four >> shift & 255u);
  }
  for (std::size_t k = 0; k < padding; ++k) bytes.pop_back();
  return bytes;
}

}  // namespace backwash::files
