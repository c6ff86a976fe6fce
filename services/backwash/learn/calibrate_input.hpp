// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/study/calibrate/height_effect.hpp"
#include "core/types/model.hpp"
#include "services/backwash/learn/log_notes.hpp"
#include "services/command_line/command_line.hpp"

namespace backwash::services {

/// Logs and the maps that they were flown in, as on the command line.
struct CampaignFiles {
  std::vector<std::string> maps;
  struct Log {
    std::string path;
    std::optional<std::size_t> map;  ///< the --map before it
  };
  std::vector<Log> logs;
};
/// Logs behind the last --map.
void append(std::vector<CampaignFiles::Log>& logs, const std::vector<std::string>& given, const CampaignFiles& files);
/// --map and --log, both as often as wanted.
void add_campaign_options(Command& command, CampaignFiles& files);
/// each_readable() of the logs, with the place of each among the maps, 0 without one. Throws Failure 64 for a log
/// that follows no map where there are several, or where another log follows the only one; and for a map without logs.
void each_readable(const CampaignFiles& files, LogNotes& notes,
                   const std::function<void(const std::string& log, std::size_t place)>& read);

/// What a calibration keeps of one log; its flight is numbered 0.
struct CalibratedLog {
  std::string path;
  std::optional<std::size_t> map;  ///< its place; none: without a map
  study::Signal signal = study::Signal::raw;
  std::array<std::size_t, study::kHoverGates> gated{};
  std::vector<std::string> not_tested;
  std::size_t windows = 0;
  std::vector<study::calibrate::Hover> hovers;
  std::vector<study::calibrate::HeightRow> heights;  ///< without a map
};

/// Flight logs, cut into windows.
struct Campaign {
  study::calibrate::Data data;
  std::vector<map::OccupancyGrid> maps;  ///< by place; a flat floor if none was given
  std::vector<std::string> map_names, logs;
  std::string signal;  ///< of all flights
  bool pushes;         ///< all flights have set-points
  std::array<std::size_t, study::kHoverGates> gated{};
  std::vector<std::string> not_tested;
  std::size_t windows = 0;
  LogNotes notes;
  std::optional<study::calibrate::HeightEffect> height;  ///< without a map: what the logs say of height and ceiling
};

/// The maps by place: those of `files`, or a flat floor.
Campaign empty_campaign(const CampaignFiles& files);
/// Reads each log and gives what it is worth to `take`. Without a map the floor is flat, at the log's `surface_z_m` or
/// z = 0, and passes count as hovers: the height effect holds the speed fixed. What cannot be read, or lies elsewhere
/// than in its map, is left out and noted. Throws Failure with the file that is at fault, where none is left.
void read_logs(const CampaignFiles& files, const std::vector<map::OccupancyGrid>& maps,
               const std::optional<Vehicle>& vehicle, const Model& gates, LogNotes& notes,
               const std::function<void(CalibratedLog&&)>& take);
/// Puts logs together in their order. Throws Failure 65 where only some have set-points.
void add_logs(Campaign& campaign, std::vector<CalibratedLog> logs, std::uint64_t seed);

/// What logs flown without a map say of height and ceiling, as read_campaign does; nothing from fewer than 10 windows.
std::optional<study::calibrate::HeightEffects> read_height_effects(const std::vector<std::string>& logs,
                                                                   const Model& gates, std::uint64_t seed);

}  // namespace backwash::services
