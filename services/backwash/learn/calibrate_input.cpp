// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwash/learn/calibrate_input.hpp"

#include <algorithm>
#include <cmath>

#include "services/backwash/files.hpp"
#include "services/backwash/learn/study_flights.hpp"
#include "services/backwash/verb.hpp"

namespace backwash::services {
namespace {

using namespace study::calibrate;

/// A floor at z = 0 with free space above, 0.04 m voxels.
map::OccupancyGrid flat_floor() {
  constexpr double kEdge = 0.04, kHalf = 2.4, kTop = 2.0;
  const int side = static_cast<int>(std::lround(2 * kHalf / kEdge)), top = static_cast<int>(std::lround(kTop / kEdge));
  map::OccupancyGrid grid({-kHalf, -kHalf, -kEdge}, kEdge, {side, side, top + 1}, map::Cell::free);
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) grid.set({i, j, 0}, map::Cell::occupied);
  return grid;
}

double value_of(const log::FlightLog& log, const std::string& column, double otherwise) {
  return log.has(column) && !log.column(column).empty() ? log.column(column).front() : otherwise;
}

study::WindowOptions mapless_windows(const Model& gates) {
  study::WindowOptions options;
  options.tau_w = gates.bound.tau_w;
  options.still_mps = 10;  // passes too
  return options;
}

std::size_t place_of(const CampaignFiles& files, const CampaignFiles::Log& log) {
  if (log.map) return *log.map;
  if (files.maps.size() > 1 || std::ranges::any_of(files.logs, [](auto& other) { return other.map.has_value(); }))
    throw Failure(kUsage, log.path + " follows no --map, as others do; give it after its own, with --log");
  return 0;
}

}  // namespace

void append(std::vector<CampaignFiles::Log>& logs, const std::vector<std::string>& given, const CampaignFiles& files) {
  const auto map = files.maps.empty() ? std::nullopt : std::optional(files.maps.size() - 1);
  for (const auto& log : given) logs.push_back({log, map});
}

void add_campaign_options(Command& command, CampaignFiles& files) {
  command
      .add_text(
          "--map", [&files](const std::string& map) { files.maps.push_back(map); },
          "OctoMap file or builtin:NAME of the logs that follow; without one, no surface but a flat floor")
      .trigger_on_parse();
  command
      .add_texts(
          "--log", [&files](const std::vector<std::string>& logs) { append(files.logs, logs, files); },
          "flight logs, one flight each: CSV, PX4 (.ulg), ArduPilot (.bin) or the daemon's (.mcap)")
      .trigger_on_parse();
}

void each_readable(const CampaignFiles& files, LogNotes& notes,
                   const std::function<void(const std::string& log, std::size_t place)>& read) {
  std::vector<std::string> paths;
  std::vector<bool> followed(files.maps.size());
  for (const auto& file : files.logs) {
    paths.push_back(file.path);
    if (file.map) followed[*file.map] = true;
  }
  if (const auto idle = std::find(followed.begin(), followed.end(), false);
      followed.size() > 1 && idle != followed.end())
    throw Failure(kUsage, "--map " + files.maps[static_cast<std::size_t>(idle - followed.begin())] +
                              " is followed by no --log; give it before those flown in it");
  std::size_t next = 0;
  each_readable(paths, notes, [&](const std::string& path) { read(path, place_of(files, files.logs[next++])); });
}

Campaign empty_campaign(const CampaignFiles& files) {
  Campaign campaign{};
  for (const auto& name : files.maps) {
    campaign.maps.push_back(read_map(name));
    campaign.map_names.push_back(name);
  }
  if (files.maps.empty()) campaign.maps.push_back(flat_floor());
  return campaign;
}

void read_logs(const CampaignFiles& files, const std::vector<map::OccupancyGrid>& maps,
               const std::optional<Vehicle>& vehicle, const Model& gates, LogNotes& notes,
               const std::function<void(CalibratedLog&&)>& take) {
  const bool mapless = files.maps.empty();
  study::WindowOptions options;
  options.tau_w = gates.bound.tau_w;
  if (mapless) options = mapless_windows(gates);
  log::KnownFlights known;
  each_readable(files, notes, [&](const std::string& path, std::size_t place) {
    const auto log = read_told(path, notes);
    if (const auto same = known.again(path, log::FlightMark(log)); !same.empty()) throw Failure(kBadData, same);
    auto flight = study::flight_windows(log, vehicle, options, path);
    if (!flight) throw Failure(kBadData, flight.error().message);
    if (!mapless)
      notes.place({path, files.maps[place], study::map_share(log, maps[place], vehicle.value_or(Vehicle{}))});
    CalibratedLog one{path, place, flight->signal, flight->gated, flight->not_tested, flight->windows.size(), {}, {}};
    if (mapless) {
      one.map.reset();
      one.heights = height_rows(*flight, log, 0);
      for (auto& w : flight->windows) w.p_W = {0, 0, std::max(0.02, w.p_W.z() - value_of(log, "surface_z_m", 0))};
    }
    one.hovers = hovers_of(*flight, 0, maps[place], gates);
    take(std::move(one));
  });
}

void add_logs(Campaign& campaign, std::vector<CalibratedLog> logs, std::uint64_t seed) {
  std::vector<HeightRow> rows;
  for (auto& log : logs) {
    const std::size_t number = campaign.data.place.size();
    const bool commanded = log.signal == study::Signal::commanded;
    if (log.signal != logs.front().signal)
      throw Failure(kBadData, log.path + ":1: has " + (commanded ? "" : "no ") +
                                  "set-points, unlike the logs before it; calibrate them apart");
    for (std::size_t g = 0; g < study::kHoverGates; ++g) campaign.gated[g] += log.gated[g];
    for (const auto& what : log.not_tested) {
      if (std::find(campaign.not_tested.begin(), campaign.not_tested.end(), what) == campaign.not_tested.end())
        campaign.not_tested.push_back(what);
    }
    for (auto& row : log.heights) {
      row.flight = number;
      rows.push_back(row);
    }
    for (auto& hover : log.hovers) {
      hover.flight = number;
      campaign.data.hovers.push_back(std::move(hover));
    }
    campaign.windows += log.windows;
    campaign.data.place.push_back(log.map.value_or(0));
    campaign.logs.push_back(log.path);
  }
  campaign.signal = study::to_string(logs.front().signal);
  campaign.pushes = logs.front().signal == study::Signal::commanded;
  if (const auto effects = height_effects(rows, seed)) campaign.height = effects->all;
}

std::optional<HeightEffects> read_height_effects(const std::vector<std::string>& logs, const Model& gates,
                                                 std::uint64_t seed) {
  std::vector<HeightRow> rows;
  for (std::size_t k = 0; k < logs.size(); ++k) {
    const auto log = read_flight(logs[k]);
    const auto flight = study::flight_windows(log, std::nullopt, mapless_windows(gates), logs[k]);
    if (!flight) continue;  // of a study's flights: too short, or without accelerations
    const auto more = height_rows(*flight, log, k);
    rows.insert(rows.end(), more.begin(), more.end());
  }
  return height_effects(rows, seed);
}

}  // namespace backwash::services
