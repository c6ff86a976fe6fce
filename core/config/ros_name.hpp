// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <string_view>

namespace backwash::config {

constexpr bool letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
constexpr bool digit(char c) { return c >= '0' && c <= '9'; }

constexpr std::size_t kLongestTopic = 255;  ///< what DDS takes

/// ROS 2's rules for names: tokens of letters, digits and underscores, none that begins with a digit or holds two
/// underscores in a row, between single slashes.
inline bool ros_name(std::string_view name, std::size_t longest) {
  if (name.empty() || name.size() > longest || name.find("__") != name.npos) return false;
  for (std::size_t at = 0; at <= name.size();) {
    const std::string_view token = name.substr(at, name.find('/', at) - at);
    if (token.empty() || digit(token[0])) return false;
    if (!std::ranges::all_of(token, [](char c) { return letter(c) || digit(c); })) return false;
    at += token.size() + 1;
  }
  return true;
}

/// As Linux allows (15 characters), and nothing that means something in the middleware's XML.
inline bool interface_name(std::string_view name) {
  constexpr std::string_view kMarks = ".:-@";
  return name.size() <= 15 &&
         std::ranges::all_of(name, [&](char c) { return letter(c) || digit(c) || kMarks.find(c) != kMarks.npos; });
}

}  // namespace backwash::config
