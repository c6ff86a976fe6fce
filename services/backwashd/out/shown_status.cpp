// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/out/shown_status.hpp"

#include <spdlog/fmt/fmt.h>

#include <utility>

#include "services/backwashd/channels.hpp"
#include "services/backwashd/out/shown_segment.hpp"
#include "services/backwashd/text.hpp"
#include "services/dds/air_text.hpp"
#include "services/dds/guard/packet_filter.hpp"
#include "services/dds/guard/strangers.hpp"

namespace backwash::daemon {
namespace {

constexpr double kNotKnown = -1;  // s: an age or a delay that nothing was measured for yet

dds::Timing timing(const TimingHistogram& h) {
  return {static_cast<float>(h.quantile(0.5)), static_cast<float>(h.quantile(0.99)), static_cast<float>(h.max_us)};
}

/// A view of what the vector owns.
template <typename Sequence, typename T>
Sequence sequence(std::vector<T>& values) {
  const auto count = static_cast<std::uint32_t>(values.size());
  return {count, count, values.data(), false};
}

std::string to_string(const AirView& air) {
  dds::AirSaid said{air.frozen, {}};
  for (std::size_t k = 0; k < kAirClasses; ++k)
    if (air.seconds[k] > 0 || air.factors[k] > 1)
      said.classes.push_back({to_string(static_cast<AirClass>(k)), air.factors[k], air.ln_evidence[k], air.seconds[k],
                              air.causes[k] == adapt::Cause::none ? "" : to_string(air.causes[k])});
  return to_text(said);
}

}  // namespace

ShownStatus::ShownStatus(const ControlView& view, const Vehicle& vehicle, const Channels& channels)
    : message_(view.shown) {
  message_.stamp = dds::wall_clock();
  message_.vehicle = dds::c_string(vehicle.name);
  take_view(view);
  take_parameters(view, vehicle);
  take_counts(channels);
}

void ShownStatus::take_view(const ControlView& view) {
  constexpr auto kWarningShown = std::chrono::seconds(10);
  dds::Status& s = message_;
  s.state = keep(to_string(view.mode));
  s.reason = keep(to_string(view.reason));
  s.armed = view.armed && view.heartbeat_age < ControlView::kNever;
  s.offboard = view.offboard;
  s.landed = view.landed.value_or(false);
  s.moving = !view.finished;
  s.position = point(view.state.p_W);
  s.setpoint = point(view.command.p_W);
  s.ticks = view.ticks;
  s.frame_residual_m = view.residual_m;
  s.odometry_age = view.odometry_age;
  s.odometry_lost_after = view.odometry_lost_after;
  s.heartbeat_age = view.heartbeat_age;
  s.clock_offset = view.clock ? seconds(view.clock->offset_ns) : 0;
  s.clock_delay = view.clock ? 0.5 * seconds(view.clock->round_trip_ns) : kNotKnown;
  s.mismatch = keep(to_string(view.mismatch));
  s.stop_switch = keep(std::string(name(view.stop_switch)));
  s.tick = timing(view.tick);
  s.lateness = timing(view.lateness);
  s.odometry_to_wire = timing(view.odometry_to_wire);
  s.autopilot = keep(std::string(view.autopilot->name));
  const bool warns = view.warning && firmware_bridge::Time::clock::now() - view.warning->at < kWarningShown;
  s.autopilot_says = keep(warns ? printable(view.warning->value.text.data()) : "");
  s.air = keep(view.air ? to_string(*view.air) : "");
  const auto& version = view.version;
  s.autopilot_version = keep(version ? fmt::format("{}.{}.{}", version->major, version->minor, version->patch) : "");
}

void ShownStatus::take_parameters(const ControlView& view, const Vehicle& vehicle) {
  doubts_ = doubts_of(view, vehicle);
  findings_ = firmware_bridge::judge_parameters(*view.autopilot, view.parameters, vehicle, view.untold_delay);
  for (const auto& [what, doubt] : doubts_)
    advice_.push_back({const_cast<char*>(what), dds::c_string(doubt)});  // a literal
  std::size_t asking = 0;
  for (const auto& finding : findings_) {
    asking += finding.asking;
    if (finding.asking) continue;
    char* const name = const_cast<char*>(finding.name.data());  // a literal, which ends
    if (finding.value) parameters_.push_back({name, *finding.value});
    if (!finding.good) advice_.push_back({name, dds::c_string(finding.advice)});
  }
  if (asking > 0)
    advice_.push_back({const_cast<char*>(dds::kAsking),
                       keep(fmt::format("asking: {} of {} are known", findings_.size() - asking, findings_.size()))});
  message_.parameters = sequence<decltype(message_.parameters)>(parameters_);
  message_.advice = sequence<decltype(message_.advice)>(advice_);
}

void ShownStatus::take_counts(const Channels& channels) {
  dds::Status& s = message_;
  s.maps_accepted = channels.maps_accepted;
  s.maps_rejected = channels.maps_rejected;
  s.scans_accepted = channels.scans_accepted;
  s.scans_rejected = channels.scans_rejected;
  s.odometry_refused = channels.odometry_refused;
  s.loop_closures = channels.loop_closures;
  s.closures_refused = channels.closures_refused;
  s.foreign_writers = channels.foreign_writers;
  s.map_age = channels.map_age(now_ns()).value_or(kNotKnown);
  s.commands_refused = channels.commands_refused;
  s.parts_filtered = dds::filtered_parts() + dds::kept_out_parts();
}

}  // namespace backwash::daemon
