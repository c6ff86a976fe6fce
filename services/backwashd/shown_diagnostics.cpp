// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/shown_diagnostics.hpp"

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

void ShownDiagnostics::add(const char* key, std::string value) {
  texts_.at(count_) = std::move(value);
  values_.at(count_) = {const_cast<char*>(key), dds::c_string(texts_.at(count_))};  // a literal, which ends
  ++count_;
}

ShownDiagnostics::ShownDiagnostics(const dds::Status& s, const std::string& name_space)
    : name_("backwashd: " + text(s.vehicle)) {
  static const std::string nowhere;
  const std::string why = doubt(s);
  said_ = text(s.state) + ": " + text(s.reason) + (why.empty() ? "" : "; " + why);
  add("task", text(s.task));
  add("place", text(s.place));
  add("refused", text(s.refused));
  add("odometry_age_s", number("%.3f", s.odometry_age));
  add("heartbeat_age_s", number("%.3f", s.heartbeat_age));
  add("map_age_s", number("%.1f", s.map_age));
  add("ticks_missed", std::to_string(s.ticks_missed));
  add("tick_us_p99", number("%.0f", s.tick.p99));
  add("samples_inside", std::to_string(s.samples_inside));
  add("samples_outside", std::to_string(s.samples_outside));
  status_ = {level_of(s, !why.empty()),
             dds::c_string(name_),
             dds::c_string(said_),
             dds::c_string(name_space),
             {count_, count_, values_.data(), false}};
  message_ = {{s.stamp, dds::c_string(nowhere)}, {1, 1, &status_, false}};
}

}  // namespace backwash::daemon
