// SPDX-License-Identifier: BSD-3-Clause
// The status's thread: what the other threads have said, as one message ten times a second.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cstdio>
#include <thread>
#include <vector>

#include "services/backwashd/dds_front.hpp"
#include "services/backwashd/doubts.hpp"
#include "services/backwashd/shown_diagnostics.hpp"
#include "services/backwashd/shown_segment.hpp"
#include "services/backwashd/text.hpp"
#include "services/dds/air_text.hpp"
#include "services/dds/packet_filter.hpp"
#include "services/dds/strangers.hpp"
#include "services/dds/topics.hpp"

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

/// Owns what a message only points to, until it is sent.
struct StatusStrings {
  std::string state, reason, mismatch, stop_switch, autopilot, version, warning, air;
  std::string asking;
  Doubts doubts;
  std::vector<firmware_bridge::ParameterFinding> findings;
  std::vector<dds::Parameter> parameters;
  std::vector<dds::Advice> advice;
};

StatusStrings strings_of(const ControlView& view, const Vehicle& vehicle) {
  constexpr auto kWarningShown = std::chrono::seconds(10);
  StatusStrings text{
      to_string(view.mode),
      to_string(view.reason),
      to_string(view.mismatch),
      std::string(name(view.stop_switch)),
      std::string(view.autopilot->name),
      view.version ? fmt::format("{}.{}.{}", view.version->major, view.version->minor, view.version->patch) : "",
      {},
      view.air ? to_string(*view.air) : "",
      {},
      {},
      {},
      {},
      {}};
  text.doubts = doubts_of(view, vehicle);
  text.findings = firmware_bridge::judge_parameters(*view.autopilot, view.parameters, vehicle, view.untold_delay);
  for (const auto& [what, doubt] : text.doubts)
    text.advice.push_back({const_cast<char*>(what), dds::c_string(doubt)});  // a literal
  std::size_t asking = 0;
  for (const auto& finding : text.findings) {
    asking += finding.asking;
    if (finding.asking) continue;
    char* const name = const_cast<char*>(finding.name.data());  // a literal, which ends
    if (finding.value) text.parameters.push_back({name, *finding.value});
    if (!finding.good) text.advice.push_back({name, dds::c_string(finding.advice)});
  }
  if (asking > 0) {
    text.asking = fmt::format("asking: {} of {} are known", text.findings.size() - asking, text.findings.size());
    text.advice.push_back({const_cast<char*>(dds::kAsking), dds::c_string(text.asking)});
  }
  if (view.warning && firmware_bridge::Time::clock::now() - view.warning->at < kWarningShown)
    text.warning = printable(view.warning->value.text.data());
  return text;
}

void set_view(dds::Status& s, const ControlView& view, StatusStrings& text) {
  s.state = dds::c_string(text.state);
  s.reason = dds::c_string(text.reason);
  s.armed = view.armed && view.heartbeat_age < ControlView::kNever;
  s.offboard = view.offboard;
  s.landed = view.landed.value_or(false);
  s.moving = !view.finished;
  s.frames_aligned = view.aligned;
  s.position = point(view.state.p_W);
  s.setpoint = point(view.command.p_W);
  s.ticks = view.ticks;
  s.ticks_missed = view.missed;
  s.setpoints_sent = view.setpoints;
  s.samples_inside = view.inside;
  s.samples_outside = view.outside;
  s.odometry_received = view.odometry_received;
  s.odometry_rejected = view.odometry_rejected;
  s.frames_bad = view.frames_bad;
  s.frames_refused = view.frames_refused;
  s.page_faults = view.page_faults;
  s.frame_residual_m = view.residual_m;
  s.frame_residual_rad = view.residual_rad;
  s.odometry_age = view.odometry_age;
  s.odometry_lost_after = view.odometry_lost_after;
  s.heartbeat_age = view.heartbeat_age;
  s.clock_offset = view.clock ? seconds(view.clock->offset_ns) : 0;
  s.clock_delay = view.clock ? 0.5 * seconds(view.clock->round_trip_ns) : kNotKnown;
  s.mismatch = dds::c_string(text.mismatch);
  s.stop_switch = dds::c_string(text.stop_switch);
  s.tick = timing(view.tick);
  s.lateness = timing(view.lateness);
  s.odometry_to_wire = timing(view.odometry_to_wire);
  s.autopilot = dds::c_string(text.autopilot);
  s.autopilot_says = dds::c_string(text.warning);
  s.air = dds::c_string(text.air);
  s.autopilot_version = dds::c_string(text.version);
  s.parameters = sequence<decltype(s.parameters)>(text.parameters);
  s.advice = sequence<decltype(s.advice)>(text.advice);
}

void set_counts(dds::Status& s, const Channels& channels) {
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

}  // namespace

void DdsFront::run_status(const Vehicle& vehicle, const Recorder& recorder) {
  ControlView view;
  CommandId accepted;
  Line task{}, place{}, refused{};
  auto next = std::chrono::steady_clock::now();
  constexpr int kDiagnosticsEvery = 10;
  int rounds = 0;
  while (!channels_.stop) {
    next += std::chrono::milliseconds(100);
    std::this_thread::sleep_until(next);
    if (const auto newest = channels_.task.read_new()) task = *newest;
    if (const auto newest = channels_.accepted.read_new()) accepted = *newest;
    if (const auto newest = channels_.view_status.read_new()) view = *newest;
    if (const auto newest = channels_.place.read_new()) place = *newest;
    for (auto* line : {&channels_.refused, &channels_.refused_map})
      if (const auto newest = line->read_new()) refused = *newest;
    commanding_ = track::commanding(view.mode);
    StatusStrings text = strings_of(view, vehicle);
    dds::Status s{};
    s.stamp = dds::wall_clock();
    s.vehicle = dds::c_string(vehicle.name);
    set_view(s, view, text);
    set_counts(s, channels_);
    s.records_lost = channels_.records_lost() + recorder.lost();
    s.task = task.data();
    s.place = place.data();
    s.refused = refused.data();
    s.session = accepted.session;
    s.sequence_number = accepted.sequence;
    status_.write(s);
    if (const auto& shown = transforms_.message(now_ns()); tf_ && shown.transforms._length > 0) tf_->write(shown);
    const auto now = firmware_bridge::Time::clock::now();
    if (const auto* shown = shown_battery_.next(view.battery, now, dds::nanoseconds(s.stamp))) battery_.write(*shown);
    if (rounds++ % kDiagnosticsEvery == 0) diagnostics_.write(ShownDiagnostics(s, name_space_).message());
  }
}

}  // namespace backwash::daemon
