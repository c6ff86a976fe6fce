// SPDX-License-Identifier: BSD-3-Clause
#include "services/dds/air_text.hpp"

#include <algorithm>
#include <cstdio>
#include <string_view>

namespace backwash::dds {
namespace {

constexpr std::string_view kFrozen = "frozen: ", kModelled = "as modelled", kBetween = ", ", kNext = "), ";

std::optional<AirSaid::Class> class_said(const std::string& text) {
  char name[16], cause[16] = "";
  AirSaid::Class said;
  int factor = 0, caused = 0, end = 0;
  if (std::sscanf(text.c_str(), "%15s %lf%n by %15s%n", name, &said.factor, &factor, cause, &caused) < 2)
    return std::nullopt;
  const std::size_t left = static_cast<std::size_t>(std::max(factor, caused));
  const int read = std::sscanf(text.c_str() + left, " (%lf, %lf s)%n", &said.ln_evidence, &said.seconds, &end);
  if (read != 2 || left + static_cast<std::size_t>(end) != text.size()) return std::nullopt;
  said.name = name;
  said.cause = cause;
  return said;
}

}  // namespace

std::string to_text(const AirSaid& air) {
  std::string text;
  for (const auto& [name, factor, ln_evidence, seconds, cause] : air.classes) {
    char line[96];
    std::snprintf(line, sizeof line, "%s %.2f%s%s (%.1f, %.0f s)", name.c_str(), factor, cause.empty() ? "" : " by ",
                  cause.c_str(), ln_evidence, seconds);
    if (!text.empty()) text += kBetween;
    text += line;
  }
  if (text.empty()) text = kModelled;
  return air.frozen ? std::string(kFrozen) += text : text;
}

std::optional<AirSaid> air_said(const std::string& text) {
  AirSaid air;
  air.frozen = text.starts_with(kFrozen);
  std::string left = text.substr(air.frozen ? kFrozen.size() : 0);
  if (left == kModelled) return air;
  while (!left.empty()) {
    const std::size_t end = left.find(kNext);
    const auto said = class_said(left.substr(0, end == std::string::npos ? end : end + 1));
    if (!said) return std::nullopt;
    air.classes.push_back(*said);
    left = end == std::string::npos ? "" : left.substr(end + kNext.size());
  }
  return air.classes.empty() ? std::nullopt : std::optional(air);
}

}  // namespace backwash::dds
