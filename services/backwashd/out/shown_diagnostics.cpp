// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/out/shown_diagnostics.hpp"

#include <cstdio>
#include <string_view>
#include <utility>

namespace backwash::daemon {
namespace {

std::string text(const char* s) { return s ? s : ""; }

std::string number(const char* format, double value) {
  char line[48];
  std::snprintf(line, sizeof line, format, value);
  return line;
}

/// What is wrong beside the mode, if anything; the first of them.
std::string doubt(const dds::Status& s) {
  if (!(s.odometry_age <= s.odometry_lost_after)) return "no odometry";
  if (const std::string in = text(s.mismatch); !in.empty() && in != "none") return "map and autopilot disagree: " + in;
  if (s.samples_outside > 0) return std::to_string(s.samples_outside) + " samples outside their sets";
  if (s.advice._length > 0)
    return "parameter " + text(s.advice._buffer[0].name) + ": " + text(s.advice._buffer[0].text);
  return "";
}

/// Quiet in the air is an error: nobody of ours steers. Whatever ended or holds a flight is a warning, also where an
/// operator asked for it.
std::uint8_t level_of(const dds::Status& s, bool doubted) {
  const std::string_view state = s.state;
  if (state == "quiet" && !s.landed) return ShownDiagnostics::kError;
  const bool held = state == "hold" || state == "land" || state == "quiet";
  return held || doubted ? ShownDiagnostics::kWarn : ShownDiagnostics::kOk;
}

}  // namespace

void ShownDiagnostics::add(std::string key, std::string value) {
  char* const name = texts_.emplace_back(std::move(key)).data();
  values_.push_back({name, texts_.emplace_back(std::move(value)).data()});
}

ShownDiagnostics::ShownDiagnostics(const dds::Status& s, const std::string& name_space)
    : name_("backwashd: " + text(s.vehicle)) {
  static const std::string nowhere;
  const std::string why = doubt(s);
  said_ = text(s.state) + ": " + text(s.reason) + (why.empty() ? "" : "; " + why);
  dds::each_status_member([&]<typename T>(const dds::StatusMember<T>& member) {
    if (!member.diagnosed) return;
    if constexpr (std::is_same_v<T, char*>)
      add(member.key, text(s.*member.at));
    else if constexpr (std::is_same_v<T, dds::Timing>)
      add(std::string(member.key) + "_p99", number(member.diagnosed, static_cast<double>((s.*member.at).p99)));
    else if constexpr (std::is_same_v<T, double>)
      add(member.key, number(member.diagnosed, s.*member.at));
    else if constexpr (std::is_integral_v<T>)
      add(member.key, std::to_string(s.*member.at));
  });
  const auto count = static_cast<std::uint32_t>(values_.size());
  status_ = {level_of(s, !why.empty()),
             dds::c_string(name_),
             dds::c_string(said_),
             dds::c_string(name_space),
             {count, count, values_.data(), false}};
  message_ = {{s.stamp, dds::c_string(nowhere)}, {1, 1, &status_, false}};
}

}  // namespace backwash::daemon
