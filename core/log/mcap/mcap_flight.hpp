// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/log/autopilot/autopilot_flight.hpp"
#include "core/log/mcap/mcap_writer.hpp"
#include "core/log/raw/raw_log.hpp"

namespace backwash::log {

/// The channel of the autopilot's own poses, where there are any.
inline constexpr std::string_view kAutopilotTopic = "/autopilot/odometry";

/// Which of the accepted maps are drawn: a voxel takes 24 bytes, 60 times what a map of a building takes as octomap
/// data.
struct DrawnMaps {
  std::size_t largest = std::numeric_limits<std::size_t>::max();  ///< bytes of octomap data
  std::int64_t between_ns = 0;                                    ///< at least, to the newest since then
};

/// A raw log as an MCAP file: each record byte for byte on kRawTopic, and beside it what others read, ROS 2 messages of
/// what the VIO said, what was commanded, each accepted trajectory with its tube, mode and reason, the error against
/// its bound, commands and answers, the maps. Times are wall time by the first part record; without one (logs of
/// before) those of the daemon's monotonic clock. A message's log time never falls: it is the latest of the records so
/// far.
class McapFlight {
 public:
  /// `library`: who writes it. `autopilot`: what its own log says, rising in time; those within the time of the raw log
  /// are written in the frame `autopilot`, and once a second of set-points where that frame lies in the map.
  explicit McapFlight(std::string_view library, const DrawnMaps& drawn = {},
                      std::span<const AutopilotPose> autopilot = {});

  /// Adds a record, and what follows from it, to the writer's batch. One of records lost says anew what else may be
  /// lost: mode, reason and trajectory.
  void take(const RawRecord& record);
  /// Ends the file as McapWriter does.
  bool finish(const McapSink& sink);
  McapWriter& writer() noexcept { return writer_; }
  /// Messages in the file by topic.
  std::map<std::string, std::uint64_t> messages() const;

 private:
  enum Channel : std::size_t;
  using Bytes = std::vector<std::uint8_t>;

  void say(Channel channel, const Bytes& cdr, std::span<const std::uint8_t> more = {});
  void take_poses_until(std::int64_t t_ns);
  void place_autopilot(const TickRecord& row);
  void take_odometry(const OdometryRecord& row);
  void take_tick(const TickRecord& row);
  void take_offer(const RawRecord& record);
  void show_trajectory();
  void show_map();

  McapWriter writer_;
  const DrawnMaps drawn_;
  std::span<const AutopilotPose> autopilot_;  ///< those that are still to come
  bool of_autopilot_;                         ///< there were any
  int placed_ = 0;
  std::optional<std::int64_t> wall_ns_;
  std::int64_t now_ns_ = 0, newest_ns_ = 0;
  std::optional<std::pair<std::size_t, std::size_t>> mode_;  ///< and its reason
  std::uint64_t segment_ = 0;                                ///< that is flown
  bool shown_ = true;                                        ///< it was, or it is none
  static constexpr std::size_t kOffers = 8;                  ///< kept until one is flown
  std::map<std::uint64_t, Bytes> offers_;                    ///< by segment: that and those after it
  std::optional<RawRecord> map_;                             ///< accepted, not drawn yet
  std::int64_t drawn_ns_ = std::numeric_limits<std::int64_t>::min() / 2;
};

/// The whole log as one such file. Gives the messages by topic; whether the stream took everything is the stream's to
/// tell.
std::map<std::string, std::uint64_t> export_mcap(std::ostream& out, const RawLog& log, std::string_view library,
                                                 std::span<const AutopilotPose> autopilot = {});

}  // namespace backwash::log
