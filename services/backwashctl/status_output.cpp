// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/status_output.hpp"

#include <cmath>
#include <cstdio>

namespace backwash::ctl {
namespace {

nlohmann::json member_json(const dds::Timing& t) { return {{"p50", t.p50}, {"p99", t.p99}, {"max", t.max}}; }
nlohmann::json member_json(const geometry_msgs_msg_dds__Point_& p) { return {p.x, p.y, p.z}; }
template <typename T>
nlohmann::json member_json(const T& said) {
  return said;
}

template <typename... T>
std::string printed(const char* format, T... value) {
  char line[96];
  std::snprintf(line, sizeof line, format, value...);
  return line;
}

std::string member_text(const dds::Timing& t) {
  return printed("%.0f / %.0f / %.0f µs", static_cast<double>(t.p50), static_cast<double>(t.p99),
                 static_cast<double>(t.max));
}
std::string member_text(const geometry_msgs_msg_dds__Point_& p) { return printed("%.2f, %.2f, %.2f", p.x, p.y, p.z); }
std::string member_text(std::uint64_t count) { return std::to_string(count); }
std::string member_text(double s) { return !std::isfinite(s) ? "none yet" : s < 0 ? "none" : printed("%.2f s", s); }
std::string member_text(const char* text) { return text; }

}  // namespace

std::string text_of(const nlohmann::json& json, int indent) {
  return json.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}

nlohmann::json json_of(const StatusCopy& s) {
  nlohmann::json all{{"parameters", s.parameters}};
  dds::each_status_member([&](const auto& member) { all[member.key] = member_json(s.said.*member.at); });
  return all;
}

std::vector<std::pair<std::string, std::string>> rows_of(const StatusCopy& s) {
  std::vector<std::pair<std::string, std::string>> rows;
  dds::each_status_member([&](const auto& member) {
    if constexpr (requires { member_text(s.said.*member.at); })
      if (std::string text = member.on_page ? member_text(s.said.*member.at) : ""; !text.empty())
        rows.emplace_back(member.on_page, std::move(text));
  });
  return rows;
}

void print(const StatusCopy& s) {
  const auto& n = s.said;
  std::printf("%s: %s (%s)  %s %s  at (%.2f, %.2f, %.2f)  inside %llu of %llu  ticks %llu, %llu missed  by %s\n",
              n.vehicle, n.state, n.reason, n.armed ? "armed" : "disarmed",
              n.landed ? "on the ground" : (n.moving ? "flying" : "hovering"), n.position.x, n.position.y, n.position.z,
              static_cast<unsigned long long>(n.samples_inside),
              static_cast<unsigned long long>(n.samples_inside + n.samples_outside),
              static_cast<unsigned long long>(n.ticks), static_cast<unsigned long long>(n.ticks_missed),
              controller(s).c_str());
  std::fflush(stdout);
}

nlohmann::ordered_json json_of(const std::optional<dds::AirSaid>& air) {
  nlohmann::ordered_json classes = nlohmann::ordered_json::array();
  if (air)
    for (const auto& [name, factor, ln_evidence, seconds, cause] : air->classes)
      classes.push_back({{"class", name},
                         {"factor", factor},
                         {"ln_evidence", ln_evidence},
                         {"seconds", seconds},
                         {"cause", cause.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(cause)}});
  return {{"learns", air.has_value()}, {"frozen", air && air->frozen}, {"classes", classes}};
}

void print(const std::optional<dds::AirSaid>& air) {
  if (!air) return void(std::printf("nothing is learnt of the air: adaptation.enabled is false\n"));
  if (air->frozen) std::printf("frozen: the factors stay as they are until thawed\n");
  if (air->classes.empty()) std::printf("as modelled; nothing was flown yet\n");
  for (const auto& [name, factor, ln_evidence, seconds, cause] : air->classes)
    std::printf("%-9s factor %.2f%s%s%s, ln evidence %.1f, %.0f s of flight\n", name.c_str(), factor,
                factor < 1 ? " (calmer)" : "", cause.empty() ? "" : ", by ", cause.c_str(), ln_evidence, seconds);
}

}  // namespace backwash::ctl
