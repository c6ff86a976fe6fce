// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashd/dds_front.hpp"

#include <spdlog/spdlog.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <thread>
#include <utility>

#include "services/parallel/real_time.hpp"

namespace backwash::daemon {
namespace {

// The frame that everything on our topics is in.
const std::string kMapFrame = "map";

builtin_interfaces_msg_dds__Time_ wall_clock() {
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  const auto s = std::chrono::duration_cast<std::chrono::seconds>(since);
  return {static_cast<std::int32_t>(s.count()),
          static_cast<std::uint32_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(since - s).count())};
}

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
      sensor_range_(config.map.sensor_range),
      localization_(config, vehicle.estimation.position),
      malformed_({{config.dds.odometry_topic, &channels.odometry_refused},
                  {topic_of<dds::Octomap>(config), &channels.maps_rejected},
                  {topic_of<dds::PointCloud>(config), &channels.scans_rejected},
                  {topic_of<dds::TransformStamped>(config), &channels.closures_refused},
                  {topic_of<dds::Command>(config), &channels.commands_refused}},
                 [](std::string_view line) { spdlog::warn("DDS: {}", line); }),
      participant_(static_cast<std::uint32_t>(config.dds.domain), config.dds.interface, priority),
      odometry_(participant_, dds::TopicOf<dds::Odometry>::type(), config.dds.odometry_topic,
                dds::TopicOf<dds::Odometry>::kDelivery),
      maps_(dds::make_reader<dds::Octomap>(participant_, config.dds.name_space)),
      scans_(dds::make_reader<dds::PointCloud>(participant_, config.dds.name_space)),
      closures_(dds::make_reader<dds::TransformStamped>(participant_, config.dds.name_space)),
      commands_(dds::make_reader<dds::Command>(participant_, config.dds.name_space)),
      foreign_(participant_),
      acks_(dds::make_writer<dds::Ack>(participant_, config.dds.name_space)),
      status_(dds::make_writer<dds::Status>(participant_, config.dds.name_space)),
      tube_(dds::make_writer<dds::Tube>(participant_, config.dds.name_space)),
      trajectory_(dds::make_writer<dds::Path>(participant_, config.dds.name_space)),
      waitset_(participant_) {
  waitset_.add(odometry_);
  waitset_.add(maps_);
  waitset_.add(scans_);
  waitset_.add(closures_);
  waitset_.add(commands_);
}

void DdsFront::refuse(std::atomic<std::uint64_t>& counter, const std::string& why) {
  constexpr std::int64_t kPause_ns = 1'000'000'000;
  ++counter;
  auto& said_ns = said_ns_[&counter];
  if (now_ns() - said_ns < kPause_ns) return;
  said_ns = now_ns();
  spdlog::warn("refused: {}", why);
}

void DdsFront::take_odometry() {
  odometry_.take([&](const dds::Odometry& m) {
    if (const auto sample = localization_.odometry(m, now_ns()))
      channels_.odometry.write(*sample);
    else
      refuse(channels_.odometry_refused, sample.error());
  });
}

void DdsFront::take_closures() {
  closures_.take([&](const dds::TransformStamped& m) {
    if (const auto taken = localization_.loop_closure(m); !taken) refuse(channels_.closures_refused, taken.error());
    channels_.loop_closures = localization_.closures();
  });
}

void DdsFront::take_scans() {
  if (const auto* newest = channels_.worlds.reader.take())
    channels_.worlds.reader.give_back(std::exchange(world_, newest));
  scans_.take([&](const dds::PointCloud& m) {
    auto scan = localization_.scan(m, now_ns());
    if (!scan) return refuse(channels_.scans_rejected, scan.error());
    std::size_t fresh = 0;
    if (world_) {
      const NewVoxels voxels = new_voxels(world_->world->grid, *scan, sensor_range_);
      fresh = voxels.count;
      if (fresh > 0) channels_.scan_voxels.push(voxels);
    }
    recorder_.append(study::RecordKind::scan, "scan of " + std::to_string(scan->points_W.size()) + " points, " +
                                                  std::to_string(fresh) + " new voxels");
    auto owned = std::make_unique<Scan>(std::move(*scan));
    if (channels_.scans.push(owned.get()))
      owned.release();
    else
      refuse(channels_.scans_rejected, "a scan: the map worker has 16 waiting");
  });
}

void DdsFront::take_maps() {
  maps_.take([&](const dds::Octomap& m) {
    MapMessage message;
    message.data.assign(reinterpret_cast<const std::int8_t*>(m.data._buffer),
                        reinterpret_cast<const std::int8_t*>(m.data._buffer) + m.data._length);
    message.resolution = m.resolution;
    message.binary = m.binary;
    message.id = m.id ? m.id : "";
    message.received_ns = now_ns();
    channels_.maps.offer(std::make_unique<const MapMessage>(std::move(message)));
  });
}

void DdsFront::take_commands() {
  commands_.take([&](const dds::Command& m) {
    CommandMessage c;
    std::snprintf(c.station.data(), c.station.size(), "%s", m.station ? m.station : "");
    c.session = m.session;
    c.sequence = m.sequence_number;
    c.verb = m.verb;
    c.position = {m.position.x, m.position.y, m.position.z};
    c.yaw = m.yaw;
    c.waypoints = m.waypoints._length;
    for (std::size_t n = 0; n < std::min(c.waypoints, c.kMostWaypoints); ++n)
      c.waypoint[n] = {m.waypoints._buffer[n].x, m.waypoints._buffer[n].y, m.waypoints._buffer[n].z};
    char line[256];
    std::snprintf(line, sizeof line, "%s %llu %u verb %u (%.3f, %.3f, %.3f) yaw %.3f", c.station.data(),
                  static_cast<unsigned long long>(c.session), c.sequence, c.verb, c.position.x(), c.position.y(),
                  c.position.z(), c.yaw);
    recorder_.append(study::RecordKind::command, line);
    if (!channels_.commands.push(c)) ++channels_.commands_refused;
  });
}

void DdsFront::run_readers() {
  if (priority_ > 0) set_fifo(priority_);
  while (!channels_.stop) {
    waitset_.wait(0.1);
    take_closures();  // before the odometry that it is about
    take_odometry();
    take_scans();
    take_commands();
    take_maps();
    if (const auto writers = foreign_.count(); writers != channels_.foreign_writers) {
      channels_.foreign_writers = writers;
      spdlog::warn("a writer on one of our topics has another type: it is not listened to ({} so far)", writers);
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

void DdsFront::send(const track::AcceptedSegment& segment) {
  const std_msgs_msg_dds__Header_ header{wall_clock(), dds::c_string(kMapFrame)};
  std::vector<dds::TubeStep> steps;
  std::vector<dds::PoseStamped> poses;
  for (const auto& s : segment.tube) {
    dds::TubeStep step{s.t, point(s.center.p_W), {}};
    std::copy(s.half_widths_interval.begin(), s.half_widths_interval.end(), step.half_widths);
    steps.push_back(step);
  }
  for (const Setpoint& c : segment.commands)
    poses.push_back({header, {point(c.p_W), {0, 0, std::sin(c.yaw / 2), std::cos(c.yaw / 2)}}});
  dds::Tube tube{};
  tube.header = header;
  tube.steps = {static_cast<std::uint32_t>(steps.size()), static_cast<std::uint32_t>(steps.size()), steps.data(),
                false};
  tube_.write(tube);
  dds::Path path{};
  path.header = header;
  path.poses = {static_cast<std::uint32_t>(poses.size()), static_cast<std::uint32_t>(poses.size()), poses.data(),
                false};
  trajectory_.write(path);
}

void DdsFront::run_status(const Vehicle& vehicle) {
  ControlView view;
  std::array<char, 192> task{}, place{};
  const std::vector<std::string> names(kParameters.begin(), kParameters.end());
  auto next = std::chrono::steady_clock::now();
  while (!channels_.stop) {
    next += std::chrono::milliseconds(100);
    std::this_thread::sleep_until(next);
    if (const auto newest = channels_.task.read_new()) task = *newest;
    if (const auto newest = channels_.view_status.read_new()) view = *newest;
    if (const auto newest = channels_.place.read_new()) place = *newest;
    const std::string mode = to_string(view.mode), reason = to_string(view.reason);
    const std::string mismatch = to_string(view.mismatch);
    dds::Status s{};
    s.stamp = wall_clock();
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
    s.frames_bad = view.frames_bad;
    s.records_lost = channels_.control_log.lost() + recorder_.lost();
    s.page_faults = view.page_faults;
    s.frame_residual_m = view.residual_m;
    s.frame_residual_rad = view.residual_rad;
    s.odometry_age = view.odometry_age;
    s.heartbeat_age = view.heartbeat_age;
    s.mismatch = dds::c_string(mismatch);
    s.place = place.data();
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
