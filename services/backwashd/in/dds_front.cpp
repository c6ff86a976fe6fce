// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/in/dds_front.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iterator>
#include <thread>

#include "services/backwashd/channels.hpp"
#include "services/backwashd/out/shown_diagnostics.hpp"
#include "services/backwashd/out/shown_status.hpp"
#include "services/backwashd/text.hpp"
#include "services/parallel/real_time.hpp"

namespace backwash::daemon {
namespace {

// Odometry, closures and commands are small; one of 64 waypoints takes 2 kB.
constexpr std::size_t kMaxSampleBytes = 64u << 10;

template <typename T>
std::string topic_of(const config::Daemon& config) {
  return dds::topic(config.dds.name_space, dds::TopicOf<T>::kName);
}

/// Topics outside of the name space.
std::vector<std::string> others_of(const config::Daemon& config) {
  std::vector<std::string> all{config.dds.odometry_topic};
  if (config.dds.tf != config::Transforms::none) all.push_back(dds::kTf);
  return all;
}

/// From a stamp to now by the clock that the sender stamps with, s: this machine's monotonic one, or its wall clock.
/// Nothing: it is neither. For what is told before a flight alone: nothing that flies asks the wall clock.
std::optional<double> on_the_way(std::int64_t stamp_ns) {
  constexpr double kSame = 1;  // s that a message is on its way at most
  const std::int64_t wall_ns =
      std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch()).count();
  for (const std::int64_t clock_ns : {now_ns(), wall_ns})
    if (const double way = seconds(clock_ns - stamp_ns); way >= 0 && way < kSame) return way;
  return std::nullopt;
}

}  // namespace

DdsFront::DdsFront(const config::Daemon& config, int priority, const Vehicle& vehicle, Channels& channels)
    : channels_(channels),
      priority_(priority),
      name_space_(config.dds.name_space),
      localization_(config, vehicle.estimation.position),
      check_(config.odometry.twist, config.odometry.timing),
      drift_(config.odometry.twist, vehicle.estimation.position),
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
                   {.priority = priority,
                    .max_sample_bytes = kMaxSampleBytes,
                    .topics = dds::topics(config.dds.name_space, others_of(config))},
                   config.dds.security),
      poses_(participant_, config),
      closures_(dds::make_reader<dds::TransformStamped>(participant_, config.dds.name_space)),
      commands_(dds::make_reader<dds::Command>(participant_, config.dds.name_space)),
      foreign_(participant_, {&poses_.reader(), &closures_, &commands_}),
      acks_(dds::make_writer<dds::Ack>(participant_, config.dds.name_space)),
      status_(dds::make_writer<dds::Status>(participant_, config.dds.name_space)),
      diagnostics_(participant_, diagnostic_msgs_msg_dds__DiagnosticArray__desc, dds::kDiagnostics,
                   config.dds),  // the newest alone: a reader that takes nothing holds up no thread
      battery_(participant_, config.dds),
      transforms_(config),
      statuses_(participant_, topic_of<dds::Status>(config), status_.guid()),
      waitset_(participant_) {
  if (config.dds.tf != config::Transforms::none)
    tf_.emplace(participant_, tf2_msgs_msg_dds__TFMessage__desc, dds::kTf, config.dds, dds::Delivery::sent_tf);
  waitset_.add(poses_.reader());
  waitset_.add(closures_);
  waitset_.add(commands_);
  waitset_.add_departures(commands_);  // or the next process's first command would find the session held
  look_for_other_daemons();            // before the mission hears a command
}

// As it came, also where it is refused: a doubt says why, and what to set.
void DdsFront::look_at_odometry(const dds::Odometry& m) {
  const auto& p = m.pose.pose.position;
  const auto& q = m.pose.pose.orientation;
  const auto& v = m.twist.twist.linear;
  const std::int64_t stamp_ns = dds::nanoseconds(m.header.stamp);
  const auto why = check_.look(stamp_ns, {p.x, p.y, p.z}, {q.w, q.x, q.y, q.z}, {v.x, v.y, v.z}, on_the_way(stamp_ns));
  if (!why) return;
  Line line{};
  std::snprintf(line.data(), line.size(), "%s", why->c_str());
  channels_.odometry_doubt.write(line);
  if (!why->empty()) spdlog::warn("{}; nothing is enabled meanwhile", *why);
}

void DdsFront::take_odometry(const dds::Odometry& m, const dds::Guid& writer) {
  if (!odometry_writer_.hears(writer))
    return refusals_.add(channels_.odometry_refused, [&] { return odometry_writer_.refusal(writer); });
  look_at_odometry(m);
  const auto sample = localization_.odometry(m, now_ns());
  if (!sample) return refusals_.add(channels_.odometry_refused, [&] { return sample.error(); });
  tell_closures();
  if (odometry_writer_.bind(writer)) spdlog::info("odometry is taken from writer {}", dds::text(writer));
  if (const auto told = drift_.look(*sample))
    spdlog::log(told->warns ? spdlog::level::warn : spdlog::level::info, "{}", told->line);
  channels_.odometry.write(*sample);
  if (!channels_.poses.push(*sample))
    refusals_.add(poses_lost_, [] { return "a pose to place scans by: 512 others wait for the map reader"; });
  transforms_.add(*sample);
}

void DdsFront::take_poses() {
  const auto refuse = [&](const PoseTakers::Why& why) { refusals_.add(channels_.odometry_refused, why); };
  poses_.take({[&](const auto& m, const auto& writer) { take_odometry(m, writer); },
               [&](const auto& m, const auto& writer) { take_closure(m, writer); }, refuse});
  const auto departed = poses_.departed();
  odometry_writer_.let_go(departed, !commanding_, now_ns());
  let_closures_go(departed);  // a TFMessage may have held them
}

void DdsFront::take_closure(const dds::TransformStamped& m, const dds::Guid& writer) {
  if (!closure_writer_.hears(writer))
    return refusals_.add(channels_.closures_refused, [&] { return closure_writer_.refusal(writer); });
  const auto taken = localization_.loop_closure(m);
  if (!taken) return refusals_.add(channels_.closures_refused, [&] { return taken.error(); });
  if (closure_writer_.bind(writer)) spdlog::info("loop closures are taken from writer {}", dds::text(writer));
  tell_closures();
}

void DdsFront::tell_closures() {
  if (channels_.loop_closures.exchange(localization_.closures()) == localization_.closures()) return;
  channels_.map_from_odom.write(*localization_.map_from_odom());
  transforms_.close(*localization_.map_from_odom());
}

// What the next writer said was refused while this one was not known to be gone; it is said once.
void DdsFront::let_closures_go(std::span<const dds::Guid> departed) {
  if (closure_writer_.let_go(departed, !commanding_, now_ns())) closures_.renew(waitset_);
}

void DdsFront::take_closures() {
  closures_.take([&](const dds::TransformStamped& m, const dds::Guid& writer) { take_closure(m, writer); });
  let_closures_go(closures_.departed());
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
  ControlRecord record;
  char* line = reinterpret_cast<char*>(record.bytes.data());
  const int length =
      std::snprintf(line, record.bytes.size(), "%s %llu %u verb %u (%.3f, %.3f, %.3f) yaw %.3f writer %s",
                    c.station.data(), static_cast<unsigned long long>(c.session), c.sequence, c.verb, c.position.x(),
                    c.position.y(), c.position.z(), c.yaw, dds::text(writer).c_str());
  const std::size_t size = std::min(static_cast<std::size_t>(std::max(length, 0)), record.bytes.size() - 1);
  record.header = {now_ns(), log::RecordKind::command, static_cast<std::uint32_t>(size)};
  channels_.command_log.push_or_count(record);
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

void DdsFront::look_for_other_daemons() {
  const auto other = statuses_.first();
  const auto why = others_.look(other, now_ns());
  if (!why) return;
  Line line{};
  std::snprintf(line.data(), line.size(), "%s", why->c_str());
  channels_.other_daemon.write(line);
  if (other)
    spdlog::error("{}: it obeys the same commands; nothing is enabled here meanwhile", *why);
  else if (why->empty())
    spdlog::info("no other daemon in this namespace");
}

void DdsFront::run_readers() {
  if (priority_ > 0) set_fifo(priority_);
  while (!channels_.stop) {
    waitset_.wait(0.1);
    take_closures();  // before the odometry that it is about
    take_poses();
    look_for_other_daemons();
    take_commands();
    if (const auto news = foreign_.take_new(); news.count > 0) {
      channels_.foreign_writers += news.count - 1;
      refusals_.add(channels_.foreign_writers, [&] { return printable(news.first, 240) + ": it is not listened to"; });
    }
  }
}

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
    ShownStatus shown(view, vehicle, channels_);
    dds::Status& s = shown.message();
    s.records_lost = channels_.records_lost() + recorder.lost();
    s.task = task.data();
    s.place = place.data();
    s.refused = refused.data();
    s.session = accepted.session;
    s.sequence_number = accepted.sequence;
    status_.write(s);
    if (const auto& moved = transforms_.message(now_ns()); tf_ && moved.transforms._length > 0) tf_->write(moved);
    const auto now = firmware_bridge::Time::clock::now();
    if (const auto* battery = shown_battery_.next(view.battery, now, dds::nanoseconds(s.stamp)))
      battery_.write(*battery);
    if (rounds++ % kDiagnosticsEvery == 0) diagnostics_.write(ShownDiagnostics(s, name_space_).message());
  }
}

void DdsFront::send(const CommandMessage& command, const Answer& answer) {
  const std::string station(command.station.data());
  dds::Ack ack{
      dds::c_string(station), command.session, command.sequence, answer.result, dds::c_string(answer.reason), {}};
  std::ranges::copy(command.writer, ack.writer);
  acks_.write(ack);
}

}  // namespace backwash::daemon
