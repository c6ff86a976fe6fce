// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/mcap/mcap_flight.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/log/mcap/ros_messages.hpp"
#include "core/log/mcap/ros_schemas.hpp"
#include "core/log/raw/tick_log.hpp"
#include "core/map/octomap/octomap_message.hpp"
#include "core/types/mode.hpp"

namespace backwash::log {

enum McapFlight::Channel : std::size_t {
  kTransform,
  kOdometry,
  kSetpoint,
  kTrajectory,
  kMarkers,
  kScene,
  kError,
  kMode,
  kReason,
  kEvents,
  kMap,
  kRaw,
  kAutopilot,  ///< the last: without its poses there is no such channel
};

namespace {

struct ChannelName {
  std::string_view topic, package, type;
};
/// In the order of Channel. odometry, trajectory and markers are named as the daemon's own topics.
constexpr std::array<ChannelName, 13> kChannels{{{"/tf", "tf2_msgs", "TFMessage"},
                                                 {"/backwash/odometry", "nav_msgs", "Odometry"},
                                                 {"/backwash/setpoint", "geometry_msgs", "PoseStamped"},
                                                 {"/backwash/trajectory", "nav_msgs", "Path"},
                                                 {"/backwash/markers", "visualization_msgs", "MarkerArray"},
                                                 {"/backwash/scene", "foxglove_msgs", "SceneUpdate"},
                                                 {"/backwash/error_over_bound", "geometry_msgs", "Vector3Stamped"},
                                                 {"/backwash/mode", "std_msgs", "String"},
                                                 {"/backwash/reason", "std_msgs", "String"},
                                                 {"/backwash/events", "rcl_interfaces", "Log"},
                                                 {"/backwash/voxels", "visualization_msgs", "MarkerArray"},
                                                 {kRawTopic, "std_msgs", "UInt8MultiArray"},
                                                 {kAutopilotTopic, "nav_msgs", "Odometry"}}};
constexpr std::string_view kAutopilotFrame = "autopilot", kAutopilotBody = "autopilot_body";

constexpr std::uint32_t kSentSetpoint = 1;  // of TickRecord::sent

Vec3 vec(const double* v) { return {v[0], v[1], v[2]}; }

}  // namespace

McapFlight::McapFlight(std::string_view library, const DrawnMaps& drawn, std::span<const AutopilotPose> autopilot)
    : writer_(library), drawn_(drawn), autopilot_(autopilot), of_autopilot_(!autopilot.empty()) {
  for (const auto& [topic, package, type] : kChannels)
    if (topic != kAutopilotTopic || of_autopilot_)
      writer_.add_channel(topic, std::string(package) + "/msg/" + std::string(type),
                          ros_schema(std::string(package) + "/" + std::string(type)));
}

void McapFlight::take(const RawRecord& record) {
  using enum RecordKind;
  const auto kind = record.header.kind;
  if (const auto* row = kind == part ? payload<PartRecord>(record) : nullptr; row && !wall_ns_) wall_ns_ = row->wall_ns;
  take_poses_until(record.header.t_ns);
  now_ns_ = record.header.t_ns + wall_ns_.value_or(0);
  newest_ns_ = std::max(newest_ns_, now_ns_);
  Bytes raw = ros::octets(sizeof record.header + record.bytes.size());
  const auto* header = reinterpret_cast<const std::uint8_t*>(&record.header);
  raw.insert(raw.end(), header, header + sizeof record.header);
  say(kRaw, raw, record.bytes);
  if (const auto* row = kind == odometry ? payload<OdometryRecord>(record) : nullptr) take_odometry(*row);
  if (const auto* row = kind == tick ? payload<TickRecord>(record) : nullptr) take_tick(*row);
  if (kind == offer) take_offer(record);
  const auto* head = kind == RecordKind::map ? payload<MapRecord>(record) : nullptr;
  if (head && head->accepted && record.bytes.size() - sizeof *head <= drawn_.largest) map_ = record;
  const std::string_view text(reinterpret_cast<const char*>(record.bytes.data()), record.bytes.size());
  if (kind == command || kind == ack) say(kEvents, ros::line(now_ns_, ros::Level::info, text));
  if (kind == failure) say(kEvents, ros::line(now_ns_, ros::Level::error, text));
  if (kind == lost) {
    mode_.reset();
    shown_ = segment_ == 0;
  }
  if (map_ && now_ns_ - drawn_ns_ >= drawn_.between_ns) show_map();
}

bool McapFlight::finish(const McapSink& sink) {
  if (map_) show_map();
  return writer_.finish(sink);
}

std::map<std::string, std::uint64_t> McapFlight::messages() const {
  std::map<std::string, std::uint64_t> messages;
  for (std::size_t n = 0; n < writer_.messages().size(); ++n)
    messages[std::string(kChannels[n].topic)] = writer_.messages()[n];
  return messages;
}

void McapFlight::say(Channel channel, const Bytes& cdr, std::span<const std::uint8_t> more) {
  writer_.write(static_cast<std::uint16_t>(channel + 1),
                {static_cast<std::uint64_t>(std::max<std::int64_t>(newest_ns_, 0)),
                 static_cast<std::uint64_t>(std::max<std::int64_t>(now_ns_, 0))},
                cdr, more);
}

/// The autopilot's poses up to a record; none before the first record.
void McapFlight::take_poses_until(std::int64_t t_ns) {
  for (; !autopilot_.empty() && autopilot_.front().t_ns <= t_ns; autopilot_ = autopilot_.subspan(1)) {
    if (newest_ns_ == 0) continue;
    now_ns_ = autopilot_.front().t_ns + wall_ns_.value_or(0);
    newest_ns_ = std::max(newest_ns_, now_ns_);
    say(kAutopilot, ros::odometry(now_ns_, autopilot_.front().moving, {kAutopilotFrame, kAutopilotBody}));
  }
}

/// Where the autopilot's frame lies in the map, by one set-point in both.
void McapFlight::place_autopilot(const TickRecord& row) {
  constexpr int kEvery = 50;  // ticks
  if (!of_autopilot_ || placed_++ % kEvery != 0) return;
  const double yaw = row.cmd_yaw - row.local_yaw;
  const Eigen::AngleAxisd turn(yaw, Vec3::UnitZ());
  say(kTransform,
      ros::transform(now_ns_,
                     {{vec(row.cmd_p) - turn * vec(row.local_p)}, {std::cos(yaw / 2), 0, 0, std::sin(yaw / 2)}},
                     {ros::kMapFrame, kAutopilotFrame}));
}

void McapFlight::take_odometry(const OdometryRecord& row) {
  const ros::Moving vehicle{{vec(row.p), vec(row.v)}, {row.q[0], row.q[1], row.q[2], row.q[3]}};
  say(kOdometry, ros::odometry(now_ns_, vehicle));
  say(kTransform, ros::transform(now_ns_, vehicle));
}

void McapFlight::take_tick(const TickRecord& row) {
  if ((row.sent & kSentSetpoint) != 0) {
    say(kSetpoint, ros::pose(now_ns_, {vec(row.cmd_p), vec(row.cmd_v), vec(row.cmd_a), row.cmd_yaw}));
    place_autopilot(row);
  }
  if (row.judged != 0) {
    const Vec3 half(row.half_widths[kX], row.half_widths[kY], row.half_widths[kZ]);
    say(kError, ros::vector(now_ns_, (vec(row.p) - vec(row.center)).cwiseQuotient(half)));
  }
  const std::pair now(std::min<std::size_t>(row.mode, kModeNames.size() - 1),
                      std::min<std::size_t>(row.reason, kReasonNames.size() - 1));
  if (mode_ != now) {
    mode_ = now;
    say(kMode, ros::text(kModeNames[now.first]));
    say(kReason, ros::text(kReasonNames[now.second]));
  }
  if (std::exchange(segment_, row.segment) != row.segment) shown_ = row.segment == 0;
  show_trajectory();
}

void McapFlight::take_offer(const RawRecord& record) {
  const auto* id = payload<double>(record);  // the first of its numbers
  if (!id || !(*id > 0 && *id < 9e15)) return;
  offers_[static_cast<std::uint64_t>(*id)] = record.bytes;
  if (offers_.size() > kOffers) offers_.erase(offers_.begin());  // refused ones, of a daemon that flies none of them
  show_trajectory();  // it may stand behind the ticks that fly it: it came by another thread
}

/// The trajectory that is flown from now on, once.
void McapFlight::show_trajectory() {
  const auto offered = offers_.find(segment_);
  if (shown_ || offered == offers_.end()) return;
  shown_ = true;
  offers_.erase(offers_.begin(), offered);
  const auto flown = decode_offer(offered->second);
  if (!flown) return;
  say(kTrajectory, ros::path(now_ns_, (*flown)->commands));
  say(kMarkers, ros::markers(now_ns_, (*flown)->commands, (*flown)->tube));
  say(kScene, ros::scene(now_ns_, (*flown)->commands, (*flown)->tube));
}

void McapFlight::show_map() {
  const RawRecord record = *std::exchange(map_, std::nullopt);
  const auto* head = payload<MapRecord>(record);
  const std::span data(reinterpret_cast<const std::int8_t*>(record.bytes.data()) + sizeof *head,
                       record.bytes.size() - sizeof *head);
  drawn_ns_ = now_ns_;
  if (const auto grid = map::decode_octomap(data, head->resolution, head->binary, "OcTree"))
    say(kMap, ros::voxels(now_ns_, *grid));
}

std::map<std::string, std::uint64_t> export_mcap(std::ostream& out, const RawLog& log, std::string_view library,
                                                 std::span<const AutopilotPose> autopilot) {
  McapFlight flight(library, {}, autopilot);
  // A stream need not go back: what was put last holds a whole chunk, and waits for its head.
  std::uint64_t held_at = 0;
  std::vector<std::uint8_t> held;
  const auto put = [&] {
    out.write(reinterpret_cast<const char*>(held.data()), static_cast<std::streamsize>(held.size()));
  };
  const McapSink sink = [&](std::uint64_t at, std::span<const std::uint8_t> bytes) {
    if (at < held_at + held.size()) {
      std::ranges::copy(bytes, held.begin() + static_cast<std::ptrdiff_t>(at - held_at));
    } else {
      put();
      held_at = at;
      held.assign(bytes.begin(), bytes.end());
    }
    return true;
  };
  for (const RawRecord& record : log.records) {
    flight.take(record);
    if (flight.writer().waiting() >= McapWriter::kChunk) flight.writer().flush(sink);
  }
  flight.finish(sink);
  put();
  return flight.messages();
}

}  // namespace backwash::log
