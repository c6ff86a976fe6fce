// SPDX-License-Identifier: BSD-3-Clause
#include "core/config/link_device.hpp"

#include <charconv>
#include <utility>

namespace backwash::config {
namespace {

constexpr std::pair<std::string_view, LinkDevice::Kind> kSockets[] = {
    {"udp:", LinkDevice::Kind::udp}, {"udpin:", LinkDevice::Kind::udpin}, {"tcp:", LinkDevice::Kind::tcp}};

/// The whole text as a number from 0 to `most`.
std::optional<unsigned> number(std::string_view text, unsigned most) {
  unsigned value = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failed != std::errc{} || end != text.data() + text.size() || value > most) return std::nullopt;
  return value;
}

bool numeric_ipv4(std::string_view text) {
  for (int dots = 3; dots > 0; --dots) {
    const auto dot = text.find('.');
    if (dot == text.npos || !number(text.substr(0, dot), 255)) return false;
    text.remove_prefix(dot + 1);
  }
  return number(text, 255).has_value();
}

}  // namespace

std::optional<LinkDevice> link_device(std::string_view text) {
  for (const auto& [scheme, kind] : kSockets) {
    if (!text.starts_with(scheme)) continue;
    text.remove_prefix(scheme.size());
    const auto colon = text.find(':');
    if (colon == text.npos || !numeric_ipv4(text.substr(0, colon))) return std::nullopt;
    const auto port = number(text.substr(colon + 1), 65535);
    if (!port || *port == 0) return std::nullopt;
    return LinkDevice{kind, std::string(text.substr(0, colon)), static_cast<std::uint16_t>(*port)};
  }
  return LinkDevice{LinkDevice::Kind::serial, std::string(text), 0};
}

}  // namespace backwash::config
