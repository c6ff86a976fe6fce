// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/dds_front.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <thread>

#include "services/backwashd/text.hpp"
#include "services/dds/packet_filter.hpp"
#include "services/parallel/real_time.hpp"

namespace backwash::daemon {
namespace {

// Odometry, closures and commands are small; one of 64 waypoints takes 2 kB.
constexpr std::size_t kMaxSampleBytes = 64u << 10;
// After which a bound odometry writer that is gone is let go of: by then an enabling that it began has ended.
constexpr std::int64_t kForget_ns = 500'000'000;

template <typename T>
std::string topic_of(const config::Daemon& config) {
  return dds::topic(config.dds.name_space, dds::TopicOf<T>::kName);
}

geometry_msgs_msg_dds__Point_ point(const Vec3& p) { return {p.x(), p.y(), p.z()}; }

dds::Timing timing(const TimingHistogram& h) {
  return {static_cast<float>(h.quantile(0.5)), static_cast<float>(h.quantile(0.99)), static_cast<float>(h.max_us)};
}

}  // namespace

DdsFront::DdsFront(const config::Daemon& config, int priority, const Vehicle& vehicle, Channels& channels,
                   Recorder& recorder)
    : channels_(channels),
      recorder_(recorder),
      priority_(priority),
      localization_(config, vehicle.estimation.position),
      refusals_(channels.refused),
      malformed_({{config.dds.odometry_topic, &channels.odometry_refused},
                  {topic_of<dds::Octomap>(config), &channels.maps_rejected},
                  {topic_of<dds::PointCloud>(config), &channels.scans_rejected},
                  {topic_of<dds::TransformStamped>(config), &channels.closures_refused},
                  {topic_of<dds::Command>(config), &channels.commands_refused}},
                 [](std::string_view line, std::int64_t left_out) {
                   spdlog::warn("DDS: {} ({} more left out)", printable(line, 240), left_out);
                 }),
      participant_(static_cast<std::uint32_t>(config.dds.domain), config.dds.interface,
                   {.priority = priority, .max_sample_bytes = kMaxSampleBytes}),
      odometry_(participant_, dds::TopicOf<dds::Odometry>::type(), config.dds.odometry_topic,
                dds::TopicOf<dds::Odometry>::kDelivery),
      closures_(dds::make_reader<dds::TransformStamped>(participant_, config.dds.name_space)),
      commands_(dds::make_reader<dds::Command>(participant_, config.dds.name_space)),
      foreign_(participant_, {&odometry_, &closures_, &commands_}),
      acks_(dds::make_writer<dds::Ack>(participant_, config.dds.name_space)),
      status_(dds::make_writer<dds::Status>(participant_, config.dds.name_space)),
      waitset_(participant_) {
  waitset_.add(odometry_);
  waitset_.add(closures_);
  waitset_.add(commands_);
}

void DdsFront::take_odometry() {
  odometry_.take([&](const dds::Odometry& m, const dds::Guid& writer) {
    if (bound_ && *bound_ != writer)
      return refusals_.add(channels_.odometry_refused, [&] {
        return "odometry of writer " + dds::text(writer) + ": that of " + dds::text(*bound_) +
               (gone_ns_ ? ", which is gone, was flown with: disable first" : " is in use");
      });
    const auto sample = localization_.odometry(m, now_ns());
    if (!sample) return refusals_.add(channels_.odometry_refused, [&] { return sample.error(); });
    if (!bound_) spdlog::info("odometry is taken from writer {}", dds::text(writer));
    bound_ = writer;
    channels_.odometry.write(*sample);
    channels_.poses.push(*sample);
  });
  for (const dds::Guid& gone : odometry_.departed())
    if (bound_ == gone) gone_ns_ = now_ns();
  if (!gone_ns_ || commanding_ || now_ns() - *gone_ns_ < kForget_ns) return;
  bound_.reset();
  gone_ns_.reset();
}

void DdsFront::take_closures() {
  closures_.take([&](const dds::TransformStamped& m) {
    const auto taken = localization_.loop_closure(m);
    if (!taken) return refusals_.add(channels_.closures_refused, [&] { return taken.error(); });
    channels_.loop_closures = localization_.closures();
    channels_.map_from_odom.write(*localization_.map_from_odom());
  });
}

// A writer that floods us is cut to what can be carried out, before it costs anything: else it would fill the mission's
// ring and the raw log, and keep the reader from the odometry. Its STOPs have an allowance of their own, and a STOP
// waits for room.
void DdsFront::take_command(const dds::Command& m, const dds::Guid& writer) {
  const bool stops = m.verb == backwash_msgs_msg_dds__COMMAND_STOP;
  if (!allowances_[writer][stops ? 0 : 1].take(now_ns()))
    return refusals_.add(channels_.commands_refused,
                         [&] { return "commands of writer " + dds::text(writer) + ": more than 50 a second"; });
  CommandMessage c;
  c.writer = writer;
  std::snprintf(c.station.data(), c.station.size(), "%s", printable(m.station ? m.station : "").c_str());
  c.session = m.session;
  c.sequence = m.sequence_number;
  c.verb = m.verb;
  c.position = {m.position.x, m.position.y, m.position.z};
  c.yaw = m.yaw;
  c.waypoints = m.waypoints._length;
  for (std::size_t n = 0; n < std::min(c.waypoints, c.kMostWaypoints); ++n)
    c.waypoint[n] = {m.waypoints._buffer[n].x, m.waypoints._buffer[n].y, m.waypoints._buffer[n].z};
  char line[320];
  std::snprintf(line, sizeof line, "%s %llu %u verb %u (%.3f, %.3f, %.3f) yaw %.3f writer %s", c.station.data(),
                static_cast<unsigned long long>(c.session), c.sequence, c.verb, c.position.x(), c.position.y(),
                c.position.z(), c.yaw, dds::text(writer).c_str());
  recorder_.append(study::RecordKind::command, line);
  if (channels_.commands.push(c)) return;
  if (stops) stop_ = c;
  refusals_.add(channels_.commands_refused, [] { return "a command: 64 others wait to be answered"; });
}

// After what they said last. Who finds no room is told of in the next round.
void DdsFront::tell_of_departed() {
  std::ranges::copy(commands_.departed(), std::back_inserter(gone_));
  while (!gone_.empty()) {
    CommandMessage c;
    c.writer = gone_.back();
    c.departed = true;
    if (!channels_.commands.push(c)) return;
    allowances_.erase(gone_.back());
    gone_.pop_back();
  }
}

void DdsFront::take_commands() {
  commands_.take([&](const dds::Command& m, const dds::Guid& writer) { take_command(m, writer); });
  if (stop_ && channels_.commands.push(*stop_)) stop_.reset();
  tell_of_departed();
}

void DdsFront::run_readers() {
  if (priority_ > 0) set_fifo(priority_);
  while (!channels_.stop) {
    waitset_.wait(0.1);
    take_closures();  // before the odometry that it is about
    take_odometry();
    take_commands();
    if (const auto writers = foreign_.take_new()) {
      channels_.foreign_writers += writers;
      spdlog::warn("{} writers on our topics have another type: they are not listened to", writers);
    }
  }
}

void DdsFront::send(const CommandMessage& command, const Answer& answer) {
  const std::string station(command.station.data());
  const dds::Ack ack{dds::c_string(station), command.session, command.sequence, answer.result,
                     dds::c_string(answer.reason)};
  acks_.write(ack);
  recorder_.append(study::RecordKind::ack, station + " " + std::to_string(command.sequence) + " result " +
                                               std::to_string(answer.result) + ": " + answer.reason);
}

void DdsFront::run_status(const Vehicle& vehicle) {
  ControlView view;
  Line task{}, place{}, refused{};
  const std::vector<std::string> names(kParameters.begin(), kParameters.end());
  auto next = std::chrono::steady_clock::now();
  while (!channels_.stop) {
    next += std::chrono::milliseconds(100);
    std::this_thread::sleep_until(next);
    if (const auto newest = channels_.task.read_new()) task = *newest;
    if (const auto newest = channels_.view_status.read_new()) view = *newest;
    if (const auto newest = channels_.place.read_new()) place = *newest;
    for (auto* line : {&channels_.refused, &channels_.refused_map})
      if (const auto newest = line->read_new()) refused = *newest;
    commanding_ = view.mode != track::Mode::passive && view.mode != track::Mode::quiet;
    const std::string mode = to_string(view.mode), reason = to_string(view.reason);
    const std::string mismatch = to_string(view.mismatch);
    const std::string stop_switch(name(view.stop_switch));
    dds::Status s{};
    s.stamp = dds::wall_clock();
    s.vehicle = dds::c_string(vehicle.name);
    s.state = dds::c_string(mode);
    s.reason = dds::c_string(reason);
    s.task = task.data();
    s.armed = view.armed;
    s.offboard = view.offboard;
    s.landed = view.landed;
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
    s.maps_accepted = channels_.maps_accepted;
    s.maps_rejected = channels_.maps_rejected;
    s.scans_accepted = channels_.scans_accepted;
    s.scans_rejected = channels_.scans_rejected;
    s.odometry_refused = channels_.odometry_refused;
    s.loop_closures = channels_.loop_closures;
    s.closures_refused = channels_.closures_refused;
    s.foreign_writers = channels_.foreign_writers;
    const std::int64_t map_ns = channels_.map_ns;
    s.map_age = map_ns < 0 ? -1 : static_cast<double>(now_ns() - map_ns) * 1e-9;
    s.commands_refused = channels_.commands_refused;
    s.stop_switch = dds::c_string(stop_switch);
    s.frames_bad = view.frames_bad;
    s.frames_refused = view.frames_refused;
    s.records_lost = channels_.control_log.lost() + recorder_.lost();
    s.page_faults = view.page_faults;
    s.frame_residual_m = view.residual_m;
    s.frame_residual_rad = view.residual_rad;
    s.odometry_age = view.odometry_age;
    s.heartbeat_age = view.heartbeat_age;
    s.clock_offset = view.clock ? 1e-9 * static_cast<double>(view.clock->offset_ns) : 0;
    s.clock_delay = view.clock ? 0.5e-9 * static_cast<double>(view.clock->round_trip_ns) : -1;
    s.mismatch = dds::c_string(mismatch);
    s.place = place.data();
    s.parts_filtered = dds::filtered_parts();
    s.refused = refused.data();
    std::array<dds::Parameter, kParameters.size()> parameters{};
    std::uint32_t known = 0;
    for (std::size_t n = 0; n < kParameters.size(); ++n)
      if (view.parameters[n]) parameters[known++] = {dds::c_string(names[n]), *view.parameters[n]};
    s.parameters = {known, known, parameters.data(), false};
    s.tick = timing(view.tick);
    s.lateness = timing(view.lateness);
    s.odometry_to_wire = timing(view.odometry_to_wire);
    status_.write(s);
  }
}

}  // namespace backwash::daemon
