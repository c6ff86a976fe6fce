// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/status_output.hpp"

#include <cstdio>

namespace backwash::ctl {
namespace {

/// A member of the status and the key that JSON gives it: with the unit where the IDL says it in a comment.
template <typename T>
struct Member {
  const char* key;
  T dds::Status::*member;
};

constexpr Member<bool> kFlags[] = {
    {"armed", &dds::Status::armed},
    {"offboard", &dds::Status::offboard},
    {"landed", &dds::Status::landed},
    {"moving", &dds::Status::moving},
    {"frames_aligned", &dds::Status::frames_aligned},
};

constexpr Member<std::uint64_t> kCounts[] = {
    {"ticks", &dds::Status::ticks},
    {"ticks_missed", &dds::Status::ticks_missed},
    {"setpoints_sent", &dds::Status::setpoints_sent},
    {"samples_inside", &dds::Status::samples_inside},
    {"samples_outside", &dds::Status::samples_outside},
    {"odometry_received", &dds::Status::odometry_received},
    {"odometry_rejected", &dds::Status::odometry_rejected},
    {"odometry_refused", &dds::Status::odometry_refused},
    {"maps_accepted", &dds::Status::maps_accepted},
    {"maps_rejected", &dds::Status::maps_rejected},
    {"scans_accepted", &dds::Status::scans_accepted},
    {"scans_rejected", &dds::Status::scans_rejected},
    {"loop_closures", &dds::Status::loop_closures},
    {"closures_refused", &dds::Status::closures_refused},
    {"foreign_writers", &dds::Status::foreign_writers},
    {"commands_refused", &dds::Status::commands_refused},
    {"frames_bad", &dds::Status::frames_bad},
    {"frames_refused", &dds::Status::frames_refused},
    {"records_lost", &dds::Status::records_lost},
    {"page_faults", &dds::Status::page_faults},
    {"parts_filtered", &dds::Status::parts_filtered},
};

constexpr Member<double> kMeasures[] = {
    {"odometry_age_s", &dds::Status::odometry_age},
    {"odometry_lost_after_s", &dds::Status::odometry_lost_after},
    {"map_age_s", &dds::Status::map_age},
    {"heartbeat_age_s", &dds::Status::heartbeat_age},
    {"frame_residual_m", &dds::Status::frame_residual_m},
    {"frame_residual_rad", &dds::Status::frame_residual_rad},
    {"clock_offset_s", &dds::Status::clock_offset},
    {"clock_delay_s", &dds::Status::clock_delay},
};

nlohmann::json timing(const dds::Timing& t) { return {{"p50", t.p50}, {"p99", t.p99}, {"max", t.max}}; }

}  // namespace

std::string text_of(const nlohmann::json& json, int indent) {
  return json.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}

nlohmann::json json_of(const StatusCopy& s) {
  const auto& n = s.numbers;
  nlohmann::json all{{"position", {n.position.x, n.position.y, n.position.z}},
                     {"setpoint", {n.setpoint.x, n.setpoint.y, n.setpoint.z}},
                     {"parameters", s.parameters},
                     {"tick_us", timing(n.tick)},
                     {"lateness_us", timing(n.lateness)},
                     {"odometry_to_wire_us", timing(n.odometry_to_wire)}};
  for (const auto& [key, member] : kFlags) all[key] = n.*member;
  for (const auto& [key, member] : kCounts) all[key] = n.*member;
  for (const auto& [key, member] : kMeasures) all[key] = n.*member;
  for (const StatusText& t : kStatusTexts) all[t.key] = s.*t.own;
  return all;
}

void print(const StatusCopy& s) {
  const auto& n = s.numbers;
  std::printf("%s: %s (%s)  %s %s  at (%.2f, %.2f, %.2f)  inside %llu of %llu  ticks %llu, %llu missed  by %s\n",
              s.vehicle.c_str(), s.state.c_str(), s.reason.c_str(), n.armed ? "armed" : "disarmed",
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
