// SPDX-License-Identifier: BSD-3-Clause
#include "core/log/mcap_export.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include "core/log/mcap_writer.hpp"
#include "core/log/ros_messages.hpp"
#include "core/log/ros_schemas.hpp"
#include "core/log/tick_log.hpp"
#include "core/map/octomap_message.hpp"
#include "core/types/mode.hpp"

namespace backwash::log {
namespace {

enum Channel : std::size_t {
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
struct ChannelName {
  std::string_view topic, package, type;
};
/// In the order of Channel. odometry, trajectory and markers are named as the daemon's own topics.
constexpr std::array<ChannelName, kAutopilot + 1> kChannels{
    {{"/tf", "tf2_msgs", "TFMessage"},
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

/// Goes through the records in their order.
class Exporter {
 public:
  Exporter(std::ostream& out, const RawLog& log, std::string_view library, std::span<const AutopilotPose> autopilot)
      : writer_(out, library), autopilot_(autopilot), channels_(autopilot.empty() ? kAutopilot : kChannels.size()) {
    for (std::size_t n = 0; n < channels_; ++n) {
      const auto& [topic, package, type] = kChannels[n];
      numbers_[n] = writer_.add_channel(topic, std::string(package) + "/msg/" + std::string(type),
                                        ros_schema(std::string(package) + "/" + std::string(type)));
    }
    std::optional<std::int64_t> wall_ns;
    for (const RawRecord& record : log.records) {
      const auto* part = record.header.kind == RecordKind::part ? payload<PartRecord>(record) : nullptr;
      if (part && !wall_ns) wall_ns = part->wall_ns;
      // An offer may stand behind the ticks that fly it: it came by another thread.
      const auto* id = record.header.kind == RecordKind::offer ? payload<double>(record) : nullptr;
      if (id) offers_[*id] = &record;
    }
    wall_ns_ = wall_ns.value_or(0);
  }

  void take(const RawRecord& record) {
    take_poses_until(record.header.t_ns);
    now_ns_ = record.header.t_ns + wall_ns_;
    newest_ns_ = std::max(newest_ns_, now_ns_);
    Bytes raw(sizeof record.header);
    std::memcpy(raw.data(), &record.header, sizeof record.header);
    raw.insert(raw.end(), record.bytes.begin(), record.bytes.end());
    say(kRaw, ros::octets(raw));
    using enum RecordKind;
    const auto kind = record.header.kind;
    if (kind == odometry)
      if (const auto* row = payload<OdometryRecord>(record)) take_odometry(*row);
    if (kind == tick)
      if (const auto* row = payload<TickRecord>(record)) take_tick(*row);
    if (kind == RecordKind::map) take_map(record);
    const std::string_view text(reinterpret_cast<const char*>(record.bytes.data()), record.bytes.size());
    if (kind == command || kind == ack) say(kEvents, ros::line(now_ns_, ros::Level::info, text));
    if (kind == failure) say(kEvents, ros::line(now_ns_, ros::Level::error, text));
  }

  std::map<std::string, std::uint64_t> finish() {
    writer_.finish();
    std::map<std::string, std::uint64_t> messages;
    for (std::size_t n = 0; n < channels_; ++n) messages[std::string(kChannels[n].topic)] = messages_[n];
    return messages;
  }

 private:
  using Bytes = std::vector<std::uint8_t>;

  void say(Channel channel, const Bytes& cdr) {
    writer_.write(numbers_[channel],
                  {static_cast<std::uint64_t>(std::max<std::int64_t>(newest_ns_, 0)),
                   static_cast<std::uint64_t>(std::max<std::int64_t>(now_ns_, 0))},
                  cdr);
    ++messages_[channel];
  }

  /// The autopilot's poses up to a record; none before the first record.
  void take_poses_until(std::int64_t t_ns) {
    for (; !autopilot_.empty() && autopilot_.front().t_ns <= t_ns; autopilot_ = autopilot_.subspan(1)) {
      if (newest_ns_ == 0) continue;
      now_ns_ = autopilot_.front().t_ns + wall_ns_;
      newest_ns_ = std::max(newest_ns_, now_ns_);
      say(kAutopilot, ros::odometry(now_ns_, autopilot_.front().moving, {kAutopilotFrame, kAutopilotBody}));
    }
  }

  /// Where the autopilot's frame lies in the map, by one set-point in both.
  void place_autopilot(const TickRecord& row) {
    constexpr int kEvery = 50;  // ticks
    if (channels_ <= kAutopilot || placed_++ % kEvery != 0) return;
    const double yaw = row.cmd_yaw - row.local_yaw;
    const Eigen::AngleAxisd turn(yaw, Vec3::UnitZ());
    say(kTransform,
        ros::transform(now_ns_,
                       {{vec(row.cmd_p) - turn * vec(row.local_p)}, {std::cos(yaw / 2), 0, 0, std::sin(yaw / 2)}},
                       {ros::kMapFrame, kAutopilotFrame}));
  }

  void take_odometry(const OdometryRecord& row) {
    const ros::Moving vehicle{{vec(row.p), vec(row.v)}, {row.q[0], row.q[1], row.q[2], row.q[3]}};
    say(kOdometry, ros::odometry(now_ns_, vehicle));
    say(kTransform, ros::transform(now_ns_, vehicle));
  }

  void take_tick(const TickRecord& row) {
    const Setpoint command{vec(row.cmd_p), vec(row.cmd_v), vec(row.cmd_a), row.cmd_yaw};
    if ((row.sent & kSentSetpoint) != 0) {
      say(kSetpoint, ros::pose(now_ns_, command));
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
    if (std::exchange(segment_, row.segment) != row.segment) show(row.segment);
  }

  /// The trajectory that is flown from now on.
  void show(std::uint64_t segment) {
    const auto offered = offers_.find(static_cast<double>(segment));
    if (offered == offers_.end()) return;
    const auto flown = decode_offer(offered->second->bytes);
    if (!flown) return;
    say(kTrajectory, ros::path(now_ns_, (*flown)->commands));
    say(kMarkers, ros::markers(now_ns_, (*flown)->commands, (*flown)->tube));
    say(kScene, ros::scene(now_ns_, (*flown)->commands, (*flown)->tube));
  }

  void take_map(const RawRecord& record) {
    const auto* head = payload<MapRecord>(record);
    if (!head || !head->accepted) return;
    const std::span data(reinterpret_cast<const std::int8_t*>(record.bytes.data()) + sizeof *head,
                         record.bytes.size() - sizeof *head);
    if (const auto grid = map::decode_octomap(data, head->resolution, head->binary, "OcTree"))
      say(kMap, ros::voxels(now_ns_, *grid));
  }

  McapWriter writer_;
  std::span<const AutopilotPose> autopilot_;  ///< those that are still to come
  const std::size_t channels_;
  int placed_ = 0;
  std::array<std::uint16_t, kChannels.size()> numbers_{};
  std::array<std::uint64_t, kChannels.size()> messages_{};
  std::int64_t wall_ns_ = 0, now_ns_ = 0, newest_ns_ = 0;
  std::optional<std::pair<std::size_t, std::size_t>> mode_;  ///< and its reason
  std::uint64_t segment_ = 0;
  std::map<double, const RawRecord*> offers_;  ///< by the first of their numbers, the segment's
};

}  // namespace

std::map<std::string, std::uint64_t> export_mcap(std::ostream& out, const RawLog& log, std::string_view library,
                                                 std::span<const AutopilotPose> autopilot) {
  Exporter exporter(out, log, library, autopilot);
  for (const RawRecord& record : log.records) exporter.take(record);
  return exporter.finish();
}

}  // namespace backwash::log
